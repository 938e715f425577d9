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
        struct kl_linkage_rates rates;
        kl_linkage_rates(def, i, &rates);
        kl_reach_linkage(def, &def->linkages[i], &reach);
        add_spring(m, &reach, rates.k, rates.c);
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

/* The columns of every row, as bits. */
#define WORD_BITS 32u
struct columns {
    uint32_t n_rows;
    uint32_t n_words;
    uint32_t *word; /* n_words per row */
};

static void mark_columns(const struct kl_vehicle_def *def, const struct kl_dense *m,
                         const struct columns *c) {
    for (uint32_t i = 0; i < m->n; i++) {
        uint32_t *word = &c->word[i * c->n_words];
        for (uint32_t k = 0; k < c->n_words; k++) {
            word[k] = 0;
        }
        for (uint32_t j = 0; j < m->n; j++) {
            word[j / WORD_BITS] |= keep_entry(def, m, i, j) ? 1u << (j % WORD_BITS) : 0u;
        }
    }
}

static int has_column(const struct columns *c, uint32_t row, uint32_t column) {
    return ((c->word[row * c->n_words + column / WORD_BITS] >> (column % WORD_BITS)) & 1u) != 0;
}

static uint32_t count_shared(const struct columns *c, uint32_t a, uint32_t b) {
    uint32_t n = 0;
    for (uint32_t k = 0; k < c->n_words; k++) {
        uint32_t both = c->word[a * c->n_words + k] & c->word[b * c->n_words + k];
        for (; both != 0; both &= both - 1u) {
            n++;
        }
    }
    return n;
}

/* The row that shares most columns with row a, of those that have no twin yet; n_rows: none is left. */
static uint32_t best_twin(const struct columns *c, const unsigned char *done, uint32_t a,
                          uint32_t *shared) {
    uint32_t best = c->n_rows;
    *shared = 0;
    for (uint32_t b = a + 1u; b < c->n_rows; b++) {
        const uint32_t n = done[b] ? 0u : count_shared(c, a, b);
        if (!done[b] && (best == c->n_rows || n > *shared)) {
            best = b;
            *shared = n;
        }
    }
    return best;
}

/* The two rows that share most columns first, and so on; the last may be left alone. Returns the
 * entries that they all have. */
static uint32_t pair_rows(const struct columns *c, unsigned char *done, uint16_t *twins) {
    uint32_t entries = 0;
    for (uint32_t i = 0; i < c->n_rows; i++) {
        done[i] = 0;
    }
    for (uint32_t t = 0; t < (c->n_rows + 1u) / 2u; t++, twins += 3) {
        uint32_t first = c->n_rows;
        uint32_t most = 0;
        twins[1] = (uint16_t)c->n_rows;
        for (uint32_t a = 0; a < c->n_rows; a++) {
            uint32_t shared = 0;
            const uint32_t b = done[a] ? c->n_rows : best_twin(c, done, a, &shared);
            if (!done[a] && (first == c->n_rows || shared > most)) {
                first = a;
                most = shared;
                twins[1] = (uint16_t)b;
            }
        }
        twins[0] = (uint16_t)first;
        twins[2] = 0;
        for (uint32_t j = 0; j < c->n_rows; j++) {
            const int second = twins[1] < c->n_rows && has_column(c, twins[1], j);
            twins[2] = (uint16_t)(twins[2] + (has_column(c, first, j) || second ? 1 : 0));
        }
        twins[2] = (uint16_t)(twins[2] + twins[2] % 2u);
        done[first] = 1;
        if (twins[1] < c->n_rows) {
            done[twins[1]] = 1;
        }
        entries += twins[2];
    }
    return entries;
}

struct rows {
    uint16_t *twins;
    uint16_t *place;
    struct kl_spring *spring;
};

static struct kl_spring spring_at(const struct kl_vehicle_def *def, const struct kl_dense *m,
                                  uint32_t row, uint32_t column) {
    const size_t at = (size_t)row * m->n + column;
    const int is = row < m->n && keep_entry(def, m, row, column);
    const struct kl_spring spring = {is ? (kl_real)m->k[at] : KL_R(0),
                                     is ? (kl_real)m->c[at] : KL_R(0)};
    return spring;
}

