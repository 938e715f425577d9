/* kl_creep_table.c - makes the creep-force table from the results of CONTACT, and checks it. */
#include "kl_creep.h"

#include "kl_diag.h"
#include "kl_math.h"

#define INFINITE 1e30 /* spins and creeps above this */

size_t kl_creep_table_pure(const struct kl_creep_table *t) {
    return (size_t)t->n_ratio * t->spin.n;
}

size_t kl_creep_table_rest(const struct kl_creep_table *t) {
    return kl_creep_table_pure(t) * t->creep.n * t->angle.n * 3 + 1;
}

size_t kl_creep_table_stiffness(const struct kl_creep_table *t) {
    return (size_t)t->spin.n * t->creep.n;
}

static size_t axis_bytes(const struct kl_creep_axis *axis) {
    return (axis->n - 1) * sizeof *axis->cell + KL_CREEP_BINS + 1;
}

size_t kl_creep_table_bytes(const struct kl_creep_table *t) {
    return sizeof *t + axis_bytes(&t->spin) + axis_bytes(&t->creep) + axis_bytes(&t->angle) +
           t->n_ratio * 4 * sizeof(double) +
           sizeof(float) *
               (kl_creep_table_pure(t) + kl_creep_table_rest(t) + kl_creep_table_stiffness(t));
}

/* ---- checking ---- */

static enum kl_status check_counts(uint32_t n_ratio, uint32_t n_spin, uint32_t n_creep,
                                   uint32_t n_angle) {
    const uint32_t n[3] = {n_spin, n_creep, n_angle};
    if (n_ratio < 2 || n_ratio > KL_CREEP_MAX_RATIOS) {
        return KL_ERR_CAPACITY;
    }
    for (int i = 0; i < 3; i++) {
        if (n[i] < 4 || n[i] > KL_CREEP_MAX_NODES) {
            return KL_ERR_CAPACITY;
        }
    }
    return n_angle % 2 == 1 ? KL_OK : KL_ERR_CAPACITY;
}

/* Nodes 0 .. infinity, rising. */
static int rises(const double *node, uint32_t n) {
    int good = node[0] == 0.0 && node[n - 1] > INFINITE;
    for (uint32_t i = 1; i < n; i++) {
        good = good && node[i] > node[i - 1];
    }
    return good;
}

static enum kl_status check_def(const struct kl_creep_table_def *def, struct kl_diag *diag) {
    if (check_counts(def->n_ratio, def->n_spin, def->n_creep, def->n_angle) != KL_OK) {
        return kl_report(diag, KL_ERR_CAPACITY, "creep table: number of nodes", -1, 0.0);
    }
    if (!rises(def->spin, def->n_spin) || !rises(def->creep, def->n_creep)) {
        return kl_report(diag, KL_ERR_VALUE, "creep table: P and R must rise from 0 to infinity",
                         -1, 0.0);
    }
    if (!(def->alpha > 0.0 && def->beta > 0.0 && def->gamma > 0.0)) {
        return kl_report(diag, KL_ERR_VALUE, "creep table: alpha, beta, gamma must be above 0", -1,
                         0.0);
    }
    for (uint32_t i = 0; i < def->n_ratio; i++) {
        const double *c = def->c_ij[i];
        if (!(def->ratio[i] > (i > 0 ? def->ratio[i - 1] : 0.0) && def->ratio[i] < INFINITE &&
              c[0] > 0.0 && c[1] > 0.0 && c[2] > 0.0)) {
            return kl_report(diag, KL_ERR_VALUE,
                             "creep table: a/b must rise, and C11, C22, C23 be above 0", (int32_t)i,
                             def->ratio[i]);
        }
    }
    const uint32_t n = def->n_ratio * def->n_spin * def->n_creep * def->n_angle;
    for (uint32_t i = 0; i < n; i++) {
        const double x = (double)def->force[i][0];
        const double y = (double)def->force[i][1];
        const double z = (double)def->force[i][2];
        if (!(x * x + y * y <= 1.002 && z * z <= 100.0)) {
            return kl_report(diag, KL_ERR_VALUE, "creep table: a force is beyond mu N", (int32_t)i,
                             x);
        }
    }
    return KL_OK;
}

