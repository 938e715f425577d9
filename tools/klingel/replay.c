/* replay.c - a recording done again, step by step. */
#include "replay.h"

#include <inttypes.h>
#include <string.h>

/* ---- opening ---- */

static int check_model(const struct replay *p, bool changed_model) {
    const struct record_head *h = &p->reader.head;
    const struct kl_model *model = &p->m.model;
    const char *path = p->reader.path;
    const char *real = sizeof(kl_real) == sizeof(double) ? "double" : "float";
    if (strcmp(h->real, real) != 0) {
        return cli_fail("%s: recorded in %s, and this program computes in %s", path, h->real, real);
    }
    if (model->hash != h->model_hash && !changed_model) {
        return cli_fail("%s: recorded with model %s, hash %016" PRIx64 ", model version %" PRIu32
                        " (klingel %s); this one is %s, hash %016" PRIx64 ", model version %" PRIu32
                        "; --changed-model replays it all the same",
                        path, h->model, h->model_hash, h->model_version, h->library, model->name,
                        model->hash, model->version);
    }
    if (model->step_ns != h->step_ns || p->inputs.n != h->n_inputs) {
        return cli_fail("%s: recorded with %" PRIu32 " inputs and a step of %" PRId64
                        " ns; the model has %" PRIu32 " and %" PRId64 " ns",
                        path, h->n_inputs, h->step_ns, p->inputs.n, model->step_ns);
    }
    return CLI_OK;
}

/* States of another model are taken over by putting this model's hash into the snapshot and its check
 * sum right. */
static bool restore(struct replay *p, const unsigned char *bytes, size_t n,
                    struct kl_state *state) {
    unsigned char copy[KL_SNAPSHOT_SIZE];
    if (!p->changed_model || n < 24 || n > sizeof copy) {
        return kl_restore(&p->m.model, state, bytes, n) == KL_OK;
    }
    memcpy(copy, bytes, n);
    for (unsigned i = 0; i < 8; i++) {
        copy[8 + i] = (unsigned char)(p->m.model.hash >> (8 * i));
    }
    const uint64_t sum = kl_hash_bytes(KL_HASH_SEED, copy, n - 8);
    for (unsigned i = 0; i < 8; i++) {
        copy[n - 8 + i] = (unsigned char)(sum >> (8 * i));
    }
    return kl_restore(&p->m.model, state, copy, n) == KL_OK;
}

static int open_model(struct replay *p, const struct cli_target *target) {
    const struct record_head *h = &p->reader.head;
    struct cli_target files = *target;
    if (target->vehicle == NULL) {
        files.vehicle = h->vehicle;
        files.track = h->track[0] != '\0' ? h->track : NULL;
        files.set.n = 0;
        for (size_t i = 0; i < h->n_set; i++) {
            files.set.item[files.set.n++] = h->set[i];
        }
        for (size_t i = 0; i < target->set.n && files.set.n < CLI_MAX_LIST; i++) {
            files.set.item[files.set.n++] = target->set.item[i];
        }
    }
    return cli_model_open(&p->m, &files);
}

int replay_open(struct replay *p, const char *path, const struct cli_target *target,
                bool changed_model) {
    memset(p, 0, sizeof *p);
    int status = record_read_open(&p->reader, path);
    if (status != CLI_OK) {
        return status;
    }
    status = open_model(p, target);
    if (status != CLI_OK) {
        record_read_close(&p->reader);
        return status;
    }
    p->changed_model = changed_model;
    record_inputs_of(&p->m.model, &p->inputs);
    kl_input_init(&p->input);
    status = check_model(p, changed_model);
    if (status == CLI_OK &&
        !restore(p, p->reader.head.start, p->reader.head.start_bytes, &p->state)) {
        status = cli_fail("%s: the state at the start does not fit the model", path);
    }
    if (status != CLI_OK) {
        replay_close(p);
    }
    return status;
}

void replay_close(struct replay *p) {
    cli_model_close(&p->m);
    record_read_close(&p->reader);
}

/* ---- going on ---- */

/* Which number of two states differs most, in units of itself. */
static void find_worst(struct replay *p, const struct kl_state *recorded) {
    static double now[STATE_MAX_SIGNALS];
    static double then[STATE_MAX_SIGNALS];
    const uint32_t n = 4u + 2u * p->m.model.n_states + 3u * KL_SIDES * p->m.model.n_wheelsets;
    double most = -1.0;
    state_values(&p->m.model, &p->state, now);
    state_values(&p->m.model, recorded, then);
    for (uint32_t i = 0; i < n; i++) {
        const double size = fmax(fabs(now[i]), fabs(then[i]));
        const double off = size > 0.0 ? fabs(now[i] - then[i]) / size : 0.0;
        if (off > most) {
            most = off;
            p->bad_signal = i;
            p->bad_now = now[i];
            p->bad_recorded = then[i];
        }
    }
}

static bool compare(struct replay *p, const struct record_item *item) {
    static struct kl_state recorded;
    if (!restore(p, item->bytes, item->n_bytes, &recorded)) {
        return false;
    }
    p->checked++;
    if (kl_state_hash(&recorded) == kl_state_hash(&p->state)) {
        p->good_step = p->parted == 0 ? p->steps : p->good_step;
    } else if (p->parted++ == 0) {
        p->bad_step = p->steps;
        find_worst(p, &recorded);
    }
    return true;
}

enum replay_result replay_next(struct replay *p) {
    while (p->todo == 0) {
        struct record_item item;
        bool good = true;
        record_read(&p->reader, &item);
        switch (item.kind) {
        case RECORD_INPUT:
            record_input_set(&p->inputs, &p->input, item.index, (kl_real)item.value);
            break;
        case RECORD_STEPS:
            p->todo = item.count;
            break;
        case RECORD_STATE:
            good = compare(p, &item);
            break;
        case RECORD_REPLACE:
            good = restore(p, item.bytes, item.n_bytes, &p->state);
            p->replaced++;
            break;
        case RECORD_LOST:
            p->lost += item.count;
            p->gaps++;
            break;
        case RECORD_END:
            p->end_steps = item.count;
            p->end_hash = item.hash;
            return REPLAY_END;
        case RECORD_CUT:
            return REPLAY_CUT;
        }
        if (!good) {
            return REPLAY_BAD;
        }
    }
    p->todo--;
    p->steps++;
    kl_step(&p->m.model, &p->state, &p->input, &p->output, cli_work());
    return REPLAY_STEP;
}
