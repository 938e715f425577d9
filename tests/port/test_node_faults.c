/* The node on a bus that fails: whatever the bus does, the model keeps its step, bit for bit. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "node_bench.h"

/* The state after so many undisturbed cycles of running, from a displaced wheelset. */
static void start_displaced(struct bench *b) {
    b->config.start_running = true;
    assert_int_equal(kl_node_init(&b->node, &b->config), KL_OK);
    b->state.x[kl_wheelset_state_index(&b->model, 0, KL_WS_Y)] = (kl_real)0.002;
    kl_refresh(&b->model, &b->state, &b->work);
}

static struct kl_state undisturbed(unsigned cycles) {
    struct bench *b = bench_new();
    start_displaced(b);
    bench_cycles(b, cycles);
    assert_int_equal(b->state.tick, cycles);
    assert_int_equal(b->gaps + b->node.counts.dropped, 0);
    assert_int_equal(b->state.faults, 0);
    struct kl_state state = b->state;
    bench_free(b);
    return state;
}

/* ---- the k-th call fails ---- */

static void walk_through(enum kl_vbus_fault_kind kind, uint64_t calls) {
    const unsigned cycles = 40;
    const struct kl_state expected = undisturbed(cycles);
    for (uint64_t k = 1; k <= calls; k++) {
        struct bench *b = bench_new();
        start_displaced(b);
        kl_vbus_inject(&b->ends[0], (struct kl_vbus_fault){.kind = kind, .first = k, .last = k});
        bench_cycles(b, cycles);
        bool same = memcmp(&expected, &b->state, sizeof expected) == 0;
        bench_cycles(b, 200); /* a recovery is tried every 100 cycles */
        uint64_t gaps = b->gaps;
        bench_cycles(b, 100);
        if (!same || b->state.tick != cycles + 300 || b->gaps != gaps || b->node.bus_down) {
            fail_msg("fault %d at call %u: same bits %d, steps %u, gaps after recovery %u",
                     (int)kind, (unsigned)k, (int)same, (unsigned)b->state.tick,
                     (unsigned)(b->gaps - gaps));
        }
        bench_free(b);
    }
}

static void any_one_call_may_fail(void **state) {
    (void)state;
    walk_through(KL_VBUS_CALL_FAILS, 320);
}

static void any_one_send_may_fail_or_find_the_bus_busy_or_gone(void **state) {
    (void)state;
    walk_through(KL_VBUS_SEND_FAILS, 80);
    walk_through(KL_VBUS_SEND_BUSY, 80);
    walk_through(KL_VBUS_SEND_LOST, 80);
    walk_through(KL_VBUS_SEND_CORRUPT, 80);
    walk_through(KL_VBUS_GOES_DOWN, 120);
    walk_through(KL_VBUS_RECEIVE_FAILS, 40);
}

/* From the k-th call on nothing works any more, at all. */
static void all_calls_may_fail_for_ever(void **state) {
    (void)state;
    const struct kl_state expected = undisturbed(300);
    for (uint64_t k = 1; k <= 20; k++) {
        struct bench *b = bench_new();
        start_displaced(b);
        kl_vbus_inject(&b->ends[0], (struct kl_vbus_fault){.kind = KL_VBUS_CALL_FAILS, .first = k});
        bench_cycles(b, 300);
        assert_memory_equal(&expected, &b->state, sizeof expected);
        assert_true(b->node.counts.dropped > 1000);
        assert_int_equal(b->node.counts.sent + b->node.counts.dropped,
                         300 * 6 + 30 * 15 + 3); /* every frame due is accounted for */
        bench_free(b);
    }
}

/* ---- the bus goes and comes back ---- */

static void the_bus_may_go_and_come_back(void **state) {
    (void)state;
    const struct kl_state expected = undisturbed(3000);
    struct bench *b = bench_new();
    start_displaced(b);
    bench_cycles(b, 1000);
    kl_vbus_set_up(&b->bus, false);
    bench_cycles(b, 1000);
    assert_in_range(b->node.counts.recover_calls, 9, 11); /* every 100 ms, not every cycle */
    assert_int_equal(b->node.counts.down_cycles, 1000);
    assert_int_equal(b->node.counts.dropped, 1000 * 6 + 100 * 15 + 3);
    assert_int_equal(b->node.counts.recoveries, 0);
    kl_vbus_set_up(&b->bus, true);
    kl_can_recover(&b->can);
    bench_cycles(b, 100); /* back within 100 ms */
    assert_int_equal(b->node.counts.recoveries, 1);
    uint64_t gaps = b->gaps;
    assert_true(gaps > 0);
    bench_cycles(b, 900);
    assert_memory_equal(&expected, &b->state, sizeof expected);
    assert_int_equal(b->gaps, gaps);
    assert_int_equal(gaps, b->node.counts.dropped);
    assert_int_equal(seen_raw(b, KL_MSG_STATUS_CODEC, 0, "Recoveries"), 1);
    assert_int_equal(seen_raw(b, KL_MSG_STATUS_BUS, 0, "SendDropped"),
                     b->node.counts.dropped & 0xFFFF);
    bench_free(b);
}

