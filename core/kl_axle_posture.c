/* kl_axle_posture.c - where a wheelset and its rails are within a step. */
#include "kl_axle.h"

#include "kl_lookup.h"
#include "kl_math.h"

/* One side's row below a place in the table, which stays inside it. */
struct cell {
    const struct kl_row *row;
    kl_real t;
};

static struct cell cell_at(const struct kl_pair *pair, const struct kl_side_table *table,
                           kl_real place) {
    const uint32_t i = (uint32_t)place;
    const uint32_t last = 2u * pair->half - 1u;
    const uint32_t row = i < last ? i : last;
    const struct cell cell = {&table->rows[row], place - (kl_real)row};
    return cell;
}

/* A tread goes no further than to where its flange touches: to its path's end, and earlier where the
 * flange of a yawed wheel held the rail before. */
static void find_cells(const struct kl_pair *restrict pair, kl_both *w, struct kl_axle *axle) {
    struct kl_ride *ride = &axle->ride;
    struct kl_cells *cells = &axle->cells;
    const kl_lane middle = kl_lane_all((kl_real)pair->half);
    kl_both place;
    KL_EACH_LANE(g) {
        const kl_lane from_start = KL_LANE(*w, g) * pair->inv_step_1_m + middle;
        const kl_lane end =
            kl_lane_load(pair->tread_end, g) - KL_LANE(axle->shortened, g) * pair->inv_step_1_m;
        const kl_lane after = from_start - end;
        KL_LANE(place, g) = kl_lane_at_least(kl_lane_min(from_start, end), kl_lane_all(KL_R(0)));
        KL_LANE(ride->within, g) = kl_lane_positive_or_0(-after, kl_lane_all(KL_R(1)));
        KL_LANE(ride->after, g) = after * pair->step_m;
    }
    const struct cell right = cell_at(pair, &pair->side[KL_RIGHT], place[KL_RIGHT]);
    const struct cell left = cell_at(pair, &pair->side[KL_LEFT], place[KL_LEFT]);
    cells->below[KL_RIGHT] = right.row;
    cells->below[KL_LEFT] = left.row;
    KL_EACH_LANE(g) {
        KL_LANE(cells->t, g) = kl_lane_of(right.t, left.t, g);
    }
}

/* A column of both sides' rows: below (0), above (1). */
#define BELOW(cells, field, g)                                                                     \
    kl_lane_of((cells)->below[KL_RIGHT]->field, (cells)->below[KL_LEFT]->field, g)
#define ABOVE(cells, field, g)                                                                     \
    kl_lane_of((cells)->below[KL_RIGHT][1].field, (cells)->below[KL_LEFT][1].field, g)

#define ROW_REALS (sizeof(struct kl_row) / sizeof(kl_real))

/* Two neighbouring columns, the first of them `field`, linear in between. */
#define COLUMNS(cells, field, first, second)                                                       \
    kl_lane_columns(&(cells)->below[KL_RIGHT]->field, &(cells)->below[KL_LEFT]->field, ROW_REALS,  \
                    (cells)->t[KL_RIGHT], (cells)->t[KL_LEFT], first, second)

#define FOUR_COLUMNS(cells, field, first, second, third, fourth)                                   \
    kl_lane_four_columns(&(cells)->below[KL_RIGHT]->field, &(cells)->below[KL_LEFT]->field,        \
                         ROW_REALS, (cells)->t[KL_RIGHT], (cells)->t[KL_LEFT], first, second,      \
                         third, fourth)

static void read_tables(const struct kl_pair *restrict pair, kl_both *w, struct kl_axle *axle) {
    struct kl_ride *ride = &axle->ride;
    const struct kl_cells *cells = &axle->cells;
    struct kl_coefficients *creep = &axle->creep;
    find_cells(pair, w, axle);
    COLUMNS(cells, arm_m, &axle->arm, &axle->radius);
    FOUR_COLUMNS(cells, f11_1, &creep->f11, &creep->f22, &creep->f23, &creep->f33);
    if (pair->n_shapes != 0) {
        FOUR_COLUMNS(cells, shape[0], &creep->shape[0], &creep->shape[1], &creep->shape[2],
                     &creep->shape[3]);
        COLUMNS(cells, shape[4], &creep->shape[4], &creep->shape[5]);
    }
    KL_EACH_LANE(g) {
        const struct kl_lane_hermite h = kl_lane_hermite(
            BELOW(cells, height_m, g), BELOW(cells, height_w, g), ABOVE(cells, height_m, g),
            ABOVE(cells, height_w, g), KL_LANE(cells->t, g), pair->step_m, pair->inv_step_1_m);
        KL_LANE(axle->height, g) = h.value - KL_LANE(axle->rise, g);
        KL_LANE(ride->slope, g) = h.slope;
        KL_LANE(ride->second, g) = h.second;
    }
}

