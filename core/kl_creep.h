/*
 * kl_creep.h - creep forces: the laws, the friction they depend on, the table of CONTACT's results.
 *
 * Signs and axes as in kl_contact.h: force on the wheel, creepage of the wheel relative to the
 * rail.
 *
 * Every law but the linear one is a function of three normalised creepages and of the ratio of the
 * ellipse's axes, and gives forces over mu N:
 *     x = k f11 gamma1/(mu N),   y = k f22 gamma2/(mu N),   p = k f23 omega3/(mu N),
 *     f11 = f11_1 N^(2/3), f22 likewise, f23 = f23_1 N,   T1 = mu N t1(x, y, p), ...
 * so that t1 = -x, t2 = -(y + p) where the creepages are small. What depends on the ellipse is
 * built beforehand (struct kl_creep_row): a step needs no logarithm, no exponential and no search.
 *
 *   LINEAR    Kalker; no limit
 *   SHE       Vermeulen-Johnson, with Shen, Hedrick and Elkins' (1983) reduction for spin
 *   POLACH    Polach 1999, with k_A, k_S of Polach 2005
 *   FASTSIM   Kalker 1982: three flexibilities, KL_FASTSIM_STRIPS x KL_FASTSIM_STEPS elements,
 *             the traction bound parabolic or elliptic
 *   TABLE     interpolated results of CONTACT, the complete half-space theory
 *
 * All of them: finite for every finite or infinite creepage, |T| <= mu N (1 + 1e-12), 0 at N = 0
 * and continuous there, the mirror image and the reversal exact to the bit, a number of operations
 * that does not depend on the input. Energy: SHE never gives any; the others are not bound to that
 * exactly.
 */
#ifndef KL_CREEP_H
#define KL_CREEP_H

#include "kl_contact.h"

