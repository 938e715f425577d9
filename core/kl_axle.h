/*
 * kl_axle.h - one wheelset within a step: posture from the tables, then forces and accelerations.
 * Internal to the core.
 *
 * The wheelset's height z and roll phi follow from its lateral displacement through the table, so
 * the normal forces do no work on it and the lateral equation is free of them (Lagrange):
 *     (m (1 + z_y^2) + I_x phi_y^2) y'' = F_y + z_y (F_z + m g) + phi_y M_x
 *                                         - m (kappa V^2 - g phi0) - m z_y b_z - I_x phi_y b_phi
 *                                         - phi_y I_y Omega psi' + sum T2 (1 - r phi_y)/cos delta
 * where z'' = z_y y'' + b_z and phi'' = phi_y y'' + b_phi. Normal forces then
 * follow from vertical and roll equilibrium. Creep forces need them and they need the creep forces:
 * creep is found at the normal forces that the last two steps lead to expect, and enters as so
 * much per newton of the normal force, with which it is solved for. A constant number of operations;
 * no iteration.
 *
 * Where a wheel has tread and flange, its rail gives way sideways. It has no mass: what presses it
 * outboard is k q + c q', over what does so in the wagon at rest. While only the tread is on it, q
 * follows the tread's force; where the flange touches it follows the flange, k q + c q' is the
 * lateral force of the wheel whatever each contact's part, and the two parts are those that also
 * give the wheel its vertical force.
 */
#ifndef KL_AXLE_H
#define KL_AXLE_H

#include "kl_creep.h"
#include "kl_lanes.h"
#include "kl_step.h"

/* The rows of either side's table around its place: the row below, the row above and how far on. */
struct kl_cells {
    const struct kl_row *below[KL_SIDES];
    kl_both t;
};

/* Rigid slip of a contact over V. */
struct kl_creepages {
    kl_both gamma1;
    kl_both gamma2;
    kl_both omega3;
};

/* Creep coefficients of a contact at unit load, and what laws want besides. */
struct kl_coefficients {
    kl_both f11;                    /* per N^(2/3) */
    kl_both f22;                    /* per N^(2/3) */
    kl_both f23;                    /* per N */
    kl_both f33;                    /* per N^(4/3) */
    kl_both shape[KL_CREEP_SHAPES]; /* see struct kl_creep_row */
};

/* A rail under either wheel, sideways. */
struct kl_rail {
    kl_both start; /* q before the step, m, outboard, and q' */
    kl_both start_rate;
    kl_both press; /* of the tread, as struct kl_lift tells from the step before, without slip */
    kl_both resist;
    kl_both inertia;
    kl_both q; /* and after */
    kl_both rate;
    kl_both acceleration;
    kl_both behind;   /* part of the change of q' in which the wheel does not yet take part */
    kl_both followed; /* q', as far as the wheel takes part in it */
    kl_both held;     /* 1 where the flange is on it, else 0 */
};

/* The flange contact of either wheel, where it may be. */
struct kl_flange {
    const struct kl_flange_row *row[KL_SIDES]; /* at or above the ride height, and the next */
    kl_both t;
    kl_both arm;
    kl_both radius;
    kl_both sin_delta;
    kl_both cos_delta;
    kl_both inv_sin;
    kl_both inv_cos;
    kl_both reach;  /* radius tan(delta): times yaw, how far ahead of the axle it touches */
    kl_both normal; /* N of the last step */
    struct kl_coefficients creep;
};

/* Of either side's tread: how its table goes on from its place, and how it moves. */
struct kl_ride {
    kl_both outboard; /* of the tread over the rail at rest */
    kl_both outboard_rate;
    kl_both slope; /* dH/dw */
    kl_both second;
    kl_both within; /* 1 before the path's end, else 0 */
    kl_both after;  /* how far beyond it the rail as it goes by itself would leave it, m */
    kl_both rate;   /* of the height */
    kl_both rest;   /* of its second time derivative what does not depend on y'' */
};

