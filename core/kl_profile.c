/* kl_profile.c - cross-sections: natural cubic spline through points or near them, circular arc, straight cone.
 */
#include "kl_profile.h"

#include "kl_diag.h"
#include "kl_math.h"
#include "kl_smooth.h"

#define STEEPEST_SLOPE 100.0

static enum kl_status build_arc(const struct kl_profile_def *def, double rotate_rad,
                                struct kl_profile *profile, struct kl_diag *diag) {
    const double slope = def->slope_rad + rotate_rad;
    if (!kl_finite(def->radius_m) || def->radius_m < 0.0) {
        return kl_report(diag, KL_ERR_VALUE, "profile arc: radius_m must be >= 0", -1,
                         def->radius_m);
    }
    if (!(kl_abs(slope) < 0.5)) {
        return kl_report(diag, KL_ERR_VALUE, "profile arc: |slope_rad| must be below 0.5", -1,
                         slope);
    }
    if (!(def->half_width_m > 0.0 && def->half_width_m < 1.0)) {
        return kl_report(diag, KL_ERR_VALUE, "profile arc: half_width_m must be in 0..1", -1,
                         def->half_width_m);
    }
    profile->kind = KL_PROFILE_ARC;
    profile->radius_m = def->radius_m;
    profile->sin_slope = kl_sin(slope);
    profile->cos_slope = kl_cos(slope);
    profile->tan_slope = profile->sin_slope / profile->cos_slope;
    profile->eta_min_m = -def->half_width_m;
    profile->eta_max_m = def->half_width_m;
    if (def->radius_m > 0.0) {
        /* keep clear of the arc's vertical tangents */
        const double inner = (0.998 - profile->sin_slope) * def->radius_m;
        const double outer = (-0.998 - profile->sin_slope) * def->radius_m;
        profile->eta_max_m = inner < profile->eta_max_m ? inner : profile->eta_max_m;
        profile->eta_min_m = outer > profile->eta_min_m ? outer : profile->eta_min_m;
    }
    return KL_OK;
}

/* Natural cubic spline: the tridiagonal system for the second derivatives, solved in place. */
static void spline(const double *x, const double *y, double *second, double *work, uint32_t n) {
    second[0] = 0.0;
    work[0] = 0.0;
    for (uint32_t i = 1; i + 1 < n; i++) {
        const double h0 = x[i] - x[i - 1];
        const double h1 = x[i + 1] - x[i];
        const double part = h0 / (h0 + h1);
        const double p = part * second[i - 1] + 2.0;
        second[i] = (part - 1.0) / p;
        const double rise = (y[i + 1] - y[i]) / h1 - (y[i] - y[i - 1]) / h0;
        work[i] = (6.0 * rise / (h0 + h1) - part * work[i - 1]) / p;
    }
    second[n - 1] = 0.0;
    for (uint32_t i = n - 1; i-- > 0;) {
        second[i] = second[i] * second[i + 1] + work[i];
    }
}

/* Points turned by `rotate_rad`, as they come. */
static enum kl_status turn_points(const struct kl_profile_def *def, double rotate_rad, double *eta,
                                  double *zeta, struct kl_diag *diag) {
    const double c = kl_cos(rotate_rad);
    const double s = kl_sin(rotate_rad);
    for (uint32_t i = 0; i < def->n_points; i++) {
        const double e = def->eta_m[i];
        const double z = def->zeta_m[i];
        if (!(kl_abs(e) < 1.0 && kl_abs(z) < 1.0)) {
            return kl_report(diag, KL_ERR_VALUE, "profile point is not finite or beyond 1 m",
                             (int32_t)i, kl_abs(e) < 1.0 ? z : e);
        }
        eta[i] = c * e - s * z;
        zeta[i] = s * e + c * z;
    }
    return KL_OK;
}

