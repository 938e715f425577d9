/*
 * Wheels that turn by themselves. What they must do is derived here, from the creepages and Newton's
 * law for either wheel: I_y/2 Omega' = torque - r T1 (Wickens, Fundamentals of Rail Vehicle
 * Dynamics, on independent wheels; Goodall and Mei 2006 in the Handbook of Railway Vehicle Dynamics).
 */
#include "fixtures.h"

#define CONICITY 0.1144
#define F11 7.44e6
#define F22 6.79e6
#define MASS 1250.0
#define YAW 700.0
#define SPIN 100.0

static void one_wheelset(struct vehicle *v, double conicity, double k_y, double k_yaw) {
    single_wheelset(v, linear_pair(conicity), k_y, k_yaw);
    v->wheelset[0].creep = constant_creep();
    v->wheelset[0].independent = 1;
}

static kl_real *twist_of(const struct kl_model *m, struct kl_state *x, uint32_t w) {
    const int32_t i = kl_wheelset_state_index(m, w, KL_WS_TWIST);
    assert_true(i >= 0);
    return &x->x[i];
}

static void it_has_one_state_more(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    wagon(&v, s1002_uic60());
    build(&v, &b);
    const uint32_t n = b.model.n_states;
    const uint64_t solid = b.model.hash;
    assert_int_equal(kl_wheelset_state_index(&b.model, 1, KL_WS_TWIST), -1);
    unbuild(&b);
    v.wheelset[1].independent = 1;
    build(&v, &b);
    assert_int_equal(b.model.n_states, n + 1);
    assert_int_equal(b.model.n_twists, 1);
    assert_int_equal(kl_wheelset_state_index(&b.model, 0, KL_WS_TWIST), -1);
    assert_int_equal(kl_wheelset_state_index(&b.model, 1, KL_WS_TWIST), n);
    assert_true(b.model.hash != solid);
    assert_int_equal(kl_model_check(&b.model), KL_OK);
    b.model.n_twists = 2;
    assert_int_equal(kl_model_check(&b.model), KL_ERR_VALUE);
    unbuild(&b);
}

/* y, y', psi, psi', twist of the linear wheelset: slip of either wheel over V is
 * -s (lambda y/r0 + r0 twist/V + l psi'/V). */
static void slope(const double q[5], double v, double k_y, double k_yaw, double d[5]) {
    const double slip = CONICITY * q[0] / ARCS_R0 + ARCS_R0 * q[4] / v + ARCS_L * q[3] / v;
    d[0] = q[1];
    d[1] = (-2.0 * F22 * (q[1] / v - q[2]) - k_y * q[0]) / MASS;
    d[2] = q[3];
    d[3] = (-2.0 * F11 * ARCS_L * slip - k_yaw * q[2]) / YAW;
    d[4] = -2.0 * F11 * ARCS_R0 * slip / SPIN;
}

static void runge_kutta(double q[5], double v, double k_y, double k_yaw, double h) {
    double d[4][5];
    double at[5];
    slope(q, v, k_y, k_yaw, d[0]);
    for (int stage = 1; stage < 4; stage++) {
        const double part = stage < 3 ? 0.5 * h : h;
        for (int i = 0; i < 5; i++) {
            at[i] = q[i] + part * d[stage - 1][i];
        }
        slope(at, v, k_y, k_yaw, d[stage]);
    }
    for (int i = 0; i < 5; i++) {
        q[i] += h / 6.0 * (d[0][i] + 2.0 * d[1][i] + 2.0 * d[2][i] + d[3][i]);
    }
}

/* Largest distance to those equations over 2 s, relative to the start. */
static double distance_to_equations(double v, double k_y, double k_yaw, int64_t step_ns) {
    struct vehicle vehicle;
    struct built b;
    struct kl_state x;
    one_wheelset(&vehicle, CONICITY, k_y, k_yaw);
    vehicle.def.step_ns = step_ns;
    vehicle.def.gravity_m_s2 = 0.0;
    set_going(&vehicle, &b, v, &x);
    double q[5] = {1e-3, 0.0, 0.0, 0.0, 0.0};
    wheelset_x(&b.model, &x, 0)[KL_WS_Y] = (kl_real)q[0];
    kl_refresh(&b.model, &x, work());
    double worst = 0.0;
    for (int64_t t = 0; t < 2000000000; t += step_ns) {
        assert_int_equal(coast(&b.model, &x, 1, NULL), 0);
        for (int64_t fine = 0; fine < step_ns; fine += 10000) {
            runge_kutta(q, v, k_y, k_yaw, 1e-5);
        }
        worst = fmax(worst, fabs((double)wheelset_x(&b.model, &x, 0)[KL_WS_Y] - q[0]));
    }
    unbuild(&b);
    return worst / 1e-3;
}

