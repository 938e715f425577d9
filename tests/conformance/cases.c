/*
 * What port/kl_can.h promises, held against any back end. Each case starts on a fresh bus with the
 * back end (`can`) and another node (the peer).
 */
#include "cases.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

/* A case that takes this long hangs in a call that must not block. */
#define HANGS_S 60u

static const struct bench *bench;
static struct kl_can can;
static struct kl_can_counts before;

/* ---- helpers ---- */

static struct kl_can_frame make(uint32_t id, unsigned flags, uint8_t length, uint8_t fill) {
    struct kl_can_frame frame = {.id = id, .flags = (uint8_t)flags, .length = length};
    if ((flags & KL_CAN_REMOTE) == 0) {
        for (unsigned i = 0; i < length && i < sizeof frame.data; i++)
            frame.data[i] = (uint8_t)(fill + 3 * i);
    }
    return frame;
}

static void assert_same(const struct kl_can_frame *is, const struct kl_can_frame *wanted) {
    assert_int_equal(is->id, wanted->id);
    assert_int_equal(is->flags, wanted->flags);
    assert_int_equal(is->length, wanted->length);
    assert_memory_equal(is->data, wanted->data, wanted->length);
}

static void pause_ms(long ms) {
    const struct timespec time = {.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000};
    nanosleep(&time, NULL);
}

/* What waits for the back end, given the time to arrive. */
static enum kl_can_status fetch(struct kl_can_frame *frame, int milliseconds) {
    enum kl_can_status status = KL_CAN_EMPTY;
    for (int i = 0; i <= 2 * milliseconds && status == KL_CAN_EMPTY; i++) {
        kl_can_service(&can);
        status = kl_can_receive(&can, frame);
        if (status == KL_CAN_EMPTY && i < 2 * milliseconds) {
            const struct timespec half = {.tv_nsec = 500000};
            nanosleep(&half, NULL);
        }
    }
    return status;
}

static struct kl_can_counts counts_now(void) {
    struct kl_can_counts counts;
    kl_can_get_counts(&can, &counts);
    assert_true(counts.sent >= before.sent && counts.received >= before.received &&
                counts.send_dropped >= before.send_dropped &&
                counts.receive_dropped >= before.receive_dropped &&
                counts.refused >= before.refused && counts.recoveries >= before.recoveries);
    before = counts;
    return counts;
}

/* The back end sends `out`, then the peer `in`; both arrive as they are. */
static void assert_carried(const struct kl_can_frame *out, const struct kl_can_frame *in) {
    struct kl_can_frame got;
    assert_int_equal(kl_can_send(&can, out), KL_CAN_OK);
    assert_true(bench->peer_receive(&got));
    assert_same(&got, out);
    assert_true(bench->peer_send(in));
    assert_int_equal(fetch(&got, 1000), KL_CAN_OK);
    assert_same(&got, in);
}

static void assert_both_ways_work(void) {
    const struct kl_can_frame out = make(0x321, 0, 8, 0x5A);
    const struct kl_can_frame in = make(0x322, 0, 3, 0xC0);
    assert_carried(&out, &in);
}

static int set_up(void **state) {
    (void)state;
    memset(&before, 0, sizeof before);
    (void)alarm(HANGS_S);
    return bench->open(&can) ? 0 : -1;
}

static int tear_down(void **state) {
    (void)state;
    bench->close();
    (void)alarm(0);
    return 0;
}

/* ---- frames ---- */

/* The i-th of a row of frames that all differ, i < 100. */
static struct kl_can_frame numbered(unsigned i) {
    return make(i * 20, 0, (uint8_t)(i % 9), (uint8_t)i);
}

static void sends_in_order(void **state) {
    (void)state;
    for (unsigned i = 0; i < 100; i++) {
        struct kl_can_frame frame = numbered(i);
        assert_int_equal(kl_can_send(&can, &frame), KL_CAN_OK);
    }
    for (unsigned i = 0; i < 100; i++) {
        struct kl_can_frame wanted = numbered(i);
        struct kl_can_frame got;
        assert_true(bench->peer_receive(&got));
        assert_same(&got, &wanted);
    }
    assert_int_equal(counts_now().sent, 100);
    assert_int_equal(counts_now().send_dropped, 0);
}

static void receives_in_order(void **state) {
    (void)state;
    struct kl_can_frame got;
    for (unsigned i = 0; i < 100; i++) {
        struct kl_can_frame frame = numbered(i);
        assert_true(bench->peer_send(&frame));
    }
    for (unsigned i = 0; i < 100; i++) {
        struct kl_can_frame wanted = numbered(i);
        assert_int_equal(fetch(&got, 1000), KL_CAN_OK);
        assert_same(&got, &wanted);
    }
    assert_int_equal(fetch(&got, 5), KL_CAN_EMPTY);
    assert_int_equal(counts_now().received, 100);
    assert_int_equal(counts_now().receive_dropped, 0);
}

