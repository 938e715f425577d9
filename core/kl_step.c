/* kl_step.c - the right-hand side of a whole vehicle, and the integrator. */
#include "kl_step.h"

#include "kl_axle.h"
#include "kl_math.h"
#include "kl_suspension.h"

/* gamma of ROS2, 1 - 1/sqrt 2 */
#define GAMMA 0.29289321881345254

/* When and how fast a stage stands. */
struct stage {
    kl_real s_m;
    kl_real speed_m_s;
    kl_real speed_rate_m_s2;
};

/* One coordinate of the suspension. */
struct motion {
    kl_real q;
    kl_real rate;
};

/* One body's positions and rates, absent freedoms zero. Rates are the states: y' - z V phi0',
 * absolute roll and yaw. */
struct body_motion {
    kl_real position[KL_FREEDOMS];
    kl_real rate[KL_FREEDOMS];
};

/* Everything of one evaluation that the outputs may want. */
struct evaluation {
    struct kl_track_point reference;
    struct kl_track_point at_body[KL_MAX_BODIES];
    struct body_motion body[KL_MAX_BODIES];
    kl_real body_acceleration[KL_MAX_BODIES][KL_FREEDOMS]; /* specific forces */
    struct kl_axle axle[KL_MAX_WHEELSETS];
    struct kl_axle_forces forces[KL_MAX_WHEELSETS];
    kl_real rate[KL_MAX_STATES];
    uint32_t faults;
};

static uint32_t freedoms_of(const struct kl_body *body) {
    uint32_t n = 0;
    for (uint32_t f = 0; f < KL_FREEDOMS; f++) {
        n += (body->freedoms >> f) & 1u;
    }
    return n;
}

/* Reads one body's states; a freedom that it does not have follows the track. Returns the next
 * body's states. */
static const kl_real *unpack_body(const struct kl_body *body, const kl_real *x,
                                  const struct kl_track_point *here, kl_real v,
                                  struct body_motion *motion) {
    const kl_real along = v * here->cant_s_1_m;
    const kl_real follow[KL_FREEDOMS] = {-(body->z_m * along), KL_R(0), along, KL_R(0),
                                         v * here->curvature_1_m};
    const uint32_t n = freedoms_of(body);
    uint32_t i = 0;
    for (uint32_t f = 0; f < KL_FREEDOMS; f++) {
        const int has = (body->freedoms & KL_HAS(f)) != 0;
        motion->position[f] = has ? x[i] : KL_R(0);
        motion->rate[f] = has ? x[n + i] : follow[f];
        i += has ? 1u : 0u;
    }
    return x + 2u * n;
}

/*
 * Absolute coordinates: relative to the straight frame that stands on the track at the reference
 * point. A point at height z is carried aside by the cant's change, -z (phi0 - phi0_ref).
 */
struct offsets {
    kl_real y;
    kl_real y_rate;
    kl_real roll;
    kl_real yaw;
};

static struct offsets offsets_at(const struct kl_track_point *here,
                                 const struct kl_track_point *reference, kl_real x, kl_real z,
                                 kl_real v) {
    const kl_real turn = here->heading_rad - reference->heading_rad;
    const kl_real roll = here->cant_rad - reference->cant_rad;
    const struct offsets o = {
        ((here->offset_m - reference->offset_m) - x * reference->heading_rad) - z * roll,
        v * (turn - x * reference->curvature_1_m) + z * (v * reference->cant_s_1_m), roll, turn};
    return o;
}

static void place_bodies(const struct kl_model *model, const kl_real *x, const struct stage *stage,
                         struct evaluation *e, struct motion *q) {
    const kl_real v = stage->speed_m_s;
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        const struct kl_body *body = &model->bodies[b];
        struct kl_track_point *here = &e->at_body[b];
        struct body_motion *m = &e->body[b];
        kl_track_layout_at(&model->track, stage->s_m + body->x_m, here);
        x = unpack_body(body, x, here, v, m);
        const struct offsets o = offsets_at(here, &e->reference, body->x_m, body->z_m, v);
        struct motion *qb = &q[kl_body_coordinate(b)];
        for (uint32_t f = 0; f < KL_FREEDOMS; f++) {
            qb[f].q = m->position[f];
            qb[f].rate = m->rate[f];
        }
        qb[KL_Y].q += o.y;
        qb[KL_ROLL].q += o.roll;
        qb[KL_YAW].q += o.yaw;
        qb[KL_Y].rate += o.y_rate;
        qb[KL_ROLL].rate -= v * e->reference.cant_s_1_m;
        qb[KL_YAW].rate -= v * e->reference.curvature_1_m;
    }
}

