/* model_yaml.c - loads a text by a libcyaml schema and says with line and key what does not fit. */
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "model_source.h"

/* ---- what libcyaml does not look at: unknown keys with their own line, garbage behind numbers
 * ---- */

/* Edits (insert, delete, replace) from a to b, at most `limit` + 1. */
static size_t edit_distance(const char *a, const char *b, size_t limit) {
    size_t row[64];
    size_t n = strlen(b);
    if (n >= sizeof row / sizeof row[0] || strlen(a) >= sizeof row / sizeof row[0]) {
        return limit + 1;
    }
    for (size_t j = 0; j <= n; j++) {
        row[j] = j;
    }
    for (size_t i = 1; a[i - 1] != '\0'; i++) {
        size_t diagonal = row[0];
        row[0] = i;
        for (size_t j = 1; j <= n; j++) {
            size_t best = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
            diagonal = row[j];
            best = best < row[j] + 1 ? best : row[j] + 1;
            row[j] = best < row[j - 1] + 1 ? best : row[j - 1] + 1;
        }
    }
    return row[n];
}

static void unknown_key(struct model_parts *parts, int32_t node,
                        const cyaml_schema_field_t *fields) {
    const char *key = parts->outline.nodes[node].key;
    size_t length = strlen(key);
    char path[MODEL_PATH_SIZE];
    outline_path(&parts->outline, node, path, sizeof path);
    const cyaml_schema_field_t *near = NULL;
    size_t least = length < 6 ? 2 : 3;
    for (const cyaml_schema_field_t *f = fields; f->key != NULL; f++) {
        if (strncmp(f->key, key, length) == 0 && f->key[length] == '_' && length > 0) {
            model_error(parts, path, "unknown key; the unit is missing: %s", f->key);
            return;
        }
        size_t distance = edit_distance(key, f->key, least);
        if (distance < least) {
            least = distance;
            near = f;
        }
    }
    if (near != NULL) {
        model_error(parts, path, "unknown key; did you mean %s?", near->key);
        return;
    }
    char known[400] = "";
    for (const cyaml_schema_field_t *f = fields; f->key != NULL; f++) {
        size_t used = strlen(known);
        snprintf(known + used, sizeof known - used, "%s%s", used > 0 ? ", " : "", f->key);
    }
    model_error(parts, path, "unknown key; known here: %s", known);
}

static bool is_number(const char *text, bool whole) {
    char *end;
    if (text[0] == '\0' || text[strspn(text, whole ? "0123456789+-" : "0123456789+-.eE")] != '\0') {
        return false;
    }
    return isfinite(strtod(text, &end)) && *end == '\0';
}

static void check_scalar(struct model_parts *parts, int32_t node,
                         const cyaml_schema_value_t *schema) {
    const char *text = parts->outline.nodes[node].text;
    bool whole = schema->type == CYAML_INT || schema->type == CYAML_UINT;
    bool fits = is_number(text != NULL ? text : "", whole) &&
                (schema->type != CYAML_UINT || strchr(text, '-') == NULL);
    if (text == NULL || (!whole && schema->type != CYAML_FLOAT) || fits) {
        return;
    }
    char path[MODEL_PATH_SIZE];
    outline_path(&parts->outline, node, path, sizeof path);
    model_error(parts, path, "must be a %s number%s", whole ? "whole" : "finite",
                schema->type == CYAML_UINT ? " >= 0" : "");
}