static void nobody_hears_himself(void **state) {
    (void)state;
    const struct kl_can_frame frame = make(0x100, 0, 2, 1);
    struct kl_can_frame got;
    assert_int_equal(kl_can_send(&can, &frame), KL_CAN_OK);
    assert_true(bench->peer_receive(&got));
    assert_int_equal(fetch(&got, 10), KL_CAN_EMPTY);
    assert_true(bench->peer_send(&frame));
    assert_int_equal(fetch(&got, 1000), KL_CAN_OK);
    assert_false(bench->peer_hears(&got));
}

static void carries_every_kind_of_identifier(void **state) {
    (void)state;
    static const struct {
        uint32_t id;
        unsigned flags;
    } kinds[] = {{0, 0},
                 {0x7FF, 0},
                 {0x123, 0},
                 {0x123, KL_CAN_EXTENDED},
                 {0, KL_CAN_EXTENDED},
                 {0x800, KL_CAN_EXTENDED},
                 {0x1FFFFFFF, KL_CAN_EXTENDED}};
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        struct kl_can_frame frame = make(kinds[i].id, kinds[i].flags, 4, 0x10);
        assert_carried(&frame, &frame);
    }
}

/* Sends what must not go out, and sees that it is refused, counted, and heard by nobody. */
static void assert_refused(const struct kl_can_frame *frame) {
    struct kl_can_counts was = counts_now();
    struct kl_can_frame got;
    assert_int_equal(kl_can_send(&can, frame), KL_CAN_REFUSED);
    struct kl_can_counts now = counts_now();
    assert_int_equal(now.refused, was.refused + 1);
    assert_int_equal(now.send_dropped, was.send_dropped + 1);
    assert_int_equal(now.sent, was.sent);
    assert_false(bench->peer_hears(&got));
}

static void assert_carried_or_refused(bool carried, const struct kl_can_frame *frame) {
    if (carried)
        assert_carried(frame, frame);
    else
        assert_refused(frame);
}

