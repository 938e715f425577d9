/* cmd_run.c - klingel run: a simulation as fast as possible. */
#include <inttypes.h>
#include <math.h>
#include <string.h>
#include <unistd.h>

#include "run_record.h"

#define MOST_STEPS 1e12
#define PROGRESS_STEPS 20000u /* between two looks at the clock */
#define PROGRESS_S 0.25

struct arguments {
    double speed_m_s;
    double target_m_s;
    double time_s;
    double from_m;
    uint64_t every;
    const char *csv;
    bool final_hash;
    struct cli_list initial;
    struct cli_target target;
};

struct run {
    const struct kl_model *model;
    uint64_t n_steps;
    struct kl_state state;
    struct kl_input input;
    struct kl_output output;
    struct run_record record;
    double wall_s;
};

static int prepare(struct run *run, const struct arguments *a) {
    kl_real rates[KL_MAX_STATES];
    memset(&run->output, 0, sizeof run->output);
    kl_input_init(&run->input);
    run->input.speed_m_s = (kl_real)(isnan(a->target_m_s) ? a->speed_m_s : a->target_m_s);
    enum kl_status status =
        kl_init(run->model, &run->state, (kl_real)a->from_m, (kl_real)a->speed_m_s);
    if (status != KL_OK) {
        return cli_fail("cannot start: %s", kl_status_text(status));
    }
    for (size_t i = 0; i < a->initial.n; i++) {
        int set = run_set_initial(run->model, &run->state, a->initial.item[i]);
        if (set != CLI_OK) {
            return set;
        }
    }
    kl_refresh(run->model, &run->state);
    double steps = a->time_s / (double)run->model->step_s;
    if (steps > MOST_STEPS) {
        return cli_misuse("--time %g: more than %g steps of %g s", a->time_s, MOST_STEPS,
                          (double)run->model->step_s);
    }
    run->n_steps = (uint64_t)llround(steps);
    kl_rates(run->model, &run->state, &run->input, rates, &run->output);
    run_record_init(&run->record, run->model);
    run_record_add(&run->record, &run->output);
    return CLI_OK;
}

static void show_progress(const struct run *run, uint64_t done, double began, double *shown) {
    double now = cli_seconds();
    if (now - *shown < PROGRESS_S) {
        return;
    }
    *shown = now;
    double share = (double)done / (double)run->n_steps;
    fprintf(stderr, "\r%5.1f %%  %.1f s simulated, %.0f s to go ", 100.0 * share,
            (double)done * (double)run->model->step_s, (now - began) * (1.0 / share - 1.0));
}

static void simulate(struct run *run, uint64_t every, FILE *csv) {
    double began = cli_seconds();
    double shown = began + PROGRESS_S;
    bool tty = isatty(STDERR_FILENO) != 0;
    if (csv != NULL) {
        run_csv_header(csv, run->model);
        run_csv_row(csv, run->model, &run->output);
    }
    for (uint64_t i = 1; i <= run->n_steps; i++) {
        kl_step(run->model, &run->state, &run->input, &run->output);
        run_record_add(&run->record, &run->output);
        if ((run->output.faults & KL_FAULTS_HOLD) != 0) {
            run->n_steps = i; /* nothing moves any more */
        }
        if (csv != NULL && (i % every == 0 || i == run->n_steps)) {
            run_csv_row(csv, run->model, &run->output);
        }
        if (tty && i % PROGRESS_STEPS == 0) {
            show_progress(run, i, began, &shown);
        }
    }
    run->wall_s = cli_seconds() - began;
    if (tty && shown > began + PROGRESS_S) {
        fprintf(stderr, "\r%60s\r", "");
    }
}

static void print_summary(const struct run *run, const struct arguments *a) {
    double simulated = (double)run->n_steps * (double)run->model->step_s;
    printf("%s: %g s in %" PRIu64
           " steps of %g ms from s = %g m, %.2f m/s at the end (%.1f km/h)\n",
           run->model->name, simulated, run->n_steps, 1e3 * (double)run->model->step_s, a->from_m,
           (double)run->state.speed_m_s, 3.6 * (double)run->state.speed_m_s);
    run_record_print(&run->record, stdout);
    printf("speed       %.0f x real time (%.3f s%s)\n",
           run->wall_s > 0.0 ? simulated / run->wall_s : 0.0, run->wall_s,
           a->csv != NULL ? ", writing the CSV included" : "");
    printf("model hash  %016" PRIx64 "\nstate hash  %016" PRIx64 "\n", run->model->hash,
           kl_state_hash(&run->state));
}

