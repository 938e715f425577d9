/* Building a vehicle: static loads by hand, states, the model's identity, and every definition that
 * must be refused. */
#include "fixtures.h"

/* ---- static loads ---- */

/* Wheelbase 9 m; centre of mass 1.2 m ahead of the middle: levers 5.7 and 3.3 m. */
static void wheel_loads_of_an_unevenly_laden_wagon(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    struct kl_state x;
    struct kl_output o;
    wagon(&v, arcs_pair(KL_KINEMATICS_RIGID));
    v.body[0].x_m = 1.2;
    v.wheelset[1].load_N = 5000.0;
    build(&v, &b);
    const double body = 37200.0 * 9.81;
    const double axle = 1400.0 * 9.81;
    const double want[2] = {body * 5.7 / 9.0 + axle, body * 3.3 / 9.0 + axle + 5000.0};
    for (int i = 0; i < 2; i++) {
        assert_near((double)b.model.wheelsets[i].static_load_N, want[i], 1e-8 * want[i]);
        assert_near((double)b.model.wheelsets[i].preload[0], 0.0, 0.0);
        assert_near((double)b.model.wheelsets[i].preload[2], 0.0, 0.0);
        assert_near((double)b.model.wheelsets[i].preload[3], 0.0, 0.0);
    }
    /* and it stays like that: each wheel carries half, nothing moves */
    assert_int_equal(kl_init(&b.model, &x, 0, 0, work()), KL_OK);
    assert_int_equal(coast(&b.model, &x, 1000, &o), 0);
    for (int i = 0; i < 2; i++) {
        for (int s = 0; s < KL_SIDES; s++) {
            assert_near((double)o.wheelset[i].q_N[s], 0.5 * want[i], 1e-9 * want[i]);
        }
    }
    for (uint32_t i = 0; i < b.model.n_states; i++) {
        assert_near((double)x.x[i], 0.0, 1e-12);
    }
    unbuild(&b);
}

/* One side sprung twice as hard, by hand: the body tilts, and each side still carries half of it;
 * its springs are 1 m from the middle. An element across carries nothing at rest. */
static void springs_of_different_sides(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    wagon(&v, arcs_pair(KL_KINEMATICS_RIGID));
    v.element[0].k[2] = 2.2e6;
    v.element[2].k[2] = 2.2e6;
    build(&v, &b);
    for (int i = 0; i < 2; i++) {
        const double want = 0.5 * 37200.0 * 9.81 + 1400.0 * 9.81;
        assert_near((double)b.model.wheelsets[i].static_load_N, want, 1e-8 * want);
        assert_near((double)b.model.wheelsets[i].preload[2], 0.0, 1e-6 * want);
    }
    unbuild(&b);
}

/* Wheels of different radius need no special case; a dead load alone makes a wheelset stand. */
static void dead_load_of_a_lone_wheelset(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    single_wheelset(&v, arcs_pair(KL_KINEMATICS_RIGID), 0.0, 0.0);
    v.wheelset[0].load_N = 87737.5;
    build(&v, &b);
    assert_near((double)b.model.wheelsets[0].static_load_N, 1e5, 1e-9);
    unbuild(&b);
}

/* ---- states and identity ---- */

static void states_are_laid_out_as_promised(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    wagon(&v, linear_pair(0.1));
    v.body[0].freedoms = KL_HAS(KL_Y) | KL_HAS(KL_ROLL) | KL_HAS(KL_YAW);
    v.wheelset[0].load_N = v.wheelset[1].load_N = 1e5;
    build(&v, &b);
    const struct kl_model *m = &b.model;
    assert_int_equal(m->n_states, 2 * 3 + 2 * KL_WHEELSET_STATES);
    const int32_t want[KL_FREEDOMS] = {0, -1, 2, -1, 4};
    for (int f = 0; f < KL_FREEDOMS; f++) {
        const int32_t rate = want[f] < 0 ? -1 : want[f] + 1;
        assert_int_equal(kl_body_state_index(m, 0, (enum kl_freedom)f, 0), want[f]);
        assert_int_equal(kl_body_state_index(m, 0, (enum kl_freedom)f, 1), rate);
        assert_int_equal(kl_body_state_index(m, 1, (enum kl_freedom)f, 0), -1);
    }
    for (int k = 0; k < KL_WHEELSET_STATES; k++) {
        assert_int_equal(kl_wheelset_state_index(m, 0, (enum kl_wheelset_state)k), 6 + k);
        assert_int_equal(kl_wheelset_state_index(m, 1, (enum kl_wheelset_state)k), 11 + k);
        assert_int_equal(kl_wheelset_state_index(m, 2, (enum kl_wheelset_state)k), -1);
    }
    unbuild(&b);
}

