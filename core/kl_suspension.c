/* kl_suspension.c - springs and dampers to sparse matrices, and the static equilibrium. */
#include "kl_suspension.h"

#include "kl_diag.h"
#include "kl_math.h"

#define COORDINATES_PER_END 5
/* entries smaller than this part of what was added up are rounding, and are dropped: symmetry stays
 * exact */
#define ROUNDING 1e-14

/* How one end moves along one direction: up to five coordinates with factors. */
struct reach {
    uint32_t n;
    uint32_t coordinate[2 * COORDINATES_PER_END];
    double factor[2 * COORDINATES_PER_END];
};

/* What is assembled: the definition, and the height of each axle. */
struct assembly {
    const struct kl_vehicle_def *def;
    const double *axle_z_m;
};

/* Dense matrices while assembling; `size` is the sum of absolute contributions. */
struct dense {
    uint32_t n;
    double *k;
    double *k_size;
    double *c;
    double *c_size;
};

static void add_reach(struct reach *reach, uint32_t coordinate, double factor) {
    if (factor != 0.0) {
        reach->coordinate[reach->n] = coordinate;
        reach->factor[reach->n] = factor;
        reach->n++;
    }
}

static int is_wheelset(int32_t end) {
    return end >= KL_WHEELSET_END(0);
}

/* Adds the motion of one end along direction 0..5 (x, y, z, about x, y, z), times `sign`. d =
 * translation + theta x r. */
static void reach_end(const struct assembly *as, int32_t end, const double point[3], int direction,
                      int with_pitch, double sign, struct reach *reach) {
    if (end == KL_GROUND_END) {
        return;
    }
    const struct kl_vehicle_def *def = as->def;
    const int wheelset = is_wheelset(end);
    const uint32_t i = (uint32_t)(wheelset ? end - KL_WHEELSET_END(0) : end);
    const uint32_t base =
        wheelset ? kl_wheelset_coordinate(def->n_bodies, i) : kl_body_coordinate(i);
    const uint32_t yaw = base + (wheelset ? 3u : (uint32_t)KL_YAW);
    const uint32_t y = base;
    const uint32_t z = base + 1u;
    const uint32_t roll = base + 2u;
    const uint32_t pitch = base + 3u; /* bodies only */
    const double z_centre = wheelset ? as->axle_z_m[i] : def->bodies[i].z_m;
    const double rx = point[0] - (wheelset ? def->wheelsets[i].x_m : def->bodies[i].x_m);
    const double ry = point[1];
    const double rz = point[2] - z_centre;
    switch (direction) {
    case 0:
        add_reach(reach, yaw, -sign * ry);
        add_reach(reach, pitch, wheelset || !with_pitch ? 0.0 : sign * rz);
        break;
    case 1:
        add_reach(reach, y, sign);
        add_reach(reach, yaw, sign * rx);
        add_reach(reach, roll, -sign * rz);
        break;
    case 2:
        add_reach(reach, z, sign);
        add_reach(reach, roll, sign * ry);
        add_reach(reach, pitch, wheelset ? 0.0 : -sign * rx);
        break;
    case 3:
        add_reach(reach, roll, sign);
        break;
    case 4:
        add_reach(reach, pitch, wheelset ? 0.0 : sign);
        break;
    default:
        add_reach(reach, yaw, sign);
        break;
    }
}

static void add_spring(double *matrix, double *size, uint32_t n, const struct reach *reach,
                       double value) {
    for (uint32_t i = 0; i < reach->n; i++) {
        for (uint32_t j = 0; j < reach->n; j++) {
            const size_t at = (size_t)reach->coordinate[i] * n + reach->coordinate[j];
            const double part = value * (reach->factor[i] * reach->factor[j]);
            matrix[at] += part;
            size[at] += kl_abs(part);
        }
    }
}

static enum kl_status check_element(const struct kl_vehicle_def *def, uint32_t index,
                                    struct kl_diag *diag) {
    const struct kl_element_def *e = &def->elements[index];
    const int32_t ends[2] = {e->end_a, e->end_b};
    for (int i = 0; i < 2; i++) {
        const int32_t last_body = (int32_t)def->n_bodies - 1;
        const int32_t last_wheelset = KL_WHEELSET_END((int32_t)def->n_wheelsets - 1);
        const int known = ends[i] == KL_GROUND_END || (ends[i] >= 0 && ends[i] <= last_body) ||
                          (is_wheelset(ends[i]) && ends[i] <= last_wheelset);
        if (!known) {
            return kl_report(diag, KL_ERR_REFERENCE, "element: no such body or wheelset",
                             (int32_t)index, ends[i]);
        }
    }
    if (e->end_a == e->end_b) {
        return kl_report(diag, KL_ERR_REFERENCE, "element: both ends are on the same body",
                         (int32_t)index, e->end_a);
    }
    for (int i = 0; i < 3; i++) {
        if (!(kl_abs(e->point_a_m[i]) < 1e3 && kl_abs(e->point_b_m[i]) < 1e3)) {
            return kl_report(diag, KL_ERR_VALUE, "element: points must be within 1000 m",
                             (int32_t)index,
                             kl_abs(e->point_a_m[i]) < 1e3 ? e->point_b_m[i] : e->point_a_m[i]);
        }
    }
    for (int i = 0; i < 6; i++) {
        if (!(e->k[i] >= 0.0 && e->k[i] < 1e12)) {
            return kl_report(diag, KL_ERR_VALUE, "element: stiffness must be in 0..1e12",
                             (int32_t)index, e->k[i]);
        }
        if (!(e->c[i] >= 0.0 && e->c[i] < 1e12)) {
            return kl_report(diag, KL_ERR_VALUE, "element: damping must be in 0..1e12",
                             (int32_t)index, e->c[i]);
        }
    }
    return KL_OK;
}

