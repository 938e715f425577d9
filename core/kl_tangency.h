/* kl_tangency.h - the tangency equations of one wheelset posture. Internal to the core (geometry
 * room). */
#ifndef KL_TANGENCY_H
#define KL_TANGENCY_H

#include "kl_geometry.h"

#define KL_WHEEL_SAMPLES 1024u
#define KL_RAIL_SAMPLES 4096u

/* One wheel over one rail. Distances q from the middle are outboard. */
struct kl_contact_side {
    struct kl_profile wheel;
    struct kl_profile rail;
    double *wheel_zeta; /* KL_WHEEL_SAMPLES over the wheel's range */
    double *rail_zeta;  /* KL_RAIL_SAMPLES over the rail's range */
    double *gap;        /* scratch of one search, KL_WHEEL_SAMPLES */
    double *rail_slope; /* dzeta times the sample distance, likewise */
    double wheel_step_m;
    double rail_step_m;
    double radius_m;    /* rolling radius at eta_w = 0 */
    double spacing_m;   /* q of eta_w = 0 */
    double offset_m;    /* q of eta_r = 0 minus spacing */
    double eta0_m;      /* central contact on the wheel */
    double rise0_m;     /* zeta_r - zeta_w there */
    double radius0_m;   /* rolling radius there */
    double half_base_m; /* l: its distance from the middle */
    uint32_t flange_at; /* first sample of the flange; KL_WHEEL_SAMPLES where there is none */
    uint32_t searched;  /* samples 0..searched - 1 are searched for the contact */
};

struct kl_tangency {
    struct kl_contact_side side[KL_SIDES];
    enum kl_kinematics kinematics;
    struct kl_material material;
    int symmetric; /* right and left are defined by the same numbers */
};

/* The touching posture at one u_y. */
struct kl_touch {
    double eta_wheel_m[KL_SIDES];
    double phi_rad;
    double phi_y_rad_m;
    double height_m[KL_SIDES]; /* H */
    double height_w[KL_SIDES]; /* dH/dw */
};

/* Prepares both sides and finds the central contact. */
enum kl_status kl_tangency_build(const struct kl_pair_def *def, struct kl_arena *arena,
                                 struct kl_tangency *tangency, struct kl_diag *diag);

/* From now on the wheels end where their flanges begin. */
void kl_tangency_treads_only(struct kl_tangency *tangency);

/* Solves eq. 2-11 at u_y; `touch->phi_rad` on entry is the first guess. Bound: KL_POSTURE_ROUNDS
 * searches per side. */
#define KL_POSTURE_ROUNDS 24
enum kl_status kl_tangency_solve(const struct kl_tangency *tangency, double u_y_m,
                                 struct kl_touch *touch, struct kl_diag *diag);

/* Contact point on the rail that belongs to a point on the wheel. */
double kl_tangency_rail_eta(const struct kl_tangency *tangency, enum kl_side side, double w_m,
                            double phi_s_rad, double eta_wheel_m);

#endif
