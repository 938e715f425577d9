/* csv.h - reads the reference files: `#` comments, one header line, rows. No quoting, no NaN. */
#ifndef CSV_H
#define CSV_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define CSV_MAX_FIELDS 32
#define CSV_LINE 4096

struct csv {
    FILE *file;
    const char *path;
    unsigned line_number;
    char header_line[CSV_LINE];
    char line[CSV_LINE];
    char *header[CSV_MAX_FIELDS];
    char *field[CSV_MAX_FIELDS];
    int n_header;
    int n_fields;
};

static inline int csv_split(char *line, char **field) {
    int n = 0;
    line[strcspn(line, "\r\n")] = '\0';
    for (char *at = line; at != NULL && n < CSV_MAX_FIELDS; n++) {
        field[n] = at;
        at = strchr(at, ',');
        if (at != NULL) {
            *at++ = '\0';
        }
    }
    return n;
}

/* The next line that is no comment; 0 at the end. */
static inline int csv_line(struct csv *csv, char *line) {
    while (fgets(line, CSV_LINE, csv->file) != NULL) {
        csv->line_number++;
        if (line[0] != '#') {
            return 1;
        }
    }
    return 0;
}

static inline void csv_open(struct csv *csv, const char *path) {
    csv->path = path;
    csv->line_number = 0;
    csv->file = fopen(path, "r");
    if (csv->file == NULL) {
        fail_msg("%s: cannot open (run from the root of the repository)", path);
    }
    if (!csv_line(csv, csv->header_line)) {
        fail_msg("%s: empty", path);
    }
    csv->n_header = csv_split(csv->header_line, csv->header);
}

static inline int csv_column(const struct csv *csv, const char *name) {
    for (int i = 0; i < csv->n_header; i++) {
        if (strcmp(csv->header[i], name) == 0) {
            return i;
        }
    }
    fail_msg("%s: no column %s", csv->path, name);
    return -1;
}

static inline int csv_next(struct csv *csv) {
    if (!csv_line(csv, csv->line)) {
        return 0;
    }
    csv->n_fields = csv_split(csv->line, csv->field);
    if (csv->n_fields != csv->n_header) {
        fail_msg("%s:%u: %d fields, header has %d", csv->path, csv->line_number, csv->n_fields,
                 csv->n_header);
    }
    return 1;
}

static inline double csv_number(const struct csv *csv, int column) {
    char *end = NULL;
    const double value = strtod(csv->field[column], &end);
    if (end == csv->field[column] || *end != '\0') {
        fail_msg("%s:%u: '%s' is no number", csv->path, csv->line_number, csv->field[column]);
    }
    return value;
}

static inline double csv_named(const struct csv *csv, const char *name) {
    return csv_number(csv, csv_column(csv, name));
}

static inline int csv_is(const struct csv *csv, const char *name, const char *text) {
    return strcmp(csv->field[csv_column(csv, name)], text) == 0;
}

static inline void csv_close(struct csv *csv) {
    assert_int_equal(fclose(csv->file), 0);
}

#endif