/* ---- making: the coordinates ---- */

/* `node` from -offset on, KL_CREEP_BINS/scale long. */
static enum kl_status make_axis(struct kl_arena *arena, const double *node, uint32_t n,
                                double offset, double scale, struct kl_creep_axis *axis,
                                struct kl_diag *diag) {
    struct kl_creep_cell *cell = kl_arena_take(arena, n - 1, sizeof *cell);
    uint8_t *bins = kl_arena_take(arena, KL_CREEP_BINS + 1, 1);
    double at[KL_CREEP_MAX_NODES]; /* in bins */
    if (cell == NULL || bins == NULL) {
        return KL_ERR_MEMORY;
    }
    for (uint32_t i = 0; i < n; i++) {
        at[i] = (node[i] + offset) * scale;
    }
    for (uint32_t i = 0; i + 1 < n; i++) {
        cell[i].low = (kl_real)at[i];
        cell[i].next = i + 2 < n ? (kl_real)at[i + 1] : (kl_real)INFINITE;
        cell[i].inverse = (kl_real)(1.0 / (at[i + 1] - at[i]));
    }
    uint32_t i = 0;
    for (uint32_t bin = 0; bin <= KL_CREEP_BINS; bin++) {
        while (i + 2 < n && at[i + 1] <= (double)bin) {
            i++;
        }
        if (i + 3 < n && at[i + 2] < (double)(bin + 1)) {
            return kl_report(diag, KL_ERR_VALUE, "creep table: nodes too near each other",
                             (int32_t)i, node[i + 1]);
        }
        bins[bin] = (uint8_t)i;
    }
    const struct kl_creep_axis made = {n, cell, bins};
    *axis = made;
    return KL_OK;
}

/* ---- making: the forces ---- */

/* What is known of the nodes while the arrays are filled. */
struct nodes {
    const struct kl_creep_table_def *def;
    double w[KL_CREEP_MAX_NODES];
    double u[KL_CREEP_MAX_NODES];
    double t[KL_CREEP_MAX_NODES];
    double sine[KL_CREEP_MAX_NODES];
    double cosine[KL_CREEP_MAX_NODES];
    double log_ratio[KL_CREEP_MAX_RATIOS];
    double moment[KL_CREEP_MAX_RATIOS]; /* m0 */
};

static void find_nodes(const struct kl_creep_table_def *def, struct nodes *nodes) {
    nodes->def = def;
    for (uint32_t i = 0; i < def->n_spin; i++) {
        const double p = def->spin[i];
        nodes->w[i] = p > INFINITE ? 1.0 : p / (p + def->beta);
    }
    for (uint32_t i = 0; i < def->n_creep; i++) {
        const double r = def->creep[i];
        nodes->u[i] = r > INFINITE ? 1.0 : r / (r + def->gamma);
    }
    const uint32_t half = def->n_angle / 2;
    for (uint32_t i = 0; i <= half; i++) { /* the two quarters mirror each other to the bit */
        const double angle = 0.5 * KL_PI * (double)i / (double)half;
        const double sine = i == half ? 1.0 : kl_sin(angle);
        const double cosine = i == half ? 0.0 : kl_cos(angle);
        const double t = sine / (1.0 + cosine);
        nodes->t[half + i] = t;
        nodes->t[half - i] = -t;
        nodes->sine[half + i] = sine;
        nodes->sine[half - i] = -sine;
        nodes->cosine[half + i] = cosine;
        nodes->cosine[half - i] = cosine;
    }
    for (uint32_t i = 0; i < def->n_ratio; i++) {
        nodes->log_ratio[i] = kl_log(def->ratio[i]);
        nodes->moment[i] = kl_spin_moment(def->ratio[i]);
    }
}

