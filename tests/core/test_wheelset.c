/* One wheelset in motion: against an independent integration, Klingel's wavelength, the rolling
 * line in a curve, and the critical speeds of physics.md section 8. */
#include "fixtures.h"

#define PI 3.14159265358979323846

/* ---- tests/reference/wheelset_run.py ---- */

static void reference_wheelset(struct vehicle *v, int she) {
    struct kl_pair_def pair = arcs_pair(KL_KINEMATICS_RIGID);
    single_wheelset(v, pair, 1e6, 1e6);
    v->wheelset[0].load_N = 1e5 - 1250.0 * 9.81;
    if (!she) {
        v->wheelset[0].creep = constant_creep();
        v->wheelset[0].creep.f23_Nm = (kl_real)13.7e3;
        v->wheelset[0].creep.f33_Nm2 = (kl_real)20.0;
    }
}

#define COLUMNS 11
static const char *const column_name[COLUMNS] = {
    "y_m",      "psi_rad",    "y_rate_m_s", "psi_rate_rad_s", "spin_rad_s", "N_right_N",
    "N_left_N", "T1_right_N", "T1_left_N",  "T2_right_N",     "T2_left_N"};

static void columns_of(const struct kl_output *o, double *column) {
    const struct kl_wheelset_output *w = &o->wheelset[0];
    const double values[COLUMNS] = {(double)w->y_m,
                                    (double)w->yaw_rad,
                                    (double)w->y_rate_m_s,
                                    (double)w->yaw_rate_rad_s,
                                    (double)w->spin_rad_s,
                                    (double)w->tread.normal_N[KL_RIGHT],
                                    (double)w->tread.normal_N[KL_LEFT],
                                    (double)w->tread.t1_N[KL_RIGHT],
                                    (double)w->tread.t1_N[KL_LEFT],
                                    (double)w->tread.t2_N[KL_RIGHT],
                                    (double)w->tread.t2_N[KL_LEFT]};
    memcpy(column, values, sizeof values);
}

struct comparison {
    double low[COLUMNS];
    double high[COLUMNS];
    double worst[COLUMNS];
};

/* Runs one law from y = 3 mm and compares at every millisecond; `steps` steps make one. */
static void compare_run(const char *law, int64_t step_ns, struct comparison *c) {
    struct vehicle v;
    struct built b;
    struct kl_state x;
    struct kl_output o;
    struct kl_input input;
    reference_wheelset(&v, strcmp(law, "she") == 0);
    v.def.step_ns = step_ns;
    build(&v, &b);
    assert_int_equal(kl_init(&b.model, &x, 0, 30, work()), KL_OK);
    wheelset_x(&b.model, &x, 0)[KL_WS_Y] = (kl_real)3e-3;
    kl_refresh(&b.model, &x, work());
    kl_input_init(&input);
    input.speed_m_s = 30;
    for (int k = 0; k < COLUMNS; k++) {
        c->low[k] = DBL_MAX;
        c->high[k] = -DBL_MAX;
        c->worst[k] = 0.0;
    }
    struct csv csv;
    int rows = 0;
    csv_open(&csv, "tests/reference/wheelset_run.csv");
    while (csv_next(&csv)) {
        if (!csv_is(&csv, "law", law)) {
            continue;
        }
        const double t_ms = 1e3 * csv_named(&csv, "t_s");
        if (t_ms > 0.5) {
            assert_int_equal(coast(&b.model, &x, (uint64_t)(1000000 / step_ns), NULL), 0);
        }
        double got[COLUMNS];
        kl_observe(&b.model, &x, &input, &o, work());
        columns_of(&o, got);
        for (int k = 0; k < COLUMNS; k++) {
            const double want = csv_named(&csv, column_name[k]);
            c->low[k] = fmin(c->low[k], want);
            c->high[k] = fmax(c->high[k], want);
            c->worst[k] = fmax(c->worst[k], fabs(got[k] - want));
        }
        rows++;
    }
    csv_close(&csv);
    assert_int_equal(rows, 1001);
    unbuild(&b);
}

/* Tolerances, as parts of each column's range over the run. */
struct tolerances {
    double motion; /* y, psi and their rates */
    double spin;  /* its range is 2e-4 of itself: a mode of 1000 1/s that dies in the first steps */
    double creep; /* T1, T2 */
    double normal; /* 3e-3 of the range is 1e-4 of the load */
};

