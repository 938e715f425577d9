#include "model_source.h"

#include "creep_file.h"

#include <errno.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

char *model_read_whole(const char *path, size_t max_bytes, size_t *size, char *why,
                       size_t why_size) {
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        snprintf(why, why_size, "cannot open: %s", strerror(errno));
        return NULL;
    }
    char *text = NULL;
    size_t used = 0;
    size_t capacity = 0;
    why[0] = '\0';
    for (size_t got = 1; got > 0 && why[0] == '\0';) {
        if (capacity - used < 2) {
            capacity = capacity == 0 ? 16384 : 2 * capacity;
            char *larger = realloc(text, capacity);
            if (larger == NULL) {
                snprintf(why, why_size, "out of memory");
                break;
            }
            text = larger;
        }
        got = fread(text + used, 1, capacity - used - 1, file);
        used += got;
        if (used > max_bytes) {
            snprintf(why, why_size, "larger than %zu bytes", max_bytes);
        } else if (ferror(file)) {
            snprintf(why, why_size, "cannot read: %s", strerror(errno));
        }
    }
    fclose(file);
    if (why[0] == '\0' && memchr(text, '\0', used) != NULL) {
        snprintf(why, why_size, "not a text file (it holds a NUL byte)");
    }
    if (why[0] != '\0') {
        free(text);
        return NULL;
    }
    text[used] = '\0';
    *size = used;
    return text;
}

/* The rest of opening, once path and text are there. */
static struct model_parts *outlined(struct model_parts *parts) {
    struct outline_error error;
    if (outline_parse(&parts->outline, parts->text, parts->size, &error) != 0) {
        fprintf(parts->errors, "%s:%u: %s\n", parts->path, (unsigned)error.line, error.what);
    } else if (parts->outline.n == 0 || parts->outline.nodes[0].kind != OUTLINE_MAPPING) {
        fprintf(parts->errors, "%s:1: %s\n", parts->path,
                parts->outline.n == 0 ? "the file is empty" : "must be a mapping (key: value)");
    } else {
        return parts;
    }
    model_source_free(parts);
    return NULL;
}

struct model_parts *model_source_open(const char *path, FILE *errors) {
    struct model_parts *parts = calloc(1, sizeof *parts);
    if (parts == NULL || (parts->path = strdup(path)) == NULL) {
        fprintf(errors, "%s: out of memory\n", path);
        model_source_free(parts);
        return NULL;
    }
    char why[128];
    parts->errors = errors;
    parts->text = model_read_whole(path, MODEL_MAX_YAML_BYTES, &parts->size, why, sizeof why);
    if (parts->text == NULL) {
        fprintf(errors, "%s: %s\n", path, why);
        model_source_free(parts);
        return NULL;
    }
    return outlined(parts);
}

void model_source_free(struct model_parts *parts) {
    if (parts == NULL) {
        return;
    }
    while (parts->blocks != NULL) {
        struct model_block *next = parts->blocks->next;
        free(parts->blocks);
        parts->blocks = next;
    }
    for (size_t i = 0; i < parts->n_set; i++) {
        free(parts->set_paths[i]);
    }
    free(parts->set_paths);
    for (uint32_t i = 0; i < parts->n_children; i++) {
        model_source_free(parts->child[i].parts);
    }
    free(parts->child);
    outline_free(&parts->outline);
    if (parts->creep_table != NULL) {
        creep_file_free(parts->creep_table);
    }
    free(parts->creep_table);
    free(parts->path);
    free(parts->text);
    free(parts);
}

void *model_take(struct model_parts *parts, size_t count, size_t size) {
    const size_t head = 16; /* keeps what follows aligned for any type */
    struct model_block *block = NULL;
    if (size == 0 || count <= (SIZE_MAX - head) / size) {
        block = calloc(1, head + count * size);
    }
    if (block == NULL) {
        fprintf(parts->errors, "%s: out of memory\n", parts->path);
        parts->n_errors++;
        return NULL;
    }
    block->next = parts->blocks;
    parts->blocks = block;
    return (unsigned char *)block + head;
}

char *model_beside(struct model_parts *parts, const char *name) {
    const char *slash = strrchr(parts->path, '/');
    size_t folder = name[0] == '/' || slash == NULL ? 0 : (size_t)(slash - parts->path) + 1;
    size_t length = strlen(name);
    char *path = model_take(parts, folder + length + 1, 1);
    if (path != NULL) {
        memcpy(path, parts->path, folder);
        memcpy(path + folder, name, length + 1);
    }
    return path;
}

/* ---- messages ---- */

static bool was_set(const struct model_parts *parts, const char *key) {
    for (size_t i = 0; i < parts->n_set; i++) {
        if (strcmp(parts->set_paths[i], key) == 0) {
            return true;
        }
    }
    return false;
}

