/* cmd_diff.c - klingel diff: where two recordings or two CSV files part. */
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "diff_table.h"
#include "replay.h"

struct arguments {
    double absolute;
    double relative;
    const char *model;
    const char *track;
    struct cli_target target; /* vehicle and track: A and B */
};

/* Two recordings done again beside each other. Large. */
struct both {
    struct replay a;
    struct replay b;
    struct state_signal signal[STATE_MAX_SIGNALS];
    struct diff_signal signals[STATE_MAX_SIGNALS];
    double value_a[STATE_MAX_SIGNALS];
    double value_b[STATE_MAX_SIGNALS];
    uint64_t input_step; /* steps after which an input is not the same, and which; only if so: */
    uint32_t input;
    bool inputs_differ;
};

/* ---- what can be said before ---- */

static int check_shape(struct both *p) {
    const struct kl_model *a = &p->a.m.model;
    const struct kl_model *b = &p->b.m.model;
    static struct state_signal other[STATE_MAX_SIGNALS];
    const uint32_t n = state_signals(a, p->signal);
    if (state_signals(b, other) != n || a->step_ns != b->step_ns) {
        return cli_fail("%s and %s are of vehicles that cannot be compared: %" PRIu32
                        " and %" PRIu32 " states, steps of %" PRId64 " and %" PRId64 " ns",
                        p->a.reader.path, p->b.reader.path, a->n_states, b->n_states, a->step_ns,
                        b->step_ns);
    }
    for (uint32_t i = 0; i < n; i++) {
        if (strcmp(p->signal[i].name, other[i].name) != 0) {
            return cli_fail("%s and %s are of vehicles that cannot be compared: %s in one is %s in "
                            "the other",
                            p->a.reader.path, p->b.reader.path, p->signal[i].name, other[i].name);
        }
    }
    return CLI_OK;
}

static void print_models(const struct both *p) {
    const struct kl_model *a = &p->a.m.model;
    const struct kl_model *b = &p->b.m.model;
    if (a->hash != b->hash) {
        printf("models      differ: %s %016" PRIx64 " and %s %016" PRIx64 "\n", a->name, a->hash,
               b->name, b->hash);
    }
}

/* ---- step by step ---- */

static void compare_inputs(struct both *p) {
    for (uint32_t i = 0; i < p->a.inputs.n && i < p->b.inputs.n && !p->inputs_differ; i++) {
        const kl_real a = record_input_get(&p->a.inputs, &p->a.input, i);
        const kl_real b = record_input_get(&p->b.inputs, &p->b.input, i);
        if (memcmp(&a, &b, sizeof a) != 0) {
            char name[RECORD_INPUT_NAME];
            record_input_name(&p->a.m.model, i, name);
            printf("inputs      part in step %" PRIu64 ": %s %.17g against %.17g\n", p->a.steps,
                   name, (double)a, (double)b);
            p->inputs_differ = true;
        }
    }
}

static void compare_states(struct both *p, struct diff_table *t, uint64_t step) {
    if (memcmp(&p->a.state, &p->b.state, sizeof p->a.state) == 0) {
        t->rows++; /* the usual case */
        return;
    }
    state_values(&p->a.m.model, &p->a.state, p->value_a);
    state_values(&p->b.m.model, &p->b.state, p->value_b);
    diff_row(t, step, p->value_a, p->value_b);
}

/* A recording that this program does not repeat was made by another one: that is said. */
static bool print_faithful(const struct replay *p, enum replay_result result) {
    if (result == REPLAY_CUT) {
        printf("%s: %s; good up to step %" PRIu64 "\n", p->reader.path, p->reader.why, p->steps);
    } else if (result == REPLAY_BAD) {
        printf("%s:%" PRIu64 ": the recorded state does not fit the model\n", p->reader.path,
               p->reader.line - 1);
    }
    if (p->parted > 0) {
        printf("%s: this program does not give the recorded bits after step %" PRIu64
               " (klingel replay says more)\n",
               p->reader.path, p->good_step);
    } else if (result == REPLAY_END && p->end_hash != kl_state_hash(&p->state)) {
        printf("%s: this program does not give the recorded bits at the end (klingel replay)\n",
               p->reader.path);
    } else {
        return result == REPLAY_END || result == REPLAY_STEP;
    }
    return false;
}

