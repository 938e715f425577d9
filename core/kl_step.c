/* kl_step.c - the life of a state, and the integrator. */
#include "kl_step.h"

#include "kl_damp.h"
#include "kl_math.h"
#include "kl_rates.h"
#include "kl_train.h"
#include "kl_twist.h"

/* ---- inputs ---- */

/* What is not a number counts as not given; what is too large is cut; `wrong` grows by what was
 * changed. */
static kl_lane limited(kl_lane value, kl_real limit_low, kl_real limit_high, kl_real otherwise,
                       kl_lane *wrong) {
    const kl_lane low = kl_lane_all(limit_low);
    const kl_lane kept = kl_lane_at_most(kl_lane_at_least(value, low), kl_lane_all(limit_high));
    const kl_lane off = kept - value;
    *wrong += off * off;
    return kl_lane_if_0(value - value, kept, kl_lane_all(otherwise));
}

static uint32_t check_input(const struct kl_model *model, const struct kl_state *state,
                            const struct kl_input *restrict input, struct kl_input *restrict kept) {
    kl_lane wrong = kl_lane_all(KL_R(0));
    kept->speed_m_s = kl_lane_first(limited(kl_lane_all(input->speed_m_s), KL_R(0),
                                            KL_R(KL_MAX_SPEED_M_S), state->speed_m_s, &wrong));
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        kept->axle_torque_Nm[w] = kl_lane_first(
            limited(kl_lane_all(input->axle_torque_Nm[w]), KL_R(-1e6), KL_R(1e6), KL_R(0), &wrong));
        KL_EACH_LANE_LOOP(g) {
            const kl_lane factor = kl_lane_load(input->friction_factor[w], g);
            kl_lane_store(kept->friction_factor[w], g,
                          limited(factor, KL_R(0), KL_R(2), KL_R(1), &wrong));
            const kl_lane slope = kl_lane_load(input->slope_factor[w], g);
            kl_lane_store(kept->slope_factor[w], g,
                          limited(slope, KL_R(0.01), KL_R(1), KL_R(1), &wrong));
            if (model->wheelsets[w].creep.falls != 0) {
                const kl_lane falling = kl_lane_load(input->falling_factor[w], g);
                kl_lane_store(kept->falling_factor[w], g,
                              limited(falling, KL_R(0), KL_R(1), KL_R(1), &wrong));
                const kl_lane decay = kl_lane_load(input->falling_decay_s_m[w], g);
                kl_lane_store(kept->falling_decay_s_m[w], g,
                              limited(decay, KL_R(0), KL_R(100), KL_R(0), &wrong));
            }
        }
    }
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        kept->side_force_N[b] = kl_lane_first(
            limited(kl_lane_all(input->side_force_N[b]), KL_R(-1e7), KL_R(1e7), KL_R(0), &wrong));
    }
    int cut = kl_struts_limit(&model->struts, input, kept);
    if (model->n_twists != 0) {
        cut |= kl_twists_limit(model, input, kept);
    }
    if (model->running.free != 0) {
        cut |= kl_train_limit(input, kept);
    }
    return kl_lane_is_0(wrong) && !cut ? 0u : (uint32_t)KL_FAULT_INPUT;
}

void kl_input_init(struct kl_input *input) {
    const struct kl_input blank = {0};
    *input = blank;
    for (uint32_t w = 0; w < KL_MAX_WHEELSETS; w++) {
        for (int s = 0; s < KL_SIDES; s++) {
            input->friction_factor[w][s] = KL_R(1);
            input->slope_factor[w][s] = KL_R(1);
            input->falling_factor[w][s] = KL_R(1);
        }
    }
}

/* ---- life ---- */

/* Rails that the treads press as they stand, and that stand still. */
#define REST_ROUNDS 6
static void rest_rails(const struct kl_model *model, struct kl_state *state, struct kl_work *work) {
    kl_refresh(model, state, work);
    for (int round = 0; round < REST_ROUNDS && model->n_rails != 0; round++) {
        for (uint32_t w = 0; w < model->n_wheelsets; w++) {
            const int32_t right = kl_rail_state_index(model, w, KL_RIGHT);
            const struct kl_pair *pair = &model->pairs[model->wheelsets[w].pair];
            for (int s = 0; s < KL_SIDES && right >= 0; s++) {
                const struct kl_lift *lift = &state->lift[w];
                const kl_real press = lift->press_N[s] - lift->resist_Ns_m[s] * lift->slip_m_s[s];
                state->x[right + s] = press / pair->flange_stiffness_N_m;
            }
        }
        kl_refresh(model, state, work);
    }
}

