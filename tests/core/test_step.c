/* The life of a state: init, inputs, outputs, and faults as values. */
#include "fixtures.h"

static struct built wagon_model;
static struct built wheelset_model;

static int set_up(void **state) {
    (void)state;
    struct vehicle v;
    wagon(&v, arcs_pair(KL_KINEMATICS_RIGID));
    v.pair[0].range_m = 0.015;
    one_curve(&v, KL_RAMP_LINEAR, 0.001, 0.02);
    build(&v, &wagon_model);
    single_wheelset(&v, arcs_pair(KL_KINEMATICS_RIGID), 1e5, 1e5);
    v.wheelset[0].load_N = 1e5;
    build(&v, &wheelset_model);
    return 0;
}

static int tear_down(void **state) {
    (void)state;
    unbuild(&wagon_model);
    unbuild(&wheelset_model);
    return 0;
}

static void init(const struct built *b, struct kl_state *x, double s, double v) {
    assert_int_equal(kl_init(&b->model, x, (kl_real)s, (kl_real)v, work()), KL_OK);
}

/* ---- life ---- */

static void init_rolls_freely(void **state) {
    (void)state;
    struct kl_state x;
    init(&wagon_model, &x, -50.0, 20.0);
    assert_int_equal(x.tick, 0);
    assert_int_equal(x.faults, 0);
    assert_near((double)x.s_m, -50.0, 0.0);
    assert_near((double)x.speed_m_s, 20.0, 0.0);
    for (uint32_t i = 0; i < x.n_states; i++) {
        const int spin =
            i == (uint32_t)kl_wheelset_state_index(&wagon_model.model, 0, KL_WS_SPIN) ||
            i == (uint32_t)kl_wheelset_state_index(&wagon_model.model, 1, KL_WS_SPIN);
        assert_near((double)x.x[i], spin ? 20.0 / ARCS_R0 : 0.0, 1e-12);
    }
    /* in the curve the rates are the track's */
    init(&wagon_model, &x, 140.0, 20.0);
    assert_near((double)wheelset_x(&wagon_model.model, &x, 0)[KL_WS_YAW_RATE], 0.02, 1e-12);
}

static void init_refuses(void **state) {
    (void)state;
    struct kl_state x;
    struct kl_model other = wagon_model.model;
    assert_int_equal(kl_init(NULL, &x, 0, 1, work()), KL_ERR_ARGUMENT);
    assert_int_equal(kl_init(&wagon_model.model, NULL, 0, 1, work()), KL_ERR_ARGUMENT);
    const double speeds[] = {-0.1, KL_MAX_SPEED_M_S + 0.1, (double)NAN, (double)INFINITY};
    for (size_t i = 0; i < COUNT(speeds); i++) {
        assert_int_equal(kl_init(&wagon_model.model, &x, 0, (kl_real)speeds[i], work()),
                         KL_ERR_ARGUMENT);
    }
    assert_int_equal(kl_init(&wagon_model.model, &x, (kl_real)NAN, 1, work()), KL_ERR_ARGUMENT);
    assert_int_equal(kl_init(&wagon_model.model, &x, (kl_real)INFINITY, 1, work()),
                     KL_ERR_ARGUMENT);
    other.version++;
    assert_int_equal(kl_init(&other, &x, 0, 1, work()), KL_ERR_ARGUMENT);
}

static void time_is_ticks(void **state) {
    (void)state;
    struct kl_state x;
    struct kl_output o;
    init(&wagon_model, &x, 0.0, 10.0);
    assert_int_equal(coast(&wagon_model.model, &x, 1234, &o), 0);
    assert_int_equal(x.tick, 1234);
    assert_int_equal(o.tick, 1234);
    assert_int_equal(o.time_ns, INT64_C(1234) * 1000000);
    assert_near((double)x.s_m, 12.34, 1e-9);
    assert_near((double)o.s_m, 12.34, 1e-9);
}