static void assemble(const struct assembly *as, const struct dense *m) {
    const struct kl_vehicle_def *def = as->def;
    for (uint32_t i = 0; i < def->n_elements; i++) {
        const struct kl_element_def *e = &def->elements[i];
        const int with_pitch = !is_wheelset(e->end_a) && !is_wheelset(e->end_b);
        for (int direction = 0; direction < 6; direction++) {
            struct reach reach = {.n = 0};
            reach_end(as, e->end_a, e->point_a_m, direction, with_pitch, 1.0, &reach);
            reach_end(as, e->end_b, e->point_b_m, direction, with_pitch, -1.0, &reach);
            add_spring(m->k, m->k_size, m->n, &reach, e->k[direction]);
            add_spring(m->c, m->c_size, m->n, &reach, e->c[direction]);
        }
    }
    for (size_t i = 0; i < (size_t)m->n * m->n; i++) {
        m->k[i] = kl_abs(m->k[i]) > ROUNDING * m->k_size[i] ? m->k[i] : 0.0;
        m->c[i] = kl_abs(m->c[i]) > ROUNDING * m->c_size[i] ? m->c[i] : 0.0;
    }
}

/* 1 where the coordinate moves freely under forces: a body's freedom. */
static int is_free(const struct kl_vehicle_def *def, uint32_t coordinate) {
    const uint32_t b = coordinate / KL_FREEDOMS;
    return b < def->n_bodies && (def->bodies[b].freedoms & KL_HAS(coordinate % KL_FREEDOMS)) != 0;
}

/*
 * Static equilibrium of the bodies under their weight, wheelsets held: K q = W by Gauss elimination
 * with row pivoting. A freedom that nothing holds has an empty row; it is an error only if a load
 * asks for it.
 */
static enum kl_status solve_static(double *a, double *q, const uint32_t *body_of, uint32_t n,
                                   struct kl_diag *diag) {
    double largest = 0.0;
    for (size_t i = 0; i < (size_t)n * n; i++) {
        largest = kl_abs(a[i]) > largest ? kl_abs(a[i]) : largest;
    }
    double load = 0.0;
    for (uint32_t i = 0; i < n; i++) {
        load = kl_abs(q[i]) > load ? kl_abs(q[i]) : load;
    }
    for (uint32_t i = 0; i < n; i++) {
        uint32_t pivot = i;
        for (uint32_t r = i + 1u; r < n; r++) {
            pivot = kl_abs(a[(size_t)r * n + i]) > kl_abs(a[(size_t)pivot * n + i]) ? r : pivot;
        }
        if (!(kl_abs(a[(size_t)pivot * n + i]) > 1e-11 * largest)) {
            a[(size_t)i * n + i] = 0.0;
            continue;
        }
        for (uint32_t j = 0; j < n; j++) {
            const double swap = a[(size_t)i * n + j];
            a[(size_t)i * n + j] = a[(size_t)pivot * n + j];
            a[(size_t)pivot * n + j] = swap;
        }
        const double swap = q[i];
        q[i] = q[pivot];
        q[pivot] = swap;
        for (uint32_t r = i + 1u; r < n; r++) {
            const double part = a[(size_t)r * n + i] / a[(size_t)i * n + i];
            for (uint32_t j = i; j < n; j++) {
                a[(size_t)r * n + j] -= part * a[(size_t)i * n + j];
            }
            q[r] -= part * q[i];
        }
    }
    for (uint32_t i = n; i-- > 0;) {
        if (a[(size_t)i * n + i] == 0.0) {
            if (kl_abs(q[i]) > 1e-9 * load) {
                return kl_report(diag, KL_ERR_SINGULAR,
                                 "body is not held vertically, in roll or in pitch",
                                 (int32_t)body_of[i], 0.0);
            }
            q[i] = 0.0;
            continue;
        }
        double sum = q[i];
        for (uint32_t j = i + 1u; j < n; j++) {
            sum -= a[(size_t)i * n + j] * q[j];
        }
        q[i] = sum / a[(size_t)i * n + i];
    }
    return KL_OK;
}

