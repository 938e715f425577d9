/*
 * kl_creep_lookup.c - reads the creep-force table, both wheels at once.
 *
 * The coordinates and what follows from the result is done in lanes. Between them, wheel by wheel,
 * the sixteen nodes round the place are blended along the ratio and the spin, in float as they are
 * stored:
 * neither changes much with the motion, and the last two coordinates, which do, are left to
 * kl_real.
 */
#include "kl_creep_lanes.h"

/* Three floats and one that is not needed: the parts of a node, see struct kl_creep_table. */
#if KL_LANES == 2
typedef float kl_quad __attribute__((vector_size(16)));
static inline kl_quad quad_at(const float *from) {
    kl_quad q;
    __builtin_memcpy(&q, from, sizeof q);
    return q;
}
static inline kl_quad quad_between(kl_quad a, kl_quad b, float t) {
    return a + t * (b - a);
}
#else
typedef struct {
    float part[3];
} kl_quad;
static inline kl_quad quad_at(const float *from) {
    const kl_quad q = {{from[0], from[1], from[2]}};
    return q;
}
static inline kl_quad quad_between(kl_quad a, kl_quad b, float t) {
    const kl_quad q = {{a.part[0] + t * (b.part[0] - a.part[0]),
                        a.part[1] + t * (b.part[1] - a.part[1]),
                        a.part[2] + t * (b.part[2] - a.part[2])}};
    return q;
}
#endif

/* Where a coordinate is: the node below, and the part of the way to the next. */
struct place {
    uint32_t node;
    kl_real t;
};

/* `x` is within the axis but for rounding. No search: the bin tells the cell, or the one before. */
static inline struct place place_on(const struct kl_creep_axis *axis, kl_real x) {
    uint32_t node = axis->bin[(uint32_t)((x + axis->offset) * axis->scale)];
    node += x >= axis->cell[node].next;
    const struct place place = {node, (x - axis->cell[node].low) * axis->cell[node].inverse};
    return place;
}

static inline struct place place_of_ratio(const struct kl_creep_table *table, kl_real at) {
    uint32_t node = (uint32_t)at;
    node = node < table->n_ratio - 2 ? node : table->n_ratio - 2;
    const struct place place = {node, at - (kl_real)node};
    return place;
}

/* A function of two coordinates, the second of which goes on from one float to the next. */
static inline float between_four(const float *at, uint32_t row, float t_row, float t) {
    const float low = at[0] + t * (at[1] - at[0]);
    const float high = at[row] + t * (at[row + 1] - at[row]);
    return low + t_row * (high - low);
}

/* A node, blended along ratio and spin. */
static inline kl_quad blended(const float *at, size_t by_spin, size_t by_ratio, float ratio,
                              float spin) {
    const kl_quad low = quad_between(quad_at(at), quad_at(at + by_ratio), ratio);
    const float *next = at + by_spin;
    const kl_quad high = quad_between(quad_at(next), quad_at(next + by_ratio), ratio);
    return quad_between(low, high, spin);
}

/* What one wheel takes from the table. */
struct reading {
    kl_quad corner[4]; /* angle and creep below; creep above; angle above; both above */
    kl_real angle;     /* parts of the way */
    kl_real creep;
    kl_real pure;
    kl_real stiffness;
};

static inline void read_table(const struct kl_creep_table *table, kl_real ratio, kl_real w,
                              kl_real u, kl_real t, struct reading *r) {
    const struct place i = place_of_ratio(table, ratio);
    const struct place j = place_on(&table->spin, w);
    const struct place k = place_on(&table->creep, u);
    const struct place l = place_on(&table->angle, t);
    const uint32_t n_creep = table->creep.n;
    const uint32_t n_angle = table->angle.n;
    const uint32_t n_spin = table->spin.n;
    const size_t by_angle = (size_t)3 * n_creep;
    const size_t by_spin = by_angle * n_angle;
    const size_t by_ratio = by_spin * n_spin;
    const uint32_t pure = i.node * n_spin + j.node;
    const float *at = table->rest + (size_t)3 * ((pure * n_angle + l.node) * n_creep + k.node);
    const float across = (float)i.t;
    const float spin = (float)j.t;
    r->corner[0] = blended(at, by_spin, by_ratio, across, spin);
    r->corner[1] = blended(at + 3, by_spin, by_ratio, across, spin);
    r->corner[2] = blended(at + by_angle, by_spin, by_ratio, across, spin);
    r->corner[3] = blended(at + by_angle + 3, by_spin, by_ratio, across, spin);
    r->angle = l.t;
    r->creep = k.t;
    r->pure = (kl_real)between_four(table->pure + pure, n_spin, across, spin);
    r->stiffness = (kl_real)between_four(table->stiffness + j.node * n_creep + k.node, n_creep,
                                         spin, (float)k.t);
}

