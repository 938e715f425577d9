/* cmd_run.c - klingel run: a simulation as fast as possible. */
#include <inttypes.h>
#include <math.h>
#include <string.h>
#include <unistd.h>

#include "record.h"
#include "run_forces.h"
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
    const char *record;
    uint64_t record_every;
    const char *snapshot;
    double snapshot_s;
    const char *from_snapshot;
    struct cli_list initial;
    struct cli_list forces;
    struct cli_list input;
    struct cli_target target;
};

struct run {
    const struct kl_model *model;
    uint64_t n_steps;
    struct kl_state state;
    struct kl_input input;
    struct kl_output output;
    struct run_record record;
    struct run_forces forces;  /* of --forces */
    struct record_taker taker; /* of --record */
    uint64_t snapshot_tick;
    struct kl_state snapshot; /* of --snapshot, once its tick was reached */
    double start_m;
    double wall_s;
};

static int start(struct run *run, const struct arguments *a) {
    enum kl_status status =
        kl_init(run->model, &run->state, isnan(a->from_m) ? 0 : (kl_real)a->from_m,
                (kl_real)a->speed_m_s, cli_work());
    if (status != KL_OK) {
        return cli_fail("cannot start: %s", kl_status_text(status));
    }
    for (size_t i = 0; i < a->initial.n; i++) {
        int set = run_set_initial(run->model, &run->state, a->initial.item[i]);
        if (set != CLI_OK) {
            return set;
        }
    }
    kl_refresh(run->model, &run->state, cli_work());
    return CLI_OK;
}

/* The tick at which the snapshot is due. */
static int place_snapshot(struct run *run, const struct arguments *a) {
    const double step_s = (double)run->model->step_s;
    const uint64_t first = run->state.tick;
    const uint64_t last = first + run->n_steps;
    run->snapshot_tick = isnan(a->snapshot_s) ? last : (uint64_t)llround(a->snapshot_s / step_s);
    if (run->snapshot_tick < first || run->snapshot_tick > last) {
        return cli_misuse("--snapshot-at %g: this run goes from %g to %g s", a->snapshot_s,
                          (double)first * step_s, (double)last * step_s);
    }
    run->snapshot = run->state;
    return CLI_OK;
}

