/* modes_linear.c - steady state, Jacobian and eigenvalues. */
#include "modes_linear.h"

#include <float.h>
#include <lapacke.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define N KL_MAX_STATES
#define MAX_NEWTON 40
#define MAX_SETTLE 3000
#define LONG_S 1e8
#define STEADY 1e-9 /* rates below this, relative to their states' scale, are zero */

/* Differences: small against table steps and creep saturation, large against rounding. */
#define STEP_POSITION 1e-7 /* m, rad */
#define STEP_RATE 1e-6     /* m/s, rad/s */
#define STEP_SPIN 1e-5     /* rad/s */

struct linear {
    const struct modes_request *request;
    struct kl_input input;
    struct kl_state state;
    double step[N];
    double matrix[N * N]; /* row by row */
};

/* ---- names ---- */

static void add_name(struct modes_names *names, const char *part, const char *what,
                     int32_t position, int32_t rate, double inertia) {
    snprintf(names->freedom[names->n].name, sizeof names->freedom[0].name, "%s.%s", part, what);
    names->freedom[names->n].position = position;
    names->freedom[names->n].rate = rate;
    names->freedom[names->n].inertia = inertia;
    names->n++;
}

void modes_name(const struct kl_model *model, struct modes_names *names) {
    static const char *const word[KL_FREEDOMS] = {"y", "z", "roll", "pitch", "yaw"};
    memset(names, 0, sizeof *names);
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        const struct kl_body *body = &model->bodies[b];
        for (int f = 0; f < KL_FREEDOMS; f++) {
            int32_t rate = kl_body_state_index(model, b, (enum kl_freedom)f, 1);
            if (rate >= 0) {
                add_name(names, body->name, word[f],
                         kl_body_state_index(model, b, (enum kl_freedom)f, 0), rate,
                         (double)(f < KL_ROLL ? body->mass_kg : body->inertia_kgm2[f - KL_ROLL]));
            }
        }
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct kl_wheelset *ws = &model->wheelsets[w];
        add_name(names, ws->name, "y", kl_wheelset_state_index(model, w, KL_WS_Y),
                 kl_wheelset_state_index(model, w, KL_WS_Y_RATE), (double)ws->mass_kg);
        add_name(names, ws->name, "yaw", kl_wheelset_state_index(model, w, KL_WS_YAW),
                 kl_wheelset_state_index(model, w, KL_WS_YAW_RATE), (double)ws->inertia_yaw_kgm2);
        add_name(names, ws->name, "spin", -1, kl_wheelset_state_index(model, w, KL_WS_SPIN),
                 (double)ws->inertia_spin_kgm2);
    }
}

/* ---- Jacobian ---- */

static void rates_at(const struct linear *l, uint32_t state, double displacement, kl_real *rates) {
    struct kl_state moved = l->state;
    moved.x[state] += (kl_real)displacement;
    kl_rates(l->request->model, &moved, &l->input, rates, cli_work());
}

/* The distance that is really between x + h and x - h, after rounding. */
static double width(const struct linear *l, uint32_t state, double h) {
    volatile kl_real high = l->state.x[state] + (kl_real)h;
    volatile kl_real low = l->state.x[state] - (kl_real)h;
    return (double)(high - low);
}

/*
 * One column. A saturating creep law has |creepage| in it: central differences of that have an
 * error of the first order in the step. Two steps, extrapolated to zero, take it away, and leave
 * what is smooth as it was.
 */
static void differentiate(struct linear *l, uint32_t column, double factor) {
    kl_real high[N];
    kl_real low[N];
    const uint32_t n = l->state.n_states;
    for (int pass = 0; pass < 2; pass++) {
        double h = l->step[column] * factor * (pass == 0 ? 1.0 : 0.5);
        double weight = pass == 0 ? -1.0 : 2.0;
        double inverse = weight / width(l, column, h);
        rates_at(l, column, h, high);
        rates_at(l, column, -h, low);
        for (uint32_t i = 0; i < n; i++) {
            double *at = &l->matrix[i * n + column];
            *at = (pass == 0 ? 0.0 : *at) + inverse * ((double)high[i] - (double)low[i]);
        }
    }
}

