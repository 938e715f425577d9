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
    KL_PROFILE_POINTS = 0, /* a cubic spline through points */
    KL_PROFILE_ARC = 1 /* one circular arc through eta = 0, zeta = 0; radius 0: a straight cone */
};

/* A profile as the user gives it. Angles in rad, lengths in m. Pointers are only read while
 * building. */
struct kl_profile_def {
    enum kl_profile_kind kind;
    uint32_t n_points;     /* POINTS: KL_PROFILE_MIN_POINTS..KL_PROFILE_MAX_POINTS */
    const kl_real *eta_m;  /* POINTS: strictly increasing */
    const kl_real *zeta_m; /* POINTS */
    kl_real radius_m;      /* ARC: > 0, delta grows with eta; 0 means straight */
    kl_real slope_rad;     /* ARC: delta at eta = 0, |slope| < 0.5 */
    kl_real half_width_m;  /* ARC: valid for |eta| <= half_width, > 0 and below the radius */
};

/* One point of a profile. */
struct kl_profile_point {
    kl_real zeta_m;
    kl_real slope;      /* dzeta/deta = tan(delta) */
    kl_real second_1_m; /* d2zeta/deta2 */
};

/* A profile ready for evaluation; memory is the arena's. */
struct kl_profile {
    enum kl_profile_kind kind;
    uint32_t n_points;
    const kl_real *eta_m;
    const kl_real *zeta_m;
    const kl_real *second_1_m; /* second derivatives at the points (natural spline) */
    kl_real radius_m;
    kl_real sin_slope;
    kl_real cos_slope;
    kl_real tan_slope;
    kl_real eta_min_m;
    kl_real eta_max_m;
};

/*
 * Checks a definition and prepares it; `rotate_rad` turns the cross-section first (rail cant:
 * positive turns the head towards the track's middle, that is adds to delta). KL_ERR_PROFILE: too
 * few or too many points, eta not strictly increasing (also after turning), or a slope above 20 (87
 * degrees). KL_ERR_VALUE: a value that is not finite or out of range. KL_ERR_MEMORY. Bound: linear
 * in n_points.
 */
enum kl_status kl_profile_build(const struct kl_profile_def *def, kl_real rotate_rad,
                                struct kl_arena *arena, struct kl_profile *profile,
                                struct kl_diag *diag);

/* Evaluates at eta; outside [eta_min, eta_max] the end's tangent continues. Bound: 13 halvings. */
struct kl_profile_point kl_profile_at(const struct kl_profile *profile, kl_real eta_m);

#ifdef __cplusplus
}
#endif
#endif
