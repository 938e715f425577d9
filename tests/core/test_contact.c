/* The contact patch: Hertz and Kalker against the reference files, and the properties that a
 * creep-force law must have. */
#include "fixtures.h"

static double relative(double got, double want) {
    return fabs(got - want) / fabs(want);
}

static void hertz_agrees_with_elliptic_integrals(void **state) {
    (void)state;
    struct csv csv;
    int rows = 0;
    csv_open(&csv, "tests/reference/hertz.csv");
    while (csv_next(&csv)) {
        const struct kl_ellipse e =
            kl_hertz(csv_named(&csv, "A_1_m"), csv_named(&csv, "B_1_m"),
                     csv_named(&csv, "shear_modulus_Pa"), csv_named(&csv, "poisson"));
        assert_at_most(relative(e.semi_a_1, csv_named(&csv, "semi_a_m_at_1N")), 1e-11);
        assert_at_most(relative(e.semi_b_1, csv_named(&csv, "semi_b_m_at_1N")), 1e-11);
        assert_at_most(relative(e.semi_a_1 * cbrt(82e3), csv_named(&csv, "semi_a_m_at_82kN")),
                       1e-11);
        const double approach =
            kl_hertz_approach(csv_named(&csv, "A_1_m"), csv_named(&csv, "B_1_m"),
                              csv_named(&csv, "shear_modulus_Pa"), csv_named(&csv, "poisson"));
        assert_at_most(relative(approach, csv_named(&csv, "approach_m_at_1N")), 1e-11);
        rows++;
    }
    csv_close(&csv);
    assert_int_equal(rows, 26);
}

/* physics.md section 4: A 0.8464, B 2.406 1/m, 82 kN gives 8.0000 x 4.0001 mm. */
static void hertz_gives_8_by_4_mm(void **state) {
    (void)state;
    const struct kl_ellipse e = kl_hertz(0.8464, 2.406, 82e9, 0.28);
    assert_near(1e3 * e.semi_a_1 * cbrt(82e3), 8.0000, 5e-5);
    assert_near(1e3 * e.semi_b_1 * cbrt(82e3), 4.0001, 5e-5);
}

/* A sphere on a plane: a^3 = 3 N (1 - nu) R/(4 G), and the axes swap with the curvatures. */
static void hertz_is_symmetric(void **state) {
    (void)state;
    const double radius = 0.3;
    const struct kl_ellipse sphere = kl_hertz(0.5 / radius, 0.5 / radius, 80e9, 0.3);
    assert_at_most(relative(sphere.semi_a_1, cbrt(3.0 * 0.7 * radius / (4.0 * 80e9))), 1e-12);
    assert_at_most(relative(sphere.semi_b_1, sphere.semi_a_1), 1e-12);
    /* and it sinks by a^2/R */
    assert_at_most(relative(kl_hertz_approach(0.5 / radius, 0.5 / radius, 80e9, 0.3),
                            sphere.semi_a_1 * sphere.semi_a_1 / radius),
                   1e-12);
    uint64_t seed = 11;
    for (int i = 0; i < 2000; i++) {
        const double a = pow(10.0, random_between(&seed, -2.0, 3.0));
        const double b = pow(10.0, random_between(&seed, -2.0, 3.0));
        const struct kl_ellipse e = kl_hertz(a, b, 82e9, 0.28);
        const struct kl_ellipse swapped = kl_hertz(b, a, 82e9, 0.28);
        assert_true(e.semi_a_1 == swapped.semi_b_1 && e.semi_b_1 == swapped.semi_a_1);
        const double ratio = e.semi_a_1 / e.semi_b_1;
        assert_true(ratio >= KL_HERTZ_MIN_RATIO - 1e-9 && ratio <= 1.0 / KL_HERTZ_MIN_RATIO + 1e-7);
        assert_true(a == b || (a < b) == (ratio > 1.0));
        assert_true(kl_hertz_approach(a, b, 82e9, 0.28) == kl_hertz_approach(b, a, 82e9, 0.28));
    }
}

/* What a table row holds at one newton: G c^2 C11 ... with C33 too. */
static void coefficients_at_unit_load(void **state) {
    (void)state;
    struct csv csv;
    csv_open(&csv, "tests/reference/hertz.csv");
    while (csv_next(&csv)) {
        const double g = csv_named(&csv, "shear_modulus_Pa");
        const double nu = csv_named(&csv, "poisson");
        const struct kl_ellipse e =
            kl_hertz(csv_named(&csv, "A_1_m"), csv_named(&csv, "B_1_m"), g, nu);
        const struct kl_kalker c = kl_kalker_coefficients(e.semi_a_1 / e.semi_b_1, nu);
        const double cc = e.semi_a_1 * e.semi_b_1;
        assert_at_most(relative(g * cc * c.c11, csv_named(&csv, "f11_1")), 1e-10);
        assert_at_most(relative(g * cc * c.c22, csv_named(&csv, "f22_1")), 1e-10);
        assert_at_most(relative(g * cc * sqrt(cc) * c.c23, csv_named(&csv, "f23_1")), 1e-10);
        assert_at_most(relative(g * cc * cc * c.c33, csv_named(&csv, "f33_1")), 1e-10);
    }
    csv_close(&csv);
}

