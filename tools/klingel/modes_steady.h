/*
 * modes_steady.h - the steady state of a vehicle: where the rates of all its states are zero.
 * Private to the commands that need one.
 */
#ifndef MODES_STEADY_H
#define MODES_STEADY_H

#include "modes_jacobian.h"
#include "modes_linear.h"

struct modes_steady {
    struct kl_state state;
    struct kl_output output;
    double residual;     /* the largest rate that is left, m/s2, rad/s2 and so on */
    bool found;          /* the residual is zero but for rounding */
    unsigned iterations; /* Jacobians that were needed */
};

/*
 * From `guess` on, or from the centred state where that is NULL.
 *
 * Newton's method, each step halved until either the rates or the next correction (by the same
 * Jacobian: the natural level function) have become smaller. Where no share of a step does that, at
 * kinks and steep places of the contact, the motion itself is followed by implicit Euler steps,
 * which lengthen while one correction is all that they need and shorten where it is not: that is
 * damped enough to pass kinks, and finds stable states only. Newton's method then ends it.
 *
 * CLI_OK with `found` false where there is none, or CLI_FAILED (printed) where the model cannot
 * start or there is no memory.
 */
int modes_steady(const struct modes_request *request, const struct kl_state *guess,
                 struct modes_steady *steady);

#endif
