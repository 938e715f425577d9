/* kl_track_build.c - two lists of ramps to one list of pieces; samples to B-splines. */
#include "kl_diag.h"
#include "kl_layout.h"
#include "kl_math.h"

#define MAX_CURVATURE_1_M 0.02
#define MAX_CANT_RAD 0.3
#define HALF_SINE_PIECES 16
#define LONG_BEFORE_M (-1e30)

/* One list while building: value = c0 + c1 d + c2 d^2 + c3 d^3 from `start` on. */
struct cubic {
    double start;
    double c[4];
};

/* The cubics of one list, with a constant before and after them. */
struct cubics {
    struct cubic *at;
    uint32_t n;
    double end;
};

/* The cubic over length h with the given values and slopes at its ends. */
static struct cubic hermite(double start, double h, double v0, double v1, double s0, double s1) {
    const double rise = (v1 - v0) / h;
    const struct cubic cubic = {
        start, {v0, s0, (3.0 * rise - 2.0 * s0 - s1) / h, (s0 + s1 - 2.0 * rise) / (h * h)}};
    return cubic;
}

static enum kl_status check_ramp(const struct kl_ramp_def *def, double from, int32_t index,
                                 double limit, struct kl_diag *diag) {
    if (!(def->length_m > 1e-2 && def->length_m < 1e6)) {
        return kl_report(diag, KL_ERR_VALUE, "track ramp: length_m must be in 0.01..1e6", index,
                         def->length_m);
    }
    const double to = def->shape == KL_RAMP_CONSTANT ? from : def->to;
    if (!(kl_abs(to) < limit)) {
        return kl_report(diag, KL_ERR_VALUE,
                         "track ramp: |curvature| must be below 0.02 1/m, |cant| below 0.3 rad",
                         index, to);
    }
    if (def->shape != KL_RAMP_CONSTANT && def->shape != KL_RAMP_LINEAR &&
        def->shape != KL_RAMP_BLOSS && def->shape != KL_RAMP_HALF_SINE) {
        return kl_report(diag, KL_ERR_VALUE, "track ramp: unknown shape", index,
                         (double)def->shape);
    }
    return KL_OK;
}

static void add_ramp(struct cubics *list, const struct kl_ramp_def *def, double from) {
    const double length = def->length_m;
    const double step = def->shape == KL_RAMP_CONSTANT ? 0.0 : def->to - from;
    if (def->shape != KL_RAMP_HALF_SINE) {
        const double slope = def->shape == KL_RAMP_LINEAR ? step / length : 0.0;
        list->at[list->n++] = hermite(list->end, length, from, from + step, slope, slope);
        list->end += length;
        return;
    }
    const double h = length / HALF_SINE_PIECES;
    const double slope = 0.5 * KL_PI * step / length;
    for (int i = 0; i < HALF_SINE_PIECES; i++) {
        const double a = KL_PI * (double)i / HALF_SINE_PIECES;
        const double b = KL_PI * (double)(i + 1) / HALF_SINE_PIECES;
        list->at[list->n++] =
            hermite(list->end + h * (double)i, h, from + 0.5 * step * (1.0 - kl_cos(a)),
                    from + 0.5 * step * (1.0 - kl_cos(b)), slope * kl_sin(a), slope * kl_sin(b));
    }
    list->end += length;
}

static enum kl_status list_cubics(const struct kl_ramp_def *defs, uint32_t n_defs, double start,
                                  double limit, struct kl_arena *arena, struct cubics *list,
                                  struct kl_diag *diag) {
    if (!(kl_abs(start) < limit)) {
        return kl_report(diag, KL_ERR_VALUE,
                         "track start: |curvature| must be below 0.02 1/m, |cant| below 0.3 rad",
                         -1, start);
    }
    list->at = kl_arena_take(arena, (size_t)n_defs * HALF_SINE_PIECES + 2u, sizeof *list->at);
    if (list->at == NULL) {
        return kl_report(diag, KL_ERR_MEMORY, "track ramps", -1, (double)arena->wanted);
    }
    const struct cubic before = {LONG_BEFORE_M, {start, 0.0, 0.0, 0.0}};
    list->at[0] = before;
    list->n = 1;
    list->end = 0.0;
    double value = start;
    for (uint32_t i = 0; i < n_defs; i++) {
        const enum kl_status status = check_ramp(&defs[i], value, (int32_t)i, limit, diag);
        if (status != KL_OK) {
            return status;
        }
        add_ramp(list, &defs[i], value);
        value = defs[i].shape == KL_RAMP_CONSTANT ? value : defs[i].to;
    }
    const struct cubic after = {list->end, {value, 0.0, 0.0, 0.0}};
    list->at[list->n++] = after;
    return KL_OK;
}

