/*
 * run_forces.h - forces of elements and linkages as columns of a run's CSV.
 *
 * NAME_x_N and so on, one column for each part that an element has; the signs are those of
 * kl_force.h. They are found from the state of the row, after its step.
 */
#ifndef RUN_FORCES_H
#define RUN_FORCES_H

#include "cli.h"

struct run_force {
    bool linkage;
    uint32_t index;
    int part; /* 0..5 axes, 6 line, 7 slip, 8 stop, 9 damper, 10 actuator */
};

struct run_forces {
    const struct kl_vehicle_def *def;
    size_t n;
    struct run_force *column; /* NULL: none */
};

/* Chooses by name: of an element (with or without the _r and _l of a mirrored one) or a linkage, or
 * "all". CLI_OK, or CLI_USAGE or CLI_FAILED (printed). */
int run_forces_choose(struct run_forces *forces, const struct kl_vehicle_def *def,
                      const struct cli_list *names);
void run_forces_free(struct run_forces *forces);

/* What follows the other columns of the header and of a row, each with its comma. */
void run_forces_header(const struct run_forces *forces, FILE *file);
void run_forces_row(const struct run_forces *forces, const struct kl_model *model,
                    const struct kl_state *state, const struct kl_input *input, FILE *file);

#endif
