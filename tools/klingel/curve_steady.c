/* curve_steady.c - equilibrium in a curve. */
#include "curve_steady.h"

#include <math.h>

#define LOOK_S 0.5   /* simulated, between two looks at how far it has settled */
#define SETTLED 1e-3 /* m/s2, rad/s2: rates that count as settled */
#define ENOUGH 1e-9  /* ... beyond which simulating on gains nothing */
#define FADES 0.7    /* of the largest rate from one look to the next */
#define PATIENCE 8   /* looks without such progress */

/* Displacements of another curve, with the rates of this one. */
static int move_into(const struct cli_model *m, const struct curve_case *at,
                     const struct curve_result *before, struct kl_state *state) {
    enum kl_status status =
        kl_init(&m->model, state, (kl_real)0, (kl_real)at->speed_m_s, cli_work());
    if (status != KL_OK) {
        return cli_fail("cannot start at %g m/s: %s", at->speed_m_s, kl_status_text(status));
    }
    for (uint32_t b = 0; b < m->model.n_bodies; b++) {
        for (int f = 0; f < KL_FREEDOMS; f++) {
            const int32_t i = kl_body_state_index(&m->model, b, (enum kl_freedom)f, 0);
            if (i >= 0) {
                state->x[i] = before->steady.state.x[i];
            }
        }
    }
    for (uint32_t w = 0; w < m->model.n_wheelsets; w++) {
        const int32_t y = kl_wheelset_state_index(&m->model, w, KL_WS_Y);
        const int32_t yaw = kl_wheelset_state_index(&m->model, w, KL_WS_YAW);
        state->x[y] = before->steady.state.x[y];
        state->x[yaw] = before->steady.state.x[yaw];
    }
    return CLI_OK;
}

static double largest_rate(const struct cli_model *m, const struct kl_input *input,
                           const struct kl_state *state) {
    kl_real rates[KL_MAX_STATES];
    double worst = 0.0;
    kl_rates(&m->model, state, input, rates, cli_work());
    for (uint32_t i = 0; i < state->n_states; i++) {
        worst = fmax(worst, fabs((double)rates[i]));
    }
    return worst;
}

/* Runs until it is as steady as it becomes. The largest rate that is left; HUGE_VAL: derailed. */
static double simulate(const struct cli_model *m, double longest_s, struct kl_state *state) {
    const uint64_t look = (uint64_t)llround(ceil(LOOK_S / (double)m->model.step_s));
    struct kl_input input;
    double least = HUGE_VAL;
    int waited = 0;
    kl_input_init(&input);
    input.speed_m_s = state->speed_m_s;
    for (double t = 0.0; t < longest_s && waited < PATIENCE; t += LOOK_S) {
        for (uint64_t i = 0; i < look; i++) {
            if ((kl_step(&m->model, state, &input, NULL, cli_work()) & KL_FAULTS_HOLD) != 0) {
                return HUGE_VAL;
            }
        }
        const double now = largest_rate(m, &input, state);
        waited = now < FADES * least ? 0 : waited + 1;
        least = fmin(least, now);
        if (now < ENOUGH) {
            break;
        }
    }
    return largest_rate(m, &input, state);
}

static int fall_back(const struct cli_model *m, const struct modes_request *request,
                     double longest_s, struct curve_result *result) {
    struct kl_state state;
    struct modes_steady polished;
    struct kl_input input;
    if (kl_init(&m->model, &state, (kl_real)0, (kl_real)request->speed_m_s, cli_work()) != KL_OK) {
        return cli_fail("cannot start at %g m/s", request->speed_m_s);
    }
    const double left = simulate(m, longest_s, &state);
    int status = isfinite(left) ? modes_steady(request, &state, &polished) : CLI_OK;
    if (status != CLI_OK || !isfinite(left)) {
        return status;
    }
    if (polished.found) {
        result->way = CURVE_FOUND;
        result->steady = polished;
    } else if (left < SETTLED) {
        result->way = CURVE_SIMULATED;
        result->steady.state = state;
        result->steady.residual = left;
        kl_input_init(&input);
        input.speed_m_s = state.speed_m_s;
        kl_observe(&m->model, &state, &input, &result->steady.output, cli_work());
    }
    return CLI_OK;
}

/* ---- what it adds up to ---- */

static void add_up(const struct cli_model *m, struct curve_result *r) {
    const double g = (double)m->model.gravity_m_s2;
    const double aside =
        r->at.curvature_1_m * r->at.speed_m_s * r->at.speed_m_s - g * r->at.cant_rad;
    double mass = 0.0;
    double q = 0.0;
    double y = 0.0;
    r->weight_N = 0.0;
    for (uint32_t b = 0; b < m->model.n_bodies; b++) {
        mass += (m->model.bodies[b].freedoms & KL_HAS(KL_Y)) != 0
                    ? (double)m->model.bodies[b].mass_kg
                    : 0.0;
    }
    for (uint32_t w = 0; w < m->model.n_wheelsets; w++) {
        const struct kl_wheelset_output *o = &r->steady.output.wheelset[w];
        mass += (double)m->model.wheelsets[w].mass_kg;
        r->weight_N += (double)m->model.wheelsets[w].static_load_N;
        y += (double)o->force_y_N;
        q += (double)o->q_N[KL_RIGHT] + (double)o->q_N[KL_LEFT];
    }
    r->aside_N = -mass * aside;
    r->lateral_N = y - r->aside_N;
    r->vertical_N = q - r->weight_N;
    for (uint32_t i = 0; i < m->file.vehicle.n_elements; i++) {
        const struct kl_element_def *e = &m->file.vehicle.elements[i];
        r->grounded = r->grounded || e->end_a == KL_GROUND_END || e->end_b == KL_GROUND_END;
    }
}

int curve_find(const struct cli_model *m, const struct modes_names *names,
               const struct curve_case *at, const struct curve_result *before, double longest_s,
               struct curve_result *r) {
    const struct modes_request request = {
        .model = &m->model, .names = names, .speed_m_s = at->speed_m_s};
    struct kl_state guess;
    *r = (struct curve_result){.at = *at, .way = CURVE_NONE};
    int status = CLI_OK;
    if (before != NULL) {
        status = move_into(m, at, before, &guess);
        status = status == CLI_OK ? modes_steady(&request, &guess, &r->steady) : status;
    }
    if (status == CLI_OK && !r->steady.found) {
        status = modes_steady(&request, NULL, &r->steady);
    }
    if (status == CLI_OK && r->steady.found) {
        r->way = CURVE_FOUND;
    } else if (status == CLI_OK) {
        status = fall_back(m, &request, longest_s, r);
    }
    if (status == CLI_OK && r->way != CURVE_NONE) {
        add_up(m, r);
    }
    return status;
}
