/* kl_twist.c - wheels that turn by themselves. */
#include "kl_twist.h"

#include "kl_damp.h"
#include "kl_math.h"

#define MOST_TORQUE_NM 1e6

int kl_twists_limit(const struct kl_model *model, const struct kl_input *restrict input,
                    struct kl_input *restrict kept) {
    int changed = 0;
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        if (model->wheelsets[w].independent != 0) {
            const kl_real given = input->twist_torque_Nm[w];
            const kl_real number = given - given == KL_R(0) ? given : KL_R(0);
            kept->twist_torque_Nm[w] =
                kl_clamp(number, KL_R(-MOST_TORQUE_NM), KL_R(MOST_TORQUE_NM));
            changed |= kept->twist_torque_Nm[w] != given;
        }
    }
    return changed;
}

void kl_twists_carry(const struct kl_model *model, const struct kl_origin *from,
                     struct kl_evaluation *e) {
    const uint32_t first = kl_wheelset_states(model);
    uint32_t t = kl_twist_states(model);
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        struct kl_axle *axle = &e->axle[w];
        if (model->wheelsets[w].independent == 0) {
            continue;
        }
        const kl_real mean = axle->x[KL_WS_SPIN];
        axle->yaw_carried = from->rate[first + KL_WHEELSET_STATES * w + KL_WS_YAW_RATE];
        axle->twist = from->x[t] + from->h * from->rate[t];
        t++;
        KL_EACH_LANE_LOOP(g) {
            KL_LANE(axle->spin, g) = kl_lane_of(mean + axle->twist, mean - axle->twist, g);
        }
    }
}

void kl_twists_move(const struct kl_model *model, const struct kl_input *restrict input,
                    struct kl_evaluation *restrict e) {
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct kl_wheelset *wheelset = &model->wheelsets[w];
        const struct kl_axle_forces *forces = &e->forces[w];
        struct kl_axle *axle = &e->axle[w];
        if (wheelset->independent == 0) {
            continue;
        }
        kl_both creep;
        KL_EACH_LANE_LOOP(g) {
            KL_LANE(creep, g) = KL_LANE(axle->radius, g) * KL_LANE(forces->tread.t1, g) +
                                KL_LANE(axle->flange.radius, g) * KL_LANE(forces->flange.t1, g);
        }
        const kl_real driven = KL_R(2) * input->twist_torque_Nm[w];
        const kl_real held = KL_R(4) * wheelset->coupling_Nms_rad * axle->twist;
        axle->twist_rate =
            ((driven - held) - (creep[KL_RIGHT] - creep[KL_LEFT])) * wheelset->inv_spin_1_kgm2;
    }
}

/* The axis that slips is (cos, sin) in psi' and gear * twist, which have the same inertia. */
struct axes {
    kl_real cos;
    kl_real sin;
    kl_real gear;
    kl_real z[2]; /* slipping, rolling */
};

/* Of the twist, and of yaw and twist together. */
struct twist_damping {
    kl_real gear; /* sqrt(I_y/I_z) */
    kl_real twist;
    kl_real coupled;
};

static struct twist_damping find_damping(const struct kl_wheelset *wheelset,
                                         const struct kl_axle *axle,
                                         const struct kl_axle_forces *forces, kl_real step_s) {
    const kl_real gear = kl_sqrt_real(wheelset->inertia_spin_kgm2 * wheelset->inv_yaw_1_kgm2);
    const kl_real by = forces->inv_creep_speed_s_m;
    kl_both twist;
    kl_both coupled;
    KL_EACH_LANE_LOOP(g) {
        const kl_lane tread =
            KL_LANE(forces->tread.reduction, g) * KL_LANE(forces->tread.f11_N, g) * by;
        const kl_lane flange =
            KL_LANE(forces->flange.reduction, g) * KL_LANE(forces->flange.f11_N, g) * by;
        const kl_lane r = KL_LANE(axle->radius, g);
        const kl_lane flange_r = KL_LANE(axle->flange.radius, g);
        KL_LANE(twist, g) = tread * (r * r) + flange * (flange_r * flange_r);
        KL_LANE(coupled, g) = tread * (KL_LANE(axle->arm, g) * r) +
                              flange * (KL_LANE(axle->flange.arm, g) * flange_r);
    }
    const kl_real between = KL_R(4) * wheelset->coupling_Nms_rad;
    const struct twist_damping z = {gear,
                                    (KL_SUM(twist) + between) * wheelset->inv_spin_1_kgm2 * step_s,
                                    KL_SUM(coupled) * (wheelset->inv_yaw_1_kgm2 / gear) * step_s};
    return z;
}

static struct axes principal_axes(const struct kl_model *model, const struct kl_evaluation *e,
                                  uint32_t w) {
    struct kl_stiffness z;
    const struct kl_wheelset *wheelset = &model->wheelsets[w];
    kl_axle_stiffness(wheelset, &model->pairs[wheelset->pair], &e->axle[w], &e->forces[w],
                      model->step_s, &z);
    const struct twist_damping t =
        find_damping(&model->wheelsets[w], &e->axle[w], &e->forces[w], model->step_s);
    const kl_real mean = KL_R(0.5) * (z.yaw + t.twist);
    const kl_real half = KL_R(0.5) * (z.yaw - t.twist);
    const kl_real apart =
        kl_max_real(kl_sqrt_real(half * half + t.coupled * t.coupled), KL_R(1e-30));
    const kl_real tilt = kl_clamp(half / apart, KL_R(-1), KL_R(1)); /* cos of twice the angle */
    const struct axes axes = {kl_sqrt_real(KL_R(0.5) * (KL_R(1) + tilt)),
                              kl_sqrt_real(KL_R(0.5) * (KL_R(1) - tilt)),
                              t.gear,
                              {mean + apart, kl_max_real(mean - apart, KL_R(0))}};
    return axes;
}