/*
 * Where the rails go by themselves: c q' + k q = what the tread presses, with the wheel as it moves at
 * the end of the step, implicitly. A tread that is up, or would have to pull for that, leaves the
 * rail alone. Of a state as it stands no rail goes where it wants to be faster than in a step.
 */
static void carry_rails(const struct kl_pair *restrict pair, kl_real rest_N, kl_real step_s,
                        kl_real speed_m_s, struct kl_axle *restrict axle) {
    struct kl_rail *rail = &axle->rail;
    const kl_real k = pair->flange_stiffness_N_m;
    const kl_real c = pair->flange_damping_Ns_m;
    const kl_lane least = kl_lane_all(step_s * k + KL_R(1));
    const kl_real ahead = speed_m_s * axle->x[KL_WS_YAW];
    const kl_lane none = kl_lane_all(KL_R(0));
    const kl_lane half = kl_lane_all(KL_R(0.5) * axle->step);
    KL_EACH_LANE(g) {
        const kl_lane sign = kl_lane_of(KL_R(1), KL_R(-1), g);
        const kl_lane begin = kl_lane_if_0(KL_LANE(axle->flange.normal, g), half, none);
        const kl_lane end = axle->step - begin;
        const kl_lane start = KL_LANE(rail->start, g) + begin * KL_LANE(rail->start_rate, g);
        const kl_lane own = c + end * k;
        const kl_lane inertia = KL_LANE(rail->inertia, g) * axle->inv_step;
        const kl_lane resist = KL_LANE(rail->resist, g);
        const kl_lane wheel = KL_LANE(axle->outboard_rate, g);
        const kl_lane spring = k * start;
        const kl_lane press = (KL_LANE(rail->press, g) + resist * (wheel - sign * ahead)) +
                              inertia * KL_LANE(rail->start_rate, g);
        const kl_lane with = (press - spring) / kl_lane_at_least((own + resist) + inertia, least);
        const kl_lane without =
            -(spring + rest_N * kl_lane_load(pair->central_tan, g)) / kl_lane_at_least(own, least);
        const kl_lane more = kl_lane_at_least(without - with, none);
        const kl_lane pressed = with + kl_lane_positive_or_0(inertia, more);
        const kl_lane rate = pressed + KL_LANE(axle->up, g) * (without - pressed);
        KL_LANE(rail->rate, g) = pair->gives * rate;
        KL_LANE(rail->q, g) = start + end * KL_LANE(rail->rate, g);
    }
}

/*
 * What the bend of a wheel's path, H'' w'^2, adds to its vertical acceleration. A contact jumps within
 * less than a step, and the bend just where the step ends is then a lottery: a blow of many times
 * the right size, or none. So it is kept near the mean over the step, which the slopes at both its
 * ends give; then the change of velocity is right whatever lies between. Where the path is smooth
 * the two agree, and it is the bend itself. A tread that the flange takes off its path, or that is in
 * the air, is kicked by all of that change; one that lands is stopped instead.
 */
#define BEND_ABOUT_M_S2 10.0
static inline kl_lane bend(struct kl_axle *axle, kl_real lever, kl_lane slope, kl_lane second,
                           int g) {
    const kl_real near = axle->inv_step > KL_R(0) ? KL_R(BEND_ABOUT_M_S2) : KL_R(1e30);
    const kl_lane one = kl_lane_all(KL_R(1));
    const kl_lane rate = KL_LANE(axle->path_rate, g);
    const kl_lane before = KL_LANE(axle->path_rate_before, g);
    const kl_lane lands = KL_LANE(axle->lands, g);
    const kl_lane steeper = slope - KL_LANE(axle->slope_before, g);
    const kl_lane change = steeper * before;
    /* who lands is stopped on the slope there, and rolls the axle no more about the other wheel */
    const kl_lane fall = KL_LANE(axle->closing, g);
    const kl_lane closing = fall + (lands * steeper) * (before - lever * fall);
    const kl_lane jumps = kl_lane_at_least(KL_LANE(axle->rail.held, g), KL_LANE(axle->up, g));
    KL_LANE(axle->closing, g) = closing;
    KL_LANE(axle->landing, g) = -(closing * (axle->inv_step * axle->settles));
    KL_LANE(axle->kick, g) = jumps * change;
    const kl_lane about = (one - jumps) * near;
    const kl_lane mean = (change - lands * change) * axle->inv_step;
    const kl_lane here = second * (rate * rate);
    (void)g;
    return kl_lane_min(kl_lane_max(here, mean - about), mean + about);
}

