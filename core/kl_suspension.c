/* kl_suspension.c - springs and dampers to sparse matrices. */
#include "kl_suspension.h"

#include "kl_diag.h"
#include "kl_math.h"
#include "kl_reach.h"

/* entries smaller than this part of what was added up are rounding, and are dropped: symmetry stays
 * exact */
#define ROUNDING 1e-14

/* value (sum of a's factors q) (sum of b's factors q) of potential energy, b = a for a spring. */
static void add_product(double *matrix, double *size, uint32_t n, const struct kl_reach *a,
                        const struct kl_reach *b, double value) {
    for (uint32_t i = 0; i < a->n; i++) {
        for (uint32_t j = 0; j < b->n; j++) {
            const size_t at = (size_t)a->coordinate[i] * n + b->coordinate[j];
            const double part = value * (a->factor[i] * b->factor[j]);
            matrix[at] += part;
            size[at] += kl_abs(part);
        }
    }
}

static void add_spring(const struct kl_dense *m, const struct kl_reach *reach, double k, double c) {
    add_product(m->k, m->k_size, m->n, reach, reach, k);
    add_product(m->c, m->c_size, m->n, reach, reach, c);
}

/* V = value a b: both halves of the symmetric matrix. */
static void add_coupling(const struct kl_dense *m, const struct kl_reach *a,
                         const struct kl_reach *b, double value) {
    add_product(m->k, m->k_size, m->n, a, b, value);
    add_product(m->k, m->k_size, m->n, b, a, value);
}

/*
 * The load P of a spring at rest, up on end a and down on b, when bodies move. A body that leans by
 * phi turns a point rz below its centre aside by -rz phi: V = -P rz phi^2/2 at a, + at b. Between
 * the ends, with s = y_a - y_b there:
 *   clamped  V = -P s (phi_a + phi_b)/2: half of the couple P s to either end, and P times the mean
 *            angle aside; s is measured at half the height
 *   pinned   V = -P s^2/(2 h): the line of the load leans by s/h
 * Both leave the energy alone where everything turns as one rigid body, as they must. Fore and aft
 * the same with pitch, which turns the other way, where both ends can pitch.
 */
static void add_sway(const struct kl_assembly *as, const struct kl_element_def *e, double load_N,
                     const struct kl_dense *m) {
    static const enum kl_along aside[2] = {KL_ALONG_Y, KL_ALONG_X};
    static const enum kl_along lean[2] = {KL_ALONG_ROLL, KL_ALONG_PITCH};
    const int both_pitch = !kl_is_wheelset(e->end_a) && !kl_is_wheelset(e->end_b);
    const double height = e->point_b_m[2] - e->point_a_m[2];
    for (int i = 0; i < (both_pitch ? 2 : 1); i++) {
        const double sense = i == 0 ? 1.0 : -1.0;
        struct kl_reach shift;
        struct kl_reach angle_a = {.n = 0};
        struct kl_reach angle_b = {.n = 0};
        kl_reach_element(as, e, aside[i], &shift);
        kl_reach_point(as, e->end_a, e->point_a_m, (int)lean[i], 1, 1.0, &angle_a);
        kl_reach_point(as, e->end_b, e->point_b_m, (int)lean[i], 1, 1.0, &angle_b);
        add_spring(m, &angle_a, -load_N * kl_reach_below(as, e->end_a, e->point_a_m), 0.0);
        add_spring(m, &angle_b, load_N * kl_reach_below(as, e->end_b, e->point_b_m), 0.0);
        if (e->sway == KL_SWAY_CLAMPED) {
            add_coupling(m, &shift, &angle_a, -0.5 * sense * load_N);
            add_coupling(m, &shift, &angle_b, -0.5 * sense * load_N);
        } else {
            add_spring(m, &shift, -load_N / height, 0.0);
        }
    }
}

