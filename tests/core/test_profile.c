/* Cross-sections: arcs against circles, the spline against its defining properties, refusals. */
#include "fixtures.h"

#define N 41

/* A head: circle of 300 mm, as points. */
struct points {
    double eta[N];
    double zeta[N];
    struct kl_profile_def def;
};

static void circle_points(struct points *p) {
    for (int i = 0; i < N; i++) {
        p->eta[i] = 1e-3 * (i - 20) + 2e-4 * sin(i);
        p->zeta[i] = 0.3 - sqrt(0.09 - p->eta[i] * p->eta[i]);
    }
    const struct kl_profile_def def = {
        .kind = KL_PROFILE_POINTS, .n_points = N, .eta_m = p->eta, .zeta_m = p->zeta};
    p->def = def;
}

static struct kl_profile made(const struct kl_profile_def *def, double rotate, struct memory *m) {
    struct kl_profile profile;
    struct kl_diag diag = {.what = ""};
    assert_int_equal(kl_profile_build(def, rotate, &m->arena, &profile, &diag), KL_OK);
    return profile;
}

/* Through (0, 0) with slope delta0; the centre lies at R (-sin, +cos): a convex head seen from
 * above. */
static void arc_is_a_circle(void **state) {
    (void)state;
    struct memory m = take_memory(4096);
    const struct kl_profile_def def = arc(0.25, 0.05, 0.04);
    const struct kl_profile p = made(&def, 0.0, &m);
    for (double eta = -0.04; eta <= 0.04; eta += 0.0007) {
        const struct kl_profile_point at = kl_profile_at(&p, eta);
        const double s = sin(0.05) + eta / 0.25;
        assert_near(at.zeta_m, 0.25 * (cos(0.05) - sqrt(1.0 - s * s)), 1e-16);
        assert_near(at.slope, s / sqrt(1.0 - s * s), 1e-14);
        assert_near(at.second_1_m, pow(1.0 - s * s, -1.5) / 0.25, 1e-12);
    }
    give_memory(&m);
}

static void cone_is_straight_and_turns_by_the_cant(void **state) {
    (void)state;
    struct memory m = take_memory(4096);
    const struct kl_profile_def def = arc(0.0, 0.05, 0.04);
    const struct kl_profile p = made(&def, 0.025, &m);
    const struct kl_profile_point at = kl_profile_at(&p, 0.03);
    assert_near(at.slope, tan(0.075), 1e-15);
    assert_near(at.zeta_m, 0.03 * tan(0.075), 1e-17);
    assert_near(at.second_1_m, 0.0, 0.0);
    give_memory(&m);
}

/* An arc keeps clear of its own vertical tangents, however wide it is said to be. */
static void arc_stays_on_its_circle(void **state) {
    (void)state;
    struct memory m = take_memory(4096);
    const struct kl_profile_def def = arc(0.013, 0.2, 0.05);
    const struct kl_profile p = made(&def, 0.0, &m);
    for (double eta = -0.06; eta <= 0.06; eta += 0.0003) {
        const struct kl_profile_point at = kl_profile_at(&p, eta);
        assert_true(isfinite(at.zeta_m) && isfinite(at.slope) && isfinite(at.second_1_m));
    }
    assert_true(p.eta_max_m < 0.013 && p.eta_min_m > -0.026);
    give_memory(&m);
}

static void spline_meets_its_points(void **state) {
    (void)state;
    struct memory m = take_memory(1u << 16);
    struct points pts;
    circle_points(&pts);
    const struct kl_profile p = made(&pts.def, 0.0, &m);
    for (int i = 0; i < N; i++) {
        assert_near(kl_profile_at(&p, pts.eta[i]).zeta_m, pts.zeta[i], 1e-16);
    }
    /* away from the free ends the cubic is as good as h^4: 1e-12 / 0.3^3 and less */
    for (double eta = -0.009; eta < 0.009; eta += 0.00013) {
        const double root = sqrt(0.09 - eta * eta);
        assert_near(kl_profile_at(&p, eta).zeta_m, 0.3 - root, 2e-12);
        assert_near(kl_profile_at(&p, eta).slope, eta / root, 3e-9);
    }
    give_memory(&m);
}

