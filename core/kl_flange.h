/* kl_flange.h - building the table of a flange. Internal to the core (geometry room). */
#ifndef KL_FLANGE_H
#define KL_FLANGE_H

#include "kl_row.h"

/* The contact of a flange at one ride height: where it is, and the outboard displacement of the
 * axle at which it just touches. */
struct kl_flange_contact {
    double place_m; /* W */
    double eta_wheel_m;
    double eta_rail_m;
    double slope; /* of the common tangent */
};

/*
 * Finds the contact at ride height H and roll phi_s seen from this side: of all points of the
 * flange the one that meets the gauge face at the least displacement. Returns 0 where the flange is
 * above the rail or below the profile. Bound: one pass over the samples and KL_FLANGE_ROUNDS
 * evaluations.
 */
#define KL_FLANGE_ROUNDS 48
int kl_flange_solve(const struct kl_tangency *tangency, enum kl_side side, double height_m,
                    double phi_s_rad, struct kl_flange_contact *contact);

/* The rows of both treads while a pair is built, 2 half + 1 each. */
struct kl_pair_rows {
    struct kl_row *rows[KL_SIDES];
    uint32_t half;
};

/* A contact point that moves less than this between two places does not jump. */
#define KL_LEAST_JUMP_M 1e-4

/* The table of a wheel that has none. */
void kl_flange_none(struct kl_flange_row rows[2], struct kl_flange_table *table);

/* The tables of both flanges, into `rows` (room for 2 KL_FLANGE_MAX_ROWS). */
void kl_flanges_build(const struct kl_pair_def *def, const struct kl_tangency *t,
                      const struct kl_pair_rows *tables, struct kl_flange_row *rows,
                      struct kl_pair *pair);

/* Ends one tread's table where its flange touches, if it does, and counts the jump to it. Bound: 21
 * postures. */
enum kl_status kl_flange_end_tread(const struct kl_pair_def *def, const struct kl_tangency *t,
                                   const struct kl_pair_rows *tables, enum kl_side s,
                                   struct kl_pair *pair, struct kl_diag *diag);

#endif
