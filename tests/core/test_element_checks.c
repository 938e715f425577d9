/* Force elements and linkages as definitions: in the model's hash, in every size of memory, and what
 * is refused. */
#include "fixtures.h"

static struct kl_linkage_def link_of(int32_t a, enum kl_freedom fa, double factor_a, int32_t b,
                                     enum kl_freedom fb, double factor_b) {
    const struct kl_linkage_def linkage = {
        .name = "link", .n_terms = 2, .term = {{a, fa, factor_a}, {b, fb, factor_b}}};
    return linkage;
}

/* ---- identity and memory ---- */

/* A wagon with one of each. */
static const struct kl_linkage_def *everything(struct vehicle *v) {
    static const double at[] = {-0.02, 0.0, 0.01, 0.03};
    static const double force[] = {-1e4, 0.0, 0.0, 5e4};
    static struct kl_linkage_def link;
    wagon(v, linear_pair(0.1));
    v->pair[0].step_m = 1e-3;
    v->element[0].sway = KL_SWAY_CLAMPED;
    v->element[1].along = KL_ALONG_Y;
    v->element[1].slip = (struct kl_slip_def){.k = 1e6, .c = 1e4, .limit = 2e3};
    v->element[1].stop = (struct kl_table_def){COUNT(at), at, force};
    v->element[2].along = KL_ALONG_Z;
    v->element[2].damper = (struct kl_table_def){COUNT(at), at, force};
    v->element[2].actuator = 1;
    v->element[3].point_b_m[0] -= 1.0;
    v->element[3].line_k_N_m = 1e5;
    link = link_of(KL_WHEELSET_END(0), KL_YAW, 1.0, KL_WHEELSET_END(1), KL_YAW, -1.0);
    link.k = 1e6;
    v->def.linkages = &link;
    v->def.n_linkages = 1;
    return &link;
}

static void hash_knows_every_part(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    uint64_t first = 0;
    static const double other[] = {-1.1e4, 0.0, 0.0, 5e4};
    for (int i = 0; i < 14; i++) {
        struct kl_linkage_def link = *everything(&v);
        v.def.linkages = &link;
        v.element[0].sway = i == 1 ? KL_SWAY_NONE : KL_SWAY_CLAMPED;
        v.element[1].slip.k *= i == 2 ? 1.01 : 1.0;
        v.element[1].slip.c *= i == 3 ? 1.01 : 1.0;
        v.element[1].slip.limit *= i == 4 ? 1.01 : 1.0;
        v.element[1].stop.force = i == 5 ? other : v.element[1].stop.force;
        v.element[1].along = i == 6 ? KL_ALONG_Z : KL_ALONG_Y;
        v.element[2].damper.force = i == 7 ? other : v.element[2].damper.force;
        v.element[2].actuator = i == 8 ? 2 : 1;
        v.element[3].line_k_N_m *= i == 9 ? 1.01 : 1.0;
        v.element[3].line_c_Ns_m = i == 10 ? 1.0 : 0.0;
        link.k *= i == 11 ? 1.01 : 1.0;
        link.rigid = i == 12;
        v.def.n_linkages = i == 13 ? 0 : 1;
        build(&v, &b);
        first = i == 0 ? b.model.hash : first;
        assert_true((b.model.hash == first) == (i == 0));
        assert_int_equal(kl_model_check(&b.model), KL_OK);
        unbuild(&b);
    }
}

/* kl_build in every size of memory: refused, never overrun, and enough where it says enough. */
static void every_size_of_memory(void **state) {
    (void)state;
    struct vehicle v;
    (void)everything(&v);
    unsigned char *memory = malloc(1u << 18);
    assert_non_null(memory);
    enum kl_status status = KL_ERR_MEMORY;
    for (size_t size = 0; status != KL_OK; size += 13) {
        struct kl_arena arena;
        struct kl_model model;
        assert_true(size + 64u < 1u << 18);
        memset(memory + size, 0xc3, 64);
        kl_arena_init(&arena, memory, size);
        status = kl_build(&v.def, &arena, &model, NULL);
        assert_true(status == KL_OK || (status == KL_ERR_MEMORY && arena.wanted > size));
        for (size_t i = 0; i < 64; i++) {
            assert_int_equal(memory[size + i], 0xc3);
        }
        if (status == KL_OK) {
            assert_int_equal(kl_model_check(&model), KL_OK);
        }
    }
    free(memory);
}

