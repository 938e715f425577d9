/* conicity_source.c - delta_r of a wheel-rail pair, and from a file. */
#include "conicity_source.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#define STEP_M 1e-4
#define BESIDE_M                                                                                   \
    2e-6 /* the contact is settled so far from a jump: twice what the jump is located to */

void conicity_source_free(struct conicity_source *source) {
    conicity_curve_free(&source->curve);
}

/* ---- of a pair ---- */

struct built {
    struct kl_pair_def def;
    const char *name;
    void *memory;
    size_t size;
    struct kl_pair pair;
};

static int pair_failed(const struct built *b, enum kl_status status, const struct kl_diag *diag) {
    return cli_fail("pair %s: %s: %s (%g)", b->name, kl_status_text(status),
                    diag->what != NULL ? diag->what : "", diag->value);
}

static int build(struct built *b) {
    struct kl_diag diag = {KL_OK, NULL, -1, 0.0};
    enum kl_status status = KL_ERR_MEMORY;
    for (b->size = (size_t)1 << 20; status == KL_ERR_MEMORY; b->size *= 2) {
        struct kl_arena arena;
        free(b->memory);
        b->memory = malloc(b->size);
        if (b->memory == NULL) {
            return cli_fail("out of memory (%zu bytes for a table)", b->size);
        }
        kl_arena_init(&arena, b->memory, b->size);
        status = kl_pair_build(&b->def, &arena, &b->pair, &diag);
    }
    return status == KL_OK ? CLI_OK : pair_failed(b, status, &diag);
}

static double difference(const struct kl_posture *p) {
    return (double)p->row[KL_RIGHT].radius_m - (double)p->row[KL_LEFT].radius_m;
}

static int jump_point(const struct built *b, double at_m, double beside_m,
                      struct conicity_point *point) {
    struct kl_diag diag = {KL_OK, NULL, -1, 0.0};
    struct kl_posture posture;
    struct kl_arena arena;
    void *memory = malloc(b->size);
    if (memory == NULL) {
        return cli_fail("out of memory");
    }
    kl_arena_init(&arena, memory, b->size);
    enum kl_status status = kl_pair_solve(&b->def, &arena, at_m + beside_m, &posture, &diag);
    free(memory);
    if (status != KL_OK) {
        return pair_failed(b, status, &diag);
    }
    *point = (struct conicity_point){at_m, difference(&posture)};
    return CLI_OK;
}

/* Where the contact of either side jumps, as u_y; returns how many. */
static size_t jumps_of(const struct kl_pair *pair, double at[KL_SIDES * KL_MAX_JUMPS]) {
    size_t n = 0;
    for (int s = 0; s < KL_SIDES; s++) {
        for (uint32_t i = 0; i < pair->side[s].n_jumps && i < KL_MAX_JUMPS; i++) {
            double w = pair->side[s].jumps[i].w_m;
            at[n++] = s == KL_RIGHT ? w : -w;
        }
    }
    return n;
}

static int by_place(const void *a, const void *b) {
    double x = ((const struct conicity_point *)a)->y_m;
    double y = ((const struct conicity_point *)b)->y_m;
    return (x > y) - (x < y);
}

/* Rows of the table and jumps, in order; a row right on a jump gives way to it, and of jumps at one
 * place (both sides at once) one stays. */
static size_t merge(const struct conicity_point *rows, size_t n_rows, struct conicity_point *jumps,
                    size_t n_jumps, struct conicity_point *all) {
    size_t n = 0;
    size_t j = 0;
    for (size_t i = 0; i <= n_rows; i++) {
        double end = i < n_rows ? rows[i].y_m : 1e9;
        for (; j < n_jumps && jumps[j].y_m <= end + BESIDE_M; j += 2) {
            if (n == 0 || jumps[j].y_m > all[n - 1].y_m + BESIDE_M) {
                all[n++] = jumps[j];
                all[n++] = jumps[j + 1];
            }
        }
        if (i < n_rows && (n == 0 || end > all[n - 1].y_m + BESIDE_M)) {
            all[n++] = rows[i];
        }
    }
    return n;
}

