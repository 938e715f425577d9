/*
 * kl_creep_lookup.c - reads the creep-force table, both wheels at once.
 *
 * The coordinates and what follows from the result is done in lanes. Between them, wheel by wheel,
 * the sixteen nodes round the place are blended along the ratio and the spin, in float as they are
 * stored: neither changes much with the motion, and the last two coordinates, which do, are left to
 * kl_real.
 */
#include "kl_creep_lanes.h"

#include <stddef.h>

/* Three floats and one that is not needed: the parts of a node, see struct kl_creep_table. */
#if KL_LANES == 2
typedef float kl_quad __attribute__((vector_size(16)));
static inline kl_quad quad_at(const float *from) {
    kl_quad q;
    __builtin_memcpy(&q, from, sizeof q);
    return q;
}
#endif

/* The weights of a rectangle's corners. */
struct weights {
    float low;
    float ratio; /* the next ratio */
    float spin;  /* the next spin */
    float both;
};

/* How many floats on the next node along the ratio and the spin is. */
struct strides {
    size_t ratio;
    size_t spin;
};

#if KL_LANES == 2
static inline kl_quad weighed(const float *at, struct strides by, struct weights w) {
    const float *next = at + by.spin;
    return (quad_at(at) * w.low + quad_at(at + by.ratio) * w.ratio) +
           (quad_at(next) * w.spin + quad_at(next + by.ratio) * w.both);
}
#else
typedef struct {
    float part[3];
} kl_quad;
static inline kl_quad weighed(const float *at, struct strides by, struct weights w) {
    kl_quad q;
    const float *next = at + by.spin;
    for (size_t i = 0; i < 3; i++) {
        q.part[i] = (at[i] * w.low + at[i + by.ratio] * w.ratio) +
                    (next[i] * w.spin + next[i + by.ratio] * w.both);
    }
    return q;
}
#endif

/* Where a coordinate is: the node below, and the part of the way to the next. */
struct place {
    size_t node;
    kl_real t;
};

/* `x` is in 0..KL_CREEP_BINS but for rounding. No search: the bin tells the cell, or the one before.
 */
static inline struct place place_on(const struct kl_creep_axis *axis, kl_real x) {
    size_t node = axis->bin[(ptrdiff_t)x];
    node += x >= axis->cell[node].next;
    const struct kl_creep_cell *cell = &axis->cell[node];
    const struct place place = {node, (x - cell->low) * cell->inverse};
    return place;
}

static inline struct place place_of_ratio(const struct kl_creep_table *table, kl_real at) {
    const size_t last = table->n_ratio - 2u;
    size_t node = (size_t)(ptrdiff_t)at;
    node = node < last ? node : last;
    const struct place place = {node, at - (kl_real)(ptrdiff_t)node};
    return place;
}

/*
 * Two functions of two coordinates each, bilinear: of f the next value of the first coordinate lies
 * f_row floats on, that of the second one float; of g likewise. `first` and `second` are the parts
 * of the way of both.
 */
struct flat {
    const float *f;
    const float *g;
    size_t f_row;
    size_t g_row;
};
#if KL_LANES == 2
typedef kl_quad kl_two; /* f, g and two that are not needed */
typedef double kl_moved __attribute__((vector_size(16)));

/* Two floats of either function side by side. They are only moved, whatever the doubles would be. */
static inline kl_quad beside(const float *f, const float *g) {
    double a;
    double b;
    __builtin_memcpy(&a, f, sizeof a);
    __builtin_memcpy(&b, g, sizeof b);
    return (kl_quad)(kl_moved){a, b};
}
static inline kl_two read_flat(const struct flat *at, const float first[2], const float second[2]) {
    const kl_quad low = beside(at->f, at->g);
    const kl_quad high = beside(at->f + at->f_row, at->g + at->g_row);
    const kl_quad t = {first[0], first[0], first[1], first[1]};
    const kl_quad between = low + t * (high - low);
    const kl_quad start = {between[0], between[2], between[0], between[2]};
    const kl_quad end = {between[1], between[3], between[1], between[3]};
    const kl_quad u = {second[0], second[1], second[0], second[1]};
    return start + u * (end - start);
}
#else
typedef struct {
    float part[2];
} kl_two;
static inline float read_one(const float *at, size_t row, float first, float second) {
    const float start = at[0] + first * (at[row] - at[0]);
    const float end = at[1] + first * (at[row + 1u] - at[1]);
    return start + second * (end - start);
}
static inline kl_two read_flat(const struct flat *at, const float first[2], const float second[2]) {
    const kl_two two = {{read_one(at->f, at->f_row, first[0], second[0]),
                         read_one(at->g, at->g_row, first[1], second[1])}};
    return two;
}
#endif

