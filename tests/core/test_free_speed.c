/*
 * The speed as a freedom of the train. Expected values: the equation of motion of a train, M V' = F -
 * R(V) with M the mass and the inertia of what rolls, and its closed solutions; Coulomb's limit; the
 * balance of momentum and of power.
 */
#include "fixtures.h"

#define R0 ARCS_R0
#define MASS (37200.0 + 2.0 * 1400.0)
#define SPIN 100.0
#define ROLLING (MASS + 2.0 * SPIN / (R0 * R0))

static void free_wagon(struct vehicle *v, double a, double b, double c) {
    wagon(v, linear_pair(0.1));
    v->def.running.free = 1;
    v->def.running.resistance_N = a;
    v->def.running.resistance_Ns_m = b;
    v->def.running.resistance_Ns2_m2 = c;
}

static struct kl_input input_of(double torque_0, double torque_1, double draw) {
    struct kl_input input;
    kl_input_init(&input);
    input.axle_torque_Nm[0] = (kl_real)torque_0;
    input.axle_torque_Nm[1] = (kl_real)torque_1;
    input.draw_force_N = (kl_real)draw;
    return input;
}

static void it_knows_the_masses(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    free_wagon(&v, 600.0, 0.0, 0.0);
    build(&v, &b);
    assert_near((double)b.model.running.mass_kg, MASS, 1e-9 * MASS);
    assert_near((double)b.model.running.rolling_kg, ROLLING, 1e-6 * MASS);
    assert_int_equal(kl_model_check(&b.model), KL_OK);
    const uint64_t hash = b.model.hash;
    unbuild(&b);
    v.def.running.resistance_N = 601.0;
    build(&v, &b);
    assert_true(b.model.hash != hash);
    unbuild(&b);
}

/* Error of V after 60 s from 25 m/s. A and C: sqrt(A/C) tan(atan(V0 sqrt(C/A)) - t sqrt(A C)/M); A and
 * B: (V0 + A/B) exp(-B t/M) - A/B. */
static double coasting_error(double a, double b, double c, int64_t step_ns) {
    struct vehicle v;
    struct built built;
    struct kl_state x;
    struct kl_output o;
    const struct kl_input none = input_of(0.0, 0.0, 0.0);
    const double t = 60.0;
    free_wagon(&v, a, b, c);
    v.def.step_ns = step_ns;
    set_going(&v, &built, 25.0, &x);
    run(&built, &x, &none, (int)(t / (1e-9 * (double)step_ns) + 0.5), &o);
    unbuild(&built);
    const double want =
        c > 0.0 ? sqrt(a / c) * tan(atan(25.0 * sqrt(c / a)) - t * sqrt(a * c) / ROLLING)
                : (25.0 + a / b) * exp(-b * t / ROLLING) - a / b;
    return fabs((double)x.speed_m_s - want);
}

static void coasting_follows_the_closed_solutions(void **state) {
    (void)state;
    const double resistance[][3] = {{600.0, 0.0, 25.0}, {600.0, 1500.0, 0.0}};
    for (size_t i = 0; i < COUNT(resistance); i++) {
        const double *r = resistance[i];
        const double coarse = coasting_error(r[0], r[1], r[2], 10000000);
        const double fine = coasting_error(r[0], r[1], r[2], 1000000);
        print_message("off by %.2e m/s at 10 ms, %.2e at 1 ms\n", coarse, fine);
        assert_at_most(coarse, 1e-5);
        assert_at_most(fine, 1e-6); /* what the wheels' slip has of the momentum */
    }
}

/* Without forces nothing changes. */
static void it_rolls_on(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    struct kl_state x;
    struct kl_output o;
    const struct kl_input none = input_of(0.0, 0.0, 0.0);
    free_wagon(&v, 0.0, 0.0, 0.0);
    set_going(&v, &b, 30.0, &x);
    run(&b, &x, &none, 20000, &o);
    assert_near((double)x.speed_m_s, 30.0, 1e-9);
    assert_near((double)x.s_m, 600.0, 1e-6);
    assert_near((double)o.acceleration_m_s2, 0.0, 1e-9);
    unbuild(&b);
}

static double momentum(const struct kl_model *m, struct kl_state *x) {
    double p = MASS * (double)x->speed_m_s;
    for (uint32_t w = 0; w < 2; w++) {
        p += SPIN / R0 * (double)wheelset_x(m, x, w)[KL_WS_SPIN];
    }
    return p;
}

