/*
 * conicity_flat.c - delta_r of a wheelset that stays level, as EN 15302 takes it.
 *
 * Without roll each wheel is by itself: it touches its rail where the vertical distance of the two
 * curves is least. Rail positions, gauge and radii are those of the core's central contact.
 */
#include <stdlib.h>
#include <string.h>

#include "conicity_source.h"

#define STEP_M 1e-4    /* of the displacement */
#define SAMPLE_M 1e-4  /* of the search along the wheel */
#define JUMP_M 5e-4    /* the contact moves more than that from step to step: looked at closely */
#define SETTLED_M 1e-9 /* a jump is located to that */
#define GOLDEN 0.6180339887498949
#define NO_RAIL 1e9

struct side {
    struct kl_profile wheel;
    struct kl_profile rail;
    double offset_m; /* eta of the rail over eta of the wheel, when central */
    double radius_m; /* at eta = 0 */
    double *zeta_m;  /* of the wheel, every SAMPLE_M */
    size_t n;
};

struct level {
    const char *name;
    struct side side[KL_SIDES];
    void *memory;
};

struct touch {
    double eta_m[KL_SIDES]; /* on the wheels */
    double delta_r_m;
};

static double gap_at(const struct side *s, double w, double eta, double zeta_w) {
    double eta_r = eta + s->offset_m - w;
    bool over = eta_r >= s->rail.eta_min_m && eta_r <= s->rail.eta_max_m;
    return over ? kl_profile_at(&s->rail, eta_r).zeta_m - zeta_w : NO_RAIL;
}

static double gap_near(const struct side *s, double w, double eta) {
    return gap_at(s, w, eta, kl_profile_at(&s->wheel, eta).zeta_m);
}

/* The lowest point of the gap within one sample of `eta`, by golden section. */
static double lowest_near(const struct side *s, double w, double eta) {
    double low = eta - SAMPLE_M;
    double high = eta + SAMPLE_M;
    double a = high - GOLDEN * (high - low);
    double b = low + GOLDEN * (high - low);
    double gap_a = gap_near(s, w, a);
    double gap_b = gap_near(s, w, b);
    while (high - low > SETTLED_M) {
        if (gap_a < gap_b) {
            high = b;
            b = a;
            gap_b = gap_a;
            a = high - GOLDEN * (high - low);
            gap_a = gap_near(s, w, a);
        } else {
            low = a;
            a = b;
            gap_a = gap_b;
            b = low + GOLDEN * (high - low);
            gap_b = gap_near(s, w, b);
        }
    }
    return 0.5 * (low + high);
}

/* Where wheel and rail touch at w outboard; false: at an end of a profile. All valleys of the
 * samples that could be the lowest are followed down. */
static bool touch_side(const struct side *s, double w, double *eta) {
    const double close = 1e-6; /* more than a valley is deeper than its sample */
    double gap[3] = {NO_RAIL, NO_RAIL, NO_RAIL};
    double best = NO_RAIL;
    bool found = false;
    for (size_t i = 0; i < s->n; i++) {
        gap[0] = gap[1];
        gap[1] = gap[2];
        double at = s->wheel.eta_min_m + (double)i * SAMPLE_M;
        gap[2] = gap_at(s, w, at, s->zeta_m[i]);
        if (i < 2 || !(gap[1] <= gap[0] && gap[1] <= gap[2] && gap[1] < best + close)) {
            continue;
        }
        double lowest = lowest_near(s, w, at - SAMPLE_M);
        double depth = gap_near(s, w, lowest);
        if (depth < best) {
            best = depth;
            *eta = lowest;
            found = gap[0] < NO_RAIL && gap[2] < NO_RAIL;
        }
    }
    return found && best < NO_RAIL;
}

static int touch_at(const struct level *l, double u_y, struct touch *touch) {
    double radius[KL_SIDES];
    for (int k = 0; k < KL_SIDES; k++) {
        const struct side *s = &l->side[k];
        if (!touch_side(s, k == KL_RIGHT ? u_y : -u_y, &touch->eta_m[k])) {
            return cli_fail("pair %s: the contact runs off a profile's end at y = %g mm", l->name,
                            u_y * 1e3);
        }
        radius[k] = s->radius_m + kl_profile_at(&s->wheel, touch->eta_m[k]).zeta_m;
    }
    touch->delta_r_m = radius[KL_RIGHT] - radius[KL_LEFT];
    return CLI_OK;
}

