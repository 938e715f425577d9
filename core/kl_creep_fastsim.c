/*
 * kl_creep_fastsim.c - Kalker's simplified theory on a fixed grid.
 *
 * In coordinates x/a, y/b, tractions times ab/(mu N): along a strip, from its leading edge L =
 * sqrt(1 - y^2) backwards, the traction grows by the slip over the flexibility and is cut at the
 * bound q,
 *     dp_x = -(3/8 x_n - 4/pi (b/a) p_n y) dx,   dp_y = -(3/8 y_n + 4/pi p_n x) dx,   |p| <= q,
 * with the flexibilities L1 = 8a/(3 G C11), L2 = 8a/(3 G C22), L3 = pi a^2/(4 G c C23) put in.
 * A step of length s changes the traction by e = -s w, w the slip over the flexibility. Where all
 * sticks that is exact. Where all slides p turns into the direction of -w, which moves along with
 * the spin; cutting p + e back to the bound alone is a step of first order, too slow a turn by half
 * of s |w|/q. So of what the bound cuts off, 1 - k with k = q/|p + e|, half is made good along e:
 *     p <- k p + (1 + k)/2 e, cut to q,
 * in a small turn of angle f by f/(1 + K + K^2/2), K = s |w|/q, for f exp(-K). e belongs to the
 * middle of the step, but where p follows it at once, K large, to its end: it is moved there by
 * (1 - k)^2. Both take the error of 10 x 10 elements, on average over the points of
 * tests/reference/creep_forces.csv, to a sixth of what cutting alone leaves.
 *
 * The elements' tractions are taken LAG behind their middles, which is nearer to CONTACT's FASTSIM:
 * that has them at the ends of 40 elements, an eighth of an element here, and is itself up to 0.022
 * mu N from the limit of infinitely many elements (docs/creep_laws.md).
 *
 * Strips are of equal width. The bound and the slips are scaled so that full sliding gives mu N and
 * full adhesion the linear theory on this very grid. A strip and its mirror image are added first,
 * which makes the mirrored contact the same to the bit.
 */
#include "kl_creep_lanes.h"

#define PAIRS (KL_FASTSIM_STRIPS / 2)
#define N KL_FASTSIM_STEPS

#if KL_FASTSIM_STRIPS != 10 || KL_FASTSIM_STEPS != 10
#error "the numbers below belong to 10 strips of 10 elements"
#endif

/* y = 0.1, 0.3, ...: L = sqrt(1 - y^2) */
static const kl_real half_length[PAIRS] = {KL_R(0.99498743710662), KL_R(0.9539392014169457),
                                           KL_R(0.8660254037844386), KL_R(0.714142842854285),
                                           KL_R(0.4358898943540673)};

/* 1 - xi^2 and its root at the middles xi = 1 - (2i + 1)/N */
static const kl_real parabola[N] = {KL_R(0.18999999999999995), KL_R(0.51), KL_R(0.75),
                                    KL_R(0.9099999999999999),  KL_R(0.99), KL_R(0.99),
                                    KL_R(0.9099999999999999),  KL_R(0.75), KL_R(0.51),
                                    KL_R(0.19000000000000017)};
static const kl_real circle[N] = {KL_R(0.4358898943540673), KL_R(0.714142842854285),
                                  KL_R(0.8660254037844386), KL_R(0.9539392014169457),
                                  KL_R(0.99498743710662),   KL_R(0.99498743710662),
                                  KL_R(0.9539392014169457), KL_R(0.8660254037844386),
                                  KL_R(0.714142842854285),  KL_R(0.43588989435406755)};

/* What makes sums over the grid right; in brackets that of an infinitely fine one. */
#define PARABOLA_SCALE 0.6325011292767155 /* (2/pi) 1 over the sum of L^2 (1 - xi^2) over all */
#define CIRCLE_SCALE 0.470536898761719    /* (3/(2 pi)) of L sqrt(1 - xi^2) */
#define CREEP_SCALE 0.36762002793912218   /* (3/8) */
#define ACROSS_SCALE 1.2242455441208331   /* (4/pi) by the moment of all p_x */
#define TURNING_SCALE 1.2654272154541433  /* (4/pi) by the force of all p_y */

/* How far behind an element's middle its traction is taken, in elements. */
#define LAG 0.075

