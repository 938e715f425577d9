/* state_signals.h - every number of a state with its name and unit. */
#ifndef STATE_SIGNALS_H
#define STATE_SIGNALS_H

#include "cli.h"

#define STATE_MAX_SIGNALS (5u + 2u * KL_MAX_STATES + 6u * KL_MAX_WHEELSETS)

struct state_signal {
    char name[KL_NAME_SIZE + 32]; /* front.y, body.roll_rate; "front.y, next rate" of state->rate */
    const char *unit;             /* mm, mrad, ... */
    double scale;                 /* of one SI unit in it */
};

/* Fills STATE_MAX_SIGNALS at most; returns how many the model has. */
uint32_t state_signals(const struct kl_model *model, struct state_signal *signals);

/* Their values in SI, in the same order. */
void state_values(const struct kl_model *model, const struct kl_state *state, double *values);

#endif
