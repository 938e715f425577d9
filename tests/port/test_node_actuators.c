/*
 * Forces and torques over the bus: what a right frame does, what a late one, a foreign or damaged one;
 * and what is told of it. The bench's model has two actuators, see node_bench.h.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>
#include <math.h>

#include "node_bench.h"

static void assert_force(const struct bench *b, uint32_t i, double force_N) {
    assert_true(fabs((double)b->input.actuator_N[i] - force_N) < 1e-9);
}

static void every_actuator_of_the_model_has_its_frame(void **state) {
    (void)state;
    struct bench *b = bench_start();
    uint32_t index;
    uint32_t instance;
    assert_int_equal(b->node.layout.n_actuators, 2);
    assert_true(kl_message_find(&b->node.layout, 0x041, &index, &instance));
    assert_int_equal(index, KL_MSG_ACTUATOR);
    assert_int_equal(instance, 1);
    assert_false(kl_message_find(&b->node.layout, 0x042, &index, &instance));
    bench_free(b);
}

/* The body stands on 100 kN/m to the ground and 10 kN/m to the wheelset: 2 kN move it aside. */
static void a_force_moves_the_vehicle(void **state) {
    (void)state;
    struct bench *b = bench_start();
    bench_ask(b, KL_COMMAND_START, 0);
    bench_cycles(b, 100);
    bench_force(b, 0, 2000, 0);
    bench_cycles(b, 1);
    assert_force(b, 0, 2000);
    assert_force(b, 1, 0);
    bench_cycles(b, 8000); /* released: nobody watches it */
    assert_force(b, 0, 2000);
    assert_int_equal(b->node.counts.late, 0);
    assert_int_equal(b->node.counts.forces, 1);
    const double y = (double)b->output.body[0].position[KL_Y];
    assert_true(y > 0.9 * 2000 / 110e3 && y < 1.1 * 2000 / 100e3);
    bench_force(b, 0, -8388607, 0); /* the least that the signal holds */
    bench_cycles(b, 1);
    assert_force(b, 0, -8388607);
    bench_free(b);
}

static void a_late_force_is_replaced_by_none(void **state) {
    (void)state;
    struct bench *b = bench_start();
    bench_ask(b, KL_COMMAND_START, 0);
    for (int i = 0; i < 20; i++) {
        bench_force(b, 0, 1500, 1);
        bench_force(b, 1, -700, i < 10);
        bench_cycles(b, 10);
    }
    assert_force(b, 0, 1500);
    assert_int_equal(b->node.counts.late, 0);
    assert_int_equal(seen_raw(b, KL_MSG_STATUS_BUS, 0, "ActuatorControl"), 1);
    bench_cycles(b, 40);
    assert_force(b, 0, 1500);
    bench_cycles(b, 1); /* 5 x 10 ms after the frame */
    assert_force(b, 0, 0);
    assert_force(b, 1, -700); /* was released */
    assert_int_equal(b->node.counts.late, 1);
    bench_cycles(b, 100);
    assert_int_equal(b->node.counts.late, 1);
    assert_int_equal(seen_raw(b, KL_MSG_STATUS_BUS, 0, "ActuatorLate"), 1);
    assert_int_equal(seen_raw(b, KL_MSG_STATUS_BUS, 0, "SpeedLate"), 0);
    bench_force(b, 0, 300, 1);
    bench_cycles(b, 11);
    assert_force(b, 0, 300);
    assert_int_equal(seen_raw(b, KL_MSG_STATUS_BUS, 0, "ActuatorLate"), 0);
    bench_free(b);
}

