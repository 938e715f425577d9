/* cmd_critical.c - klingel critical: where a vehicle begins to hunt, and where it stops. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli_plot.h"
#include "critical_report.h"
#include "critical_vehicle.h"
#include "modes_critical.h"

#define TWO_PI 6.283185307179586
#define SCAN_LOW 1.0         /* m/s */
#define ABOVE_LINEAR 1.15    /* times the linear critical speed: where the search begins */
#define WITHOUT_LINEAR 100.0 /* m/s, if there is none */
#define BELOW 0.4            /* of the highest speed: where it ends */
#define DEFAULT_STEP 1.0     /* m/s */
#define AVERAGED 4u          /* periods */
#define AT_ONCE 0.3          /* of the largest amplitude: a smaller last cycle is no hard loss */

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
    struct cycle_system system;
    struct cycle_limits limits;
    struct cli_progress progress;
    struct critical_result result;
    struct kl_state *state; /* of each point of the result */
    char doing[64];
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

/* ---- down the branch of stable cycles ---- */

static struct critical_point *add_point(struct job *job, double speed_m_s,
                                        const struct cycle *cycle, const struct kl_state *state) {
    struct critical_result *r = &job->result;
    struct critical_point *point = &r->point[r->n];
    *point = (struct critical_point){.speed_m_s = speed_m_s, .cycle = *cycle};
    job->state[r->n++] = *state;
    return point;
}

static void say_doing(struct job *job, const char *what, double speed_m_s) {
    snprintf(job->doing, sizeof job->doing, "%s at %.4g m/s", what, speed_m_s);
    job->vehicle.doing = job->doing;
}

/* The highest speed at which a disturbance ends in a cycle. */
static int find_start(struct job *job, const struct range *range, double *speed,
                      struct kl_state *state) {
    for (*speed = range->high; *speed >= range->low; *speed -= range->step) {
        struct cycle cycle;
        say_doing(job, "disturbed", *speed);
        int status = critical_start(&job->vehicle, *speed, job->a->aside_m, state);
        if (status != CLI_OK) {
            return status;
        }
        cycle_settle(&job->system, &job->limits, state, &cycle);
        add_point(job, *speed, &cycle, state);
        if (cycle.end == CYCLE_STAYS || cycle.end == CYCLE_UNSETTLED) {
            return CLI_OK;
        }
    }
    *speed = 0.0;
    return CLI_OK;
}

static int find_fold(struct job *job, double low, double high, const struct critical_point *last,
                     struct kl_state *state) {
    struct critical_result *r = &job->result;
    say_doing(job, "end of hunting", high);
    r->fold = last->cycle;
    r->fold_low_m_s = low;
    r->fold_m_s = high;
    job->system.retune(job->system.context, state, high);
    r->has_fold = cycle_fold(&job->system, &job->limits, job->a->near_m_s, &r->fold_low_m_s,
                             &r->fold_m_s, state, &r->fold);
    return CLI_OK;
}

static int follow(struct job *job, const struct range *range) {
    struct kl_state state;
    double speed = 0.0;
    int status = find_start(job, range, &speed, &state);
    if (status != CLI_OK || speed == 0.0) {
        return status;
    }
    double count = floor((speed - range->low) / range->step + 1e-9);
    const double from = speed;
    for (double i = 1.0; i <= count; i += 1.0) {
        const struct critical_point *last = &job->result.point[job->result.n - 1];
        const double next = from - i * range->step;
        struct kl_state here = state;
        struct cycle cycle;
        say_doing(job, "hunting", next);
        job->system.retune(job->system.context, &here, next);
        cycle_settle(&job->system, &job->limits, &here, &cycle);
        if (cycle.end == CYCLE_REST) {
            return find_fold(job, next, speed, last, &state);
        }
        add_point(job, next, &cycle, &here);
        if (cycle.end == CYCLE_LOST) {
            return CLI_OK;
        }
        speed = next;
        state = here;
    }
    return CLI_OK;
}

/* The unstable cycles at the speeds between the end of the stable ones and the linear critical
 * speed. */
