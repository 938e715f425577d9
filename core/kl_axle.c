/* kl_axle.c - the wheelset within a step. */
#include "kl_axle.h"

#include "kl_lookup.h"
#include "kl_math.h"
#include "kl_saturate.h"

static kl_real lerp(kl_real a, kl_real b, kl_real t) {
    return a + t * (b - a);
}

/* The two rows around a place in the table, which stays inside it. */
struct cell {
    const struct kl_row *a;
    const struct kl_row *b;
    kl_real t;
};

static struct cell cell_at(const struct kl_pair *pair, const struct kl_side_table *table,
                           kl_real place) {
    const kl_real last = (kl_real)(2u * pair->half);
    const kl_real kept = kl_min_real(kl_max_real(place, KL_R(0)), last);
    const uint32_t i = (uint32_t)kept;
    const uint32_t row = i < 2u * pair->half ? i : 2u * pair->half - 1u;
    const struct cell cell = {&table->rows[row], &table->rows[row + 1u], kept - (kl_real)row};
    return cell;
}

/* Height, slope and bend of one side's table at its place. */
struct ride {
    kl_real height[KL_SIDES];
    kl_real slope[KL_SIDES];
    kl_real bend[KL_SIDES];
};

#define COLUMNS 8 /* arm, radius, sin, cos, f11, f22, f23, f33: neighbours in a row */

static void read_tables(const struct kl_pair *restrict pair, const kl_real w[KL_SIDES],
                        struct kl_axle *restrict axle, struct ride *restrict ride) {
    kl_real column[KL_SIDES][COLUMNS];
    for (int s = 0; s < KL_SIDES; s++) {
        axle->place[s] = w[s] * pair->inv_step_1_m + (kl_real)pair->half;
        const struct cell cell = cell_at(pair, &pair->side[s], axle->place[s]);
        const struct kl_hermite h =
            kl_hermite(cell.a, cell.b, cell.t, pair->step_m, pair->inv_step_1_m);
        ride->height[s] = h.value;
        ride->slope[s] = h.slope;
        ride->bend[s] = h.second;
        const kl_real *a = &cell.a->arm_m;
        const kl_real *b = &cell.b->arm_m;
        for (int c = 0; c < COLUMNS; c++) {
            column[s][c] = lerp(a[c], b[c], cell.t);
        }
    }
    for (int s = 0; s < KL_SIDES; s++) {
        axle->arm[s] = column[s][0];
        axle->radius[s] = column[s][1];
        axle->sin_delta[s] = column[s][2];
        axle->cos_delta[s] = column[s][3];
        axle->f11[s] = column[s][4];
        axle->f22[s] = column[s][5];
        axle->f23[s] = column[s][6];
        axle->f33[s] = column[s][7];
        axle->inv_cos[s] = KL_R(1) / axle->cos_delta[s];
    }
}

static const kl_real side_sign[KL_SIDES] = {KL_R(1), KL_R(-1)};

/*
 * Displacement relative to the rails: u = y - y0 - r0 phi_x (the cross-level phi_x turns the
 * wheelset about the rails), seen outboard from either side less half the gauge's change.
 */