static void assemble(const struct kl_assembly *as, const struct kl_dense *m) {
    const struct kl_vehicle_def *def = as->def;
    struct kl_reach reach;
    for (uint32_t i = 0; i < def->n_elements; i++) {
        const struct kl_element_def *e = &def->elements[i];
        for (int direction = 0; direction < 6; direction++) {
            kl_reach_element(as, e, (enum kl_along)direction, &reach);
            add_spring(m, &reach, e->k[direction], e->c[direction]);
        }
        if (e->line_k_N_m > 0.0 || e->line_c_Ns_m > 0.0) {
            kl_reach_element(as, e, KL_ALONG_LINE, &reach);
            add_spring(m, &reach, e->line_k_N_m, e->line_c_Ns_m);
        }
        if (as->load_N != NULL && e->sway != KL_SWAY_NONE) {
            add_sway(as, e, as->load_N[i], m);
        }
    }
    for (uint32_t i = 0; i < def->n_linkages; i++) {
        double k;
        double c;
        kl_linkage_rates(def, i, &k, &c);
        kl_reach_linkage(def, &def->linkages[i], &reach);
        add_spring(m, &reach, k, c);
    }
    for (size_t i = 0; i < (size_t)m->n * m->n; i++) {
        m->k[i] = kl_abs(m->k[i]) > ROUNDING * m->k_size[i] ? m->k[i] : 0.0;
        m->c[i] = kl_abs(m->c[i]) > ROUNDING * m->c_size[i] ? m->c[i] : 0.0;
    }
}

/* Rows that move and columns that can be non-zero: absent vertical and pitch freedoms are always
 * zero. */
static int is_used(const struct kl_vehicle_def *def, uint32_t coordinate, int as_row) {
    if (coordinate >= kl_wheelset_coordinate(def->n_bodies, 0) || kl_is_free(def, coordinate)) {
        return 1;
    }
    const uint32_t freedom = coordinate % KL_FREEDOMS;
    return !as_row && freedom != (uint32_t)KL_Z && freedom != (uint32_t)KL_PITCH;
}

static int keep_entry(const struct kl_vehicle_def *def, const struct kl_dense *m, uint32_t i,
                      uint32_t j) {
    const size_t at = (size_t)i * m->n + j;
    return (m->k[at] != 0.0 || m->c[at] != 0.0) && is_used(def, i, 1) && is_used(def, j, 0);
}

static uint32_t count_entries(const struct kl_vehicle_def *def, const struct kl_dense *m) {
    uint32_t entries = 0;
    for (uint32_t i = 0; i < m->n; i++) {
        for (uint32_t j = 0; j < m->n; j++) {
            entries += keep_entry(def, m, i, j) ? 1u : 0u;
        }
    }
    return entries;
}

struct rows {
    uint16_t *row_start;
    uint16_t *column;
    struct kl_spring *spring;
};

static void store_sparse(const struct kl_vehicle_def *def, const struct kl_dense *m,
                         const struct rows *rows) {
    uint16_t next = 0;
    for (uint32_t i = 0; i < m->n; i++) {
        rows->row_start[i] = next;
        for (uint32_t j = 0; j < m->n; j++) {
            if (keep_entry(def, m, i, j)) {
                rows->column[next] = (uint16_t)j;
                rows->spring[next].k = (kl_real)m->k[(size_t)i * m->n + j];
                rows->spring[next].c = (kl_real)m->c[(size_t)i * m->n + j];
                next++;
            }
        }
    }
    rows->row_start[m->n] = next;
}

/* Takes and fills the dense matrices; they are scratch. */
static enum kl_status make_dense(const struct kl_assembly *as, struct kl_arena *arena,
                                 struct kl_dense *m, struct kl_diag *diag) {
    const uint32_t n = KL_COORDINATES(as->def->n_bodies, as->def->n_wheelsets);
    const size_t cells = (size_t)n * n;
    m->n = n;
    m->k = kl_arena_take(arena, cells, sizeof(double));
    m->k_size = kl_arena_take(arena, cells, sizeof(double));
    m->c = kl_arena_take(arena, cells, sizeof(double));
    m->c_size = kl_arena_take(arena, cells, sizeof(double));
    if (m->k == NULL || m->k_size == NULL || m->c == NULL || m->c_size == NULL) {
        return kl_report(diag, KL_ERR_MEMORY, "suspension matrices", -1, (double)arena->wanted);
    }
    for (size_t i = 0; i < cells; i++) {
        m->k[i] = m->k_size[i] = m->c[i] = m->c_size[i] = 0.0;
    }
    assemble(as, m);
    return KL_OK;
}

