/*
 * soft_double.c - addition of doubles on an Arm without a unit for them, in place of libgcc's.
 *
 * libgcc's addition (ieee754-df.S; GCC 12 at least) rounds wrongly where a power of two and a number
 * 33 binary places below it are subtracted: 1 - 0x1.ccdc8297191a2p-33 becomes 0x1.fffffffe33237p-1,
 * though 0x1.fffffffe33238p-1 is nearer. It shifts the smaller one by 33 and keeps one bit of what
 * falls out and a sticky one, and then needs a second bit, since the difference loses its first
 * place. That alone would make a Cortex-M3 or M4 compute other bits than every other machine. Its
 * multiplication, division and comparison round as IEEE 754 says and stay.
 *
 * Everything that shares an object in libgcc with the addition stands here, so that the linker never
 * takes that one. Arguments are bits, as the run-time ABI passes doubles in core registers (RTABI
 * 4.1.2). Round to nearest, ties to even; no exceptions are told; NaNs are quiet. Bound: constant.
 */
#include <stdbool.h>
#include <stdint.h>

#if (defined(__arm__) && !(defined(__ARM_FP) && (__ARM_FP & 8))) || defined(KL_SOFT_DOUBLE_TEST)

#define SIGN (UINT64_C(1) << 63)
#define HIDDEN (UINT64_C(1) << 52)
#define INFINITE (UINT64_C(0x7FF) << 52)
#define QUIET (UINT64_C(1) << 51)
#define MORE 10u /* places kept below the last one: the first place stands at bit 62 */

/* bits = sign, (exponent - 1) << 52 + mantissa: the hidden place adds the 1 that the exponent lacks,
 * a number without one has exponent 0, and a carry out of the mantissa raises the exponent. */
static uint64_t round_up_even(uint64_t sign, int32_t exponent, uint64_t mantissa) {
    uint64_t half = UINT64_C(1) << (MORE - 1);
    uint64_t rest = mantissa & ((UINT64_C(1) << MORE) - 1);
    uint64_t kept = mantissa >> MORE;
    kept += rest > half || (rest == half && (kept & 1u) != 0) ? 1u : 0u;
    uint64_t bits = ((uint64_t)(uint32_t)(exponent - 1) << 52) + kept;
    return sign | (bits >= INFINITE ? INFINITE : bits);
}

/* Places that fall out leave a mark in the last one. */
static uint64_t shift_right_sticky(uint64_t mantissa, uint32_t places) {
    if (places == 0) {
        return mantissa;
    }
    if (places > 63) {
        return mantissa != 0 ? 1u : 0u;
    }
    return mantissa >> places | ((mantissa << (64u - places)) != 0 ? 1u : 0u);
}

static int32_t exponent_of(uint64_t bits) {
    int32_t exponent = (int32_t)(bits >> 52 & 0x7FFu);
    return exponent == 0 ? 1 : exponent;
}

static uint64_t mantissa_of(uint64_t bits) {
    uint64_t fraction = bits & (HIDDEN - 1);
    return ((bits & INFINITE) != 0 ? fraction | HIDDEN : fraction) << MORE;
}

/* The first place back to bit 62, as far as the exponent goes. */
static uint64_t normalised(uint64_t sign, int32_t exponent, uint64_t mantissa) {
    int32_t places = (int32_t)__builtin_clzll(mantissa) - 1;
    if (places < 0) {
        return round_up_even(sign, exponent + 1, shift_right_sticky(mantissa, 1));
    }
    places = places < exponent - 1 ? places : exponent - 1;
    return round_up_even(sign, exponent - places, mantissa << (uint32_t)places);
}

/* One of them is infinite or no number. */
static uint64_t add_special(uint64_t a, uint64_t b) {
    bool a_is_nan = (a & ~SIGN) > INFINITE;
    bool b_is_nan = (b & ~SIGN) > INFINITE;
    if (a_is_nan || b_is_nan) {
        return (a_is_nan ? a : b) | QUIET;
    }
    bool both = (a & INFINITE) == INFINITE && (b & INFINITE) == INFINITE;
    if (both && a != b) {
        return INFINITE | QUIET;
    }
    return (a & INFINITE) == INFINITE ? a : b;
}