/*
 * The treads' motion along their paths, the rails' motion taken off. A tread whose flange holds the
 * rail stays where it is on it; so does one that is off the rail beyond its path's end. The other
 * wheel's path is that of an axle which rolls as both wheels go along theirs, and takes it along at
 * the height of its contact: where one of them stays, the other one's rises by so much less.
 */
static void follow_paths(const struct kl_pair *restrict pair, struct kl_axle *axle,
                         struct kl_ride *ride) {
    const struct kl_rail *rail = &axle->rail;
    const kl_real lever = pair->radius_m * pair->inv_base_1_m;
    kl_both free;
    kl_both stays; /* of the slope */
    KL_EACH_LANE(g) {
        const kl_lane down = KL_R(1) - KL_LANE(axle->up, g);
        KL_LANE(free, g) =
            kl_lane_at_least(KL_LANE(ride->within, g), down) * (KL_R(1) - KL_LANE(rail->held, g));
        KL_LANE(stays, g) = KL_LANE(ride->slope, g) - KL_LANE(free, g) * KL_LANE(ride->slope, g);
    }
    KL_EACH_LANE(g) {
        const kl_lane part = KL_LANE(free, g) / (KL_R(1) - lever * KL_OTHER(stays, g));
        const kl_lane slope = part * KL_LANE(ride->slope, g);
        const kl_lane rate = KL_LANE(ride->outboard_rate, g) - KL_LANE(rail->rate, g);
        KL_LANE(axle->slope, g) = slope;
        KL_LANE(axle->path_rate, g) = rate;
        KL_LANE(ride->rate, g) = slope * rate;
        KL_LANE(ride->rest, g) =
            bend(axle, lever, slope, part * KL_LANE(ride->second, g), g) +
            slope * (KL_LANE(axle->outboard_rest, g) - KL_LANE(rail->acceleration, g));
        KL_LANE(axle->height_rate, g) = KL_LANE(ride->rate, g) - KL_LANE(axle->rise_rate, g);
    }
}

/*
 * The contact planes, from how the constraint moves the wheelset: z_y + s arm phi_y = -s tan(delta)
 * (1 - r phi_y). Between rows, above all in the one in which a contact jumps, angles interpolated
 * by themselves would contradict the heights, and the wheels' forces the motion. A tread whose flange
 * holds the rail does not move along its plane, but keeps the one that it had.
 */
static inline void find_contact_planes(const struct kl_pair *restrict pair,
                                       const struct kl_ride *ride, struct kl_axle *axle) {
    KL_EACH_LANE(g) {
        const kl_lane own = KL_LANE(ride->slope, g);
        const kl_lane other = KL_OTHER(ride->slope, g);
        const kl_lane share = kl_lane_load(pair->share, g);
        const kl_lane s_z_y = share * own - (KL_R(1) - share) * other;
        const kl_lane phi_y = (own + other) * pair->inv_base_1_m;
        /* cosine and sine from both sides of the triangle at once, for one root and its inverse */
        const kl_lane across = KL_R(1) - KL_LANE(axle->radius, g) * phi_y;
        const kl_lane up = -(s_z_y + KL_LANE(axle->arm, g) * phi_y);
        const kl_lane length = kl_lane_sqrt(across * across + up * up);
        const kl_lane inv_length = KL_R(1) / length;
        KL_LANE(axle->inv_cos, g) = length / across;
        KL_LANE(axle->cos_delta, g) = across * inv_length;
        KL_LANE(axle->sin_delta, g) = up * inv_length;
    }
}

/*
 * Displacement relative to the rails at rest: u = y - y0 - r0 phi_x (the cross-level phi_x turns the
 * wheelset about the rails), seen outboard from either side less half the gauge's change.
 */
