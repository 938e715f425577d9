/*
 * test_rigid_linkage.c - rigid linkages against the constraint that they stand for.
 *
 * The constraint is put into the linear model by projection: with the Jacobian J of the vehicle without
 * linkages, rows c of the linkages on the coordinates, and the columns g = M^-1 c^T by which a force in
 * them accelerates, what keeps c v' = 0 makes the accelerations (1 - g (c g)^-1 c) J x. Nothing of the
 * stiffness, the damping and the integral that stand for it in the core is in this. g comes from the
 * difference that a weak spring makes.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>
#include <lapacke.h>

#include "modes_jacobian.h"
#include "modes_linear.h"

#define MODEL "models/cross_braced_rigid.yaml"
#define SPEED 35.0
#define LINKAGES 2
#define WEAK 1e5  /* N/m */
#define LEAST 0.1 /* 1/s: slower ones are what the projection leaves of u itself */
#define MOST 200.0

static struct cli_model m;
static struct kl_input input;
static struct modes modes;
static struct modes_names names;
static uint32_t n;

/* With springs in place of the linkages, where `k` is not NULL. */
static void open_model(const double *k) {
    const struct cli_target target = {.vehicle = MODEL};
    assert_int_equal(cli_model_load(&m, &target), CLI_OK);
    assert_int_equal(m.file.vehicle.n_linkages, LINKAGES);
    static struct kl_linkage_def linkages[LINKAGES];
    for (uint32_t i = 0; i < LINKAGES; i++) {
        linkages[i] = m.file.vehicle.linkages[i];
        assert_true(linkages[i].rigid == 1);
        linkages[i].rigid = k == NULL;
        linkages[i].k = k == NULL ? 0.0 : k[i];
    }
    m.file.vehicle.linkages = linkages;
    assert_int_equal(cli_model_build(&m), CLI_OK);
    n = m.model.n_states;
    kl_input_init(&input);
    input.speed_m_s = (kl_real)SPEED;
}

/* The Jacobian with springs, about the given state. */
static double *with_springs(const double k[LINKAGES], const struct kl_state *about) {
    static struct jacobian_plan plan;
    open_model(k);
    jacobian_plan(&m.model, &plan);
    struct kl_state state = *about;
    state.n_states = n;
    const int32_t rails = kl_rail_state_index(&m.model, 0, KL_RIGHT);
    for (uint32_t i = (uint32_t)rails; i < n;
         i++) { /* rigid linkages have a state each before these */
        state.x[i] = about->x[i + LINKAGES];
    }
    const struct jacobian_point at = {&m.model, &input, &state};
    double *matrix = calloc((size_t)n * n, sizeof matrix[0]);
    assert_non_null(matrix);
    jacobian(&plan, &at, JACOBIAN_PLAIN, 1.0, matrix);
    return matrix;
}

/* y1 - y2 - 1.28 (yaw1 + yaw2): factor of a state, position or (1) rate; 0 of others. */
static double factor_of(uint32_t linkage, uint32_t state, int rate) {
    static const double factor[2][2] = {{1.0, -1.28}, {-1.0, -1.28}};
    for (uint32_t w = 0; w < 2; w++) {
        const int32_t y = kl_wheelset_state_index(&m.model, 2 * linkage + w, KL_WS_Y);
        if ((int32_t)state == y + (rate ? KL_WS_Y_RATE : KL_WS_Y)) {
            return factor[w][0];
        }
        if ((int32_t)state == y + (rate ? KL_WS_YAW_RATE : KL_WS_YAW)) {
            return factor[w][1];
        }
    }
    return 0.0;
}