void kl_axle_posture(const struct kl_pair *restrict pair, const kl_real *restrict x,
                     kl_real speed_m_s, kl_real speed_rate_m_s2, struct kl_axle *restrict axle) {
    const struct kl_track_point *track = &axle->track;
    const kl_real v = speed_m_s;
    const kl_real v2 = v * v;
    const kl_real r0 = pair->radius_m;
    axle->y = x[KL_WS_Y];
    axle->yaw = x[KL_WS_YAW];
    axle->y_abs_rate = x[KL_WS_Y_RATE];
    axle->yaw_abs_rate = x[KL_WS_YAW_RATE];
    axle->spin = x[KL_WS_SPIN];
    axle->y_rate = axle->y_abs_rate - r0 * (v * track->cant_s_1_m);

    /* d2/dt2 of anything that runs along the track: V^2 f'' + V' f' */
    const kl_real cant_rest = v2 * track->cant_ss_1_m2 + speed_rate_m_s2 * track->cant_s_1_m;
    const kl_real place0 = track->value.lateral_m + r0 * track->value.cross_rad;
    const kl_real place1 = track->slope.lateral_m + r0 * track->slope.cross_rad;
    const kl_real place2 = track->second.lateral_m + r0 * track->second.cross_rad;
    const kl_real u = axle->y - place0;
    const kl_real u_rate = axle->y_rate - v * place1;
    const kl_real u_rest = -(r0 * cant_rest + (v2 * place2 + speed_rate_m_s2 * place1));
    const kl_real gauge = KL_R(0.5) * track->value.gauge_m;
    const kl_real gauge_rate = KL_R(0.5) * (v * track->slope.gauge_m);
    const kl_real gauge_rest =
        KL_R(0.5) * (v2 * track->second.gauge_m + speed_rate_m_s2 * track->slope.gauge_m);
    const kl_real w[KL_SIDES] = {u - gauge, -u - gauge};
    struct ride ride;
    read_tables(pair, w, axle, &ride);
    /* the comparison is also false for a NaN */
    const int on_table =
        kl_abs_real(w[KL_RIGHT]) <= pair->range_m && kl_abs_real(w[KL_LEFT]) <= pair->range_m;
    axle->faults = on_table ? 0u : (uint32_t)KL_FAULT_DERAILED;

    kl_real rate[KL_SIDES]; /* dH/dt, and d2H/dt2 without y'' */
    kl_real rest[KL_SIDES];
    for (int s = 0; s < KL_SIDES; s++) {
        const kl_real w_rate = side_sign[s] * u_rate - gauge_rate;
        const kl_real w_rest = side_sign[s] * u_rest - gauge_rest;
        rate[s] = ride.slope[s] * w_rate;
        rest[s] = ride.bend[s] * (w_rate * w_rate) + ride.slope[s] * w_rest;
    }
    const kl_real inv_base = pair->inv_base_1_m;
    const kl_real q_r = pair->share[KL_RIGHT];
    const kl_real q_l = pair->share[KL_LEFT];
    axle->z_y = q_r * ride.slope[KL_RIGHT] - q_l * ride.slope[KL_LEFT];
    axle->phi_y = (ride.slope[KL_RIGHT] + ride.slope[KL_LEFT]) * inv_base;
    axle->z = (q_r * ride.height[KL_RIGHT] + q_l * ride.height[KL_LEFT]) + track->value.vertical_m;
    axle->z_rate = (q_r * rate[KL_RIGHT] + q_l * rate[KL_LEFT]) + v * track->slope.vertical_m;
    axle->z_rest = (q_r * rest[KL_RIGHT] + q_l * rest[KL_LEFT]) +
                   (v2 * track->second.vertical_m + speed_rate_m_s2 * track->slope.vertical_m);
    axle->roll = (ride.height[KL_RIGHT] - ride.height[KL_LEFT]) * inv_base + track->value.cross_rad;
    axle->roll_rate = (rate[KL_RIGHT] - rate[KL_LEFT]) * inv_base + v * track->slope.cross_rad;
    axle->roll_rest =
        (rest[KL_RIGHT] - rest[KL_LEFT]) * inv_base +
        ((v2 * track->second.cross_rad + speed_rate_m_s2 * track->slope.cross_rad) + cant_rest);
}

/* Vertical and roll equilibrium: N_r c_r + N_l c_l = P, N_r A_r - N_l A_l = R with A = arm cos - r
 * sin. */
struct equilibrium {
    kl_real lever[KL_SIDES];
    kl_real inv;
};

