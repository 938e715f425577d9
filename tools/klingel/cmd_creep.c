/* cmd_creep.c - klingel creep: creep forces against creepage, the laws against CONTACT, the table
 * as C source. */
#include <ctype.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "bench_count.h"
#include "cli_plot.h"
#include "creep_compare.h"
#include "creep_file.h"
#include "kl_geometry.h"

#define LAWS "all|linear|she|polach|fastsim|fastsim_elliptic|table"
#define MAX_ROWS 401

enum swept { GAMMA1, GAMMA2, OMEGA3 };

struct arguments {
    bool compact;
    int law; /* 0: all */
    double a_m;
    double b_m;
    double load_N;
    double creepage[3];
    int sweep;
    double to;
    uint64_t rows;
    double mu;
    double ratio;
    double decay;
    double k_a;
    double k_s;
    double speed;
    const char *csv;
    const char *plot;
    const char *points;
    const char *check;
    bool instructions;
    const char *count_only;
    const char *source;
    const char *name;
    struct cli_target target;
    const char *path; /* of the table */
    struct creep_file file;
};

static bool is_wanted(const struct arguments *a, int law) {
    return a->law == 0 || a->law == law + 1;
}

/* ---- force against creepage ---- */

static const char *const swept_name[3] = {"gamma1", "gamma2", "omega3_1_m"};

static int contact(const struct arguments *a, enum kl_creep_law law, struct kl_creep_contact *c) {
    const struct kl_material steel = {82e9, 0.28};
    const double third = cbrt(a->load_N);
    const struct kl_ellipse at_1 = {a->a_m / third, a->b_m / third};
    struct kl_diag diag = {KL_OK, NULL, -1, 0.0};
    memset(c, 0, sizeof *c);
    const double ratio = a->a_m / a->b_m;
    if (!(ratio >= 0.0999 && ratio <= 10.001)) {
        return cli_misuse("--a and --b: their ratio must be 0.1 to 10, it is %g", ratio);
    }
    c->friction = (struct kl_friction){(kl_real)a->mu, (kl_real)a->ratio, (kl_real)a->decay,
                                       (kl_real)a->k_a, (kl_real)a->k_s};
    if (kl_friction_check(&c->friction, &diag) != KL_OK) {
        return cli_misuse("%s (%g)", diag.what, diag.value);
    }
    c->normal_N = (kl_real)a->load_N;
    c->speed_m_s = (kl_real)a->speed;
    return kl_creep_row_build(law, &a->file.table, &at_1, &steel, &c->row) == KL_OK
               ? CLI_OK
               : cli_fail("no row");
}

static struct kl_creep_force force_at(const struct arguments *a, enum kl_creep_law law,
                                      struct kl_creep_contact *c, double at) {
    double v[3] = {a->creepage[0], a->creepage[1], a->creepage[2]};
    v[a->sweep] = at;
    c->creepage = (struct kl_creepage){(kl_real)v[0], (kl_real)v[1], (kl_real)v[2]};
    return kl_creep_force(law, &a->file.table, c);
}

static void print_row(const struct arguments *a, FILE *csv, const char *law, double at,
                      const struct kl_creep_force *f) {
    if (csv != NULL) {
        fprintf(csv, "%s,%.9g,%.9g,%.9g,%.9g,%.9g\n", law, at, (double)f->t1_N, (double)f->t2_N,
                (double)f->m3_Nm, (double)f->reduction);
    } else {
        printf("%-17s %11.6g %10.3f %10.3f %10.3f %9.4f\n", law, a->sweep == OMEGA3 ? at : 1e3 * at,
               1e-3 * (double)f->t1_N, 1e-3 * (double)f->t2_N, (double)f->m3_Nm,
               (double)f->reduction);
    }
}

