/* kl_axle_flange.c - the flanges of a wheelset within a step. */
#include "kl_axle.h"

#include "kl_lookup.h"
#include "kl_math.h"
#include "kl_saturate.h"

/* The damper begins to act over this much of the overlap, so that a touch is not a blow. */
#define SOFT_M 1e-4

/* A column of both sides' rows: n = 0 the lower, 1 the upper. */
#define FIELD(axle, n, field, g)                                                                   \
    kl_lane_of((axle)->flange.row[KL_RIGHT][n].field, (axle)->flange.row[KL_LEFT][n].field, g)

#define ROW_REALS (sizeof(struct kl_flange_row) / sizeof(kl_real))

/* Two neighbouring columns, the first of them `field`, linear in between. */
#define COLUMNS(axle, field, first, second)                                                        \
    kl_lane_columns(&(axle)->flange.row[KL_RIGHT]->field, &(axle)->flange.row[KL_LEFT]->field,     \
                    ROW_REALS, (axle)->flange.t[KL_RIGHT], (axle)->flange.t[KL_LEFT], first,       \
                    second)

static void find_row(const struct kl_pair *pair, int side, struct kl_axle *axle, kl_real *t) {
    const struct kl_flange_table *table = &pair->flange[side];
    const uint32_t last = table->n_rows - 2u;
    const kl_real place = (table->top_m - axle->height[side]) * pair->inv_step_1_m;
    const kl_real kept = kl_clamp(place, KL_R(0), (kl_real)(last + 1u));
    const uint32_t i = (uint32_t)kept < last ? (uint32_t)kept : last;
    axle->flange.row[side] = &table->rows[i];
    *t = kept - (kl_real)i;
    /* beyond the last row the wheel has climbed */
    axle->faults |= place > (kl_real)(last + 1u) ? (uint32_t)KL_FAULT_DERAILED : 0u;
}

void kl_axle_flange_posture(const struct kl_pair *restrict pair, struct kl_axle *restrict axle) {
    struct kl_flange *flange = &axle->flange;
    kl_real right;
    kl_real left;
    find_row(pair, KL_RIGHT, axle, &right);
    find_row(pair, KL_LEFT, axle, &left);
    KL_EACH_LANE(g) {
        KL_LANE(flange->t, g) = kl_lane_of(right, left, g);
    }
    COLUMNS(axle, inv_sin, &flange->inv_sin, &flange->inv_cos);
    COLUMNS(axle, contact.arm_m, &flange->arm, &flange->radius);
    COLUMNS(axle, contact.sin_delta, &flange->sin_delta, &flange->cos_delta);
    const kl_real lean = KL_R(0.5) * (axle->x[KL_WS_YAW] * axle->x[KL_WS_YAW]);
    KL_EACH_LANE(g) {
        const struct kl_lane_hermite place = kl_lane_flange_place(
            FIELD(axle, 0, place_m, g), FIELD(axle, 0, place_h, g), FIELD(axle, 1, place_m, g),
            FIELD(axle, 1, place_h, g), KL_LANE(flange->t, g), pair->step_m, pair->inv_step_1_m);
        const kl_lane sin_delta = KL_LANE(flange->sin_delta, g);
        const kl_lane inv_cos = KL_LANE(flange->inv_cos, g);
        const kl_lane radius = KL_LANE(flange->radius, g);
        /* yawed, a flange touches ahead of the axle, where it is broader */
        const kl_lane reach = radius * (sin_delta * inv_cos);
        const kl_lane overlap = (KL_LANE(axle->outboard, g) - place.value) + lean * reach;
        const kl_lane rate =
            KL_LANE(axle->outboard_rate, g) - place.slope * KL_LANE(axle->height_rate, g);
        const kl_lane soft = kl_lane_min(overlap * KL_R(1.0 / SOFT_M), kl_lane_all(KL_R(1)));
        const kl_lane push =
            pair->flange_stiffness_N_m * overlap + pair->flange_damping_Ns_m * (soft * rate);
        KL_LANE(flange->reach, g) = reach;
        KL_LANE(flange->overlap, g) = overlap;
        KL_LANE(flange->rate, g) = rate;
        KL_LANE(flange->push, g) =
            kl_lane_positive_or_0(overlap, kl_lane_max(push, kl_lane_all(KL_R(0))));
    }
}

