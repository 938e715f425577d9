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

/* e^x, |x| <= 700, within 1e-14 relative; ln x for normal x > 0, within 1e-15 of the larger of 1 and
 * the result. For the builder. Bound: constant. */
double kl_exp(double x);
double kl_log(double x);

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

static inline kl_wide kl_wide_sqrt(kl_wide x) {
#if KL_WIDE == KL_LANES
    return kl_lane_sqrt(x);
#elif defined(__AVX__) && !defined(KL_REAL_FLOAT)
    return _mm256_sqrt_pd(x);
#else
    return kl_wide_join(kl_lane_sqrt(kl_wide_first(x)), kl_lane_sqrt(kl_wide_second(x)));
#endif
}

/*
 * x^(-1/3) for normal x > 0. The guess takes the exponent and the leading bits of x as an integer k
 * and divides it by -3: k is the fraction of 2^52 + k (float: 2^23 + k), so shifts and one multiply
 * and add do it, in the same registers; of a double half of the bits, so that 32-bit machines only
 * move words. It is within 3.5 %. Each round of Newton on y^-3 = x, y <- y (4 - x y^3) / 3, takes an
 * error e to 2 e^2: 2.4e-3, 1.2e-5, 2.8e-10, 1.5e-19.
 */
#ifdef KL_REAL_FLOAT
#define KL_CBRT_SHIFT 9
#define KL_CBRT_UNIT UINT32_C(0x4b000000)
#define KL_CBRT_BASE 13958073.0
#define KL_CBRT_ROUNDS 3
#else
#define KL_CBRT_SHIFT 32
#define KL_CBRT_UNIT UINT64_C(0x4330000000000000)
#define KL_CBRT_BASE 6004800933348948.0
#define KL_CBRT_ROUNDS 4
#endif
static inline kl_wide kl_wide_inverse_cbrt(kl_wide x, int rounds) {
    union {
        kl_wide value;
        kl_wide_bits bits;
    } u = {.value = x};
    u.bits = (u.bits >> KL_CBRT_SHIFT) | KL_CBRT_UNIT;
    u.value = KL_R(KL_CBRT_BASE) - u.value * KL_R(1.0 / 3.0);
    u.bits = u.bits << KL_CBRT_SHIFT;
    kl_wide y = u.value;
    const kl_wide third = x * KL_R(1.0 / 3.0);
    KL_UNROLL_4 for (int i = 0; i < rounds; i++) {
        y = y * (KL_R(4.0 / 3.0) - (third * y) * (y * y));
    }
    return y;
}
/* Within 4 units in the last place. */
static inline kl_real kl_inverse_cbrt(kl_real x) {
    kl_real root[4];
    kl_wide_store(root, 0, kl_wide_inverse_cbrt(kl_wide_all(x), KL_CBRT_ROUNDS));
    return root[0];
}

/*
 * e^-x for x >= 0; from x = 32 on e^-32 = 1.3e-14. Taylor of x/64, then squared six times: relative
 * within 1e-13 (float: 1e-5), 1 at 0 exactly, never rising. Bound: 32 multiplications.
 */
static inline kl_lane kl_lane_exp_falling(kl_lane x) {
    const kl_lane z = kl_lane_at_most(x, kl_lane_all(KL_R(32))) * KL_R(1.0 / 64.0);
    kl_lane e = KL_R(1) - z * KL_R(1.0 / 13.0);
    e = KL_R(1) - z * e * KL_R(1.0 / 12.0);
    e = KL_R(1) - z * e * KL_R(1.0 / 11.0);
    e = KL_R(1) - z * e * KL_R(1.0 / 10.0);
    e = KL_R(1) - z * e * KL_R(1.0 / 9.0);
    e = KL_R(1) - z * e * KL_R(1.0 / 8.0);
    e = KL_R(1) - z * e * KL_R(1.0 / 7.0);
    e = KL_R(1) - z * e * KL_R(1.0 / 6.0);
    e = KL_R(1) - z * e * KL_R(1.0 / 5.0);
    e = KL_R(1) - z * e * KL_R(1.0 / 4.0);
    e = KL_R(1) - z * e * KL_R(1.0 / 3.0);
    e = KL_R(1) - z * e * KL_R(1.0 / 2.0);
    e = KL_R(1) - z * e;
    for (int i = 0; i < 6; i++) {
        e = e * e;
    }
    return e;
}

/*
 * atan x for x >= 0, within 1e-13 relative: x or 1/x, the angle halved once, then t (1 + z p(z)), z
 * = t^2 <= 0.1716, p fitted to (atan t/t - 1)/z at 400 Chebyshev points. Bound: three divisions and
 * a root.
 */
static inline kl_lane kl_lane_atan_positive(kl_lane x) {
    const kl_lane one = kl_lane_all(KL_R(1));
    const kl_lane small = kl_lane_min(x, one) / kl_lane_max(x, one);
    const kl_lane t = small / (KL_R(1) + kl_lane_sqrt(KL_R(1) + small * small));
    const kl_lane z = t * t;
    kl_lane p = kl_lane_all(KL_R(-0.03617730316536515));
    p = p * z + KL_R(0.05821166038691668);
    p = p * z - KL_R(0.06746793267659527);
    p = p * z + KL_R(0.07712253805466522);
    p = p * z - KL_R(0.09093087336398134);
    p = p * z + KL_R(0.11111235336080993);
    p = p * z - KL_R(0.14285717904189577);
    p = p * z + KL_R(0.20000000046359592);
    p = p * z - KL_R(0.3333333333350485);
    const kl_lane angle = KL_R(2) * (t + t * (z * p));
    /* beyond 1 the rest of the right angle */
    const kl_lane beyond = kl_lane_positive_or_0(x - one, kl_lane_all(KL_R(KL_PI / 2.0)));
    const kl_lane sign = one - kl_lane_positive_or_0(x - one, kl_lane_all(KL_R(2)));
    return beyond + sign * angle;
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
    return b > a ? a : b; /* see kl_lane_min */
}
/* low where x is not a number; no branch. low <= high, both numbers, low no -0 and high no 0 unless low is +0. */
static inline kl_real kl_clamp(kl_real x, kl_real low, kl_real high) {
    return kl_lane_first(
        kl_lane_at_most(kl_lane_at_least(kl_lane_all(x), kl_lane_all(low)), kl_lane_all(high)));
}
/* True for every number but NaN and the infinities. */
static inline int kl_finite(double x) {
    return x - x == 0.0;
}
static inline int kl_finite_real(kl_real x) {
    return x - x == KL_R(0);
}

#endif