static void it_moves_as_the_equations_say(void **state) {
    (void)state;
    const double speed[] = {10.0, 30.0, 60.0};
    for (size_t i = 0; i < COUNT(speed); i++) {
        const double coarse = distance_to_equations(speed[i], 1e6, 2.5e6, 1000000);
        const double fine = distance_to_equations(speed[i], 1e6, 2.5e6, 250000);
        print_message("%g m/s: %.2e at 1 ms, %.2e at 0.25 ms\n", speed[i], coarse, fine);
        assert_at_most(coarse, 0.02);
        assert_at_most(fine, 0.2 * coarse);
    }
}

/* A solid wheelset swings with Klingel's wavelength, 2 pi sqrt(r0 l/lambda) = 10.757 m; this one
 * rolls on aside, each wheel at the speed of its radius. */
static void it_does_not_hunt(void **state) {
    (void)state;
    for (int independent = 0; independent < 2; independent++) {
        struct vehicle v;
        struct built b;
        struct kl_state x;
        struct kl_output o;
        one_wheelset(&v, CONICITY, 0.0, 0.0);
        v.wheelset[0].independent = independent;
        set_going(&v, &b, 5, &x);
        const double y = 1e-3;
        const double dr = CONICITY * y;
        wheelset_x(&b.model, &x, 0)[KL_WS_Y] = (kl_real)y;
        if (independent) {
            *twist_of(&b.model, &x, 0) =
                (kl_real)(0.5 * (5.0 / (ARCS_R0 + dr) - 5.0 / (ARCS_R0 - dr)));
        }
        kl_refresh(&b.model, &x, work());
        double least = y;
        for (int n = 0; n < 20 * 2152; n++) { /* 20 of those wavelengths */
            assert_int_equal(coast(&b.model, &x, 1, &o), 0);
            least = fmin(least, (double)o.wheelset[0].y_m);
        }
        if (independent) {
            assert_near(least, y, 1e-9);
            assert_near((double)o.wheelset[0].yaw_rad, 0.0, 1e-9);
            assert_near((double)o.wheelset[0].tread.gamma1[KL_RIGHT], 0.0, 1e-9);
            assert_near((double)o.wheelset[0].tread.gamma1[KL_LEFT], 0.0, 1e-9);
        } else {
            assert_true(least < -y); /* and grows, as free wheelsets do */
        }
        unbuild(&b);
    }
}

/* In a curve the solid wheelset's slip turns it against its yaw spring; these wheels roll freely. */
static void a_curve_does_not_steer_it(void **state) {
    (void)state;
    const double kappa = 1.0 / 400.0;
    const double speed = 20.0;
    struct vehicle v;
    struct built b;
    struct kl_state x;
    struct kl_output o;
    one_wheelset(&v, CONICITY, 50e6, 2e6);
    v.def.gravity_m_s2 = 0.0;
    v.track.curvature_start_1_m = kappa;
    v.element[0].c[5] = 20e3; /* what rolls as it yaws is damped by nothing else */
    set_going(&v, &b, speed, &x);
    assert_int_equal(coast(&b.model, &x, 20000, &o), 0);
    const struct kl_wheelset_output *w = &o.wheelset[0];
    const double dr = CONICITY * (double)w->y_m;
    const double right = speed * (1.0 - ARCS_L * kappa) / (ARCS_R0 + dr);
    const double left = speed * (1.0 + ARCS_L * kappa) / (ARCS_R0 - dr);
    print_message("y %.3g mm, twist %.6f rad/s\n", 1e3 * (double)w->y_m, (double)w->twist_rad_s);
    assert_near((double)w->yaw_rad, 0.0, 1e-8);
    assert_near((double)w->tread.t1_N[KL_RIGHT], 0.0, 0.1);
    assert_near((double)w->tread.t1_N[KL_LEFT], 0.0, 0.1);
    assert_near((double)w->twist_rad_s, 0.5 * (right - left), 1e-6);
    assert_near((double)w->spin_rad_s, 0.5 * (right + left), 1e-6);
    unbuild(&b);
}