/* A model from flash of which a table lost its order is found before a step walks over it. */
static void damaged_parts_are_found(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    (void)everything(&v);
    build(&v, &b);
    const struct kl_model good = b.model;
    uint16_t wrong[64];
#define DAMAGED(field, count, index, value)                                                        \
    do {                                                                                           \
        b.model = good;                                                                            \
        memcpy(wrong, good.struts.field, (count) * sizeof wrong[0]);                               \
        wrong[index] = (value);                                                                    \
        b.model.struts.field = wrong;                                                              \
        b.model.hash = 0;                                                                          \
        assert_int_equal(kl_model_check(&b.model), KL_ERR_VALUE);                                  \
    } while (0)
    const uint32_t n = kl_count_struts(&good.struts);
    assert_int_equal(n, 4);
    DAMAGED(term_start, n + 1u, 1, UINT16_MAX);
    DAMAGED(term_start, n + 1u, n, UINT16_MAX);
    DAMAGED(column, good.struts.n_terms, 0, UINT16_MAX);
    DAMAGED(bend_start, 5, 1, UINT16_MAX);
    DAMAGED(input, 1, 0, KL_MAX_ACTUATORS);
#undef DAMAGED
    b.model = good;
    b.model.struts.slip = NULL;
    assert_int_equal(kl_model_check(&b.model), KL_ERR_VALUE);
    b.model = good;
    b.model.struts.n_slips = KL_MAX_SLIPS + 1;
    assert_int_equal(kl_model_check(&b.model), KL_ERR_VALUE);
    b.model = good;
    unbuild(&b);
}

/* ---- refusals ---- */

static void refused_at(struct vehicle *v, enum kl_status want, int32_t index, const char *word,
                       int line) {
    struct memory m = take_memory(1u << 20);
    struct kl_model model;
    struct kl_diag diag = {.what = ""};
    const enum kl_status status = kl_build(&v->def, &m.arena, &model, &diag);
    if (status != want || diag.index != index || strstr(diag.what, word) == NULL) {
        print_error("got %d index %d '%s'; wanted %d index %d '...%s...'\n", status,
                    (int)diag.index, diag.what, want, (int)index, word);
        _fail(__FILE__, line);
    }
    give_memory(&m);
}
#define REFUSED(change, status, index, word)                                                       \
    do {                                                                                           \
        wagon(&v, linear_pair(0.1));                                                               \
        v.def.linkages = link;                                                                     \
        change;                                                                                    \
        refused_at(&v, (status), (index), (word), __LINE__);                                       \
    } while (0)

static void bad_linkages_are_refused(void **state) {
    (void)state;
    struct vehicle v;
    struct kl_linkage_def link[3];
    const struct kl_linkage_def good =
        link_of(KL_WHEELSET_END(0), KL_YAW, 1.0, KL_WHEELSET_END(1), KL_YAW, -1.0);
#define LINKS(n, change)                                                                           \
    v.def.n_linkages = (n);                                                                        \
    link[0] = link[1] = link[2] = good;                                                            \
    change
    REFUSED(LINKS(1, link[0].n_terms = 1), KL_ERR_VALUE, 0, "terms");
    REFUSED(LINKS(1, link[0].n_terms = KL_MAX_TERMS + 1), KL_ERR_VALUE, 0, "terms");
    REFUSED(LINKS(1, link[0].term[1].end = 1), KL_ERR_REFERENCE, 0, "no such body");
    REFUSED(LINKS(1, link[0].term[1].end = KL_GROUND_END), KL_ERR_REFERENCE, 0, "no such body");
    REFUSED(LINKS(1, link[0].term[1].freedom = KL_PITCH), KL_ERR_VALUE, 0, "freedom");
    REFUSED(LINKS(1, link[0].term[1].factor = 0.0), KL_ERR_VALUE, 0, "factors");
    REFUSED(LINKS(1, link[0].term[1].factor = (double)NAN), KL_ERR_VALUE, 0, "factors");
    REFUSED(LINKS(1, link[0].term[1].factor = -0.9), KL_ERR_VALUE, 0, "ties the vehicle");
    REFUSED(LINKS(1, link[0].k = -1.0), KL_ERR_VALUE, 0, "stiffness");
    REFUSED(LINKS(1, link[0].c = (double)NAN), KL_ERR_VALUE, 0, "stiffness");
    REFUSED(v.def.n_linkages = KL_MAX_LINKAGES + 1, KL_ERR_CAPACITY, -1, "too many");
    /* front to body and body to rear make front to rear */
    REFUSED(LINKS(3, link[0] = link_of(KL_WHEELSET_END(0), KL_YAW, 2.0, 0, KL_YAW, -2.0);
                  link[1] = link_of(0, KL_YAW, 1.0, KL_WHEELSET_END(1), KL_YAW, -1.0);
                  link[0].rigid = link[1].rigid = link[2].rigid = 1),
            KL_ERR_SINGULAR, 2, "loop");
    REFUSED(LINKS(2, link[0].rigid = link[1].rigid = 1), KL_ERR_SINGULAR, 1, "loop");
#undef LINKS
}

