/*
 * Faults that only a real interface has: down and up under a sender that keeps its pace, a bus of
 * limited speed, bus-off, interfaces that come late or cannot carry FD.
 */
#include "bench_socketcan.h"

#include "kl_socketcan.h"

#include <linux/can.h>
#include <linux/can/error.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

static const struct bench *const bench = &bench_socketcan;
static struct kl_can can;

static int set_up(void **state) {
    (void)state;
    (void)alarm(60);
    return bench->open(&can) ? 0 : -1;
}

static int tear_down(void **state) {
    (void)state;
    bench->close();
    (void)alarm(0);
    return 0;
}

static void pause_us(long us) {
    const struct timespec time = {.tv_nsec = us * 1000};
    nanosleep(&time, NULL);
}

static struct kl_can_counts counts(void) {
    struct kl_can_counts now;
    kl_can_get_counts(&can, &now);
    return now;
}

static unsigned heard_by_peer(void) {
    struct kl_can_frame frame;
    unsigned heard = 0;
    while (bench->peer_hears(&frame))
        heard++;
    return heard;
}

/* What an owner does in each step, and nothing else: send, and now and then recover. */
static enum kl_can_status step(unsigned tick) {
    const struct kl_can_frame frame = {
        .id = 0x180, .length = 2, .data = {(uint8_t)tick, (uint8_t)(tick >> 8)}};
    struct kl_can_frame in;
    enum kl_can_status status = kl_can_send(&can, &frame);
    (void)kl_can_receive(&can, &in);
    if (!kl_can_is_up(&can) && tick % 10 == 0)
        (void)kl_can_recover(&can);
    return status;
}

/* Somebody else takes the interface away and brings it back while the sender runs. */
static void sender_outlives(const char *what) {
    unsigned ticks = 0;
    unsigned ok = 0;
    vcan_shell(what);
    for (unsigned left = 200; left > 0 && ticks < 10000; ticks++) {
        enum kl_can_status status = step(ticks);
        assert_true(status == KL_CAN_OK || status == KL_CAN_DOWN);
        ok += status == KL_CAN_OK;
        left -= counts().recoveries > 0;
        pause_us(1000);
    }
    struct kl_can_counts now = counts();
    assert_int_equal(now.recoveries, 1);
    assert_int_equal(now.sent, ok);
    assert_int_equal(now.sent + now.send_dropped, ticks);
    assert_true(now.send_dropped > 0);
    assert_true(kl_can_is_up(&can));
}

static void down_and_up_under_a_sender(void **state) {
    (void)state;
    sender_outlives("(sleep 0.3; ip link set %1$s down; sleep 0.3; ip link set %1$s up) &");
    /* What the kernel has taken and not yet delivered as the interface goes down it throws away, and tells
     * nobody: a frame or two at this rate, more where the kernel is slow to deliver. */
    const unsigned in_flight = 20;
    const unsigned heard = heard_by_peer();
    const unsigned sent = (unsigned)counts().sent;
    assert_true(heard <= sent);
    assert_in_range(sent - heard, 0, in_flight);
}

static void unplugged_and_plugged_under_a_sender(void **state) {
    (void)state;
    sender_outlives("(sleep 0.3; ip link del %1$s; sleep 0.3; ip link add dev %1$s type vcan; "
                    "ip link set %1$s mtu 72 up) &");
}

/* The speed and the queue of a 500 kbit/s bus: the sender wants more than it carries. */
static void bus_of_limited_speed(void **state) {
    (void)state;
    enum { FRAMES = 4000 };
    unsigned busy = 0;
    vcan_shell("tc qdisc add dev %s root tbf rate 500kbit burst 64 limit 640");
    for (unsigned i = 0; i < FRAMES; i++) {
        const struct kl_can_frame frame = {.id = 0x181, .length = 8, .data = {(uint8_t)i}};
        enum kl_can_status status = kl_can_send(&can, &frame);
        assert_true(status == KL_CAN_OK || status == KL_CAN_BUSY);
        busy += status == KL_CAN_BUSY;
        if (i % 100 == 99)
            pause_us(1000);
    }
    struct kl_can_counts now = counts();
    assert_true(busy > 0 && busy < FRAMES);
    assert_int_equal(now.send_dropped, busy);
    assert_int_equal(now.sent, FRAMES - busy);
    assert_int_equal(heard_by_peer(), now.sent);
    (void)printf("             %u of %d frames found the bus busy\n", busy, FRAMES);

    for (unsigned i = 0; i < 100; i++) { /* within its speed the same bus loses nothing */
        const struct kl_can_frame frame = {.id = 0x182, .length = 8, .data = {(uint8_t)i}};
        assert_int_equal(kl_can_send(&can, &frame), KL_CAN_OK);
        pause_us(2000);
    }
    vcan_shell("tc qdisc del dev %s root");
    assert_int_equal(heard_by_peer(), 100);
}

