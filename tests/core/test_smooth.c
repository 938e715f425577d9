/*
 * Smoothing of measured profiles: points of S1002 and UIC60 from their definitions with seeded
 * noise, against the curvature, slope and contact that the definitions have.
 *
 * What noise leaves is bounded from below: among n points over a length L, sigma off, no estimate of
 * a slope is better than sigma sqrt(12/n)/L. 20 mm of UIC60's 300 mm arc with points every 0.1 mm and
 * 10 um of noise: 1.2e-4, and S1002 on it has a relative curvature of only 0.2 to 1 1/m about the
 * tape line, so that the contact point there is known to some tenths of a millimetre at best. The
 * bounds below are stated with that in view.
 */
#include "fixtures.h"

#include "kl_smooth.h"
#include "profiles.h"

#define ARENA_BYTES (8u << 20)
#define MOST 4096

typedef struct kl_profile_point (*definition)(double eta_m);

struct measured {
    uint32_t n;
    double eta[MOST];
    double zeta[MOST];
};

/* Nearly normal: the sum of twelve. */
static double noise(uint64_t *seed) {
    double sum = 0.0;
    for (int i = 0; i < 12; i++) {
        sum += random_between(seed, -0.5, 0.5);
    }
    return sum;
}

/* Points every `spacing` along the section, off it along its normal. */
static void measure(struct measured *m, definition at, double spacing, double sigma,
                    uint64_t *seed) {
    const int wheel = at == s1002_at;
    const double to = wheel ? S1002_TO_M : UIC60_HALF_M;
    m->n = 0;
    for (double eta = wheel ? S1002_FROM_M : -UIC60_HALF_M; eta <= to;) {
        const struct kl_profile_point p = at(eta);
        const double c = 1.0 / sqrt(1.0 + p.slope * p.slope);
        const double off = sigma > 0.0 ? sigma * noise(seed) : 0.0;
        assert_true(m->n < MOST);
        m->eta[m->n] = eta - off * p.slope * c;
        m->zeta[m->n] = p.zeta_m + off * c;
        m->n++;
        eta += spacing * c;
    }
}

static struct kl_profile_def def_of(const struct measured *m, double smoothing) {
    const struct kl_profile_def def = {.kind = KL_PROFILE_POINTS,
                                       .n_points = m->n,
                                       .eta_m = m->eta,
                                       .zeta_m = m->zeta,
                                       .smoothing_m = smoothing};
    return def;
}

static struct kl_profile made(const struct kl_profile_def *def, double rotate, struct memory *m) {
    struct kl_profile profile;
    struct kl_diag diag = {.what = ""};
    if (kl_profile_build(def, rotate, &m->arena, &profile, &diag) != KL_OK) {
        fail_msg("%s: %g (point %d)", diag.what, diag.value, (int)diag.index);
    }
    return profile;
}

/* ---- against the definitions ---- */

/* A stretch of a section, mm, and the largest errors allowed there. */
struct stretch {
    definition at;
    double from_mm;
    double to_mm;
    double curvature_1_m;
    double slope;
};

static void check_stretch(const struct kl_profile *profile, const struct stretch *s,
                          double *deviation, int *count) {
    for (double eta = 1e-3 * s->from_mm; eta <= 1e-3 * s->to_mm; eta += 1e-4) {
        const struct kl_profile_point got = kl_profile_at(profile, eta);
        const struct kl_profile_point want = s->at(eta);
        assert_near(curvature_of(got), curvature_of(want), s->curvature_1_m);
        assert_near(atan(got.slope), atan(want.slope), s->slope);
        *deviation += (got.zeta_m - want.zeta_m) * (got.zeta_m - want.zeta_m);
        ++*count;
    }
}

static void noisy(double spacing, double sigma, const struct stretch *stretch, size_t n) {
    static struct measured points[2];
    for (uint64_t start = 1; start <= 8; start++) {
        uint64_t seed = start * 7919;
        struct memory m = take_memory(ARENA_BYTES);
        measure(&points[0], s1002_at, spacing, sigma, &seed);
        measure(&points[1], uic60_at, spacing, sigma, &seed);
        const struct kl_profile_def wheel = def_of(&points[0], 1.5 * sigma);
        const struct kl_profile_def rail = def_of(&points[1], 1.5 * sigma);
        const struct kl_profile p[] = {made(&wheel, 0.0, &m), made(&rail, 0.0, &m)};
        double sum = 0.0;
        int count = 0;
        for (size_t i = 0; i < n; i++) {
            check_stretch(&p[stretch[i].at == uic60_at], &stretch[i], &sum, &count);
        }
        assert_at_most(sqrt(sum / count), 0.25 * sigma); /* the curve is nearer than the points */
        give_memory(&m);
    }
}

