/* kl_axle_lift.c - wheels that leave their rails, and come back. */
#include "kl_axle.h"

#include "kl_math.h"

void kl_axle_lift_carry(const struct kl_lift *lift, kl_real h, struct kl_axle *axle) {
    const kl_real inv_h = h > KL_R(0) ? KL_R(1) / h : KL_R(0);
    axle->inv_step = inv_h;
    KL_EACH_LANE(g) {
        const kl_lane rate = kl_lane_load(lift->rate_m_s, g);
        const kl_lane rise = kl_lane_load(lift->rise_m, g) + h * rate;
        const kl_lane up = kl_lane_positive_or_0(rise, kl_lane_all(KL_R(1)));
        KL_LANE(axle->expected, g) = kl_lane_load(lift->expected_N, g);
        KL_LANE(axle->slope_before, g) = kl_lane_load(lift->slope, g);
        KL_LANE(axle->rise, g) = kl_lane_positive_or_0(rise, rise);
        KL_LANE(axle->up, g) = up;
        KL_LANE(axle->rise_rate, g) = up * rate;
        /* who comes down on the rail is stopped within the step */
        KL_LANE(axle->landing, g) = (up - kl_lane_all(KL_R(1))) * rate * inv_h;
    }
}

void kl_axle_lift_prepare(const struct kl_wheelset *restrict wheelset,
                          const struct kl_pair *restrict pair, const struct kl_axle *restrict axle,
                          struct kl_axle_forces *restrict forces) {
    struct kl_lifting *lifting = &forces->lifting;
    kl_both known;
    KL_EACH_LANE(g) {
        const kl_lane sign = kl_lane_of(KL_R(1), KL_R(-1), g);
        const kl_lane share = kl_lane_load(pair->share, g);
        KL_LANE(lifting->down, g) = wheelset->mass_kg * share;
        KL_LANE(lifting->roll, g) = sign * (wheelset->inertia_roll_kgm2 * pair->inv_base_1_m);
        KL_LANE(lifting->free_y, g) =
            axle->z_y * KL_LANE(lifting->down, g) + axle->phi_y * KL_LANE(lifting->roll, g);
        KL_LANE(known, g) = KL_LANE(axle->landing, g) * KL_LANE(lifting->down, g);
    }
    forces->load.down += KL_SUM(known);
    KL_EACH_LANE(g) {
        KL_LANE(known, g) = KL_LANE(axle->landing, g) * KL_LANE(lifting->roll, g);
    }
    forces->load.roll += KL_SUM(known);
}

/* A column for either wheel. */
void kl_axle_lift_weights(struct kl_axle_forces *forces) {
    struct kl_lifting *lifting = &forces->lifting;
    const struct kl_contacts *contacts = &forces->contacts;
    KL_EACH_LANE(g) {
        const kl_lane free_y = KL_LANE(lifting->free_y, g);
        const kl_lane down = KL_LANE(lifting->down, g) - contacts->z_part * free_y;
        const kl_lane roll = KL_LANE(lifting->roll, g) - contacts->roll_part * free_y;
        const kl_lane right =
            contacts->by_down[KL_RIGHT] * down + contacts->by_roll[KL_RIGHT] * roll;
        const kl_lane left = contacts->by_down[KL_LEFT] * down + contacts->by_roll[KL_LEFT] * roll;
        const kl_lane pulled = contacts->pulls[KL_RIGHT] * right + contacts->pulls[KL_LEFT] * left;
        KL_LANE(lifting->right, g) = right - contacts->backs[KL_RIGHT] * pulled;
        KL_LANE(lifting->left, g) = left - contacts->backs[KL_LEFT] * pulled;
    }
}

/* The normal forces that the creep forces ask for, both wheels held on their rails. */
static inline void find_normals(const struct kl_axle *axle, const struct kl_axle_forces *forces,
                                kl_both *normal) {
    const struct kl_contacts *contacts = &forces->contacts;
    const struct kl_load *load = &forces->load;
    kl_both across;
    kl_both sinks;
    kl_both turns;
    kl_both pulled;
    KL_EACH_LANE(g) {
        const kl_lane t2 = KL_LANE(forces->t2, g);
        const kl_lane sign = kl_lane_of(KL_R(1), KL_R(-1), g);
        KL_LANE(across, g) = KL_LANE(forces->gain, g) * t2;
        KL_LANE(sinks, g) = sign * (KL_LANE(axle->sin_delta, g) * t2);
        KL_LANE(turns, g) = KL_LANE(contacts->turns, g) * t2;
    }
    const kl_real free_y = load->free_y + KL_SUM(across);
    const kl_real down = (load->down - contacts->z_part * free_y) - KL_SUM(sinks);
    const kl_real roll = (load->roll - contacts->roll_part * free_y) - KL_SUM(turns);
    KL_EACH_LANE(g) {
        const kl_lane n =
            KL_LANE(contacts->by_down, g) * down + KL_LANE(contacts->by_roll, g) * roll;
        KL_LANE(*normal, g) = n;
        KL_LANE(pulled, g) = KL_LANE(contacts->pulls, g) * n;
    }
    const kl_real all = KL_SUM(pulled);
    KL_EACH_LANE(g) {
        KL_LANE(*normal, g) -= KL_LANE(contacts->backs, g) * all;
    }
}

