/*
 * kl_strut.h - the force elements that are not linear, within a step. Internal to the core.
 */
#ifndef KL_STRUT_H
#define KL_STRUT_H

#include "kl_lanes.h"
#include "kl_step.h"

/* How far each damper or slider in series with a spring has moved at the end of the step, and how
 * fast it moves there. */
struct kl_slipped {
    kl_real u[KL_MAX_SLIPS];
    kl_real rate[KL_MAX_SLIPS];
};

/* Where the slips stand when the step begins, and its length; 0: forces where they stand. */
struct kl_slip_origin {
    const kl_real *u;
    const kl_real *rate;
    kl_real h;
};

/* Adds the forces of all struts on the coordinates. q: coordinate and rate, two and two. */
void kl_struts_act(const struct kl_struts *restrict struts,
                   const struct kl_slip_origin *restrict from, kl_both *restrict q,
                   const struct kl_input *restrict input, kl_real *restrict force,
                   struct kl_slipped *restrict slipped);

/* One strut of an evaluation, by its number among all. The slips as kl_struts_act left them. */
struct kl_strut_view {
    const struct kl_struts *struts;
    const kl_both *q;
    const struct kl_slipped *slipped;
    const struct kl_input *input;
};
kl_real kl_strut_force(const struct kl_strut_view *view, uint32_t strut);

/* Twice the energy in springs of slips and in stops. */
kl_real kl_struts_energy(const struct kl_struts *struts, const kl_real *u, kl_both *q);

/* Cuts the actuators' inputs to +-1e7 N and writes what is kept; what is not a number counts as 0.
 * 1 where something was changed. */
int kl_struts_limit(const struct kl_struts *struts, const struct kl_input *restrict input,
                    struct kl_input *restrict kept);

/* The new states of the slips: to where they live in a state's x and rate. */
static inline void kl_slips_finish(const struct kl_struts *struts, const struct kl_slipped *slipped,
                                   kl_real *u, kl_real *rate) {
    for (uint32_t i = 0; i < struts->n_slips; i++) {
        u[i] = slipped->u[i];
        rate[i] = slipped->rate[i];
    }
}

/* And their rates alone. */
static inline void kl_slips_rates(const struct kl_struts *struts, const struct kl_slipped *slipped,
                                  kl_real *rates) {
    for (uint32_t i = 0; i < struts->n_slips; i++) {
        rates[i] = slipped->rate[i];
    }
}

#endif
