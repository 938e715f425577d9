/* What the loader makes of good files: every key lands where it should. Run from the project's
 * root. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>
#include <dirent.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "model_file.h"

#define FULL "tests/tools/good/full.yaml"
#define FULL_TRACK "tests/tools/good/full_track.yaml"
#define COMBINED "tests/tools/good/combined_track.yaml"
#define RESTRAINED "models/restrained_wheelset.yaml"

/* Exact where the file's number is taken as it is. */
#define same(a, b) assert_true((a) == (b))

static void load(struct model_file *mf, const char *vehicle, const char *track) {
    assert_int_equal(model_file_load(mf, vehicle, track, stderr), 0);
}

/* The messages of a failing call, and that it fails. */
static char said[4096];

static FILE *listen(void) {
    memset(said, 0, sizeof said);
    return fmemopen(said, sizeof said - 1, "w");
}

static void test_scalars_and_bodies(void **state) {
    (void)state;
    struct model_file mf;
    load(&mf, FULL, NULL);
    const struct kl_vehicle_def *v = &mf.vehicle;
    assert_string_equal(v->name, "full");
    same(v->step_ns, 500000);
    same(v->gravity_m_s2, 9.5);
    same(v->acceleration_limit_m_s2, 2.5);
    assert_int_equal(v->n_bodies, 1);
    assert_string_equal(v->bodies[0].name, "body");
    same(v->bodies[0].mass_kg, 30000.0);
    same(v->bodies[0].inertia_kgm2[0], 11.0);
    same(v->bodies[0].inertia_kgm2[1], 12.0);
    same(v->bodies[0].inertia_kgm2[2], 13.0);
    same(v->bodies[0].x_m, 0.25);
    same(v->bodies[0].z_m, -1.5);
    assert_int_equal(v->bodies[0].freedoms, KL_HAS(KL_Y) | KL_HAS(KL_ROLL) | KL_HAS(KL_YAW));
    assert_ptr_equal(v->track, &mf.track);
    assert_int_equal(mf.track.n_curvature + mf.track.n_cant + mf.track.irregularity.n_samples, 0);
    assert_string_equal(mf.track_name, "straight");
    model_file_free(&mf);
}

static void test_wheelsets(void **state) {
    (void)state;
    struct model_file mf;
    load(&mf, FULL, NULL);
    assert_int_equal(mf.vehicle.n_wheelsets, 3);
    const struct kl_wheelset_def *w = mf.vehicle.wheelsets;
    assert_string_equal(w[0].name, "front");
    same(w[0].mass_kg, 1100.0);
    same(w[0].inertia_roll_kgm2, 21.0);
    same(w[0].inertia_spin_kgm2, 22.0);
    same(w[0].inertia_yaw_kgm2, 23.0);
    same(w[0].x_m, 3.5);
    same(w[0].load_N, 44.0);
    assert_int_equal(w[0].pair, 1);
    assert_int_equal(w[0].creep.law, KL_CREEP_SHE);
    same(w[0].creep.friction, (kl_real)0.35);
    same(w[0].creep.f11_N, (kl_real)0);
    same(w[1].load_N, 0.0);
    assert_int_equal(w[1].pair, 0);
    assert_int_equal(w[1].creep.law, KL_CREEP_LINEAR);
    same(w[1].creep.f11_N, (kl_real)1e6);
    same(w[1].creep.f22_N, (kl_real)2e6);
    same(w[1].creep.f23_Nm, (kl_real)3e3);
    same(w[1].creep.f33_Nm2, (kl_real)4.5);
    assert_int_equal(w[2].creep.law, KL_CREEP_SHE); /* by its alias */
    same(w[2].creep.friction, (kl_real)0.35);
    model_file_free(&mf);
}