static void motion_at(int64_t step_ns, const struct tolerances *t) {
    const char *const laws[] = {"linear", "she"};
    for (int i = 0; i < 2; i++) {
        struct comparison c;
        compare_run(laws[i], step_ns, &c);
        for (int k = 0; k < COLUMNS; k++) {
            const double part = c.worst[k] / (c.high[k] - c.low[k]);
            print_message("%s, %g ms: %s differs by %.2e of its range\n", laws[i],
                          1e-6 * (double)step_ns, column_name[k], part);
            assert_at_most(part, k < 4    ? t->motion
                                 : k == 4 ? t->spin
                                 : k < 7  ? t->normal
                                          : t->creep);
        }
    }
}

static void motion_agrees_at_50_us(void **state) {
    (void)state;
    const struct tolerances t = {.motion = 1e-4, .spin = 5e-4, .creep = 4e-4, .normal = 3e-3};
    motion_at(50000, &t);
}

static void motion_agrees_at_1_ms(void **state) {
    (void)state;
    const struct tolerances t = {.motion = 4e-3, .spin = 4e-2, .creep = 1.5e-2, .normal = 6e-3};
    motion_at(1000000, &t);
}

static void compare_wheel(const struct csv *csv, const char *side,
                          const struct kl_contact_output *tread, int s) {
    const char *const force[] = {"N", "T1", "T2", "M3"};
    const double got[] = {(double)tread->normal_N[s], (double)tread->t1_N[s],
                          (double)tread->t2_N[s], (double)tread->m3_Nm[s]};
    const double tolerance[] = {2e-4 * 5e4, 1e-3 * 327.0, 1e-3 * 6300.0, 4e-3 * 7.0};
    for (int k = 0; k < 4; k++) {
        char column[32];
        (void)snprintf(column, sizeof column, "%s_%s_%s", force[k], side, k < 3 ? "N" : "Nm");
        assert_near(got[k], csv_named(csv, column), tolerance[k]);
    }
}

/* Steady state in a curve: run until all is quiet, then everything of the reference's row. */
static void curving_agrees_with_the_reference(void **state) {
    (void)state;
    struct csv csv;
    int rows = 0;
    csv_open(&csv, "tests/reference/wheelset_curve.csv");
    while (csv_next(&csv)) {
        struct vehicle v;
        struct built b;
        struct kl_state x;
        struct kl_output o;
        reference_wheelset(&v, csv_is(&csv, "law", "she"));
        v.pair[0].range_m = 0.012;
        endless_curve(&v, csv_named(&csv, "kappa_1_m"), csv_named(&csv, "cant_rad"));
        build(&v, &b);
        assert_int_equal(kl_init(&b.model, &x, 0, 30, work()), KL_OK);
        wheelset_x(&b.model, &x, 0)[KL_WS_Y] = (kl_real)(0.8 * csv_named(&csv, "y_m"));
        kl_refresh(&b.model, &x, work());
        assert_int_equal(coast(&b.model, &x, 20000, &o), 0);
        const struct kl_wheelset_output *w = &o.wheelset[0];
        assert_near((double)w->y_m, csv_named(&csv, "y_m"), 3e-4 * 5.7e-3);
        assert_near((double)w->yaw_rad, csv_named(&csv, "psi_rad"), 1e-3 * 4.7e-4);
        assert_near((double)w->spin_rad_s, csv_named(&csv, "spin_rad_s"), 1e-6 * 66.0);
        assert_near((double)w->z_m, csv_named(&csv, "z_m"), 0.04 * 1.4e-4);
        assert_near((double)w->roll_rad, csv_named(&csv, "phi_rad"), 3e-4 * 3.9e-4);
        compare_wheel(&csv, "right", &w->tread, KL_RIGHT);
        compare_wheel(&csv, "left", &w->tread, KL_LEFT);
        unbuild(&b);
        rows++;
    }
    csv_close(&csv);
    assert_int_equal(rows, 10);
}

/* ---- Klingel ---- */

static struct kl_linear_geometry linear_of(const struct kl_pair_def *def) {
    struct memory m = take_memory(1u << 20);
    struct kl_linear_geometry g;
    assert_int_equal(kl_pair_linear(def, &m.arena, &g, NULL), KL_OK);
    give_memory(&m);
    return g;
}

/* A wheelset with nothing but its own weight on the rails. */
static void free_wheelset(struct vehicle *v, struct kl_pair_def pair) {
    single_wheelset(v, pair, 0.0, 0.0);
    v->wheelset[0].creep = constant_creep();
}