static int curves(const struct arguments *a) {
    struct cli_output csv = {0};
    int status = a->csv != NULL ? cli_output_open(&csv, a->csv) : CLI_OK;
    if (status != CLI_OK) {
        return status;
    }
    const bool to_text = csv.file == NULL;
    if (to_text) {
        printf("ellipse %.4g x %.4g mm at %.4g kN, mu %.4g\n\n%-17s %11s %10s %10s %10s %9s\n",
               1e3 * a->a_m, 1e3 * a->b_m, 1e-3 * a->load_N, a->mu, "law",
               a->sweep == OMEGA3   ? "omega3 1/m"
               : a->sweep == GAMMA1 ? "gamma1 1e-3"
                                    : "gamma2 1e-3",
               "T1 kN", "T2 kN", "M3 Nm", "reduction");
    } else {
        fprintf(csv.file, "law,%s,t1_N,t2_N,m3_Nm,reduction\n", swept_name[a->sweep]);
    }
    for (int law = 0; law < KL_CREEP_LAWS && status == CLI_OK; law++) {
        struct kl_creep_contact c;
        if (!is_wanted(a, law)) {
            continue;
        }
        status = contact(a, (enum kl_creep_law)law, &c);
        for (uint64_t i = 0; i < a->rows && status == CLI_OK; i++) {
            const double at = a->to * (double)i / (double)(a->rows - 1);
            const struct kl_creep_force f = force_at(a, (enum kl_creep_law)law, &c, at);
            print_row(a, csv.file, creep_law_name[law], at, &f);
        }
    }
    return csv.file != NULL ? cli_output_close(&csv, status) : status;
}

/* ---- the picture ---- */

#define SPINS 4
#define MAX_POINTS 64

/* What is drawn: the force along the creepage that grows, over mu N. */
static double part_of(const struct arguments *a, const struct kl_creep_force *f) {
    return (double)(a->sweep == GAMMA1 ? f->t1_N : f->t2_N) / (a->mu * a->load_N);
}

static void draw_law(struct cli_plot *plot, const struct arguments *a, int law,
                     const struct cli_plot_style *style) {
    double x[MAX_ROWS];
    double y[MAX_ROWS];
    struct kl_creep_contact c;
    if (contact(a, (enum kl_creep_law)law, &c) != CLI_OK) {
        return;
    }
    for (int i = 0; i < MAX_ROWS; i++) {
        const double at = a->to * (double)i / (MAX_ROWS - 1);
        const struct kl_creep_force f = force_at(a, (enum kl_creep_law)law, &c, at);
        x[i] = 1e3 * at;
        y[i] = part_of(a, &f);
        if (law == KL_CREEP_LINEAR && fabs(y[i]) > 1.05) {
            x[i] = y[i] = (double)NAN;
        }
    }
    cli_plot_line(plot, style, x, y, MAX_ROWS);
}

/* The solutions for this very contact: the same ellipse, load and friction, the other creepages too. */
static void draw_solutions(struct cli_plot *plot, const struct arguments *a,
                           const struct creep_solutions *solutions, const char *label) {
    const struct cli_plot_style style = {
        .label = label, .colour = CLI_PLOT_INK, .pen = CLI_PLOT_POINTS};
    double x[MAX_POINTS];
    double y[MAX_POINTS];
    size_t n = 0;
    for (size_t i = 0; i < solutions->n && n < MAX_POINTS; i++) {
        const struct creep_solution *s = &solutions->value[i];
        bool same = fabs(s->a_m - a->a_m) < 1e-6 && fabs(s->b_m - a->b_m) < 1e-6 &&
                    fabs(s->normal_N - a->load_N) < 1.0 && fabs(s->friction - a->mu) < 1e-6;
        for (int k = 0; k < 3; k++) {
            same = same && (k == a->sweep || fabs(s->creepage[k] - a->creepage[k]) < 1e-6);
        }
        if (same && s->creepage[a->sweep] >= 0.0 && s->creepage[a->sweep] <= a->to) {
            x[n] = 1e3 * s->creepage[a->sweep];
            y[n++] = a->sweep == GAMMA1 ? s->fx : s->fy;
        }
    }
    if (n > 0) {
        cli_plot_line(plot, &style, x, y, n);
    }
}