/* Curvatures of the definitions: S1002's tread -3..11 1/m, its throat up to 77; UIC60 3.33, 12.5,
 * 77 1/m. Interpolation of these points gives thousands. */
static void curvature_of_noisy_points(void **state) {
    (void)state;
    static const struct stretch fine[] = {
        {s1002_at, -55.0, -34.0, 1.5, 2e-3}, {s1002_at, -30.0, 20.0, 1.5, 3e-3},
        {s1002_at, 20.0, 30.0, 5.0, 6e-3},   {uic60_at, -8.0, 8.0, 1.5, 2.5e-3},
        {uic60_at, 13.0, 23.0, 6.0, 6e-3},   {uic60_at, 29.0, 32.0, 20.0, 8e-3}};
    static const struct stretch coarse[] = {{s1002_at, -55.0, -34.0, 2.5, 4e-3},
                                            {s1002_at, -30.0, 20.0, 2.5, 6e-3},
                                            {uic60_at, -8.0, 8.0, 2.5, 6e-3},
                                            {uic60_at, 13.0, 23.0, 12.0, 15e-3}};
    noisy(1e-4, 10e-6, fine, COUNT(fine));
    noisy(2e-4, 10e-6, coarse, COUNT(coarse));
    noisy(1e-4, 20e-6, coarse, COUNT(coarse));
}

/* Exact points are not rounded off by a generous tolerance: they foretell one another. */
static void exact_points_stay_exact(void **state) {
    (void)state;
    static struct measured points;
    static const struct stretch exact[] = {{s1002_at, -30.0, 20.0, 0.02, 1e-5},
                                           {uic60_at, -8.0, 8.0, 0.02, 1e-5},
                                           {uic60_at, 13.0, 23.0, 0.05, 1e-5}};
    struct memory m = take_memory(ARENA_BYTES);
    double sum = 0.0;
    int count = 0;
    for (size_t i = 0; i < COUNT(exact); i++) {
        measure(&points, exact[i].at, 2e-4, 0.0, NULL);
        const struct kl_profile_def def = def_of(&points, 20e-6);
        const struct kl_profile p = made(&def, 0.0, &m);
        check_stretch(&p, &exact[i], &sum, &count);
    }
    assert_at_most(sqrt(sum / count), 5e-9);
    give_memory(&m);
}

/* ---- contact ---- */

static struct kl_pair_def pair_from(const struct measured points[2], double smoothing) {
    struct kl_pair_def def = s1002_uic60();
    for (int s = 0; s < KL_SIDES; s++) {
        def.wheel[s].profile = def_of(&points[0], smoothing);
        def.rail[s].profile = def_of(&points[1], smoothing);
    }
    def.range_m = 0.006;
    return def;
}

static double rrd(const struct kl_posture *p) {
    return (double)(p->row[KL_RIGHT].radius_m - p->row[KL_LEFT].radius_m);
}

/* The largest error of the contact point and of the rolling-radius difference, 0.5 to 4.5 mm. */
static void contact_errors(double sigma, uint64_t start, double *point_m, double *radius_m) {
    static struct measured exact[2];
    static struct measured points[2];
    struct memory m = take_memory(ARENA_BYTES);
    struct kl_pair pair[2];
    uint64_t seed = start * 7919;
    measure(&exact[0], s1002_at, 1e-4, 0.0, NULL);
    measure(&exact[1], uic60_at, 1e-4, 0.0, NULL);
    measure(&points[0], s1002_at, 1e-4, sigma, &seed);
    measure(&points[1], uic60_at, 1e-4, sigma, &seed);
    const struct kl_pair_def def[] = {pair_from(exact, 0.0), pair_from(points, 1.5 * sigma)};
    for (int i = 0; i < 2; i++) {
        assert_int_equal(kl_pair_build(&def[i], &m.arena, &pair[i], NULL), KL_OK);
    }
    assert_int_equal(pair[1].side[0].n_jumps, pair[0].side[0].n_jumps); /* noise makes no more */
    *point_m = 0.0;
    *radius_m = 0.0;
    for (double u = 0.0005; u < 0.0046; u += 0.0005) {
        struct kl_posture p[2];
        for (int i = 0; i < 2; i++) {
            assert_int_equal(kl_pair_posture(&pair[i], u, &p[i]), KL_OK);
        }
        for (int s = 0; s < KL_SIDES; s++) {
            const double off = (double)(p[1].row[s].eta_wheel_m - p[0].row[s].eta_wheel_m);
            *point_m = fmax(*point_m, fabs(off));
        }
        *radius_m = fmax(*radius_m, fabs(rrd(&p[1]) - rrd(&p[0])));
    }
    give_memory(&m);
}