/* The set-point is reached at the stated acceleration, exactly, and s is its integral. */
static void speed_follows_the_set_point(void **state) {
    (void)state;
    struct kl_state x;
    struct kl_output o;
    struct kl_input input;
    init(&wagon_model, &x, 0.0, 10.0);
    kl_input_init(&input);
    input.speed_m_s = 12;
    for (int i = 0; i < 1000; i++) {
        kl_step(&wagon_model.model, &x, &input, &o, work());
    }
    assert_near((double)x.speed_m_s, 11.0, 1e-12);
    assert_near((double)x.s_m, 10.5, 1e-9);
    assert_near((double)o.acceleration_m_s2, 1.0, 1e-9);
    for (int i = 0; i < 1500; i++) {
        kl_step(&wagon_model.model, &x, &input, &o, work());
    }
    assert_true(x.speed_m_s == 12);
    assert_near((double)o.acceleration_m_s2, 0.0, 0.0);
}

/* Outputs are optional and change nothing. */
static void output_may_be_null(void **state) {
    (void)state;
    struct kl_state a;
    struct kl_state b;
    struct kl_output o;
    init(&wagon_model, &a, 0.0, 25.0);
    b = a;
    coast(&wagon_model.model, &a, 3000, NULL);
    coast(&wagon_model.model, &b, 3000, &o);
    assert_memory_equal(&a, &b, sizeof a);
}

/* Rates are what the step integrates: (x(h) - x(0))/h -> rates as h -> 0. */
static void rates_are_derivatives(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    struct kl_state x;
    struct kl_state next;
    struct kl_input input;
    kl_real rates[KL_MAX_STATES];
    wagon(&v, arcs_pair(KL_KINEMATICS_RIGID));
    v.def.step_ns = 10000;
    build(&v, &b);
    init(&b, &x, 0.0, 20.0);
    kl_input_init(&input);
    input.speed_m_s = 20;
    wheelset_x(&b.model, &x, 0)[KL_WS_Y] = (kl_real)1e-3;
    x.x[kl_body_state_index(&b.model, 0, KL_ROLL, 0)] = (kl_real)1e-3;
    kl_refresh(&b.model, &x, work());
    coast(&b.model, &x, 20000, NULL);
    kl_rates(&b.model, &x, &input, rates, work());
    next = x;
    kl_step(&b.model, &next, &input, NULL, work());
    for (uint32_t i = 0; i < x.n_states; i++) {
        const double slope = (double)(next.x[i] - x.x[i]) / 1e-5;
        assert_near(slope, (double)rates[i], 1e-6 + 0.02 * fabs((double)rates[i]));
    }
    unbuild(&b);
}

/* Torque accelerates the axle: in the first step by torque/I_y, then creep force holds it. */
static void torque_drives_forward(void **state) {
    (void)state;
    struct kl_state x;
    struct kl_output o;
    struct kl_input input;
    init(&wheelset_model, &x, 0.0, 20.0);
    kl_input_init(&input);
    input.speed_m_s = 20;
    input.axle_torque_Nm[0] = 1000;
    for (int i = 0; i < 2000; i++) {
        assert_int_equal(kl_step(&wheelset_model.model, &x, &input, &o, work()), 0);
    }
    const struct kl_wheelset_output *w = &o.wheelset[0];
    /* forward on the wheels, one half each; the axle turns faster than it rolls */
    assert_near((double)w->tread.t1_N[KL_RIGHT], 0.5 * 1000.0 / ARCS_R0, 1.0);
    assert_near((double)w->tread.t1_N[KL_LEFT], 0.5 * 1000.0 / ARCS_R0, 1.0);
    assert_true(w->spin_rad_s > (kl_real)(20.0 / ARCS_R0));
}

/* Side force to the right leans the body on the right wheels: Q by moments about the rails. */
static void side_force_acts_to_the_right(void **state) {
    (void)state;
    struct kl_state x;
    struct kl_output o;
    struct kl_input input;
    init(&wagon_model, &x, -1e5, 20.0);
    kl_input_init(&input);
    input.speed_m_s = 20;
    input.side_force_N[0] = 10000;
    for (int i = 0; i < 30000; i++) {
        assert_int_equal(kl_step(&wagon_model.model, &x, &input, &o, work()), 0);
    }
    double q = 0.0;
    double y = 0.0;
    for (int w = 0; w < 2; w++) {
        q += (double)(o.wheelset[w].q_N[KL_RIGHT] - o.wheelset[w].q_N[KL_LEFT]);
        y += (double)o.wheelset[w].force_y_N;
    }
    assert_near(y, 10000.0, 20.0);
    /* F h + W y of the body, over half the base; y is a few mm */
    assert_true(q * ARCS_L > 10000.0 * 1.65 && q * ARCS_L < 10000.0 * 1.65 + 4e5 * 0.05);
}

