/* cmd_hil.c - klingel hil: a vehicle in real time on a CAN bus. */
#include <math.h>
#include <signal.h>
#include <string.h>

#include "cli_bus.h"
#include "hil_session.h"
#include "kl_dbc.h"

struct arguments {
    const char *bus;
    double speed_m_s;
    double from_m;
    double time_s;
    int clock;
    int policy;
    uint64_t priority;
    uint64_t cpu;
    const char *report;
    const char *dbc;
    const char *record;
    uint64_t record_every;
    bool start;
    struct cli_bus layout;
    struct cli_target target;
};

#define ANY_CPU 100000u
#define MAX_CPU 1023

static struct hil_session session; /* large, and a signal handler must reach it */

static void on_signal(int number) {
    (void)number;
    kl_realtime_stop(&session.loop);
}

static void catch_signals(void) {
    struct sigaction action;
    memset(&action, 0, sizeof action);
    action.sa_handler = on_signal;
    sigemptyset(&action.sa_mask);
    (void)sigaction(SIGINT, &action, NULL);
    (void)sigaction(SIGTERM, &action, NULL);
    (void)signal(SIGPIPE, SIG_IGN);
}

static int prepare_node(const struct kl_model *model, const struct arguments *a) {
    struct kl_node_observer observer = {0};
    if (a->record != NULL) {
        observer = (struct kl_node_observer){.told = hil_record_told, .context = &session.record};
    }
    kl_input_init(&session.input);
    const struct kl_node_config config = {.model = model,
                                          .state = &session.state,
                                          .input = &session.input,
                                          .output = &session.output,
                                          .snapshot = &session.snapshot,
                                          .work = &session.work,
                                          .can = session.bus.can,
                                          .start_s_m = (kl_real)a->from_m,
                                          .start_speed_m_s = (kl_real)a->speed_m_s,
                                          .state_divider = (uint32_t)a->layout.divider,
                                          .bit_rate = (uint32_t)a->layout.bit_rate,
                                          .lockstep = a->clock == HIL_LOCKSTEP,
                                          .start_running = a->start,
                                          .observer = observer};
    char load[160];
    enum kl_status status = kl_node_init(&session.node, &config);
    if (status == KL_ERR_VALUE && session.node.load.verdict == KL_LOAD_EXCEEDED) {
        cli_bus_load_text(&session.node.load, a->layout.bit_rate, load, sizeof load);
        return cli_fail("--bit-rate %llu: the bus would carry %s; raise --state-divider",
                        (unsigned long long)a->layout.bit_rate, load);
    }
    return status == KL_OK ? CLI_OK : cli_fail("cannot start: %s", kl_status_text(status));
}

static int prepare_loop(const struct kl_model *model, const struct arguments *a,
                        kl_realtime_callback callback) {
    const double cycles = a->time_s / (double)model->step_s;
    const struct kl_realtime_options options = {.period_ns = model->step_ns,
                                                .ticks = (uint64_t)llround(cycles),
                                                .policy = (enum kl_realtime_policy)a->policy,
                                                .priority = (int)a->priority,
                                                .cpu = a->cpu == ANY_CPU ? -1 : (int)a->cpu,
                                                .callback = callback,
                                                .context = &session,
                                                .warnings = stderr};
    session.clock = (enum hil_clock)a->clock;
    session.cycles_wanted = options.ticks;
    return kl_realtime_init(&session.loop, &options) == KL_REALTIME_DONE
               ? CLI_OK
               : cli_fail("the real-time loop does not take these options");
}

static void print_start(const struct arguments *a) {
    char load[160];
    cli_bus_load_text(&session.node.load, a->layout.bit_rate, load, sizeof load);
    hil_bus_print(&session.bus, stdout);
    printf("     %s\n", load);
    printf("%s: %s at %g m/s, clock %s%s; Ctrl-C ends\n", session.node.config.model->name,
           a->start ? "running" : "waits for the start command", a->speed_m_s,
           a->clock == HIL_LOCKSTEP ? "lockstep: one step per SYNC (0x080)" : "realtime",
           a->time_s > 0.0 ? ", for a limited time" : "");
    fflush(stdout);
    if (session.node.load.verdict == KL_LOAD_HIGH) {
        cli_warn("the bus load is high: late and dropped frames are to be expected");
    }
}

