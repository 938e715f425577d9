/* A flange on its rail: geometry, first touch, the load of two contacts at rest, Nadal's limit, and what
 * friction on one wheel does. */
#include "flange.h"

static struct built rigid_forces; /* any two-contact wheelset, for its tables */

static int set_up(void **state) {
    (void)state;
    struct vehicle v;
    pushed_wheelset(&v, 1e5, 5e7, 2e5);
    build(&v, &rigid_forces);
    return 0;
}

static int tear_down(void **state) {
    (void)state;
    unbuild(&rigid_forces);
    return 0;
}

/* ---- geometry ---- */

struct flange_place {
    double place;
    double eta;
    double delta;
    double radius;
};

/* The table of a flange at ride height H, linearly between rows: they are 0.1 mm apart. */
static struct flange_place flange_at(const struct kl_pair *pair, int side, double height) {
    const struct kl_flange_table *t = &pair->flange[side];
    const double place = ((double)t->top_m - height) / (double)pair->step_m;
    const uint32_t i = (uint32_t)place;
    assert_true(place >= 0.0 && i + 1u < t->n_rows);
    const struct kl_flange_row *a = &t->rows[i];
    const struct kl_flange_row *b = a + 1;
    const double f = place - (double)i;
    const struct flange_place p = {
        (double)a->place_m + f * (double)(b->place_m - a->place_m),
        (double)a->contact.eta_wheel_m +
            f * (double)(b->contact.eta_wheel_m - a->contact.eta_wheel_m),
        (double)a->contact.delta_rail_rad +
            f * (double)(b->contact.delta_rail_rad - a->contact.delta_rail_rad),
        (double)a->contact.radius_m + f * (double)(b->contact.radius_m - a->contact.radius_m)};
    return p;
}

/* Reference: least vertical gaps of the turned profiles, tests/reference/flange_s1002_uic60.py. The
 * shipped points of S1002 are 0.5 mm apart, so 0.02 mm of place is what their spline allows. */
static void flange_rides_up_as_the_profiles_say(void **state) {
    (void)state;
    const struct kl_pair *pair = &rigid_forces.model.pairs[0];
    struct csv csv;
    double worst[4] = {0, 0, 0, 0};
    int rows = 0;
    csv_open(&csv, "tests/reference/flange_s1002_uic60.csv");
    while (csv_next(&csv)) {
        if (!csv_is(&csv, "kind", "climb")) {
            continue;
        }
        const double height = csv_named(&csv, "height_right_m");
        for (int s = 0; s < KL_SIDES; s++) {
            const struct flange_place p = flange_at(pair, s, height);
            worst[0] = fmax(worst[0], fabs(p.place - csv_named(&csv, "y_m")));
            worst[1] = fmax(worst[1], fabs(p.eta + csv_named(&csv, "s_wheel_m")));
            worst[2] = fmax(worst[2], fabs(p.delta - csv_named(&csv, "delta_rail_rad")));
            worst[3] = fmax(worst[3], fabs(p.radius - csv_named(&csv, "radius_m")));
        }
        rows++;
    }
    csv_close(&csv);
    print_message(
        "%d heights: place within %.4f mm, contact %.4f mm, angle %.3f deg, radius %.4f mm\n", rows,
        1e3 * worst[0], 1e3 * worst[1], 57.29578 * worst[2], 1e3 * worst[3]);
    assert_int_equal(rows, 15);
    assert_at_most(worst[0], 0.01e-3);
    assert_at_most(worst[1], 0.1e-3);
    assert_at_most(worst[2], 0.5 / 57.29578);
    assert_at_most(worst[3], 0.1e-3);
}

/* The last jump of a wheel is to the flange: between 6 and 6.5 mm by CONTACT (manchester_rigid.csv),
 * where the reference's touch says. */
static void flange_touches_where_the_contact_jumps(void **state) {
    (void)state;
    const struct kl_pair *pair = &rigid_forces.model.pairs[0];
    struct csv csv;
    double touch = 0.0;
    csv_open(&csv, "tests/reference/flange_s1002_uic60.csv");
    while (csv_next(&csv)) {
        touch = csv_is(&csv, "kind", "touch") ? csv_named(&csv, "y_m") : touch;
    }
    csv_close(&csv);
    double before = 0.0;
    double after = 1.0;
    csv_open(&csv, "tests/reference/manchester_rigid.csv");
    while (csv_next(&csv)) {
        const double y = 1e-3 * csv_named(&csv, "y_ws_mm");
        if (csv_is(&csv, "wheel", "R") && csv_named(&csv, "ycp_wheel_mm") < -37.0) {
            after = fmin(after, y);
        } else if (csv_is(&csv, "wheel", "R")) {
            before = fmax(before, y);
        }
    }
    csv_close(&csv);
    for (int s = 0; s < KL_SIDES; s++) {
        const struct kl_side_table *t = &pair->side[s];
        const struct kl_jump *last = &t->jumps[t->n_jumps - 1u];
        print_message(
            "the flange touches at %.4f mm; reference %.4f, CONTACT between %.2f and %.2f\n",
            1e3 * last->w_m, 1e3 * touch, 1e3 * before, 1e3 * after);
        assert_near(last->w_m, touch, 0.01e-3);
        assert_true(last->w_m > before && last->w_m < after);
    }
}

