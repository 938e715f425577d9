/*
 * kl_vehicle.h - what a vehicle is made of, and the model that the builder makes of it.
 *
 * Vehicle frame: x forward, y to the right, z down, origin on the track centre line at rail level
 * under the vehicle's reference point (s = s_ref there). A height h above the rail is z = -h.
 */
#ifndef KL_VEHICLE_H
#define KL_VEHICLE_H

#include "kl_contact.h"
#include "kl_geometry.h"
#include "kl_track.h"

#ifdef __cplusplus
extern "C" {
#endif

#define KL_MODEL_VERSION 4u
#define KL_NAME_SIZE 32
#define KL_MAX_PAIRS 4
#define KL_MAX_ELEMENTS 1024
#define KL_MAX_LINKAGES 256
#define KL_MAX_TERMS 8         /* of a linkage */
#define KL_MAX_TABLE_POINTS 32 /* of a force over deflection or velocity */
#ifndef KL_MAX_SLIPS
#define KL_MAX_SLIPS (4 * KL_MAX_BODIES) /* series dampers and friction elements */
#endif
#ifndef KL_MAX_ACTUATORS
#define KL_MAX_ACTUATORS KL_MAX_BODIES
#endif

/* The freedoms of a body, in this order everywhere. */
enum kl_freedom { KL_Y = 0, KL_Z = 1, KL_ROLL = 2, KL_PITCH = 3, KL_YAW = 4, KL_FREEDOMS = 5 };
#define KL_HAS(freedom) (1u << (unsigned)(freedom))

/* Ends of a force element: a body's index, KL_WHEELSET_END(i), or the ground: the track frame at
 * the reference point, which runs along with the vehicle. */
#define KL_GROUND_END (-1)
#define KL_WHEELSET_END(i) (0x100 + (i))

struct kl_body_def {
    char name[KL_NAME_SIZE];
    double mass_kg;         /* > 0 */
    double inertia_kgm2[3]; /* Ixx, Iyy, Izz > 0 */
    double x_m;             /* centre of mass */
    double z_m;             /* centre of mass, negative above the rail */
    uint32_t freedoms; /* KL_HAS bits, at least one; without KL_Z its weight must be in load_N */
};

struct kl_wheelset_def {
    char name[KL_NAME_SIZE];
    double mass_kg;           /* > 0 */
    double inertia_roll_kgm2; /* I_x > 0 */
    double inertia_spin_kgm2; /* I_y > 0, about the axle */
    double inertia_yaw_kgm2;  /* I_z > 0 */
    double x_m;
    double load_N; /* a dead vertical load on the axle besides weight and suspension, >= 0 */
    uint32_t pair; /* index into pairs */
    struct kl_creep_def creep;
    int independent; /* 0: both wheels on one axle; 1: either turns by itself, each with half of
                        inertia_spin_kgm2 */
    double coupling_Nms_rad; /* of independent wheels: a rotary damper between them, >= 0 */
};

/* The direction in which an element's line, slip, stop, damper and actuator work: along or about an
 * axis, or on the line from point b to point a. Its deflection is the motion of a less that of b;
 * on the line, how much longer it grows. */
enum kl_along {
    KL_ALONG_X = 0,
    KL_ALONG_Y,
    KL_ALONG_Z,
    KL_ALONG_ROLL,
    KL_ALONG_PITCH,
    KL_ALONG_YAW,
    KL_ALONG_LINE
};

/*
 * What becomes of the load that an element carries at rest, P, when its ends move: it stays
 * vertical, so its lines of action part, and the bodies lean under it.
 *   KL_SWAY_NONE     nothing: the ordinary linear spring
 *   KL_SWAY_CLAMPED  a coil or air spring, both ends clamped, point_a = point_b at half its height,
 *                    k measured in shear under the load: besides k s each end bears half of the
 *                    couple P s, and leaning ends push aside with P times their mean angle
 *   KL_SWAY_PINNED   a strut, or a link in tension, hinged at point_a and point_b: -P/h times the
 *                    displacement, h the height of a above b (a hanging link restores)
 * In all but the first case the load also turns the bodies that lean about their centres.
 */
enum kl_sway { KL_SWAY_NONE = 0, KL_SWAY_CLAMPED, KL_SWAY_PINNED };

/* Force (or moment) over deflection or velocity, straight between points and beyond the outer ones;
 * `at` growing, force never falling, and 0 at 0. */
struct kl_table_def {
    uint32_t n; /* 0: none; else 2 .. KL_MAX_TABLE_POINTS */
    const double *at;
    const double *force;
};

/*
 * A spring in series with a damper, with a slider, or with both: its force f = k w follows w' = d' -
 * f/c while |f| < limit, and d goes on alone at the limit.
 *   series spring-damper   k, c, limit = 0 for none; a damper that blows off: with its limit
 *   Coulomb friction       k, c = 0 for none, limit the friction force: sticks elastically, then
 *                          slides
 */
struct kl_slip_def {
    double k;     /* > 0; 0: no such part */
    double c;     /* > 0, or 0: no damper */
    double limit; /* > 0, or 0: no slider */
};

/*
 * What acts between a point of one body and a point of another; all of it at once, parallel.
 * k and c: linear springs and dampers in three directions and about three axes, in the order x, y,
 * z (N/m, N s/m), about x, y, z (N m/rad, N m s/rad). An anti-roll bar is a k about x. `line`: a
 * spring and damper on the line of the points, as a traction rod. The rest along `along`, in N or N
 * m. Stops and slips count deflections from the loaded vehicle at rest: they carry none of the
 * weight.
 * A wheelset rolls freely and does not pitch with its axle boxes: it takes no longitudinal force but
 * as a yaw moment, so in an element that ends on a wheelset the x direction knows yaw alone, not
 * pitch.
 */
struct kl_element_def {
    char name[KL_NAME_SIZE];
    int32_t end_a;
    int32_t end_b;
    double point_a_m[3]; /* vehicle frame */
    double point_b_m[3];
    double k[6]; /* >= 0 */
    double c[6]; /* >= 0 */
    enum kl_sway sway;
    double line_k_N_m;   /* >= 0 */
    double line_c_Ns_m;  /* >= 0 */
    enum kl_along along; /* of all that follow */
    struct kl_slip_def slip;
    struct kl_table_def stop;   /* force over deflection */
    struct kl_table_def damper; /* force over velocity */
    uint32_t actuator;          /* i: input->actuator_N[i - 1] pushes a and pulls b; 0: none */
};

/* One coordinate of a linkage. */
struct kl_term_def {
    int32_t end; /* a body or a wheelset; not the ground */
    enum kl_freedom freedom;
    double factor;
};

/*
 * A linkage ties a linear combination of coordinates: with u = sum factor coordinate it stores k
 * u^2/2 and takes c u'^2. In N/m where u is a length, in N m/rad where it is an angle. A wheelset
 * has y, z, roll and yaw. Coordinates are those of the centres; shifting or turning the whole
 * vehicle sideways must leave u alone, or the linkage would tie it to the track.
 * A rigid one is not eliminated, for the yaw of a wheelset is integrated together with its creep. It
 * has a multiplier, a state of its own among the slips, that takes over the force which lasts: at rest
 * the linkage gives by a thousandth of what it would by the stiffness with which it meets a blow. That
 * one has, on the inertias in it, the angular frequency 1/step (159 Hz at 1 ms; half of what the step
 * could bear), and a third of critical damping. Rigid linkages that share coordinates share it. A rigid
 * linkage that others already imply is a loop, and refused; with the slips there are KL_MAX_SLIPS.
 */
struct kl_linkage_def {
    char name[KL_NAME_SIZE];
    uint32_t n_terms; /* 2 .. KL_MAX_TERMS */
    struct kl_term_def term[KL_MAX_TERMS];
    double k;  /* >= 0 */
    double c;  /* >= 0 */
    int rigid; /* 1: k and c are the builder's */
};

/*
 * The speed V: prescribed, following the input's set-point; or free, a freedom that all bodies and
 * wheelsets share, with their masses and what rolls of them. Free, it follows from torques, creep,
 * the input's draw_force_N and the running resistance A + B V + C V^2, which at rest holds the train
 * with up to A.
 */
struct kl_running_def {
    int free;                 /* 0: prescribed */
    double resistance_N;      /* A >= 0; of a free speed alone, as the next two */
    double resistance_Ns_m;   /* B >= 0 */
    double resistance_Ns2_m2; /* C >= 0 */
};

struct kl_vehicle_def {
    char name[KL_NAME_SIZE];
    int64_t step_ns;                /* fixed step, 10 us .. 10 ms; 1000000 is usual */
    double gravity_m_s2;            /* 0..20 */
    double acceleration_limit_m_s2; /* slope of the speed after a new set-point, > 0 */
    struct kl_running_def running;
    uint32_t n_bodies;
    uint32_t n_wheelsets; /* at least 1 */
    uint32_t n_elements;
    uint32_t n_linkages;
    uint32_t n_pairs;
    const struct kl_body_def *bodies;
    const struct kl_wheelset_def *wheelsets;
    const struct kl_element_def *elements;
    const struct kl_linkage_def *linkages;
    const struct kl_pair_def *pairs;
    const struct kl_track_def *track;
    /* for KL_CREEP_TABLE; may be NULL otherwise. The model keeps the pointer. */
    const struct kl_creep_table *creep_table;
};

/* ---- the model: constant, flashable, made by kl_build ---- */

struct kl_body {
    char name[KL_NAME_SIZE];
    kl_real mass_kg;
    kl_real inertia_kgm2[3];
    kl_real inverse[KL_FREEDOMS]; /* of the mass or the moment of inertia of each freedom */
    kl_real x_m;
    kl_real z_m;
    uint32_t freedoms;
};

struct kl_wheelset {
    char name[KL_NAME_SIZE];
    kl_real mass_kg;
    kl_real inertia_roll_kgm2;
    kl_real inertia_spin_kgm2;
    kl_real inertia_yaw_kgm2;
    kl_real inv_spin_1_kgm2;
    kl_real inv_yaw_1_kgm2;
    kl_real x_m;
    kl_real preload[4];    /* static force of suspension and dead load: y, z (N), roll, yaw (N m) */
    kl_real static_load_N; /* vertical preload and own weight: the axle load */
    uint32_t pair;
    struct kl_creep_def creep;
    uint32_t independent;     /* 1: either wheel turns by itself */
    kl_real coupling_Nms_rad; /* between them */
};

/*
 * The suspension as sparse rows: force on coordinate i = - sum (k q[column] + c q'[column]).
 * Coordinates: five per body (kl_freedom), then four per wheelset (y, z, roll, yaw). Rows come two
 * and two, such that share as many columns as can be: an entry is a column and what either row has
 * there, which may be nothing. Entries come two and two as well: an odd number of them is followed by
 * one of nothing at all.
 */
#define KL_COORDINATES(bodies, wheelsets) (KL_FREEDOMS * (bodies) + 4u * (wheelsets))
#define KL_MAX_COORDINATES KL_COORDINATES(KL_MAX_BODIES, KL_MAX_WHEELSETS)
struct kl_spring {
    KL_ALIGN(2 * sizeof(kl_real)) kl_real k;
    kl_real c;
};
/* Where a coordinate is among q0, q0', q1, q1', ... */
#define KL_PLACE(coordinate) (2u * (coordinate))
struct kl_suspension {
    uint32_t n_coordinates;
    uint32_t n_entries;
    const uint16_t *twins; /* three each: the two rows, of which the second may be n_coordinates for
                              none, and how many entries they have */
    const uint16_t *place; /* n_entries: KL_PLACE of the column */
    const struct kl_spring *spring; /* two each */
};
static inline uint32_t kl_count_twins(const struct kl_suspension *s) {
    return (s->n_coordinates + 1u) / 2u;
}

/*
 * What is not linear, or has a state of its own: forces along one direction each, d = sum factor
 * q[column]. In this order: slips, stops, dampers, actuators.
 */
struct kl_slip {
    kl_real k;
    kl_real inv_c;  /* 0: no damper */
    kl_real most_m; /* w at the limit */
    kl_real gain;   /* w at the end of a step = gain (d - u) + carry u', see kl_strut.c */
    kl_real carry;
};
/* A bend of a table: from `at` on, away from 0, the force has this slope more. */
struct kl_bend {
    kl_real at;
    kl_real slope;
};
struct kl_struts {
    uint32_t n_slips;
    uint32_t n_stops;
    uint32_t n_dampers;
    uint32_t n_actuators;
    uint32_t n_terms;
    uint32_t n_bends;
    const uint16_t *term_start; /* one more than there are struts */
    const uint16_t *column;     /* n_terms */
    const kl_real *factor;      /* n_terms */
    const struct kl_slip *slip;
    const uint16_t *bend_start; /* of each stop and damper: bends above 0, bends below; one more */
    const struct kl_bend *bend; /* n_bends */
    const uint16_t *input;      /* of each actuator: index into actuator_N */
};
static inline uint32_t kl_count_struts(const struct kl_struts *s) {
    return s->n_slips + s->n_stops + s->n_dampers + s->n_actuators;
}

struct kl_running {
    uint32_t free; /* 0: nothing else is used */
    kl_real mass_kg;
    kl_real rolling_kg; /* mass, and I_y/r0^2 of the wheelsets */
    kl_real resistance_N;
    kl_real resistance_Ns_m;
    kl_real resistance_Ns2_m2;
};

struct kl_model {
    uint32_t version;
    uint32_t real_bytes;
    char name[KL_NAME_SIZE];
    int64_t step_ns;
    kl_real step_s;
    kl_real gravity_m_s2;
    kl_real acceleration_limit_m_s2;
    uint32_t n_bodies;
    uint32_t n_wheelsets;
    uint32_t n_pairs;
    uint32_t n_twists; /* wheelsets with independent wheels */
    uint32_t n_states;
    uint32_t n_rails; /* wheelsets on rails that give way sideways */
    const struct kl_body *bodies;
    const struct kl_wheelset *wheelsets;
    const struct kl_pair *pairs;
    struct kl_running running;
    struct kl_suspension suspension;
    struct kl_struts struts;
    struct kl_track track;
    const struct kl_creep_table *creep_table; /* NULL unless a law reads it */
    uint64_t hash;                            /* of everything above that the step reads */
};

/*
 * Builds a model into `arena`; the definition is not needed afterwards. On KL_ERR_MEMORY give
 * `arena->wanted` bytes or more and try again (a few tries may be needed). Every other error names
 * the culprit in `diag` (may be NULL). KL_ERR_SINGULAR: a body is tied to nothing, or has a
 * vertical, roll or pitch freedom that nothing holds: no static equilibrium; or a rigid linkage
 * closes a loop; or a mass or inertia is so small for its springs that no step of this length can
 * follow it. Bound: the sum of its parts; the static equilibrium is cubic in the bodies'
 * freedoms.
 */
enum kl_status kl_build(const struct kl_vehicle_def *def, struct kl_arena *arena,
                        struct kl_model *model, struct kl_diag *diag);

/* FNV-1a over the content of a model (values, not addresses), as stored in model->hash by kl_build.
 */
uint64_t kl_model_hash(const struct kl_model *model);

/* Checks a model that comes from elsewhere (flash): version, real type, capacities, hash.
 * KL_ERR_ARGUMENT or KL_ERR_VALUE. */
enum kl_status kl_model_check(const struct kl_model *model);

#ifdef __cplusplus
}
#endif
#endif