static void test_pairs(void **state) {
    (void)state;
    struct model_file mf;
    load(&mf, FULL, NULL);
    assert_int_equal(mf.vehicle.n_pairs, 3);
    assert_string_equal(model_file_pair_name(&mf, 0), "conical");
    assert_string_equal(model_file_pair_name(&mf, 1), "curved");
    assert_string_equal(model_file_pair_name(&mf, 2), "half");
    assert_string_equal(model_file_pair_name(&mf, 3), "?");
    const struct kl_pair_def *p = mf.vehicle.pairs;
    assert_int_equal(p[0].kind, KL_PAIR_LINEAR);
    same(p[0].radius_m, 0.45);
    same(p[0].half_base_m, 0.75);
    same(p[0].conicity, 0.1);
    same(p[0].curvature_1_m, 3.3);
    same(p[0].material.shear_modulus_Pa, 80e9);
    same(p[0].material.poisson, 0.3);
    same(p[0].step_m, 2e-4);
    same(p[0].range_m, 0.012);
    assert_int_equal(p[1].kind, KL_PAIR_PROFILES);
    assert_int_equal(p[1].kinematics, KL_KINEMATICS_PRINTED);
    same(p[1].material.shear_modulus_Pa, 82e9); /* steel, where nothing is said */
    same(p[1].material.poisson, 0.28);
    const struct kl_wheel_def *right = &p[1].wheel[KL_RIGHT];
    const struct kl_wheel_def *left = &p[1].wheel[KL_LEFT];
    assert_int_equal(right->profile.kind, KL_PROFILE_ARC);
    same(right->profile.radius_m, 0.0);
    same(right->profile.slope_rad, 0.05);
    same(right->profile.half_width_m, 0.04);
    same(right->radius_m, 0.46);
    same(right->half_spacing_m, 0.76);
    same(left->profile.radius_m, 0.5);
    same(left->radius_m, 0.47);
    same(left->half_spacing_m, 0.77);
    assert_int_equal(p[2].kinematics, KL_KINEMATICS_RIGID);
    same(p[2].wheel[KL_LEFT].radius_m, 0.46);
    same(p[2].rail[KL_RIGHT].cant_rad, 0.0);
    same(p[2].rail[KL_RIGHT].half_spacing_m, 0.75);
    same(p[2].rail[KL_LEFT].cant_rad, 0.05);
    same(p[2].rail[KL_LEFT].half_spacing_m, 0.751);
    model_file_free(&mf);
}

static void test_points_of_a_profile(void **state) {
    (void)state;
    static const double eta[8] = {-0.030, -0.020, -0.010, 0.0, 0.010, 0.020, 0.030, 0.0375};
    static const double zeta[8] = {0.009, 0.004, 0.001, 0.0, 0.001, 0.004, 0.009, 0.0165};
    struct model_file mf;
    load(&mf, FULL, NULL);
    for (int side = 0; side < KL_SIDES; side++) {
        const struct kl_rail_def *rail = &mf.vehicle.pairs[1].rail[side];
        assert_int_equal(rail->profile.kind, KL_PROFILE_POINTS);
        assert_int_equal(rail->profile.n_points, 8);
        for (int i = 0; i < 8; i++) {
            same(rail->profile.eta_m[i], eta[i]);
            same(rail->profile.zeta_m[i], zeta[i]);
        }
        assert_true(fabs(rail->cant_rad - 0.0499583957219428) < 1e-15); /* atan(1/20) */
        same(rail->gauge_m, 1.432);
        same(rail->gauge_depth_m, 0.016);
        same(rail->half_spacing_m, 0.0);
    }
    model_file_free(&mf);
}