static struct equilibrium equilibrium_of(const struct kl_axle *axle) {
    struct equilibrium e;
    for (int s = 0; s < KL_SIDES; s++) {
        e.lever[s] = axle->arm[s] * axle->cos_delta[s] - axle->radius[s] * axle->sin_delta[s];
    }
    e.inv = KL_R(1) / (e.lever[KL_RIGHT] * axle->cos_delta[KL_LEFT] +
                       e.lever[KL_LEFT] * axle->cos_delta[KL_RIGHT]);
    return e;
}

/* A wheel that would have to be pulled down carries nothing. */
static void find_normals(const struct kl_axle *axle, const struct equilibrium *e, kl_real p,
                         kl_real r, kl_real normal[KL_SIDES]) {
    normal[KL_RIGHT] =
        kl_max_real((p * e->lever[KL_LEFT] + r * axle->cos_delta[KL_LEFT]) * e->inv, KL_R(0));
    normal[KL_LEFT] =
        kl_max_real((p * e->lever[KL_RIGHT] - r * axle->cos_delta[KL_RIGHT]) * e->inv, KL_R(0));
}

/* Powers of the normal force by which the table's coefficients grow; 1 where the definition gives
 * constants. */
struct scale {
    kl_real two_thirds[KL_SIDES];
    kl_real one[KL_SIDES];
    kl_real four_thirds[KL_SIDES];
};

static void scale_of(const kl_real normal[KL_SIDES], int constant, struct scale *scale) {
    for (int s = 0; s < KL_SIDES; s++) {
        const kl_real n = normal[s];
        const kl_real y = kl_inverse_cbrt(kl_max_real(n, KL_R(1)));
        const kl_real two_thirds = n * y;
        scale->two_thirds[s] = constant ? KL_R(1) : two_thirds;
        scale->one[s] = constant ? KL_R(1) : n;
        scale->four_thirds[s] = constant ? KL_R(1) : n * (two_thirds * y);
    }
}

static void find_creepages(const struct kl_axle *restrict axle, kl_real inv_creep_speed,
                           struct kl_axle_forces *restrict forces) {
    const kl_real v = forces->speed_m_s;
    const kl_real drift = v * axle->yaw;
    for (int s = 0; s < KL_SIDES; s++) {
        const kl_real r = axle->radius[s];
        const kl_real along =
            (v - r * axle->spin) - side_sign[s] * (axle->arm[s] * axle->yaw_abs_rate);
        const kl_real across = (axle->y_rate - r * axle->roll_rate) - drift;
        const kl_real about = axle->yaw_abs_rate * axle->cos_delta[s] -
                              side_sign[s] * (axle->spin * axle->sin_delta[s]);
        forces->gamma1[s] = along * inv_creep_speed;
        forces->gamma2[s] = across * inv_creep_speed * axle->inv_cos[s];
        forces->omega3[s] = about * inv_creep_speed;
    }
}