static void linearise(struct linear *l, double factor) {
    for (uint32_t i = 0; i < l->state.n_states; i++) {
        differentiate(l, i, factor);
    }
}

/* ---- steady state ---- */

static double residual(const struct linear *l, kl_real *rates) {
    double worst = 0.0;
    kl_rates(l->request->model, &l->state, &l->input, rates, cli_work());
    for (uint32_t i = 0; i < l->state.n_states; i++) {
        double rate = fabs((double)rates[i]);
        worst = rate > worst || isnan(rate) ? rate : worst;
    }
    return worst;
}

/* Solves (I/dt - J) step = rates; dt HUGE_VAL is Newton's step. False if that is singular. */
static bool find_step(struct linear *l, const kl_real *rates, double dt_s, double step[N]) {
    double matrix[N * N];
    lapack_int pivot[N];
    const lapack_int n = (lapack_int)l->state.n_states;
    linearise(l, 1.0);
    for (lapack_int i = 0; i < n * n; i++) {
        matrix[i] = -l->matrix[i];
    }
    for (lapack_int i = 0; i < n; i++) {
        matrix[i * n + i] += 1.0 / dt_s;
        step[i] = (double)rates[i];
    }
    return LAPACKE_dgesv(LAPACK_ROW_MAJOR, n, 1, matrix, n, pivot, step, 1) == 0;
}

static void go(struct linear *l, const struct kl_state *from, const double step[N], double share) {
    for (uint32_t i = 0; i < l->state.n_states; i++) {
        l->state.x[i] = from->x[i] + (kl_real)(share * step[i]);
    }
}

/* One Newton step, halved until it helps. False if it does not, or J is singular. */
static bool improve(struct linear *l, kl_real *rates, double *worst) {
    double step[N];
    const struct kl_state before = l->state;
    /* a slider that sticks has no rate at all: J is singular, a very long step is not */
    if (!find_step(l, rates, HUGE_VAL, step) && !find_step(l, rates, LONG_S, step)) {
        return false;
    }
    for (double share = 1.0; share > 1e-3; share *= 0.5) {
        go(l, &before, step, share);
        double now = residual(l, rates);
        if (now < *worst) {
            *worst = now;
            return true;
        }
    }
    l->state = before;
    (void)residual(l, rates);
    return false;
}

/*
 * Follows the motion by implicit Euler, in longer and longer steps as it comes to rest: this gets
 * past the kinks of the tables, where Newton's steps go to and fro, but finds stable states only.
 */
static void settle(struct linear *l, kl_real *rates, double *worst, double enough) {
    double dt_s = 1e-3;
    for (int i = 0; i<MAX_SETTLE && * worst> enough; i++) {
        double step[N];
        const struct kl_state before = l->state;
        if (!find_step(l, rates, dt_s, step)) {
            return;
        }
        go(l, &before, step, 1.0);
        double now = residual(l, rates);
        double ratio = *worst / now;
        if (!isfinite(now) || ratio < 1e-2) {
            l->state = before;
            (void)residual(l, rates);
            dt_s *= 0.1;
            continue;
        }
        dt_s *= fmin(fmax(ratio, 0.3), 2.0);
        dt_s = fmin(fmax(dt_s, 1e-4), 1e6);
        *worst = now;
    }
}

/* Accelerations are sums of forces over masses that cancel: their rounding is the limit. */
static double tolerance(const struct linear *l) {
    return (sizeof(kl_real) == sizeof(double) ? STEADY : 1e-2) *
           (1.0 + (double)l->request->model->gravity_m_s2 + l->request->speed_m_s);
}

/* Newton's steps, and settling where they do not help. */
static void iterate(struct linear *l, double *worst) {
    kl_real rates[N];
    *worst = residual(l, rates);
    for (int i = 0; i<MAX_NEWTON && * worst> tolerance(l); i++) {
        if (!improve(l, rates, worst)) {
            break;
        }
    }
    if (*worst > tolerance(l)) {
        settle(l, rates, worst, tolerance(l));
    }
}

static bool is_steady(const struct linear *l, double worst) {
    return worst <= 1e3 * tolerance(l);
}

