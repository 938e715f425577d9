/* cmd_conicity.c - klingel conicity: equivalent conicity after EN 15302. */
#include <stdlib.h>
#include <string.h>

#include "cli.h"
#include "cli_plot.h"
#include "conicity_report.h"

#define MM 1e3
#define MOST_ROWS 10000.0
#define MOST_GAUGES 200.0
#define USUAL_HIGH_M 8e-3
#define EN_BASE_M 1.5 /* where nothing else is known: the nominal values of the standard */
#define EN_RADIUS_M 0.46
#define LIMIT_SLACK 1e-9

struct arguments {
    struct cli_target target;
    const char *table;
    const char *pair;
    const char *wheelset;
    double from_m;
    double to_m;
    double step_m;
    double at_m;
    double base_m;
    double radius_m;
    bool roll;
    const char *gauge;
    double gauge_m[3]; /* low, high, step */
    const char *csv;
    const char *json;
    const char *curve;
    const char *plot;
};

/* ---- what to work on ---- */

static int parse_gauge(struct arguments *a) {
    char text[96];
    char why[160];
    char *rest = text;
    snprintf(text, sizeof text, "%s", a->gauge);
    for (int i = 0; i < 3; i++) {
        char *field = strsep(&rest, ":");
        if (field == NULL || !cli_quantity(field, "mm", &a->gauge_m[i], why, sizeof why)) {
            return cli_misuse("--gauge %s: must be LOW:HIGH:STEP, in mm", a->gauge);
        }
    }
    const double *g = a->gauge_m;
    if (rest != NULL || !(g[0] >= 0.3 && g[0] <= g[1] && g[1] <= 3.0 && g[2] > 0.0)) {
        return cli_misuse("--gauge %s: must be LOW:HIGH:STEP, rising within 300..3000 mm",
                          a->gauge);
    }
    return (g[1] - g[0]) / g[2] <= MOST_GAUGES
               ? CLI_OK
               : cli_misuse("--gauge %s: more than %.0f gauges", a->gauge, MOST_GAUGES);
}

static int check(struct arguments *a) {
    if ((a->target.vehicle == NULL) == (a->table == NULL)) {
        return a->table == NULL
                   ? cli_misuse("an argument is missing: expected MODEL | --table FILE")
                   : cli_misuse("--table %s: delta_r comes from it or from MODEL, not from both",
                                a->table);
    }
    if (a->table != NULL && (a->pair != NULL || a->wheelset != NULL || a->gauge != NULL ||
                             a->roll || a->target.set.n > 0)) {
        return cli_misuse(
            "--pair, --wheelset, --roll, --gauge and --set go with MODEL, not with --table");
    }
    if (a->table == NULL && (!isnan(a->base_m) || !isnan(a->radius_m))) {
        return cli_misuse("--base and --radius go with --table; a model has its own");
    }
    if (a->pair != NULL && a->wheelset != NULL) {
        return cli_misuse("--pair and --wheelset: one of them is enough");
    }
    if (!isnan(a->to_m) && a->to_m < a->from_m) {
        return cli_misuse("--to: must not be below --from (%g mm)", a->from_m * MM);
    }
    double to = isnan(a->to_m) ? USUAL_HIGH_M : a->to_m;
    if ((to - a->from_m) / a->step_m > MOST_ROWS) {
        return cli_misuse("--step: more than %.0f amplitudes", MOST_ROWS);
    }
    return a->gauge != NULL ? parse_gauge(a) : CLI_OK;
}

