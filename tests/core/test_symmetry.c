/* The mirror image of a run is the run of the mirror image, to the last bit of every state. */
#include "fixtures.h"

#define STEPS 5000
#define SAMPLES 600

static double lateral[2][SAMPLES];
static double vertical[SAMPLES];
static double cross[2][SAMPLES];
static double gauge[SAMPLES];

/* Right becomes left: y, roll and yaw change sign, and so do curvature, cant, lateral and cross. */
static void irregularities(struct vehicle *v, int mirrored) {
    uint64_t seed = 61;
    for (int i = 0; i < SAMPLES; i++) {
        lateral[0][i] = random_between(&seed, -8e-4, 8e-4);
        vertical[i] = random_between(&seed, -8e-4, 8e-4);
        cross[0][i] = random_between(&seed, -8e-4, 8e-4);
        gauge[i] = random_between(&seed, -8e-4, 8e-4);
        lateral[1][i] = -lateral[0][i];
        cross[1][i] = -cross[0][i];
    }
    struct kl_irregularity_def *r = &v->track.irregularity;
    r->n_samples = SAMPLES;
    r->step_m = 0.7;
    r->lateral_m = lateral[mirrored];
    r->vertical_m = vertical;
    r->cross_rad = cross[mirrored];
    r->gauge_m = gauge;
}

/* A wagon with a yaw damper on one side only, in a curve. */
static void lopsided_wagon(struct vehicle *v, struct kl_pair_def pair, int mirrored) {
    const double sign = mirrored ? -1.0 : 1.0;
    wagon(v, pair);
    one_curve(v, KL_RAMP_BLOSS, sign * 0.001, sign * 0.05);
    irregularities(v, mirrored);
    v->body[0].x_m = 0.3;
    v->def.n_elements = 5;
    corner(&v->element[4], "damper", 0, 3.9, 1.3);
    v->element[4].k[1] = 1e5;
    v->element[4].k[3] = 1e5;
    for (int i = 0; i < 5 && mirrored; i++) {
        v->element[i].point_a_m[1] = -v->element[i].point_a_m[1];
        v->element[i].point_b_m[1] = -v->element[i].point_b_m[1];
    }
}

static void start(const struct kl_model *m, struct kl_state *x, double sign) {
    assert_int_equal(kl_init(m, x, 0, 20, work()), KL_OK);
    for (uint32_t w = 0; w < 2; w++) {
        kl_real *q = wheelset_x(m, x, w);
        q[KL_WS_Y] = (kl_real)(sign * 1.3e-3);
        q[KL_WS_YAW] = (kl_real)(sign * 2e-4);
        q[KL_WS_Y_RATE] += (kl_real)(sign * 1e-2);
        q[KL_WS_YAW_RATE] += (kl_real)(sign * 1e-2);
        q[KL_WS_SPIN] += (kl_real)0.1;
    }
    x->x[kl_body_state_index(m, 0, KL_Y, 0)] = (kl_real)(sign * 2e-3);
    x->x[kl_body_state_index(m, 0, KL_Z, 0)] = (kl_real)1e-3;
    x->x[kl_body_state_index(m, 0, KL_ROLL, 0)] = (kl_real)(sign * 3e-3);
    x->x[kl_body_state_index(m, 0, KL_PITCH, 0)] = (kl_real)4e-4;
    x->x[kl_body_state_index(m, 0, KL_YAW, 1)] += (kl_real)(sign * 1e-3);
    kl_refresh(m, x, work());
}

/* The sign that a state takes in the mirror. */
static double sign_of(const struct kl_model *m, uint32_t state) {
    for (uint32_t w = 0; w < m->n_wheelsets; w++) {
        if (state == (uint32_t)kl_wheelset_state_index(m, w, KL_WS_SPIN)) {
            return 1.0;
        }
    }
    for (int rate = 0; rate < 2; rate++) {
        if (state == (uint32_t)kl_body_state_index(m, 0, KL_Z, rate) ||
            state == (uint32_t)kl_body_state_index(m, 0, KL_PITCH, rate)) {
            return 1.0;
        }
    }
    return -1.0;
}

/* Equal as numbers: -0 and +0 are one, and there is no NaN; all other numbers have one pattern. */
static int is(kl_real got, double sign, kl_real other) {
    return got == (kl_real)sign * other;
}

static void check_state(const struct kl_model *m, const struct kl_state *a,
                        const struct kl_state *b) {
    assert_true(a->s_m == b->s_m && a->speed_m_s == b->speed_m_s && a->faults == b->faults);
    for (uint32_t i = 0; i < m->n_states; i++) {
        if (!is(a->x[i], sign_of(m, i), b->x[i])) {
            fail_msg("tick %u, state %u: %.17g and %.17g", (unsigned)a->tick, i, (double)a->x[i],
                     (double)b->x[i]);
        }
    }
}