/* The same cubic about a later origin (Taylor). */
static void shift(const struct cubic *cubic, double s, kl_real c[4]) {
    const double d = cubic->start > LONG_BEFORE_M ? s - cubic->start : 0.0;
    const double *a = cubic->c;
    c[0] = (kl_real)(a[0] + d * (a[1] + d * (a[2] + d * a[3])));
    c[1] = (kl_real)(a[1] + d * (2.0 * a[2] + 3.0 * d * a[3]));
    c[2] = (kl_real)(a[2] + 3.0 * d * a[3]);
    c[3] = (kl_real)a[3];
}

void kl_layout_set(struct kl_piece *piece, const kl_real c[4], const kl_real cant[4],
                   kl_real heading_rad, kl_real offset_m) {
    const struct kl_layout_power power[KL_LAYOUT_POWERS] = {
        {c[0], heading_rad, offset_m, cant[0]},
        {c[1], c[0], heading_rad, cant[1]},
        {c[2], KL_R(0.5) * c[1], KL_R(0.5) * c[0], cant[2]},
        {c[3], KL_R(1.0 / 3.0) * c[2], KL_R(1.0 / 6.0) * c[1], cant[3]},
        {KL_R(0), KL_R(0.25) * c[3], KL_R(1.0 / 12.0) * c[2], KL_R(0)},
        {KL_R(0), KL_R(0), KL_R(0.05) * c[3], KL_R(0)}};
    const struct kl_cant_power cant_power[KL_CANT_POWERS] = {{cant[1], KL_R(2) * cant[2]},
                                                             {KL_R(2) * cant[2], KL_R(6) * cant[3]},
                                                             {KL_R(3) * cant[3], KL_R(0)}};
    for (int i = 0; i < KL_LAYOUT_POWERS; i++) {
        piece->power[i] = power[i];
    }
    for (int i = 0; i < KL_CANT_POWERS; i++) {
        piece->cant_power[i] = cant_power[i];
    }
}

/* The path at a piece's start, from the piece before it. */
static void join(struct kl_piece *piece, const struct kl_piece *before, kl_real d) {
    double x;
    double y;
    kl_layout_path(before, (double)d, &x, &y);
    piece->path_x_m = (kl_real)((double)before->path_x_m + x);
    piece->path_y_m = (kl_real)((double)before->path_y_m + y);
}

/* The next border of a list after its current cubic, or a place beyond everything. */
static double next_border(const struct cubics *list, uint32_t current) {
    return current + 1u < list->n ? list->at[current + 1u].start : -LONG_BEFORE_M;
}

/*
 * The union of both lists' borders; borders closer than 1e-6 m are one. Piece 0 is what lies before
 * s = 0; integrals and path begin at piece 1, which starts there. Returns the number of pieces.
 */
static uint32_t merge(const struct cubics *curve, const struct cubics *cant, struct kl_piece *piece,
                      double *shortest) {
    const struct kl_piece blank = {.start_m = KL_R(0)};
    kl_real curvature[4];
    kl_real angle[4];
    uint32_t i = 0;
    uint32_t j = 0;
    double s = 0.0;
    piece[0] = blank;
    shift(&curve->at[0], 0.0, curvature);
    shift(&cant->at[0], 0.0, angle);
    kl_layout_set(&piece[0], curvature, angle, KL_R(0), KL_R(0));
    uint32_t n = 1;
    const uint32_t most = curve->n + cant->n;
    while (n < most && s < -LONG_BEFORE_M) {
        while (next_border(curve, i) <= s + 1e-6) {
            i++;
        }
        while (next_border(cant, j) <= s + 1e-6) {
            j++;
        }
        struct kl_piece *p = &piece[n];
        *p = blank;
        p->start_m = (kl_real)s;
        shift(&curve->at[i], s, curvature);
        shift(&cant->at[j], s, angle);
        /* the way from piece 0 to piece 1 is none */
        const kl_real length = p->start_m - p[-1].start_m;
        kl_layout_set(p, curvature, angle, kl_layout_heading(p - 1, length),
                      kl_layout_offset(p - 1, length));
        join(p, p - 1, length);
        if (n > 1u) {
            *shortest = (double)length < *shortest ? (double)length : *shortest;
        }
        n++;
        const double a = next_border(curve, i);
        const double b = next_border(cant, j);
        s = a < b ? a : b;
    }
    piece[n] = piece[n - 1u];
    piece[n + 1u] = piece[n - 1u];
    return n;
}

