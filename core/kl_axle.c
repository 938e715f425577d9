/* kl_axle.c - forces and accelerations of a wheelset within a step. */
#include "kl_axle.h"

#include "kl_math.h"
#include "kl_saturate.h"

void kl_axle_find_creep(const struct kl_wheelset *restrict wheelset,
                        const struct kl_axle *restrict axle,
                        struct kl_axle_forces *restrict forces) {
    struct kl_contact_forces *tread = &forces->tread;
    const kl_real v = forces->speed_m_s;
    const kl_real by = forces->inv_creep_speed_s_m;
    const kl_lane speed = kl_lane_all(v);
    const kl_lane across_0 = kl_lane_all(axle->rate[KL_WS_Y] - v * axle->x[KL_WS_YAW]);
    KL_EACH_LANE(g) {
        const kl_lane sign = kl_lane_of(KL_R(1), KL_R(-1), g);
        const kl_lane turn = sign * axle->x[KL_WS_YAW_RATE];
        const kl_lane spin = KL_LANE(axle->spin, g);
        const kl_lane r = KL_LANE(axle->radius, g);
        const kl_lane along = (speed - r * spin) - KL_LANE(axle->arm, g) * turn;
        const kl_lane across =
            (across_0 - r * axle->roll_rate) - sign * KL_LANE(axle->rail.rate, g);
        const kl_lane about = KL_LANE(axle->cos_delta, g) * axle->x[KL_WS_YAW_RATE] -
                              KL_LANE(axle->sin_delta, g) * (sign * spin);
        KL_LANE(tread->creepages.gamma1, g) = along * by;
        KL_LANE(tread->creepages.gamma2, g) = across * by * KL_LANE(axle->inv_cos, g);
        KL_LANE(tread->creepages.omega3, g) = about * by;
    }
    struct kl_coefficients on_flange;
    kl_axle_flange_creepages(wheelset, axle, &on_flange, forces);
    kl_axle_creep(wheelset, &axle->creep, &on_flange, forces);
}

/*
 * A contact that bears on its rail: what a newton of its normal force, with the creep that goes with
 * it, does. Of one pass, see KL_EACH_LANE.
 */
struct bearing {
    kl_lane aside; /* to the rail, outboard */
    kl_lane lift;  /* to the wheel, upwards */
    kl_lane roll;  /* about the middle of the axle, upwards on this side */
};

/* Friction does not quite hold a wheel on a slope for ever: a newton lifts, and a flange's presses
 * aside, by at least this. */
#define LEAST_BEARING 0.1

/* Of the side of pass g; `inboard` is its T2 per newton of N; its normal acts `out` from the middle
 * and `low` below it. */
static inline struct bearing bear(kl_lane inboard, kl_lane sin_delta, kl_lane cos_delta,
                                  kl_lane arm, kl_lane radius, kl_lane out, kl_lane low) {
    const struct bearing b = {.aside = sin_delta - inboard * cos_delta,
                              .lift = cos_delta + inboard * sin_delta,
                              .roll = (out * cos_delta - low * sin_delta) +
                                      inboard * (arm * sin_delta + radius * cos_delta)};
    return b;
}

/* T2 of a contact per newton of N, inboard; at most all of it. */
static inline kl_lane inboard_of(const struct kl_contact_forces *contact, int g) {
    const kl_lane most = kl_lane_all(KL_R(1));
    const kl_lane ratio = KL_LANE(contact->t2, g) * KL_LANE(contact->inv_used, g);
    return kl_lane_of(KL_R(1), KL_R(-1), g) * kl_lane_at_least(kl_lane_at_most(ratio, most), -most);
}

/* Creep that does not follow the normal force is a load like others. */
static void load_creep(const struct kl_axle *restrict axle,
                       struct kl_axle_forces *restrict forces) {
    struct kl_contact_forces *tread = &forces->tread;
    kl_both aside;
    kl_both down;
    kl_both roll;
    KL_EACH_LANE_LOOP(g) {
        const kl_lane on = kl_lane_all(KL_R(1)) - KL_LANE(axle->up, g);
        const kl_lane sign = kl_lane_of(KL_R(1), KL_R(-1), g);
        const kl_lane t2 = on * KL_LANE(tread->t2, g);
        const kl_lane s = KL_LANE(axle->sin_delta, g);
        const kl_lane c = KL_LANE(axle->cos_delta, g);
        KL_LANE(tread->t1, g) *= on;
        KL_LANE(tread->t2, g) = t2;
        KL_LANE(tread->m3, g) *= on;
        KL_LANE(aside, g) = t2 * c;
        KL_LANE(down, g) = -(sign * (t2 * s));
        KL_LANE(roll, g) =
            -(KL_LANE(axle->arm, g) * (t2 * s) + KL_LANE(axle->radius, g) * (t2 * c));
    }
    forces->load.lateral += KL_SUM(aside);
    forces->load.down += KL_SUM(down);
    forces->load.roll += KL_SUM(roll);
}

