/* hil_record.c - from the loop through a ring to the file. */
#include "hil_record.h"

#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define DRAIN_NS 20000000     /* between two looks into the ring */
#define BLOCK_NS 1000000000LL /* what a crash may cost */

/* In the ring: a word whose upper half says what it is and whose lower half counts what follows. */
enum word {
    WORD_STEP = 1, /* n pairs of input number and bits */
    WORD_STATE,    /* n words of a state to check against */
    WORD_PUT,      /* n words of a state that replaces the model's */
    WORD_LOST      /* one word: steps lost */
};
#define HEAD(word, n) (((uint64_t)(word) << 32) | (n))

/* ---- the loop's side ---- */

static uint64_t room(const struct hil_record *r) {
    return r->size - (atomic_load_explicit(&r->put, memory_order_relaxed) -
                      atomic_load_explicit(&r->taken, memory_order_acquire));
}

static void put_word(struct hil_record *r, uint64_t *at, uint64_t word) {
    r->ring[(*at)++ & (r->size - 1)] = word;
}

static void put_state(struct hil_record *r, uint64_t *at, enum word word,
                      const struct kl_state *state) {
    unsigned char bytes[KL_SNAPSHOT_SIZE];
    size_t n = 0;
    (void)kl_snapshot(r->model, state, bytes, sizeof bytes, &n); /* fits: it did at the start */
    put_word(r, at, HEAD(word, n / 8));
    for (size_t i = 0; i < n; i += 8) {
        uint64_t value;
        memcpy(&value, bytes + i, 8);
        put_word(r, at, value);
    }
}

static bool same(kl_real a, kl_real b) {
    return memcmp(&a, &b, sizeof a) == 0;
}

static uint64_t bits_of(kl_real value) {
    const double wide = (double)value;
    uint64_t bits;
    memcpy(&bits, &wide, sizeof bits);
    return bits;
}

static uint32_t count_changes(const struct hil_record *r, const struct kl_input *input) {
    uint32_t n = 0;
    for (uint32_t i = 0; i < r->inputs.n; i++) {
        n += !r->known || !same(record_input_get(&r->inputs, input, i),
                                record_input_get(&r->inputs, &r->last, i));
    }
    return n;
}

static void put_step(struct hil_record *r, uint64_t *at, const struct kl_input *input,
                     uint32_t changes) {
    put_word(r, at, HEAD(WORD_STEP, changes));
    for (uint32_t i = 0; i < r->inputs.n && changes > 0; i++) {
        const kl_real now = record_input_get(&r->inputs, input, i);
        if (!r->known || !same(now, record_input_get(&r->inputs, &r->last, i))) {
            put_word(r, at, i);
            put_word(r, at, bits_of(now));
            record_input_set(&r->inputs, &r->last, i, now);
            changes--;
        }
    }
    r->known = true;
}

static void note(struct hil_record *r, const struct kl_state *state, const struct kl_input *input) {
    const uint32_t changes = count_changes(r, input);
    const bool check = r->steps > 0 && r->steps % r->every == 0 && !r->replaced;
    const uint64_t left = room(r);
    uint64_t at = atomic_load_explicit(&r->put, memory_order_relaxed);
    /* the largest that this can be */
    if (left < 2u + 1u + RECORD_STATE_WORDS + 1u + 2u * (uint64_t)changes) {
        r->waiting++;
        atomic_fetch_add_explicit(&r->lost, 1, memory_order_relaxed);
        r->replaced = true;
        r->known = false;
        return;
    }
    if (r->waiting > 0) {
        put_word(r, &at, HEAD(WORD_LOST, 1));
        put_word(r, &at, r->waiting);
        r->waiting = 0;
    }
    if (r->replaced || check) {
        put_state(r, &at, r->replaced ? WORD_PUT : WORD_STATE, state);
        r->replaced = false;
    }
    put_step(r, &at, input, changes);
    r->steps++;
    r->fullest = r->size - left > r->fullest ? r->size - left : r->fullest;
    atomic_store_explicit(&r->put, at, memory_order_release);
}

void hil_record_told(void *context, enum kl_node_event event, const struct kl_node *node) {
    struct hil_record *r = context;
    if (event == KL_NODE_REPLACED) {
        r->replaced = true;
    } else {
        note(r, node->config.state, node->config.input);
    }
}

/* ---- the thread's side ---- */