/* Motors of two wheels that pull against each other turn it: k_yaw psi = -2 l torque/r0. */
static void opposite_torques_steer_it(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    struct kl_state x;
    struct kl_output o;
    struct kl_input input;
    one_wheelset(&v, 1e-9, 50e9, 2e6);
    v.def.gravity_m_s2 = 0.0;
    v.def.step_ns = 100000;
    v.element[0].c[1] = 1e6;
    v.element[0].c[5] = 20e3;
    set_going(&v, &b, 20, &x);
    kl_input_init(&input);
    input.speed_m_s = 20;
    input.twist_torque_Nm[0] = 1000;
    for (int n = 0; n < 100000; n++) {
        assert_int_equal(kl_step(&b.model, &x, &input, &o, work()), 0);
    }
    assert_near((double)o.wheelset[0].yaw_rad, -2.0 * ARCS_L * 1000.0 / ARCS_R0 / 2e6, 1e-7);
    assert_near((double)o.wheelset[0].tread.t1_N[KL_RIGHT], 1000.0 / ARCS_R0, 0.1);
    assert_near((double)o.wheelset[0].tread.t1_N[KL_LEFT], -1000.0 / ARCS_R0, 0.1);
    unbuild(&b);
}

/* Worn wheels: the contact angles part as it goes aside, and weigh it back, without a swing. */
static void contact_angles_centre_it(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    struct kl_state x;
    single_wheelset(&v, arcs_pair(KL_KINEMATICS_RIGID), 0.0, 10e6);
    v.wheelset[0].load_N = 67.7e3;
    v.wheelset[0].independent = 1;
    v.element[0].c[5] = 20e3;
    set_going(&v, &b, 20, &x);
    wheelset_x(&b.model, &x, 0)[KL_WS_Y] = (kl_real)2e-3;
    kl_refresh(&b.model, &x, work());
    assert_int_equal(coast(&b.model, &x, 500, NULL), 0);
    double before = (double)wheelset_x(&b.model, &x, 0)[KL_WS_Y];
    for (int n = 0; n < 100; n++) {
        assert_int_equal(coast(&b.model, &x, 100, NULL), 0);
        const double y = (double)wheelset_x(&b.model, &x, 0)[KL_WS_Y];
        assert_true(y >= -1e-7 && y <= before + 1e-9);
        before = y;
    }
    print_message("y after 10.5 s: %.3g mm\n", 1e3 * before);
    assert_near(before, 0.0, 2e-4);
    unbuild(&b);
}

/* Largest distance of y to that of a solid axle. */
static double distance_to_solid(double coupling) {
    struct vehicle v;
    struct built solid;
    struct built held;
    struct kl_state a;
    struct kl_state c;
    wagon(&v, s1002_uic60());
    build(&v, &solid);
    for (uint32_t w = 0; w < 2; w++) {
        v.wheelset[w].independent = 1;
        v.wheelset[w].coupling_Nms_rad = coupling;
    }
    build(&v, &held);
    assert_int_equal(kl_init(&solid.model, &a, 0, 25, work()), KL_OK);
    assert_int_equal(kl_init(&held.model, &c, 0, 25, work()), KL_OK);
    wheelset_x(&solid.model, &a, 0)[KL_WS_Y] = (kl_real)2e-3;
    wheelset_x(&held.model, &c, 0)[KL_WS_Y] = (kl_real)2e-3;
    kl_refresh(&solid.model, &a, work());
    kl_refresh(&held.model, &c, work());
    double worst = 0.0;
    for (int n = 0; n < 3000; n++) {
        assert_int_equal(coast(&solid.model, &a, 1, NULL), 0);
        assert_int_equal(coast(&held.model, &c, 1, NULL), 0);
        for (uint32_t w = 0; w < 2; w++) {
            worst = fmax(worst, fabs((double)(wheelset_x(&solid.model, &a, w)[KL_WS_Y] -
                                              wheelset_x(&held.model, &c, w)[KL_WS_Y])));
        }
    }
    unbuild(&solid);
    unbuild(&held);
    return worst;
}

