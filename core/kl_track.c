/* kl_track.c - the track: ramps as polynomials, irregularities as B-splines, the path by
 * quadrature. */
#include "kl_track.h"

#include "kl_diag.h"
#include "kl_math.h"

#define MAX_CURVATURE_1_M 0.02
#define MAX_CANT_RAD 0.3
#define PATH_PANELS 16

/* (1 - cos pi t)/2 on 0..1: the polynomial of degree 7, odd about t = 1/2, with value and slope met
 * at both ends and the smallest greatest error otherwise (6.4e-7). */
static const double half_sine[KL_RAMP_COEFFS] = {0.0,
                                                 0.0,
                                                 2.4679119749685055,
                                                 -0.0084415569849254357,
                                                 -1.9764718396029597,
                                                 -0.16696686393513183,
                                                 0.95755559977631566,
                                                 -0.27358731422180449};

/* ---- building ---- */

static enum kl_status set_ramp(struct kl_ramp *ramp, const struct kl_ramp_def *def, double from,
                               int32_t index, double limit, struct kl_diag *diag) {
    if (!(def->length_m > 1e-3 && def->length_m < 1e6)) {
        return kl_report(diag, KL_ERR_VALUE, "track ramp: length_m must be in 0.001..1e6", index,
                         def->length_m);
    }
    const double to = def->shape == KL_RAMP_CONSTANT ? from : def->to;
    if (!(kl_abs(to) < limit)) {
        return kl_report(diag, KL_ERR_VALUE,
                         "track ramp: |curvature| must be below 0.02 1/m, |cant| below 0.3 rad",
                         index, to);
    }
    double shape[KL_RAMP_COEFFS] = {0.0};
    switch (def->shape) {
    case KL_RAMP_CONSTANT:
        break;
    case KL_RAMP_LINEAR:
        shape[1] = 1.0;
        break;
    case KL_RAMP_BLOSS:
        shape[2] = 3.0;
        shape[3] = -2.0;
        break;
    case KL_RAMP_HALF_SINE:
        for (int k = 0; k < KL_RAMP_COEFFS; k++) {
            shape[k] = half_sine[k];
        }
        break;
    default:
        return kl_report(diag, KL_ERR_VALUE, "track ramp: unknown shape", index,
                         (double)def->shape);
    }
    for (int k = 0; k < KL_RAMP_COEFFS; k++) {
        ramp->c[k] = (kl_real)((k == 0 ? from : 0.0) + (to - from) * shape[k]);
    }
    ramp->length_m = (kl_real)def->length_m;
    ramp->inv_length_1_m = (kl_real)(1.0 / def->length_m);
    return KL_OK;
}

/* A value that stays, from `start` on. */
static void set_constant(struct kl_ramp *ramp, double start, double value) {
    const struct kl_ramp blank = {
        .start_m = (kl_real)start, .inv_length_1_m = KL_R(1), .length_m = KL_R(1)};
    *ramp = blank;
    ramp->c[0] = (kl_real)value;
}

/* First and second integral of a ramp's value from its start to t = `t`. */
static void integrate(const struct kl_ramp *ramp, kl_real t, kl_real *first, kl_real *second) {
    kl_real p1 = KL_R(0);
    kl_real p2 = KL_R(0);
    for (int k = KL_RAMP_COEFFS - 1; k >= 0; k--) {
        p1 = p1 * t + ramp->c[k] * KL_R(1.0 / (k + 1));
        p2 = p2 * t + ramp->c[k] * KL_R(1.0 / ((k + 1) * (k + 2)));
    }
    const kl_real along = t * ramp->length_m;
    *first = along * p1;
    *second = along * along * p2;
}