/* Friction off on both wheels: no creep force at all. */
static void friction_factor_scales_friction(void **state) {
    (void)state;
    struct kl_state x;
    struct kl_output o;
    struct kl_input input;
    init(&wheelset_model, &x, 0.0, 20.0);
    wheelset_x(&wheelset_model.model, &x, 0)[KL_WS_YAW] = (kl_real)5e-3;
    kl_refresh(&wheelset_model.model, &x, work());
    kl_input_init(&input);
    input.speed_m_s = 20;
    input.friction_factor[0][KL_LEFT] = (kl_real)0.5;
    input.friction_factor[0][KL_RIGHT] = 0;
    kl_observe(&wheelset_model.model, &x, &input, &o, work());
    const struct kl_contact_output *tread = &o.wheelset[0].tread;
    assert_true(tread->t1_N[KL_RIGHT] == 0 && tread->t2_N[KL_RIGHT] == 0 &&
                tread->m3_Nm[KL_RIGHT] == 0);
    assert_at_most(hypot((double)tread->t1_N[KL_LEFT], (double)tread->t2_N[KL_LEFT]),
                   0.15 * (double)tread->normal_N[KL_LEFT]);
    assert_true(hypot((double)tread->t1_N[KL_LEFT], (double)tread->t2_N[KL_LEFT]) >
                0.13 * (double)tread->normal_N[KL_LEFT]);
}

/* ---- faults ---- */

static void bad_input_is_limited_and_said(void **state) {
    (void)state;
    const double bad[] = {(double)NAN, (double)INFINITY, -(double)INFINITY, 1e9, -1e9};
    for (size_t i = 0; i < COUNT(bad); i++) {
        for (int field = 0; field < 4; field++) {
            struct kl_state x;
            struct kl_state y;
            struct kl_input input;
            struct kl_input limited;
            init(&wagon_model, &x, 0.0, 20.0);
            y = x;
            kl_input_init(&input);
            input.speed_m_s = 20;
            limited = input;
            const double kept[4][2] = {
                {KL_MAX_SPEED_M_S, 0.0}, {1e6, -1e6}, {2.0, 0.0}, {1e7, -1e7}};
            const double otherwise[4] = {20.0, 0.0, 1.0, 0.0};
            const double as = !isfinite(bad[i]) ? otherwise[field] : kept[field][bad[i] < 0.0];
            kl_real *in[4] = {&input.speed_m_s, &input.axle_torque_Nm[1],
                              &input.friction_factor[1][KL_LEFT], &input.side_force_N[0]};
            kl_real *to[4] = {&limited.speed_m_s, &limited.axle_torque_Nm[1],
                              &limited.friction_factor[1][KL_LEFT], &limited.side_force_N[0]};
            *in[field] = (kl_real)bad[i];
            *to[field] = (kl_real)as;
            for (int n = 0; n < 3; n++) {
                assert_true(kl_step(&wagon_model.model, &x, &input, NULL, work()) & KL_FAULT_INPUT);
                assert_false(kl_step(&wagon_model.model, &y, &limited, NULL, work()) &
                             KL_FAULT_INPUT);
            }
            assert_int_equal(x.fault_tick, 1);
            assert_memory_equal(x.x, y.x, sizeof x.x); /* the run goes on as with the limit */
            /* said until it is cleared */
            assert_true(kl_step(&wagon_model.model, &x, &limited, NULL, work()) & KL_FAULT_INPUT);
            kl_clear_faults(&x);
            assert_false(kl_step(&wagon_model.model, &x, &limited, NULL, work()) & KL_FAULT_INPUT);
        }
    }
}

/* Inputs of vehicles that this one does not have are not looked at. */
static void absent_inputs_do_not_matter(void **state) {
    (void)state;
    struct kl_state x;
    struct kl_input input;
    init(&wagon_model, &x, 0.0, 20.0);
    kl_input_init(&input);
    input.speed_m_s = 20;
    input.axle_torque_Nm[2] = (kl_real)NAN;
    input.friction_factor[5][0] = (kl_real)NAN;
    input.side_force_N[1] = (kl_real)NAN;
    assert_int_equal(kl_step(&wagon_model.model, &x, &input, NULL, work()), 0);
}