static void draw_panel(struct cli_plot *plot, const struct arguments *a, int spin,
                       const struct creep_solutions *solutions) {
    static const enum cli_plot_colour colour[KL_CREEP_LAWS] = {CLI_PLOT_QUIET, CLI_PLOT_SECOND,
                                                               CLI_PLOT_THIRD, CLI_PLOT_FOURTH,
                                                               CLI_PLOT_FIFTH, CLI_PLOT_FIRST};
    char title[64];
    snprintf(title, sizeof title, "omega3 = %.3g 1/m", a->creepage[OMEGA3]);
    const bool first = a->sweep == GAMMA1 && spin == 0;
    const struct cli_plot_panel panel = {.title = a->sweep == GAMMA1 ? title : NULL,
                                         .x_label = a->sweep == GAMMA1 ? "gamma1 [0.001]"
                                                                       : "gamma2 [0.001]",
                                         .y_label = spin > 0             ? NULL
                                                    : a->sweep == GAMMA1 ? "T1 / mu N, gamma2 = 0"
                                                                         : "T2 / mu N, gamma1 = 0",
                                         .row = a->sweep == GAMMA1 ? 0 : 1,
                                         .column = spin,
                                         .y_low = -1.05,
                                         .y_high = 0.05};
    cli_plot_panel(plot, &panel);
    for (int law = 0; law < KL_CREEP_LAWS; law++) {
        const struct cli_plot_style style = {
            .label = first ? creep_law_name[law] : NULL,
            .colour = colour[law],
            .pen = law == KL_CREEP_FASTSIM_ELLIPTIC ? CLI_PLOT_DASHED : CLI_PLOT_SOLID,
            .thin = law != KL_CREEP_TABLE};
        if (is_wanted(a, law)) {
            draw_law(plot, a, law, &style);
        }
    }
    draw_solutions(plot, a, solutions, first ? "CONTACT" : NULL);
}

static int picture(const struct arguments *a) {
    static const double times[SPINS] = {0.0, 1.0, 2.0, 4.0};
    struct creep_solutions solutions = {0};
    struct cli_plot plot;
    char notes[160];
    int status = a->points != NULL ? creep_solutions_read(&solutions, a->points) : CLI_OK;
    if (status != CLI_OK) {
        return status;
    }
    snprintf(notes, sizeof notes, "ellipse %.4g x %.4g mm, %.3g kN, mu %.3g", 1e3 * a->a_m,
             1e3 * a->b_m, 1e-3 * a->load_N, a->mu);
    status = cli_plot_open(&plot, a->plot, "Creep forces by law", notes);
    for (int i = 0; i < 2 * SPINS && status == CLI_OK; i++) {
        struct arguments one = *a;
        one.sweep = i < SPINS ? GAMMA1 : GAMMA2;
        one.to = a->sweep == OMEGA3 ? 0.01 : a->to;
        one.creepage[GAMMA1] = one.creepage[GAMMA2] = 0.0;
        one.creepage[OMEGA3] = times[i % SPINS] * a->creepage[OMEGA3];
        draw_panel(&plot, &one, i % SPINS, &solutions);
    }
    creep_solutions_free(&solutions);
    return status == CLI_OK ? cli_plot_close(&plot, status) : status;
}

/* ---- the comparison ---- */

static int count_one(char *const *words, int law, double *per_contact) {
    fflush(stdout); /* or the child prints it once more */
    return bench_count("creep", words, creep_law_name[law], per_contact);
}

static int compare(const struct arguments *a) {
    struct creep_points points;
    int status = creep_points_read(&points, a->check);
    if (status != CLI_OK) {
        return status;
    }
    char path[4096];
    char flag[] = "--compact";
    snprintf(path, sizeof path, "%s", a->path);
    char *words[3] = {path, a->compact ? flag : NULL, NULL};
    printf(
        "against CONTACT at %zu points: |force difference|/mu N, moment/(mu N c); the same where "
        "|p| <= 0.3\n\n",
        points.n);
    printf("%-17s %8s %8s %8s %8s %10s %8s %10s %s\n", "law", "T mean", "T max", "M mean", "M max",
           "T mean .3", "T max .3", "ns/contact", a->instructions ? "instructions/contact" : "");
    for (int law = 1; law < KL_CREEP_LAWS && status == CLI_OK; law++) {
        if (!is_wanted(a, law)) {
            continue;
        }
        const enum kl_creep_law which = (enum kl_creep_law)law;
        const struct creep_difference all =
            creep_difference(which, &a->file.table, &points, HUGE_VAL);
        const struct creep_difference little =
            creep_difference(which, &a->file.table, &points, 0.3);
        double instructions = 0.0;
        if (a->instructions) {
            status = count_one(words, law, &instructions);
        }
        printf("%-17s %8.4f %8.4f %8.4f %8.4f %10.4f %8.4f %10.1f", creep_law_name[law],
               all.force_mean, all.force_max, all.moment_mean, all.moment_max, little.force_mean,
               little.force_max, creep_time(which, &a->file.table, &points));
        if (a->instructions) {
            printf(" %.0f", instructions);
        }
        printf("\n");
    }
    creep_points_free(&points);
    return status;
}

