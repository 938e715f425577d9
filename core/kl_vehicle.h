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

#define KL_MODEL_VERSION 1u
#define KL_NAME_SIZE 32
#define KL_MAX_PAIRS 4
#define KL_MAX_ELEMENTS 256

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
};

/*
 * A linear spring and damper, parallel, in three directions and about three axes, between a point
 * of one body and a point of another. Order of k and c: x, y, z (N/m, N s/m), about x, y, z (N
 * m/rad, N m s/rad). A wheelset rolls freely and does not pitch with its axle boxes: it takes no
 * longitudinal force but as a yaw moment, so in an element that ends on a wheelset the x direction
 * knows yaw alone, not pitch.
 */
struct kl_element_def {
    char name[KL_NAME_SIZE];
    int32_t end_a;
    int32_t end_b;
    double point_a_m[3]; /* vehicle frame */
    double point_b_m[3];
    double k[6]; /* >= 0 */
    double c[6]; /* >= 0 */
};

struct kl_vehicle_def {
    char name[KL_NAME_SIZE];
    int64_t step_ns;                /* fixed step, 10 us .. 10 ms; 1000000 is usual */
    double gravity_m_s2;            /* 0..20 */
    double acceleration_limit_m_s2; /* slope of the speed after a new set-point, > 0 */
    uint32_t n_bodies;
    uint32_t n_wheelsets; /* at least 1 */
    uint32_t n_elements;
    uint32_t n_pairs;
    const struct kl_body_def *bodies;
    const struct kl_wheelset_def *wheelsets;
    const struct kl_element_def *elements;
    const struct kl_pair_def *pairs;
    const struct kl_track_def *track;
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
};

/* The suspension as sparse rows: force on coordinate i = - sum (k q[column] + c q'[column]).
 * Coordinates: five per body (kl_freedom), then four per wheelset (y, z, roll, yaw). */
#define KL_COORDINATES(bodies, wheelsets) (KL_FREEDOMS * (bodies) + 4u * (wheelsets))
#define KL_MAX_COORDINATES KL_COORDINATES(KL_MAX_BODIES, KL_MAX_WHEELSETS)
struct kl_spring {
    kl_real k;
    kl_real c;
};
struct kl_suspension {
    uint32_t n_coordinates;
    uint32_t n_entries;
    const uint16_t *row_start;      /* n_coordinates + 1 */
    const uint16_t *column;         /* n_entries */
    const struct kl_spring *spring; /* n_entries */
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
    uint32_t n_states;
    const struct kl_body *bodies;
    const struct kl_wheelset *wheelsets;
    const struct kl_pair *pairs;
    struct kl_suspension suspension;
    struct kl_track track;
    uint64_t hash; /* of everything above that the step reads */
};

/*
 * Builds a model into `arena`; the definition is not needed afterwards. On KL_ERR_MEMORY give
 * `arena->wanted` bytes or more and try again (a few tries may be needed). Every other error names
 * the culprit in `diag` (may be NULL). KL_ERR_SINGULAR: a body has a vertical, roll or pitch
 * freedom that nothing holds: no static equilibrium. Bound: the sum of its parts.
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