#ifdef __cplusplus
extern "C" {
#endif

struct kl_material; /* kl_geometry.h */

/* ---- friction ---- */

/*
 * The friction of one contact. It may change from step to step and from wheel to wheel.
 *     mu(w) = mu0 (A + (1 - A) e^(-B w)), w = V |(gamma1, gamma2)| the velocity of slip (Polach
 *     2005)
 * k_A and k_S reduce the initial slope as a layer of water or oil does: Polach's law as he states
 * it, in the areas of adhesion and of slip; the others by (k_A + k_S)/2, which is the slope of his.
 * Usual (Polach 2005): dry mu0 0.55, A 0.40, B 0.60 s/m, k_A 1.00, k_S 0.40; wet 0.30, 0.40, 0.20,
 * 0.30, 0.10. Without any of that: A 1, B 0, k_A = k_S = 1.
 */
struct kl_friction {
    kl_real mu0;       /* 0..2 */
    kl_real ratio;     /* A, friction of fast over that of slow slip, 0..1 */
    kl_real decay_s_m; /* B, 0..100 */
    kl_real k_a;       /* 0.01..1 */
    kl_real k_s;       /* 0.01..k_a */
};

/* Constant friction. */
struct kl_friction kl_friction_constant(kl_real mu0);

/* KL_OK, or KL_ERR_VALUE with the culprit in `diag` (may be NULL). */
enum kl_status kl_friction_check(const struct kl_friction *friction, struct kl_diag *diag);

/* mu at a velocity of slip >= 0. Bound: constant; see kl_lane_exp_falling in kl_math.h. */
kl_real kl_friction_at(const struct kl_friction *friction, kl_real slip_m_s);

/* ---- the table ---- */

#define KL_CREEP_BINS 64
#define KL_CREEP_MAX_RATIOS 16
#define KL_CREEP_MAX_NODES 33

/*
 * The results of CONTACT as they were computed: dimensionless forces over mu N and moment over
 * mu N c, c = sqrt(a b), on the wheel, at every node of a grid over
 *   ratio   a/b, rising
 *   spin    P = k p >= 0, k = sqrt(C11 C22)/C23 sqrt(max(a/b, b/a)): spin at the end of the longer
 *   axis creep   R = |(x, y)|/s >= 0, s = sqrt(1 + (alpha P)^2)
 *   angle   of (x, y), -90 to 90 degrees, evenly; the rest follows by symmetry
 * The last spin and the last creep are infinite (any value above 1e30), the first ones 0. At creep
 * 0 the angle has no meaning and the forces are the same for all.
 */
struct kl_creep_table_def {
    uint32_t n_ratio; /* 2..KL_CREEP_MAX_RATIOS */
    uint32_t n_spin;  /* 4..KL_CREEP_MAX_NODES */
    uint32_t n_creep;
    uint32_t n_angle; /* odd */
    const double *ratio;
    const double (*c_ij)[3]; /* per ratio: C11, C22, C23 that x, y and p are scaled with */
    const double *spin;
    const double *creep;
    double alpha;
    double beta;             /* the table is read in w = P/(P + beta) */
    double gamma;            /* and u = R/(R + gamma), */
    const float (*force)[3]; /* [ratio][spin][creep][angle]: fx, fy, mz */
};

/* The nodes of one coordinate, cell by cell; places and widths in bins, 0..KL_CREEP_BINS. */
struct kl_creep_cell {
    kl_real low;     /* the cell's first node */
    kl_real next;    /* where the next cell begins; beyond everything in the last one */
    kl_real inverse; /* 1/width */
};
struct kl_creep_axis {
    uint32_t n;                       /* nodes */
    const struct kl_creep_cell *cell; /* n - 1 */
    /* KL_CREEP_BINS + 1: the cell in which a bin begins; at most one more begins in it */
    const uint8_t *bin;
};

/*
 * The table as a step reads it: linearly in the place between the ratios, in w, u and t = tan
 * (angle/2). What is stored is smooth in them: the lateral force of spin alone, `pure`, which is
 * faded out by (1 - u)^2, and the rest, along the creepage, across it, and the moment over m0(a/b),
 * the moment of rigid spin (kl_spin_moment). Where the forces bend, a node is moved by a twelfth of
 * the second difference in each coordinate, which makes the piecewise linear function the best
 * fitting one instead of one that lies on the hollow side everywhere: half the error of
 * interpolation. Constant data; no alignment beyond that of its types.
 */
struct kl_creep_table {
    uint32_t n_ratio;
    kl_real alpha;
    kl_real beta;
    kl_real gamma;
    struct kl_creep_axis spin;   /* KL_CREEP_BINS w */
    struct kl_creep_axis creep;  /* KL_CREEP_BINS u */
    struct kl_creep_axis angle;  /* KL_CREEP_BINS (1 + t)/2 */
    const double *log_ratio;     /* n_ratio: ln a/b */
    const double (*log_c_ij)[3]; /* n_ratio: ln C11, C22, C23 */
    const float *pure;           /* [ratio][spin] */
    const float *rest;           /* [ratio][spin][angle][creep][3], and one more */
    const float *stiffness; /* [spin][creep]: times r + s, no less than any slope of the forces */
    uint64_t hash;
};

/*
 * Makes a table in `arena`; the definition is not needed afterwards. KL_ERR_ARGUMENT,
 * KL_ERR_CAPACITY (too many nodes), KL_ERR_VALUE (nodes not rising, two in one bin, |F| > 1.001 mu
 * N, not finite), KL_ERR_MEMORY. Bound: about 1000 operations per node.
 */
enum kl_status kl_creep_table_build(const struct kl_creep_table_def *def, struct kl_arena *arena,
                                    struct kl_creep_table *table, struct kl_diag *diag);

/* Bytes of constant data behind a table. */
size_t kl_creep_table_bytes(const struct kl_creep_table *table);

/* Numbers in the arrays of a table, for who writes it down. */
size_t kl_creep_table_pure(const struct kl_creep_table *table);
size_t kl_creep_table_rest(const struct kl_creep_table *table);
size_t kl_creep_table_stiffness(const struct kl_creep_table *table);

/* FNV-1a over the values, as stored in table->hash by kl_creep_table_build. */
uint64_t kl_creep_table_hash(const struct kl_creep_table *table);

/* Checks a table that comes from elsewhere (flash): counts and hash. KL_ERR_ARGUMENT or
 * KL_ERR_VALUE. */
enum kl_status kl_creep_table_check(const struct kl_creep_table *table);

/* ---- what a law needs of the ellipse ---- */

#define KL_CREEP_SHAPES 6

/*
 * One row of what a lookup table holds per contact. Linear between rows. f11_1, f22_1, f23_1, f33_1
 * as in struct kl_row; for TABLE with the coefficients of the table, which are right for it. Then,
 * by law (lengths at 1 N):
 *   LINEAR   -
 *   SHE      f23/f22 (m), f33/f23 (m), largest moment m0 c (m)
 *   POLACH   as SHE; then a C22/(c C23), 8/3 (b/c) (C23/C22)/(1 + 6.3 (1 - e^(-a/b))), C22/C11
 *   FASTSIM  a (m), b (m), b/a
 *   TABLE    place between the ratios 0..n_ratio - 1, k of P = k p, m0 c (m)
 */
struct kl_creep_row {
    kl_real f11_1;
    kl_real f22_1;
    kl_real f23_1;
    kl_real f33_1;
    kl_real shape[KL_CREEP_SHAPES];
};

/* Fills a row. `table` is needed by TABLE alone. KL_ERR_ARGUMENT: no table, unknown law. Bound:
 * constant. */
enum kl_status kl_creep_row_build(enum kl_creep_law law, const struct kl_creep_table *table,
                                  const struct kl_ellipse *ellipse,
                                  const struct kl_material *material, struct kl_creep_row *row);

/* ---- forces ---- */

#define KL_LEAST_FRICTION 1e-9 /* creepages are normalised as if mu were no less */
#define KL_FASTSIM_STRIPS 10
#define KL_FASTSIM_STEPS 10

/* One contact at one instant. */
struct kl_creep_contact {
    struct kl_creep_row row;
    struct kl_friction friction;
    kl_real normal_N;  /* limited to 0..1e12 */
    kl_real speed_m_s; /* V >= 0, for falling friction alone */
    struct kl_creepage creepage;
};

/*
 * The creep force under one law. `reduction` is 0..1 and, but for LINEAR, no less than any slope
 * -dT1/dgamma1/f11, -dT2/dgamma2/f22 that is not above 1 itself (for the integrator, which takes
 * creep damping implicitly).
 * `table` is used by TABLE alone. NaN in the creepage counts as -1e9 times the linear limit. Bound:
 * constant; re-entrant. One wheel: a step does both of an axle at once by kl_lane_creep.
 */
struct kl_creep_force kl_creep_force(enum kl_creep_law law, const struct kl_creep_table *table,
                                     const struct kl_creep_contact *contact);

#ifdef __cplusplus
}
#endif
#endif
