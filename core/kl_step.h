/*
 * kl_step.h - the state of one vehicle, and the step.
 */
#ifndef KL_STEP_H
#define KL_STEP_H

#include "kl_vehicle.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Creepages divide by max(V, KL_MIN_CREEP_SPEED): standstill is a legal state, where contact acts
 * as a stiff damper. */
#define KL_MIN_CREEP_SPEED_M_S 0.1
#define KL_MAX_SPEED_M_S 150.0

/* States: per body each freedom that it has, coordinate and rate, then per wheelset y, y', psi, psi'
 * + kappa V, Omega, then per series damper or friction element how far its damper or slider has
 * moved, then per wheelset whose rails give way how far the right and the left rail have, outboard,
 * from where they stand under the wheels at rest, then per wheelset with independent wheels its twist. Omega is the mean of both wheels, the
 * twist half their difference: the right one turns with Omega + twist, the left one with Omega -
 * twist. Roll and yaw rates are absolute: phi' + V phi0', psi' + kappa V; y' of a point at height z
 * is y' - z V phi0'. */
#define KL_WHEELSET_STATES 5
#define KL_MAX_STATES                                                                              \
    (2 * KL_FREEDOMS * KL_MAX_BODIES + (KL_WHEELSET_STATES + KL_SIDES + 1) * KL_MAX_WHEELSETS +    \
     KL_MAX_SLIPS)
enum kl_wheelset_state {
    KL_WS_Y = 0,
    KL_WS_Y_RATE,
    KL_WS_YAW,
    KL_WS_YAW_RATE,
    KL_WS_SPIN,
    KL_WS_TWIST /* not among the five: at the tail, of independent wheels alone */
};

/* Faults: bits, latched in the state until kl_init or kl_clear_faults. */
enum kl_fault {
    KL_FAULT_NONFINITE = 1 << 0, /* the new state held a NaN or an infinity */
    KL_FAULT_DERAILED = 1 << 1,  /* a contact left its table: |w| > range */
    KL_FAULT_WHEEL_LIFT =
        1 << 2, /* a wheel carried no load for at least one step; the run goes on */
    KL_FAULT_INPUT =
        1 << 3 /* an input was not finite or out of range and was limited; the run goes on */
};
/* Faults that stop the motion: the last good state is held, ticks go on. */
#define KL_FAULTS_HOLD ((uint32_t)KL_FAULT_NONFINITE | (uint32_t)KL_FAULT_DERAILED)

/* How the wheels of a wheelset stand on their rails. */
struct kl_lift {
    kl_real
        rise_m[KL_SIDES]; /* of the tread off the rail, >= 0: 0 in ordinary running, above while a
                                 wheel jumps or its flange climbs */
    kl_real rate_m_s[KL_SIDES];   /* of the rise; in contact what a landing has left of it, <= 0 */
    kl_real faster_m_s[KL_SIDES]; /* by how much that grows in a step, off the rail */
    kl_real normal_N[KL_SIDES];   /* of the tread in the last step */
    kl_real expected_N[KL_SIDES]; /* in the next one, if it goes on like that */
    kl_real flange_N[KL_SIDES];   /* normal force of the flange in the last step */
    kl_real slope[KL_SIDES];      /* dH/dw of the tread's path where it stood */
    kl_real path_m_s[KL_SIDES];   /* and how fast it moved along, outboard over its rail */
    /* the tread presses its rail outboard with a force, over what it does at rest, that falls by
     * resist with the rail's velocity relative to the rolling wheel and by inertia with its
     * acceleration; where it rises by that, inertia is negative */
    kl_real press_N[KL_SIDES];  /* without the acceleration */
    kl_real slip_m_s[KL_SIDES]; /* that relative velocity, outboard of the wheel */
    kl_real trend_N[KL_SIDES];  /* by how much press_N, but for the slip, grows in a step */
    kl_real resist_Ns_m[KL_SIDES];
    kl_real inertia_kg[KL_SIDES];
    kl_real push_kg[KL_SIDES]; /* by which it grows with an upward acceleration of the wheel */
    kl_real short_m[KL_SIDES]; /* where the flange held the rail: how far before the end of its path
                                  the tread stood, >= 0; else 0 */
};
#define KL_LIFT_FIELDS 15 /* of KL_SIDES reals each, nothing else */

/* Plain data without pointers: a copy is a snapshot. */
struct kl_state {
    uint64_t tick;       /* steps since kl_init */
    uint64_t fault_tick; /* tick at which the first fault was latched */
    uint32_t faults;     /* enum kl_fault bits */
    uint32_t n_states;
    kl_real s_m;             /* distance of the vehicle's reference point */
    kl_real speed_m_s;       /* V */
    kl_real speed_rate_m_s2; /* of a free V: with which it goes on; 0 of a prescribed one */
    kl_real x[KL_MAX_STATES];
    kl_real
        rate[KL_MAX_STATES]; /* with which x goes on; of y', psi', Omega and twist of a wheelset the
                                    part that its creep does not stop (see kl_step) */
    struct kl_lift lift[KL_MAX_WHEELSETS];
};

