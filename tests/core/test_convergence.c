/* Order of the integrator, and stability at 1 ms from standstill to full speed. */
#include "fixtures.h"

/* ---- order ---- */

/* 2 s through a transition, from rest relative to the track; the state at the end. */
static void final_state(struct vehicle *v, int64_t step_ns, double speed, struct kl_state *x) {
    struct built b;
    v->def.step_ns = step_ns;
    build(v, &b);
    assert_int_equal(kl_init(&b.model, x, 30, (kl_real)speed, work()), KL_OK);
    wheelset_x(&b.model, x, 0)[KL_WS_Y] = (kl_real)5e-4;
    kl_refresh(&b.model, x, work());
    assert_int_equal(coast(&b.model, x, (uint64_t)(2000000000 / step_ns), NULL), 0);
    unbuild(&b);
}

/* Root of the squares of all differences, each state scaled by its own size in the finest run. */
static double distance(const struct kl_state *a, const struct kl_state *fine) {
    double sum = 0.0;
    for (uint32_t i = 0; i < a->n_states; i++) {
        const double scale = fabs((double)fine->x[i]) + 1e-6;
        const double d = (double)(a->x[i] - fine->x[i]) / scale;
        sum += d * d;
    }
    return sqrt(sum / a->n_states);
}

static void order_of(struct vehicle *v, const char *what, double speed, double least) {
    static const int64_t steps[] = {2000000, 1000000, 500000, 250000};
    struct kl_state fine;
    struct kl_state x;
    double error[COUNT(steps)];
    final_state(v, 15625, speed, &fine);
    for (size_t i = 0; i < COUNT(steps); i++) {
        final_state(v, steps[i], speed, &x);
        error[i] = distance(&x, &fine);
    }
    const double order = log2(error[1] / error[3]) / 2.0;
    print_message("%s at %g m/s: error %.2e at 2 ms, %.2e at 1 ms, %.2e at 0.5 ms, %.2e at 0.25 ms;"
                  " order %.2f\n",
                  what, speed, error[0], error[1], error[2], error[3], order);
    assert_true(order > least);
    assert_true(error[1] < error[0] && error[2] < error[1] && error[3] < error[2]);
}

static void halving_the_step_quarters_the_error(void **state) {
    (void)state;
    struct vehicle v;
    single_wheelset(&v, arcs_pair(KL_KINEMATICS_RIGID), 1e6, 1e6);
    v.wheelset[0].load_N = 1e5;
    v.pair[0].step_m = 2e-5;
    one_curve(&v, KL_RAMP_HALF_SINE, 0.0008, 0.04);
    order_of(&v, "wheelset", 20.0, 1.8);
    wagon(&v, arcs_pair(KL_KINEMATICS_RIGID));
    v.pair[0].step_m = 2e-5;
    v.pair[0].range_m = 0.012;
    one_curve(&v, KL_RAMP_HALF_SINE, 0.0008, 0.04);
    order_of(&v, "wagon", 20.0, 1.8);
    wagon(&v, linear_pair(0.1));
    one_curve(&v, KL_RAMP_HALF_SINE, 0.0008, 0.04);
    order_of(&v, "wagon on the linear pair", 20.0, 1.8);
}

/* ---- stability at 1 ms ---- */

static double largest_y(const struct kl_model *m, struct kl_state *x) {
    double largest = 0.0;
    for (uint32_t w = 0; w < m->n_wheelsets; w++) {
        largest = fmax(largest, fabs((double)wheelset_x(m, x, w)[KL_WS_Y]));
    }
    return largest;
}

/* A wagon that is stable by itself: stiffer yaw of the axles, low conicity. */
static void stable_wagon(struct vehicle *v, double speed, struct built *b, struct kl_state *x) {
    wagon(v, linear_pair(0.02));
    for (int i = 0; i < 4; i++) {
        v->element[i].k[0] = 1e7;
        v->element[i].c[0] = 1e5;
        v->element[i].c[1] = 4e4;
    }
    v->def.acceleration_limit_m_s2 = 2.0;
    build(v, b);
    assert_int_equal(kl_init(&b->model, x, 0, (kl_real)speed, work()), KL_OK);
    for (uint32_t w = 0; w < 2; w++) {
        wheelset_x(&b->model, x, w)[KL_WS_Y] = (kl_real)2e-3;
    }
    kl_refresh(&b->model, x, work());
}

