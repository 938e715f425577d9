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

/* A contact of either wheel, or two of them. */
struct rubbing {
    const struct kl_coefficients *k;
    const kl_both *mu;
    struct kl_contact_forces *contact;
};

/* What the first of two contacts has instead, the same on either side. */
static inline kl_wide instead(kl_real first, kl_wide x) {
#if KL_WIDE == 4
    return kl_wide_join(kl_lane_all(first), kl_wide_second(x));
#else
    (void)x;
    return kl_wide_all(first);
#endif
}

/*
 * Part h of two contacts by laws that saturate the linear forces; `constant` coefficients are the
 * wheelset's own, of the first contact alone.
 */
static inline void saturate(const struct kl_creep_def *def, const struct kl_axle_forces *forces,
                            const struct rubbing *one, const struct rubbing *two, int constant,
                            int h) {
    (void)h;
    const struct kl_coefficients *k1 = one->k;
    const struct kl_coefficients *k2 = two->k;
    struct kl_contact_forces *a = one->contact;
    struct kl_contact_forces *b = two->contact;
    const kl_wide n = KL_WIDE_OF(a->used, b->used, h);
    const kl_wide y = KL_WIDE_OF(a->inv_root, b->inv_root, h);
    const kl_wide two_thirds = n * y;
    const kl_wide third = two_thirds * y;
    kl_wide f11 = KL_WIDE_OF(k1->f11, k2->f11, h) * two_thirds;
    kl_wide f22 = KL_WIDE_OF(k1->f22, k2->f22, h) * two_thirds;
    kl_wide f23 = KL_WIDE_OF(k1->f23, k2->f23, h) * n;
    kl_wide f33 = KL_WIDE_OF(k1->f33, k2->f33, h) * (n * third);
    if (constant) {
        f11 = instead(def->f11_N, f11);
        f22 = instead(def->f22_N, f22);
        f23 = instead(def->f23_Nm, f23);
        f33 = instead(def->f33_Nm2, f33);
    }
    const kl_wide gamma1 = KL_WIDE_OF(a->creepages.gamma1, b->creepages.gamma1, h);
    const kl_wide gamma2 = KL_WIDE_OF(a->creepages.gamma2, b->creepages.gamma2, h);
    const kl_wide omega3 = KL_WIDE_OF(a->creepages.omega3, b->creepages.omega3, h);
    const kl_wide slope = KL_WIDE_OF(forces->slope, forces->slope, h);
    const kl_wide back1 = slope * (f11 * gamma1);
    const kl_wide back2 = slope * (f22 * gamma2 + f23 * omega3);
    const kl_wide limit = KL_WIDE_OF(*one->mu, *two->mu, h) * n + kl_no_limit(def->law);
    const kl_wide secant = kl_wide_saturate(back1, back2, limit);
    const kl_wide reduction = slope * secant;
    const kl_wide along = -(secant * back1);
    const kl_wide across = -(secant * back2);
    const kl_wide about = reduction * (f23 * gamma2 - f33 * omega3);
    KL_WIDE_PUT(a->reduction, b->reduction, h, reduction);
    KL_WIDE_PUT(a->t1, b->t1, h, along);
    KL_WIDE_PUT(a->t2, b->t2, h, across);
    KL_WIDE_PUT(a->m3, b->m3, h, about);
    KL_WIDE_PUT(a->f11_N, b->f11_N, h, f11);
    KL_WIDE_PUT(a->f22_N, b->f22_N, h, f22);
    KL_WIDE_PUT(a->f33_Nm2, b->f33_Nm2, h, f33);
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

static void find_mu(const struct kl_wheelset *restrict wheelset,
                    const struct kl_axle_forces *restrict forces, kl_both *restrict falling,
                    struct rubbing *restrict rubbing) {
    rubbing->mu = (const kl_both *)(const void *)&forces->friction;
    if (wheelset->creep.falls != 0) {
        find_friction(forces, &rubbing->contact->creepages, falling);
        rubbing->mu = (const kl_both *)(const void *)falling;
    }
}

/* A contact by itself. */
static void rub(const struct kl_wheelset *restrict wheelset,
                const struct kl_axle_forces *restrict forces,
                const struct kl_coefficients *restrict k, int constant,
                struct kl_contact_forces *restrict contact) {
    struct rubbing one = {.k = k, .contact = contact};
    kl_both falling;
    find_mu(wheelset, forces, &falling, &one);
    if (kl_saturates(wheelset->creep.law)) {
        KL_EACH_LANE(g) {
            saturate(&wheelset->creep, forces, &one, &one, constant, g);
        }
    } else {
        follow_law(wheelset, k, forces, one.mu, contact);
    }
}

void kl_axle_creep(const struct kl_wheelset *restrict wheelset,
                   const struct kl_coefficients *on_tread, const struct kl_coefficients *on_flange,
                   struct kl_axle_forces *forces) {
    const struct kl_creep_def *def = &wheelset->creep;
    const int constant = def->f11_N > KL_R(0);
#if KL_WIDE == 4
    if (kl_saturates(def->law)) {
        struct rubbing tread = {.k = on_tread, .contact = &forces->tread};
        struct rubbing flange = {.k = on_flange, .contact = &forces->flange};
        kl_both falling[2];
        find_mu(wheelset, forces, &falling[0], &tread);
        find_mu(wheelset, forces, &falling[1], &flange);
        saturate(def, forces, &tread, &flange, constant, 0);
        return;
    }
#endif
    rub(wheelset, forces, on_tread, constant, &forces->tread);
    rub(wheelset, forces, on_flange, 0, &forces->flange);
}