/* Distance of whole waves between upward zero crossings of y, over their number. */
static double wavelength(const struct kl_model *model, struct kl_state *x, int waves) {
    const int32_t y = kl_wheelset_state_index(model, 0, KL_WS_Y);
    double first = 0.0;
    double last = 0.0;
    int crossings = 0;
    for (int i = 0; i < 1000000 && crossings <= waves; i++) {
        const double before = (double)x->x[y];
        const double s = (double)x->s_m;
        assert_int_equal(coast(model, x, 1, NULL), 0);
        const double after = (double)x->x[y];
        if (before < 0.0 && after >= 0.0) {
            const double at = s + ((double)x->s_m - s) * before / (before - after);
            first = crossings == 0 ? at : first;
            last = at;
            crossings++;
        }
    }
    assert_int_equal(crossings, waves + 1);
    return (last - first) / waves;
}

/*
 * Klingel: 2 pi sqrt(r0 l/lambda), with lambda per displacement AT THE RAIL. A wheelset on inclined
 * contacts rolls as it moves: at the rail it moves by u* = (1 - r0 phi_y) u, so that there lambda
 * is lambda0/(1 - r0 phi_y). On level contacts phi_y = 0 and the two are one.
 */
static void wave_of(struct kl_pair_def pair) {
    struct vehicle v;
    struct built b;
    struct kl_state x;
    const struct kl_linear_geometry g = linear_of(&pair);
    const double at_rail = g.conicity / (1.0 - g.radius_m * g.phi_y_rad_m);
    const double want = 2.0 * PI * sqrt(g.radius_m * g.half_base_m / at_rail);
    free_wheelset(&v, pair);
    build(&v, &b);
    assert_int_equal(kl_init(&b.model, &x, 0, 2, work()), KL_OK);
    wheelset_x(&b.model, &x, 0)[KL_WS_Y] = (kl_real)1e-3;
    kl_refresh(&b.model, &x, work());
    const double got = wavelength(&b.model, &x, 4);
    print_message("wavelength %.5f m, Klingel %.5f m: %+.4f %%\n", got, want,
                  100.0 * (got / want - 1.0));
    assert_near(got / want, 1.0, 1e-4);
    unbuild(&b);
}

static void klingels_wavelength(void **state) {
    (void)state;
    wave_of(linear_pair(0.1144)); /* 10.757 m, physics.md section 8 */
    wave_of(linear_pair(0.05));
    wave_of(cones_pair(0.05));
    wave_of(cones_pair(0.025));
}

/* Newton on y, psi, Omega until the accelerations vanish; rates and track stay as they are. */
static void balance(const struct kl_model *model, struct kl_state *x) {
    static const int unknown[3] = {KL_WS_Y, KL_WS_YAW, KL_WS_SPIN};
    static const int known[3] = {KL_WS_Y_RATE, KL_WS_YAW_RATE, KL_WS_SPIN};
    static const double step[3] = {1e-8, 1e-8, 1e-6};
    struct kl_input input;
    kl_input_init(&input);
    input.speed_m_s = x->speed_m_s;
    kl_real *q = wheelset_x(model, x, 0);
    for (int round = 0; round < 20; round++) {
        kl_real at[KL_MAX_STATES];
        kl_real near[KL_MAX_STATES];
        double a[3][4];
        kl_rates(model, x, &input, at, work());
        for (int j = 0; j < 3; j++) {
            const kl_real kept = q[unknown[j]];
            q[unknown[j]] = kept + (kl_real)step[j];
            kl_rates(model, x, &input, near, work());
            q[unknown[j]] = kept;
            for (int i = 0; i < 3; i++) {
                a[i][j] = (double)(near[known[i]] - at[known[i]]) / step[j];
                a[i][3] = -(double)at[known[i]];
            }
        }
        for (int i = 0; i < 3;
             i++) { /* Gauss-Jordan; yaw is the pivot of y and the other way round */
            int pivot = i;
            for (int r = i; r < 3; r++) {
                pivot = fabs(a[r][i]) > fabs(a[pivot][i]) ? r : pivot;
            }
            for (int k = 0; k < 4; k++) {
                const double swap = a[i][k];
                a[i][k] = a[pivot][k];
                a[pivot][k] = swap;
            }
            for (int r = 0; r < 3; r++) {
                const double part = r == i ? 0.0 : a[r][i] / a[i][i];
                for (int k = i; k < 4; k++) {
                    a[r][k] -= part * a[i][k];
                }
            }
        }
        for (int j = 0; j < 3; j++) {
            q[unknown[j]] += (kl_real)(a[j][3] / a[j][j]);
        }
    }
    kl_real rest[KL_MAX_STATES];
    kl_rates(model, x, &input, rest, work());
    for (int i = 0; i < KL_WHEELSET_STATES; i++) {
        assert_near((double)rest[i], 0.0, 1e-7);
    }
}

