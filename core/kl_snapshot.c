/* kl_snapshot.c - a state as bytes: hash, snapshot, restore. Little-endian on every target. */
#include "kl_math.h"
#include "kl_step.h"

#define MAGIC UINT64_C(0x34544154534c4b21) /* "!KLSTAT4" */
/* magic, model hash, tick, fault tick, faults and number of states, s, V, V' */
#define HEADER_WORDS 8u

static uint64_t word_of(kl_real x) {
#ifdef KL_REAL_FLOAT
    union {
        float value;
        uint32_t bits;
    } u = {.value = x};
#else
    union {
        double value;
        uint64_t bits;
    } u = {.value = x};
#endif
    return u.bits;
}

static kl_real real_of(uint64_t word) {
#ifdef KL_REAL_FLOAT
    union {
        uint32_t bits;
        float value;
    } u = {.bits = (uint32_t)word};
#else
    union {
        uint64_t bits;
        double value;
    } u = {.bits = word};
#endif
    return u.value;
}

static void put(unsigned char *to, uint64_t word) {
    for (int i = 0; i < 8; i++) {
        to[i] = (unsigned char)(word >> (8 * i));
    }
}

static uint64_t get(const unsigned char *from) {
    uint64_t word = 0;
    for (int i = 0; i < 8; i++) {
        word |= (uint64_t)from[i] << (8 * i);
    }
    return word;
}

static uint64_t hash_word(uint64_t hash, uint64_t word) {
    unsigned char bytes[8];
    put(bytes, word);
    return kl_hash_bytes(hash, bytes, sizeof bytes);
}

/* States, their rates and the lifts, in one row. */
#define LIFT_WORDS ((uint32_t)KL_LIFT_FIELDS * KL_SIDES)
/* A state does not know its wheelsets. The hash takes the lifts of this many, and of more where they
 * are not 0: so it does not depend on how many the build has room for. */
#define LIFTS_ALWAYS 8u
static uint32_t count_words(uint32_t n_states, uint32_t n_wheelsets) {
    return 2u * n_states + LIFT_WORDS * n_wheelsets;
}

static kl_real *word_at(struct kl_state *state, uint32_t i) {
    const uint32_t n = state->n_states;
    if (i < n) {
        return &state->x[i];
    }
    if (i < 2u * n) {
        return &state->rate[i - n];
    }
    const uint32_t k = i - 2u * n;
    struct kl_lift *lift = &state->lift[k / LIFT_WORDS];
    kl_real *const field[KL_LIFT_FIELDS] = {
        lift->rise_m,   lift->rate_m_s,    lift->faster_m_s, lift->normal_N, lift->expected_N,
        lift->flange_N, lift->slope,       lift->path_m_s,   lift->press_N,  lift->slip_m_s,
        lift->trend_N,  lift->resist_Ns_m, lift->inertia_kg, lift->push_kg,  lift->short_m};
    return &field[k % LIFT_WORDS / KL_SIDES][k % KL_SIDES];
}

static kl_real value_at(const struct kl_state *state, uint32_t i) {
    const uint32_t n = state->n_states;
    if (i < 2u * n) {
        return i < n ? state->x[i] : state->rate[i - n];
    }
    const uint32_t k = i - 2u * n;
    const struct kl_lift *lift = &state->lift[k / LIFT_WORDS];
    const kl_real *const field[KL_LIFT_FIELDS] = {
        lift->rise_m,   lift->rate_m_s,    lift->faster_m_s, lift->normal_N, lift->expected_N,
        lift->flange_N, lift->slope,       lift->path_m_s,   lift->press_N,  lift->slip_m_s,
        lift->trend_N,  lift->resist_Ns_m, lift->inertia_kg, lift->push_kg,  lift->short_m};
    return field[k % LIFT_WORDS / KL_SIDES][k % KL_SIDES];
}

uint64_t kl_state_hash(const struct kl_state *state) {
    uint64_t h = KL_HASH_SEED;
    h = hash_word(h, state->tick);
    h = hash_word(h, state->fault_tick);
    h = hash_word(h, ((uint64_t)state->faults << 32) | state->n_states);
    h = hash_word(h, word_of(state->s_m));
    h = hash_word(h, word_of(state->speed_m_s));
    const uint64_t speed_rate = word_of(state->speed_rate_m_s2);
    h = speed_rate != 0u ? hash_word(h, speed_rate) : h; /* a free speed */
    const uint32_t n = count_words(state->n_states, KL_MAX_WHEELSETS);
    const uint32_t always = count_words(state->n_states, LIFTS_ALWAYS);
    for (uint32_t i = 0; i < (n > always ? n : always); i++) {
        const uint64_t word = i < n ? word_of(value_at(state, i)) : 0u;
        if (i < always || word != 0u) {
            h = hash_word(h, word);
        }
    }
    return h;
}

enum kl_status kl_snapshot(const struct kl_model *model, const struct kl_state *state,
                           unsigned char *buffer, size_t size_bytes, size_t *used_bytes) {
    if (model == NULL || state == NULL || buffer == NULL || used_bytes == NULL ||
        state->n_states != model->n_states) {
        return KL_ERR_ARGUMENT;
    }
    const uint32_t n = count_words(model->n_states, model->n_wheelsets);
    const size_t need = 8u * (HEADER_WORDS + (size_t)n + 1u);
    if (size_bytes < need) {
        return KL_ERR_MEMORY;
    }
    put(buffer, MAGIC);
    put(buffer + 8, model->hash);
    put(buffer + 16, state->tick);
    put(buffer + 24, state->fault_tick);
    put(buffer + 32, ((uint64_t)state->faults << 32) | state->n_states);
    put(buffer + 40, word_of(state->s_m));
    put(buffer + 48, word_of(state->speed_m_s));
    put(buffer + 56, word_of(state->speed_rate_m_s2));
    for (uint32_t i = 0; i < n; i++) {
        put(buffer + 8u * (HEADER_WORDS + i), word_of(value_at(state, i)));
    }
    put(buffer + need - 8u, kl_hash_bytes(KL_HASH_SEED, buffer, need - 8u));
    *used_bytes = need;
    return KL_OK;
}

enum kl_status kl_restore(const struct kl_model *model, struct kl_state *state,
                          const unsigned char *buffer, size_t used_bytes) {
    if (model == NULL || state == NULL || buffer == NULL) {
        return KL_ERR_ARGUMENT;
    }
    const uint32_t n = count_words(model->n_states, model->n_wheelsets);
    const size_t need = 8u * (HEADER_WORDS + (size_t)n + 1u);
    if (used_bytes != need || get(buffer) != MAGIC || get(buffer + 8) != model->hash ||
        (uint32_t)get(buffer + 32) != model->n_states ||
        get(buffer + need - 8u) != kl_hash_bytes(KL_HASH_SEED, buffer, need - 8u)) {
        return KL_ERR_SNAPSHOT;
    }
    const struct kl_state blank = {0};
    *state = blank;
    state->tick = get(buffer + 16);
    state->fault_tick = get(buffer + 24);
    state->faults = (uint32_t)(get(buffer + 32) >> 32);
    state->n_states = model->n_states;
    state->s_m = real_of(get(buffer + 40));
    state->speed_m_s = real_of(get(buffer + 48));
    state->speed_rate_m_s2 = real_of(get(buffer + 56));
    for (uint32_t i = 0; i < n; i++) {
        *word_at(state, i) = real_of(get(buffer + 8u * (HEADER_WORDS + i)));
    }
    return KL_OK;
}
