/* kl_flange.h - building the table of a flange. Internal to the core (geometry room). */
#ifndef KL_FLANGE_H
#define KL_FLANGE_H

#include "kl_tangency.h"

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

#endif
