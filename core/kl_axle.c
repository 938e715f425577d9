/* kl_axle.c - the wheelset within a step. */
#include "kl_axle.h"

#include "kl_lookup.h"
#include "kl_math.h"

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

static void read_wheel(const struct kl_pair *pair, const struct kl_side_table *table, kl_real w,
                       struct kl_wheel *wheel) {
    wheel->place = w * pair->inv_step_1_m + (kl_real)pair->half;
    const struct cell cell = cell_at(pair, table, wheel->place);
    const struct kl_row *a = cell.a;
    const struct kl_row *b = cell.b;
    const kl_real t = cell.t;
    const struct kl_hermite h = kl_hermite(a, b, t, pair->step_m, pair->inv_step_1_m);
    wheel->height = h.value;
    wheel->height_w = h.slope;
    wheel->height_ww = h.second;
    wheel->arm = lerp(a->arm_m, b->arm_m, t);
    wheel->radius = lerp(a->radius_m, b->radius_m, t);
    wheel->sin_delta = lerp(a->sin_delta, b->sin_delta, t);
    wheel->cos_delta = lerp(a->cos_delta, b->cos_delta, t);
    wheel->inv_cos = KL_R(1) / wheel->cos_delta;
    wheel->unit.f11_N = lerp(a->f11_1, b->f11_1, t);
    wheel->unit.f22_N = lerp(a->f22_1, b->f22_1, t);
    wheel->unit.f23_Nm = lerp(a->f23_1, b->f23_1, t);
    wheel->unit.f33_Nm2 = lerp(a->f33_1, b->f33_1, t);
}

/*
 * Displacement relative to the rails: u = y - y0 - r0 phi_x (the cross-level phi_x turns the
 * wheelset about the rails), seen outboard from either side less half the gauge's change.
 */
void kl_axle_posture(const struct kl_pair *pair, const kl_real *x, kl_real speed_m_s,
                     kl_real speed_rate_m_s2, struct kl_axle *axle) {
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
    axle->faults = 0;
    for (int s = 0; s < KL_SIDES; s++) {
        struct kl_wheel *wheel = &axle->wheel[s];
        const kl_real sign = s == KL_RIGHT ? KL_R(1) : KL_R(-1);
        const kl_real w = sign * u - gauge;
        wheel->w_rate = sign * u_rate - gauge_rate;
        wheel->w_rest = sign * u_rest - gauge_rest;
        read_wheel(pair, &pair->side[s], w, wheel);
        /* also true for a NaN */
        if (!(kl_abs_real(w) <= pair->range_m)) {
            axle->faults |= (uint32_t)KL_FAULT_DERAILED;
        }
    }
    const struct kl_wheel *r = &axle->wheel[KL_RIGHT];
    const struct kl_wheel *l = &axle->wheel[KL_LEFT];
    const kl_real inv_base = KL_R(1) / pair->base_m;
    const kl_real q_r = pair->share[KL_RIGHT];
    const kl_real q_l = pair->share[KL_LEFT];
    axle->z_y = q_r * r->height_w - q_l * l->height_w;
    axle->phi_y = (r->height_w + l->height_w) * inv_base;
    const kl_real rate_r = r->height_w * r->w_rate;
    const kl_real rate_l = l->height_w * l->w_rate;
    const kl_real rest_r = r->height_ww * (r->w_rate * r->w_rate) + r->height_w * r->w_rest;
    const kl_real rest_l = l->height_ww * (l->w_rate * l->w_rate) + l->height_w * l->w_rest;
    axle->z = (q_r * r->height + q_l * l->height) + track->value.vertical_m;
    axle->z_rate = (q_r * rate_r + q_l * rate_l) + v * track->slope.vertical_m;
    axle->z_rest = (q_r * rest_r + q_l * rest_l) +
                   (v2 * track->second.vertical_m + speed_rate_m_s2 * track->slope.vertical_m);
    axle->roll = (r->height - l->height) * inv_base + track->value.cross_rad;
    axle->roll_rate = (rate_r - rate_l) * inv_base + v * track->slope.cross_rad;
    axle->roll_rest =
        (rest_r - rest_l) * inv_base +
        ((v2 * track->second.cross_rad + speed_rate_m_s2 * track->slope.cross_rad) + cant_rest);
}

