/* record_read.c - recordings in, block by block. */
#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>

#include "record.h"

#define FIRST_LINE "klingel recording "
#define MAX_BLOCK (64u << 20) /* no writer makes one of this size */

/* ---- blocks ---- */

static void cut(struct record_reader *r, const char *why) {
    r->size = r->at = 0;
    snprintf(r->why, sizeof r->why, "line %" PRIu64 ": %s", r->line, why);
}

static bool take_in(struct record_reader *r, const char *text, size_t n) {
    if (r->size + n > MAX_BLOCK) {
        return false;
    }
    if (r->size + n + 1 > r->room) {
        size_t room = 2 * (r->size + n) + 4096;
        char *more = realloc(r->block, room);
        if (more == NULL) {
            return false;
        }
        r->block = more;
        r->room = room;
    }
    memcpy(r->block + r->size, text, n);
    r->size += n;
    r->block[r->size] = '\0';
    return true;
}

/* "crc 1c291ca3\n" */
static bool is_crc(const char *text, ssize_t n, uint32_t *crc) {
    char *end = NULL;
    if (n != 13 || strncmp(text, "crc ", 4) != 0 || text[12] != '\n') {
        return false;
    }
    *crc = (uint32_t)strtoul(text + 4, &end, 16);
    return end == text + 12;
}

/* Reads a block; false where none with a right CRC follows, and then says why. */
static bool next_block(struct record_reader *r) {
    char *text = NULL;
    size_t room = 0;
    uint32_t wanted = 0;
    bool closed = false;
    bool held = true;
    r->line = r->lines_in + 1;
    r->size = r->at = 0;
    ssize_t n = 0;
    while (held && !closed && (n = getline(&text, &room, r->file)) > 0) {
        closed = is_crc(text, n, &wanted);
        held = closed || take_in(r, text, (size_t)n);
        r->lines_in++;
    }
    bool failed = ferror(r->file) != 0;
    free(text);
    if (failed) {
        cut(r, strerror(errno));
    } else if (!held) {
        cut(r, "a block without end; this is no recording, or it is badly damaged");
    } else if (!closed) {
        cut(r, r->size > 0 ? "the file was cut off in the block that begins here"
                           : "the file was cut off here: it has no end");
    } else if (record_crc(0, r->block, r->size) != wanted) {
        cut(r, "the block that begins here is damaged: its CRC is wrong");
    } else {
        return true;
    }
    return false;
}

/* The next line of the block, without its end; NULL: no more. */
static char *next_line(struct record_reader *r) {
    if (r->at >= r->size) {
        return NULL;
    }
    char *text = r->block + r->at;
    char *end = memchr(text, '\n', r->size - r->at);
    if (end == NULL || memchr(text, '\0', (size_t)(end - text)) != NULL) {
        return NULL;
    }
    *end = '\0';
    r->at = (size_t)(end + 1 - r->block);
    return text;
}

/* ---- what stands in lines ---- */

