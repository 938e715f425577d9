/* A wagon in a steady curve: the forces of all wheels balance what cant leaves over. */
#include "fixtures.h"

#define SPEED 20.0
#define KAPPA (1.0 / 1500.0)
#define CANT 0.015 /* 0.0272 would be balanced at this speed */

static void steady(struct kl_pair_def pair, struct built *b, struct kl_state *x,
                   struct kl_output *o) {
    struct vehicle v;
    wagon(&v, pair);
    /* it enters the curve all at once */
    const int measured = pair.wheel[KL_RIGHT].profile.kind == KL_PROFILE_POINTS;
    v.pair[0].range_m = measured ? 0.0105 : 0.02;
    for (int i = 0; i < 4; i++) {
        v.element[i].c[0] = 2e4;
    }
    endless_curve(&v, KAPPA, CANT);
    build(&v, b);
    assert_int_equal(kl_init(&b->model, x, 0, (kl_real)SPEED, work()), KL_OK);
    for (uint32_t w = 0; w < 2; w++) {
        wheelset_x(&b->model, x, w)[KL_WS_Y] = (kl_real)-2e-3;
    }
    kl_refresh(&b->model, x, work());
    assert_int_equal(coast(&b->model, x, 60000, o), 0);
    struct kl_state later = *x;
    assert_int_equal(coast(&b->model, &later, 1, NULL), 0);
    for (uint32_t i = 0; i < x->n_states; i++) { /* nothing moves any more */
        assert_near((double)later.x[i], (double)x->x[i], 1e-12);
    }
}

/* d'Alembert over the whole vehicle: sum Y = -m (kappa V^2 - g phi0), sum Q = m g. */
static void balance(struct kl_pair_def pair, double lateral, double vertical) {
    struct built b;
    struct kl_state x;
    struct kl_output o;
    steady(pair, &b, &x, &o);
    const double mass = 37200.0 + 2.0 * 1400.0;
    const double aside = KAPPA * SPEED * SPEED - 9.81 * CANT;
    double y = 0.0;
    double q = 0.0;
    for (int w = 0; w < 2; w++) {
        y += (double)o.wheelset[w].force_y_N;
        q += (double)(o.wheelset[w].q_N[KL_RIGHT] + o.wheelset[w].q_N[KL_LEFT]);
    }
    print_message("sum Y %.6f N, wanted %.6f: %.1e of it; sum Q %.6f N, wanted %.6f: %.1e of it\n",
                  y, -mass * aside, y / (-mass * aside) - 1.0, q, mass * 9.81,
                  q / (mass * 9.81) - 1.0);
    assert_near(y, -mass * aside, lateral * mass * aside);
    assert_near(q, mass * 9.81, vertical * mass * 9.81);
    /* the accelerometer of a body that turns with the track feels the deficiency */
    assert_near((double)o.body[0].acceleration[KL_Y], aside, 1e-6 * aside);
    unbuild(&b);
}

/* Level contacts: nothing is left out, to 1e-6 and better. */
static void forces_balance_on_the_linear_pair(void **state) {
    (void)state;
    balance(linear_pair(0.1), 1e-6, 1e-9);
}

static void forces_balance_on_arcs(void **state) {
    (void)state;
    balance(arcs_pair(KL_KINEMATICS_RIGID), 1e-6, 1e-9);
}

/* An axle comes to rest on the jump of the contact at 0.2 mm, within one step of the table: the wheels'
 * forces must still be those that hold the wagon. */
static void forces_balance_on_a_jump(void **state) {
    (void)state;
    balance(s1002_uic60(), 1e-6, 1e-6);
}

/* Outer wheels carry more by the moment of the deficiency about the rails. */
static void outer_wheels_carry_the_moment(void **state) {
    (void)state;
    struct built b;
    struct kl_state x;
    struct kl_output o;
    steady(linear_pair(0.1), &b, &x, &o);
    const double aside = KAPPA * SPEED * SPEED - 9.81 * CANT;
    double difference = 0.0;
    for (int w = 0; w < 2; w++) {
        difference += (double)(o.wheelset[w].q_N[KL_LEFT] - o.wheelset[w].q_N[KL_RIGHT]);
    }
    /* at rail level: centrifugal force at the centres and the gyroscopic moment of the axles. A
     * linear suspension carries the weight where it stood at rest. */
    const double spin = SPEED / ARCS_R0;
    double moment = 37200.0 * aside * 1.65 + 2.0 * 1400.0 * aside * ARCS_R0 +
                    2.0 * 100.0 * spin * KAPPA * SPEED;
    print_message("Q left - right %.3f N, moment about the rails gives %.3f N\n", difference,
                  moment / ARCS_L);
    assert_near(difference, moment / ARCS_L, 1e-5 * fabs(difference));
    assert_true(difference > 0.0); /* right-hand curve: the left wheel is outside */
    unbuild(&b);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(forces_balance_on_the_linear_pair),
        cmocka_unit_test(forces_balance_on_arcs),
        cmocka_unit_test(forces_balance_on_a_jump),
        cmocka_unit_test(outer_wheels_carry_the_moment),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