/* Takes the springs off `matrix`, and then the motion of u. */
static void constrain(double *matrix, double *const stiffer[LINKAGES]) {
    double *g[LINKAGES];
    double cg[LINKAGES][LINKAGES] = {{0.0}};
    for (uint32_t l = 0; l < LINKAGES; l++) {
        const uint32_t y =
            (uint32_t)kl_wheelset_state_index(&m.model, 2 * l, KL_WS_Y); /* factor 1 */
        g[l] = calloc(n, sizeof g[l][0]);
        for (uint32_t i = 0; i < n; i++) {
            g[l][i] = -(stiffer[l][i * n + y] - matrix[i * n + y]) / WEAK;
        }
    }
    for (uint32_t l = 0; l < LINKAGES; l++) {
        for (uint32_t i = 0; i < n * n; i++) {
            matrix[i] += WEAK * g[l][i / n] * factor_of(l, i % n, 0);
        }
        for (uint32_t k = 0; k < LINKAGES; k++) {
            for (uint32_t i = 0; i < n; i++) {
                cg[l][k] += factor_of(l, i, 1) * g[k][i];
            }
        }
    }
    /* the bogies do not share a wheelset: c g is diagonal */
    assert_true(cg[0][1] == 0.0 && cg[1][0] == 0.0 && cg[0][0] > 0.0 && cg[1][1] > 0.0);
    for (uint32_t l = 0; l < LINKAGES; l++) {
        for (uint32_t k = 0; k < n; k++) {
            double along = 0.0;
            for (uint32_t i = 0; i < n; i++) {
                along += factor_of(l, i, 1) * matrix[i * n + k];
            }
            for (uint32_t i = 0; i < n; i++) {
                matrix[i * n + k] -= g[l][i] * along / cg[l][l];
            }
        }
        free(g[l]);
    }
}

/* Every eigenvalue of the constrained vehicle, up to 30 Hz, is one of the model with rigid linkages:
 * those that swing, within 0.1 %, and those that only decay, within 0.3 %. */
static void eigenvalues_are_those_of_the_constraint(void **unused) {
    (void)unused;
    open_model(NULL);
    modes_name(&m.model, &names);
    const struct modes_request request = {&m.model, &names, SPEED, 0.0, false, false, false};
    assert_int_equal(modes_find(&request, &modes), CLI_OK);
    cli_model_close(&m);
    const double weak[LINKAGES] = {WEAK, WEAK};
    const double front[LINKAGES] = {2 * WEAK, WEAK};
    const double rear[LINKAGES] = {WEAK, 2 * WEAK};
    double *matrix = with_springs(weak, &modes.state);
    cli_model_close(&m);
    double *stiff_front = with_springs(front, &modes.state);
    cli_model_close(&m);
    double *stiff_rear = with_springs(rear, &modes.state);
    double *const stiffer[LINKAGES] = {stiff_front, stiff_rear};
    constrain(matrix, stiffer);
    static double re[KL_MAX_STATES];
    static double im[KL_MAX_STATES];
    assert_int_equal(LAPACKE_dgeev(LAPACK_ROW_MAJOR, 'N', 'N', (lapack_int)n, matrix, (lapack_int)n,
                                   re, im, NULL, 1, NULL, 1),
                     0);
    uint32_t compared = 0;
    double worst[2] = {0.0, 0.0};
    for (uint32_t i = 0; i < n; i++) {
        const double size = hypot(re[i], im[i]);
        if (size < LEAST || size > MOST || im[i] < 0.0) {
            continue;
        }
        double nearest = HUGE_VAL;
        for (uint32_t k = 0; k < modes.n_modes; k++) {
            nearest = fmin(nearest, hypot(modes.mode[k].real - re[i], modes.mode[k].imag - im[i]));
        }
        const int swings = im[i] > 0.0;
        worst[swings] = fmax(worst[swings], nearest / size);
        compared++;
    }
    print_message("%u eigenvalues: off by %.3f %%, and where nothing swings by %.3f %%\n", compared,
                  100.0 * worst[1], 100.0 * worst[0]);
    assert_true(compared >= 18);
    assert_true(worst[1] < 1e-3);
    assert_true(worst[0] < 3e-3);
    free(matrix);
    free(stiff_front);
    free(stiff_rear);
    cli_model_close(&m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(eigenvalues_are_those_of_the_constraint),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