static void a_stiff_coupling_makes_it_solid(void **state) {
    (void)state;
    const double loose = distance_to_solid(0.0);
    const double stiff = distance_to_solid(1e6);
    const double stiffer = distance_to_solid(1e7);
    print_message("y off by %.3g mm free, %.3g at 1e6, %.3g at 1e7 N m s\n", 1e3 * loose,
                  1e3 * stiff, 1e3 * stiffer);
    assert_true(loose > 1e-3);
    assert_at_most(stiff, 1e-4);
    assert_at_most(stiffer, 0.12 * stiff);
}

/* Any speed at 1 ms: thrown aside with wheels at wrong speeds, on a rail that is dry, or wet on one
 * side, it settles to rolling. At 120 m/s the wagon hunts within the jump on the tread, the same at a
 * tenth of the step. */
static void it_is_stable_at_any_speed(void **state) {
    (void)state;
    const double speed[] = {0.0, 0.02, 0.1, 0.3, 1.0, 3.0, 10.0, 40.0, 120.0};
    for (size_t i = 0; i < 2 * COUNT(speed); i++) {
        struct vehicle v;
        struct built b;
        struct kl_state x;
        struct kl_input input;
        struct kl_output o;
        wagon(&v, s1002_uic60());
        v.wheelset[0].independent = 1;
        v.wheelset[1].independent = 1;
        build(&v, &b);
        const kl_real at = (kl_real)speed[i / 2];
        assert_int_equal(kl_init(&b.model, &x, 0, at, work()), KL_OK);
        kl_input_init(&input);
        input.speed_m_s = at;
        input.friction_factor[0][KL_LEFT] = i % 2 ? (kl_real)0.05 : 1;
        wheelset_x(&b.model, &x, 0)[KL_WS_Y] = (kl_real)2e-3;
        wheelset_x(&b.model, &x, 0)[KL_WS_SPIN] += (kl_real)0.5;
        *twist_of(&b.model, &x, 0) = (kl_real)1;
        kl_refresh(&b.model, &x, work());
        double left = 0.0;
        for (int n = 0; n < 4000; n++) {
            assert_int_equal(kl_step(&b.model, &x, &input, &o, work()), 0);
            for (int s = 0; s < KL_SIDES && n >= 3000; s++) {
                left = fmax(left, fabs((double)o.wheelset[0].tread.t1_N[s]));
            }
        }
        print_message("%g m/s%s: T1 in the last second %.3g N\n", (double)at,
                      i % 2 ? ", left rail wet" : "", left);
        assert_at_most(left, at < 100 ? 30.0 : 20e3);
        assert_at_most(fabs((double)o.wheelset[0].y_m), 3e-3);
        unbuild(&b);
    }
}

/* The mirror image moves as the mirror image, to the last bit. */
static void it_is_symmetric(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    struct kl_state x[2];
    wagon(&v, s1002_uic60());
    v.wheelset[0].independent = 1;
    build(&v, &b);
    for (int k = 0; k < 2; k++) {
        const kl_real sign = k == 0 ? 1 : -1;
        assert_int_equal(kl_init(&b.model, &x[k], 0, 30, work()), KL_OK);
        wheelset_x(&b.model, &x[k], 0)[KL_WS_Y] = sign * (kl_real)6e-3;
        *twist_of(&b.model, &x[k], 0) = sign * (kl_real)0.3;
        kl_refresh(&b.model, &x[k], work());
        (void)coast(&b.model, &x[k], 3000, NULL);
    }
    const kl_real *a = wheelset_x(&b.model, &x[0], 0);
    const kl_real *c = wheelset_x(&b.model, &x[1], 0);
    assert_true(a[KL_WS_Y] == -c[KL_WS_Y] && a[KL_WS_YAW] == -c[KL_WS_YAW]);
    assert_true(a[KL_WS_SPIN] == c[KL_WS_SPIN]);
    assert_true(*twist_of(&b.model, &x[0], 0) == -*twist_of(&b.model, &x[1], 0));
    unbuild(&b);
}

