/* The track: ramps, their integrals and path against closed forms; irregularities; refusals. */
#include "fixtures.h"

#define ARENA_BYTES (1u << 21)
/* a half-sine is made of cubics: this part of its step (kl_track.h) */
#define HALF_SINE_ERROR 3e-6

struct layout {
    struct kl_ramp_def curvature[VEHICLE_MAX_RAMPS];
    struct kl_ramp_def cant[VEHICLE_MAX_RAMPS];
    struct kl_track_def def;
};

static void blank_layout(struct layout *l) {
    const struct layout blank = {0};
    *l = blank;
    l->def.curvature = l->curvature;
    l->def.cant = l->cant;
}

static struct kl_track built_track(const struct kl_track_def *def, struct memory *m) {
    struct kl_track track;
    struct kl_diag diag = {.what = ""};
    if (kl_track_build(def, &m->arena, &track, &diag) != KL_OK) {
        fail_msg("%s (index %d, value %g)", diag.what, (int)diag.index, diag.value);
    }
    return track;
}

/* The tracks of tests/reference/track_path.py, by name. */
static void reference_layout(const char *name, struct layout *l) {
    blank_layout(l);
    struct kl_ramp_def *r = l->curvature;
    uint32_t *n = &l->def.n_curvature;
    if (strcmp(name, "clothoid") == 0) {
        add_ramp(r, n, KL_RAMP_LINEAR, 80.0, 1.0 / 500.0);
    } else if (strcmp(name, "bloss") == 0) {
        add_ramp(r, n, KL_RAMP_BLOSS, 80.0, 1.0 / 500.0);
    } else if (strcmp(name, "half_sine") == 0) {
        add_ramp(r, n, KL_RAMP_HALF_SINE, 80.0, 1.0 / 500.0);
    } else if (strcmp(name, "sharp_clothoid") == 0) {
        add_ramp(r, n, KL_RAMP_LINEAR, 200.0, -0.0195);
    } else if (strcmp(name, "curve") == 0) {
        add_ramp(r, n, KL_RAMP_CONSTANT, 30.0, 0.0);
        add_ramp(r, n, KL_RAMP_LINEAR, 60.0, 1.0 / 400.0);
        add_ramp(r, n, KL_RAMP_CONSTANT, 100.0, 0.0);
        add_ramp(r, n, KL_RAMP_BLOSS, 60.0, 0.0);
    } else {
        assert_string_equal(name, "s_curve");
        add_ramp(r, n, KL_RAMP_CONSTANT, 20.0, 0.0);
        add_ramp(r, n, KL_RAMP_HALF_SINE, 50.0, 1.0 / 300.0);
        add_ramp(r, n, KL_RAMP_CONSTANT, 40.0, 0.0);
        add_ramp(r, n, KL_RAMP_LINEAR, 60.0, -1.0 / 350.0);
        add_ramp(r, n, KL_RAMP_CONSTANT, 50.0, 0.0);
        add_ramp(r, n, KL_RAMP_BLOSS, 40.0, -1.0 / 800.0);
    }
}

static void paths_agree_with_quadrature(void **state) {
    (void)state;
    struct memory m = take_memory(ARENA_BYTES);
    struct layout l;
    struct kl_track track = {0};
    char last[32] = "";
    struct csv csv;
    int rows = 0;
    csv_open(&csv, "tests/reference/track_path.csv");
    while (csv_next(&csv)) {
        const char *name = csv.field[csv_column(&csv, "track")];
        if (strcmp(name, last) != 0) {
            (void)snprintf(last, sizeof last, "%s", name);
            reference_layout(name, &l);
            track = built_track(&l.def, &m);
        }
        /* error of a half-sine's step of curvature over 50..80 m, and where it goes from there */
        const int has_sine = strcmp(name, "half_sine") == 0 || strcmp(name, "s_curve") == 0;
        const double curvature_error = has_sine ? HALF_SINE_ERROR / 300.0 : 1e-16;
        const double s = csv_named(&csv, "s_m");
        struct kl_track_point p;
        struct kl_path path;
        kl_track_at(&track, (kl_real)s, &p);
        kl_track_path(&track, (kl_real)s, &path);
        assert_near((double)p.curvature_1_m, csv_named(&csv, "kappa_1_m"), curvature_error);
        assert_near((double)p.heading_rad, csv_named(&csv, "heading_rad"),
                    1e-12 + 30.0 * curvature_error);
        assert_near((double)p.offset_m, csv_named(&csv, "offset_m"), 1e-10 + 5e3 * curvature_error);
        assert_near(path.heading_rad, csv_named(&csv, "heading_rad"),
                    1e-12 + 30.0 * curvature_error);
        assert_near(path.x_m, csv_named(&csv, "X_m"), 1e-6);
        assert_near(path.y_m, csv_named(&csv, "Y_m"), 1e-6 + 5e3 * curvature_error);
        rows++;
    }
    csv_close(&csv);
    assert_true(rows > 200);
    give_memory(&m);
}