/* The model does not remember where it was built, nor the definition. */
static void hash_is_of_the_content(void **state) {
    (void)state;
    struct vehicle v;
    struct vehicle w;
    struct built a;
    struct built b;
    wagon(&v, linear_pair(0.1));
    wagon(&w, linear_pair(0.1));
    build(&v, &a);
    build(&w, &b);
    memset(&v, 0, sizeof v);
    assert_true(a.model.hash == b.model.hash);
    assert_true(kl_model_hash(&a.model) == a.model.hash);
    assert_int_equal(kl_model_check(&a.model), KL_OK);
    unbuild(&a);
    unbuild(&b);
}

static uint64_t hash_of(struct vehicle *v) {
    struct built b;
    build(v, &b);
    const uint64_t hash = b.model.hash;
    unbuild(&b);
    return hash;
}

/* Whatever the step reads is in the hash. */
static void hash_knows_every_definition(void **state) {
    (void)state;
    struct vehicle v;
    wagon(&v, linear_pair(0.1));
    one_curve(&v, KL_RAMP_LINEAR, 0.001, 0.02);
    const uint64_t base = hash_of(&v);
#define CHANGES(change)                                                                            \
    do {                                                                                           \
        wagon(&v, linear_pair(0.1));                                                               \
        one_curve(&v, KL_RAMP_LINEAR, 0.001, 0.02);                                                \
        assert_true(hash_of(&v) == base);                                                          \
        change;                                                                                    \
        assert_true(hash_of(&v) != base);                                                          \
    } while (0)
    CHANGES(v.def.name[0] = 'W');
    CHANGES(v.def.step_ns = 1000001);
    CHANGES(v.def.gravity_m_s2 = 9.82);
    CHANGES(v.def.acceleration_limit_m_s2 = 1.5);
    CHANGES(v.body[0].name[0] = 'B');
    CHANGES(v.body[0].mass_kg = 37201.0);
    CHANGES(v.body[0].inertia_kgm2[1] = 6e5);
    CHANGES(v.body[0].x_m = 0.01);
    CHANGES(v.body[0].z_m = -1.66);
    CHANGES(v.wheelset[1].name[0] = 'R');
    CHANGES(v.wheelset[1].mass_kg = 1401.0);
    CHANGES(v.wheelset[1].inertia_roll_kgm2 = 751.0);
    CHANGES(v.wheelset[1].inertia_spin_kgm2 = 101.0);
    CHANGES(v.wheelset[1].inertia_yaw_kgm2 = 751.0);
    CHANGES(v.wheelset[1].x_m = -4.6);
    CHANGES(v.wheelset[1].load_N = 1.0);
    CHANGES(v.wheelset[1].creep.law = KL_CREEP_LINEAR);
    CHANGES(v.wheelset[1].creep.friction = (kl_real)0.31);
    CHANGES(v.wheelset[1].creep.f11_N = (kl_real)1e6);
    CHANGES(v.wheelset[1].creep.f22_N = (kl_real)1e6);
    CHANGES(v.wheelset[1].creep.f23_Nm = (kl_real)1e3);
    CHANGES(v.wheelset[1].creep.f33_Nm2 = (kl_real)1.0);
    CHANGES(v.element[3].k[1] = 0.41e6);
    CHANGES(v.element[3].c[2] = 21e3);
    CHANGES(v.element[3].point_a_m[1] = -1.01);
    CHANGES(v.pair[0].conicity = 0.11);
    CHANGES(v.pair[0].radius_m = 0.46);
    CHANGES(v.pair[0].half_base_m = 0.75);
    CHANGES(v.pair[0].range_m = 0.0101);
    CHANGES(v.pair[0].step_m = 2e-4);
    CHANGES(v.pair[0].material.poisson = 0.29);
    CHANGES(v.curvature[1].to = 0.0011);
    CHANGES(v.cant[1].to = 0.021);
    CHANGES(v.cant[2].length_m = 101.0);
    CHANGES(v.cant[2].shape = KL_RAMP_BLOSS; v.cant[2].to = 0.03);
#undef CHANGES
}

