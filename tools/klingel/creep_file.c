/* creep_file.c - reads a creep-force table. */
#include "creep_file.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MAX_NODES 64
#define COLUMNS 7
static const char header[] = "a_over_b,P,R,theta_deg,fx,fy,mz";

enum { RATIO, SPIN, CREEP, ANGLE, AXES };

struct axis {
    double node[MAX_NODES];
    bool left_out[MAX_NODES]; /* of the compact table */
    uint32_t n;
    double without[MAX_NODES]; /* as named by #COMPACT */
    uint32_t n_without;
};

struct reader {
    const char *path;
    FILE *errors;
    unsigned line;
    bool compact;
    struct axis axis[AXES];
    double c_ij[MAX_NODES][4]; /* a/b, C11, C22, C23 */
    uint32_t n_c_ij;
    double alpha;
    double beta;
    double gamma;
    float (*force)[3]; /* all rows, as they come */
    size_t n_rows;
    size_t room;
};

static int say(const struct reader *r, const char *what) {
    fprintf(r->errors, "%s:%u: %s\n", r->path, r->line, what);
    return -1;
}

/* Up to `most` numbers parted by commas or blanks; how many, -1 if something else is there. */
static int numbers(char *text, double *values, int most) {
    int n = 0;
    for (char *at = text + strspn(text, ", \t"); *at != '\0'; at += strspn(at, ", \t")) {
        char *end = NULL;
        if (n == most) {
            return -1;
        }
        values[n] = strtod(at, &end);
        if (end == at || isnan(values[n++])) {
            return -1;
        }
        at = end;
    }
    return n;
}

/* ---- what the comments say ---- */

static int parameter(struct reader *r, char *text) {
    char name[16] = "";
    int used = 0;
    double value = 0.0;
    if (sscanf(text, "%15s %n", name, &used) != 1 || numbers(text + used, &value, 1) != 1) {
        return say(r, "#PARAM needs a name and a number");
    }
    double *place = strcmp(name, "alpha") == 0   ? &r->alpha
                    : strcmp(name, "beta") == 0  ? &r->beta
                    : strcmp(name, "gamma") == 0 ? &r->gamma
                                                 : NULL;
    if (place == NULL) {
        return say(r, "#PARAM must be alpha, beta or gamma");
    }
    *place = value;
    return 0;
}

static int compact(struct reader *r, char *text) {
    const size_t blank = strspn(text, " \t");
    const char which = text[blank];
    if (which != 'P' && which != 'R') {
        return say(r, "#COMPACT must name P or R");
    }
    struct axis *axis = &r->axis[which == 'P' ? SPIN : CREEP];
    const int n = numbers(text + blank + 1, axis->without, MAX_NODES);
    if (n < 0) {
        return say(r, "#COMPACT needs numbers");
    }
    axis->n_without = (uint32_t)n;
    return 0;
}

static int comment(struct reader *r, char *text) {
    if (strncmp(text, "#PARAM", 6) == 0) {
        return parameter(r, text + 6);
    }
    if (strncmp(text, "#COMPACT", 8) == 0) {
        return compact(r, text + 8);
    }
    if (strncmp(text, "#CIJ", 4) == 0) {
        if (r->n_c_ij == MAX_NODES || numbers(text + 4, r->c_ij[r->n_c_ij++], 4) != 4) {
            return say(r, "#CIJ needs a/b, C11, C22, C23");
        }
    }
    return 0;
}

/* ---- rows ---- */

/* A node that rises above the last one is new; the rows are in order, so all others are known. */
static int learn_node(struct reader *r, int which, double value) {
    struct axis *axis = &r->axis[which];
    if (axis->n > 0 && value <= axis->node[axis->n - 1]) {
        return 0;
    }
    if (axis->n == MAX_NODES) {
        return say(r, "too many nodes");
    }
    axis->node[axis->n++] = value;
    return 0;
}

static int row(struct reader *r, char *text) {
    double v[COLUMNS];
    if (numbers(text, v, COLUMNS) != COLUMNS) {
        return say(r, "a row has seven numbers");
    }
    for (int i = 0; i < AXES; i++) {
        if (learn_node(r, i, v[i]) != 0) {
            return -1;
        }
    }
    if (r->n_rows == r->room) {
        r->room = r->room == 0 ? 65536 : 2 * r->room;
        void *more = realloc(r->force, r->room * sizeof *r->force);
        if (more == NULL) {
            return say(r, "out of memory");
        }
        r->force = more;
    }
    for (int i = 0; i < 3; i++) {
        r->force[r->n_rows][i] = (float)v[AXES + i];
    }
    r->n_rows++;
    return 0;
}

static int read_lines(struct reader *r, FILE *file) {
    char text[512];
    bool seen_header = false;
    int status = 0;
    while (status == 0 && fgets(text, sizeof text, file) != NULL) {
        r->line++;
        text[strcspn(text, "\r\n")] = '\0';
        if (text[0] == '#') {
            status = comment(r, text);
        } else if (!seen_header) {
            seen_header = strcmp(text, header) == 0;
            status =
                seen_header ? 0 : say(r, "the columns must be a_over_b,P,R,theta_deg,fx,fy,mz");
        } else if (text[0] != '\0') {
            status = row(r, text);
        }
    }
    return status;
}