enum kl_status kl_init(const struct kl_model *model, struct kl_state *state, kl_real s_m,
                       kl_real speed_m_s, struct kl_work *work) {
    if (model == NULL || state == NULL || work == NULL || model->version != KL_MODEL_VERSION ||
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
        struct kl_track_layout here;
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
        struct kl_track_layout here;
        kl_track_layout_at(&model->track, s_m + wheelset->x_m, &here);
        kl_real *x = &state->x[kl_wheelset_state_index(model, w, KL_WS_Y)];
        x[KL_WS_Y_RATE] = pair->radius_m * (speed_m_s * here.cant_s_1_m);
        x[KL_WS_YAW_RATE] = speed_m_s * here.curvature_1_m;
        x[KL_WS_SPIN] = speed_m_s / pair->radius_m;
        state->lift[w].expected_N[KL_RIGHT] = KL_R(0.5) * wheelset->static_load_N;
        state->lift[w].expected_N[KL_LEFT] = KL_R(0.5) * wheelset->static_load_N;
    }
    rest_rails(model, state, work);
    return KL_OK;
}

int32_t kl_body_state_index(const struct kl_model *model, uint32_t body, enum kl_freedom freedom,
                            int rate) {
    if (body >= model->n_bodies || (model->bodies[body].freedoms & KL_HAS(freedom)) == 0) {
        return -1;
    }
    uint32_t i = 0;
    for (uint32_t b = 0; b < body; b++) {
        i += kl_freedoms_of(&model->bodies[b]);
    }
    for (uint32_t f = 0; f < (uint32_t)freedom; f++) {
        i += (model->bodies[body].freedoms >> f) & 1u;
    }
    return (int32_t)(2u * i + (rate ? 1u : 0u));
}

int32_t kl_wheelset_state_index(const struct kl_model *model, uint32_t wheelset,
                                enum kl_wheelset_state which) {
    if (wheelset >= model->n_wheelsets) {
        return -1;
    }
    if (which == KL_WS_TWIST) {
        uint32_t twist = kl_twist_states(model);
        for (uint32_t w = 0; w < wheelset; w++) {
            twist += model->wheelsets[w].independent;
        }
        return model->wheelsets[wheelset].independent != 0 ? (int32_t)twist : -1;
    }
    return (int32_t)(kl_wheelset_states(model) + KL_WHEELSET_STATES * wheelset + (uint32_t)which);
}

int32_t kl_rail_state_index(const struct kl_model *model, uint32_t wheelset, enum kl_side side) {
    if (wheelset >= model->n_wheelsets ||
        !(model->pairs[model->wheelsets[wheelset].pair].gives > KL_R(0))) {
        return -1;
    }
    uint32_t i = kl_rail_states(model);
    for (uint32_t w = 0; w < wheelset; w++) {
        i += model->pairs[model->wheelsets[w].pair].gives > KL_R(0) ? KL_SIDES : 0u;
    }
    return (int32_t)(i + (uint32_t)side);
}

/* ---- one evaluation ---- */

/* The rates of an evaluation where the state stands. */
static void write_rates(const struct kl_model *model, const struct kl_evaluation *e,
                        kl_real *rates) {
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        for (uint32_t f = 0; f < KL_FREEDOMS; f++) {
            if (model->bodies[b].freedoms & KL_HAS(f)) {
                *rates++ = e->body[b].rate[2u * f];
                *rates++ = e->body[b].rate[2u * f + 1u];
            }
        }
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        for (int i = 0; i < KL_WHEELSET_STATES; i++) {
            *rates++ = e->axle[w].rate[i];
        }
    }
    kl_slips_rates(&model->struts, &e->slipped, rates);
    rates += model->struts.n_slips;
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        if (model->pairs[model->wheelsets[w].pair].gives > KL_R(0)) {
            *rates++ = e->axle[w].rail.rate[KL_RIGHT];
            *rates++ = e->axle[w].rail.rate[KL_LEFT];
        }
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        if (model->wheelsets[w].independent != 0) {
            *rates++ = e->axle[w].twist_rate;
        }
    }
}