/* The last good state and output are held; ticks go on. */
static void holds(struct kl_state *x, struct kl_output *last, uint32_t fault) {
    struct kl_output o = *last;
    struct kl_state before = *x;
    const uint32_t faults = coast(&wheelset_model.model, x, 1, &o);
    assert_true((faults & fault) != 0);
    assert_int_equal(x->tick, before.tick + 1u);
    assert_int_equal(x->fault_tick, before.fault_tick != 0 ? before.fault_tick : x->tick);
    for (int i = 0; i < 5; i++) {
        assert_int_equal(coast(&wheelset_model.model, x, 1, &o), faults);
    }
    assert_int_equal(x->tick, before.tick + 6u);
    assert_memory_equal(x->x, before.x, sizeof x->x);
    assert_memory_equal(&x->s_m, &before.s_m, sizeof x->s_m);
    assert_memory_equal(&x->speed_m_s, &before.speed_m_s, sizeof x->speed_m_s);
    assert_int_equal(o.tick, x->tick);
    assert_int_equal(o.time_ns, (int64_t)x->tick * 1000000);
    assert_int_equal(o.faults, faults);
    o.tick = last->tick;
    o.time_ns = last->time_ns;
    o.faults = last->faults;
    assert_memory_equal(&o, last, sizeof o);
}

static void nan_in_the_state_is_latched(void **state) {
    (void)state;
    for (int k = 0; k < KL_WHEELSET_STATES; k++) {
        const double bad[] = {(double)NAN, (double)INFINITY, -(double)INFINITY};
        for (size_t i = 0; i < COUNT(bad); i++) {
            struct kl_state x;
            struct kl_state good;
            struct kl_output o;
            memset(&o, 0, sizeof o);
            init(&wheelset_model, &x, 0.0, 20.0);
            wheelset_x(&wheelset_model.model, &x, 0)[KL_WS_Y] = (kl_real)1e-3;
            assert_int_equal(coast(&wheelset_model.model, &x, 100, &o), 0);
            good = x;
            wheelset_x(&wheelset_model.model, &x, 0)[k] = (kl_real)bad[i];
            holds(&x, &o, KL_FAULTS_HOLD);
            assert_true((x.faults & (uint32_t)KL_FAULT_NONFINITE) != 0);
            /* cleared and restored it goes on as if nothing had been */
            const uint64_t tick = x.tick;
            kl_clear_faults(&x);
            assert_int_equal(x.faults, 0);
            assert_int_equal(x.fault_tick, 0);
            memcpy(x.x, good.x, sizeof x.x);
            assert_int_equal(coast(&wheelset_model.model, &x, 50, NULL), 0);
            assert_int_equal(coast(&wheelset_model.model, &good, 50, NULL), 0);
            assert_memory_equal(x.x, good.x, sizeof x.x);
            assert_int_equal(x.tick, tick + 50u);
        }
    }
}

/* Pushed beyond the table: held at the last state within it. */
static void derailment_is_latched(void **state) {
    (void)state;
    for (int side = -1; side <= 1; side += 2) {
        struct kl_state x;
        struct kl_state before;
        struct kl_output o;
        memset(&o, 0, sizeof o);
        init(&wheelset_model, &x, 0.0, 20.0);
        kl_real *q = wheelset_x(&wheelset_model.model, &x, 0);
        q[KL_WS_YAW] = (kl_real)(0.03 * side);
        uint32_t faults = 0;
        int steps = 0;
        do {
            before = x;
            struct kl_output last = o;
            faults = coast(&wheelset_model.model, &x, 1, &o);
            o = faults ? last : o;
            steps++;
            assert_true(steps < 1000);
        } while (faults == 0);
        assert_int_equal(faults, KL_FAULT_DERAILED);
        assert_int_equal(x.fault_tick, x.tick);
        assert_memory_equal(x.x, before.x, sizeof x.x);
        assert_true(fabs((double)q[KL_WS_Y]) <= 0.008 && (double)q[KL_WS_Y] * side > 0.007);
        holds(&x, &o, KL_FAULT_DERAILED);
    }
}

/* A state restored beyond the table is at once derailed. */
static void a_state_beyond_the_table_is_derailed(void **state) {
    (void)state;
    struct kl_state x;
    init(&wheelset_model, &x, 0.0, 20.0);
    wheelset_x(&wheelset_model.model, &x, 0)[KL_WS_Y] = (kl_real)0.00801;
    assert_true(coast(&wheelset_model.model, &x, 1, NULL) & KL_FAULT_DERAILED);
    assert_near((double)wheelset_x(&wheelset_model.model, &x, 0)[KL_WS_Y], 0.00801, 0.0);
}

