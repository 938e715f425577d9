/* modes_jacobian.c - differences of the rates, many states at once. */
#include "modes_jacobian.h"

#include <string.h>

#define NONE UINT32_MAX

/* Small against table steps and creep saturation, large against rounding. */
#define STEP_POSITION 1e-7 /* m, rad */
#define STEP_RATE 1e-6     /* m/s, rad/s */
#define STEP_SPIN 1e-5     /* rad/s */

/* ---- who acts on whom ---- */

static uint32_t part_of_coordinate(const struct kl_model *model, uint32_t coordinate) {
    const uint32_t bodies = KL_FREEDOMS * model->n_bodies;
    return coordinate < bodies ? coordinate / KL_FREEDOMS
                               : model->n_bodies + (coordinate - bodies) / 4u;
}

static void join(struct jacobian_plan *plan, uint32_t a, uint32_t b) {
    plan->neighbours[a][b] = true;
    plan->neighbours[b][a] = true;
}

static void join_suspension(struct jacobian_plan *plan, const struct kl_model *model) {
    const struct kl_suspension *s = &model->suspension;
    const uint16_t *twins = s->twins;
    uint32_t entry = 0;
    for (uint32_t i = 0, n = kl_count_twins(s); i < n; i++, twins += 3) {
        for (uint32_t last = entry + twins[2]; entry != last; entry++) {
            for (uint32_t row = 0; row < 2; row++) {
                const struct kl_spring *spring = &s->spring[2 * entry + row];
                if (spring->k != (kl_real)0 || spring->c != (kl_real)0) {
                    join(plan, part_of_coordinate(model, twins[row]),
                         part_of_coordinate(model, s->place[entry] / KL_PLACE(1u)));
                }
            }
        }
    }
}

static void join_struts(struct jacobian_plan *plan, const struct kl_model *model) {
    const struct kl_struts *s = &model->struts;
    const uint32_t first_slip = model->n_bodies + model->n_wheelsets;
    for (uint32_t i = 0, n = kl_count_struts(s); i < n; i++) {
        for (uint32_t a = s->term_start[i]; a < s->term_start[i + 1]; a++) {
            const uint32_t part = part_of_coordinate(model, s->column[a]);
            for (uint32_t b = s->term_start[i]; b < a; b++) {
                join(plan, part, part_of_coordinate(model, s->column[b]));
            }
            if (i < s->n_slips) {
                join(plan, part, first_slip + i);
            }
        }
    }
}

static void own(struct jacobian_plan *plan, int32_t state, uint32_t part, double step) {
    if (state >= 0) {
        plan->part[state] = part;
        plan->step[state] = step * (sizeof(kl_real) == sizeof(double) ? 1.0 : 1e3);
    }
}

/* Whose each state is. What is nobody's is the last part's, which is everybody's neighbour. */
static void divide(struct jacobian_plan *plan, const struct kl_model *model) {
    const uint32_t others = plan->n_parts - 1;
    for (uint32_t i = 0; i < plan->n_states; i++) {
        own(plan, (int32_t)i, others, STEP_POSITION);
    }
    int32_t next = 0;
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        for (int f = 0; f < KL_FREEDOMS; f++) {
            own(plan, kl_body_state_index(model, b, (enum kl_freedom)f, 0), b, STEP_POSITION);
            own(plan, kl_body_state_index(model, b, (enum kl_freedom)f, 1), b, STEP_RATE);
        }
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const uint32_t part = model->n_bodies + w;
        const int32_t y = kl_wheelset_state_index(model, w, KL_WS_Y);
        own(plan, y + KL_WS_Y, part, STEP_POSITION);
        own(plan, y + KL_WS_Y_RATE, part, STEP_RATE);
        own(plan, y + KL_WS_YAW, part, STEP_POSITION);
        own(plan, y + KL_WS_YAW_RATE, part, STEP_RATE);
        own(plan, y + KL_WS_SPIN, part, STEP_SPIN);
        own(plan, kl_rail_state_index(model, w, KL_RIGHT), part, STEP_POSITION);
        own(plan, kl_rail_state_index(model, w, KL_LEFT), part, STEP_POSITION);
        own(plan, kl_wheelset_state_index(model, w, KL_WS_TWIST), part, STEP_SPIN);
        next = y + KL_WHEELSET_STATES;
    }
    for (uint32_t i = 0; i < model->struts.n_slips; i++) {
        own(plan, next + (int32_t)i, model->n_bodies + model->n_wheelsets + i, STEP_POSITION);
    }
    for (uint32_t i = 0; i < plan->n_states; i++) {
        for (uint32_t p = 0; p < plan->n_parts && plan->part[i] == others; p++) {
            join(plan, p, others);
        }
    }
}

