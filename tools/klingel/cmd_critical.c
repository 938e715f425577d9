/* cmd_critical.c - klingel critical: where a vehicle begins to hunt, and where it stops. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli_plot.h"
#include "critical_follow.h"
#include "modes_critical.h"

#define TWO_PI 6.283185307179586
#define SCAN_LOW 1.0         /* m/s */
#define ABOVE_LINEAR 1.15    /* times the linear critical speed: where the search begins */
#define WITHOUT_LINEAR 100.0 /* m/s, if there is none */
#define LOWEST 5.0           /* m/s: where it ends */
#define DEFAULT_STEP 1.0     /* m/s */
#define AVERAGED 4u          /* periods */
#define REST_SHARE 2e-3      /* of the disturbance: a smaller amplitude is rest */

struct range {
    double low;
    double high;
    double step;
};

struct arguments {
    const char *speeds;
    const char *wheelset;
    double step_s;
    double aside_m;
    double settle_s;
    double tolerance;
    double near_m_s;
    double at_m;
    bool linear;
    bool threshold;
    const char *csv;
    const char *plot;
    struct cli_target target;
};

struct job {
    const struct kl_model *model;
    const struct arguments *a;
    struct modes_names names;
    struct modes modes; /* large */
    struct critical_vehicle vehicle;
    struct critical_search search;
    struct cli_progress progress;
    struct critical_result result;
};

/* ---- arguments ---- */

static int parse_range(const char *text, struct range *range) {
    double *const value[] = {&range->low, &range->high, &range->step};
    char why[160];
    const char *at = text;
    for (int i = 0; i < 3; i++) {
        char part[64];
        snprintf(part, sizeof part, "%.*s", (int)strcspn(at, ":"), at);
        if (!cli_quantity(part, "m/s", value[i], why, sizeof why)) {
            return cli_misuse("--speeds %s: '%s' %s", text, part, why);
        }
        at += strcspn(at, ":");
        if (*at == '\0' && i == 0) {
            return cli_misuse("--speeds %s: must be A:B or A:B:STEP", text);
        }
        if (*at == '\0') {
            break;
        }
        at++;
    }
    if (!(range->low > 0.0 && range->low < range->high && range->high <= KL_MAX_SPEED_M_S)) {
        return cli_misuse("--speeds %s: speeds must rise within 0..%g m/s", text, KL_MAX_SPEED_M_S);
    }
    if (!(range->step > 0.0) || (range->high - range->low) / range->step > 1000.0) {
        return cli_misuse("--speeds %s: the step must be positive, and the speeds at most 1000",
                          text);
    }
    return CLI_OK;
}

static int find_wheelset(const struct kl_model *model, const char *name, uint32_t *wheelset) {
    const char *names[KL_MAX_WHEELSETS];
    *wheelset = 0;
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        names[w] = model->wheelsets[w].name;
        if (name == NULL && model->wheelsets[w].x_m > model->wheelsets[*wheelset].x_m) {
            *wheelset = w;
        }
        if (name != NULL && strcmp(name, names[w]) == 0) {
            *wheelset = w;
            return CLI_OK;
        }
    }
    if (name == NULL) {
        return CLI_OK;
    }
    const char *near = cli_nearest(name, names, model->n_wheelsets);
    return cli_misuse("--wheelset %s: the model has none of that name; %s %s%s", name,
                      near != NULL ? "did you mean" : "its first is",
                      near != NULL ? near : names[0], near != NULL ? "?" : "");
}

/* ---- linear ---- */

static int find_linear(struct job *job) {
    struct modes_scan *scan = &job->result.linear;
    *scan = (struct modes_scan){.model = job->model,
                                .names = &job->names,
                                .low_m_s = SCAN_LOW,
                                .high_m_s = KL_MAX_SPEED_M_S,
                                .work = &job->modes};
    int status = modes_scan(scan);
    for (size_t i = 0; i < scan->n && status == CLI_OK; i++) {
        const struct modes_request request = {.model = job->model,
                                              .names = &job->names,
                                              .speed_m_s = scan->crossing[i].speed_m_s,
                                              .parts = true};
        status = modes_find(&request, &job->modes);
        job->result.linear_Hz[i] =
            status == CLI_OK ? modes_least_stable(&job->modes)->imag / TWO_PI : 0.0;
    }
    return status;
}

/* ---- the whole ---- */