static void contact_of_noisy_points(void **state) {
    (void)state;
    /* noise, contact point, rolling-radius difference */
    static const double bound[][3] = {
        {1e-6, 3e-4, 1.5e-5}, {2e-6, 4e-4, 3e-5}, {1e-5, 1.5e-3, 1e-4}};
    for (size_t i = 0; i < COUNT(bound); i++) {
        for (uint64_t start = 1; start <= 3; start++) {
            double point_m;
            double radius_m;
            contact_errors(bound[i][0], start, &point_m, &radius_m);
            print_message("%g um, seed %d: contact point %.3f mm, radius difference %.4f mm\n",
                          1e6 * bound[i][0], (int)start, 1e3 * point_m, 1e3 * radius_m);
            assert_at_most(point_m, bound[i][1]);
            assert_at_most(radius_m, bound[i][2]);
        }
    }
}

/* ---- properties ---- */

/* The root of the mean square distance of the points from the finished profile, along the normal. */
static double deviation(const struct measured *points, const struct kl_profile *p) {
    double sum = 0.0;
    for (uint32_t i = 0; i < points->n; i++) {
        const struct kl_profile_point at = kl_profile_at(p, points->eta[i]);
        const double off = (at.zeta_m - points->zeta[i]) / sqrt(1.0 + at.slope * at.slope);
        sum += off * off;
    }
    return sqrt(sum / points->n);
}

static void tolerance_is_kept(void **state) {
    (void)state;
    static struct measured points;
    struct memory m = take_memory(ARENA_BYTES);
    uint64_t seed = 5;
    measure(&points, uic60_at, 2e-4, 1e-5, &seed);
    for (double tolerance = 6e-6; tolerance < 1e-3; tolerance *= 1.7) {
        const struct kl_profile_def def = def_of(&points, tolerance);
        const struct kl_profile p = made(&def, 0.0, &m);
        assert_at_most(deviation(&points, &p), fmin(1.02 * tolerance, 1.1e-5));
    }
    give_memory(&m);
}

/* Turning before or after smoothing is the same. */
static void smoothing_turns_with_the_section(void **state) {
    (void)state;
    static struct measured points;
    static struct measured turned;
    struct memory m = take_memory(ARENA_BYTES);
    uint64_t seed = 6;
    const double angle = 0.025;
    measure(&points, uic60_at, 2e-4, 1e-5, &seed);
    turned = points;
    for (uint32_t i = 0; i < points.n; i++) {
        turned.eta[i] = cos(angle) * points.eta[i] - sin(angle) * points.zeta[i];
        turned.zeta[i] = sin(angle) * points.eta[i] + cos(angle) * points.zeta[i];
    }
    const struct kl_profile_def defs[] = {def_of(&points, 1.5e-5), def_of(&turned, 1.5e-5)};
    const struct kl_profile a = made(&defs[0], angle, &m);
    const struct kl_profile b = made(&defs[1], 0.0, &m);
    for (double eta = -0.03; eta < 0.03; eta += 0.0007) {
        assert_near(kl_profile_at(&a, eta).zeta_m, kl_profile_at(&b, eta).zeta_m, 1e-11);
        assert_near(kl_profile_at(&a, eta).slope, kl_profile_at(&b, eta).slope, 1e-8);
    }
    give_memory(&m);
}

/* Points that noise has thrown back in eta, and points measured twice, are welcome. */
static void thrown_back_and_doubled_points(void **state) {
    (void)state;
    static struct measured points;
    static struct measured doubled;
    struct memory m = take_memory(ARENA_BYTES);
    uint64_t seed = 7;
    uint32_t back = 0;
    measure(&points, s1002_at, 6e-5, 2e-5, &seed);
    for (uint32_t i = 1; i < points.n; i++) {
        back += points.eta[i] <= points.eta[i - 1];
    }
    assert_true(back > 10);
    doubled.n = 0;
    for (uint32_t i = 0; i < points.n; i++) {
        for (int twice = 0; twice < (i % 3 == 0 ? 2 : 1); twice++, doubled.n++) {
            doubled.eta[doubled.n] = points.eta[i];
            doubled.zeta[doubled.n] = points.zeta[i];
        }
    }
    const struct kl_profile_def defs[] = {def_of(&points, 3e-5), def_of(&doubled, 3e-5)};
    const struct kl_profile a = made(&defs[0], 0.0, &m);
    const struct kl_profile b = made(&defs[1], 0.0, &m);
    for (double eta = -0.05; eta < 0.04; eta += 0.001) {
        assert_near(kl_profile_at(&a, eta).zeta_m, kl_profile_at(&b, eta).zeta_m, 5e-6);
    }
    give_memory(&m);
}

