/*
 * kl_axle.h - one wheelset within a step: posture from the tables, then forces and accelerations.
 * Internal to the core.
 *
 * The wheelset's height z and roll phi follow from its lateral displacement through the table, so
 * the normal forces do no work on it and the lateral equation is free of them (Lagrange): (m (1 +
 * z_y^2) + I_x phi_y^2) y'' = F_y + z_y (F_z + m g) + phi_y M_x - m (kappa V^2 - g phi0)
 *                                         - m z_y b_z - I_x phi_y b_phi - phi_y I_y Omega psi'
 *                                         + sum T2 (1 - r phi_y)/cos delta
 * where z'' = z_y y'' + b_z and phi'' = phi_y y'' + b_phi. Normal forces then follow from vertical
 * and roll equilibrium. Creep forces need them, and they need the creep forces: two passes, always.
 */
#ifndef KL_AXLE_H
#define KL_AXLE_H

#include "kl_step.h"

/* One wheel on its rail. */
struct kl_wheel {
    kl_real place;  /* place in the table, in rows; kept for the outputs */
    kl_real w_rate; /* dw/dt */
    kl_real w_rest; /* d2w/dt2 without y'' */
    kl_real height; /* H, H', H'' */
    kl_real height_w;
    kl_real height_ww;
    kl_real arm;
    kl_real radius;
    kl_real sin_delta;
    kl_real cos_delta;
    kl_real inv_cos;
    struct kl_creep_coefficients unit; /* per N^(2/3), N^(2/3), N, N^(4/3) */
};

/* Where the wheelset is and how it moves. */
struct kl_axle {
    struct kl_track_point track;
    struct kl_wheel wheel[KL_SIDES];
    kl_real y; /* state */
    kl_real yaw;
    kl_real y_abs_rate; /* lateral velocity of the centre, the frame's rolling included */
    kl_real yaw_abs_rate;
    kl_real spin;
    kl_real y_rate; /* dy/dt relative to the track */
    kl_real z;      /* relative to the smooth track, positive down */
    kl_real z_rate;
    kl_real roll; /* relative to the smooth, canted track */
    kl_real roll_rate;
    kl_real z_y;
    kl_real phi_y;
    kl_real z_rest;    /* b_z: z'' = z_y p' + b_z, p = y_abs_rate */
    kl_real roll_rest; /* b_phi, absolute roll */
    uint32_t faults;
};

/* What acts on it, and what comes of it. */
struct kl_axle_forces {
    kl_real suspension[4]; /* y, z, roll, yaw: static and dynamic */
    kl_real torque_Nm;
    kl_real friction[KL_SIDES];
    kl_real speed_m_s;
    kl_real gravity_m_s2;
    /* results */
    kl_real normal[KL_SIDES];
    struct kl_creep_force creep[KL_SIDES];
    struct kl_creepage creepage[KL_SIDES];
    kl_real y_acc;   /* d(y_abs_rate)/dt */
    kl_real yaw_acc; /* d(yaw_abs_rate)/dt */
    kl_real spin_acc;
    kl_real damping[3]; /* diagonal creep damping of the three rates, 1/s, >= 0 */
};

/* Posture at the state x (KL_WHEELSET_STATES values), with the track at the wheelset in
 * axle->track, speed V and its rate. */
void kl_axle_posture(const struct kl_pair *pair, const kl_real *x, kl_real speed_m_s,
                     kl_real speed_rate_m_s2, struct kl_axle *axle);

/* Contact forces and accelerations. */
void kl_axle_forces(const struct kl_wheelset *wheelset, const struct kl_axle *axle,
                    struct kl_axle_forces *forces);

/* Fills the outputs that belong to the wheels and the wheelset. */
void kl_axle_output(const struct kl_pair *pair, const struct kl_axle *axle,
                    const struct kl_axle_forces *forces, struct kl_wheelset_output *output);

#endif