struct spot {
    uint32_t ratio;
    uint32_t spin;
    uint32_t creep;
    uint32_t angle;
};

struct parts {
    double along;
    double across;
    double moment;
};

static const float *force_at(const struct kl_creep_table_def *def, struct spot s) {
    return def->force[((s.ratio * def->n_spin + s.spin) * def->n_creep + s.creep) * def->n_angle +
                      s.angle];
}

/* The lateral force of spin alone. */
static double pure_at(const struct nodes *nodes, uint32_t ratio, uint32_t spin) {
    const struct spot s = {ratio, spin, 0, 0};
    return spin == 0 ? 0.0 : (double)force_at(nodes->def, s)[1];
}

/* The rest, before nodes are moved. Without spin exactly symmetric. */
static struct parts rest_at(const struct nodes *nodes, struct spot s) {
    const float *f = force_at(nodes->def, s);
    const double faded = 1.0 - nodes->u[s.creep];
    double x = (double)f[0];
    double y = (double)f[1] - pure_at(nodes, s.ratio, s.spin) * (faded * faded);
    double z = (double)f[2];
    if (s.spin == 0) {
        struct spot other = s;
        other.angle = nodes->def->n_angle - 1 - s.angle;
        const float *g = force_at(nodes->def, other);
        x = 0.5 * (x + (double)g[0]);
        y = 0.5 * (y - (double)g[1]);
        z = 0.5 * (z - (double)g[2]);
    }
    const double c = nodes->cosine[s.angle];
    const double n = nodes->sine[s.angle];
    const int still = s.creep == 0;
    const struct parts parts = {still ? 0.0 : x * c + y * n, still ? 0.0 : y * c - x * n,
                                z / nodes->moment[s.ratio]};
    return parts;
}

/* A twelfth of h^2 f'' where the neighbours are `below` and `above` at those distances. */
static double bend(double before, double at, double after, double below, double above) {
    const double second = 2.0 * ((after - at) / above - (at - before) / below) / (below + above);
    return second * (below * below + above * above) / 24.0;
}

static void move(struct parts *moved, const struct nodes *nodes, struct spot before, struct spot at,
                 struct spot after, double below, double above) {
    const struct parts f = rest_at(nodes, before);
    const struct parts g = rest_at(nodes, at);
    const struct parts h = rest_at(nodes, after);
    moved->along -= bend(f.along, g.along, h.along, below, above);
    moved->across -= bend(f.across, g.across, h.across, below, above);
    moved->moment -= bend(f.moment, g.moment, h.moment, below, above);
}

/* a/b = 1, where P has a kink, and the ends are not moved along the ratio. */
static int ratio_bends(const struct nodes *nodes, uint32_t i) {
    const double log = nodes->log_ratio[i];
    return i > 0 && i + 1 < nodes->def->n_ratio && !(log < 1e-6 && log > -1e-6);
}

static double moved_pure(const struct nodes *nodes, uint32_t i, uint32_t j) {
    double f = pure_at(nodes, i, j);
    const double at = f;
    if (j > 0 && j + 1 < nodes->def->n_spin) {
        f -= bend(pure_at(nodes, i, j - 1), at, pure_at(nodes, i, j + 1),
                  nodes->w[j] - nodes->w[j - 1], nodes->w[j + 1] - nodes->w[j]);
    }
    if (ratio_bends(nodes, i)) {
        f -= bend(pure_at(nodes, i - 1, j), at, pure_at(nodes, i + 1, j),
                  nodes->log_ratio[i] - nodes->log_ratio[i - 1],
                  nodes->log_ratio[i + 1] - nodes->log_ratio[i]);
    }
    return f;
}

/* Sliding without end stays as it is, and so does the first node of the creep, which is the slope
 * of small creepages. */