/* Torques, pulls and bad rails as they come: creep forces are inner forces, whether they slide or
 * not. What comes in over a step is the mean of its two ends. */
static void momentum_is_kept(void **state) {
    (void)state;
    for (int independent = 0; independent < 2; independent++) {
        struct vehicle v;
        struct built b;
        struct kl_state x;
        uint64_t seed = 7;
        free_wagon(&v, 0.0, 0.0, 0.0);
        v.wheelset[0].independent = independent;
        set_going(&v, &b, 15.0, &x);
        double before = 0.0;
        double p = momentum(&b.model, &x);
        double largest = 0.0;
        for (int n = 0; n < 5000; n++) {
            struct kl_input input =
                input_of(random_between(&seed, -40e3, 40e3), random_between(&seed, -20e3, 20e3),
                         random_between(&seed, -20e3, 20e3));
            input.friction_factor[1][0] = (kl_real)random_between(&seed, 0.05, 1.0);
            input.friction_factor[1][1] = input.friction_factor[1][0];
            const double now = (double)input.draw_force_N +
                               (double)(input.axle_torque_Nm[0] + input.axle_torque_Nm[1]) / R0;
            assert_int_equal(kl_step(&b.model, &x, &input, NULL, work()), 0);
            p += 1e-3 * 0.5 * (before + now);
            before = now;
            largest = fmax(largest, fabs(momentum(&b.model, &x) - p));
        }
        print_message("momentum %.6g kg m/s, off by %.2e\n", p, largest);
        assert_at_most(largest, 1e-9 * p);
        unbuild(&b);
    }
}

/* From a stand to 30 m/s at constant torque: V = F t/M, less half a step for the input that begins;
 * the wheels slip by what their share of the force asks of f11. */
static void torque_accelerates(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    struct kl_state x;
    struct kl_output o;
    const struct kl_input input = input_of(9000.0, 9000.0, 0.0);
    const double force = 2.0 * 9000.0 / R0;
    free_wagon(&v, 0.0, 0.0, 0.0);
    v.wheelset[0].creep = constant_creep();
    v.wheelset[1].creep = constant_creep();
    set_going(&v, &b, 0.0, &x);
    run(&b, &x, &input, 30000, &o);
    const double a = force / ROLLING;
    assert_near((double)x.speed_m_s, a * (30.0 - 0.0005), 1e-3 * a);
    assert_near((double)o.acceleration_m_s2, a, 1e-4 * a); /* slip grows with V */
    const double t1 = (9000.0 - SPIN * a / R0) / R0 / 2.0;
    assert_near((double)o.wheelset[0].tread.t1_N[KL_RIGHT], t1, 1e-3 * t1);
    const double slip = 1.0 - (double)o.wheelset[0].spin_rad_s * R0 / (double)x.speed_m_s;
    assert_near(slip, -t1 / 7.44e6, 1e-3 * t1 / 7.44e6);
    unbuild(&b);
}

/* More torque than the rail bears: the effort is mu N, whatever the torque, and no more than that
 * goes into the train; when the torque ends the wheels come back to rolling. */
static void adhesion_limits_the_effort(void **state) {
    (void)state;
    const double factor[] = {1.0, 0.5, 0.2};
    for (size_t i = 0; i < COUNT(factor); i++) {
        struct vehicle v;
        struct built b;
        struct kl_state x;
        struct kl_output o;
        struct kl_input input = input_of(60e3, 60e3, 0.0);
        free_wagon(&v, 0.0, 0.0, 0.0);
        set_going(&v, &b, 5.0, &x);
        for (int w = 0; w < 2; w++) {
            input.friction_factor[w][KL_RIGHT] = (kl_real)factor[i];
            input.friction_factor[w][KL_LEFT] = (kl_real)factor[i];
        }
        const double limit = 0.3 * factor[i] * MASS * 9.81;
        run(&b, &x, &input, 1000, &o);
        const double v1 = (double)x.speed_m_s;
        double effort = 0.0;
        for (int w = 0; w < 2; w++) {
            for (int s = 0; s < KL_SIDES; s++) {
                effort += (double)o.wheelset[w].tread.t1_N[s];
            }
        }
        run(&b, &x, &input, 1000, &o);
        print_message("mu x %g: effort %.1f of %.1f N, V' %.5f m/s2\n", factor[i], effort, limit,
                      (double)x.speed_m_s - v1);
        assert_near(effort, limit, 2e-3 * limit);
        assert_near((double)x.speed_m_s - v1, limit / MASS, 2e-3 * limit / MASS);
        assert_true((double)o.wheelset[0].spin_rad_s * R0 > 1.5 * (double)x.speed_m_s);
        const struct kl_input none = input_of(0.0, 0.0, 0.0);
        run(&b, &x, &none, 25000, &o);
        assert_near((double)o.wheelset[0].spin_rad_s * R0, (double)x.speed_m_s, 1e-4);
        unbuild(&b);
    }
}