/* A wheelset by name, or by number from 1 on. */
static int pair_of_wheelset(const struct model_file *file, const char *wanted, uint32_t *pair) {
    const struct kl_vehicle_def *v = &file->vehicle;
    const char *names[KL_MAX_WHEELSETS];
    char *end = NULL;
    unsigned long number = strtoul(wanted, &end, 10);
    bool is_number = wanted[0] >= '0' && wanted[0] <= '9' && *end == '\0';
    for (uint32_t i = 0; i < v->n_wheelsets; i++) {
        names[i] = v->wheelsets[i].name;
        if (strcmp(names[i], wanted) == 0 || (is_number && number == i + 1u)) {
            *pair = v->wheelsets[i].pair;
            return CLI_OK;
        }
    }
    const char *near = cli_nearest(wanted, names, v->n_wheelsets);
    return cli_misuse("--wheelset %s: must be 1..%u or a name; %s %s", wanted, v->n_wheelsets,
                      near != NULL ? "did you mean" : "the first is",
                      near != NULL ? near : names[0]);
}

static int choose_pair(const struct arguments *a, const struct model_file *file, uint32_t *pair) {
    const char *names[KL_MAX_PAIRS];
    uint32_t n = file->vehicle.n_pairs;
    *pair = file->vehicle.wheelsets[0].pair;
    if (a->wheelset != NULL) {
        return pair_of_wheelset(file, a->wheelset, pair);
    }
    for (uint32_t i = 0; i < n && a->pair != NULL; i++) {
        names[i] = model_file_pair_name(file, i);
        if (strcmp(names[i], a->pair) == 0) {
            *pair = i;
            return CLI_OK;
        }
    }
    if (a->pair == NULL) {
        return CLI_OK;
    }
    const char *near = cli_nearest(a->pair, names, n);
    return cli_misuse("--pair %s: the model has no such pair; %s %s", a->pair,
                      near != NULL ? "did you mean" : "its first is",
                      near != NULL ? near : names[0]);
}

/* ---- the figures ---- */

static struct conicity_row row_at(const struct conicity_source *source, double amplitude_m) {
    struct conicity_row row = {.amplitude_m = amplitude_m};
    row.status =
        conicity_at(&source->curve, amplitude_m, source->base_m, source->radius_m, &row.motion);
    return row;
}

static size_t count(double low, double high, double step) {
    return (size_t)floor((high - low) / step * (1.0 + 1e-12) + 1e-9) + 1u;
}

/* The amplitudes asked for; without --to as far as delta_r carries. */
static int compute_rows(const struct arguments *a, struct conicity_report *r) {
    double largest = conicity_largest(&r->source->curve) * (1.0 + LIMIT_SLACK);
    double to = isnan(a->to_m) ? fmin(USUAL_HIGH_M, largest) : a->to_m;
    if (largest == 0.0) {
        return cli_fail("delta_r drives the wheelset back nowhere: there is no conicity");
    }
    if (a->from_m > largest || to > largest) {
        return cli_misuse("--%s %g mm: delta_r carries amplitudes up to %g mm only",
                          a->from_m > largest ? "from" : "to",
                          (a->from_m > largest ? a->from_m : to) * MM,
                          floor(largest * 1e6) / 1e6 * MM);
    }
    r->n_rows = count(a->from_m, to, a->step_m);
    r->rows = calloc(r->n_rows, sizeof r->rows[0]);
    if (r->rows == NULL) {
        return cli_fail("out of memory");
    }
    for (size_t i = 0; i < r->n_rows; i++) {
        r->rows[i] = row_at(r->source, fmin(a->from_m + (double)i * a->step_m, to));
    }
    r->at_m = a->at_m;
    r->single = row_at(r->source, a->at_m);
    return CLI_OK;
}

