/* The core's elementary functions against the C library's, and the hash against published values.
 */
#include "fixtures.h"
#include "kl_math.h"

/* Distance in units of the last place of `want`. */
static double ulps(double got, double want) {
    int exponent;
    (void)frexp(want, &exponent);
    return fabs(got - want) / ldexp(1.0, exponent - 53);
}

static double double_from(uint64_t bits) {
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static uint64_t bits_from(double x) {
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

/* sqrt is correctly rounded by IEEE 754: every bit must agree, over all exponents, subnormals too.
 */
static void sqrt_is_correctly_rounded(void **state) {
    (void)state;
    uint64_t seed = 1;
    for (int i = 0; i < 300000; i++) {
        const double x = fabs(double_from(random_bits(&seed)));
        if (!isnan(x)) {
            assert_int_equal(bits_from(kl_sqrt_portable(x)), bits_from(sqrt(x)));
            assert_int_equal(bits_from(kl_sqrt(x)), bits_from(sqrt(x)));
        }
    }
    const double special[] = {0.0,
                              -0.0,
                              1.0,
                              4.0,
                              DBL_MIN,
                              DBL_MAX,
                              DBL_TRUE_MIN,
                              0x1.fffffffffffffp-1023,
                              2.0 - DBL_EPSILON,
                              1.0 + DBL_EPSILON,
                              (double)INFINITY};
    for (size_t i = 0; i < COUNT(special); i++) {
        assert_int_equal(bits_from(kl_sqrt_portable(special[i])), bits_from(sqrt(special[i])));
    }
    assert_true(isnan(kl_sqrt_portable(-1.0)));
    assert_true(isnan(kl_sqrt_portable((double)NAN)));
    assert_true(isnan(kl_sqrt_portable(-(double)INFINITY)));
    assert_true(isnan(kl_sqrt(-1.0)));
}

/* kl_math.h: relative to 1 within 4e-16 for |x| <= 1e6. */
static void sine_and_cosine_agree_with_libm(void **state) {
    (void)state;
    uint64_t seed = 2;
    double worst = 0.0;
    for (int i = 0; i < 600000; i++) {
        const double range = i % 3 == 0 ? 1e6 : (i % 3 == 1 ? 10.0 : 1e-3);
        const double x = random_between(&seed, -range, range);
        worst = fmax(worst, fabs(kl_sin(x) - sin(x)));
        worst = fmax(worst, fabs(kl_cos(x) - cos(x)));
    }
    assert_at_most(worst, 4e-16);
    assert_true(kl_sin(0.0) == 0.0 && kl_cos(0.0) == 1.0);
    assert_true(kl_sin(-1.25) == -kl_sin(1.25) && kl_cos(-1.25) == kl_cos(1.25));
}

static void small_angles_keep_their_digits(void **state) {
    (void)state;
    uint64_t seed = 3;
    for (int i = 0; i < 100000; i++) {
        const double x = random_between(&seed, -0.78, 0.78);
        assert_at_most(ulps(kl_sin(x), sin(x)), 4.0);
        assert_at_most(fabs(kl_tan(x) - tan(x)), 1e-15 * fabs(tan(x)));
    }
}

static void arc_tangent_agrees_with_libm(void **state) {
    (void)state;
    uint64_t seed = 4;
    for (int i = 0; i < 300000; i++) {
        const double x = pow(10.0, random_between(&seed, -9.0, 9.0)) * (i % 2 == 0 ? 1.0 : -1.0);
        assert_at_most(fabs(kl_atan(x) - atan(x)), 1e-15 * fabs(atan(x)));
    }
    assert_true(kl_atan(0.0) == 0.0);
}

/* kl_math.h: within 4 units in the last place, for every normal number that a load can be. */
static void inverse_cube_root(void **state) {
    (void)state;
    uint64_t seed = 5;
    for (int i = 0; i < 300000; i++) {
        const double x = pow(10.0, random_between(&seed, -30.0, 30.0));
        const double want = (double)(1.0L / cbrtl((long double)x));
        assert_at_most(ulps((double)kl_inverse_cbrt((kl_real)x), want), 4.0);
    }
}

static void finite_tells_numbers_from_the_rest(void **state) {
    (void)state;
    assert_true(kl_finite(0.0) && kl_finite(DBL_MAX) && kl_finite(-DBL_MAX) &&
                kl_finite(DBL_TRUE_MIN));
    assert_false(kl_finite((double)NAN) || kl_finite((double)INFINITY) ||
                 kl_finite(-(double)INFINITY));
}

/* Noll's FNV-1a, 64 bit: published test vectors. */
static void hash_is_fnv_1a(void **state) {
    (void)state;
    assert_int_equal(kl_hash_bytes(KL_HASH_SEED, "", 0), UINT64_C(0xcbf29ce484222325));
    assert_int_equal(kl_hash_bytes(KL_HASH_SEED, "a", 1), UINT64_C(0xaf63dc4c8601ec8c));
    assert_int_equal(kl_hash_bytes(KL_HASH_SEED, "foobar", 6), UINT64_C(0x85944171f73967e8));
    const uint64_t first = kl_hash_bytes(KL_HASH_SEED, "foo", 3);
    assert_int_equal(kl_hash_bytes(first, "bar", 3), UINT64_C(0x85944171f73967e8));
}

static void every_status_has_a_text_of_its_own(void **state) {
    (void)state;
    const char *unknown = kl_status_text((enum kl_status) - 999);
    for (int i = KL_ERR_REFERENCE; i <= 0; i++) {
        const char *text = kl_status_text((enum kl_status)i);
        assert_non_null(text);
        assert_string_not_equal(text, unknown);
        for (int k = KL_ERR_REFERENCE; k < i; k++) {
            assert_string_not_equal(text, kl_status_text((enum kl_status)k));
        }
    }
    assert_string_equal(kl_status_text((enum kl_status)1), unknown);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sqrt_is_correctly_rounded),
        cmocka_unit_test(sine_and_cosine_agree_with_libm),
        cmocka_unit_test(small_angles_keep_their_digits),
        cmocka_unit_test(arc_tangent_agrees_with_libm),
        cmocka_unit_test(inverse_cube_root),
        cmocka_unit_test(finite_tells_numbers_from_the_rest),
        cmocka_unit_test(hash_is_fnv_1a),
        cmocka_unit_test(every_status_has_a_text_of_its_own),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