/* Depth is bounded by the schema's. */
static void check_node(struct model_parts *parts, int32_t node,
                       const cyaml_schema_value_t *schema) {
    const struct outline_node *nodes = parts->outline.nodes;
    bool sequence = schema->type == CYAML_SEQUENCE || schema->type == CYAML_SEQUENCE_FIXED;
    if (nodes[node].kind == OUTLINE_SCALAR) {
        check_scalar(parts, node, schema);
    } else if (nodes[node].kind == OUTLINE_SEQUENCE && sequence) {
        for (int32_t c = nodes[node].first_child; c != OUTLINE_NONE; c = nodes[c].next) {
            check_node(parts, c, schema->sequence.entry);
        }
    } else if (nodes[node].kind == OUTLINE_MAPPING && schema->type == CYAML_MAPPING) {
        for (int32_t c = nodes[node].first_child; c != OUTLINE_NONE; c = nodes[c].next) {
            const cyaml_schema_field_t *f = schema->mapping.fields;
            while (f->key != NULL && strcmp(f->key, nodes[c].key) != 0) {
                f++;
            }
            if (f->key == NULL) {
                unknown_key(parts, c, schema->mapping.fields);
            } else {
                check_node(parts, c, &f->value);
            }
        }
    }
}

/* ---- libcyaml's own messages, caught and put into our form ---- */

#define MAX_CRUMBS 12

/* One line of libcyaml's backtrace, innermost first. */
struct crumb {
    char key[64];   /* "" for a sequence entry */
    unsigned entry; /* entries begun, from 1 */
    unsigned line;
};

struct caught {
    char message[256];
    struct crumb crumb[MAX_CRUMBS];
    int n_crumbs;
};

static void catch_log(cyaml_log_t level, void *ctx, const char *format, va_list args) {
    struct caught *caught = ctx;
    char line[256];
    vsnprintf(line, sizeof line, format, args);
    line[strcspn(line, "\n")] = '\0';
    if (level != CYAML_LOG_ERROR || strcmp(line, "Load: Backtrace:") == 0) {
        return;
    }
    struct crumb crumb = {0};
    bool field =
        sscanf(line, "  in mapping field '%63[^']' (line: %u", crumb.key, &crumb.line) == 2;
    bool entry = sscanf(line, "  in sequence entry '%u' (line: %u", &crumb.entry, &crumb.line) == 2;
    bool other = strncmp(line, "  in mapping (", 14) == 0;
    if (field || entry || other) {
        if (caught->n_crumbs < MAX_CRUMBS) {
            caught->crumb[caught->n_crumbs++] = crumb;
        }
    } else if (caught->message[0] == '\0') {
        snprintf(caught->message, sizeof caught->message, "%s",
                 strncmp(line, "Load: ", 6) == 0 ? line + 6 : line);
    }
}

/* The key path of the crumbs from the outermost to number `innermost`. */
static void crumb_path(const struct caught *caught, int innermost, char *path, size_t size) {
    size_t used = 0;
    path[0] = '\0';
    for (int i = caught->n_crumbs - 1; i >= innermost && used < size; i--) {
        const struct crumb *c = &caught->crumb[i];
        int wrote = 0;
        if (c->key[0] != '\0') {
            wrote = snprintf(path + used, size - used, "%s%s", used > 0 ? "." : "", c->key);
        } else if (c->entry > 0) {
            wrote = snprintf(path + used, size - used, "[%u]", c->entry - 1);
        }
        used += wrote > 0 ? (size_t)wrote : 0;
    }
}

static const cyaml_schema_value_t *schema_of(const struct caught *caught, int innermost,
                                             const cyaml_schema_value_t *schema) {
    for (int i = caught->n_crumbs - 1; i >= innermost && schema != NULL; i--) {
        const struct crumb *c = &caught->crumb[i];
        if (c->key[0] != '\0' && schema->type == CYAML_MAPPING) {
            const cyaml_schema_field_t *f = schema->mapping.fields;
            while (f->key != NULL && strcmp(f->key, c->key) != 0) {
                f++;
            }
            schema = f->key != NULL ? &f->value : NULL;
        } else if (schema->type == CYAML_SEQUENCE || schema->type == CYAML_SEQUENCE_FIXED) {
            schema = schema->sequence.entry;
        }
    }
    return schema;
}

