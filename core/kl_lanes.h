/*
 * kl_lanes.h - the two wheels of an axle, worked on at once. Internal to the core.
 *
 * Both wheels of a wheelset go through the same arithmetic. Where the machine has registers that
 * hold two reals, one operation does both; everywhere else the same source runs once per side in
 * plain C. Lane by lane these are the same IEEE operations, so the bits are the same.
 * -DKL_PLAIN_LANES takes the plain way everywhere.
 *
 *   kl_both        a value of either side; x[KL_RIGHT] and x[KL_LEFT] are its parts
 *   KL_EACH_LANE   a loop over the passes that both sides need: one, or one per side
 *   kl_lane        what one pass works on: both sides, or one
 *   KL_LANE(x, g)  the part of a kl_both x that belongs to pass g; can be assigned to
 *   KL_OTHER(x, g) the same of the opposite side; not while x is being written
 *
 * Rows of four reals go the same way, at once where registers hold four:
 *   KL_EACH_WIDE(h) a loop over the passes that four reals need: one, two or four
 *   kl_wide         what one pass works on
 */
#ifndef KL_LANES_H
#define KL_LANES_H

#include "kl_base.h"

#if !defined(KL_PLAIN_LANES) && defined(__GNUC__) && (defined(__SSE2__) || defined(__aarch64__))
#define KL_LANES 2
#else
#define KL_LANES 1
#endif

#ifdef KL_REAL_FLOAT
typedef uint32_t kl_real_bits;
#define KL_QUIET 1e-12f
#define KL_NO_SIGN UINT32_C(0x7fffffff)
#else
typedef uint64_t kl_real_bits;
#define KL_QUIET 1e-30
#define KL_NO_SIGN UINT64_C(0x7fffffffffffffff)
#endif

/* Passes follow each other without a loop, so that what belongs to either side stays in registers; gcc
 * must be told below -O3. */
#if defined(__GNUC__) && !defined(__clang__)
#define KL_UNROLL _Pragma("GCC unroll 2")
#define KL_UNROLL_4 _Pragma("GCC unroll 4")
#define KL_UNROLL_5 _Pragma("GCC unroll 5")
#else
#define KL_UNROLL
#define KL_UNROLL_4
#define KL_UNROLL_5
#endif
#define KL_EACH_LANE(g) KL_UNROLL for (int g = 0; g < KL_SIDES / KL_LANES; g++)
/* A loop all the same, for long passes that few vehicles or steps go through. */
#define KL_EACH_LANE_LOOP(g) for (int g = 0; g < KL_SIDES / KL_LANES; g++)

#if KL_LANES == 2

typedef kl_real kl_both __attribute__((vector_size(2 * sizeof(kl_real))));
typedef kl_real_bits kl_lane_bits __attribute__((vector_size(2 * sizeof(kl_real))));
typedef kl_both kl_lane;
#define KL_LANE(x, g) (x)

/* The part of (right, left) that belongs to pass g. */
static inline kl_lane kl_lane_of(kl_real right, kl_real left, int g) {
    (void)g;
    const kl_lane both = {right, left};
    return both;
}

static inline kl_lane kl_lane_swapped(kl_lane x) {
    const kl_lane other = {x[KL_LEFT], x[KL_RIGHT]};
    return other;
}
#define KL_OTHER(x, g) kl_lane_swapped(x)

/* x where the mask has ones, 0 elsewhere. */
static inline kl_lane kl_lane_keep(kl_lane_bits mask, kl_lane x) {
    return (kl_lane)(mask & (kl_lane_bits)x);
}

static inline kl_lane kl_lane_positive_or_0(kl_lane test, kl_lane x) {
    return kl_lane_keep((kl_lane_bits)(test > (kl_lane){0}), x);
}

/* x, and 0 where it is so small that its powers would leave the range of ordinary numbers, with which
 * machines are slow. NaN stays. */
static inline kl_lane kl_lane_quiet(kl_lane x) {
    const kl_lane size = (kl_lane)(kl_lane_bits)((kl_lane_bits)x & KL_NO_SIGN);
    return (kl_lane)(~(kl_lane_bits)(size < KL_QUIET) & (kl_lane_bits)x);
}

