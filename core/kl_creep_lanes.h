/* kl_creep_lanes.h - creep forces of both wheels of an axle at once. Internal to the core. */
#ifndef KL_CREEP_LANES_H
#define KL_CREEP_LANES_H

#include "kl_creep.h"
#include "kl_lanes.h"
#include "kl_math.h"

/* Normalised creepages beyond this are as good as infinite, and their cubes still fit a float. */
#define KL_CREEP_MOST 1e9

/* One pass, see KL_EACH_LANE. */
struct kl_creep_lanes {
    kl_lane x; /* -KL_CREEP_MOST..KL_CREEP_MOST */
    kl_lane y;
    kl_lane p;
    kl_lane k_a; /* Polach */
    kl_lane k_s;
    kl_lane shape[KL_CREEP_SHAPES]; /* as in struct kl_creep_row */
};

struct kl_creep_lanes_force {
    kl_lane t1; /* over mu N */
    kl_lane t2;
    kl_lane m3; /* over mu N N^(1/3), m */
    kl_lane reduction;
};

/* What of the friction a pass needs. */
struct kl_friction_lanes {
    kl_lane mu;
    kl_lane k; /* (k_A + k_S)/2 */
};

static inline kl_lane kl_lane_limited(kl_lane x, kl_real most) {
    return kl_lane_at_most(kl_lane_at_least(x, kl_lane_all(-most)), kl_lane_all(most));
}

static inline kl_lane kl_lane_abs(kl_lane x) {
    return kl_lane_max(x, -x);
}

/* mu0 (A + (1 - A) e^(-B w)) */
static inline kl_lane kl_lane_friction(kl_lane mu0, kl_lane ratio, kl_lane decay_s_m,
                                       kl_lane slip_m_s) {
    const kl_lane falling = kl_lane_exp_falling(decay_s_m * slip_m_s);
    return mu0 * (ratio + (KL_R(1) - ratio) * falling);
}

/*
 * Normalises. `linear1` is f11_1 gamma1 and so on; `by` = k/mu; inv_cbrt = N^(-1/3), N at least 1
 * (for less than that the creepages count as at one newton, and the force goes with N).
 */
static inline void kl_lane_normalise(kl_lane linear1, kl_lane linear2, kl_lane linear3, kl_lane by,
                                     kl_lane inv_cbrt, struct kl_creep_lanes *in) {
    in->x = kl_lane_limited(linear1 * (inv_cbrt * by), KL_R(KL_CREEP_MOST));
    in->y = kl_lane_limited(linear2 * (inv_cbrt * by), KL_R(KL_CREEP_MOST));
    in->p = kl_lane_limited(linear3 * by, KL_R(KL_CREEP_MOST));
}

/*
 * The force under any law but LINEAR. x = k f11 gamma1/(mu N), y and p likewise; the forces are t1
 * mu N, t2 mu N, m3 mu N N^(1/3). Bound: constant for each law.
 */
void kl_lane_creep(enum kl_creep_law law, const struct kl_creep_table *table,
                   const struct kl_creep_lanes *in, struct kl_creep_lanes_force *out);

/* The laws with a file of their own. */
void kl_lane_creep_table(const struct kl_creep_table *table, const struct kl_creep_lanes *in,
                         struct kl_creep_lanes_force *out);
void kl_lane_creep_fastsim(int elliptic, const struct kl_creep_lanes *in,
                           struct kl_creep_lanes_force *out);

#endif
