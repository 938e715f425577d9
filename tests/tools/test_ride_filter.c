/* Filters and spectra of klingel ride against their definitions, tables and closed sums. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "ride_filter.h"
#include "ride_spectrum.h"

#define PI 3.14159265358979323846
#define RATE 1000.0

static void assert_near(double value, double wanted, double relative) {
    if (!(fabs(value - wanted) <= relative * fabs(wanted))) {
        print_error("%.9g, wanted %.9g\n", value, wanted);
    }
    assert_true(fabs(value - wanted) <= relative * fabs(wanted));
}

/* Butterworth: |H|^2 = 1/(1 + (f/fc)^8), with the bilinear rule's f -> tan(pi f/rate). */
static void low_pass_is_a_butterworth_filter(void **unused) {
    (void)unused;
    static const double corner[] = {6.0, 10.0, 20.0};
    for (int i = 0; i < 3; i++) {
        struct ride_filter f;
        ride_band(&f, 0.0, corner[i], RATE);
        assert_near(ride_filter_gain(&f, 0.01, RATE), 1.0, 1e-9);
        assert_near(ride_filter_gain(&f, corner[i], RATE), sqrt(0.5), 1e-9);
        for (double at = 0.25; at < 8.0; at *= 2.0) {
            double ratio = tan(PI * at * corner[i] / RATE) / tan(PI * corner[i] / RATE);
            assert_near(ride_filter_gain(&f, at * corner[i], RATE),
                        1.0 / sqrt(1.0 + pow(ratio, 8.0)), 1e-8);
        }
    }
}

/* EN 14363 wants at least 24 dB per octave. */
static void band_pass_falls_on_both_sides(void **unused) {
    (void)unused;
    struct ride_filter f;
    ride_band(&f, 0.4, 10.0, RATE);
    assert_near(ride_filter_gain(&f, 0.4, RATE), sqrt(0.5), 1e-4);
    assert_near(ride_filter_gain(&f, 10.0, RATE), sqrt(0.5), 1e-4);
    assert_near(ride_filter_gain(&f, 2.0, RATE), 1.0, 1e-5);
    assert_true(20.0 * log10(ride_filter_gain(&f, 0.1, RATE) / ride_filter_gain(&f, 0.05, RATE)) >
                23.9);
    assert_true(20.0 * log10(ride_filter_gain(&f, 40.0, RATE) / ride_filter_gain(&f, 80.0, RATE)) >
                23.9);
}

/* The printed table of W_d in ISO 2631-1, at the nominal frequencies. */
static void lateral_weighting_is_that_of_the_table(void **unused) {
    (void)unused;
    static const double table[][2] = {{0.5, 0.853}, {1.0, 1.011}, {2.0, 0.890},
                                      {4.0, 0.512}, {8.0, 0.253}, {16.0, 0.125}};
    struct ride_filter f;
    ride_weighting(&f, RIDE_WD, RATE);
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++) {
        assert_near(ride_filter_gain(&f, table[i][0], RATE), table[i][1], 5e-3);
    }
}

/* W_b from its parts at s = j w, by real arithmetic. */
static double second(double f, double corner, double q) {
    double x = f / corner;
    return hypot(1.0 - x * x, x / q);
}

static void vertical_weighting_is_its_definition(void **unused) {
    (void)unused;
    struct ride_filter f;
    ride_weighting(&f, RIDE_WB, 1e5); /* fast enough for the bilinear rule to do no harm */
    for (double at = 0.2; at < 150.0; at *= 1.4) {
        double wanted = 0.4 * pow(at / 0.4, 2.0) / second(at, 0.4, sqrt(0.5)) /
                        second(at, 100.0, sqrt(0.5)) * hypot(1.0, at / 16.0) /
                        second(at, 16.0, 0.63) * second(at, 2.5, 0.8) / second(at, 4.0, 0.8);
        assert_near(ride_filter_gain(&f, at, 1e5), wanted, 1e-4);
    }
}

static void filters_a_sine_by_its_gain(void **unused) {
    (void)unused;
    struct ride_filter f;
    double most = 0.0;
    ride_band(&f, 0.4, 4.0, RATE);
    double gain = ride_filter_gain(&f, 5.0, RATE);
    for (int i = 0; i < 20000; i++) {
        double y = ride_filter_step(&f, 3.0 * sin(2.0 * PI * 5.0 * i / RATE));
        most = i > 15000 ? fmax(most, fabs(y)) : most;
    }
    assert_near(most, 3.0 * gain, 1e-3);
}

/* By hand: at 1 Hz 1.9735/(0.723^2 + 1.5262^2), at 5 Hz 86.8375/(5.925^2 + 3.215^2) and at 20 Hz
 * 10764.4/(109.8^2 + 263.14^2). */
static void sperling_weighting(void **unused) {
    (void)unused;
    assert_near(ride_sperling(1.0), 0.588 * sqrt(1.9735 / 2.85200), 1e-4);
    assert_near(ride_sperling(5.0), 0.588 * sqrt(86.8375 / 45.4418), 1e-4);
    assert_near(ride_sperling(20.0), 0.588 * sqrt(10764.4 / 81298.7), 1e-4);
}

static void quantiles(void **unused) {
    (void)unused;
    double x[] = {5.0, 1.0, 4.0, 2.0, 3.0};
    assert_near(ride_quantile(x, 5, 0.5), 3.0, 1e-15);
    assert_near(ride_quantile(x, 5, 1.0), 5.0, 1e-15);
    assert_near(ride_quantile(x, 5, 0.125), 1.5, 1e-15);
    assert_true(isnan(ride_quantile(x, 0, 0.5)));
}

/* The spectrum adds up to the variance, and a sine is where it belongs. */
static void spectrum_adds_up(void **unused) {
    (void)unused;
    enum { N = 65536 };
    double *x = malloc(N * sizeof *x);
    uint32_t random = 1;
    double power = 0.0;
    assert_non_null(x);
    for (int i = 0; i < N; i++) {
        random = random * 1664525u + 1013904223u;
        x[i] = 7.0 + (double)random / 4294967296.0 - 0.5 + 2.0 * sin(2.0 * PI * 12.5 * i / RATE);
    }
    struct ride_spectrum s;
    assert_true(ride_spectrum_make(&s, x, N, RATE, 4.0));
    size_t top = 0;
    for (size_t k = 0; k < s.n; k++) {
        power += s.density[k] * s.width_Hz;
        top = s.density[k] > s.density[top] ? k : top;
    }
    assert_near(power, 2.0 + 1.0 / 12.0, 0.01);
    assert_near((double)top * s.width_Hz, 12.5, 0.02);
    /* white noise of variance 1/12 up to 500 Hz */
    double noise = 0.0;
    for (size_t k = 100; k < s.n; k++) {
        noise += s.density[k] / (double)(s.n - 100);
    }
    assert_near(noise, 1.0 / 12.0 / 500.0, 0.03);
    ride_spectrum_free(&s);
    assert_false(ride_spectrum_make(&s, x, 8, RATE, 4.0));
    free(x);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(low_pass_is_a_butterworth_filter),
        cmocka_unit_test(band_pass_falls_on_both_sides),
        cmocka_unit_test(lateral_weighting_is_that_of_the_table),
        cmocka_unit_test(vertical_weighting_is_its_definition),
        cmocka_unit_test(filters_a_sine_by_its_gain),
        cmocka_unit_test(sperling_weighting),
        cmocka_unit_test(quantiles),
        cmocka_unit_test(spectrum_adds_up),
    };
    return cmocka_run_group_tests_name("ride_filter", tests, NULL, NULL);
}
