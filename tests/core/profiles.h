/*
 * profiles.h - S1002 and UIC60 from their definitions, with slope and curvature, for the tests.
 *
 * S1002: EN 13715, polynomials and arcs over S, mm from the tape line, positive towards the field
 * side; height positive towards the flange tip. UIC60: UIC 861-3 / EN 13674-1, arcs of 300, 80 and
 * 13 mm, upright. Here in Klingel's coordinates: eta inboard, zeta down, m.
 */
#ifndef PROFILES_H
#define PROFILES_H

#include <math.h>
#include <stdint.h>

#include "kl_profile.h"

#define S1002_FROM_M (-0.060)
#define S1002_TO_M 0.0439    /* on the flange arc, short of its tip */
#define UIC60_HALF_M 0.03592 /* on the 13 mm arc, at 84 degrees */

/* sum c[k] s^k and its first two derivatives */
static inline void polynomial(const double *c, int n, double s, double value[3]) {
    value[0] = value[1] = value[2] = 0.0;
    for (int k = n - 1; k >= 0; k--) {
        value[2] = value[2] * s + 2.0 * value[1];
        value[1] = value[1] * s + value[0];
        value[0] = value[0] * s + c[k];
    }
}

static inline struct kl_profile_point s1002_at(double eta_m) {
    static const double tread[] = {0.0,
                                   -3.358537058e-2,
                                   1.565681624e-3,
                                   -2.810427944e-5,
                                   5.844240864e-8,
                                   -1.562379023e-8,
                                   5.309217349e-15,
                                   -5.957839843e-12,
                                   2.646656573e-13};
    static const double throat[] = {-4.320221063e3,  -1.038384026e3,  -1.065501873e2,
                                    -6.051367875,    -2.054332446e-1, -4.169739389e-3,
                                    -4.687195829e-5, -2.252755540e-7};
    static const double field[] = {1.364323640, -0.066666667};
    static const double flange[] = {-93.576667419, -2.747477419};
    const double s = -1e3 * eta_m;
    double v[3];
    if (s > 32.15796) {
        polynomial(field, 2, s, v);
    } else if (s > -26.0) {
        polynomial(tread, 9, s, v);
    } else if (s > -35.0) {
        polynomial(throat, 8, s, v);
    } else if (s > -38.426669071) {
        const double x = s + 26.210665;
        const double root = sqrt(13.0 * 13.0 - x * x);
        v[0] = 16.446 - root;
        v[1] = x / root;
        v[2] = 169.0 / (root * root * root);
    } else if (s > -39.764473993) {
        polynomial(flange, 2, s, v);
    } else {
        const double x = s + 58.558326413;
        const double root = sqrt(20.0 * 20.0 - x * x);
        v[0] = 8.834924130 + root;
        v[1] = -x / root;
        v[2] = -400.0 / (root * root * root);
    }
    const struct kl_profile_point point = {1e-3 * v[0], -v[1], 1e3 * v[2]};
    return point;
}

static inline struct kl_profile_point uic60_at(double eta_m) {
    const double join[] = {10.52, 25.98};
    const double radius[] = {300.0, 80.0, 13.0};
    const double y = 1e3 * fabs(eta_m);
    double centre = 0.0;
    double depth = 300.0;
    int arc = 0;
    for (; arc < 2 && y > join[arc]; arc++) { /* the next centre lies on the normal at the join */
        const double sine = (join[arc] - centre) / radius[arc];
        const double step = radius[arc] - radius[arc + 1];
        centre += step * sine;
        depth -= step * sqrt(1.0 - sine * sine);
    }
    const double x = y - centre;
    const double root = sqrt(radius[arc] * radius[arc] - x * x);
    const struct kl_profile_point point = {1e-3 * (depth - root),
                                           (eta_m < 0.0 ? -1.0 : 1.0) * x / root,
                                           1e3 * radius[arc] * radius[arc] / (root * root * root)};
    return point;
}

/* Curvature along the section, 1/m, positive where delta grows inboard. */
static inline double curvature_of(struct kl_profile_point p) {
    return p.second_1_m / pow(1.0 + p.slope * p.slope, 1.5);
}

#endif