static void the_bench_may_vanish_and_return(void **state) {
    (void)state;
    const struct kl_state expected = undisturbed(300);
    struct bench *b = bench_new();
    start_displaced(b);
    bench_cycles(b, 100);
    kl_can_close(&b->can);
    bench_cycles(b, 100);
    kl_vbus_join(&b->bus, &b->ends[1], b->bench_ring, BENCH_RING, &b->can);
    bench_cycles(b, 100);
    assert_memory_equal(&expected, &b->state, sizeof expected);
    assert_int_equal(b->node.counts.dropped, 0);
    assert_int_equal(b->seen[KL_MSG_VEHICLE_MOTION][0], 200);
    bench_free(b);
}

/* ---- the bus is full ---- */

/* A loss that the node counts is a gap that the bench sees, and the other way round. */
static void a_full_bus_drops_the_oldest_state_and_starves_nobody(void **state) {
    (void)state;
    const unsigned cycles = 3000;
    const struct kl_state expected = undisturbed(cycles);
    for (uint64_t budget = 1; budget <= 8; budget++) {
        struct bench *b = bench_new();
        start_displaced(b);
        kl_vbus_set_budget(&b->ends[0], budget);
        bench_cycles(b, cycles);
        assert_memory_equal(&expected, &b->state, sizeof expected);
        if (budget < 8) {
            assert_true(b->node.counts.dropped > 0);
            assert_in_range(b->node.counts.sent, budget * cycles - 8, budget * cycles);
        } else {
            assert_int_equal(b->node.counts.dropped, 0); /* 7.3 frames a cycle go through */
        }
        uint64_t waiting = 0;
        for (uint32_t i = 0; i < b->node.n_slots; i++) {
            const struct kl_node_slot *slot = &b->node.slots[i];
            assert_true(b->seen[slot->message][slot->instance] > 0);
            waiting += slot->turn != KL_TURN_NONE ? 1 : 0;
        }
        uint64_t due = (uint64_t)cycles * 6 + cycles / 10 * 15 + cycles / 1000 * 3;
        assert_int_equal(b->node.counts.sent + b->node.counts.dropped + waiting, due);
        assert_in_range(b->gaps, 0, b->node.counts.dropped);
        kl_vbus_set_budget(&b->ends[0], 0);
        bench_cycles(b, 1000);
        assert_int_equal(b->gaps, b->node.counts.dropped);
        bench_free(b);
    }
}

/* What goes out late is the state of the cycle in which it goes out, not of the one it was due. */
static void a_late_frame_carries_the_newest_state(void **state) {
    (void)state;
    struct bench *b = bench_start();
    bench_ask(b, KL_COMMAND_START, 0);
    bench_cycles(b, 10);
    int32_t slot = -1;
    for (uint32_t i = 0; i < b->node.n_slots; i++) {
        slot = b->node.slots[i].message == KL_MSG_STATUS ? (int32_t)i : slot;
    }
    while (b->node.slots[slot].wait != 0) {
        bench_cycles(b, 1);
    }
    uint64_t seen = b->seen[KL_MSG_STATUS][0];
    kl_vbus_inject(&b->ends[0],
                   (struct kl_vbus_fault){.kind = KL_VBUS_SEND_BUSY, .first = 1, .last = 7});
    bench_cycles(b, 1);
    assert_int_equal(b->seen[KL_MSG_STATUS][0], seen);
    assert_int_equal(b->node.slots[slot].turn, KL_TURN_LATE);
    bench_cycles(b, 1);
    assert_int_equal(b->seen[KL_MSG_STATUS][0], seen + 1);
    assert_int_equal(seen_raw(b, KL_MSG_STATUS, 0, "Step"), b->state.tick);
    bench_free(b);
}

static void acknowledges_wait_for_room_and_are_bounded(void **state) {
    (void)state;
    struct bench *b = bench_start();
    kl_vbus_inject(&b->ends[0],
                   (struct kl_vbus_fault){.kind = KL_VBUS_SEND_BUSY, .first = 1, .last = 7});
    for (unsigned i = 0; i < KL_NODE_ACKS + 4; i++) {
        bench_command(b, KL_COMMAND_NONE, 0);
    }
    bench_cycles(b, 1);
    assert_int_equal(b->acks, 0);
    uint64_t dropped = b->node.counts.dropped;
    assert_int_equal(dropped, 4);
    bench_cycles(b, 3);
    assert_int_equal(b->acks, KL_NODE_ACKS);
    bench_free(b);
}

/* ---- garbage ---- */

struct garbage {
    uint64_t seed;
    uint64_t left;
    uint64_t delivered;
    uint64_t commands;
};

static uint64_t random_bits(uint64_t *seed) { /* splitmix64 */
    uint64_t z = (*seed += UINT64_C(0x9E3779B97F4A7C15));
    z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
    return z ^ (z >> 31);
}