/* Bins no wider than the shortest piece, so that a bin meets at most one border besides rounding.
 */
static enum kl_status set_bins(struct kl_track *track, double shortest, struct kl_arena *arena,
                               struct kl_diag *diag) {
    const double end = (double)track->piece[track->n_pieces - 1u].start_m;
    const double wanted = end / shortest + 1.0;
    if (!(wanted < (double)KL_TRACK_MAX_BINS)) {
        return kl_report(diag, KL_ERR_CAPACITY,
                         "track: a ramp, or the part in which two overlap, is too short for the "
                         "whole length (1/16384)",
                         -1, shortest);
    }
    const uint32_t n = (uint32_t)wanted + 1u;
    uint16_t *bin = kl_arena_take(arena, n, sizeof *bin);
    if (bin == NULL) {
        return kl_report(diag, KL_ERR_MEMORY, "track bins", -1, (double)arena->wanted);
    }
    const double width = end > 0.0 ? end / (double)n : 1.0;
    uint16_t p = 0;
    for (uint32_t i = 0; i < n; i++) {
        const double s = width * (double)i - 1e-6;
        while (p + 1u < track->n_pieces && (double)track->piece[p + 1u].start_m <= s) {
            p++;
        }
        bin[i] = p;
    }
    track->bin = bin;
    track->n_bins = n;
    track->inv_bin_1_m = (kl_real)(1.0 / width);
    return KL_OK;
}

/* The lists are scratch above the pieces, which are therefore taken first, for the most there can
 * be. */
static enum kl_status build_layout(const struct kl_track_def *def, struct kl_arena *arena,
                                   struct kl_track *track, struct kl_diag *diag) {
    if (def->n_curvature > KL_TRACK_MAX_RAMPS || def->n_cant > KL_TRACK_MAX_RAMPS) {
        return kl_report(diag, KL_ERR_CAPACITY, "track: more than 256 ramps", -1,
                         def->n_curvature > def->n_cant ? def->n_curvature : def->n_cant);
    }
    const uint32_t most = (def->n_curvature + def->n_cant) * HALF_SINE_PIECES + 6u;
    struct kl_piece *piece = kl_arena_take(arena, most, sizeof *piece);
    if (piece == NULL) {
        return kl_report(diag, KL_ERR_MEMORY, "track pieces", -1, (double)arena->wanted);
    }
    const size_t mark = arena->used;
    struct cubics curve;
    struct cubics cant;
    enum kl_status status = list_cubics(def->curvature, def->n_curvature, def->curvature_start_1_m,
                                        MAX_CURVATURE_1_M, arena, &curve, diag);
    if (status == KL_OK) {
        status = list_cubics(def->cant, def->n_cant, def->cant_start_rad, MAX_CANT_RAD, arena,
                             &cant, diag);
    }
    if (status != KL_OK) {
        return status;
    }
    double shortest = 1e6;
    track->n_pieces = merge(&curve, &cant, piece, &shortest);
    track->piece = piece;
    arena->used = mark;
    return set_bins(track, shortest, arena, diag);
}

/* ---- irregularities ---- */

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

enum kl_status kl_track_build(const struct kl_track_def *def, struct kl_arena *arena,
                              struct kl_track *track, struct kl_diag *diag) {
    if (def == NULL || arena == NULL || track == NULL ||
        (def->n_curvature != 0 && def->curvature == NULL) ||
        (def->n_cant != 0 && def->cant == NULL)) {
        return kl_report(diag, KL_ERR_ARGUMENT, "kl_track_build: NULL", -1, 0.0);
    }
    const struct kl_track blank = {0};
    *track = blank;
    enum kl_status status = build_layout(def, arena, track, diag);
    if (status == KL_OK && def->irregularity.n_samples != 0) {
        status = build_irregularity(&def->irregularity, arena, track, diag);
    }
    return status;
}