struct kl_input {
    kl_real speed_m_s;    /* set-point of V, 0..KL_MAX_SPEED_M_S; a free speed ignores it */
    kl_real draw_force_N; /* on the whole train along the track, positive forward: what draws or
                             buffs it, or a grade; -1e8..1e8; a prescribed speed ignores it */
    kl_real axle_torque_Nm[KL_MAX_WHEELSETS];  /* positive drives forward; half of it on either of
                                                 independent wheels */
    kl_real twist_torque_Nm[KL_MAX_WHEELSETS]; /* of independent wheels: more on the right one and
                                                  less on the left one; solid axles ignore it */
    kl_real friction_factor[KL_MAX_WHEELSETS]
                           [KL_SIDES]; /* multiplies mu, 0..2; kl_input_init sets 1 */
    /* rail conditions, per wheel, on top of the model's (struct kl_creep_def); kl_input_init sets 1, 1, 0 */
    kl_real slope_factor[KL_MAX_WHEELSETS][KL_SIDES]; /* multiplies k_A and k_S, 0.01..1 */
    kl_real falling_factor[KL_MAX_WHEELSETS]
                          [KL_SIDES]; /* multiplies A, 0..1; where friction falls */
    kl_real falling_decay_s_m[KL_MAX_WHEELSETS][KL_SIDES]; /* is added to B, 0..100; likewise */
    kl_real
        side_force_N[KL_MAX_BODIES]; /* lateral force at a body's centre of mass, positive right */
    kl_real actuator_N[KL_MAX_ACTUATORS]; /* of the elements with an actuator; N, or N m */
};

/* One contact of both wheels, [KL_RIGHT] and [KL_LEFT]. */
struct kl_contact_output {
    kl_real normal_N[KL_SIDES]; /* N >= 0 */
    kl_real t1_N[KL_SIDES];     /* longitudinal creep force on the wheel */
    kl_real t2_N[KL_SIDES];     /* lateral creep force on the wheel, in the contact plane */
    kl_real m3_Nm[KL_SIDES];
    kl_real gamma1[KL_SIDES];
    kl_real gamma2[KL_SIDES];
    kl_real omega3_1_m[KL_SIDES];
    kl_real reduction[KL_SIDES]; /* 1 linear .. 0 sliding */
    kl_real radius_m[KL_SIDES];
    kl_real delta_rad[KL_SIDES];   /* contact angle */
    kl_real eta_wheel_m[KL_SIDES]; /* contact point on the wheel; kl_pair_posture knows more */
};

struct kl_wheelset_output {
    kl_real y_m; /* relative to the track centre line */
    kl_real yaw_rad;
    kl_real z_m;         /* positive down */
    kl_real roll_rad;    /* relative to the canted track */
    kl_real spin_rad_s;  /* Omega, positive rolling forward; of independent wheels the mean */
    kl_real twist_rad_s; /* right wheel Omega + twist, left wheel Omega - twist; 0: solid axle */
    kl_real y_rate_m_s;
    kl_real yaw_rate_rad_s; /* relative to the track */
    kl_real y_acc_m_s2;     /* absolute lateral acceleration without gravity: y'' + kappa V^2 */
    kl_real z_acc_m_s2;
    kl_real force_y_N;                       /* track shifting force: sum of Y over both wheels */
    struct kl_irregularity_row irregularity; /* of the track where it is */
    /* of either wheel: */
    kl_real q_N[KL_SIDES];    /* vertical load on the rail, Q, of both contacts */
    kl_real y_N[KL_SIDES];    /* lateral force ON THE RAIL, positive right, of both contacts */
    kl_real rise_m[KL_SIDES]; /* of the tread off the rail: 0 in contact */
    kl_real rail_m
        [KL_SIDES]; /* by which the rail has given way outboard, from its place under the wheel at
                              rest */
    struct kl_contact_output tread; /* with KL_CONTACTS_RIGID the only one */
    struct kl_contact_output flange;
};

struct kl_body_output {
    kl_real position[KL_FREEDOMS]; /* y, z (m), roll, pitch, yaw (rad), relative to the track at the
                                      body's x */
    kl_real rate[KL_FREEDOMS];     /* relative to the track */
    kl_real acceleration[KL_FREEDOMS]; /* y: y'' + kappa V^2 - g phi0, as a body-fixed
                                          accelerometer; others inertial */
};

/* All of it for the state after the step; forces are those of the step's evaluation, which stands at
 * its end. */
struct kl_output {
    uint64_t tick;
    int64_t time_ns; /* tick * step */
    uint32_t faults;
    kl_real s_m;
    kl_real speed_m_s;
    kl_real acceleration_m_s2;
    struct kl_track_layout track; /* at the reference point */
    struct kl_body_output body[KL_MAX_BODIES];
    struct kl_wheelset_output wheelset[KL_MAX_WHEELSETS];
};

