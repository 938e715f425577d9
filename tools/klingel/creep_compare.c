/* creep_compare.c - creep laws against CONTACT. */
#include "creep_compare.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "kl_creep_lanes.h"

const char *const creep_law_name[KL_CREEP_LAWS] = {"linear",           "she",  "polach", "fastsim",
                                                   "fastsim_elliptic", "table"};

/* The contact in which all points are evaluated; only mu N G c^2 and a/b matter. */
#define C_M 5e-3
#define NORMAL_N 60e3
#define FRICTION 0.3
static const struct kl_material steel = {82e9, 0.28};

/* ---- files ---- */

/* A table of which each line is taken by `row`, which has room for one more; -1: it cannot. */
struct lines {
    const char *path;
    const char *header;
    int (*row)(void *rows, size_t n, const char *line); /* 1 taken, 0 left out */
    size_t row_bytes;
};

static int read_lines(const struct lines *how, void **rows, size_t *n) {
    char line[512];
    unsigned number = 0;
    bool seen_header = false;
    size_t room = 0;
    int status = CLI_OK;
    FILE *file = fopen(how->path, "r");
    *rows = NULL;
    *n = 0;
    if (file == NULL) {
        return cli_fail("%s: %s", how->path, strerror(errno));
    }
    while (status == CLI_OK && fgets(line, sizeof line, file) != NULL) {
        number++;
        line[strcspn(line, "\r\n")] = '\0';
        if (line[0] == '#' || line[0] == '\0') {
            continue;
        }
        if (!seen_header) {
            seen_header = strcmp(line, how->header) == 0;
            status = seen_header ? CLI_OK
                                 : cli_fail("%s:%u: the columns must be %s", how->path, number,
                                            how->header);
            continue;
        }
        if (*n == room) {
            room = room == 0 ? 1024 : 2 * room;
            void *more = realloc(*rows, room * how->row_bytes);
            if (more == NULL) {
                status = cli_fail("out of memory");
                break;
            }
            *rows = more;
        }
        const int taken = how->row(*rows, *n, line);
        if (taken < 0) {
            status = cli_fail("%s:%u: not a row of %s", how->path, number, how->header);
        } else {
            *n += (size_t)taken;
        }
    }
    fclose(file);
    if (status == CLI_OK && *n == 0) {
        status = cli_fail("%s: holds no points", how->path);
    }
    if (status != CLI_OK) {
        free(*rows);
        *rows = NULL;
        *n = 0;
    }
    return status;
}

static int point_row(void *rows, size_t n, const char *line) {
    double *v = ((double(*)[7])rows)[n];
    return sscanf(line, "%*[^,],%lf,%lf,%lf,%lf,%lf,%lf,%lf", &v[0], &v[1], &v[2], &v[3], &v[4],
                  &v[5], &v[6]) == 7
               ? 1
               : -1;
}

int creep_points_read(struct creep_points *points, const char *path) {
    const struct lines how = {path, "set,a_over_b,X,Y,Z,fx,fy,mz", point_row,
                              sizeof *points->value};
    void *rows = NULL;
    const int status = read_lines(&how, &rows, &points->n);
    points->value = rows;
    return status;
}

void creep_points_free(struct creep_points *points) {
    free(points->value);
    memset(points, 0, sizeof *points);
}

static int solution_row(void *rows, size_t n, const char *line) {
    struct creep_solution *s = &((struct creep_solution *)rows)[n];
    if (strncmp(line, "CONTACT", 7) != 0) {
        return 0;
    }
    if (sscanf(line, "%*[^,],%*f,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf", &s->a_m, &s->b_m,
               &s->normal_N, &s->friction, &s->creepage[0], &s->creepage[1], &s->creepage[2],
               &s->fx, &s->fy) != 9) {
        return -1;
    }
    s->a_m *= 1e-3;
    s->b_m *= 1e-3;
    return 1;
}

int creep_solutions_read(struct creep_solutions *solutions, const char *path) {
    const struct lines how = {path,
                              "method,a_over_b,a_mm,b_mm,normal_N,friction,xi,eta,phi_1_m,fx,fy,mz",
                              solution_row, sizeof *solutions->value};
    void *rows = NULL;
    const int status = read_lines(&how, &rows, &solutions->n);
    solutions->value = rows;
    return status;
}

void creep_solutions_free(struct creep_solutions *solutions) {
    free(solutions->value);
    memset(solutions, 0, sizeof *solutions);
}

/* ---- differences ---- */

/* One point as a contact. */
static struct kl_creep_contact contact_at(enum kl_creep_law law, const struct kl_creep_table *table,
                                          const double *v) {
    struct kl_creep_contact c;
    const double third = cbrt(NORMAL_N);
    const struct kl_ellipse at_1 = {C_M * sqrt(v[0]) / third, C_M / sqrt(v[0]) / third};
    const double by = FRICTION * NORMAL_N / (steel.shear_modulus_Pa * C_M * C_M);
    memset(&c, 0, sizeof c);
    (void)kl_creep_row_build(law, table, &at_1, &steel, &c.row);
    c.friction = kl_friction_constant((kl_real)FRICTION);
    c.normal_N = (kl_real)NORMAL_N;
    c.creepage.gamma1 = (kl_real)(by * v[1]);
    c.creepage.gamma2 = (kl_real)(by * v[2]);
    c.creepage.omega3_1_m = (kl_real)(by / C_M * v[3]);
    return c;
}

