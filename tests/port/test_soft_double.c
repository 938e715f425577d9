/* port/mps2/soft_double.c against the arithmetic of this machine, which is IEEE 754's. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#define KL_SOFT_DOUBLE_TEST
#include "mps2/soft_double.c"

static uint64_t random_state;
static uint64_t random_bits(void) {
    random_state = random_state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    uint64_t high = random_state;
    random_state = random_state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (high & ~UINT64_C(0xFFFFFFFF)) | random_state >> 32;
}

static uint64_t bits_of(double x) {
    uint64_t bits = 0;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static double value_of(uint64_t bits) {
    double x = 0;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static void assert_sum(uint64_t a, uint64_t b) {
    const double sum = value_of(a) + value_of(b);
    const uint64_t soft = kl_soft_add(a, b);
    if (sum != sum) {
        assert_true(value_of(soft) != value_of(soft));
    } else {
        assert_int_equal(soft, bits_of(sum));
    }
}

/* The case that libgcc gets wrong: by hand, 2^53 - 0x1ccdc8.297191a2 rounds to ...33238. */
static void the_case_of_libgcc(void **state) {
    (void)state;
    assert_int_equal(kl_soft_add(UINT64_C(0x3ff0000000000000), UINT64_C(0x3deccdc8297191a2) | SIGN),
                     UINT64_C(0x3fefffffffe33238));
}

static void powers_of_two_less_anything(void **state) {
    (void)state;
    random_state = 1;
    for (int distance = 0; distance < 70; distance++) {
        for (int i = 0; i < 20000; i++) {
            uint64_t sign = (random_bits() & 1u) << 63;
            uint64_t large = sign | UINT64_C(1100) << 52 | (random_bits() & 3u);
            uint64_t small =
                (sign ^ SIGN) | (uint64_t)(1100 - distance) << 52 | (random_bits() & (HIDDEN - 1));
            assert_sum(large, small);
            assert_sum(small, large);
        }
    }
}

static void all_kinds(void **state) {
    (void)state;
    static const uint64_t edges[] = {0,
                                     1,
                                     UINT64_C(0x000fffffffffffff),
                                     UINT64_C(0x0010000000000000),
                                     UINT64_C(0x0010000000000001),
                                     UINT64_C(0x3ff0000000000000),
                                     UINT64_C(0x3fefffffffffffff),
                                     UINT64_C(0x7fefffffffffffff),
                                     UINT64_C(0x7fe0000000000000),
                                     UINT64_C(0x7ff0000000000000),
                                     UINT64_C(0x7ff8000000000000),
                                     UINT64_C(0x7ff0000000000001)};
    const size_t n = sizeof edges / sizeof edges[0];
    for (size_t i = 0; i < 4 * n * n; i++) {
        assert_sum(edges[i / 4 / n] | (i & 1u) << 63, edges[i / 4 % n] | (i >> 1 & 1u) << 63);
    }
    random_state = 2;
    for (int i = 0; i < 2000000; i++) {
        uint64_t a = random_bits();
        uint64_t b = random_bits();
        if (i % 2 == 0) { /* of like size */
            b = (b & ~INFINITE) | ((a + ((random_bits() % 120) << 52)) & INFINITE);
        }
        assert_sum(a, b);
    }
}

static void integers_and_floats(void **state) {
    (void)state;
    random_state = 3;
    for (int i = 0; i < 500000; i++) {
        uint64_t bits = random_bits() >> (random_bits() % 64);
        uint32_t narrow = (uint32_t)random_bits();
        float single = 0;
        assert_int_equal(kl_soft_of_u64(bits), bits_of((double)bits));
        assert_int_equal(kl_soft_of_i64((int64_t)bits), bits_of((double)(int64_t)bits));
        assert_int_equal(kl_soft_of_i64(-(int64_t)(bits >> 1)),
                         bits_of((double)-(int64_t)(bits >> 1)));
        if (i % 4 == 0) {
            narrow &= 0x807FFFFFu; /* below the normal ones */
        }
        memcpy(&single, &narrow, sizeof single);
        if (single == single) {
            assert_int_equal(kl_soft_of_float(narrow), bits_of((double)single));
        }
    }
    assert_int_equal(kl_soft_of_i64(INT64_MIN), bits_of(-0x1p63));
    assert_int_equal(kl_soft_of_u64(UINT64_MAX), bits_of(0x1p64));
    assert_true(kl_soft_of_float(0x7f800001u) > INFINITE);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_case_of_libgcc),
        cmocka_unit_test(powers_of_two_less_anything),
        cmocka_unit_test(all_kinds),
        cmocka_unit_test(integers_and_floats),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
