/* The profiles of models/profiles against their definitions and a published point table. Run from
 * the project's root. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>
#include <math.h>
#include <stdlib.h>

#include "model_file.h"

#define RAIL_CANT 0.02499479361892016 /* atan(1/40) */

static struct model_file mf;
static struct kl_profile wheel;
static struct kl_profile rail; /* upright */
static unsigned char memory[1 << 18];

static int load(void **state) {
    (void)state;
    struct kl_arena arena;
    kl_arena_init(&arena, memory, sizeof memory);
    if (model_file_load(&mf, "models/two_axle_wagon.yaml", NULL, stderr) != 0) {
        return -1;
    }
    const struct kl_pair_def *pair = &mf.vehicle.pairs[0];
    return kl_profile_build(&pair->wheel[0].profile, 0, &arena, &wheel, NULL) != KL_OK ||
           kl_profile_build(&pair->rail[0].profile, 0, &arena, &rail, NULL) != KL_OK;
}

static int unload(void **state) {
    (void)state;
    model_file_free(&mf);
    return 0;
}

static double zeta_mm(const struct kl_profile *profile, double eta_mm) {
    return (double)kl_profile_at(profile, (kl_real)(eta_mm / 1000.0)).zeta_m * 1000.0;
}

static double slope_deg(const struct kl_profile *profile, double eta_mm) {
    return atan((double)kl_profile_at(profile, (kl_real)(eta_mm / 1000.0)).slope) *
           57.29577951308232;
}

/* Points of the Manchester contact benchmark's S1002 (file MBench_S1002_v3 of the CONTACT
 * examples): y from the tape line towards the flange, z down, mm. */
static void test_wheel_meets_the_benchmark(void **state) {
    (void)state;
    static const double point[][2] = {
        {42.039956, 20.110714},    {40.747062, 17.932114},    {37.814698, 10.585419},
        {32.254015, 4.9261168},    {24.940124, 2.4962203},    {16.226081, 1.1019054},
        {6.3226037, 0.28229325},   {-4.4933683, -0.12185443}, {-15.540845, -0.26044927},
        {-25.681054, -0.44883835}, {-34.549661, -0.9389871},  {-43.26553, -1.5200451},
        {-51.9814, -2.101103}};
    for (size_t i = 0; i < sizeof point / sizeof point[0]; i++) {
        assert_true(fabs(zeta_mm(&wheel, point[i][0]) - point[i][1]) < 0.0005);
    }
}

/* Points of the same benchmark's UIC60, canted 1:40, y towards the field, z down from the highest
 * point of the canted head, mm. The head's top is an arc of 300 mm, so its highest point lies
 * 300 sin(cant) from the middle and 300 (1 - cos(cant)) above the middle of the head. */
static void test_rail_meets_the_benchmark(void **state) {
    (void)state;
    static const double point[][2] = {{-27.062596, 1.6085003},   {-17.237161, 0.49595173},
                                      {-4.9636765, 0.041164848}, {6.4443153, 0.1232364},
                                      {15.305911, 1.0904245},    {21.681023, 2.7839235}};
    const double s = sin(RAIL_CANT);
    const double c = cos(RAIL_CANT);
    for (size_t i = 0; i < sizeof point / sizeof point[0]; i++) {
        double y = point[i][0] + 300.0 * s;
        double z = point[i][1] - 300.0 * (1.0 - c);
        double upright_y = y * c - z * s;
        double upright_z = y * s + z * c;
        assert_true(fabs(zeta_mm(&rail, -upright_y) - upright_z) < 0.004);
    }
}

static void test_marks_of_the_definitions(void **state) {
    (void)state;
    /* EN 13715: zero at the tape line, flange angle 70 degrees, run-out 1:15 on the field side */
    assert_true(fabs(zeta_mm(&wheel, 0.0)) < 1e-9);
    double steepest = 0.0;
    for (double eta = 30.0; eta < 43.5; eta += 0.01) {
        steepest = fmax(steepest, slope_deg(&wheel, eta));
    }
    assert_true(fabs(steepest - 70.0) < 0.06);
    assert_true(fabs(tan(slope_deg(&wheel, -45.0) / 57.29577951308232) - 1.0 / 15.0) < 1e-6);
    /* UIC 861-3: height of the head where its first arcs join */
    assert_true(fabs(zeta_mm(&rail, 10.52) - 0.184) < 0.001);
    assert_true((double)wheel.eta_max_m >= 0.0439 && (double)wheel.eta_min_m <= -0.0599);
}

/* Curvatures of the splines are those of the arcs, from 1 mm beside the joins on. */
static void test_smooth_enough_for_hertz(void **state) {
    (void)state;
    static const double arc[][3] = {/* from, to mm, radius mm */
                                    {0.0, 9.6, 300.0},
                                    {11.2, 24.9, 80.0},
                                    {26.7, 34.5, 13.0}};
    for (size_t i = 0; i < 3; i++) {
        for (double eta = arc[i][0]; eta <= arc[i][1]; eta += 0.05) {
            struct kl_profile_point p = kl_profile_at(&rail, (kl_real)(eta / 1000.0));
            double slope = (double)p.slope;
            double curvature = (double)p.second_1_m / pow(1.0 + slope * slope, 1.5);
            assert_true(fabs(curvature * arc[i][2] / 1000.0 - 1.0) < 0.02);
        }
    }
}

static void test_rail_is_symmetric(void **state) {
    (void)state;
    const struct kl_profile_def *def = &mf.vehicle.pairs[0].rail[0].profile;
    for (uint32_t i = 0; i < def->n_points; i++) {
        assert_true(def->eta_m[i] == -def->eta_m[def->n_points - 1 - i]);
        assert_true(def->zeta_m[i] == def->zeta_m[def->n_points - 1 - i]);
    }
}

static void test_files_are_what_the_script_writes(void **state) {
    (void)state;
    assert_int_equal(system("/usr/bin/python3 -B models/profiles/generate.py --check"), 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_wheel_meets_the_benchmark),
        cmocka_unit_test(test_rail_meets_the_benchmark),
        cmocka_unit_test(test_marks_of_the_definitions),
        cmocka_unit_test(test_smooth_enough_for_hertz),
        cmocka_unit_test(test_rail_is_symmetric),
        cmocka_unit_test(test_files_are_what_the_script_writes),
    };
    return cmocka_run_group_tests(tests, load, unload);
}