/* A model from flash that lost a bit is found, wherever the bit was. */
static void damaged_models_are_found(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    wagon(&v, linear_pair(0.1));
    build(&v, &b);
    const struct kl_model good = b.model;
    assert_int_equal(kl_model_check(NULL), KL_ERR_ARGUMENT);
#define DAMAGED(change)                                                                            \
    do {                                                                                           \
        b.model = good;                                                                            \
        change;                                                                                    \
        assert_int_equal(kl_model_check(&b.model), KL_ERR_VALUE);                                  \
    } while (0)
    DAMAGED(b.model.version++);
    DAMAGED(b.model.real_bytes = 3);
    DAMAGED(b.model.n_bodies = KL_MAX_BODIES + 1);
    DAMAGED(b.model.n_wheelsets = KL_MAX_WHEELSETS + 1);
    DAMAGED(b.model.n_wheelsets = 0);
    DAMAGED(b.model.n_states = KL_MAX_STATES + 1);
    DAMAGED(b.model.hash ^= 1u);
    DAMAGED(b.model.step_ns++);
    DAMAGED(b.model.name[3] = '?');
#undef DAMAGED
    b.model = good;
    /* every byte of the arena that the model stands on, a bit at a time */
    unsigned found = 0;
    unsigned char *bytes = b.memory.arena.base;
    const unsigned char *pairs = (const unsigned char *)b.model.pairs;
    for (size_t i = 0; i < b.memory.arena.used; i += 7) {
        if (bytes + i >= pairs && bytes + i < pairs + sizeof(struct kl_pair)) {
            continue; /* addresses: the linker's, not the model's */
        }
        bytes[i] ^= 4u;
        found += kl_model_check(&b.model) != KL_OK ? 1u : 0u;
        bytes[i] ^= 4u;
    }
    assert_int_equal(kl_model_check(&b.model), KL_OK);
    /* all but padding between blocks and columns that the step does not read */
    print_message("%u of %zu damaged bytes found\n", found, (b.memory.arena.used + 6) / 7);
    assert_true(found > 0.95 * (double)(b.memory.arena.used / 7));
    unbuild(&b);
}

/* ---- refusals ---- */

static void refused_at(struct vehicle *v, enum kl_status want, int32_t index, const char *word,
                       int line) {
    struct memory m = take_memory(1u << 20);
    struct kl_model model;
    struct kl_diag diag = {.what = ""};
    const enum kl_status status = kl_build(&v->def, &m.arena, &model, &diag);
    if (status != want || diag.status != want || diag.index != index ||
        strstr(diag.what, word) == NULL) {
        print_error("got %d index %d '%s'; wanted %d index %d '...%s...'\n", status,
                    (int)diag.index, diag.what, want, (int)index, word);
        _fail(__FILE__, line);
    }
    assert_int_equal(kl_build(&v->def, &m.arena, &model, NULL), want);
    give_memory(&m);
}
#define REFUSED(change, status, index, word)                                                       \
    do {                                                                                           \
        wagon(&v, linear_pair(0.1));                                                               \
        change;                                                                                    \
        refused_at(&v, (status), (index), (word), __LINE__);                                       \
    } while (0)
/* each of the values that no range allows, in one field */
#define REFUSED_VALUES(field, low, high, index, word)                                              \
    do {                                                                                           \
        const double values[] = {(low), (high), (double)NAN, (double)INFINITY, -(double)INFINITY}; \
        for (size_t i_ = 0; i_ < COUNT(values); i_++) {                                            \
            REFUSED(field = values[i_], KL_ERR_VALUE, index, word);                                \
        }                                                                                          \
    } while (0)

