/* The bus in memory: order, bounds, faults by number, loss of the bus. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "kl_virtual_bus.h"

#define RING 4u

struct fixture {
    struct kl_vbus bus;
    struct kl_vbus_node node[3];
    struct kl_can_frame ring[3][RING];
    struct kl_can can[3];
};

static void set_up(struct fixture *f) {
    kl_vbus_init(&f->bus);
    for (unsigned i = 0; i < 3; i++) {
        assert_int_equal(kl_vbus_join(&f->bus, &f->node[i], f->ring[i], RING, &f->can[i]),
                         KL_CAN_OK);
    }
}

static enum kl_can_status send(const struct kl_can *can, uint8_t value) {
    const struct kl_can_frame frame = {.id = 0x123, .length = 1, .data = {value}};
    return kl_can_send(can, &frame);
}

/* The value of the next frame, or -1 if there is none. */
static int next(const struct kl_can *can) {
    struct kl_can_frame frame;
    return kl_can_receive(can, &frame) == KL_CAN_OK ? frame.data[0] : -1;
}

static void frames_arrive_in_order_everywhere_but_at_the_sender(void **state) {
    (void)state;
    struct fixture f;
    set_up(&f);
    assert_int_equal(send(&f.can[0], 1), KL_CAN_OK);
    assert_int_equal(send(&f.can[1], 2), KL_CAN_OK);
    assert_int_equal(next(&f.can[0]), 2);
    assert_int_equal(next(&f.can[0]), -1);
    assert_int_equal(next(&f.can[1]), 1);
    assert_int_equal(next(&f.can[1]), -1);
    assert_int_equal(next(&f.can[2]), 1);
    assert_int_equal(next(&f.can[2]), 2);
    assert_int_equal(next(&f.can[2]), -1);
}

static void a_full_ring_loses_the_new_frame_and_counts_it(void **state) {
    (void)state;
    struct fixture f;
    struct kl_can_counts counts;
    set_up(&f);
    for (uint8_t i = 0; i < 7; i++) {
        assert_int_equal(send(&f.can[0], i), KL_CAN_OK);
    }
    kl_can_get_counts(&f.can[1], &counts);
    assert_int_equal(counts.receive_dropped, 3);
    for (int i = 0; i < (int)RING; i++) {
        assert_int_equal(next(&f.can[1]), i);
    }
    assert_int_equal(send(&f.can[0], 9), KL_CAN_OK); /* the ring has gone round */
    assert_int_equal(next(&f.can[1]), 9);
    kl_can_get_counts(&f.can[0], &counts);
    assert_int_equal(counts.sent, 8);
    assert_int_equal(counts.send_dropped, 0);
}

static void a_budget_makes_the_bus_busy_until_the_next_tick(void **state) {
    (void)state;
    struct fixture f;
    struct kl_can_counts counts;
    set_up(&f);
    kl_vbus_set_budget(&f.node[0], 2);
    assert_int_equal(send(&f.can[0], 1), KL_CAN_OK);
    assert_int_equal(send(&f.can[0], 2), KL_CAN_OK);
    assert_int_equal(send(&f.can[0], 3), KL_CAN_BUSY);
    assert_int_equal(send(&f.can[1], 4), KL_CAN_OK);
    kl_vbus_tick(&f.bus);
    assert_int_equal(send(&f.can[0], 5), KL_CAN_OK);
    kl_can_get_counts(&f.can[0], &counts);
    assert_int_equal(counts.send_dropped, 1);
}

static void a_bus_that_is_away_says_so_until_recovered(void **state) {
    (void)state;
    struct fixture f;
    struct kl_can_counts counts;
    set_up(&f);
    assert_true(kl_can_is_up(&f.can[0]));
    kl_vbus_set_up(&f.bus, false);
    assert_false(kl_can_is_up(&f.can[0]));
    assert_int_equal(send(&f.can[0], 1), KL_CAN_DOWN);
    assert_int_equal(kl_can_recover(&f.can[0]), KL_CAN_DOWN);
    kl_vbus_set_up(&f.bus, true);
    assert_int_equal(send(&f.can[0], 2), KL_CAN_DOWN);
    assert_int_equal(kl_can_recover(&f.can[0]), KL_CAN_OK);
    assert_int_equal(kl_can_recover(&f.can[1]), KL_CAN_OK);
    assert_int_equal(send(&f.can[0], 3), KL_CAN_OK);
    assert_int_equal(next(&f.can[1]), 3);
    kl_can_get_counts(&f.can[0], &counts);
    assert_int_equal(counts.recoveries, 1);
    assert_int_equal(counts.send_dropped, 2);
}