static struct parts moved_rest(const struct nodes *nodes, struct spot s) {
    const struct kl_creep_table_def *def = nodes->def;
    struct parts moved = rest_at(nodes, s);
    struct spot before = s;
    struct spot after = s;
    if (s.creep + 1 == def->n_creep) {
        return moved;
    }
    if (ratio_bends(nodes, s.ratio)) {
        before.ratio--;
        after.ratio++;
        move(&moved, nodes, before, s, after,
             nodes->log_ratio[s.ratio] - nodes->log_ratio[before.ratio],
             nodes->log_ratio[after.ratio] - nodes->log_ratio[s.ratio]);
        before = after = s;
    }
    if (s.spin > 0 && s.spin + 1 < def->n_spin) {
        before.spin--;
        after.spin++;
        move(&moved, nodes, before, s, after, nodes->w[s.spin] - nodes->w[before.spin],
             nodes->w[after.spin] - nodes->w[s.spin]);
        before = after = s;
    }
    if (s.creep > 1) {
        before.creep--;
        after.creep++;
        move(&moved, nodes, before, s, after, nodes->u[s.creep] - nodes->u[before.creep],
             nodes->u[after.creep] - nodes->u[s.creep]);
        before = after = s;
    }
    if (s.creep > 0 && s.angle > 0 && s.angle + 1 < def->n_angle) {
        before.angle--;
        after.angle++;
        move(&moved, nodes, before, s, after, nodes->t[s.angle] - nodes->t[before.angle],
             nodes->t[after.angle] - nodes->t[s.angle]);
    }
    return moved;
}

static void fill(const struct nodes *nodes, float *pure, float *rest) {
    const struct kl_creep_table_def *def = nodes->def;
    for (uint32_t i = 0; i < def->n_ratio; i++) {
        for (uint32_t j = 0; j < def->n_spin; j++) {
            *pure++ = (float)moved_pure(nodes, i, j);
            for (uint32_t l = 0; l < def->n_angle; l++) {
                for (uint32_t k = 0; k < def->n_creep; k++) {
                    const struct spot s = {i, j, k, l};
                    const struct parts parts = moved_rest(nodes, s);
                    *rest++ = (float)parts.along;
                    *rest++ = (float)parts.across;
                    *rest++ = (float)parts.moment;
                }
            }
        }
    }
    *rest = 0.0F;
}

/* ---- making: the bound on the slopes ---- */

/* The largest of -dFx/dx, -dFy/dy, times r + s, at angle fraction `h` and creep end `e` of a cell
 * whose corners are q[angle][creep]. */
static double slope_in(const struct nodes *nodes, double gamma, uint32_t k, uint32_t l, int e,
                       double h, const float *q[2][2], double pure) {
    const double width = nodes->u[k + 1] - nodes->u[k];
    const double u = nodes->u[k + (uint32_t)e];
    const double t = nodes->t[l] + h * (nodes->t[l + 1] - nodes->t[l]);
    const double c = (1.0 - t * t) / (1.0 + t * t);
    const double n = 2.0 * t / (1.0 + t * t);
    double value[2];
    double by_u[2];
    double by_t[2];
    for (int i = 0; i < 2; i++) { /* along, across */
        const double low = (double)q[0][0][i] + h * (double)(q[1][0][i] - q[0][0][i]);
        const double high = (double)q[0][1][i] + h * (double)(q[1][1][i] - q[0][1][i]);
        by_u[i] = (high - low) / width;
        value[i] = e ? high : low;
        by_t[i] = (double)(q[1][e][i] - q[0][e][i]) / (nodes->t[l + 1] - nodes->t[l]);
        if (u == 0.0) { /* what follows is divided by u */
            value[i] = by_u[i];
            by_t[i] = (double)(q[1][1][i] - q[0][1][i]) / (width * (nodes->t[l + 1] - nodes->t[l]));
        }
    }
    const double by_angle = 0.5 * (1.0 + t * t);
    const double grown = 1.0 + (gamma - 1.0) * u;                  /* (1 + R)(1 - u) */
    const double radial = (1.0 - u) * grown / gamma;               /* (r + s) du/dr */
    const double turning = grown / (gamma * (u == 0.0 ? 1.0 : u)); /* (r + s)/r */
    const double along = by_angle * by_t[0] - value[1];
    const double across = by_angle * by_t[1] + value[0];
    const double fading = -2.0 * (1.0 - u) * pure * radial;
    const double x_x =
        c * radial * (by_u[0] * c - by_u[1] * n) - n * turning * (along * c - across * n);
    const double y_y = n * (radial * (by_u[0] * n + by_u[1] * c) + fading) +
                       c * turning * (along * n + across * c);
    const double most = -x_x > -y_y ? -x_x : -y_y;
    return most > 0.0 ? most : 0.0;
}

