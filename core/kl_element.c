/* kl_element.c - what a force element may be. */
#include "kl_diag.h"
#include "kl_math.h"
#include "kl_reach.h"
#include "kl_suspension.h"

#define MOST_STIFFNESS 1e12
#define LEAST_LENGTH_M 1e-3

static int within(double x, double most) {
    return x >= 0.0 && x < most;
}

static enum kl_status check_ends(const struct kl_vehicle_def *def, const struct kl_element_def *e,
                                 int32_t index, struct kl_diag *diag) {
    const int32_t ends[2] = {e->end_a, e->end_b};
    for (int i = 0; i < 2; i++) {
        if (!kl_is_end(def, ends[i])) {
            return kl_report(diag, KL_ERR_REFERENCE, "element: no such body or wheelset", index,
                             ends[i]);
        }
    }
    if (e->end_a == e->end_b) {
        return kl_report(diag, KL_ERR_REFERENCE, "element: both ends are on the same body", index,
                         e->end_a);
    }
    for (int i = 0; i < 3; i++) {
        if (!(kl_abs(e->point_a_m[i]) < 1e3 && kl_abs(e->point_b_m[i]) < 1e3)) {
            return kl_report(diag, KL_ERR_VALUE, "element: points must be within 1000 m", index,
                             kl_abs(e->point_a_m[i]) < 1e3 ? e->point_b_m[i] : e->point_a_m[i]);
        }
    }
    return KL_OK;
}

static enum kl_status check_linear(const struct kl_element_def *e, int32_t index,
                                   struct kl_diag *diag) {
    for (int i = 0; i < 6; i++) {
        if (!within(e->k[i], MOST_STIFFNESS)) {
            return kl_report(diag, KL_ERR_VALUE, "element: stiffness must be in 0..1e12", index,
                             e->k[i]);
        }
        if (!within(e->c[i], MOST_STIFFNESS)) {
            return kl_report(diag, KL_ERR_VALUE, "element: damping must be in 0..1e12", index,
                             e->c[i]);
        }
    }
    if (!within(e->line_k_N_m, MOST_STIFFNESS) || !within(e->line_c_Ns_m, MOST_STIFFNESS)) {
        return kl_report(diag, KL_ERR_VALUE, "element: stiffness and damping must be in 0..1e12",
                         index, e->line_k_N_m);
    }
    if ((int)e->sway < 0 || e->sway > KL_SWAY_PINNED) {
        return kl_report(diag, KL_ERR_VALUE, "element: unknown sway", index, (double)e->sway);
    }
    const double apart[3] = {e->point_a_m[0] - e->point_b_m[0], e->point_a_m[1] - e->point_b_m[1],
                             e->point_a_m[2] - e->point_b_m[2]};
    if (e->sway == KL_SWAY_CLAMPED && (apart[0] != 0.0 || apart[1] != 0.0 || apart[2] != 0.0)) {
        return kl_report(diag, KL_ERR_VALUE,
                         "element: sway clamped wants one point, at half the spring's height",
                         index, apart[2]);
    }
    if (e->sway == KL_SWAY_PINNED && !(kl_abs(apart[2]) >= LEAST_LENGTH_M)) {
        return kl_report(diag, KL_ERR_VALUE,
                         "element: sway pinned wants points one above the other", index, apart[2]);
    }
    return KL_OK;
}

/* Growing, never falling, through the origin. */
static enum kl_status check_table(const struct kl_table_def *t, int32_t index,
                                  struct kl_diag *diag) {
    if (t->n == 0) {
        return KL_OK;
    }
    if (t->n < 2 || t->n > KL_MAX_TABLE_POINTS || t->at == NULL || t->force == NULL) {
        return kl_report(diag, KL_ERR_VALUE, "element: a table needs 2 to 32 points", index, t->n);
    }
    for (uint32_t i = 0; i < t->n; i++) {
        if (!(kl_abs(t->at[i]) < 1e3 && kl_abs(t->force[i]) < 1e9)) {
            return kl_report(diag, KL_ERR_VALUE, "element: table values are too large", index,
                             t->at[i]);
        }
        if (i > 0 && !(t->at[i] - t->at[i - 1] >= 1e-9)) {
            return kl_report(diag, KL_ERR_VALUE, "element: the first row of a table must grow",
                             index, t->at[i]);
        }
        if (i > 0 && !(t->force[i] >= t->force[i - 1])) {
            return kl_report(diag, KL_ERR_VALUE, "element: the force of a table must not fall",
                             index, t->force[i]);
        }
    }
    if (!(t->at[0] <= 0.0 && t->at[t->n - 1] >= 0.0)) {
        return kl_report(diag, KL_ERR_VALUE, "element: a table must reach to 0 from both sides",
                         index, t->at[0]);
    }
    for (uint32_t i = 0; i + 1 < t->n; i++) {
        const double low = t->at[i];
        const double high = t->at[i + 1];
        if (low <= 0.0 && high >= 0.0) {
            const double there =
                t->force[i] + (t->force[i + 1] - t->force[i]) * (-low / (high - low));
            const double size = kl_abs(t->force[i]) + kl_abs(t->force[i + 1]);
            if (kl_abs(there) > 1e-9 * size) {
                return kl_report(diag, KL_ERR_VALUE, "element: the force of a table must be 0 at 0",
                                 index, there);
            }
        }
    }
    return KL_OK;
}