/*
 * Evaluates a state as it stands. A step takes creep at normal forces that it expects from the steps
 * before; for a state that comes from elsewhere they are found in rounds, each of which leaves a
 * fifth of the error or less.
 */
#define ROUNDS 16
static void evaluate_still(const struct kl_model *model, const struct kl_state *state,
                           const struct kl_input *input, struct kl_lift *lift,
                           struct kl_evaluation *e) {
    const struct kl_stage stage = {state->s_m, state->speed_m_s, KL_R(0)};
    const struct kl_origin here = {state->x, state->rate, lift, KL_R(0)};
    for (int round = 0; round < ROUNDS; round++) {
        kl_evaluate(model, &here, &stage, input, e);
        for (uint32_t w = 0; w < model->n_wheelsets; w++) {
            const struct kl_wheelset *wheelset = &model->wheelsets[w];
            kl_axle_keep(&model->pairs[wheelset->pair], wheelset, &e->axle[w], &e->forces[w],
                         KL_R(0), &lift[w]);
        }
    }
}

/* The same for a state that is not to be changed, under any input. */
static void look_at(const struct kl_model *model, const struct kl_state *state,
                    const struct kl_input *input, struct kl_evaluation *e) {
    (void)check_input(model, state, input, &e->kept);
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        e->lift[w] = state->lift[w];
    }
    evaluate_still(model, state, &e->kept, e->lift, e);
}

void kl_rates(const struct kl_model *model, const struct kl_state *state,
              const struct kl_input *input, kl_real rates[KL_MAX_STATES], struct kl_work *work) {
    struct kl_evaluation *e = kl_evaluation_in(work);
    look_at(model, state, input, e);
    write_rates(model, e, rates);
}

void kl_observe(const struct kl_model *model, const struct kl_state *state,
                const struct kl_input *input, struct kl_output *output, struct kl_work *work) {
    struct kl_evaluation *e = kl_evaluation_in(work);
    struct kl_stage stage = {state->s_m, state->speed_m_s, KL_R(0)};
    look_at(model, state, input, e);
    if (model->running.free != 0) {
        stage.speed_rate_m_s2 = kl_train_acceleration(model, e);
    }
    kl_write_output(model, state, &stage, e, output);
}

/* A velocity at the end of the step, and its coordinate's rate there. */
static inline void finish(kl_real *x, kl_real *rate, const kl_real *next, const kl_real *next_rate,
                          kl_real h, kl_real a, kl_real carried) {
    const kl_real p = x[1] + h * (a + KL_R(0.5) * (rate[1] - carried));
    const kl_real change = next_rate[0] + (p - next[1]);
    KL_EACH_LANE(g) {
        kl_lane_store(x, g, kl_lane_quiet(kl_lane_of(next[0], p, g)));
        kl_lane_store(rate, g, kl_lane_of(change, carried, g));
    }
}

static void finish_wheelset(const struct kl_model *model, const struct kl_evaluation *e, uint32_t w,
                            kl_real *x, kl_real *rate) {
    const struct kl_axle *axle = &e->axle[w];
    const kl_real h = model->step_s;
    const kl_real *force = axle->rate;
    struct kl_stiffness z;
    const struct kl_wheelset *wheelset = &model->wheelsets[w];
    kl_axle_stiffness(wheelset, &model->pairs[wheelset->pair], axle, &e->forces[w], h, &z);
    struct kl_damped moved = {.force = {force[KL_WS_Y_RATE], force[KL_WS_YAW_RATE]},
                              .carried = {rate[KL_WS_Y_RATE], rate[KL_WS_YAW_RATE]},
                              .z = {z.y, z.yaw}};
    struct kl_damped turned = {.force = {force[KL_WS_SPIN], KL_R(0)},
                               .carried = {rate[KL_WS_SPIN], KL_R(0)},
                               .z = {z.spin, KL_R(0)}};
    kl_damp(&moved);
    kl_damp(&turned);
    finish(&x[KL_WS_Y], &rate[KL_WS_Y], &axle->x[KL_WS_Y], &axle->rate[KL_WS_Y], h, moved.a[0],
           moved.carried[0]);
    finish(&x[KL_WS_YAW], &rate[KL_WS_YAW], &axle->x[KL_WS_YAW], &axle->rate[KL_WS_YAW], h,
           moved.a[1], moved.carried[1]);
    x[KL_WS_SPIN] +=
        h * ((turned.a[0] + axle->spin_drift) + KL_R(0.5) * (rate[KL_WS_SPIN] - turned.carried[0]));
    rate[KL_WS_SPIN] = turned.carried[0];
}

