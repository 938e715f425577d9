/* kl_step.c - the life of a state, and the integrator. */
#include "kl_step.h"

#include "kl_math.h"
#include "kl_rates.h"

/* gamma of ROS2, 1 - 1/sqrt 2 */
#define GAMMA 0.29289321881345254

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

/* States are taken KL_LANES at a time; where that does not come out even the first ones are taken
 * twice. */
static uint32_t first_stride(uint32_t n) {
    return n % KL_LANES != 0u ? n % KL_LANES : KL_LANES;
}

/* The implicit part of a stage: each wheelset's three rates divided by 1 + gamma h damping. */
struct implicit {
    kl_real scale[KL_MAX_WHEELSETS][3];
};

static void find_implicit(const struct kl_model *model, const struct kl_evaluation *e,
                          struct implicit *implicit) {
    const kl_real by = KL_R(GAMMA) * model->step_s;
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        kl_real damping[3];
        kl_axle_damping(&model->wheelsets[w], &e->axle[w], &e->forces[w], damping);
        for (uint32_t k = 0; k < 3u; k++) {
            implicit->scale[w][k] = KL_R(1) / (KL_R(1) + by * damping[k]);
        }
    }
}

/* First stage: k1 = S f(x), x2 = x + h k1. */
static void first_stage(const struct kl_model *model, const struct implicit *restrict implicit,
                        const kl_real *restrict x, kl_real *restrict k1, kl_real *restrict x2) {
    const uint32_t n = model->n_states;
    const kl_real h = model->step_s;
    kl_real *of_axle = k1 + (n - KL_WHEELSET_STATES * model->n_wheelsets) + KL_WS_Y_RATE;
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        for (uint32_t k = 0; k < 3u; k++) {
            of_axle[KL_WHEELSET_STATES * w + k] *= implicit->scale[w][k];
        }
    }
    for (uint32_t i = 0, by = first_stride(n); i < n; i += by, by = KL_LANES) {
        kl_lane_store(&x2[i], 0, kl_lane_load(&x[i], 0) + kl_lane_load(&k1[i], 0) * h);
    }
}

/* Second stage: k2 = S (f(x2) - 2 k1), x2 = x + h (3 k1 + k2)/2. Where S is 1 that is the mean of
 * f(x) and f(x2); so elsewhere f(x2) is first changed to 2 k1 + k2. Returns 1
 * where every new state is finite. */
static int second_stage(const struct kl_model *model, const struct implicit *restrict implicit,
                        const kl_real *restrict x, const kl_real *restrict k1, kl_real *restrict k2,
                        kl_real *restrict x2) {
    const uint32_t n = model->n_states;
    const kl_real half_h = KL_R(0.5) * model->step_s;
    const uint32_t first = (n - KL_WHEELSET_STATES * model->n_wheelsets) + KL_WS_Y_RATE;
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        for (uint32_t k = 0; k < 3u; k++) {
            const uint32_t i = first + KL_WHEELSET_STATES * w + k;
            const kl_real twice = KL_R(2) * k1[i];
            k2[i] = twice + (k2[i] - twice) * implicit->scale[w][k];
        }
    }
    kl_lane unsound = kl_lane_all(KL_R(0)); /* 0, or NaN for ever */
    for (uint32_t i = 0, by = first_stride(n); i < n; i += by, by = KL_LANES) {
        const kl_lane k = kl_lane_load(&k1[i], 0) + kl_lane_load(&k2[i], 0);
        const kl_lane next = kl_lane_load(&x[i], 0) + k * half_h;
        kl_lane_store(&x2[i], 0, next);
        unsound += next - next;
    }
    return kl_lane_is_0(unsound);
}

/* Takes the new state over, or holds the old one; latches faults. Returns 1 where held. */
static int settle(struct kl_state *state, const kl_real *restrict x, const struct kl_stage *end,
                  uint32_t faults) {
    const uint32_t n = state->n_states;
    state->tick++;
    if (state->faults == 0 && faults != 0) {
        state->fault_tick = state->tick;
    }
    state->faults |= faults;
    const int hold = (state->faults & KL_FAULTS_HOLD) != 0;
    if (!hold) {
        for (uint32_t i = 0, by = first_stride(n); i < n; i += by, by = KL_LANES) {
            kl_lane_store(&state->x[i], 0, kl_lane_load(&x[i], 0));
        }
        state->s_m = end->s_m;
        state->speed_m_s = end->speed_m_s;
    }
    return hold;
}

uint32_t kl_step(const struct kl_model *model, struct kl_state *state, const struct kl_input *input,
                 struct kl_output *output) {
    struct kl_evaluation e;
    struct kl_input kept;
    struct implicit implicit;
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
    find_implicit(model, &e, &implicit);
    first_stage(model, &implicit, state->x, k1, x2);
    kl_evaluate(model, x2, &end, &kept, &e, k2);
    faults |= e.faults;
    const int sound = second_stage(model, &implicit, state->x, k1, k2, x2);
    faults |= sound && kl_finite_real(end.s_m) ? 0u : (uint32_t)KL_FAULT_NONFINITE;

    const int hold = settle(state, x2, &end, faults);
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