static int run(const struct kl_model *model, const struct arguments *a) {
    struct cli_output report = {0};
    int status = prepare_loop(model, a, hil_session_tick);
    status = status == CLI_OK ? hil_bus_open(&session.bus, a->bus) : status;
    if (status != CLI_OK) {
        return status;
    }
    status = prepare_node(model, a);
    if (status == CLI_OK && a->report != NULL) {
        status = cli_output_open(&report, a->report); /* now: not after an hour of running */
    }
    if (status == CLI_OK && a->record != NULL) {
        status = hil_record_open(&session.record, a->record, model, &a->target, &session.state,
                                 a->record_every, HIL_RECORD_WORDS, true);
        session.recorded = status == CLI_OK;
        if (status != CLI_OK && a->report != NULL) {
            (void)cli_output_close(&report, status);
        }
    }
    if (status == CLI_OK) {
        print_start(a);
        hil_status_begin(&session);
        hil_session_run(&session);
        hil_status_end();
        int written = session.recorded ? hil_record_close(&session.record, &session.state) : CLI_OK;
        hil_report_text(&session, stdout);
        status = written;
        if (session.loop.end == KL_REALTIME_HALTED || session.loop.end == KL_REALTIME_FAILED) {
            status = cli_fail("%s", kl_realtime_end_text(session.loop.end));
        }
        status = cli_flush(status);
        if (a->report != NULL) {
            hil_report_json(&session, report.file);
            written = cli_output_close(&report, CLI_OK);
            status = status == CLI_OK ? written : status;
        }
    }
    kl_can_close(&session.bus.can);
    return status;
}

static int perform(struct cli_model *m, const struct arguments *a) {
    int status = cli_model_load(m, &a->target);
    if (status != CLI_OK) {
        return status;
    }
    if (a->dbc != NULL && (status = cli_bus_write(m, &a->layout, a->dbc, kl_dbc_write)) != CLI_OK) {
        cli_model_close(m);
        return status;
    }
    status = cli_model_build(m);
    if (status == CLI_OK) {
        catch_signals();
        status = run(&m->model, a);
        cli_model_close(m);
    }
    return status;
}

int cmd_hil(int argc, char **argv) {
    struct arguments a = {.bus = "auto",
                          .priority = KL_REALTIME_PRIORITY,
                          .cpu = ANY_CPU,
                          .record_every = RECORD_EVERY,
                          .layout = {.divider = 1}};
    int status = CLI_OK;
    const struct cli_option options[] = {
        {.name = "--bus",
         .argument = "BUS",
         .kind = CLI_TEXT,
         .value = &a.bus,
         .help = "socketcand[:PORT]: a server on 127.0.0.1, port 29536 if none is given,\n"
                 "any free one for 0; slcan[:PATH]: a pty that is used as an slcan adapter,\n"
                 "linked from PATH; or a CAN interface such as vcan0; or auto\n"
                 "(default): vcan0 if there is one, else socketcand"},
        {.name = "--start",
         .kind = CLI_FLAG,
         .value = &a.start,
         .help = "run at once; default: wait for the start command on the bus"},
        cli_speed_option("--speed", &a.speed_m_s, 0.0,
                         "speed at the start and set-point until the bus commands another,\n"
                         "m/s or with a unit (72km/h); default 0"),
        cli_place_option("--from", &a.from_m, "where on the track to start, m; default 0"),
        cli_time_option("--time", &a.time_s, 1e8,
                        "end after T, s or with a unit; default 0, never"),
        {.name = "--clock",
         .argument = "realtime|lockstep",
         .kind = CLI_CHOICE,
         .value = &a.clock,
         .help = "realtime (default): the machine's clock; lockstep: one step for each\n"
                 "SYNC frame (identifier 0x080), at whatever speed they come"},
        {.name = "--policy",
         .argument = "skip|catch-up|halt",
         .kind = CLI_CHOICE,
         .value = &a.policy,
         .help = "what to do about missed ticks: leave them out (default), do them at\n"
                 "once, or end"},
        {.name = "--priority",
         .argument = "N",
         .kind = CLI_COUNT,
         .value = &a.priority,
         .low = 0,
         .high = 99,
         .help = "SCHED_FIFO priority, default 80; 0 leaves scheduling and memory alone"},
        {.name = "--cpu",
         .argument = "N",
         .kind = CLI_COUNT,
         .value = &a.cpu,
         .low = 0,
         .high = MAX_CPU,
         .help = "stay on this processor; default any"},
        cli_divider_option(&a.layout),
        cli_bit_rate_option(&a.layout),
        cli_file_option("--report", &a.report,
                        "the timing report with histograms and all counts as JSON"),
        cli_file_option("--record", &a.record,
                        "record all inputs with their steps, for klingel replay and diff;\n"
                        "written beside the loop, which never waits for it"),
        record_every_option(&a.record_every),
        cli_file_option("--dbc", &a.dbc, "write the DBC of this bus first, as klingel dbc does"),
    };
    const struct cli_command command = {
        .takes_track = true,
        .purpose =
            "Runs a vehicle in real time on a CAN bus: its states go out in the messages that\n"
            "klingel signals describes; run control and speed set-points are taken from it. A bus\n"
            "that goes away, a client that dies, garbage: counted, never a lost step. Ctrl-C or\n"
            "SIGTERM ends it, with a timing report.",
        .example =
            "klingel hil models/two_axle_wagon.yaml models/demo_track.yaml --speed 27 --start\n",
        .options = options,
        .n_options = sizeof options / sizeof options[0]};
    if (!cli_parse(&command, argc, argv, &a.target, &status)) {
        return status;
    }
    static struct cli_model m;
    return perform(&m, &a);
}