static int prepare(struct run *run, const struct arguments *a) {
    int begun = a->from_snapshot != NULL
                    ? run_snapshot_read(a->from_snapshot, run->model, &run->state)
                    : start(run, a);
    if (begun != CLI_OK) {
        return begun;
    }
    memset(&run->output, 0, sizeof run->output);
    kl_input_init(&run->input);
    run->input.speed_m_s = isnan(a->target_m_s) ? run->state.speed_m_s : (kl_real)a->target_m_s;
    if (run->model->running.free != 0 && !isnan(a->target_m_s)) {
        return cli_misuse("--speed-to: the speed of %s is free, no set-point moves it; see --input",
                          run->model->name);
    }
    for (size_t i = 0; i < a->input.n; i++) {
        int set = run_set_input(run->model, &run->input, a->input.item[i]);
        if (set != CLI_OK) {
            return set;
        }
    }
    double steps = a->time_s / (double)run->model->step_s;
    if (steps > MOST_STEPS) {
        return cli_misuse("--time %g: more than %g steps of %g s", a->time_s, MOST_STEPS,
                          (double)run->model->step_s);
    }
    run->n_steps = (uint64_t)llround(steps);
    kl_observe(run->model, &run->state, &run->input, &run->output, cli_work());
    run->start_m = (double)run->state.s_m;
    run_record_init(&run->record, run->model);
    run_record_add(&run->record, &run->output);
    return place_snapshot(run, a);
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

static void step(struct run *run, bool recorded) {
    if (recorded) {
        record_taker_step(&run->taker, &run->input);
    }
    kl_step(run->model, &run->state, &run->input, &run->output, cli_work());
    if (recorded) {
        record_taker_done(&run->taker, &run->state);
    }
    run_record_add(&run->record, &run->output);
    if (run->state.tick == run->snapshot_tick) {
        run->snapshot = run->state;
    }
}

static void write_row(const struct run *run, FILE *csv) {
    run_csv_row(csv, run->model, &run->output);
    run_forces_row(&run->forces, run->model, &run->state, &run->input, csv);
    fputc('\n', csv);
}

static void simulate(struct run *run, const struct arguments *a, FILE *csv) {
    double began = cli_seconds();
    double shown = began + PROGRESS_S;
    bool tty = isatty(STDERR_FILENO) != 0;
    if (csv != NULL) {
        run_csv_header(csv, run->model);
        run_forces_header(&run->forces, csv);
        fputc('\n', csv);
        write_row(run, csv);
    }
    for (uint64_t i = 1; i <= run->n_steps; i++) {
        step(run, a->record != NULL);
        if ((run->output.faults & KL_FAULTS_HOLD) != 0) {
            run->n_steps = i; /* nothing moves any more */
        }
        if (csv != NULL && (i % a->every == 0 || i == run->n_steps)) {
            write_row(run, csv);
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
           " steps of %g ms%s%s from s = %g m, %.2f m/s at the end (%.1f km/h)\n",
           run->model->name, simulated, run->n_steps, 1e3 * (double)run->model->step_s,
           a->from_snapshot != NULL ? " after " : "",
           a->from_snapshot != NULL ? a->from_snapshot : "", run->start_m,
           (double)run->state.speed_m_s, 3.6 * (double)run->state.speed_m_s);
    run_record_print(&run->record, stdout);
    printf("speed       %.0f x real time (%.3f s%s)\n",
           run->wall_s > 0.0 ? simulated / run->wall_s : 0.0, run->wall_s,
           a->csv != NULL ? ", writing the CSV included" : "");
    printf("model hash  %016" PRIx64 "\nstate hash  %016" PRIx64 "\n", run->model->hash,
           kl_state_hash(&run->state));
}

static int open_files(struct run *run, const struct arguments *a, struct cli_output *csv) {
    int status = CLI_OK;
    if (a->record != NULL) {
        status = record_taker_open(&run->taker, a->record, run->model, &a->target, &run->state,
                                   a->record_every);
    }
    if (status == CLI_OK && a->csv != NULL) {
        status = cli_output_open(csv, a->csv);
    }
    if (status != CLI_OK && a->record != NULL) {
        (void)record_close(&run->taker.writer, false, &run->state);
    }
    return status;
}

static int close_files(struct run *run, const struct arguments *a, struct cli_output *csv) {
    int status = cli_output_close(csv, CLI_OK);
    if (a->record != NULL) {
        int closed = record_close(&run->taker.writer, true, &run->state);
        status = status == CLI_OK ? closed : status;
    }
    if (status == CLI_OK && a->snapshot != NULL) {
        status = run->state.tick >= run->snapshot_tick
                     ? run_snapshot_write(a->snapshot, run->model, &run->snapshot)
                     : cli_fail("%s: not written, the run ended before", a->snapshot);
    }
    return status;
}

static int perform(const struct cli_model *m, const struct arguments *a) {
    static struct run run;
    struct cli_output csv = {0};
    char held[128];
    run.model = &m->model;
    int status = run_forces_choose(&run.forces, &m->file.vehicle, &a->forces);
    status = status == CLI_OK ? prepare(&run, a) : status;
    status = status == CLI_OK ? open_files(&run, a, &csv) : status;
    if (status != CLI_OK) {
        run_forces_free(&run.forces);
        return status;
    }
    simulate(&run, a, csv.file);
    run_forces_free(&run.forces);
    if (a->final_hash && !cli_is_stdout(a->csv)) {
        printf("%016" PRIx64 "\n", kl_state_hash(&run.state));
    } else if (!cli_is_stdout(a->csv)) {
        print_summary(&run, a);
    }
    status = close_files(&run, a, &csv);
    status = cli_flush(status);
    run_record_hold_text(&run.record, held, sizeof held);
    return status == CLI_OK && held[0] != '\0' ? cli_fail("the run ended %s", held) : status;
}

static int check(const struct arguments *a) {
    const bool resumed = a->from_snapshot != NULL;
    if (resumed && (!isnan(a->speed_m_s) || !isnan(a->from_m) || a->initial.n > 0)) {
        return cli_misuse("--from-snapshot and %s exclude each other: the snapshot holds that",
                          !isnan(a->speed_m_s) ? "--speed"
                          : !isnan(a->from_m)  ? "--from"
                                               : "--initial");
    }
    if (!isnan(a->snapshot_s) && a->snapshot == NULL) {
        return cli_misuse("--snapshot-at needs --snapshot FILE");
    }
    if (a->forces.n > 0 && a->csv == NULL) {
        return cli_misuse("--forces needs --csv, in whose columns they stand");
    }
    if (isnan(a->time_s) || (isnan(a->speed_m_s) && !resumed)) {
        return cli_misuse("%s is missing",
                          isnan(a->speed_m_s) && !resumed ? "--speed V" : "--time T");
    }
    return CLI_OK;
}

int cmd_run(int argc, char **argv) {
    struct arguments a = {.speed_m_s = CLI_NOT_GIVEN,
                          .target_m_s = CLI_NOT_GIVEN,
                          .from_m = CLI_NOT_GIVEN,
                          .time_s = CLI_NOT_GIVEN,
                          .every = 1,
                          .record_every = RECORD_EVERY,
                          .snapshot_s = CLI_NOT_GIVEN};
    int status = CLI_OK;
    const struct cli_option options[] = {
        cli_speed_option("--speed", &a.speed_m_s, 0.0,
                         "speed at the start, m/s or with a unit (72km/h); 0..150 m/s; needed"),
        cli_time_option("--time", &a.time_s, 1e9,
                        "simulated time, s or with a unit (5min); needed"),
        cli_speed_option("--speed-to", &a.target_m_s, 0.0,
                         "set-point of the speed, reached at the model's acceleration\n"
                         "limit; default: the speed at the start, or of the snapshot"),
        cli_place_option("--from", &a.from_m, "where on the track to start, m; default 0"),
        {.name = "--initial",
         .argument = "PART.COORDINATE=X",
         .kind = CLI_LIST,
         .value = &a.initial,
         .help = "start displaced, as often as wanted: front.y=3mm, front.yaw=1mrad,\n"
                 "body.y=10mm, body.roll_rate=0.1; SI or with a unit. For wheelsets y,\n"
                 "yaw, y_rate, yaw_rate, spin; for bodies y, z, roll, pitch, yaw and\n"
                 "their rates; rates relative to the track. Default: at rest, centred"},
        {.name = "--input",
         .argument = "NAME=X",
         .kind = CLI_LIST,
         .value = &a.input,
         .help = "an input of all steps, as often as wanted, SI, named as in recordings:\n"
                 "front.axle_torque_Nm=2000, body.side_force_N=1e4, actuator_1_N=500,\n"
                 "front.left.friction_factor=0.3; where the speed is free draw_force_N"},
        cli_maybe_file_option("--csv", &a.csv,
                              "states and forces as CSV in SI units; without FILE, or with -, to\n"
                              "standard output in place of the summary"),
        {.name = "--forces",
         .argument = "NAME",
         .kind = CLI_LIST,
         .value = &a.forces,
         .help = "with --csv: the forces of this element or linkage as columns, as often\n"
                 "as wanted; all of them: all. Changes from the vehicle at rest; positive\n"
                 "pulls the first end back. A mirrored pair needs no _r and _l"},
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
        cli_file_option("--record", &a.record,
                        "record all inputs with their steps, for klingel replay and diff"),
        record_every_option(&a.record_every),
        cli_file_option("--snapshot", &a.snapshot,
                        "write the state at the end, or at --snapshot-at, to be gone on from:\n"
                        "kl_snapshot's bytes, for any process or target with the same model"),
        cli_time_option("--snapshot-at", &a.snapshot_s, 1e9,
                        "when, in the model's time, s or with a unit; the nearest step"),
        cli_file_option("--from-snapshot", &a.from_snapshot,
                        "start from a snapshot, in place of --speed, --from and --initial; what\n"
                        "follows are the bits of a run without a break. A state does not hold\n"
                        "the set-point: give --speed-to again"),
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
    status = check(&a);
    if (status != CLI_OK) {
        return status;
    }
    struct cli_model m;
    status = cli_model_open(&m, &a.target);
    if (status == CLI_OK) {
        status = perform(&m, &a);
        cli_model_close(&m);
    }
    return status;
}