static void bus_off_is_down_until_recover(void **state) {
    (void)state;
    const struct can_frame bus_off = {.can_id = CAN_ERR_FLAG | CAN_ERR_BUSOFF, .len = CAN_ERR_DLC};
    const struct kl_can_frame frame = {.id = 1};
    struct kl_can_frame got;
    assert_true(vcan_inject(&bus_off, sizeof bus_off));
    enum kl_can_status status = KL_CAN_EMPTY;
    for (int i = 0; i < 100 && status == KL_CAN_EMPTY; i++) {
        status = kl_can_receive(&can, &got);
        pause_us(1000);
    }
    assert_int_equal(status, KL_CAN_DOWN);
    assert_false(kl_can_is_up(&can));
    assert_int_equal(kl_can_send(&can, &frame), KL_CAN_DOWN);
    assert_int_equal(kl_can_recover(&can), KL_CAN_OK);
    assert_int_equal(kl_can_send(&can, &frame), KL_CAN_OK);
    assert_int_equal(counts().received, 0); /* error frames are not frames */
    assert_int_equal(counts().recoveries, 1);
}

static void interface_that_comes_later(void **state) {
    (void)state;
    struct kl_socketcan port;
    const struct kl_socketcan_options options = {.interface = "klvcan9"};
    const struct kl_can_frame frame = {.id = 1};
    struct kl_can_frame got;
    assert_int_equal(kl_socketcan_open(&port, &options), KL_CAN_DOWN);
    assert_non_null(strstr(kl_socketcan_text(&port), "No such device"));
    const struct kl_can late = kl_socketcan_can(&port);
    assert_int_equal(kl_can_send(&late, &frame), KL_CAN_DOWN);
    assert_int_equal(kl_can_receive(&late, &got), KL_CAN_DOWN);
    assert_int_equal(kl_can_recover(&late), KL_CAN_DOWN);
    vcan_shell("ip link add dev klvcan9 type vcan");
    assert_int_equal(kl_can_recover(&late), KL_CAN_DOWN);
    vcan_shell("ip link set klvcan9 up");
    assert_int_equal(kl_can_recover(&late), KL_CAN_OK);
    assert_int_equal(kl_can_send(&late, &frame), KL_CAN_OK);
    vcan_shell("ip link del klvcan9");
    assert_int_equal(kl_can_send(&late, &frame), KL_CAN_DOWN);
    kl_can_close(&late);
}

static void interface_that_is_down_at_first(void **state) {
    (void)state;
    struct kl_socketcan port;
    const struct kl_socketcan_options options = {.interface = vcan_name()};
    const struct kl_can_frame frame = {.id = 1};
    bench->take_down();
    assert_int_equal(kl_socketcan_open(&port, &options), KL_CAN_DOWN);
    const struct kl_can other = kl_socketcan_can(&port);
    assert_int_equal(kl_can_send(&other, &frame), KL_CAN_DOWN);
    bench->bring_up();
    assert_int_equal(kl_can_recover(&other), KL_CAN_OK);
    assert_int_equal(kl_can_send(&other, &frame), KL_CAN_OK);
    kl_can_close(&other);
}

static void fd_needs_an_interface_that_carries_it(void **state) {
    (void)state;
    struct kl_socketcan port;
    const struct kl_socketcan_options options = {.interface = vcan_name(), .fd = true};
    const struct kl_can_frame frame = {.id = 1, .flags = KL_CAN_FD, .length = 64};
    const struct kl_can_frame classic = {.id = 1};
    assert_int_equal(kl_socketcan_open(&port, &options), KL_CAN_OK);
    const struct kl_can fd = kl_socketcan_can(&port);
    assert_int_equal(kl_can_send(&fd, &frame), KL_CAN_OK);
    vcan_shell("ip link set %1$s down; ip link set %1$s mtu 16; ip link set %1$s up");
    if (kl_can_send(&fd, &classic) != KL_CAN_OK)
        assert_int_equal(kl_can_recover(&fd), KL_CAN_OK);
    assert_int_equal(kl_can_send(&fd, &frame), KL_CAN_REFUSED);
    assert_int_equal(kl_can_send(&fd, &classic), KL_CAN_OK);
    kl_can_close(&fd);
    assert_int_equal(kl_socketcan_open(&port, &options), KL_CAN_FAILED);
    assert_non_null(strstr(kl_socketcan_text(&port), "carries no FD frames"));
    const struct kl_can none = kl_socketcan_can(&port);
    assert_int_equal(kl_can_recover(&none), KL_CAN_DOWN);
    vcan_shell("ip link set %1$s down; ip link set %1$s mtu 72; ip link set %1$s up");
}

int run_vcan_faults(void) {
#define CASE(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)
    const struct CMUnitTest cases[] = {
        CASE(down_and_up_under_a_sender),
        CASE(unplugged_and_plugged_under_a_sender),
        CASE(bus_of_limited_speed),
        CASE(bus_off_is_down_until_recover),
        CASE(interface_that_comes_later),
        CASE(interface_that_is_down_at_first),
        CASE(fd_needs_an_interface_that_carries_it),
    };
    return cmocka_run_group_tests_name("vcan faults", cases, NULL, NULL);
}