/* By chance a command may be right, counter, CRC and all; then it would rightly be carried out.
 * Only such frames are spoilt here. */
static void spoil(struct kl_can_frame *frame) {
    for (uint32_t i = KL_MSG_RUN_CONTROL; i <= KL_MSG_SPEED_SETPOINT; i++) {
        const struct kl_message *message = &kl_signal_messages()[i];
        struct kl_protect check;
        kl_protect_init(&check, message->data_id);
        if (frame->id == message->id && frame->length == 8 &&
            kl_protect_check(&check, frame->data, 8) != KL_PROTECT_BAD_CRC) {
            frame->data[0] ^= 0x55;
        }
    }
}

/* A back end that hands out anything: half of it wild, half of it near our own identifiers. */
static enum kl_can_status garbage_receive(void *context, struct kl_can_frame *frame) {
    struct garbage *g = context;
    if (g->left == 0) {
        return KL_CAN_EMPTY;
    }
    uint64_t r = random_bits(&g->seed);
    frame->id = (uint32_t)(r & 1 ? r >> 32 : (r >> 32) % 0x24);
    frame->flags = (uint8_t)((r & 6) == 0 ? r >> 8 : 0);
    frame->length = (uint8_t)((r & 24) == 0 ? r >> 16 : 8);
    for (unsigned i = 0; i < 64; i += 8) {
        uint64_t bits = random_bits(&g->seed);
        memcpy(frame->data + i, &bits, 8);
    }
    spoil(frame);
    g->commands += frame->id == 0x010 || frame->id == 0x011 ? 1 : 0;
    g->left--;
    g->delivered++;
    return KL_CAN_OK;
}
static enum kl_can_status garbage_send(void *context, const struct kl_can_frame *frame) {
    (void)context;
    return kl_can_check(frame);
}
static bool garbage_is_up(void *context) {
    return context != NULL;
}
static void garbage_counts(void *context, struct kl_can_counts *counts) {
    (void)context;
    *counts = (struct kl_can_counts){0};
}

static void a_million_frames_of_garbage_disturb_nothing(void **state) {
    (void)state;
    static const struct kl_can_ops ops = {.send = garbage_send,
                                          .receive = garbage_receive,
                                          .is_up = garbage_is_up,
                                          .counts = garbage_counts};
    const unsigned cycles = 1000000 / KL_NODE_MAX_RECEIVED + 1;
    const struct kl_state expected = undisturbed(cycles);
    struct garbage garbage = {.seed = 2026, .left = 1000000};
    struct bench *b = bench_new();
    b->config.can = (struct kl_can){.ops = &ops, .context = &garbage};
    start_displaced(b);
    for (unsigned i = 0; i < cycles; i++) {
        assert_true(kl_node_cycle(&b->node, NULL));
    }
    const struct kl_node_counts *counts = &b->node.counts;
    assert_int_equal(garbage.delivered, 1000000);
    assert_true(garbage.commands > 20000);
    assert_memory_equal(&expected, &b->state, sizeof expected);
    assert_int_equal(counts->received, 1000000);
    assert_int_equal(counts->unknown + counts->malformed + counts->protection + counts->syncs,
                     1000000);
    assert_int_equal(counts->setpoints + counts->run_commands + counts->run_refused, 0);
    assert_int_equal(counts->send_errors + counts->dropped, 0);
    bench_free(b);
}

/* A flood is fetched in bounded portions; the rest is the back end's to lose. */
static void a_flood_is_taken_in_bounded_portions(void **state) {
    (void)state;
    const struct kl_state expected = undisturbed(50);
    const struct kl_can_frame noise = {.id = 0x7FF, .length = 8};
    struct bench *b = bench_new();
    start_displaced(b);
    for (unsigned i = 0; i < 50; i++) {
        for (unsigned k = 0; k < 300; k++) {
            kl_can_send(&b->can, &noise);
        }
        uint64_t before = b->node.counts.received;
        bench_cycles(b, 1);
        assert_int_equal(b->node.counts.received - before, KL_NODE_MAX_RECEIVED);
    }
    assert_memory_equal(&expected, &b->state, sizeof expected);
    assert_int_equal(b->gaps, 0);
    bench_free(b);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(any_one_call_may_fail),
        cmocka_unit_test(any_one_send_may_fail_or_find_the_bus_busy_or_gone),
        cmocka_unit_test(all_calls_may_fail_for_ever),
        cmocka_unit_test(the_bus_may_go_and_come_back),
        cmocka_unit_test(the_bench_may_vanish_and_return),
        cmocka_unit_test(a_full_bus_drops_the_oldest_state_and_starves_nobody),
        cmocka_unit_test(a_late_frame_carries_the_newest_state),
        cmocka_unit_test(acknowledges_wait_for_room_and_are_bounded),
        cmocka_unit_test(a_million_frames_of_garbage_disturb_nothing),
        cmocka_unit_test(a_flood_is_taken_in_bounded_portions),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
