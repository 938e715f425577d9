/*
 * kl_math.h - the core's own elementary functions: no libm, the same bits everywhere. Internal to
 * the core.
 *
 * kl_sqrt is correctly rounded (the instruction where there is one, integer arithmetic where not,
 * the same bits). The others are within a few units in the last place of double, which nothing
 * relies on but the tests.
 */
#ifndef KL_MATH_H
#define KL_MATH_H

#include "kl_base.h"

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

/*
 * x^(-1/3) for normal x > 0, within 4 units in the last place. No division: Newton on y^-3 = x, y
 * <- y (4 - x y^3) / 3, from an integer guess (the exponent divided by -3) that is within 3.5 %.
 * Bound: constant. In line, as a step needs it often.
 */
static inline kl_real kl_inverse_cbrt(kl_real x) {
#ifdef KL_REAL_FLOAT
    union {
        float value;
        uint32_t bits;
    } u = {.value = x};
    u.bits = UINT32_C(0x54a21d2a) - u.bits / 3u;
    const int rounds = 3;
#else
    union {
        double value;
        uint64_t bits;
    } u = {.value = x};
    u.bits = UINT64_C(0x553ef0ff289dd796) - u.bits / 3u;
    const int rounds = 4;
#endif
    kl_real y = u.value;
    for (int i = 0; i < rounds; i++) {
        y = y * (KL_R(4.0 / 3.0) - (KL_R(1.0 / 3.0) * x * y) * (y * y));
    }
    return y;
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
/* True for every number but NaN and the infinities. */
static inline int kl_finite(double x) {
    return x - x == 0.0;
}
static inline int kl_finite_real(kl_real x) {
    return x - x == KL_R(0);
}

#endif
