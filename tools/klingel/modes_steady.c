/* modes_steady.c - damped Newton, and implicit Euler steps where that stalls. */
#include "modes_steady.h"

#include <lapacke.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MAX_NEWTON 40
#define MAX_STEPS 400     /* of implicit Euler */
#define LEAST_SHARE 1e-3  /* of a Newton step */
#define STEADY 1e-9       /* rates below this, relative to their states' scale, are zero */
#define NEARLY 1e3        /* times that is steady but for rounding */
#define FIRST_STEP_S 1e-3 /* of implicit Euler */
#define LEAST_STEP_S 1e-4 /* taken at any rate: the rates may jump there */
#define LONGEST_STEP_S 1e8
#define GOOD 0.1 /* correction over step: below, the next one may be longer */
#define BAD 0.5  /* above, the step is not taken */

struct solver {
    const struct modes_request *request;
    struct kl_input input;
    struct kl_state state;
    struct jacobian_plan plan;
    kl_real rates[KL_MAX_STATES];
    double worst; /* of the rates */
    double tolerance;
    unsigned iterations;
    double *matrix; /* of the steps: I/dt - J, factorised */
    lapack_int pivot[KL_MAX_STATES];
};

static lapack_int size_of(const struct solver *s) {
    return (lapack_int)s->plan.n_states;
}

static void look(struct solver *s) {
    s->worst = 0.0;
    kl_rates(s->request->model, &s->state, &s->input, s->rates, cli_work());
    for (uint32_t i = 0; i < s->plan.n_states; i++) {
        const double rate = fabs((double)s->rates[i]);
        s->worst = rate > s->worst || isnan(rate) ? rate : s->worst;
    }
}

/* ---- steps ---- */

/* I/dt - J, factorised; dt HUGE_VAL: Newton's. A slider that sticks has no rate at all: J is
 * singular, a very long step is not. */
static bool prepare_step(struct solver *s, double dt_s) {
    const struct jacobian_point at = {s->request->model, &s->input, &s->state};
    const lapack_int n = size_of(s);
    const double inverse[2] = {1.0 / dt_s, 1.0 / LONGEST_STEP_S};
    for (int pass = 0; pass < 2; pass++) {
        jacobian(&s->plan, &at, JACOBIAN_PLAIN, 1.0, s->matrix);
        for (lapack_int i = 0; i < n * n; i++) {
            s->matrix[i] = -s->matrix[i];
        }
        for (lapack_int i = 0; i < n; i++) {
            s->matrix[i * n + i] += inverse[pass];
        }
        s->iterations++;
        if (LAPACKE_dgetrf(LAPACK_ROW_MAJOR, n, n, s->matrix, n, s->pivot) == 0) {
            return true;
        }
    }
    return false;
}

/* The step that the rates ask for, less what `step` holds already over dt (NULL: nothing). */
static bool solve(struct solver *s, const double *taken, double dt_s, double *step) {
    const lapack_int n = size_of(s);
    for (lapack_int i = 0; i < n; i++) {
        step[i] = (double)s->rates[i] - (taken != NULL ? taken[i] / dt_s : 0.0);
    }
    return LAPACKE_dgetrs(LAPACK_ROW_MAJOR, 'N', n, 1, s->matrix, n, s->pivot, step, 1) == 0;
}

/* Largest part of a step, in units of the differences' widths: what is small for each state. */
static double length_of(const struct solver *s, const double *step) {
    double worst = 0.0;
    for (uint32_t i = 0; i < s->plan.n_states; i++) {
        const double part = fabs(step[i]) / s->plan.step[i];
        worst = part > worst || isnan(part) ? part : worst;
    }
    return worst;
}

static void go(struct solver *s, const struct kl_state *from, const double *step, double share) {
    for (uint32_t i = 0; i < s->plan.n_states; i++) {
        s->state.x[i] = from->x[i] + (kl_real)(share * step[i]);
    }
    look(s);
}

/* ---- Newton ---- */

/* One step, halved until it helps. False if it does not, or J is singular. */
static bool improve(struct solver *s) {
    double step[KL_MAX_STATES];
    double next[KL_MAX_STATES];
    const struct kl_state before = s->state;
    const double worst = s->worst;
    if (!prepare_step(s, HUGE_VAL) || !solve(s, NULL, HUGE_VAL, step)) {
        return false;
    }
    const double length = length_of(s, step);
    for (double share = 1.0; share > LEAST_SHARE; share *= 0.5) {
        go(s, &before, step, share);
        if (!isfinite(s->worst)) {
            continue;
        }
        if (s->worst < (1.0 - 0.25 * share) * worst ||
            (solve(s, NULL, HUGE_VAL, next) &&
             length_of(s, next) < (1.0 - 0.25 * share) * length)) {
            return true;
        }
    }
    s->state = before;
    look(s);
    return false;
}