/* The shape of each ramp, and its two derivatives by s; steps of cant of 0.1 over 40 m. */
struct shape {
    double value, slope, bend;
};

static struct shape shape_at(enum kl_ramp_shape shape, double t) {
    const double pi = acos(-1.0);
    const struct shape linear = {t, 1.0, 0.0};
    const struct shape bloss = {t * t * (3.0 - 2.0 * t), 6.0 * t * (1.0 - t), 6.0 - 12.0 * t};
    const struct shape sine = {0.5 - 0.5 * cos(pi * t), 0.5 * pi * sin(pi * t),
                               0.5 * pi * pi * cos(pi * t)};
    return shape == KL_RAMP_LINEAR ? linear : (shape == KL_RAMP_BLOSS ? bloss : sine);
}

static void cant_ramps_have_their_shapes(void **state) {
    (void)state;
    struct memory m = take_memory(ARENA_BYTES);
    for (int k = KL_RAMP_LINEAR; k <= KL_RAMP_HALF_SINE; k++) {
        const enum kl_ramp_shape shape = (enum kl_ramp_shape)k;
        const double error = shape == KL_RAMP_HALF_SINE ? HALF_SINE_ERROR : 1e-15;
        struct layout l;
        blank_layout(&l);
        l.def.cant_start_rad = -0.02;
        add_ramp(l.cant, &l.def.n_cant, KL_RAMP_CONSTANT, 10.0, 0.0);
        add_ramp(l.cant, &l.def.n_cant, shape, 40.0, 0.08);
        const struct kl_track track = built_track(&l.def, &m);
        for (double s = 10.013; s < 50.0; s += 0.37) {
            struct kl_track_point p;
            const struct shape want = shape_at(shape, (s - 10.0) / 40.0);
            kl_track_at(&track, (kl_real)s, &p);
            assert_near((double)p.cant_rad, -0.02 + 0.1 * want.value, 0.1 * error);
            assert_near((double)p.cant_s_1_m, 0.1 / 40.0 * want.slope, 0.1 / 40.0 * 60.0 * error);
            assert_near((double)p.cant_ss_1_m2, 0.1 / 1600.0 * want.bend,
                        0.1 / 1600.0 * 6e3 * error);
        }
        const double outside[] = {-1e5, -1.0, 0.0, 9.999, 50.001, 1e5};
        for (size_t i = 0; i < COUNT(outside); i++) {
            struct kl_track_point p;
            kl_track_at(&track, (kl_real)outside[i], &p);
            assert_near((double)p.cant_rad, outside[i] < 10.0 ? -0.02 : 0.08, 1e-16);
            assert_near((double)p.cant_s_1_m, 0.0, 0.0);
            assert_near((double)p.cant_ss_1_m2, 0.0, 0.0);
        }
    }
    give_memory(&m);
}

/* Bloss and half-sine begin and end without a kink; every quantity is the integral of the next. */
static void layout_is_smooth_and_consistent(void **state) {
    (void)state;
    struct memory m = take_memory(ARENA_BYTES);
    struct layout l;
    reference_layout("s_curve", &l);
    add_ramp(l.cant, &l.def.n_cant, KL_RAMP_HALF_SINE, 77.0, 0.1);
    add_ramp(l.cant, &l.def.n_cant, KL_RAMP_BLOSS, 61.0, -0.05);
    const struct kl_track track = built_track(&l.def, &m);
    const double h = 1e-3;
    for (double s = -20.0; s < 320.0; s += 0.0937) {
        struct kl_track_point a;
        struct kl_track_point p;
        struct kl_track_point b;
        kl_track_at(&track, (kl_real)(s - h), &a);
        kl_track_at(&track, (kl_real)s, &p);
        kl_track_at(&track, (kl_real)(s + h), &b);
        assert_near((double)(b.heading_rad - a.heading_rad) / (2 * h), (double)p.curvature_1_m,
                    1e-6);
        assert_near((double)(b.offset_m - a.offset_m) / (2 * h), (double)p.heading_rad, 1e-8);
        assert_near((double)(b.cant_rad - a.cant_rad) / (2 * h), (double)p.cant_s_1_m, 1e-7);
        assert_near((double)b.cant_s_1_m, (double)a.cant_s_1_m, 2 * h * 3e-4);
    }
    give_memory(&m);
}