static void a_wrong_frame_changes_nothing(void **state) {
    (void)state;
    struct bench *b = bench_start();
    bench_force(b, 0, 100, 0);
    bench_cycles(b, 1);
    struct kl_can_frame frame = force_frame(b, 0, 200, 0);
    frame.data[4] ^= 1; /* damaged */
    kl_can_send(&b->can, &frame);
    frame = force_frame(b, 1, 400, 0);
    frame.id = 0x040; /* of another actuator: its data ID does not fit */
    kl_can_send(&b->can, &frame);
    frame = force_frame(b, 0, (double)NAN, 0);
    kl_can_send(&b->can, &frame);
    frame = force_frame(b, 0, 500, 2); /* no such control */
    kl_can_send(&b->can, &frame);
    frame = force_frame(b, 0, 600, 0);
    frame.length = 7;
    kl_can_send(&b->can, &frame);
    frame = force_frame(b, 0, 100, 0);
    kl_can_send(&b->can, &frame);
    kl_can_send(&b->can, &frame); /* repeated */
    bench_cycles(b, 1);
    assert_force(b, 0, 100);
    assert_force(b, 1, 0);
    assert_int_equal(b->node.counts.protection, 3);
    assert_int_equal(b->node.counts.malformed, 3);
    assert_int_equal(b->node.counts.forces, 2);
    bench_free(b);
}

static void reset_lets_go_of_what_is_not_supervised(void **state) {
    (void)state;
    struct bench *b = bench_start();
    bench_force(b, 0, 100, 1);
    bench_force(b, 1, 200, 0);
    bench_cycles(b, 1);
    assert_force(b, 1, 200);
    assert_int_equal(bench_ask(b, KL_COMMAND_RESET, 0), KL_ACK_DONE);
    assert_force(b, 0, 100);
    assert_force(b, 1, 0);
    bench_free(b);
}

static void flanges_are_told(void **state) {
    (void)state;
    struct bench *b = bench_start();
    b->output.wheelset[0].flange.normal_N[KL_LEFT] = (kl_real)12345;
    b->output.wheelset[0].rail_m[KL_LEFT] = (kl_real)0.000287;
    b->output.wheelset[0].rail_m[KL_RIGHT] = (kl_real)-0.00006;
    b->output.wheelset[0].rise_m[KL_LEFT] = (kl_real)0.0035;
    bench_cycles(b, 11); /* in INIT the output stays */
    assert_int_equal(seen_raw(b, KL_MSG_WHEEL_FLANGE, 1, "Normal"), 1235); /* 10 N */
    assert_int_equal(seen_raw(b, KL_MSG_WHEEL_FLANGE, 1, "Rail"), 287);
    assert_int_equal(seen_raw(b, KL_MSG_WHEEL_FLANGE, 1, "Rise"), 3500);
    assert_int_equal(seen_raw(b, KL_MSG_WHEEL_FLANGE, 0, "Normal"), 0);
    assert_int_equal(seen_raw(b, KL_MSG_WHEEL_FLANGE, 0, "Rail"), -60);
    assert_int_equal(b->node.codec.saturated, 0);
    bench_free(b);
}

/* What only some vehicles have is not on the bus of others; a torque is on every one's. */
static void messages_follow_the_model(void **state) {
    (void)state;
    uint32_t index;
    uint32_t instance;
    struct bench *b = bench_start();
    assert_true(kl_message_find(&b->node.layout, 0x060, &index, &instance));
    assert_int_equal(index, KL_MSG_WHEELSET_DRIVE);
    assert_false(kl_message_find(&b->node.layout, 0x061, &index, &instance));
    assert_false(kl_message_find(&b->node.layout, 0x013, &index, &instance));
    assert_false(kl_message_find(&b->node.layout, 0x180, &index, &instance));
    bench_draw(b, 1000, 0);
    bench_cycles(b, 1);
    assert_int_equal(b->node.counts.unknown, 1);
    bench_free(b);
    b = bench_start_of(true);
    assert_true(kl_message_find(&b->node.layout, 0x013, &index, &instance));
    assert_int_equal(index, KL_MSG_DRAW_FORCE);
    assert_true(kl_message_find(&b->node.layout, 0x181, &index, &instance));
    assert_int_equal(index, KL_MSG_WHEEL_SPIN);
    assert_int_equal(instance, 1);
    assert_false(kl_message_find(&b->node.layout, 0x182, &index, &instance));
    bench_free(b);
}

/* Half a second with a draw force F, or with a torque F r on the axle, on the 11 250 kg of body and
 * wheelset and the rotating J / r^2: as much faster by Newton's law. */
