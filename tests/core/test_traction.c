/* Starting and braking: creep forces are what the axle's inertia asks for, and do not chatter. */
#include "fixtures.h"

/* Largest |T1| and its changes of sign above 1 kN while the speed goes to `target`. */
static void drive(const struct kl_model *m, struct kl_state *x, double target, double seconds,
                  double *largest, int *flips) {
    struct kl_input input;
    struct kl_output o;
    double last = 0.0;
    kl_input_init(&input);
    input.speed_m_s = (kl_real)target;
    *largest = 0.0;
    *flips = 0;
    for (int n = 0; n < (int)(1000.0 * seconds); n++) {
        assert_int_equal(kl_step(m, x, &input, &o, work()), 0);
        const double t1 = (double)o.wheelset[0].tread.t1_N[KL_RIGHT];
        *flips += t1 * last < 0.0 && fabs(t1) > 1000.0 ? 1 : 0;
        *largest = n < 100 ? 0.0 : fmax(*largest, fabs(t1));
        last = t1;
    }
}

/* I_y a/r^2 over two wheels: 235 N at 1 m/s2. At rest nothing is left of it. */
static void starting_and_braking_do_not_chatter(void **state) {
    (void)state;
    const double acceleration[] = {0.2, 0.5, 1.0, 2.0};
    for (size_t i = 0; i < COUNT(acceleration); i++) {
        struct vehicle v;
        struct built b;
        struct kl_state x;
        struct kl_output o;
        double up;
        double down;
        int flips_up;
        int flips_down;
        wagon(&v, linear_pair(0.02));
        v.def.acceleration_limit_m_s2 = acceleration[i];
        build(&v, &b);
        assert_int_equal(kl_init(&b.model, &x, 0, 0, work()), KL_OK);
        drive(&b.model, &x, 8.0, 10.0 / acceleration[i], &up, &flips_up);
        drive(&b.model, &x, 0.0, 7.5 / acceleration[i], &down, &flips_down);
        const double need = 0.5 * 100.0 * acceleration[i] / (ARCS_R0 * ARCS_R0);
        print_message(
            "%g m/s2 needs %.0f N: up to %.0f N starting, %.0f N braking, %d and %d flips\n",
            acceleration[i], need, up, down, flips_up, flips_down);
        assert_int_equal(flips_up + flips_down, 0);
        assert_at_most(up, 1.5 * need);
        assert_at_most(down, 1.5 * need);
        drive(&b.model, &x, 0.0, 5.0, &down, &flips_down);
        assert_int_equal(coast(&b.model, &x, 1, &o), 0);
        assert_near((double)o.wheelset[0].tread.t1_N[KL_RIGHT], 0.0, 1.0);
        assert_near((double)wheelset_x(&b.model, &x, 0)[KL_WS_SPIN], 0.0, 1e-6);
        unbuild(&b);
    }
}

/* A kick that makes the wheels slide is over in milliseconds, at whatever speed. */
static void a_slide_ends(void **state) {
    (void)state;
    const double speed[] = {0.0, 0.05, 0.3, 1.0, 3.0, 10.0};
    for (size_t i = 0; i < COUNT(speed); i++) {
        struct vehicle v;
        struct built b;
        struct kl_state x;
        struct kl_output o;
        wagon(&v, linear_pair(0.02));
        build(&v, &b);
        assert_int_equal(kl_init(&b.model, &x, 0, (kl_real)speed[i], work()), KL_OK);
        kl_real *spin = &wheelset_x(&b.model, &x, 0)[KL_WS_SPIN];
        *spin += (kl_real)0.5;
        double left = 0.0;
        for (int n = 0; n < 500; n++) {
            assert_int_equal(coast(&b.model, &x, 1, &o), 0);
            left = n < 200 ? 0.0 : fmax(left, fabs((double)o.wheelset[0].tread.t1_N[KL_RIGHT]));
        }
        print_message("%g m/s: T1 after 0.2 s %.3g N\n", speed[i], left);
        assert_at_most(left, 1.0);
        assert_near((double)*spin, speed[i] / ARCS_R0, 1e-6);
        unbuild(&b);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(starting_and_braking_do_not_chatter),
        cmocka_unit_test(a_slide_ends),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
