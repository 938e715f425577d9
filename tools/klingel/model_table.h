/*
 * model_table.h - columns of numbers from a text file: '#' begins a comment, the first line names
 * the columns, each with its unit; commas between. Private to the loader.
 */
#ifndef MODEL_TABLE_H
#define MODEL_TABLE_H

#include <stdint.h>

#include "model_source.h"

#define MODEL_TABLE_MAX_COLUMNS 8
#define MODEL_TABLE_MAX_ROWS 1000000u

/* A quantity a file may hold, in one of two units: "lateral" as lateral_m or lateral_mm. */
struct model_column {
    const char *name;     /* "lateral" */
    const char *unit;     /* "m": taken as it is */
    const char *sub_unit; /* "mm": divided by 1000 */
    bool needed;
};

struct model_table {
    const char *path; /* lives as long as parts */
    uint32_t n_rows;
    double *column[MODEL_TABLE_MAX_COLUMNS]; /* as in the array of model_column; NULL: not there */
    uint32_t *line;                          /* of each row, in the file */
};

/* Reads the file named at `key` of the YAML (relative to it); memory is of `parts`. -1: printed. */
int model_table_read(struct model_parts *parts, const char *key, const char *name,
                     const struct model_column *columns, uint32_t n_columns,
                     struct model_table *table);

/* Prints "file:line: what" for a row, and counts. */
void model_table_error(struct model_parts *parts, const struct model_table *table, uint32_t row,
                       const char *what);

#endif