/* zeta is a function of eta, and not too steep. */
static enum kl_status check_points(const double *eta, const double *zeta, uint32_t n,
                                   double rotate_rad, struct kl_diag *diag) {
    for (uint32_t i = 1; i < n; i++) {
        if (!(eta[i] - eta[i - 1] > 1e-7)) {
            return kl_report(diag, KL_ERR_PROFILE,
                             "profile: eta must grow from point to point by more than 1e-7 m",
                             (int32_t)i, eta[i]);
        }
        if (!(kl_abs(zeta[i] - zeta[i - 1]) < STEEPEST_SLOPE * (eta[i] - eta[i - 1]))) {
            return kl_report(diag, KL_ERR_PROFILE,
                             rotate_rad != 0.0 ? "profile, turned by the rail's inclination, is "
                                                 "steeper than 89.4 degrees (canted already?)"
                                               : "profile is steeper than 89.4 degrees",
                             (int32_t)i, eta[i]);
        }
    }
    return KL_OK;
}

/* The points that the spline goes through: those of the definition, or the knots of the smooth
 * curve near them. They stay in the arena. */
static enum kl_status spline_points(const struct kl_profile_def *def, double rotate_rad,
                                    struct kl_arena *arena, struct kl_profile *profile,
                                    struct kl_diag *diag) {
    double *eta = kl_arena_take(arena, def->n_points, sizeof *eta);
    double *zeta = kl_arena_take(arena, def->n_points, sizeof *zeta);
    if (eta == NULL || zeta == NULL) {
        return kl_report(diag, KL_ERR_MEMORY, "profile points", -1, (double)arena->wanted);
    }
    enum kl_status status = turn_points(def, rotate_rad, eta, zeta, diag);
    if (status != KL_OK) {
        return status;
    }
    profile->n_points = def->n_points;
    profile->eta_m = eta;
    profile->zeta_m = zeta;
    if (def->smoothing_m > 0.0) {
        const struct kl_smooth_points points = {def->n_points, eta, zeta};
        const uint32_t n = kl_smooth_size(&points);
        double *smooth_eta = kl_arena_take(arena, n, sizeof *smooth_eta);
        double *smooth_zeta = kl_arena_take(arena, n, sizeof *smooth_zeta);
        if (smooth_eta == NULL || smooth_zeta == NULL) {
            return kl_report(diag, KL_ERR_MEMORY, "profile points", -1, (double)arena->wanted);
        }
        status = kl_smooth(&points, def->smoothing_m, arena, smooth_eta, smooth_zeta, diag);
        profile->n_points = n;
        profile->eta_m = smooth_eta;
        profile->zeta_m = smooth_zeta;
    }
    return status == KL_OK
               ? check_points(profile->eta_m, profile->zeta_m, profile->n_points, rotate_rad, diag)
               : status;
}

static enum kl_status build_points(const struct kl_profile_def *def, double rotate_rad,
                                   struct kl_arena *arena, struct kl_profile *profile,
                                   struct kl_diag *diag) {
    if (def->n_points < KL_PROFILE_MIN_POINTS || def->n_points > KL_PROFILE_MAX_POINTS) {
        return kl_report(diag, KL_ERR_PROFILE, "profile: number of points must be 8..4096", -1,
                         def->n_points);
    }
    if (def->eta_m == NULL || def->zeta_m == NULL) {
        return kl_report(diag, KL_ERR_ARGUMENT, "profile: no points given", -1, 0.0);
    }
    if (def->smoothing_m != 0.0 && !(def->smoothing_m >= 1e-7 && def->smoothing_m <= 1e-3)) {
        return kl_report(diag, KL_ERR_VALUE, "profile: smoothing_m must be 0 or 1e-7..1e-3", -1,
                         def->smoothing_m);
    }
    const enum kl_status status = spline_points(def, rotate_rad, arena, profile, diag);
    if (status != KL_OK) {
        return status;
    }
    const uint32_t n = profile->n_points;
    double *second = kl_arena_take(arena, n, sizeof *second);
    const size_t mark = arena->used;
    double *work = kl_arena_take(arena, n, sizeof *work);
    if (second == NULL || work == NULL) {
        return kl_report(diag, KL_ERR_MEMORY, "profile points", -1, (double)arena->wanted);
    }
    spline(profile->eta_m, profile->zeta_m, second, work, n);
    arena->used = mark;
    profile->kind = KL_PROFILE_POINTS;
    profile->second_1_m = second;
    profile->eta_min_m = profile->eta_m[0];
    profile->eta_max_m = profile->eta_m[n - 1];
    return KL_OK;
}

