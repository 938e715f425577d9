/* kl_axle.c - the wheelset within a step. */
#include "kl_axle.h"

#include "kl_lookup.h"
#include "kl_math.h"
#include "kl_saturate.h"

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

static void find_cells(const struct kl_pair *restrict pair, const kl_both *w,
                       struct kl_cells *cells) {
    const kl_lane middle = kl_lane_all((kl_real)pair->half);
    kl_both place;
    KL_EACH_LANE(g) {
        const kl_lane from_start = KL_LANE(*w, g) * pair->inv_step_1_m + middle;
        KL_LANE(place, g) =
            kl_lane_min(kl_lane_max(from_start, kl_lane_all(KL_R(0))), middle + middle);
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

/* Height of either side's table at its place, and its first two time derivatives, of the second
 * what does not depend on y''. */
struct ride {
    kl_both height;
    kl_both slope; /* dH/dw */
    kl_both rate;
    kl_both rest;
};

/* Displacement outboard of one side, as ride. */
struct outboard {
    kl_both w;
    kl_both rate;
    kl_both rest;
};

/*
 * What the bend of a wheel's path, H'' w'^2, adds to its vertical acceleration. A contact jumps within
 * less than a step, and the bend just where the step ends is then a lottery: a blow of many times
 * the right size, or none. So it is kept near the mean over the step, which the slopes at both its
 * ends give; then the change of velocity is right whatever lies between. Where the path is smooth
 * the two agree, and it is the bend itself.
 */
#define BEND_ABOUT_M_S2 10.0
static inline kl_lane bend(const struct kl_axle *axle, kl_lane slope, kl_lane second, kl_lane rate,
                           int g) {
    const int steps = axle->inv_step > KL_R(0);
    const kl_lane about = kl_lane_all(steps ? KL_R(BEND_ABOUT_M_S2) : KL_R(1e30));
    const kl_lane mean = (slope - KL_LANE(axle->slope_before, g)) * (rate * axle->inv_step);
    const kl_lane here = second * (rate * rate);
    (void)g;
    return kl_lane_min(kl_lane_max(here, mean - about), mean + about);
}

static void read_tables(const struct kl_pair *restrict pair, const struct outboard *restrict out,
                        struct kl_axle *restrict axle, struct ride *restrict ride) {
    struct kl_cells *cells = &axle->cells;
    find_cells(pair, &out->w, cells);
    COLUMNS(cells, arm_m, &axle->arm, &axle->radius);
    COLUMNS(cells, f11_1, &axle->f11, &axle->f22);
    COLUMNS(cells, f23_1, &axle->f23, &axle->f33);
    COLUMNS(cells, carried, &axle->carried, &axle->extra);
    if (pair->n_shapes != 0) {
        COLUMNS(cells, shape[0], &axle->shape[0], &axle->shape[1]);
        COLUMNS(cells, shape[2], &axle->shape[2], &axle->shape[3]);
        COLUMNS(cells, shape[4], &axle->shape[4], &axle->shape[5]);
    }
    KL_EACH_LANE(g) {
        const struct kl_lane_hermite h = kl_lane_hermite(
            BELOW(cells, height_m, g), BELOW(cells, height_w, g), ABOVE(cells, height_m, g),
            ABOVE(cells, height_w, g), KL_LANE(cells->t, g), pair->step_m, pair->inv_step_1_m);
        const kl_lane rate = KL_LANE(out->rate, g);
        KL_LANE(ride->height, g) = h.value;
        KL_LANE(ride->slope, g) = h.slope;
        KL_LANE(ride->rate, g) = h.slope * rate;
        KL_LANE(ride->rest, g) =
            bend(axle, h.slope, h.second, rate, g) + h.slope * KL_LANE(out->rest, g);
        KL_LANE(axle->slope, g) = h.slope;
    }
}

/*
 * The contact plane, from how the constraint moves the wheelset: z_y + s arm phi_y = -s tan(delta)
 * (1 - r phi_y). Between rows, above all in the one in which a contact jumps, angles interpolated
 * by themselves would contradict the heights, and the wheels' forces the motion. A contact that is
 * carried along by the rail has the angle of its row; in the row in which that begins, the path's as
 * far as it is carried.
 */
static inline void find_contact_planes(struct kl_axle *axle) {
    KL_EACH_LANE(g) {
        const kl_lane s_z_y = kl_lane_of(axle->z_y, -axle->z_y, g);
        const kl_lane held = KL_R(1) - KL_LANE(axle->radius, g) * axle->phi_y;
        const kl_lane path = -(s_z_y + KL_LANE(axle->arm, g) * axle->phi_y) / held;
        const kl_lane extra = kl_lane_max(
            KL_LANE(axle->extra, g) - KL_LANE(axle->carried, g) * path, kl_lane_all(KL_R(0)));
        const kl_lane tangent = path + extra;
        KL_LANE(axle->extra, g) = extra;
        const kl_lane inv_cos = kl_lane_sqrt(KL_R(1) + tangent * tangent);
        const kl_lane cos_delta = KL_R(1) / inv_cos;
        KL_LANE(axle->inv_cos, g) = inv_cos;
        KL_LANE(axle->cos_delta, g) = cos_delta;
        KL_LANE(axle->sin_delta, g) = tangent * cos_delta;
    }
}

/*
 * Displacement relative to the rails: u = y - y0 - r0 phi_x (the cross-level phi_x turns the
 * wheelset about the rails), seen outboard from either side less half the gauge's change.
 */
void kl_axle_posture(const struct kl_pair *restrict pair, kl_real speed_m_s,
                     kl_real speed_rate_m_s2, struct kl_axle *restrict axle) {
    const struct kl_track_point *track = &axle->track;
    const kl_real v = speed_m_s;
    const kl_real v2 = v * v;
    const kl_real r0 = pair->radius_m;

    /* d2/dt2 of anything that runs along the track: V^2 f'' + V' f' */
    const kl_real cant_rest = v2 * track->cant_ss_1_m2 + speed_rate_m_s2 * track->cant_s_1_m;
    const kl_real place0 = track->value.lateral_m + r0 * track->value.cross_rad;
    const kl_real place1 = track->slope.lateral_m + r0 * track->slope.cross_rad;
    const kl_real place2 = track->second.lateral_m + r0 * track->second.cross_rad;
    const kl_real whole = axle->x[KL_WS_Y] - place0;
    const kl_real whole_rate = axle->rate[KL_WS_Y] - v * place1;
    const kl_real u_rest = -(r0 * cant_rest + (v2 * place2 + speed_rate_m_s2 * place1));
    const kl_real gauge = KL_R(0.5) * track->value.gauge_m;
    const kl_real gauge_rate = KL_R(0.5) * (v * track->slope.gauge_m);
    const kl_real gauge_rest =
        KL_R(0.5) * (v2 * track->second.gauge_m + speed_rate_m_s2 * track->slope.gauge_m);
    /* a wheel off its rail rolls the axle, and that carries the other tread aside */
    const kl_real lever = r0 * pair->inv_base_1_m;
    const kl_real u = whole + lever * (axle->rise[KL_RIGHT] - axle->rise[KL_LEFT]);
    const kl_real u_rate =
        whole_rate + lever * (axle->rise_rate[KL_RIGHT] - axle->rise_rate[KL_LEFT]);
    KL_EACH_LANE(g) {
        KL_LANE(axle->outboard, g) = kl_lane_of(whole - gauge, -whole - gauge, g);
        KL_LANE(axle->outboard_rate, g) =
            kl_lane_of(whole_rate - gauge_rate, -whole_rate - gauge_rate, g);
    }
    const struct outboard out = {{u - gauge, -u - gauge},
                                 {u_rate - gauge_rate, -u_rate - gauge_rate},
                                 {u_rest - gauge_rest, -u_rest - gauge_rest}};
    struct ride ride;
    read_tables(pair, &out, axle, &ride);
    KL_EACH_LANE(g) {
        KL_LANE(axle->height, g) = KL_LANE(ride.height, g) - KL_LANE(axle->rise, g);
        KL_LANE(axle->height_rate, g) = KL_LANE(ride.rate, g) - KL_LANE(axle->rise_rate, g);
    }
    /* the larger |w| of both sides; the comparison is also false for a NaN */
    const int on_table = kl_abs_real(whole) + kl_abs_real(gauge) <= pair->range_m;
    axle->faults = on_table ? 0u : (uint32_t)KL_FAULT_DERAILED;

    const kl_real inv_base = pair->inv_base_1_m;
    const kl_real q_r = pair->share[KL_RIGHT];
    const kl_real q_l = pair->share[KL_LEFT];
    axle->z_y = q_r * ride.slope[KL_RIGHT] - q_l * ride.slope[KL_LEFT];
    axle->phi_y = KL_SUM(ride.slope) * inv_base;
    find_contact_planes(axle);
    axle->z =
        (q_r * axle->height[KL_RIGHT] + q_l * axle->height[KL_LEFT]) + track->value.vertical_m;
    axle->z_rate = (q_r * axle->height_rate[KL_RIGHT] + q_l * axle->height_rate[KL_LEFT]) +
                   v * track->slope.vertical_m;
    axle->z_rest = (q_r * ride.rest[KL_RIGHT] + q_l * ride.rest[KL_LEFT]) +
                   (v2 * track->second.vertical_m + speed_rate_m_s2 * track->slope.vertical_m);
    axle->roll =
        (axle->height[KL_RIGHT] - axle->height[KL_LEFT]) * inv_base + track->value.cross_rad;
    axle->roll_rate = (axle->height_rate[KL_RIGHT] - axle->height_rate[KL_LEFT]) * inv_base +
                      v * track->slope.cross_rad;
    axle->roll_rest =
        (ride.rest[KL_RIGHT] - ride.rest[KL_LEFT]) * inv_base +
        ((v2 * track->second.cross_rad + speed_rate_m_s2 * track->slope.cross_rad) + cant_rest);
}

/* ---- forces ---- */

static void find_creepages(const struct kl_wheelset *restrict wheelset,
                           const struct kl_axle *restrict axle,
                           struct kl_axle_forces *restrict forces) {
    struct kl_contacts *contacts = &forces->contacts;
    const struct kl_creep_def *law = &wheelset->creep;
    const int constant = law->f11_N > KL_R(0);
    const kl_real v = forces->speed_m_s;
    const kl_real by = forces->inv_creep_speed_s_m;
    const kl_lane speed = kl_lane_all(v);
    const kl_lane across_0 = kl_lane_all(axle->rate[KL_WS_Y] - v * axle->x[KL_WS_YAW]);
    contacts->constant = constant;
    contacts->limit_more = kl_no_limit(law->law);
    KL_EACH_LANE(g) {
        const kl_lane turn = kl_lane_of(axle->x[KL_WS_YAW_RATE], -axle->x[KL_WS_YAW_RATE], g);
        const kl_lane spin = KL_LANE(axle->spin, g);
        const kl_lane r = KL_LANE(axle->radius, g);
        const kl_lane along = (speed - r * spin) - KL_LANE(axle->arm, g) * turn;
        const kl_lane with_rail = kl_lane_of(KL_R(1), KL_R(-1), g) *
                                  (KL_LANE(axle->carried, g) * KL_LANE(axle->flange.rate, g));
        const kl_lane across = (across_0 - r * axle->roll_rate) - with_rail;
        const kl_lane about =
            KL_LANE(axle->cos_delta, g) * axle->x[KL_WS_YAW_RATE] -
            KL_LANE(axle->sin_delta, g) * (kl_lane_of(KL_R(1), KL_R(-1), g) * spin);
        const kl_lane gamma1 = along * by;
        const kl_lane gamma2 = across * by * KL_LANE(axle->inv_cos, g);
        const kl_lane omega3 = about * by;
        const kl_lane f11 = constant ? kl_lane_all(law->f11_N) : KL_LANE(axle->f11, g);
        const kl_lane f22 = constant ? kl_lane_all(law->f22_N) : KL_LANE(axle->f22, g);
        const kl_lane f23 = constant ? kl_lane_all(law->f23_Nm) : KL_LANE(axle->f23, g);
        const kl_lane slope = KL_LANE(forces->slope, g);
        KL_LANE(forces->tread.creepages.gamma1, g) = gamma1;
        KL_LANE(forces->tread.creepages.gamma2, g) = gamma2;
        KL_LANE(forces->tread.creepages.omega3, g) = omega3;
        KL_LANE(contacts->linear1, g) = -(slope * f11 * gamma1);
        KL_LANE(contacts->linear2, g) = -(slope * f22 * gamma2);
        KL_LANE(contacts->linear3, g) = -(slope * f23 * omega3);
    }
    kl_axle_friction(wheelset, forces, &forces->tread.creepages, &forces->tread.mu);
}

/*
 * Vertical and roll equilibrium: N_r c_r + N_l c_l = P, N_r A_r - N_l A_l = R with A = arm cos - r
 * sin. P and R hold T2 and the inertia of y'', and y'' holds T2: see kl_axle_lift_solve.
 */
static void prepare_normals(const struct kl_wheelset *restrict wheelset,
                            const struct kl_axle *restrict axle,
                            struct kl_axle_forces *restrict forces) {
    struct kl_contacts *contacts = &forces->contacts;
    const kl_real z_part = (wheelset->mass_kg * axle->z_y) * forces->inv_mass_1_kg;
    const kl_real roll_part = (wheelset->inertia_roll_kgm2 * axle->phi_y) * forces->inv_mass_1_kg;
    contacts->z_part = z_part;
    contacts->roll_part = roll_part;
    kl_both lever; /* A */
    KL_EACH_LANE(g) {
        const kl_lane r = KL_LANE(axle->radius, g);
        const kl_lane arm = KL_LANE(axle->arm, g);
        const kl_lane s = KL_LANE(axle->sin_delta, g);
        const kl_lane c = KL_LANE(axle->cos_delta, g);
        const kl_lane sign = kl_lane_of(KL_R(1), KL_R(-1), g);
        const kl_lane held = KL_R(1) - r * axle->phi_y;
        const kl_lane extra = KL_LANE(axle->extra, g);
        KL_LANE(forces->gain, g) = held * (KL_LANE(axle->inv_cos, g) - s * extra);
        KL_LANE(contacts->pulls, g) = -(sign * held * (c * extra));
        KL_LANE(contacts->turns, g) = arm * s + r * c;
        KL_LANE(lever, g) = arm * c - r * s;
    }
    const kl_real inv = KL_R(1) / (lever[KL_RIGHT] * axle->cos_delta[KL_LEFT] +
                                   lever[KL_LEFT] * axle->cos_delta[KL_RIGHT]);
    kl_both pulled;
    KL_EACH_LANE(g) {
        const kl_lane by_down = KL_OTHER(lever, g) * inv;
        const kl_lane by_roll = KL_OTHER(axle->cos_delta, g) * kl_lane_of(inv, -inv, g);
        const kl_lane backs = by_down * z_part + by_roll * roll_part;
        KL_LANE(contacts->by_down, g) = by_down;
        KL_LANE(contacts->by_roll, g) = by_roll;
        KL_LANE(contacts->backs, g) = backs;
        KL_LANE(pulled, g) = KL_LANE(contacts->pulls, g) * backs;
    }
    /* a normal force that pulls aside has its own inertia against it: N = N0 - backs (pulls N) */
    const kl_real share = KL_R(1) / (KL_R(1) + KL_SUM(pulled));
    KL_EACH_LANE(g) {
        KL_LANE(contacts->backs, g) *= share;
    }
}

/* Creep forces of the expected normal forces, by saturation. */
static inline void find_creep(struct kl_axle_forces *forces) {
    struct kl_contacts *contacts = &forces->contacts;
    KL_EACH_LANE(g) {
        const kl_lane n = KL_LANE(forces->tread.normal, g);
        const kl_lane y =
            kl_lane_inverse_cbrt(kl_lane_max(n, kl_lane_all(KL_R(1))), KL_CBRT_ROUNDS);
        const kl_lane two_thirds = contacts->constant ? kl_lane_all(KL_R(1)) : n * y;
        const kl_lane one = contacts->constant ? kl_lane_all(KL_R(1)) : n;
        const kl_lane t1 = two_thirds * KL_LANE(contacts->linear1, g);
        const kl_lane t2 =
            two_thirds * KL_LANE(contacts->linear2, g) + one * KL_LANE(contacts->linear3, g);
        const kl_lane limit = KL_LANE(forces->tread.mu, g) * n + kl_lane_all(contacts->limit_more);
        const kl_lane reduction = kl_lane_saturate(t1, t2, limit);
        KL_LANE(contacts->used, g) = n;
        KL_LANE(contacts->inv_cbrt, g) = y;
        KL_LANE(forces->tread.reduction, g) = reduction;
        KL_LANE(forces->tread.t1, g) = reduction * t1;
        KL_LANE(forces->tread.t2, g) = reduction * t2;
    }
}

/* Coefficients for the normal force that the creep forces were found with, and the spin moment. */
static void find_moments(const struct kl_wheelset *restrict wheelset,
                         const struct kl_axle *restrict axle,
                         struct kl_axle_forces *restrict forces) {
    const struct kl_contacts *contacts = &forces->contacts;
    const struct kl_creep_def *law = &wheelset->creep;
    const int constant = law->f11_N > KL_R(0);
    KL_EACH_LANE(g) {
        const kl_lane n = KL_LANE(contacts->used, g);
        const kl_lane y = KL_LANE(contacts->inv_cbrt, g);
        const kl_lane two_thirds = n * y;
        const kl_lane f23 = constant ? kl_lane_all(law->f23_Nm) : KL_LANE(axle->f23, g) * n;
        const kl_lane f33 =
            constant ? kl_lane_all(law->f33_Nm2) : KL_LANE(axle->f33, g) * (n * (two_thirds * y));
        KL_LANE(forces->tread.f11_N, g) =
            constant ? kl_lane_all(law->f11_N) : KL_LANE(axle->f11, g) * two_thirds;
        KL_LANE(forces->tread.f22_N, g) =
            constant ? kl_lane_all(law->f22_N) : KL_LANE(axle->f22, g) * two_thirds;
        KL_LANE(forces->f33_Nm2, g) = f33;
        KL_LANE(forces->tread.third, g) = KL_LANE(forces->tread.normal, g) * (y * y);
        if (kl_saturates(law->law)) {
            const kl_lane reduction =
                KL_LANE(forces->slope, g) * KL_LANE(forces->tread.reduction, g);
            KL_LANE(forces->tread.m3, g) =
                reduction * (f23 * KL_LANE(forces->tread.creepages.gamma2, g) -
                             f33 * KL_LANE(forces->tread.creepages.omega3, g));
            KL_LANE(forces->tread.reduction, g) = reduction;
        }
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
    kl_axle_flange_load(wheelset, axle, forces);
    kl_axle_lift_prepare(wheelset, pair, axle, forces);
    load->free_y = load->lateral + (axle->z_y * load->down + axle->phi_y * load->roll);
    forces->inv_mass_1_kg =
        KL_R(1) / (m * (KL_R(1) + axle->z_y * axle->z_y) + i_x * (axle->phi_y * axle->phi_y));
    find_creepages(wheelset, axle, forces);
    prepare_normals(wheelset, axle, forces);
    kl_axle_lift_weights(forces);
}

/* Creep forces of the expected normal forces, by a law that is more than a saturation. */
static void follow_law(const struct kl_wheelset *restrict wheelset,
                       const struct kl_axle *restrict axle,
                       struct kl_axle_forces *restrict forces) {
    struct kl_contacts *contacts = &forces->contacts;
    struct kl_law_contact contact;
    struct kl_law_forces law;
    KL_EACH_LANE(g) {
        const kl_lane n = KL_LANE(forces->tread.normal, g);
        const kl_lane inv_cbrt =
            kl_lane_inverse_cbrt(kl_lane_max(n, kl_lane_all(KL_R(1))), KL_CBRT_ROUNDS);
        KL_LANE(contacts->used, g) = n;
        KL_LANE(contacts->inv_cbrt, g) = inv_cbrt;
        KL_LANE(contact.linear1, g) =
            KL_LANE(axle->f11, g) * KL_LANE(forces->tread.creepages.gamma1, g);
        KL_LANE(contact.linear2, g) =
            KL_LANE(axle->f22, g) * KL_LANE(forces->tread.creepages.gamma2, g);
        KL_LANE(contact.linear3, g) =
            KL_LANE(axle->f23, g) * KL_LANE(forces->tread.creepages.omega3, g);
        KL_LANE(contact.normal, g) = n;
        KL_LANE(contact.inv_cbrt, g) = inv_cbrt;
        KL_LANE(contact.mu, g) = KL_LANE(forces->tread.mu, g);
        for (int i = 0; i < KL_CREEP_SHAPES; i++) {
            KL_LANE(contact.shape[i], g) = KL_LANE(axle->shape[i], g);
        }
    }
    kl_axle_law(wheelset, forces, &contact, &law);
    KL_EACH_LANE(g) {
        KL_LANE(forces->tread.t1, g) = KL_LANE(law.t1, g);
        KL_LANE(forces->tread.t2, g) = KL_LANE(law.t2, g);
        KL_LANE(forces->tread.m3, g) = KL_LANE(law.m3, g);
        KL_LANE(forces->tread.reduction, g) = KL_LANE(law.reduction, g);
    }
}

void kl_axle_balance(const struct kl_wheelset *restrict wheelset,
                     const struct kl_axle *restrict axle, struct kl_axle_forces *restrict forces) {
    KL_EACH_LANE(g) { /* a wheel that is up carries nothing */
        const kl_lane carries = kl_lane_all(KL_R(1)) - KL_LANE(axle->up, g);
        KL_LANE(forces->tread.normal, g) =
            carries * kl_lane_max(KL_LANE(axle->expected, g), kl_lane_all(KL_R(0)));
    }
    if (kl_saturates(wheelset->creep.law)) {
        find_creep(forces);
    } else {
        follow_law(wheelset, axle, forces);
    }
    kl_axle_lift_solve(wheelset, axle, forces);
}

void kl_axle_accelerate(const struct kl_wheelset *restrict wheelset, struct kl_axle *restrict axle,
                        struct kl_axle_forces *restrict forces) {
    kl_both across;
    kl_both turn;
    kl_both drive;
    /* where the flange has the rail give way, a tread that lands is stopped by it, but not thrown back
     * aside: no more than twice a wheel's load pulls */
    const kl_lane most = kl_lane_all(wheelset->static_load_N);
    find_moments(wheelset, axle, forces);
    KL_EACH_LANE(g) {
        const kl_lane t1 = KL_LANE(forces->tread.t1, g);
        const kl_lane sign = kl_lane_of(KL_R(1), KL_R(-1), g);
        KL_LANE(across, g) = KL_LANE(forces->tread.t2, g) * KL_LANE(forces->gain, g) +
                             kl_lane_min(KL_LANE(forces->tread.normal, g), most) *
                                 KL_LANE(forces->contacts.pulls, g);
        KL_LANE(turn, g) = KL_LANE(forces->tread.m3, g) * KL_LANE(axle->cos_delta, g) -
                           sign * (KL_LANE(axle->arm, g) * t1);
        KL_LANE(drive, g) = KL_LANE(axle->radius, g) * t1;
    }
    axle->rate[KL_WS_Y_RATE] = (forces->load.free_y + KL_SUM(across)) * forces->inv_mass_1_kg;
    axle->rate[KL_WS_YAW_RATE] = (forces->load.yaw + KL_SUM(turn)) * wheelset->inv_yaw_1_kgm2;
    axle->rate[KL_WS_SPIN] =
        (forces->load.drive - KL_SUM(drive)) * wheelset->inv_spin_1_kgm2 - axle->spin_drift;
}

void kl_axle_stiffness(const struct kl_wheelset *restrict wheelset,
                       const struct kl_axle *restrict axle,
                       const struct kl_axle_forces *restrict forces, kl_real step_s,
                       struct kl_stiffness *restrict stiffness) {
    kl_both along;
    kl_both yaw;
    kl_both spin;
    KL_EACH_LANE(g) {
        const kl_lane by = KL_LANE(forces->tread.reduction, g) * forces->inv_creep_speed_s_m;
        const kl_lane gain = KL_LANE(forces->gain, g);
        const kl_lane arm = KL_LANE(axle->arm, g);
        const kl_lane r = KL_LANE(axle->radius, g);
        const kl_lane f11 = KL_LANE(forces->tread.f11_N, g);
        KL_LANE(along, g) = by * KL_LANE(forces->tread.f22_N, g) * (gain * gain) *
                            (KL_R(1) - KL_LANE(axle->carried, g));
        /* of a flange the longitudinal creep alone: across it slides with the rail */
        const kl_lane flange_f11 = KL_LANE(forces->flange.reduction, g) *
                                   KL_LANE(forces->flange.f11_N, g) * forces->inv_creep_speed_s_m;
        const kl_lane flange_arm = KL_LANE(axle->flange.arm, g);
        const kl_lane flange_r = KL_LANE(axle->flange.radius, g);
        KL_LANE(yaw, g) = by * (f11 * (arm * arm) + KL_LANE(forces->f33_Nm2, g)) +
                          flange_f11 * (flange_arm * flange_arm);
        KL_LANE(spin, g) = by * f11 * (r * r) + flange_f11 * (flange_r * flange_r);
    }
    stiffness->y = KL_SUM(along) * forces->inv_mass_1_kg * step_s;
    stiffness->yaw = KL_SUM(yaw) * wheelset->inv_yaw_1_kgm2 * step_s;
    stiffness->spin = KL_SUM(spin) * wheelset->inv_spin_1_kgm2 * step_s;
}