/* Braked to a stand: V^2/2a of way; it stands still, and stays so under the brake's torque. */
static void braking_ends_in_rest(void **state) {
    (void)state;
    const double torque[] = {200.0, 2000.0, 15e3, 25e3};
    for (size_t i = 0; i < COUNT(torque); i++) {
        struct vehicle v;
        struct built b;
        struct kl_state x;
        struct kl_output o;
        const struct kl_input input = input_of(-torque[i], -torque[i], 0.0);
        const double a = 2.0 * torque[i] / R0 / ROLLING;
        free_wagon(&v, 0.0, 0.0, 0.0);
        set_going(&v, &b, 3.0, &x);
        double last = 3.0;
        int flips = 0;
        double t1 = 0.0;
        for (int n = 0; n < (int)(1000.0 * (3.0 / a + 2.0)); n++) {
            run(&b, &x, &input, 1, &o);
            assert_true((double)x.speed_m_s >= 0.0 && (double)x.speed_m_s <= last + 1e-9);
            flips += t1 * (double)o.wheelset[0].tread.t1_N[0] < 0.0;
            t1 = (double)o.wheelset[0].tread.t1_N[0];
            last = (double)x.speed_m_s;
        }
        print_message("%g N m: %.4f m of way, wanted %.4f; %d flips\n", torque[i], (double)x.s_m,
                      9.0 / (2.0 * a), flips);
        assert_true(x.speed_m_s == 0 && o.acceleration_m_s2 == 0);
        assert_near((double)x.s_m, 9.0 / (2.0 * a), 0.01 + 2e-3 * 9.0 / a);
        assert_int_equal(flips, 0);
        unbuild(&b);
    }
}

/* At rest the constant resistance holds up to its size, and takes its part beyond. */
static void resistance_holds_at_rest(void **state) {
    (void)state;
    const double pulls[] = {-5e5, -100.0, 0.0, 599.0, 601.0, 5000.0};
    for (size_t i = 0; i < COUNT(pulls); i++) {
        struct vehicle v;
        struct built b;
        struct kl_state x;
        struct kl_output o;
        const struct kl_input input = input_of(0.0, 0.0, pulls[i]);
        free_wagon(&v, 600.0, 0.0, 0.0);
        set_going(&v, &b, 0.0, &x);
        run(&b, &x, &input, 5000, &o);
        const double a = fmax(pulls[i] - 600.0, 0.0) / ROLLING;
        assert_near((double)x.speed_m_s, 5.0 * a, 1e-3 * a);
        assert_true(a > 0.0 || (x.speed_m_s == 0 && x.s_m == 0));
        unbuild(&b);
    }
}

/* Wheels that turn at wrong speeds come back to rolling at any speed of the train. */
static void it_is_stable_at_any_speed(void **state) {
    (void)state;
    const double speed[] = {0.0, 0.02, 0.1, 0.3, 1.0, 3.0, 10.0, 40.0, 120.0};
    for (size_t i = 0; i < COUNT(speed); i++) {
        struct vehicle v;
        struct built b;
        struct kl_state x;
        struct kl_output o;
        const struct kl_input none = input_of(0.0, 0.0, 0.0);
        free_wagon(&v, 0.0, 0.0, 0.0);
        set_going(&v, &b, speed[i], &x);
        wheelset_x(&b.model, &x, 0)[KL_WS_SPIN] += (kl_real)2;
        wheelset_x(&b.model, &x, 1)[KL_WS_SPIN] += (kl_real)0.5;
        kl_refresh(&b.model, &x, work());
        run(&b, &x, &none, 3000, &o);
        const double want = speed[i] + 2.5 * SPIN / R0 / ROLLING;
        print_message("%g m/s: %.9f, wanted %.9f\n", speed[i], (double)x.speed_m_s, want);
        assert_near((double)x.speed_m_s, want, 1e-4);
        for (int w = 0; w < 2; w++) {
            assert_near((double)o.wheelset[w].tread.t1_N[KL_RIGHT], 0.0, 1.0);
            assert_near((double)o.wheelset[w].spin_rad_s * R0, (double)x.speed_m_s, 1e-4);
        }
        unbuild(&b);
    }
}

