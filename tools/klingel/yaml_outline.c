#include "yaml_outline.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <yaml.h>

/* What the event loop carries from one event to the next. */
struct outline_builder {
    struct outline *outline;
    struct outline_error *error;
    int32_t open[OUTLINE_MAX_DEPTH];
    int depth;
    char *key; /* of the value to come */
    uint32_t key_line;
    int documents;
};

static int fail(struct outline_builder *b, size_t line_from_0, const char *what,
                const char *detail) {
    b->error->line = (uint32_t)line_from_0 + 1;
    snprintf(b->error->what, sizeof b->error->what, "%s%s", what, detail);
    return -1;
}

static char *copy_text(const void *bytes, size_t length) {
    char *copy = malloc(length + 1);
    if (copy != NULL) {
        memcpy(copy, bytes, length);
        copy[length] = '\0';
    }
    return copy;
}

static struct outline_node *grow(struct outline *outline) {
    if (outline->n == outline->capacity) {
        int32_t capacity = outline->capacity == 0 ? 256 : 2 * outline->capacity;
        struct outline_node *nodes =
            realloc(outline->nodes, (size_t)capacity * sizeof *outline->nodes);
        if (nodes == NULL) {
            return NULL;
        }
        outline->nodes = nodes;
        outline->capacity = capacity;
    }
    struct outline_node *node = &outline->nodes[outline->n++];
    memset(node, 0, sizeof *node);
    node->parent = node->first_child = node->last_child = OUTLINE_NONE;
    node->next = node->target = OUTLINE_NONE;
    return node;
}

static void link_to_parent(struct outline *outline, int32_t id, int32_t parent) {
    struct outline_node *node = &outline->nodes[id];
    node->parent = parent;
    if (parent == OUTLINE_NONE) {
        return;
    }
    struct outline_node *up = &outline->nodes[parent];
    if (up->first_child == OUTLINE_NONE) {
        up->first_child = id;
    } else {
        outline->nodes[up->last_child].next = id;
        node->index = outline->nodes[up->last_child].index + 1;
    }
    up->last_child = id;
}

/* Adds a node for `event` under the innermost open collection; its id, or -1 with the error said.
 */
static int32_t add(struct outline_builder *b, const yaml_event_t *event, enum outline_kind kind) {
    size_t line = event->start_mark.line;
    if (b->outline->n >= OUTLINE_MAX_NODES) {
        return fail(b, line, "the file holds too many values", "");
    }
    struct outline_node *node = grow(b->outline);
    if (node == NULL) {
        return fail(b, line, "out of memory", "");
    }
    int32_t id = b->outline->n - 1;
    node->kind = kind;
    node->key = b->key;
    node->line = b->key != NULL ? b->key_line : (uint32_t)line + 1;
    node->start = event->start_mark.index;
    node->end = event->end_mark.index;
    node->is_flow = event->start_mark.line == event->end_mark.line;
    b->key = NULL;
    link_to_parent(b->outline, id, b->depth > 0 ? b->open[b->depth - 1] : OUTLINE_NONE);
    return id;
}

static int open_collection(struct outline_builder *b, const yaml_event_t *event,
                           enum outline_kind kind, const yaml_char_t *anchor) {
    if (b->depth == OUTLINE_MAX_DEPTH) {
        return fail(b, event->start_mark.line, "nested too deeply", "");
    }
    int32_t id = add(b, event, kind);
    if (id < 0) {
        return -1;
    }
    if (anchor != NULL) {
        b->outline->nodes[id].anchor = copy_text(anchor, strlen((const char *)anchor));
    }
    b->open[b->depth++] = id;
    return 0;
}

static void close_collection(struct outline_builder *b, const yaml_event_t *event) {
    struct outline_node *node = &b->outline->nodes[b->open[--b->depth]];
    /* the end event of a flow collection is its bracket; that of a block collection is empty */
    node->is_flow = event->end_mark.index == event->start_mark.index + 1 &&
                    event->start_mark.line + 1 == node->line;
    node->end = event->end_mark.index;
}

static int take_key(struct outline_builder *b, const yaml_event_t *event) {
    const char *name = (const char *)event->data.scalar.value;
    int32_t mapping = b->open[b->depth - 1];
    int32_t twin = outline_child(b->outline, mapping, name, strlen(name));
    if (twin != OUTLINE_NONE) {
        char where[64];
        snprintf(where, sizeof where, ": key stands twice, first in line %u",
                 (unsigned)b->outline->nodes[twin].line);
        char path[128];
        outline_path(b->outline, twin, path, sizeof path);
        return fail(b, event->start_mark.line, path, where);
    }
    b->key = copy_text(name, strlen(name));
    b->key_line = (uint32_t)event->start_mark.line + 1;
    return b->key != NULL ? 0 : fail(b, event->start_mark.line, "out of memory", "");
}

