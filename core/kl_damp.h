/* kl_damp.h - velocities that creep damps, within a step. Internal to the core. */
#ifndef KL_DAMP_H
#define KL_DAMP_H

#include "kl_lanes.h"
#include "kl_math.h"

/*
 * A wheelset's share of the step, where creep damps a velocity p by z = step * damping. With e =
 * sigma a, the part of the last acceleration that is carried on, the evaluation stood at p + h e
 * and gave F; then
 *     a = (F + z e/2)/(1 + (1 - sigma/2) z),   p_new = p + h a + h/2 (e - sigma a),
 * and the last terms add up to nothing over several steps. If z is all the damping there is, a is
 * exactly the acceleration at p_new: the trapezoidal rule with sigma = 1, implicit Euler with sigma
 * = 0. sigma = min(1, 1/z) is second order where creep is not stiff, and never overshoots where it
 * is: a saturated creep force would answer that by alternating between +-mu N. With z = 0 this is
 * leapfrog.
 */
struct kl_damped {
    kl_both force;   /* F */
    kl_both carried; /* e, and sigma a afterwards */
    kl_both z;
    kl_both a;
};

static inline kl_lane kl_carried_part(kl_lane z) {
    return KL_R(1) / kl_lane_at_least(z, kl_lane_all(KL_R(1)));
}

static inline void kl_damp(struct kl_damped *d) {
    KL_EACH_LANE(g) {
        const kl_lane half_z = KL_R(0.5) * KL_LANE(d->z, g);
        const kl_lane sigma = kl_carried_part(KL_LANE(d->z, g));
        const kl_lane a = (KL_LANE(d->force, g) + half_z * KL_LANE(d->carried, g)) /
                          (KL_R(1) + (KL_R(2) - sigma) * half_z);
        KL_LANE(d->a, g) = a;
        KL_LANE(d->carried, g) = sigma * a;
    }
}

#endif