/* What a strip adds up to, per length of an element. */
struct strip_sum {
    kl_lane x;
    kl_lane y;
    kl_lane turn;  /* of x/a p_y */
    kl_lane slope; /* no less than that of the traction by the creepage */
};

static inline kl_lane cut_at(kl_lane p_x, kl_lane p_y, kl_real bound) {
    const kl_lane size = kl_lane_max(kl_lane_sqrt(p_x * p_x + p_y * p_y), kl_lane_all(KL_R(1e-15)));
    return kl_lane_min(kl_lane_all(bound) / size, kl_lane_all(KL_R(1)));
}

/* `slip_x` is constant over the strip, `slip_y` grows by `turning` along it. */
static inline struct strip_sum one_strip(kl_lane slip_x, kl_lane slip_y, kl_lane turning,
                                         kl_real half, const kl_real *bound, kl_real scale) {
    const kl_lane zero = kl_lane_all(KL_R(0));
    const kl_real step = half * KL_R(2.0 / N);
    struct strip_sum sum = {zero, zero, zero, zero};
    kl_lane p_x = zero;
    kl_lane p_y = zero;
    kl_lane slope = zero;
    for (int i = 0; i < N; i++) {
        /* from the edge to where the first element's traction is taken, then from one to the next */
        const kl_real length = i == 0 ? KL_R(0.5 + LAG) * step : step;
        const kl_real at =
            i == 0 ? half - KL_R(0.5) * length : half - ((kl_real)i + KL_R(LAG)) * step;
        const kl_real middle = half - ((kl_real)i + KL_R(0.5)) * step;
        const kl_real q = scale * bound[i];
        const kl_lane by_x = -length * slip_x;
        const kl_lane by_y = -length * (slip_y + at * turning);
        const kl_lane stuck = cut_at(p_x + by_x, p_y + by_y, q);
        const kl_lane slid = KL_R(1) - stuck;
        const kl_lane half_more = KL_R(0.5) * (KL_R(1) + stuck);
        p_x = stuck * p_x + half_more * by_x;
        p_y = stuck * p_y + half_more * (by_y + slid * slid * ((length * (at - middle)) * turning));
        const kl_lane cut = cut_at(p_x, p_y, q);
        p_x = cut * p_x;
        p_y = cut * p_y;
        slope = cut * (stuck * slope + half_more * kl_lane_all(KL_R(CREEP_SCALE) * length));
        sum.x = sum.x + p_x;
        sum.y = sum.y + p_y;
        sum.turn = sum.turn + middle * p_y;
        sum.slope = sum.slope + slope;
    }
    return sum;
}

void kl_lane_creep_fastsim(int elliptic, const struct kl_creep_lanes *in,
                           struct kl_creep_lanes_force *out) {
    const kl_lane zero = kl_lane_all(KL_R(0));
    const kl_lane slip_x = KL_R(CREEP_SCALE) * in->x;
    const kl_lane slip_y = KL_R(CREEP_SCALE) * in->y;
    const kl_lane turning = KL_R(TURNING_SCALE) * in->p;
    const kl_lane across = KL_R(ACROSS_SCALE) * in->p * in->shape[2];
    kl_lane x = zero;
    kl_lane y = zero;
    kl_lane turn = zero;
    kl_lane slope = zero;
    for (int j = 0; j < PAIRS; j++) {
        const kl_real at = ((kl_real)j + KL_R(0.5)) * KL_R(2.0 / KL_FASTSIM_STRIPS);
        const kl_real half = half_length[j];
        const kl_real area = half * KL_R(2.0 / N) * KL_R(2.0 / KL_FASTSIM_STRIPS);
        const kl_real scale =
            elliptic ? KL_R(CIRCLE_SCALE) * half : KL_R(PARABOLA_SCALE) * (half * half);
        const kl_real *bound = elliptic ? circle : parabola;
        const struct strip_sum right =
            one_strip(slip_x - across * at, slip_y, turning, half, bound, scale);
        const struct strip_sum left =
            one_strip(slip_x + across * at, slip_y, turning, half, bound, scale);
        x = x + area * (right.x + left.x);
        y = y + area * (right.y + left.y);
        turn = turn + area * (in->shape[0] * (right.turn + left.turn) -
                              in->shape[1] * (at * (right.x - left.x)));
        slope = slope + area * (right.slope + left.slope);
    }
    out->t1 = x;
    out->t2 = y;
    out->m3 = turn;
    out->reduction = kl_lane_min(slope, kl_lane_all(KL_R(1)));
}