static inline kl_lane kl_lane_if_0(kl_lane test, kl_lane a, kl_lane b) {
    const kl_lane_bits first = (kl_lane_bits)(test == (kl_lane){0});
    return (kl_lane)((first & (kl_lane_bits)a) | (~first & (kl_lane_bits)b));
}

/* Two neighbours in memory, on no particular border. */
static inline kl_lane kl_lane_load(const kl_real *from, int g) {
    (void)g;
    kl_lane x;
    __builtin_memcpy(&x, from, sizeof x);
    return x;
}
/* The same where the first of them stands at an even place. */
static inline kl_lane kl_lane_load_even(const kl_real *from, int g) {
    (void)g;
    kl_lane x;
    __builtin_memcpy(&x, __builtin_assume_aligned(from, sizeof x), sizeof x);
    return x;
}
static inline void kl_lane_store(kl_real *to, int g, kl_lane x) {
    (void)g;
    __builtin_memcpy(to, &x, sizeof x);
}

#if defined(__SSE2__) && !defined(KL_REAL_FLOAT)
/* these instructions are exactly a > b ? a : b and a < b ? a : b */
#include <emmintrin.h>
static inline kl_lane kl_lane_max(kl_lane a, kl_lane b) {
    return _mm_max_pd(a, b);
}
static inline kl_lane kl_lane_min(kl_lane a, kl_lane b) {
    return _mm_min_pd(a, b);
}
#else
static inline kl_lane kl_lane_max(kl_lane a, kl_lane b) {
    const kl_lane_bits first = (kl_lane_bits)(a > b);
    return (kl_lane)((first & (kl_lane_bits)a) | (~first & (kl_lane_bits)b));
}
static inline kl_lane kl_lane_min(kl_lane a, kl_lane b) {
    const kl_lane_bits first = (kl_lane_bits)(a < b);
    return (kl_lane)((first & (kl_lane_bits)a) | (~first & (kl_lane_bits)b));
}
#endif

#else /* KL_LANES == 1 */

typedef kl_real kl_both[KL_SIDES];
typedef kl_real_bits kl_lane_bits;
typedef kl_real kl_lane;
#define KL_LANE(x, g) ((x)[g])

static inline kl_lane kl_lane_of(kl_real right, kl_real left, int g) {
    return g == KL_RIGHT ? right : left;
}

#define KL_OTHER(x, g) ((x)[KL_SIDES - 1 - (g)])

static inline kl_lane kl_lane_positive_or_0(kl_lane test, kl_lane x) {
    return test > (kl_real)0 ? x : (kl_real)0;
}
/* one comparison where the machine takes the sign off by one instruction */
#if defined(__GNUC__) && defined(KL_REAL_FLOAT)
#define KL_SIZE(x) __builtin_fabsf(x)
#elif defined(__GNUC__)
#define KL_SIZE(x) __builtin_fabs(x)
#else
#define KL_SIZE(x) ((x) < (kl_real)0 ? -(x) : (x))
#endif
static inline kl_lane kl_lane_quiet(kl_lane x) {
    return KL_SIZE(x) < KL_QUIET ? (kl_real)0 : x;
}
static inline kl_lane kl_lane_if_0(kl_lane test, kl_lane a, kl_lane b) {
    return test == (kl_real)0 ? a : b;
}
static inline kl_lane kl_lane_load(const kl_real *from, int g) {
    return from[g];
}
static inline kl_lane kl_lane_load_even(const kl_real *from, int g) {
    return from[g];
}
static inline void kl_lane_store(kl_real *to, int g, kl_lane x) {
    to[g] = x;
}
static inline kl_lane kl_lane_max(kl_lane a, kl_lane b) {
    return a > b ? a : b;
}
/* a < b ? a : b, asked in such a way that a Cortex-M7 selects and does not branch */
static inline kl_lane kl_lane_min(kl_lane a, kl_lane b) {
    return b > a ? a : b;
}

#endif

