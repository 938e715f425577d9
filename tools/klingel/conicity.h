/*
 * conicity.h - equivalent conicity after EN 15302, from the rolling-radius difference.
 *
 * A free wheelset that rolls without slip on straight track follows, s being the distance run,
 *     y'' + delta_r(y) / (e r0) = 0,    delta_r = r_right - r_left,
 * e the distance of the contact points and r0 the rolling radius (EN 15302, 4 and Annex B). Its
 * first integral gives the slope of the path from the turning points y_min and y_max,
 *     y'^2 = 2 (P(y_max) - P(y)) / (e r0),    P = integral of delta_r dy,    P(y_min) = P(y_max),
 * and a second integral the wavelength. The amplitude is half the distance of the turning points,
 * so an asymmetric delta_r is treated as the standard does. The equivalent conicity is that of the
 * cone with the same wavelength, by Klingel's formula:
 *     tan gamma_e = (pi / wavelength)^2 2 e r0.
 * It does not depend on e and r0; the wavelength does.
 *
 * Between its points delta_r is taken as straight, which makes the motion through each stretch a
 * piece of a harmonic (or hyperbolic) one: the time is exact, also at the turning points, and there
 * is no step size. Two points at the same y are a jump of delta_r.
 *
 * Pure functions of their arguments; host side (heap, libm). Lengths in m.
 */
#ifndef CONICITY_H
#define CONICITY_H

#include <stddef.h>

#define CONICITY_MIN_POINTS 3u
#define CONICITY_MAX_POINTS 100000u

enum conicity_status {
    CONICITY_OK = 0,
    CONICITY_BEYOND = -1, /* the motion would leave the range of delta_r */
    CONICITY_NONE = -2    /* no closed motion of this amplitude: the wheelset is not driven back */
};

/* A delta_r function. */
struct conicity_curve {
    size_t n;
    double *y_m;         /* not falling */
    double *delta_r_m;   /* at y */
    double *integral_m2; /* P at y, 0 at the first point */
};

/* One periodic motion. */
struct conicity_motion {
    double amplitude_m;
    double low_m; /* turning points */
    double high_m;
    double wavelength_m; /* for the e and r0 given */
    double conicity;     /* tan gamma_e, by integration (Annex B) */
    double regression;   /* tan gamma_e, by linear regression (Annex C) */
};

/*
 * Copies n points and integrates. 0; -1 out of memory; otherwise 1 + the index of the first point
 * that is not finite, falls back in y, or is the third at its y (n + 1: fewer than
 * CONICITY_MIN_POINTS, or more than CONICITY_MAX_POINTS, or no length). After anything but 0
 * `curve` is empty. Bound: linear in n.
 */
long conicity_curve_make(struct conicity_curve *curve, const double *y_m, const double *delta_r_m,
                         size_t n);

/* Gives the memory back; harmless on an empty curve. */
void conicity_curve_free(struct conicity_curve *curve);

/* delta_r at y (the mean of both values on a jump); constant beyond the ends. */
double conicity_delta_r(const struct conicity_curve *curve, double y_m);

/*
 * y_em, where the wheelset rolls straight on: delta_r is zero and rises there. Of several the one
 * nearest to y = 0. 0, or -1 where there is none. Bound: linear in n.
 */
int conicity_rolling_line(const struct conicity_curve *curve, double *y_m);

/*
 * The motion of an amplitude > 0, about the rolling line (of several motions the one whose middle is
 * nearest). `base_m` e > 0, `radius_m` r0 > 0. The regression is the straight line of least squares
 * through delta_r between the turning points, tan gamma_e half its slope. Bound: n log n.
 */
enum conicity_status conicity_at(const struct conicity_curve *curve, double amplitude_m,
                                 double base_m, double radius_m, struct conicity_motion *motion);

/* The largest amplitude that conicity_at accepts, within 1 nm; 0 where it accepts none. */
double conicity_largest(const struct conicity_curve *curve);

#endif