/* ---- colours ---- */

static bool have_common_neighbour(const struct jacobian_plan *plan, uint32_t a, uint32_t b) {
    for (uint32_t p = 0; p < plan->n_parts; p++) {
        if (plan->neighbours[a][p] && plan->neighbours[b][p]) {
            return true;
        }
    }
    return false;
}

static uint32_t colour_parts(const struct jacobian_plan *plan, uint32_t colour[JACOBIAN_PARTS]) {
    uint32_t n = 0;
    for (uint32_t p = 0; p < plan->n_parts; p++) {
        bool taken[JACOBIAN_PARTS] = {false};
        for (uint32_t q = 0; q < p; q++) {
            taken[colour[q]] = taken[colour[q]] || have_common_neighbour(plan, p, q);
        }
        colour[p] = 0;
        while (taken[colour[p]]) {
            colour[p]++;
        }
        n = colour[p] >= n ? colour[p] + 1 : n;
    }
    return n;
}

/* The k-th states of all parts of one colour make a group. */
static void make_groups(struct jacobian_plan *plan) {
    uint32_t colour[JACOBIAN_PARTS];
    const uint32_t n_colours = colour_parts(plan, colour);
    plan->n_groups = 0;
    for (uint32_t c = 0; c < n_colours; c++) {
        uint32_t seen[JACOBIAN_PARTS] = {0};
        uint32_t most = 0;
        for (uint32_t i = 0; i < plan->n_states; i++) {
            const uint32_t part = plan->part[i];
            if (colour[part] == c) {
                plan->group[i] = plan->n_groups + seen[part]++;
                most = seen[part] > most ? seen[part] : most;
            }
        }
        plan->n_groups += most;
    }
}

void jacobian_plan(const struct kl_model *model, struct jacobian_plan *plan) {
    memset(plan, 0, sizeof *plan);
    plan->n_states = model->n_states;
    plan->n_parts = model->n_bodies + model->n_wheelsets + model->struts.n_slips + 1;
    for (uint32_t p = 0; p < plan->n_parts; p++) {
        plan->neighbours[p][p] = true;
    }
    join_suspension(plan, model);
    join_struts(plan, model);
    divide(plan, model);
    make_groups(plan);
}

/* ---- differences ---- */

/* Moves the states of one group, and says which of them each part feels. */
static void move(const struct jacobian_plan *plan, uint32_t group, double factor,
                 struct kl_state *state, uint32_t felt[JACOBIAN_PARTS]) {
    for (uint32_t p = 0; p < plan->n_parts; p++) {
        felt[p] = NONE;
    }
    for (uint32_t i = 0; i < plan->n_states; i++) {
        if (plan->group[i] != group) {
            continue;
        }
        state->x[i] += (kl_real)(factor * plan->step[i]);
        for (uint32_t p = 0; p < plan->n_parts; p++) {
            felt[p] = plan->neighbours[plan->part[i]][p] ? i : felt[p];
        }
    }
}

/* Adds weight times the central differences of one group. The distance that is really between both
 * sides, after rounding, divides. */
static void differentiate(const struct jacobian_plan *plan, const struct jacobian_point *at,
                          uint32_t group, double factor, double weight, double *matrix) {
    struct kl_state high = *at->state;
    struct kl_state low = *at->state;
    kl_real rates_high[KL_MAX_STATES];
    kl_real rates_low[KL_MAX_STATES];
    uint32_t felt[JACOBIAN_PARTS];
    move(plan, group, factor, &high, felt);
    move(plan, group, -factor, &low, felt);
    kl_rates(at->model, &high, at->input, rates_high, cli_work());
    kl_rates(at->model, &low, at->input, rates_low, cli_work());
    for (uint32_t i = 0; i < plan->n_states; i++) {
        const uint32_t k = felt[plan->part[i]];
        if (k != NONE) {
            const double width = (double)high.x[k] - (double)low.x[k];
            matrix[i * plan->n_states + k] +=
                weight * ((double)rates_high[i] - (double)rates_low[i]) / width;
        }
    }
}

void jacobian(const struct jacobian_plan *plan, const struct jacobian_point *at,
              enum jacobian_kind kind, double factor, double *matrix) {
    memset(matrix, 0, (size_t)plan->n_states * plan->n_states * sizeof matrix[0]);
    for (uint32_t g = 0; g < plan->n_groups; g++) {
        if (kind == JACOBIAN_PLAIN) {
            differentiate(plan, at, g, factor, 1.0, matrix);
        } else {
            differentiate(plan, at, g, factor, -1.0, matrix);
            differentiate(plan, at, g, 0.5 * factor, 2.0, matrix);
        }
    }
}