static void bad_vehicles_are_refused(void **state) {
    (void)state;
    struct vehicle v;
    REFUSED(v.def.n_bodies = KL_MAX_BODIES + 1, KL_ERR_CAPACITY, -1, "too many");
    REFUSED(v.def.n_wheelsets = KL_MAX_WHEELSETS + 1, KL_ERR_CAPACITY, -1, "too many");
    REFUSED(v.def.n_pairs = KL_MAX_PAIRS + 1, KL_ERR_CAPACITY, -1, "too many");
    REFUSED(v.def.n_elements = KL_MAX_ELEMENTS + 1, KL_ERR_CAPACITY, -1, "too many");
    REFUSED(v.def.n_wheelsets = 0, KL_ERR_ARGUMENT, -1, "needs");
    REFUSED(v.def.n_pairs = 0, KL_ERR_ARGUMENT, -1, "needs");
    REFUSED(v.def.wheelsets = NULL, KL_ERR_ARGUMENT, -1, "needs");
    REFUSED(v.def.pairs = NULL, KL_ERR_ARGUMENT, -1, "needs");
    REFUSED(v.def.bodies = NULL, KL_ERR_ARGUMENT, -1, "needs");
    REFUSED(v.def.elements = NULL, KL_ERR_ARGUMENT, -1, "needs");
    REFUSED(v.def.track = NULL, KL_ERR_ARGUMENT, -1, "needs");
    REFUSED(v.def.step_ns = 9999, KL_ERR_VALUE, -1, "step_ns");
    REFUSED(v.def.step_ns = 10000001, KL_ERR_VALUE, -1, "step_ns");
    REFUSED(v.def.step_ns = -1000000, KL_ERR_VALUE, -1, "step_ns");
    REFUSED_VALUES(v.def.gravity_m_s2, -0.1, 20.1, -1, "gravity");
    REFUSED_VALUES(v.def.acceleration_limit_m_s2, 0.0, 1000.0, -1, "acceleration_limit");
}

static void bad_bodies_are_refused(void **state) {
    (void)state;
    struct vehicle v;
    REFUSED_VALUES(v.body[0].mass_kg, 0.0, 1e7, 0, "mass_kg");
    for (int k = 0; k < 3; k++) {
        REFUSED_VALUES(v.body[0].inertia_kgm2[k], 0.0, 1e9, 0, "inertia_kgm2");
    }
    REFUSED_VALUES(v.body[0].x_m, -1e3, 1e3, 0, "x_m");
    REFUSED_VALUES(v.body[0].z_m, -20.0, 20.0, 0, "z_m");
    REFUSED(v.body[0].freedoms = 0, KL_ERR_VALUE, 0, "freedoms");
    REFUSED(v.body[0].freedoms = 32, KL_ERR_VALUE, 0, "freedoms");
    REFUSED(v.def.n_bodies = 2, KL_ERR_VALUE, 1, "mass_kg"); /* the second one is blank */
}

static void bad_wheelsets_are_refused(void **state) {
    (void)state;
    struct vehicle v;
    REFUSED_VALUES(v.wheelset[1].mass_kg, 0.0, 1e5, 1, "mass_kg");
    REFUSED_VALUES(v.wheelset[0].inertia_roll_kgm2, 0.0, 1e6, 0, "inertias");
    REFUSED_VALUES(v.wheelset[1].inertia_spin_kgm2, 0.0, 1e6, 1, "inertias");
    REFUSED_VALUES(v.wheelset[1].inertia_yaw_kgm2, -1.0, 1e6, 1, "inertias");
    REFUSED_VALUES(v.wheelset[1].x_m, -1e3, 1e3, 1, "x_m");
    REFUSED_VALUES(v.wheelset[1].load_N, -1.0, 1e7, 1, "load_N");
    REFUSED(v.wheelset[1].pair = 1, KL_ERR_REFERENCE, 1, "pair");
    REFUSED(v.wheelset[0].creep.law = (enum kl_creep_law)KL_CREEP_LAWS, KL_ERR_VALUE, 0, "law");
    REFUSED_VALUES(v.wheelset[1].creep.friction, -0.1, 2.1, 1, "friction");
    REFUSED_VALUES(v.wheelset[1].creep.f11_N, -1.0, 1e12, 1, "f11");
    REFUSED_VALUES(v.wheelset[1].creep.f22_N, -1.0, 1e12, 1, "f11");
    REFUSED_VALUES(v.wheelset[1].creep.f23_Nm, -1.0, 1e12, 1, "f11");
    REFUSED_VALUES(v.wheelset[1].creep.f33_Nm2, -1.0, 1e12, 1, "f11");
}