/* Where the wheelset is and how it moves. */
struct kl_axle {
    kl_both arm; /* contact: distance from the middle */
    kl_both radius;
    kl_both sin_delta;
    kl_both cos_delta;
    kl_both inv_cos;
    kl_real x[KL_WHEELSET_STATES]; /* enum kl_wheelset_state */
    kl_both spin;                  /* of either wheel */
    kl_real twist;                 /* of independent wheels: KL_WS_TWIST, and its rate */
    kl_real twist_rate;
    kl_real yaw_carried; /* of independent wheels: psi'' as the step began */
    kl_real
        rate[KL_WHEELSET_STATES]; /* of y and yaw: relative to the track; of Omega: besides V'/r0 */
    kl_real spin_drift;           /* V'/r0: what Omega does besides */
    kl_both outboard;             /* displacement of the axle towards either rail at rest */
    kl_both outboard_rate;
    kl_both outboard_rest; /* of its acceleration, besides y'' */
    kl_both path_rate;     /* of the tread over its rail */
    kl_both path_rate_before;
    kl_both height; /* ride height of either wheel over its rail, positive down */
    kl_both height_rate;
    kl_both rise; /* of the tread off the rail, >= 0 */
    kl_both rise_rate;
    kl_both rise_mean; /* rate over the step, but for half of what it changes by */
    kl_both up;        /* 1 where the tread is off the rail */
    kl_both lands;     /* 1 where it comes down on the rail in this step */
    kl_both closing;   /* velocity with which it has come down and is not yet stopped, <= 0 */
    kl_both landing;   /* upward acceleration that stops it */
    kl_both kick; /* velocity off the rail that a tread gets as the flange takes its path away */
    kl_both expected; /* the treads' normal forces, as the last two steps tell */
    kl_both slope; /* dH/dw of the treads; 0 where the flange holds the rail; and a step before */
    kl_both slope_before;
    kl_both
        shortened; /* how far before its end the tread's path stops; and where it has been found to */
    kl_both shortens;
    kl_real step;     /* s; 0 where a state is looked at as it stands */
    kl_real inv_step; /* 1/s; or 0 */
    kl_real settles;  /* of a blow, the part that the step takes up: see kl_axle_carry */
    struct kl_rail rail;
    struct kl_ride ride;
    struct kl_flange flange;
    kl_real z; /* relative to the smooth track, positive down */
    kl_real z_rate;
    kl_real roll; /* relative to the smooth, canted track */
    kl_real roll_rate;
    kl_real z_y;
    kl_real phi_y;
    kl_real z_rest;    /* b_z: z'' = z_y p' + b_z, p = x[KL_WS_Y_RATE] */
    kl_real roll_rest; /* b_phi, absolute roll */
    uint32_t faults;
    /* what is read through pointers of its own stands last, out of the way of the others */
    struct kl_coefficients creep;
    struct kl_track_point track;
    struct kl_cells cells;
};

/* How the normal forces N of the treads follow from what acts on the axle. */
struct kl_contacts {
    kl_both pulls;   /* what a unit of N adds to the lateral motion: 0 where N does no work */
    kl_both backs;   /* by which the lateral motion changes N */
    kl_both by_down; /* N = by_down (what is down) + by_roll (what rolls) */
    kl_both by_roll;
    kl_real z_part; /* of the lateral force that goes into vertical and roll inertia */
    kl_real roll_part;
    kl_both press;      /* to its rail, of a newton on a tread */
    kl_both shed;       /* by which a unit of the tread's N relieves the flange */
    kl_both flange_all; /* the flange's N without the tread */
};

/* What a newton on a tread does together with what it takes off the flange. */
struct kl_bearings {
    kl_both aside;
    kl_both lift;
    kl_both roll;
};

/* What acts on the axle besides the contact, the inertia that is known already taken off. */
struct kl_load {
    kl_real lateral;
    kl_real down;
    kl_real roll;
    kl_real yaw;
    kl_real drive;  /* about the axle */
    kl_real free_y; /* along the path that the tables prescribe */
};

/* A contact of either wheel: first what it is at the normal force `used`, in the end at `normal`. */
struct kl_contact_forces {
    kl_both used; /* N that creep is found with, at least 1 N; 1/N and N^(-1/3) */
    kl_both inv_used;
    kl_both inv_root;
    kl_both normal;
    struct kl_creepages creepages;
    kl_both t1;
    kl_both t2;
    kl_both m3;
    kl_both reduction; /* secant over Kalker's slope */
    kl_both f11_N;     /* of the normal force, not reduced */
    kl_both f22_N;
    kl_both f33_Nm2;
};

/*
 * A wheel is held down on its rail by its load alone. Its tread's rise e off the rail is a
 * coordinate of its own, e >= 0, N >= 0, and one of both is zero; the normal forces grow with the
 * upward accelerations e'' by a 2 x 2 matrix.
 */
struct kl_lifting {
    kl_both down; /* what a unit of e'' adds to the loads */
    kl_both roll;
    kl_both free_y;
    kl_both right; /* the right wheel's normal force by either e'' */
    kl_both left;
    kl_both on; /* 1 where the tread is on the rail when the step ends */
    kl_both acceleration;
};

/* What acts on it, and what comes of it. */
struct kl_axle_forces {
    kl_real torque_Nm;
    kl_real speed_m_s;
    kl_real inv_creep_speed_s_m;
    kl_real gravity_m_s2;
    kl_both friction; /* mu0 */
    kl_both ratio;    /* of falling friction */
    kl_both decay;
    kl_both slope; /* of the initial creep forces over Kalker's */
    const struct kl_creep_table *table;
    struct kl_load load;
    struct kl_bearings together;
    struct kl_contacts contacts;
    struct kl_lifting lifting;
    struct kl_contact_forces tread;
    struct kl_contact_forces flange;
    kl_real inv_mass_1_kg; /* of the lateral motion */
};