static void finish_step(const struct kl_model *model, const struct kl_evaluation *e,
                        struct kl_state *state) {
    const kl_real h = model->step_s;
    kl_real *x = state->x;
    kl_real *rate = state->rate;
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct kl_wheelset *wheelset = &model->wheelsets[w];
        kl_axle_keep(&model->pairs[wheelset->pair], wheelset, &e->axle[w], &e->forces[w], h,
                     &state->lift[w]);
    }
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        const struct kl_body_motion *m = &e->body[b];
        const uint32_t freedoms = model->bodies[b].freedoms;
        if (freedoms == KL_ALL_FREEDOMS) {
            KL_UNROLL_5 for (uint32_t i = 0; i < 2u * KL_FREEDOMS; i += 2u) {
                finish(&x[i], &rate[i], &m->x[i], &m->rate[i], h, m->rate[i + 1u], m->rate[i + 1u]);
            }
            x += 2u * KL_FREEDOMS;
            rate += 2u * KL_FREEDOMS;
            continue;
        }
        for (uint32_t i = 0; i < 2u * KL_FREEDOMS; i += 2u) {
            if ((freedoms & KL_HAS(i / 2u)) != 0) {
                finish(x, rate, &m->x[i], &m->rate[i], h, m->rate[i + 1u], m->rate[i + 1u]);
                x += 2;
                rate += 2;
            }
        }
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        finish_wheelset(model, e, w, x, rate);
        x += KL_WHEELSET_STATES;
        rate += KL_WHEELSET_STATES;
    }
    kl_slips_finish(&model->struts, &e->slipped, x, rate);
    x += model->struts.n_slips;
    rate += model->struts.n_slips;
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        if (model->pairs[model->wheelsets[w].pair].gives > KL_R(0)) {
            const struct kl_rail *rail = &e->axle[w].rail;
            KL_EACH_LANE(g) {
                kl_lane_store(x, g, kl_lane_quiet(KL_LANE(rail->q, g)));
                kl_lane_store(rate, g, KL_LANE(rail->followed, g));
            }
            x += KL_SIDES;
            rate += KL_SIDES;
        }
    }
    if (model->n_twists != 0) {
        kl_twists_finish(model, e, state);
    }
}

/* 1 where all accelerations are finite, and so far below the largest real that the new state will
 * be; a place or a velocity that is not finite makes some acceleration so. */
static int is_sound(const struct kl_model *model, const struct kl_evaluation *e) {
    kl_lane rising = kl_lane_all(KL_R(0));
    kl_real sum = KL_R(0);
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        const kl_real *rate = e->body[b].rate;
        KL_UNROLL_5 for (uint32_t f = 0; f < KL_FREEDOMS; f++) {
            sum += rate[2u * f + 1u] * rate[2u * f + 1u];
        }
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const kl_real *rate = e->axle[w].rate;
        sum += (rate[KL_WS_Y_RATE] * rate[KL_WS_Y_RATE] +
                rate[KL_WS_YAW_RATE] * rate[KL_WS_YAW_RATE]) +
               rate[KL_WS_SPIN] * rate[KL_WS_SPIN];
        KL_EACH_LANE(g) {
            const kl_lane up = KL_LANE(e->forces[w].lifting.acceleration, g);
            rising += up * up;
        }
    }
    return kl_lane_is_0(rising - rising) && sum - sum == KL_R(0);
}

/* ---- the step ---- */