static void kalker_agrees_with_his_table(void **state) {
    (void)state;
    struct csv csv;
    int rows = 0;
    csv_open(&csv, "tests/reference/kalker.csv");
    while (csv_next(&csv)) {
        const struct kl_kalker c =
            kl_kalker_coefficients(csv_named(&csv, "a_over_b"), csv_named(&csv, "poisson"));
        assert_at_most(relative(c.c11, csv_named(&csv, "c11")), 1e-11);
        assert_at_most(relative(c.c22, csv_named(&csv, "c22")), 1e-11);
        assert_at_most(relative(c.c23, csv_named(&csv, "c23")), 1e-11);
        assert_at_most(relative(c.c33, csv_named(&csv, "c33")), 1e-11);
        rows++;
    }
    csv_close(&csv);
    assert_int_equal(rows, 234);
}

/* ---- the law ---- */

static const struct kl_creep_coefficients typical = {(kl_real)7.44e6, (kl_real)6.79e6,
                                                     (kl_real)13.7e3, (kl_real)20.0};

static struct kl_creep_force she(double n, double mu, double g1, double g2, double w3) {
    const struct kl_creepage creepage = {(kl_real)g1, (kl_real)g2, (kl_real)w3};
    return kl_creep(KL_CREEP_SHE, &typical, (kl_real)mu, (kl_real)n, &creepage);
}

static double size_of(const struct kl_creep_force *f) {
    return hypot((double)f->t1_N, (double)f->t2_N);
}

/* T1 = -f11 g1, T2 = -f22 g2 - f23 w3, M3 = f23 g2 - f33 w3: physics.md section 4. */
static void linear_law(void **state) {
    (void)state;
    const struct kl_creepage creepage = {(kl_real)1e-3, (kl_real)-2e-3, (kl_real)0.3};
    const struct kl_creep_force f = kl_creep(KL_CREEP_LINEAR, &typical, 0, 0, &creepage);
    assert_near((double)f.t1_N, -7440.0, 1e-9);
    assert_near((double)f.t2_N, 2.0 * 6790.0 - 0.3 * 13.7e3, 1e-9);
    assert_near((double)f.m3_Nm, -2e-3 * 13.7e3 - 20.0 * 0.3, 1e-12);
    assert_near((double)f.reduction, 1.0, 0.0);
}

/* Slope at the origin, and how it bends: |T| = |T linear| (1 - u/3 + u^2/27), u = |T linear|/mu N.
 */
static void saturating_law_begins_linear(void **state) {
    (void)state;
    for (double g = 1e-9; g < 1e-6; g *= 3.0) {
        const struct kl_creep_force f = she(80e3, 0.3, g, 0.0, 0.0);
        const double u = 7.44e6 * g / 24e3;
        assert_at_most(relative(-(double)f.t1_N / g, 7.44e6 * (1.0 - u / 3.0 + u * u / 27.0)),
                       1e-13);
    }
}

/* Shen-Hedrick-Elkins at chosen points: u = 1 gives 19/27 of mu N, u = 3 and beyond all of it. */
static void saturating_law_at_known_points(void **state) {
    (void)state;
    const double limit = 0.3 * 80e3;
    const double u[] = {0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 100.0};
    const double part[] = {
        0.5 - 0.25 / 3.0 + 0.125 / 27.0, 19.0 / 27.0, 0.875, 26.0 / 27.0, 1.0, 1.0, 1.0};
    for (size_t i = 0; i < COUNT(u); i++) {
        const struct kl_creep_force f = she(80e3, 0.3, u[i] * limit / 7.44e6, 0.0, 0.0);
        assert_at_most(relative(-(double)f.t1_N, part[i] * limit), 1e-14);
        assert_at_most(relative((double)f.reduction, part[i] / u[i]), 1e-14);
    }
}

/* Value and slope are continuous where sliding begins. */
static void continuous_where_sliding_begins(void **state) {
    (void)state;
    const double at = 3.0 * 24e3 / 7.44e6;
    const double d = 1e-6 * at;
    const double below = -(double)she(80e3, 0.3, at - d, 0.0, 0.0).t1_N;
    const double above = -(double)she(80e3, 0.3, at + d, 0.0, 0.0).t1_N;
    assert_near(below, 24e3, 1e-11 * 24e3); /* third order contact with the limit */
    assert_near(above, 24e3, 1e-11 * 24e3);
    const double last = (double)she(80e3, 0.3, nextafter(at, 0.0), 0.0, 0.0).t1_N;
    const double next = (double)she(80e3, 0.3, nextafter(at, 1.0), 0.0, 0.0).t1_N;
    assert_near(last, next, 1e-11);
}

/* More creepage never gives less force. */
static void monotonic(void **state) {
    (void)state;
    double before = 0.0;
    for (double g = 0.0; g < 0.03; g += 1e-5) {
        const struct kl_creep_force f = she(80e3, 0.3, 0.3 * g, -g, 0.0);
        assert_true(size_of(&f) >= before * (1.0 - 1e-15));
        before = size_of(&f);
    }
}