static void print_error(struct model_parts *parts, const char *key, const char *what) {
    if (parts->n_errors++ >= MODEL_MAX_ERRORS) {
        return;
    }
    int32_t nearest = OUTLINE_NONE;
    int32_t id = outline_find(&parts->outline, key, &nearest);
    const struct outline_node *nodes = parts->outline.nodes;
    const char *value = id != OUTLINE_NONE ? nodes[id].text : NULL;
    fprintf(parts->errors, "%s:%u: ", parts->path,
            nearest != OUTLINE_NONE ? (unsigned)nodes[nearest].line : 1u);
    if (value != NULL) {
        fprintf(parts->errors, "%s = %.60s%s: ", key, value, strlen(value) > 60 ? "..." : "");
    } else if (key[0] != '\0') {
        fprintf(parts->errors, "%s: ", key);
    }
    fprintf(parts->errors, "%s%s\n", what, was_set(parts, key) ? " (set, not from the file)" : "");
    if (parts->n_errors == MODEL_MAX_ERRORS) {
        fprintf(parts->errors, "%s: more errors are not shown\n", parts->path);
    }
}

void model_error(struct model_parts *parts, const char *key, const char *what_format, ...) {
    char what[512];
    va_list args;
    va_start(args, what_format);
    vsnprintf(what, sizeof what, what_format, args);
    va_end(args);
    print_error(parts, key, what);
}

bool model_check(struct model_parts *parts, bool ok, const char *what, const char *key_format,
                 ...) {
    if (!ok) {
        char key[MODEL_PATH_SIZE];
        va_list args;
        va_start(args, key_format);
        vsnprintf(key, sizeof key, key_format, args);
        va_end(args);
        print_error(parts, key, what);
    }
    return ok;
}

/* ---- replacing values ---- */

/* libyaml counts characters, a text has bytes; a byte-order mark is not counted. */
static size_t byte_offset(const char *text, size_t size, size_t characters) {
    size_t at = size >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0 ? 3 : 0;
    while (characters > 0 && at < size) {
        at++;
        while (at < size && ((unsigned char)text[at] & 0xc0u) == 0x80u) {
            at++;
        }
        characters--;
    }
    return at;
}

/* Replaces one value in parts->text; the outline is then stale. */
static int splice(struct model_parts *parts, const char *key, const char *value) {
    int32_t id = outline_find(&parts->outline, key, NULL);
    while (id != OUTLINE_NONE && parts->outline.nodes[id].kind == OUTLINE_ALIAS) {
        id = parts->outline.nodes[id].target;
    }
    if (id == OUTLINE_NONE) {
        fprintf(parts->errors, "%s: cannot set %s: no such key in the file\n", parts->path, key);
        return -1;
    }
    const struct outline_node *node = &parts->outline.nodes[id];
    if (!node->is_flow || value[0] == '\0' || strpbrk(value, "\r\n#&*") != NULL) {
        fprintf(parts->errors, "%s:%u: cannot set %s to '%s': only one plain value on one line\n",
                parts->path, (unsigned)node->line, key, value);
        return -1;
    }
    size_t start = byte_offset(parts->text, parts->size, node->start);
    size_t end = byte_offset(parts->text, parts->size, node->end);
    size_t length = strlen(value);
    char *text = malloc(parts->size - (end - start) + length + 1);
    char **paths = realloc(parts->set_paths, (parts->n_set + 1) * sizeof *paths);
    char path[MODEL_PATH_SIZE];
    outline_path(&parts->outline, id, path, sizeof path);
    char *kept = strdup(path);
    if (paths != NULL) {
        parts->set_paths = paths;
    }
    if (text == NULL || paths == NULL || kept == NULL) {
        free(text);
        free(kept);
        fprintf(parts->errors, "%s: out of memory\n", parts->path);
        return -1;
    }
    paths[parts->n_set++] = kept;
    memcpy(text, parts->text, start);
    memcpy(text + start, value, length);
    memcpy(text + start + length, parts->text + end, parts->size - end + 1);
    free(parts->text);
    parts->text = text;
    parts->size = parts->size - (end - start) + length;
    return 0;
}

struct model_parts *model_source_edit(const struct model_parts *from, const char *const *keys,
                                      const char *const *values, size_t n, FILE *errors) {
    struct model_parts *parts = calloc(1, sizeof *parts);
    if (parts == NULL || (parts->path = strdup(from->path)) == NULL ||
        (parts->text = malloc(from->size + 1)) == NULL ||
        (parts->set_paths = calloc(from->n_set + 1, sizeof *parts->set_paths)) == NULL) {
        fprintf(errors, "%s: out of memory\n", from->path);
        model_source_free(parts);
        return NULL;
    }
    memcpy(parts->text, from->text, from->size + 1);
    parts->size = from->size;
    parts->errors = errors;
    for (size_t i = 0; i < from->n_set; i++) {
        parts->set_paths[i] = strdup(from->set_paths[i]);
        parts->n_set += parts->set_paths[i] != NULL ? 1 : 0;
    }
    parts = outlined(parts);
    for (size_t i = 0; i < n && parts != NULL; i++) {
        if (splice(parts, keys[i], values[i]) != 0) {
            model_source_free(parts);
            return NULL;
        }
        outline_free(&parts->outline);
        parts = outlined(parts);
    }
    return parts;
}