/* Far from the origin and for thousands of ramps' borders the piece is found exactly. */
static void every_border_is_found(void **state) {
    (void)state;
    struct memory m = take_memory(ARENA_BYTES);
    struct kl_ramp_def ramps[KL_TRACK_MAX_RAMPS];
    uint32_t n = 0;
    uint64_t seed = 21;
    double start[KL_TRACK_MAX_RAMPS + 1];
    start[0] = 0.0;
    while (n < KL_TRACK_MAX_RAMPS) {
        add_ramp(ramps, &n, KL_RAMP_LINEAR, random_between(&seed, 5.0, 200.0), n % 2 ? 0.0 : 0.001);
        start[n] = start[n - 1u] + ramps[n - 1u].length_m;
    }
    const struct kl_track_def def = {.n_curvature = n, .curvature = ramps};
    const struct kl_track track = built_track(&def, &m);
    for (uint32_t i = 0; i < n; i++) {
        const double from = i % 2 ? 0.001 : 0.0;
        for (double t = 0.0001; t < 1.0; t += 0.4999) {
            struct kl_track_layout p;
            kl_track_layout_at(&track, (kl_real)(start[i] + t * ramps[i].length_m), &p);
            assert_near((double)p.curvature_1_m, from + t * (ramps[i].to - from), 1e-12);
        }
    }
    give_memory(&m);
}

/* ---- irregularities ---- */

#define SAMPLES 60
struct series {
    double lateral[SAMPLES];
    double vertical[SAMPLES];
    double cross[SAMPLES];
    double gauge[SAMPLES];
    struct kl_track_def def;
};

static void random_series(struct series *r) {
    uint64_t seed = 22;
    for (int i = 0; i < SAMPLES; i++) {
        r->lateral[i] = random_between(&seed, -0.005, 0.005);
        r->vertical[i] = random_between(&seed, -0.005, 0.005);
        r->cross[i] = random_between(&seed, -0.005, 0.005);
        r->gauge[i] = random_between(&seed, -0.005, 0.005);
    }
    const struct kl_track_def def = {.irregularity = {.n_samples = SAMPLES,
                                                      .start_m = 7.25,
                                                      .step_m = 0.25,
                                                      .lateral_m = r->lateral,
                                                      .vertical_m = r->vertical,
                                                      .cross_rad = r->cross,
                                                      .gauge_m = r->gauge}};
    r->def = def;
}

static void irregularities_hit_their_samples(void **state) {
    (void)state;
    struct memory m = take_memory(ARENA_BYTES);
    struct series r;
    random_series(&r);
    const struct kl_track track = built_track(&r.def, &m);
    for (int i = 0; i < SAMPLES; i++) {
        struct kl_track_point p;
        kl_track_at(&track, (kl_real)(7.25 + 0.25 * i), &p);
        assert_near((double)p.value.lateral_m, r.lateral[i], 1e-16);
        assert_near((double)p.value.vertical_m, r.vertical[i], 1e-16);
        assert_near((double)p.value.cross_rad, r.cross[i], 1e-16);
        assert_near((double)p.value.gauge_m, r.gauge[i], 1e-16);
    }
    give_memory(&m);
}

/* Value, slope and second derivative go through the samples without a step. */
static void irregularities_are_twice_continuous(void **state) {
    (void)state;
    struct memory m = take_memory(ARENA_BYTES);
    struct series r;
    random_series(&r);
    const struct kl_track track = built_track(&r.def, &m);
    const double d = 1e-9;
    for (int i = 1; i + 1 < SAMPLES; i++) {
        struct kl_track_point a;
        struct kl_track_point b;
        kl_track_at(&track, (kl_real)(7.25 + 0.25 * i - d), &a);
        kl_track_at(&track, (kl_real)(7.25 + 0.25 * i + d), &b);
        const double second = 0.01 * 24.0 / (0.25 * 0.25); /* no series bends more than this */
        assert_near((double)b.value.lateral_m, (double)a.value.lateral_m, d * second);
        assert_near((double)b.slope.vertical_m, (double)a.slope.vertical_m, 2.0 * d * second);
        assert_near((double)b.second.cross_rad, (double)a.second.cross_rad,
                    2.0 * d * second * 24.0);
    }
    give_memory(&m);
}