/* What a value of this schema may be, in words. */
static void allowed(const cyaml_schema_value_t *schema, char *what, size_t size) {
    static const char *const words[CYAML__TYPE_COUNT] = {[CYAML_INT] = "a whole number",
                                                         [CYAML_UINT] = "a whole number >= 0",
                                                         [CYAML_FLOAT] = "a number",
                                                         [CYAML_MAPPING] = "a mapping (key: value)",
                                                         [CYAML_STRING] = "a text"};
    if (schema->type == CYAML_ENUM || schema->type == CYAML_FLAGS) {
        snprintf(what, size, "must be %s", schema->type == CYAML_FLAGS ? "a list of" : "one of");
        for (uint32_t i = 0; i < schema->enumeration.count; i++) {
            size_t used = strlen(what);
            snprintf(what + used, size - used, "%s %s", i > 0 ? "," : "",
                     schema->enumeration.strings[i].str);
        }
    } else if (schema->type == CYAML_SEQUENCE || schema->type == CYAML_SEQUENCE_FIXED) {
        const char *plural = schema->sequence.max == 1 ? "entry" : "entries";
        if (schema->sequence.min == schema->sequence.max) {
            snprintf(what, size, "must be a list of %u %s", schema->sequence.min, plural);
        } else {
            snprintf(what, size, "must be a list of %u to %u %s", schema->sequence.min,
                     schema->sequence.max, plural);
        }
    } else if (schema->type == CYAML_STRING) {
        snprintf(what, size, "must be a text of %u to %u characters", schema->string.min,
                 schema->string.max);
    } else {
        snprintf(what, size, "must be %s",
                 words[schema->type] != NULL ? words[schema->type] : "something else");
    }
}

static bool begins(const char *text, const char *with) {
    return strncmp(text, with, strlen(with)) == 0;
}

static void print_caught(struct model_parts *parts, const struct caught *caught, cyaml_err_t status,
                         const cyaml_schema_value_t *schema) {
    static const char missing[] = "Missing required mapping field: ";
    const char *message = caught->message[0] != '\0' ? caught->message : cyaml_strerror(status);
    char path[MODEL_PATH_SIZE];
    char what[300];
    /* the innermost crumb of these is a key or entry within what is wrong */
    bool within = begins(message, missing) || begins(message, "Insufficient entries") ||
                  begins(message, "Excessive entries");
    int innermost = within ? 1 : 0;
    crumb_path(caught, innermost, path, sizeof path);
    const cyaml_schema_value_t *of = schema_of(caught, innermost, schema);
    bool value = within || begins(message, "Invalid") || begins(message, "Unknown flag") ||
                 begins(message, "Expecting") || begins(message, "STRING length");
    if (begins(message, missing)) {
        snprintf(what, sizeof what, "%s is missing", message + strlen(missing));
    } else if (value && of != NULL) {
        allowed(of, what, sizeof what);
    } else {
        snprintf(what, sizeof what, "%s", message);
    }
    model_error(parts, path, "%s", what);
}

static const cyaml_config_t quiet = {
    .mem_fn = cyaml_mem, .log_level = CYAML_LOG_ERROR, .flags = CYAML_CFG_DEFAULT};

void *model_source_load(struct model_parts *parts, const cyaml_schema_value_t *schema) {
    check_node(parts, 0, schema);
    if (parts->n_errors > 0) {
        return NULL;
    }
    struct caught caught = {0};
    cyaml_config_t config = quiet;
    config.log_fn = catch_log;
    config.log_ctx = &caught;
    cyaml_data_t *data = NULL;
    cyaml_err_t status =
        cyaml_load_data((const uint8_t *)parts->text, parts->size, &config, schema, &data, NULL);
    if (status != CYAML_OK || data == NULL) {
        print_caught(parts, &caught, status, schema);
        return NULL;
    }
    return data;
}

void model_source_unload(const cyaml_schema_value_t *schema, void *data) {
    cyaml_free(&quiet, schema, data, 0);
}
