/*
 * model_source.h - one YAML file of a model: its text, its outline, its messages, its memory.
 * Private to the loader (model_*.c).
 */
#ifndef MODEL_SOURCE_H
#define MODEL_SOURCE_H

#include <cyaml/cyaml.h>
#include <stdbool.h>
#include <stdio.h>

#include "yaml_outline.h"

#define MODEL_MAX_YAML_BYTES (256u * 1024u)
#define MODEL_MAX_TABLE_BYTES (64u * 1024u * 1024u)
#define MODEL_MAX_ERRORS 20 /* printed; the rest is only counted */
#define MODEL_PATH_SIZE 256 /* of a key path */

struct model_block {
    struct model_block *next;
};

/* A vehicle file that a train is made of, and where its parts begin in those of the train. */
struct model_child {
    struct model_parts *parts;
    uint32_t first_body;
    uint32_t first_wheelset;
    uint32_t first_element;
    uint32_t first_linkage;
};

#define MODEL_MAX_CHILD_PAIRS 4

struct model_parts {
    char *path;
    char *text;
    size_t size;
    struct outline outline;
    char **set_paths; /* values that model_file_set replaced */
    size_t n_set;
    struct model_block *blocks;
    struct creep_file *creep_table; /* NULL unless a law reads it */
    struct model_child *child;      /* of a train, in its order */
    uint32_t n_children;
    uint32_t own_element; /* the first element and linkage that are the train's own */
    uint32_t own_linkage;
    uint32_t pair_child[MODEL_MAX_CHILD_PAIRS]; /* where each pair of a train comes from */
    uint32_t pair_index[MODEL_MAX_CHILD_PAIRS];
    FILE *errors; /* during a call only */
    unsigned n_errors;
};

/* Reads a whole file into malloc'ed memory with a NUL behind it; NULL with a reason in `why`. */
char *model_read_whole(const char *path, size_t max_bytes, size_t *size, char *why,
                       size_t why_size);

/* Opens a file and outlines it. NULL: printed. */
struct model_parts *model_source_open(const char *path, FILE *errors);

/* A copy of `from` in which the values at the key paths are replaced. NULL: printed. */
struct model_parts *model_source_edit(const struct model_parts *from, const char *const *keys,
                                      const char *const *values, size_t n, FILE *errors);

void model_source_free(struct model_parts *parts);

/* Zeroed memory that lives as long as `parts`. NULL if there is none (said). */
void *model_take(struct model_parts *parts, size_t count, size_t size);

/* "<directory of the file>/<name>", or name if absolute; lives as long as parts. */
char *model_beside(struct model_parts *parts, const char *name);

/* Prints "file:line: key = value: what"; the key path is made from `key_format`. A key that is not
 * in the file gets the line of what should hold it. Counts. */
void model_error(struct model_parts *parts, const char *key, const char *what_format, ...)
    __attribute__((format(printf, 3, 4)));

/* The same where `ok` is false; returns ok. */
bool model_check(struct model_parts *parts, bool ok, const char *what, const char *key_format, ...)
    __attribute__((format(printf, 4, 5)));

/* Loads the text by a libcyaml schema whose top level is a pointer to a mapping; prints in the same
 * form what does not fit. NULL: printed. */
void *model_source_load(struct model_parts *parts, const cyaml_schema_value_t *schema);
void model_source_unload(const cyaml_schema_value_t *schema, void *data);

#endif
