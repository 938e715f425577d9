/*
 * kl_track.h - the track as a function of the distance s: curvature, cant, irregularities, path.
 *
 * Signs: curvature kappa = 1/R > 0 in a right-hand curve; cant phi0 > 0 lowers the right rail.
 * Curvature and cant are two independent lists of ramps, so cant may run off by itself. Before the
 * first and after the last ramp the value stays.
 */
#ifndef KL_TRACK_H
#define KL_TRACK_H

#include "kl_base.h"

#ifdef __cplusplus
extern "C" {
#endif

#define KL_TRACK_MAX_RAMPS 256
#define KL_TRACK_MAX_BINS 16384

enum kl_ramp_shape {
    KL_RAMP_CONSTANT = 0, /* `to` is not used */
    KL_RAMP_LINEAR = 1,   /* clothoid; straight cant ramp */
    KL_RAMP_BLOSS = 2,    /* 3 t^2 - 2 t^3 */
    KL_RAMP_HALF_SINE =
        3 /* (1 - cos pi t)/2, as 16 cubics that meet value and slope: within 3e-6 of the step */
};

/* One ramp: from the previous ramp's end value to `to`, over `length`. */
struct kl_ramp_def {
    enum kl_ramp_shape shape;
    double length_m; /* > 0 */
    double to;       /* curvature 1/m or cant rad at the end */
};

/* Irregularities at equal distances: each series has n samples or is NULL (zero). Value 0 outside.
 */
struct kl_irregularity_def {
    uint32_t n_samples;       /* 0: none; else 4..1000000 */
    double start_m;           /* s of the first sample */
    double step_m;            /* > 0 */
    const double *lateral_m;  /* y0: track centre line, positive right */
    const double *vertical_m; /* z0: track centre line, positive down */
    const double *cross_rad;  /* cross-level as an angle, positive: right rail lower */
    const double *gauge_m;    /* gauge minus nominal, positive: wider */
};

struct kl_track_def {
    uint32_t n_curvature; /* 0: straight */
    const struct kl_ramp_def *curvature;
    double curvature_start_1_m; /* before the first ramp */
    uint32_t n_cant;
    const struct kl_ramp_def *cant;
    double cant_start_rad;
    struct kl_irregularity_def irregularity;
};

/* The coefficients of a power of d = s - start, as in struct kl_track_layout. */
struct kl_layout_power {
    kl_real curvature;
    kl_real heading; /* int kappa ds from s = 0 */
    kl_real offset;  /* int int kappa ds ds */
    kl_real cant;
};
struct kl_cant_power {
    kl_real first; /* of the derivatives of cant */
    kl_real second;
};
#define KL_LAYOUT_POWERS 6
#define KL_CANT_POWERS 3

/* A piece of track between neighbouring borders of ramps: polynomials in d; curvature and cant are
 * cubics. The first piece reaches back to minus infinity, the last one on to infinity. */
struct kl_piece {
    kl_real start_m;
    kl_real path_x_m; /* path at the start */
    kl_real path_y_m;
    struct kl_layout_power power[KL_LAYOUT_POWERS];
    struct kl_cant_power cant_power[KL_CANT_POWERS];
};

/* One B-spline control point of the four irregularities. */
struct kl_irregularity_row {
    kl_real lateral_m;
    kl_real vertical_m;
    kl_real cross_rad;
    kl_real gauge_m;
};

struct kl_track {
    const struct kl_piece
        *piece;          /* n_pieces, and two more like the last: nobody asks where they end */
    const uint16_t *bin; /* the piece in which each of n_bins equal parts of 0..end begins */
    uint32_t n_pieces;
    uint32_t n_bins;
    kl_real inv_bin_1_m;
    uint32_t n_samples;
    const struct kl_irregularity_row *irregularity; /* n_samples + 2 control points, or NULL */
    kl_real start_m;                                /* of the irregularities */
    kl_real step_m;
    kl_real inv_step_1_m;
};

/* The layout at one s: nothing but kl_real columns. Derivatives are with respect to s. */
struct kl_track_layout {
    kl_real curvature_1_m;
    kl_real heading_rad; /* I1 = int kappa ds from s = 0 */
    kl_real offset_m;    /* I2 = int int kappa ds ds from s = 0 */
    kl_real cant_rad;
    kl_real cant_s_1_m;
    kl_real cant_ss_1_m2;
};

/* The layout, and the irregularities on it. */
struct kl_track_point {
    kl_real curvature_1_m;
    kl_real heading_rad;
    kl_real offset_m;
    kl_real cant_rad;
    kl_real cant_s_1_m;
    kl_real cant_ss_1_m2;
    struct kl_irregularity_row value;
    struct kl_irregularity_row slope;  /* d/ds */
    struct kl_irregularity_row second; /* d2/ds2 */
};

/*
 * Prepares a track. KL_ERR_VALUE: a number out of range or not finite (|curvature| < 0.02 1/m,
 * |cant| < 0.3 rad); KL_ERR_CAPACITY: more than KL_TRACK_MAX_RAMPS ramps, or ramp lengths so
 * unequal that KL_TRACK_MAX_BINS bins cannot separate them; KL_ERR_MEMORY. Bound: linear in ramps,
 * bins and samples.
 */
enum kl_status kl_track_build(const struct kl_track_def *def, struct kl_arena *arena,
                              struct kl_track *track, struct kl_diag *diag);

/* Curvature, heading, offset and cant at s. Bound: constant. */
void kl_track_layout_at(const struct kl_track *track, kl_real s_m, struct kl_track_layout *layout);

/* Everything about the track at s. Bound: constant. */
void kl_track_at(const struct kl_track *track, kl_real s_m, struct kl_track_point *point);

/* The centre line in the earth frame (x along the first heading, y to its right): dX/ds = cos Psi,
 * dY/ds = sin Psi. Bound: constant (Gauss quadrature with a fixed number of panels over the ramp;
 * error below 1e-6 of the ramp's length for turns up to pi per ramp; beyond a constant ramp's end
 * the arc is exact). */
struct kl_path {
    double x_m;
    double y_m;
    double heading_rad;
};
void kl_track_path(const struct kl_track *track, kl_real s_m, struct kl_path *path);

/*
 * Synthesises irregularities by random-phase cosines from one-sided spectra
 *   S(W) = A Wc^2 / ((W^2 + Wr^2)(W^2 + Wc^2))                        lateral, vertical
 *   S(W) = Av/b^2 Wc^2 W^2 / ((W^2+Wr^2)(W^2+Wc^2)(W^2+Ws^2))         cross-level angle
 * with Wc 0.8246, Wr 0.0206, Ws 0.4380 rad/m, b 0.75 m (ERRI B176). W runs over n_waves equal steps
 * between the two wavelengths. Every series starts and ends at zero by a cosine taper of taper_m.
 */
struct kl_spectrum_def {
    double lateral_A;  /* m2 rad/m: low 2.119e-7, high 6.125e-7; 0: none */
    double vertical_A; /* low 4.032e-7, high 1.080e-6 */
    double cross_A;    /* as vertical_A; 0: none */
    double shortest_m; /* shortest wavelength, > 2 steps */
    double longest_m;  /* longest wavelength */
    double taper_m;    /* >= 0 */
    uint32_t n_waves;  /* 1..4096 */
    uint32_t seed;
};
/* Fills lateral, vertical and cross (n samples each, step_m apart). KL_ERR_VALUE as above. Bound:
 * n_waves * n * 3 cosines. */
enum kl_status kl_spectrum_synthesise(const struct kl_spectrum_def *def, double step_m, uint32_t n,
                                      double *lateral_m, double *vertical_m, double *cross_rad);

#ifdef __cplusplus
}
#endif
#endif
