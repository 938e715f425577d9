/* kl_saturate.h - the saturation of a creep force, in line. Internal to the core (contact room). */
#ifndef KL_SATURATE_H
#define KL_SATURATE_H

#include "kl_contact.h"
#include "kl_math.h"

/*
 * The factor 0..1 that takes the linear creep force (t1, t2) to the law's. Shen-Hedrick-Elkins:
 * with u = |T|/(mu N), 1 - u/3 + u^2/27 up to u = 3 and 1/u beyond; 0 where mu N is 0.
 */
static inline kl_real kl_saturate(enum kl_creep_law law, kl_real t1_N, kl_real t2_N,
                                  kl_real limit_N) {
    const kl_real linear = kl_sqrt_real(t1_N * t1_N + t2_N * t2_N);
    const kl_real u = linear / kl_max_real(limit_N, KL_R(1e-9));
    const kl_real cubic = KL_R(1) - u * (KL_R(1.0 / 3.0) - u * KL_R(1.0 / 27.0));
    const kl_real sliding = limit_N / kl_max_real(linear, KL_R(1e-9));
    const kl_real reduction = u < KL_R(3) ? cubic : sliding;
    const kl_real kept = limit_N > KL_R(0) ? reduction : KL_R(0);
    return law == KL_CREEP_LINEAR ? KL_R(1) : kept;
}

#endif