static void find_creepages(const struct kl_axle *axle, struct kl_axle_forces *forces) {
    const struct kl_flange *flange = &axle->flange;
    struct kl_contact_forces *f = &forces->flange;
    const kl_real by = forces->inv_creep_speed_s_m;
    const kl_lane speed = kl_lane_all(forces->speed_m_s);
    const kl_lane ahead = kl_lane_all(forces->speed_m_s * axle->x[KL_WS_YAW]);
    KL_EACH_LANE(g) {
        const kl_lane sign = kl_lane_of(KL_R(1), KL_R(-1), g);
        const kl_lane turn = sign * axle->x[KL_WS_YAW_RATE];
        const kl_lane spin = KL_LANE(axle->spin, g);
        const kl_lane down = sign * KL_LANE(axle->height_rate, g);
        const kl_lane along =
            (speed - KL_LANE(flange->radius, g) * spin) - KL_LANE(flange->arm, g) * turn;
        KL_LANE(f->creepages.gamma1, g) = along * by;
        KL_LANE(f->creepages.gamma2, g) =
            -(down * KL_LANE(flange->inv_sin, g) + ahead * KL_LANE(flange->inv_cos, g)) * by;
        KL_LANE(f->creepages.omega3, g) = (KL_LANE(flange->cos_delta, g) * axle->x[KL_WS_YAW_RATE] -
                                           KL_LANE(flange->sin_delta, g) * (sign * spin)) *
                                          by;
    }
}

/* Creep coefficients of both contacts at unit load. */
struct coefficients {
    kl_both f11;
    kl_both f22;
    kl_both f23;
    kl_both f33;
};

static void follow_law(const struct kl_wheelset *wheelset, const struct kl_axle *axle,
                       const struct coefficients *k, struct kl_axle_forces *forces) {
    struct kl_contact_forces *f = &forces->flange;
    struct kl_law_contact contact;
    struct kl_law_forces law;
    COLUMNS(axle, contact.shape[0], &contact.shape[0], &contact.shape[1]);
    COLUMNS(axle, contact.shape[2], &contact.shape[2], &contact.shape[3]);
    COLUMNS(axle, contact.shape[4], &contact.shape[4], &contact.shape[5]);
    KL_EACH_LANE(g) {
        const kl_lane n = KL_LANE(axle->flange.push, g) * KL_LANE(axle->flange.inv_sin, g);
        const kl_lane y =
            kl_lane_inverse_cbrt(kl_lane_max(n, kl_lane_all(KL_R(1))), KL_CBRT_ROUNDS);
        const kl_lane two_thirds = n * y;
        KL_LANE(contact.linear1, g) = KL_LANE(k->f11, g) * KL_LANE(f->creepages.gamma1, g);
        KL_LANE(contact.linear2, g) = KL_LANE(k->f22, g) * KL_LANE(f->creepages.gamma2, g);
        KL_LANE(contact.linear3, g) = KL_LANE(k->f23, g) * KL_LANE(f->creepages.omega3, g);
        KL_LANE(contact.normal, g) = n;
        KL_LANE(contact.inv_cbrt, g) = y;
        KL_LANE(contact.mu, g) = KL_LANE(f->mu, g);
        KL_LANE(f->normal, g) = n;
        KL_LANE(f->f11_N, g) = KL_LANE(k->f11, g) * two_thirds;
        KL_LANE(f->f22_N, g) = KL_LANE(k->f22, g) * two_thirds;
        KL_LANE(f->third, g) = two_thirds * y;
    }
    kl_axle_law(wheelset, forces, &contact, &law);
    KL_EACH_LANE(g) {
        KL_LANE(f->t1, g) = KL_LANE(law.t1, g);
        KL_LANE(f->t2, g) = KL_LANE(law.t2, g);
        KL_LANE(f->m3, g) = KL_LANE(law.m3, g);
        KL_LANE(f->reduction, g) = KL_LANE(law.reduction, g);
    }
}