static int is_key(const struct outline_builder *b) {
    return b->depth > 0 && b->key == NULL &&
           b->outline->nodes[b->open[b->depth - 1]].kind == OUTLINE_MAPPING;
}

static int take_scalar(struct outline_builder *b, const yaml_event_t *event) {
    const char *value = (const char *)event->data.scalar.value;
    if (strlen(value) != event->data.scalar.length) {
        return fail(b, event->start_mark.line, "a value holds a NUL byte", "");
    }
    if (is_key(b)) {
        return take_key(b, event);
    }
    int32_t id = add(b, event, OUTLINE_SCALAR);
    if (id < 0) {
        return -1;
    }
    struct outline_node *node = &b->outline->nodes[id];
    node->text = copy_text(value, event->data.scalar.length);
    if (node->text == NULL) {
        return fail(b, event->start_mark.line, "out of memory", "");
    }
    if (event->data.scalar.anchor != NULL) {
        const char *anchor = (const char *)event->data.scalar.anchor;
        node->anchor = copy_text(anchor, strlen(anchor));
    }
    return 0;
}

static int take_alias(struct outline_builder *b, const yaml_event_t *event) {
    const char *anchor = (const char *)event->data.alias.anchor;
    int32_t target = b->outline->n - 1;
    /* the latest anchor of that name wins */
    while (target >= 0 && (b->outline->nodes[target].anchor == NULL ||
                           strcmp(b->outline->nodes[target].anchor, anchor) != 0)) {
        target--;
    }
    if (target < 0) {
        return fail(b, event->start_mark.line, "no anchor for alias *", anchor);
    }
    for (int i = 0; i < b->depth; i++) {
        if (b->open[i] == target) {
            return fail(b, event->start_mark.line, "an anchor contains its own alias *", anchor);
        }
    }
    int32_t id = add(b, event, OUTLINE_ALIAS);
    if (id < 0) {
        return -1;
    }
    b->outline->nodes[id].target = target;
    return 0;
}

static int take_event(struct outline_builder *b, const yaml_event_t *event) {
    if (is_key(b) && event->type != YAML_SCALAR_EVENT && event->type != YAML_MAPPING_END_EVENT) {
        return fail(b, event->start_mark.line, "a key must be a plain word", "");
    }
    switch (event->type) {
    case YAML_DOCUMENT_START_EVENT:
        if (b->documents++ > 0) {
            return fail(b, event->start_mark.line, "a second document (---) in one file", "");
        }
        return 0;
    case YAML_SCALAR_EVENT:
        return take_scalar(b, event);
    case YAML_ALIAS_EVENT:
        return take_alias(b, event);
    case YAML_SEQUENCE_START_EVENT:
        return open_collection(b, event, OUTLINE_SEQUENCE, event->data.sequence_start.anchor);
    case YAML_MAPPING_START_EVENT:
        return open_collection(b, event, OUTLINE_MAPPING, event->data.mapping_start.anchor);
    case YAML_SEQUENCE_END_EVENT:
    case YAML_MAPPING_END_EVENT:
        close_collection(b, event);
        return 0;
    default:
        return 0;
    }
}

int outline_parse(struct outline *outline, const char *text, size_t size,
                  struct outline_error *error) {
    struct outline_builder b = {.outline = outline, .error = error};
    memset(outline, 0, sizeof *outline);
    memset(error, 0, sizeof *error);
    yaml_parser_t parser;
    if (!yaml_parser_initialize(&parser)) {
        return fail(&b, 0, "out of memory", "");
    }
    yaml_parser_set_input_string(&parser, (const unsigned char *)text, size);
    int status = 0;
    for (int done = 0; !done && status == 0;) {
        yaml_event_t event;
        if (!yaml_parser_parse(&parser, &event)) {
            const char *problem = parser.problem != NULL ? parser.problem : "not a YAML text";
            status = fail(&b, parser.problem_mark.line, "not valid YAML: ", problem);
            break;
        }
        done = event.type == YAML_STREAM_END_EVENT;
        status = take_event(&b, &event);
        yaml_event_delete(&event);
    }
    free(b.key);
    yaml_parser_delete(&parser);
    return status;
}