static int compute_gauges(const struct arguments *a, const struct kl_pair_def *def,
                          const char *name, struct conicity_report *r) {
    struct kl_pair_def other = *def;
    if (def->kind != KL_PAIR_PROFILES || def->rail[KL_RIGHT].half_spacing_m > 0.0 ||
        def->rail[KL_LEFT].half_spacing_m > 0.0) {
        return cli_misuse("--gauge: the rails of pair %s are not placed by gauge_m", name);
    }
    size_t n = count(a->gauge_m[0], a->gauge_m[1], a->gauge_m[2]);
    r->gauges = calloc(n, sizeof r->gauges[0]);
    if (r->gauges == NULL) {
        return cli_fail("out of memory");
    }
    for (r->n_gauges = 0; r->n_gauges < n; r->n_gauges++) {
        struct conicity_source source;
        double gauge = fmin(a->gauge_m[0] + (double)r->n_gauges * a->gauge_m[2], a->gauge_m[1]);
        char text[KL_NAME_SIZE + 40];
        snprintf(text, sizeof text, "%s at gauge %g mm", name, gauge * MM);
        other.rail[KL_RIGHT].gauge_m = other.rail[KL_LEFT].gauge_m = gauge;
        int status = conicity_source_pair(&source, &other, text, a->roll);
        if (status != CLI_OK) {
            return status;
        }
        r->gauges[r->n_gauges] = row_at(&source, a->at_m);
        r->gauges[r->n_gauges].gauge_m = gauge;
        conicity_source_free(&source);
    }
    return CLI_OK;
}

/* ---- output ---- */

static int write_file(const struct conicity_report *r, const char *path,
                      void (*write)(const struct conicity_report *, FILE *)) {
    struct cli_output output;
    int status = path != NULL ? cli_output_open(&output, path) : CLI_OK;
    if (path == NULL || status != CLI_OK) {
        return status;
    }
    write(r, output.file);
    return cli_output_close(&output, CLI_OK);
}

static int show(const struct arguments *a, const struct conicity_report *r) {
    int to_stdout = cli_is_stdout(a->csv) + cli_is_stdout(a->json) + cli_is_stdout(a->curve) +
                    cli_is_stdout(a->plot);
    if (to_stdout > 1) {
        return cli_misuse("only one of --csv, --json, --delta-r and --plot can be standard output");
    }
    if (to_stdout == 0) {
        conicity_report_text(r);
    }
    int status = write_file(r, a->csv, conicity_report_csv);
    status = status == CLI_OK ? write_file(r, a->json, conicity_report_json) : status;
    status = status == CLI_OK ? write_file(r, a->curve, conicity_report_curve) : status;
    return status == CLI_OK && a->plot != NULL ? conicity_report_plot(r, a->plot) : status;
}

static int with_source(const struct arguments *a, struct conicity_report *r,
                       const struct kl_pair_def *def, const char *name) {
    int status = CLI_OK;
    if (conicity_rolling_line(&r->source->curve, &r->rolling_line_m) != 0) {
        status =
            cli_fail("%s: delta_r does not rise through zero anywhere: no rolling line", r->what);
    }
    status = status == CLI_OK ? compute_rows(a, r) : status;
    status = status == CLI_OK && a->gauge != NULL ? compute_gauges(a, def, name, r) : status;
    status = status == CLI_OK ? show(a, r) : status;
    free(r->rows);
    free(r->gauges);
    return status;
}

static int of_table(const struct arguments *a) {
    struct conicity_source source;
    struct conicity_report report = {.source = &source};
    snprintf(report.what, sizeof report.what, "table %s", a->table);
    int status = conicity_source_table(&source, a->table);
    source.base_m = isnan(a->base_m) ? EN_BASE_M : a->base_m;
    source.radius_m = isnan(a->radius_m) ? EN_RADIUS_M : a->radius_m;
    status = status == CLI_OK ? with_source(a, &report, NULL, NULL) : status;
    conicity_source_free(&source);
    return status;
}

static int of_model(const struct arguments *a) {
    struct cli_model m;
    struct conicity_source source;
    struct conicity_report report = {.source = &source};
    uint32_t pair = 0;
    int status = cli_model_load(&m, &a->target);
    if (status != CLI_OK) {
        return status;
    }
    status = choose_pair(a, &m.file, &pair);
    if (status == CLI_OK) {
        const struct kl_pair_def *def = &m.file.vehicle.pairs[pair];
        const char *name = model_file_pair_name(&m.file, pair);
        snprintf(report.what, sizeof report.what, "pair %s of %s, %s", name, a->target.vehicle,
                 a->roll ? "with roll" : "axle level");
        status = conicity_source_pair(&source, def, name, a->roll);
        status = status == CLI_OK ? with_source(a, &report, def, name) : status;
        conicity_source_free(&source);
    }
    cli_model_close(&m);
    return status;
}