static void find_thresholds(struct job *job) {
    struct critical_result *r = &job->result;
    const size_t stable = r->n;
    for (size_t i = 0; i < stable; i++) {
        const struct critical_point *p = &r->point[i];
        struct cycle cycle;
        if (p->cycle.end != CYCLE_STAYS ||
            (r->linear.n > 0 && p->speed_m_s >= r->linear.crossing[0].speed_m_s) ||
            r->n == CRITICAL_MOST_POINTS) {
            continue;
        }
        say_doing(job, "threshold", p->speed_m_s);
        if (cycle_unstable(&job->system, &job->limits, &job->state[i], p->cycle.amplitude,
                           &cycle)) {
            add_point(job, p->speed_m_s, &cycle, &job->state[i])->unstable = true;
        }
    }
}

/* ---- what it means ---- */

static void print_verdict(const struct critical_result *r) {
    const bool linear = r->linear.n > 0 && r->linear.stable_at_low;
    if (!r->has_fold || !linear) {
        return;
    }
    const double critical = r->linear.crossing[0].speed_m_s;
    double above = 0.0;
    for (size_t i = 0; i < r->n; i++) {
        above = r->point[i].unstable ? above : fmax(above, r->point[i].cycle.amplitude);
    }
    if (r->fold_m_s < critical && r->fold.amplitude > AT_ONCE * above) {
        printf("hard loss of stability: between %.2f and %.2f m/s the vehicle runs steadily or "
               "hunts, by the disturbance\n",
               r->fold_m_s, critical);
    } else if (r->fold_m_s < critical) {
        printf("hunting with small amplitudes goes on down to %.2f m/s, below the linear critical "
               "speed\n",
               r->fold_m_s);
    } else {
        printf("soft loss of stability: hunting begins at the linear critical speed and grows "
               "with the speed\n");
    }
}

static int show(struct job *job, struct cli_output *csv) {
    const struct arguments *a = job->a;
    if (csv->file != NULL) {
        critical_csv(csv->file, &job->result);
    }
    if (!cli_is_stdout(a->csv)) {
        critical_print(&job->result);
        print_verdict(&job->result);
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
    range->low = fmax(1.0, floor(BELOW * range->high));
    return CLI_OK;
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
    modes_name(job->model, &job->names);
    cli_progress_begin(&job->progress);
    critical_vehicle_init(&job->vehicle, job->model, &job->names, wheelset);
    job->vehicle.progress = &job->progress;
    job->system = critical_system(&job->vehicle);
    job->limits = (struct cycle_limits){.rest = 0.01 * a->aside_m,
                                        .tolerance = a->tolerance,
                                        .longest_s = a->settle_s,
                                        .averaged = AVERAGED};
    job->result.name = job->model->name;
    job->result.wheelset = job->model->wheelsets[wheelset].name;
    job->result.step_s = (double)job->model->step_s;
    status = find_linear(job);
    status = status == CLI_OK ? choose_range(job, &range) : status;
    if (status == CLI_OK && !a->linear) {
        status = follow(job, &range);
        if (status == CLI_OK && a->threshold) {
            find_thresholds(job);
        }
    }
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
        job->state = calloc(CRITICAL_MOST_POINTS, sizeof job->state[0]);
    }
    if (job == NULL || job->result.point == NULL || job->state == NULL) {
        status = cli_fail("out of memory");
    } else {
        status = perform(job);
    }
    if (job != NULL) {
        free(job->result.point);
        free(job->state);
    }
    free(job);
    return status;
}

static const char purpose[] =
    "The speeds at which a vehicle loses its stability, on straight track or in the curve where\n"
    "--at stands on TRACK (taken as endless; irregularities are left out).\n"
    "Linear: eigenvalues, by bisection, as klingel modes --critical. Nonlinear: the vehicle is\n"
    "disturbed at the highest speed until it hunts, then slowed down step by step, each time\n"
    "until the limit cycle has settled; where it decays, the speed at which hunting ends is\n"
    "bisected, always from the nearest cycle that stays. --threshold also finds the unstable\n"
    "cycles: the amplitude that a disturbance must exceed to end in hunting.";

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
                 "(or 100 m/s) down to 0.4 times that"},
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
         .help = "all wheelsets aside by that much at the start; default 5 mm. Less than a\n"
                 "hundredth of it is rest"},
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
                         "to what the end of hunting is bisected; default 0.005 m/s"),
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
