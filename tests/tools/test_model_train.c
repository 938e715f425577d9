/*
 * Force elements, linkages and trains as the loader makes them of a file: against what stands in the
 * file, worked out by hand. Run from the project's root.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "model_file.h"

#define ELEMENTS "tests/tools/good/elements.yaml"
#define TRAIN "tests/tools/good/train.yaml"

static void load(struct model_file *mf, const char *path) {
    assert_int_equal(model_file_load(mf, path, NULL, stderr), 0);
}

static const struct kl_element_def *element(const struct model_file *mf, const char *name) {
    for (uint32_t i = 0; i < mf->vehicle.n_elements; i++) {
        if (strcmp(mf->vehicle.elements[i].name, name) == 0) {
            return &mf->vehicle.elements[i];
        }
    }
    fail_msg("no element %s", name);
    return NULL;
}

static const struct kl_linkage_def *linkage(const struct model_file *mf, const char *name) {
    for (uint32_t i = 0; i < mf->vehicle.n_linkages; i++) {
        if (strcmp(mf->vehicle.linkages[i].name, name) == 0) {
            return &mf->vehicle.linkages[i];
        }
    }
    fail_msg("no linkage %s", name);
    return NULL;
}

static void is_point(const double point[3], double x, double y, double z) {
    assert_true(point[0] == x && point[1] == y && point[2] == z);
}

static void is_table(const struct kl_table_def *t, uint32_t n, const double *at,
                     const double *force) {
    assert_int_equal(t->n, n);
    for (uint32_t i = 0; i < n; i++) {
        assert_true(t->at[i] == at[i] && t->force[i] == force[i]);
    }
}

static void every_key_arrives(void **state) {
    (void)state;
    struct model_file mf;
    load(&mf, ELEMENTS);
    assert_int_equal(mf.vehicle.n_elements, 17);
    assert_int_equal(element(&mf, "air_spring_l")->sway, KL_SWAY_CLAMPED);
    const struct kl_element_def *rod = element(&mf, "rod");
    assert_true(rod->line_k_N_m == 5e6 && rod->line_c_Ns_m == 1e4);
    const struct kl_element_def *damper = element(&mf, "lateral_damper");
    assert_int_equal(damper->along, KL_ALONG_LINE);
    assert_true(damper->slip.k == 6e6 && damper->slip.c == 3.2e4 && damper->slip.limit == 9e3);
    is_point(damper->point_b_m, 0.3, -0.1, -0.7);
    const struct kl_element_def *friction = element(&mf, "yaw_friction");
    assert_int_equal(friction->along, KL_ALONG_YAW);
    assert_true(friction->slip.k == 2e6 && friction->slip.c == 0.0 && friction->slip.limit == 4e3);
    const double at[] = {-0.045, -0.04, -0.035, -0.03, -0.025, 0.025, 0.03, 0.035, 0.04, 0.045};
    const double force[] = {-6870, -3730, -1760, -600, 0, 0, 600, 1760, 3730, 6870};
    is_table(&element(&mf, "lateral_stop")->stop, 10, at, force);
    const double one_at[] = {0, 0.02, 0.03};
    const double one_force[] = {0, 0, 1e4};
    is_table(&element(&mf, "side_stop_r")->stop, 3, one_at, one_force);
    const double left_at[] = {-0.03, -0.02, 0};
    const double left_force[] = {-1e4, 0, 0};
    is_table(&element(&mf, "side_stop_l")->stop, 3, left_at, left_force);
    is_point(element(&mf, "side_stop_l")->point_a_m, 0.0, -0.9, -0.8);
    const double speed[] = {-1, -0.1, 0, 0.1, 1};
    const double damping[] = {-6e3, -2e3, 0, 2e3, 6e3};
    is_table(&element(&mf, "vertical_damper_l")->damper, 5, speed, damping); /* along z: the same */
    assert_int_equal(element(&mf, "wind")->actuator, 2);
    assert_int_equal(element(&mf, "wind")->end_b, KL_GROUND_END);
    const struct kl_linkage_def *bracing = linkage(&mf, "cross_bracing");
    assert_int_equal(bracing->n_terms, 4);
    assert_int_equal(bracing->term[3].end, KL_WHEELSET_END(1));
    assert_int_equal(bracing->term[3].freedom, KL_YAW);
    assert_true(bracing->term[3].factor == -1.25 && bracing->k == 4e6 && bracing->c == 1e3);
    assert_int_equal(bracing->rigid, 0);
    assert_int_equal(linkage(&mf, "steering")->rigid, 1);
    assert_int_equal(linkage(&mf, "steering")->term[2].end, 0);
    model_file_free(&mf);
}

/* Turned round: x and y change signs, ends count on, and what works along x or y works the other
 * way. */