static void untied_bodies_are_refused(void **state) {
    (void)state;
    struct vehicle v;
    struct kl_linkage_def link[1];
    REFUSED(v.def.n_bodies = 2; v.body[1] = v.body[0];
            v.body[1].freedoms = KL_HAS(KL_Y), KL_ERR_SINGULAR, 1, "nothing ties it");
    /* an element without stiffness or damping is no tie */
    REFUSED(v.def.n_bodies = 2; v.body[1] = v.body[0]; v.body[1].freedoms = KL_HAS(KL_Y);
            v.def.n_elements = 5; v.element[4] = v.element[0]; v.element[4].end_a = 1;
            memset(v.element[4].k, 0, sizeof v.element[4].k);
            memset(v.element[4].c, 0, sizeof v.element[4].c), KL_ERR_SINGULAR, 1,
            "nothing ties it");
}

static void bad_parts_are_refused(void **state) {
    (void)state;
    struct vehicle v;
    const struct kl_linkage_def *link = NULL;
    static double at[4] = {-1.0, 0.0, 0.5, 1.0};
    static double force[4] = {-1.0, 0.0, 0.0, 2.0};
#define TABLE(a0, a1, a2, a3, f0, f1, f2, f3)                                                      \
    at[0] = (a0), at[1] = (a1), at[2] = (a2), at[3] = (a3);                                        \
    force[0] = (f0), force[1] = (f1), force[2] = (f2), force[3] = (f3);                            \
    v.element[1].along = KL_ALONG_Y;                                                               \
    v.element[1].stop = (struct kl_table_def){4, at, force}
    REFUSED(TABLE(-1, 0, 0, 1, -1, 0, 0, 2), KL_ERR_VALUE, 1, "must grow");
    REFUSED(TABLE(-1, 0, 0.5, 1, -1, 0, 0, -2), KL_ERR_VALUE, 1, "must not fall");
    REFUSED(TABLE(-1, 0, 0.5, 1, -1, 0.5, 1, 2), KL_ERR_VALUE, 1, "0 at 0");
    REFUSED(TABLE(0.1, 0.2, 0.5, 1, 0, 0, 0, 2), KL_ERR_VALUE, 1, "reach to 0");
    REFUSED(TABLE(-1, 0, 0.5, (double)NAN, -1, 0, 0, 2), KL_ERR_VALUE, 1, "too large");
    REFUSED(TABLE(-1, 0, 0.5, 1, -1, 0, 0, 2); v.element[1].stop.n = 1, KL_ERR_VALUE, 1, "points");
    REFUSED(TABLE(-1, 0, 0.5, 1, -1, 0, 0, 2);
            v.element[1].along = (enum kl_along)7, KL_ERR_VALUE, 1, "direction");
#undef TABLE
    REFUSED(v.element[1].slip.c = 1e3, KL_ERR_VALUE, 1, "in series");
    REFUSED(v.element[1].slip.k = 1e3, KL_ERR_VALUE, 1, "in series");
    REFUSED(v.element[1].slip.k = -1.0, KL_ERR_VALUE, 1, "limit");
    REFUSED(v.element[1].slip.limit = (double)NAN, KL_ERR_VALUE, 1, "limit");
    REFUSED(v.element[1].line_k_N_m = 1e6, KL_ERR_VALUE, 1, "no line");
    REFUSED(v.element[1].sway = KL_SWAY_PINNED, KL_ERR_VALUE, 1, "pinned");
    REFUSED(v.element[1].sway = KL_SWAY_CLAMPED;
            v.element[1].point_a_m[2] -= 0.1, KL_ERR_VALUE, 1, "clamped");
    REFUSED(v.element[1].sway = (enum kl_sway)3, KL_ERR_VALUE, 1, "sway");
    REFUSED(v.element[1].actuator = KL_MAX_ACTUATORS + 1, KL_ERR_CAPACITY, 1, "actuator");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(hash_knows_every_part),     cmocka_unit_test(every_size_of_memory),
        cmocka_unit_test(damaged_parts_are_found),   cmocka_unit_test(bad_linkages_are_refused),
        cmocka_unit_test(untied_bodies_are_refused), cmocka_unit_test(bad_parts_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
