/* kl_track.c - reading the track: layout, irregularities, path. */
#include "kl_track.h"

#include "kl_layout.h"
#include "kl_math.h"
#include "kl_track_read.h"

#define PATH_PANELS 16

struct kl_track_layout kl_layout_read(const struct kl_track *track, kl_real s) {
    const struct kl_piece *piece = kl_piece_at(track, s);
    const kl_real d = s - piece->start_m;
    const kl_real *k = piece->curvature;
    const kl_real *c = piece->cant;
    const struct kl_track_layout at = {
        .curvature_1_m = k[0] + d * (k[1] + d * (k[2] + d * k[3])),
        .heading_rad = piece->heading_rad + kl_layout_heading(k, d),
        .offset_m = piece->offset_m + (piece->heading_rad * d + kl_layout_offset(k, d)),
        .cant_rad = c[0] + d * (c[1] + d * (c[2] + d * c[3])),
        .cant_s_1_m = c[1] + d * (KL_R(2) * c[2] + d * (KL_R(3) * c[3])),
        .cant_ss_1_m2 = KL_R(2) * c[2] + d * (KL_R(6) * c[3])};
    return at;
}

void kl_track_layout_at(const struct kl_track *track, kl_real s_m, struct kl_track_layout *layout) {
    *layout = kl_layout_read(track, s_m);
}

void kl_track_at(const struct kl_track *track, kl_real s_m, struct kl_track_point *point) {
    kl_track_read(track, s_m, point);
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
    const struct kl_piece *piece = kl_piece_at(track, s_m);
    const kl_real d = s_m - piece->start_m;
    double x;
    double y;
    kl_layout_path(piece, (double)d, &x, &y);
    path->x_m = (double)piece->path_x_m + x;
    path->y_m = (double)piece->path_y_m + y;
    path->heading_rad = (double)(piece->heading_rad + kl_layout_heading(piece->curvature, d));
}