static void trains_move_and_turn_their_vehicles(void **state) {
    (void)state;
    struct model_file mf;
    struct kl_model model;
    load(&mf, TRAIN);
    const struct kl_vehicle_def *v = &mf.vehicle;
    assert_int_equal(v->n_bodies, 4);
    assert_int_equal(v->n_wheelsets, 4);
    assert_int_equal(v->n_elements, 2 * 17 + 2);
    assert_int_equal(v->n_linkages, 2 * 2 + 1);
    assert_int_equal(v->n_pairs, 1);
    assert_string_equal(v->bodies[2].name, "last_body");
    assert_string_equal(v->wheelsets[2].name, "last_front");
    assert_true(v->wheelsets[2].x_m == -8.5 - 1.25 && v->wheelsets[3].x_m == -8.5 + 1.25);
    const struct kl_element_def *right = element(&mf, "last_box_front_r");
    is_point(right->point_a_m, -9.75, -1.0, -0.45);
    assert_int_equal(right->end_a, 3);
    assert_int_equal(right->end_b, KL_WHEELSET_END(2));
    const double left_at[] = {-0.03, -0.02, 0};
    const double left_force[] = {-1e4, 0, 0};
    is_table(&element(&mf, "last_side_stop_r")->stop, 3, left_at, left_force);
    const double speed[] = {-1, -0.1, 0, 0.1, 1};
    const double damping[] = {-6e3, -2e3, 0, 2e3, 6e3};
    is_table(&element(&mf, "last_vertical_damper_r")->damper, 5, speed, damping);
    assert_int_equal(element(&mf, "last_wind")->end_a, KL_GROUND_END);
    assert_int_equal(element(&mf, "last_wind")->end_b, 2);
    const struct kl_linkage_def *bracing = linkage(&mf, "last_cross_bracing");
    assert_int_equal(bracing->term[0].end, KL_WHEELSET_END(2));
    assert_true(bracing->term[0].factor == -1.0 && bracing->term[2].factor == -1.25);
    assert_int_equal(element(&mf, "coupler")->end_b, 2);
    assert_int_equal(linkage(&mf, "articulation")->term[1].end, 2);
    assert_string_equal(model_file_pair_name(&mf, 0), "cone");
    assert_int_equal(model_file_build(&mf, &model, stderr), 0);
    assert_int_equal(model.struts.n_slips, 2 * 2 + 1 + 2); /* a rigid linkage each */
    model_file_free(&mf);
}

/* ---- runs ---- */

static char path[64];

static void write_train(const char *vehicles) {
    char folder[256];
    assert_non_null(getcwd(folder, sizeof folder));
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fprintf(file, "name: two_axle_wagon\nstep_ns: 1000000\ngravity_m_s2: 9.81\n"
                  "acceleration_limit_m_s2: 1\nvehicles:\n");
    for (const char *at = vehicles; *at != '\0'; at++) {
        if (*at == '@') {
            fprintf(file, "%s/models/two_axle_wagon.yaml", folder);
        } else {
            fputc(*at, file);
        }
    }
    assert_int_equal(fclose(file), 0);
}

/* After 3 s at 25 m/s in a curve, the first wheelset of the train, or the last, begun 2 mm aside. */
static void run(const char *vehicle, uint32_t disturbed, struct kl_state *x) {
    struct model_file mf;
    struct kl_model model;
    struct kl_input input;
    static struct kl_work work;
    assert_int_equal(model_file_load(&mf, vehicle, "models/curve_r600.yaml", stderr), 0);
    assert_int_equal(model_file_build(&mf, &model, stderr), 0);
    assert_int_equal(kl_init(&model, x, 0, 20, &work), KL_OK);
    x->x[kl_wheelset_state_index(&model, disturbed, KL_WS_Y)] = (kl_real)2e-3;
    kl_refresh(&model, x, &work);
    kl_input_init(&input);
    input.speed_m_s = 20;
    for (int i = 0; i < 5000; i++) {
        assert_int_equal(kl_step(&model, x, &input, NULL, &work), 0);
    }
    model_file_free(&mf);
}

/* A train of one vehicle is the vehicle; one that is alike in front and behind can be turned round,
 * and then has its rear wheelset in front. */
static void one_vehicle_is_itself(void **state) {
    (void)state;
    struct kl_state alone;
    struct kl_state train;
    struct kl_state turned;
    run("models/two_axle_wagon.yaml", 0, &alone);
    write_train("  - {prefix: a, file: @, at_x_m: 0}\n");
    run(path, 0, &train);
    assert_memory_equal(alone.x, train.x, sizeof alone.x);
    write_train("  - {prefix: a, file: @, at_x_m: 0, reversed: true}\n");
    run(path, 1, &turned);
    double most = 0.0;
    for (uint32_t i = 0; i < alone.n_states; i++) {
        /* five freedoms of the body, then five states a wheelset, front and rear changed over, then
         * two rails a wheelset, likewise */
        const uint32_t at = i < 10 ? i : i < 15 ? i + 5 : i < 20 ? i - 5 : i < 22 ? i + 2 : i - 2;
        assert_true(fabs((double)(alone.x[i] - turned.x[at])) < 1e-9);
        most = fmax(most, fabs((double)alone.x[i]));
    }
    assert_true(most > 1e-3);
}

/* Far apart and not coupled: each goes its own way, as if alone. */
static void uncoupled_vehicles_do_not_meet(void **state) {
    (void)state;
    struct kl_state alone;
    struct kl_state train;
    run("models/two_axle_wagon.yaml", 0, &alone);
    write_train("  - {prefix: a, file: @, at_x_m: 0}\n  - {prefix: b, file: @, at_x_m: -15}\n");
    run(path, 0, &train);
    double apart = 0.0;
    for (uint32_t i = 0; i < 10; i++) {
        apart = fmax(apart, fabs((double)(alone.x[i] - train.x[i])));
    }
    for (uint32_t i = 0; i < 10; i++) {
        apart = fmax(apart, fabs((double)(alone.x[10 + i] - train.x[20 + i])));
    }
    assert_true(apart < 1e-12);
}

static int clean(void **state) {
    (void)state;
    (void)unlink(path);
    return 0;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_key_arrives),
        cmocka_unit_test(trains_move_and_turn_their_vehicles),
        cmocka_unit_test(one_vehicle_is_itself),
        cmocka_unit_test(uncoupled_vehicles_do_not_meet),
    };
    snprintf(path, sizeof path, "/tmp/klingel_train_%ld.yaml", (long)getpid());
    return cmocka_run_group_tests(tests, NULL, clean);
}