/*
 * Where an evaluation puts what it works out on the way, so that a step needs little stack. Opaque;
 * nothing of it ever reaches a state or an output, no call reads what another has left, and it need
 * not be cleared. The one exception is kl_force.h, which reads what kl_observe has just left there. Any number of vehicles and models that are stepped in turn can share one; two
 * threads need two.
 */
#define KL_WORK_REALS                                                                              \
    (32u + 40u * KL_MAX_BODIES + 376u * KL_MAX_WHEELSETS + 2u * KL_MAX_SLIPS + KL_MAX_ACTUATORS)
struct kl_work {
    KL_ALIGN(16) kl_real room[KL_WORK_REALS];
};

/* All zero, friction factors 1. Bound: constant. */
void kl_input_init(struct kl_input *input);

/*
 * Puts a vehicle at rest relative to the track at distance s, rolling at speed V
 * (0..KL_MAX_SPEED_M_S), wheels rolling freely, all displacements zero, faults clear, tick 0.
 * KL_ERR_ARGUMENT: NULL, a model that does not fit, or V out of range. Bound: 16 evaluations.
 */
enum kl_status kl_init(const struct kl_model *model, struct kl_state *state, kl_real s_m,
                       kl_real speed_m_s, struct kl_work *work);

/* Where a freedom lives in state->x; -1 where the body or the wheelset does not have it (the twist of
 * a solid axle). `rate` 1 for its rate. */
int32_t kl_body_state_index(const struct kl_model *model, uint32_t body, enum kl_freedom freedom,
                            int rate);
int32_t kl_wheelset_state_index(const struct kl_model *model, uint32_t wheelset,
                                enum kl_wheelset_state which);
/* Where the displacement of the rail under a wheel lives; -1 where it does not give way. */
int32_t kl_rail_state_index(const struct kl_model *model, uint32_t wheelset, enum kl_side side);

/* To be called after changing x, s or V of a state by hand: finds the rates with which it goes on.
 * kl_init and kl_restore leave nothing to be done. Bound: 16 evaluations. */
void kl_refresh(const struct kl_model *model, struct kl_state *state, struct kl_work *work);

/*
 * Advances one vehicle by one step. `input` acts over the whole step; `output` may be NULL. Returns
 * the latched faults (0: none). Never fails otherwise; the same number of operations whatever the
 * input.
 * Integrator: leapfrog (Stoermer-Verlet) with one evaluation a step, second order, symplectic where
 * forces come from places alone; velocities enter the forces by extrapolation, and the diagonal
 * creep damping of each wheelset, reduced by the secant of the saturated law, is taken implicitly.
 * A free speed is integrated as the momentum of all that rolls, which creep does not stiffen. It does
 * not go below 0: at rest resistance, and a torque that would push backwards, hold the train.
 * As that damping grows stiff (towards standstill) the method turns into the implicit Euler one for
 * y', psi' and Omega. Independent wheels can roll while the wheelset yaws, so there yaw and twist are
 * damped together: the slip of both as above, what rolls not at all. Stable below: undamped angular frequency 2/step, explicit damping 1/step.
 * Re-entrant: touches nothing but its arguments.
 */
uint32_t kl_step(const struct kl_model *model, struct kl_state *state, const struct kl_input *input,
                 struct kl_output *output, struct kl_work *work);

/* The right-hand side alone: rates of state->x at the state's own s and V, exact for the state; V is
 * held, also a free one. Used for linearisation. Bound: 16 evaluations. */
void kl_rates(const struct kl_model *model, const struct kl_state *state,
              const struct kl_input *input, kl_real rates[KL_MAX_STATES], struct kl_work *work);

/* The outputs of a state as it stands, without a step; likewise. */
void kl_observe(const struct kl_model *model, const struct kl_state *state,
                const struct kl_input *input, struct kl_output *output, struct kl_work *work);

/* Total mechanical energy relative to the frame moving with the track: kinetic, elastic and
 * gravitational, J. For tests on straight, smooth track. */
kl_real kl_energy(const struct kl_model *model, const struct kl_state *state, struct kl_work *work);

/* Unlatches all faults. After a holding fault the state is what it was before; restore or init it
 * first if need be. */
void kl_clear_faults(struct kl_state *state);

/* FNV-1a over the used part of the state, fields in order, little-endian. Bound: n_states. */
uint64_t kl_state_hash(const struct kl_state *state);

/* A snapshot for another process or machine: little-endian bytes with the model's hash and a check
 * sum. */
#define KL_SNAPSHOT_SIZE                                                                           \
    (72u + 16u * KL_MAX_STATES + 8u * KL_LIFT_FIELDS * KL_SIDES * KL_MAX_WHEELSETS)
enum kl_status kl_snapshot(const struct kl_model *model, const struct kl_state *state,
                           unsigned char *buffer, size_t size_bytes, size_t *used_bytes);
/* KL_ERR_SNAPSHOT: damaged, or of another model; the state is then untouched. */
enum kl_status kl_restore(const struct kl_model *model, struct kl_state *state,
                          const unsigned char *buffer, size_t used_bytes);

#ifdef __cplusplus
}
#endif
#endif