static int start(struct linear *l) {
    enum kl_status status = kl_init(l->request->model, &l->state, (kl_real)l->request->at_m,
                                    (kl_real)l->request->speed_m_s, cli_work());
    if (status != KL_OK) {
        return cli_fail("cannot start at %g m/s: %s", l->request->speed_m_s,
                        kl_status_text(status));
    }
    return CLI_OK;
}

static int find_steady(struct linear *l, double *worst) {
    int status = start(l);
    if (status != CLI_OK) {
        return status;
    }
    iterate(l, worst);
    if (!is_steady(l, *worst)) {
        return cli_fail("no steady state at %g m/s, s = %g m: a rate of %g is left. Is the whole "
                        "vehicle on one curvature there, and stable?",
                        l->request->speed_m_s, l->request->at_m, *worst);
    }
    return CLI_OK;
}

/* ---- eigenvalues ---- */

struct eigen {
    double real[N];
    double imag[N];
    double right[N * N];
};

static int solve(const struct linear *l, bool vectors, struct eigen *e) {
    double matrix[N * N];
    const lapack_int n = (lapack_int)l->state.n_states;
    memcpy(matrix, l->matrix, sizeof matrix);
    for (lapack_int i = 0; i < n * n; i++) {
        if (!isfinite(matrix[i])) {
            return cli_fail("the linearised model is not finite");
        }
    }
    lapack_int info = LAPACKE_dgeev(LAPACK_ROW_MAJOR, 'N', vectors ? 'V' : 'N', n, matrix, n,
                                    e->real, e->imag, NULL, 1, e->right, n);
    return info == 0 ? CLI_OK : cli_fail("the eigenvalues did not converge (dgeev: %d)", (int)info);
}

/* Largest relative distance of an eigenvalue of `a` to its nearest in `b`. Of two that nearly
 * coincide both move as the root of the error: no fault of the differences. */
static double compare(const struct eigen *a, const struct eigen *b, uint32_t n) {
    double worst = 0.0;
    for (uint32_t i = 0; i < n; i++) {
        double size = hypot(a->real[i], a->imag[i]);
        double least = HUGE_VAL;
        for (uint32_t k = 0; k < n; k++) {
            least = fmin(least, hypot(a->real[i] - b->real[k], a->imag[i] - b->imag[k]));
        }
        if (size > MODES_NEUTRAL) {
            worst = fmax(worst, least / size);
        }
    }
    return worst;
}

/* ---- which freedoms ---- */

static void find_parts(const struct linear *l, const struct eigen *e, uint32_t k,
                       struct mode *mode) {
    const struct modes_names *names = l->request->names;
    const uint32_t n = l->state.n_states;
    const bool pair = e->imag[k] != 0.0;
    const bool neutral = hypot(e->real[k], e->imag[k]) <= MODES_NEUTRAL;
    double share[KL_FREEDOMS * KL_MAX_BODIES + 3 * KL_MAX_WHEELSETS];
    double phase[KL_FREEDOMS * KL_MAX_BODIES + 3 * KL_MAX_WHEELSETS];
    double total = 0.0;
    for (uint32_t f = 0; f < names->n; f++) {
        int32_t position = names->freedom[f].position;
        int32_t state = neutral && position >= 0 ? position : names->freedom[f].rate;
        double re = e->right[(uint32_t)state * n + k];
        double im = pair ? e->right[(uint32_t)state * n + k + 1] : 0.0;
        share[f] = names->freedom[f].inertia * (re * re + im * im);
        phase[f] = atan2(im, re);
        total += share[f];
    }
    mode->n_parts = 0;
    while (mode->n_parts < 3 && mode->n_parts < names->n && total > 0.0) {
        uint32_t best = 0;
        for (uint32_t f = 1; f < names->n; f++) {
            best = share[f] > share[best] ? f : best;
        }
        if (mode->n_parts > 0 && share[best] < 0.05 * total) {
            break;
        }
        mode->part[mode->n_parts].freedom = best;
        mode->part[mode->n_parts].share = share[best] / total;
        mode->part[mode->n_parts].phase_rad =
            mode->n_parts == 0 ? 0.0 : phase[best] - phase[mode->part[0].freedom];
        mode->n_parts++;
        share[best] = -1.0;
    }
}