/* Creepages (physics: creepage of the wheel over the rail), V bounded below. */
static void find_creepages(const struct kl_axle *axle, kl_real speed, kl_real inv_creep_speed,
                           struct kl_creepage creepage[KL_SIDES]) {
    for (int s = 0; s < KL_SIDES; s++) {
        const struct kl_wheel *wheel = &axle->wheel[s];
        const kl_real sign = s == KL_RIGHT ? KL_R(1) : KL_R(-1);
        const kl_real along =
            (speed - wheel->radius * axle->spin) - sign * (wheel->arm * axle->yaw_abs_rate);
        const kl_real across = (axle->y_rate - wheel->radius * axle->roll_rate) - speed * axle->yaw;
        const kl_real about =
            axle->yaw_abs_rate * wheel->cos_delta - sign * (axle->spin * wheel->sin_delta);
        creepage[s].gamma1 = along * inv_creep_speed;
        creepage[s].gamma2 = across * inv_creep_speed * wheel->inv_cos;
        creepage[s].omega3_1_m = about * inv_creep_speed;
    }
}

static struct kl_creep_coefficients coefficients(const struct kl_creep_def *creep,
                                                 const struct kl_wheel *wheel, kl_real normal) {
    struct kl_creep_coefficients f = {creep->f11_N, creep->f22_N, creep->f23_Nm, creep->f33_Nm2};
    if (!(creep->f11_N > KL_R(0))) {
        const kl_real y = kl_inverse_cbrt(kl_max_real(normal, KL_R(1)));
        const kl_real two_thirds = normal * y;
        const kl_real third = two_thirds * y;
        f.f11_N = wheel->unit.f11_N * two_thirds;
        f.f22_N = wheel->unit.f22_N * two_thirds;
        f.f23_Nm = wheel->unit.f23_Nm * normal;
        f.f33_Nm2 = wheel->unit.f33_Nm2 * (normal * third);
    }
    return f;
}

/*
 * Vertical and roll equilibrium for the two normal forces:
 *     N_r c_r + N_l c_l = P,   N_r A_r - N_l A_l = R,   A = arm cos - r sin.
 * A wheel that would have to be pulled down carries nothing.
 */
static void find_normals(const struct kl_axle *axle, kl_real p, kl_real r,
                         kl_real normal[KL_SIDES]) {
    const struct kl_wheel *wr = &axle->wheel[KL_RIGHT];
    const struct kl_wheel *wl = &axle->wheel[KL_LEFT];
    const kl_real a_r = wr->arm * wr->cos_delta - wr->radius * wr->sin_delta;
    const kl_real a_l = wl->arm * wl->cos_delta - wl->radius * wl->sin_delta;
    const kl_real inv = KL_R(1) / (a_r * wl->cos_delta + a_l * wr->cos_delta);
    normal[KL_RIGHT] = kl_max_real((p * a_l + r * wl->cos_delta) * inv, KL_R(0));
    normal[KL_LEFT] = kl_max_real((p * a_r - r * wr->cos_delta) * inv, KL_R(0));
}

/* Sums of the creep forces over both wheels, in the mirror-symmetric order. */
struct creep_sums {
    kl_real lateral; /* generalised force on y: sum T2 (1 - r phi_y)/cos delta */
    kl_real down;    /* vertical force on the wheelset, positive down */
    kl_real roll;    /* moment about x */
};