/* Dense here and sparse there: the curve bridges what was not measured. */
static void uneven_points(void **state) {
    (void)state;
    static struct measured points;
    struct memory m = take_memory(ARENA_BYTES);
    measure(&points, uic60_at, 1e-4, 0.0, NULL);
    uint32_t kept = 0;
    for (uint32_t i = 0; i < points.n; i++) {
        if (points.eta[i] < -0.002 || points.eta[i] > 0.003 || i % 7 == 0) {
            points.eta[kept] = points.eta[i];
            points.zeta[kept++] = points.zeta[i];
        }
    }
    points.n = kept;
    const struct kl_profile_def def = def_of(&points, 1e-5);
    const struct kl_profile p = made(&def, 0.0, &m);
    for (double eta = -0.009; eta < 0.009; eta += 0.0002) {
        assert_near(curvature_of(kl_profile_at(&p, eta)), 1.0 / 0.3, 0.03);
    }
    give_memory(&m);
}

/* ---- refusals ---- */

static void refused(const struct kl_profile_def *def, enum kl_status status, const char *word) {
    struct memory m = take_memory(ARENA_BYTES);
    struct kl_profile profile;
    struct kl_diag diag = {.what = ""};
    assert_int_equal(kl_profile_build(def, 0.0, &m.arena, &profile, &diag), status);
    assert_non_null(strstr(diag.what, word));
    give_memory(&m);
}

static void what_cannot_be_smoothed_is_refused(void **state) {
    (void)state;
    static struct measured points;
    uint64_t seed = 8;
    measure(&points, uic60_at, 1e-4, 2e-5, &seed);
    struct kl_profile_def def = def_of(&points, 2e-3);
    refused(&def, KL_ERR_VALUE, "smoothing_m must be");
    def.smoothing_m = -1e-6;
    refused(&def, KL_ERR_VALUE, "smoothing_m must be");
    def.smoothing_m = (double)NAN;
    refused(&def, KL_ERR_VALUE, "smoothing_m must be");
    def.smoothing_m = 1e-7; /* more points than knots, off by 20 um */
    refused(&def, KL_ERR_PROFILE, "less than a curve can come near");
    def.smoothing_m = 1e-5;
    def.n_points = 8; /* 0.7 mm long */
    refused(&def, KL_ERR_PROFILE, "extend over");
    for (uint32_t i = 0; i < points.n; i++) {
        points.eta[i] = 0.01;
        points.zeta[i] = 0.002;
    }
    def.n_points = points.n;
    refused(&def, KL_ERR_PROFILE, "extend over");
    for (uint32_t i = 0; i < points.n; i++) {
        points.eta[i] = i % 2 ? 0.4 : -0.4; /* to and fro */
    }
    refused(&def, KL_ERR_PROFILE, "extend over");
    for (uint32_t i = 0; i < points.n; i++) { /* a full circle: eta turns back */
        points.eta[i] = 0.02 * cos(6.2 * i / points.n);
        points.zeta[i] = 0.02 * sin(6.2 * i / points.n);
    }
    refused(&def, KL_ERR_PROFILE, "eta must grow");
    points.zeta[9] = (double)INFINITY;
    refused(&def, KL_ERR_VALUE, "not finite");
}

static void memory_is_asked_for(void **state) {
    (void)state;
    static struct measured points;
    uint64_t seed = 9;
    measure(&points, uic60_at, 2e-4, 1e-5, &seed);
    const struct kl_profile_def def = def_of(&points, 1.5e-5);
    struct memory m = take_memory(ARENA_BYTES);
    struct kl_profile profile;
    assert_int_equal(kl_profile_build(&def, 0.0, &m.arena, &profile, NULL), KL_OK);
    const size_t wanted = m.arena.wanted;
    int refusals = 0;
    int enough = 0;
    for (size_t size = 0; size < wanted; size += 1 + wanted / 97) {
        kl_arena_init(&m.arena, m.block, size);
        const enum kl_status status = kl_profile_build(&def, 0.0, &m.arena, &profile, NULL);
        assert_int_equal(status, enough || status == KL_OK ? KL_OK : KL_ERR_MEMORY);
        enough = status == KL_OK;
        refusals += !enough;
    }
    assert_true(enough && refusals > 20);
    give_memory(&m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(curvature_of_noisy_points),
        cmocka_unit_test(exact_points_stay_exact),
        cmocka_unit_test(contact_of_noisy_points),
        cmocka_unit_test(tolerance_is_kept),
        cmocka_unit_test(smoothing_turns_with_the_section),
        cmocka_unit_test(thrown_back_and_doubled_points),
        cmocka_unit_test(uneven_points),
        cmocka_unit_test(what_cannot_be_smoothed_is_refused),
        cmocka_unit_test(memory_is_asked_for),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
