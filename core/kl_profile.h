/*
 * kl_profile.h - the cross-section of a wheel or of a rail.
 *
 * Local coordinates of one side, the same for right and left: eta grows INBOARD (from the field
 * side towards the flange, for the wheel; from the field side towards the gauge corner, for the
 * rail), zeta grows DOWN. tan(delta) = dzeta/deta, so delta > 0 on the tread and grows towards the
 * flange.
 */
#ifndef KL_PROFILE_H
#define KL_PROFILE_H

#include "kl_base.h"

#ifdef __cplusplus
extern "C" {
#endif

#define KL_PROFILE_MIN_POINTS 8
#define KL_PROFILE_MAX_POINTS 4096

enum kl_profile_kind {
    KL_PROFILE_POINTS = 0, /* a cubic spline through points, or near them */
    KL_PROFILE_ARC = 1 /* one circular arc through eta = 0, zeta = 0; radius 0: a straight cone */
};

/* A profile as the user gives it. Angles in rad, lengths in m. Pointers are only read while
 * building. */
struct kl_profile_def {
    enum kl_profile_kind kind;
    uint32_t n_points;   /* POINTS: KL_PROFILE_MIN_POINTS..KL_PROFILE_MAX_POINTS */
    const double *eta_m; /* POINTS: strictly increasing (if smoothed: in order along the section) */
    const double *zeta_m; /* POINTS */
    double smoothing_m;   /* POINTS: 0: the spline meets every point; else 1e-7..1e-3, how far the
                             points may lie off a smooth curve (root mean square along the
                             section), see kl_smooth.h */
    double radius_m;      /* ARC: > 0, delta grows with eta; 0 means straight */
    double slope_rad;     /* ARC: delta at eta = 0, |slope| < 0.5 */
    double half_width_m;  /* ARC: valid for |eta| <= half_width, > 0 and below the radius */
};

/* One point of a profile. */
struct kl_profile_point {
    double zeta_m;
    double slope;      /* dzeta/deta = tan(delta) */
    double second_1_m; /* d2zeta/deta2 */
};

/* A profile ready for evaluation; memory is the arena's. */
struct kl_profile {
    enum kl_profile_kind kind;
    uint32_t n_points;
    const double *eta_m;
    const double *zeta_m;
    const double *second_1_m; /* second derivatives at the points (natural spline) */
    double radius_m;
    double sin_slope;
    double cos_slope;
    double tan_slope;
    double eta_min_m;
    double eta_max_m;
};

/*
 * Checks a definition and prepares it; `rotate_rad` turns the cross-section first (rail cant:
 * positive turns the head towards the track's middle, that is adds to delta). KL_ERR_PROFILE: too
 * few or too many points, eta not strictly increasing (also after turning and smoothing), a slope
 * above 100 (89.4 degrees), or a smoothing that cannot be had (see kl_smooth.h). KL_ERR_VALUE: a
 * value that is not finite or out of range. KL_ERR_MEMORY. Bound: linear in n_points.
 */
enum kl_status kl_profile_build(const struct kl_profile_def *def, double rotate_rad,
                                struct kl_arena *arena, struct kl_profile *profile,
                                struct kl_diag *diag);

/* Evaluates at eta; outside [eta_min, eta_max] the end's tangent continues. Bound: 13 halvings. */
struct kl_profile_point kl_profile_at(const struct kl_profile *profile, double eta_m);

#ifdef __cplusplus
}
#endif
#endif