static int sample(const struct built *b, struct conicity_point *all, size_t *n) {
    const struct kl_pair *pair = &b->pair;
    const size_t n_rows = 2u * (size_t)pair->half + 1u;
    double at[KL_SIDES * KL_MAX_JUMPS];
    struct conicity_point jumps[2 * KL_SIDES * KL_MAX_JUMPS];
    const size_t n_jumps = jumps_of(pair, at);
    struct conicity_point *rows = all + n_rows + 2 * n_jumps; /* behind what they are merged into */
    for (size_t i = 0; i < n_rows; i++) {
        struct kl_posture posture;
        double y = ((double)i - (double)pair->half) * (double)pair->step_m;
        (void)kl_pair_posture(pair, y, &posture);
        rows[i] = (struct conicity_point){y, difference(&posture)};
    }
    for (size_t i = 0; i < n_jumps; i++) {
        int status = jump_point(b, at[i], -BESIDE_M, &jumps[2 * i]);
        status = status == CLI_OK ? jump_point(b, at[i], BESIDE_M, &jumps[2 * i + 1]) : status;
        if (status != CLI_OK) {
            return status;
        }
    }
    qsort(jumps, n_jumps, 2 * sizeof jumps[0], by_place);
    *n = merge(rows, n_rows, jumps, 2 * n_jumps, all);
    return CLI_OK;
}

int conicity_source_points(struct conicity_source *source, const struct conicity_point *points,
                           size_t n, const char *where) {
    double *values = malloc(2 * (n > 0 ? n : 1) * sizeof *values);
    if (values == NULL) {
        return cli_fail("out of memory");
    }
    for (size_t i = 0; i < n; i++) {
        values[i] = points[i].y_m;
        values[n + i] = points[i].delta_r_m;
    }
    long fault = conicity_curve_make(&source->curve, values, values + n, n);
    free(values);
    if (fault > (long)n) {
        return cli_fail("%s: delta_r needs %u to %u points, not %zu", where, CONICITY_MIN_POINTS,
                        CONICITY_MAX_POINTS, n);
    }
    return fault == 0 ? CLI_OK
                      : cli_fail("%s: delta_r: %s", where,
                                 fault < 0 ? "out of memory" : "y must rise from point to point");
}

/* With the wheelset's roll: rows and jumps of the table. */
static int sample_rolling(struct conicity_source *source, const struct built *b) {
    size_t most = 2 * (2u * (size_t)b->pair.half + 1u + 2u * KL_SIDES * KL_MAX_JUMPS);
    struct conicity_point *points = malloc(most * sizeof *points);
    size_t n = 0;
    int status = points != NULL ? sample(b, points, &n) : cli_fail("out of memory");
    status = status == CLI_OK ? conicity_source_points(source, points, n, b->name) : status;
    free(points);
    return status;
}

int conicity_source_pair(struct conicity_source *source, const struct kl_pair_def *def,
                         const char *name, bool roll) {
    struct built b = {.def = *def, .name = name};
    struct kl_posture central;
    memset(source, 0, sizeof *source);
    b.def.contacts = KL_CONTACTS_RIGID; /* the whole wheel, whichever part of it touches */
    const bool level = !roll && def->kind == KL_PAIR_PROFILES;
    if (level) {
        b.def.range_m = 8.0 * b.def.step_m; /* the central contact is all that is wanted of it */
    } else if (b.def.step_m > STEP_M && b.def.range_m / STEP_M <= KL_TABLE_MAX_HALF) {
        b.def.step_m = STEP_M;
    }
    int status = build(&b);
    if (status == CLI_OK) {
        source->base_m = (double)b.pair.base_m;
        source->radius_m = (double)b.pair.radius_m;
        (void)kl_pair_posture(&b.pair, 0.0, &central);
        status =
            level ? conicity_source_level(source, def, &central, name) : sample_rolling(source, &b);
    }
    free(b.memory);
    return status;
}

