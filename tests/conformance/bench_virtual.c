/* The virtual bus under test; the other node is a second node of it. */
#include "bench.h"

#include "kl_virtual_bus.h"

#include <stddef.h>

#define RING 256u

static struct kl_vbus bus;
static struct kl_vbus_node nodes[2];
static struct kl_can_frame rings[2][RING];
static struct kl_can ends[2];

static const char *available(const char *argument) {
    (void)argument;
    return NULL;
}

static bool open_bus(struct kl_can *can) {
    kl_vbus_init(&bus);
    bool joined = kl_vbus_join(&bus, &nodes[0], rings[0], RING, &ends[0]) == KL_CAN_OK &&
                  kl_vbus_join(&bus, &nodes[1], rings[1], RING, &ends[1]) == KL_CAN_OK;
    *can = ends[0];
    return joined;
}

static void close_bus(void) {
    kl_can_close(&ends[0]);
    kl_can_close(&ends[1]);
}

static bool peer_send(const struct kl_can_frame *frame) {
    return kl_can_send(&ends[1], frame) == KL_CAN_OK;
}

static bool peer_receive(struct kl_can_frame *frame) {
    return kl_can_receive(&ends[1], frame) == KL_CAN_OK;
}

static void block(void) {
    kl_vbus_set_budget(&nodes[0], 10);
}

static void unblock(void) {
    kl_vbus_set_budget(&nodes[0], 0);
}

static void take_down(void) {
    kl_vbus_set_up(&bus, false);
}

static void bring_up(void) {
    kl_vbus_set_up(&bus, true);
    (void)kl_can_recover(&ends[1]);
}

const struct bench bench_virtual = {.name = "virtual",
                                    .carries_fd = true,
                                    .carries_remote = true,
                                    .carries_bus_faults = true,
                                    .most_until_busy = 11,
                                    .overflow_frames = RING + 50,
                                    .available = available,
                                    .open = open_bus,
                                    .close = close_bus,
                                    .peer_send = peer_send,
                                    .peer_receive = peer_receive,
                                    .peer_hears = peer_receive,
                                    .block = block,
                                    .unblock = unblock,
                                    .take_down = take_down,
                                    .bring_up = bring_up};
