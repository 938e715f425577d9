/* kl_axle_lift.c - wheels that leave their rails, and come back; what a wheel remembers. */
#include "kl_axle.h"

#include "kl_math.h"

/*
 * How long a blow takes. Rigid wheels on rails without mass know no such time: a shorter step would
 * only make blows higher, and where creep draws a rail to its wheel by more than the tread's slope
 * presses it away, the wheel's own inertia would drive the rail on, with no solution in the end. In
 * truth the contact yields, within about a millisecond. So a wheel that comes down is stopped over this
 * time, and one that is drawn along follows its rail over a tenth of it; steps as long or longer do
 * all of it.
 */
#define BLOWS_1_S 1000.0
#define FOLLOWS_1_S 10000.0

/*
 * A wheel's force on its rail falls with the rail's acceleration by an inertia, and by up to as much
 * again because creep follows the load that is expected. Where less than all of it is reckoned with,
 * rail and wheel swing against each other from step to step; more makes the rail only a little later.
 */
#define SURE_INERTIA 1.5

void kl_axle_carry(const struct kl_lift *lift, kl_real h, struct kl_axle *axle) {
    const kl_real inv_h = h > KL_R(0) ? KL_R(1) / h : KL_R(0);
    axle->step = h;
    axle->inv_step = inv_h;
    axle->settles = kl_min_real(h * KL_R(BLOWS_1_S), KL_R(1));
    const kl_lane one = kl_lane_all(KL_R(1));
    const kl_real follows = kl_min_real(h * KL_R(FOLLOWS_1_S), KL_R(1));
    KL_EACH_LANE(g) {
        const kl_lane faster = kl_lane_load(lift->faster_m_s, g);
        const kl_lane rate = kl_lane_load(lift->rate_m_s, g) + faster;
        const kl_lane mean = rate - KL_R(0.5) * faster;
        const kl_lane before = kl_lane_load(lift->rise_m, g);
        const kl_lane rise = before + h * mean;
        const kl_lane up = kl_lane_positive_or_0(rise, one);
        const kl_lane closing = (one - up) * rate;
        /* what stops it presses the rail too */
        const kl_lane blow = (closing * kl_lane_load(lift->push_kg, g)) * (inv_h * axle->settles);
        KL_LANE(axle->expected, g) = kl_lane_load(lift->expected_N, g);
        KL_LANE(axle->flange.normal, g) = kl_lane_load(lift->flange_N, g);
        KL_LANE(axle->slope_before, g) = kl_lane_load(lift->slope, g);
        KL_LANE(axle->path_rate_before, g) = kl_lane_load(lift->path_m_s, g);
        KL_LANE(axle->shortened, g) = kl_lane_load(lift->short_m, g);
        const kl_lane resist = kl_lane_load(lift->resist_Ns_m, g);
        const kl_lane inertia = kl_lane_load(lift->inertia_kg, g);
        KL_LANE(axle->rail.press, g) =
            ((kl_lane_load(lift->press_N, g) - resist * kl_lane_load(lift->slip_m_s, g)) +
             kl_lane_load(lift->trend_N, g)) -
            kl_lane_at_most(blow, kl_lane_all(KL_R(0)));
        KL_LANE(axle->rail.resist, g) = resist;
        KL_LANE(axle->rail.inertia, g) = kl_lane_at_least(inertia, kl_lane_all(KL_R(0)));
        KL_LANE(axle->rail.behind, g) =
            kl_lane_positive_or_0(-inertia, kl_lane_all(KL_R(1) - follows));
        KL_LANE(axle->rise, g) = kl_lane_at_least(rise, kl_lane_all(KL_R(0)));
        KL_LANE(axle->up, g) = up;
        KL_LANE(axle->rise_rate, g) = up * rate;
        KL_LANE(axle->rise_mean, g) = up * mean;
        KL_LANE(axle->closing, g) = closing;
        KL_LANE(axle->lands, g) = kl_lane_positive_or_0(before, one - up);
    }
}

