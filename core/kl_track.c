/* kl_track.c - reading the track: layout, irregularities, path. */
#include "kl_track.h"

#include "kl_layout.h"
#include "kl_math.h"

#define PATH_PANELS 16

static const struct kl_piece *piece_at(const struct kl_track *track, kl_real s) {
    const kl_real place = s * track->inv_bin_1_m;
    const kl_real top = (kl_real)(track->n_bins - 1u);
    const uint32_t b = (uint32_t)kl_min_real(kl_max_real(place, KL_R(0)), top);
    const uint32_t last = track->n_pieces - 1u;
    uint32_t p = track->bin[b];
    for (int i = 0; i < 2; i++) {
        const uint32_t next = p < last ? p + 1u : last;
        p = s >= track->piece[next].start_m ? next : p;
    }
    return &track->piece[s < KL_R(0) ? 0u : p];
}

static void read_irregularity(const struct kl_track *restrict track, kl_real s,
                              struct kl_track_point *restrict point) {
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
    /* a row is four kl_real: all channels at once */
    const kl_real *restrict row = &track->irregularity[i].lateral_m;
    kl_real *restrict value = &point->value.lateral_m;
    kl_real *restrict slope = &point->slope.lateral_m;
    kl_real *restrict second = &point->second.lateral_m;
    for (int c = 0; c < 4; c++) {
        value[c] =
            (w0[0] * row[c] + w0[1] * row[4 + c]) + (w0[2] * row[8 + c] + w0[3] * row[12 + c]);
        slope[c] =
            (w1[0] * row[c] + w1[1] * row[4 + c]) + (w1[2] * row[8 + c] + w1[3] * row[12 + c]);
        second[c] =
            (w2[0] * row[c] + w2[1] * row[4 + c]) + (w2[2] * row[8 + c] + w2[3] * row[12 + c]);
    }
}

void kl_track_layout_at(const struct kl_track *track, kl_real s_m, struct kl_track_point *point) {
    const struct kl_piece *piece = piece_at(track, s_m);
    const kl_real d = s_m - piece->start_m;
    const kl_real *k = piece->curvature;
    const kl_real *c = piece->cant;
    point->curvature_1_m = k[0] + d * (k[1] + d * (k[2] + d * k[3]));
    point->heading_rad = piece->heading_rad + kl_layout_heading(k, d);
    point->offset_m = piece->offset_m + (piece->heading_rad * d + kl_layout_offset(k, d));
    point->cant_rad = c[0] + d * (c[1] + d * (c[2] + d * c[3]));
    point->cant_s_1_m = c[1] + d * (KL_R(2) * c[2] + d * (KL_R(3) * c[3]));
    point->cant_ss_1_m2 = KL_R(2) * c[2] + d * (KL_R(6) * c[3]);
}

void kl_track_at(const struct kl_track *track, kl_real s_m, struct kl_track_point *point) {
    kl_track_layout_at(track, s_m, point);
    if (track->irregularity != NULL) {
        read_irregularity(track, s_m, point);
    } else {
        const struct kl_irregularity_row zero = {0};
        point->value = zero;
        point->slope = zero;
        point->second = zero;
    }
}

/* A constant piece is an arc: chord d sin(h)/h along theta + h, h = kappa d/2. Others by
 * Gauss-Legendre, five points a panel. */
void kl_layout_path(const struct kl_piece *piece, double length, double *x, double *y) {
    static const double at[5] = {-0.9061798459386640, -0.5384693101056831, 0.0, 0.5384693101056831,
                                 0.9061798459386640};
    static const double weight[5] = {0.2369268850561891, 0.4786286704993665, 0.5688888888888889,
                                     0.4786286704993665, 0.2369268850561891};
    const kl_real *c = piece->curvature;
    if (c[1] == KL_R(0) && c[2] == KL_R(0) && c[3] == KL_R(0)) {
        const double h = 0.5 * (double)c[0] * length;
        const double chord = length * (kl_abs(h) > 1e-4 ? kl_sin(h) / h : 1.0 - h * h / 6.0);
        const double along = (double)piece->heading_rad + h;
        *x = chord * kl_cos(along);
        *y = chord * kl_sin(along);
        return;
    }
    const double half = 0.5 * length / PATH_PANELS;
    *x = 0.0;
    *y = 0.0;
    for (int panel = 0; panel < PATH_PANELS; panel++) {
        for (int i = 0; i < 5; i++) {
            const double s = half * ((double)(2 * panel + 1) + at[i]);
            const double heading = (double)(piece->heading_rad + kl_layout_heading(c, (kl_real)s));
            *x += half * weight[i] * kl_cos(heading);
            *y += half * weight[i] * kl_sin(heading);
        }
    }
}

void kl_track_path(const struct kl_track *track, kl_real s_m, struct kl_path *path) {
    const struct kl_piece *piece = piece_at(track, s_m);
    const kl_real d = s_m - piece->start_m;
    double x;
    double y;
    kl_layout_path(piece, (double)d, &x, &y);
    path->x_m = (double)piece->path_x_m + x;
    path->y_m = (double)piece->path_y_m + y;
    path->heading_rad = (double)(piece->heading_rad + kl_layout_heading(piece->curvature, d));
}
