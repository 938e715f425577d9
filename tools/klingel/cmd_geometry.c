/* cmd_geometry.c - klingel geometry: the contact tables of a wheel-rail pair. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli.h"
#include "cli_plot.h"
#include "geometry_plot.h"

#define MM 1e3
#define TIMED_BUILDS 5

struct arguments {
    const char *pair;
    double every_m;
    double wheel_load_N; /* 0: rigid */
    struct cli_list solve;
    double solve_m[CLI_MAX_LIST];
    const char *csv;
    const char *plot;
    struct cli_target target;
};

/* A pair made afresh outside the model: its definition and memory. */
struct work {
    struct model_file *file;
    const struct kl_pair_def *def;
    const char *name;
    void *memory;
    size_t size;
    struct kl_pair pair;
    double build_ms; /* median */
};

/* ---- CSV ---- */

static const char *const side_name[KL_SIDES] = {"right", "left"};

static void csv_header(FILE *file, bool loaded) {
    static const char *const column[][2] = {
        {"eta_wheel", "m"},    {"eta_rail", "m"},    {"delta_wheel", "rad"}, {"delta_rail", "rad"},
        {"arm", "m"},          {"radius", "m"},      {"curv_wheel", "1_m"},  {"curv_rail", "1_m"},
        {"semi_a_at_1N", "m"}, {"semi_b_at_1N", "m"}};
    fprintf(file, "u_y_m,phi_rad,u_z_m,phi_y_rad_m,z_y");
    for (int s = 0; s < KL_SIDES; s++) {
        for (size_t i = 0; i < sizeof column / sizeof column[0]; i++) {
            fprintf(file, ",%s_%s_%s", column[i][0], side_name[s], column[i][1]);
        }
    }
    fprintf(file, "%s\n", loaded ? ",approach_right_m,approach_left_m" : "");
}

static void csv_posture(FILE *file, const struct kl_posture *p, bool loaded) {
    double values[5 + 11 * KL_SIDES] = {p->u_y_m, p->phi_rad, p->u_z_m, p->phi_y_rad_m, p->z_y};
    for (int s = 0; s < KL_SIDES; s++) {
        const struct kl_row *row = &p->row[s];
        const kl_real side[10] = {row->eta_wheel_m,    row->eta_rail_m,    row->delta_wheel_rad,
                                  row->delta_rail_rad, row->arm_m,         row->radius_m,
                                  row->curv_wheel_1_m, row->curv_rail_1_m, row->semi_a_1,
                                  row->semi_b_1};
        for (int i = 0; i < 10; i++) {
            values[5 + 10 * s + i] = (double)side[i];
        }
        values[5 + 10 * KL_SIDES + s] = p->approach_m[s];
    }
    cli_csv_row(file, values, 5 + (loaded ? 11 : 10) * KL_SIDES);
}

/* ---- text ---- */

static void print_head(void) {
    printf("%7s %9s %9s %9s %9s |%s|%s\n", "u_y", "phi", "u_z", "phi_y", "z_y",
           "          right: eta_w    eta_r   delta        r ",
           "           left: eta_w    eta_r   delta        r");
    printf("%7s %9s %9s %9s %9s |%23s %8s %7s %8s |%23s %8s %7s %8s\n", "mm", "mrad", "mm", "rad/m",
           "-", "mm", "mm", "deg", "mm", "mm", "mm", "deg", "mm");
}

static void print_posture(const struct kl_posture *p) {
    printf("%7.2f %9.4f %9.5f %9.5f %9.5f |", p->u_y_m * MM, p->phi_rad * 1e3, p->u_z_m * MM,
           p->phi_y_rad_m, p->z_y);
    for (int s = 0; s < KL_SIDES; s++) {
        const struct kl_row *row = &p->row[s];
        printf("%23.4f %8.4f %7.4f %8.4f %s", (double)row->eta_wheel_m * MM,
               (double)row->eta_rail_m * MM, (double)row->delta_rail_rad / cli_unit("deg"),
               (double)row->radius_m * MM, s == KL_RIGHT ? "|" : "\n");
    }
}