static void faults_strike_at_their_number(void **state) {
    (void)state;
    static const struct {
        enum kl_vbus_fault_kind kind;
        enum kl_can_status answer;
    } cases[] = {{KL_VBUS_SEND_FAILS, KL_CAN_FAILED},
                 {KL_VBUS_SEND_BUSY, KL_CAN_BUSY},
                 {KL_VBUS_CALL_FAILS, KL_CAN_FAILED},
                 {KL_VBUS_GOES_DOWN, KL_CAN_DOWN}};
    for (size_t c = 0; c < sizeof cases / sizeof cases[0]; c++) {
        for (uint64_t k = 1; k <= 4; k++) {
            struct fixture f;
            set_up(&f);
            assert_true(kl_vbus_inject(
                &f.node[0], (struct kl_vbus_fault){.kind = cases[c].kind, .first = k, .last = k}));
            for (uint64_t i = 1; i <= 5; i++) {
                enum kl_can_status sent = send(&f.can[0], (uint8_t)i);
                bool hit = i == k || (i > k && cases[c].kind == KL_VBUS_GOES_DOWN);
                assert_int_equal(sent, hit ? cases[c].answer : KL_CAN_OK);
            }
        }
    }
}

static void lost_and_corrupt_frames_look_sent(void **state) {
    (void)state;
    struct fixture f;
    set_up(&f);
    kl_vbus_inject(&f.node[0],
                   (struct kl_vbus_fault){.kind = KL_VBUS_SEND_LOST, .first = 2, .last = 2});
    kl_vbus_inject(&f.node[0],
                   (struct kl_vbus_fault){.kind = KL_VBUS_SEND_CORRUPT, .first = 3, .every = 100});
    for (uint8_t i = 1; i <= 4; i++) {
        assert_int_equal(send(&f.can[0], (uint8_t)(i << 4)), KL_CAN_OK);
    }
    assert_int_equal(next(&f.can[1]), 0x10);
    int corrupt = next(&f.can[1]);
    assert_int_equal(__builtin_popcount((unsigned)corrupt ^ 0x30u), 1);
    assert_int_equal(next(&f.can[1]), 0x40);
    kl_vbus_clear_faults(&f.node[0]);
    send(&f.can[0], 7);
    assert_int_equal(next(&f.can[1]), 7);
}

static void a_failed_receive_keeps_the_frame(void **state) {
    (void)state;
    struct fixture f;
    struct kl_can_frame frame = {.id = 99};
    set_up(&f);
    kl_vbus_inject(&f.node[1],
                   (struct kl_vbus_fault){.kind = KL_VBUS_RECEIVE_FAILS, .first = 1, .last = 1});
    send(&f.can[0], 5);
    assert_int_equal(kl_can_receive(&f.can[1], &frame), KL_CAN_FAILED);
    assert_int_equal(frame.id, 99);
    assert_int_equal(next(&f.can[1]), 5);
}

static void bad_frames_and_bad_arguments_are_refused(void **state) {
    (void)state;
    struct fixture f;
    struct kl_vbus_node extra[KL_VBUS_MAX_NODES];
    struct kl_can_frame ring[KL_VBUS_MAX_NODES];
    struct kl_can can;
    const struct kl_can_frame bad = {.id = 0x800, .length = 8};
    set_up(&f);
    assert_int_equal(kl_can_send(&f.can[0], &bad), KL_CAN_REFUSED);
    assert_int_equal(next(&f.can[1]), -1);
    assert_int_equal(kl_can_send(&f.can[0], NULL), KL_CAN_ARGUMENT);
    assert_int_equal(kl_can_receive(&f.can[0], NULL), KL_CAN_ARGUMENT);
    assert_int_equal(kl_vbus_join(&f.bus, &extra[0], ring, 0, &can), KL_CAN_ARGUMENT);
    for (unsigned i = 3; i < KL_VBUS_MAX_NODES; i++) {
        assert_int_equal(kl_vbus_join(&f.bus, &extra[i], &ring[i], 1, &can), KL_CAN_OK);
    }
    assert_int_equal(kl_vbus_join(&f.bus, &extra[0], ring, 1, &can), KL_CAN_REFUSED);
    kl_can_close(&f.can[2]);
    assert_false(kl_can_is_up(&f.can[2]));
    assert_int_equal(send(&f.can[2], 1), KL_CAN_DOWN);
    assert_int_equal(send(&f.can[0], 1), KL_CAN_OK);
    assert_int_equal(kl_vbus_join(&f.bus, &extra[0], ring, 1, &can), KL_CAN_OK);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(frames_arrive_in_order_everywhere_but_at_the_sender),
        cmocka_unit_test(a_full_ring_loses_the_new_frame_and_counts_it),
        cmocka_unit_test(a_budget_makes_the_bus_busy_until_the_next_tick),
        cmocka_unit_test(a_bus_that_is_away_says_so_until_recovered),
        cmocka_unit_test(faults_strike_at_their_number),
        cmocka_unit_test(lost_and_corrupt_frames_look_sent),
        cmocka_unit_test(a_failed_receive_keeps_the_frame),
        cmocka_unit_test(bad_frames_and_bad_arguments_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