/*
 * What the flange bears without the tread, as a load: with both the rail is pressed aside by k q + c
 * q' and what presses it at rest. A newton on the tread then relieves the flange of what it presses
 * itself, and both together do not press aside. A flange carries when its wheel rises and the axle
 * is rolled: its arms turn.
 */
static void share_with_flange(const struct kl_wheelset *restrict wheelset,
                              const struct kl_pair *restrict pair,
                              const struct kl_axle *restrict axle,
                              struct kl_axle_forces *restrict forces) {
    struct kl_bearings *together = &forces->together;
    const struct kl_flange *f = &axle->flange;
    struct kl_contacts *contacts = &forces->contacts;
    const kl_real rest = KL_R(0.5) * wheelset->static_load_N;
    const kl_real turn = axle->roll - axle->track.value.cross_rad;
    const int limited = kl_axle_is_limited(wheelset);
    const kl_lane none = kl_lane_all(KL_R(0));
    const kl_lane least = kl_lane_all(KL_R(LEAST_BEARING));
    kl_both aside;
    kl_both up;
    kl_both roll;
    KL_EACH_LANE(g) {
        const kl_lane sign = kl_lane_of(KL_R(1), KL_R(-1), g);
        const kl_lane held = KL_LANE(axle->rail.held, g);
        const kl_lane arm = KL_LANE(axle->arm, g);
        const kl_lane radius = KL_LANE(axle->radius, g);
        const struct bearing tread =
            bear(limited ? inboard_of(&forces->tread, g) : none, KL_LANE(axle->sin_delta, g),
                 KL_LANE(axle->cos_delta, g), arm, radius, arm, radius);
        /* the arms of a flange turn with the roll, `down` on this side */
        const kl_lane down = sign * turn;
        const kl_lane flange_arm = KL_LANE(f->arm, g);
        const kl_lane flange_radius = KL_LANE(f->radius, g);
        const struct bearing flange =
            bear(inboard_of(&forces->flange, g), KL_LANE(f->sin_delta, g), KL_LANE(f->cos_delta, g),
                 flange_arm, flange_radius, flange_arm - flange_radius * down,
                 flange_radius + flange_arm * down);
        const kl_lane press = (pair->flange_stiffness_N_m * KL_LANE(axle->rail.q, g) +
                               pair->flange_damping_Ns_m * KL_LANE(axle->rail.rate, g)) +
                              rest * kl_lane_load(pair->central_tan, g);
        const kl_lane creep =
            limited ? none : sign * (KL_LANE(forces->tread.t2, g) * KL_LANE(axle->cos_delta, g));
        const kl_lane by_normal = held / kl_lane_at_least(flange.aside, least);
        const kl_lane all = by_normal * (press + creep);
        const kl_lane shed = by_normal * tread.aside;
        KL_LANE(contacts->flange_all, g) = all;
        KL_LANE(contacts->press, g) = tread.aside;
        KL_LANE(contacts->shed, g) = shed;
        KL_LANE(aside, g) = sign * (held * (press + creep));
        KL_LANE(up, g) = all * flange.lift;
        KL_LANE(roll, g) = sign * (all * flange.roll);
        KL_LANE(together->aside, g) = tread.aside - held * tread.aside;
        KL_LANE(together->lift, g) = kl_lane_at_least(tread.lift - shed * flange.lift, least);
        KL_LANE(together->roll, g) = tread.roll - shed * flange.roll;
    }
    forces->load.lateral -= KL_SUM(aside);
    forces->load.down -= KL_SUM(up);
    forces->load.roll -= KL_SUM(roll);
}

/*
 * Vertical and roll equilibrium: N_r lift_r + N_l lift_l = P, N_r roll_r - N_l roll_l = R. P and R
 * hold the inertia of y'', and y'' what N does along the path.
 */
