/*
 * Forces of elements and linkages (kl_force.h): tests/tools/good/elements.yaml displaced by hand,
 * where every force follows from the file's own figures; and Newton's law for a coach that runs.
 * Run from the project's root.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>
#include <math.h>
#include <string.h>

#include "model_file.h"

#define ELEMENTS "tests/tools/good/elements.yaml"
#define COACH "models/manchester_vehicle1.yaml"

static struct model_file mf;
static struct kl_model model;
static struct kl_state state;
static struct kl_input input;
static struct kl_output output;
static struct kl_work work;

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance)) {
        print_error("%.12g, expected %.12g +- %g\n", value, expected, tolerance);
        fail();
    }
}

static void load(const char *path, const char *track, double speed_m_s) {
    assert_int_equal(model_file_load(&mf, path, track, stderr), 0);
    assert_int_equal(model_file_build(&mf, &model, stderr), 0);
    assert_int_equal(kl_init(&model, &state, (kl_real)0, (kl_real)speed_m_s, &work), KL_OK);
    kl_input_init(&input);
    input.speed_m_s = (kl_real)speed_m_s;
}

static int unload(void **unused) {
    (void)unused;
    model_file_free(&mf);
    return 0;
}

static void displace(uint32_t body, enum kl_freedom freedom, int rate, double value) {
    state.x[kl_body_state_index(&model, body, freedom, rate)] = (kl_real)value;
}

static struct kl_element_force force_of(const char *name) {
    struct kl_element_force force;
    for (uint32_t i = 0; i < mf.vehicle.n_elements; i++) {
        if (strcmp(mf.vehicle.elements[i].name, name) == 0) {
            kl_element_force(&mf.vehicle, &model, i, &force, &work);
            return force;
        }
    }
    fail_msg("no element %s", name);
    return force;
}

static double linkage_of(const char *name) {
    for (uint32_t i = 0; i < mf.vehicle.n_linkages; i++) {
        if (strcmp(mf.vehicle.linkages[i].name, name) == 0) {
            return (double)kl_linkage_force(&mf.vehicle, &model, i, &work);
        }
    }
    fail_msg("no linkage %s", name);
    return 0.0;
}

static void observe(void) {
    kl_refresh(&model, &state, &work);
    kl_observe(&model, &state, &input, &output, &work);
}

/* The body 30 mm to the right of the frame, which stands still; body 0, frame 1. */
static void test_aside(void **unused) {
    (void)unused;
    load(ELEMENTS, NULL, 0.0);
    displace(0, KL_Y, 0, 0.030);
    input.actuator_N[1] = (kl_real)500;
    observe();
    assert_near((double)force_of("air_spring_r").axis[KL_Y + 1], 1.6e5 * 0.030, 1e-6);
    assert_near((double)force_of("air_spring_l").axis[KL_Y + 1], 1.6e5 * 0.030, 1e-6);
    assert_near((double)force_of("lateral_stop").stop, 600.0, 1e-9);
    /* to 10 kN over the second centimetre beyond 20 mm; the left one the other way */
    assert_near((double)force_of("side_stop_r").stop, 1e4, 1e-6);
    assert_near((double)force_of("side_stop_l").stop, 0.0, 1e-9);
    /* the damper stands across; 6 MN/m would be 180 kN, but it blows off */
    assert_near((double)force_of("lateral_damper").slip, 9e3, 1e-6);
    assert_near((double)force_of("rod").line_N, 0.0, 1e-9);
    assert_near((double)force_of("wind").actuator, -500.0, 0.0);
    assert_near((double)force_of("box_front_r").axis[1], 0.0, 1e-9);
    assert_near(linkage_of("cross_bracing"), 0.0, 1e-9);
}

/* The body sinks at 50 mm/s and turns by 1 mrad, at 0.5 rad/s in pitch. */
static void test_rates_and_turning(void **unused) {
    (void)unused;
    load(ELEMENTS, NULL, 0.0);
    displace(0, KL_Z, 1, 0.050);
    displace(0, KL_YAW, 0, 1e-3);
    displace(0, KL_PITCH, 1, 0.5);
    observe();
    assert_near((double)force_of("vertical_damper_r").damper, 1e3, 1e-6); /* half of 2 kN */
    assert_near((double)force_of("air_spring_l").axis[2], 2e4 * 0.050, 1e-6);
    assert_near((double)force_of("pitch_hold").axis[4], 1e4 * 0.5, 1e-6);
    assert_near((double)force_of("pitch_hold").axis[5], 1e5 * 1e-3, 1e-6);
    assert_near((double)force_of("yaw_friction").slip, 2e6 * 1e-3, 1e-6); /* sticks: below 4 kN m */
    displace(0, KL_YAW, 0, 5e-3);
    observe();
    assert_near((double)force_of("yaw_friction").slip, 4e3, 1e-6); /* slides */
}

static void test_linkages(void **unused) {
    (void)unused;
    load(ELEMENTS, NULL, 0.0);
    state.x[kl_wheelset_state_index(&model, 0, KL_WS_Y)] = (kl_real)1e-3;
    state.x[kl_wheelset_state_index(&model, 1, KL_WS_YAW)] = (kl_real)2e-4;
    observe();
    assert_near(linkage_of("cross_bracing"), 4e6 * (1e-3 - 1.25 * 2e-4), 1e-3);
    assert_true(linkage_of("steering") < 0.0); /* rigid; yaw(front) - yaw(rear) */
}

/* m y'' and m z'' of the car body of a coach in a transition are the sum of its elements' forces; on
 * straight track, where its frame does not turn. Its springs sway, which adds a lateral force of the
 * loads: so vertically to rounding, and laterally where nothing leans. */
static void test_newton(void **unused) {
    (void)unused;
    load(COACH, "models/straight_erri_high.yaml", 30.0);
    for (int i = 0; i < 2500; i++) {
        (void)kl_step(&model, &state, &input, &output, &work);
    }
    observe();
    double z = 0.0;
    double largest = 0.0;
    for (uint32_t i = 0; i < mf.vehicle.n_elements; i++) {
        struct kl_element_force force;
        kl_element_force(&mf.vehicle, &model, i, &force, &work);
        if (mf.vehicle.elements[i].end_a == 0) {
            z -= (double)force.axis[2];
            largest = fmax(largest, fabs((double)force.axis[2]));
        }
    }
    const double wanted = 32000.0 * (double)output.body[0].acceleration[KL_Z];
    assert_true(largest > 100.0);
    assert_near(z, wanted, 1e-6 * largest);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_aside, unload),
        cmocka_unit_test_teardown(test_rates_and_turning, unload),
        cmocka_unit_test_teardown(test_linkages, unload),
        cmocka_unit_test_teardown(test_newton, unload),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
