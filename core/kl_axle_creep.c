/* kl_axle_creep.c - creep of a contact of both wheels, by any law, at a normal force that stands. */
#include "kl_axle.h"

#include "kl_creep_lanes.h"
#include "kl_saturate.h"

void kl_axle_expect(const struct kl_axle *restrict axle, struct kl_axle_forces *restrict forces) {
    struct kl_contact_forces *tread = &forces->tread;
    struct kl_contact_forces *flange = &forces->flange;
    KL_EACH_WIDE(h) {
        const kl_wide n = kl_wide_at_least(KL_WIDE_OF(axle->expected, axle->flange.normal, h),
                                           kl_wide_all(KL_R(1)));
        const kl_wide y = kl_wide_inverse_cbrt(n, KL_CBRT_ROUNDS);
        const kl_wide inv = y * (y * y);
        KL_WIDE_PUT(tread->used, flange->used, h, n);
        KL_WIDE_PUT(tread->inv_root, flange->inv_root, h, y);
        KL_WIDE_PUT(tread->inv_used, flange->inv_used, h, inv);
    }
}

/* Friction that falls with the velocity of slip. */
static void find_friction(const struct kl_axle_forces *restrict forces,
                          const struct kl_creepages *restrict creepages, kl_both *restrict mu) {
    const kl_real v = KL_R(1) / forces->inv_creep_speed_s_m;
    KL_EACH_LANE_LOOP(g) {
        const kl_lane along = KL_LANE(creepages->gamma1, g);
        const kl_lane across = KL_LANE(creepages->gamma2, g);
        const kl_lane slip = v * kl_lane_sqrt(along * along + across * across);
        KL_LANE(*mu, g) = kl_lane_friction(KL_LANE(forces->friction, g), KL_LANE(forces->ratio, g),
                                           KL_LANE(forces->decay, g), slip);
    }
}

/* Laws that saturate the linear forces; `constant` coefficients are the wheelset's own. */
static inline void saturate(const struct kl_wheelset *restrict wheelset,
                            const struct kl_coefficients *restrict k, int constant,
                            const struct kl_axle_forces *restrict forces, const kl_both *mu,
                            struct kl_contact_forces *restrict contact) {
    const struct kl_creep_def *def = &wheelset->creep;
    const kl_lane no_limit = kl_lane_all(kl_no_limit(def->law));
    KL_EACH_LANE(g) {
        const kl_lane n = KL_LANE(contact->used, g);
        const kl_lane y = KL_LANE(contact->inv_root, g);
        const kl_lane two_thirds = n * y;
        const kl_lane third = two_thirds * y;
        const kl_lane f11 = constant ? kl_lane_all(def->f11_N) : KL_LANE(k->f11, g) * two_thirds;
        const kl_lane f22 = constant ? kl_lane_all(def->f22_N) : KL_LANE(k->f22, g) * two_thirds;
        const kl_lane f23 = constant ? kl_lane_all(def->f23_Nm) : KL_LANE(k->f23, g) * n;
        const kl_lane f33 = constant ? kl_lane_all(def->f33_Nm2) : KL_LANE(k->f33, g) * (n * third);
        const kl_lane gamma2 = KL_LANE(contact->creepages.gamma2, g);
        const kl_lane omega3 = KL_LANE(contact->creepages.omega3, g);
        const kl_lane slope = KL_LANE(forces->slope, g);
        const kl_lane back1 = slope * (f11 * KL_LANE(contact->creepages.gamma1, g));
        const kl_lane back2 = slope * (f22 * gamma2 + f23 * omega3);
        const kl_lane limit = KL_LANE(*mu, g) * n + no_limit;
        const kl_lane secant = kl_lane_saturate(back1, back2, limit);
        const kl_lane reduction = slope * secant;
        KL_LANE(contact->reduction, g) = reduction;
        KL_LANE(contact->t1, g) = -(secant * back1);
        KL_LANE(contact->t2, g) = -(secant * back2);
        KL_LANE(contact->m3, g) = reduction * (f23 * gamma2 - f33 * omega3);
        KL_LANE(contact->f11_N, g) = f11;
        KL_LANE(contact->f22_N, g) = f22;
        KL_LANE(contact->f33_Nm2, g) = f33;
    }
}

/* Laws that have more to do. */
static void follow_law(const struct kl_wheelset *restrict wheelset,
                       const struct kl_coefficients *restrict k,
                       const struct kl_axle_forces *restrict forces, const kl_both *friction,
                       struct kl_contact_forces *restrict contact) {
    const struct kl_creep_def *def = &wheelset->creep;
    const int polach = def->law == KL_CREEP_POLACH;
    const kl_lane one = kl_lane_all(KL_R(1));
    KL_EACH_LANE_LOOP(g) {
        const kl_lane n = KL_LANE(contact->used, g);
        const kl_lane y = KL_LANE(contact->inv_root, g);
        const kl_lane two_thirds = n * y;
        const kl_lane third = two_thirds * y;
        const kl_lane mu = KL_LANE(*friction, g);
        const kl_lane slope = KL_LANE(forces->slope, g);
        const kl_lane by =
            (polach ? one : slope) / kl_lane_max(mu, kl_lane_all(KL_R(KL_LEAST_FRICTION)));
        struct kl_creep_lanes in;
        struct kl_creep_lanes_force out;
        kl_lane_normalise(KL_LANE(k->f11, g) * KL_LANE(contact->creepages.gamma1, g),
                          KL_LANE(k->f22, g) * KL_LANE(contact->creepages.gamma2, g),
                          KL_LANE(k->f23, g) * KL_LANE(contact->creepages.omega3, g), by, y, &in);
        /* slope = (k_A + k_S)/2, here and in the input's changes */
        const kl_real whole = KL_R(2) / (def->k_a + def->k_s);
        in.k_a = slope * (def->k_a * whole);
        in.k_s = slope * (def->k_s * whole);
        for (int i = 0; i < KL_CREEP_SHAPES; i++) {
            in.shape[i] = KL_LANE(k->shape[i], g);
        }
        kl_lane_creep(def->law, forces->table, &in, &out);
        const kl_lane limit = mu * n;
        KL_LANE(contact->t1, g) = limit * out.t1;
        KL_LANE(contact->t2, g) = limit * out.t2;
        KL_LANE(contact->m3, g) = limit * third * out.m3;
        KL_LANE(contact->reduction, g) = polach ? out.reduction : slope * out.reduction;
        KL_LANE(contact->f11_N, g) = KL_LANE(k->f11, g) * two_thirds;
        KL_LANE(contact->f22_N, g) = KL_LANE(k->f22, g) * two_thirds;
        KL_LANE(contact->f33_Nm2, g) = KL_LANE(k->f33, g) * (n * third);
    }
}

void kl_axle_creep(const struct kl_wheelset *restrict wheelset,
                   const struct kl_coefficients *restrict coefficients, int constant,
                   const struct kl_axle_forces *restrict forces,
                   struct kl_contact_forces *restrict contact) {
    kl_both falling;
    const kl_both *mu = &forces->friction;
    if (wheelset->creep.falls != 0) {
        find_friction(forces, &contact->creepages, &falling);
        mu = (const kl_both *)(const void *)&falling;
    }
    if (kl_saturates(wheelset->creep.law)) {
        saturate(wheelset, coefficients, constant, forces, mu, contact);
    } else {
        follow_law(wheelset, coefficients, forces, mu, contact);
    }
}
