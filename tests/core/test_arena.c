/* The bump allocator: alignment, refusal, what it says it wanted, and no byte beyond its memory. */
#include "fixtures.h"

#define GUARD 0xa5

static void blocks_are_aligned_and_apart(void **state) {
    (void)state;
    unsigned char memory[1024];
    for (size_t offset = 0; offset < 17; offset++) {
        struct kl_arena arena;
        kl_arena_init(&arena, memory + offset, sizeof memory - offset);
        unsigned char *a = kl_arena_take(&arena, 3, 1);
        unsigned char *b = kl_arena_take(&arena, 5, sizeof(double));
        unsigned char *c = kl_arena_take(&arena, 1, 1);
        assert_non_null(a);
        assert_non_null(b);
        assert_non_null(c);
        assert_int_equal((uintptr_t)a % 16u + (uintptr_t)b % 16u + (uintptr_t)c % 16u, 0);
        assert_true(a >= memory + offset && b >= a + 3 && c >= b + 40);
    }
}

/* Fails if and only if the rest is too small; `used` stays, `wanted` grows by what was asked. */
static void refuses_only_what_does_not_fit(void **state) {
    (void)state;
    unsigned char memory[256 + 15];
    for (size_t size = 0; size <= sizeof memory; size++) {
        struct kl_arena arena;
        kl_arena_init(&arena, memory, size);
        const size_t free_before = arena.size - arena.used;
        const size_t used = arena.used;
        const size_t wanted = arena.wanted;
        void *block = kl_arena_take(&arena, 6, 16);
        assert_int_equal(block != NULL, free_before >= 96);
        assert_int_equal(arena.used, block != NULL ? used + 96 : used);
        assert_int_equal(arena.wanted, wanted + 96);
    }
}

static void absurd_sizes_do_not_wrap(void **state) {
    (void)state;
    unsigned char memory[64];
    struct kl_arena arena;
    kl_arena_init(&arena, memory, sizeof memory);
    const size_t used = arena.used;
    assert_null(kl_arena_take(&arena, SIZE_MAX, 16));
    assert_null(kl_arena_take(&arena, SIZE_MAX / 8, 8));
    assert_null(kl_arena_take(&arena, 2, SIZE_MAX - 1));
    assert_null(kl_arena_take(&arena, SIZE_MAX / 2, 1));
    assert_int_equal(arena.used, used);
    assert_true(arena.wanted > sizeof memory);
}

static void smaller_than_the_alignment(void **state) {
    (void)state;
    unsigned char memory[32];
    memset(memory, GUARD, sizeof memory);
    for (size_t offset = 0; offset < 16; offset++) {
        for (size_t size = 0; size < 16; size++) {
            struct kl_arena arena;
            kl_arena_init(&arena, memory + offset, size);
            assert_true(arena.base >= memory + offset);
            assert_true(arena.base + arena.size <= memory + offset + size);
            assert_null(kl_arena_take(&arena, 1, 1));
        }
    }
    for (size_t i = 0; i < sizeof memory; i++) {
        assert_int_equal(memory[i], GUARD);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(blocks_are_aligned_and_apart),
        cmocka_unit_test(refuses_only_what_does_not_fit),
        cmocka_unit_test(absurd_sizes_do_not_wrap),
        cmocka_unit_test(smaller_than_the_alignment),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
