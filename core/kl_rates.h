/*
 * kl_rates.h - the right-hand side of a whole vehicle: one stage of a step. Internal to the core.
 */
#ifndef KL_RATES_H
#define KL_RATES_H

#include "kl_axle.h"
#include "kl_strut.h"
#include "kl_suspension.h"

/* When and how fast a stage stands. */
struct kl_stage {
    kl_real s_m;
    kl_real speed_m_s;
    kl_real speed_rate_m_s2;
};

/* Coordinate and rate of every freedom, two and two as states are, and the rates of both; absent
 * freedoms stand still on the track. Rates are the states: y' - z V phi0', absolute roll and yaw. */
struct kl_body_motion {
    kl_real x[2 * KL_FREEDOMS];
    kl_real rate[2 * KL_FREEDOMS];
    kl_real aside; /* lateral acceleration of the canted frame that it is in */
};

/* Everything of one evaluation: what a struct kl_work holds. */
struct kl_evaluation {
    struct kl_track_layout reference; /* at the vehicle's reference point */
    struct kl_body_motion body[KL_MAX_BODIES];
    struct kl_axle axle[KL_MAX_WHEELSETS];
    struct kl_axle_forces forces[KL_MAX_WHEELSETS];
    kl_both motion[KL_MAX_COORDINATES]; /* of the suspension: a coordinate has its rate beside it */
    kl_real force[KL_MAX_COORDINATES + 1]; /* and a place for the force of no row */
    struct kl_slipped slipped;
    struct kl_input kept; /* inputs within their ranges */
    struct kl_lift lift[KL_MAX_WHEELSETS];
    uint32_t faults;
};
_Static_assert(sizeof(struct kl_evaluation) <= sizeof(struct kl_work), "raise KL_WORK_REALS");

/* The room of a step; nothing else ever looks into it. */
static inline struct kl_evaluation *kl_evaluation_in(struct kl_work *work) {
    return (struct kl_evaluation *)(void *)work;
}

/* The state that is evaluated: x carried on over the time h with the rates that it had. Velocities
 * go on straight; coordinates by the mean of their rates at both ends. h = 0 takes x as it is. */
struct kl_origin {
    const kl_real *x;
    const kl_real *rate;
    const struct kl_lift *lift;
    kl_real h;
};

/* What the vehicle is at a stage and what becomes of it; `input` must be within its ranges. */
void kl_evaluate(const struct kl_model *model, const struct kl_origin *from,
                 const struct kl_stage *stage, const struct kl_input *restrict input,
                 struct kl_evaluation *restrict e);

/* Outputs of an evaluation, for the state that it leads to. */
void kl_write_output(const struct kl_model *model, const struct kl_state *state,
                     const struct kl_stage *stage, const struct kl_evaluation *restrict e,
                     struct kl_output *restrict output);

#endif