/* Mirroring the creepages mirrors the forces, bit for bit. */
static void odd_in_every_creepage(void **state) {
    (void)state;
    uint64_t seed = 12;
    for (int i = 0; i < 100000; i++) {
        const double g1 = random_between(&seed, -0.02, 0.02);
        const double g2 = random_between(&seed, -0.02, 0.02);
        const double w3 = random_between(&seed, -1.0, 1.0);
        const struct kl_creep_force f = she(5e4, 0.3, g1, g2, w3);
        const struct kl_creep_force back = she(5e4, 0.3, -g1, g2, w3);
        const struct kl_creep_force mirror = she(5e4, 0.3, g1, -g2, -w3);
        assert_true(f.t1_N == -back.t1_N && f.t2_N == back.t2_N && f.m3_Nm == back.m3_Nm);
        assert_true(f.t1_N == mirror.t1_N && f.t2_N == -mirror.t2_N && f.m3_Nm == -mirror.m3_Nm);
    }
}

/* A lifted wheel, or no friction, carries nothing - not even with constant coefficients. */
static void no_load_no_force(void **state) {
    (void)state;
    const double cases[][2] = {{0.0, 0.3}, {80e3, 0.0}, {0.0, 0.0}};
    for (size_t i = 0; i < COUNT(cases); i++) {
        const struct kl_creep_force f = she(cases[i][0], cases[i][1], 1e-3, -2e-3, 0.5);
        assert_true(f.t1_N == 0 && f.t2_N == 0 && f.m3_Nm == 0 && f.reduction == 0);
    }
    const struct kl_creep_force still = she(80e3, 0.3, 0.0, 0.0, 0.0);
    assert_true(still.t1_N == 0 && still.t2_N == 0 && still.m3_Nm == 0 && still.reduction == 1);
}

/* Two million contacts, most of them absurd: finite, within mu N, reduction in 0..1. */
static void never_beyond_friction_and_always_finite(void **state) {
    (void)state;
    uint64_t seed = 13;
    print_message("seed 13\n");
    for (int i = 0; i < 2000000; i++) {
        const double big = i % 2 == 0 ? 2.0 : 30.0;
        double v[6];
        for (int k = 0; k < 6; k++) {
            const double sign = random_bits(&seed) & 1u ? 1.0 : -1.0;
            v[k] = sign * ldexp(1.0, (int)random_between(&seed, -20.0 * big, 10.0 * big));
        }
        const struct kl_creep_coefficients f = {(kl_real)fmin(fabs(v[0]), 1e12), (kl_real)6e6,
                                                (kl_real)fmin(fabs(v[1]), 1e12), (kl_real)20};
        const struct kl_creepage creepage = {(kl_real)v[2], (kl_real)v[3], (kl_real)v[4]};
        const double n = fabs(v[5]);
        const struct kl_creep_force force =
            kl_creep(KL_CREEP_SHE, &f, (kl_real)0.3, (kl_real)n, &creepage);
        const double size = size_of(&force);
        /* below a nanonewton of friction the law no longer cares */
        if (!(size <= fmax(0.3 * n * (1.0 + 1e-14), 1e-9)) || !isfinite((double)force.m3_Nm) ||
            !(force.reduction >= 0 && force.reduction <= 1)) {
            fail_msg("case %d: |T| %g, mu N %g, reduction %g", i, size, 0.3 * n,
                     (double)force.reduction);
        }
    }
}

/* Friction takes power from the wheel, whatever the creepages: f23 works both ways and cancels. */
static void dissipates(void **state) {
    (void)state;
    uint64_t seed = 14;
    for (int i = 0; i < 200000; i++) {
        const double g1 = random_between(&seed, -0.02, 0.02);
        const double g2 = random_between(&seed, -0.02, 0.02);
        const double w3 = random_between(&seed, -1.0, 1.0);
        const struct kl_creep_force f = she(5e4, 0.3, g1, g2, w3);
        const double power = (double)f.t1_N * g1 + (double)f.t2_N * g2 + (double)f.m3_Nm * w3;
        assert_true(power <= 0.0);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(hertz_agrees_with_elliptic_integrals),
        cmocka_unit_test(hertz_gives_8_by_4_mm),
        cmocka_unit_test(hertz_is_symmetric),
        cmocka_unit_test(coefficients_at_unit_load),
        cmocka_unit_test(kalker_agrees_with_his_table),
        cmocka_unit_test(linear_law),
        cmocka_unit_test(saturating_law_begins_linear),
        cmocka_unit_test(saturating_law_at_known_points),
        cmocka_unit_test(continuous_where_sliding_begins),
        cmocka_unit_test(monotonic),
        cmocka_unit_test(odd_in_every_creepage),
        cmocka_unit_test(no_load_no_force),
        cmocka_unit_test(never_beyond_friction_and_always_finite),
        cmocka_unit_test(dissipates),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
