/*
 * kl_reach.h - how the ends of elements and linkages move with the coordinates. Internal to the core
 * (vehicle room), for the builder alone.
 */
#ifndef KL_REACH_H
#define KL_REACH_H

#include "kl_vehicle.h"

/* Five coordinates an end, or the terms of a linkage. */
#define KL_REACH_TERMS 10

/* A displacement as a sum of factors times coordinates. */
struct kl_reach {
    uint32_t n;
    uint32_t coordinate[KL_REACH_TERMS];
    double factor[KL_REACH_TERMS];
};

/* What is assembled: the definition, the height of each axle (negative), and the vertical load of
 * each element at rest, or NULL. */
struct kl_assembly {
    const struct kl_vehicle_def *def;
    const double *axle_z_m;
    const double *load_N;
};

static inline int kl_is_wheelset(int32_t end) {
    return end >= KL_WHEELSET_END(0);
}

/* A body, a wheelset or the ground of this definition. */
int kl_is_end(const struct kl_vehicle_def *def, int32_t end);

/* Adds factor times the motion of one end's point along direction 0..5 (x, y, z, about x, y, z).
 * Pitch takes part in x only where with_pitch is not 0. */
void kl_reach_point(const struct kl_assembly *as, int32_t end, const double point[3], int direction,
                    int with_pitch, double factor, struct kl_reach *reach);

/* The deflection of an element along a direction: a less b. Terms of the same coordinate are put
 * together. */
void kl_reach_element(const struct kl_assembly *as, const struct kl_element_def *e,
                      enum kl_along along, struct kl_reach *reach);

/* The combination of a linkage. */
void kl_reach_linkage(const struct kl_vehicle_def *def, const struct kl_linkage_def *linkage,
                      struct kl_reach *reach);

/* How high a point stands above the centre of its end's body: rz, positive below it. */
double kl_reach_below(const struct kl_assembly *as, int32_t end, const double point[3]);

/* Checks the elements. */
enum kl_status kl_elements_check(const struct kl_assembly *as, struct kl_diag *diag);

/* Checks the linkages, and that something ties each body to a wheelset or the ground. */
enum kl_status kl_linkages_check(const struct kl_vehicle_def *def, struct kl_arena *arena,
                                 struct kl_diag *diag);

/* Stiffness and damping of a linkage; of a rigid one what the step can bear, with a slip of negative
 * stiffness and damping that takes off the rest of the stiffness where motion is quick. */
struct kl_linkage_rates {
    double k;
    double c;
    struct kl_slip_def slip;
};
void kl_linkage_rates(const struct kl_vehicle_def *def, uint32_t index, struct kl_linkage_rates *r);

/* The matrices while they are assembled, n by n. The sizes are the sums of absolute contributions. */
struct kl_dense {
    uint32_t n;
    double *k;
    double *k_size;
    double *c;
    double *c_size;
};

/* 1 where the coordinate moves freely under forces: a body's freedom. */
int kl_is_free(const struct kl_vehicle_def *def, uint32_t coordinate);

/* The static equilibrium under gravity, wheelsets held on level track: displacements of all
 * coordinates to q[n], and the reactions on the wheelsets to preload, four each. Scratch is taken
 * from the arena. */
enum kl_status kl_static_solve(const struct kl_vehicle_def *def, const struct kl_dense *m,
                               struct kl_arena *arena, double *q, double *preload,
                               struct kl_diag *diag);

#endif
