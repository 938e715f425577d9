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

#define TABLE_FILE "models/creep/contact.csv"
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

/* One law's force over mu N: the size of T1 and T2 with the sign of the one that is swept. */
static void draw(struct cli_plot *plot, const struct arguments *a, int law, int part,
                 const struct cli_plot_style *style) {
    double x[MAX_ROWS];
    double y[MAX_ROWS];
    struct kl_creep_contact c;
    if (contact(a, (enum kl_creep_law)law, &c) != CLI_OK) {
        return;
    }
    const double limit = a->mu * a->load_N;
    for (int i = 0; i < MAX_ROWS; i++) {
        const double at = a->to * (double)i / (MAX_ROWS - 1);
        const struct kl_creep_force f = force_at(a, (enum kl_creep_law)law, &c, at);
        x[i] = a->sweep == OMEGA3 ? at : 1e3 * at;
        y[i] = part == 0   ? (double)f.t1_N / limit
               : part == 1 ? (double)f.t2_N / limit
                           : (double)f.m3_Nm / (limit * sqrt(a->a_m * a->b_m));
        if (law == KL_CREEP_LINEAR && fabs(y[i]) > 1.2) {
            x[i] = y[i] = (double)NAN;
        }
    }
    cli_plot_line(plot, style, x, y, MAX_ROWS);
}

static int picture(const struct arguments *a) {
    static const char *const axis[3] = {"T1 / mu N", "T2 / mu N", "M3 / (mu N c)"};
    static const char *const creepage[3] = {"longitudinal creepage gamma1 [0.001]",
                                            "lateral creepage gamma2 [0.001]", "spin omega3 [1/m]"};
    static const enum cli_plot_colour colour[KL_CREEP_LAWS] = {CLI_PLOT_QUIET, CLI_PLOT_SECOND,
                                                               CLI_PLOT_THIRD, CLI_PLOT_FOURTH,
                                                               CLI_PLOT_FIFTH, CLI_PLOT_FIRST};
    static const double spin[3] = {0.0, 0.3, 1.0};
    struct cli_plot plot;
    char notes[160];
    snprintf(notes, sizeof notes, "ellipse %.3g x %.3g mm, %.3g kN, mu %.3g", 1e3 * a->a_m,
             1e3 * a->b_m, 1e-3 * a->load_N, a->mu);
    int status = cli_plot_open(&plot, a->plot, "Creep forces by law", notes);
    if (status != CLI_OK) {
        return status;
    }
    const int columns = a->sweep == OMEGA3 ? 1 : 3;
    for (int column = 0; column < columns; column++) {
        struct arguments one = *a;
        one.creepage[OMEGA3] += a->sweep == OMEGA3 ? 0.0 : spin[column];
        for (int part = 0; part < 3; part++) {
            char title[64];
            snprintf(title, sizeof title, "omega3 = %.3g 1/m", one.creepage[OMEGA3]);
            const struct cli_plot_panel panel = {.title =
                                                     part == 0 && a->sweep != OMEGA3 ? title : NULL,
                                                 .x_label = part == 2 ? creepage[a->sweep] : NULL,
                                                 .y_label = column == 0 ? axis[part] : NULL,
                                                 .row = part,
                                                 .column = column};
            cli_plot_panel(&plot, &panel);
            for (int law = 0; law < KL_CREEP_LAWS; law++) {
                const struct cli_plot_style style = {
                    .label = part == 0 && column == 0 ? creep_law_name[law] : NULL,
                    .colour = colour[law],
                    .pen = law == KL_CREEP_FASTSIM_ELLIPTIC ? CLI_PLOT_DASHED : CLI_PLOT_SOLID,
                    .thin = law != KL_CREEP_TABLE};
                if (is_wanted(a, law)) {
                    draw(&plot, &one, law, part, &style);
                }
            }
        }
    }
    return cli_plot_close(&plot, status);
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
         .argument = "gamma1|gamma2|omega3",
         .kind = CLI_CHOICE,
         .value = &a.sweep,
         .help = "the creepage that grows from 0; default gamma1"},
        number("--to", "VALUE", &a.to, "", -1e3, 1e3, "and how far; default 0.01 (omega3: 2 1/m)"),
        number("--gamma1", "VALUE", &a.creepage[0], "", -10.0, 10.0,
               "the others: longitudinal creepage; default 0"),
        number("--gamma2", "VALUE", &a.creepage[1], "", -10.0, 10.0, "lateral creepage; default 0"),
        number("--omega3", "VALUE", &a.creepage[2], "", -1e3, 1e3, "spin, 1/m; default 0"),
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
        cli_plot_option(&a.plot, "the curves as a picture, over mu N, at three spins"),
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
        .operands = "[TABLE]",
        .purpose =
            "Creep forces of one contact: T1, T2 and M3 against a creepage under each law; or "
            "every\n"
            "law against CONTACT; or the creep-force table as C source for firmware. TABLE is\n"
            "the file of the table, " TABLE_FILE " by default.",
        .example = "klingel creep --a 6 --b 4 --omega3 0.5 --sweep gamma2 --plot creep.png\n"
                   "klingel creep --check tests/reference/creep_check_points.csv\n"
                   "klingel creep --compact --source creep_table_compact.c\n",
        .options = options,
        .n_options = sizeof options / sizeof options[0]};
    if (!cli_parse(&command, argc, argv, &a.target, &status)) {
        return status;
    }
    if (a.target.set.n > 0) {
        return cli_misuse("--set: there is no model file");
    }
    a.to = isnan(a.to) ? (a.sweep == OMEGA3 ? 2.0 : 0.01) : a.to;
    a.path = a.target.vehicle != NULL ? a.target.vehicle : TABLE_FILE;
    if (creep_file_load(&a.file, a.path, a.compact, stderr) != 0) {
        return CLI_FAILED;
    }
    status = perform(&a);
    creep_file_free(&a.file);
    return cli_flush(status);
}