static int perform(const struct kl_model *model, const struct arguments *a) {
    struct run run = {.model = model};
    struct cli_output csv = {0};
    char held[128];
    int status = prepare(&run, a);
    if (status == CLI_OK && a->csv != NULL) {
        status = cli_output_open(&csv, a->csv);
    }
    if (status != CLI_OK) {
        return status;
    }
    simulate(&run, a->every, csv.file);
    if (a->final_hash && !cli_is_stdout(a->csv)) {
        printf("%016" PRIx64 "\n", kl_state_hash(&run.state));
    } else if (!cli_is_stdout(a->csv)) {
        print_summary(&run, a);
    }
    status = cli_output_close(&csv, CLI_OK);
    status = cli_flush(status);
    run_record_hold_text(&run.record, held, sizeof held);
    return status == CLI_OK && held[0] != '\0' ? cli_fail("the run ended %s", held) : status;
}

int cmd_run(int argc, char **argv) {
    struct arguments a = {.speed_m_s = CLI_NOT_GIVEN,
                          .target_m_s = CLI_NOT_GIVEN,
                          .time_s = CLI_NOT_GIVEN,
                          .every = 1};
    int status = CLI_OK;
    const struct cli_option options[] = {
        cli_speed_option("--speed", &a.speed_m_s, 0.0,
                         "speed at the start, m/s or with a unit (72km/h); 0..150 m/s; needed"),
        cli_time_option("--time", &a.time_s, 1e9,
                        "simulated time, s or with a unit (5min); needed"),
        cli_speed_option("--speed-to", &a.target_m_s, 0.0,
                         "set-point of the speed, reached at the model's acceleration\n"
                         "limit; default: the speed at the start"),
        cli_place_option("--from", &a.from_m, "where on the track to start, m; default 0"),
        {.name = "--initial",
         .argument = "PART.COORDINATE=X",
         .kind = CLI_LIST,
         .value = &a.initial,
         .help = "start displaced, as often as wanted: front.y=3mm, front.yaw=1mrad,\n"
                 "body.y=10mm, body.roll_rate=0.1; SI or with a unit. For wheelsets y,\n"
                 "yaw, y_rate, yaw_rate, spin; for bodies y, z, roll, pitch, yaw and\n"
                 "their rates; rates relative to the track. Default: at rest, centred"},
        cli_maybe_file_option("--csv", &a.csv,
                              "states and forces as CSV in SI units; without FILE, or with -, to\n"
                              "standard output in place of the summary"),
        {.name = "--every",
         .argument = "N",
         .kind = CLI_COUNT,
         .value = &a.every,
         .low = 1,
         .high = 1e9,
         .help = "write every Nth step to the CSV; default 1"},
        {.name = "--final-hash",
         .kind = CLI_FLAG,
         .value = &a.final_hash,
         .help = "print nothing but the hash of the last state, for regression tests"},
    };
    const struct cli_command command = {
        .takes_track = true,
        .purpose =
            "Simulates a vehicle on a track (default: straight, level, smooth) as fast as "
            "possible.\n"
            "Prints extremes of motion and forces, faults, the speed against real time, and the\n"
            "hash of the last state, which is the same on every machine. Exit status 1 if the run\n"
            "ended early because the vehicle derailed or its state became infinite.",
        .example = "klingel run models/two_axle_wagon.yaml models/demo_track.yaml --speed 27 \\\n"
                   "    --time 30 --csv run.csv --every 10\n",
        .options = options,
        .n_options = sizeof options / sizeof options[0]};
    if (!cli_parse(&command, argc, argv, &a.target, &status)) {
        return status;
    }
    if (isnan(a.speed_m_s) || isnan(a.time_s)) {
        return cli_misuse("%s is missing", isnan(a.speed_m_s) ? "--speed V" : "--time T");
    }
    struct cli_model m;
    status = cli_model_open(&m, &a.target);
    if (status == CLI_OK) {
        status = perform(&m.model, &a);
        cli_model_close(&m);
    }
    return status;
}