void kl_refresh(const struct kl_model *model, struct kl_state *state, struct kl_work *work) {
    struct kl_evaluation *e = kl_evaluation_in(work);
    kl_input_init(&e->kept);
    evaluate_still(model, state, &e->kept, state->lift, e);
    write_rates(model, e, state->rate);
    for (uint32_t w = 0; w < model->n_wheelsets; w++) { /* a flange does not stand in its rail */
        const int32_t right = kl_rail_state_index(model, w, KL_RIGHT);
        for (int s = 0; s < KL_SIDES && right >= 0; s++) {
            const kl_real back = e->axle[w].rail.q[s] - state->x[right + s];
            const kl_real slower = back / model->step_s;
            state->x[right + s] += back;
            state->rate[right + s] -= slower;
            state->lift[w].path_m_s[s] += slower;
            state->lift[w].slip_m_s[s] += slower;
        }
    }
    const uint32_t first = kl_wheelset_states(model);
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        kl_real *rate = &state->rate[first + KL_WHEELSET_STATES * w];
        struct kl_stiffness z;
        const struct kl_wheelset *wheelset = &model->wheelsets[w];
        kl_axle_stiffness(wheelset, &model->pairs[wheelset->pair], &e->axle[w], &e->forces[w],
                          model->step_s, &z);
        rate[KL_WS_Y_RATE] *= kl_lane_first(kl_carried_part(kl_lane_all(z.y)));
        rate[KL_WS_YAW_RATE] *= kl_lane_first(kl_carried_part(kl_lane_all(z.yaw)));
        rate[KL_WS_SPIN] *= kl_lane_first(kl_carried_part(kl_lane_all(z.spin)));
    }
    if (model->n_twists != 0) {
        kl_twists_refresh(model, e, state);
    }
    state->speed_rate_m_s2 = KL_R(0);
    if (model->running.free != 0) {
        kl_train_refresh(model, e, state);
    }
}

/* Takes the new state over, or holds the old one; latches faults. Returns 1 where held. */
static int settle(const struct kl_model *model, struct kl_state *state,
                  const struct kl_evaluation *e, const struct kl_stage *end, uint32_t faults) {
    state->tick++;
    if (state->faults == 0 && faults != 0) {
        state->fault_tick = state->tick;
    }
    state->faults |= faults;
    const int hold = (state->faults & KL_FAULTS_HOLD) != 0;
    if (!hold) {
        finish_step(model, e, state);
        state->s_m = end->s_m;
        state->speed_m_s = end->speed_m_s;
    }
    return hold;
}

/* A prescribed speed goes straight to its set-point. */
static struct kl_stage follow(const struct kl_model *model, const struct kl_state *state,
                              kl_real speed_m_s) {
    const kl_real h = model->step_s;
    const kl_real most = model->acceleration_limit_m_s2 * h;
    const kl_real change = kl_clamp(speed_m_s - state->speed_m_s, -most, most);
    const kl_real v = state->speed_m_s + change;
    const struct kl_stage end = {state->s_m + h * (KL_R(0.5) * (state->speed_m_s + v)), v,
                                 change / h};
    return end;
}

uint32_t kl_step(const struct kl_model *model, struct kl_state *state, const struct kl_input *input,
                 struct kl_output *output, struct kl_work *work) {
    struct kl_evaluation *e = kl_evaluation_in(work);
    const kl_real h = model->step_s;
    uint32_t faults = check_input(model, state, input, &e->kept);
    const int runs_free = model->running.free != 0;
    struct kl_stage end =
        runs_free ? kl_train_carry(model, state) : follow(model, state, e->kept.speed_m_s);
    const struct kl_origin from = {state->x, state->rate, state->lift, h};
    kl_evaluate(model, &from, &end, &e->kept, e);
    faults |= e->faults;
    kl_real speed_rate = KL_R(0);
    if (runs_free) {
        faults |= kl_train_move(model, state, e, &end, &speed_rate);
    }
    const int sound = is_sound(model, e) && kl_finite_real(end.s_m);
    faults |= sound ? 0u : (uint32_t)KL_FAULT_NONFINITE;

    const int hold = settle(model, state, e, &end, faults);
    if (runs_free && !hold) {
        state->speed_rate_m_s2 = speed_rate;
    }
    if (output != NULL && !hold) {
        kl_write_output(model, state, &end, e, output);
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