/* Where wheels and rails are, at axle->x, with the rates of y and yaw in axle->rate and the track at the
 * wheelset in axle->track, at speed V and its rate; rest_N is a wheel's load at rest, step_s the
 * model's, also for a state as it stands. What the tables say there; whether the flanges reach the
 * rails, which stand where they go by themselves, and takes the rails along where they do; then the
 * posture. Each part is done for all axles before the next, see below. */
void kl_axle_place(const struct kl_pair *restrict pair, kl_real speed_m_s, kl_real speed_rate_m_s2,
                   kl_real rest_N, kl_real step_s, struct kl_axle *restrict axle);
void kl_axle_look_up(const struct kl_pair *restrict pair, struct kl_axle *restrict axle);
void kl_axle_meet_flange(const struct kl_pair *restrict pair, kl_real step_s,
                         struct kl_axle *restrict axle);
void kl_axle_posture(const struct kl_pair *restrict pair, kl_real speed_m_s,
                     kl_real speed_rate_m_s2, struct kl_axle *restrict axle);

/* The normal forces that creep is found with, from axle->expected and the flange's. */
void kl_axle_expect(const struct kl_axle *restrict axle, struct kl_axle_forces *restrict forces);

/* Creep of treads and flanges at their `used` normal forces, by the wheelset's law, from their creepages
 * and coefficients; of treads with those of the wheelset itself, where it has some. */
void kl_axle_creep(const struct kl_wheelset *restrict wheelset,
                   const struct kl_coefficients *on_tread, const struct kl_coefficients *on_flange,
                   struct kl_axle_forces *forces);

/* Whether creep grows with the normal force and is limited by it. */
static inline int kl_axle_is_limited(const struct kl_wheelset *wheelset) {
    return wheelset->creep.law != KL_CREEP_LINEAR;
}

/* Carries on over the time h what is known of rails and treads, the rail's place before in
 * axle->rail; before the posture. */
void kl_axle_carry(const struct kl_lift *lift, kl_real h, struct kl_axle *axle);

/* Creepages of the flanges, and their coefficients. */
void kl_axle_flange_creepages(const struct kl_wheelset *restrict wheelset,
                              const struct kl_axle *restrict axle,
                              struct kl_coefficients *restrict creep,
                              struct kl_axle_forces *restrict forces);

/* What the next step has to know of the wheels on their rails: at the end of a step, or (`h` 0) of a
 * state as it stands. */
void kl_axle_keep(const struct kl_pair *restrict pair, const struct kl_wheelset *restrict wheelset,
                  const struct kl_axle *restrict axle, const struct kl_axle_forces *restrict forces,
                  kl_real h, struct kl_lift *restrict lift);

/*
 * Contact forces and accelerations from the suspension's y, z, roll and yaw, in five parts: creep per
 * newton of the normal forces; the loads, with what a flange bears; how the normal forces follow
 * from them; these; and what follows from them. Each part is a chain of operations that wait for each
 * other, and is done for all axles before the next, so that the chains of several axles overlap.
 */
void kl_axle_find_creep(const struct kl_wheelset *restrict wheelset,
                        const struct kl_axle *restrict axle,
                        struct kl_axle_forces *restrict forces);
void kl_axle_prepare(const struct kl_wheelset *restrict wheelset,
                     const struct kl_pair *restrict pair, const struct kl_axle *restrict axle,
                     const kl_real suspension[restrict 4], struct kl_axle_forces *restrict forces);
void kl_axle_weigh(const struct kl_wheelset *restrict wheelset, const struct kl_pair *restrict pair,
                   const struct kl_axle *restrict axle, struct kl_axle_forces *restrict forces);
void kl_axle_balance(const struct kl_wheelset *restrict wheelset,
                     const struct kl_axle *restrict axle, struct kl_axle_forces *restrict forces);
void kl_axle_accelerate(const struct kl_wheelset *restrict wheelset, struct kl_axle *restrict axle,
                        struct kl_axle_forces *restrict forces);

/*
 * z = step * damping of y', psi', Omega and twist, where damping (1/s, >= 0) is the diagonal creep
 * damping, a secant of the saturated law.
 */
struct kl_stiffness {
    kl_real y;
    kl_real yaw;
    kl_real spin;
};
void kl_axle_stiffness(const struct kl_wheelset *restrict wheelset,
                       const struct kl_pair *restrict pair, const struct kl_axle *restrict axle,
                       const struct kl_axle_forces *restrict forces, kl_real step_s,
                       struct kl_stiffness *restrict stiffness);

#endif
