/* The node: run control, set-point supervision, schedule and lockstep, on an undisturbed bus. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "node_bench.h"

/* ---- run control ---- */

static void it_starts_in_init_with_time_standing(void **state) {
    (void)state;
    struct bench *b = bench_start();
    bench_cycles(b, 50);
    assert_int_equal(b->node.run_state, KL_RUN_INIT);
    assert_int_equal(b->node.counts.steps, 0);
    assert_int_equal(b->state.tick, 0);
    assert_int_equal(seen_raw(b, KL_MSG_STATUS, 0, "RunState"), KL_RUN_INIT);
    /* the outputs are those of the initial state: 20 m/s in units of 2.5 mm/s */
    assert_int_equal(seen_raw(b, KL_MSG_VEHICLE_MOTION, 0, "Speed"), 8000);
    bench_free(b);
}

static void commands_walk_through_the_run_states(void **state) {
    (void)state;
    struct bench *b = bench_start();
    assert_int_equal(bench_ask(b, KL_COMMAND_NONE, 0), KL_ACK_DONE);
    assert_int_equal(bench_ask(b, KL_COMMAND_PAUSE, 0), KL_ACK_WRONG_STATE);
    assert_int_equal(bench_ask(b, KL_COMMAND_START, 0), KL_ACK_DONE);
    bench_cycles(b, 9);
    assert_int_equal(b->state.tick, 10);
    assert_int_equal(bench_ask(b, KL_COMMAND_STEP, 1), KL_ACK_WRONG_STATE);
    assert_int_equal(bench_ask(b, KL_COMMAND_PAUSE, 0), KL_ACK_DONE);
    bench_cycles(b, 5);
    assert_int_equal(b->state.tick, 11);
    assert_int_equal(bench_ask(b, KL_COMMAND_START, 0), KL_ACK_DONE);
    assert_int_equal(b->state.tick, 12);
    assert_int_equal(bench_ask(b, KL_COMMAND_STOP, 0), KL_ACK_DONE);
    bench_cycles(b, 5);
    assert_int_equal(b->node.run_state, KL_RUN_STOPPED);
    assert_int_equal(b->state.tick, 12);
    assert_int_equal(bench_ask(b, KL_COMMAND_PAUSE, 0), KL_ACK_WRONG_STATE);
    assert_int_equal(bench_ask(b, KL_COMMAND_START, 0), KL_ACK_DONE);
    assert_int_equal(b->state.tick, 1); /* from the initial state again */
    assert_int_equal(bench_ask(b, KL_COMMAND_RESET, 0), KL_ACK_DONE);
    assert_int_equal(b->node.run_state, KL_RUN_INIT);
    assert_int_equal(b->state.tick, 0);
    assert_int_equal(bench_ask(b, 8, 0), KL_ACK_UNKNOWN_COMMAND);
    assert_int_equal(bench_ask(b, 255, 0), KL_ACK_UNKNOWN_COMMAND);
    assert_int_equal(b->node.counts.run_commands, 7);
    assert_int_equal(b->node.counts.run_refused, 5);
    assert_int_equal(b->gaps, 0);
    bench_free(b);
}

static void steps_are_done_one_per_cycle_and_add_up(void **state) {
    (void)state;
    struct bench *b = bench_start();
    assert_int_equal(bench_ask(b, KL_COMMAND_STEP, 0), KL_ACK_DONE);
    bench_cycles(b, 10);
    assert_int_equal(b->state.tick, 1);
    assert_int_equal(b->node.run_state, KL_RUN_PAUSED);
    bench_command(b, KL_COMMAND_STEP, 5);
    bench_command(b, KL_COMMAND_STEP, 3);
    bench_cycles(b, 4);
    assert_int_equal(b->state.tick, 5);
    bench_cycles(b, 10);
    assert_int_equal(b->state.tick, 9);
    bench_ask(b, KL_COMMAND_STEP, 100);
    assert_int_equal(bench_ask(b, KL_COMMAND_PAUSE, 0), KL_ACK_DONE);
    bench_cycles(b, 10);
    assert_int_equal(b->state.tick, 10);
    bench_free(b);
}

