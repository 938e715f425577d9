/*
 * kl_rates.h - the right-hand side of a whole vehicle: one stage of a step. Internal to the core.
 */
#ifndef KL_RATES_H
#define KL_RATES_H

#include "kl_axle.h"
#include "kl_suspension.h"

/* When and how fast a stage stands. */
struct kl_stage {
    kl_real s_m;
    kl_real speed_m_s;
    kl_real speed_rate_m_s2;
};

/* One body's positions (0..4) and rates (KL_RATE + 0..4) in a row, as states are; absent freedoms
 * zero. Rates are the states: y' - z V phi0', absolute roll and yaw. */
#define KL_RATE KL_FREEDOMS
struct kl_body_motion {
    kl_real x[2 * KL_FREEDOMS];
};

/* Everything of one evaluation that the outputs may want. */
struct kl_evaluation {
    struct kl_track_point reference; /* at the vehicle's reference point */
    const struct kl_track_point *at_body[KL_MAX_BODIES];
    struct kl_track_point own[KL_MAX_BODIES]; /* of bodies that are not at the reference point */
    struct kl_body_motion body[KL_MAX_BODIES];
    kl_real body_acceleration[KL_MAX_BODIES][KL_FREEDOMS]; /* specific forces */
    struct kl_axle axle[KL_MAX_WHEELSETS];
    struct kl_axle_forces forces[KL_MAX_WHEELSETS];
    uint32_t faults;
};

/* Reads one body's states; a freedom that it does not have follows the track. Returns the next
 * body's states. */
const kl_real *kl_unpack_body(const struct kl_body *body, const kl_real *x,
                              const struct kl_track_point *here, kl_real v,
                              struct kl_body_motion *motion);

/* The rates of the states x at a stage; `input` must be within its ranges. */
void kl_evaluate(const struct kl_model *model, const kl_real *restrict x,
                 const struct kl_stage *stage, const struct kl_input *restrict input,
                 struct kl_evaluation *restrict e, kl_real *restrict rate);

/* Outputs of an evaluation, for the state that it leads to. */
void kl_write_output(const struct kl_model *model, const struct kl_state *state,
                     const struct kl_stage *stage, const struct kl_evaluation *restrict e,
                     struct kl_output *restrict output);

#endif
