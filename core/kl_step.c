/* kl_step.c - the life of a state, and the integrator. */
#include "kl_step.h"

#include "kl_math.h"
#include "kl_rates.h"

/* ---- inputs ---- */

/* What is not a number counts as not given; what is too large is cut; `wrong` grows by what was
 * changed. */
static kl_lane limited(kl_lane value, kl_real limit_low, kl_real limit_high, kl_real otherwise,
                       kl_lane *wrong) {
    const kl_lane low = kl_lane_all(limit_low);
    const kl_lane kept = kl_lane_min(kl_lane_max(value, low), kl_lane_all(limit_high));
    const kl_lane off = kept - value;
    *wrong += kl_lane_max(off, -off);
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
        KL_EACH_LANE(g) {
            const kl_lane factor = kl_lane_load(input->friction_factor[w], g);
            kl_lane_store(kept->friction_factor[w], g,
                          limited(factor, KL_R(0), KL_R(2), KL_R(1), &wrong));
        }
    }
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        kept->side_force_N[b] = kl_lane_first(
            limited(kl_lane_all(input->side_force_N[b]), KL_R(-1e7), KL_R(1e7), KL_R(0), &wrong));
    }
    return kl_lane_is_0(wrong) ? 0u : (uint32_t)KL_FAULT_INPUT;
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
        i += 2u * kl_freedoms_of(&model->bodies[b]);
    }
    for (uint32_t f = 0; f < (uint32_t)freedom; f++) {
        i += (model->bodies[body].freedoms >> f) & 1u;
    }
    return (int32_t)(i + (rate ? kl_freedoms_of(&model->bodies[body]) : 0u));
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
    struct kl_evaluation e;
    struct kl_input kept;
    (void)check_input(model, state, input, &kept);
    const struct kl_stage stage = {state->s_m, state->speed_m_s, KL_R(0)};
    kl_evaluate(model, state->x, &stage, &kept, &e, rates);
    if (output != NULL) {
        kl_write_output(model, state, &stage, &e, output);
    }
}

/* ---- the step ---- */

/*
 * States are read and written in the same pairs everywhere: a body's one after the other (there are
 * always two per freedom), a wheelset's as (y, yaw), (y', yaw'), spin. A pair that is read as it
 * was written comes straight from the store; one that was written in other parts would have to wait
 * for the memory, at the end of the longest chain of the step.
 */
static void copy_pair(const kl_real *from, kl_real *to) {
    KL_EACH_LANE(g) {
        kl_lane_store(to, g, kl_lane_load(from, g));
    }
}

/* to = x + h k */
static void advance_pair(const kl_real *x, const kl_real *k, kl_real h, kl_real *to) {
    KL_EACH_LANE(g) {
        kl_lane_store(to, g, kl_lane_load(x, g) + kl_lane_load(k, g) * h);
    }
}

static void multiply_pair(kl_real *k, const kl_both *by) {
    KL_EACH_LANE(g) {
        kl_lane_store(k, g, kl_lane_load(k, g) * KL_LANE(*by, g));
    }
}

static uint32_t body_states(const struct kl_model *model) {
    return model->n_states - KL_WHEELSET_STATES * model->n_wheelsets;
}

/* The wheels' rotation is integrated relative to V/r0, so that both stages see the same slip while
 * the speed changes. */
static void find_implicit(const struct kl_model *model, const struct kl_evaluation *e,
                          kl_real v_rate, struct kl_implicit *implicit) {
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct kl_wheelset *wheelset = &model->wheelsets[w];
        kl_axle_implicit(wheelset, &e->axle[w], &e->forces[w], model->step_s, &implicit[w]);
        implicit[w].spin_drift = v_rate / model->pairs[wheelset->pair].radius_m;
    }
}

/* First stage: k1 = S f(x), x2 = x + h k1. */
static void first_stage(const struct kl_model *model, const struct kl_implicit *restrict implicit,
                        const kl_real *restrict x, kl_real *restrict k1, kl_real *restrict x2) {
    const kl_real h = model->step_s;
    const uint32_t n = body_states(model);
    for (uint32_t i = 0; i < n; i += 2u) {
        advance_pair(&x[i], &k1[i], h, &x2[i]);
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const uint32_t i = n + KL_WHEELSET_STATES * w;
        multiply_pair(&k1[i + KL_WS_Y_RATE], &implicit[w].y_and_yaw);
        k1[i + KL_WS_SPIN] = (k1[i + KL_WS_SPIN] - implicit[w].spin_drift) * implicit[w].spin;
        advance_pair(&x[i], &k1[i], h, &x2[i]);
        advance_pair(&x[i + KL_WS_Y_RATE], &k1[i + KL_WS_Y_RATE], h, &x2[i + KL_WS_Y_RATE]);
        x2[i + KL_WS_SPIN] = x[i + KL_WS_SPIN] + h * (k1[i + KL_WS_SPIN] + implicit[w].spin_drift);
    }
}

/* Where S is 1 the second stage is the mean of both rates. */
static kl_lane finish_pair(const kl_real *x, const kl_real *k1, const kl_real *k2, kl_real h,
                           kl_real *to) {
    kl_lane unsound = kl_lane_all(KL_R(0));
    KL_EACH_LANE(g) {
        const kl_lane mean = (kl_lane_load(k1, g) + kl_lane_load(k2, g)) * KL_R(0.5);
        const kl_lane next = kl_lane_load(x, g) + mean * h;
        kl_lane_store(to, g, next);
        unsound += next - next;
    }
    return unsound;
}