static int is_entry(const struct kl_vehicle_def *def, const struct kl_dense *m,
                    const uint16_t *twins, uint32_t column) {
    return keep_entry(def, m, twins[0], column) ||
           (twins[1] < m->n && keep_entry(def, m, twins[1], column));
}

static void store_entry(const struct kl_vehicle_def *def, const struct kl_dense *m,
                        const struct rows *rows, const uint16_t *twins, uint32_t entry,
                        uint32_t column) {
    rows->place[entry] = (uint16_t)KL_PLACE(column);
    rows->spring[2u * entry] = spring_at(def, m, twins[0], column);
    rows->spring[2u * entry + 1u] = spring_at(def, m, twins[1], column);
}

static void store_sparse(const struct kl_vehicle_def *def, const struct kl_dense *m,
                         const struct rows *rows) {
    uint32_t next = 0;
    const uint16_t *twins = rows->twins;
    for (uint32_t t = 0; t < (m->n + 1u) / 2u; t++, twins += 3) {
        const uint32_t first = next;
        for (uint32_t j = 0; j < m->n; j++) {
            if (is_entry(def, m, twins, j)) {
                store_entry(def, m, rows, twins, next, j);
                next++;
            }
        }
        if (next - first < twins[2]) {
            const uint16_t no_rows[2] = {(uint16_t)m->n, (uint16_t)m->n};
            store_entry(def, m, rows, no_rows, next, 0);
            next++;
        }
    }
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

/* What a coordinate accelerates; 0 for what is not integrated by its own inertia. */
static double inertia_of(const struct kl_vehicle_def *def, uint32_t coordinate) {
    const uint32_t first = kl_wheelset_coordinate(def->n_bodies, 0);
    if (coordinate >= first) {
        const struct kl_wheelset_def *w = &def->wheelsets[(coordinate - first) / 4u];
        const uint32_t which = (coordinate - first) % 4u;
        return which == 0 ? w->mass_kg : which == 3u ? w->inertia_yaw_kgm2 : 0.0;
    }
    const struct kl_body_def *body = &def->bodies[coordinate / KL_FREEDOMS];
    const uint32_t freedom = coordinate % KL_FREEDOMS;
    return !kl_is_free(def, coordinate)  ? 0.0
           : freedom < (uint32_t)KL_ROLL ? body->mass_kg
                                         : body->inertia_kgm2[freedom - (uint32_t)KL_ROLL];
}

/* The stiffness of rigid linkages that is there at rest alone. */
static double leaking_at(const struct kl_vehicle_def *def, uint32_t coordinate) {
    double sum = 0.0;
    for (uint32_t i = 0; i < def->n_linkages; i++) {
        struct kl_reach reach;
        struct kl_linkage_rates rates;
        kl_linkage_rates(def, i, &rates);
        kl_reach_linkage(def, &def->linkages[i], &reach);
        for (uint32_t t = 0; t < reach.n; t++) {
            const double factor = reach.coordinate[t] == coordinate ? reach.factor[t] : 0.0;
            sum -= rates.slip.k * (factor * factor);
        }
    }
    return sum;
}

/*
 * A mass matrix that is as good as singular: springs on a mass so small that no step could follow.
 * The step is stable up to the angular frequency 2/step. The fastest one of the vehicle is no lower
 * than sqrt(k_ii/m_i) of any coordinate (Rayleigh's quotient of its unit vector), so that nothing that
 * could run is refused.
 */
static enum kl_status check_inertias(const struct kl_vehicle_def *def, const struct kl_dense *m,
                                     struct kl_diag *diag) {
    const double fastest = 2.0 / ((double)def->step_ns * 1e-9);
    const uint32_t first = kl_wheelset_coordinate(def->n_bodies, 0);
    for (uint32_t i = 0; i < m->n; i++) {
        const double inertia = inertia_of(def, i);
        const double k = m->k[(size_t)i * m->n + i] - leaking_at(def, i);
        if (inertia > 0.0 && k > fastest * fastest * inertia) {
            const int body = i < first;
            return kl_report(diag, KL_ERR_SINGULAR,
                             body ? "body: mass or inertia too small for its springs and the step; "
                                    "angular frequency, 1/s"
                                  : "wheelset: mass or inertia too small for its springs and the "
                                    "step; angular frequency, 1/s",
                             (int32_t)(body ? i / KL_FREEDOMS : (i - first) / 4u),
                             kl_sqrt(k / inertia));
        }
    }
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
    status = status == KL_OK ? check_inertias(def, &m, diag) : status;
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

/* Which rows go together; everything but that is scratch. */
static enum kl_status make_twins(const struct kl_assembly *as, struct kl_arena *arena,
                                 uint16_t *twins, uint32_t *entries, struct kl_diag *diag) {
    struct kl_dense m;
    struct columns columns;
    const size_t mark = arena->used;
    enum kl_status status = make_dense(as, arena, &m, diag);
    if (status != KL_OK) {
        return status;
    }
    columns.n_rows = m.n;
    columns.n_words = (m.n + WORD_BITS - 1u) / WORD_BITS;
    columns.word = kl_arena_take(arena, (size_t)m.n * columns.n_words, sizeof *columns.word);
    unsigned char *done = kl_arena_take(arena, m.n, sizeof *done);
    if (columns.word == NULL || done == NULL) {
        return kl_report(diag, KL_ERR_MEMORY, "suspension", -1, (double)arena->wanted);
    }
    mark_columns(as->def, &m, &columns);
    *entries = pair_rows(&columns, done, twins);
    arena->used = mark;
    return *entries <= UINT16_MAX
               ? KL_OK
               : kl_report(diag, KL_ERR_CAPACITY, "element: the suspension has too many entries",
                           -1, *entries);
}

static enum kl_status make_rows(const struct kl_assembly *as, struct kl_arena *arena,
                                struct rows *rows, uint32_t *entries, struct kl_diag *diag) {
    const uint32_t n = KL_COORDINATES(as->def->n_bodies, as->def->n_wheelsets);
    struct kl_dense m;
    rows->twins = kl_arena_take(arena, 3u * ((n + 1u) / 2u), sizeof *rows->twins);
    if (rows->twins == NULL) {
        return kl_report(diag, KL_ERR_MEMORY, "suspension", -1, (double)arena->wanted);
    }
    enum kl_status status = make_twins(as, arena, rows->twins, entries, diag);
    if (status != KL_OK) {
        return status;
    }
    rows->place = kl_arena_take(arena, *entries, sizeof *rows->place);
    rows->spring = kl_arena_take(arena, 2u * (size_t)*entries, sizeof *rows->spring);
    if (rows->place == NULL || rows->spring == NULL) {
        return kl_report(diag, KL_ERR_MEMORY, "suspension", -1, (double)arena->wanted);
    }
    const size_t mark = arena->used;
    status = make_dense(as, arena, &m, diag);
    if (status == KL_OK) {
        store_sparse(as->def, &m, rows);
    }
    arena->used = mark;
    return status;
}

/* What is kept must lie below the scratch that makes it: assembled once for the loads, once to find out
 * which rows go together, once more to fill them. */
enum kl_status kl_suspension_build(const struct kl_vehicle_def *def, const double *axle_z_m,
                                   struct kl_arena *arena, struct kl_suspension *suspension,
                                   double *preload, struct kl_diag *diag) {
    struct kl_assembly as = {def, axle_z_m, NULL};
    struct rows rows;
    uint32_t entries = 0;
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
    status = status == KL_OK ? make_rows(&as, arena, &rows, &entries, diag) : status;
    if (status != KL_OK) {
        return status;
    }
    suspension->n_coordinates = KL_COORDINATES(def->n_bodies, def->n_wheelsets);
    suspension->n_entries = entries;
    suspension->twins = rows.twins;
    suspension->place = rows.place;
    suspension->spring = rows.spring;
    return KL_OK;
}
