/* record_write.c - a recording, line by line. */
#include <errno.h>
#include <inttypes.h>
#include <stdarg.h>
#include <string.h>
#include <sys/stat.h>

#include "record.h"

static void put_text(struct record_writer *w, const char *text, size_t n) {
    w->crc = record_crc(w->crc, text, n);
    w->in_block += n;
    w->bytes += n;
    (void)fwrite(text, 1, n, w->file); /* an error stays in the stream; record_close sees it */
}

static void line(struct record_writer *w, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
static void line(struct record_writer *w, const char *format, ...) {
    char text[RECORD_MAX_PATH + 64];
    va_list arguments;
    va_start(arguments, format);
    int n = vsnprintf(text, sizeof text - 1, format, arguments);
    va_end(arguments);
    size_t length = n < 0 ? 0 : (size_t)n < sizeof text - 1 ? (size_t)n : sizeof text - 2;
    text[length++] = '\n';
    put_text(w, text, length);
}

static void hexadecimal(struct record_writer *w, const char *word, const unsigned char *bytes,
                        size_t n) {
    static const char digit[] = "0123456789abcdef";
    char text[2 * KL_SNAPSHOT_SIZE + 16];
    size_t at = (size_t)snprintf(text, 16, "%s ", word);
    for (size_t i = 0; i < n; i++) {
        text[at++] = digit[bytes[i] >> 4];
        text[at++] = digit[bytes[i] & 15];
    }
    text[at++] = '\n';
    put_text(w, text, at);
}

void record_end_block(struct record_writer *w) {
    char text[32];
    if (w->waiting > 0) {
        line(w, "+ %" PRIu64, w->waiting);
        w->waiting = 0;
    }
    if (w->in_block == 0) {
        return;
    }
    int n = snprintf(text, sizeof text, "crc %08" PRIx32 "\n", w->crc);
    (void)fwrite(text, 1, (size_t)n, w->file);
    (void)fflush(w->file);
    w->bytes += (uint64_t)n;
    w->crc = 0;
    w->in_block = 0;
}

/* What was done before this line comes before it. */
static void begin_line(struct record_writer *w) {
    if (w->waiting > 0) {
        line(w, "+ %" PRIu64, w->waiting);
        w->waiting = 0;
    }
    if (w->in_block >= RECORD_BLOCK) {
        record_end_block(w);
    }
}

static int write_head(struct record_writer *w, const struct kl_model *model,
                      const struct cli_target *target, const char *source,
                      const struct kl_state *start) {
    unsigned char bytes[KL_SNAPSHOT_SIZE];
    char name[RECORD_INPUT_NAME];
    struct record_inputs inputs;
    size_t n = 0;
    if (kl_snapshot(model, start, bytes, sizeof bytes, &n) != KL_OK) {
        return cli_fail("%s: the state does not fit the model", w->path);
    }
    line(w, "klingel recording %u", RECORD_VERSION);
    line(w, "model %s", model->name);
    line(w, "model_hash %016" PRIx64, model->hash);
    line(w, "model_version %" PRIu32, model->version);
    line(w, "library %s", KL_VERSION_TEXT);
    line(w, "real %s", sizeof(kl_real) == sizeof(double) ? "double" : "float");
    line(w, "step_ns %" PRId64, model->step_ns);
    line(w, "source %s", source);
    line(w, "vehicle %s", target->vehicle);
    if (target->track != NULL) {
        line(w, "track %s", target->track);
    }
    for (size_t i = 0; i < target->set.n; i++) {
        line(w, "set %s", target->set.item[i]);
    }
    record_inputs_of(model, &inputs);
    for (uint32_t i = 0; i < inputs.n; i++) {
        record_input_name(model, i, name);
        line(w, "input %" PRIu32 " %s", i, name);
    }
    hexadecimal(w, "start", bytes, n);
    record_end_block(w);
    return CLI_OK;
}

static int check_names(const char *path, const struct cli_target *target) {
    size_t n = strlen(path);
    if ((n > 5 && strcmp(path + n - 5, ".yaml") == 0) ||
        (n > 4 && strcmp(path + n - 4, ".yml") == 0)) {
        return cli_misuse("%s: a model file shall not be written over; choose another name", path);
    }
    if (cli_is_stdout(path)) {
        return cli_misuse("--record -: a recording needs a file");
    }
    const char *words[2 + CLI_MAX_LIST] = {target->vehicle, target->track};
    for (size_t i = 0; i < target->set.n; i++) {
        words[2 + i] = target->set.item[i];
    }
    for (size_t i = 0; i < 2 + target->set.n; i++) {
        if (words[i] != NULL &&
            (strlen(words[i]) >= RECORD_MAX_PATH || strchr(words[i], '\n') != NULL)) {
            return cli_misuse("--record: names and values of --set must be one line of at most %d "
                              "characters",
                              RECORD_MAX_PATH - 1);
        }
    }
    return CLI_OK;
}

int record_open(struct record_writer *w, const char *path, const struct kl_model *model,
                const struct cli_target *target, const char *source, const struct kl_state *start) {
    *w = (struct record_writer){.path = path};
    int status = check_names(path, target);
    if (status != CLI_OK) {
        return status;
    }
    w->file = fopen(path, "w");
    if (w->file == NULL) {
        return cli_fail("cannot write %s: %s", path, strerror(errno));
    }
    status = write_head(w, model, target, source, start);
    if (status == CLI_OK && ferror(w->file) != 0) {
        status = cli_fail("cannot write %s: %s", path, strerror(errno != 0 ? errno : EIO));
    }
    if (status != CLI_OK) {
        (void)fclose(w->file);
        w->file = NULL;
    }
    return status;
}

void record_put_input(struct record_writer *w, uint32_t i, double value) {
    begin_line(w);
    line(w, "= %" PRIu32 " %.17g", i, value);
}

void record_put_step(struct record_writer *w) {
    w->waiting++;
    w->steps++;
}

void record_put_state(struct record_writer *w, const unsigned char *bytes, size_t n,
                      bool replaces) {
    begin_line(w);
    hexadecimal(w, replaces ? "put" : "state", bytes, n);
}

void record_put_lost(struct record_writer *w, uint64_t steps) {
    begin_line(w);
    line(w, "lost %" PRIu64, steps);
    w->lost += steps;
}

int record_close(struct record_writer *w, bool whole, const struct kl_state *last) {
    if (w->file == NULL) {
        return CLI_OK;
    }
    if (whole) {
        begin_line(w);
        line(w, "end %" PRIu64 " %016" PRIx64, w->steps, kl_state_hash(last));
    }
    errno = 0;
    record_end_block(w);
    bool failed = ferror(w->file) != 0;
    int reason = errno;
    if (fclose(w->file) != 0) {
        failed = true;
        reason = errno;
    }
    w->file = NULL;
    return failed ? cli_fail("cannot write %s: %s", w->path, strerror(reason != 0 ? reason : EIO))
                  : CLI_OK;
}

/* ---- taking a run down ---- */

int record_taker_open(struct record_taker *t, const char *path, const struct kl_model *model,
                      const struct cli_target *target, const struct kl_state *start,
                      uint64_t every) {
    t->model = model;
    t->every = every;
    record_inputs_of(model, &t->inputs);
    kl_input_init(&t->last);
    return record_open(&t->writer, path, model, target, "run", start);
}

void record_taker_step(struct record_taker *t, const struct kl_input *input) {
    for (uint32_t i = 0; i < t->inputs.n; i++) {
        const kl_real now = record_input_get(&t->inputs, input, i);
        const kl_real then = record_input_get(&t->inputs, &t->last, i);
        if (memcmp(&now, &then, sizeof now) != 0) {
            record_put_input(&t->writer, i, (double)now);
        }
    }
    t->last = *input;
    record_put_step(&t->writer);
}

void record_taker_done(struct record_taker *t, const struct kl_state *state) {
    unsigned char bytes[KL_SNAPSHOT_SIZE];
    size_t n = 0;
    if (t->writer.steps % t->every == 0 &&
        kl_snapshot(t->model, state, bytes, sizeof bytes, &n) == KL_OK) {
        record_put_state(&t->writer, bytes, n, false);
    }
}

struct cli_option record_every_option(uint64_t *value) {
    return (struct cli_option){
        .name = "--record-every",
        .argument = "N",
        .kind = CLI_COUNT,
        .value = value,
        .low = 1,
        .high = 1e9,
        .help = "keep the state of every Nth step as well, so that a replay can\n"
                "say where it parts; default 1000"};
}
