/*
 * yaml_outline.h - a YAML text as a tree that knows its lines: where each key stands and what it
 * says. libcyaml loads the data; this is for messages and for replacing single values.
 */
#ifndef YAML_OUTLINE_H
#define YAML_OUTLINE_H

#include <stddef.h>
#include <stdint.h>

#define OUTLINE_MAX_NODES 20000
#define OUTLINE_MAX_DEPTH 16
#define OUTLINE_NONE (-1)

enum outline_kind { OUTLINE_SCALAR = 0, OUTLINE_SEQUENCE, OUTLINE_MAPPING, OUTLINE_ALIAS };

struct outline_node {
    enum outline_kind kind;
    int32_t parent;
    int32_t first_child;
    int32_t last_child;
    int32_t next;   /* sibling */
    int32_t target; /* of an alias */
    uint32_t index; /* position among its siblings */
    uint32_t line;  /* of the key, or of the value in a sequence; from 1 */
    size_t start;   /* the value's bytes in the text; for a block collection `end` is not exact */
    size_t end;
    int is_flow;  /* scalar on one line, or [ ], { } */
    char *key;    /* NULL in a sequence and at the root */
    char *text;   /* of a scalar, else NULL */
    char *anchor; /* or NULL */
};

struct outline {
    struct outline_node *nodes; /* nodes[0] is the root, if there is any */
    int32_t n;
    int32_t capacity;
};

struct outline_error {
    uint32_t line;
    char what[200];
};

/* 0, or -1 with `error` filled: a syntax error, a duplicate key, a second document, or more than
 * the limits above. An empty text gives n = 0. Free in both cases. */
int outline_parse(struct outline *outline, const char *text, size_t size,
                  struct outline_error *error);
void outline_free(struct outline *outline);

/* The child of a mapping by key, or of a sequence by index; follows aliases. OUTLINE_NONE. */
int32_t outline_child(const struct outline *outline, int32_t node, const char *key, size_t length);
int32_t outline_entry(const struct outline *outline, int32_t node, uint32_t index);

/*
 * The node at a path such as "elements[2].k_N_m[1]". An entry of a sequence may also be named by
 * its `name`: "elements.restraint.k_N_m[1]". OUTLINE_NONE if there is none; `*nearest` (may be
 * NULL) is then its closest ancestor that exists, else the node itself.
 */
int32_t outline_find(const struct outline *outline, const char *path, int32_t *nearest);

/* Writes the path of a node, indices in brackets; "" for the root. Truncates to size. */
void outline_path(const struct outline *outline, int32_t node, char *path, size_t size);

#endif