static void place_wheelsets(const struct kl_model *model, const kl_real *x,
                            const struct stage *stage, struct evaluation *e, struct motion *q) {
    const kl_real v = stage->speed_m_s;
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct kl_wheelset *wheelset = &model->wheelsets[w];
        const struct kl_pair *pair = &model->pairs[wheelset->pair];
        struct kl_axle *axle = &e->axle[w];
        kl_track_at(&model->track, stage->s_m + wheelset->x_m, &axle->track);
        kl_axle_posture(pair, x, v, stage->speed_rate_m_s2, axle);
        x += KL_WHEELSET_STATES;
        e->faults |= axle->faults;
        const struct offsets o =
            offsets_at(&axle->track, &e->reference, wheelset->x_m, -pair->radius_m, v);
        struct motion *qw = &q[kl_wheelset_coordinate(model->n_bodies, w)];
        qw[0].q = axle->y + o.y;
        qw[1].q = axle->z;
        qw[2].q = axle->roll + o.roll;
        qw[3].q = axle->yaw + o.yaw;
        qw[0].rate = axle->y_abs_rate + o.y_rate;
        qw[1].rate = axle->z_rate;
        qw[2].rate = axle->roll_rate + v * (axle->track.cant_s_1_m - e->reference.cant_s_1_m);
        qw[3].rate = axle->yaw_abs_rate - v * e->reference.curvature_1_m;
    }
}

static void suspension_forces(const struct kl_suspension *restrict suspension,
                              const struct motion *restrict q, kl_real *restrict force) {
    const struct kl_spring *spring = suspension->spring;
    const uint16_t *column = suspension->column;
    uint32_t at = 0;
    for (uint32_t i = 0; i < suspension->n_coordinates; i++) {
        kl_real elastic = KL_R(0);
        kl_real viscous = KL_R(0);
        for (const uint32_t end = suspension->row_start[i + 1u]; at < end; at++) {
            const struct motion *m = &q[column[at]];
            elastic += spring[at].k * m->q;
            viscous += spring[at].c * m->rate;
        }
        force[i] = -(elastic + viscous);
    }
}

static void move_bodies(const struct kl_model *model, const struct stage *stage,
                        const struct kl_input *input, const kl_real *force, struct evaluation *e) {
    const kl_real v = stage->speed_m_s;
    kl_real *rate = e->rate;
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        const struct kl_body *body = &model->bodies[b];
        const struct kl_track_point *here = &e->at_body[b];
        const kl_real *moving = e->body[b].rate;
        const kl_real *acting = &force[kl_body_coordinate(b)];
        kl_real *a = e->body_acceleration[b];
        a[KL_Y] = (acting[KL_Y] + input->side_force_N[b]) / body->mass_kg;
        a[KL_Z] = acting[KL_Z] / body->mass_kg;
        a[KL_ROLL] = acting[KL_ROLL] / body->inertia_kgm2[0];
        a[KL_PITCH] = acting[KL_PITCH] / body->inertia_kgm2[1];
        a[KL_YAW] = acting[KL_YAW] / body->inertia_kgm2[2];
        const kl_real along = v * here->cant_s_1_m;
        const kl_real aside = here->curvature_1_m * (v * v) - model->gravity_m_s2 * here->cant_rad;
        const kl_real velocity[KL_FREEDOMS] = {moving[KL_Y] + body->z_m * along, moving[KL_Z],
                                               moving[KL_ROLL] - along, moving[KL_PITCH],
                                               moving[KL_YAW] - v * here->curvature_1_m};
        const kl_real acceleration[KL_FREEDOMS] = {a[KL_Y] - aside, a[KL_Z], a[KL_ROLL],
                                                   a[KL_PITCH], a[KL_YAW]};
        const uint32_t n = freedoms_of(body);
        uint32_t i = 0;
        for (uint32_t f = 0; f < KL_FREEDOMS; f++) {
            if (body->freedoms & KL_HAS(f)) {
                rate[i] = velocity[f];
                rate[n + i] = acceleration[f];
                i++;
            }
        }
        rate += 2u * n;
    }
}

