/*
 * kl_geometry.h - wheel-rail geometry: two profiles in, one uniform lookup table out.
 *
 * For each side s (+1 right, -1 left) the wheelset's displacement relative to the rails is seen
 * from that side: w = s (u_y - y_0) is the displacement OUTBOARD (towards that side's rail, flange
 * closing), phi_s = s phi. The tangency equations (Wickens 2.3, eq. 2-11) are then the same on both
 * sides: w - r0 phi_s - eta_w + eta_r = 0 u_z + l phi_s + zeta_w(eta_w) - zeta_r(eta_r) = 0 phi_s -
 * delta_w + delta_r = 0 with one u_z and one phi for the two sides. They are solved by
 * Newton-Raphson, started from a search over the whole profile for the contact that touches first,
 * so that the bodies never penetrate and jumps are found.
 *
 * A side's table holds, against w, its ride height H = u_z + l phi_s. The wheelset's posture
 * follows from the two sides without any loss: phi = (H_right - H_left) / (2 l),   u_z = (H_right +
 * H_left) / 2. So a mirror-symmetric pair gives mirrored numbers to the last bit, gauge and
 * cross-level variations act on each side for themselves, and different wheels on the two sides
 * need no special case.
 */
#ifndef KL_GEOMETRY_H
#define KL_GEOMETRY_H

#include "kl_creep.h"
#include "kl_profile.h"