/* The tread's table goes up to the touch as if there were no flange, and one row on. */
static void tread_ends_where_the_flange_touches(void **state) {
    (void)state;
    const struct kl_pair *pair = &rigid_forces.model.pairs[0];
    const struct kl_side_table *t = &pair->side[KL_RIGHT];
    const double touch = t->jumps[t->n_jumps - 1u].w_m;
    const struct kl_row *end = &t->rows[2u * pair->half];
    for (uint32_t i = 0; i <= 2u * pair->half; i++) {
        const double w = (double)pair->step_m * ((double)i - (double)pair->half);
        const struct kl_row *row = &t->rows[i];
        if (w > touch + (double)pair->step_m) {
            assert_memory_equal(row, end, sizeof *row);
        } else {
            assert_true(row->height_w != 0);
        }
    }
    assert_near(((double)pair->tread_end[KL_RIGHT] - (double)pair->half) * (double)pair->step_m,
                touch, 1e-12);
    assert_true(end->height_w == 0 && end->sin_delta > (kl_real)0.4);
    assert_true(pair->gives == 1);
}

/* ---- at rest on two contacts ---- */

struct rest {
    struct kl_output o;
    double force;
};

/* Without friction, pushed by a force that grows to `force` and stays. */
static void push_to(double force, double settle_s, struct rest *rest) {
    struct vehicle v;
    struct built b;
    struct kl_state x;
    struct kl_input in;
    pushed_wheelset(&v, 1e5, 5e7, 2e5);
    v.wheelset[0].creep.friction = 0;
    build(&v, &b);
    assert_int_equal(kl_init(&b.model, &x, 0, 10, work()), KL_OK);
    kl_input_init(&in);
    in.speed_m_s = 10;
    const int rise = (int)(force / 25.0);
    for (int i = 0; i < rise + (int)(1e3 * settle_s); i++) {
        in.actuator_N[PUSH_Y] = (kl_real)fmin(25.0 * i, force);
        assert_int_equal(kl_step(&b.model, &x, &in, &rest->o, work()) & KL_FAULTS_HOLD, 0);
    }
    rest->force = force;
    unbuild(&b);
}

/* Direction cosines and lever of one contact about the axle. */
struct hand {
    double sine;
    double cosine;
    double lever;
};
static struct hand hand_of(const struct kl_contact_output *c, int side) {
    const double arm = 0.75 - (double)c->eta_wheel_m[side];
    const struct hand h = {sin((double)c->delta_rad[side]), cos((double)c->delta_rad[side]),
                           arm * cos((double)c->delta_rad[side]) -
                               (double)c->radius_m[side] * sin((double)c->delta_rad[side])};
    return h;
}

/*
 * Three equations for the three normal forces, the angles and arms given:
 *   aside  N_f s_f + N_t s_t - N_l s_l = F
 *   down   N_f c_f + N_t c_t + N_l c_l = P
 *   roll   N_f A_f + N_t A_t - N_l A_l = -F r0     (F acts on the level of the rails)
 */
static void solve_three(double m[3][4], double x[3]) {
    for (int i = 0; i < 3; i++) {
        for (int r = 0; r < 3; r++) {
            const double part = m[r][i] / m[i][i];
            for (int k = i; k < 4 && r != i; k++) {
                m[r][k] -= part * m[i][k];
            }
        }
    }
    for (int i = 0; i < 3; i++) {
        x[i] = m[i][3] / m[i][i];
    }
}

static void two_contacts_share_the_load_by_hand(void **state) {
    (void)state;
    const double forces[] = {75e3, 90e3, 110e3, 130e3, 145e3};
    for (size_t i = 0; i < COUNT(forces); i++) {
        struct rest rest;
        push_to(forces[i], 3.0, &rest);
        const struct kl_wheelset_output *w = &rest.o.wheelset[0];
        const struct hand f = hand_of(&w->flange, KL_RIGHT);
        const struct hand t = hand_of(&w->tread, KL_RIGHT);
        const struct hand l = hand_of(&w->tread, KL_LEFT);
        const double p = 1e5 + 1250.0 * 9.81;
        const double r0 = (double)rigid_forces.model.pairs[0].radius_m;
        double m[3][4] = {{f.sine, t.sine, -l.sine, forces[i]},
                          {f.cosine, t.cosine, l.cosine, p},
                          {f.lever, t.lever, -l.lever, -forces[i] * r0}};
        double n[3];
        solve_three(m, n);
        print_message("%3.0f kN: rail %.3f mm; flange %.2f kN (hand %.2f), tread %.2f (%.2f), "
                      "other wheel %.2f (%.2f)\n",
                      1e-3 * forces[i], 1e3 * (double)w->rail_m[KL_RIGHT],
                      1e-3 * (double)w->flange.normal_N[KL_RIGHT], 1e-3 * n[0],
                      1e-3 * (double)w->tread.normal_N[KL_RIGHT], 1e-3 * n[1],
                      1e-3 * (double)w->tread.normal_N[KL_LEFT], 1e-3 * n[2]);
        assert_true(w->rise_m[KL_RIGHT] == 0 && w->tread.normal_N[KL_RIGHT] > 0);
        assert_near((double)w->flange.normal_N[KL_RIGHT], n[0], 0.015 * p);
        assert_near((double)w->tread.normal_N[KL_RIGHT], n[1], 0.015 * p);
        assert_near((double)w->tread.normal_N[KL_LEFT], n[2], 0.015 * p);
        /* both push on the rail's spring, over what the central contact does with half the load */
        const double central = 0.5 * p * (double)rigid_forces.model.pairs[0].central_tan[KL_RIGHT];
        assert_near(43e6 * (double)w->rail_m[KL_RIGHT] + central,
                    (double)w->flange.normal_N[KL_RIGHT] * f.sine +
                        (double)w->tread.normal_N[KL_RIGHT] * t.sine,
                    3e-3 * p);
        assert_near((double)w->y_N[KL_RIGHT] + (double)w->y_N[KL_LEFT], forces[i], 1e-3 * p);
        assert_near((double)w->q_N[KL_RIGHT] + (double)w->q_N[KL_LEFT], p, 1e-3 * p);
    }
}