struct creep_difference creep_difference(enum kl_creep_law law, const struct kl_creep_table *table,
                                         const struct creep_points *points, double spin_most) {
    struct creep_difference d = {0.0, 0.0, 0.0, 0.0, 0};
    const double limit = FRICTION * NORMAL_N;
    for (size_t i = 0; i < points->n; i++) {
        const double *v = points->value[i];
        const struct kl_creep_contact c = contact_at(law, table, v);
        const struct kl_kalker k = kl_kalker_coefficients(v[0], steel.poisson);
        if (fabs(k.c23 * v[3]) > spin_most) {
            continue;
        }
        const struct kl_creep_force f = kl_creep_force(law, table, &c);
        const double force = hypot((double)f.t1_N / limit - v[4], (double)f.t2_N / limit - v[5]);
        const double moment = fabs((double)f.m3_Nm / (limit * C_M) - v[6]);
        d.force_mean += force;
        d.moment_mean += moment;
        d.force_max = fmax(d.force_max, force);
        d.moment_max = fmax(d.moment_max, moment);
        d.n++;
    }
    d.force_mean /= d.n > 0 ? (double)d.n : 1.0;
    d.moment_mean /= d.n > 0 ? (double)d.n : 1.0;
    return d;
}

/* ---- time ---- */

#define CASES 64

/* Pairs of contacts that follow each other as those of a vehicle do: both wheels at about the same
 * place. */
static void cases(enum kl_creep_law law, const struct kl_creep_table *table,
                  const struct creep_points *points, struct kl_creep_lanes *in) {
    for (size_t i = 0; i < CASES; i++) {
        struct kl_creep_contact c[KL_SIDES];
        static const double still[7] = {1.3, 0.2, 0.05, 0.1, 0.0, 0.0, 0.0};
        for (size_t s = 0; s < KL_SIDES; s++) {
            c[s] = contact_at(law, table,
                              points != NULL ? points->value[(2 * i + s) % points->n] : still);
        }
        for (int q = 0; q < KL_CREEP_SHAPES; q++) {
            in[i].shape[q] = kl_lane_of(c[0].row.shape[q], c[1].row.shape[q], 0);
        }
        const kl_real y = kl_inverse_cbrt((kl_real)NORMAL_N);
        kl_lane_normalise(kl_lane_of(c[0].row.f11_1 * c[0].creepage.gamma1,
                                     c[1].row.f11_1 * c[1].creepage.gamma1, 0),
                          kl_lane_of(c[0].row.f22_1 * c[0].creepage.gamma2,
                                     c[1].row.f22_1 * c[1].creepage.gamma2, 0),
                          kl_lane_of(c[0].row.f23_1 * c[0].creepage.omega3_1_m,
                                     c[1].row.f23_1 * c[1].creepage.omega3_1_m, 0),
                          kl_lane_all((kl_real)(1.0 / FRICTION)), kl_lane_all(y), &in[i]);
        in[i].k_a = in[i].k_s = kl_lane_all((kl_real)1);
    }
}

static double run(enum kl_creep_law law, const struct kl_creep_table *table,
                  const struct kl_creep_lanes *in, uint64_t passes) {
    kl_lane sum = kl_lane_all((kl_real)0);
    for (uint64_t i = 0; i < passes; i++) {
        struct kl_creep_lanes_force out;
        kl_lane_creep(law, table, &in[i % CASES], &out);
        sum = sum + ((out.t1 + out.t2) + (out.m3 + out.reduction));
    }
    return (double)kl_lane_first(sum);
}

double creep_time(enum kl_creep_law law, const struct kl_creep_table *table,
                  const struct creep_points *points) {
    struct kl_creep_lanes in[CASES];
    const uint64_t passes =
        law == KL_CREEP_FASTSIM || law == KL_CREEP_FASTSIM_ELLIPTIC ? 640 : 20480;
    double least = 1e9;
    volatile double keep = 0.0;
    cases(law, table, points, in);
    for (int round = 0; round < 15; round++) {
        const double before = cli_seconds();
        keep = keep + run(law, table, in, passes);
        const double ns = 1e9 * (cli_seconds() - before) / (double)(passes * KL_LANES);
        least = ns < least ? ns : least;
    }
    return least;
}

double creep_repeat(enum kl_creep_law law, const struct kl_creep_table *table, uint64_t n) {
    struct kl_creep_lanes in[CASES];
    cases(law, table, NULL, in);
    return run(law, table, in, n / KL_LANES);
}