static int show(struct job *job, struct cli_output *csv) {
    const struct arguments *a = job->a;
    if (csv->file != NULL) {
        critical_csv(csv->file, &job->result);
    }
    if (!cli_is_stdout(a->csv)) {
        critical_print(&job->result);
    }
    int status = cli_output_close(csv, CLI_OK);
    if (status == CLI_OK && a->plot != NULL) {
        status = critical_plot(a->plot, &job->result);
    }
    return cli_flush(status);
}

static int choose_range(const struct job *job, struct range *range) {
    const struct critical_result *r = &job->result;
    if (job->a->speeds != NULL) {
        return parse_range(job->a->speeds, range);
    }
    const double critical =
        r->linear.n > 0 ? ABOVE_LINEAR * r->linear.crossing[0].speed_m_s : WITHOUT_LINEAR;
    range->high = fmin(ceil(critical), KL_MAX_SPEED_M_S);
    range->low = fmin(LOWEST, 0.5 * range->high);
    return CLI_OK;
}

static void set_up(struct job *job, uint32_t wheelset) {
    const struct arguments *a = job->a;
    modes_name(job->model, &job->names);
    critical_vehicle_init(&job->vehicle, job->model, &job->names, wheelset);
    job->vehicle.progress = &job->progress;
    job->search.vehicle = &job->vehicle;
    job->search.system = critical_system(&job->vehicle);
    job->search.limits = (struct cycle_limits){.rest = REST_SHARE * a->aside_m,
                                               .tolerance = a->tolerance,
                                               .longest_s = a->settle_s,
                                               .averaged = AVERAGED};
    job->search.near_m_s = a->near_m_s;
    job->search.aside_m = a->aside_m;
    job->search.result = &job->result;
    job->result.name = job->model->name;
    job->result.wheelset = job->model->wheelsets[wheelset].name;
    job->result.step_s = (double)job->model->step_s;
    job->result.longest_s = a->settle_s;
    job->result.rest_m = job->search.limits.rest;
}

static int find_all(struct job *job) {
    struct range range = {0.0, 0.0, DEFAULT_STEP};
    int status = find_linear(job);
    status = status == CLI_OK ? choose_range(job, &range) : status;
    if (status == CLI_OK && !job->a->linear) {
        job->search.low_m_s = job->result.low_m_s = range.low;
        job->search.high_m_s = job->result.high_m_s = range.high;
        job->search.step_m_s = range.step;
        job->result.followed = true;
        status = critical_follow(&job->search);
        if (status == CLI_OK && job->a->threshold) {
            critical_thresholds(&job->search);
        }
    }
    return status;
}

static int perform(struct job *job) {
    const struct arguments *a = job->a;
    struct range range = {0.0, 0.0, DEFAULT_STEP};
    struct cli_output csv = {0};
    uint32_t wheelset = 0;
    int status = a->speeds != NULL ? parse_range(a->speeds, &range) : CLI_OK;
    status = status == CLI_OK ? find_wheelset(job->model, a->wheelset, &wheelset) : status;
    if (status == CLI_OK && a->csv != NULL) {
        status = cli_output_open(&csv, a->csv);
    }
    if (status != CLI_OK) {
        return status;
    }
    cli_progress_begin(&job->progress);
    set_up(job, wheelset);
    status = find_all(job);
    cli_progress_end(&job->progress);
    return status == CLI_OK ? show(job, &csv) : cli_output_close(&csv, status);
}

/* ---- the command ---- */

static int open_model(struct cli_model *m, const struct arguments *a) {
    double curvature = 0.0;
    double cant = 0.0;
    int status = cli_model_load(m, &a->target);
    if (status != CLI_OK) {
        return status;
    }
    status = cli_model_step(m, a->step_s);
    if (status != CLI_OK) {
        cli_model_close(m);
        return status;
    }
    cli_model_hold_speed(m);
    status = cli_model_layout(m, a->at_m, &curvature, &cant);
    return status == CLI_OK ? cli_model_endless(m, curvature, cant) : status;
}

static int run(struct cli_model *m, const struct arguments *a) {
    struct job *job = calloc(1, sizeof *job);
    int status = CLI_OK;
    if (job != NULL) {
        job->model = &m->model;
        job->a = a;
        job->result.point = calloc(CRITICAL_MOST_POINTS, sizeof job->result.point[0]);
        job->search.state = calloc(CRITICAL_MOST_POINTS, sizeof job->search.state[0]);
    }
    if (job == NULL || job->result.point == NULL || job->search.state == NULL) {
        status = cli_fail("out of memory");
    } else {
        status = perform(job);
    }
    if (job != NULL) {
        free(job->result.point);
        free(job->search.state);
    }
    free(job);
    return status;
}