void kl_axle_forces(const struct kl_wheelset *restrict wheelset,
                    const struct kl_axle *restrict axle, struct kl_axle_forces *restrict forces) {
    const struct kl_creep_def *law = &wheelset->creep;
    const struct kl_track_point *track = &axle->track;
    const kl_real m = wheelset->mass_kg;
    const kl_real i_x = wheelset->inertia_roll_kgm2;
    const kl_real v = forces->speed_m_s;
    const kl_real inv_creep_speed = KL_R(1) / kl_max_real(v, KL_R(KL_MIN_CREEP_SPEED_M_S));
    const kl_real gyro = wheelset->inertia_spin_kgm2 * axle->spin;
    const kl_real inv_mass =
        KL_R(1) / (m * (KL_R(1) + axle->z_y * axle->z_y) + i_x * (axle->phi_y * axle->phi_y));
    const kl_real aside = track->curvature_1_m * (v * v) -
                          forces->gravity_m_s2 * (track->cant_rad + track->value.cross_rad);
    /* what acts besides the contact, the inertia that is known already taken off */
    const kl_real lateral = forces->suspension[0] - m * aside;
    const kl_real down = (forces->suspension[1] + m * forces->gravity_m_s2) - m * axle->z_rest;
    const kl_real roll =
        (forces->suspension[2] - gyro * axle->yaw_abs_rate) - i_x * axle->roll_rest;
    const kl_real free_y = lateral + (axle->z_y * down + axle->phi_y * roll);

    const int constant = law->f11_N > KL_R(0);
    kl_real f[4][KL_SIDES];
    kl_real gain[KL_SIDES];  /* of T2 in the lateral equation */
    kl_real lever[KL_SIDES]; /* of T2 about x */
    kl_real linear[3][KL_SIDES];
    find_creepages(axle, inv_creep_speed, forces);
    for (int s = 0; s < KL_SIDES; s++) {
        f[0][s] = constant ? law->f11_N : axle->f11[s];
        f[1][s] = constant ? law->f22_N : axle->f22[s];
        f[2][s] = constant ? law->f23_Nm : axle->f23[s];
        f[3][s] = constant ? law->f33_Nm2 : axle->f33[s];
        linear[0][s] = -(f[0][s] * forces->gamma1[s]);
        linear[1][s] = -(f[1][s] * forces->gamma2[s]);
        linear[2][s] = -(f[2][s] * forces->omega3[s]);
        gain[s] = (KL_R(1) - axle->radius[s] * axle->phi_y) * axle->inv_cos[s];
        lever[s] = axle->arm[s] * axle->sin_delta[s] + axle->radius[s] * axle->cos_delta[s];
    }

    /* first guess: no lateral acceleration, and creep that balances the lateral forces at the rail
     */
    const struct equilibrium e = equilibrium_of(axle);
    struct scale scale;
    find_normals(axle, &e, down,
                 roll + KL_R(0.5) * (axle->radius[KL_RIGHT] + axle->radius[KL_LEFT]) * lateral,
                 forces->normal);
    for (int pass = 0; pass < 2; pass++) {
        kl_real across[KL_SIDES];
        kl_real up[KL_SIDES];
        kl_real turn[KL_SIDES];
        scale_of(forces->normal, constant, &scale);
        for (int s = 0; s < KL_SIDES; s++) {
            const kl_real t1 = scale.two_thirds[s] * linear[0][s];
            const kl_real t2 = scale.two_thirds[s] * linear[1][s] + scale.one[s] * linear[2][s];
            const kl_real reduction =
                kl_saturate(law->law, t1, t2, forces->friction[s] * forces->normal[s]);
            forces->reduction[s] = reduction;
            forces->t1[s] = reduction * t1;
            forces->t2[s] = reduction * t2;
            across[s] = forces->t2[s] * gain[s];
            up[s] = forces->t2[s] * axle->sin_delta[s];
            turn[s] = forces->t2[s] * lever[s];
        }
        forces->y_acc = (free_y + (across[KL_RIGHT] + across[KL_LEFT])) * inv_mass;
        find_normals(
            axle, &e, (down - m * (axle->z_y * forces->y_acc)) + (up[KL_LEFT] - up[KL_RIGHT]),
            (roll - i_x * (axle->phi_y * forces->y_acc)) - (turn[KL_RIGHT] + turn[KL_LEFT]),
            forces->normal);
    }

    const kl_real inv_yaw = KL_R(1) / wheelset->inertia_yaw_kgm2;
    const kl_real inv_spin = KL_R(1) / wheelset->inertia_spin_kgm2;
    kl_real yaw[KL_SIDES];
    kl_real about[KL_SIDES];
    kl_real drive[KL_SIDES];
    kl_real damping[3][KL_SIDES];
    for (int s = 0; s < KL_SIDES; s++) {
        const kl_real by = forces->reduction[s] * inv_creep_speed;
        const kl_real f11 = f[0][s] * scale.two_thirds[s];
        const kl_real f22 = f[1][s] * scale.two_thirds[s];
        const kl_real f33 = f[3][s] * scale.four_thirds[s];
        forces->m3[s] = forces->reduction[s] *
                        (f[2][s] * scale.one[s] * forces->gamma2[s] - f33 * forces->omega3[s]);
        yaw[s] = axle->arm[s] * forces->t1[s];
        about[s] = forces->m3[s] * axle->cos_delta[s];
        drive[s] = axle->radius[s] * forces->t1[s];
        damping[0][s] = by * f22 * (gain[s] * gain[s]);
        damping[1][s] = by * (f11 * (axle->arm[s] * axle->arm[s]) + f33);
        damping[2][s] = by * f11 * (axle->radius[s] * axle->radius[s]);
    }
    forces->yaw_acc = ((forces->suspension[3] + gyro * (axle->roll_rate + v * track->cant_s_1_m)) +
                       ((yaw[KL_LEFT] - yaw[KL_RIGHT]) + (about[KL_RIGHT] + about[KL_LEFT]))) *
                      inv_yaw;
    forces->spin_acc = (forces->torque_Nm - (drive[KL_RIGHT] + drive[KL_LEFT])) * inv_spin;
    forces->damping[0] = (damping[0][KL_RIGHT] + damping[0][KL_LEFT]) * inv_mass;
    forces->damping[1] = (damping[1][KL_RIGHT] + damping[1][KL_LEFT]) * inv_yaw;
    forces->damping[2] = (damping[2][KL_RIGHT] + damping[2][KL_LEFT]) * inv_spin;
}

