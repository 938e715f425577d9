/*
 * fixtures.h - what the core's tests share: building models, reading reference files, random
 * numbers, comparing. The definitions themselves are in vehicles.h.
 */
#ifndef FIXTURES_H
#define FIXTURES_H

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "csv.h"
#include "vehicles.h"

#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

/* ---- comparing ---- */

static inline void near_at(double got, double want, double tolerance, const char *what,
                           const char *file, int line) {
    if (!(fabs(got - want) <= tolerance)) {
        print_error("%s: %.17g, wanted %.17g within %g (off by %g)\n", what, got, want, tolerance,
                    got - want);
        _fail(file, line);
    }
}
#define assert_near(got, want, tolerance)                                                          \
    near_at((got), (want), (tolerance), #got, __FILE__, __LINE__)

static inline void below_at(double got, double limit, const char *what, const char *file,
                            int line) {
    if (!(got <= limit)) {
        print_error("%s: %.17g, wanted at most %g\n", what, got, limit);
        _fail(file, line);
    }
}
#define assert_at_most(got, limit) below_at((got), (limit), #got, __FILE__, __LINE__)

/* ---- random numbers: xorshift64*, the seed is the test's ---- */

static inline uint64_t random_bits(uint64_t *seed) {
    *seed ^= *seed >> 12;
    *seed ^= *seed << 25;
    *seed ^= *seed >> 27;
    return *seed * UINT64_C(0x2545f4914f6cdd1d);
}

static inline double random_between(uint64_t *seed, double low, double high) {
    return low + (high - low) * ((double)(random_bits(seed) >> 11) * (1.0 / 9007199254740992.0));
}

/* ---- memory ---- */

struct memory {
    void *block;
    struct kl_arena arena;
};

static inline struct memory take_memory(size_t bytes) {
    struct memory m = {.block = malloc(bytes)};
    assert_non_null(m.block);
    kl_arena_init(&m.arena, m.block, bytes);
    return m;
}

static inline void give_memory(struct memory *m) {
    free(m->block);
    m->block = NULL;
}

/* ---- models ---- */

struct built {
    struct memory memory;
    struct kl_model model;
};

static inline void build(struct vehicle *v, struct built *b) {
    struct kl_diag diag = {.what = ""};
    size_t bytes = 1u << 16;
    for (int i = 0; i < 20; i++) {
        b->memory = take_memory(bytes);
        const enum kl_status status = kl_build(&v->def, &b->memory.arena, &b->model, &diag);
        if (status == KL_OK) {
            return;
        }
        bytes = b->memory.arena.wanted + 64u;
        give_memory(&b->memory);
        if (status != KL_ERR_MEMORY) {
            break;
        }
    }
    fail_msg("kl_build: %s: %s (index %d, value %g)", kl_status_text(diag.status), diag.what,
             (int)diag.index, diag.value);
}

static inline void unbuild(struct built *b) {
    give_memory(&b->memory);
}

static inline kl_real *wheelset_x(const struct kl_model *model, struct kl_state *state,
                                  uint32_t w) {
    return &state->x[kl_wheelset_state_index(model, w, KL_WS_Y)];
}

/* Tests have one thread. */
static inline struct kl_work *work(void) {
    static struct kl_work room;
    return &room;
}

/* Runs n steps at the state's own speed; returns the faults. */
static inline uint32_t coast(const struct kl_model *model, struct kl_state *state, uint64_t n,
                             struct kl_output *output) {
    struct kl_input input;
    uint32_t faults = 0;
    kl_input_init(&input);
    input.speed_m_s = state->speed_m_s;
    for (uint64_t i = 0; i < n; i++) {
        faults = kl_step(model, state, &input, output, work());
    }
    return faults;
}

/* Built, and at a speed. */
static inline void set_going(struct vehicle *v, struct built *b, double speed_m_s,
                             struct kl_state *state) {
    build(v, b);
    assert_int_equal(kl_init(&b->model, state, 0, (kl_real)speed_m_s, work()), KL_OK);
}

/* n steps without a fault. */
static inline void run(const struct built *b, struct kl_state *state, const struct kl_input *input,
                       int n, struct kl_output *output) {
    for (int i = 0; i < n; i++) {
        assert_int_equal(kl_step(&b->model, state, input, output, work()), 0);
    }
}

/* n steps, a snapshot, and n more from it and without it: the same. `one` is what it is then, `other`
 * the one restored. */
static inline void go_on_from_snapshot(const struct built *b, const struct kl_input *input, int n,
                                       struct kl_state *one, struct kl_state *other) {
    static unsigned char bytes[KL_SNAPSHOT_SIZE];
    size_t used = 0;
    run(b, one, input, n, NULL);
    assert_int_equal(kl_snapshot(&b->model, one, bytes, sizeof bytes, &used), KL_OK);
    assert_int_equal(kl_restore(&b->model, other, bytes, used), KL_OK);
    run(b, one, input, n, NULL);
    run(b, other, input, n, NULL);
    assert_true(kl_state_hash(one) == kl_state_hash(other));
}

/* ---- profiles ---- */

#define MAX_PROFILE_POINTS 1000
struct profile_file {
    double eta_m[MAX_PROFILE_POINTS];
    double zeta_m[MAX_PROFILE_POINTS];
    struct profile_points points;
};

static inline void read_profile(const char *path, struct profile_file *p) {
    struct csv csv;
    csv_open(&csv, path);
    const int eta = csv_column(&csv, "eta_mm");
    const int zeta = csv_column(&csv, "zeta_mm");
    p->points.n = 0;
    while (csv_next(&csv)) {
        assert_true(p->points.n < MAX_PROFILE_POINTS);
        p->eta_m[p->points.n] = 1e-3 * csv_number(&csv, eta);
        p->zeta_m[p->points.n] = 1e-3 * csv_number(&csv, zeta);
        p->points.n++;
    }
    csv_close(&csv);
    p->points.eta_m = p->eta_m;
    p->points.zeta_m = p->zeta_m;
}

static inline struct kl_pair_def s1002_uic60(void) {
    static struct profile_file wheel;
    static struct profile_file rail;
    if (wheel.points.n == 0) {
        read_profile("models/profiles/s1002.csv", &wheel);
        read_profile("models/profiles/uic60.csv", &rail);
    }
    return points_pair(wheel.points, rail.points);
}

#endif