static void bad_elements_are_refused(void **state) {
    (void)state;
    struct vehicle v;
    REFUSED(v.element[2].end_a = 1, KL_ERR_REFERENCE, 2, "no such");
    REFUSED(v.element[2].end_a = -2, KL_ERR_REFERENCE, 2, "no such");
    REFUSED(v.element[2].end_b = KL_WHEELSET_END(2), KL_ERR_REFERENCE, 2, "no such");
    REFUSED(v.element[2].end_b = INT32_MAX, KL_ERR_REFERENCE, 2, "no such");
    REFUSED(v.element[2].end_b = INT32_MIN, KL_ERR_REFERENCE, 2, "no such");
    REFUSED(v.element[2].end_b = v.element[2].end_a, KL_ERR_REFERENCE, 2, "same body");
    for (int k = 0; k < 3; k++) {
        REFUSED_VALUES(v.element[1].point_a_m[k], -1e3, 1e3, 1, "points");
        REFUSED_VALUES(v.element[1].point_b_m[k], -1e3, 1e3, 1, "points");
    }
    for (int k = 0; k < 6; k++) {
        REFUSED_VALUES(v.element[3].k[k], -1.0, 1e12, 3, "stiffness");
        REFUSED_VALUES(v.element[3].c[k], -1.0, 1e12, 3, "damping");
    }
}

/* What a part refuses, the vehicle refuses, and says which pair or ramp it was. */
static void bad_parts_are_refused(void **state) {
    (void)state;
    struct vehicle v;
    REFUSED(v.def.n_pairs = 2; v.pair[1] = linear_pair(0.1);
            v.pair[1].step_m = 0.0, KL_ERR_VALUE, 1, "step_m");
    REFUSED(v.pair[0].conicity = (double)NAN, KL_ERR_VALUE, 0, "conicity");
    REFUSED(one_curve(&v, KL_RAMP_LINEAR, 0.001, 0.02);
            v.cant[3].to = 1.0, KL_ERR_VALUE, 3, "cant");
    REFUSED(v.track.curvature_start_1_m = 0.1, KL_ERR_VALUE, -1, "curvature");
}

/* A body that nothing holds against its weight has no static equilibrium. */
static void unsupported_bodies_are_refused(void **state) {
    (void)state;
    struct vehicle v;
    REFUSED(v.def.n_elements = 0, KL_ERR_SINGULAR, 0, "not held");
    REFUSED(for (int i = 0; i < 4; i++) v.element[i].k[2] = 0.0, KL_ERR_SINGULAR, 0, "not held");
    /* held at one end only: it would pitch down */
    REFUSED(v.def.n_elements = 2, KL_ERR_SINGULAR, 0, "not held");
}

static void null_arguments_are_refused(void **state) {
    (void)state;
    struct vehicle v;
    struct memory m = take_memory(64);
    struct kl_model model;
    struct kl_diag diag;
    wagon(&v, linear_pair(0.1));
    assert_int_equal(kl_build(NULL, &m.arena, &model, &diag), KL_ERR_ARGUMENT);
    assert_int_equal(diag.status, KL_ERR_ARGUMENT);
    assert_int_equal(kl_build(&v.def, NULL, &model, NULL), KL_ERR_ARGUMENT);
    assert_int_equal(kl_build(&v.def, &m.arena, NULL, NULL), KL_ERR_ARGUMENT);
    give_memory(&m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(wheel_loads_of_an_unevenly_laden_wagon),
        cmocka_unit_test(springs_of_different_sides),
        cmocka_unit_test(dead_load_of_a_lone_wheelset),
        cmocka_unit_test(states_are_laid_out_as_promised),
        cmocka_unit_test(hash_is_of_the_content),
        cmocka_unit_test(hash_knows_every_definition),
        cmocka_unit_test(damaged_models_are_found),
        cmocka_unit_test(bad_vehicles_are_refused),
        cmocka_unit_test(bad_bodies_are_refused),
        cmocka_unit_test(bad_wheelsets_are_refused),
        cmocka_unit_test(bad_elements_are_refused),
        cmocka_unit_test(bad_parts_are_refused),
        cmocka_unit_test(unsupported_bodies_are_refused),
        cmocka_unit_test(null_arguments_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