static enum kl_status find_preload(const struct kl_vehicle_def *def, const struct dense *m,
                                   struct kl_arena *arena, double *preload, struct kl_diag *diag) {
    double *a = kl_arena_take(arena, (size_t)m->n * m->n, sizeof *a);
    double *q = kl_arena_take(arena, m->n, sizeof *q);
    uint32_t *coordinate = kl_arena_take(arena, m->n, sizeof *coordinate);
    uint32_t *body_of = kl_arena_take(arena, m->n, sizeof *body_of);
    if (a == NULL || q == NULL || coordinate == NULL || body_of == NULL) {
        return kl_report(diag, KL_ERR_MEMORY, "static equilibrium", -1, (double)arena->wanted);
    }
    uint32_t n = 0;
    for (uint32_t i = 0; i < m->n; i++) {
        if (is_free(def, i)) {
            body_of[n] = i / KL_FREEDOMS;
            coordinate[n++] = i;
        }
    }
    for (uint32_t i = 0; i < n; i++) {
        for (uint32_t j = 0; j < n; j++) {
            a[(size_t)i * n + j] = m->k[(size_t)coordinate[i] * m->n + coordinate[j]];
        }
        const int vertical = coordinate[i] % KL_FREEDOMS == (uint32_t)KL_Z;
        q[i] = vertical ? def->bodies[body_of[i]].mass_kg * def->gravity_m_s2 : 0.0;
    }
    const enum kl_status status = solve_static(a, q, body_of, n, diag);
    if (status != KL_OK) {
        return status;
    }
    for (uint32_t w = 0; w < def->n_wheelsets; w++) {
        const uint32_t first = kl_wheelset_coordinate(def->n_bodies, w);
        for (uint32_t d = 0; d < 4u; d++) {
            double force = 0.0;
            double size = 0.0;
            for (uint32_t i = 0; i < n; i++) {
                const double part = m->k[(size_t)(first + d) * m->n + coordinate[i]] * q[i];
                force -= part;
                size += kl_abs(part);
            }
            preload[4u * w + d] = kl_abs(force) > 1e-10 * size ? force : 0.0;
        }
        preload[4u * w + 1u] += def->wheelsets[w].load_N;
    }
    return KL_OK;
}

/* Rows that move and columns that can be non-zero: absent vertical and pitch freedoms are always
 * zero. */
static int is_used(const struct kl_vehicle_def *def, uint32_t coordinate, int as_row) {
    if (coordinate >= kl_wheelset_coordinate(def->n_bodies, 0) || is_free(def, coordinate)) {
        return 1;
    }
    const uint32_t freedom = coordinate % KL_FREEDOMS;
    return !as_row && freedom != (uint32_t)KL_Z && freedom != (uint32_t)KL_PITCH;
}

static int keep_entry(const struct kl_vehicle_def *def, const struct dense *m, uint32_t i,
                      uint32_t j) {
    const size_t at = (size_t)i * m->n + j;
    return (m->k[at] != 0.0 || m->c[at] != 0.0) && is_used(def, i, 1) && is_used(def, j, 0);
}

static uint32_t count_entries(const struct kl_vehicle_def *def, const struct dense *m) {
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

static void store_sparse(const struct kl_vehicle_def *def, const struct dense *m,
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
static enum kl_status make_dense(const struct assembly *as, struct kl_arena *arena, struct dense *m,
                                 struct kl_diag *diag) {
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

/* The rows must lie below the scratch that makes them: assembled once to count, once more to fill.
 */
enum kl_status kl_suspension_build(const struct kl_vehicle_def *def, const double *axle_z_m,
                                   struct kl_arena *arena, struct kl_suspension *suspension,
                                   double *preload, struct kl_diag *diag) {
    const struct assembly as = {def, axle_z_m};
    struct dense m;
    enum kl_status status = KL_OK;
    for (uint32_t i = 0; i < def->n_elements && status == KL_OK; i++) {
        status = check_element(def, i, diag);
    }
    if (status != KL_OK) {
        return status;
    }
    size_t mark = arena->used;
    status = make_dense(&as, arena, &m, diag);
    status = status == KL_OK ? find_preload(def, &m, arena, preload, diag) : status;
    if (status != KL_OK) {
        return status;
    }
    const uint32_t entries = count_entries(def, &m);
    arena->used = mark;
    struct rows rows;
    rows.row_start = kl_arena_take(arena, m.n + 1u, sizeof *rows.row_start);
    rows.column = kl_arena_take(arena, entries, sizeof *rows.column);
    rows.spring = kl_arena_take(arena, entries, sizeof *rows.spring);
    if (rows.row_start == NULL || rows.column == NULL || rows.spring == NULL) {
        return kl_report(diag, KL_ERR_MEMORY, "suspension", -1, (double)arena->wanted);
    }
    mark = arena->used;
    status = make_dense(&as, arena, &m, diag);
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