/*
 * kl_lane_max(x, limit) and kl_lane_min(x, limit), where the limit is a number, not NaN; at least no
 * -0, at most no 0 unless x >= +0. Then maxNum and minNum of IEEE 754-2008 give the same bits, which
 * M-profile machines with double have as one instruction instead of three to five.
 */
#if KL_LANES == 1 && defined(__GNUC__) && defined(__ARM_ARCH_PROFILE) && defined(__ARM_FP)
#if __ARM_ARCH_PROFILE == 'M' && (__ARM_FP & 8) != 0
#define KL_HAS_MAXNUM 1
#endif
#endif
#if defined(KL_HAS_MAXNUM) && defined(KL_REAL_FLOAT)
static inline kl_lane kl_lane_at_least(kl_lane x, kl_lane limit) {
    return __builtin_fmaxf(x, limit);
}
static inline kl_lane kl_lane_at_most(kl_lane x, kl_lane limit) {
    return __builtin_fminf(x, limit);
}
#elif defined(KL_HAS_MAXNUM)
static inline kl_lane kl_lane_at_least(kl_lane x, kl_lane limit) {
    return __builtin_fmax(x, limit);
}
static inline kl_lane kl_lane_at_most(kl_lane x, kl_lane limit) {
    return __builtin_fmin(x, limit);
}
#else
static inline kl_lane kl_lane_at_least(kl_lane x, kl_lane limit) {
    return kl_lane_max(x, limit);
}
static inline kl_lane kl_lane_at_most(kl_lane x, kl_lane limit) {
    return kl_lane_min(x, limit);
}
#endif

#if KL_LANES == 2 && (defined(__AVX__) || defined(KL_REAL_FLOAT))
#define KL_WIDE 4
typedef kl_real kl_wide __attribute__((vector_size(4 * sizeof(kl_real))));
typedef kl_real_bits kl_wide_bits __attribute__((vector_size(4 * sizeof(kl_real))));

/* Part h of four neighbours in memory, on no particular border. */
static inline kl_wide kl_wide_load(const kl_real *from, int h) {
    (void)h;
    kl_wide x;
    __builtin_memcpy(&x, from, sizeof x);
    return x;
}
static inline void kl_wide_store(kl_real *to, int h, kl_wide x) {
    (void)h;
    __builtin_memcpy(to, &x, sizeof x);
}
#if defined(__AVX__) && !defined(KL_REAL_FLOAT)
#include <immintrin.h>
/* Part h of a pair twice; the pair stands at an even place. */
static inline kl_wide kl_wide_twice(const kl_real *pair, int h) {
    (void)h;
    return _mm256_broadcast_pd((const __m128d *)(const void *)pair);
}
/* (a0, b0), (a1, b1), (a2, b2), (a3, b3). */
static inline void kl_wide_mix(kl_wide a, kl_wide b, kl_lane mixed[4]) {
    const kl_wide even = _mm256_unpacklo_pd(a, b);
    const kl_wide odd = _mm256_unpackhi_pd(a, b);
    mixed[0] = _mm256_castpd256_pd128(even);
    mixed[1] = _mm256_castpd256_pd128(odd);
    mixed[2] = _mm256_extractf128_pd(even, 1);
    mixed[3] = _mm256_extractf128_pd(odd, 1);
}
/* Two values of both sides as four, and back. */
static inline kl_wide kl_wide_join(kl_lane a, kl_lane b) {
    return _mm256_insertf128_pd(_mm256_castpd128_pd256(a), b, 1);
}
static inline kl_lane kl_wide_first(kl_wide x) {
    return _mm256_castpd256_pd128(x);
}
static inline kl_lane kl_wide_second(kl_wide x) {
    return _mm256_extractf128_pd(x, 1);
}
static inline kl_wide kl_wide_at_least(kl_wide a, kl_wide b) {
    return _mm256_max_pd(a, b);
}
static inline kl_wide kl_wide_at_most(kl_wide a, kl_wide b) {
    return _mm256_min_pd(a, b);
}
/* The sums of the first two of four, and of the others. */
static inline void kl_wide_sums(const kl_wide *x, kl_real *first, kl_real *second) {
    const kl_lane sums = _mm_hadd_pd(_mm256_castpd256_pd128(*x), _mm256_extractf128_pd(*x, 1));
    *first = sums[0];
    *second = sums[1];
}
#else
static inline kl_wide kl_wide_twice(const kl_real *pair, int h) {
    (void)h;
    const kl_lane x = kl_lane_load_even(pair, 0);
    const kl_wide twice = {x[0], x[1], x[0], x[1]};
    return twice;
}
static inline void kl_wide_mix(kl_wide a, kl_wide b, kl_lane mixed[4]) {
    for (int i = 0; i < 4; i++) {
        mixed[i] = (kl_lane){a[i], b[i]};
    }
}
static inline kl_wide kl_wide_join(kl_lane a, kl_lane b) {
    const kl_wide x = {a[0], a[1], b[0], b[1]};
    return x;
}
static inline kl_lane kl_wide_first(kl_wide x) {
    const kl_lane a = {x[0], x[1]};
    return a;
}
static inline kl_lane kl_wide_second(kl_wide x) {
    const kl_lane b = {x[2], x[3]};
    return b;
}
static inline kl_wide kl_wide_at_least(kl_wide a, kl_wide b) {
    const kl_wide_bits first = (kl_wide_bits)(a > b);
    return (kl_wide)((first & (kl_wide_bits)a) | (~first & (kl_wide_bits)b));
}
static inline kl_wide kl_wide_at_most(kl_wide a, kl_wide b) {
    const kl_wide_bits first = (kl_wide_bits)(a < b);
    return (kl_wide)((first & (kl_wide_bits)a) | (~first & (kl_wide_bits)b));
}
static inline void kl_wide_sums(const kl_wide *x, kl_real *first, kl_real *second) {
    *first = (*x)[0] + (*x)[1];
    *second = (*x)[2] + (*x)[3];
}
#endif

