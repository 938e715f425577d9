/* critical_vehicle.c - the vehicle between two speeds. */
#include "critical_vehicle.h"

#include <string.h>

#define LOOK_EVERY 65536u /* steps between two looks at the clock */

static bool advance(void *context, void *memory, double *observed) {
    struct critical_vehicle *v = context;
    struct kl_state *state = memory;
    const uint32_t faults = kl_step(v->model, state, &v->input, NULL, cli_work());
    *observed = (double)state->x[v->observed];
    if (++v->steps % LOOK_EVERY == 0) {
        cli_progress_show(v->progress, -1.0, v->doing);
    }
    return (faults & KL_FAULTS_HOLD) == 0;
}

/* The wheels go on rolling as they did; everything else keeps its place and rate. */
static void retune(void *context, void *memory, double speed_m_s) {
    struct critical_vehicle *v = context;
    struct kl_state *state = memory;
    const double ratio = speed_m_s / (double)state->speed_m_s;
    for (uint32_t w = 0; w < v->model->n_wheelsets; w++) {
        const int32_t twist = kl_wheelset_state_index(v->model, w, KL_WS_TWIST);
        state->x[kl_wheelset_state_index(v->model, w, KL_WS_SPIN)] *= (kl_real)ratio;
        if (twist >= 0) {
            state->x[twist] *= (kl_real)ratio;
        }
    }
    state->speed_m_s = (kl_real)speed_m_s;
    v->input.speed_m_s = (kl_real)speed_m_s;
    kl_refresh(v->model, state, cli_work());
}

static int find_rest(struct critical_vehicle *v, double speed_m_s) {
    if (v->rest_m_s == speed_m_s) {
        return CLI_OK;
    }
    const struct modes_request request = {
        .model = v->model, .names = v->names, .speed_m_s = speed_m_s, .at_m = v->at_m};
    int status = modes_steady(&request, NULL, &v->rest);
    if (status == CLI_OK && !v->rest.found) {
        status = cli_fail("no steady state at %g m/s: a rate of %g is left", speed_m_s,
                          v->rest.residual);
    }
    v->rest_m_s = status == CLI_OK ? speed_m_s : -1.0;
    return status;
}

/* Without a steady state, said already, the centre of the track is taken for it. */
static void scale(void *context, void *out, const void *memory, double share) {
    struct critical_vehicle *v = context;
    const struct kl_state *state = memory;
    struct kl_state *to = out;
    *to = *state;
    (void)find_rest(v, (double)state->speed_m_s);
    for (uint32_t i = 0; i < state->n_states; i++) {
        const double rest = (double)v->rest.state.x[i];
        to->x[i] = (kl_real)(rest + share * ((double)state->x[i] - rest));
    }
    v->input.speed_m_s = state->speed_m_s;
    kl_refresh(v->model, to, cli_work());
}

void critical_vehicle_init(struct critical_vehicle *v, const struct kl_model *model,
                           const struct modes_names *names, uint32_t wheelset) {
    memset(v, 0, sizeof *v);
    v->model = model;
    v->names = names;
    v->observed = kl_wheelset_state_index(model, wheelset, KL_WS_Y);
    v->rest_m_s = -1.0;
    kl_input_init(&v->input);
}

struct cycle_system critical_system(struct critical_vehicle *v) {
    return (struct cycle_system){.context = v,
                                 .state_size = sizeof(struct kl_state),
                                 .scratch = &v->scratch,
                                 .step_s = (double)v->model->step_s,
                                 .advance = advance,
                                 .retune = retune,
                                 .scale = scale};
}

int critical_start(struct critical_vehicle *v, double speed_m_s, double aside_m,
                   struct kl_state *state) {
    int status = find_rest(v, speed_m_s);
    if (status == CLI_OK) {
        *state = v->rest.state;
        for (uint32_t w = 0; w < v->model->n_wheelsets; w++) {
            state->x[kl_wheelset_state_index(v->model, w, KL_WS_Y)] += (kl_real)aside_m;
        }
        v->input.speed_m_s = (kl_real)speed_m_s;
        kl_refresh(v->model, state, cli_work());
    }
    return status;
}
