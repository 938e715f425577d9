/* kl_math.c - elementary functions from arithmetic alone. */
#include "kl_math.h"

static uint64_t bits_of(double x) {
    union {
        double value;
        uint64_t bits;
    } u = {.value = x};
    return u.bits;
}

static double double_of(uint64_t bits) {
    union {
        uint64_t bits;
        double value;
    } u = {.bits = bits};
    return u.value;
}

/* Digit by digit on the integer significand: 54 bits of root and the remainder decide the rounding.
 */
double kl_sqrt_portable(double x) {
    const uint64_t bits = bits_of(x);
    if (x == 0.0 || x != x || bits == UINT64_C(0x7ff0000000000000)) {
        return x;
    }
    if (x < 0.0) {
        return double_of(UINT64_C(0x7ff8000000000000));
    }
    int exponent = (int)(bits >> 52);
    uint64_t significand = bits & UINT64_C(0x000fffffffffffff);
    if (exponent == 0) { /* subnormal: shift up to a normal significand */
        exponent = 1;
        for (int i = 0; i < 52 && (significand >> 52) == 0; i++) {
            significand <<= 1;
            exponent--;
        }
    } else {
        significand |= UINT64_C(1) << 52;
    }
    int unbiased = exponent - 1023;
    if (unbiased & 1) {
        significand <<= 1;
        unbiased--;
    }
    /* root of significand * 2^54: 54 result bits (53 and one for rounding) */
    uint64_t root = 0;
    uint64_t rest = 0;
    for (int i = 53; i >= 0; i--) {
        /* bring down two bits of significand << 54 (108 bits in all, the top pair first) */
        const int shift = 2 * i - 54;
        const uint64_t pair = shift >= 0 ? (significand >> shift) & 3u : 0u;
        rest = (rest << 2) | pair;
        const uint64_t trial = (root << 2) | 1u;
        root <<= 1;
        if (rest >= trial) {
            rest -= trial;
            root |= 1u;
        }
    }
    /* half up; a tie cannot happen, as a root is never exactly between two doubles */
    root = (root >> 1) + (root & 1u);
    return double_of(((uint64_t)(unbiased / 2 + 1022) << 52) + root);
}

/* Taylor series are exact enough on |r| <= pi/4; coefficients are reciprocal factorials. */
static double sin_small(double r) {
    const double z = r * r;
    double p = -1.0 / 1307674368000.0;
    p = p * z + 1.0 / 6227020800.0;
    p = p * z - 1.0 / 39916800.0;
    p = p * z + 1.0 / 362880.0;
    p = p * z - 1.0 / 5040.0;
    p = p * z + 1.0 / 120.0;
    p = p * z - 1.0 / 6.0;
    return r + r * (z * p);
}

static double cos_small(double r) {
    const double z = r * r;
    double p = 1.0 / 20922789888000.0;
    p = p * z - 1.0 / 87178291200.0;
    p = p * z + 1.0 / 479001600.0;
    p = p * z - 1.0 / 3628800.0;
    p = p * z + 1.0 / 40320.0;
    p = p * z - 1.0 / 720.0;
    p = p * z + 1.0 / 24.0;
    return 1.0 - 0.5 * z + z * z * p;
}

/* Cody and Waite: pi/2 in three parts of 33 bits, so that k * part is exact for |k| < 2^20. */
static double reduce(double x, int *quadrant) {
    const double scaled = x * (2.0 / KL_PI);
    const int64_t k = (int64_t)(scaled < 0.0 ? scaled - 0.5 : scaled + 0.5);
    const double n = (double)k;
    *quadrant = (int)((uint64_t)k & 3u);
    double r = x - n * 1.57079632673412561417e+00;
    r = r - n * 6.07710050630396597660e-11;
    return r - n * 2.02226624879595063154e-21;
}

static double by_quadrant(double x, int shift) {
    int quadrant;
    const double r = reduce(x, &quadrant);
    const int q = (quadrant + shift) & 3;
    const double value = (q & 1) ? cos_small(r) : sin_small(r);
    return (q & 2) ? -value : value;
}

double kl_sin(double x) {
    return by_quadrant(x, 0);
}

double kl_cos(double x) {
    return by_quadrant(x, 1);
}

double kl_tan(double x) {
    return kl_sin(x) / kl_cos(x);
}

/* Halve the angle three times, then the series: atan x = 2 atan(x / (1 + sqrt(1 + x^2))). */
double kl_atan(double x) {
    double t = x;
    for (int i = 0; i < 3; i++) {
        t = t / (1.0 + kl_sqrt(1.0 + t * t));
    }
    const double z = t * t;
    double p = 1.0 / 21.0;
    for (int n = 19; n >= 3; n -= 2) {
        p = 1.0 / (double)n - z * p;
    }
    return 8.0 * (t - t * (z * p));
}

/* x = k ln 2 + r, |r| <= 0.35: e^r by Taylor, and k into the exponent. */
double kl_exp(double x) {
    const double scaled = x * 1.44269504088896340736;
    const int64_t k = (int64_t)(scaled < 0.0 ? scaled - 0.5 : scaled + 0.5);
    const double n = (double)k;
    const double r = (x - n * 6.93147180369123816490e-01) - n * 1.90821492927058770002e-10;
    double e = 1.0;
    for (int i = 14; i >= 1; i--) {
        e = 1.0 + r * e / (double)i;
    }
    return e * double_of((uint64_t)(k + 1023) << 52);
}

/* x = 2^k m, m in 0.707..1.414: ln m = 2 atanh((m - 1)/(m + 1)). */
double kl_log(double x) {
    const uint64_t bits = bits_of(x);
    int k = (int)((bits >> 52) & 0x7ffu) - 1023;
    double m = double_of((bits & UINT64_C(0x000fffffffffffff)) | UINT64_C(0x3ff0000000000000));
    if (m > 1.41421356237309504880) {
        m *= 0.5;
        k++;
    }
    const double t = (m - 1.0) / (m + 1.0);
    const double z = t * t;
    double p = 1.0 / 23.0;
    for (int n = 21; n >= 1; n -= 2) {
        p = 1.0 / (double)n + z * p;
    }
    return (double)k * 6.93147180369123816490e-01 +
           ((double)k * 1.90821492927058770002e-10 + 2.0 * (t * p));
}
