/* kl_axle_flange.c - the flanges of a wheelset within a step. */
#include "kl_axle.h"

#include "kl_lookup.h"
#include "kl_math.h"
#include "kl_saturate.h"

/* A column of both sides' rows: n = 0 the lower, 1 the upper. */
#define FIELD(axle, n, field, g)                                                                   \
    kl_lane_of((axle)->flange.row[KL_RIGHT][n].field, (axle)->flange.row[KL_LEFT][n].field, g)

#define ROW_REALS (sizeof(struct kl_flange_row) / sizeof(kl_real))

/* Two neighbouring columns, the first of them `field`, linear in between. */
#define COLUMNS(flange, field, first, second)                                                      \
    kl_lane_columns(&(flange)->row[KL_RIGHT]->field, &(flange)->row[KL_LEFT]->field, ROW_REALS,    \
                    (flange)->t[KL_RIGHT], (flange)->t[KL_LEFT], first, second)

#define FOUR_COLUMNS(flange, field, first, second, third, fourth)                                  \
    kl_lane_four_columns(&(flange)->row[KL_RIGHT]->field, &(flange)->row[KL_LEFT]->field,          \
                         ROW_REALS, (flange)->t[KL_RIGHT], (flange)->t[KL_LEFT], first, second,    \
                         third, fourth)

static inline void find_row(const struct kl_pair *pair, int side, struct kl_axle *axle,
                            kl_real *t) {
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

/*
 * The flange is on the rail where it would overlap it at the end of the step, had the rail gone by
 * itself; then the rail ends where it just touches. Of a state as it stands that is asked over the
 * model's step, from the velocities that it has.
 */
void kl_axle_meet_flange(const struct kl_pair *restrict pair, kl_real step_s,
                         struct kl_axle *restrict axle) {
    struct kl_flange *flange = &axle->flange;
    struct kl_rail *rail = &axle->rail;
    kl_real right;
    kl_real left;
    find_row(pair, KL_RIGHT, axle, &right);
    find_row(pair, KL_LEFT, axle, &left);
    KL_EACH_LANE(g) {
        KL_LANE(flange->t, g) = kl_lane_of(right, left, g);
    }
    COLUMNS(flange, inv_sin, &flange->inv_sin, &flange->inv_cos);
    FOUR_COLUMNS(flange, contact.arm_m, &flange->arm, &flange->radius, &flange->sin_delta,
                 &flange->cos_delta);
    const kl_real lean = KL_R(0.5) * (axle->x[KL_WS_YAW] * axle->x[KL_WS_YAW]);
    const int still = !(axle->step > KL_R(0));
    const kl_real inv_step = KL_R(1) / step_s;
    KL_EACH_LANE(g) {
        const struct kl_lane_hermite place = kl_lane_flange_place(
            FIELD(axle, 0, place_m, g), FIELD(axle, 0, place_h, g), FIELD(axle, 1, place_m, g),
            FIELD(axle, 1, place_h, g), KL_LANE(flange->t, g), pair->step_m, pair->inv_step_1_m);
        /* yawed, a flange touches ahead of the axle, where it is broader */
        const kl_lane reach = KL_LANE(flange->radius, g) *
                              (KL_LANE(flange->sin_delta, g) * KL_LANE(flange->inv_cos, g));
        const kl_lane overlap =
            ((KL_LANE(axle->outboard, g) - KL_LANE(rail->q, g)) - place.value) + lean * reach;
        const kl_lane own = KL_LANE(rail->rate, g);
        /* a wheel that goes up finds more room */
        const kl_lane wheel =
            KL_LANE(axle->outboard_rate, g) - place.slope * KL_LANE(axle->rise_rate, g);
        const kl_lane closing = overlap * inv_step + (still ? wheel - own : kl_lane_all(KL_R(0)));
        const kl_lane held = kl_lane_positive_or_0(closing, kl_lane_all(KL_R(1)));
        /* over the step; at its end, if the flange was there when it began */
        const kl_lane mean = own + held * closing;
        const kl_lane rate =
            mean + (still ? kl_lane_all(KL_R(0))
                          : held * kl_lane_positive_or_0(KL_LANE(flange->normal, g), wheel - mean));
        KL_LANE(flange->reach, g) = reach;
        KL_LANE(rail->held, g) = held;
        KL_LANE(rail->rate, g) = rate;
        /* a tread that is down was looked up where the rail would have gone: now its place is known */
        const kl_lane after = KL_LANE(axle->ride.after, g);
        const kl_lane back = held * overlap;
        const kl_lane moved = kl_lane_at_least(after, kl_lane_all(KL_R(0))) - back;
        KL_LANE(axle->ride.slope, g) +=
            (KL_R(1) - KL_LANE(axle->up, g)) * (KL_LANE(axle->ride.second, g) * moved);
        KL_LANE(rail->q, g) += back;
        KL_LANE(axle->shortens, g) =
            held *
            kl_lane_at_least((KL_LANE(axle->shortened, g) + back) - after, kl_lane_all(KL_R(0)));
        const kl_lane change = rate - KL_LANE(rail->start_rate, g);
        const kl_lane behind = KL_LANE(rail->behind, g) * change;
        KL_LANE(rail->acceleration, g) = (change - behind) * axle->inv_step;
        KL_LANE(rail->followed, g) = rate - behind;
    }
}

void kl_axle_flange_creepages(const struct kl_wheelset *restrict wheelset,
                              const struct kl_axle *restrict axle,
                              struct kl_coefficients *restrict creep,
                              struct kl_axle_forces *restrict forces) {
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
    FOUR_COLUMNS(flange, contact.f11_1, &creep->f11, &creep->f22, &creep->f23, &creep->f33);
    if (!kl_saturates(wheelset->creep.law)) {
        FOUR_COLUMNS(flange, contact.shape[0], &creep->shape[0], &creep->shape[1], &creep->shape[2],
                     &creep->shape[3]);
        COLUMNS(flange, contact.shape[4], &creep->shape[4], &creep->shape[5]);
    }
}