/* What one wheel takes from the table. */
struct reading {
    kl_quad corner[4]; /* angle and creep below; creep above; angle above; both above */
    kl_real angle;     /* parts of the way */
    kl_real creep;
    kl_two flat; /* pure, stiffness */
};

static inline void read_table(const struct kl_creep_table *table, kl_real ratio, kl_real w,
                              kl_real u, kl_real t, struct reading *r) {
    const struct place i = place_of_ratio(table, ratio);
    const struct place j = place_on(&table->spin, w);
    const struct place k = place_on(&table->creep, u);
    const struct place l = place_on(&table->angle, t);
    const size_t n_creep = table->creep.n;
    const size_t n_spin = table->spin.n;
    const size_t by_angle = 3u * n_creep;
    const size_t by_spin = by_angle * table->angle.n;
    const struct strides by = {by_spin * n_spin, by_spin};
    const float across = (float)i.t;
    const float spin = (float)j.t;
    const float both = across * spin;
    const struct weights weights = {(1.0F - across) - (spin - both), across - both, spin - both,
                                    both};
    const float *at =
        table->rest + ((i.node * by.ratio + j.node * by.spin) + (l.node * by_angle + 3u * k.node));
    r->corner[0] = weighed(at, by, weights);
    r->corner[1] = weighed(at + 3, by, weights);
    r->corner[2] = weighed(at + by_angle, by, weights);
    r->corner[3] = weighed(at + (by_angle + 3u), by, weights);
    r->angle = l.t;
    r->creep = k.t;
    const struct flat flat = {table->pure + (i.node * n_spin + j.node),
                              table->stiffness + (j.node * n_creep + k.node), n_spin, n_creep};
    const float first[2] = {across, spin};
    const float second[2] = {spin, (float)k.t};
    r->flat = read_flat(&flat, first, second);
}

/* Both wheels' readings of one number, or the one wheel's. */
#if KL_LANES == 2
#define BOTH(r, member) kl_lane_of((r)[0].member, (r)[1].member, 0)
#define PART(r, c, i) kl_lane_of((kl_real)(r)[0].corner[c][i], (kl_real)(r)[1].corner[c][i], 0)
#define FLAT(r, i) kl_lane_of((kl_real)(r)[0].flat[i], (kl_real)(r)[1].flat[i], 0)
#else
#define BOTH(r, member) ((r)[0].member)
#define PART(r, c, i) ((kl_real)(r)[0].corner[c].part[i])
#define FLAT(r, i) ((kl_real)(r)[0].flat.part[i])
#endif

static inline kl_lane blend(const struct reading *r, int i, kl_lane angle, kl_lane creep) {
    const kl_lane low = PART(r, 0, i) + angle * (PART(r, 2, i) - PART(r, 0, i));
    const kl_lane high = PART(r, 1, i) + angle * (PART(r, 3, i) - PART(r, 1, i));
    return low + creep * (high - low);
}

/* Where in the table, and how to turn what is found there. */
struct coordinates {
    kl_lane w; /* in bins */
    kl_lane u;
    kl_lane t;
    kl_lane faded;  /* 1 - u */
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
    const kl_lane by_1 = KL_R(KL_CREEP_BINS) / ((u_below * w_below) * (r + s));
    at.u = r * ((w_below * (r + s)) * by_1);
    at.faded = KL_R(1) - KL_R(1.0 / KL_CREEP_BINS) * at.u;
    at.w = spin * ((u_below * (r + s)) * by_1);
    at.inv_r_s = KL_R(1.0 / KL_CREEP_BINS) * ((u_below * w_below) * by_1);
    const kl_lane r_1 = kl_lane_max(r, kl_lane_all(KL_R(1e-15)));
    const kl_lane t_below = r_1 + x;
    const kl_lane by_2 = KL_R(1) / (r_1 * t_below);
    const kl_lane inv_r = t_below * by_2;
    at.t = KL_R(0.5 * KL_CREEP_BINS) * (KL_R(1) + y * (r_1 * by_2));
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
    const kl_lane t1 = along * at.cosine - across * at.sine;
    const kl_lane t2 =
        (along * at.sine + across * at.cosine) + FLAT(reading, 0) * (at.faded * at.faded);
    /* interpolation may pass mu N by some thousandths: with |T|^2 = 1 + e, 1 - e/2 is enough for
     * any e up to 2, as (1 - e/2)^2 (1 + e) = 1 - 3/4 e^2 + e^3/4, and needs no root */
    const kl_lane excess = kl_lane_max((t1 * t1 + t2 * t2) - one, zero);
    const kl_lane limited = one - KL_R(0.5) * excess;
    out->t1 = at.way * (limited * t1);
    out->t2 = at.turn * (limited * t2);
    out->m3 = at.turn * (in->shape[2] * blend(reading, 2, angle, creep));
    out->reduction = kl_lane_min(FLAT(reading, 1) * at.inv_r_s, one);
}