static void a_restored_snapshot_runs_on_to_the_same_bits(void **state) {
    (void)state;
    struct bench *b = bench_start();
    assert_int_equal(bench_ask(b, KL_COMMAND_RESTORE, 0), KL_ACK_NO_SNAPSHOT);
    b->state.x[kl_wheelset_state_index(&b->model, 0, KL_WS_Y)] = (kl_real)0.003;
    kl_refresh(&b->model, &b->state, &b->work);
    bench_ask(b, KL_COMMAND_START, 0);
    bench_cycles(b, 100);
    assert_int_equal(bench_ask(b, KL_COMMAND_SNAPSHOT, 0), KL_ACK_DONE);
    bench_cycles(b, 199);
    struct kl_state straight = b->state;
    assert_int_equal(bench_ask(b, KL_COMMAND_RESTORE, 0), KL_ACK_DONE);
    assert_int_equal(b->node.run_state, KL_RUN_RUNNING);
    bench_cycles(b, 199);
    assert_memory_equal(&straight, &b->state, sizeof straight);
    bench_cycles(b, 10);
    assert_int_equal(seen_raw(b, KL_MSG_STATUS_BUS, 0, "HasSnapshot"), 1);

    bench_ask(b, KL_COMMAND_RESET, 0);
    assert_int_equal(bench_ask(b, KL_COMMAND_RESTORE, 0), KL_ACK_DONE);
    assert_int_equal(b->node.run_state, KL_RUN_PAUSED);
    assert_int_equal(b->state.tick, 101);
    assert_int_equal(b->output.tick, 101); /* what is published is the restored state */
    bench_free(b);
}

static void without_memory_for_it_there_is_no_snapshot(void **state) {
    (void)state;
    struct bench *b = bench_new();
    b->config.snapshot = NULL;
    assert_int_equal(kl_node_init(&b->node, &b->config), KL_OK);
    assert_int_equal(bench_ask(b, KL_COMMAND_SNAPSHOT, 0), KL_ACK_NO_SNAPSHOT);
    assert_int_equal(bench_ask(b, KL_COMMAND_RESTORE, 0), KL_ACK_NO_SNAPSHOT);
    bench_free(b);
}

static void a_holding_fault_is_latched_published_and_left_by_reset(void **state) {
    (void)state;
    struct bench *b = bench_start();
    bench_ask(b, KL_COMMAND_START, 0);
    bench_cycles(b, 10);
    bench_ask(b, KL_COMMAND_SNAPSHOT, 0);
    b->state.x[kl_wheelset_state_index(&b->model, 0, KL_WS_Y)] = (kl_real)1.0; /* off the rails */
    bench_cycles(b, 20);
    assert_int_equal(b->node.run_state, KL_RUN_FAULT);
    assert_int_equal(b->node.counts.faults, 1);
    assert_int_equal(seen_raw(b, KL_MSG_STATUS, 0, "RunState"), KL_RUN_FAULT);
    assert_true((seen_raw(b, KL_MSG_STATUS, 0, "Faults") & KL_FAULT_DERAILED) != 0);
    assert_int_equal(b->node.counts.steps, 31 + 1); /* steps go on */
    assert_int_equal(bench_ask(b, KL_COMMAND_START, 0), KL_ACK_WRONG_STATE);
    assert_int_equal(bench_ask(b, KL_COMMAND_STOP, 0), KL_ACK_WRONG_STATE);
    assert_int_equal(bench_ask(b, KL_COMMAND_SNAPSHOT, 0), KL_ACK_WRONG_STATE);
    assert_int_equal(bench_ask(b, KL_COMMAND_RESTORE, 0), KL_ACK_DONE);
    assert_int_equal(b->node.run_state, KL_RUN_PAUSED);
    assert_int_equal(b->state.faults, 0);
    assert_int_equal(bench_ask(b, KL_COMMAND_START, 0), KL_ACK_DONE);
    assert_int_equal(b->gaps, 0);
    bench_free(b);
}

static void repeated_and_corrupt_commands_are_not_carried_out(void **state) {
    (void)state;
    struct bench *b = bench_start();
    struct kl_can_frame frame =
        command_frame(b, KL_MSG_RUN_CONTROL, (struct kl_bus_command){.command = KL_COMMAND_STEP});
    kl_can_send(&b->can, &frame);
    kl_can_send(&b->can, &frame);
    bench_cycles(b, 5);
    assert_int_equal(b->state.tick, 1);
    assert_int_equal(b->acks, 2);
    assert_int_equal(seen_raw(b, KL_MSG_ACK, 0, "Result"), KL_ACK_REPEATED);
    frame.data[2] ^= 1; /* another command under the old CRC */
    kl_can_send(&b->can, &frame);
    frame.length = 7;
    kl_can_send(&b->can, &frame);
    bench_cycles(b, 5);
    assert_int_equal(b->acks, 2);
    assert_int_equal(b->node.counts.protection, 2);
    assert_int_equal(b->node.counts.malformed, 1);
    command_frame(b, KL_MSG_RUN_CONTROL, (struct kl_bus_command){0}); /* lost on the way */
    assert_int_equal(bench_ask(b, KL_COMMAND_STEP, 0), KL_ACK_DONE);
    assert_int_equal(b->node.run_control.gaps, 1);
    bench_free(b);
}