static double moved(const struct touch *a, const struct touch *b) {
    return fmax(fabs(a->eta_m[0] - b->eta_m[0]), fabs(a->eta_m[1] - b->eta_m[1]));
}

/* Where the contact moves most between two displacements: halves them until it has settled, and keeps
 * what stands on both sides, at one place, if it is a jump. */
static int locate_jump(const struct level *l, double y0, struct touch t0, double y1,
                       struct touch t1, struct conicity_point *points, size_t *n) {
    while (y1 - y0 > SETTLED_M) {
        struct touch middle;
        double y = 0.5 * (y0 + y1);
        int status = touch_at(l, y, &middle);
        if (status != CLI_OK) {
            return status;
        }
        if (moved(&t0, &middle) > moved(&middle, &t1)) {
            y1 = y;
            t1 = middle;
        } else {
            y0 = y;
            t0 = middle;
        }
    }
    points[(*n)++] = (struct conicity_point){0.5 * (y0 + y1), t0.delta_r_m};
    if (moved(&t0, &t1) > 0.1 * JUMP_M) {
        points[(*n)++] = (struct conicity_point){0.5 * (y0 + y1), t1.delta_r_m};
    }
    return CLI_OK;
}

/* All displacements to +-range; room for three points a step. */
static int sample(const struct level *l, double range_m, struct conicity_point *points, size_t *n) {
    const int half = (int)floor(range_m / STEP_M * (1.0 + 1e-12));
    struct touch before = {.delta_r_m = 0.0};
    *n = 0;
    for (int i = -half; i <= half; i++) {
        struct touch now;
        double y = i * STEP_M;
        int status = touch_at(l, y, &now);
        if (status == CLI_OK && i > -half && moved(&before, &now) > JUMP_M) {
            status = locate_jump(l, y - STEP_M, before, y, now, points, n);
        }
        if (status != CLI_OK) {
            return status;
        }
        points[(*n)++] = (struct conicity_point){y, now.delta_r_m};
        before = now;
    }
    return CLI_OK;
}

static int prepare_side(struct level *l, const struct kl_pair_def *def, int k,
                        const struct kl_row *central, struct kl_arena *arena) {
    struct side *s = &l->side[k];
    enum kl_status status = kl_profile_build(&def->wheel[k].profile, 0.0, arena, &s->wheel, NULL);
    if (status == KL_OK) {
        status =
            kl_profile_build(&def->rail[k].profile, def->rail[k].cant_rad, arena, &s->rail, NULL);
    }
    if (status != KL_OK) {
        return cli_fail("pair %s: %s", l->name, kl_status_text(status));
    }
    s->radius_m = def->wheel[k].radius_m;
    s->offset_m = (double)central->eta_rail_m - (double)central->eta_wheel_m;
    s->n = (size_t)((s->wheel.eta_max_m - s->wheel.eta_min_m) / SAMPLE_M);
    s->zeta_m = malloc((s->n + 1) * sizeof *s->zeta_m);
    if (s->zeta_m == NULL) {
        return cli_fail("out of memory");
    }
    for (size_t i = 0; i < s->n; i++) {
        double eta = s->wheel.eta_min_m + (double)i * SAMPLE_M;
        s->zeta_m[i] = kl_profile_at(&s->wheel, eta).zeta_m;
    }
    return CLI_OK;
}

int conicity_source_level(struct conicity_source *source, const struct kl_pair_def *def,
                          const struct kl_posture *central, const char *name) {
    const size_t size = (size_t)4 << 20;
    struct level l = {.name = name, .memory = malloc(size)};
    struct kl_arena arena;
    size_t n = 0;
    struct conicity_point *points =
        malloc((size_t)(6.0 * (def->range_m / STEP_M + 2.0)) * sizeof *points);
    int status = l.memory != NULL && points != NULL ? CLI_OK : cli_fail("out of memory");
    if (l.memory != NULL) {
        kl_arena_init(&arena, l.memory, size);
    }
    for (int k = 0; k < KL_SIDES && status == CLI_OK; k++) {
        status = prepare_side(&l, def, k, &central->row[k], &arena);
    }
    status = status == CLI_OK ? sample(&l, def->range_m, points, &n) : status;
    status = status == CLI_OK ? conicity_source_points(source, points, n, name) : status;
    free(l.side[KL_RIGHT].zeta_m);
    free(l.side[KL_LEFT].zeta_m);
    free(l.memory);
    free(points);
    return status;
}