/* Value, slope and curvature go through every point without a step; slope is the derivative. */
static void spline_is_smooth_and_natural(void **state) {
    (void)state;
    struct memory m = take_memory(1u << 16);
    struct points pts;
    circle_points(&pts);
    const struct kl_profile p = made(&pts.def, 0.0, &m);
    const double d = 1e-9;
    for (int i = 1; i + 1 < N; i++) {
        const struct kl_profile_point a = kl_profile_at(&p, pts.eta[i] - d);
        const struct kl_profile_point b = kl_profile_at(&p, pts.eta[i] + d);
        assert_near(b.zeta_m - a.zeta_m, 2.0 * d * a.slope, 1e-15);
        assert_near(b.slope, a.slope, 3.0 * d * 4.0);
        assert_near(b.second_1_m, a.second_1_m, 1e-3);
    }
    for (double eta = -0.0195; eta < 0.0195; eta += 0.00037) {
        const double h = 1e-6;
        const double up = kl_profile_at(&p, eta + h).zeta_m;
        const double down = kl_profile_at(&p, eta - h).zeta_m;
        assert_near((up - down) / (2.0 * h), kl_profile_at(&p, eta).slope, 1e-8);
    }
    assert_near(kl_profile_at(&p, pts.eta[0]).second_1_m, 0.0, 1e-12);
    assert_near(kl_profile_at(&p, pts.eta[N - 1]).second_1_m, 0.0, 1e-12);
    give_memory(&m);
}

/* A natural spline of any points on a line is the line. */
static void spline_of_a_line(void **state) {
    (void)state;
    struct memory m = take_memory(1u << 16);
    struct points pts;
    circle_points(&pts);
    for (int i = 0; i < N; i++) {
        pts.zeta[i] = 0.002 + 0.04 * pts.eta[i];
    }
    const struct kl_profile p = made(&pts.def, 0.0, &m);
    for (double eta = -0.05; eta < 0.05; eta += 0.0011) { /* beyond the ends too */
        assert_near(kl_profile_at(&p, eta).zeta_m, 0.002 + 0.04 * eta, 1e-16);
        assert_near(kl_profile_at(&p, eta).slope, 0.04, 1e-13);
    }
    give_memory(&m);
}

static void outside_the_ends_tangent_continues(void **state) {
    (void)state;
    struct memory m = take_memory(1u << 16);
    struct points pts;
    circle_points(&pts);
    const struct kl_profile_def defs[] = {pts.def, arc(0.25, 0.05, 0.02)};
    for (size_t i = 0; i < COUNT(defs); i++) {
        const struct kl_profile p = made(&defs[i], 0.0, &m);
        const double ends[] = {p.eta_min_m, p.eta_max_m};
        for (int e = 0; e < 2; e++) {
            const struct kl_profile_point end = kl_profile_at(&p, ends[e]);
            const double by = e == 0 ? -0.004 : 0.004;
            const struct kl_profile_point out = kl_profile_at(&p, ends[e] + by);
            assert_near(out.zeta_m, end.zeta_m + by * end.slope, 1e-16);
            assert_near(out.slope, end.slope, 0.0);
            assert_near(out.second_1_m, 0.0, 0.0);
        }
    }
    give_memory(&m);
}

/* Turning by an angle adds it to every slope and moves the points as a rigid body. */
static void rotation_is_rigid(void **state) {
    (void)state;
    struct memory m = take_memory(1u << 16);
    struct points pts;
    circle_points(&pts);
    const double a = 0.025;
    const struct kl_profile p = made(&pts.def, a, &m);
    for (int i = 0; i < N; i++) {
        const double eta = pts.eta[i] * cos(a) - pts.zeta[i] * sin(a);
        const double zeta = pts.eta[i] * sin(a) + pts.zeta[i] * cos(a);
        assert_near(kl_profile_at(&p, eta).zeta_m, zeta, 1e-16);
    }
    const double eta0 = pts.eta[25] * cos(a) - pts.zeta[25] * sin(a);
    const double slope0 = pts.eta[25] / sqrt(0.09 - pts.eta[25] * pts.eta[25]);
    assert_near(atan(kl_profile_at(&p, eta0).slope), atan(slope0) + a, 1e-8);
    give_memory(&m);
}

/* ---- refusals ---- */

struct refusal {
    enum kl_status status;
    int32_t index;
    const char *word; /* in the reason */
};

static void refused_at(const struct kl_profile_def *def, double rotate, struct refusal want,
                       int line) {
    struct memory m = take_memory(1u << 18);
    struct kl_profile profile;
    struct kl_diag diag = {.what = ""};
    const enum kl_status status = kl_profile_build(def, rotate, &m.arena, &profile, &diag);
    if (status != want.status || diag.status != want.status || diag.index != want.index ||
        strstr(diag.what, want.word) == NULL) {
        print_error("got %d, index %d, '%s'; wanted %d, index %d, '...%s...'\n", status,
                    (int)diag.index, diag.what, want.status, (int)want.index, want.word);
        _fail(__FILE__, line);
    }
    assert_int_equal(kl_profile_build(def, rotate, &m.arena, &profile, NULL), want.status);
    give_memory(&m);
}
#define REFUSED(def, rotate, ...)                                                                  \
    refused_at((def), (rotate), (struct refusal){__VA_ARGS__}, __LINE__)

