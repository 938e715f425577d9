/* cmd_curve.c - klingel curve: steady running in curves. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli_plot.h"
#include "cli_progress.h"
#include "curve_report.h"

#define MOST_CASES 1000
#define LEAST_RADIUS_M 51.0 /* the track's bound is 0.02 1/m */
#define DEFAULT_CANT_M 0.1
#define STANDARD_GRAVITY 9.81 /* cant deficiency of a model without gravity */

struct arguments {
    const char *radius;
    double speed_m_s;
    double cant_m;
    double deficiency_m;
    double base_m;
    double settle_s;
    const char *csv;
    const char *plot;
    struct cli_target target;
};

/* ---- which curves ---- */

/* "R", "A:B:STEP" or "R1,R2,...". */
static int parse_radii(const char *text, double radius[MOST_CASES], size_t *n) {
    double part[3];
    char why[160];
    const bool range = strchr(text, ':') != NULL;
    const char *at = text;
    *n = 0;
    for (;;) {
        char word[64];
        const size_t length = strcspn(at, range ? ":" : ",");
        snprintf(word, sizeof word, "%.*s", (int)length, at);
        double *to = range ? &part[*n < 3 ? *n : 2] : &radius[*n];
        if (*n == (range ? 3 : MOST_CASES) || !cli_quantity(word, "m", to, why, sizeof why)) {
            return cli_misuse("--radius %s: '%s' %s", text, word,
                              *n == (range ? 3 : MOST_CASES) ? "is one too many" : why);
        }
        *n += 1;
        if (at[length] == '\0') {
            break;
        }
        at += length + 1;
    }
    if (range) {
        const double count = *n == 3 ? floor((part[1] - part[0]) / part[2] + 1e-9) : -1.0;
        if (!(count >= 0.0 && count < MOST_CASES)) {
            return cli_misuse("--radius %s: must be A:B:STEP, with at most %d radii", text,
                              MOST_CASES);
        }
        *n = (size_t)count + 1;
        for (size_t i = 0; i < *n; i++) {
            radius[i] = part[0] + (double)i * part[2];
        }
    }
    for (size_t i = 0; i < *n; i++) {
        if (!(fabs(radius[i]) >= LEAST_RADIUS_M && fabs(radius[i]) <= 1e6)) {
            return cli_misuse("--radius %s: radii must be within %g m and 1000 km", text,
                              LEAST_RADIUS_M);
        }
    }
    return CLI_OK;
}

/*
 * Of speed, cant and deficiency two give the third: V^2/(g R) = (cant + deficiency)/base, as the
 * model has it for small angles.
 */
static int make_case(const struct arguments *a, double radius_m, double gravity_m_s2,
                     struct curve_case *c) {
    const double r = fabs(radius_m);
    const double per_speed2 = a->base_m / (gravity_m_s2 * r);
    const double sign = radius_m > 0.0 ? 1.0 : -1.0;
    c->radius_m = radius_m;
    c->cant_m = isnan(a->cant_m) ? DEFAULT_CANT_M : a->cant_m;
    c->deficiency_m = a->deficiency_m;
    c->speed_m_s = a->speed_m_s;
    if (isnan(a->speed_m_s)) {
        c->speed_m_s = sqrt(fmax(c->cant_m + c->deficiency_m, 0.0) / per_speed2);
    } else if (isnan(a->deficiency_m)) {
        c->deficiency_m = per_speed2 * c->speed_m_s * c->speed_m_s - c->cant_m;
    } else {
        c->cant_m = per_speed2 * c->speed_m_s * c->speed_m_s - c->deficiency_m;
    }
    c->curvature_1_m = sign / r;
    c->cant_rad = sign * c->cant_m / a->base_m;
    if (!(c->speed_m_s >= 0.1 && c->speed_m_s <= KL_MAX_SPEED_M_S)) {
        return cli_misuse("R = %g m: a speed of %g m/s follows, which is not within 0.1..%g",
                          radius_m, c->speed_m_s, KL_MAX_SPEED_M_S);
    }
    if (!(fabs(c->cant_rad) < 0.3)) {
        return cli_misuse("R = %g m: a cant of %g mm follows", radius_m, 1e3 * c->cant_m);
    }
    return CLI_OK;
}

/* ---- the command ---- */

struct job {
    struct cli_model m;
    struct curve_bench bench; /* large */
    size_t n;
    double radius[MOST_CASES];
    struct curve_result *result;
};

static int find_one(struct job *job, const struct arguments *a, size_t i,
                    const struct curve_result **before) {
    struct curve_case at;
    const double gravity = job->m.file.vehicle.gravity_m_s2;
    struct curve_result *r = &job->result[i];
    int status = make_case(a, job->radius[i], gravity > 0.0 ? gravity : STANDARD_GRAVITY, &at);
    if (status == CLI_OK) {
        status = curve_find(&job->bench, &at, *before, a->settle_s, r);
    }
    if (status == CLI_OK && r->way != CURVE_NONE) {
        *before = r;
    } else if (status == CLI_OK && cli_is_stdout(a->csv)) {
        cli_warn("R = %g m: no steady running: %s", job->radius[i], r->why);
    }
    return status;
}

static int find_all(struct job *job, const struct arguments *a, FILE *csv, size_t *found) {
    struct cli_progress progress;
    const struct curve_result *before = NULL;
    int status = CLI_OK;
    cli_progress_begin(&progress);
    for (size_t i = 0; i < job->n && status == CLI_OK; i++) {
        const struct curve_result *r = &job->result[i];
        status = find_one(job, a, i, &before);
        if (status == CLI_OK) {
            *found += r->way != CURVE_NONE;
            if (!cli_is_stdout(a->csv)) {
                curve_print(&job->m.model, r);
            }
            if (csv != NULL) {
                curve_csv(csv, &job->m.model, r);
            }
        }
        cli_progress_show(&progress, (double)(i + 1) / (double)job->n, "curves");
    }
    cli_progress_end(&progress);
    return status;
}