/* The normal forces of the treads, both wheels held on their rails. */
static inline void find_normals(const struct kl_axle_forces *forces, kl_both *normal) {
    const struct kl_contacts *contacts = &forces->contacts;
    const struct kl_load *load = &forces->load;
    const kl_real down = load->down - contacts->z_part * load->free_y;
    const kl_real roll = load->roll - contacts->roll_part * load->free_y;
    kl_both pulled;
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

/* 1 where x > 0, else 0. */
static inline kl_lane is_positive(kl_lane x) {
    return kl_lane_positive_or_0(x, kl_lane_all(KL_R(1)));
}

/*
 * Both wheels' upward accelerations from the normal forces N0 that there would be without: a wheel
 * on its rail has none unless it would have to be pulled, one that is up or comes off carries
 * nothing. N = N0 + W a, and without creep W is symmetric and positive in all but rounding. One that
 * comes off may take the other along; then both come off.
 */
static void solve_lifting(const struct kl_wheelset *restrict wheelset,
                          const struct kl_axle *restrict axle,
                          struct kl_axle_forces *restrict forces) {
    /* without a load nothing could come down */
    const kl_real loaded = wheelset->static_load_N > KL_R(0) ? KL_R(1) : KL_R(0);
    struct kl_lifting *lifting = &forces->lifting;
    const kl_real w_rr = lifting->right[KL_RIGHT];
    const kl_real w_rl = lifting->right[KL_LEFT];
    const kl_real w_lr = lifting->left[KL_RIGHT];
    const kl_real w_ll = lifting->left[KL_LEFT];
    const kl_real inv = KL_R(1) / (w_rr * w_ll - w_rl * w_lr);
    kl_both without;
    kl_both off;
    kl_both alone;
    kl_both along; /* 1 where this wheel comes off and takes the other along, or finds it off */
    kl_both a;
    kl_both free_y;
    find_normals(forces, &without);
    KL_EACH_LANE(g) {
        const kl_lane n = KL_LANE(without, g);
        KL_LANE(off, g) = loaded * kl_lane_at_least(KL_LANE(axle->up, g), is_positive(-n));
        KL_LANE(alone, g) = -(n / kl_lane_of(w_rr, w_ll, g));
    }
    KL_EACH_LANE(g) {
        const kl_lane other = KL_OTHER(without, g) + kl_lane_of(w_lr, w_rl, g) * KL_LANE(alone, g);
        KL_LANE(along, g) =
            KL_LANE(off, g) * kl_lane_at_least(KL_OTHER(off, g), is_positive(-other));
    }
    const kl_real both = kl_max_real(along[KL_RIGHT], along[KL_LEFT]);
    KL_EACH_LANE(g) {
        const kl_lane n = KL_LANE(without, g);
        const kl_lane together =
            (kl_lane_of(w_rl, w_lr, g) * KL_OTHER(without, g) - kl_lane_of(w_ll, w_rr, g) * n) *
            inv;
        const kl_lane alone_a = KL_LANE(alone, g);
        KL_LANE(a, g) = kl_lane_at_least(KL_LANE(off, g), kl_lane_all(both)) *
                        (alone_a + both * (together - alone_a));
    }
    KL_EACH_LANE(g) {
        const kl_lane one = kl_lane_all(KL_R(1));
        const kl_lane on = one - kl_lane_at_least(KL_LANE(off, g), kl_lane_all(both));
        const kl_lane n = KL_LANE(without, g) + (kl_lane_of(w_rr, w_ll, g) * KL_LANE(a, g) +
                                                 kl_lane_of(w_rl, w_lr, g) * KL_OTHER(a, g));
        KL_LANE(lifting->on, g) = on;
        KL_LANE(lifting->acceleration, g) = KL_LANE(axle->landing, g) + KL_LANE(a, g);
        KL_LANE(free_y, g) = KL_LANE(a, g) * KL_LANE(lifting->free_y, g);
        KL_LANE(forces->tread.normal, g) = on * kl_lane_at_least(n, kl_lane_all(KL_R(0)));
    }
    forces->load.free_y += KL_SUM(free_y);
}

void kl_axle_balance(const struct kl_wheelset *restrict wheelset,
                     const struct kl_axle *restrict axle, struct kl_axle_forces *restrict forces) {
    const struct kl_contacts *contacts = &forces->contacts;
    solve_lifting(wheelset, axle, forces);
    KL_EACH_LANE(g) {
        const kl_lane n = KL_LANE(contacts->flange_all, g) -
                          KL_LANE(contacts->shed, g) * KL_LANE(forces->tread.normal, g);
        const kl_lane held = KL_LANE(axle->rail.held, g);
        KL_LANE(forces->flange.normal, g) = kl_lane_at_least(n, kl_lane_all(KL_R(0)));
        KL_LANE(forces->flange.f11_N, g) *= held;
        KL_LANE(forces->flange.f22_N, g) *= held;
    }
}

/*
 * The tread's force on its rail, over that at rest, and by how much it falls as the rail gives way:
 * by creep, and because a wheel that follows the rail down its plane is lighter. On a flange a wheel
 * slides up and down against creep, which is as stiff a damper as elsewhere.
 */
void kl_axle_keep(const struct kl_pair *restrict pair, const struct kl_wheelset *restrict wheelset,
                  const struct kl_axle *restrict axle, const struct kl_axle_forces *restrict forces,
                  kl_real h, struct kl_lift *restrict lift) {
    const struct kl_lifting *lifting = &forces->lifting;
    const struct kl_contact_forces *tread = &forces->tread;
    const kl_both weight = {lifting->right[KL_RIGHT], lifting->left[KL_LEFT]};
    const kl_real rest = KL_R(0.5) * wheelset->static_load_N;
    const kl_real by = forces->inv_creep_speed_s_m;
    const kl_real steps = h > KL_R(0) ? KL_R(1) : KL_R(0);
    const int limited = kl_axle_is_limited(wheelset);
    const kl_real ahead = forces->speed_m_s * axle->x[KL_WS_YAW];
    KL_EACH_LANE(g) {
        const kl_lane sign = kl_lane_of(KL_R(1), KL_R(-1), g);
        const kl_lane press = KL_LANE(forces->contacts.press, g);
        const kl_lane tangent = KL_LANE(axle->sin_delta, g) * KL_LANE(axle->inv_cos, g);
        const kl_lane push = KL_LANE(weight, g) * press;
        const kl_lane inertia = KL_R(SURE_INERTIA) * (push * tangent);
        const kl_lane resist = by * KL_LANE(tread->reduction, g) * KL_LANE(tread->f22_N, g);
        const kl_lane slip =
            (KL_LANE(axle->outboard_rate, g) - sign * ahead) - KL_LANE(axle->rail.rate, g);
        const kl_lane free = KL_R(1) - KL_LANE(axle->rail.held, g);
        /* without the blow of a landing; of a wheel that comes off, what would hold it */
        const kl_lane off = KL_R(1) - KL_LANE(lifting->on, g);
        const kl_lane climb =
            KL_LANE(lifting->acceleration, g) - (off * KL_LANE(axle->kick, g)) * axle->inv_step;
        const kl_lane blow = KL_LANE(weight, g) * climb;
        const kl_lane explicit = limited
                                     ? kl_lane_all(KL_R(0))
                                     : sign * (KL_LANE(tread->t2, g) * KL_LANE(axle->cos_delta, g));
        const kl_lane aside = press * (KL_LANE(tread->normal, g) - blow) - explicit;
        const kl_lane over = aside - rest * kl_lane_load(pair->central_tan, g);
        const kl_lane pressed = over + (free * kl_lane_at_least(inertia, kl_lane_all(KL_R(0)))) *
                                           KL_LANE(axle->rail.acceleration, g);
        /* on its rail by itself it goes on as it went */
        const kl_lane before = kl_lane_load(lift->press_N, g);
        const kl_lane grown =
            (pressed - before) - resist * (slip - kl_lane_load(lift->slip_m_s, g));
        const kl_lane trend = kl_lane_load(lift->trend_N, g);
        const kl_lane goes_on = steps * (free * (KL_R(1) - KL_LANE(axle->up, g)));
        kl_lane_store(lift->press_N, g, pressed);
        kl_lane_store(lift->slip_m_s, g, slip);
        kl_lane_store(lift->trend_N, g, goes_on * (trend + axle->settles * (grown - trend)));
        kl_lane_store(lift->resist_Ns_m, g, resist);
        kl_lane_store(lift->inertia_kg, g, inertia);
        kl_lane_store(lift->push_kg, g, push);
        kl_lane_store(lift->slope, g, KL_LANE(axle->slope, g));
        kl_lane_store(lift->path_m_s, g, KL_LANE(axle->path_rate, g));
        kl_lane_store(lift->short_m, g, KL_LANE(axle->shortens, g));
        kl_lane_store(lift->flange_N, g, KL_LANE(forces->flange.normal, g));
    }
    KL_EACH_LANE(g) {
        const kl_lane normal = KL_LANE(tread->normal, g);
        /* a wheel that leaves its rail for a moment is soon back */
        const kl_lane before = KL_LANE(tread->used, g);
        const kl_lane next = KL_R(2) * normal - kl_lane_load(lift->normal_N, g);
        const kl_lane kept = kl_lane_at_least(
            kl_lane_at_most(next, KL_R(2) * kl_lane_at_least(KL_R(0.5) * normal, before)),
            KL_R(0.5) * before);
        kl_lane_store(lift->expected_N, g, h > KL_R(0) ? kept : normal);
        kl_lane_store(lift->normal_N, g, normal);
    }
    if (h > KL_R(0)) {
        KL_EACH_LANE(g) {
            const kl_lane inv_sin = KL_LANE(axle->flange.inv_sin, g);
            const kl_lane creep = KL_LANE(forces->flange.reduction, g) *
                                  KL_LANE(forces->flange.f22_N, g) * (inv_sin * inv_sin);
            const kl_lane z = (h * by) * creep / KL_LANE(weight, g);
            const kl_lane up = KL_LANE(axle->up, g);
            const kl_lane off = KL_R(1) - KL_LANE(lifting->on, g);
            const kl_lane kick = KL_LANE(axle->kick, g);
            const kl_lane closing = KL_LANE(axle->closing, g);
            const kl_lane gain = (h * KL_LANE(lifting->acceleration, g) - kick) / (KL_R(1) + z);
            const kl_lane half = KL_R(0.5) * gain;
            /* in the air by the mean of both its accelerations; who comes off has done so all the step */
            const kl_lane mean = (KL_LANE(axle->rise_mean, g) + half) + (closing + kick);
            const kl_lane leaves = off * (KL_R(1) - up);
            kl_lane_store(lift->rise_m, g,
                          KL_LANE(axle->rise, g) +
                              h * (leaves * kl_lane_at_least(mean, kl_lane_all(KL_R(0)))));
            kl_lane_store(lift->rate_m_s, g,
                          kl_lane_if_0(KL_LANE(lifting->on, g), mean + leaves * half,
                                       closing - axle->settles * closing));
            kl_lane_store(lift->faster_m_s, g, off * gain);
        }
    }
}
