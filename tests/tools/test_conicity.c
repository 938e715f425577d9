/* Equivalent conicity: cases with a closed solution, and the results of EN 15302. Run from the
 * project's root. */
#include <math.h>
#include <stdbool.h>

#include "conicity.h"
#include "core/csv.h"

#define PI 3.14159265358979323846
#define BASE_M 1.5
#define RADIUS_M 0.46

static struct conicity_curve made(const double *y, const double *r, size_t n) {
    struct conicity_curve curve;
    assert_int_equal(conicity_curve_make(&curve, y, r, n), 0);
    return curve;
}

static struct conicity_motion motion_of(const struct conicity_curve *curve, double amplitude) {
    struct conicity_motion m;
    assert_int_equal(conicity_at(curve, amplitude, BASE_M, RADIUS_M, &m), CONICITY_OK);
    return m;
}

static void near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance)) {
        fail_msg("%.15g is not %.15g within %g", value, expected, tolerance);
    }
}

/* Cones: Klingel's formula, whatever the amplitude and wherever the points. */
static void a_cone_is_klingels(void **state) {
    (void)state;
    const double y[] = {-0.01, -0.0032, 0.0, 1e-9, 0.004, 0.0123};
    double r[6];
    for (int i = 0; i < 6; i++) {
        r[i] = 2.0 * 0.1144 * y[i];
    }
    struct conicity_curve curve = made(y, r, 6);
    for (double a = 1e-6; a <= 0.01; a *= 1.37) {
        struct conicity_motion m = motion_of(&curve, a);
        near(m.conicity, 0.1144, 1e-12);
        near(m.regression, 0.1144, 1e-12);
        near(m.wavelength_m, 2.0 * PI * sqrt(BASE_M / 2.0 * RADIUS_M / 0.1144), 1e-10);
        near(m.low_m, -a, 1e-12);
        near(m.high_m, a, 1e-12);
    }
    near(motion_of(&curve, 0.01).conicity, 0.1144, 1e-12);
    near(conicity_largest(&curve), 0.01, 2e-9);
    conicity_curve_free(&curve);
}

/* Wheels of different size on a cone: the same motion about another line. */
static void a_constant_moves_the_line(void **state) {
    (void)state;
    const double y[] = {-0.01, 0.0, 0.01};
    const double r[] = {0.001 - 0.002, 0.001, 0.001 + 0.002};
    struct conicity_curve curve = made(y, r, 3);
    double line = 0.0;
    assert_int_equal(conicity_rolling_line(&curve, &line), 0);
    near(line, -0.005, 1e-15);
    struct conicity_motion m = motion_of(&curve, 0.003);
    near(m.conicity, 0.1, 1e-12);
    near(m.low_m, -0.008, 1e-12);
    near(m.high_m, -0.002, 1e-12);
    struct conicity_motion beyond;
    assert_int_equal(conicity_at(&curve, 0.0051, BASE_M, RADIUS_M, &beyond), CONICITY_BEYOND);
    near(conicity_largest(&curve), 0.005, 2e-9);
    conicity_curve_free(&curve);
}

/* delta_r = +-c, a jump at the centre: four parabolas, s^2 = 2 A e r0 / c each, so the conicity is
 * (pi^2 / 16) c / A; the line of least squares through it has the slope 3 c / (2 A). */
static void a_jump_is_parabolas(void **state) {
    (void)state;
    const double y[] = {-0.01, 0.0, 0.0, 0.01};
    const double r[] = {-0.0004, -0.0004, 0.0004, 0.0004};
    struct conicity_curve curve = made(y, r, 4);
    for (double a = 1e-5; a < 0.01; a *= 2.1) {
        struct conicity_motion m = motion_of(&curve, a);
        near(m.conicity * a / 0.0004, PI * PI / 16.0, 1e-12);
        near(m.regression * a / 0.0004, 0.75, 1e-12);
    }
    near(conicity_delta_r(&curve, 0.0), 0.0, 0.0);
    near(conicity_delta_r(&curve, 0.003), 0.0004, 0.0);
    conicity_curve_free(&curve);
}