static void prepare_normals(const struct kl_wheelset *restrict wheelset,
                            const struct kl_axle *restrict axle,
                            struct kl_axle_forces *restrict forces) {
    const struct kl_bearings *tread = &forces->together;
    struct kl_contacts *contacts = &forces->contacts;
    const kl_real z_part = (wheelset->mass_kg * axle->z_y) * forces->inv_mass_1_kg;
    const kl_real roll_part = (wheelset->inertia_roll_kgm2 * axle->phi_y) * forces->inv_mass_1_kg;
    const kl_real inv = KL_R(1) / (tread->roll[KL_RIGHT] * tread->lift[KL_LEFT] +
                                   tread->roll[KL_LEFT] * tread->lift[KL_RIGHT]);
    kl_both pulled;
    contacts->z_part = z_part;
    contacts->roll_part = roll_part;
    KL_EACH_LANE(g) {
        const kl_lane sign = kl_lane_of(KL_R(1), KL_R(-1), g);
        const kl_lane by_down = KL_OTHER(tread->roll, g) * inv;
        const kl_lane by_roll = KL_OTHER(tread->lift, g) * kl_lane_of(inv, -inv, g);
        const kl_lane backs = by_down * z_part + by_roll * roll_part;
        const kl_lane pulls =
            -(sign * (KL_LANE(tread->aside, g) + axle->phi_y * KL_LANE(tread->roll, g)) +
              axle->z_y * KL_LANE(tread->lift, g));
        KL_LANE(contacts->by_down, g) = by_down;
        KL_LANE(contacts->by_roll, g) = by_roll;
        KL_LANE(contacts->pulls, g) = pulls;
        KL_LANE(contacts->backs, g) = backs;
        KL_LANE(pulled, g) = pulls * backs;
    }
    /* a normal force that pulls aside has its own inertia against it: N = N0 - backs (pulls N) */
    const kl_real share = KL_R(1) / (KL_R(1) + KL_SUM(pulled));
    KL_EACH_LANE(g) {
        KL_LANE(contacts->backs, g) *= share;
    }
}

void kl_axle_prepare(const struct kl_wheelset *restrict wheelset,
                     const struct kl_pair *restrict pair, const struct kl_axle *restrict axle,
                     const kl_real suspension[restrict 4], struct kl_axle_forces *restrict forces) {
    const struct kl_track_point *track = &axle->track;
    struct kl_load *load = &forces->load;
    const kl_real m = wheelset->mass_kg;
    const kl_real i_x = wheelset->inertia_roll_kgm2;
    const kl_real v = forces->speed_m_s;
    const kl_real gyro = wheelset->inertia_spin_kgm2 * axle->x[KL_WS_SPIN];
    const kl_real aside = track->curvature_1_m * (v * v) -
                          forces->gravity_m_s2 * (track->cant_rad + track->value.cross_rad);
    load->lateral = (suspension[0] + wheelset->preload[0]) - m * aside;
    load->down =
        (suspension[1] + wheelset->preload[1] + m * forces->gravity_m_s2) - m * axle->z_rest;
    load->roll = (suspension[2] + wheelset->preload[2] - gyro * axle->x[KL_WS_YAW_RATE]) -
                 i_x * axle->roll_rest;
    load->yaw =
        (suspension[3] + wheelset->preload[3]) + gyro * (axle->roll_rate + v * track->cant_s_1_m);
    load->drive = forces->torque_Nm;
    if (!kl_axle_is_limited(wheelset)) {
        load_creep(axle, forces);
    }
    share_with_flange(wheelset, pair, axle, forces);
}