/* ---- the command ---- */

static struct cli_option length(const char *name, double *value, double low, double high,
                                const char *help) {
    return (struct cli_option){.name = name,
                               .argument = "MM",
                               .kind = CLI_NUMBER,
                               .value = value,
                               .unit = "mm",
                               .low = low,
                               .high = high,
                               .help = help};
}

static struct cli_option text(const char *name, const char *argument, const char **value,
                              const char *help) {
    return (struct cli_option){
        .name = name, .argument = argument, .kind = CLI_TEXT, .value = value, .help = help};
}

int cmd_conicity(int argc, char **argv) {
    struct arguments a = {.from_m = 1e-3,
                          .to_m = CLI_NOT_GIVEN,
                          .step_m = 5e-4,
                          .at_m = 3e-3,
                          .base_m = CLI_NOT_GIVEN,
                          .radius_m = CLI_NOT_GIVEN};
    int status = CLI_OK;
    const struct cli_option options[] = {
        text("--table", "FILE", &a.table,
             "delta_r from a file in place of a model: two columns, y and\n"
             "r_right - r_left, in mm; --delta-r writes such a file"),
        text("--pair", "NAME", &a.pair,
             "a wheel-rail pair of the model; default the first wheelset's"),
        text("--wheelset", "N", &a.wheelset, "the pair of this wheelset, by number (1..) or name"),
        length("--from", &a.from_m, 1e-5, 0.1, "smallest amplitude, mm; default 1"),
        length("--to", &a.to_m, 1e-5, 0.1,
               "largest amplitude, mm; default 8, or what delta_r carries"),
        length("--step", &a.step_m, 1e-6, 0.1, "distance of the amplitudes, mm; default 0.5"),
        length("--at", &a.at_m, 1e-5, 0.1,
               "the amplitude that is marked and used for --gauge, mm; default 3"),
        text("--gauge", "L:H:STEP", &a.gauge,
             "conicity at one amplitude against the gauge, mm: 1430:1440:1"),
        {.name = "--roll",
         .kind = CLI_FLAG,
         .value = &a.roll,
         .help = "with the roll of the wheelset, as in the tables that a vehicle runs\n"
                 "on; default: the axle stays level, as in the standard's cases"},
        length("--base", &a.base_m, 0.1, 5.0,
               "with --table: e, distance of the contact points, mm; default 1500"),
        length("--radius", &a.radius_m, 0.05, 2.0, "with --table: r0, mm; default 460"),
        cli_maybe_file_option("--csv", &a.csv,
                              "the table as CSV in SI units, with --gauge the sweep; without\n"
                              "FILE, or with -, to standard output in place of the text"),
        cli_maybe_file_option("--json", &a.json, "everything as JSON, likewise"),
        cli_maybe_file_option("--delta-r", &a.curve, "delta_r as CSV, likewise"),
        cli_plot_option(&a.plot, "conicity and delta_r as a picture: .png, .pdf, .svg"),
    };
    const struct cli_command command = {
        .operands = "MODEL | --table FILE",
        .purpose =
            "Equivalent conicity after EN 15302, from the rolling-radius difference delta_r(y) of\n"
            "a wheel-rail pair or of a table: conicity and wavelength of the wheelset's motion\n"
            "against its amplitude, by integration of the nonlinear equation of motion (Annex B)\n"
            "and by linear regression (Annex C); the effect of the gauge.",
        .example = "klingel conicity models/two_axle_wagon.yaml --to 6 --plot conicity.png\n"
                   "klingel conicity models/two_axle_wagon.yaml --gauge 1430:1440:2\n",
        .options = options,
        .n_options = sizeof options / sizeof options[0]};
    if (!cli_parse(&command, argc, argv, &a.target, &status)) {
        return status;
    }
    status = check(&a);
    if (status == CLI_OK) {
        status = a.table != NULL ? of_table(&a) : of_model(&a);
    }
    return cli_flush(status);
}
