/*
 * kl_creep_lookup.c - reads the creep-force table, both wheels at once.
 *
 * The coordinates and what follows from the result is done in lanes. Between them, wheel by wheel, the
 * sixteen nodes round the place are blended along the ratio and the spin, in float as they are stored:
 * neither changes much with the motion, and the last two coordinates, which do, are left to kl_real.
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
#define QUAD(q, i) ((q)[i])
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
#define QUAD(q, i) ((q).part[i])
#endif

/* Where a coordinate is: the node below, and the part of the way to the next. */
struct place {
    uint32_t node;
    kl_real t;
};

/* `x` is within the axis but for rounding. No search: the bin tells the cell, but for one node in it. */
static inline struct place place_on(const struct kl_creep_axis *axis, kl_real x) {
    uint32_t bin = (uint32_t)((x + axis->offset) * axis->scale);
    bin = bin < KL_CREEP_BINS ? bin : KL_CREEP_BINS - 1;
    uint32_t node = axis->cell[bin];
    node += x >= axis->node[node + 1];
    node = node < axis->n - 2 ? node : axis->n - 2;
    const struct place place = {node, (x - axis->node[node]) * axis->inverse[node]};
    return place;
}

static inline struct place place_of_ratio(const struct kl_creep_table *table, kl_real at) {
    uint32_t node = (uint32_t)at;
    node = node < table->n_ratio - 2 ? node : table->n_ratio - 2;
    const struct place place = {node, at - (kl_real)node};
    return place;
}

/* What one wheel takes from the table. */
struct reading {
    kl_quad corner[2][2]; /* [angle][creep] */
    kl_real angle;        /* parts of the way */
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
    const uint32_t by_angle = 3 * table->creep.n;
    const uint32_t by_spin = by_angle * table->angle.n;
    const uint32_t by_ratio = by_spin * table->spin.n;
    const float *base =
        table->rest + i.node * by_ratio + j.node * by_spin + l.node * by_angle + 3 * k.node;
    const float across = (float)i.t;
    const float spin = (float)j.t;
    for (uint32_t a = 0; a < 2; a++) {
        for (uint32_t c = 0; c < 2; c++) {
            const float *at = base + a * by_angle + 3 * c;
            const kl_quad low = quad_between(quad_at(at), quad_at(at + by_ratio), across);
            const kl_quad high =
                quad_between(quad_at(at + by_spin), quad_at(at + by_spin + by_ratio), across);
            r->corner[a][c] = quad_between(low, high, spin);
        }
    }
    const float *pure = table->pure + i.node * table->spin.n + j.node;
    const float *next = pure + table->spin.n;
    const float before = pure[0] + across * (next[0] - pure[0]);
    const float after = pure[1] + across * (next[1] - pure[1]);
    const float *stiff = table->stiffness + j.node * table->creep.n + k.node;
    const float *more = stiff + table->creep.n;
    const float creep = (float)k.t;
    const float slow = stiff[0] + creep * (stiff[1] - stiff[0]);
    const float fast = more[0] + creep * (more[1] - more[0]);
    r->angle = l.t;
    r->creep = k.t;
    r->pure = (kl_real)(before + spin * (after - before));
    r->stiffness = (kl_real)(slow + spin * (fast - slow));
}

/* Both wheels' readings of one number; `left` is not looked at where lanes are single. */
#if KL_LANES == 2
#define BOTH(r, member) kl_lane_of((r)[0].member, (r)[1].member, 0)
#define PART(r, a, c, i)                                                                           \
    kl_lane_of((kl_real)QUAD((r)[0].corner[a][c], i), (kl_real)QUAD((r)[1].corner[a][c], i), 0)
#define PART_OF_LANE(x, s) ((x)[s])
#else
#define BOTH(r, member) ((r)[0].member)
#define PART(r, a, c, i) ((kl_real)QUAD((r)[0].corner[a][c], i))
#define PART_OF_LANE(x, s) (x)
#endif