/*
 * Both wheels' upward accelerations from the normal forces N0 that there would be without: a wheel
 * on its rail has none unless it would have to be pulled, one that is up or comes off carries
 * nothing. N = N0 + W a, and W is symmetric and positive in all but rounding.
 */
void kl_axle_lift_solve(const struct kl_wheelset *restrict wheelset,
                        const struct kl_axle *restrict axle,
                        struct kl_axle_forces *restrict forces) {
    const int loaded =
        wheelset->static_load_N > KL_R(0); /* without a load nothing could come down */
    const int limited = wheelset->creep.law != KL_CREEP_LINEAR;
    struct kl_lifting *lifting = &forces->lifting;
    kl_both without;
    find_normals(axle, forces, &without);
    const kl_real n_r = without[KL_RIGHT];
    const kl_real n_l = without[KL_LEFT];
    const kl_real w_rr = lifting->right[KL_RIGHT];
    const kl_real w_rl = lifting->right[KL_LEFT];
    const kl_real w_lr = lifting->left[KL_RIGHT];
    const kl_real w_ll = lifting->left[KL_LEFT];
    const kl_real alone_r = -n_r / w_rr;
    const kl_real alone_l = -n_l / w_ll;
    int off_r = loaded && (axle->up[KL_RIGHT] > KL_R(0) || n_r < KL_R(0));
    int off_l = loaded && (axle->up[KL_LEFT] > KL_R(0) || n_l < KL_R(0));
    const int drags_r = n_r + w_rl * alone_l < KL_R(0);
    const int drags_l = n_l + w_lr * alone_r < KL_R(0);
    const int both = (off_r && (off_l || drags_l)) || (off_l && drags_r);
    off_r = off_r || both;
    off_l = off_l || both;
    const kl_real inv = KL_R(1) / (w_rr * w_ll - w_rl * w_lr);
    const kl_real both_r = (w_rl * n_l - w_ll * n_r) * inv;
    const kl_real both_l = (w_lr * n_r - w_rr * n_l) * inv;
    const kl_real a_r = off_r ? (both ? both_r : alone_r) : KL_R(0);
    const kl_real a_l = off_l ? (both ? both_l : alone_l) : KL_R(0);
    const kl_both a = {a_r, a_l};
    const kl_both on = {off_r ? KL_R(0) : KL_R(1), off_l ? KL_R(0) : KL_R(1)};
    const kl_both n = {n_r + (w_rr * a_r + w_rl * a_l), n_l + (w_lr * a_r + w_ll * a_l)};
    kl_both free_y;
    KL_EACH_LANE(g) {
        const kl_lane zero = kl_lane_all(KL_R(0));
        const kl_lane one = kl_lane_all(KL_R(1));
        KL_LANE(lifting->on, g) = KL_LANE(on, g);
        KL_LANE(lifting->acceleration, g) = KL_LANE(axle->landing, g) + KL_LANE(a, g);
        KL_LANE(free_y, g) = KL_LANE(a, g) * KL_LANE(lifting->free_y, g);
        const kl_lane normal = KL_LANE(on, g) * kl_lane_max(KL_LANE(n, g), zero);
        /* creep stays within what this normal force allows */
        const kl_lane used = kl_lane_max(KL_LANE(forces->contacts.used, g), one);
        const kl_lane within = limited ? kl_lane_min(normal / used, one) : KL_LANE(on, g);
        KL_LANE(forces->normal, g) = normal;
        KL_LANE(forces->t1, g) = within * KL_LANE(forces->t1, g);
        KL_LANE(forces->t2, g) = within * KL_LANE(forces->t2, g);
    }
    forces->load.free_y += KL_SUM(free_y);
}

/* On a flange a wheel slides up and down against creep, which is as stiff a damper as elsewhere. */
void kl_axle_lift_finish(const struct kl_axle *restrict axle,
                         const struct kl_axle_forces *restrict forces, kl_real h,
                         struct kl_lift *restrict lift) {
    const struct kl_lifting *lifting = &forces->lifting;
    const kl_both weight = {lifting->right[KL_RIGHT], lifting->left[KL_LEFT]};
    KL_EACH_LANE(g) {
        const kl_lane inv_sin = KL_LANE(axle->flange.inv_sin, g);
        const kl_lane creep = KL_LANE(forces->flange.reduction, g) *
                              KL_LANE(forces->flange.f22_N, g) * (inv_sin * inv_sin);
        const kl_lane z = (h * forces->inv_creep_speed_s_m) * creep / KL_LANE(weight, g);
        const kl_lane rate =
            kl_lane_load(lift->rate_m_s, g) + h * KL_LANE(lifting->acceleration, g) / (KL_R(1) + z);
        kl_lane_store(lift->rise_m, g, KL_LANE(axle->rise, g));
        const kl_lane normal = KL_LANE(forces->normal, g);
        kl_lane_store(lift->slope, g, KL_LANE(axle->slope, g));
        kl_lane_store(lift->expected_N, g, KL_R(2) * normal - kl_lane_load(lift->normal_N, g));
        kl_lane_store(lift->normal_N, g, normal);
        kl_lane_store(lift->rate_m_s, g,
                      kl_lane_if_0(KL_LANE(lifting->on, g), rate, kl_lane_all(KL_R(0))));
    }
}
