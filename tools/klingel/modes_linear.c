/* modes_linear.c - eigenvalues about a steady state. */
#include "modes_linear.h"

#include <float.h>
#include <lapacke.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "modes_steady.h"

#define N KL_MAX_STATES

struct linear {
    const struct modes_request *request;
    struct jacobian_plan plan;
    double matrix[N * N]; /* row by row; LAPACK writes over it */
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
        const int32_t twist = kl_wheelset_state_index(model, w, KL_WS_TWIST);
        if (twist >= 0) {
            add_name(names, ws->name, "twist", -1, twist, (double)ws->inertia_spin_kgm2);
        }
    }
}

/* ---- eigenvalues ---- */

struct eigen {
    double real[N];
    double imag[N];
    double right[N * N];
};

static int solve(struct linear *l, bool vectors, struct eigen *e) {
    double *matrix = l->matrix;
    const lapack_int n = (lapack_int)l->request->model->n_states;
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
    const uint32_t n = l->request->model->n_states;
    const bool pair = e->imag[k] != 0.0;
    const bool neutral = hypot(e->real[k], e->imag[k]) <= MODES_NEUTRAL;
    double share[MODES_FREEDOMS];
    double phase[MODES_FREEDOMS];
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
    const uint32_t n = l->request->model->n_states;
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
    for (uint32_t k = 0; k < l->request->model->n_states; k++) {
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

/* ---- the whole ---- */

static int find_steady(const struct modes_request *request, struct modes_steady *steady) {
    int status = modes_steady(request, NULL, steady);
    if (status == CLI_OK && !steady->found) {
        return cli_fail("no steady state at %g m/s, s = %g m: a rate of %g is left. Is the whole "
                        "vehicle on one curvature there, and stable?",
                        request->speed_m_s, request->at_m, steady->residual);
    }
    return status;
}

static int find_modes(struct linear *l, struct eigen e[2], struct modes *modes) {
    const struct modes_request *request = l->request;
    struct kl_input input;
    kl_input_init(&input);
    input.speed_m_s = (kl_real)request->speed_m_s;
    const struct jacobian_point at = {request->model, &input, &modes->state};
    int status = CLI_OK;
    modes->n = request->model->n_states;
    modes->insensitivity = 0.0;
    jacobian_plan(request->model, &l->plan);
    if (request->check) {
        jacobian(&l->plan, &at, JACOBIAN_EXACT, 4.0, l->matrix);
        status = solve(l, false, &e[1]);
    }
    jacobian(&l->plan, &at, JACOBIAN_EXACT, 1.0, l->matrix);
    status = status == CLI_OK ? solve(l, request->parts, &e[0]) : status;
    if (status == CLI_OK) {
        collect(l, &e[0], modes);
        modes->insensitivity = request->check ? compare(&e[0], &e[1], modes->n) : 0.0;
    }
    return status;
}

int modes_about(const struct modes_request *request, const struct modes_steady *steady,
                struct modes *modes) {
    static struct linear l; /* too large for a stack */
    static struct eigen e[2];
    modes->state = steady->state;
    modes->output = steady->output;
    modes->residual = steady->residual;
    l.request = request;
    return find_modes(&l, e, modes);
}

int modes_find(const struct modes_request *request, struct modes *modes) {
    static struct modes_steady steady;
    int status = find_steady(request, &steady);
    return status == CLI_OK ? modes_about(request, &steady, modes) : status;
}