/* Both wheels' readings of one number, or the one wheel's. */
#if KL_LANES == 2
#define BOTH(r, member) kl_lane_of((r)[0].member, (r)[1].member, 0)
#define PART(r, c, i) kl_lane_of((kl_real)(r)[0].corner[c][i], (kl_real)(r)[1].corner[c][i], 0)
#else
#define BOTH(r, member) ((r)[0].member)
#define PART(r, c, i) ((kl_real)(r)[0].corner[c].part[i])
#endif

static inline kl_lane blend(const struct reading *r, int i, kl_lane angle, kl_lane creep) {
    const kl_lane low = PART(r, 0, i) + angle * (PART(r, 2, i) - PART(r, 0, i));
    const kl_lane high = PART(r, 1, i) + angle * (PART(r, 3, i) - PART(r, 1, i));
    return low + creep * (high - low);
}

/* Where in the table, and how to turn what is found there. */
struct coordinates {
    kl_lane w;
    kl_lane u;
    kl_lane t;
    kl_lane cosine; /* of the angle */
    kl_lane sine;
    kl_lane way; /* signs of x, and of what turns */
    kl_lane turn;
    kl_lane inv_r_s; /* 1/(r + s) */
};

static inline struct coordinates find(const struct kl_creep_table *table,
                                      const struct kl_creep_lanes *in) {
    struct coordinates at;
    const kl_lane one = kl_lane_all(KL_R(1));
    const kl_lane two = kl_lane_all(KL_R(2));
    /* the half of creepage space that is stored: spin >= 0, x >= 0; without spin also y >= 0, so
     * that the mirror image is the same to the bit */
    at.turn = one - kl_lane_positive_or_0(-kl_lane_if_0(in->p, in->y, in->p), two);
    at.way = kl_lane_if_0(in->x, kl_lane_all(KL_R(0)), one - kl_lane_positive_or_0(-in->x, two));
    const kl_lane x = at.way * in->x;
    const kl_lane y = at.turn * in->y;
    const kl_lane spin = in->shape[1] * (at.turn * in->p);
    const kl_lane bent = table->alpha * spin;
    const kl_lane s = kl_lane_sqrt(KL_R(1) + bent * bent);
    const kl_lane r = kl_lane_sqrt(x * x + y * y);
    /* w = P/(P + beta), u = r/(r + gamma s), 1/(r + s) by one division; direction and t by another
     * */
    const kl_lane u_below = r + table->gamma * s;
    const kl_lane w_below = spin + kl_lane_all(table->beta);
    const kl_lane by_1 = KL_R(1) / ((u_below * w_below) * (r + s));
    at.u = r * ((w_below * (r + s)) * by_1);
    at.w = spin * ((u_below * (r + s)) * by_1);
    at.inv_r_s = (u_below * w_below) * by_1;
    const kl_lane r_1 = kl_lane_max(r, kl_lane_all(KL_R(1e-15)));
    const kl_lane t_below = r_1 + x;
    const kl_lane by_2 = KL_R(1) / (r_1 * t_below);
    const kl_lane inv_r = t_below * by_2;
    at.t = y * (r_1 * by_2);
    at.cosine = x * inv_r;
    at.sine = y * inv_r;
    return at;
}

void kl_lane_creep_table(const struct kl_creep_table *table, const struct kl_creep_lanes *in,
                         struct kl_creep_lanes_force *out) {
    const kl_lane zero = kl_lane_all(KL_R(0));
    const kl_lane one = kl_lane_all(KL_R(1));
    const struct coordinates at = find(table, in);
    struct reading reading[KL_LANES];
#if KL_LANES == 2
    read_table(table, in->shape[0][0], at.w[0], at.u[0], at.t[0], &reading[0]);
    read_table(table, in->shape[0][1], at.w[1], at.u[1], at.t[1], &reading[1]);
#else
    read_table(table, in->shape[0], at.w, at.u, at.t, &reading[0]);
#endif
    const kl_lane angle = BOTH(reading, angle);
    const kl_lane creep = BOTH(reading, creep);
    const kl_lane along = blend(reading, 0, angle, creep);
    const kl_lane across = blend(reading, 1, angle, creep);
    const kl_lane faded = one - at.u;
    const kl_lane t1 = along * at.cosine - across * at.sine;
    const kl_lane t2 =
        (along * at.sine + across * at.cosine) + BOTH(reading, pure) * (faded * faded);
    /* interpolation may pass mu N by some thousandths: with |T|^2 = 1 + e, 1 - e/2 is enough for
     * any e up to 2, as (1 - e/2)^2 (1 + e) = 1 - 3/4 e^2 + e^3/4, and needs no root */
    const kl_lane excess = kl_lane_max((t1 * t1 + t2 * t2) - one, zero);
    const kl_lane limited = one - KL_R(0.5) * excess;
    out->t1 = at.way * (limited * t1);
    out->t2 = at.turn * (limited * t2);
    out->m3 = at.turn * (in->shape[2] * blend(reading, 2, angle, creep));
    out->reduction = kl_lane_min(BOTH(reading, stiffness) * at.inv_r_s, one);
}