static void test_elements(void **state) {
    (void)state;
    struct model_file mf;
    load(&mf, FULL, NULL);
    assert_int_equal(mf.vehicle.n_elements, 3);
    const struct kl_element_def *e = mf.vehicle.elements;
    assert_string_equal(e[0].name, "box_r");
    assert_string_equal(e[1].name, "box_l");
    assert_string_equal(e[2].name, "rod");
    for (int i = 0; i < 2; i++) {
        assert_int_equal(e[i].end_a, 0);
        assert_int_equal(e[i].end_b, KL_WHEELSET_END(0));
        same(e[i].point_a_m[0], 3.5);
        same(e[i].point_a_m[1], i == 0 ? 1.0 : -1.0);
        same(e[i].point_a_m[2], -0.5);
        same(e[i].point_b_m[1], e[i].point_a_m[1]);
        for (int axis = 0; axis < 3; axis++) {
            same(e[i].k[axis], axis + 1.0);
            same(e[i].k[3 + axis], axis + 4.0);
            same(e[i].c[axis], axis + 7.0);
            same(e[i].c[3 + axis], axis + 10.0);
        }
    }
    assert_int_equal(e[2].end_a, KL_GROUND_END);
    assert_int_equal(e[2].end_b, KL_WHEELSET_END(1));
    same(e[2].point_a_m[0], -4.5);
    same(e[2].point_b_m[0], -3.5);
    same(e[2].point_b_m[1], 0.1);
    same(e[2].point_b_m[2], -0.7);
    same(e[2].k[0], 100.0);
    same(e[2].c[0], 0.0);
    model_file_free(&mf);
}

static void test_track(void **state) {
    (void)state;
    struct model_file mf;
    load(&mf, RESTRAINED, FULL_TRACK);
    const struct kl_track_def *t = &mf.track;
    assert_string_equal(mf.track_name, "full track");
    same(mf.track_length_m, 90.0);
    same(t->curvature_start_1_m, -0.001);
    assert_true(fabs(t->cant_start_rad + asin(0.040 / 1.6)) < 1e-16);
    assert_int_equal(t->n_curvature, 3);
    assert_int_equal(t->curvature[0].shape, KL_RAMP_CONSTANT);
    same(t->curvature[0].length_m, 10.0);
    assert_int_equal(t->curvature[1].shape, KL_RAMP_LINEAR);
    same(t->curvature[1].to, 0.001);
    assert_int_equal(t->curvature[2].shape, KL_RAMP_BLOSS);
    same(t->curvature[2].to, 1.0 / 400.0);
    assert_int_equal(t->n_cant, 2);
    assert_int_equal(t->cant[0].shape, KL_RAMP_HALF_SINE);
    assert_true(fabs(t->cant[0].to - asin(0.080 / 1.6)) < 1e-16);
    same(t->cant[1].to, 0.01);
    const struct kl_irregularity_def *r = &t->irregularity;
    assert_int_equal(r->n_samples, 5);
    same(r->start_m, 5.0);
    same(r->step_m, 0.5);
    same(r->lateral_m[3], -0.004);
    assert_null(r->vertical_m);
    same(r->cross_rad[1], -0.0005);
    same(r->gauge_m[3], -0.004);
    model_file_free(&mf);
}

static void test_combined_track(void **state) {
    (void)state;
    struct model_file mf;
    load(&mf, RESTRAINED, COMBINED);
    const struct kl_track_def *t = &mf.track;
    assert_int_equal(t->n_curvature, 3);
    assert_int_equal(t->n_cant, 3);
    assert_int_equal(t->curvature[1].shape, KL_RAMP_CONSTANT);
    assert_int_equal(t->cant[1].shape, KL_RAMP_LINEAR);
    assert_int_equal(t->cant[2].shape, KL_RAMP_CONSTANT);
    assert_true(fabs(t->cant[0].to - asin(0.1)) < 1e-16);
    const struct kl_irregularity_def *r = &t->irregularity;
    assert_int_equal(r->n_samples, 201);
    same(r->start_m, 2.0);
    assert_non_null(r->lateral_m);
    assert_null(r->vertical_m);
    assert_null(r->cross_rad);
    double square = 0.0;
    for (uint32_t i = 0; i < r->n_samples; i++) {
        square += r->lateral_m[i] * r->lateral_m[i] / r->n_samples;
    }
    /* the integral of the spectrum from 2 pi/50 to 2 pi/3 rad/m is 1.30e-6 m2: 1.14 mm rms */
    assert_true(sqrt(square) > 0.0005 && sqrt(square) < 0.0025);
    model_file_free(&mf);
}