/* Makes f(x2) into 2 k1 + k2 with k2 = S (f(x2) - 2 k1), for the rates that S slows. */
static void damp_wheelset(const struct kl_implicit *implicit, const kl_real *k1, kl_real *k2) {
    KL_EACH_LANE(g) {
        const kl_lane twice = KL_R(2) * kl_lane_load(&k1[KL_WS_Y_RATE], g);
        const kl_lane rest = kl_lane_load(&k2[KL_WS_Y_RATE], g) - twice;
        kl_lane_store(&k2[KL_WS_Y_RATE], g, twice + rest * KL_LANE(implicit->y_and_yaw, g));
    }
    const kl_real twice = KL_R(2) * k1[KL_WS_SPIN];
    k2[KL_WS_SPIN] = twice + ((k2[KL_WS_SPIN] - implicit->spin_drift) - twice) * implicit->spin;
}

/* Second stage: k2 = S (f(x2) - 2 k1), x2 = x + h (3 k1 + k2)/2. Returns 1 where every new state is
 * finite. */
static int second_stage(const struct kl_model *model, const struct kl_implicit *restrict implicit,
                        const kl_real *restrict x, const kl_real *restrict k1, kl_real *restrict k2,
                        kl_real *restrict x2) {
    const kl_real h = model->step_s;
    const uint32_t n = body_states(model);
    kl_lane unsound = kl_lane_all(KL_R(0)); /* 0, or NaN for ever */
    for (uint32_t i = 0; i < n; i += 2u) {
        unsound += finish_pair(&x[i], &k1[i], &k2[i], h, &x2[i]);
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const uint32_t i = n + KL_WHEELSET_STATES * w;
        const uint32_t r = i + KL_WS_Y_RATE;
        const uint32_t s = i + KL_WS_SPIN;
        damp_wheelset(&implicit[w], &k1[i], &k2[i]);
        unsound += finish_pair(&x[i], &k1[i], &k2[i], h, &x2[i]);
        unsound += finish_pair(&x[r], &k1[r], &k2[r], h, &x2[r]);
        x2[s] = x[s] + h * (KL_R(0.5) * (k1[s] + k2[s]) + implicit[w].spin_drift);
        unsound += kl_lane_all(x2[s] - x2[s]);
    }
    return kl_lane_is_0(unsound);
}

static void copy_states(const struct kl_model *model, const kl_real *restrict from,
                        kl_real *restrict to) {
    const uint32_t n = body_states(model);
    for (uint32_t i = 0; i < n; i += 2u) {
        copy_pair(&from[i], &to[i]);
    }
    for (uint32_t i = n; i < model->n_states; i += KL_WHEELSET_STATES) {
        copy_pair(&from[i], &to[i]);
        copy_pair(&from[i + KL_WS_Y_RATE], &to[i + KL_WS_Y_RATE]);
        to[i + KL_WS_SPIN] = from[i + KL_WS_SPIN];
    }
}

/* Takes the new state over, or holds the old one; latches faults. Returns 1 where held. */
static int settle(const struct kl_model *model, struct kl_state *state, const kl_real *x,
                  const struct kl_stage *end, uint32_t faults) {
    state->tick++;
    if (state->faults == 0 && faults != 0) {
        state->fault_tick = state->tick;
    }
    state->faults |= faults;
    const int hold = (state->faults & KL_FAULTS_HOLD) != 0;
    if (!hold) {
        copy_states(model, x, state->x);
        state->s_m = end->s_m;
        state->speed_m_s = end->speed_m_s;
    }
    return hold;
}

uint32_t kl_step(const struct kl_model *model, struct kl_state *state, const struct kl_input *input,
                 struct kl_output *output) {
    struct kl_evaluation e;
    struct kl_input kept;
    struct kl_implicit implicit[KL_MAX_WHEELSETS];
    kl_real k1[KL_MAX_STATES];
    kl_real k2[KL_MAX_STATES];
    kl_real x2[KL_MAX_STATES];
    const kl_real h = model->step_s;
    uint32_t faults = check_input(model, state, input, &kept);
    const kl_real most = model->acceleration_limit_m_s2 * h;
    const kl_real change = kl_clamp(kept.speed_m_s - state->speed_m_s, -most, most);
    const kl_real v2 = state->speed_m_s + change;
    const kl_real v_rate = change / h;
    const struct kl_stage begin = {state->s_m, state->speed_m_s, v_rate};
    const struct kl_stage end = {state->s_m + h * (KL_R(0.5) * (state->speed_m_s + v2)), v2,
                                 v_rate};

    kl_evaluate(model, state->x, &begin, &kept, &e, k1);
    faults |= e.faults;
    find_implicit(model, &e, v_rate, implicit);
    first_stage(model, implicit, state->x, k1, x2);
    kl_evaluate(model, x2, &end, &kept, &e, k2);
    faults |= e.faults;
    const int sound = second_stage(model, implicit, state->x, k1, k2, x2);
    faults |= sound && kl_finite_real(end.s_m) ? 0u : (uint32_t)KL_FAULT_NONFINITE;

    const int hold = settle(model, state, x2, &end, faults);
    if (output != NULL && !hold) {
        kl_write_output(model, state, &end, &e, output);
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