/* Steady curve: y = -r0 l kappa/lambda, outwards, where cant and speed are in balance. */
static void rolling_line(void **state) {
    (void)state;
    const struct kl_pair_def pairs[] = {linear_pair(0.1144), cones_pair(0.05), cones_pair(0.025)};
    for (size_t i = 0; i < COUNT(pairs); i++) {
        for (int turn = -1; turn <= 1; turn += 2) {
            const double kappa = turn / 2400.0;
            const double v = 5.0;
            const struct kl_linear_geometry g = linear_of(&pairs[i]);
            const double want = -g.radius_m * g.half_base_m * kappa / g.conicity;
            struct vehicle vehicle;
            struct built b;
            struct kl_state x;
            free_wheelset(&vehicle, pairs[i]);
            endless_curve(&vehicle, kappa, kappa * v * v / 9.81);
            build(&vehicle, &b);
            assert_int_equal(kl_init(&b.model, &x, 0, (kl_real)v, work()), KL_OK);
            balance(&b.model, &x);
            const double got = (double)wheelset_x(&b.model, &x, 0)[KL_WS_Y];
            print_message("rolls at %.5f mm, formula %.5f mm: %+.3f %%\n", 1e3 * got, 1e3 * want,
                          100.0 * (got / want - 1.0));
            assert_near(got / want, 1.0, 1e-4);
            unbuild(&b);
        }
    }
}

/* ---- critical speeds ---- */

static double largest_y(const struct kl_model *model, struct kl_state *x, int steps) {
    const int32_t y = kl_wheelset_state_index(model, 0, KL_WS_Y);
    double largest = 0.0;
    for (int i = 0; i < steps; i++) {
        coast(model, x, 1, NULL);
        largest = fmax(largest, fabs((double)x->x[y]));
    }
    return largest;
}

/* Growth of the lateral amplitude over 6 s, after 3 s in which all but hunting has died. */
static double growth(double k_y, double k_yaw, double speed) {
    struct vehicle v;
    struct built b;
    struct kl_state x;
    single_wheelset(&v, linear_pair(0.1144), k_y, k_yaw);
    v.wheelset[0].creep = constant_creep();
    v.def.gravity_m_s2 = 0.0;
    v.def.step_ns = 250000;
    build(&v, &b);
    assert_int_equal(kl_init(&b.model, &x, 0, (kl_real)speed, work()), KL_OK);
    wheelset_x(&b.model, &x, 0)[KL_WS_Y] = (kl_real)1e-4;
    kl_refresh(&b.model, &x, work());
    coast(&b.model, &x, 12000, NULL);
    const double early = largest_y(&b.model, &x, 4000);
    coast(&b.model, &x, 20000, NULL);
    const double late = largest_y(&b.model, &x, 4000);
    unbuild(&b);
    return late / early;
}

static void critical_speeds_are_bracketed(void **state) {
    (void)state;
    static const double cases[][3] = {{0.23e6, 2.5e6, 75.294193},
                                      {1e6, 1e6, 56.880268},
                                      {5e6, 0.0, 81.970103},
                                      {0.0, 5e6, 118.970116}};
    for (size_t i = 0; i < COUNT(cases); i++) {
        const double critical = cases[i][2];
        const double below = growth(cases[i][0], cases[i][1], 0.995 * critical);
        const double above = growth(cases[i][0], cases[i][1], 1.005 * critical);
        print_message(
            "k_y %g, k_psi %g: amplitude over 6 s times %.3f below, %.3f above %.3f m/s\n",
            cases[i][0], cases[i][1], below, above, critical);
        assert_true(below < 1.0 && above > 1.0);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(motion_agrees_at_50_us),
        cmocka_unit_test(motion_agrees_at_1_ms),
        cmocka_unit_test(curving_agrees_with_the_reference),
        cmocka_unit_test(klingels_wavelength),
        cmocka_unit_test(rolling_line),
        cmocka_unit_test(critical_speeds_are_bracketed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
