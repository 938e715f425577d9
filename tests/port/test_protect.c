/* Command protection: the CRC against published values, and every verdict of the check. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <string.h>

#include "kl_protect.h"

/* Check value of CRC-8/SAE-J1850 from the catalogue of parametrised CRC algorithms. */
static void crc_has_its_check_value(void **state) {
    (void)state;
    assert_int_equal(kl_crc8_j1850((const uint8_t *)"123456789", 9), 0x4B);
    assert_int_equal(kl_crc8_j1850(NULL, 0), 0x00);
}

/* The examples of the AUTOSAR protocol specification for variant A: data ID 0x123, eight bytes,
 * all payload zero, counters 0 and 1. */
static void frames_match_the_autosar_examples(void **state) {
    (void)state;
    uint8_t counter = 0;
    uint8_t data[8] = {0};
    kl_protect_seal(0x123, &counter, data, sizeof data);
    assert_int_equal(data[0], 0xCC);
    assert_int_equal(data[1], 0x00);
    kl_protect_seal(0x123, &counter, data, sizeof data);
    assert_int_equal(data[0], 0x91);
    assert_int_equal(data[1], 0x01);
}

static void counter_runs_0_to_14_and_is_accepted_in_order(void **state) {
    (void)state;
    struct kl_protect check;
    uint8_t counter = 0;
    kl_protect_init(&check, 0xABCD);
    for (unsigned i = 0; i < 100; i++) {
        uint8_t data[8] = {0, 0x50, (uint8_t)i};
        kl_protect_seal(0xABCD, &counter, data, sizeof data);
        assert_int_equal(data[1], 0x50 | (i % 15));
        assert_int_equal(kl_protect_check(&check, data, sizeof data), KL_PROTECT_OK);
    }
    assert_int_equal(check.ok, 100);
    assert_int_equal(check.repeated + check.gaps + check.bad_crc, 0);
}

static void repetition_and_gaps_are_told_apart(void **state) {
    (void)state;
    struct kl_protect check;
    uint8_t counter = 9; /* any first counter is right */
    uint8_t data[8] = {0};
    kl_protect_init(&check, 1);
    kl_protect_seal(1, &counter, data, sizeof data);
    assert_int_equal(kl_protect_check(&check, data, sizeof data), KL_PROTECT_OK);
    assert_int_equal(kl_protect_check(&check, data, sizeof data), KL_PROTECT_REPEATED);
    kl_protect_seal(1, &counter, data, sizeof data); /* lost */
    kl_protect_seal(1, &counter, data, sizeof data);
    assert_int_equal(kl_protect_check(&check, data, sizeof data), KL_PROTECT_GAP);
    kl_protect_seal(1, &counter, data, sizeof data);
    assert_int_equal(kl_protect_check(&check, data, sizeof data), KL_PROTECT_OK);
    assert_int_equal(check.ok, 2);
    assert_int_equal(check.repeated, 1);
    assert_int_equal(check.gaps, 1);
}

/* The polynomial finds every error of one or two bits in a frame. */
static void every_one_and_two_bit_error_is_found(void **state) {
    (void)state;
    uint8_t counter = 3;
    uint8_t good[8] = {0, 0, 0x12, 0x34, 0x56, 0x78, 0x9A, 0xBC};
    kl_protect_seal(0x1010, &counter, good, sizeof good);
    for (unsigned a = 0; a < 64; a++) {
        for (unsigned b = a; b < 64; b++) {
            struct kl_protect check;
            uint8_t bad[8];
            memcpy(bad, good, sizeof bad);
            bad[a / 8] = (uint8_t)(bad[a / 8] ^ (1u << (a % 8)));
            if (b != a) {
                bad[b / 8] = (uint8_t)(bad[b / 8] ^ (1u << (b % 8)));
            }
            kl_protect_init(&check, 0x1010);
            assert_int_equal(kl_protect_check(&check, bad, sizeof bad), KL_PROTECT_BAD_CRC);
            assert_int_equal(check.last, KL_PROTECT_NO_COUNTER);
        }
    }
}

static void foreign_short_and_reserved_frames_are_bad(void **state) {
    (void)state;
    struct kl_protect check;
    uint8_t counter = 0;
    uint8_t data[8] = {0};
    kl_protect_init(&check, 0x1011);
    kl_protect_seal(0x1010, &counter, data, sizeof data);
    assert_int_equal(kl_protect_check(&check, data, sizeof data), KL_PROTECT_BAD_CRC);
    assert_int_equal(kl_protect_check(&check, data, 1), KL_PROTECT_BAD_CRC);
    assert_int_equal(kl_protect_check(&check, data, 0), KL_PROTECT_BAD_CRC);
    for (unsigned crc = 0; crc < 256; crc++) { /* counter 15 with whatever CRC */
        uint8_t reserved[8] = {(uint8_t)crc, 0x0F};
        assert_int_equal(kl_protect_check(&check, reserved, sizeof reserved), KL_PROTECT_BAD_CRC);
    }
    assert_int_equal(check.bad_crc, 3 + 256);
}

static void sealing_is_bounded(void **state) {
    (void)state;
    uint8_t counter = 200; /* not a counter value: counts as 0 */
    uint8_t data[2] = {0x77, 0x77};
    kl_protect_seal(1, &counter, data, 1);
    assert_int_equal(data[0], 0x77);
    assert_int_equal(counter, 200);
    kl_protect_seal(1, &counter, data, 2);
    assert_int_equal(data[1], 0x70);
    assert_int_equal(counter, 1);
    for (int result = -1; result < 6; result++) {
        assert_non_null(kl_protect_text((enum kl_protect_result)result));
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(crc_has_its_check_value),
        cmocka_unit_test(frames_match_the_autosar_examples),
        cmocka_unit_test(counter_runs_0_to_14_and_is_accepted_in_order),
        cmocka_unit_test(repetition_and_gaps_are_told_apart),
        cmocka_unit_test(every_one_and_two_bit_error_is_found),
        cmocka_unit_test(foreign_short_and_reserved_frames_are_bad),
        cmocka_unit_test(sealing_is_bounded),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