/* What lifting has to do with the loads. */
static void prepare_lifting(const struct kl_wheelset *restrict wheelset,
                            const struct kl_pair *restrict pair,
                            const struct kl_axle *restrict axle,
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

/* How the normal forces grow with the upward accelerations: a column for either wheel. */
static void weigh_lifting(struct kl_axle_forces *forces) {
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

void kl_axle_weigh(const struct kl_wheelset *restrict wheelset, const struct kl_pair *restrict pair,
                   const struct kl_axle *restrict axle, struct kl_axle_forces *restrict forces) {
    struct kl_load *load = &forces->load;
    const kl_real m = wheelset->mass_kg;
    const kl_real i_x = wheelset->inertia_roll_kgm2;
    prepare_lifting(wheelset, pair, axle, forces);
    load->free_y = load->lateral + (axle->z_y * load->down + axle->phi_y * load->roll);
    forces->inv_mass_1_kg =
        KL_R(1) / (m * (KL_R(1) + axle->z_y * axle->z_y) + i_x * (axle->phi_y * axle->phi_y));
    prepare_normals(wheelset, axle, forces);
    weigh_lifting(forces);
}

/* What turns the axle, and a wheel. */
struct turning {
    kl_lane yaw; /* besides the moment of T1 about the middle */
    kl_lane t1;
};

/* Creep goes with the normal force that it was found for: all of it by the same factor. */
static inline struct turning scale(struct kl_contact_forces *contact, kl_lane by, kl_lane cos_delta,
                                   int g) {
    const kl_lane m3 = by * KL_LANE(contact->m3, g);
    (void)g;
    const struct turning turning = {.yaw = m3 * cos_delta, .t1 = by * KL_LANE(contact->t1, g)};
    KL_LANE(contact->t1, g) = turning.t1;
    KL_LANE(contact->t2, g) *= by;
    KL_LANE(contact->m3, g) = m3;
    return turning;
}

void kl_axle_accelerate(const struct kl_wheelset *restrict wheelset, struct kl_axle *restrict axle,
                        struct kl_axle_forces *restrict forces) {
    struct kl_contact_forces *tread = &forces->tread;
    struct kl_contact_forces *f = &forces->flange;
    const struct kl_flange *flange = &axle->flange;
    const int limited = kl_axle_is_limited(wheelset);
    kl_both across;
    kl_both turn;
    kl_both drive;
    KL_EACH_LANE(g) {
        const kl_lane sign = kl_lane_of(KL_R(1), KL_R(-1), g);
        const kl_lane normal = KL_LANE(tread->normal, g);
        const kl_lane flange_normal = KL_LANE(f->normal, g);
        const struct turning at_tread =
            scale(tread, limited ? normal * KL_LANE(tread->inv_used, g) : kl_lane_all(KL_R(1)),
                  KL_LANE(axle->cos_delta, g), g);
        const struct turning at_flange =
            scale(f, flange_normal * KL_LANE(f->inv_used, g), KL_LANE(flange->cos_delta, g), g);
        const kl_lane push = flange_normal * KL_LANE(flange->sin_delta, g);
        KL_LANE(across, g) = normal * KL_LANE(forces->contacts.pulls, g);
        KL_LANE(turn, g) =
            ((at_tread.yaw + at_flange.yaw) - sign * (KL_LANE(axle->arm, g) * at_tread.t1 +
                                                      KL_LANE(flange->arm, g) * at_flange.t1)) -
            push * (KL_LANE(flange->reach, g) * axle->x[KL_WS_YAW]);
        KL_LANE(drive, g) =
            KL_LANE(axle->radius, g) * at_tread.t1 + KL_LANE(flange->radius, g) * at_flange.t1;
    }
    axle->rate[KL_WS_Y_RATE] = (forces->load.free_y + KL_SUM(across)) * forces->inv_mass_1_kg;
    axle->rate[KL_WS_YAW_RATE] = (forces->load.yaw + KL_SUM(turn)) * wheelset->inv_yaw_1_kgm2;
    axle->rate[KL_WS_SPIN] =
        (forces->load.drive - KL_SUM(drive)) * wheelset->inv_spin_1_kgm2 - axle->spin_drift;
}

/*
 * Aside a wheel is damped by creep against a rail that gives way, one after the other; where its
 * flange holds the rail, by the rail alone.
 */
void kl_axle_stiffness(const struct kl_wheelset *restrict wheelset,
                       const struct kl_pair *restrict pair, const struct kl_axle *restrict axle,
                       const struct kl_axle_forces *restrict forces, kl_real step_s,
                       struct kl_stiffness *restrict stiffness) {
    const struct kl_contact_forces *tread = &forces->tread;
    const struct kl_contact_forces *flange = &forces->flange;
    const kl_real damping = pair->flange_damping_Ns_m;
    const kl_real own = damping + step_s * pair->flange_stiffness_N_m;
    kl_both along;
    kl_both yaw;
    kl_both spin;
    KL_EACH_LANE(g) {
        const kl_lane held = KL_LANE(axle->rail.held, g);
        const kl_lane by = KL_LANE(tread->reduction, g) * forces->inv_creep_speed_s_m;
        const kl_lane arm = KL_LANE(axle->arm, g);
        const kl_lane r = KL_LANE(axle->radius, g);
        const kl_lane gain = (KL_R(1) - r * axle->phi_y) * KL_LANE(axle->inv_cos, g);
        const kl_lane f11 = KL_LANE(tread->f11_N, g);
        const kl_lane creep = by * KL_LANE(tread->f22_N, g);
        const kl_lane both = creep * (own / (own + pair->gives * creep));
        KL_LANE(along, g) = both * (gain * gain) + held * (damping - both * (gain * gain));
        /* of a flange the longitudinal creep alone: across it slides with the rail */
        const kl_lane flange_f11 =
            KL_LANE(flange->reduction, g) * KL_LANE(flange->f11_N, g) * forces->inv_creep_speed_s_m;
        const kl_lane flange_arm = KL_LANE(axle->flange.arm, g);
        const kl_lane flange_r = KL_LANE(axle->flange.radius, g);
        KL_LANE(yaw, g) = by * (f11 * (arm * arm) + KL_LANE(tread->f33_Nm2, g)) +
                          flange_f11 * (flange_arm * flange_arm);
        KL_LANE(spin, g) = by * f11 * (r * r) + flange_f11 * (flange_r * flange_r);
    }
    stiffness->y = KL_SUM(along) * forces->inv_mass_1_kg * step_s;
    stiffness->yaw = KL_SUM(yaw) * wheelset->inv_yaw_1_kgm2 * step_s;
    stiffness->spin = KL_SUM(spin) * wheelset->inv_spin_1_kgm2 * step_s;
}