/* The same start, run and stop with a tenth of the step. */
static void the_step_does_not_matter(void **state) {
    (void)state;
    double s[2];
    for (int k = 0; k < 2; k++) {
        struct vehicle v;
        struct built b;
        struct kl_state x;
        const int per_second = k == 0 ? 1000 : 10000;
        const struct kl_input drive = input_of(20e3, 5e3, -1000.0);
        const struct kl_input brake = input_of(-8e3, -8e3, 2000.0);
        free_wagon(&v, 600.0, 20.0, 3.0);
        v.def.step_ns = 1000000000 / per_second;
        set_going(&v, &b, 0.0, &x);
        run(&b, &x, &drive, 20 * per_second, NULL);
        run(&b, &x, &brake, 60 * per_second, NULL);
        assert_true(x.speed_m_s == 0);
        s[k] = (double)x.s_m;
        unbuild(&b);
    }
    print_message("%.5f m at 1 ms, %.5f at 0.1 ms\n", s[0], s[1]);
    assert_near(s[0], s[1], 1e-4 * s[1]);
}

/* In a curve creep takes power, T1 gamma1 + T2 gamma2 + M3 omega3, and the train gives it; but for what
 * M3 takes about the axle, M3 Omega sin(delta), which the wheelset's equations leave out. */
static void a_curve_brakes(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    struct kl_state x;
    struct kl_output o;
    const struct kl_input none = input_of(0.0, 0.0, 0.0);
    wagon(&v, s1002_uic60());
    v.def.running.free = 1;
    v.track.curvature_start_1_m = 1.0 / 500.0;
    v.track.cant_start_rad = 0.08;
    set_going(&v, &b, 19.8, &x);
    run(&b, &x, &none, 15000, &o);
    double power = 0.0;
    double lost = 0.0;
    const double v0 = (double)x.speed_m_s;
    for (int n = 0; n < 4000; n++) {
        run(&b, &x, &none, 1, &o);
        const double at = (double)x.speed_m_s;
        power = 0.0;
        for (int w = 0; w < 2; w++) {
            const struct kl_contact_output *contact[2] = {&o.wheelset[w].tread,
                                                          &o.wheelset[w].flange};
            for (int c = 0; c < 2 * KL_SIDES; c++) {
                const struct kl_contact_output *t = contact[c / 2];
                const int side = c % 2;
                power += at * ((double)t->t1_N[side] * (double)t->gamma1[side] +
                               (double)t->t2_N[side] * (double)t->gamma2[side] +
                               (double)t->m3_Nm[side] * (double)t->omega3_1_m[side]) +
                         (side == KL_RIGHT ? 1.0 : -1.0) *
                             (double)(t->m3_Nm[side] * o.wheelset[w].spin_rad_s) *
                             sin((double)t->delta_rad[side]);
            }
        }
        lost += 1e-3 * power;
    }
    const double m = MASS + 2.0 * SPIN / (0.46 * 0.46);
    const double energy = 0.5 * m * ((double)x.speed_m_s * (double)x.speed_m_s - v0 * v0);
    print_message("creep takes %.1f W, force %.0f N; energy %.1f J, creep %.1f J\n", -power,
                  -power / v0, energy, lost);
    assert_true(power < -1000.0);
    assert_near(energy, lost, 0.01 * fabs(lost));
    unbuild(&b);
}

