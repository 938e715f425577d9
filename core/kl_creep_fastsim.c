/*
 * kl_creep_fastsim.c - Kalker's simplified theory on a fixed grid.
 *
 * In coordinates x/a, y/b, tractions times ab/(mu N): along a strip from its leading edge L = sqrt(1 -
 * y^2) backwards the traction grows by the slip over the flexibility, and is cut at the bound,
 *     dp_x = -(3/8 x_n - 4/pi (b/a) p_n y) dx,   dp_y = -(3/8 y_n + 4/pi p_n x) dx,   |p| <= q,
 * with the flexibilities L1 = 8a/(3 G C11), L2 = 8a/(3 G C22), L3 = pi a^2/(4 G c C23) put in. Strips
 * lie at the points of Gauss-Legendre, so that full adhesion is integrated exactly; tractions are
 * those of the elements' middles, and so are the slips between them. The bound is scaled so that all
 * of it sums up to mu N on this grid. A strip and its mirror image are added first, which makes the
 * mirrored contact the same to the bit.
 */
#include "kl_creep_lanes.h"

#define PAIRS (KL_FASTSIM_STRIPS / 2)
#define N KL_FASTSIM_STEPS

#if KL_FASTSIM_STRIPS != 10 || KL_FASTSIM_STEPS != 12
#error "the numbers below belong to 10 strips of 12 elements"
#endif

/* Gauss-Legendre: place, weight, and L */
static const kl_real strip[PAIRS][3] = {
    {KL_R(0.14887433898163122), KL_R(0.295524224714753), KL_R(0.9888561225945777)},
    {KL_R(0.4333953941292472), KL_R(0.2692667193099965), KL_R(0.9012038794565603)},
    {KL_R(0.6794095682990244), KL_R(0.219086362515982), KL_R(0.7337592510515512)},
    {KL_R(0.8650633666889845), KL_R(0.14945134915058036), KL_R(0.5016626073495208)},
    {KL_R(0.9739065285171717), KL_R(0.06667134430868807), KL_R(0.22694949594927788)}};

/* 1 - xi^2 and its root at the middles xi = 1 - (2i + 1)/N, and what makes all of it 1 */
static const kl_real parabola[N] = {
    KL_R(0.15972222222222232), KL_R(0.4375), KL_R(0.6597222222222223),
    KL_R(0.826388888888889),   KL_R(0.9375), KL_R(0.9930555555555556),
    KL_R(0.9930555555555556),  KL_R(0.9375), KL_R(0.826388888888889),
    KL_R(0.6597222222222223),  KL_R(0.4375), KL_R(0.15972222222222232)};
static const kl_real circle[N] = {
    KL_R(0.39965262694272674), KL_R(0.6614378277661477), KL_R(0.8122328620674137),
    KL_R(0.9090593428863095),  KL_R(0.9682458365518543), KL_R(0.9965217285917832),
    KL_R(0.9965217285917832),  KL_R(0.9682458365518543), KL_R(0.9090593428863095),
    KL_R(0.8122328620674137),  KL_R(0.6614378277661477), KL_R(0.39965262694272674)};
#define PARABOLA_SCALE 0.6344285800726986 /* 2/pi on an infinitely fine grid */
#define CIRCLE_SCALE 0.4739685692360489   /* 3/(2 pi) */

/* What a strip adds up to, per length of an element. */
struct strip_sum {
    kl_lane x;
    kl_lane y;
    kl_lane turn;  /* of x/a p_y */
    kl_lane slope; /* no less than that of the traction by the creepage */
};

/* `slip_x` is constant over the strip, `slip_y` grows by `turning` along it. */
static inline struct strip_sum one_strip(kl_lane slip_x, kl_lane slip_y, kl_lane turning,
                                         kl_real half, const kl_real *bound, kl_real scale) {
    const kl_lane zero = kl_lane_all(KL_R(0));
    const kl_lane least = kl_lane_all(KL_R(1e-15));
    const kl_lane one = kl_lane_all(KL_R(1));
    const kl_real step = half * KL_R(2.0 / N);
    struct strip_sum sum = {zero, zero, zero, zero};
    kl_lane p_x = zero;
    kl_lane p_y = zero;
    kl_lane slope = zero;
    for (int i = 0; i < N; i++) {
        /* half an element from the edge to the first middle, then from middle to middle */
        const kl_real length = i == 0 ? KL_R(0.5) * step : step;
        const kl_real at = i == 0 ? half - KL_R(0.25) * step : half - (kl_real)i * step;
        const kl_real middle = half - ((kl_real)i + KL_R(0.5)) * step;
        p_x = p_x - length * slip_x;
        p_y = p_y - length * (slip_y + at * turning);
        const kl_lane size = kl_lane_max(kl_lane_sqrt(p_x * p_x + p_y * p_y), least);
        const kl_lane cut = kl_lane_min(kl_lane_all(scale * bound[i]) / size, one);
        p_x = cut * p_x;
        p_y = cut * p_y;
        slope = cut * (slope + kl_lane_all(KL_R(3.0 / 8.0) * length));
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
    const kl_lane slip_x = KL_R(3.0 / 8.0) * in->x;
    const kl_lane slip_y = KL_R(3.0 / 8.0) * in->y;
    const kl_lane turning = KL_R(4.0 / KL_PI) * in->p;
    const kl_lane across = turning * in->shape[2];
    kl_lane x = zero;
    kl_lane y = zero;
    kl_lane turn = zero;
    kl_lane slope = zero;
    for (int j = 0; j < PAIRS; j++) {
        const kl_real at = strip[j][0];
        const kl_real half = strip[j][2];
        const kl_real weight = strip[j][1] * (half * KL_R(2.0 / N));
        const kl_real scale =
            elliptic ? KL_R(CIRCLE_SCALE) * half : KL_R(PARABOLA_SCALE) * (half * half);
        const kl_real *bound = elliptic ? circle : parabola;
        const struct strip_sum right =
            one_strip(slip_x - across * at, slip_y, turning, half, bound, scale);
        const struct strip_sum left =
            one_strip(slip_x + across * at, slip_y, turning, half, bound, scale);
        x = x + weight * (right.x + left.x);
        y = y + weight * (right.y + left.y);
        turn = turn + weight * (in->shape[0] * (right.turn + left.turn) -
                                in->shape[1] * (at * (right.x - left.x)));
        slope = slope + weight * (right.slope + left.slope);
    }
    out->t1 = x;
    out->t2 = y;
    out->m3 = turn;
    out->reduction = kl_lane_min(slope, kl_lane_all(KL_R(1)));
}
