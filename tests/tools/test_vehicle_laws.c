/* The creep laws and the state of the rails in a vehicle: each law in a sharp curve, equal slopes where
 * creepages are small, friction that changes on one wheel at one step. */
#include "../core/flange.h"
#include "creep_file.h"

static struct creep_file table;

static int load(void **state) {
    (void)state;
    return creep_file_load(&table, "models/creep/contact.csv", false, stderr);
}

static int drop(void **state) {
    (void)state;
    creep_file_free(&table);
    return 0;
}

static const enum kl_creep_law laws[] = {KL_CREEP_LINEAR, KL_CREEP_SHE,
                                         KL_CREEP_POLACH, KL_CREEP_FASTSIM,
                                         KL_CREEP_TABLE,  KL_CREEP_FASTSIM_ELLIPTIC};

static void wagon_with(struct vehicle *v, enum kl_creep_law law) {
    wagon(v, two_contacts());
    v->def.creep_table = &table.table;
    for (int i = 0; i < 2; i++) {
        v->wheelset[i].creep.law = law;
    }
}

/* Without a limit of friction the wheels would climb in a sharp curve. */
static double radius_for(enum kl_creep_law law) {
    return law == KL_CREEP_LINEAR ? 1500.0 : 300.0;
}

/* Steady in 300 m at 15 m/s: no fault, still, and the rails take the whole of the side force. */
static void every_law_runs_in_a_curve_of_300_m(void **state) {
    (void)state;
    for (size_t k = 0; k < COUNT(laws); k++) {
        struct vehicle v;
        struct built b;
        struct kl_state x;
        struct kl_output o;
        const double radius = radius_for(laws[k]);
        wagon_with(&v, laws[k]);
        add_ramp(v.curvature, &v.track.n_curvature, KL_RAMP_CONSTANT, 20.0, 0.0);
        add_ramp(v.curvature, &v.track.n_curvature, KL_RAMP_LINEAR, 60.0, 1.0 / radius);
        add_ramp(v.cant, &v.track.n_cant, KL_RAMP_CONSTANT, 20.0, 0.0);
        add_ramp(v.cant, &v.track.n_cant, KL_RAMP_LINEAR, 60.0, 0.05);
        build(&v, &b);
        assert_int_equal(kl_init(&b.model, &x, 0, 15, work()), KL_OK);
        assert_int_equal(coast(&b.model, &x, 17000, &o) & KL_FAULTS_HOLD, 0);
        double side = 0.0;
        double load_sum = 0.0;
        double low = 1.0;
        double high = -1.0;
        const int steps = 1000;
        for (int i = 0; i < steps; i++) {
            assert_int_equal(coast(&b.model, &x, 1, &o) & KL_FAULTS_HOLD, 0);
            low = fmin(low, (double)o.wheelset[0].y_m);
            high = fmax(high, (double)o.wheelset[0].y_m);
            for (int w = 0; w < 2; w++) {
                for (int s = 0; s < KL_SIDES; s++) {
                    side += (double)o.wheelset[w].y_N[s] / steps;
                    load_sum += (double)o.wheelset[w].q_N[s] / steps;
                }
            }
        }
        const double mass = 37200.0 + 2.0 * 1400.0;
        const double want = -mass * (225.0 / radius - 9.81 * 0.05); /* on the rails: outwards */
        print_message("law %d: front y %.2f to %.2f mm, Y %.1f kN, Q %.1f kN outside\n",
                      (int)laws[k], 1e3 * low, 1e3 * high,
                      -1e-3 * (double)o.wheelset[0].y_N[KL_LEFT],
                      1e-3 * (double)o.wheelset[0].q_N[KL_LEFT]);
        assert_near(side, want, 0.01 * fabs(want) + 20.0);
        assert_near(load_sum, mass * 9.81, 0.005 * mass * 9.81);
        assert_at_most(high - low, 0.1e-3);
        unbuild(&b);
    }
}

/* dT2/dpsi of the front right tread. Kalker's slope is f22; CONTACT's own on the table's grid is up to
 * 5 % off, spin takes a little more off where a law lets it. */
static void laws_agree_where_creepages_are_small(void **state) {
    (void)state;
    double slope[COUNT(laws)];
    for (size_t k = 0; k < COUNT(laws); k++) {
        struct vehicle v;
        struct built b;
        struct kl_state x;
        struct kl_input in;
        struct kl_output o;
        double t2[2];
        wagon_with(&v, laws[k]);
        v.wheelset[0].creep.friction = (kl_real)1.0;
        v.wheelset[1].creep.friction = (kl_real)1.0;
        build(&v, &b);
        assert_int_equal(kl_init(&b.model, &x, 0, 15, work()), KL_OK);
        kl_input_init(&in);
        in.speed_m_s = 15;
        for (int i = 0; i < 2; i++) {
            wheelset_x(&b.model, &x, 0)[KL_WS_YAW] = (kl_real)(i == 0 ? -1e-5 : 1e-5);
            kl_observe(&b.model, &x, &in, &o, work());
            t2[i] = (double)o.wheelset[0].tread.t2_N[KL_RIGHT];
        }
        slope[k] = (t2[1] - t2[0]) / 2e-5;
        print_message("law %d: dT2/dpsi %.4g N\n", (int)laws[k], slope[k]);
        assert_near(slope[k] / slope[0], 1.0, 0.08);
        unbuild(&b);
    }
}