/* The larger of what is there and the most within a cell at one spin. */
static double slope_of_cell(const struct kl_creep_table *table, const struct nodes *nodes,
                            uint32_t i, uint32_t j, uint32_t k) {
    const struct kl_creep_table_def *def = nodes->def;
    const float *base =
        table->rest + (size_t)(i * def->n_spin + j) * def->n_angle * def->n_creep * 3;
    double most = 0.0;
    for (uint32_t l = 0; l + 1 < def->n_angle; l++) {
        const float *low = base + (l * def->n_creep + k) * 3;
        const float *high = low + def->n_creep * 3;
        const float *q[2][2] = {{low, low + 3}, {high, high + 3}};
        for (int corner = 0; corner < 6; corner++) {
            const double at =
                slope_in(nodes, def->gamma, k, l, corner % 2, 0.5 * (double)(corner / 2), q,
                         (double)table->pure[i * def->n_spin + j]);
            most = at > most ? at : most;
        }
    }
    return most;
}

static void bound_slopes(const struct kl_creep_table *table, const struct nodes *nodes,
                         float *stiffness) {
    const struct kl_creep_table_def *def = nodes->def;
    for (uint32_t j = 0; j < def->n_spin; j++) {
        float *row = stiffness + j * def->n_creep;
        for (uint32_t k = 0; k < def->n_creep; k++) {
            row[k] = 0.0F;
        }
        for (uint32_t k = 0; k + 1 < def->n_creep; k++) {
            for (uint32_t i = 0; i < def->n_ratio; i++) {
                const float most = (float)slope_of_cell(table, nodes, i, j, k);
                row[k] = most > row[k] ? most : row[k];
                row[k + 1] = most > row[k + 1] ? most : row[k + 1];
            }
        }
    }
}

/* ---- all of it ---- */

static enum kl_status make_axes(const struct nodes *nodes, struct kl_arena *arena,
                                struct kl_creep_table *table, struct kl_diag *diag) {
    const struct kl_creep_table_def *def = nodes->def;
    enum kl_status status =
        make_axis(arena, nodes->w, def->n_spin, 0.0, KL_CREEP_BINS, &table->spin, diag);
    if (status == KL_OK) {
        status = make_axis(arena, nodes->u, def->n_creep, 0.0, KL_CREEP_BINS, &table->creep, diag);
    }
    if (status == KL_OK) {
        status =
            make_axis(arena, nodes->t, def->n_angle, 1.0, 0.5 * KL_CREEP_BINS, &table->angle, diag);
    }
    return status;
}