static uint64_t word_at(const struct hil_record *r, uint64_t at) {
    return r->ring[at & (r->size - 1)];
}

static double real_at(const struct hil_record *r, uint64_t at) {
    const uint64_t bits = word_at(r, at);
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static void write_state(struct hil_record *r, uint64_t at, size_t n, bool replaces) {
    unsigned char bytes[8 * RECORD_STATE_WORDS];
    for (size_t i = 0; i < n; i++) {
        const uint64_t word = word_at(r, at + i);
        memcpy(bytes + 8 * i, &word, 8);
    }
    record_put_state(&r->writer, bytes, 8 * n, replaces);
}

/* Writes one thing; returns where the next begins. */
static uint64_t write_one(struct hil_record *r, uint64_t at) {
    const uint64_t head = word_at(r, at++);
    const size_t n = (size_t)(head & UINT32_MAX);
    switch ((enum word)(head >> 32)) {
    case WORD_STEP:
        for (size_t i = 0; i < n; i++) {
            record_put_input(&r->writer, (uint32_t)word_at(r, at + 2 * i),
                             real_at(r, at + 2 * i + 1));
        }
        record_put_step(&r->writer);
        return at + 2 * n;
    case WORD_STATE:
    case WORD_PUT:
        write_state(r, at, n, (head >> 32) == WORD_PUT);
        return at + n;
    case WORD_LOST:
        record_put_lost(&r->writer, word_at(r, at));
        return at + 1;
    }
    return at;
}

void hil_record_drain(struct hil_record *r) {
    uint64_t at = atomic_load_explicit(&r->taken, memory_order_relaxed);
    const uint64_t put = atomic_load_explicit(&r->put, memory_order_acquire);
    while (at != put) {
        at = write_one(r, at);
        atomic_store_explicit(&r->taken, at, memory_order_release);
    }
}

static void *write_on(void *context) {
    struct hil_record *r = context;
    const struct timespec pause = {.tv_nsec = DRAIN_NS};
    while (atomic_load(&r->stop) == 0) {
        hil_record_drain(r);
        r->block_ns += DRAIN_NS;
        if (r->block_ns >= BLOCK_NS) {
            record_end_block(&r->writer);
            r->block_ns = 0;
        }
        (void)nanosleep(&pause, NULL);
    }
    return NULL;
}

static int start_thread(struct hil_record *r) {
    sigset_t all;
    sigset_t before;
    sigfillset(&all); /* signals shall wake the loop, not this thread */
    pthread_sigmask(SIG_SETMASK, &all, &before);
    r->has_thread = pthread_create(&r->thread, NULL, write_on, r) == 0;
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    return r->has_thread ? CLI_OK : cli_fail("--record: no thread to write it");
}

int hil_record_open(struct hil_record *r, const char *path, const struct kl_model *model,
                    const struct cli_target *target, const struct kl_state *start, uint64_t every,
                    uint64_t words, bool thread) {
    memset(r, 0, sizeof *r);
    r->model = model;
    r->every = every;
    r->size = words;
    r->known = true;
    kl_input_init(&r->last);
    record_inputs_of(model, &r->inputs);
    r->ring = calloc(words, sizeof *r->ring);
    if (r->ring == NULL) {
        return cli_fail("out of memory");
    }
    int status = record_open(&r->writer, path, model, target, "hil", start);
    if (status == CLI_OK && thread) {
        status = start_thread(r);
    }
    if (status != CLI_OK) {
        (void)record_close(&r->writer, false, start);
        free(r->ring);
        r->ring = NULL;
    }
    return status;
}

int hil_record_close(struct hil_record *r, const struct kl_state *last) {
    unsigned char bytes[KL_SNAPSHOT_SIZE];
    size_t n = 0;
    if (r->ring == NULL) {
        return CLI_OK;
    }
    if (r->has_thread) {
        atomic_store(&r->stop, 1);
        (void)pthread_join(r->thread, NULL);
    }
    hil_record_drain(r);
    if (r->waiting > 0) {
        record_put_lost(&r->writer, r->waiting);
    }
    if (r->replaced && kl_snapshot(r->model, last, bytes, sizeof bytes, &n) == KL_OK) {
        record_put_state(&r->writer, bytes, n, true); /* loaded, and not stepped since */
    }
    free(r->ring);
    r->ring = NULL;
    return record_close(&r->writer, true, last);
}
