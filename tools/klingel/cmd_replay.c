/* cmd_replay.c - klingel replay: a recording's steps done again. */
#include <inttypes.h>
#include <stdlib.h>

#include "replay.h"
#include "run_record.h"

struct arguments {
    const char *csv;
    uint64_t every;
    bool final_hash;
    bool changed_model;
    struct cli_target target;
};

static void print_parting(const struct replay *p) {
    static struct state_signal signals[STATE_MAX_SIGNALS];
    (void)state_signals(&p->m.model, signals);
    const struct state_signal *s = &signals[p->bad_signal];
    printf("parts       after step %" PRIu64 ", by step %" PRIu64
           " at the latest; most there: %s %.9g %s, recorded %.9g, by %.3g\n",
           p->good_step, p->bad_step, s->name, s->scale * p->bad_now, s->unit,
           s->scale * p->bad_recorded, s->scale * (p->bad_now - p->bad_recorded));
}

static void print_summary(const struct replay *p, bool same) {
    const struct record_head *h = &p->reader.head;
    printf("%s: %" PRIu64 " steps of %g ms, recorded by klingel %s of %s, klingel %s\n",
           p->reader.path, p->steps, 1e-6 * (double)h->step_ns, h->source, h->model, h->library);
    if (p->replaced > 0 || p->lost > 0) {
        printf("state set   %" PRIu64 " times (loads and restores on the bus, gaps)\n",
               p->replaced);
    }
    if (p->lost > 0) {
        printf("gaps        %" PRIu64 ": %" PRIu64
               " steps were not recorded; behind a gap the recorded state goes on\n",
               p->gaps, p->lost);
    }
    printf("states      %" PRIu64 " compared with the recorded ones, %" PRIu64 " differ\n",
           p->checked, p->parted);
    if (p->parted > 0) {
        print_parting(p);
    }
    printf("model hash  %016" PRIx64 "\nstate hash  %016" PRIx64 "%s\n", p->m.model.hash,
           kl_state_hash(&p->state),
           same              ? ", as recorded"
           : p->reader.ended ? ", NOT AS RECORDED"
                             : "");
}

static enum replay_result replay_all(struct replay *p, const struct arguments *a, FILE *csv) {
    enum replay_result result = REPLAY_STEP;
    if (csv != NULL) {
        kl_observe(&p->m.model, &p->state, &p->input, &p->output, cli_work());
        run_csv_header(csv, &p->m.model);
        fputc('\n', csv);
        run_csv_row(csv, &p->m.model, &p->output);
        fputc('\n', csv);
    }
    uint64_t written = 0;
    while ((result = replay_next(p)) == REPLAY_STEP) {
        if (csv != NULL && p->steps % a->every == 0) {
            run_csv_row(csv, &p->m.model, &p->output);
            fputc('\n', csv);
            written = p->steps;
        }
    }
    if (csv != NULL && written != p->steps) {
        run_csv_row(csv, &p->m.model, &p->output);
        fputc('\n', csv);
    }
    return result;
}

static int judge(const struct replay *p, enum replay_result result, bool same) {
    const struct record_reader *r = &p->reader;
    if (result == REPLAY_BAD) {
        return cli_fail("%s:%" PRIu64 ": the recorded state does not fit the model", r->path,
                        r->line - 1);
    }
    if (result == REPLAY_CUT) {
        return cli_fail("%s: %s; good up to step %" PRIu64, r->path, r->why, p->steps);
    }
    if (p->steps != p->end_steps) {
        return cli_fail("%s: holds %" PRIu64 " steps, and says %" PRIu64, r->path, p->steps,
                        p->end_steps);
    }
    return same ? CLI_OK
                : cli_fail("%s: other bits: state hash %016" PRIx64 ", recorded %016" PRIx64,
                           r->path, kl_state_hash(&p->state), p->end_hash);
}

static int perform(struct replay *p, const struct arguments *a) {
    struct cli_output csv = {0};
    int status = a->csv != NULL ? cli_output_open(&csv, a->csv) : CLI_OK;
    if (status != CLI_OK) {
        return status;
    }
    enum replay_result result = replay_all(p, a, csv.file);
    bool same = result == REPLAY_END && p->parted == 0 && kl_state_hash(&p->state) == p->end_hash;
    if (a->final_hash && !cli_is_stdout(a->csv)) {
        printf("%016" PRIx64 "\n", kl_state_hash(&p->state));
    } else if (!cli_is_stdout(a->csv)) {
        print_summary(p, same);
    }
    status = cli_flush(cli_output_close(&csv, CLI_OK));
    int verdict = judge(p, result, same);
    return status == CLI_OK ? verdict : status;
}

int cmd_replay(int argc, char **argv) {
    struct arguments a = {.every = 1};
    int status = CLI_OK;
    const struct cli_option options[] = {
        cli_maybe_file_option("--csv", &a.csv,
                              "states and forces as CSV in SI units, as klingel run writes them;\n"
                              "without FILE, or with -, to standard output"),
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
         .help = "print nothing but the hash of the last state"},
        {.name = "--changed-model",
         .kind = CLI_FLAG,
         .value = &a.changed_model,
         .help = "the same inputs to a model that is not the recorded one, if it has the\n"
                 "same states: says where the two part"},
    };
    const struct cli_command command = {
        .takes_track = true,
        .takes_file = true,
        .operands = "FILE [MODEL [TRACK]]",
        .purpose =
            "Does the steps of a recording (klingel hil --record, klingel run --record) again and\n"
            "compares: the states that it keeps, and the hash of the last one. The model is built\n"
            "of the files that the recording names, or of those given. Exit status 0 only if\n"
            "every bit is as recorded; a recording that was cut off is done as far as it is good.",
        .example = "klingel run models/two_axle_wagon.yaml --speed 27 --time 2 --record run.klr\n"
                   "klingel replay run.klr --csv replay.csv\n",
        .options = options,
        .n_options = sizeof options / sizeof options[0]};
    if (!cli_parse(&command, argc, argv, &a.target, &status)) {
        return status;
    }
    struct replay *p = malloc(sizeof *p);
    if (p == NULL) {
        return cli_fail("out of memory");
    }
    status = replay_open(p, a.target.file, &a.target, a.changed_model);
    if (status == CLI_OK) {
        status = perform(p, &a);
        replay_close(p);
    }
    free(p);
    return status;
}