static const char purpose[] =
    "The speeds at which a vehicle loses its stability, on straight track or in the curve where\n"
    "--at stands on TRACK (taken as endless; irregularities are left out).\n"
    "Linear: eigenvalues, as klingel modes --critical. Nonlinear: disturbed at the highest\n"
    "speed until it hunts, the vehicle is slowed down step by step, each time until its motion\n"
    "has settled; where it comes to rest, the end of hunting is bisected, always from the\n"
    "nearest cycle that stays, and below that end the disturbance is tried again. Hardly\n"
    "disturbed just above the linear critical speed, it shows what it grows into: a cycle that\n"
    "exists below that speed too (subcritical, hard) or one that begins there (supercritical,\n"
    "soft). Motions whose periods differ for good are irregular; what neither settles nor\n"
    "decays in time is said to be unsettled. --threshold also finds the unstable cycles: the\n"
    "amplitude that a disturbance must exceed to end in hunting.";

int cmd_critical(int argc, char **argv) {
    struct arguments a = {.step_s = CLI_NOT_GIVEN,
                          .aside_m = 5e-3,
                          .settle_s = 300.0,
                          .tolerance = 1e-5,
                          .near_m_s = 0.005};
    int status = CLI_OK;
    struct cli_option step =
        cli_time_option("--step", &a.step_s, 0.01,
                        "time step instead of the model's, 0.01ms..10ms: results are those of the\n"
                        "stepped model, and a finer step tells what the step does to them");
    step.low = 1e-5;
    struct cli_option settle =
        cli_time_option("--settle", &a.settle_s, 1e5,
                        "longest simulated time to settle in at one speed; default 300 s");
    settle.low = 1.0;
    const struct cli_option options[] = {
        {.name = "--speeds",
         .argument = "A:B:STEP",
         .kind = CLI_TEXT,
         .value = &a.speeds,
         .help = "where to look for hunting, from B down to A in m/s; STEP may be\n"
                 "left out: 1 m/s. Default: from 1.15 times the linear critical speed\n"
                 "(or 100 m/s) down to 5 m/s"},
        {.name = "--linear",
         .kind = CLI_FLAG,
         .value = &a.linear,
         .help = "the linear critical speeds alone"},
        {.name = "--threshold",
         .kind = CLI_FLAG,
         .value = &a.threshold,
         .help = "the unstable cycles as well (takes several times as long)"},
        {.name = "--wheelset",
         .argument = "NAME",
         .kind = CLI_TEXT,
         .value = &a.wheelset,
         .help = "whose lateral displacement is observed; default: the leading one"},
        step,
        {.name = "--disturbance",
         .argument = "Y",
         .kind = CLI_NUMBER,
         .value = &a.aside_m,
         .unit = "m",
         .low = 1e-5,
         .high = 0.1,
         .help = "all wheelsets aside by that much at the start; default 5 mm. Less than\n"
                 "0.002 of it is rest, twice that the weak disturbance"},
        settle,
        {.name = "--tolerance",
         .argument = "X",
         .kind = CLI_NUMBER,
         .value = &a.tolerance,
         .unit = "",
         .low = 1e-9,
         .high = 0.1,
         .help = "of a settled amplitude, relative; default 1e-5"},
        cli_speed_option("--near", &a.near_m_s, 1e-6,
                         "to what ends of hunting are bisected; default 0.005 m/s"),
        cli_place_option("--at", &a.at_m, "where on TRACK the curve is taken; default 0"),
        cli_maybe_file_option("--csv", &a.csv,
                              "the cycles as CSV, critical speeds as comments; without FILE, or\n"
                              "with -, to standard output in place of the text"),
        cli_plot_option(&a.plot, "amplitude and frequency over the speed. .png, .pdf or .svg"),
    };
    const struct cli_command command = {
        .takes_track = true,
        .purpose = purpose,
        .example = "klingel critical models/cooperrider_bogie.yaml --plot hunting.png\n"
                   "klingel critical models/two_axle_wagon.yaml --linear\n",
        .options = options,
        .n_options = sizeof options / sizeof options[0]};
    if (!cli_parse(&command, argc, argv, &a.target, &status)) {
        return status;
    }
    if (cli_is_stdout(a.csv) && cli_is_stdout(a.plot)) {
        return cli_misuse("--csv and --plot cannot both go to standard output");
    }
    struct cli_model m;
    status = open_model(&m, &a);
    if (status == CLI_OK) {
        status = run(&m, &a);
        cli_model_close(&m);
    }
    return status;
}
