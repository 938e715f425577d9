/* Synthesised irregularities against the spectra they are said to have. */
#include "fixtures.h"

#define STEP_M 0.5
#define N 4000 /* 2 km */
#define PI 3.14159265358979323846

struct synthesis {
    double lateral[N];
    double vertical[N];
    double cross[N];
};

/* ERRI B176, low: physics.md section 2. */
static const struct kl_spectrum_def low = {.lateral_A = 2.119e-7,
                                           .vertical_A = 4.032e-7,
                                           .cross_A = 4.032e-7,
                                           .shortest_m = 3.0,
                                           .longest_m = 100.0,
                                           .n_waves = 500,
                                           .seed = 1};

static struct synthesis made; /* too large for the stack of some machines */

static void synthesise(uint32_t seed) {
    struct kl_spectrum_def def = low;
    def.seed = seed;
    assert_int_equal(
        kl_spectrum_synthesise(&def, STEP_M, N, made.lateral, made.vertical, made.cross), KL_OK);
}

/* One-sided densities, m2/(rad/m). */
static double plain(double a, double w) {
    return a * 0.8246 * 0.8246 / ((w * w + 0.0206 * 0.0206) * (w * w + 0.8246 * 0.8246));
}

static double cross_level(double a, double w) {
    return plain(a, w) * w * w / (0.75 * 0.75 * (w * w + 0.4380 * 0.4380));
}

/* Simpson over w between two wavelengths. */
static double variance_of(double (*density)(double, double), double a, double shortest,
                          double longest) {
    const int n = 20000;
    const double from = 2.0 * PI / longest;
    const double h = (2.0 * PI / shortest - from) / n;
    double sum = 0.0;
    for (int i = 0; i <= n; i++) {
        const double weight = i == 0 || i == n ? 1.0 : (i % 2 ? 4.0 : 2.0);
        sum += weight * density(a, from + h * i);
    }
    return sum * h / 3.0;
}

static double mean_square(const double *x) {
    double sum = 0.0;
    for (int i = 0; i < N; i++) {
        sum += x[i] * x[i];
    }
    return sum / N;
}

/*
 * The variance is the integral of the spectrum. One series of 2 km has few of the longest waves;
 * the mean over 12 seeds comes within 0.5 %.
 */
static void variance_is_the_integral_of_the_spectrum(void **state) {
    (void)state;
    double sum[3] = {0.0, 0.0, 0.0};
    for (uint32_t seed = 1; seed <= 12; seed++) {
        synthesise(seed);
        sum[0] += mean_square(made.lateral) / 12.0;
        sum[1] += mean_square(made.vertical) / 12.0;
        sum[2] += mean_square(made.cross) / 12.0;
    }
    const double want[3] = {variance_of(plain, 2.119e-7, 3.0, 100.0),
                            variance_of(plain, 4.032e-7, 3.0, 100.0),
                            variance_of(cross_level, 4.032e-7, 3.0, 100.0)};
    for (int k = 0; k < 3; k++) {
        print_message("rms %.4g, of the spectrum %.4g\n", sqrt(sum[k]), sqrt(want[k]));
        assert_near(sum[k] / want[k], 1.0, 0.03);
    }
}

/* Power of the series between two frequencies, by the discrete Fourier transform of all of it. */
static double power_between(const double *x, double from, double to) {
    const double width = 2.0 * PI / (N * STEP_M);
    double power = 0.0;
    for (int k = (int)ceil(from / width); k * width < to; k++) {
        double re = 0.0;
        double im = 0.0;
        for (int i = 0; i < N; i++) {
            const double phase = 2.0 * PI * (double)((long)k * i % N) / N;
            re += x[i] * cos(phase);
            im += x[i] * sin(phase);
        }
        power += 2.0 * (re * re + im * im) / ((double)N * N);
    }
    return power;
}

/* Not only the sum: each band has its share. A band holds about 60 bins or more; 4 seeds. */
static void every_band_has_its_share(void **state) {
    (void)state;
    const double wavelength[] = {100.0, 22.0, 12.0, 7.0};
    for (size_t b = 0; b + 1 < COUNT(wavelength); b++) {
        const double from = 2.0 * PI / wavelength[b];
        const double to = 2.0 * PI / wavelength[b + 1];
        double lateral = 0.0;
        double cross = 0.0;
        for (uint32_t seed = 31; seed < 35; seed++) {
            synthesise(seed);
            lateral += 0.25 * power_between(made.lateral, from, to);
            cross += 0.25 * power_between(made.cross, from, to);
        }
        const double want_lateral = variance_of(plain, 2.119e-7, wavelength[b + 1], wavelength[b]);
        const double want_cross =
            variance_of(cross_level, 4.032e-7, wavelength[b + 1], wavelength[b]);
        print_message("%g..%g m: %.3f %.3f of the spectrum\n", wavelength[b], wavelength[b + 1],
                      lateral / want_lateral, cross / want_cross);
        assert_near(lateral / want_lateral, 1.0, 0.25);
        assert_near(cross / want_cross, 1.0, 0.25);
    }
}

