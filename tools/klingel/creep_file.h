/* creep_file.h - a creep-force table from its CSV file (models/creep/contact.csv describes it). */
#ifndef CREEP_FILE_H
#define CREEP_FILE_H

#include <stdbool.h>
#include <stdio.h>

#include "kl_creep.h"

struct creep_file {
    struct kl_creep_table table; /* must not be moved while its arrays are used: they are here */
    void *memory;
};

/* Reads the file and builds the table; `compact` leaves out the nodes that the file's #COMPACT
 * lines name. 0, or -1 with "path:line: what is wrong" printed to `errors`. */
int creep_file_load(struct creep_file *file, const char *path, bool compact, FILE *errors);
void creep_file_free(struct creep_file *file);

/* Writes the table as C source that defines `const struct kl_creep_table NAME`. With `is_static` it
 * is seen in that source alone. Exact: the same bits. */
void emit_creep_table(FILE *file, const struct kl_creep_table *table, const char *name,
                      bool is_static);

#endif