static inline kl_wide kl_wide_positive_or_0(kl_wide test, kl_wide x) {
    return (kl_wide)((kl_wide_bits)(test > (kl_wide){0}) & (kl_wide_bits)x);
}
#else
#define KL_WIDE KL_LANES
typedef kl_lane kl_wide;
typedef kl_lane_bits kl_wide_bits;

static inline kl_wide kl_wide_load(const kl_real *from, int h) {
    return kl_lane_load(&from[KL_WIDE * h], 0);
}
static inline void kl_wide_store(kl_real *to, int h, kl_wide x) {
    kl_lane_store(&to[KL_WIDE * h], 0, x);
}
static inline kl_wide kl_wide_twice(const kl_real *pair, int h) {
    return kl_lane_load_even(pair, h % (KL_SIDES / KL_LANES));
}
static inline void kl_wide_sums(const kl_wide *x, kl_real *first, kl_real *second) {
#if KL_LANES == 2
    *first = x[0][0] + x[0][1];
    *second = x[1][0] + x[1][1];
#else
    *first = x[0] + x[1];
    *second = x[2] + x[3];
#endif
}
/* Here the first of two is all that there is room for. */
static inline kl_wide kl_wide_join(kl_lane a, kl_lane b) {
    (void)b;
    return a;
}
static inline kl_lane kl_wide_first(kl_wide x) {
    return x;
}
static inline kl_wide kl_wide_at_least(kl_wide a, kl_wide b) {
    return kl_lane_at_least(a, b);
}
static inline kl_wide kl_wide_at_most(kl_wide a, kl_wide b) {
    return kl_lane_at_most(a, b);
}
static inline kl_wide kl_wide_positive_or_0(kl_wide test, kl_wide x) {
    return kl_lane_positive_or_0(test, x);
}
#endif
#define KL_EACH_WIDE(h) KL_UNROLL_4 for (int h = 0; h < 4 / KL_WIDE; h++)