/* Without creep and dampers nothing is lost; either wheel's own energy is in the sum. */
static void its_energy_is_known(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    struct kl_state x;
    one_wheelset(&v, CONICITY, 1e6, 1e6);
    set_going(&v, &b, 10, &x);
    const double before = (double)kl_energy(&b.model, &x, work());
    *twist_of(&b.model, &x, 0) = 3;
    const double after = (double)kl_energy(&b.model, &x, work());
    assert_near(after - before, 2.0 * 0.5 * (0.5 * SPIN) * 9.0, 1e-6);
    unbuild(&b);
}

static void a_snapshot_goes_on(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    struct kl_state x;
    struct kl_state y;
    struct kl_input input;
    wagon(&v, s1002_uic60());
    v.wheelset[1].independent = 1;
    set_going(&v, &b, 30, &x);
    wheelset_x(&b.model, &x, 1)[KL_WS_Y] = (kl_real)3e-3;
    kl_refresh(&b.model, &x, work());
    kl_input_init(&input);
    input.speed_m_s = 30;
    go_on_from_snapshot(&b, &input, 700, &x, &y);
    assert_true(*twist_of(&b.model, &x, 1) != 0);
    *twist_of(&b.model, &y, 1) += (kl_real)1e-9;
    assert_true(kl_state_hash(&x) != kl_state_hash(&y));
    unbuild(&b);
}

static void bad_torques_are_said(void **state) {
    (void)state;
    const double bad[] = {2e6, -2e6, (double)NAN, (double)INFINITY};
    for (size_t i = 0; i < 2 * COUNT(bad); i++) {
        struct vehicle v;
        struct built b;
        struct kl_state x;
        struct kl_input input;
        one_wheelset(&v, CONICITY, 1e6, 1e6);
        v.wheelset[0].independent = i % 2 == 0;
        set_going(&v, &b, 10, &x);
        kl_input_init(&input);
        input.speed_m_s = 10;
        input.twist_torque_Nm[0] = (kl_real)bad[i / 2];
        const uint32_t faults = kl_step(&b.model, &x, &input, NULL, work());
        assert_int_equal(faults & (uint32_t)KL_FAULT_INPUT,
                         i % 2 == 0 ? (uint32_t)KL_FAULT_INPUT : 0u);
        unbuild(&b);
    }
}

static void bad_definitions_are_refused(void **state) {
    (void)state;
    const double bad[] = {-1.0, (double)NAN, 1e10};
    for (size_t i = 0; i < COUNT(bad) + 1; i++) {
        struct vehicle v;
        struct kl_model model;
        struct kl_diag diag;
        struct memory memory = take_memory(1u << 20);
        one_wheelset(&v, CONICITY, 1e6, 1e6);
        v.wheelset[0].coupling_Nms_rad = i < COUNT(bad) ? bad[i] : 1.0;
        v.wheelset[0].independent = i < COUNT(bad);
        assert_int_equal(kl_build(&v.def, &memory.arena, &model, &diag), KL_ERR_VALUE);
        assert_int_equal(diag.index, 0);
        assert_non_null(strstr(diag.what, "coupling_Nms_rad"));
        give_memory(&memory);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_has_one_state_more),
        cmocka_unit_test(it_moves_as_the_equations_say),
        cmocka_unit_test(it_does_not_hunt),
        cmocka_unit_test(a_curve_does_not_steer_it),
        cmocka_unit_test(opposite_torques_steer_it),
        cmocka_unit_test(contact_angles_centre_it),
        cmocka_unit_test(a_stiff_coupling_makes_it_solid),
        cmocka_unit_test(it_is_stable_at_any_speed),
        cmocka_unit_test(it_is_symmetric),
        cmocka_unit_test(its_energy_is_known),
        cmocka_unit_test(a_snapshot_goes_on),
        cmocka_unit_test(bad_torques_are_said),
        cmocka_unit_test(bad_definitions_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
