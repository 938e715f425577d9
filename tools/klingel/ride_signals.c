/* ride_signals.c - simulate and keep. */
#include "ride_signals.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LOOK_EVERY 4096u

/* ---- where ---- */

static struct ride_point *add_point(struct ride_record *r, uint32_t body, double x_m,
                                    double height_m, const char *where) {
    struct ride_point *p = &r->point[r->n_points];
    const struct kl_body *b = &r->model->bodies[body];
    if (r->n_points < RIDE_MAX_POINTS) {
        r->n_points++;
        snprintf(p->name, sizeof p->name, "%s%s%s", b->name, where[0] != '\0' ? " " : "", where);
        p->body = body;
        p->ahead_m = x_m - (double)b->x_m;
        p->height_m = height_m;
    }
    return p;
}

void ride_points(struct ride_record *r, double floor_m) {
    const struct kl_model *m = r->model;
    uint32_t heaviest = 0;
    double ahead = 0.0;
    double behind = 0.0;
    double middle = 0.0;
    double n_ahead = 0.0;
    for (uint32_t b = 0; b < m->n_bodies; b++) {
        heaviest = m->bodies[b].mass_kg > m->bodies[heaviest].mass_kg ? b : heaviest;
    }
    for (uint32_t w = 0; w < m->n_wheelsets; w++) {
        middle += (double)m->wheelsets[w].x_m / m->n_wheelsets;
    }
    for (uint32_t w = 0; w < m->n_wheelsets; w++) {
        const double x = (double)m->wheelsets[w].x_m;
        n_ahead += x > middle;
        ahead += x > middle ? x : 0.0;
        behind += x > middle ? 0.0 : x;
    }
    for (uint32_t b = 0; b < m->n_bodies; b++) {
        if ((m->bodies[b].freedoms & KL_HAS(KL_Y)) == 0 && b != heaviest) {
            continue;
        }
        if (b == heaviest && n_ahead > 0.0) {
            const double front = ahead / n_ahead;
            const double rear = behind / (m->n_wheelsets - n_ahead);
            add_point(r, b, front, floor_m, "front")->floor = true;
            add_point(r, b, 0.5 * (front + rear), floor_m, "middle")->floor = true;
            add_point(r, b, rear, floor_m, "rear")->floor = true;
        } else {
            add_point(r, b, (double)m->bodies[b].x_m, -(double)m->bodies[b].z_m, "")->floor =
                b == heaviest;
        }
    }
}

/* ---- memory ---- */

static bool take(double **series, size_t n) {
    *series = malloc(n * sizeof(double));
    return *series != NULL;
}

static bool take_all(struct ride_record *r, size_t n) {
    bool ok = take(&r->s_m, n);
    for (uint32_t p = 0; p < r->n_points; p++) {
        ok = ok && take(&r->lateral[p], n) && take(&r->vertical[p], n);
    }
    for (uint32_t w = 0; w < r->model->n_wheelsets; w++) {
        ok = ok && take(&r->sum_y_N[w], n);
        for (int s = 0; s < KL_SIDES; s++) {
            ok = ok && take(&r->y_N[w][s], n) && take(&r->q_N[w][s], n);
        }
    }
    return ok;
}

void ride_free(struct ride_record *r) {
    free(r->s_m);
    for (uint32_t p = 0; p < RIDE_MAX_POINTS; p++) {
        free(r->lateral[p]);
        free(r->vertical[p]);
    }
    for (uint32_t w = 0; w < KL_MAX_WHEELSETS; w++) {
        free(r->sum_y_N[w]);
        for (int s = 0; s < KL_SIDES; s++) {
            free(r->y_N[w][s]);
            free(r->q_N[w][s]);
        }
    }
    memset(r, 0, sizeof *r);
}

/* ---- the run ---- */

static void keep(struct ride_record *r, const struct kl_output *o) {
    const size_t i = r->n++;
    r->s_m[i] = (double)o->s_m;
    for (uint32_t p = 0; p < r->n_points; p++) {
        const struct ride_point *point = &r->point[p];
        const struct kl_body_output *b = &o->body[point->body];
        const double below = -point->height_m - (double)r->model->bodies[point->body].z_m;
        r->lateral[p][i] = (double)b->acceleration[KL_Y] +
                           point->ahead_m * (double)b->acceleration[KL_YAW] -
                           below * (double)b->acceleration[KL_ROLL] -
                           (double)r->model->gravity_m_s2 * (double)b->position[KL_ROLL];
        r->vertical[p][i] =
            (double)b->acceleration[KL_Z] - point->ahead_m * (double)b->acceleration[KL_PITCH];
    }
    for (uint32_t w = 0; w < r->model->n_wheelsets; w++) {
        const struct kl_wheelset_output *ws = &o->wheelset[w];
        r->sum_y_N[w][i] = (double)ws->force_y_N;
        for (int s = 0; s < KL_SIDES; s++) {
            const double y = (double)ws->y_N[s];
            r->y_N[w][s][i] = s == KL_RIGHT ? y : -y;
            r->q_N[w][s][i] = (double)ws->q_N[s];
        }
    }
}

int ride_simulate(struct ride_record *r, const struct ride_run *run) {
    const double h = (double)r->model->step_s;
    const double length = run->to_m - run->from_m;
    const uint64_t steps = (uint64_t)ceil(length / (r->speed_m_s * h));
    struct kl_state state;
    struct kl_input input;
    static struct kl_output output; /* large */
    if (!take_all(r, (size_t)steps + 1)) {
        return cli_fail("out of memory for %.0f steps", (double)steps);
    }
    enum kl_status status =
        kl_init(r->model, &state, (kl_real)run->from_m, (kl_real)r->speed_m_s, cli_work());
    if (status != KL_OK) {
        return cli_fail("cannot start: %s", kl_status_text(status));
    }
    kl_input_init(&input);
    input.speed_m_s = (kl_real)r->speed_m_s;
    r->rate_Hz = 1.0 / h;
    for (uint64_t i = 1; i <= steps; i++) {
        r->faults = kl_step(r->model, &state, &input, &output, cli_work());
        r->ended_s = (double)i * h;
        if ((r->faults & KL_FAULTS_HOLD) != 0) {
            return cli_fail("the run ended at s = %.1f m: the vehicle %s", (double)state.s_m,
                            (r->faults & KL_FAULT_DERAILED) != 0 ? "derailed"
                                                                 : "is no longer finite");
        }
        keep(r, &output);
        r->first += (double)output.s_m < run->assess_from_m;
        if (i % LOOK_EVERY == 0) {
            cli_progress_show(run->progress, (double)i / (double)steps, "simulating");
        }
    }
    return CLI_OK;
}
