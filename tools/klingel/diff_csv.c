/* diff_csv.c - two CSV files, column by column. */
#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>

#include "diff_table.h"

struct csv {
    const char *path;
    FILE *file;
    uint64_t line;
    char *text;
    size_t room;
    size_t n; /* columns */
    char **name;
    double *value;
};

static int csv_open(struct csv *c, const char *path) {
    c->path = path;
    c->file = fopen(path, "r");
    return c->file != NULL ? CLI_OK : cli_fail("cannot open %s: %s", path, strerror(errno));
}

static void csv_close(struct csv *c) {
    if (c->file != NULL) {
        (void)fclose(c->file);
    }
    for (size_t i = 0; c->name != NULL && i < c->n; i++) {
        free(c->name[i]);
    }
    free(c->name);
    free(c->value);
    free(c->text);
}

/* The next line that is no comment, without its end; false: the end. */
static bool csv_line(struct csv *c) {
    ssize_t n = 0;
    do {
        n = getline(&c->text, &c->room, c->file);
        c->line++;
    } while (n > 0 && c->text[0] == '#');
    if (n > 0) {
        c->text[strcspn(c->text, "\r\n")] = '\0';
    }
    return n > 0;
}

static int csv_head(struct csv *c) {
    if (!csv_line(c) || c->text[0] == '\0') {
        return cli_fail("%s: no CSV file: a line with the names of the columns is missing",
                        c->path);
    }
    size_t most = 1;
    for (const char *at = c->text; *at != '\0'; at++) {
        most += *at == ',';
    }
    c->name = calloc(most, sizeof *c->name);
    c->value = calloc(most, sizeof *c->value);
    char *at = c->text;
    while (c->name != NULL && c->value != NULL && c->n < most) {
        size_t length = strcspn(at, ",");
        c->name[c->n] = strndup(at, length);
        if (c->name[c->n++] == NULL) {
            break;
        }
        at += length + (at[length] == ',');
    }
    return c->n == most && c->name[most - 1] != NULL ? CLI_OK : cli_fail("out of memory");
}

/* CLI_OK with `*more` false at the end. */
static int csv_values(struct csv *c, bool *more) {
    *more = csv_line(c);
    const char *at = c->text;
    for (size_t i = 0; *more && i < c->n; i++) {
        char *end = NULL;
        c->value[i] = strtod(at, &end);
        if (end == at || *end != (i + 1 < c->n ? ',' : '\0')) {
            return cli_fail("%s:%" PRIu64 ": column %s: '%.*s' is no number", c->path, c->line,
                            c->name[i], (int)strcspn(at, ","), at);
        }
        at = end + 1;
    }
    return CLI_OK;
}

static int compare_heads(const struct csv *a, const struct csv *b) {
    for (size_t i = 0; i < a->n && i < b->n; i++) {
        if (strcmp(a->name[i], b->name[i]) != 0) {
            return cli_fail("column %zu is %s in %s and %s in %s", i + 1, a->name[i], a->path,
                            b->name[i], b->path);
        }
    }
    return a->n == b->n ? CLI_OK
                        : cli_fail("%s has %zu columns, %s %zu", a->path, a->n, b->path, b->n);
}

static int compare(struct csv *a, struct csv *b, struct diff_table *t) {
    bool more_a = true;
    bool more_b = true;
    for (uint64_t row = 1;; row++) {
        int status = csv_values(a, &more_a);
        status = status == CLI_OK ? csv_values(b, &more_b) : status;
        if (status != CLI_OK) {
            return status;
        }
        if (!more_a || !more_b) {
            break;
        }
        diff_row(t, row, a->value, b->value);
    }
    diff_print(t, 0.0, stdout);
    if (more_a != more_b) {
        printf("%s ends after row %" PRIu64 ", %s goes on\n", more_a ? b->path : a->path, t->rows,
               more_a ? a->path : b->path);
    }
    if (!diff_any(t) && more_a == more_b) {
        printf("%s and %s: %" PRIu64 " rows of %zu columns, no difference\n", a->path, b->path,
               t->rows, a->n);
        return CLI_OK;
    }
    return CLI_FAILED;
}

int diff_csv(const char *path_a, const char *path_b, double absolute, double relative) {
    struct csv a = {0};
    struct csv b = {0};
    struct diff_table t = {.row = "row", .absolute = absolute, .relative = relative};
    int status = csv_open(&a, path_a);
    status = status == CLI_OK ? csv_open(&b, path_b) : status;
    status = status == CLI_OK ? csv_head(&a) : status;
    status = status == CLI_OK ? csv_head(&b) : status;
    status = status == CLI_OK ? compare_heads(&a, &b) : status;
    if (status == CLI_OK) {
        t.n = a.n;
        t.signals = calloc(a.n, sizeof *t.signals);
        for (size_t i = 0; t.signals != NULL && i < a.n; i++) {
            t.signals[i] = (struct diff_signal){.name = a.name[i], .unit = "", .scale = 1.0};
        }
        status = t.signals != NULL ? compare(&a, &b, &t) : cli_fail("out of memory");
    }
    free(t.signals);
    csv_close(&a);
    csv_close(&b);
    return status;
}