#ifdef __cplusplus
extern "C" {
#endif

#define KL_TABLE_MAX_HALF 2000 /* most table steps from the centre to either end */
#define KL_MAX_JUMPS 16        /* jumps kept per side; more are counted */

/* Elastic constants of wheel and rail (equal materials). */
struct kl_material {
    double shear_modulus_Pa; /* G > 0; steel 82e9 */
    double poisson;          /* nu, 0..0.5; steel 0.28 */
};

enum kl_pair_kind {
    KL_PAIR_PROFILES = 0, /* from profiles, as above */
    KL_PAIR_LINEAR = 1 /* r = r0 + conicity w exactly, level contact: the classic linear wheelset */
};

/* One wheel, and where it sits on the axle. */
struct kl_wheel_def {
    struct kl_profile_def profile;
    double radius_m;       /* rolling radius at eta = 0, > 0 */
    double half_spacing_m; /* distance of eta = 0 from the middle of the axle, > 0 */
};

/* One rail, and where it sits on the sleeper: either directly or by gauge. */
struct kl_rail_def {
    struct kl_profile_def profile;
    double cant_rad;       /* inclination towards the middle of the track; 1:40 is 0.02499 */
    double half_spacing_m; /* distance of eta = 0 from the middle of the track; 0: from the gauge */
    double gauge_m;        /* distance between the gauge faces; used where half_spacing_m is 0 */
    double gauge_depth_m;  /* depth below the rail top at which the gauge is measured; 0.014 */
};

/*
 * How exactly the roll of the wheelset enters. The printed equations above turn the wheel by phi but
 * leave out phi times the contact's own eta and zeta, and all that is quadratic in phi;
 * KL_KINEMATICS_RIGID turns the wheelset as a rigid body: with q = (distance of the point from the
 * middle of the axle) and rho = r0 + zeta_w,
 *     q_rail = w + q cos phi_s - rho sin phi_s,   zeta_rail = u_z + q sin phi_s + rho cos phi_s
 * up to constants. It is the choice for vehicles (work and energy then agree; the difference in u_z
 * is 2 R_w delta0/l, 3.6 % for Wickens' example; l phi^2/2 is 40 um at 10 mrad, in flange contact as
 * much of the rolling radius). KL_KINEMATICS_PRINTED reproduces the printed equations.
 */
enum kl_kinematics { KL_KINEMATICS_RIGID = 0, KL_KINEMATICS_PRINTED = 1 };

/*
 * Which contacts a wheel has. TWO: tread and flange for themselves, both rigid, on a rail that gives
 * way sideways; a wheel can be on both, and can leave its tread and climb. RIGID: one rigid contact at a time, whichever touches first, as in Wickens 2.3; for
 * looking at geometry, and for vehicles that keep off their flanges.
 */
enum kl_contact_model { KL_CONTACTS_RIGID = 0, KL_CONTACTS_TWO = 1 };

struct kl_pair_def {
    enum kl_pair_kind kind;
    enum kl_contact_model contacts;      /* PROFILES */
    enum kl_kinematics kinematics;       /* PROFILES */
    struct kl_wheel_def wheel[KL_SIDES]; /* PROFILES */
    struct kl_rail_def rail[KL_SIDES];   /* PROFILES */
    double radius_m;                     /* LINEAR: r0 > 0 */
    double half_base_m;   /* LINEAR: l > 0, half the distance between the contact points */
    double conicity;      /* LINEAR: lambda = dr/du_y */
    double curvature_1_m; /* LINEAR: relative transverse curvature 1/R_r - 1/R_w > 0, for Hertz */
    struct kl_material material;
    /* Lateral elasticity and damping of rail and track, per rail: what the wheels work against where
     * contacts are TWO. */
    double flange_stiffness_N_m; /* 1e5..1e10; 0: both as KL_FLANGE_... */
    double flange_damping_Ns_m;  /* 0..1e8 */
    /* The creep law whose coefficients the rows hold; kl_build sets both by the wheelsets. */
    enum kl_creep_law law;
    const struct kl_creep_table *creep_table; /* KL_CREEP_TABLE */
    double step_m;                            /* table step, 1e-5..1e-3; 1e-4 is usual */
    double range_m; /* table covers |w| <= range, step * 4 .. step * KL_TABLE_MAX_HALF */
};

/*
 * One row of a side's table, at one w: nothing but kl_real columns, which are read two at a time. Contact
 * coefficients are per N^(2/3), N, N^(4/3) of the normal load in newton: f11 = f11_1 N^(2/3), f22
 * likewise, f23 = f23_1 N, f33 = f33_1 N^(4/3).
 */
struct kl_row {
    kl_real height_m; /* H, positive down */
    kl_real height_w; /* dH/dw */
    kl_real arm_m;    /* lateral distance of the contact point from the middle of the axle */
    kl_real radius_m; /* rolling radius at the contact */
    /* Of the contact angle of the rail: the common tangent, against the track. On a tread for reading
     * alone: a step takes the contact plane from the heights' slopes, with which the wheels' forces do
     * no work. */
    kl_real sin_delta;
    kl_real cos_delta;
    kl_real f11_1;
    kl_real f22_1;
    kl_real f23_1;
    kl_real f33_1;
    kl_real delta_rail_rad;
    kl_real eta_wheel_m; /* contact point on the wheel */
    kl_real eta_rail_m;  /* contact point on the rail */
    kl_real semi_a_1;    /* Hertz semi-axis along the rail at 1 N; a = semi_a_1 N^(1/3) */
    kl_real semi_b_1;    /* Hertz semi-axis across the rail at 1 N */
    kl_real delta_wheel_rad;
    kl_real curv_wheel_1_m; /* transverse curvature, positive where delta grows inboard (concave
                               tread) */
    kl_real curv_rail_1_m;  /* transverse curvature, positive for a convex head */
    kl_real shape
        [KL_CREEP_SHAPES]; /* of the creep law, see struct kl_creep_row; f11_1.. are then its own */
};

/*
 * One row of a flange's table, at one ride height H of its wheel. The flange is the part of a wheel
 * that is within KL_FLANGE_SPREAD_RAD of its steepest, if that is at least KL_FLANGE_LEAST_RAD. It
 * is a contact of its own, beside that of the tread. From where it touches it takes the rail along:
 * there the tread's contact stays where it is, and its table ends.
 */
#define KL_FLANGE_LEAST_RAD 0.7
#define KL_FLANGE_SPREAD_RAD 0.175
/* Lateral stiffness and damping between rail and sleeper, as in the track of the Manchester benchmarks for rail vehicle
 * simulation (Iwnicki 1998). */
#define KL_FLANGE_STIFFNESS_N_M 43e6
#define KL_FLANGE_DAMPING_NS_M 240e3
struct kl_flange_row {
    kl_real place_m; /* outboard displacement w of the axle at which the flange just touches */
    kl_real place_h; /* its derivative by H; negative: who rides higher must go further */
    kl_real inv_sin; /* of the contact angle */
    kl_real inv_cos;
    struct kl_row contact; /* its height_m is H, its height_w 1/place_h */
};

/* Rows from the lowest ride height upwards: row i at H = top_m - i step. A wheel without a flange
 * has two rows that are out of reach. The last row is where the flange begins to lose its hold:
 * above it the wheel has climbed the rail. */
#define KL_FLANGE_MAX_ROWS 600
struct kl_flange_table {
    const struct kl_flange_row *rows;
    uint32_t n_rows; /* at least 2 */
    kl_real top_m;
};

/* A jump of the contact point between two neighbouring rows. */
struct kl_jump {
    double w_m;          /* outboard displacement, bisected to 1e-6 m */
    double eta_before_m; /* contact point on the wheel for smaller w */
    double eta_after_m;  /* and for larger w */
};

/* The table of one side: 2 half + 1 rows, w = (i - half) step. */
struct kl_side_table {
    const struct kl_row *rows;
    struct kl_jump jumps[KL_MAX_JUMPS];
    uint32_t n_jumps; /* found; only the first KL_MAX_JUMPS are kept */
};

struct kl_pair {
    struct kl_side_table side[KL_SIDES]; /* the treads, as if there were no flanges; where contacts
                                            are RIGID the whole wheels */
    struct kl_flange_table flange[KL_SIDES];
    kl_real tread_end[KL_SIDES];   /* last place in the tread's rows, where the flange touches */
    kl_real central_tan[KL_SIDES]; /* of the contact angle when central */
    kl_real gives; /* 1: there is a flange, and the rails give way sideways; else 0 */
    uint32_t half;
    kl_real step_m;
    kl_real inv_step_1_m;
    kl_real range_m;
    kl_real base_m; /* l_right + l_left of the central contact = 2 l */
    kl_real inv_base_1_m;
    kl_real share[KL_SIDES]; /* u_z = share_r H_r + share_l H_l; 1/2 each for a symmetric pair */
    kl_real radius_m;        /* mean r0 of the central contact */
    kl_real flange_stiffness_N_m;
    kl_real flange_damping_Ns_m;
    enum kl_creep_law law; /* that shape is for: SHE, which needs none, or another */
    uint32_t n_shapes;     /* KL_CREEP_SHAPES or 0 */
};

/* The wheelset's posture for one displacement. */
struct kl_posture {
    double u_y_m;                /* lateral displacement relative to the rails */
    double u_z_m;                /* vertical displacement, positive down, 0 when central */
    double phi_rad;              /* roll */
    double phi_y_rad_m;          /* dphi/du_y */
    double z_y;                  /* du_z/du_y */
    double approach_m[KL_SIDES]; /* of wheel and rail under load, along the normal; 0: rigid */
    struct kl_row row[KL_SIDES];
};

/* Where a wheelset stands, and what it carries. */
struct kl_loaded_place {
    double u_y_m;        /* |u_y| <= 0.1 m */
    double wheel_load_N; /* vertical force on the rail under either wheel, 0..1e6 */
};

/* Small-displacement parameters about a symmetric central position (Wickens eq. 16-34). */
struct kl_linear_geometry {
    double radius_m;      /* r0 */
    double half_base_m;   /* l */
    double delta0_rad;    /* contact angle when central */
    double conicity;      /* lambda0 = d(r_r - r_l)/du_y / 2 */
    double epsilon_rail;  /* epsilon0  = l d(delta_rr - delta_rl)/du_y / 2 */
    double epsilon_wheel; /* epsilon0* = l d(delta_wr - delta_wl)/du_y / 2 */
    double sigma;         /* -l phi_y (1 - r0 delta0/l): equals delta0 for arcs */
    double phi_y_rad_m;
    double z_yy_1_m; /* d2u_z/du_y2 */
};

/*
 * Builds the tables of a pair. Every step is bounded; no result depends on anything but `def`.
 * KL_ERR_PROFILE, KL_ERR_VALUE: see kl_profile_build; KL_ERR_CONTACT: no contact when central, or
 * the contact runs off a profile's end inside the range; KL_ERR_CONVERGE; KL_ERR_MEMORY. `diag`
 * (may be NULL) says more. Bound: about (2 range/step + 1) * (profile points) * 8 evaluations.
 */
enum kl_status kl_pair_build(const struct kl_pair_def *def, struct kl_arena *arena,
                             struct kl_pair *pair, struct kl_diag *diag);

/*
 * Solves the geometry afresh at one u_y (|u_y| <= 0.1 m): the full solution at table-builder
 * accuracy. `scratch` holds the prepared profiles while it works. Bound: as one row of the table.
 */
enum kl_status kl_pair_solve(const struct kl_pair_def *def, struct kl_arena *scratch, double u_y_m,
                             struct kl_posture *posture, struct kl_diag *diag);

/*
 * The same with wheels and rails pressed together. Each wheel carries wheel_load_N without friction,
 * N = wheel_load_N / cos delta, and approaches its rail by Hertz's d(N) along the normal: the rigid
 * solution on rails that are moved away by that much, until load, angle and curvatures agree. The
 * two bodies, of one material, give way by d/2 each, so the patch lies in the middle between them:
 * arm_m and radius_m are given there, other than in a table's row, where they are those of the
 * wheel's own surface. eta_wheel_m, eta_rail_m and the angles are those of the unloaded profiles
 * where they are parallel. u_z counts from the unloaded wheelset when central; phi_y and z_y are
 * those of the approach as it is. As kl_pair_solve, and KL_ERR_CONVERGE where under this load the
 * contact goes to and fro between two places, which then share it; one patch cannot describe that.
 * Bound: KL_LOAD_ROUNDS rows of the table more than kl_pair_solve.
 */
#define KL_LOAD_ROUNDS 30
enum kl_status kl_pair_solve_loaded(const struct kl_pair_def *def, struct kl_arena *scratch,
                                    const struct kl_loaded_place *at, struct kl_posture *posture,
                                    struct kl_diag *diag);

/* Reads the tables of the treads (KL_CONTACTS_RIGID: of whatever touches first) at u_y, interpolated
 * as in the step. Bound: constant. */
enum kl_status kl_pair_posture(const struct kl_pair *pair, double u_y_m,
                               struct kl_posture *posture);

/* The linear parameters by differences over +-1e-5 m of the full solution. */
enum kl_status kl_pair_linear(const struct kl_pair_def *def, struct kl_arena *scratch,
                              struct kl_linear_geometry *linear, struct kl_diag *diag);

#ifdef __cplusplus
}
#endif
#endif