static void saturate(const struct kl_wheelset *wheelset, const struct kl_axle *axle,
                     const struct coefficients *coefficients, struct kl_axle_forces *forces) {
    const struct coefficients k = *coefficients;
    struct kl_contact_forces *f = &forces->flange;
    const kl_lane no_limit = kl_lane_all(kl_no_limit(wheelset->creep.law));
    KL_EACH_LANE(g) {
        const kl_lane n = KL_LANE(axle->flange.push, g) * KL_LANE(axle->flange.inv_sin, g);
        const kl_lane y =
            kl_lane_inverse_cbrt(kl_lane_max(n, kl_lane_all(KL_R(1))), KL_CBRT_ROUNDS);
        const kl_lane two_thirds = n * y;
        const kl_lane f11 = KL_LANE(k.f11, g) * two_thirds;
        const kl_lane f22 = KL_LANE(k.f22, g) * two_thirds;
        const kl_lane f23 = KL_LANE(k.f23, g) * n;
        const kl_lane f33 = KL_LANE(k.f33, g) * (n * (two_thirds * y));
        const kl_lane gamma2 = KL_LANE(f->creepages.gamma2, g);
        const kl_lane omega3 = KL_LANE(f->creepages.omega3, g);
        const kl_lane slope = KL_LANE(forces->slope, g);
        const kl_lane t1 = -(slope * (f11 * KL_LANE(f->creepages.gamma1, g)));
        const kl_lane t2 = -(slope * (f22 * gamma2 + f23 * omega3));
        const kl_lane limit = KL_LANE(f->mu, g) * n + no_limit;
        const kl_lane secant = kl_lane_saturate(t1, t2, limit);
        const kl_lane reduction = slope * secant;
        KL_LANE(f->normal, g) = n;
        KL_LANE(f->reduction, g) = reduction;
        KL_LANE(f->t1, g) = secant * t1;
        KL_LANE(f->t2, g) = secant * t2;
        KL_LANE(f->m3, g) = reduction * (f23 * gamma2 - f33 * omega3);
        KL_LANE(f->f11_N, g) = f11;
        KL_LANE(f->f22_N, g) = f22;
        KL_LANE(f->third, g) = two_thirds * y;
    }
}

static void find_creep(const struct kl_wheelset *wheelset, const struct kl_axle *axle,
                       struct kl_axle_forces *forces) {
    struct coefficients k;
    COLUMNS(axle, contact.f11_1, &k.f11, &k.f22);
    COLUMNS(axle, contact.f23_1, &k.f23, &k.f33);
    kl_axle_friction(wheelset, forces, &forces->flange.creepages, &forces->flange.mu);
    if (kl_saturates(wheelset->creep.law)) {
        saturate(wheelset, axle, &k, forces);
    } else {
        follow_law(wheelset, axle, &k, forces);
    }
}

void kl_axle_flange_load(const struct kl_wheelset *restrict wheelset,
                         const struct kl_axle *restrict axle,
                         struct kl_axle_forces *restrict forces) {
    const struct kl_flange *flange = &axle->flange;
    const struct kl_contact_forces *f = &forces->flange;
    struct kl_load *load = &forces->load;
    kl_both aside;
    kl_both down;
    kl_both roll;
    kl_both yaw;
    kl_both spin;
    find_creepages(axle, forces);
    find_creep(wheelset, axle, forces);
    KL_EACH_LANE(g) {
        const kl_lane sign = kl_lane_of(KL_R(1), KL_R(-1), g);
        const kl_lane push = KL_LANE(flange->push, g);
        const kl_lane t1 = KL_LANE(f->t1, g);
        const kl_lane t2 = KL_LANE(f->t2, g);
        const kl_lane sin_delta = KL_LANE(flange->sin_delta, g);
        const kl_lane cos_delta = KL_LANE(flange->cos_delta, g);
        const kl_lane arm = KL_LANE(flange->arm, g);
        const kl_lane y = t2 * cos_delta - sign * push;
        const kl_lane z = -(KL_LANE(f->normal, g) * cos_delta + sign * (t2 * sin_delta));
        KL_LANE(aside, g) = y;
        KL_LANE(down, g) = z;
        KL_LANE(roll, g) = sign * (arm * z) - KL_LANE(flange->radius, g) * y;
        KL_LANE(yaw, g) = (KL_LANE(f->m3, g) * cos_delta - sign * (arm * t1)) -
                          push * (KL_LANE(flange->reach, g) * axle->x[KL_WS_YAW]);
        KL_LANE(spin, g) = KL_LANE(flange->radius, g) * t1;
    }
    load->lateral += KL_SUM(aside);
    load->down += KL_SUM(down);
    load->roll += KL_SUM(roll);
    load->yaw += KL_SUM(yaw);
    load->drive -= KL_SUM(spin);
}