static inline kl_lane blend(const struct reading *r, int i, kl_lane angle, kl_lane creep) {
    const kl_lane low = PART(r, 0, 0, i) + angle * (PART(r, 1, 0, i) - PART(r, 0, 0, i));
    const kl_lane high = PART(r, 0, 1, i) + angle * (PART(r, 1, 1, i) - PART(r, 0, 1, i));
    return low + creep * (high - low);
}

void kl_lane_creep_table(const struct kl_creep_table *table, const struct kl_creep_lanes *in,
                         struct kl_creep_lanes_force *out) {
    const kl_lane zero = kl_lane_all(KL_R(0));
    const kl_lane one = kl_lane_all(KL_R(1));
    const kl_lane two = kl_lane_all(KL_R(2));
    const kl_lane least = kl_lane_all(KL_R(1e-15));
    /* the half of creepage space that is stored: spin >= 0, x >= 0; without spin also y >= 0, so that
     * the mirror image is the same to the bit */
    const kl_lane turn = one - kl_lane_positive_or_0(-kl_lane_if_0(in->p, in->y, in->p), two);
    const kl_lane way = one - kl_lane_positive_or_0(-in->x, two);
    const kl_lane x = way * in->x;
    const kl_lane y = turn * in->y;
    const kl_lane spin = in->shape[1] * (turn * in->p);
    const kl_lane bent = table->alpha * spin;
    const kl_lane s = kl_lane_sqrt(KL_R(1) + bent * bent);
    const kl_lane r = kl_lane_sqrt(x * x + y * y);
    /* w = P/(P + beta), u = r/(r + gamma s), 1/s by one division; the direction and t by another */
    const kl_lane u_below = r + table->gamma * s;
    const kl_lane w_below = spin + kl_lane_all(table->beta);
    const kl_lane by_1 = KL_R(1) / ((u_below * w_below) * s);
    const kl_lane u = r * (w_below * s) * by_1;
    const kl_lane w = spin * (u_below * s) * by_1;
    const kl_lane inv_s = (u_below * w_below) * by_1;
    const kl_lane r_1 = kl_lane_max(r, least);
    const kl_lane t_below = r_1 + x;
    const kl_lane by_2 = KL_R(1) / (r_1 * t_below);
    const kl_lane t = y * r_1 * by_2;
    const kl_lane c = x * t_below * by_2;
    const kl_lane n = y * t_below * by_2;

    struct reading reading[KL_LANES];
    for (int i = 0; i < KL_LANES; i++) {
        read_table(table, PART_OF_LANE(in->shape[0], i), PART_OF_LANE(w, i), PART_OF_LANE(u, i),
                   PART_OF_LANE(t, i), &reading[i]);
    }
    const kl_lane angle = BOTH(reading, angle);
    const kl_lane creep = BOTH(reading, creep);
    const kl_lane along = blend(reading, 0, angle, creep);
    const kl_lane across = blend(reading, 1, angle, creep);
    const kl_lane faded = one - u;
    const kl_lane t1 = along * c - across * n;
    const kl_lane t2 = (along * n + across * c) + BOTH(reading, pure) * (faded * faded);
    /* interpolation may pass mu N by some thousandths: with |T|^2 = 1 + e, 1 - e/2 is enough for any e
     * up to 3, as (1 - e/2)^2 (1 + e) = 1 - 3/4 e^2 + e^3/4, and needs no root */
    const kl_lane excess = kl_lane_max((t1 * t1 + t2 * t2) - one, zero);
    const kl_lane limited = one - KL_R(0.5) * excess;
    out->t1 = way * (limited * t1);
    out->t2 = turn * (limited * t2);
    out->m3 = turn * (in->shape[2] * blend(reading, 2, angle, creep));
    out->reduction = kl_lane_min(BOTH(reading, stiffness) * inv_s, one);
}
