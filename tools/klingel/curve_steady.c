/* curve_steady.c - equilibrium in a curve. */
#include "curve_steady.h"

#include <math.h>

#define LONG_SHARE 0.25     /* of the way, tried first from straight track */
#define SHORT_SHARE 0.03    /* shorter steps of the way are left to the slower method */
#define SHORTEST_SHARE 1e-3 /* ... and below that there is no way */
#define MOST_TRIES 60       /* along one way */
#define LOOK_S 0.5          /* simulated, between two looks at how far it has settled */
#define SETTLED 1e-3        /* m/s2, rad/s2: rates that count as settled */
#define ENOUGH 1e-9         /* ... beyond which simulating on gains nothing */
#define FADES 0.7           /* of the largest rate from one look to the next */
#define PATIENCE 8          /* looks without such progress */

/* ---- bending the track ---- */

static int bend(struct curve_bench *bench, const struct curve_case *at) {
    const struct kl_track_def def = {.curvature_start_1_m = at->curvature_1_m,
                                     .cant_start_rad = at->cant_rad};
    struct kl_arena arena;
    struct kl_diag diag = {0};
    kl_arena_init(&arena, bench->memory, sizeof bench->memory);
    const enum kl_status status = kl_track_build(&def, &arena, &bench->m->model.track, &diag);
    return status == KL_OK ? CLI_OK
                           : cli_fail("R = %g m: %s", at->radius_m, kl_status_text(status));
}

/* The case that lies a share of the way from one to another. */
static struct curve_case between(const struct curve_case *from, const struct curve_case *to,
                                 double share) {
    struct curve_case c = *to;
    c.curvature_1_m = from->curvature_1_m + share * (to->curvature_1_m - from->curvature_1_m);
    c.cant_rad = from->cant_rad + share * (to->cant_rad - from->cant_rad);
    c.speed_m_s = from->speed_m_s + share * (to->speed_m_s - from->speed_m_s);
    return c;
}

/* ---- following ---- */

/* A wheelset at the end of its contact table stands nowhere: name it. -1: all are on theirs. */
static int off_table(const struct kl_model *model, const struct kl_output *output) {
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct kl_pair *pair = &model->pairs[model->wheelsets[w].pair];
        if (!(fabs((double)output->wheelset[w].y_m) < (double)pair->range_m)) {
            return (int)w;
        }
    }
    return -1;
}

struct way {
    struct curve_case from;
    const struct curve_case *to;
    double share;            /* of the way, that has been gone */
    double last_share;       /* before the last step; negative: there was none */
    struct kl_state here;    /* at `share` */
    struct kl_state last;    /* at `last_share` */
    struct modes_steady try; /* the result of the last try */
};

static int try_at(struct curve_bench *bench, struct way *way, double share, bool quick,
                  bool *found) {
    const struct curve_case at = between(&way->from, way->to, share);
    const struct modes_request request = {.model = &bench->m->model,
                                          .names = &bench->names,
                                          .speed_m_s = at.speed_m_s,
                                          .quick = quick};
    struct kl_state guess = way->here;
    if (way->last_share >= 0.0) {
        const double on = (share - way->share) / (way->share - way->last_share);
        for (uint32_t i = 0; i < guess.n_states; i++) {
            guess.x[i] += (kl_real)on * (way->here.x[i] - way->last.x[i]);
        }
    }
    int status = bend(bench, &at);
    if (status == CLI_OK) {
        status = modes_steady(&request, &guess, &way->try);
    }
    *found =
        status == CLI_OK && way->try.found && off_table(&bench->m->model, &way->try.output) < 0;
    return status;
}

/* From way->here, where way->share is 0, to the end. CLI_OK, whether it is reached or not. */
static int go(struct curve_bench *bench, struct way *way, double first) {
    double step = first;
    int status = CLI_OK;
    way->share = 0.0;
    way->last_share = -1.0;
    for (int i = 0; i < MOST_TRIES && status == CLI_OK && way->share < 1.0; i++) {
        const double next = fmin(way->share + step, 1.0);
        bool found = false;
        status = try_at(bench, way, next, step > SHORT_SHARE, &found);
        if (found) {
            way->last = way->here;
            way->last_share = way->share;
            way->here = way->try.state;
            way->share = next;
            step *= 2.0;
        } else if (step < SHORTEST_SHARE) {
            break;
        } else {
            step *= 0.4;
        }
    }
    return status;
}

/* ---- simulation ---- */

static double largest_rate(const struct kl_model *model, const struct kl_input *input,
                           const struct kl_state *state) {
    kl_real rates[KL_MAX_STATES];
    double worst = 0.0;
    kl_rates(model, state, input, rates, cli_work());
    for (uint32_t i = 0; i < state->n_states; i++) {
        worst = fmax(worst, fabs((double)rates[i]));
    }
    return worst;
}