/* Part h of what two contacts have of either side; and where it belongs. */
#if KL_WIDE == 4
#define KL_WIDE_OF(a, b, h) kl_wide_join(a, b)
#define KL_WIDE_PUT(a, b, h, x) ((a) = kl_wide_first(x), (b) = kl_wide_second(x))
#else
#define KL_WIDE_PART(h) ((h) % (KL_SIDES / KL_LANES))
#define KL_WIDE_OF(a, b, h)                                                                        \
    ((h) < KL_SIDES / KL_LANES ? KL_LANE(a, KL_WIDE_PART(h)) : KL_LANE(b, KL_WIDE_PART(h)))
#define KL_WIDE_PUT(a, b, h, x)                                                                    \
    (*((h) < KL_SIDES / KL_LANES ? &KL_LANE(a, KL_WIDE_PART(h)) : &KL_LANE(b, KL_WIDE_PART(h))) = x)
#endif

/* The same value in every part. */
static inline kl_wide kl_wide_all(kl_real x) {
#if KL_WIDE == 4
    const kl_wide all = {x, x, x, x};
    return all;
#else
    return kl_lane_of(x, x, 0);
#endif
}

/*
 * Two neighbouring columns of a row pair of either side, linear in between: from a (right and left)
 * to the rows that lie `stride` reals on, at t_r and t_l. They come out as values of both sides.
 */
static inline void kl_lane_columns(const kl_real *right, const kl_real *left, size_t stride,
                                   kl_real t_r, kl_real t_l, kl_both *first, kl_both *second) {
#if KL_LANES == 2
    const kl_lane t_right = {t_r, t_r};
    const kl_lane t_left = {t_l, t_l};
    const kl_lane r = kl_lane_load(right, 0);
    const kl_lane l = kl_lane_load(left, 0);
    const kl_lane at_right = r + t_right * (kl_lane_load(right + stride, 0) - r);
    const kl_lane at_left = l + t_left * (kl_lane_load(left + stride, 0) - l);
    *first = (kl_lane){at_right[0], at_left[0]};
    *second = (kl_lane){at_right[1], at_left[1]};
#else
    (*first)[KL_RIGHT] = right[0] + t_r * (right[stride] - right[0]);
    (*second)[KL_RIGHT] = right[1] + t_r * (right[stride + 1u] - right[1]);
    (*first)[KL_LEFT] = left[0] + t_l * (left[stride] - left[0]);
    (*second)[KL_LEFT] = left[1] + t_l * (left[stride + 1u] - left[1]);
#endif
}

/* The same for four neighbouring columns. */
static inline void kl_lane_four_columns(const kl_real *right, const kl_real *left, size_t stride,
                                        kl_real t_r, kl_real t_l, kl_both *first, kl_both *second,
                                        kl_both *third, kl_both *fourth) {
#if KL_WIDE == 4
    const kl_wide r = kl_wide_load(right, 0);
    const kl_wide l = kl_wide_load(left, 0);
    const kl_wide at_right = r + t_r * (kl_wide_load(right + stride, 0) - r);
    const kl_wide at_left = l + t_l * (kl_wide_load(left + stride, 0) - l);
    kl_lane mixed[4];
    kl_wide_mix(at_right, at_left, mixed);
    *first = mixed[0];
    *second = mixed[1];
    *third = mixed[2];
    *fourth = mixed[3];
#else
    kl_lane_columns(right, left, stride, t_r, t_l, first, second);
    kl_lane_columns(right + 2, left + 2, stride, t_r, t_l, third, fourth);
#endif
}

/* The same value for either side. */
static inline kl_lane kl_lane_all(kl_real x) {
    return kl_lane_of(x, x, 0);
}

/* One of two values that are the same. */
static inline kl_real kl_lane_first(kl_lane x) {
#if KL_LANES == 2
    return x[KL_RIGHT];
#else
    return x;
#endif
}

/* True where every part is 0. */
static inline int kl_lane_is_0(kl_lane x) {
#if KL_LANES == 2
    return x[KL_RIGHT] == (kl_real)0 && x[KL_LEFT] == (kl_real)0;
#else
    return x == (kl_real)0;
#endif
}

/* Both sides together; swapping them changes nothing. */
#define KL_SUM(x) ((x)[KL_RIGHT] + (x)[KL_LEFT])

#endif