/* Two cones of different slope: half a period of each, T = pi / w with w^2 = slope. */
static void two_cones_are_two_half_waves(void **state) {
    (void)state;
    const double y[] = {-0.012, 0.0, 0.006};
    const double r[] = {-0.2 * 0.012, 0.0, 0.8 * 0.006};
    struct conicity_curve curve = made(y, r, 3);
    struct conicity_motion m = motion_of(&curve, 0.003);
    /* equal energy: 0.2 low^2 = 0.8 high^2 */
    near(m.low_m, -0.004, 1e-12);
    near(m.high_m, 0.002, 1e-12);
    double wave = PI / sqrt(0.2) + PI / sqrt(0.8);
    near(m.conicity, 2.0 * (PI / wave) * (PI / wave), 1e-12);
    near(m.wavelength_m, wave * sqrt(BASE_M * RADIUS_M), 1e-10);
    conicity_curve_free(&curve);
}

/* A softening cubic, fine steps: the exact period is an elliptic integral, here by the mean of
 * arithmetic and geometric means. y'' + y - b y^3 = 0, k^2 = b A^2 / (2 - b A^2). */
static void a_cubic_is_elliptic(void **state) {
    (void)state;
    enum { N = 40001 };
    static double y[N];
    static double r[N];
    const double b = 0.9;
    for (int i = 0; i < N; i++) {
        y[i] = -1.0 + 2.0 * i / (N - 1);
        r[i] = y[i] - b * y[i] * y[i] * y[i];
    }
    struct conicity_curve curve = made(y, r, N);
    for (double a = 0.1; a < 0.95; a += 0.2) {
        double k2 = b * a * a / (2.0 - b * a * a);
        double mean = 1.0;
        double geometric = sqrt(1.0 - k2);
        for (int i = 0; i < 10; i++) {
            double next = 0.5 * (mean + geometric);
            geometric = sqrt(mean * geometric);
            mean = next;
        }
        double wave = 4.0 * (PI / (2.0 * mean)) / sqrt(1.0 - b * a * a / 2.0);
        near(motion_of(&curve, a).conicity, 2.0 * (PI / wave) * (PI / wave), 1e-7);
    }
    conicity_curve_free(&curve);
}

/* Two wells with a hill between: small motions in one, large ones around both, none in between. */
static void wells_and_hills(void **state) {
    (void)state;
    const double y[] = {-0.004, -0.002, -0.001, 0.001, 0.002, 0.004};
    const double r[] = {-0.002, 0.0, 0.001, -0.001, 0.0, 0.002};
    struct conicity_curve curve = made(y, r, 6);
    struct conicity_motion m;
    assert_int_equal(conicity_at(&curve, 0.0005, 1.0, 1.0, &m), CONICITY_OK);
    near(fabs(0.5 * (m.low_m + m.high_m)), 0.002, 1e-9);
    near(m.conicity, 0.5, 1e-9);
    /* P at the centre is 1.0e-6 above the wells: y = 2 +- sqrt(2) mm there */
    assert_int_equal(conicity_at(&curve, 0.0019, 1.0, 1.0, &m), CONICITY_NONE);
    assert_int_equal(conicity_at(&curve, 0.0038, 1.0, 1.0, &m), CONICITY_OK);
    near(m.low_m, -0.0038, 1e-12);
    conicity_curve_free(&curve);
    /* a cone the wrong way round drives nothing back */
    const double back[] = {0.002, 0.0, -0.002};
    const double at[] = {-0.01, 0.0, 0.01};
    curve = made(at, back, 3);
    double line;
    assert_int_equal(conicity_rolling_line(&curve, &line), -1);
    assert_int_equal(conicity_at(&curve, 0.001, 1.0, 1.0, &m), CONICITY_NONE);
    assert_true(conicity_largest(&curve) == 0.0);
    conicity_curve_free(&curve);
}

/* delta_r of a table every 0.1 mm: turning points meet its points, which must not show. */
static void points_do_not_show(void **state) {
    (void)state;
    enum { N = 401 };
    double y[N];
    double r[N];
    for (int i = 0; i < N; i++) {
        y[i] = (i - 200) * 1e-4;
        r[i] = 2.0 * 0.1144 * y[i];
    }
    struct conicity_curve curve = made(y, r, N);
    for (int i = 1; i <= 200; i++) {
        near(motion_of(&curve, i * 1e-4).conicity, 0.1144, 1e-9);
        near(motion_of(&curve, i * 0.99987e-4).conicity, 0.1144, 1e-9);
    }
    conicity_curve_free(&curve);
}