static void train_and_axle_are_driven(void **state) {
    (void)state;
    const double mass = 11250 + 100 / (0.45 * 0.45);
    for (int by_torque = 0; by_torque < 2; by_torque++) {
        struct bench *b = bench_start_of(true);
        bench_ask(b, KL_COMMAND_START, 0);
        bench_cycles(b, 500);
        const double before = (double)b->output.speed_m_s;
        if (by_torque) {
            bench_drive(b, 2000 * 0.45, 0, 0);
        } else {
            bench_draw(b, 2000, 0);
        }
        bench_cycles(b, 500);
        assert_true(fabs((double)b->output.speed_m_s - before - 0.5 * 2000 / mass) <
                    0.02 * 0.5 * 2000 / mass);
        assert_int_equal(b->node.counts.forces, 1);
        assert_int_equal(b->output.faults, 0);
        bench_free(b);
    }
}

/* A twist turns the right wheel faster than the left; the frames tell either wheel's spin. */
static void wheels_that_turn_by_themselves_are_told(void **state) {
    (void)state;
    struct bench *b = bench_start_of(true);
    bench_ask(b, KL_COMMAND_START, 0);
    bench_cycles(b, 200);
    bench_drive(b, 0, 500, 0);
    bench_cycles(b, 200);
    assert_true((double)b->input.twist_torque_Nm[0] > 499.9);
    const double mean = (double)b->output.wheelset[0].spin_rad_s;
    const double twist = (double)b->output.wheelset[0].twist_rad_s;
    assert_true(twist > 1e-3);
    assert_true(fabs(1e-3 * (double)seen_raw(b, KL_MSG_WHEEL_SPIN, 0, "Spin") - mean - twist) <
                0.6e-3);
    assert_true(fabs(1e-3 * (double)seen_raw(b, KL_MSG_WHEEL_SPIN, 1, "Spin") - mean + twist) <
                0.6e-3);
    bench_free(b);
}

static void late_torques_and_draw_forces_are_replaced_by_none(void **state) {
    (void)state;
    struct bench *b = bench_start_of(true);
    bench_drive(b, 1500, 200, 1);
    bench_draw(b, -4000, 1);
    bench_cycles(b, 50);
    assert_true(fabs((double)b->input.axle_torque_Nm[0] - 1500) < 1e-9);
    assert_int_equal(seen_raw(b, KL_MSG_STATUS_BUS, 0, "ActuatorControl"), 1);
    bench_cycles(b, 1); /* 5 x 10 ms */
    assert_true(b->input.axle_torque_Nm[0] == 0 && b->input.twist_torque_Nm[0] == 0);
    assert_true(fabs((double)b->input.draw_force_N + 4000) < 1e-9);
    assert_int_equal(b->node.counts.late, 1);
    bench_cycles(b, 450); /* 5 x 100 ms */
    assert_true(b->input.draw_force_N == 0);
    assert_int_equal(b->node.counts.late, 2);
    bench_cycles(b, 20);
    assert_int_equal(seen_raw(b, KL_MSG_STATUS_BUS, 0, "ActuatorLate"), 1);
    bench_draw(b, (double)NAN, 1);
    bench_drive(b, 1, (double)INFINITY, 1);
    bench_cycles(b, 1);
    assert_int_equal(b->node.counts.malformed, 2);
    bench_drive(b, 700, 0, 0);
    bench_draw(b, 800, 0);
    bench_cycles(b, 1);
    assert_int_equal(bench_ask(b, KL_COMMAND_RESET, 0), KL_ACK_DONE);
    assert_true(b->input.axle_torque_Nm[0] == 0 && b->input.draw_force_N == 0);
    bench_free(b);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_actuator_of_the_model_has_its_frame),
        cmocka_unit_test(a_force_moves_the_vehicle),
        cmocka_unit_test(a_late_force_is_replaced_by_none),
        cmocka_unit_test(a_wrong_frame_changes_nothing),
        cmocka_unit_test(reset_lets_go_of_what_is_not_supervised),
        cmocka_unit_test(flanges_are_told),
        cmocka_unit_test(messages_follow_the_model),
        cmocka_unit_test(train_and_axle_are_driven),
        cmocka_unit_test(wheels_that_turn_by_themselves_are_told),
        cmocka_unit_test(late_torques_and_draw_forces_are_replaced_by_none),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