uint64_t kl_soft_add(uint64_t a, uint64_t b);
uint64_t kl_soft_add(uint64_t a, uint64_t b) {
    if ((a & INFINITE) == INFINITE || (b & INFINITE) == INFINITE) {
        return add_special(a, b);
    }
    bool swap = (a & ~SIGN) < (b & ~SIGN);
    uint64_t large = swap ? b : a;
    uint64_t small = swap ? a : b;
    int32_t exponent = exponent_of(large);
    uint64_t mantissa = mantissa_of(large);
    uint64_t shifted =
        shift_right_sticky(mantissa_of(small), (uint32_t)(exponent - exponent_of(small)));
    bool same_sign = ((a ^ b) & SIGN) == 0;
    mantissa = same_sign ? mantissa + shifted : mantissa - shifted;
    if (mantissa == 0) {
        return same_sign ? large & SIGN : 0;
    }
    return normalised(large & SIGN, exponent, mantissa);
}

static uint64_t of_magnitude(uint64_t sign, uint64_t magnitude) {
    return magnitude == 0 ? 0 : normalised(sign, 1023 + 62, magnitude);
}

uint64_t kl_soft_of_i64(int64_t value);
uint64_t kl_soft_of_i64(int64_t value) {
    return value < 0 ? of_magnitude(SIGN, 0u - (uint64_t)value) : of_magnitude(0, (uint64_t)value);
}

uint64_t kl_soft_of_u64(uint64_t value);
uint64_t kl_soft_of_u64(uint64_t value) {
    return of_magnitude(0, value);
}

/* Exact, but that a signalling NaN becomes a quiet one. */
uint64_t kl_soft_of_float(uint32_t bits);
uint64_t kl_soft_of_float(uint32_t bits) {
    uint64_t sign = (uint64_t)(bits >> 31) << 63;
    uint32_t exponent = bits >> 23 & 0xFFu;
    uint64_t fraction = bits & 0x7FFFFFu;
    if (exponent == 0xFFu) {
        return sign | INFINITE | fraction << 29 | (fraction != 0 ? QUIET : 0);
    }
    if (exponent == 0) { /* fraction 2^-149 */
        return fraction == 0 ? sign : normalised(sign, 1023 + 62 - 149, fraction);
    }
    return sign | (uint64_t)(exponent + 1023u - 127u) << 52 | fraction << 29;
}

#ifdef __arm__

/* The names of the run-time ABI and GCC's own. Used: link-time optimisation sees no caller, for it
 * makes the calls after it has looked. */
#define NAMED(result, name, parameters, value)                                                     \
    __attribute__((used)) result name parameters;                                                  \
    result name parameters {                                                                       \
        return value;                                                                              \
    }
NAMED(uint64_t, __aeabi_dadd, (uint64_t a, uint64_t b), kl_soft_add(a, b))
NAMED(uint64_t, __aeabi_dsub, (uint64_t a, uint64_t b), kl_soft_add(a, b ^ SIGN))
NAMED(uint64_t, __aeabi_drsub, (uint64_t a, uint64_t b), kl_soft_add(a ^ SIGN, b))
NAMED(uint64_t, __aeabi_i2d, (int32_t value), kl_soft_of_i64(value))
NAMED(uint64_t, __aeabi_ui2d, (uint32_t value), kl_soft_of_u64(value))
NAMED(uint64_t, __aeabi_l2d, (int64_t value), kl_soft_of_i64(value))
NAMED(uint64_t, __aeabi_ul2d, (uint64_t value), kl_soft_of_u64(value))
NAMED(uint64_t, __aeabi_f2d, (uint32_t bits), kl_soft_of_float(bits))
NAMED(uint64_t, __adddf3, (uint64_t a, uint64_t b), kl_soft_add(a, b))
NAMED(uint64_t, __subdf3, (uint64_t a, uint64_t b), kl_soft_add(a, b ^ SIGN))
NAMED(uint64_t, __floatsidf, (int32_t value), kl_soft_of_i64(value))
NAMED(uint64_t, __floatunsidf, (uint32_t value), kl_soft_of_u64(value))
NAMED(uint64_t, __floatdidf, (int64_t value), kl_soft_of_i64(value))
NAMED(uint64_t, __floatundidf, (uint64_t value), kl_soft_of_u64(value))
NAMED(uint64_t, __extendsfdf2, (uint32_t bits), kl_soft_of_float(bits))

#endif
#else

typedef int kl_soft_double_not_needed; /* a file must hold something */

#endif
