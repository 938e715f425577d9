/* Energy: kept without creep and dampers, never growing with them. */
#include "fixtures.h"

static void start(const struct kl_model *m, struct kl_state *x, double speed) {
    assert_int_equal(kl_init(m, x, 0, (kl_real)speed, work()), KL_OK);
    for (uint32_t w = 0; w < m->n_wheelsets; w++) {
        kl_real *q = wheelset_x(m, x, w);
        q[KL_WS_Y] = (kl_real)(w == 0 ? 1.5e-3 : -1e-3);
        q[KL_WS_YAW] = (kl_real)1e-3;
    }
    if (m->n_bodies > 0) {
        const double place[KL_FREEDOMS] = {3e-3, 5e-3, 4e-3, 1e-3, -1e-3};
        for (int f = 0; f < KL_FREEDOMS; f++) {
            x->x[kl_body_state_index(m, 0, (enum kl_freedom)f, 0)] = (kl_real)place[f];
        }
    }
}

/* What the motion has beyond rest: the scale of every drift. */
static double excess(const struct kl_model *m, const struct kl_state *x) {
    struct kl_state rest;
    assert_int_equal(kl_init(m, &rest, x->s_m, x->speed_m_s, work()), KL_OK);
    return (double)kl_energy(m, x, work()) - (double)kl_energy(m, &rest, work());
}

/* No creep forces: friction 0; no dampers. */
static void lossless(struct vehicle *v, struct kl_pair_def pair, double restraint) {
    if (restraint > 0.0) {
        single_wheelset(v, pair, restraint, restraint);
        v->wheelset[0].load_N = 1e5;
    } else {
        wagon(v, pair);
    }
    for (int i = 0; i < 2; i++) {
        v->wheelset[i].creep.friction = 0;
    }
    for (int i = 0; i < 4; i++) {
        memset(v->element[i].c, 0, sizeof v->element[i].c);
    }
    v->element[0].k[5] += restraint > 0.0 ? 0.0 : 2e6; /* holds the yaw that no creep holds */
    v->element[2].k[5] += restraint > 0.0 ? 0.0 : 2e6;
}

/* Largest departure from the first energy over 2 s, as a part of what the motion has. */
static double drift(struct vehicle *v, int64_t step_ns, double speed) {
    struct built b;
    struct kl_state x;
    v->def.step_ns = step_ns;
    build(v, &b);
    start(&b.model, &x, speed);
    const double first = (double)kl_energy(&b.model, &x, work());
    const double scale = excess(&b.model, &x);
    double worst = 0.0;
    assert_true(scale > 0.0);
    for (int64_t t = 0; t < 2000000000; t += step_ns) {
        assert_int_equal(coast(&b.model, &x, 1, NULL) & KL_FAULTS_HOLD, 0);
        worst = fmax(worst, fabs((double)kl_energy(&b.model, &x, work()) - first));
    }
    unbuild(&b);
    return worst / scale;
}

/* The drift is the integrator's. */
static void kept(struct vehicle *v, const char *what, double speed, double at_1_ms) {
    const double coarse = drift(v, 1000000, speed);
    const double half = drift(v, 500000, speed);
    const double fine = drift(v, 250000, speed);
    print_message(
        "%s at %g m/s: drift over 2 s %.2e at 1 ms, %.2e at 0.5 ms, %.2e at 0.25 ms; order %.2f\n",
        what, speed, coarse, half, fine, log2(half / fine));
    assert_at_most(coarse, at_1_ms);
    assert_true(log2(half / fine) > 1.9);
}

static void without_creep_and_dampers_it_is_kept(void **state) {
    (void)state;
    struct vehicle v;
    lossless(&v, arcs_pair(KL_KINEMATICS_RIGID), 2e6);
    kept(&v, "wheelset on arcs", 20.0, 1e-2);
    kept(&v, "wheelset on arcs", 0.0, 1e-2);
    lossless(&v, arcs_pair(KL_KINEMATICS_RIGID), 0.0);
    kept(&v, "wagon on arcs", 20.0, 1e-2);
    lossless(&v, linear_pair(0.1), 2e6);
    kept(&v, "wheelset on the linear pair", 40.0, 1e-2);
}

struct fall {
    double rise; /* largest of a step */
    double left; /* after 5 s */
    double most; /* ever */
};

static struct fall run_down(struct vehicle *v, int64_t step_ns, double speed) {
    struct built b;
    struct kl_state x;
    struct fall fall = {0.0, 0.0, 0.0};
    v->def.step_ns = step_ns;
    build(v, &b);
    start(&b.model, &x, speed);
    const double scale = excess(&b.model, &x);
    const double first = (double)kl_energy(&b.model, &x, work());
    double before = 0.0;
    for (int64_t i = 0; i < 5000000000 / step_ns; i++) {
        assert_int_equal(coast(&b.model, &x, 1, NULL) & KL_FAULTS_HOLD, 0);
        const double now = ((double)kl_energy(&b.model, &x, work()) - first) / scale;
        fall.rise = fmax(fall.rise, now - before);
        fall.most = fmax(fall.most, now);
        before = now;
    }
    fall.left = 1.0 + before;
    unbuild(&b);
    return fall;
}

/* Leapfrog keeps an energy that differs from the true one by a part of the order dt^2, which swings;
 * so a step may show a rise of that order, and a run none. */
static void falls(struct vehicle *v, const char *what, double speed) {
    const struct fall coarse = run_down(v, 1000000, speed);
    const struct fall fine = run_down(v, 250000, speed);
    print_message(
        "%s: %.3f of the energy left after 5 s; largest rise in a step %.1e at 1 ms, %.1e "
        "at 0.25 ms\n",
        what, coarse.left, coarse.rise, fine.rise);
    assert_at_most(coarse.rise, 1e-3);
    assert_at_most(fine.rise, coarse.rise / 10.0 + 1e-6);
    assert_at_most(coarse.most, 1e-3);
    assert_at_most(fine.most, 1e-4);
    assert_at_most(coarse.left, 0.5);
}

/* Dampers, but no creep to feed on the forward motion. */
static void with_dampers_it_never_grows(void **state) {
    (void)state;
    struct vehicle v;
    lossless(&v, arcs_pair(KL_KINEMATICS_RIGID), 0.0);
    for (int i = 0; i < 4; i++) {
        for (int k = 0; k < 6; k++) {
            v.element[i].c[k] = 2e4;
        }
    }
    falls(&v, "dampers, 20 m/s", 20.0);
}

/* At standstill the track gives no power: creep can only take. */
static void with_creep_at_standstill_it_never_grows(void **state) {
    (void)state;
    struct vehicle v;
    wagon(&v, arcs_pair(KL_KINEMATICS_RIGID));
    falls(&v, "wagon at rest", 0.0);
    single_wheelset(&v, arcs_pair(KL_KINEMATICS_RIGID), 2e6, 2e6);
    v.wheelset[0].load_N = 1e5;
    v.wheelset[0].creep.friction = (kl_real)0.02;
    falls(&v, "wheelset at rest, slippery", 0.0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(without_creep_and_dampers_it_is_kept),
        cmocka_unit_test(with_dampers_it_never_grows),
        cmocka_unit_test(with_creep_at_standstill_it_never_grows),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