static enum kl_status check_directed(const struct kl_element_def *e, int32_t index,
                                     struct kl_diag *diag) {
    const struct kl_slip_def *s = &e->slip;
    if (!within(s->k, MOST_STIFFNESS) || !within(s->c, MOST_STIFFNESS) || !within(s->limit, 1e9)) {
        return kl_report(diag, KL_ERR_VALUE,
                         "element: stiffness and damping must be in 0..1e12, a limit in 0..1e9",
                         index, s->k);
    }
    const int asks = s->c != 0.0 || s->limit != 0.0;
    if ((s->k == 0.0 && asks) || (s->k != 0.0 && !asks)) {
        return kl_report(diag, KL_ERR_VALUE,
                         "element: a spring in series needs its stiffness, and a damper or a limit",
                         index, s->k);
    }
    if (s->k != 0.0 && (s->k < 1.0 || (s->c != 0.0 && s->c < 1e-3))) {
        return kl_report(diag, KL_ERR_VALUE,
                         "element: in series stiffness must be 1, damping 0.001 at least", index,
                         s->k);
    }
    if (e->actuator > KL_MAX_ACTUATORS) {
        return kl_report(diag, KL_ERR_CAPACITY, "element: no such actuator input", index,
                         e->actuator);
    }
    enum kl_status status = check_table(&e->stop, index, diag);
    status = status == KL_OK ? check_table(&e->damper, index, diag) : status;
    return status;
}

static int has_direction(const struct kl_element_def *e) {
    return e->slip.k != 0.0 || e->stop.n != 0 || e->damper.n != 0 || e->actuator != 0;
}

/* A direction in which neither end can move would be an element without effect. */
static enum kl_status check_reach(const struct kl_assembly *as, const struct kl_element_def *e,
                                  int32_t index, struct kl_diag *diag) {
    double square = 0.0;
    for (int i = 0; i < 3; i++) {
        const double apart = e->point_a_m[i] - e->point_b_m[i];
        square += apart * apart;
    }
    const int on_line = e->line_k_N_m > 0.0 || e->line_c_Ns_m > 0.0 ||
                        (has_direction(e) && e->along == KL_ALONG_LINE);
    if (on_line && !(square >= LEAST_LENGTH_M * LEAST_LENGTH_M)) {
        return kl_report(diag, KL_ERR_VALUE, "element: its points are no line", index, square);
    }
    if (!has_direction(e)) {
        return KL_OK;
    }
    if ((int)e->along < 0 || e->along > KL_ALONG_LINE) {
        return kl_report(diag, KL_ERR_VALUE, "element: unknown direction", index, (double)e->along);
    }
    struct kl_reach reach;
    kl_reach_element(as, e, e->along, &reach);
    if (reach.n == 0) {
        return kl_report(diag, KL_ERR_VALUE, "element: neither end can move in its direction",
                         index, (double)e->along);
    }
    return KL_OK;
}

enum kl_status kl_elements_check(const struct kl_assembly *as, struct kl_diag *diag) {
    enum kl_status status = KL_OK;
    uint32_t slips = 0;
    for (uint32_t i = 0; i < as->def->n_elements && status == KL_OK; i++) {
        const struct kl_element_def *e = &as->def->elements[i];
        const int32_t index = (int32_t)i;
        status = check_ends(as->def, e, index, diag);
        status = status == KL_OK ? check_linear(e, index, diag) : status;
        status = status == KL_OK ? check_directed(e, index, diag) : status;
        status = status == KL_OK ? check_reach(as, e, index, diag) : status;
        slips += e->slip.k != 0.0 ? 1u : 0u;
        if (status == KL_OK && slips > KL_MAX_SLIPS) {
            status = kl_report(diag, KL_ERR_CAPACITY,
                               "element: more series dampers and friction elements than "
                               "KL_MAX_SLIPS",
                               index, slips);
        }
    }
    return status;
}