/* A motion that turns right at a jump of delta_r: the jump has no part in it. */
static void turning_at_a_jump(void **state) {
    (void)state;
    const double y[] = {-0.004, -0.002, -0.002, 0.0, 0.002, 0.002, 0.004};
    const double r[] = {-0.009, -0.008, -0.0004, 0.0, 0.0004, 0.008, 0.009};
    struct conicity_curve curve = made(y, r, 7);
    struct conicity_motion m = motion_of(&curve, 0.002);
    near(m.conicity, 0.1, 1e-9);
    near(m.regression, 0.1, 1e-9);
    conicity_curve_free(&curve);
}

static void bad_points_are_named(void **state) {
    (void)state;
    struct conicity_curve curve;
    const double y[] = {-1.0, 0.0, 0.0, 1.0};
    const double back[] = {-1.0, 0.5, 0.0, 1.0};
    const double third[] = {-1.0, 0.0, 0.0, 0.0};
    const double nan_y[] = {-1.0, (double)NAN, 0.0, 1.0};
    const double r[] = {-1.0, 0.0, 0.0, 1.0};
    const double inf_r[] = {-1.0, 0.0, 0.0, (double)HUGE_VAL};
    assert_int_equal(conicity_curve_make(&curve, back, r, 4), 3);
    assert_int_equal(conicity_curve_make(&curve, third, r, 4), 4);
    assert_int_equal(conicity_curve_make(&curve, nan_y, r, 4), 2);
    assert_int_equal(conicity_curve_make(&curve, y, inf_r, 4), 4);
    assert_int_equal(conicity_curve_make(&curve, y, r, 2), 3);
    assert_null(curve.y_m);
    conicity_curve_free(&curve);
}

/* ---- EN 15302 ---- */

#define EN_POINTS 160

static size_t read_case(const char *name, double *y, double *r) {
    struct csv csv;
    size_t n = 0;
    csv_open(&csv, "tests/reference/en15302_delta_r.csv");
    while (csv_next(&csv)) {
        if (csv_is(&csv, "case", name)) {
            assert_true(n < EN_POINTS);
            y[n] = csv_named(&csv, "y_mm") / 1e3;
            r[n++] = csv_named(&csv, "delta_r_mm") / 1e3;
        }
    }
    csv_close(&csv);
    return n;
}

/* Every amplitude that the standard's own delta_r carries; its conicities have three decimals, so half
 * a unit of the last stands beside the tolerance. */
static void en_15302(void **state) {
    (void)state;
    static const struct {
        const char *name;
        size_t points;
        int amplitudes;
        double tolerance;
    } cases[] = {{"E1", 137, 59, 0.001},
                 {"E3", 137, 59, 0.001},
                 {"E5", 137, 45, 0.0065},
                 {"E7", 136, 42, 0.001}};
    for (size_t c = 0; c < 4; c++) {
        double y[EN_POINTS];
        double r[EN_POINTS];
        size_t n = read_case(cases[c].name, y, r);
        assert_int_equal(n, cases[c].points);
        struct conicity_curve curve = made(y, r, n);
        struct csv csv;
        int compared = 0;
        csv_open(&csv, "tests/reference/en15302_conicity.csv");
        while (csv_next(&csv)) {
            struct conicity_motion m;
            double a = csv_named(&csv, "amplitude_mm") / 1e3;
            enum conicity_status status = conicity_at(&curve, a, BASE_M, RADIUS_M, &m);
            assert_true(status == CONICITY_OK || status == CONICITY_BEYOND);
            if (status == CONICITY_OK) {
                near(m.conicity, csv_named(&csv, cases[c].name), cases[c].tolerance);
                compared++;
            }
        }
        csv_close(&csv);
        assert_int_equal(compared, cases[c].amplitudes);
        conicity_curve_free(&curve);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_cone_is_klingels),   cmocka_unit_test(a_constant_moves_the_line),
        cmocka_unit_test(a_jump_is_parabolas),  cmocka_unit_test(two_cones_are_two_half_waves),
        cmocka_unit_test(a_cubic_is_elliptic),  cmocka_unit_test(wells_and_hills),
        cmocka_unit_test(points_do_not_show),   cmocka_unit_test(turning_at_a_jump),
        cmocka_unit_test(bad_points_are_named), cmocka_unit_test(en_15302),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