/* ---- the state of the rails ---- */

struct pair_of_runs {
    struct built b;
    struct kl_state x[2];
    struct kl_output o[2];
    struct kl_input in[2];
};

/* Two equal runs in the curve, so that every wheel creeps. */
static void start_pair(struct pair_of_runs *p, enum kl_creep_law law, int falls) {
    struct vehicle v;
    wagon_with(&v, law);
    endless_curve(&v, 1.0 / radius_for(law), 0.05);
    for (int i = 0; i < 2; i++) {
        v.wheelset[i].creep.falls = (uint32_t)falls;
        v.wheelset[i].creep.falling_ratio = (kl_real)0.6;
        v.wheelset[i].creep.falling_decay_s_m = (kl_real)0.2;
    }
    build(&v, &p->b);
    for (int i = 0; i < 2; i++) {
        assert_int_equal(kl_init(&p->b.model, &p->x[i], 0, 15, work()), KL_OK);
        kl_input_init(&p->in[i]);
        p->in[i].speed_m_s = 15;
        for (int n = 0; n < 3000; n++) {
            (void)kl_step(&p->b.model, &p->x[i], &p->in[i], &p->o[i], work());
        }
    }
    assert_memory_equal(&p->x[0], &p->x[1], sizeof p->x[0]);
}

/* One step with the changed input of run 1: the wheel's creep changes, no other's does. */
static void step_pair(struct pair_of_runs *p, uint32_t w, int side, double limit) {
    for (int i = 0; i < 2; i++) {
        assert_int_equal(
            kl_step(&p->b.model, &p->x[i], &p->in[i], &p->o[i], work()) & KL_FAULTS_HOLD, 0);
    }
    for (uint32_t k = 0; k < 2; k++) {
        for (int s = 0; s < KL_SIDES; s++) {
            const struct kl_contact_output *a = &p->o[0].wheelset[k].tread;
            const struct kl_contact_output *c = &p->o[1].wheelset[k].tread;
            const double before = hypot((double)a->t1_N[s], (double)a->t2_N[s]);
            const double now = hypot((double)c->t1_N[s], (double)c->t2_N[s]);
            if (k == w && s == side) {
                assert_true(now < 0.95 * before);
                assert_true(now <= limit * (double)c->normal_N[s] * (1.0 + 1e-9));
            } else if (k != w) {
                assert_true(a->t1_N[s] == c->t1_N[s] && a->t2_N[s] == c->t2_N[s]);
                assert_true(a->normal_N[s] == c->normal_N[s]);
            } else { /* the other wheel of the axle feels the lost force in its load, and that alone */
                assert_true(a->gamma1[s] == c->gamma1[s] && a->gamma2[s] == c->gamma2[s]);
                assert_near(now, before, 0.15 * before);
            }
        }
    }
    unbuild(&p->b);
}

static void wet_oiled_and_falling_friction_act_on_one_wheel(void **state) {
    (void)state;
    for (size_t k = 1; k < COUNT(laws); k++) {
        for (uint32_t w = 0; w < 2; w++) {
            for (int s = 0; s < KL_SIDES; s++) {
                struct pair_of_runs p;
                start_pair(&p, laws[k], 0);
                p.in[1].friction_factor[w][s] = (kl_real)0.1; /* oil */
                step_pair(&p, w, s, 0.03);
            }
        }
    }
}

static void lower_slope_acts_on_one_wheel(void **state) {
    (void)state;
    for (size_t k = 0; k < COUNT(laws); k++) {
        struct pair_of_runs p;
        start_pair(&p, laws[k], 0);
        p.in[1].slope_factor[1][KL_LEFT] = (kl_real)0.1; /* water */
        step_pair(&p, 1, KL_LEFT, laws[k] == KL_CREEP_LINEAR ? 1e9 : 0.3);
    }
}

static void falling_friction_acts_on_one_wheel(void **state) {
    (void)state;
    for (size_t k = 1; k < COUNT(laws); k++) {
        struct pair_of_runs p;
        start_pair(&p, laws[k], 1);
        p.in[1].falling_factor[0][KL_RIGHT] = (kl_real)0.1;
        p.in[1].falling_decay_s_m[0][KL_RIGHT] = (kl_real)100.0;
        step_pair(&p, 0, KL_RIGHT, 0.3);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_law_runs_in_a_curve_of_300_m),
        cmocka_unit_test(laws_agree_where_creepages_are_small),
        cmocka_unit_test(wet_oiled_and_falling_friction_act_on_one_wheel),
        cmocka_unit_test(lower_slope_acts_on_one_wheel),
        cmocka_unit_test(falling_friction_acts_on_one_wheel),
    };
    return cmocka_run_group_tests(tests, load, drop);
}