/* ---- the set-point ---- */

static void a_late_setpoint_is_replaced_by_the_safe_value(void **state) {
    (void)state;
    struct bench *b = bench_start();
    bench_ask(b, KL_COMMAND_START, 0);
    bench_cycles(b, 1000);
    assert_int_equal(b->node.counts.late, 0); /* nobody has taken the speed over */
    bench_speed(b, 25.0, 1);
    bench_cycles(b, 500);
    assert_true(b->input.speed_m_s > 24 && b->input.speed_m_s < 26);
    assert_int_equal(b->node.counts.late, 0);
    bench_cycles(b, 1); /* 5 x 100 ms after the frame */
    assert_int_equal(b->node.counts.late, 1);
    assert_true(b->input.speed_m_s <= 0);
    bench_cycles(b, 2000);
    assert_int_equal(b->node.counts.late, 1);
    assert_int_equal(seen_raw(b, KL_MSG_STATUS_BUS, 0, "SpeedLate"), 1);
    assert_int_equal(seen_raw(b, KL_MSG_STATUS_BUS, 0, "CommandsLate"), 1);
    assert_true(b->state.speed_m_s < 20); /* it brakes */
    bench_speed(b, 30.0, 1);
    bench_cycles(b, 11);
    assert_int_equal(seen_raw(b, KL_MSG_STATUS_BUS, 0, "SpeedLate"), 0);
    assert_true(b->input.speed_m_s > 29);
    bench_speed(b, 10.0, 0); /* release */
    bench_cycles(b, 1000);
    assert_int_equal(b->node.counts.late, 1);
    assert_true(b->input.speed_m_s > 9 && b->input.speed_m_s < 11);
    assert_int_equal(seen_raw(b, KL_MSG_STATUS_BUS, 0, "SpeedControl"), 0);
    bench_free(b);
}

static void a_repeated_or_impossible_setpoint_is_no_sign_of_life(void **state) {
    (void)state;
    struct bench *b = bench_start();
    bench_speed(b, 25.0, 1);
    bench_cycles(b, 400);
    b->speed_alive = 0; /* the same counter once more */
    bench_speed(b, 26.0, 1);
    bench_speed(b, 155.0, 1);
    bench_speed(b, (double)(0.0f / 0.0f), 1);
    bench_speed(b, 25.0, 2);
    bench_cycles(b, 101);
    assert_int_equal(b->node.counts.protection, 1);
    assert_int_equal(b->node.counts.malformed, 3);
    assert_int_equal(b->node.counts.setpoints, 1);
    assert_int_equal(b->node.counts.late, 1);
    bench_free(b);
}

static void reset_puts_a_free_setpoint_back_and_keeps_a_supervised_one(void **state) {
    (void)state;
    struct bench *b = bench_start();
    bench_speed(b, 30.0, 0);
    bench_ask(b, KL_COMMAND_RESET, 0);
    assert_true(b->input.speed_m_s > 19 && b->input.speed_m_s < 21);
    bench_speed(b, 30.0, 1);
    bench_ask(b, KL_COMMAND_RESET, 0);
    assert_true(b->input.speed_m_s > 29);
    bench_free(b);
}

/* ---- schedule ---- */

static void every_message_keeps_its_period_without_a_gap(void **state) {
    (void)state;
    struct bench *b = bench_start();
    bench_ask(b, KL_COMMAND_START, 0);
    bench_cycles(b, 2999);
    for (uint32_t i = 0; i < KL_MESSAGES; i++) {
        const struct kl_message *message = &kl_signal_messages()[i];
        uint32_t cycles = kl_message_cycles(&b->node.layout, message);
        for (uint32_t k = 0; k < kl_message_instances(&b->node.layout, message); k++) {
            if (cycles > 0 && message->sender == KL_SENT_BY_NODE) {
                assert_int_equal(b->seen[i][k], 3000 / cycles);
            }
        }
    }
    assert_int_equal(b->gaps, 0);
    assert_int_equal(b->node.counts.dropped, 0);
    assert_int_equal(b->node.counts.sent, 3000 * 6 + 300 * (5 + 8 + 1 + 1) + 3 * 3 + 1);
    bench_free(b);
}

