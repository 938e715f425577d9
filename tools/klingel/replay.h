/* replay.h - a recording done again, step by step. Private to cmd_replay.c, cmd_diff.c and tests. */
#ifndef REPLAY_H
#define REPLAY_H

#include "record.h"
#include "state_signals.h"

enum replay_result {
    REPLAY_STEP = 0, /* one step was done */
    REPLAY_END,      /* the recording's end; `hash` is the recorded one */
    REPLAY_CUT,      /* the file is not whole: reader.why */
    REPLAY_BAD       /* a state of it does not fit the model: reader.line */
};

/* Large: make it static or take it from the heap. */
struct replay {
    struct record_reader reader;
    struct cli_model m;
    struct record_inputs inputs;
    struct kl_state state;
    struct kl_input input;
    struct kl_output output;
    uint64_t todo; /* steps of the line that is being done */
    uint64_t steps;
    uint64_t lost;
    uint64_t gaps;
    uint64_t replaced;
    uint64_t checked;   /* states that were compared with the recorded ones */
    uint64_t parted;    /* of these, not the same */
    uint64_t good_step; /* steps after which the last one was the same */
    uint64_t bad_step;  /* and after which the first one was not, with what differs most: */
    uint32_t bad_signal;
    double bad_recorded;
    double bad_now;
    uint64_t end_steps;
    uint64_t end_hash;
    bool changed_model; /* states of another model are taken over where they fit */
};

/*
 * Opens a recording and builds its model: of the files given or, where `target` names none, of those
 * that the recording names. CLI_OK, or CLI_FAILED (printed): also where the model is not the
 * recorded one, unless `changed_model`, when only the states must have the same number.
 */
int replay_open(struct replay *p, const char *path, const struct cli_target *target,
                bool changed_model);

/* Goes on to the next step, over everything that comes before it. */
enum replay_result replay_next(struct replay *p);

void replay_close(struct replay *p);

#endif