/* Side s of one, the other side of the other. */
static void check_contact(const struct kl_contact_output *a, const struct kl_contact_output *b,
                          int s) {
    const int t = 1 - s;
    assert_true(is(a->normal_N[s], 1, b->normal_N[t]));
    assert_true(is(a->t1_N[s], 1, b->t1_N[t]) && is(a->t2_N[s], -1, b->t2_N[t]));
    assert_true(is(a->m3_Nm[s], -1, b->m3_Nm[t]) && is(a->gamma1[s], 1, b->gamma1[t]));
    assert_true(is(a->gamma2[s], -1, b->gamma2[t]) && is(a->omega3_1_m[s], -1, b->omega3_1_m[t]));
    assert_true(is(a->radius_m[s], 1, b->radius_m[t]) && is(a->delta_rad[s], 1, b->delta_rad[t]));
    assert_true(is(a->eta_wheel_m[s], 1, b->eta_wheel_m[t]));
}

static void check_wheel(const struct kl_wheelset_output *a, const struct kl_wheelset_output *b,
                        int s) {
    const int t = 1 - s;
    assert_true(is(a->q_N[s], 1, b->q_N[t]) && is(a->y_N[s], -1, b->y_N[t]));
    assert_true(is(a->rise_m[s], 1, b->rise_m[t]) && is(a->rail_m[s], 1, b->rail_m[t]));
    check_contact(&a->tread, &b->tread, s);
    check_contact(&a->flange, &b->flange, s);
}

static void check_output(const struct kl_output *a, const struct kl_output *b) {
    for (int w = 0; w < 2; w++) {
        const struct kl_wheelset_output *p = &a->wheelset[w];
        const struct kl_wheelset_output *q = &b->wheelset[w];
        check_wheel(p, q, KL_RIGHT);
        check_wheel(p, q, KL_LEFT);
        assert_true(is(p->y_m, -1, q->y_m) && is(p->z_m, 1, q->z_m));
        assert_true(is(p->roll_rad, -1, q->roll_rad) && is(p->force_y_N, -1, q->force_y_N));
        assert_true(is(p->y_acc_m_s2, -1, q->y_acc_m_s2));
    }
    for (int f = 0; f < KL_FREEDOMS; f++) {
        const double sign = f == KL_Z || f == KL_PITCH ? 1.0 : -1.0;
        assert_true(is(a->body[0].position[f], sign, b->body[0].position[f]));
        assert_true(is(a->body[0].acceleration[f], sign, b->body[0].acceleration[f]));
    }
}

static void mirrored_runs(struct kl_pair_def pair) {
    struct vehicle v;
    struct built m[2];
    struct kl_state x[2];
    struct kl_output o[2];
    struct kl_input in[2];
    for (int i = 0; i < 2; i++) {
        const double sign = i == 0 ? 1.0 : -1.0;
        lopsided_wagon(&v, pair, i);
        build(&v, &m[i]);
        start(&m[i].model, &x[i], sign);
        kl_input_init(&in[i]);
        in[i].speed_m_s = 23;
        in[i].axle_torque_Nm[0] = 300;
        in[i].side_force_N[0] = (kl_real)(sign * 4000.0);
        in[i].friction_factor[1][i == 0 ? KL_RIGHT : KL_LEFT] = (kl_real)0.4;
        in[i].friction_factor[0][i == 0 ? KL_LEFT : KL_RIGHT] = (kl_real)1.3;
    }
    for (int n = 0; n < STEPS; n++) {
        for (int i = 0; i < 2; i++) {
            assert_int_equal(kl_step(&m[i].model, &x[i], &in[i], &o[i], work()), 0);
        }
        check_state(&m[0].model, &x[0], &x[1]);
        check_output(&o[0], &o[1]);
    }
    assert_true(x[0].x[kl_wheelset_state_index(&m[0].model, 0, KL_WS_Y)] != 0);
    unbuild(&m[0]);
    unbuild(&m[1]);
}

static void mirror_image_on_arcs(void **state) {
    (void)state;
    struct kl_pair_def pair = arcs_pair(KL_KINEMATICS_RIGID);
    pair.range_m = 0.02;
    mirrored_runs(pair);
}

static void mirror_image_on_s1002_uic60(void **state) {
    (void)state;
    mirrored_runs(s1002_uic60());
}

/* What is symmetric itself stays exactly in the middle, at any speed, for as long as one likes. */
static void a_symmetric_run_never_leaves_the_middle(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    struct kl_state x;
    struct kl_output o;
    wagon(&v, s1002_uic60());
    irregularities(&v, 0);
    v.track.irregularity.lateral_m = NULL;
    v.track.irregularity.cross_rad = NULL;
    build(&v, &b);
    assert_int_equal(kl_init(&b.model, &x, 0, 60, work()), KL_OK);
    assert_int_equal(coast(&b.model, &x, STEPS, &o), 0);
    for (uint32_t w = 0; w < 2; w++) {
        const kl_real *q = wheelset_x(&b.model, &x, w);
        assert_true(q[KL_WS_Y] == 0 && q[KL_WS_YAW] == 0 && q[KL_WS_Y_RATE] == 0 &&
                    q[KL_WS_YAW_RATE] == 0);
        assert_true(o.wheelset[w].roll_rad == 0);
    }
    assert_true(x.x[kl_body_state_index(&b.model, 0, KL_Z, 0)] != 0); /* it does bounce */
    unbuild(&b);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(mirror_image_on_arcs),
        cmocka_unit_test(mirror_image_on_s1002_uic60),
        cmocka_unit_test(a_symmetric_run_never_leaves_the_middle),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