static void move_wheelsets(const struct kl_model *model, const struct stage *stage,
                           const struct kl_input *input, const kl_real *force,
                           struct evaluation *e) {
    kl_real *rate = e->rate + (model->n_states - KL_WHEELSET_STATES * model->n_wheelsets);
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct kl_wheelset *wheelset = &model->wheelsets[w];
        const struct kl_axle *axle = &e->axle[w];
        struct kl_axle_forces *f = &e->forces[w];
        const kl_real *acting = &force[kl_wheelset_coordinate(model->n_bodies, w)];
        for (int k = 0; k < 4; k++) {
            f->suspension[k] = acting[k] + wheelset->preload[k];
        }
        f->torque_Nm = input->axle_torque_Nm[w];
        f->speed_m_s = stage->speed_m_s;
        f->gravity_m_s2 = model->gravity_m_s2;
        KL_EACH_LANE(g) {
            KL_LANE(f->friction, g) =
                wheelset->creep.friction * kl_lane_of(input->friction_factor[w][KL_RIGHT],
                                                      input->friction_factor[w][KL_LEFT], g);
        }
        kl_axle_forces(wheelset, axle, f);
        rate[KL_WS_Y] = axle->y_rate;
        rate[KL_WS_YAW] = axle->yaw_abs_rate - stage->speed_m_s * axle->track.curvature_1_m;
        rate[KL_WS_Y_RATE] = f->y_acc;
        rate[KL_WS_YAW_RATE] = f->yaw_acc;
        rate[KL_WS_SPIN] = f->spin_acc;
        for (int s = 0; s < KL_SIDES; s++) {
            e->faults |= f->normal[s] > KL_R(0) ? 0u : (uint32_t)KL_FAULT_WHEEL_LIFT;
        }
        rate += KL_WHEELSET_STATES;
    }
}

static void evaluate(const struct kl_model *model, const kl_real *x, const struct stage *stage,
                     const struct kl_input *input, struct evaluation *e) {
    struct motion q[KL_MAX_COORDINATES];
    kl_real force[KL_MAX_COORDINATES];
    const kl_real *x_wheelsets = x + (model->n_states - KL_WHEELSET_STATES * model->n_wheelsets);
    e->faults = 0;
    kl_track_layout_at(&model->track, stage->s_m, &e->reference);
    place_bodies(model, x, stage, e, q);
    place_wheelsets(model, x_wheelsets, stage, e, q);
    suspension_forces(&model->suspension, q, force);
    move_bodies(model, stage, input, force, e);
    move_wheelsets(model, stage, input, force, e);
}

/* ---- outputs ---- */

static void write_output(const struct kl_model *model, const struct kl_state *state,
                         const struct stage *stage, const struct evaluation *e,
                         struct kl_output *output) {
    const kl_real *x = state->x;
    const kl_real v = stage->speed_m_s;
    output->tick = state->tick;
    output->time_ns = (int64_t)state->tick * model->step_ns;
    output->faults = state->faults;
    output->s_m = state->s_m;
    output->speed_m_s = state->speed_m_s;
    output->acceleration_m_s2 = stage->speed_rate_m_s2;
    output->track = e->reference;
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        const struct kl_body *body = &model->bodies[b];
        const struct kl_track_point *here = &e->at_body[b];
        struct kl_body_output *o = &output->body[b];
        struct body_motion motion;
        x = unpack_body(body, x, here, v, &motion);
        for (uint32_t f = 0; f < KL_FREEDOMS; f++) {
            const int has = (body->freedoms & KL_HAS(f)) != 0;
            o->position[f] = motion.position[f];
            o->rate[f] = motion.rate[f];
            o->acceleration[f] = has ? e->body_acceleration[b][f] : KL_R(0);
        }
        /* relative to the track */
        const kl_real along = v * here->cant_s_1_m;
        o->rate[KL_Y] += body->z_m * along;
        o->rate[KL_ROLL] -= along;
        o->rate[KL_YAW] -= v * here->curvature_1_m;
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct kl_axle *axle = &e->axle[w];
        struct kl_wheelset_output *o = &output->wheelset[w];
        const struct kl_pair *pair = &model->pairs[model->wheelsets[w].pair];
        kl_axle_output(axle, &e->forces[w], o);
        o->y_m = x[KL_WS_Y];
        o->yaw_rad = x[KL_WS_YAW];
        o->spin_rad_s = x[KL_WS_SPIN];
        o->y_rate_m_s = x[KL_WS_Y_RATE] - pair->radius_m * (v * axle->track.cant_s_1_m);
        o->yaw_rate_rad_s = x[KL_WS_YAW_RATE] - v * axle->track.curvature_1_m;
        x += KL_WHEELSET_STATES;
    }
}