/* "table:1000" */
static int count_only(const struct arguments *a) {
    const char *colon = strchr(a->count_only, ':');
    for (int law = 0; law < KL_CREEP_LAWS && colon != NULL; law++) {
        const size_t length = (size_t)(colon - a->count_only);
        if (strlen(creep_law_name[law]) == length &&
            strncmp(a->count_only, creep_law_name[law], length) == 0) {
            printf("%g\n", creep_repeat((enum kl_creep_law)law, &a->file.table,
                                        strtoull(colon + 1, NULL, 10)));
            return CLI_OK;
        }
    }
    return cli_misuse("--count-only %s: expected LAW:CONTACTS", a->count_only);
}

/* ---- the table as C source ---- */

static int write_source(const struct arguments *a) {
    struct cli_output output;
    const char *name = a->name != NULL ? a->name
                       : a->compact    ? "creep_table_compact"
                                       : "creep_table";
    bool good = isalpha((unsigned char)name[0]) != 0 && strlen(name) <= 31;
    for (const char *at = name; *at != '\0'; at++) {
        good = good && (isalnum((unsigned char)*at) != 0 || *at == '_');
    }
    if (!good) {
        return cli_misuse("--name %s: must be a C name of at most 31 letters, digits and _", name);
    }
    int status = cli_output_open(&output, a->source);
    if (status != CLI_OK) {
        return status;
    }
    emit_creep_table(output.file, &a->file.table, name, false);
    status = cli_output_close(&output, CLI_OK);
    if (status == CLI_OK && !cli_is_stdout(a->source)) {
        printf("%s: const struct kl_creep_table %s, %zu bytes of constant data, hash %016" PRIx64
               "\n",
               a->source, name, kl_creep_table_bytes(&a->file.table), a->file.table.hash);
    }
    return status;
}

static int perform(const struct arguments *a) {
    int status = CLI_OK;
    if (a->count_only != NULL) {
        return count_only(a);
    }
    if (a->source != NULL) {
        return write_source(a);
    }
    if (a->check != NULL) {
        return compare(a);
    }
    if (a->plot == NULL || a->csv != NULL) {
        status = curves(a);
    }
    return status == CLI_OK && a->plot != NULL ? picture(a) : status;
}

static struct cli_option number(const char *name, const char *argument, double *value,
                                const char *unit, double low, double high, const char *help) {
    return (struct cli_option){.name = name,
                               .argument = argument,
                               .kind = CLI_NUMBER,
                               .value = value,
                               .unit = unit,
                               .low = low,
                               .high = high,
                               .help = help};
}

