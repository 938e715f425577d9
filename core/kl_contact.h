/*
 * kl_contact.h - the contact patch: Hertz, Kalker's coefficients, and the creep-force laws.
 *
 * Signs: force ON the wheel; creepage = velocity of the wheel relative to the rail over V. Axis 1
 * is forward, axis 2 lateral in the contact plane (to the right), axis 3 the normal into the rail.
 */
#ifndef KL_CONTACT_H
#define KL_CONTACT_H

#include "kl_base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The laws; kl_creep.h describes them. */
enum kl_creep_law {
    KL_CREEP_LINEAR = 0,           /* Kalker's linear law, no limit */
    KL_CREEP_SHE = 1,              /* Vermeulen-Johnson saturation, Shen-Hedrick-Elkins reduction */
    KL_CREEP_POLACH = 2,           /* Polach */
    KL_CREEP_FASTSIM = 3,          /* Kalker's simplified theory, parabolic traction bound */
    KL_CREEP_FASTSIM_ELLIPTIC = 4, /* the same with the elliptic bound */
    KL_CREEP_TABLE = 5             /* interpolated results of CONTACT */
};
#define KL_CREEP_LAWS 6

/* The law of a wheelset's contacts, in definition and model alike. If f11_N > 0 the four
 * coefficients are constants and replace Hertz and Kalker. */
struct kl_creep_def {
    enum kl_creep_law law;
    kl_real friction; /* mu0, 0..2; all laws but LINEAR */
    /* mu falls with the velocity w of slip, mu0 (A + (1 - A) e^(-B w)), see struct kl_friction */
    uint32_t falls;            /* 0: it does not, and the two below are not read */
    kl_real falling_ratio;     /* A, 0..1 */
    kl_real falling_decay_s_m; /* B, 0..100 */
    /* what water or oil leave of the initial slope, in the areas of adhesion and slip; 0 means 1 */
    kl_real k_a; /* 0.01..1 */
    kl_real k_s; /* 0.01..k_a */
    kl_real f11_N;
    kl_real f22_N;
    kl_real f23_Nm;
    kl_real f33_Nm2;
};

/* A Hertzian ellipse at unit load. */
struct kl_ellipse {
    double semi_a_1; /* along the rolling direction, m at 1 N */
    double semi_b_1; /* across */
};

/* Kalker's coefficients for one ratio of the axes. */
struct kl_kalker {
    double c11;
    double c22;
    double c23;
    double c33;
};

struct kl_creepage {
    kl_real gamma1;     /* longitudinal, - */
    kl_real gamma2;     /* lateral, - */
    kl_real omega3_1_m; /* spin */
};

struct kl_creep_force {
    kl_real t1_N;
    kl_real t2_N;
    kl_real m3_Nm;
    kl_real reduction; /* |T| / |T linear|, 0..1: the secant by which the linear law is reduced */
};

/*
 * The ellipse of two bodies of equal material for A (half the relative curvature along the rolling
 * direction) and B (half across), both > 0; a and b grow with N^(1/3). The ratio is limited to
 * KL_HERTZ_MIN_RATIO..1/KL_HERTZ_MIN_RATIO, the range of Kalker's table, by raising the smaller of
 * A and B. Bound: 60 halvings. Source: Hertz; complete elliptic integrals by the
 * arithmetic-geometric mean.
 */
#define KL_HERTZ_MIN_RATIO 0.1
struct kl_ellipse kl_hertz(double a_1_m, double b_1_m, double shear_modulus_Pa, double poisson);

/*
 * How far the two bodies approach each other along the normal at 1 N, m; it grows with N^(2/3). As
 * kl_hertz, but for ratios of the axes down to KL_HERTZ_APPROACH_RATIO. Source: Johnson, Contact
 * Mechanics, (4.26c).
 */
#define KL_HERTZ_APPROACH_RATIO 1e-4
double kl_hertz_approach(double a_1_m, double b_1_m, double shear_modulus_Pa, double poisson);

/*
 * Kalker's creep coefficients at a/b (limited to 0.1..10) and nu (limited to 0..0.5), linear
 * between the table's ratios (in the smaller-over-larger axis) and quadratic in nu. Source: Kalker
 * 1990, table E.3; C33 is tabulated at nu = 0.25 only.
 */
struct kl_kalker kl_kalker_coefficients(double a_over_b, double poisson);

/*
 * The moment of rigid spin, all of the contact sliding round its centre: |M3| = mu N c m0 with c =
 * sqrt(a b), the largest there is; m0 = 3/8 max(a, b)/c E(k^2 = 1 - min(a/b, b/a)^2). a_over_b > 0.
 */
double kl_spin_moment(double a_over_b);

/*
 * The creep force under one law, LINEAR or SHE. f11..f33 are for the actual normal force; N >= 0. With N = 0 every
 * force is 0 under SHE. |T| <= mu N under SHE; M3 is
 * reduced by the same factor as T1 and T2. Bound: constant, no iteration. Source: Shen,
 * Hedrick, Elkins 1983.
 */
struct kl_creep_coefficients {
    kl_real f11_N;
    kl_real f22_N;
    kl_real f23_Nm;
    kl_real f33_Nm2;
};
struct kl_creep_force kl_creep(enum kl_creep_law law, const struct kl_creep_coefficients *f,
                               kl_real friction, kl_real normal_N,
                               const struct kl_creepage *creepage);

#ifdef __cplusplus
}
#endif
#endif