/* Static equilibrium, and what each element carries of the weight there. */
static enum kl_status find_loads(const struct kl_assembly *as, struct kl_arena *arena,
                                 double *load_N, double *preload, struct kl_diag *diag) {
    const struct kl_vehicle_def *def = as->def;
    struct kl_dense m;
    enum kl_status status = make_dense(as, arena, &m, diag);
    double *q = kl_arena_take(arena, m.n, sizeof *q);
    if (status == KL_OK && q == NULL) {
        status = kl_report(diag, KL_ERR_MEMORY, "static equilibrium", -1, (double)arena->wanted);
    }
    status = status == KL_OK ? kl_static_solve(def, &m, arena, q, preload, diag) : status;
    for (uint32_t i = 0; i < def->n_elements && status == KL_OK; i++) {
        struct kl_reach reach;
        double sag = 0.0;
        kl_reach_element(as, &def->elements[i], KL_ALONG_Z, &reach);
        for (uint32_t t = 0; t < reach.n; t++) {
            sag += reach.factor[t] * q[reach.coordinate[t]];
        }
        load_N[i] = def->elements[i].k[2] * sag;
    }
    return status;
}

static enum kl_status take_rows(struct kl_arena *arena, uint32_t n, uint32_t entries,
                                struct rows *rows, struct kl_diag *diag) {
    rows->row_start = kl_arena_take(arena, n + 1u, sizeof *rows->row_start);
    rows->column = kl_arena_take(arena, entries, sizeof *rows->column);
    rows->spring = kl_arena_take(arena, entries, sizeof *rows->spring);
    if (rows->row_start == NULL || rows->column == NULL || rows->spring == NULL) {
        return kl_report(diag, KL_ERR_MEMORY, "suspension", -1, (double)arena->wanted);
    }
    return KL_OK;
}

/* The rows must lie below the scratch that makes them: assembled once for the loads, once to count,
 * once more to fill. */
enum kl_status kl_suspension_build(const struct kl_vehicle_def *def, const double *axle_z_m,
                                   struct kl_arena *arena, struct kl_suspension *suspension,
                                   double *preload, struct kl_diag *diag) {
    struct kl_assembly as = {def, axle_z_m, NULL};
    struct kl_dense m;
    struct rows rows;
    enum kl_status status = kl_elements_check(&as, diag);
    size_t mark = arena->used;
    status = status == KL_OK ? kl_linkages_check(def, arena, diag) : status;
    arena->used = mark;
    if (status != KL_OK) {
        return status;
    }
    double *load_N = kl_arena_take(arena, def->n_elements + 1u, sizeof *load_N);
    if (load_N == NULL) {
        return kl_report(diag, KL_ERR_MEMORY, "static loads", -1, (double)arena->wanted);
    }
    mark = arena->used;
    status = find_loads(&as, arena, load_N, preload, diag);
    arena->used = mark;
    as.load_N = load_N;
    status = status == KL_OK ? make_dense(&as, arena, &m, diag) : status;
    if (status != KL_OK) {
        return status;
    }
    const uint32_t entries = count_entries(def, &m);
    arena->used = mark;
    if (entries > UINT16_MAX) {
        return kl_report(diag, KL_ERR_CAPACITY, "element: the suspension has too many entries", -1,
                         entries);
    }
    status = take_rows(arena, m.n, entries, &rows, diag);
    mark = arena->used;
    status = status == KL_OK ? make_dense(&as, arena, &m, diag) : status;
    if (status != KL_OK) {
        return status;
    }
    store_sparse(def, &m, &rows);
    arena->used = mark;
    suspension->n_coordinates = m.n;
    suspension->n_entries = entries;
    suspension->row_start = rows.row_start;
    suspension->column = rows.column;
    suspension->spring = rows.spring;
    return KL_OK;
}