/* Slow, the creep is stiff: 2 f22/(m V) is 20 000 1/s at 0.5 m/s. Fast, it is all inertia. */
static void slow_and_fast(void **state) {
    (void)state;
    const double speeds[] = {0.01, 0.1, 0.5, 2.0, 10.0, 40.0, 100.0, 120.0};
    for (size_t i = 0; i < COUNT(speeds); i++) {
        struct vehicle v;
        struct built b;
        struct kl_state x;
        stable_wagon(&v, speeds[i], &b, &x);
        double early = 0.0;
        double late = 0.0;
        for (int n = 0; n < 20000; n++) {
            assert_int_equal(coast(&b.model, &x, 1, NULL), 0);
            const double y = largest_y(&b.model, &x);
            early = n < 10000 ? fmax(early, y) : early;
            late = n >= 10000 ? fmax(late, y) : late;
        }
        print_message("%g m/s: largest y %.3f mm, after 10 s %.3f mm\n", speeds[i], 1e3 * early,
                      1e3 * late);
        assert_at_most(early, 4e-3);
        assert_at_most(late, early * (1.0 + 1e-9));
        unbuild(&b);
    }
}

/* At rest contact is a stiff damper: what swings comes to rest in seconds, and what is left pulls
 * the wheelsets back at microns a second. */
static void standstill(void **state) {
    (void)state;
    struct kl_pair_def pairs[3] = {arcs_pair(KL_KINEMATICS_RIGID), s1002_uic60(), linear_pair(0.1)};
    for (int i = 0; i < 3; i++) {
        struct vehicle v;
        struct built b;
        struct kl_state x;
        kl_real rates[KL_MAX_STATES];
        struct kl_input input;
        wagon(&v, pairs[i]);
        build(&v, &b);
        assert_int_equal(kl_init(&b.model, &x, 0, 0, work()), KL_OK);
        wheelset_x(&b.model, &x, 0)[KL_WS_Y] = (kl_real)2e-3;
        wheelset_x(&b.model, &x, 1)[KL_WS_YAW] = (kl_real)1e-3;
        x.x[kl_body_state_index(&b.model, 0, KL_ROLL, 0)] = (kl_real)0.01;
        kl_refresh(&b.model, &x, work());
        assert_int_equal(coast(&b.model, &x, 60000, NULL), 0);
        kl_input_init(&input);
        kl_rates(&b.model, &x, &input, rates, work());
        for (uint32_t k = 0; k < x.n_states; k++) {
            assert_near((double)rates[k], 0.0, 1e-3);
        }
        for (uint32_t w = 0; w < 2; w++) {
            const int32_t y = kl_wheelset_state_index(&b.model, w, KL_WS_Y);
            assert_near((double)rates[y], 0.0, 2e-5);
            assert_near((double)rates[y + 1], 0.0, 2e-5);
        }
        assert_true(x.s_m == 0);
        unbuild(&b);
    }
}

/* 0 to 120 m/s and back to a stand on one state. */
static void the_full_range_of_speed(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    struct kl_state x;
    struct kl_input input;
    stable_wagon(&v, 0.0, &b, &x);
    kl_input_init(&input);
    double largest = 0.0;
    for (int n = 0; n < 125000; n++) {
        input.speed_m_s = n < 62000 ? 120 : 0;
        assert_int_equal(kl_step(&b.model, &x, &input, NULL, work()), 0);
        largest = fmax(largest, largest_y(&b.model, &x));
        if (n == 61000) {
            assert_true(x.speed_m_s == 120);
            assert_near((double)wheelset_x(&b.model, &x, 0)[KL_WS_SPIN], 120.0 / ARCS_R0, 0.01);
        }
    }
    assert_true(x.speed_m_s == 0);
    assert_near((double)wheelset_x(&b.model, &x, 0)[KL_WS_SPIN], 0.0, 1e-6);
    assert_at_most(largest, 4e-3);
    unbuild(&b);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(halving_the_step_quarters_the_error),
        cmocka_unit_test(slow_and_fast),
        cmocka_unit_test(standstill),
        cmocka_unit_test(the_full_range_of_speed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