enum kl_status kl_creep_table_build(const struct kl_creep_table_def *def, struct kl_arena *arena,
                                    struct kl_creep_table *table, struct kl_diag *diag) {
    struct nodes nodes;
    if (def == NULL || arena == NULL || table == NULL || def->ratio == NULL || def->c_ij == NULL ||
        def->spin == NULL || def->creep == NULL || def->force == NULL) {
        return KL_ERR_ARGUMENT;
    }
    enum kl_status status = check_def(def, diag);
    if (status != KL_OK) {
        return status;
    }
    find_nodes(def, &nodes);
    struct kl_creep_table made = {.n_ratio = def->n_ratio,
                                  .alpha = (kl_real)def->alpha,
                                  .beta = (kl_real)def->beta,
                                  .gamma = (kl_real)def->gamma};
    status = make_axes(&nodes, arena, &made, diag);
    if (status != KL_OK) {
        return status == KL_ERR_MEMORY
                   ? kl_report(diag, status, "creep table: memory", -1, (double)arena->size)
                   : status;
    }
    double *log_ratio = kl_arena_take(arena, def->n_ratio, sizeof(double));
    double(*log_c)[3] = kl_arena_take(arena, def->n_ratio, sizeof *log_c);
    float *pure = kl_arena_take(arena, kl_creep_table_pure(&made), sizeof(float));
    float *rest = kl_arena_take(arena, kl_creep_table_rest(&made), sizeof(float));
    float *stiffness = kl_arena_take(arena, kl_creep_table_stiffness(&made), sizeof(float));
    if (log_ratio == NULL || log_c == NULL || pure == NULL || rest == NULL || stiffness == NULL) {
        return kl_report(diag, KL_ERR_MEMORY, "creep table: memory", -1, (double)arena->size);
    }
    for (uint32_t i = 0; i < def->n_ratio; i++) {
        log_ratio[i] = nodes.log_ratio[i];
        for (int k = 0; k < 3; k++) {
            log_c[i][k] = kl_log(def->c_ij[i][k]);
        }
    }
    fill(&nodes, pure, rest);
    made.log_ratio = log_ratio;
    made.log_c_ij = (const double(*)[3])log_c;
    made.pure = pure;
    made.rest = rest;
    bound_slopes(&made, &nodes, stiffness);
    made.stiffness = stiffness;
    made.hash = kl_creep_table_hash(&made);
    *table = made;
    return KL_OK;
}

static uint64_t hash_axis(uint64_t h, const struct kl_creep_axis *axis) {
    h = kl_hash_bytes(h, &axis->n, sizeof axis->n);
    h = kl_hash_bytes(h, axis->cell, (axis->n - 1) * sizeof *axis->cell);
    return kl_hash_bytes(h, axis->bin, KL_CREEP_BINS + 1);
}

uint64_t kl_creep_table_hash(const struct kl_creep_table *t) {
    const kl_real numbers[3] = {t->alpha, t->beta, t->gamma};
    uint64_t h = kl_hash_bytes(KL_HASH_SEED, &t->n_ratio, sizeof t->n_ratio);
    h = kl_hash_bytes(h, numbers, sizeof numbers);
    h = hash_axis(hash_axis(hash_axis(h, &t->spin), &t->creep), &t->angle);
    h = kl_hash_bytes(h, t->log_ratio, t->n_ratio * sizeof(double));
    h = kl_hash_bytes(h, t->log_c_ij, t->n_ratio * sizeof *t->log_c_ij);
    h = kl_hash_bytes(h, t->pure, kl_creep_table_pure(t) * sizeof(float));
    h = kl_hash_bytes(h, t->rest, kl_creep_table_rest(t) * sizeof(float));
    return kl_hash_bytes(h, t->stiffness, kl_creep_table_stiffness(t) * sizeof(float));
}

enum kl_status kl_creep_table_check(const struct kl_creep_table *t) {
    if (t == NULL || t->log_ratio == NULL || t->log_c_ij == NULL || t->pure == NULL ||
        t->rest == NULL || t->stiffness == NULL || t->spin.cell == NULL || t->creep.cell == NULL ||
        t->angle.cell == NULL || t->spin.bin == NULL || t->creep.bin == NULL ||
        t->angle.bin == NULL) {
        return KL_ERR_ARGUMENT;
    }
    const int counts = check_counts(t->n_ratio, t->spin.n, t->creep.n, t->angle.n) == KL_OK;
    return counts && kl_creep_table_hash(t) == t->hash ? KL_OK : KL_ERR_VALUE;
}