static void test_set(void **state) {
    (void)state;
    struct model_file mf;
    static const char *const row[] = {"elements.restraint.k_N_m[1]=1e6",
                                      "elements[0].k_Nm_rad[2]=1.5e6"};
    load(&mf, RESTRAINED, COMBINED);
    assert_int_equal(model_file_set(&mf, row, 2, stderr), 0);
    same(mf.vehicle.elements[0].k[1], 1e6);
    same(mf.vehicle.elements[0].k[5], 1.5e6);
    same(mf.vehicle.wheelsets[0].mass_kg, 1250.0);
    static const char *const mixed[] = {"track.segments[0].length_m=12",
                                        "wheelsets.wheelset.mass_kg=99",
                                        "elements.restraint.k_N_m=[1, 2, 3]"};
    assert_int_equal(model_file_set(&mf, mixed, 3, stderr), 0);
    same(mf.vehicle.elements[0].k[1], 2.0);
    same(mf.vehicle.elements[0].k[5], 1.5e6); /* of the first set */
    same(mf.vehicle.wheelsets[0].mass_kg, 99.0);
    same(mf.track.curvature[0].length_m, 12.0);
    same(mf.track_length_m, 62.0);
    assert_ptr_equal(mf.vehicle.track, &mf.track);
    model_file_free(&mf);
}

/* Where a text first stands in a file, from 1. */
static unsigned line_of(const char *path, const char *text) {
    char line[512];
    unsigned n = 0;
    int found = 0;
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    while (!found && fgets(line, sizeof line, file) != NULL) {
        n++;
        found = strncmp(line, text, strlen(text)) == 0;
    }
    fclose(file);
    assert_true(found);
    return n;
}

/* A set that must fail with "<file>:<line of `where`><expected>", or just `expected`, and must not
 * change anything. */
static void refuse(struct model_file *mf, const char *assignment, const char *where,
                   const char *expected) {
    char whole[512];
    snprintf(whole, sizeof whole, "%s", expected);
    if (where != NULL) {
        snprintf(whole, sizeof whole, "%s:%u: %s", RESTRAINED, line_of(RESTRAINED, where),
                 expected);
    }
    FILE *errors = listen();
    assert_int_equal(model_file_set(mf, &assignment, 1, errors), -1);
    fclose(errors);
    assert_string_equal(said, whole);
    same(mf->vehicle.elements[0].k[1], 0.23e6);
}

static void test_set_refuses(void **state) {
    (void)state;
    struct model_file mf;
    load(&mf, RESTRAINED, NULL);
    refuse(&mf, "elements.restraint.k_N_m[1]=-1",
           "    k_N_m: ", "elements[0].k_N_m[1] = -1: must be >= 0 (set, not from the file)\n");
    refuse(&mf, "elements.restrain.k_N_m[1]=1", NULL,
           RESTRAINED ": cannot set elements.restrain.k_N_m[1]: no such key in the file\n");
    refuse(&mf, "name", NULL, "cannot set 'name': must be key.path=value\n");
    refuse(&mf, "=1", NULL, "cannot set '=1': must be key.path=value\n");
    refuse(&mf, "track.name=x", NULL, "cannot set track.name: there is no track file\n");
    refuse(&mf, "elements=1",
           "elements:", "cannot set elements to '1': only one plain value on one line\n");
    refuse(&mf, "name=", "name:", "cannot set name to '': only one plain value on one line\n");
    model_file_free(&mf);
}

static void test_set_through_an_alias(void **state) {
    (void)state;
    struct model_file mf;
    const char *friction = "wheelsets.middle.creep.friction=0.1";
    load(&mf, FULL, NULL);
    assert_int_equal(model_file_set(&mf, &friction, 1, stderr), 0);
    same(mf.vehicle.wheelsets[0].creep.friction, (kl_real)0.1); /* they share one mapping */
    same(mf.vehicle.wheelsets[2].creep.friction, (kl_real)0.1);
    model_file_free(&mf);
}

/* Is it a track? It has no wheelsets. */
static int is_track(const char *path) {
    char line[512];
    int wheelsets = 0;
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    while (fgets(line, sizeof line, file) != NULL) {
        wheelsets |= strncmp(line, "wheelsets:", 10) == 0 || strncmp(line, "vehicles:", 9) == 0;
    }
    fclose(file);
    return !wheelsets;
}

