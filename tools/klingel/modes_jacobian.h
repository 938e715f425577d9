/*
 * modes_jacobian.h - the Jacobian of kl_rates by differences, several states at a time. Private to
 * modes_linear.c and modes_steady.c.
 *
 * Who acts on whom stands in the model: bodies, wheelsets and slips that share a row of the
 * suspension or an element are neighbours, and the rates of each depend on its own states and its
 * neighbours' alone. Two of them without a common neighbour can be moved at once: every rate then
 * tells of one of the two. They are coloured greedily; the number of evaluations is that of the
 * colours, and does not grow with the length of a train.
 */
#ifndef MODES_JACOBIAN_H
#define MODES_JACOBIAN_H

#include <stdbool.h>

#include "cli.h"

#define JACOBIAN_PARTS (KL_MAX_BODIES + KL_MAX_WHEELSETS + KL_MAX_SLIPS + 1)

/* What can be moved at once. */
struct jacobian_plan {
    uint32_t n_states;
    uint32_t n_parts;
    uint32_t n_groups;
    uint32_t
        part[KL_MAX_STATES]; /* of each state: a body, a wheelset, a slip, or the last: others */
    uint32_t group[KL_MAX_STATES]; /* of each state; those of one group are moved at once */
    double step[KL_MAX_STATES];    /* by which each state is moved */
    bool neighbours[JACOBIAN_PARTS][JACOBIAN_PARTS];
};

void jacobian_plan(const struct kl_model *model, struct jacobian_plan *plan);

/* Where the Jacobian is taken. */
struct jacobian_point {
    const struct kl_model *model;
    const struct kl_input *input;
    const struct kl_state *state;
};

enum jacobian_kind {
    JACOBIAN_PLAIN, /* central differences: error of the second order where the rates are smooth */
    JACOBIAN_EXACT  /* of two widths, extrapolated: also past the kink of a saturating creep law */
};

/*
 * matrix[i * n_states + k] = d rate[i] / d x[k], steps times `factor`. A saturating creep law has
 * |creepage| in it: central differences of that have an error of the first order in the step. Two
 * steps, extrapolated to zero, take it away, and leave what is smooth as it was.
 */
void jacobian(const struct jacobian_plan *plan, const struct jacobian_point *at,
              enum jacobian_kind kind, double factor, double *matrix);

#endif
