/* kl_axle_creep.c - the creep laws that have more to do than a saturation, for both contacts. */
#include "kl_axle.h"

#include "kl_creep_lanes.h"

/* Everything of one law for one contact of both wheels. The contact's normal forces stand. */
void kl_axle_law(const struct kl_wheelset *restrict wheelset,
                 const struct kl_axle_forces *restrict forces,
                 const struct kl_law_contact *restrict contact,
                 struct kl_law_forces *restrict result) {
    const struct kl_creep_def *def = &wheelset->creep;
    const int polach = def->law == KL_CREEP_POLACH;
    KL_EACH_LANE(g) {
        const kl_lane mu = KL_LANE(contact->mu, g);
        const kl_lane slope = KL_LANE(forces->slope, g);
        const kl_lane inv_cbrt = KL_LANE(contact->inv_cbrt, g);
        const kl_lane n = KL_LANE(contact->normal, g);
        const kl_lane one = kl_lane_all(KL_R(1));
        const kl_lane by =
            (polach ? one : slope) / kl_lane_max(mu, kl_lane_all(KL_R(KL_LEAST_FRICTION)));
        struct kl_creep_lanes in;
        struct kl_creep_lanes_force out;
        kl_lane_normalise(KL_LANE(contact->linear1, g), KL_LANE(contact->linear2, g),
                          KL_LANE(contact->linear3, g), by, inv_cbrt, &in);
        /* slope = (k_A + k_S)/2, here and in the input's changes */
        const kl_real whole = KL_R(2) / (def->k_a + def->k_s);
        in.k_a = slope * (def->k_a * whole);
        in.k_s = slope * (def->k_s * whole);
        for (int i = 0; i < KL_CREEP_SHAPES; i++) {
            in.shape[i] = KL_LANE(contact->shape[i], g);
        }
        kl_lane_creep(def->law, forces->table, &in, &out);
        const kl_lane limit = mu * n;
        KL_LANE(result->t1, g) = limit * out.t1;
        KL_LANE(result->t2, g) = limit * out.t2;
        KL_LANE(result->m3, g) = limit * (n * (inv_cbrt * inv_cbrt)) * out.m3;
        KL_LANE(result->reduction, g) = polach ? out.reduction : slope * out.reduction;
    }
}

/* Friction at the velocity of slip, where the model lets it fall with that. */
void kl_axle_friction(const struct kl_wheelset *restrict wheelset,
                      const struct kl_axle_forces *restrict forces,
                      const struct kl_creepages *restrict creepages, kl_both *restrict mu) {
    if (wheelset->creep.falls == 0) {
        KL_EACH_LANE(g) {
            KL_LANE(*mu, g) = KL_LANE(forces->friction, g);
        }
        return;
    }
    const kl_real v = KL_R(1) / forces->inv_creep_speed_s_m;
    KL_EACH_LANE(g) {
        const kl_lane along = KL_LANE(creepages->gamma1, g);
        const kl_lane across = KL_LANE(creepages->gamma2, g);
        const kl_lane slip = v * kl_lane_sqrt(along * along + across * across);
        KL_LANE(*mu, g) = kl_lane_friction(KL_LANE(forces->friction, g), KL_LANE(forces->ratio, g),
                                           KL_LANE(forces->decay, g), slip);
    }
}