static void it_stays_in_its_range(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    struct kl_state x;
    const struct kl_input input = input_of(0.0, 0.0, 1e6);
    free_wagon(&v, 0.0, 0.0, 0.0);
    set_going(&v, &b, 149.0, &x);
    uint32_t faults = 0;
    for (int n = 0; n < 200; n++) {
        faults = kl_step(&b.model, &x, &input, NULL, work());
    }
    assert_int_equal(faults, KL_FAULT_INPUT);
    assert_true(x.speed_m_s == (kl_real)KL_MAX_SPEED_M_S);
    const struct kl_input back = input_of(0.0, 0.0, -1e5);
    for (int n = 0; n < 1000; n++) {
        (void)kl_step(&b.model, &x, &back, NULL, work());
    }
    assert_near((double)x.speed_m_s, 150.0 - 1e5 / ROLLING, 0.01);
    unbuild(&b);
}

/* Whatever acts is looked at: pulls of a free speed, actuators; what does not act is not. */
static void bad_inputs_are_said(void **state) {
    (void)state;
    const double bad[] = {2e8, -2e8, (double)NAN, (double)INFINITY};
    for (size_t i = 0; i < COUNT(bad); i++) {
        for (int runs_free = 0; runs_free < 2; runs_free++) {
            struct vehicle v;
            struct built b;
            struct kl_state x;
            struct kl_input input = input_of(0.0, 0.0, bad[i]);
            free_wagon(&v, 0.0, 0.0, 0.0);
            v.def.running.free = runs_free;
            v.element[0].along = KL_ALONG_Y;
            v.element[0].actuator = 1;
            set_going(&v, &b, 10.0, &x);
            input.speed_m_s = 10;
            assert_int_equal(kl_step(&b.model, &x, &input, NULL, work()),
                             runs_free ? KL_FAULT_INPUT : 0);
            kl_clear_faults(&x);
            input.draw_force_N = 0;
            assert_int_equal(kl_step(&b.model, &x, &input, NULL, work()), 0);
            input.actuator_N[0] = (kl_real)bad[i];
            assert_true((kl_step(&b.model, &x, &input, NULL, work()) & (uint32_t)KL_FAULT_INPUT) !=
                        0);
            assert_true(isfinite((double)x.speed_m_s));
            unbuild(&b);
        }
    }
}

static void bad_definitions_are_refused(void **state) {
    (void)state;
    const double bad[] = {-1.0, (double)NAN, 1e9, 5.0};
    for (size_t i = 0; i < 3 * COUNT(bad); i++) {
        struct vehicle v;
        struct kl_model model;
        struct kl_diag diag;
        struct memory memory = take_memory(1u << 20);
        const double value = bad[i / 3];
        free_wagon(&v, i % 3 == 0 ? value : 0.0, i % 3 == 1 ? value : 0.0,
                   i % 3 == 2 ? value : 0.0);
        v.def.running.free = i / 3 < 3;
        assert_int_equal(kl_build(&v.def, &memory.arena, &model, &diag), KL_ERR_VALUE);
        assert_non_null(strstr(diag.what, "running resistance"));
        give_memory(&memory);
    }
}

static void a_snapshot_goes_on(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    struct kl_state x;
    struct kl_state y;
    const struct kl_input input = input_of(5000.0, -1000.0, 300.0);
    free_wagon(&v, 600.0, 0.0, 2.5);
    set_going(&v, &b, 10.0, &x);
    go_on_from_snapshot(&b, &input, 777, &x, &y);
    assert_true(x.speed_rate_m_s2 != 0 && x.speed_rate_m_s2 == y.speed_rate_m_s2);
    y.speed_rate_m_s2 *= 2;
    assert_true(kl_state_hash(&x) != kl_state_hash(&y));
    unbuild(&b);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_knows_the_masses),
        cmocka_unit_test(coasting_follows_the_closed_solutions),
        cmocka_unit_test(it_rolls_on),
        cmocka_unit_test(momentum_is_kept),
        cmocka_unit_test(torque_accelerates),
        cmocka_unit_test(adhesion_limits_the_effort),
        cmocka_unit_test(braking_ends_in_rest),
        cmocka_unit_test(resistance_holds_at_rest),
        cmocka_unit_test(it_is_stable_at_any_speed),
        cmocka_unit_test(the_step_does_not_matter),
        cmocka_unit_test(a_curve_brakes),
        cmocka_unit_test(it_stays_in_its_range),
        cmocka_unit_test(bad_inputs_are_said),
        cmocka_unit_test(bad_definitions_are_refused),
        cmocka_unit_test(a_snapshot_goes_on),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