static void irregularity_slopes_are_derivatives(void **state) {
    (void)state;
    struct memory m = take_memory(ARENA_BYTES);
    struct series r;
    random_series(&r);
    const struct kl_track track = built_track(&r.def, &m);
    const double h = 1e-4;
    for (double s = 7.26; s < 21.9; s += 0.0371) {
        struct kl_track_point a;
        struct kl_track_point p;
        struct kl_track_point b;
        kl_track_at(&track, (kl_real)(s - h), &a);
        kl_track_at(&track, (kl_real)s, &p);
        kl_track_at(&track, (kl_real)(s + h), &b);
        const double *va = (const double *)&a.value;
        const double *vb = (const double *)&b.value;
        const double *da = (const double *)&a.slope;
        const double *db = (const double *)&b.slope;
        const double *d = (const double *)&p.slope;
        const double *dd = (const double *)&p.second;
        for (int k = 0; k < 4; k++) {
            assert_near((vb[k] - va[k]) / (2.0 * h), d[k], 1e-6);
            assert_near((db[k] - da[k]) / (2.0 * h), dd[k], 2e-3);
        }
    }
    give_memory(&m);
}

/* Outside the samples the track is smooth; an absent series is zero; a parabola keeps its bend. */
static void outside_and_absent_series_are_zero(void **state) {
    (void)state;
    struct memory m = take_memory(ARENA_BYTES);
    struct series r;
    random_series(&r);
    r.def.irregularity.gauge_m = NULL;
    const struct kl_track track = built_track(&r.def, &m);
    const double outside[] = {-1e4, 7.249, 22.001, 1e4};
    for (size_t i = 0; i < COUNT(outside); i++) {
        struct kl_track_point p;
        kl_track_at(&track, (kl_real)outside[i], &p);
        const struct kl_irregularity_row zero = {0};
        for (size_t k = 0; k < sizeof zero / sizeof(kl_real); k++) {
            assert_true(((const kl_real *)&p.value)[k] == 0);
            assert_true(((const kl_real *)&p.slope)[k] == 0);
            assert_true(((const kl_real *)&p.second)[k] == 0);
        }
    }
    for (double s = 5.0; s < 25.0; s += 0.1) {
        struct kl_track_point p;
        kl_track_at(&track, (kl_real)s, &p);
        assert_true(p.value.gauge_m == 0 && p.slope.gauge_m == 0 && p.second.gauge_m == 0);
    }
    give_memory(&m);
}

/* ---- refusals ---- */

static void refused_at(const struct kl_track_def *def, enum kl_status want, int32_t index,
                       const char *word, int line) {
    struct memory m = take_memory(ARENA_BYTES);
    struct kl_track track;
    struct kl_diag diag = {.what = ""};
    const enum kl_status status = kl_track_build(def, &m.arena, &track, &diag);
    if (status != want || diag.status != want || diag.index != index ||
        strstr(diag.what, word) == NULL) {
        print_error("got %d index %d '%s'; wanted %d index %d '...%s...'\n", status,
                    (int)diag.index, diag.what, want, (int)index, word);
        _fail(__FILE__, line);
    }
    assert_int_equal(kl_track_build(def, &m.arena, &track, NULL), want);
    give_memory(&m);
}
#define REFUSED(def, status, index, word) refused_at((def), (status), (index), (word), __LINE__)

static void bad_ramps_are_refused(void **state) {
    (void)state;
    const double nan = (double)NAN;
    const double bad_length[] = {0.0, -1.0, 1e-4, 1e7, nan, (double)INFINITY};
    const double bad_curvature[] = {0.02, -0.02, nan, (double)INFINITY};
    const double bad_cant[] = {0.3, -0.3, nan, (double)INFINITY};
    struct layout l;
    for (size_t i = 0; i < COUNT(bad_length); i++) {
        reference_layout("curve", &l);
        l.curvature[2].length_m = bad_length[i];
        REFUSED(&l.def, KL_ERR_VALUE, 2, "length_m");
        reference_layout("curve", &l);
        add_ramp(l.cant, &l.def.n_cant, KL_RAMP_LINEAR, bad_length[i], 0.01);
        REFUSED(&l.def, KL_ERR_VALUE, 0, "length_m");
    }
    for (size_t i = 0; i < COUNT(bad_curvature); i++) {
        reference_layout("curve", &l);
        l.curvature[1].to = bad_curvature[i];
        REFUSED(&l.def, KL_ERR_VALUE, 1, "curvature");
        reference_layout("curve", &l);
        l.def.curvature_start_1_m = bad_curvature[i];
        REFUSED(&l.def, KL_ERR_VALUE, -1, "start");
        reference_layout("curve", &l);
        add_ramp(l.cant, &l.def.n_cant, KL_RAMP_CONSTANT, 10.0, 0.0);
        add_ramp(l.cant, &l.def.n_cant, KL_RAMP_BLOSS, 10.0, bad_cant[i]);
        REFUSED(&l.def, KL_ERR_VALUE, 1, "cant");
        reference_layout("curve", &l);
        l.def.cant_start_rad = bad_cant[i];
        REFUSED(&l.def, KL_ERR_VALUE, -1, "start");
    }
    reference_layout("curve", &l);
    l.curvature[3].shape = (enum kl_ramp_shape)4;
    REFUSED(&l.def, KL_ERR_VALUE, 3, "shape");
}