enum kl_status kl_profile_build(const struct kl_profile_def *def, double rotate_rad,
                                struct kl_arena *arena, struct kl_profile *profile,
                                struct kl_diag *diag) {
    if (def == NULL || arena == NULL || profile == NULL) {
        return kl_report(diag, KL_ERR_ARGUMENT, "kl_profile_build: NULL", -1, 0.0);
    }
    if (!(kl_abs(rotate_rad) < 0.5)) {
        return kl_report(diag, KL_ERR_VALUE, "profile: |rotation| must be below 0.5 rad", -1,
                         rotate_rad);
    }
    const struct kl_profile blank = {0};
    *profile = blank;
    switch (def->kind) {
    case KL_PROFILE_ARC:
        return build_arc(def, rotate_rad, profile, diag);
    case KL_PROFILE_POINTS:
        return build_points(def, rotate_rad, arena, profile, diag);
    }
    return kl_report(diag, KL_ERR_VALUE, "profile: unknown kind", -1, (double)def->kind);
}

/* eta = R (sin delta - sin slope), zeta = R (cos slope - cos delta) */
static struct kl_profile_point arc_at(const struct kl_profile *p, double eta) {
    struct kl_profile_point point = {eta * p->tan_slope, p->tan_slope, 0.0};
    if (p->radius_m > 0.0) {
        const double s = eta / p->radius_m + p->sin_slope;
        const double c = kl_sqrt(1.0 - s * s);
        /* R (cos slope - c) without cancellation: (s^2 - sin^2)/(cos slope + c) */
        const double drop = (s - p->sin_slope) * (s + p->sin_slope) / (p->cos_slope + c);
        point.zeta_m = p->radius_m * drop;
        point.slope = s / c;
        point.second_1_m = 1.0 / (p->radius_m * c * c * c);
    }
    return point;
}

static struct kl_profile_point spline_at(const struct kl_profile *p, double eta) {
    uint32_t low = 0;
    uint32_t high = p->n_points - 1;
    for (int i = 0; i < 13 && high - low > 1; i++) {
        const uint32_t middle = (low + high) / 2;
        if (p->eta_m[middle] > eta) {
            high = middle;
        } else {
            low = middle;
        }
    }
    const double h = p->eta_m[high] - p->eta_m[low];
    const double a = (p->eta_m[high] - eta) / h;
    const double b = (eta - p->eta_m[low]) / h;
    const double s0 = p->second_1_m[low];
    const double s1 = p->second_1_m[high];
    const struct kl_profile_point point = {
        .zeta_m = a * p->zeta_m[low] + b * p->zeta_m[high] +
                  ((a * a * a - a) * s0 + (b * b * b - b) * s1) * (h * h) / 6.0,
        .slope = (p->zeta_m[high] - p->zeta_m[low]) / h +
                 ((3.0 * b * b - 1.0) * s1 - (3.0 * a * a - 1.0) * s0) * h / 6.0,
        .second_1_m = a * s0 + b * s1};
    return point;
}

struct kl_profile_point kl_profile_at(const struct kl_profile *profile, double eta_m) {
    double eta = eta_m;
    if (eta < profile->eta_min_m) {
        eta = profile->eta_min_m;
    }
    if (eta > profile->eta_max_m) {
        eta = profile->eta_max_m;
    }
    struct kl_profile_point point =
        profile->kind == KL_PROFILE_ARC ? arc_at(profile, eta) : spline_at(profile, eta);
    if (eta != eta_m) {
        point.zeta_m += point.slope * (eta_m - eta);
        point.second_1_m = 0.0;
    }
    return point;
}
