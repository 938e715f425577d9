#include "model_table.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Where the reader stands. */
struct reader {
    struct model_parts *parts;
    const struct model_column *columns;
    uint32_t n_columns;
    struct model_table *table;
    unsigned line;
    int field_of[MODEL_TABLE_MAX_COLUMNS]; /* which column a field of the line fills */
    bool thousandth[MODEL_TABLE_MAX_COLUMNS];
    uint32_t n_fields; /* 0: the header is yet to come */
    char header[MODEL_TABLE_MAX_COLUMNS][32];
};

static int say(const struct reader *r, const char *what, const char *detail) {
    fprintf(r->parts->errors, "%s:%u: %s%.60s\n", r->table->path, r->line, what, detail);
    r->parts->n_errors++;
    return -1;
}

static char *trim(char *text) {
    text += strspn(text, " \t\r");
    size_t length = strlen(text);
    while (length > 0 && strchr(" \t\r", text[length - 1]) != NULL) {
        text[--length] = '\0';
    }
    return text;
}

/* The next field of a line; NULL at its end. */
static char *next_field(char **rest) {
    char *field = strsep(rest, ",");
    return field != NULL ? trim(field) : NULL;
}

static void list_known(const struct reader *r, char *text, size_t size) {
    size_t used = 0;
    text[0] = '\0';
    for (uint32_t i = 0; i < r->n_columns && used < size; i++) {
        const struct model_column *c = &r->columns[i];
        int wrote = snprintf(text + used, size - used, "%s%s_%s|%s_%s", i > 0 ? ", " : "", c->name,
                             c->unit, c->name, c->sub_unit);
        used += wrote > 0 ? (size_t)wrote : 0;
    }
}

static int take_column_name(struct reader *r, const char *field) {
    uint32_t f = r->n_fields;
    if (f == MODEL_TABLE_MAX_COLUMNS) {
        return say(r, "too many columns", "");
    }
    for (uint32_t i = 0; i < r->n_columns; i++) {
        char plain[32];
        char sub[32];
        snprintf(plain, sizeof plain, "%s_%s", r->columns[i].name, r->columns[i].unit);
        snprintf(sub, sizeof sub, "%s_%s", r->columns[i].name, r->columns[i].sub_unit);
        if (strcmp(field, plain) != 0 && strcmp(field, sub) != 0) {
            continue;
        }
        for (uint32_t before = 0; before < f; before++) {
            if (r->field_of[before] == (int)i) {
                return say(r, "this column stands twice: ", field);
            }
        }
        r->field_of[f] = (int)i;
        r->thousandth[f] = strcmp(field, sub) == 0;
        snprintf(r->header[f], sizeof r->header[f], "%s", field);
        r->n_fields++;
        return 0;
    }
    char known[256];
    char what[340];
    list_known(r, known, sizeof known);
    snprintf(what, sizeof what, "the first line must name columns of %s; not ", known);
    return say(r, what, field[0] != '\0' ? field : "''");
}

static int take_header(struct reader *r, char *text) {
    for (char *field = next_field(&text); field != NULL; field = next_field(&text)) {
        if (take_column_name(r, field) != 0) {
            return -1;
        }
    }
    for (uint32_t i = 0; i < r->n_columns; i++) {
        bool found = false;
        for (uint32_t f = 0; f < r->n_fields; f++) {
            found = found || r->field_of[f] == (int)i;
        }
        if (!found && r->columns[i].needed) {
            return say(r, "a column is missing: ", r->columns[i].name);
        }
    }
    return 0;
}

static int take_row(struct reader *r, char *text) {
    uint32_t row = r->table->n_rows;
    uint32_t f = 0;
    for (char *field = next_field(&text); field != NULL; field = next_field(&text), f++) {
        char *end;
        double value = strtod(field, &end);
        if (f >= r->n_fields) {
            return say(r, "more values than columns: ", field);
        }
        if (field[0] == '\0' || *end != '\0' || !isfinite(value)) {
            char what[80];
            snprintf(what, sizeof what, "%s must be a finite number, not ", r->header[f]);
            return say(r, what, field[0] != '\0' ? field : "''");
        }
        r->table->column[r->field_of[f]][row] = r->thousandth[f] ? value / 1000.0 : value;
    }
    if (f < r->n_fields) {
        return say(r, "fewer values than columns: no ", r->header[f]);
    }
    r->table->line[row] = r->line;
    r->table->n_rows++;
    return 0;
}

static int allocate(struct reader *r, size_t rows) {
    for (uint32_t f = 0; f < r->n_fields; f++) {
        r->table->column[r->field_of[f]] = model_take(r->parts, rows, sizeof(double));
        if (r->table->column[r->field_of[f]] == NULL) {
            return -1;
        }
    }
    r->table->line = model_take(r->parts, rows, sizeof *r->table->line);
    return r->table->line != NULL ? 0 : -1;
}

static int take_line(struct reader *r, char *text, size_t rows) {
    text[strcspn(text, "#")] = '\0';
    text = trim(text);
    if (text[0] == '\0') {
        return 0;
    }
    if (r->n_fields == 0) {
        return take_header(r, text) != 0 ? -1 : allocate(r, rows);
    }
    return take_row(r, text);
}

int model_table_read(struct model_parts *parts, const char *key, const char *name,
                     const struct model_column *columns, uint32_t n_columns,
                     struct model_table *table) {
    memset(table, 0, sizeof *table);
    table->path = model_beside(parts, name);
    if (table->path == NULL) {
        return -1;
    }
    char why[128];
    size_t size = 0;
    char *text = model_read_whole(table->path, MODEL_MAX_TABLE_BYTES, &size, why, sizeof why);
    if (text == NULL) {
        model_error(parts, key, "%s: %s", table->path, why);
        return -1;
    }
    size_t rows = 1;
    for (const char *p = text; (p = strchr(p, '\n')) != NULL; p++) {
        rows++;
    }
    struct reader r = {.parts = parts, .columns = columns, .n_columns = n_columns, .table = table};
    int status = 0;
    if (rows > MODEL_TABLE_MAX_ROWS) {
        model_error(parts, key, "%s: more than %u lines", table->path, MODEL_TABLE_MAX_ROWS);
        status = -1;
    }
    char *rest = text;
    while (status == 0 && rest != NULL) {
        r.line++;
        status = take_line(&r, strsep(&rest, "\n"), rows);
    }
    if (status == 0 && table->n_rows == 0) {
        status = say(&r, "the file holds no numbers", "");
    }
    free(text);
    return status;
}

void model_table_error(struct model_parts *parts, const struct model_table *table, uint32_t row,
                       const char *what) {
    fprintf(parts->errors, "%s:%u: %s\n", table->path, (unsigned)table->line[row], what);
    parts->n_errors++;
}