int cmd_creep(int argc, char **argv) {
    struct arguments a = {.a_m = 5e-3,
                          .b_m = 5e-3,
                          .load_N = 60e3,
                          .to = CLI_NOT_GIVEN,
                          .rows = 11,
                          .mu = 0.3,
                          .ratio = 1.0,
                          .k_a = 1.0,
                          .k_s = 1.0};
    int status = CLI_OK;
    const struct cli_option options[] = {
        {.name = "--law",
         .argument = LAWS,
         .kind = CLI_CHOICE,
         .value = &a.law,
         .help = "one law alone; default all"},
        number("--a", "MM", &a.a_m, "mm", 1e-4, 0.1,
               "semi-axis along the rolling direction; default 5"),
        number("--b", "MM", &a.b_m, "mm", 1e-4, 0.1, "semi-axis across; default 5"),
        number("--load", "N", &a.load_N, "", 1.0, 1e9, "normal force, N; default 60000"),
        {.name = "--sweep",
         .argument = "along|across|spin",
         .kind = CLI_CHOICE,
         .value = &a.sweep,
         .help = "the creepage that grows from 0; default along"},
        number("--to", "VALUE", &a.to, "", -1e3, 1e3, "and how far; default 0.01 (spin: 2 1/m)"),
        number("--along", "VALUE", &a.creepage[0], "", -10.0, 10.0,
               "the others: longitudinal creepage; default 0"),
        number("--across", "VALUE", &a.creepage[1], "", -10.0, 10.0, "lateral creepage; default 0"),
        number("--spin", "VALUE", &a.creepage[2], "", -1e3, 1e3, "spin, 1/m; default 0"),
        {.name = "--rows",
         .argument = "N",
         .kind = CLI_COUNT,
         .value = &a.rows,
         .low = 2.0,
         .high = 1e6,
         .help = "lines per law; default 11"},
        number("--friction", "MU", &a.mu, "", 0.0, 2.0, "mu at no slip; default 0.3"),
        number("--falling", "A", &a.ratio, "", 0.0, 1.0, "mu of fast slip over that; default 1"),
        number("--decay", "B", &a.decay, "", 0.0, 100.0, "how fast it falls, s/m; default 0"),
        number("--speed", "V", &a.speed, "m/s", 0.0, 1000.0,
               "speed, for falling friction; default 0"),
        number("--k-a", "K", &a.k_a, "", 0.01, 1.0,
               "reduction of the initial slope where it sticks; default 1"),
        number("--k-s", "K", &a.k_s, "", 0.01, 1.0, "where it slips; default 1"),
        {.name = "--compact",
         .kind = CLI_FLAG,
         .value = &a.compact,
         .help = "leave out the nodes that the file names: the compact table"},
        cli_maybe_file_option("--csv", &a.csv,
                              "the curves as CSV; without FILE, or with -, to standard output"),
        cli_plot_option(&a.plot,
                        "a picture: T1 against gamma1 and T2 against gamma2, at 0, 1, 2 and 4\n"
                        "times --spin"),
        cli_file_option("--points", &a.points,
                        "with --plot: solutions of CONTACT to be marked where they are of the\n"
                        "same contact: tests/reference/creep_forces.csv"),
        cli_file_option("--check", &a.check,
                        "hold every law against the solutions of CONTACT in FILE, and time it:\n"
                        "tests/reference/creep_check_points.csv"),
        {.name = "--instructions",
         .kind = CLI_FLAG,
         .value = &a.instructions,
         .help = "with --check: count instructions as well (needs valgrind)"},
        cli_file_option("--source", &a.source,
                        "write the table as C source, to be linked with the core"),
        {.name = "--name",
         .argument = "NAME",
         .kind = CLI_TEXT,
         .value = &a.name,
         .help = "its name in C; default creep_table, creep_table_compact"},
        {.name = "--count-only",
         .argument = "LAW:N",
         .kind = CLI_EXTRA_TEXT,
         .value = &a.count_only,
         .help = "for --instructions"},
    };
    const struct cli_command command = {
        .operands = "TABLE",
        .purpose =
            "Creep forces of one contact: T1, T2 and M3 against a creepage under each law; or "
            "every\n"
            "law against CONTACT; or the creep-force table as C source for firmware. TABLE is\n"
            "the file of the table, models/creep/contact.csv.",
        .example =
            "klingel creep models/creep/contact.csv --a 6 --b 4 --spin 0.5 --plot creep.png\n"
            "klingel creep models/creep/contact.csv --check "
            "tests/reference/creep_check_points.csv\n"
            "klingel creep models/creep/contact.csv --compact --source creep_table_compact.c\n",
        .options = options,
        .n_options = sizeof options / sizeof options[0]};
    if (!cli_parse(&command, argc, argv, &a.target, &status)) {
        return status;
    }
    if (a.target.vehicle == NULL) {
        return cli_misuse("an argument is missing: expected TABLE");
    }
    if (a.target.set.n > 0) {
        return cli_misuse("--set: there is no model file");
    }
    a.to = isnan(a.to) ? (a.sweep == OMEGA3 ? 2.0 : 0.01) : a.to;
    a.path = a.target.vehicle;
    if (creep_file_load(&a.file, a.path, a.compact, stderr) != 0) {
        return CLI_FAILED;
    }
    status = perform(&a);
    creep_file_free(&a.file);
    return cli_flush(status);
}
