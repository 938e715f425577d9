/* kl_build in every size of memory up to the one that is enough: refused, never overrun. */
#include "fixtures.h"

#define GUARD_BYTES 64u
#define GUARD 0xc3

/* A small table, a curve and irregularities: all that takes memory. */
static void small_wagon(struct vehicle *v, struct kl_pair_def pair) {
    static const double lateral[8] = {0.0, 1e-3, -1e-3, 2e-3, 0.0, 1e-3, 0.0, 0.0};
    wagon(v, pair);
    v->pair[0].step_m = 1e-3;
    v->pair[0].range_m = 4e-3;
    one_curve(v, KL_RAMP_BLOSS, 0.001, 0.05);
    v->track.irregularity.n_samples = 8;
    v->track.irregularity.step_m = 1.0;
    v->track.irregularity.lateral_m = lateral;
}

/* Builds in exactly `size` bytes between guards. */
static enum kl_status build_in(const struct vehicle *v, unsigned char *memory, size_t size,
                               size_t *wanted) {
    struct kl_arena arena;
    struct kl_model model;
    struct kl_diag diag = {.what = ""};
    memset(memory, GUARD, GUARD_BYTES);
    memset(memory + GUARD_BYTES + size, GUARD, GUARD_BYTES);
    kl_arena_init(&arena, memory + GUARD_BYTES, size);
    const enum kl_status status = kl_build(&v->def, &arena, &model, &diag);
    *wanted = arena.wanted;
    for (size_t i = 0; i < GUARD_BYTES; i++) {
        assert_int_equal(memory[i], GUARD);
        assert_int_equal(memory[GUARD_BYTES + size + i], GUARD);
    }
    assert_int_equal(diag.status, status);
    if (status == KL_OK) {
        assert_int_equal(kl_model_check(&model), KL_OK);
    } else {
        assert_int_equal(status, KL_ERR_MEMORY);
        assert_true(diag.what[0] != '\0');
    }
    return status;
}

/* Refused below one size, built from there on; `wanted` leads there in a few tries. */
static void every_size(const struct vehicle *v, size_t step) {
    size_t wanted = 0;
    size_t enough = 0;
    unsigned char *memory = malloc(2u * GUARD_BYTES + (1u << 20));
    assert_non_null(memory);
    for (size_t size = 0; enough == 0; size += step) {
        assert_true(size < 1u << 20);
        enough = build_in(v, memory, size, &wanted) == KL_OK ? size : 0;
    }
    for (size_t more = 0; more < 64; more++) {
        assert_int_equal(build_in(v, memory, enough + more, &wanted), KL_OK);
    }
    int tries = 1;
    size_t size = 0;
    while (build_in(v, memory, size, &wanted) != KL_OK) {
        assert_true(wanted > size); /* or the caller would go round for ever */
        size = wanted;
        tries++;
    }
    print_message("%zu bytes are enough; by `wanted` %zu after %d tries\n", enough, size, tries);
    assert_true(tries <= 16);
    free(memory);
}

static void with_a_linear_pair(void **state) {
    (void)state;
    struct vehicle v;
    small_wagon(&v, linear_pair(0.1));
    every_size(&v, 1);
}

static void with_arcs(void **state) {
    (void)state;
    struct vehicle v;
    small_wagon(&v, arcs_pair(KL_KINEMATICS_RIGID));
    every_size(&v, 1021);
}

static void with_points(void **state) {
    (void)state;
    struct vehicle v;
    small_wagon(&v, s1002_uic60());
    every_size(&v, 4093);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(with_a_linear_pair),
        cmocka_unit_test(with_arcs),
        cmocka_unit_test(with_points),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
