/*
 * record.h - recordings: every input of a run with its step, so that the same steps can be done again.
 *
 * A recording is text, lines ended by "\n", in blocks. It says what it is of, then only what changes:
 *
 *     klingel recording 1
 *     model two_axle_wagon        name, then what must be the same for the same bits:
 *     model_hash 0123456789abcdef
 *     model_version 2             KL_MODEL_VERSION, of the numerics
 *     library 0.1.0
 *     real double                 or float
 *     step_ns 1000000
 *     source run                  or hil
 *     vehicle models/two_axle_wagon.yaml      the files and values that the model was built of
 *     track models/demo_track.yaml            may be absent
 *     set track.irregularities.spectrum.seed=7   any number of them
 *     input 0 speed_m_s           the inputs by number; SI, the unit in the name
 *     input 1 front.axle_torque_Nm
 *     start 214b4c...             state as kl_snapshot has it, in hexadecimal digits
 *     crc 1c291ca3                ends a block: CRC-32 (IEEE 802.3) of all lines since the last one
 *     = 0 27                      input 0 is 27 from the next step on; 17 digits, so the same bits.
 *     + 1000                      1000 steps     Before the first step inputs are those of kl_input_init
 *     state 214b4c...             the state here is this; written now and then, to check against
 *     put 214b4c...               the state becomes this: a load or restore on the bus
 *     lost 17                     17 steps could not be kept; `put` and all inputs follow
 *     end 1000 fedcba9876543210   steps done, and the hash of the last state
 *     crc 8fe4a1b2
 *
 * A block counts only if its CRC is right. So a file that was cut off or damaged is good up to there,
 * and without `end` it is known not to be whole.
 */
#ifndef RECORD_H
#define RECORD_H

#include "cli.h"

#define RECORD_VERSION 1u
#define RECORD_EVERY 1000u  /* steps between two states kept, unless told otherwise */
#define RECORD_BLOCK 32768u /* bytes after which a block is ended */
#define RECORD_STATE_WORDS (KL_SNAPSHOT_SIZE / 8u)
#define RECORD_MAX_INPUTS                                                                          \
    (2u + KL_MAX_WHEELSETS * (2u + 4u * KL_SIDES) + KL_MAX_BODIES + KL_MAX_ACTUATORS)

/* ---- inputs by number ---- */

/* Those of a model that kl_step reads; place: where in struct kl_input, in reals. */
struct record_inputs {
    uint32_t n;
    uint16_t place[RECORD_MAX_INPUTS];
};
#define RECORD_INPUT_NAME (KL_NAME_SIZE + 32)
void record_inputs_of(const struct kl_model *model, struct record_inputs *inputs);
void record_input_name(const struct kl_model *model, uint32_t i, char name[RECORD_INPUT_NAME]);
kl_real record_input_get(const struct record_inputs *inputs, const struct kl_input *input,
                         uint32_t i);
void record_input_set(const struct record_inputs *inputs, struct kl_input *input, uint32_t i,
                      kl_real value);

/* CRC-32 of IEEE 802.3, as zlib's: `crc` is 0 or an earlier result. */
uint32_t record_crc(uint32_t crc, const void *data, size_t size_bytes);

/* ---- writing ---- */

struct record_writer {
    FILE *file;
    const char *path;
    uint32_t crc;     /* of the block that is open */
    size_t in_block;  /* bytes of it */
    uint64_t waiting; /* steps done and not yet written */
    uint64_t steps;
    uint64_t bytes;
    uint64_t lost; /* steps */
};

/* Creates the file and writes its head; not beside its place, for half a recording is worth having.
 * CLI_OK, or CLI_FAILED or CLI_USAGE (printed). */
int record_open(struct record_writer *w, const char *path, const struct kl_model *model,
                const struct cli_target *target, const char *source, const struct kl_state *start);

void record_put_input(struct record_writer *w, uint32_t i, double value);
void record_put_step(struct record_writer *w);
/* A state as kl_snapshot has it, n bytes: to check against, or one that replaces the model's. */
void record_put_state(struct record_writer *w, const unsigned char *bytes, size_t n, bool replaces);
void record_put_lost(struct record_writer *w, uint64_t steps);
/* Ends a block, if anything is in it, and gives it to the system. */
void record_end_block(struct record_writer *w);

/* Ends the recording: `whole` with the hash of the last state. CLI_OK, or CLI_FAILED (printed) where
 * not all was written. */
int record_close(struct record_writer *w, bool whole, const struct kl_state *last);

/* ---- taking a run down as it goes, where writing may take its time ---- */

struct record_taker {
    struct record_writer writer;
    const struct kl_model *model;
    struct record_inputs inputs;
    struct kl_input last; /* as the reader has them */
    uint64_t every;
};
int record_taker_open(struct record_taker *t, const char *path, const struct kl_model *model,
                      const struct cli_target *target, const struct kl_state *start,
                      uint64_t every);
/* Before a step with `input`; after it. */
void record_taker_step(struct record_taker *t, const struct kl_input *input);
void record_taker_done(struct record_taker *t, const struct kl_state *state);

/* --record-every, for the option table of a command. */
struct cli_option record_every_option(uint64_t *value);

/* ---- reading ---- */

#define RECORD_MAX_PATH 1024
struct record_head {
    char model[KL_NAME_SIZE];
    uint64_t model_hash;
    uint32_t model_version;
    char library[16];
    char real[8];
    int64_t step_ns;
    char source[8];
    char vehicle[RECORD_MAX_PATH];
    char track[RECORD_MAX_PATH]; /* "": none */
    size_t n_set;
    char *set[CLI_MAX_LIST];
    uint32_t n_inputs;
    size_t start_bytes;
    unsigned char start[KL_SNAPSHOT_SIZE];
};

enum record_kind {
    RECORD_INPUT,   /* index, value */
    RECORD_STEPS,   /* count */
    RECORD_STATE,   /* bytes */
    RECORD_REPLACE, /* bytes */
    RECORD_LOST,    /* count */
    RECORD_END,     /* count, hash; nothing follows */
    RECORD_CUT      /* the file ends, or is damaged: see the reader's `why` */
};
struct record_item {
    enum record_kind kind;
    uint32_t index;
    double value;
    uint64_t count;
    uint64_t hash;
    const unsigned char *bytes;
    size_t n_bytes;
};

struct record_reader {
    FILE *file;
    const char *path;
    struct record_head head;
    char *block; /* lines of the block that is read, its CRC being right */
    size_t room;
    size_t size;
    size_t at;
    uint64_t line;     /* of the file, of the next item */
    uint64_t lines_in; /* of the blocks read */
    bool ended;        /* `end` was read */
    unsigned char bytes[KL_SNAPSHOT_SIZE];
    char why[160];
};

/* Opens a file and reads its head. CLI_OK, or CLI_FAILED (printed with file and line). */
int record_read_open(struct record_reader *r, const char *path);
/* The next item; RECORD_END and RECORD_CUT stay. */
void record_read(struct record_reader *r, struct record_item *item);
void record_read_close(struct record_reader *r);

/* True if a file begins as a recording does; false also where it cannot be read. */
bool record_is(const char *path);

#endif
