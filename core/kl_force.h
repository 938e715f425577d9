/*
 * kl_force.h - what each spring, damper, stop, friction element, actuator and linkage does.
 *
 * A step knows no elements: their linear parts are one matrix. Their forces are found afterwards from
 * the definition that the model was built from, and cost a step nothing. First
 * kl_observe(model, state, input, output, work), then these with the same `work`, which nobody may have
 * used in between: they read the evaluation that kl_observe leaves in it.
 *
 * Signs: deflection and rate are those of end a less those of end b; a positive force pulls end a
 * back and end b along: tension, where the element lies on a line with a at the far end. N, or N m
 * about an axis. Forces are the changes from the loaded vehicle at rest: the weight that an element
 * carries there, and the couple of a load that sways, are not in them.
 */
#ifndef KL_FORCE_H
#define KL_FORCE_H

#include "kl_step.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Absent parts are 0. */
struct kl_element_force {
    kl_real axis[6]; /* linear spring and damper along x, y, z (N), and about x, y, z (N m) */
    kl_real line_N;  /* linear spring and damper on the line of the points */
    kl_real slip;    /* series spring and damper, or friction; this and the next along `along` */
    kl_real stop;
    kl_real damper;   /* the characteristic over the velocity */
    kl_real actuator; /* -input->actuator_N, as limited */
};

/* Of element i of `def`, of which `model` must have been built. Bound: i. Re-entrant. */
void kl_element_force(const struct kl_vehicle_def *def, const struct kl_model *model, uint32_t i,
                      struct kl_element_force *force, const struct kl_work *work);

/* Of linkage i: k u + c u' of u = sum factor coordinate, which is minus the force on u. N where u is a
 * length, N m where it is an angle. Bound: n_linkages. Re-entrant. */
kl_real kl_linkage_force(const struct kl_vehicle_def *def, const struct kl_model *model, uint32_t i,
                         const struct kl_work *work);

#ifdef __cplusplus
}
#endif
#endif