/* LAPACK keeps a pair as its real part in one column and its imaginary part in the next. */
static void keep_vector(const struct linear *l, const struct eigen *e, uint32_t k,
                        struct modes *modes) {
    const uint32_t n = l->state.n_states;
    for (uint32_t i = 0; i < n; i++) {
        modes->vector_re[i * n + k] = e->right[i * n + k];
        modes->vector_im[i * n + k] = e->imag[k] != 0.0 ? e->right[i * n + k + 1] : 0.0;
    }
}

static int by_frequency(const void *a, const void *b) {
    const struct mode *x = a;
    const struct mode *y = b;
    if (x->imag != y->imag) {
        return x->imag < y->imag ? -1 : 1;
    }
    return (x->real < y->real) - (x->real > y->real);
}

static void collect(const struct linear *l, const struct eigen *e, struct modes *modes) {
    modes->n_modes = 0;
    modes->n_neutral = 0;
    modes->largest_real = -HUGE_VAL;
    for (uint32_t k = 0; k < l->state.n_states; k++) {
        if (hypot(e->real[k], e->imag[k]) <= MODES_NEUTRAL) {
            modes->n_neutral++;
        } else {
            modes->largest_real = fmax(modes->largest_real, e->real[k]);
        }
        if (e->imag[k] < 0.0) {
            continue;
        }
        struct mode *mode = &modes->mode[modes->n_modes++];
        *mode = (struct mode){.real = e->real[k], .imag = e->imag[k], .column = k};
        if (l->request->parts) {
            find_parts(l, e, k, mode);
            keep_vector(l, e, k, modes);
        }
    }
    qsort(modes->mode, modes->n_modes, sizeof modes->mode[0], by_frequency);
}

static void set_steps(struct linear *l) {
    const struct modes_names *names = l->request->names;
    const double wider = sizeof(kl_real) == sizeof(double) ? 1.0 : 1e3;
    for (uint32_t i = 0; i < l->request->model->n_states; i++) {
        l->step[i] = STEP_POSITION * wider; /* what is no freedom's: series dampers, sliders */
    }
    for (uint32_t f = 0; f < names->n; f++) {
        const bool spin = names->freedom[f].position < 0;
        if (!spin) {
            l->step[names->freedom[f].position] = STEP_POSITION * wider;
        }
        l->step[names->freedom[f].rate] = (spin ? STEP_SPIN : STEP_RATE) * wider;
    }
}

static void prepare(struct linear *l, const struct modes_request *request) {
    memset(l, 0, sizeof *l);
    l->request = request;
    kl_input_init(&l->input);
    l->input.speed_m_s = (kl_real)request->speed_m_s;
    set_steps(l);
}

int modes_find(const struct modes_request *request, struct modes *modes) {
    static struct linear l; /* too large for a stack */
    static struct eigen e[2];
    prepare(&l, request);
    int status = find_steady(&l, &modes->residual);
    if (status != CLI_OK) {
        return status;
    }
    modes->n = l.state.n_states;
    modes->state = l.state;
    kl_observe(request->model, &l.state, &l.input, &modes->output, cli_work());
    modes->insensitivity = 0.0;
    if (request->check) {
        linearise(&l, 4.0);
        status = solve(&l, false, &e[1]);
    }
    linearise(&l, 1.0);
    status = status == CLI_OK ? solve(&l, request->parts, &e[0]) : status;
    if (status == CLI_OK) {
        collect(&l, &e[0], modes);
        modes->insensitivity = request->check ? compare(&e[0], &e[1], modes->n) : 0.0;
    }
    return status;
}

int modes_steady(const struct modes_request *request, const struct kl_state *guess,
                 struct modes_steady *steady) {
    static struct linear l;
    prepare(&l, request);
    int status = start(&l);
    if (status != CLI_OK) {
        return status;
    }
    if (guess != NULL) {
        memcpy(l.state.x, guess->x, sizeof l.state.x);
    }
    iterate(&l, &steady->residual);
    steady->found = is_steady(&l, steady->residual);
    kl_refresh(request->model, &l.state, cli_work());
    steady->state = l.state;
    kl_observe(request->model, &l.state, &l.input, &steady->output, cli_work());
    return CLI_OK;
}
