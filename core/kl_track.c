/* kl_track.c - reading the track: layout, irregularities, path. */
#include "kl_track.h"

#include "kl_layout.h"
#include "kl_math.h"
#include "kl_track_read.h"

#define PATH_PANELS 16

/* The highest power of pass h's columns. */
static inline int top_power(int h) {
#if KL_WIDE == 1
    static const int top[4] = {3, 4, 5, 3};
    return top[h];
#else
    (void)h;
    return KL_LAYOUT_POWERS - 1;
#endif
}

void kl_layout_read(const struct kl_track *track, kl_real s, kl_real *at) {
    const struct kl_piece *piece = kl_piece_at(track, s);
    const kl_real d = s - piece->start_m;
    KL_EACH_WIDE(h) {
        kl_wide x = kl_wide_load(&piece->power[top_power(h)].curvature, h);
        KL_UNROLL_5 for (int i = top_power(h) - 1; i >= 0; i--) {
            x = kl_wide_load(&piece->power[i].curvature, h) + d * x;
        }
        kl_wide_store(at, h, x);
    }
    KL_EACH_LANE(g) {
        const struct kl_cant_power *c = piece->cant_power;
        kl_lane_store(at + 4, g,
                      kl_lane_load(&c[0].first, g) +
                          d * (kl_lane_load(&c[1].first, g) + d * kl_lane_load(&c[2].first, g)));
    }
}

kl_real kl_layout_heading(const struct kl_piece *piece, kl_real d) {
    kl_real x = piece->power[4].heading;
    for (int i = 3; i >= 0; i--) {
        x = piece->power[i].heading + d * x;
    }
    return x;
}

kl_real kl_layout_offset(const struct kl_piece *piece, kl_real d) {
    kl_real x = piece->power[5].offset;
    for (int i = 4; i >= 0; i--) {
        x = piece->power[i].offset + d * x;
    }
    return x;
}

void kl_track_layout_at(const struct kl_track *track, kl_real s_m, struct kl_track_layout *layout) {
    kl_layout_read(track, s_m, &layout->curvature_1_m);
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
    const struct kl_layout_power *c = piece->power;
    if (c[1].curvature == KL_R(0) && c[2].curvature == KL_R(0) && c[3].curvature == KL_R(0)) {
        const double h = 0.5 * (double)c[0].curvature * length;
        const double chord = length * (kl_abs(h) > 1e-4 ? kl_sin(h) / h : 1.0 - h * h / 6.0);
        const double along = (double)c[0].heading + h;
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
            const double heading = (double)kl_layout_heading(piece, (kl_real)s);
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
    path->heading_rad = (double)kl_layout_heading(piece, d);
}