/* The body rocks: 4.4 MN m/rad against 34.4 t m2 gives 0.17 rad for 2 rad/s if it were
 * not damped, 780 kN m on 293 kN m of weight. The wheels on one side lift: said, no force there,
 * and the run goes on. */
static void wheel_lift_is_said_and_goes_on(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    struct kl_state x;
    struct kl_output o;
    wagon(&v, linear_pair(0.1));
    v.pair[0].range_m = 0.05; /* level rails: it slides aside while it rocks */
    build(&v, &b);
    init(&b, &x, 0.0, 20.0);
    x.x[kl_body_state_index(&b.model, 0, KL_ROLL, 1)] = (kl_real)2.0;
    kl_refresh(&b.model, &x, work());
    double least = 1e9;
    for (int i = 0; i < 300 && least > 0.0; i++) {
        const uint32_t faults = coast(&b.model, &x, 1, &o);
        least = fmin(least, (double)o.wheelset[0].tread.normal_N[KL_LEFT]);
        assert_int_equal(faults & KL_FAULTS_HOLD, 0);
        assert_int_equal(o.wheelset[0].tread.normal_N[KL_LEFT] > 0 ||
                             (faults & (uint32_t)KL_FAULT_WHEEL_LIFT) != 0,
                         1);
    }
    assert_true(least == 0.0);
    assert_true(o.wheelset[0].tread.t2_N[KL_LEFT] == 0);
    assert_true(o.wheelset[0].tread.normal_N[KL_RIGHT] > 0);
    const kl_real s = x.s_m;
    coast(&b.model, &x, 1, &o);
    assert_true(x.s_m > s && (x.faults & (uint32_t)KL_FAULT_WHEEL_LIFT) != 0);
    unbuild(&b);
}

/* Whatever bytes a state is made of, the step comes back, and says so if it holds. */
static void absurd_states_never_crash(void **state) {
    (void)state;
    uint64_t seed = 41;
    print_message("seed 41\n");
    for (int i = 0; i < 20000; i++) {
        struct kl_state x;
        struct kl_output o;
        init(&wagon_model, &x, 0.0, 20.0);
        for (int k = 0; k < 4; k++) {
            uint64_t bits = random_bits(&seed);
            memcpy(&x.x[random_bits(&seed) % x.n_states], &bits, sizeof bits);
        }
        const uint32_t faults = coast(&wagon_model.model, &x, 2, &o);
        int sound = 1;
        for (uint32_t k = 0; k < x.n_states; k++) {
            sound = sound && isfinite((double)x.x[k]);
        }
        assert_true(sound || (faults & KL_FAULTS_HOLD) != 0);
    }
}

/* Absurd places on the track too: far away all is constant. */
static void absurd_places_never_crash(void **state) {
    (void)state;
    const double s[] = {-1e15, -1e9, 1e9, 1e15, 1e300, -1e300};
    for (size_t i = 0; i < COUNT(s); i++) {
        struct kl_state x;
        struct kl_output o;
        init(&wagon_model, &x, s[i], 20.0);
        (void)coast(&wagon_model.model, &x, 10, &o);
        assert_int_equal(x.tick, 10);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(init_rolls_freely),
        cmocka_unit_test(init_refuses),
        cmocka_unit_test(time_is_ticks),
        cmocka_unit_test(speed_follows_the_set_point),
        cmocka_unit_test(output_may_be_null),
        cmocka_unit_test(rates_are_derivatives),
        cmocka_unit_test(torque_drives_forward),
        cmocka_unit_test(side_force_acts_to_the_right),
        cmocka_unit_test(friction_factor_scales_friction),
        cmocka_unit_test(bad_input_is_limited_and_said),
        cmocka_unit_test(absent_inputs_do_not_matter),
        cmocka_unit_test(nan_in_the_state_is_latched),
        cmocka_unit_test(derailment_is_latched),
        cmocka_unit_test(a_state_beyond_the_table_is_derailed),
        cmocka_unit_test(wheel_lift_is_said_and_goes_on),
        cmocka_unit_test(absurd_states_never_crash),
        cmocka_unit_test(absurd_places_never_crash),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