static void slow_messages_are_spread_over_the_cycles(void **state) {
    (void)state;
    struct bench *b = bench_start();
    uint64_t before = 0;
    bench_cycles(b, 10);
    for (unsigned i = 0; i < 10; i++) { /* 6 fast ones, and 15 slow ones over 10 cycles */
        before = b->node.counts.sent;
        bench_cycles(b, 1);
        assert_in_range(b->node.counts.sent - before, 7, 8);
    }
    bench_free(b);
}

static void status_tells_what_the_real_time_layer_says(void **state) {
    (void)state;
    struct bench *b = bench_start();
    const struct kl_node_timing timing = {
        .overruns = 70000, .exec_last_ns = 12340, .exec_max_ns = 99999999};
    for (unsigned i = 0; i < 10; i++) {
        kl_node_cycle(&b->node, &timing);
    }
    bench_listen(b);
    assert_int_equal(seen_raw(b, KL_MSG_STATUS_TIMING, 0, "ExecLast"), 123);
    assert_int_equal(seen_raw(b, KL_MSG_STATUS_TIMING, 0, "ExecMax"), 65534); /* and saturated */
    assert_int_equal(seen_raw(b, KL_MSG_STATUS_TIMING, 0, "Overruns"), 70000 % 65536);
    assert_int_equal(b->node.codec.saturated, 1);
    bench_free(b);
}

static void info_tells_version_model_and_table(void **state) {
    (void)state;
    struct bench *b = bench_start();
    const int64_t low48 = (INT64_C(1) << 48) - 1;
    bench_cycles(b, 1000);
    assert_int_equal(seen_raw(b, KL_MSG_INFO_VERSION, 0, "Major"), KL_VERSION_MAJOR);
    assert_int_equal(seen_raw(b, KL_MSG_INFO_VERSION, 0, "Minor"), KL_VERSION_MINOR);
    assert_int_equal(seen_raw(b, KL_MSG_INFO_VERSION, 0, "Wheelsets"), 1);
    assert_int_equal(seen_raw(b, KL_MSG_INFO_MODEL, 0, "ModelHash"),
                     (int64_t)b->model.hash & low48);
    assert_int_equal(seen_raw(b, KL_MSG_INFO_SIGNALS, 0, "SignalHash"),
                     (int64_t)kl_signals_hash(&b->node.layout) & low48);
    bench_free(b);
}

/* ---- lockstep ---- */

static void send_sync(struct bench *b) {
    const struct kl_can_frame sync = {.id = KL_BUS_SYNC_ID};
    kl_can_send(&b->can, &sync);
}

static void lockstep_does_one_cycle_per_sync(void **state) {
    (void)state;
    struct bench *b = bench_new();
    b->config.lockstep = true;
    b->config.start_running = true;
    assert_int_equal(kl_node_init(&b->node, &b->config), KL_OK);
    assert_false(kl_node_cycle(&b->node, NULL));
    assert_int_equal(b->state.tick, 0);
    send_sync(b);
    bench_command(b, KL_COMMAND_PAUSE, 0); /* after the first SYNC: acts in the second cycle */
    send_sync(b);
    assert_true(kl_node_cycle(&b->node, NULL));
    assert_int_equal(b->state.tick, 1);
    assert_int_equal(b->node.run_state, KL_RUN_RUNNING);
    assert_true(kl_node_cycle(&b->node, NULL));
    assert_int_equal(b->state.tick, 1);
    assert_int_equal(b->node.run_state, KL_RUN_PAUSED);
    assert_false(kl_node_cycle(&b->node, NULL));
    assert_int_equal(b->node.counts.cycles, 2);
    assert_int_equal(b->node.counts.syncs, 2);
    bench_listen(b);
    assert_int_equal(b->seen[KL_MSG_VEHICLE_MOTION][0], 2);
    bench_free(b);
}

static void lockstep_and_real_time_give_the_same_bits(void **state) {
    (void)state;
    struct bench *clock = bench_start();
    struct bench *sync = bench_new();
    sync->config.lockstep = true;
    assert_int_equal(kl_node_init(&sync->node, &sync->config), KL_OK);
    for (unsigned i = 0; i < 500; i++) {
        struct bench *both[2] = {clock, sync};
        for (unsigned k = 0; k < 2; k++) {
            if (i == 3) {
                bench_command(both[k], KL_COMMAND_START, 0);
            }
            if (i % 100 == 7) {
                bench_speed(both[k], 20 + i / 100.0, 1);
            }
        }
        send_sync(sync);
        assert_true(kl_node_cycle(&clock->node, NULL));
        assert_true(kl_node_cycle(&sync->node, NULL));
        assert_memory_equal(&clock->state, &sync->state, sizeof clock->state);
    }
    assert_int_equal(clock->state.tick, 497);
    bench_free(clock);
    bench_free(sync);
}