/* ---- inputs ---- */

static kl_real limited(kl_real value, kl_real low, kl_real high, kl_real otherwise,
                       uint32_t *faults) {
    const kl_real kept = kl_min_real(kl_max_real(value, low), high);
    const int sound = kl_finite_real(value);
    *faults |= sound && kept == value ? 0u : (uint32_t)KL_FAULT_INPUT;
    return sound ? kept : otherwise;
}

/* What is not a number counts as not given; what is too large is cut; both are said. */
static uint32_t check_input(const struct kl_model *model, const struct kl_state *state,
                            const struct kl_input *input, struct kl_input *kept) {
    uint32_t faults = 0;
    kept->speed_m_s =
        limited(input->speed_m_s, KL_R(0), KL_R(KL_MAX_SPEED_M_S), state->speed_m_s, &faults);
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        kept->axle_torque_Nm[w] =
            limited(input->axle_torque_Nm[w], KL_R(-1e6), KL_R(1e6), KL_R(0), &faults);
        for (int s = 0; s < KL_SIDES; s++) {
            kept->friction_factor[w][s] =
                limited(input->friction_factor[w][s], KL_R(0), KL_R(2), KL_R(1), &faults);
        }
    }
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        kept->side_force_N[b] =
            limited(input->side_force_N[b], KL_R(-1e7), KL_R(1e7), KL_R(0), &faults);
    }
    return faults;
}

void kl_input_init(struct kl_input *input) {
    const struct kl_input blank = {0};
    *input = blank;
    for (uint32_t w = 0; w < KL_MAX_WHEELSETS; w++) {
        for (int s = 0; s < KL_SIDES; s++) {
            input->friction_factor[w][s] = KL_R(1);
        }
    }
}

/* ---- life ---- */

enum kl_status kl_init(const struct kl_model *model, struct kl_state *state, kl_real s_m,
                       kl_real speed_m_s) {
    if (model == NULL || state == NULL || model->version != KL_MODEL_VERSION ||
        model->n_bodies > KL_MAX_BODIES || model->n_wheelsets > KL_MAX_WHEELSETS ||
        !(speed_m_s >= KL_R(0) && speed_m_s <= KL_R(KL_MAX_SPEED_M_S)) || !kl_finite_real(s_m)) {
        return KL_ERR_ARGUMENT;
    }
    const struct kl_state blank = {0};
    *state = blank;
    state->n_states = model->n_states;
    state->s_m = s_m;
    state->speed_m_s = speed_m_s;
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        const struct kl_body *body = &model->bodies[b];
        struct kl_track_point here;
        kl_track_layout_at(&model->track, s_m + body->x_m, &here);
        const kl_real along = speed_m_s * here.cant_s_1_m;
        const kl_real rates[KL_FREEDOMS] = {-(body->z_m * along), KL_R(0), along, KL_R(0),
                                            speed_m_s * here.curvature_1_m};
        for (uint32_t f = 0; f < KL_FREEDOMS; f++) {
            const int32_t i = kl_body_state_index(model, b, (enum kl_freedom)f, 1);
            if (i >= 0) {
                state->x[i] = rates[f];
            }
        }
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct kl_wheelset *wheelset = &model->wheelsets[w];
        const struct kl_pair *pair = &model->pairs[wheelset->pair];
        struct kl_track_point here;
        kl_track_layout_at(&model->track, s_m + wheelset->x_m, &here);
        kl_real *x = &state->x[kl_wheelset_state_index(model, w, KL_WS_Y)];
        x[KL_WS_Y_RATE] = pair->radius_m * (speed_m_s * here.cant_s_1_m);
        x[KL_WS_YAW_RATE] = speed_m_s * here.curvature_1_m;
        x[KL_WS_SPIN] = speed_m_s / pair->radius_m;
    }
    return KL_OK;
}