/* Yaw and twist, or how they go on; or along the axes: what slips, what rolls. */
struct turning {
    kl_real yaw;
    kl_real twist;
};

/* (a, b) turned: by lanes, for of sums and differences side by side some compilers fuse the products,
 * whatever they are told. sign: 1 one way, -1 the other. */
static void rotate(const struct axes *axes, kl_real sign, kl_real a, kl_real b, kl_both *turned) {
    KL_EACH_LANE(g) {
        const kl_lane across = kl_lane_of(sign, -sign, g) * axes->sin;
        KL_LANE(*turned, g) = axes->cos * kl_lane_of(a, b, g) + across * kl_lane_of(b, a, g);
    }
}

static struct turning to_axes(const struct axes *axes, kl_real yaw, kl_real twist) {
    kl_both t;
    rotate(axes, KL_R(1), yaw, axes->gear * twist, &t);
    const struct turning turned = {t[0], t[1]};
    return turned;
}

static struct turning from_axes(const struct axes *axes, kl_real slips, kl_real rolls) {
    kl_both t;
    rotate(axes, KL_R(-1), slips, rolls, &t);
    const struct turning turned = {t[0], t[1] / axes->gear};
    return turned;
}

/* Accelerations from forces and the parts carried on, which become those of the next step. */
static struct turning damp(const struct axes *axes, const struct turning *force,
                           struct turning *carried) {
    const struct turning f = to_axes(axes, force->yaw, force->twist);
    const struct turning e = to_axes(axes, carried->yaw, carried->twist);
    struct kl_damped both = {
        .force = {f.yaw, f.twist}, .carried = {e.yaw, e.twist}, .z = {axes->z[0], axes->z[1]}};
    kl_damp(&both);
    *carried = from_axes(axes, both.carried[0], both.carried[1]);
    return from_axes(axes, both.a[0], both.a[1]);
}

static kl_real finished(kl_real moving, kl_real h, kl_real a, kl_real before, kl_real carried) {
    const kl_real p = moving + h * (a - KL_R(0.5) * (before + carried));
    return kl_lane_first(kl_lane_quiet(kl_lane_all(p)));
}

void kl_twists_finish(const struct kl_model *model, const struct kl_evaluation *e,
                      struct kl_state *state) {
    const kl_real h = model->step_s;
    const uint32_t first = kl_wheelset_states(model);
    uint32_t t = kl_twist_states(model);
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct kl_axle *axle = &e->axle[w];
        if (model->wheelsets[w].independent == 0) {
            continue;
        }
        kl_real *x = &state->x[first + KL_WHEELSET_STATES * w];
        kl_real *rate = &state->rate[first + KL_WHEELSET_STATES * w];
        const struct axes axes = principal_axes(model, e, w);
        const struct turning force = {axle->rate[KL_WS_YAW_RATE], axle->twist_rate};
        const struct turning before = {axle->yaw_carried, state->rate[t]};
        struct turning carried = before;
        const struct turning a = damp(&axes, &force, &carried);
        const kl_real moving = axle->x[KL_WS_YAW_RATE];
        x[KL_WS_YAW_RATE] = finished(moving, h, a.yaw, before.yaw, carried.yaw);
        rate[KL_WS_YAW] = axle->rate[KL_WS_YAW] + (x[KL_WS_YAW_RATE] - moving);
        rate[KL_WS_YAW_RATE] = carried.yaw;
        state->x[t] = finished(axle->twist, h, a.twist, before.twist, carried.twist);
        state->rate[t++] = carried.twist;
    }
}

void kl_twists_refresh(const struct kl_model *model, const struct kl_evaluation *e,
                       struct kl_state *state) {
    const uint32_t first = kl_wheelset_states(model);
    uint32_t t = kl_twist_states(model);
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        if (model->wheelsets[w].independent == 0) {
            continue;
        }
        const struct axes axes = principal_axes(model, e, w);
        const struct turning all =
            to_axes(&axes, e->axle[w].rate[KL_WS_YAW_RATE], e->axle[w].twist_rate);
        const struct turning carried =
            from_axes(&axes, all.yaw * kl_lane_first(kl_carried_part(kl_lane_all(axes.z[0]))),
                      all.twist * kl_lane_first(kl_carried_part(kl_lane_all(axes.z[1]))));
        state->rate[first + KL_WHEELSET_STATES * w + KL_WS_YAW_RATE] = carried.yaw;
        state->rate[t++] = carried.twist;
    }
}

void kl_twists_output(const struct kl_model *model, const struct kl_state *state,
                      struct kl_output *output) {
    uint32_t t = kl_twist_states(model);
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        if (model->wheelsets[w].independent != 0) {
            output->wheelset[w].twist_rad_s = state->x[t++];
        }
    }
}