static void the_seed_alone_decides(void **state) {
    (void)state;
    static struct synthesis first;
    synthesise(7);
    first = made;
    synthesise(7);
    assert_memory_equal(&first, &made, sizeof made);
    synthesise(8);
    double product = 0.0;
    for (int i = 0; i < N; i++) {
        product += first.lateral[i] * made.lateral[i] / N;
    }
    assert_at_most(fabs(product), 0.3 * mean_square(first.lateral));
    double within = 0.0; /* the three series of one seed are independent too */
    for (int i = 0; i < N; i++) {
        within += made.lateral[i] * made.vertical[i] / N;
    }
    assert_at_most(fabs(within),
                   0.3 * sqrt(mean_square(made.lateral) * mean_square(made.vertical)));
}

static void nothing_asked_nothing_given(void **state) {
    (void)state;
    struct kl_spectrum_def def = low;
    def.vertical_A = 0.0;
    assert_int_equal(
        kl_spectrum_synthesise(&def, STEP_M, N, made.lateral, made.vertical, made.cross), KL_OK);
    assert_true(mean_square(made.vertical) == 0.0);
    assert_true(mean_square(made.lateral) > 0.0 && mean_square(made.cross) > 0.0);
}

/* Tapered ends begin at zero and leave the middle alone. */
static void taper(void **state) {
    (void)state;
    static struct synthesis plain_ends;
    synthesise(3);
    plain_ends = made;
    struct kl_spectrum_def def = low;
    def.seed = 3;
    def.taper_m = 100.0;
    assert_int_equal(
        kl_spectrum_synthesise(&def, STEP_M, N, made.lateral, made.vertical, made.cross), KL_OK);
    assert_near(made.lateral[0], 0.0, 0.0);
    assert_near(made.cross[N - 1], 0.0, 0.0);
    for (int i = 0; i < N; i++) {
        const double s = STEP_M * i;
        const double edge = fmin(s, STEP_M * (N - 1) - s);
        const double factor = edge < 100.0 ? 0.5 - 0.5 * cos(PI * edge / 100.0) : 1.0;
        assert_near(made.vertical[i], factor * plain_ends.vertical[i], 1e-17);
    }
}

static void bad_spectra_are_refused(void **state) {
    (void)state;
    const double nan = (double)NAN;
    struct kl_spectrum_def def;
#define BAD(change)                                                                                \
    do {                                                                                           \
        def = low;                                                                                 \
        def.change;                                                                                \
        assert_int_equal(                                                                          \
            kl_spectrum_synthesise(&def, STEP_M, N, made.lateral, made.vertical, made.cross),      \
            KL_ERR_VALUE);                                                                         \
    } while (0)
    BAD(lateral_A = -1e-9);
    BAD(lateral_A = nan);
    BAD(vertical_A = 1.0);
    BAD(vertical_A = nan);
    BAD(cross_A = -1.0);
    BAD(cross_A = nan);
    BAD(shortest_m = 1.0); /* two samples to a wave */
    BAD(shortest_m = nan);
    BAD(longest_m = 3.0);
    BAD(longest_m = 1e4);
    BAD(longest_m = nan);
    BAD(taper_m = -1.0);
    BAD(taper_m = nan);
    BAD(n_waves = 0);
    BAD(n_waves = 4097);
#undef BAD
    def = low;
    assert_int_equal(kl_spectrum_synthesise(&def, 0.0, N, made.lateral, made.vertical, made.cross),
                     KL_ERR_VALUE);
    assert_int_equal(kl_spectrum_synthesise(&def, nan, N, made.lateral, made.vertical, made.cross),
                     KL_ERR_VALUE);
    assert_int_equal(
        kl_spectrum_synthesise(NULL, STEP_M, N, made.lateral, made.vertical, made.cross),
        KL_ERR_ARGUMENT);
    assert_int_equal(kl_spectrum_synthesise(&def, STEP_M, N, NULL, made.vertical, made.cross),
                     KL_ERR_ARGUMENT);
    assert_int_equal(
        kl_spectrum_synthesise(&def, STEP_M, 3, made.lateral, made.vertical, made.cross),
        KL_ERR_ARGUMENT);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(variance_is_the_integral_of_the_spectrum),
        cmocka_unit_test(every_band_has_its_share),
        cmocka_unit_test(the_seed_alone_decides),
        cmocka_unit_test(nothing_asked_nothing_given),
        cmocka_unit_test(taper),
        cmocka_unit_test(bad_spectra_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