static void bad_points_are_refused(void **state) {
    (void)state;
    struct points pts;
    circle_points(&pts);
    pts.def.n_points = KL_PROFILE_MIN_POINTS - 1u;
    REFUSED(&pts.def, 0.0, KL_ERR_PROFILE, -1, "number of points");
    pts.def.n_points = KL_PROFILE_MAX_POINTS + 1u;
    REFUSED(&pts.def, 0.0, KL_ERR_PROFILE, -1, "number of points");
    pts.def.n_points = 0;
    REFUSED(&pts.def, 0.0, KL_ERR_PROFILE, -1, "number of points");
    const double bad[] = {(double)NAN, (double)INFINITY, -(double)INFINITY, 1.5, -1e300};
    for (size_t i = 0; i < COUNT(bad); i++) {
        circle_points(&pts);
        pts.eta[7] = bad[i];
        REFUSED(&pts.def, 0.0, KL_ERR_VALUE, 7, "not finite");
        circle_points(&pts);
        pts.zeta[N - 1] = bad[i];
        REFUSED(&pts.def, 0.0, KL_ERR_VALUE, N - 1, "not finite");
    }
    circle_points(&pts);
    pts.eta[20] = pts.eta[19];
    REFUSED(&pts.def, 0.0, KL_ERR_PROFILE, 20, "grow");
    pts.eta[20] = pts.eta[18];
    REFUSED(&pts.def, 0.0, KL_ERR_PROFILE, 20, "grow");
    circle_points(&pts);
    pts.zeta[11] = pts.zeta[10] + 150.0 * (pts.eta[11] - pts.eta[10]);
    REFUSED(&pts.def, 0.0, KL_ERR_PROFILE, 11, "steep");
    circle_points(&pts);
    pts.def.eta_m = NULL;
    REFUSED(&pts.def, 0.0, KL_ERR_ARGUMENT, -1, "points");
}

/* A flank that is monotonic as drawn can hang over once the rail is inclined. */
static void overhang_after_turning_is_refused(void **state) {
    (void)state;
    struct points pts;
    circle_points(&pts);
    for (int i = 35; i < N; i++) {
        pts.zeta[i] = pts.zeta[34] + 60.0 * (pts.eta[i] - pts.eta[34]);
    }
    struct memory m = take_memory(1u << 16);
    struct kl_profile profile;
    assert_int_equal(kl_profile_build(&pts.def, 0.0, &m.arena, &profile, NULL), KL_OK);
    REFUSED(&pts.def, 0.025, KL_ERR_PROFILE, 35, "grow");
    give_memory(&m);
}

static void bad_arcs_are_refused(void **state) {
    (void)state;
    const double bad[] = {(double)NAN, (double)INFINITY, -0.1};
    for (size_t i = 0; i < COUNT(bad); i++) {
        struct kl_profile_def def = arc(bad[i], 0.05, 0.03);
        REFUSED(&def, 0.0, KL_ERR_VALUE, -1, "radius_m");
        def = arc(0.3, 0.05, bad[i]);
        REFUSED(&def, 0.0, KL_ERR_VALUE, -1, "half_width_m");
        def = arc(0.3, i == 2 ? 0.5 : bad[i], 0.03);
        REFUSED(&def, 0.0, KL_ERR_VALUE, -1, "slope_rad");
        def = arc(0.3, 0.05, 0.03);
        REFUSED(&def, i == 2 ? -0.5 : bad[i], KL_ERR_VALUE, -1, "rotation");
    }
    struct kl_profile_def def = arc(0.3, 0.05, 0.0);
    REFUSED(&def, 0.0, KL_ERR_VALUE, -1, "half_width_m");
    def = arc(0.3, 0.05, 0.03);
    def.kind = (enum kl_profile_kind)7;
    REFUSED(&def, 0.0, KL_ERR_VALUE, -1, "kind");
}

static void null_arguments_are_refused(void **state) {
    (void)state;
    struct memory m = take_memory(64);
    struct kl_profile profile;
    const struct kl_profile_def def = arc(0.3, 0.05, 0.03);
    assert_int_equal(kl_profile_build(NULL, 0.0, &m.arena, &profile, NULL), KL_ERR_ARGUMENT);
    assert_int_equal(kl_profile_build(&def, 0.0, NULL, &profile, NULL), KL_ERR_ARGUMENT);
    assert_int_equal(kl_profile_build(&def, 0.0, &m.arena, NULL, NULL), KL_ERR_ARGUMENT);
    give_memory(&m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(arc_is_a_circle),
        cmocka_unit_test(cone_is_straight_and_turns_by_the_cant),
        cmocka_unit_test(arc_stays_on_its_circle),
        cmocka_unit_test(spline_meets_its_points),
        cmocka_unit_test(spline_is_smooth_and_natural),
        cmocka_unit_test(spline_of_a_line),
        cmocka_unit_test(outside_the_ends_tangent_continues),
        cmocka_unit_test(rotation_is_rigid),
        cmocka_unit_test(bad_points_are_refused),
        cmocka_unit_test(overhang_after_turning_is_refused),
        cmocka_unit_test(bad_arcs_are_refused),
        cmocka_unit_test(null_arguments_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