static void test_all_models_build(void **state) {
    (void)state;
    int vehicles = 0;
    int tracks = 0;
    struct dirent **entries;
    int n = scandir("models", &entries, NULL, alphasort);
    assert_true(n > 0);
    for (int i = 0; i < n; i++) {
        char path[512];
        const char *dot = strrchr(entries[i]->d_name, '.');
        snprintf(path, sizeof path, "models/%s", entries[i]->d_name);
        if (dot != NULL && strcmp(dot, ".yaml") == 0) {
            struct model_file mf;
            struct kl_model model;
            int track = is_track(path);
            vehicles += !track;
            tracks += track;
            load(&mf, track ? RESTRAINED : path, track ? path : NULL);
            assert_int_equal(model_file_build(&mf, &model, stderr), 0);
            assert_int_equal(model_file_build(&mf, &model, stderr), 0); /* again is allowed */
            assert_int_equal(kl_model_check(&model), KL_OK);
            model_file_free(&mf);
        }
        free(entries[i]);
    }
    free(entries);
    assert_true(vehicles >= 7 && tracks >= 6); /* those that were there when this was written */
}

/* The n-th yaml sample of the README, from 0, into a file. */
static void sample(int n, const char *path) {
    char line[512];
    int seen = -1;
    int inside = 0;
    FILE *from = fopen("models/README.md", "r");
    FILE *to = fopen(path, "w");
    assert_non_null(from);
    assert_non_null(to);
    while (fgets(line, sizeof line, from) != NULL) {
        if (strncmp(line, "```", 3) == 0) {
            seen += inside ? 0 : 1;
            inside = !inside;
        } else if (inside && seen == n) {
            fputs(line, to);
        }
    }
    fclose(from);
    fclose(to);
}

static void test_samples_of_the_readme(void **state) {
    (void)state;
    char vehicle[64];
    char track[64];
    struct model_file mf;
    struct kl_model model;
    snprintf(vehicle, sizeof vehicle, "/tmp/klingel_vehicle_%ld.yaml", (long)getpid());
    snprintf(track, sizeof track, "/tmp/klingel_track_%ld.yaml", (long)getpid());
    sample(0, vehicle);
    sample(1, track);
    load(&mf, vehicle, track);
    assert_int_equal(model_file_build(&mf, &model, stderr), 0);
    assert_int_equal(mf.vehicle.n_elements, 4);
    assert_int_equal(mf.track.n_curvature, 4);
    model_file_free(&mf);
    (void)unlink(vehicle);
    (void)unlink(track);
}

static void test_free_is_harmless(void **state) {
    (void)state;
    struct model_file mf;
    struct kl_model model;
    memset(&mf, 0, sizeof mf);
    model_file_free(&mf);
    assert_string_equal(model_file_pair_name(&mf, 0), "?");
    FILE *errors = listen();
    assert_int_equal(model_file_build(&mf, &model, errors), -1);
    const char *assignment = "a=1";
    assert_int_equal(model_file_set(&mf, &assignment, 1, errors), -1);
    assert_int_equal(model_file_load(&mf, "models/nowhere.yaml", NULL, errors), -1);
    fclose(errors);
    assert_string_equal(said, "cannot build: no vehicle is loaded\n"
                              "cannot set anything: no vehicle is loaded\n"
                              "models/nowhere.yaml: cannot open: No such file or directory\n");
    model_file_free(&mf);
    model_file_free(&mf);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_scalars_and_bodies),
        cmocka_unit_test(test_wheelsets),
        cmocka_unit_test(test_pairs),
        cmocka_unit_test(test_points_of_a_profile),
        cmocka_unit_test(test_elements),
        cmocka_unit_test(test_track),
        cmocka_unit_test(test_combined_track),
        cmocka_unit_test(test_set),
        cmocka_unit_test(test_set_refuses),
        cmocka_unit_test(test_set_through_an_alias),
        cmocka_unit_test(test_all_models_build),
        cmocka_unit_test(test_samples_of_the_readme),
        cmocka_unit_test(test_free_is_harmless),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