/* Bins no wider than the shortest ramp, so that a bin meets at most one border besides rounding. */
static enum kl_status set_bins(struct kl_ramps *ramps, double end, double shortest,
                               struct kl_arena *arena, struct kl_diag *diag) {
    const double wanted = end / shortest + 1.0;
    if (wanted > (double)KL_TRACK_MAX_BINS) {
        return kl_report(diag, KL_ERR_CAPACITY,
                         "track: a ramp is shorter than 1/8192 of the whole track", -1, shortest);
    }
    const uint32_t n = (uint32_t)wanted + 1u;
    uint16_t *bin = kl_arena_take(arena, n, sizeof *bin);
    if (bin == NULL) {
        return kl_report(diag, KL_ERR_MEMORY, "track bins", -1, (double)arena->wanted);
    }
    const double width = end > 0.0 ? end / (double)n : 1.0;
    uint16_t r = 0;
    for (uint32_t i = 0; i < n; i++) {
        const double s = width * (double)i - 1e-6;
        while (r + 1u < ramps->n && (double)ramps->ramp[r + 1u].start_m <= s) {
            r++;
        }
        bin[i] = r;
    }
    ramps->bin = bin;
    ramps->n_bins = n;
    ramps->bin_start_m = KL_R(0);
    ramps->inv_bin_1_m = (kl_real)(1.0 / width);
    return KL_OK;
}

static enum kl_status build_ramps(const struct kl_ramp_def *defs, uint32_t n_defs, double start,
                                  double limit, struct kl_arena *arena, struct kl_ramps *ramps,
                                  struct kl_diag *diag) {
    if (n_defs > KL_TRACK_MAX_RAMPS) {
        return kl_report(diag, KL_ERR_CAPACITY, "track: more than 256 ramps", -1, n_defs);
    }
    if (!(kl_abs(start) < limit)) {
        return kl_report(diag, KL_ERR_VALUE,
                         "track start: |curvature| must be below 0.02 1/m, |cant| below 0.3 rad",
                         -1, start);
    }
    struct kl_ramp *ramp = kl_arena_take(arena, n_defs + 2u, sizeof *ramp);
    if (ramp == NULL) {
        return kl_report(diag, KL_ERR_MEMORY, "track ramps", -1, (double)arena->wanted);
    }
    double s = 0.0;
    double value = start;
    double shortest = 1e6;
    set_constant(&ramp[0], 0.0, start);
    kl_real sum1 = KL_R(0);
    kl_real sum2 = KL_R(0);
    for (uint32_t i = 0; i < n_defs; i++) {
        struct kl_ramp *r = &ramp[i + 1u];
        set_constant(r, s, 0.0);
        const enum kl_status status = set_ramp(r, &defs[i], value, (int32_t)i, limit, diag);
        if (status != KL_OK) {
            return status;
        }
        r->integral_1 = sum1;
        r->integral_2 = sum2;
        kl_real first;
        kl_real second;
        integrate(r, KL_R(1), &first, &second);
        sum2 += sum1 * r->length_m + second;
        sum1 += first;
        s += defs[i].length_m;
        value = defs[i].shape == KL_RAMP_CONSTANT ? value : defs[i].to;
        shortest = defs[i].length_m < shortest ? defs[i].length_m : shortest;
    }
    set_constant(&ramp[n_defs + 1u], s, value);
    ramp[n_defs + 1u].integral_1 = sum1;
    ramp[n_defs + 1u].integral_2 = sum2;
    ramps->ramp = ramp;
    ramps->n = n_defs + 2u;
    return set_bins(ramps, s, shortest, arena, diag);
}

/* Control points of the interpolating cubic B-spline with free ends: (c[i-1] + 4 c[i] + c[i+1])/6 =
 * sample i. */
static void control_points(const double *sample, uint32_t n, double *work, kl_real *c,
                           size_t stride) {
    /* work[i]: the eliminated upper diagonal; c holds the running right-hand side at index i + 1 */
    c[stride] = (kl_real)(sample != NULL ? sample[0] : 0.0);
    work[0] = 0.0;
    double right = sample != NULL ? sample[0] : 0.0;
    for (uint32_t i = 1; i + 1u < n; i++) {
        const double pivot = 4.0 - work[i - 1];
        right = ((sample != NULL ? 6.0 * sample[i] : 0.0) - right) / pivot;
        work[i] = 1.0 / pivot;
        c[(size_t)(i + 1u) * stride] = (kl_real)right;
    }
    double next = sample != NULL ? sample[n - 1u] : 0.0;
    c[(size_t)n * stride] = (kl_real)next;
    for (uint32_t i = n - 2u; i >= 1u; i--) {
        next = (double)c[(size_t)(i + 1u) * stride] - work[i] * next;
        c[(size_t)(i + 1u) * stride] = (kl_real)next;
    }
    c[0] = KL_R(2) * c[stride] - c[2u * stride];
    c[(size_t)(n + 1u) * stride] = KL_R(2) * c[(size_t)n * stride] - c[(size_t)(n - 1u) * stride];
}