static void print_patch(const struct kl_posture *p, int s, double wheel_load_N) {
    const struct kl_row *row = &p->row[s];
    const double normal_N = wheel_load_N / (double)row->cos_delta;
    printf("         N %.6g N   approach %.5f um   ellipse %.4f x %.4f mm\n", normal_N,
           p->approach_m[s] * 1e6, (double)row->semi_a_1 * MM * cbrt(normal_N),
           (double)row->semi_b_1 * MM * cbrt(normal_N));
}

static void print_solution(const struct kl_posture *p, double wheel_load_N) {
    printf("\nfull solution at u_y = %g mm", p->u_y_m * MM);
    if (wheel_load_N > 0.0) {
        printf(", %g N on each wheel", wheel_load_N);
    }
    printf("\n");
    printf("  phi %.9e rad   u_z %.9e m   phi_y %.9g rad/m   z_y %.9g\n", p->phi_rad, p->u_z_m,
           p->phi_y_rad_m, p->z_y);
    for (int s = 0; s < KL_SIDES; s++) {
        const struct kl_row *row = &p->row[s];
        printf("  %-5s  delta_w %.10f  delta_r %.10f rad   eta_w %.7f  eta_r %.7f mm\n"
               "         r %.7f mm   curvature: wheel %.6g, rail %.6g 1/m   "
               "ellipse at 100 kN: %.3f x %.3f mm\n",
               side_name[s], (double)row->delta_wheel_rad, (double)row->delta_rail_rad,
               (double)row->eta_wheel_m * MM, (double)row->eta_rail_m * MM,
               (double)row->radius_m * MM, (double)row->curv_wheel_1_m, (double)row->curv_rail_1_m,
               (double)row->semi_a_1 * MM * cbrt(1e5), (double)row->semi_b_1 * MM * cbrt(1e5));
        if (wheel_load_N > 0.0) {
            print_patch(p, s, wheel_load_N);
        }
    }
}

static void print_linear(const struct kl_linear_geometry *g) {
    printf("\nlinear parameters, by small differences about the centre\n"
           "  r0         %12.7g m      rolling radius\n"
           "  l          %12.7g m      half the distance of the contact points\n"
           "  delta0     %12.7g rad    contact angle\n"
           "  lambda0    %12.7g        conicity\n"
           "  epsilon0   %12.7g        change of the rail's contact angle\n"
           "  epsilon0*  %12.7g        change of the wheel's contact angle\n"
           "  sigma      %12.7g        roll parameter\n",
           g->radius_m, g->half_base_m, g->delta0_rad, g->conicity, g->epsilon_rail,
           g->epsilon_wheel, g->sigma);
}

static void print_jumps(const struct kl_pair *pair) {
    printf("\njumps of the contact point\n");
    for (int s = 0; s < KL_SIDES; s++) {
        const struct kl_side_table *table = &pair->side[s];
        for (uint32_t i = 0; i < table->n_jumps && i < KL_MAX_JUMPS; i++) {
            const struct kl_jump *jump = &table->jumps[i];
            printf("  %-5s at u_y %9.4f mm: eta_w %9.4f -> %9.4f mm\n", side_name[s],
                   (s == KL_RIGHT ? jump->w_m : -jump->w_m) * MM, jump->eta_before_m * MM,
                   jump->eta_after_m * MM);
        }
        if (table->n_jumps > KL_MAX_JUMPS) {
            printf("  %-5s and %u more\n", side_name[s], table->n_jumps - KL_MAX_JUMPS);
        }
    }
    if (pair->side[KL_RIGHT].n_jumps + pair->side[KL_LEFT].n_jumps == 0) {
        printf("  none\n");
    }
}

/* ---- the pair ---- */