static int digit_of(char c) {
    return c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

static bool read_bytes(const char *text, unsigned char *bytes, size_t *n) {
    size_t length = strlen(text);
    if (length % 2 != 0 || length == 0 || length / 2 > KL_SNAPSHOT_SIZE) {
        return false;
    }
    for (size_t i = 0; i < length / 2; i++) {
        int high = digit_of(text[2 * i]);
        int low = digit_of(text[2 * i + 1]);
        if (high < 0 || low < 0) {
            return false;
        }
        bytes[i] = (unsigned char)(16 * high + low);
    }
    *n = length / 2;
    return true;
}

static bool read_count(const char **at, int base, uint64_t *value) {
    char *end = NULL;
    if (!isxdigit((unsigned char)**at)) {
        return false;
    }
    errno = 0;
    *value = strtoull(*at, &end, base);
    bool good = errno == 0 && (*end == ' ' || *end == '\0');
    *at = end + (*end == ' ');
    return good;
}

static bool read_text(const char *value, char *to, size_t size) {
    return snprintf(to, size, "%s", value) < (int)size && value[0] != '\0';
}

/* ---- the head ---- */

static bool head_line(struct record_head *h, const char *key, const char *value) {
    uint64_t number = 0;
    const char *at = value;
    if (strcmp(key, "model") == 0) {
        return read_text(value, h->model, sizeof h->model);
    }
    if (strcmp(key, "model_hash") == 0) {
        return read_count(&at, 16, &h->model_hash);
    }
    if (strcmp(key, "model_version") == 0) {
        bool good = read_count(&at, 10, &number) && number <= UINT32_MAX;
        h->model_version = (uint32_t)number;
        return good;
    }
    if (strcmp(key, "library") == 0) {
        return read_text(value, h->library, sizeof h->library);
    }
    if (strcmp(key, "real") == 0) {
        return read_text(value, h->real, sizeof h->real);
    }
    if (strcmp(key, "step_ns") == 0) {
        bool good = read_count(&at, 10, &number) && number > 0 && number <= INT64_MAX;
        h->step_ns = (int64_t)number;
        return good;
    }
    if (strcmp(key, "source") == 0) {
        return read_text(value, h->source, sizeof h->source);
    }
    if (strcmp(key, "vehicle") == 0) {
        return read_text(value, h->vehicle, sizeof h->vehicle);
    }
    if (strcmp(key, "track") == 0) {
        return read_text(value, h->track, sizeof h->track);
    }
    if (strcmp(key, "set") == 0 && h->n_set < CLI_MAX_LIST) {
        h->set[h->n_set] = strdup(value);
        return h->set[h->n_set++] != NULL;
    }
    if (strcmp(key, "input") == 0) {
        return read_count(&at, 10, &number) && number == h->n_inputs++;
    }
    return strcmp(key, "start") == 0 && read_bytes(value, h->start, &h->start_bytes);
}

static int read_head(struct record_reader *r) {
    char first[32];
    char *text = next_line(r);
    snprintf(first, sizeof first, FIRST_LINE "%u", RECORD_VERSION);
    if (text == NULL || strcmp(text, first) != 0) {
        return cli_fail("%s:1: this program reads '%s', not '%.40s'", r->path, first,
                        text != NULL ? text : "");
    }
    while ((text = next_line(r)) != NULL) {
        r->line++;
        char *space = strchr(text, ' ');
        char *value = space != NULL ? space + 1 : text + strlen(text);
        if (space != NULL) {
            *space = '\0';
        }
        if (!head_line(&r->head, text, value)) {
            return cli_fail("%s:%" PRIu64 ": '%.40s %.40s' is not understood", r->path, r->line,
                            text, value);
        }
    }
    const struct record_head *h = &r->head;
    if (h->vehicle[0] == '\0' || h->start_bytes == 0 || h->step_ns == 0 || h->n_inputs == 0) {
        return cli_fail("%s: the head is not complete: %s is missing", r->path,
                        h->vehicle[0] == '\0' ? "vehicle"
                        : h->start_bytes == 0 ? "start"
                        : h->step_ns == 0     ? "step_ns"
                                              : "input");
    }
    return CLI_OK;
}

int record_read_open(struct record_reader *r, const char *path) {
    memset(r, 0, sizeof *r);
    r->path = path;
    if (!record_is(path)) {
        FILE *there = fopen(path, "r");
        int reason = errno;
        if (there == NULL) {
            return cli_fail("cannot open %s: %s", path, strerror(reason));
        }
        (void)fclose(there);
        return cli_fail("%s:1: not a recording: it does not begin with '%s%u'", path, FIRST_LINE,
                        RECORD_VERSION);
    }
    r->file = fopen(path, "r");
    if (r->file == NULL) {
        return cli_fail("cannot open %s: %s", path, strerror(errno));
    }
    int status = next_block(r) ? read_head(r) : cli_fail("%s: %s", path, r->why);
    if (status != CLI_OK) {
        record_read_close(r);
    }
    return status;
}

bool record_is(const char *path) {
    char text[sizeof FIRST_LINE] = "";
    FILE *file = fopen(path, "r");
    bool is = file != NULL && fgets(text, sizeof text, file) != NULL &&
              strncmp(text, FIRST_LINE, sizeof FIRST_LINE - 1) == 0;
    if (file != NULL) {
        (void)fclose(file);
    }
    return is;
}

/* ---- items ---- */

static bool take_input(struct record_reader *r, const char *text, struct record_item *item) {
    char *end = NULL;
    uint64_t index = 0;
    if (!read_count(&text, 10, &index) || index >= r->head.n_inputs) {
        return false;
    }
    item->kind = RECORD_INPUT;
    item->index = (uint32_t)index;
    item->value = strtod(text, &end);
    return end != text && *end == '\0';
}

static bool take(struct record_reader *r, const char *text, struct record_item *item) {
    if (strncmp(text, "= ", 2) == 0) {
        return take_input(r, text + 2, item);
    }
    if (strncmp(text, "+ ", 2) == 0) {
        item->kind = RECORD_STEPS;
        text += 2;
        return read_count(&text, 10, &item->count) && *text == '\0';
    }
    if (strncmp(text, "state ", 6) == 0 || strncmp(text, "put ", 4) == 0) {
        item->kind = text[0] == 's' ? RECORD_STATE : RECORD_REPLACE;
        item->bytes = r->bytes;
        return read_bytes(strchr(text, ' ') + 1, r->bytes, &item->n_bytes);
    }
    if (strncmp(text, "lost ", 5) == 0) {
        item->kind = RECORD_LOST;
        text += 5;
        return read_count(&text, 10, &item->count) && *text == '\0';
    }
    if (strncmp(text, "end ", 4) == 0) {
        item->kind = RECORD_END;
        text += 4;
        r->ended = true;
        return read_count(&text, 10, &item->count) && read_count(&text, 16, &item->hash);
    }
    return false;
}

void record_read(struct record_reader *r, struct record_item *item) {
    *item = (struct record_item){.kind = RECORD_CUT};
    if (r->why[0] != '\0') {
        return;
    }
    if (r->at >= r->size && !next_block(r)) {
        return;
    }
    const char *text = next_line(r);
    if (text == NULL || !take(r, text, item)) {
        *item = (struct record_item){.kind = RECORD_CUT};
        cut(r, "not understood");
        return;
    }
    r->line++;
}

void record_read_close(struct record_reader *r) {
    if (r->file != NULL) {
        (void)fclose(r->file);
    }
    for (size_t i = 0; i < r->head.n_set; i++) {
        free(r->head.set[i]);
    }
    free(r->block);
    memset(r, 0, sizeof *r);
}
