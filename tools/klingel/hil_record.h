/*
 * hil_record.h - takes a session down without stopping its loop. Private to cmd_hil.c and tests.
 *
 * The loop puts what happens into a ring of fixed size, a thread of ordinary priority takes it out
 * and writes the recording. The loop never waits: where the ring has no room a step is lost, counted,
 * and named in the recording, which goes on with a whole state and all inputs as soon as there is
 * room. In an ordinary cycle the loop puts 8 bytes, 16 more for each input that changed, and now and
 * then a state (with it 1 us or so, 10 us for a train of ten vehicles).
 */
#ifndef HIL_RECORD_H
#define HIL_RECORD_H

#include <pthread.h>
#include <stdatomic.h>

#include "kl_node.h"
#include "record.h"

#define HIL_RECORD_WORDS (1u << 18) /* of the ring: 2 MiB, minutes of an ordinary session */

struct hil_record {
    struct record_writer writer;
    const struct kl_model *model;
    struct record_inputs inputs;
    uint64_t every;
    uint64_t *ring; /* a power of two of words */
    uint64_t size;
    _Atomic uint64_t put;   /* by the loop */
    _Atomic uint64_t taken; /* by the thread */
    /* of the loop alone */
    struct kl_input last;
    bool replaced;    /* the next step begins with a state */
    bool known;       /* `last` is what the recording has; else all inputs are put */
    uint64_t steps;   /* in the ring or written */
    uint64_t waiting; /* lost since the last one */
    _Atomic uint64_t lost;
    uint64_t fullest; /* words in the ring at the worst */
    /* of the thread */
    pthread_t thread;
    bool has_thread;
    _Atomic int stop;
    int64_t block_ns;
};

/* Creates the file, takes memory for `words` (a power of two), starts the thread where `thread`.
 * CLI_OK, or printed. */
int hil_record_open(struct hil_record *r, const char *path, const struct kl_model *model,
                    const struct cli_target *target, const struct kl_state *start, uint64_t every,
                    uint64_t words, bool thread);

/* The observer of the node; `context` is the recorder. Bounded, never waits. */
void hil_record_told(void *context, enum kl_node_event event, const struct kl_node *node);

/* Writes what is in the ring; for the thread, and for tests without one. */
void hil_record_drain(struct hil_record *r);

/* After the loop: writes the rest and the end. CLI_OK, or CLI_FAILED (printed). */
int hil_record_close(struct hil_record *r, const struct kl_state *last);

#endif