static int by_value(const void *a, const void *b) {
    double x = *(const double *)a;
    double y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Builds the pair several times: for the time it takes, and with memory that is enough. */
static int build(struct work *w) {
    double ms[TIMED_BUILDS];
    struct kl_diag diag = {KL_OK, NULL, -1, 0.0};
    w->size = (size_t)1 << 20;
    for (int i = 0; i < TIMED_BUILDS; i++) {
        enum kl_status status = KL_ERR_MEMORY;
        while (status == KL_ERR_MEMORY) {
            struct kl_arena arena;
            free(w->memory);
            w->memory = malloc(w->size);
            if (w->memory == NULL) {
                return cli_fail("out of memory (%zu bytes for a table)", w->size);
            }
            kl_arena_init(&arena, w->memory, w->size);
            double before = cli_seconds();
            status = kl_pair_build(w->def, &arena, &w->pair, &diag);
            ms[i] = 1e3 * (cli_seconds() - before);
            w->size *= status == KL_ERR_MEMORY ? 2 : 1;
        }
        if (status != KL_OK) {
            struct kl_model model;
            bool said = model_file_build(w->file, &model, stderr) != 0; /* knows the line */
            return said ? CLI_FAILED
                        : cli_fail("pair %s: %s: %s (%g)", w->name, kl_status_text(status),
                                   diag.what != NULL ? diag.what : "", diag.value);
        }
    }
    qsort(ms, TIMED_BUILDS, sizeof ms[0], by_value);
    w->build_ms = ms[TIMED_BUILDS / 2];
    return CLI_OK;
}

/* The pairs to be shown: all of them, or the one that was named. */
static int choose(const struct cli_model *m, const char *name, uint32_t *first, uint32_t *last) {
    const char *names[KL_MAX_PAIRS];
    uint32_t n = m->file.vehicle.n_pairs;
    *first = 0;
    *last = n - 1;
    for (uint32_t i = 0; i < n; i++) {
        names[i] = model_file_pair_name(&m->file, i);
        if (name != NULL && strcmp(names[i], name) == 0) {
            *first = *last = i;
            return CLI_OK;
        }
    }
    if (name == NULL) {
        return CLI_OK;
    }
    const char *near = cli_nearest(name, names, n);
    return cli_misuse("--pair %s: the model has no such pair; %s %s", name,
                      near != NULL ? "did you mean" : "its first is",
                      near != NULL ? near : names[0]);
}

/* An arena as large as the pair's own, in memory to be freed. NULL: printed. */
static void *scratch(const struct work *w, struct kl_arena *arena) {
    void *memory = malloc(w->size);
    if (memory == NULL) {
        (void)cli_fail("out of memory");
    } else {
        kl_arena_init(arena, memory, w->size);
    }
    return memory;
}

/* The full solution at one place. `*shared` (NULL: that is an error): two contacts of a wheel share
 * the load, and there is none. */
static int solve_at(const struct work *w, const struct kl_loaded_place *at,
                    struct kl_posture *posture, bool *shared) {
    struct kl_diag diag = {KL_OK, NULL, -1, 0.0};
    struct kl_arena arena;
    void *memory = scratch(w, &arena);
    if (memory == NULL) {
        return CLI_FAILED;
    }
    enum kl_status status = kl_pair_solve_loaded(w->def, &arena, at, posture, &diag);
    free(memory);
    if (shared != NULL) {
        *shared = status == KL_ERR_CONVERGE && at->wheel_load_N > 0.0;
        status = *shared ? KL_OK : status;
    }
    return status == KL_OK ? CLI_OK
                           : cli_fail("pair %s at u_y = %g mm: %s: %s", w->name, at->u_y_m * MM,
                                      kl_status_text(status), diag.what);
}

static int linear_of(const struct work *w, struct kl_linear_geometry *linear) {
    struct kl_diag diag = {KL_OK, NULL, -1, 0.0};
    struct kl_arena arena;
    void *memory = scratch(w, &arena);
    if (memory == NULL) {
        return CLI_FAILED;
    }
    enum kl_status status = kl_pair_linear(w->def, &arena, linear, &diag);
    free(memory);
    return status == KL_OK ? CLI_OK
                           : cli_fail("pair %s: linear parameters: %s: %s", w->name,
                                      kl_status_text(status), diag.what);
}

/* One row of the table, as the step reads it, or under load, afresh. */
static int row_at(const struct work *w, const struct kl_loaded_place *at,
                  struct kl_posture *posture, bool *shared) {
    *shared = false;
    if (at->wheel_load_N > 0.0) {
        return solve_at(w, at, posture, shared);
    }
    return kl_pair_posture(&w->pair, at->u_y_m, posture) == KL_OK
               ? CLI_OK
               : cli_fail("pair %s: no row at u_y = %g mm", w->name, at->u_y_m * MM);
}

/* Rows at every `step` from -range to range. */
static int each_row(const struct work *w, double step_m, double wheel_load_N, FILE *csv) {
    const double range = (double)w->pair.range_m;
    int half = (int)floor(range / step_m * (1.0 + 1e-12));
    for (int i = -half; i <= half; i++) {
        const struct kl_loaded_place at = {fmin(fmax(i * step_m, -range), range), wheel_load_N};
        struct kl_posture posture;
        bool shared = false;
        int status = row_at(w, &at, &posture, &shared);
        if (status != CLI_OK) {
            return status;
        }
        if (shared) {
            if (csv == NULL) {
                printf("%7.2f   two contacts of a wheel share the load\n", at.u_y_m * MM);
            }
        } else if (csv != NULL) {
            csv_posture(csv, &posture, wheel_load_N > 0.0);
        } else {
            print_posture(&posture);
        }
    }
    return CLI_OK;
}

static int parse_solve(struct arguments *a) {
    char why[160];
    for (size_t i = 0; i < a->solve.n; i++) {
        if (!cli_quantity(a->solve.item[i], "mm", &a->solve_m[i], why, sizeof why)) {
            return cli_misuse("--solve %s: %s", a->solve.item[i], why);
        }
    }
    return CLI_OK;
}

static int check_solve(const struct work *w, const struct arguments *a) {
    double range = (double)w->pair.range_m;
    for (size_t i = 0; i < a->solve.n; i++) {
        if (!(fabs(a->solve_m[i]) <= range * (1.0 + 1e-12))) {
            return cli_misuse("--solve %s: must be within the table of pair %s, %g..%g mm",
                              a->solve.item[i], w->name, -range * MM, range * MM);
        }
    }
    return CLI_OK;
}

static int show_solutions(const struct work *w, const struct arguments *a, FILE *csv) {
    for (size_t i = 0; i < a->solve.n; i++) {
        const struct kl_loaded_place at = {a->solve_m[i], a->wheel_load_N};
        struct kl_posture posture;
        int status = solve_at(w, &at, &posture, NULL);
        if (status != CLI_OK) {
            return status;
        }
        if (csv != NULL) {
            csv_posture(csv, &posture, a->wheel_load_N > 0.0);
        } else {
            print_solution(&posture, a->wheel_load_N);
        }
    }
    return CLI_OK;
}

static int show_text(const struct work *w, const struct arguments *a) {
    struct kl_linear_geometry linear;
    int status = linear_of(w, &linear);
    if (status != CLI_OK) {
        return status;
    }
    printf("pair %s: |u_y| <= %g mm by %g mm, table built in %.2f ms\n\n", w->name,
           (double)w->pair.range_m * MM, (double)w->pair.step_m * MM, w->build_ms);
    if (a->wheel_load_N > 0.0) {
        printf("with %g N on each wheel; the linear parameters and the jumps are the rigid ones\n",
               a->wheel_load_N);
    }
    print_head();
    status = each_row(w, a->every_m, a->wheel_load_N, NULL);
    if (status != CLI_OK) {
        return status;
    }
    print_linear(&linear);
    print_jumps(&w->pair);
    return show_solutions(w, a, NULL);
}

static int show_csv(const struct work *w, const struct arguments *a, FILE *csv) {
    csv_header(csv, a->wheel_load_N > 0.0);
    if (a->solve.n > 0) {
        return show_solutions(w, a, csv);
    }
    return each_row(w, (double)w->pair.step_m, a->wheel_load_N, csv);
}

static int show_picture(const struct work *w, const struct arguments *a) {
    char title[400];
    snprintf(title, sizeof title, "Contact geometry of %s, %s", w->name, a->target.vehicle);
    const struct geometry_picture picture = {
        .title = title, .def = w->def, .pair = &w->pair, .every_m = a->every_m};
    return geometry_plot(&picture, a->plot);
}

static int show(struct cli_model *m, const struct arguments *a) {
    struct cli_output csv = {0};
    uint32_t first = 0;
    uint32_t last = 0;
    int status = choose(m, a->pair, &first, &last);
    if (status == CLI_OK && (a->csv != NULL || a->plot != NULL) && first != last) {
        status = cli_misuse("%s holds one pair: choose it by --pair, for example --pair %s",
                            a->csv != NULL ? "--csv" : "--plot", model_file_pair_name(&m->file, 0));
    }
    if (status == CLI_OK && a->plot != NULL && a->wheel_load_N > 0.0) {
        status = cli_misuse("--plot shows rigid contacts; --wheel-load goes with text and --csv");
    }
    if (status == CLI_OK && cli_is_stdout(a->csv) && cli_is_stdout(a->plot)) {
        status = cli_misuse("only one of --csv and --plot can be standard output");
    }
    if (status == CLI_OK && a->csv != NULL) {
        status = cli_output_open(&csv, a->csv);
    }
    for (uint32_t i = first; i <= last && status == CLI_OK; i++) {
        /* of whole wheels, also where the model's tables hold treads and flanges apart */
        struct kl_pair_def def = m->file.vehicle.pairs[i];
        def.contacts = KL_CONTACTS_RIGID;
        struct work w = {.file = &m->file, .def = &def, .name = model_file_pair_name(&m->file, i)};
        status = build(&w);
        status = status == CLI_OK ? check_solve(&w, a) : status;
        if (status == CLI_OK && !cli_is_stdout(a->csv) && !cli_is_stdout(a->plot)) {
            printf("%s", i > first ? "\n" : "");
            status = show_text(&w, a);
        }
        if (status == CLI_OK && a->csv != NULL) {
            status = show_csv(&w, a, csv.file);
        }
        if (i == last) {
            status = cli_output_close(&csv, status);
        }
        if (status == CLI_OK && a->plot != NULL) {
            status = show_picture(&w, a);
        }
        free(w.memory);
    }
    return cli_output_close(&csv, status);
}

int cmd_geometry(int argc, char **argv) {
    struct arguments a = {.every_m = 1e-3};
    int status = CLI_OK;
    const struct cli_option options[] = {
        {.name = "--pair",
         .argument = "NAME",
         .kind = CLI_TEXT,
         .value = &a.pair,
         .help = "one wheel-rail pair of the model; default all"},
        {.name = "--every",
         .argument = "MM",
         .kind = CLI_NUMBER,
         .value = &a.every_m,
         .unit = "mm",
         .low = 1e-5,
         .high = 0.1,
         .help = "distance of the lines printed, mm; default 1"},
        {.name = "--solve",
         .argument = "MM",
         .kind = CLI_LIST,
         .value = &a.solve,
         .help = "solve the geometry at this u_y, mm, to full accuracy instead of\n"
                 "reading the table; as often as wanted. With --csv only these"},
        {.name = "--wheel-load",
         .argument = "N",
         .kind = CLI_NUMBER,
         .value = &a.wheel_load_N,
         .unit = "N",
         .low = 0.0,
         .high = 1e6,
         .help = "vertical force under each wheel, N: every line solved afresh with\n"
                 "Hertz's approach of wheel and rail (columns approach_... in --csv), arm\n"
                 "and radius in the middle of the patch; default 0, rigid"},
        cli_maybe_file_option("--csv", &a.csv,
                              "the whole table as CSV in SI units; without FILE, or with -, to\n"
                              "standard output in place of the text"),
        cli_plot_option(&a.plot, "profiles with contact lines every --every mm, rolling radii,\n"
                                 "contact angles, roll and jumps as a picture: .png, .pdf, .svg"),
    };
    const struct cli_command command = {
        .purpose =
            "Wheel-rail geometry against the lateral displacement u_y of the wheelset: roll phi,\n"
            "vertical displacement u_z and their slopes; per side contact points on wheel and\n"
            "rail (eta, inboard positive), contact angle delta, rolling radius r, curvatures; the\n"
            "linear parameters; the jumps of the contact; the time the table takes to build.",
        .example = "klingel geometry models/two_axle_wagon.yaml --every 0.5 --csv table.csv\n"
                   "klingel geometry models/two_axle_wagon.yaml --plot geometry.png\n",
        .options = options,
        .n_options = sizeof options / sizeof options[0]};
    if (!cli_parse(&command, argc, argv, &a.target, &status)) {
        return status;
    }
    struct cli_model m;
    status = parse_solve(&a);
    if (status != CLI_OK) {
        return status;
    }
    status = cli_model_load(&m, &a.target);
    if (status == CLI_OK) {
        status = show(&m, &a);
        cli_model_close(&m);
    }
    return cli_flush(status);
}
