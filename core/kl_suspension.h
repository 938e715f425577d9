/* kl_suspension.h - assembling the suspension. Internal to the core (vehicle room). */
#ifndef KL_SUSPENSION_H
#define KL_SUSPENSION_H

#include "kl_step.h"

/* The usual body has all freedoms: nothing to pick. */
#define KL_ALL_FREEDOMS (KL_HAS(KL_FREEDOMS) - 1u)

/* How many freedoms a body has. */
static inline uint32_t kl_freedoms_of(const struct kl_body *body) {
    uint32_t n = 0;
    for (uint32_t f = 0; f < KL_FREEDOMS; f++) {
        n += (body->freedoms >> f) & 1u;
    }
    return n;
}

/* Where the twists of the wheelsets with independent wheels begin, the last states; the rails' before
 * them; those of the slips before these; and those of the wheelsets before all. */
static inline uint32_t kl_twist_states(const struct kl_model *model) {
    return model->n_states - model->n_twists;
}
static inline uint32_t kl_rail_states(const struct kl_model *model) {
    return kl_twist_states(model) - KL_SIDES * model->n_rails;
}
static inline uint32_t kl_slip_states(const struct kl_model *model) {
    return kl_rail_states(model) - model->struts.n_slips;
}
static inline uint32_t kl_wheelset_states(const struct kl_model *model) {
    return kl_slip_states(model) - KL_WHEELSET_STATES * model->n_wheelsets;
}

/* Coordinates of body b's five freedoms and wheelset w's four (y, z, roll, yaw) in a vehicle of
 * n_bodies. */
static inline uint32_t kl_body_coordinate(uint32_t b) {
    return KL_FREEDOMS * b;
}
static inline uint32_t kl_wheelset_coordinate(uint32_t n_bodies, uint32_t w) {
    return KL_FREEDOMS * n_bodies + 4u * w;
}

/* Checks elements and linkages, assembles stiffness and damping, and finds the static reactions on
 * the wheelsets: `preload` has four entries a wheelset, `axle_z_m` each axle's height (negative).
 * The sparse rows are the arena's; scratch is given back. */
enum kl_status kl_suspension_build(const struct kl_vehicle_def *def, const double *axle_z_m,
                                   struct kl_arena *arena, struct kl_suspension *suspension,
                                   double *preload, struct kl_diag *diag);

/* The elements that are not linear. They have been checked by kl_suspension_build. */
enum kl_status kl_struts_build(const struct kl_vehicle_def *def, const double *axle_z_m,
                               struct kl_arena *arena, struct kl_struts *struts,
                               struct kl_diag *diag);

#endif