/* ---- of a file ---- */

struct reader {
    const char *path;
    unsigned line;
    struct conicity_point *points;
    size_t n;
    size_t room;
    double unit[2]; /* of y and delta_r */
};

static int say(const struct reader *r, const char *what, const char *detail) {
    return cli_fail("%s:%u: %s%.60s", r->path, r->line, what, detail);
}

/* A line that names the columns: true, and the units are set. */
static bool take_names(struct reader *r, const char *const field[2]) {
    static const char *const names[2] = {"y", "delta_r"};
    double unit[2];
    for (int i = 0; i < 2; i++) {
        size_t length = strlen(names[i]);
        const char *tail = field[i] + length;
        if (strncmp(field[i], names[i], length) != 0 ||
            (strcmp(tail, "_mm") != 0 && strcmp(tail, "_m") != 0)) {
            return false;
        }
        unit[i] = cli_unit(tail + 1);
    }
    memcpy(r->unit, unit, sizeof unit);
    return true;
}

static int keep(struct reader *r, struct conicity_point point) {
    if (r->n == CONICITY_MAX_POINTS) {
        return say(r, "more points than the table may have", "");
    }
    if (r->n == r->room) {
        size_t room = r->room > 0 ? 2 * r->room : 256;
        struct conicity_point *more = realloc(r->points, room * sizeof *more);
        if (more == NULL) {
            return cli_fail("out of memory");
        }
        r->points = more;
        r->room = room;
    }
    bool back = r->n > 0 && point.y_m < r->points[r->n - 1].y_m;
    if (back || (r->n > 1 && point.y_m == r->points[r->n - 2].y_m)) {
        return say(r, "y must rise from line to line (the same y twice is a jump)", "");
    }
    r->points[r->n++] = point;
    return CLI_OK;
}

static int take_line(struct reader *r, char *text) {
    static const char *const blank = " \t\r\n,;";
    text[strcspn(text, "#")] = '\0';
    char *rest = NULL;
    const char *field[2];
    field[0] = strtok_r(text, blank, &rest);
    if (field[0] == NULL) {
        return CLI_OK;
    }
    field[1] = strtok_r(NULL, blank, &rest);
    if (field[1] == NULL || strtok_r(NULL, blank, &rest) != NULL) {
        return say(r, "must be two numbers: y and delta_r", "");
    }
    if (r->n == 0 && take_names(r, field)) {
        return CLI_OK;
    }
    double value[2];
    for (int i = 0; i < 2; i++) {
        char why[160];
        if (!cli_quantity(field[i], "", &value[i], why, sizeof why)) {
            return say(r, i == 0 ? "y must be a number, not " : "delta_r must be a number, not ",
                       field[i]);
        }
        value[i] *= r->unit[i];
        if (!(fabs(value[i]) <= 1.0)) {
            return say(r, "must be within 1 m, not ", field[i]);
        }
    }
    return keep(r, (struct conicity_point){value[0], value[1]});
}

int conicity_source_table(struct conicity_source *source, const char *path) {
    struct reader r = {.path = path, .unit = {1e-3, 1e-3}};
    char *text = NULL;
    size_t size = 0;
    memset(source, 0, sizeof *source);
    FILE *file = fopen(path, "r");
    if (file == NULL) {
        return cli_fail("cannot read %s: %s", path, strerror(errno));
    }
    int status = CLI_OK;
    errno = 0;
    while (status == CLI_OK && getline(&text, &size, file) >= 0) {
        r.line++;
        status = take_line(&r, text);
    }
    if (status == CLI_OK && ferror(file) != 0) {
        status = cli_fail("cannot read %s: %s", path, strerror(errno));
    }
    status = status == CLI_OK ? conicity_source_points(source, r.points, r.n, path) : status;
    free(r.points);
    free(text);
    fclose(file);
    return status;
}