/* ---- the table ---- */

static int check_grid(const struct reader *r) {
    const struct axis *a = r->axis;
    const size_t wanted = (size_t)a[RATIO].n * a[SPIN].n * a[CREEP].n * a[ANGLE].n;
    if (r->n_rows == 0 || r->n_rows != wanted) {
        return say(r, "the rows must be a full grid of a/b, P, R and theta, the last fastest");
    }
    if (r->n_c_ij != a[RATIO].n) {
        return say(r, "needs one #CIJ line for each a/b");
    }
    for (uint32_t i = 0; i < r->n_c_ij; i++) {
        if (r->c_ij[i][0] != a[RATIO].node[i]) {
            return say(r, "the #CIJ lines must be for the same a/b as the rows");
        }
    }
    for (uint32_t i = 0; i < a[ANGLE].n; i++) {
        const double even = -90.0 + 180.0 * i / (a[ANGLE].n - 1);
        if (fabs(a[ANGLE].node[i] - even) > 1e-9) {
            return say(r, "theta must go from -90 to 90 degrees in even steps");
        }
    }
    return 0;
}

static void leave_out(struct axis *axis) {
    for (uint32_t i = 0; i < axis->n; i++) {
        for (uint32_t k = 0; k < axis->n_without; k++) {
            axis->left_out[i] = axis->left_out[i] || axis->node[i] == axis->without[k];
        }
    }
}

/* Moves the rows that stay to the front, and the nodes. */
static void make_compact(struct reader *r) {
    struct axis *a = r->axis;
    size_t to = 0;
    leave_out(&a[SPIN]);
    leave_out(&a[CREEP]);
    for (size_t from = 0; from < r->n_rows; from++) {
        const size_t k = from / a[ANGLE].n % a[CREEP].n;
        const size_t j = from / a[ANGLE].n / a[CREEP].n % a[SPIN].n;
        if (!a[SPIN].left_out[j] && !a[CREEP].left_out[k]) {
            memmove(r->force[to++], r->force[from], sizeof *r->force);
        }
    }
    for (int i = 0; i < AXES; i++) {
        uint32_t n = 0;
        for (uint32_t k = 0; k < a[i].n; k++) {
            if (!a[i].left_out[k]) {
                a[i].node[n++] = a[i].node[k];
            }
        }
        a[i].n = n;
    }
}

static int build(struct reader *r, struct creep_file *file) {
    double c_ij[MAX_NODES][3];
    for (uint32_t i = 0; i < r->n_c_ij; i++) {
        memcpy(c_ij[i], &r->c_ij[i][1], sizeof c_ij[i]);
    }
    const struct axis *a = r->axis;
    const struct kl_creep_table_def def = {.n_ratio = a[RATIO].n,
                                           .n_spin = a[SPIN].n,
                                           .n_creep = a[CREEP].n,
                                           .n_angle = a[ANGLE].n,
                                           .ratio = a[RATIO].node,
                                           .c_ij = (const double(*)[3])c_ij,
                                           .spin = a[SPIN].node,
                                           .creep = a[CREEP].node,
                                           .alpha = r->alpha,
                                           .beta = r->beta,
                                           .gamma = r->gamma,
                                           .force = (const float(*)[3])r->force};
    const size_t size = r->n_rows * 2 * sizeof *r->force + 65536;
    struct kl_arena arena;
    struct kl_diag diag = {KL_OK, NULL, -1, 0.0};
    file->memory = malloc(size);
    if (file->memory == NULL) {
        return say(r, "out of memory");
    }
    kl_arena_init(&arena, file->memory, size);
    if (kl_creep_table_build(&def, &arena, &file->table, &diag) == KL_OK) {
        return 0;
    }
    free(file->memory);
    file->memory = NULL;
    return say(r, diag.what != NULL ? diag.what : "not a creep table");
}

int creep_file_load(struct creep_file *file, const char *path, bool compact_one, FILE *errors) {
    struct reader *r = calloc(1, sizeof *r);
    FILE *stream = fopen(path, "r");
    int status = -1;
    memset(file, 0, sizeof *file);
    if (r == NULL || stream == NULL) {
        fprintf(errors, "%s: %s\n", path, strerror(errno));
    } else {
        r->path = path;
        r->errors = errors;
        status = read_lines(r, stream);
        status = status == 0 && ferror(stream) != 0 ? say(r, "cannot be read") : status;
        status = status == 0 ? check_grid(r) : status;
        if (status == 0 && compact_one) {
            make_compact(r);
        }
        status = status == 0 ? build(r, file) : status;
    }
    if (stream != NULL) {
        fclose(stream);
    }
    if (r != NULL) {
        free(r->force);
    }
    free(r);
    return status;
}

void creep_file_free(struct creep_file *file) {
    free(file->memory);
    memset(file, 0, sizeof *file);
}