static void refuses_malformed_frames(void **state) {
    (void)state;
    const struct kl_can_frame bad[] = {
        {.id = 0x800},
        {.id = 0xFFFFFFFF},
        {.id = 0x20000000, .flags = KL_CAN_EXTENDED},
        {.id = 0x80000001, .flags = KL_CAN_EXTENDED},
        {.id = 1, .length = 9},
        {.id = 1, .length = 255},
        {.id = 1, .length = 64},
        {.id = 1, .flags = KL_CAN_FD, .length = 9},
        {.id = 1, .flags = KL_CAN_FD, .length = 63},
        {.id = 1, .flags = KL_CAN_FD, .length = 65},
        {.id = 1, .flags = KL_CAN_FD | KL_CAN_REMOTE, .length = 8},
        {.id = 1, .flags = KL_CAN_BRS, .length = 8},
        {.id = 1, .flags = 1 << 4, .length = 8},
        {.id = 1, .flags = 1 << 7, .length = 8},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        assert_refused(&bad[i]);
    assert_both_ways_work();
}

static void carries_fd_or_refuses_it(void **state) {
    (void)state;
    static const uint8_t lengths[] = {0, 1, 7, 8, 12, 16, 20, 24, 32, 48, 64};
    for (size_t i = 0; i < sizeof lengths; i++) {
        struct kl_can_frame frame =
            make(0x200, KL_CAN_FD | (i % 2 ? KL_CAN_BRS : 0u), lengths[i], 9);
        assert_carried_or_refused(bench->carries_fd, &frame);
    }
    assert_both_ways_work();
}

static void carries_remote_or_refuses_it(void **state) {
    (void)state;
    for (uint8_t length = 0; length <= 8; length++) {
        struct kl_can_frame frame = make(0x201, KL_CAN_REMOTE, length, 0);
        assert_carried_or_refused(bench->carries_remote, &frame);
    }
    assert_both_ways_work();
}

static void empty_receive_leaves_the_frame_alone(void **state) {
    (void)state;
    struct kl_can_frame frame;
    struct kl_can_frame pattern;
    memset(&frame, 0xA5, sizeof frame);
    memset(&pattern, 0xA5, sizeof pattern);
    assert_int_equal(fetch(&frame, 5), KL_CAN_EMPTY);
    assert_memory_equal(&frame, &pattern, sizeof frame);
    assert_int_equal(counts_now().received, 0);
}

static void null_is_an_argument_error(void **state) {
    (void)state;
    struct kl_can_frame frame = make(1, 0, 0, 0);
    struct kl_can_counts counts = {.sent = 77};
    const struct kl_can nowhere = {.ops = can.ops, .context = NULL};
    assert_int_equal(kl_can_send(&can, NULL), KL_CAN_ARGUMENT);
    assert_int_equal(kl_can_receive(&can, NULL), KL_CAN_ARGUMENT);
    assert_int_equal(can.ops->send(can.context, NULL), KL_CAN_ARGUMENT);
    assert_int_equal(can.ops->receive(can.context, NULL), KL_CAN_ARGUMENT);
    assert_int_equal(kl_can_send(&nowhere, &frame), KL_CAN_ARGUMENT);
    assert_int_equal(kl_can_receive(&nowhere, &frame), KL_CAN_ARGUMENT);
    assert_false(kl_can_is_up(&nowhere));
    kl_can_get_counts(&nowhere, &counts);
    kl_can_get_counts(&can, NULL);
    kl_can_service(&nowhere);
    kl_can_close(&nowhere);
    assert_both_ways_work();
}

/* ---- too much ---- */

static void full_bus_is_busy_and_counted(void **state) {
    (void)state;
    enum kl_can_status status = KL_CAN_OK;
    unsigned handed = 0;
    bench->block();
    while (status == KL_CAN_OK && handed <= (unsigned)bench->most_until_busy) {
        struct kl_can_frame frame = make(0x300, 0, 8, (uint8_t)handed);
        status = kl_can_send(&can, &frame);
        kl_can_service(&can);
        handed++;
    }
    assert_int_equal(status, KL_CAN_BUSY);
    struct kl_can_counts counts = counts_now();
    assert_int_equal(counts.send_dropped, 1);
    assert_int_equal(counts.sent, handed - 1);
    assert_true(kl_can_is_up(&can)); /* busy is not down */

    bench->unblock();
    struct kl_can_frame got;
    while (bench->peer_hears(&got)) {
    }
    assert_both_ways_work(); /* and no recover was needed */
    assert_int_equal(counts_now().recoveries, 0);
}

static void never_blocks_when_nobody_fetches(void **state) {
    (void)state;
    enum { FRAMES = 20000 };
    for (unsigned i = 0; i < FRAMES; i++) {
        struct kl_can_frame frame = make(i & 0x7FF, 0, 8, (uint8_t)i);
        enum kl_can_status status = kl_can_send(&can, &frame);
        assert_true(status == KL_CAN_OK || status == KL_CAN_BUSY);
        kl_can_service(&can);
    }
    struct kl_can_counts counts = counts_now();
    assert_int_equal(counts.sent + counts.send_dropped, FRAMES); /* alarm() guards the time */
}

static void overflow_at_the_receiver_is_counted(void **state) {
    (void)state;
    struct kl_can_frame got;
    unsigned fetched = 0;
    for (int i = 0; i < bench->overflow_frames; i++) {
        struct kl_can_frame frame = make(0x400, 0, 4, (uint8_t)i);
        assert_true(bench->peer_send(&frame));
    }
    for (int i = 0; i < 100; i++) { /* until all of them have arrived, or were lost */
        kl_can_service(&can);
        pause_ms(1);
    }
    while (fetch(&got, 5) == KL_CAN_OK)
        fetched++;
    const struct kl_can_frame last = make(0x401, 0, 4, 0);
    assert_true(bench->peer_send(&last)); /* some back ends learn of losses with the next frame */
    assert_int_equal(fetch(&got, 1000), KL_CAN_OK);
    assert_same(&got, &last);
    struct kl_can_counts counts = counts_now();
    assert_true(counts.receive_dropped > 0);
    assert_int_equal(counts.received, fetched + 1);
    assert_int_equal(counts.received + counts.receive_dropped, bench->overflow_frames + 1);
}

static void garbage_does_no_harm(void **state) {
    (void)state;
    struct kl_can_frame got;
    if (bench->garbage == NULL)
        skip();
    for (int k = 0; bench->garbage(k); k++) {
        assert_int_equal(fetch(&got, 10), KL_CAN_EMPTY);
        assert_true(kl_can_is_up(&can));
        assert_both_ways_work();
    }
}

/* ---- gone and back ---- */

static void send_fails_while_down(unsigned times) {
    const struct kl_can_frame frame = make(0x500, 0, 1, 0);
    for (unsigned i = 0; i < times; i++) {
        struct kl_can_counts was = counts_now();
        assert_int_equal(kl_can_send(&can, &frame), KL_CAN_DOWN);
        assert_false(kl_can_is_up(&can));
        assert_int_equal(counts_now().send_dropped, was.send_dropped + 1);
        kl_can_service(&can);
    }
}

static void comes_back_by_recover(void) {
    struct kl_can_counts was = counts_now();
    assert_int_equal(kl_can_recover(&can), KL_CAN_DOWN);
    send_fails_while_down(3);
    bench->bring_up();
    send_fails_while_down(1); /* until recover */
    enum kl_can_status status = KL_CAN_DOWN;
    for (int i = 0; i < 100 && status != KL_CAN_OK; i++) {
        status = kl_can_recover(&can);
        pause_ms(5);
    }
    assert_int_equal(status, KL_CAN_OK);
    assert_true(kl_can_is_up(&can));
    assert_int_equal(kl_can_recover(&can), KL_CAN_OK); /* nothing to do: not counted */
    assert_int_equal(counts_now().recoveries, was.recoveries + 1);
    assert_both_ways_work();
}

static void down_and_up_noticed_by_send(void **state) {
    (void)state;
    if (!bench->carries_bus_faults)
        skip();
    for (int round = 0; round < 3; round++) {
        bench->take_down();
        send_fails_while_down(3);
        comes_back_by_recover();
    }
    assert_int_equal(counts_now().recoveries, 3);
}

static void down_noticed_by_receive(void **state) {
    (void)state;
    struct kl_can_frame got;
    if (!bench->carries_bus_faults)
        skip();
    bench->take_down();
    assert_int_equal(fetch(&got, 100), KL_CAN_DOWN);
    assert_int_equal(kl_can_receive(&can, &got), KL_CAN_DOWN);
    assert_false(kl_can_is_up(&can));
    comes_back_by_recover();
}

static void down_and_up_unnoticed_leaves_no_trace_after_recover(void **state) {
    (void)state;
    const struct kl_can_frame frame = make(0x501, 0, 1, 0);
    if (!bench->carries_bus_faults)
        skip();
    bench->take_down();
    bench->bring_up();
    if (kl_can_send(&can, &frame) != KL_CAN_OK) /* it may tell of what it missed, once */
        assert_int_equal(kl_can_recover(&can), KL_CAN_OK);
    struct kl_can_frame got;
    while (bench->peer_hears(&got)) {
    }
    assert_both_ways_work();
}

static void is_found_again(uint64_t recoveries) {
    for (int i = 0; i < 10 && kl_can_recover(&can) != KL_CAN_OK; i++)
        pause_ms(5);
    assert_both_ways_work();
    assert_int_equal(counts_now().recoveries, recoveries);
}

static void replaced_bus_is_found_again(void **state) {
    (void)state;
    if (bench->replace == NULL)
        skip();
    bench->take_down();
    send_fails_while_down(1);
    bench->replace();
    send_fails_while_down(1);
    is_found_again(1);
    bench->replace(); /* and without being seen down first */
    send_fails_while_down(2);
    is_found_again(2);
}

static void closed_stays_closed(void **state) {
    (void)state;
    const struct kl_can_frame frame = make(0x502, 0, 1, 0);
    struct kl_can_frame got;
    assert_both_ways_work();
    kl_can_close(&can);
    assert_false(kl_can_is_up(&can));
    assert_int_equal(kl_can_send(&can, &frame), KL_CAN_DOWN);
    assert_int_equal(kl_can_receive(&can, &got), KL_CAN_DOWN);
    assert_int_equal(kl_can_recover(&can), KL_CAN_DOWN);
    kl_can_service(&can);
    struct kl_can_counts counts = counts_now();
    assert_int_equal(counts.sent, 1);
    assert_int_equal(counts.received, 1);
    assert_int_equal(counts.send_dropped, 1);
    kl_can_close(&can);
}

int run_cases(const struct bench *chosen) {
#define CASE(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)
    const struct CMUnitTest cases[] = {
        CASE(sends_in_order),
        CASE(receives_in_order),
        CASE(nobody_hears_himself),
        CASE(carries_every_kind_of_identifier),
        CASE(refuses_malformed_frames),
        CASE(carries_fd_or_refuses_it),
        CASE(carries_remote_or_refuses_it),
        CASE(empty_receive_leaves_the_frame_alone),
        CASE(null_is_an_argument_error),
        CASE(full_bus_is_busy_and_counted),
        CASE(never_blocks_when_nobody_fetches),
        CASE(overflow_at_the_receiver_is_counted),
        CASE(garbage_does_no_harm),
        CASE(down_and_up_noticed_by_send),
        CASE(down_noticed_by_receive),
        CASE(down_and_up_unnoticed_leaves_no_trace_after_recover),
        CASE(replaced_bus_is_found_again),
        CASE(closed_stays_closed),
    };
    bench = chosen;
    return cmocka_run_group_tests_name(bench->name, cases, NULL, NULL);
}