int32_t kl_body_state_index(const struct kl_model *model, uint32_t body, enum kl_freedom freedom,
                            int rate) {
    if (body >= model->n_bodies || (model->bodies[body].freedoms & KL_HAS(freedom)) == 0) {
        return -1;
    }
    uint32_t i = 0;
    for (uint32_t b = 0; b < body; b++) {
        i += 2u * freedoms_of(&model->bodies[b]);
    }
    for (uint32_t f = 0; f < (uint32_t)freedom; f++) {
        i += (model->bodies[body].freedoms >> f) & 1u;
    }
    return (int32_t)(i + (rate ? freedoms_of(&model->bodies[body]) : 0u));
}

int32_t kl_wheelset_state_index(const struct kl_model *model, uint32_t wheelset,
                                enum kl_wheelset_state which) {
    if (wheelset >= model->n_wheelsets) {
        return -1;
    }
    return (int32_t)(model->n_states - KL_WHEELSET_STATES * (model->n_wheelsets - wheelset) +
                     (uint32_t)which);
}

void kl_rates(const struct kl_model *model, const struct kl_state *state,
              const struct kl_input *input, kl_real rates[KL_MAX_STATES],
              struct kl_output *output) {
    struct evaluation e;
    struct kl_input kept;
    (void)check_input(model, state, input, &kept);
    const struct stage stage = {state->s_m, state->speed_m_s, KL_R(0)};
    evaluate(model, state->x, &stage, &kept, &e);
    for (uint32_t i = 0; i < model->n_states; i++) {
        rates[i] = e.rate[i];
    }
    if (output != NULL) {
        write_output(model, state, &stage, &e, output);
    }
}

/* 1/(1 + gamma h damping) of each wheelset's three rates: the implicit part of a stage. */
static void implicit_scale(const struct kl_model *model, const struct evaluation *e,
                           kl_real scale[3 * KL_MAX_WHEELSETS]) {
    const kl_real by = KL_R(GAMMA) * model->step_s;
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        kl_real damping[3];
        kl_axle_damping(&model->wheelsets[w], &e->axle[w], &e->forces[w], damping);
        for (uint32_t k = 0; k < 3u; k++) {
            scale[3u * w + k] = KL_R(1) / (KL_R(1) + by * damping[k]);
        }
    }
}

static void apply_scale(const struct kl_model *model, const kl_real *scale, kl_real *rate) {
    kl_real *of_wheelset = rate + (model->n_states - KL_WHEELSET_STATES * model->n_wheelsets);
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        for (uint32_t k = 0; k < 3u; k++) {
            of_wheelset[KL_WHEELSET_STATES * w + KL_WS_Y_RATE + k] *= scale[3u * w + k];
        }
    }
}

/* Takes the new state over, or holds the old one; latches faults. Returns 1 where held. */
static int settle(struct kl_state *state, const kl_real *x, const struct stage *end,
                  uint32_t faults) {
    state->tick++;
    if (state->faults == 0 && faults != 0) {
        state->fault_tick = state->tick;
    }
    state->faults |= faults;
    const int hold = (state->faults & KL_FAULTS_HOLD) != 0;
    for (uint32_t i = 0; i < state->n_states; i++) {
        state->x[i] = hold ? state->x[i] : x[i];
    }
    state->s_m = hold ? state->s_m : end->s_m;
    state->speed_m_s = hold ? state->speed_m_s : end->speed_m_s;
    return hold;
}