void kl_axle_output(const struct kl_pair *pair, const struct kl_axle *axle,
                    const struct kl_axle_forces *forces, struct kl_wheelset_output *output) {
    output->track = axle->track;
    output->z_m = axle->z;
    output->roll_rad = axle->roll;
    output->y_acc_m_s2 =
        forces->y_acc + axle->track.curvature_1_m * (forces->speed_m_s * forces->speed_m_s);
    output->z_acc_m_s2 = axle->z_y * forces->y_acc + axle->z_rest;
    for (int s = 0; s < KL_SIDES; s++) {
        const kl_real sign = side_sign[s];
        const kl_real n = forces->normal[s];
        const struct cell cell = cell_at(pair, &pair->side[s], axle->place[s]);
        const kl_real y = kl_inverse_cbrt(kl_max_real(n, KL_R(1)));
        const kl_real third = n * (y * y);
        struct kl_wheel_output *o = &output->wheel[s];
        o->normal_N = n;
        o->q_N = n * axle->cos_delta[s] + sign * (forces->t2[s] * axle->sin_delta[s]);
        /* on the rail: the opposite of what acts on the wheel */
        o->y_N = sign * (n * axle->sin_delta[s]) - forces->t2[s] * axle->cos_delta[s];
        o->t1_N = forces->t1[s];
        o->t2_N = forces->t2[s];
        o->m3_Nm = forces->m3[s];
        o->gamma1 = forces->gamma1[s];
        o->gamma2 = forces->gamma2[s];
        o->omega3_1_m = forces->omega3[s];
        o->reduction = forces->reduction[s];
        o->radius_m = axle->radius[s];
        o->delta_rad = lerp(cell.a->delta_rail_rad, cell.b->delta_rail_rad, cell.t);
        o->eta_wheel_m = lerp(cell.a->eta_wheel_m, cell.b->eta_wheel_m, cell.t);
        o->eta_rail_m = lerp(cell.a->eta_rail_m, cell.b->eta_rail_m, cell.t);
        o->semi_a_m = third * lerp(cell.a->semi_a_1, cell.b->semi_a_1, cell.t);
        o->semi_b_m = third * lerp(cell.a->semi_b_1, cell.b->semi_b_1, cell.t);
    }
    output->force_y_N = output->wheel[KL_RIGHT].y_N + output->wheel[KL_LEFT].y_N;
}