static enum kl_status check_samples(const double *sample, uint32_t n, double limit,
                                    const char *what, struct kl_diag *diag) {
    for (uint32_t i = 0; sample != NULL && i < n; i++) {
        if (!(kl_abs(sample[i]) < limit)) {
            return kl_report(diag, KL_ERR_VALUE, what, (int32_t)i, sample[i]);
        }
    }
    return KL_OK;
}

static enum kl_status build_irregularity(const struct kl_irregularity_def *def,
                                         struct kl_arena *arena, struct kl_track *track,
                                         struct kl_diag *diag) {
    const uint32_t n = def->n_samples;
    if (n < 4u || n > 1000000u) {
        return kl_report(diag, KL_ERR_VALUE, "irregularity: n_samples must be 4..1000000", -1, n);
    }
    if (!(def->step_m > 1e-3 && def->step_m < 1e3) || !(kl_abs(def->start_m) < 1e7)) {
        return kl_report(diag, KL_ERR_VALUE,
                         "irregularity: step_m must be in 0.001..1000, |start_m| below 1e7", -1,
                         def->step_m);
    }
    enum kl_status status =
        check_samples(def->lateral_m, n, 0.1, "lateral_m must be within 0.1 m", diag);
    status = status != KL_OK
                 ? status
                 : check_samples(def->vertical_m, n, 0.2, "vertical_m must be within 0.2 m", diag);
    status = status != KL_OK
                 ? status
                 : check_samples(def->cross_rad, n, 0.1, "cross_rad must be within 0.1", diag);
    status = status != KL_OK
                 ? status
                 : check_samples(def->gauge_m, n, 0.05, "gauge_m must be within 0.05 m", diag);
    if (status != KL_OK) {
        return status;
    }
    struct kl_irregularity_row *rows = kl_arena_take(arena, n + 2u, sizeof *rows);
    const size_t mark = arena->used;
    double *work = kl_arena_take(arena, n, sizeof *work);
    if (rows == NULL || work == NULL) {
        return kl_report(diag, KL_ERR_MEMORY, "irregularity", -1, (double)arena->wanted);
    }
    const size_t stride = sizeof *rows / sizeof(kl_real);
    control_points(def->lateral_m, n, work, &rows[0].lateral_m, stride);
    control_points(def->vertical_m, n, work, &rows[0].vertical_m, stride);
    control_points(def->cross_rad, n, work, &rows[0].cross_rad, stride);
    control_points(def->gauge_m, n, work, &rows[0].gauge_m, stride);
    arena->used = mark;
    track->irregularity = rows;
    track->n_samples = n;
    track->start_m = (kl_real)def->start_m;
    track->step_m = (kl_real)def->step_m;
    track->inv_step_1_m = (kl_real)(1.0 / def->step_m);
    return KL_OK;
}

/* ---- the path ---- */

static int is_constant(const struct kl_ramp *ramp) {
    for (int k = 1; k < KL_RAMP_COEFFS; k++) {
        if (ramp->c[k] != KL_R(0)) {
            return 0;
        }
    }
    return 1;
}

/* The way from a ramp's start over `length`. A constant ramp is an arc: chord d sin(h)/h along
 * theta + h, h = kappa d/2. */
static void path_along(const struct kl_ramp *ramp, double length, double *x, double *y) {
    if (is_constant(ramp)) {
        const double h = 0.5 * (double)ramp->c[0] * length;
        const double chord = length * (kl_abs(h) > 1e-4 ? kl_sin(h) / h : 1.0 - h * h / 6.0);
        const double along = (double)ramp->integral_1 + h;
        *x = chord * kl_cos(along);
        *y = chord * kl_sin(along);
        return;
    }
    /* Gauss-Legendre, five points a panel */
    static const double at[5] = {-0.9061798459386640, -0.5384693101056831, 0.0, 0.5384693101056831,
                                 0.9061798459386640};
    static const double weight[5] = {0.2369268850561891, 0.4786286704993665, 0.5688888888888889,
                                     0.4786286704993665, 0.2369268850561891};
    const double half = 0.5 * length / PATH_PANELS;
    *x = 0.0;
    *y = 0.0;
    for (int panel = 0; panel < PATH_PANELS; panel++) {
        for (int i = 0; i < 5; i++) {
            const double s = half * ((double)(2 * panel + 1) + at[i]);
            kl_real turn;
            kl_real unused;
            integrate(ramp, (kl_real)(s * (double)ramp->inv_length_1_m), &turn, &unused);
            const double heading = (double)(ramp->integral_1 + turn);
            *x += half * weight[i] * kl_cos(heading);
            *y += half * weight[i] * kl_sin(heading);
        }
    }
}

