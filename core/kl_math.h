/*
 * kl_math.h - the core's own elementary functions: no libm, the same bits everywhere. Not part of
 * klingel.h; the port and the tools include it where a result must not depend on the host's libm.
 *
 * kl_sqrt is correctly rounded (the instruction where there is one, integer arithmetic where not,
 * the same bits). The others are within a few units in the last place of double, which nothing
 * relies on but the tests.
 */
#ifndef KL_MATH_H
#define KL_MATH_H

#include "kl_lanes.h"

#define KL_R(x) ((kl_real)(x))
#define KL_PI 3.14159265358979323846

/* The instruction, where the compiler turns __builtin_sqrt into one. */
#if defined(__x86_64__) || defined(__aarch64__) ||                                                 \
    (defined(__riscv_flen) && __riscv_flen >= 64) || (defined(__ARM_FP) && (__ARM_FP & 8))
#define KL_SQRT_INSTRUCTION 1
#else
#define KL_SQRT_INSTRUCTION 0
#endif

/* Square root of x >= 0, correctly rounded; NaN for x < 0. Bound: one instruction, or 55 rounds. */
double kl_sqrt_portable(double x);
static inline double kl_sqrt(double x) {
#if KL_SQRT_INSTRUCTION
    return __builtin_sqrt(x);
#else
    return kl_sqrt_portable(x);
#endif
}
/* The double root of a float, rounded again, is the correctly rounded float root. */
static inline kl_real kl_sqrt_real(kl_real x) {
    return (kl_real)kl_sqrt((double)x);
}

/* sin and cos, |x| <= 1e6; relative to 1 within 4e-16 (reduction in three parts). */
double kl_sin(double x);
double kl_cos(double x);
/* atan, within 1e-15 relative. */
double kl_atan(double x);
double kl_tan(double x);

/* Both sides' roots. */
static inline kl_lane kl_lane_sqrt(kl_lane x) {
#if KL_LANES == 1
    return kl_sqrt_real(x);
#elif defined(__SSE2__) && !defined(KL_REAL_FLOAT)
    return _mm_sqrt_pd(x);
#else
    return kl_lane_of(kl_sqrt_real(x[KL_RIGHT]), kl_sqrt_real(x[KL_LEFT]), 0);
#endif
}

/*
 * x^(-1/3) for normal x > 0. The guess takes the exponent and the leading bits of x as an integer k
 * and divides it by -3: k is the fraction of 2^52 + k (float: 2^23 + k), so shifts and one multiply
 * and add do it, in the same registers. It is within 3.5 %. Each round of Newton on y^-3 = x, y <-
 * y (4 - x y^3) / 3, takes an error e to 2 e^2: 2.4e-3, 1.2e-5, 2.8e-10, 1.5e-19.
 */
#ifdef KL_REAL_FLOAT
#define KL_CBRT_SHIFT 9
#define KL_CBRT_UNIT UINT32_C(0x4b000000)
#define KL_CBRT_BASE 13958073.0
#define KL_CBRT_ROUNDS 3
#else
#define KL_CBRT_SHIFT 20
#define KL_CBRT_UNIT UINT64_C(0x4330000000000000)
#define KL_CBRT_BASE 6010657554384862.0
#define KL_CBRT_ROUNDS 4
#endif
static inline kl_lane kl_lane_inverse_cbrt(kl_lane x, int rounds) {
    union {
        kl_lane value;
        kl_lane_bits bits;
    } u = {.value = x};
    u.bits = (u.bits >> KL_CBRT_SHIFT) | KL_CBRT_UNIT;
    u.value = KL_R(KL_CBRT_BASE) - u.value * KL_R(1.0 / 3.0);
    u.bits = u.bits << KL_CBRT_SHIFT;
    kl_lane y = u.value;
    const kl_lane third = x * KL_R(1.0 / 3.0);
    for (int i = 0; i < rounds; i++) {
        y = y * (KL_R(4.0 / 3.0) - (third * y) * (y * y));
    }
    return y;
}
/* Within 4 units in the last place. */
static inline kl_real kl_inverse_cbrt(kl_real x) {
    return kl_lane_first(kl_lane_inverse_cbrt(kl_lane_all(x), KL_CBRT_ROUNDS));
}

static inline double kl_abs(double x) {
    return x < 0.0 ? -x : x;
}
static inline kl_real kl_abs_real(kl_real x) {
    return x < KL_R(0) ? -x : x;
}
static inline kl_real kl_max_real(kl_real a, kl_real b) {
    return a > b ? a : b;
}
static inline kl_real kl_min_real(kl_real a, kl_real b) {
    return a < b ? a : b;
}
/* low where x is not a number; no branch. */
static inline kl_real kl_clamp(kl_real x, kl_real low, kl_real high) {
    return kl_lane_first(
        kl_lane_min(kl_lane_max(kl_lane_all(x), kl_lane_all(low)), kl_lane_all(high)));
}
/* True for every number but NaN and the infinities. */
static inline int kl_finite(double x) {
    return x - x == 0.0;
}
static inline int kl_finite_real(kl_real x) {
    return x - x == KL_R(0);
}

#endif
