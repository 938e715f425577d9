/* The CAN seam: which frames are well-formed, and calls through incomplete tables. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "kl_can.h"

static enum kl_can_status check(uint32_t id, unsigned flags, uint8_t length) {
    const struct kl_can_frame frame = {.id = id, .flags = (uint8_t)flags, .length = length};
    return kl_can_check(&frame);
}

static void identifiers_have_11_or_29_bits(void **state) {
    (void)state;
    assert_int_equal(check(0x7FF, 0, 8), KL_CAN_OK);
    assert_int_equal(check(0x800, 0, 8), KL_CAN_REFUSED);
    assert_int_equal(check(0x1FFFFFFF, KL_CAN_EXTENDED, 0), KL_CAN_OK);
    assert_int_equal(check(0x20000000, KL_CAN_EXTENDED, 0), KL_CAN_REFUSED);
    assert_int_equal(kl_can_check(NULL), KL_CAN_ARGUMENT);
}

/* Lengths a CAN FD data length code can express, ISO 11898-1 table 5. */
static void lengths_are_those_of_the_standard(void **state) {
    (void)state;
    static const uint8_t fd[] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64};
    for (unsigned length = 0; length <= 255; length++) {
        bool allowed = false;
        for (size_t i = 0; i < sizeof fd; i++) {
            allowed = allowed || fd[i] == length;
        }
        assert_int_equal(check(1, KL_CAN_FD, (uint8_t)length),
                         allowed ? KL_CAN_OK : KL_CAN_REFUSED);
        assert_int_equal(check(1, 0, (uint8_t)length), length <= 8 ? KL_CAN_OK : KL_CAN_REFUSED);
    }
}

static void flags_agree_with_each_other(void **state) {
    (void)state;
    assert_int_equal(check(1, KL_CAN_REMOTE, 8), KL_CAN_OK);
    assert_int_equal(check(1, KL_CAN_FD | KL_CAN_BRS, 64), KL_CAN_OK);
    assert_int_equal(check(1, KL_CAN_FD | KL_CAN_REMOTE, 0), KL_CAN_REFUSED);
    assert_int_equal(check(1, KL_CAN_BRS, 8), KL_CAN_REFUSED);
    assert_int_equal(check(1, 1u << 4, 8), KL_CAN_REFUSED);
}

static void absent_operations_do_nothing(void **state) {
    (void)state;
    static const struct kl_can_ops empty = {0};
    const struct kl_can bound = {.ops = &empty};
    const struct kl_can unbound = {0};
    struct kl_can_frame frame = {.id = 1};
    struct kl_can_counts counts = {.sent = 7};

    assert_int_equal(kl_can_recover(&bound), KL_CAN_OK);
    kl_can_service(&bound);
    kl_can_close(&bound);
    assert_false(kl_can_is_up(&bound));
    assert_int_equal(kl_can_send(&bound, &frame), KL_CAN_ARGUMENT);
    kl_can_get_counts(&bound, &counts);
    assert_int_equal(counts.sent, 0);

    assert_int_equal(kl_can_send(&unbound, &frame), KL_CAN_ARGUMENT);
    assert_int_equal(kl_can_receive(&unbound, &frame), KL_CAN_ARGUMENT);
    assert_int_equal(kl_can_recover(NULL), KL_CAN_ARGUMENT);
    kl_can_service(NULL);
    kl_can_close(NULL);
    assert_false(kl_can_is_up(NULL));
}

static void every_status_has_a_text(void **state) {
    (void)state;
    for (int status = -7; status <= 3; status++) {
        assert_non_null(kl_can_status_text((enum kl_can_status)status));
    }
    assert_string_equal(kl_can_status_text(KL_CAN_OK), "ok");
    assert_string_not_equal(kl_can_status_text(KL_CAN_BUSY), kl_can_status_text(KL_CAN_DOWN));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(identifiers_have_11_or_29_bits),
        cmocka_unit_test(lengths_are_those_of_the_standard),
        cmocka_unit_test(flags_agree_with_each_other),
        cmocka_unit_test(absent_operations_do_nothing),
        cmocka_unit_test(every_status_has_a_text),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