static void build_path(struct kl_ramp *ramp, uint32_t n) {
    for (uint32_t i = 1; i < n; i++) {
        double x = 0.0;
        double y = 0.0;
        if (i > 1u) { /* ramp 0 lies before s = 0, where the path begins */
            path_along(&ramp[i - 1u], (double)ramp[i - 1u].length_m, &x, &y);
        }
        ramp[i].path_x_m = (kl_real)((double)ramp[i - 1u].path_x_m + x);
        ramp[i].path_y_m = (kl_real)((double)ramp[i - 1u].path_y_m + y);
    }
}

enum kl_status kl_track_build(const struct kl_track_def *def, struct kl_arena *arena,
                              struct kl_track *track, struct kl_diag *diag) {
    if (def == NULL || arena == NULL || track == NULL ||
        (def->n_curvature != 0 && def->curvature == NULL) ||
        (def->n_cant != 0 && def->cant == NULL)) {
        return kl_report(diag, KL_ERR_ARGUMENT, "kl_track_build: NULL", -1, 0.0);
    }
    const struct kl_track blank = {0};
    *track = blank;
    enum kl_status status = build_ramps(def->curvature, def->n_curvature, def->curvature_start_1_m,
                                        MAX_CURVATURE_1_M, arena, &track->curvature, diag);
    if (status == KL_OK) {
        /* the arena's memory is ours until the build ends */
        build_path((struct kl_ramp *)(uintptr_t)track->curvature.ramp, track->curvature.n);
        status = build_ramps(def->cant, def->n_cant, def->cant_start_rad, MAX_CANT_RAD, arena,
                             &track->cant, diag);
    }
    if (status == KL_OK && def->irregularity.n_samples != 0) {
        status = build_irregularity(&def->irregularity, arena, track, diag);
    }
    return status;
}

/* ---- reading ---- */

static const struct kl_ramp *ramp_at(const struct kl_ramps *ramps, kl_real s) {
    const kl_real place = (s - ramps->bin_start_m) * ramps->inv_bin_1_m;
    const kl_real top = (kl_real)(ramps->n_bins - 1u);
    const uint32_t b = (uint32_t)kl_min_real(kl_max_real(place, KL_R(0)), top);
    uint32_t r = s < ramps->bin_start_m ? 0u : ramps->bin[b];
    const uint32_t last = ramps->n - 1u;
    for (int i = 0; i < 2; i++) {
        const uint32_t next = r < last ? r + 1u : last;
        r = s >= ramps->ramp[next].start_m ? next : r;
    }
    return &ramps->ramp[r];
}

