/*
 * test_cycle.c - following limit cycles, on the normal form of a Hopf bifurcation with hard loss of
 * stability (Guckenheimer, Holmes: Nonlinear Oscillations, Dynamical Systems, and Bifurcations of
 * Vector Fields, 3.4, one order on):
 *     r' = r (p + r^2 - r^4),  phase' = 1 turn/s
 * Rest is stable for p < 0. Cycles: r^2 = (1 +- sqrt(1 + 4 p))/2, + stable, - unstable; they meet
 * in the fold at p = -1/4, r = sqrt(1/2).
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "cycle.h"

#define TURN 6.283185307179586
#define STEP 2e-3

struct hopf {
    double p;
    double r;
    double phase;
};

static double rate(const struct hopf *h, double r) {
    double r2 = r * r;
    return r * (h->p + r2 - r2 * r2);
}

/* Observed beside the middle, so that the mean has something to find. */
static bool advance(void *context, void *state, double *observed) {
    struct hopf *h = state;
    double k1 = rate(h, h->r);
    double k2 = rate(h, h->r + 0.5 * STEP * k1);
    (void)context;
    h->r += STEP * k2;
    h->phase += TURN * STEP;
    *observed = 0.1 + h->r * sin(h->phase);
    return h->r < 10.0;
}

static void retune(void *context, void *state, double parameter) {
    (void)context;
    ((struct hopf *)state)->p = parameter;
}

static void scale(void *context, void *out, const void *state, double share) {
    struct hopf *to = out;
    (void)context;
    *to = *(const struct hopf *)state;
    to->r *= share;
}

static struct hopf scratch;
static const struct cycle_system hopf = {NULL, sizeof(struct hopf), &scratch, STEP, advance, retune,
                                         scale};
static const struct cycle_limits limits = {1e-3, 0.0, 1e-6, 2000.0, 4};

static double cycle_radius(double p, double sign) {
    return sqrt(0.5 * (1.0 + sign * sqrt(1.0 + 4.0 * p)));
}

static void settles_on_the_stable_cycle(void **unused) {
    (void)unused;
    for (double p = -0.24; p < 0.31; p += 0.09) {
        struct hopf state = {p, 1.3, 0.3};
        struct cycle c;
        cycle_settle(&hopf, &limits, &state, &c);
        assert_int_equal(c.end, CYCLE_STAYS);
        assert_true(fabs(c.amplitude / cycle_radius(p, 1.0) - 1.0) < 1e-5);
        assert_true(fabs(c.frequency_Hz - 1.0) < 1e-5);
        assert_true(fabs(c.mean - 0.1) < 1e-5);
    }
}

static void decays_below_the_unstable_cycle_and_grows_above(void **unused) {
    (void)unused;
    const double threshold = cycle_radius(-0.15, -1.0);
    for (int above = 0; above < 2; above++) {
        struct hopf state = {-0.15, threshold * (above ? 1.01 : 0.99), 0.0};
        struct cycle c;
        cycle_settle(&hopf, &limits, &state, &c);
        assert_int_equal(c.end, above ? CYCLE_STAYS : CYCLE_REST);
    }
}

static void tells_rest_and_loss(void **unused) {
    (void)unused;
    struct hopf still = {-0.1, 0.0, 0.0};
    struct hopf lost = {1e4, 20.0, 0.0};
    struct cycle c;
    cycle_settle(&hopf, &limits, &still, &c);
    assert_int_equal(c.end, CYCLE_REST);
    cycle_settle(&hopf, &limits, &lost, &c);
    assert_int_equal(c.end, CYCLE_LOST);
}

static void finds_the_fold(void **unused) {
    (void)unused;
    struct hopf state = {-0.2, 1.0, 0.0};
    struct cycle c = {0};
    double low = -0.5;
    double high = -0.2;
    assert_true(cycle_fold(&hopf, &limits, 1e-5, &low, &high, &state, &c));
    assert_true(fabs(high + 0.25) < 3e-5);
    assert_true(high - low <= 1e-5);
    assert_true(fabs(state.p - high) < 1e-15);
    /* the amplitude goes as the root of the distance: sqrt(4 * 3e-5)/(4 r) */
    assert_true(fabs(c.amplitude - sqrt(0.5)) < 5e-3);
}

static void finds_the_unstable_cycle(void **unused) {
    (void)unused;
    for (double p = -0.24; p < -0.015; p += 0.05) {
        struct hopf state = {p, cycle_radius(p, 1.0), 0.0};
        struct cycle c;
        assert_true(cycle_unstable(&hopf, &limits, &state, state.r, &c));
        assert_true(fabs(c.amplitude / cycle_radius(p, -1.0) - 1.0) < 2e-3);
        assert_true(fabs(c.frequency_Hz - 1.0) < 1e-4);
    }
}

static void knows_where_there_is_no_threshold(void **unused) {
    (void)unused;
    struct hopf state = {0.1, cycle_radius(0.1, 1.0), 0.0};
    struct cycle c;
    assert_false(cycle_unstable(&hopf, &limits, &state, state.r, &c));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(settles_on_the_stable_cycle),
        cmocka_unit_test(decays_below_the_unstable_cycle_and_grows_above),
        cmocka_unit_test(tells_rest_and_loss),
        cmocka_unit_test(finds_the_fold),
        cmocka_unit_test(finds_the_unstable_cycle),
        cmocka_unit_test(knows_where_there_is_no_threshold),
    };
    return cmocka_run_group_tests_name("cycle", tests, NULL, NULL);
}