static void tracks_beyond_capacity_are_refused(void **state) {
    (void)state;
    struct kl_ramp_def ramps[KL_TRACK_MAX_RAMPS + 1];
    uint32_t n = 0;
    while (n < COUNT(ramps)) {
        add_ramp(ramps, &n, KL_RAMP_LINEAR, 10.0, 0.001);
    }
    struct kl_track_def def = {.n_curvature = n, .curvature = ramps};
    REFUSED(&def, KL_ERR_CAPACITY, -1, "256");
    const struct kl_track_def cant = {.n_cant = n, .cant = ramps};
    REFUSED(&cant, KL_ERR_CAPACITY, -1, "256");
    def.n_curvature = 2; /* one ramp of 2 cm on 100 km */
    ramps[0].length_m = 0.02;
    ramps[1].length_m = 1e5;
    REFUSED(&def, KL_ERR_CAPACITY, -1, "short");
}

static void bad_irregularities_are_refused(void **state) {
    (void)state;
    const double nan = (double)NAN;
    struct series r;
    struct kl_irregularity_def *i = &r.def.irregularity;
#define BAD(change, index, word)                                                                   \
    do {                                                                                           \
        random_series(&r);                                                                         \
        change;                                                                                    \
        REFUSED(&r.def, KL_ERR_VALUE, index, word);                                                \
    } while (0)
    BAD(i->n_samples = 3, -1, "n_samples");
    BAD(i->n_samples = 1000001, -1, "n_samples");
    BAD(i->step_m = 0.0, -1, "step_m");
    BAD(i->step_m = nan, -1, "step_m");
    BAD(i->step_m = -0.25, -1, "step_m");
    BAD(i->start_m = nan, -1, "start_m");
    BAD(i->start_m = 1e8, -1, "start_m");
    BAD(r.lateral[5] = 0.11, 5, "lateral_m");
    BAD(r.lateral[SAMPLES - 1] = nan, SAMPLES - 1, "lateral_m");
    BAD(r.vertical[0] = -0.21, 0, "vertical_m");
    BAD(r.vertical[9] = (double)INFINITY, 9, "vertical_m");
    BAD(r.cross[31] = 0.11, 31, "cross_rad");
    BAD(r.gauge[30] = -0.051, 30, "gauge_m");
#undef BAD
}

static void null_arguments_are_refused(void **state) {
    (void)state;
    struct memory m = take_memory(4096);
    struct kl_track track;
    struct layout l;
    reference_layout("curve", &l);
    assert_int_equal(kl_track_build(NULL, &m.arena, &track, NULL), KL_ERR_ARGUMENT);
    assert_int_equal(kl_track_build(&l.def, NULL, &track, NULL), KL_ERR_ARGUMENT);
    assert_int_equal(kl_track_build(&l.def, &m.arena, NULL, NULL), KL_ERR_ARGUMENT);
    l.def.curvature = NULL;
    assert_int_equal(kl_track_build(&l.def, &m.arena, &track, NULL), KL_ERR_ARGUMENT);
    reference_layout("curve", &l);
    l.def.n_cant = 1;
    l.def.cant = NULL;
    assert_int_equal(kl_track_build(&l.def, &m.arena, &track, NULL), KL_ERR_ARGUMENT);
    give_memory(&m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(paths_agree_with_quadrature),
        cmocka_unit_test(cant_ramps_have_their_shapes),
        cmocka_unit_test(layout_is_smooth_and_consistent),
        cmocka_unit_test(every_border_is_found),
        cmocka_unit_test(irregularities_hit_their_samples),
        cmocka_unit_test(irregularities_are_twice_continuous),
        cmocka_unit_test(irregularity_slopes_are_derivatives),
        cmocka_unit_test(outside_and_absent_series_are_zero),
        cmocka_unit_test(bad_ramps_are_refused),
        cmocka_unit_test(tracks_beyond_capacity_are_refused),
        cmocka_unit_test(bad_irregularities_are_refused),
        cmocka_unit_test(null_arguments_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