/* ---- Nadal ---- */

struct climb {
    double most; /* Y/Q, mean over 50 ms, before it derails */
    uint32_t faults;
};

/* Yaw is held; the push grows by 5 N a step until the wheel has climbed. */
static struct climb climb(double friction, double yaw) {
    struct vehicle v;
    struct built b;
    struct kl_state x;
    struct kl_input in;
    struct kl_output o;
    struct climb climb = {0.0, 0};
    double mean_y = 0.0;
    double mean_q = 1.0;
    pushed_wheelset(&v, 1e5, 5e7, 2e5);
    v.wheelset[0].creep.friction = (kl_real)friction;
    build(&v, &b);
    assert_int_equal(kl_init(&b.model, &x, 0, 20, work()), KL_OK);
    kl_input_init(&in);
    in.speed_m_s = 20;
    for (int i = 0; i < 60000 && (climb.faults & KL_FAULTS_HOLD) == 0; i++) {
        in.actuator_N[PUSH_YAW] = (kl_real)(5e7 * yaw * fmin(i / 2000.0, 1.0));
        in.actuator_N[PUSH_Y] = (kl_real)(5.0 * fmax(i - 4000.0, 0.0));
        climb.faults = kl_step(&b.model, &x, &in, &o, work());
        const double y = (double)o.wheelset[0].y_N[KL_RIGHT];
        const double q = (double)o.wheelset[0].q_N[KL_RIGHT];
        assert_true(isfinite(y) && isfinite(q));
        mean_y += 0.02 * (y - mean_y);
        mean_q += 0.02 * (q - mean_q);
        if (i > 4000 && flange_touches(&o, 0, KL_RIGHT)) {
            climb.most = fmax(climb.most, mean_y / mean_q);
        }
    }
    unbuild(&b);
    return climb;
}

/*
 * Nadal 1896: Y/Q = (tan d - mu)/(1 + mu tan d), d the steepest angle, if all friction goes upwards. At
 * small yaw it does not: creep is not saturated, and of what is much goes along the rail, as the
 * flange's radius is larger. So the formula is a lower bound, approached as yaw grows; without
 * friction it is the limit itself. S1002's flange is at atan(2.747477419), 70 degrees, the roll adds
 * 0.16.
 */
static void wheel_climbs_at_nadals_limit(void **state) {
    (void)state;
    const double friction[] = {0.0, 0.1, 0.2, 0.3, 0.4};
    const double yaw[] = {0.0, 5e-3, 20e-3};
    const double tangent = tan(atan(2.747477419) + 0.0028);
    for (size_t i = 0; i < COUNT(friction); i++) {
        const double mu = friction[i];
        const double nadal = (tangent - mu) / (1.0 + mu * tangent);
        double last = 10.0;
        for (size_t k = 0; k < COUNT(yaw); k++) {
            const struct climb c = climb(mu, yaw[k]);
            print_message("mu %.1f, yaw %4.1f mrad: climbs at Y/Q %.3f, Nadal %.3f\n", mu,
                          1e3 * yaw[k], c.most, nadal);
            assert_true((c.faults & KL_FAULT_DERAILED) != 0);
            assert_true((c.faults & KL_FAULT_NONFINITE) == 0);
            assert_true(c.most > 0.995 * nadal);
            assert_true(c.most < 1.01 * tangent && c.most < 1.01 * last);
            last = c.most;
        }
        assert_at_most(last, (mu == 0.0 ? 1.005 : 1.04) * nadal);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(flange_rides_up_as_the_profiles_say),
        cmocka_unit_test(flange_touches_where_the_contact_jumps),
        cmocka_unit_test(tread_ends_where_the_flange_touches),
        cmocka_unit_test(two_contacts_share_the_load_by_hand),
        cmocka_unit_test(wheel_climbs_at_nadals_limit),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