void outline_free(struct outline *outline) {
    for (int32_t i = 0; i < outline->n; i++) {
        free(outline->nodes[i].key);
        free(outline->nodes[i].text);
        free(outline->nodes[i].anchor);
    }
    free(outline->nodes);
    memset(outline, 0, sizeof *outline);
}

static int32_t resolve(const struct outline *outline, int32_t node) {
    if (node >= 0 && node < outline->n && outline->nodes[node].kind == OUTLINE_ALIAS) {
        return outline->nodes[node].target; /* never an alias itself: those carry no anchor */
    }
    return node < outline->n ? node : OUTLINE_NONE;
}

int32_t outline_child(const struct outline *outline, int32_t node, const char *key, size_t length) {
    int32_t id = resolve(outline, node);
    if (id == OUTLINE_NONE || outline->nodes[id].kind != OUTLINE_MAPPING) {
        return OUTLINE_NONE;
    }
    for (id = outline->nodes[id].first_child; id != OUTLINE_NONE; id = outline->nodes[id].next) {
        if (strncmp(outline->nodes[id].key, key, length) == 0 &&
            outline->nodes[id].key[length] == '\0') {
            break;
        }
    }
    return id;
}

int32_t outline_entry(const struct outline *outline, int32_t node, uint32_t index) {
    int32_t id = resolve(outline, node);
    if (id == OUTLINE_NONE || outline->nodes[id].kind != OUTLINE_SEQUENCE) {
        return OUTLINE_NONE;
    }
    id = outline->nodes[id].first_child;
    while (id != OUTLINE_NONE && outline->nodes[id].index != index) {
        id = outline->nodes[id].next;
    }
    return id;
}

static int32_t entry_named(const struct outline *outline, int32_t node, const char *name,
                           size_t length) {
    int32_t id = resolve(outline, node);
    if (id == OUTLINE_NONE || outline->nodes[id].kind != OUTLINE_SEQUENCE) {
        return OUTLINE_NONE;
    }
    for (id = outline->nodes[id].first_child; id != OUTLINE_NONE; id = outline->nodes[id].next) {
        int32_t named = resolve(outline, outline_child(outline, id, "name", 4));
        const char *text = named != OUTLINE_NONE ? outline->nodes[named].text : NULL;
        if (text != NULL && strncmp(text, name, length) == 0 && text[length] == '\0') {
            break;
        }
    }
    return id;
}

/* One step down a path: "[3]", ".name" or "name". */
static int32_t step_down(const struct outline *outline, int32_t node, const char **path) {
    const char *p = *path;
    if (*p == '[') {
        char *end;
        unsigned long index = strtoul(p + 1, &end, 10);
        if (end == p + 1 || *end != ']' || index > UINT32_MAX) {
            return OUTLINE_NONE;
        }
        *path = end + 1;
        return outline_entry(outline, node, (uint32_t)index);
    }
    p += *p == '.' ? 1 : 0;
    size_t length = strcspn(p, ".[");
    *path = p + length;
    if (length == 0) {
        return OUTLINE_NONE;
    }
    int32_t child = outline_child(outline, node, p, length);
    return child != OUTLINE_NONE ? child : entry_named(outline, node, p, length);
}

int32_t outline_find(const struct outline *outline, const char *path, int32_t *nearest) {
    int32_t node = outline->n > 0 ? 0 : OUTLINE_NONE;
    int32_t last = node;
    while (node != OUTLINE_NONE && *path != '\0') {
        last = node;
        node = step_down(outline, node, &path);
    }
    if (nearest != NULL) {
        *nearest = node != OUTLINE_NONE ? node : last;
    }
    return node;
}

void outline_path(const struct outline *outline, int32_t node, char *path, size_t size) {
    int32_t chain[OUTLINE_MAX_DEPTH + 1];
    int n = 0;
    for (; node > 0 && n <= OUTLINE_MAX_DEPTH; node = outline->nodes[node].parent) {
        chain[n++] = node;
    }
    size_t used = 0;
    path[0] = '\0';
    while (n-- > 0 && used < size) {
        const struct outline_node *at = &outline->nodes[chain[n]];
        int wrote = at->key != NULL
                        ? snprintf(path + used, size - used, "%s%s", used > 0 ? "." : "", at->key)
                        : snprintf(path + used, size - used, "[%u]", at->index);
        used += wrote > 0 ? (size_t)wrote : 0;
    }
}