static int compare(struct both *p, const struct arguments *a) {
    struct diff_table t = {
        .row = "step", .absolute = a->absolute, .relative = a->relative, .signals = p->signals};
    int status = check_shape(p);
    if (status != CLI_OK) {
        return status;
    }
    t.n = 4u + 2u * p->a.m.model.n_states + 3u * KL_SIDES * p->a.m.model.n_wheelsets;
    for (size_t i = 0; i < t.n; i++) {
        p->signals[i] = (struct diff_signal){
            .name = p->signal[i].name, .unit = p->signal[i].unit, .scale = p->signal[i].scale};
    }
    print_models(p);
    compare_states(p, &t, 0);
    enum replay_result one = REPLAY_STEP;
    enum replay_result other = REPLAY_STEP;
    while (one == REPLAY_STEP && other == REPLAY_STEP) {
        one = replay_next(&p->a);
        other = replay_next(&p->b);
        if (one == REPLAY_STEP && other == REPLAY_STEP) {
            compare_inputs(p);
            compare_states(p, &t, p->a.steps);
        }
    }
    diff_print(&t, (double)p->a.m.model.step_s, stdout);
    const bool longer = one != other;
    if (longer) {
        const struct replay *first = one == REPLAY_STEP ? &p->b : &p->a;
        printf("%s ends after step %" PRIu64 ", the other goes on\n", first->reader.path,
               first->steps);
    }
    const bool good = print_faithful(&p->a, one);
    const bool fine = print_faithful(&p->b, other);
    if (diff_any(&t) || longer || !good || !fine) {
        return CLI_FAILED;
    }
    printf("%s and %s: %" PRIu64 " steps of %zu numbers, no difference%s\n", p->a.reader.path,
           p->b.reader.path, t.rows - 1, t.n,
           a->absolute > 0.0 || a->relative > 0.0 ? " beyond the tolerance" : "");
    return CLI_OK;
}

static int diff_recordings(const struct arguments *a) {
    const struct cli_target files = {.vehicle = a->model, .track = a->track};
    struct both *p = calloc(1, sizeof *p);
    if (p == NULL) {
        return cli_fail("out of memory");
    }
    int status = replay_open(&p->a, a->target.vehicle, &files, false);
    if (status == CLI_OK) {
        status = replay_open(&p->b, a->target.track, &files, false);
        if (status == CLI_OK) {
            status = compare(p, a);
            replay_close(&p->b);
        }
        replay_close(&p->a);
    }
    free(p);
    return cli_flush(status);
}

static int perform(const struct arguments *a) {
    const char *one = a->target.vehicle;
    const char *other = a->target.track;
    if (one == NULL || other == NULL) {
        return cli_misuse("an argument is missing: expected A B");
    }
    if (a->target.set.n > 0) {
        return cli_misuse("--set: recordings and CSV files stand as they are");
    }
    const bool recording = record_is(one);
    if (recording != record_is(other)) {
        return cli_fail("%s is a recording and %s is none", recording ? one : other,
                        recording ? other : one);
    }
    if (!recording && (a->model != NULL || a->track != NULL)) {
        return cli_misuse("--model and --track are for recordings");
    }
    if (a->track != NULL && a->model == NULL) {
        return cli_misuse("--track needs --model");
    }
    return recording ? diff_recordings(a)
                     : cli_flush(diff_csv(one, other, a->absolute, a->relative));
}

int cmd_diff(int argc, char **argv) {
    struct arguments a = {0};
    int status = CLI_OK;
    const struct cli_option options[] = {
        {.name = "--tolerance",
         .argument = "X",
         .kind = CLI_NUMBER,
         .value = &a.absolute,
         .unit = "",
         .low = 0,
         .high = 1e6,
         .help = "what counts as no difference, in SI units (m, rad, m/s, N; of a CSV:\n"
                 "in the unit of its column); default 0: every bit"},
        {.name = "--relative",
         .argument = "X",
         .kind = CLI_NUMBER,
         .value = &a.relative,
         .unit = "",
         .low = 0,
         .high = 1,
         .help = "and in proportion to the larger of the two numbers; default 0"},
        cli_file_option("--model", &a.model,
                        "the vehicle of both recordings; default: those that they name"),
        cli_file_option("--track", &a.track, "and their track"),
    };
    const struct cli_command command = {
        .takes_track = true,
        .operands = "A B",
        .purpose =
            "Compares two recordings, which it does again step by step, or two CSV files, row by\n"
            "row: says the first step, signal and size of a difference, and for every signal that\n"
            "differs where it begins and how large it gets, in engineering units. Recordings also\n"
            "say where their inputs part. Exit status 0: no difference, 1: there is one, or what\n"
            "was asked cannot be done.",
        .example = "klingel run models/two_axle_wagon.yaml --speed 27 --time 2 --record a.klr\n"
                   "klingel run models/two_axle_wagon.yaml --speed 27 --time 2 --record b.klr\n"
                   "klingel diff a.klr b.klr\n",
        .options = options,
        .n_options = sizeof options / sizeof options[0]};
    if (!cli_parse(&command, argc, argv, &a.target, &status)) {
        return status;
    }
    return perform(&a);
}
