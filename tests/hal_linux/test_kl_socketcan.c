/* SocketCAN without a bus: arguments, and a kernel that has no CAN. The rest is in
 * tests/conformance. */
#include "kl_socketcan.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

static void arguments_are_checked(void **state) {
    (void)state;
    struct kl_socketcan port;
    const struct kl_socketcan_options nameless = {.interface = NULL};
    const struct kl_socketcan_options empty = {.interface = ""};
    const struct kl_socketcan_options too_long = {.interface = "sixteen-letters."};
    assert_int_equal(kl_socketcan_open(NULL, &empty), KL_CAN_ARGUMENT);
    assert_int_equal(kl_socketcan_open(&port, NULL), KL_CAN_ARGUMENT);
    assert_int_equal(kl_socketcan_open(&port, &nameless), KL_CAN_ARGUMENT);
    assert_int_equal(kl_socketcan_open(&port, &empty), KL_CAN_ARGUMENT);
    assert_int_equal(kl_socketcan_open(&port, &too_long), KL_CAN_ARGUMENT);
    assert_string_equal(kl_socketcan_text(NULL), "");
}

/* A port that failed to open is inert. */
static void failed_port_is_inert(void **state) {
    (void)state;
    struct kl_socketcan port;
    const struct kl_socketcan_options empty = {.interface = ""};
    const struct kl_can_frame frame = {.id = 1};
    struct kl_can_frame got;
    struct kl_can_counts counts;
    assert_int_equal(kl_socketcan_open(&port, &empty), KL_CAN_ARGUMENT);
    const struct kl_can can = kl_socketcan_can(&port);
    assert_false(kl_can_is_up(&can));
    assert_int_equal(kl_can_send(&can, &frame), KL_CAN_DOWN);
    assert_int_equal(kl_can_receive(&can, &got), KL_CAN_DOWN);
    assert_int_equal(kl_can_recover(&can), KL_CAN_DOWN);
    kl_can_get_counts(&can, &counts);
    assert_int_equal(counts.send_dropped, 1);
    kl_can_close(&can);
}

static void kernel_without_can_is_told(void **state) {
    (void)state;
    struct kl_socketcan port;
    const struct kl_socketcan_options options = {.interface = "vcan0"};
    if (kl_socketcan_available())
        skip();
    assert_int_equal(kl_socketcan_open(&port, &options), KL_CAN_FAILED);
    assert_string_equal(kl_socketcan_text(&port),
                        "vcan0: socket: Address family not supported by protocol");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(arguments_are_checked),
        cmocka_unit_test(failed_port_is_inert),
        cmocka_unit_test(kernel_without_can_is_told),
    };
    return cmocka_run_group_tests_name("kl_socketcan", tests, NULL, NULL);
}
