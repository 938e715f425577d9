/* kl_saturate.h - the saturation of creep forces, in line. Internal to the core (contact room). */
#ifndef KL_SATURATE_H
#define KL_SATURATE_H

#include "kl_contact.h"
#include "kl_math.h"

/* Whether a law is a saturation of the linear forces, or has more to do. */
static inline int kl_saturates(enum kl_creep_law law) {
    return law == KL_CREEP_LINEAR || law == KL_CREEP_SHE;
}

/* What is added to the limit of a law that knows none. */
static inline kl_real kl_no_limit(enum kl_creep_law law) {
    return law == KL_CREEP_LINEAR ? KL_R(1e30) : KL_R(0);
}

/*
 * The factor 0..1 that takes a linear creep force (t1, t2) to the law's. Shen-Hedrick-Elkins: with
 * u = |T|/(mu N), 1 - u/3 + u^2/27 up to u = 3 and 1/u beyond; 0 where mu N is 0. The cubic is the
 * expansion of 1/u about 3 to second order and the next term is negative, so the lesser of the two
 * is always the one that holds.
 */
static inline kl_wide kl_wide_saturate(kl_wide t1_N, kl_wide t2_N, kl_wide limit_N) {
    const kl_wide least = kl_wide_all(KL_R(1e-9));
    const kl_wide linear = kl_wide_sqrt(t1_N * t1_N + t2_N * t2_N);
    const kl_wide u = linear * (KL_R(1) / kl_wide_at_least(limit_N, least));
    const kl_wide cubic = KL_R(1) - u * (KL_R(1.0 / 3.0) - u * KL_R(1.0 / 27.0));
    const kl_wide sliding = limit_N / kl_wide_at_least(linear, least);
    return kl_wide_positive_or_0(limit_N, kl_wide_at_most(cubic, sliding));
}
static inline kl_lane kl_lane_saturate(kl_lane t1_N, kl_lane t2_N, kl_lane limit_N) {
    return kl_wide_first(kl_wide_saturate(kl_wide_join(t1_N, t1_N), kl_wide_join(t2_N, t2_N),
                                          kl_wide_join(limit_N, limit_N)));
}

static inline kl_real kl_saturate(enum kl_creep_law law, kl_real t1_N, kl_real t2_N,
                                  kl_real limit_N) {
    return kl_lane_first(kl_lane_saturate(kl_lane_all(t1_N), kl_lane_all(t2_N),
                                          kl_lane_all(limit_N + kl_no_limit(law))));
}

#endif