static int perform(struct job *job, const struct arguments *a) {
    struct cli_output csv = {0};
    size_t found = 0;
    int status = parse_radii(a->radius, job->radius, &job->n);
    if (status == CLI_OK && job->m.file.vehicle.gravity_m_s2 <= 0.0 && a->cant_m != 0.0) {
        status = cli_misuse("a model without gravity knows no cant: --cant 0");
    }
    if (status == CLI_OK && a->csv != NULL) {
        status = cli_output_open(&csv, a->csv);
    }
    if (status != CLI_OK) {
        return status;
    }
    if (csv.file != NULL) {
        curve_csv_header(csv.file);
    }
    job->result = calloc(job->n, sizeof job->result[0]);
    status = job->result != NULL ? find_all(job, a, csv.file, &found) : cli_fail("out of memory");
    status = cli_output_close(&csv, status); /* the curves that were found are kept */
    if (status == CLI_OK && a->plot != NULL && found > 0) {
        status = curve_plot(a->plot, &job->m.model, job->result, job->n);
    }
    if (status == CLI_OK && found < job->n) {
        status = cli_fail("no steady running in %zu of %zu curve%s", job->n - found, job->n,
                          job->n == 1 ? "" : "s");
    }
    free(job->result);
    return cli_flush(status);
}

static int check(const struct arguments *a) {
    const int given = !isnan(a->speed_m_s) + !isnan(a->cant_m) + !isnan(a->deficiency_m);
    if (a->radius == NULL) {
        return cli_misuse("--radius is missing");
    }
    if (isnan(a->speed_m_s) && isnan(a->deficiency_m)) {
        return cli_misuse("one of --speed and --cant-deficiency is needed");
    }
    if (given == 3) {
        return cli_misuse("two of --speed, --cant and --cant-deficiency give the third");
    }
    if (cli_is_stdout(a->csv) && cli_is_stdout(a->plot)) {
        return cli_misuse("--csv and --plot cannot both go to standard output");
    }
    return CLI_OK;
}

static struct cli_option length(const char *name, double *value, double low, double high,
                                const char *help) {
    return (struct cli_option){.name = name,
                               .argument = "H",
                               .kind = CLI_NUMBER,
                               .value = value,
                               .unit = "m",
                               .low = low,
                               .high = high,
                               .help = help};
}

static const char purpose[] =
    "The steady running of a vehicle in endless curves without irregularities: where wheelsets\n"
    "and bodies stand, angles of attack, and of every wheel the load Q, the guiding force Y\n"
    "(outwards positive), Y/Q, creep forces and flange force; of every wheelset the track\n"
    "shifting force, sum of Y. Found by Newton's method on the equations of motion, followed\n"
    "from straight track or the curve before into the wanted one; failing that, by simulation.\n"
    "What does not add up is printed, and whether the state is unstable. Where there is no\n"
    "steady running the reason is told, and the exit status is 1.";

int cmd_curve(int argc, char **argv) {
    struct arguments a = {.speed_m_s = CLI_NOT_GIVEN,
                          .cant_m = CLI_NOT_GIVEN,
                          .deficiency_m = CLI_NOT_GIVEN,
                          .base_m = 1.5,
                          .settle_s = 60.0};
    int status = CLI_OK;
    const struct cli_option options[] = {
        {.name = "--radius",
         .argument = "R",
         .kind = CLI_TEXT,
         .value = &a.radius,
         .help = "one radius, a range A:B:STEP, or a list R1,R2,...; m or with units,\n"
                 "positive in right-hand curves, negative in left-hand ones; needed"},
        cli_speed_option("--speed", &a.speed_m_s, 0.1, "m/s or with a unit (72km/h)"),
        length("--cant", &a.cant_m, -0.3, 0.3,
               "of the outer rail over the inner one, 100mm; default 100 mm"),
        length("--cant-deficiency", &a.deficiency_m, -0.45, 0.45,
               "cant that is missing to balance the centrifugal force. Of speed, cant\n"
               "and deficiency two give the third"),
        length("--cant-base", &a.base_m, 0.3, 3.0, "over which cant is measured; default 1.5 m"),
        cli_time_option("--settle", &a.settle_s, 1e4,
                        "longest time to be simulated where Newton's method fails; default 60 s"),
        cli_maybe_file_option("--csv", &a.csv,
                              "a row for every curve and wheelset, SI units; without FILE, or\n"
                              "with -, to standard output in place of the text"),
        cli_plot_option(&a.plot, "over the radius. .png, .pdf or .svg"),
    };
    const struct cli_command command = {
        .purpose = purpose,
        .example = "klingel curve models/two_axle_wagon.yaml --radius 1000:400:-100 \\\n"
                   "    --cant 100mm --cant-deficiency 50mm --plot curves.png\n",
        .options = options,
        .n_options = sizeof options / sizeof options[0]};
    if (!cli_parse(&command, argc, argv, &a.target, &status) || (status = check(&a)) != CLI_OK) {
        return status;
    }
    struct job *job = calloc(1, sizeof *job);
    if (job == NULL) {
        return cli_fail("out of memory");
    }
    status = cli_model_load(&job->m, &a.target);
    if (status == CLI_OK) {
        cli_model_hold_speed(&job->m);
        status = cli_model_endless(&job->m, 0.0, 0.0);
    }
    if (status == CLI_OK) {
        job->bench.m = &job->m;
        modes_name(&job->m.model, &job->bench.names);
        status = perform(job, &a);
        cli_model_close(&job->m);
    }
    free(job);
    return status;
}