static struct creep_sums sum_creep(const struct kl_axle *axle, const struct kl_creep_force *creep) {
    const struct kl_wheel *r = &axle->wheel[KL_RIGHT];
    const struct kl_wheel *l = &axle->wheel[KL_LEFT];
    const kl_real t_r = creep[KL_RIGHT].t2_N;
    const kl_real t_l = creep[KL_LEFT].t2_N;
    const struct creep_sums sums = {t_r * ((KL_R(1) - r->radius * axle->phi_y) * r->inv_cos) +
                                        t_l * ((KL_R(1) - l->radius * axle->phi_y) * l->inv_cos),
                                    t_l * l->sin_delta - t_r * r->sin_delta,
                                    -(t_r * (r->arm * r->sin_delta + r->radius * r->cos_delta) +
                                      t_l * (l->arm * l->sin_delta + l->radius * l->cos_delta))};
    return sums;
}

void kl_axle_forces(const struct kl_wheelset *wheelset, const struct kl_axle *axle,
                    struct kl_axle_forces *forces) {
    const struct kl_track_point *track = &axle->track;
    const kl_real m = wheelset->mass_kg;
    const kl_real i_x = wheelset->inertia_roll_kgm2;
    const kl_real v = forces->speed_m_s;
    const kl_real creep_speed = kl_max_real(v, KL_R(KL_MIN_CREEP_SPEED_M_S));
    const kl_real inv_creep_speed = KL_R(1) / creep_speed;
    const kl_real gyro = wheelset->inertia_spin_kgm2 * axle->spin;
    const kl_real weight = m * forces->gravity_m_s2;
    const kl_real inv_mass =
        KL_R(1) / (m * (KL_R(1) + axle->z_y * axle->z_y) + i_x * (axle->phi_y * axle->phi_y));
    const kl_real aside = track->curvature_1_m * (v * v) -
                          forces->gravity_m_s2 * (track->cant_rad + track->value.cross_rad);
    const kl_real down = forces->suspension[1] + weight;
    const kl_real roll = forces->suspension[2] - gyro * axle->yaw_abs_rate;
    /* everything in the lateral equation but the creep forces */
    const kl_real free_y =
        (forces->suspension[0] - m * aside) +
        (axle->z_y * (down - m * axle->z_rest) + axle->phi_y * (roll - i_x * axle->roll_rest));
    find_creepages(axle, v, inv_creep_speed, forces->creepage);

    /* first guess: no lateral acceleration, no creep but what balances the lateral forces at the
     * rail */
    const kl_real at_rail =
        KL_R(0.5) * (axle->wheel[KL_RIGHT].radius + axle->wheel[KL_LEFT].radius);
    find_normals(axle, down - m * axle->z_rest,
                 (roll - i_x * axle->roll_rest) + at_rail * (forces->suspension[0] - m * aside),
                 forces->normal);
    struct kl_creep_coefficients f[KL_SIDES];
    for (int pass = 0; pass < 2; pass++) {
        for (int s = 0; s < KL_SIDES; s++) {
            f[s] = coefficients(&wheelset->creep, &axle->wheel[s], forces->normal[s]);
            forces->creep[s] = kl_creep(wheelset->creep.law, &f[s], forces->friction[s],
                                        forces->normal[s], &forces->creepage[s]);
        }
        const struct creep_sums sums = sum_creep(axle, forces->creep);
        forces->y_acc = (free_y + sums.lateral) * inv_mass;
        const kl_real z_acc = axle->z_y * forces->y_acc + axle->z_rest;
        const kl_real roll_acc = axle->phi_y * forces->y_acc + axle->roll_rest;
        find_normals(axle, down + sums.down - m * z_acc, roll + sums.roll - i_x * roll_acc,
                     forces->normal);
    }

    const struct kl_wheel *r = &axle->wheel[KL_RIGHT];
    const struct kl_wheel *l = &axle->wheel[KL_LEFT];
    const struct kl_creep_force *c_r = &forces->creep[KL_RIGHT];
    const struct kl_creep_force *c_l = &forces->creep[KL_LEFT];
    const kl_real inv_yaw = KL_R(1) / wheelset->inertia_yaw_kgm2;
    const kl_real inv_spin = KL_R(1) / wheelset->inertia_spin_kgm2;
    const kl_real abs_roll_rate = axle->roll_rate + v * track->cant_s_1_m;
    forces->yaw_acc = ((forces->suspension[3] + gyro * abs_roll_rate) +
                       ((l->arm * c_l->t1_N - r->arm * c_r->t1_N) +
                        (c_r->m3_Nm * r->cos_delta + c_l->m3_Nm * l->cos_delta))) *
                      inv_yaw;
    forces->spin_acc =
        (forces->torque_Nm - (r->radius * c_r->t1_N + l->radius * c_l->t1_N)) * inv_spin;

    kl_real damping[KL_SIDES][3];
    for (int s = 0; s < KL_SIDES; s++) {
        const struct kl_wheel *wheel = &axle->wheel[s];
        const kl_real by = forces->creep[s].reduction * inv_creep_speed;
        const kl_real g = (KL_R(1) - wheel->radius * axle->phi_y) * wheel->inv_cos;
        damping[s][0] = by * f[s].f22_N * (g * g);
        damping[s][1] = by * (f[s].f11_N * (wheel->arm * wheel->arm) + f[s].f33_Nm2);
        damping[s][2] = by * f[s].f11_N * (wheel->radius * wheel->radius);
    }
    forces->damping[0] = (damping[KL_RIGHT][0] + damping[KL_LEFT][0]) * inv_mass;
    forces->damping[1] = (damping[KL_RIGHT][1] + damping[KL_LEFT][1]) * inv_yaw;
    forces->damping[2] = (damping[KL_RIGHT][2] + damping[KL_LEFT][2]) * inv_spin;
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
        const struct kl_wheel *wheel = &axle->wheel[s];
        const struct kl_creep_force *creep = &forces->creep[s];
        const kl_real sign = s == KL_RIGHT ? KL_R(1) : KL_R(-1);
        const kl_real n = forces->normal[s];
        const struct cell cell = cell_at(pair, &pair->side[s], wheel->place);
        const kl_real third = kl_max_real(n, KL_R(0)) * (kl_inverse_cbrt(kl_max_real(n, KL_R(1))) *
                                                         kl_inverse_cbrt(kl_max_real(n, KL_R(1))));
        struct kl_wheel_output *o = &output->wheel[s];
        o->normal_N = n;
        o->q_N = n * wheel->cos_delta + sign * (creep->t2_N * wheel->sin_delta);
        /* on the rail: the opposite of what acts on the wheel */
        o->y_N = sign * (n * wheel->sin_delta) - creep->t2_N * wheel->cos_delta;
        o->t1_N = creep->t1_N;
        o->t2_N = creep->t2_N;
        o->m3_Nm = creep->m3_Nm;
        o->gamma1 = forces->creepage[s].gamma1;
        o->gamma2 = forces->creepage[s].gamma2;
        o->omega3_1_m = forces->creepage[s].omega3_1_m;
        o->reduction = creep->reduction;
        o->radius_m = wheel->radius;
        o->delta_rad = lerp(cell.a->delta_rail_rad, cell.b->delta_rail_rad, cell.t);
        o->eta_wheel_m = lerp(cell.a->eta_wheel_m, cell.b->eta_wheel_m, cell.t);
        o->eta_rail_m = lerp(cell.a->eta_rail_m, cell.b->eta_rail_m, cell.t);
        o->semi_a_m = third * lerp(cell.a->semi_a_1, cell.b->semi_a_1, cell.t);
        o->semi_b_m = third * lerp(cell.a->semi_b_1, cell.b->semi_b_1, cell.t);
    }
    output->force_y_N = output->wheel[KL_RIGHT].y_N + output->wheel[KL_LEFT].y_N;
}