uint32_t kl_step(const struct kl_model *model, struct kl_state *state, const struct kl_input *input,
                 struct kl_output *output) {
    struct evaluation e;
    struct kl_input kept;
    kl_real k1[KL_MAX_STATES];
    kl_real x2[KL_MAX_STATES];
    kl_real scale[3 * KL_MAX_WHEELSETS];
    const uint32_t n = model->n_states;
    const kl_real h = model->step_s;
    uint32_t faults = check_input(model, state, input, &kept);
    const kl_real most = model->acceleration_limit_m_s2 * h;
    const kl_real change = kl_min_real(kl_max_real(kept.speed_m_s - state->speed_m_s, -most), most);
    const kl_real v2 = state->speed_m_s + change;
    const kl_real v_rate = change / h;
    const struct stage begin = {state->s_m, state->speed_m_s, v_rate};
    const struct stage end = {state->s_m + h * (KL_R(0.5) * (state->speed_m_s + v2)), v2, v_rate};

    evaluate(model, state->x, &begin, &kept, &e);
    faults |= e.faults;
    implicit_scale(model, &e, scale);
    apply_scale(model, scale, e.rate);
    for (uint32_t i = 0; i < n; i++) {
        k1[i] = e.rate[i];
        x2[i] = state->x[i] + h * k1[i];
    }
    evaluate(model, x2, &end, &kept, &e);
    faults |= e.faults;
    for (uint32_t i = 0; i < n; i++) {
        e.rate[i] -= KL_R(2) * k1[i];
    }
    apply_scale(model, scale, e.rate);
    kl_real sound = end.s_m - end.s_m;
    for (uint32_t i = 0; i < n; i++) {
        x2[i] = state->x[i] + h * (KL_R(1.5) * k1[i] + KL_R(0.5) * e.rate[i]);
        sound += x2[i] - x2[i]; /* 0, or NaN for ever */
    }
    faults |= sound == KL_R(0) ? 0u : (uint32_t)KL_FAULT_NONFINITE;

    const int hold = settle(state, x2, &end, faults);
    if (output != NULL && !hold) {
        write_output(model, state, &end, &e, output);
    } else if (output != NULL) { /* the last good output stays; time and faults go on */
        output->tick = state->tick;
        output->time_ns = (int64_t)state->tick * model->step_ns;
        output->faults = state->faults;
    }
    return state->faults;
}

void kl_clear_faults(struct kl_state *state) {
    state->faults = 0;
    state->fault_tick = 0;
}

kl_real kl_energy(const struct kl_model *model, const struct kl_state *state) {
    struct evaluation e;
    struct motion q[KL_MAX_COORDINATES];
    kl_real force[KL_MAX_COORDINATES];
    const struct stage stage = {state->s_m, state->speed_m_s, KL_R(0)};
    const kl_real *x = state->x;
    e.faults = 0;
    kl_track_layout_at(&model->track, stage.s_m, &e.reference);
    place_bodies(model, x, &stage, &e, q);
    place_wheelsets(model, x + (model->n_states - KL_WHEELSET_STATES * model->n_wheelsets), &stage,
                    &e, q);
    for (uint32_t i = 0; i < model->suspension.n_coordinates; i++) {
        q[i].rate = KL_R(0);
    }
    suspension_forces(&model->suspension, q, force);
    kl_real twice = KL_R(0);
    for (uint32_t i = 0; i < model->suspension.n_coordinates; i++) {
        twice -= q[i].q * force[i];
    }
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        const struct kl_body *body = &model->bodies[b];
        for (uint32_t f = 0; f < KL_FREEDOMS; f++) {
            const kl_real rate = e.body[b].rate[f];
            const kl_real inertia =
                f < (uint32_t)KL_ROLL ? body->mass_kg : body->inertia_kgm2[f - KL_ROLL];
            twice += inertia * (rate * rate);
        }
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct kl_wheelset *ws = &model->wheelsets[w];
        const struct kl_axle *axle = &e.axle[w];
        const kl_real p = axle->y_abs_rate;
        const kl_real yaw = axle->yaw_abs_rate;
        const kl_real spin = axle->spin;
        twice += ws->mass_kg * (p * p + axle->z_rate * axle->z_rate) +
                 ws->inertia_roll_kgm2 * (axle->roll_rate * axle->roll_rate) +
                 ws->inertia_yaw_kgm2 * (yaw * yaw) + ws->inertia_spin_kgm2 * (spin * spin);
        const kl_real down = ws->preload[1] + ws->mass_kg * model->gravity_m_s2;
        twice -= KL_R(2) * ((down * axle->z + ws->preload[2] * axle->roll) +
                            (ws->preload[0] * axle->y + ws->preload[3] * axle->yaw));
    }
    return KL_R(0.5) * twice;
}
