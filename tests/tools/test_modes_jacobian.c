/*
 * test_modes_jacobian.c - the Jacobian by colours against that by one state at a time, on the models
 * of this project; and that the colours do not grow with a train.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "modes_jacobian.h"

static struct cli_model m;
static struct jacobian_plan plan;
static struct kl_state state;
static struct kl_input input;

static void load(const char *vehicle, const char *track) {
    const struct cli_target target = {.vehicle = vehicle, .track = track};
    assert_int_equal(cli_model_open(&m, &target), CLI_OK);
    assert_int_equal(kl_init(&m.model, &state, 300, 25, cli_work()), KL_OK);
    kl_input_init(&input);
    input.speed_m_s = 25;
    /* off the centre, every state by another amount, so that nothing cancels */
    for (uint32_t i = 0; i < m.model.n_states; i++) {
        state.x[i] += (kl_real)(1e-4 * sin(1.0 + 2.7 * (double)i));
    }
    jacobian_plan(&m.model, &plan);
}

/* One state at a time, and no structure. */
static void dense(double *matrix) {
    const uint32_t n = m.model.n_states;
    kl_real up[KL_MAX_STATES];
    kl_real down[KL_MAX_STATES];
    for (uint32_t k = 0; k < n; k++) {
        struct kl_state high = state;
        struct kl_state low = state;
        high.x[k] += (kl_real)plan.step[k];
        low.x[k] -= (kl_real)plan.step[k];
        kl_rates(&m.model, &high, &input, up, cli_work());
        kl_rates(&m.model, &low, &input, down, cli_work());
        for (uint32_t i = 0; i < n; i++) {
            matrix[i * n + k] = (double)(up[i] - down[i]) / (double)(high.x[k] - low.x[k]);
        }
    }
}

/* To the last bit: where a state is not felt, moving it changes nothing at all. */
static void check(const char *vehicle, const char *track) {
    load(vehicle, track);
    const uint32_t n = m.model.n_states;
    const struct jacobian_point at = {&m.model, &input, &state};
    double *wanted = calloc((size_t)n * n, sizeof wanted[0]);
    double *got = calloc((size_t)n * n, sizeof got[0]);
    assert_non_null(wanted);
    assert_non_null(got);
    dense(wanted);
    jacobian(&plan, &at, JACOBIAN_PLAIN, 1.0, got);
    for (uint32_t i = 0; i < n * n; i++) {
        if (fabs(got[i] - wanted[i]) > 1e-12 * fabs(wanted[i])) {
            fail_msg("%s: d rate[%u]/d x[%u] is %.17g, one at a time %.17g", vehicle, i / n, i % n,
                     got[i], wanted[i]);
        }
    }
    free(wanted);
    free(got);
    cli_model_close(&m);
}

static void equals_one_at_a_time(void **unused) {
    (void)unused;
    check("models/two_axle_wagon.yaml", "models/curve_r600.yaml");
    check("models/manchester_vehicle1.yaml", "models/curve_r600.yaml");
    check("models/cooperrider_bogie.yaml", NULL);
    check("models/forced_steering.yaml", NULL);
    check("models/cross_braced.yaml", NULL);
    check("models/cross_braced_rigid.yaml", NULL);
    check("models/three_axle_linked.yaml", NULL);
    check("models/articulated_train.yaml", NULL);
    check("models/articulated_single_axle.yaml", NULL);
    check("models/ten_coaches.yaml", NULL);
}

static void does_not_grow_with_a_train(void **unused) {
    (void)unused;
    load("models/manchester_vehicle1.yaml", NULL);
    const uint32_t coach = plan.n_groups;
    cli_model_close(&m);
    load("models/ten_coaches.yaml", NULL);
    assert_true(plan.n_groups <= 2 * coach);
    assert_true(plan.n_groups < plan.n_states / 5);
    cli_model_close(&m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(equals_one_at_a_time),
        cmocka_unit_test(does_not_grow_with_a_train),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