static void newton(struct solver *s) {
    for (int i = 0; i < MAX_NEWTON && s->worst > s->tolerance; i++) {
        if (!improve(s)) {
            return;
        }
    }
}

/* ---- implicit Euler ---- */

/* One step of dt, and how long the next may be. The correction that one more iteration would make
 * tells how far the step is from the implicit one. False: it cannot go on. */
static bool advance(struct solver *s, double *dt_s) {
    double step[KL_MAX_STATES];
    double correction[KL_MAX_STATES];
    const struct kl_state before = s->state;
    if (!prepare_step(s, *dt_s) || !solve(s, NULL, *dt_s, step)) {
        return false;
    }
    go(s, &before, step, 1.0);
    const double length = length_of(s, step);
    double off = HUGE_VAL;
    if (isfinite(s->worst) && solve(s, step, *dt_s, correction)) {
        off = length > 0.0 ? length_of(s, correction) / length : 0.0;
    }
    if (!isfinite(s->worst) || (!(off < BAD) && *dt_s > LEAST_STEP_S)) {
        s->state = before;
        look(s);
        *dt_s = fmax(0.2 * *dt_s, LEAST_STEP_S);
        return true;
    }
    *dt_s *= off < GOOD ? 3.0 : 1.0;
    *dt_s = fmin(*dt_s, LONGEST_STEP_S);
    return *dt_s >= LEAST_STEP_S;
}

static void settle(struct solver *s) {
    double dt_s = FIRST_STEP_S;
    for (int i = 0; i < MAX_STEPS && s->worst > s->tolerance; i++) {
        if (!advance(s, &dt_s) || dt_s >= LONGEST_STEP_S) {
            return;
        }
    }
}

/* ---- the whole ---- */

/* Accelerations are sums of forces over masses that cancel: their rounding is the limit. */
static double tolerance(const struct modes_request *request) {
    return (sizeof(kl_real) == sizeof(double) ? STEADY : 1e-2) *
           (1.0 + (double)request->model->gravity_m_s2 + request->speed_m_s);
}

static void iterate(struct solver *s) {
    look(s);
    newton(s);
    if (s->worst > NEARLY * s->tolerance && !s->request->quick) {
        settle(s);
        newton(s);
    }
}

static int start(struct solver *s, const struct kl_state *guess) {
    enum kl_status status = kl_init(s->request->model, &s->state, (kl_real)s->request->at_m,
                                    (kl_real)s->request->speed_m_s, cli_work());
    if (status != KL_OK) {
        return cli_fail("cannot start at %g m/s: %s", s->request->speed_m_s,
                        kl_status_text(status));
    }
    if (guess != NULL) {
        memcpy(s->state.x, guess->x, sizeof s->state.x);
    }
    return CLI_OK;
}

static int find(struct solver *s, const struct kl_state *guess, struct modes_steady *steady) {
    int status = start(s, guess);
    if (status != CLI_OK) {
        return status;
    }
    jacobian_plan(s->request->model, &s->plan);
    iterate(s);
    kl_refresh(s->request->model, &s->state, cli_work());
    steady->state = s->state;
    steady->residual = s->worst;
    steady->found = s->worst <= NEARLY * s->tolerance;
    steady->iterations = s->iterations;
    kl_observe(s->request->model, &s->state, &s->input, &steady->output, cli_work());
    return CLI_OK;
}

int modes_steady(const struct modes_request *request, const struct kl_state *guess,
                 struct modes_steady *steady) {
    const size_t n = request->model->n_states;
    struct solver *s = calloc(1, sizeof *s);
    double *matrix = malloc(n * n * sizeof matrix[0]);
    int status = CLI_OK;
    if (s == NULL || matrix == NULL) {
        status = cli_fail("out of memory");
    } else {
        s->request = request;
        s->matrix = matrix;
        s->tolerance = tolerance(request);
        kl_input_init(&s->input);
        s->input.speed_m_s = (kl_real)request->speed_m_s;
        status = find(s, guess, steady);
    }
    free(matrix);
    free(s);
    return status;
}