static void read_irregularity(const struct kl_track *track, kl_real s,
                              struct kl_track_point *point) {
    const kl_real place = (s - track->start_m) * track->inv_step_1_m;
    const kl_real end = (kl_real)(track->n_samples - 1u);
    const kl_real inside = place >= KL_R(0) && place <= end ? KL_R(1) : KL_R(0);
    const kl_real kept = kl_min_real(kl_max_real(place, KL_R(0)), end);
    uint32_t i = (uint32_t)kept;
    i = i < track->n_samples - 1u ? i : track->n_samples - 2u;
    const kl_real t = kept - (kl_real)i;
    const kl_real u = KL_R(1) - t;
    const kl_real by = inside * track->inv_step_1_m;
    const kl_real by2 = by * track->inv_step_1_m;
    const kl_real sixth = inside * KL_R(1.0 / 6.0);
    const kl_real w0[4] = {sixth * (u * u * u), sixth * (KL_R(4) - t * t * (KL_R(6) - KL_R(3) * t)),
                           sixth * (KL_R(4) - u * u * (KL_R(6) - KL_R(3) * u)),
                           sixth * (t * t * t)};
    const kl_real w1[4] = {by * KL_R(-0.5) * (u * u), by * (t * (KL_R(1.5) * t - KL_R(2))),
                           by * (u * (KL_R(2) - KL_R(1.5) * u)), by * KL_R(0.5) * (t * t)};
    const kl_real w2[4] = {by2 * u, by2 * (KL_R(3) * t - KL_R(2)), by2 * (KL_R(3) * u - KL_R(2)),
                           by2 * t};
    const struct kl_irregularity_row *row = &track->irregularity[i];
    struct kl_irregularity_row v = {0};
    struct kl_irregularity_row d = {0};
    struct kl_irregularity_row dd = {0};
    for (int k = 0; k < 4; k++) {
        v.lateral_m += w0[k] * row[k].lateral_m;
        v.vertical_m += w0[k] * row[k].vertical_m;
        v.cross_rad += w0[k] * row[k].cross_rad;
        v.gauge_m += w0[k] * row[k].gauge_m;
        d.lateral_m += w1[k] * row[k].lateral_m;
        d.vertical_m += w1[k] * row[k].vertical_m;
        d.cross_rad += w1[k] * row[k].cross_rad;
        d.gauge_m += w1[k] * row[k].gauge_m;
        dd.lateral_m += w2[k] * row[k].lateral_m;
        dd.vertical_m += w2[k] * row[k].vertical_m;
        dd.cross_rad += w2[k] * row[k].cross_rad;
        dd.gauge_m += w2[k] * row[k].gauge_m;
    }
    point->value = v;
    point->slope = d;
    point->second = dd;
}

void kl_track_layout_at(const struct kl_track *track, kl_real s_m, struct kl_track_point *point) {
    const struct kl_ramp *curve = ramp_at(&track->curvature, s_m);
    const kl_real from = s_m - curve->start_m;
    const kl_real t = from * curve->inv_length_1_m;
    kl_real kappa = KL_R(0);
    for (int k = KL_RAMP_COEFFS - 1; k >= 0; k--) {
        kappa = kappa * t + curve->c[k];
    }
    kl_real first;
    kl_real second;
    integrate(curve, t, &first, &second);
    point->curvature_1_m = kappa;
    point->heading_rad = curve->integral_1 + first;
    point->offset_m = curve->integral_2 + (curve->integral_1 * from + second);

    const struct kl_ramp *cant = ramp_at(&track->cant, s_m);
    const kl_real q = (s_m - cant->start_m) * cant->inv_length_1_m;
    kl_real value = KL_R(0);
    kl_real slope = KL_R(0);
    kl_real bend = KL_R(0);
    for (int k = KL_RAMP_COEFFS - 1; k >= 0; k--) {
        bend = bend * q + slope; /* half the second derivative */
        slope = slope * q + value;
        value = value * q + cant->c[k];
    }
    point->cant_rad = value;
    point->cant_s_1_m = slope * cant->inv_length_1_m;
    point->cant_ss_1_m2 = KL_R(2) * bend * (cant->inv_length_1_m * cant->inv_length_1_m);
}

void kl_track_at(const struct kl_track *track, kl_real s_m, struct kl_track_point *point) {
    const struct kl_irregularity_row zero = {0};
    kl_track_layout_at(track, s_m, point);
    point->value = zero;
    point->slope = zero;
    point->second = zero;
    if (track->irregularity != NULL) {
        read_irregularity(track, s_m, point);
    }
}

void kl_track_path(const struct kl_track *track, kl_real s_m, struct kl_path *path) {
    const struct kl_ramp *curve = ramp_at(&track->curvature, s_m);
    const kl_real from = s_m - curve->start_m;
    double x;
    double y;
    kl_real first;
    kl_real second;
    path_along(curve, (double)from, &x, &y);
    integrate(curve, from * curve->inv_length_1_m, &first, &second);
    path->x_m = (double)curve->path_x_m + x;
    path->y_m = (double)curve->path_y_m + y;
    path->heading_rad = (double)(curve->integral_1 + first);
}