static void find_outboard(const struct kl_pair *restrict pair, kl_real v, kl_real v_rate,
                          struct kl_axle *restrict axle) {
    const struct kl_track_point *track = &axle->track;
    const kl_real v2 = v * v;
    const kl_real r0 = pair->radius_m;
    /* d2/dt2 of anything that runs along the track: V^2 f'' + V' f' */
    const kl_real cant_rest = v2 * track->cant_ss_1_m2 + v_rate * track->cant_s_1_m;
    const kl_real place0 = track->value.lateral_m + r0 * track->value.cross_rad;
    const kl_real place1 = track->slope.lateral_m + r0 * track->slope.cross_rad;
    const kl_real place2 = track->second.lateral_m + r0 * track->second.cross_rad;
    const kl_real whole = axle->x[KL_WS_Y] - place0;
    const kl_real whole_rate = axle->rate[KL_WS_Y] - v * place1;
    const kl_real u_rest = -(r0 * cant_rest + (v2 * place2 + v_rate * place1));
    const kl_real gauge = KL_R(0.5) * track->value.gauge_m;
    const kl_real gauge_rate = KL_R(0.5) * (v * track->slope.gauge_m);
    const kl_real gauge_rest =
        KL_R(0.5) * (v2 * track->second.gauge_m + v_rate * track->slope.gauge_m);
    /* a wheel off its rail rolls the axle: the other one goes inboard, and its own tread outboard; of
     * its flange that is in the table */
    const kl_real lever = r0 * pair->inv_base_1_m;
    KL_EACH_LANE(g) {
        const kl_lane sign = kl_lane_of(KL_R(1), KL_R(-1), g);
        const kl_lane w = (sign * whole - gauge) - lever * KL_OTHER(axle->rise, g);
        const kl_lane rate =
            (sign * whole_rate - gauge_rate) - lever * KL_OTHER(axle->rise_rate, g);
        KL_LANE(axle->outboard, g) = w;
        KL_LANE(axle->outboard_rate, g) = rate;
        KL_LANE(axle->outboard_rest, g) = sign * u_rest - gauge_rest;
        KL_LANE(axle->ride.outboard, g) = w + lever * KL_LANE(axle->rise, g);
        KL_LANE(axle->ride.outboard_rate, g) = rate + lever * KL_LANE(axle->rise_rate, g);
    }
    /* the larger |w| of both sides; the comparison is also false for a NaN */
    const int on_table = kl_abs_real(whole) + kl_abs_real(gauge) <= pair->range_m;
    axle->faults = on_table ? 0u : (uint32_t)KL_FAULT_DERAILED;
}

void kl_axle_place(const struct kl_pair *restrict pair, kl_real speed_m_s, kl_real speed_rate_m_s2,
                   kl_real rest_N, kl_real step_s, struct kl_axle *restrict axle) {
    find_outboard(pair, speed_m_s, speed_rate_m_s2, axle);
    carry_rails(pair, rest_N, step_s, speed_m_s, axle);
}

void kl_axle_look_up(const struct kl_pair *restrict pair, struct kl_axle *restrict axle) {
    kl_both w;
    KL_EACH_LANE(g) {
        KL_LANE(w, g) = KL_LANE(axle->ride.outboard, g) - KL_LANE(axle->rail.q, g);
    }
    read_tables(pair, &w, axle);
}

void kl_axle_posture(const struct kl_pair *restrict pair, kl_real speed_m_s,
                     kl_real speed_rate_m_s2, struct kl_axle *restrict axle) {
    const struct kl_track_point *track = &axle->track;
    struct kl_ride *ride = &axle->ride;
    const kl_real v = speed_m_s;
    const kl_real v2 = v * v;
    follow_paths(pair, axle, ride);

    const kl_real inv_base = pair->inv_base_1_m;
    const kl_real q_r = pair->share[KL_RIGHT];
    const kl_real q_l = pair->share[KL_LEFT];
    const kl_real cant_rest = v2 * track->cant_ss_1_m2 + speed_rate_m_s2 * track->cant_s_1_m;
    axle->z_y = q_r * axle->slope[KL_RIGHT] - q_l * axle->slope[KL_LEFT];
    axle->phi_y = KL_SUM(axle->slope) * inv_base;
    find_contact_planes(pair, ride, axle);
    axle->z =
        (q_r * axle->height[KL_RIGHT] + q_l * axle->height[KL_LEFT]) + track->value.vertical_m;
    axle->z_rate = (q_r * axle->height_rate[KL_RIGHT] + q_l * axle->height_rate[KL_LEFT]) +
                   v * track->slope.vertical_m;
    axle->z_rest = (q_r * ride->rest[KL_RIGHT] + q_l * ride->rest[KL_LEFT]) +
                   (v2 * track->second.vertical_m + speed_rate_m_s2 * track->slope.vertical_m);
    axle->roll =
        (axle->height[KL_RIGHT] - axle->height[KL_LEFT]) * inv_base + track->value.cross_rad;
    axle->roll_rate = (axle->height_rate[KL_RIGHT] - axle->height_rate[KL_LEFT]) * inv_base +
                      v * track->slope.cross_rad;
    axle->roll_rest =
        (ride->rest[KL_RIGHT] - ride->rest[KL_LEFT]) * inv_base +
        ((v2 * track->second.cross_rad + speed_rate_m_s2 * track->slope.cross_rad) + cant_rest);
}
