/*
 * kl_smooth.h - a smooth curve through measured points of a cross-section. Internal to the core
 * (profile room).
 *
 * The curve is a plane cubic B-spline c(s) over the arc length s, with knots KL_SMOOTH_KNOT_M
 * apart, the smoothest one that stays as near to the points as is asked for. It minimises
 *     sum w_i |p_i - c(s_i)|^2 + lambda sum S_k |third difference of the coefficients|_k^2
 * (P. Eilers, B. Marx, Flexible smoothing with B-splines and penalties, Statistical Science 11
 * (1996) 89-121). Third differences make arcs of any radius nearly free of charge, so curvature is
 * not pulled towards zero as by the usual penalty on the second derivative. The stiffness S_k goes
 * with the inverse square of the curve's own third difference around k, from one round to the next:
 * where one arc gives way to another the curve may turn quickly, along an arc it averages over a
 * long way. Over arc length and not over eta, so that a steep flange is smoothed as the tread is,
 * points that noise has thrown back in eta are welcome, and turning the section first or last is
 * the same.
 *
 * lambda is the one that foretells points best which the curve has not seen (generalised
 * cross-validation: P. Craven, G. Wahba 1979; a freedom counted 1.4 times), and smaller than that
 * only where the deviation would exceed the tolerance: the root of the mean square, over the arc
 * length, of the points' distances from the curve along its normal. So the tolerance is a bound and
 * may be generous, 1.5 times the scatter of the points; held against the scatter it would decide,
 * and by 2 % too little of it makes waves of the scatter. The places s_i are first those along a
 * chain of chords of at least KL_SMOOTH_CHORD_M; in each round they move to the foot of the normal
 * through p_i.
 */
#ifndef KL_SMOOTH_H
#define KL_SMOOTH_H

#include "kl_base.h"

#define KL_SMOOTH_KNOT_M 2.5e-4
#define KL_SMOOTH_CHORD_M 5e-4
#define KL_SMOOTH_MAX_SPANS 2000u /* spans between knots: 0.5 m of arc length */

/* Measured points, in order along the section. */
struct kl_smooth_points {
    uint32_t n;
    const double *x_m;
    const double *y_m;
};

/*
 * How many points kl_smooth will give: knots of the curve, both ends included. 0 where the points
 * are all in one place or the curve is longer than the knots reach. Bound: linear in n.
 */
uint32_t kl_smooth_size(const struct kl_smooth_points *points);

/*
 * Writes the curve's points at its knots to x_out_m and y_out_m (kl_smooth_size of them); they may
 * not be the arrays read. `tolerance_m` > 0. The scratch memory, 16 bytes per point and 150 per knot, is taken from the arena and put back. KL_ERR_MEMORY; KL_ERR_PROFILE: the size is 0, or
 * no curve with these knots comes as near as the tolerance (`diag` holds how near the best one
 * comes). Bound: 100 solutions, each linear in points and knots.
 */
enum kl_status kl_smooth(const struct kl_smooth_points *points, double tolerance_m,
                         struct kl_arena *arena, double *x_out_m, double *y_out_m,
                         struct kl_diag *diag);

#endif