/* ---- preparation ---- */

static void bad_configurations_are_refused(void **state) {
    (void)state;
    struct bench *b = bench_new();
    struct kl_node_config bad = b->config;
    bad.model = NULL;
    assert_int_equal(kl_node_init(&b->node, &bad), KL_ERR_ARGUMENT);
    bad = b->config;
    bad.can.ops = NULL;
    assert_int_equal(kl_node_init(&b->node, &bad), KL_ERR_ARGUMENT);
    bad = b->config;
    bad.start_speed_m_s = -1;
    assert_int_equal(kl_node_init(&b->node, &bad), KL_ERR_ARGUMENT);
    bad.start_speed_m_s = (kl_real)(0.0f / 0.0f);
    assert_int_equal(kl_node_init(&b->node, &bad), KL_ERR_ARGUMENT);
    bad = b->config;
    bad.state_divider = 1001;
    assert_int_equal(kl_node_init(&b->node, &bad), KL_ERR_ARGUMENT);
    assert_int_equal(kl_node_init(&b->node, NULL), KL_ERR_ARGUMENT);
    assert_int_equal(kl_node_init(NULL, &b->config), KL_ERR_ARGUMENT);
    bench_free(b);
}

static void too_slow_a_bus_is_refused(void **state) {
    (void)state;
    struct bench *b = bench_new();
    b->config.bit_rate = 500000;
    assert_int_equal(kl_node_init(&b->node, &b->config), KL_ERR_VALUE);
    assert_true(b->node.load.permille > 1000);
    b->config.state_divider = 5;
    assert_int_equal(kl_node_init(&b->node, &b->config), KL_OK);
    assert_true(b->node.load.permille < 700);
    assert_int_equal(b->node.load.verdict, KL_LOAD_OK);
    bench_free(b);
}

static void there_is_a_slot_for_every_message_of_the_largest_vehicle(void **state) {
    (void)state;
    static const struct kl_layout largest = {.n_bodies = KL_MAX_BODIES,
                                             .n_wheelsets = KL_MAX_WHEELSETS,
                                             .independent = true,
                                             .step_ns = 1000000,
                                             .state_divider = 1};
    uint32_t slots = 0;
    for (uint32_t i = 0; i < KL_MESSAGES; i++) {
        const struct kl_message *message = &kl_signal_messages()[i];
        bool cyclic = message->period_us != 0 && message->sender == KL_SENT_BY_NODE;
        slots += cyclic ? kl_message_instances(&largest, message) : 0;
    }
    assert_int_equal(slots, KL_NODE_SLOTS);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_starts_in_init_with_time_standing),
        cmocka_unit_test(commands_walk_through_the_run_states),
        cmocka_unit_test(steps_are_done_one_per_cycle_and_add_up),
        cmocka_unit_test(a_restored_snapshot_runs_on_to_the_same_bits),
        cmocka_unit_test(without_memory_for_it_there_is_no_snapshot),
        cmocka_unit_test(a_holding_fault_is_latched_published_and_left_by_reset),
        cmocka_unit_test(repeated_and_corrupt_commands_are_not_carried_out),
        cmocka_unit_test(a_late_setpoint_is_replaced_by_the_safe_value),
        cmocka_unit_test(a_repeated_or_impossible_setpoint_is_no_sign_of_life),
        cmocka_unit_test(reset_puts_a_free_setpoint_back_and_keeps_a_supervised_one),
        cmocka_unit_test(every_message_keeps_its_period_without_a_gap),
        cmocka_unit_test(slow_messages_are_spread_over_the_cycles),
        cmocka_unit_test(status_tells_what_the_real_time_layer_says),
        cmocka_unit_test(info_tells_version_model_and_table),
        cmocka_unit_test(lockstep_does_one_cycle_per_sync),
        cmocka_unit_test(lockstep_and_real_time_give_the_same_bits),
        cmocka_unit_test(bad_configurations_are_refused),
        cmocka_unit_test(too_slow_a_bus_is_refused),
        cmocka_unit_test(there_is_a_slot_for_every_message_of_the_largest_vehicle),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