/* Runs until it is as steady as it becomes. The largest rate that is left; HUGE_VAL: derailed. */
static double simulate(const struct kl_model *model, double longest_s, struct kl_state *state) {
    const uint64_t look = (uint64_t)llround(ceil(LOOK_S / (double)model->step_s));
    struct kl_input input;
    double least = HUGE_VAL;
    int waited = 0;
    kl_input_init(&input);
    input.speed_m_s = state->speed_m_s;
    for (double t = 0.0; t < longest_s && waited < PATIENCE; t += LOOK_S) {
        for (uint64_t i = 0; i < look; i++) {
            if ((kl_step(model, state, &input, NULL, cli_work()) & KL_FAULTS_HOLD) != 0) {
                return HUGE_VAL;
            }
        }
        const double now = largest_rate(model, &input, state);
        waited = now < FADES * least ? 0 : waited + 1;
        least = fmin(least, now);
        if (now < ENOUGH) {
            break;
        }
    }
    return largest_rate(model, &input, state);
}

static int fall_back(struct curve_bench *bench, double longest_s, struct curve_result *result) {
    const struct kl_model *model = &bench->m->model;
    const struct modes_request request = {
        .model = model, .names = &bench->names, .speed_m_s = result->at.speed_m_s};
    struct kl_state state;
    struct modes_steady polished;
    struct kl_input input;
    if (kl_init(model, &state, (kl_real)0, (kl_real)request.speed_m_s, cli_work()) != KL_OK) {
        return cli_fail("cannot start at %g m/s", request.speed_m_s);
    }
    int status = modes_steady(&request, NULL, &polished); /* at once, where the way is barred */
    double left = 0.0;
    if (status == CLI_OK && !polished.found) {
        left = simulate(model, longest_s, &state);
        status = isfinite(left) ? modes_steady(&request, &state, &polished) : CLI_OK;
    }
    if (status != CLI_OK) {
        return status;
    }
    if (!isfinite(left)) {
        snprintf(result->why, sizeof result->why, "; simulated there it derails");
    } else if (polished.found && off_table(model, &polished.output) < 0) {
        result->way = CURVE_FOUND;
        result->steady = polished;
    } else if (left < SETTLED) {
        result->way = CURVE_SIMULATED;
        result->steady.state = state;
        result->steady.residual = left;
        kl_input_init(&input);
        input.speed_m_s = state.speed_m_s;
        kl_observe(model, &state, &input, &result->steady.output, cli_work());
    } else {
        snprintf(result->why, sizeof result->why,
                 "; simulated there it does not come to rest (%.1e m/s2 or rad/s2 left)", left);
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

static int judge_stability(struct curve_bench *bench, struct curve_result *r) {
    const struct modes_request request = {
        .model = &bench->m->model, .names = &bench->names, .speed_m_s = r->at.speed_m_s};
    int status = modes_about(&request, &r->steady, &bench->modes);
    r->unstable = status == CLI_OK && bench->modes.largest_real > 0.0;
    return status;
}

/* How far it came, and what it met there. */
static void explain(const struct curve_bench *bench, const struct way *way,
                    struct curve_result *r) {
    const struct kl_model *model = &bench->m->model;
    const struct curve_case reached = between(&way->from, way->to, way->share);
    const int lost = off_table(model, &way->try.output);
    char rest[sizeof r->why];
    snprintf(rest, sizeof rest, "%s", r->why);
    char end[KL_NAME_SIZE + 48] = "";
    if (lost >= 0) {
        snprintf(end, sizeof end, ", beyond which %s leaves its contact table",
                 model->wheelsets[lost].name);
    }
    if (reached.curvature_1_m == 0.0) {
        snprintf(r->why, sizeof r->why, "it cannot be followed from straight track%s%.90s", end,
                 rest);
    } else {
        snprintf(r->why, sizeof r->why, "followed from straight track to R = %.0f m%s%.90s",
                 fabs(1.0 / reached.curvature_1_m), end, rest);
    }
}

static int follow(struct curve_bench *bench, const struct curve_result *before, struct way *way) {
    int status = CLI_OK;
    way->share = 0.0;
    if (before != NULL) {
        way->from = before->at;
        way->here = before->steady.state;
        status = go(bench, way, 1.0);
    }
    if (status == CLI_OK && way->share < 1.0) {
        bool found = false;
        way->from = *way->to;
        way->from.curvature_1_m = 0.0;
        way->from.cant_rad = 0.0;
        way->share = 0.0;
        way->last_share = -1.0;
        const struct modes_request request = {
            .model = &bench->m->model, .names = &bench->names, .speed_m_s = way->to->speed_m_s};
        status = bend(bench, &way->from);
        status = status == CLI_OK ? modes_steady(&request, NULL, &way->try) : status;
        found = status == CLI_OK && way->try.found;
        way->here = way->try.state;
        status = found ? go(bench, way, LONG_SHARE) : status;
    }
    return status;
}

int curve_find(struct curve_bench *bench, const struct curve_case *at,
               const struct curve_result *before, double longest_s, struct curve_result *r) {
    struct way way = {.to = at};
    *r = (struct curve_result){.at = *at, .way = CURVE_NONE};
    int status = follow(bench, before, &way);
    if (status == CLI_OK && way.share >= 1.0) {
        r->way = CURVE_FOUND;
        r->steady = way.try;
    } else if (status == CLI_OK) {
        status = bend(bench, at);
        status = status == CLI_OK ? fall_back(bench, longest_s, r) : status;
    }
    if (status == CLI_OK && r->way == CURVE_NONE) {
        explain(bench, &way, r);
    } else if (status == CLI_OK) {
        add_up(bench->m, r);
        status = judge_stability(bench, r);
    }
    return status;
}
