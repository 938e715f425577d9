/* kl_strut_build.c - the elements that are not linear, as the step wants them. */
#include "kl_diag.h"
#include "kl_math.h"
#include "kl_reach.h"
#include "kl_suspension.h"

/* The deflection of a spring that no limit holds, m. */
#define NO_LIMIT_M 1e30

enum part { SLIP = 0, STOP, DAMPER, ACTUATOR, PARTS };

static int has_part(const struct kl_element_def *e, enum part part) {
    switch (part) {
    case SLIP:
        return e->slip.k != 0.0;
    case STOP:
        return e->stop.n != 0;
    case DAMPER:
        return e->damper.n != 0;
    default:
        return e->actuator != 0;
    }
}

/* ---- series spring and damper ---- */

/* (e^-z - (1 - e^-z)/z)/z, without the cancellation of small z: -1/2 + z/3 - z^2/8 + ... */
static double carried(double z, double decay) {
    if (z > 0.5) {
        return (decay - (1.0 - decay) / z) / z;
    }
    double sum = 0.0;
    double term = 0.5; /* z^(n-1)/(n+1)! */
    double sign = -1.0;
    for (int n = 1; n < 18; n++) {
        sum += sign * (double)n * term;
        term *= z / (double)(n + 2);
        sign = -sign;
    }
    return sum;
}

/* (1 - e^-z)/z. */
static double gained(double z, double decay) {
    if (z > 0.5) {
        return (1.0 - decay) / z;
    }
    double sum = 0.0;
    double term = 1.0; /* (-z)^n/(n+1)! */
    for (int n = 0; n < 18; n++) {
        sum += term;
        term *= -z / (double)(n + 2);
    }
    return sum;
}

static void set_slip(const struct kl_slip_def *from, double step_s, struct kl_slip *to) {
    to->k = (kl_real)from->k;
    to->most_m = (kl_real)(from->limit > 0.0 ? from->limit / from->k : NO_LIMIT_M);
    to->inv_c = KL_R(0);
    to->gain = KL_R(1);
    to->carry = KL_R(0);
    if (from->c != 0.0) {
        const double z = step_s * (from->k / from->c);
        const double decay = z < 700.0 ? kl_exp(-z) : 0.0;
        to->inv_c = (kl_real)(1.0 / from->c);
        to->gain = (kl_real)gained(z, decay);
        to->carry = (kl_real)(step_s * carried(z, decay));
    }
}

/* ---- tables ---- */

static double slope_of(const struct kl_table_def *t, uint32_t i) {
    return (t->force[i + 1] - t->force[i]) / (t->at[i + 1] - t->at[i]);
}

static void add_bend(struct kl_bend *bend, uint32_t *n, double at, double slope) {
    if (slope != 0.0) {
        if (bend != NULL) {
            bend[*n].at = (kl_real)at;
            bend[*n].slope = (kl_real)slope;
        }
        (*n)++;
    }
}

/* Away from 0, above it (side 0) or below (side 1): the first slope at 0, then the changes. NULL
 * counts. */
static void bends_of(const struct kl_table_def *t, int side, struct kl_bend *bend, uint32_t *n) {
    double before = 0.0;
    for (uint32_t k = 0; k + 1 < t->n; k++) {
        const uint32_t i = side == 0 ? k : t->n - 2u - k;
        const double start = side == 0 ? t->at[i] : t->at[i + 1];
        const double end = side == 0 ? t->at[i + 1] : t->at[i];
        const int beyond = side == 0 ? end > 0.0 : end < 0.0;
        if (beyond) {
            const int first = side == 0 ? start <= 0.0 : start >= 0.0;
            const double slope = slope_of(t, i);
            add_bend(bend, n, first ? 0.0 : start, slope - before);
            before = slope;
        }
    }
}

/* ---- all of them ---- */

/* Room for everything, to be filled. */
struct parts {
    uint16_t *term_start;
    uint16_t *column;
    kl_real *factor;
    struct kl_slip *slip;
    uint16_t *bend_start;
    struct kl_bend *bend;
    uint16_t *input;
};

static void count(const struct kl_assembly *as, struct kl_struts *s) {
    uint32_t n[PARTS] = {0};
    for (uint32_t i = 0; i < as->def->n_elements; i++) {
        const struct kl_element_def *e = &as->def->elements[i];
        struct kl_reach reach;
        kl_reach_element(as, e, e->along, &reach);
        for (int part = 0; part < PARTS; part++) {
            const int has = has_part(e, (enum part)part);
            n[part] += has ? 1u : 0u;
            s->n_terms += has ? reach.n : 0u;
        }
        for (int side = 0; side < 2; side++) {
            bends_of(&e->stop, side, NULL, &s->n_bends);
            bends_of(&e->damper, side, NULL, &s->n_bends);
        }
    }
    for (uint32_t i = 0; i < as->def->n_linkages; i++) {
        const struct kl_linkage_def *linkage = &as->def->linkages[i];
        struct kl_reach reach;
        kl_reach_linkage(as->def, linkage, &reach);
        n[SLIP] += linkage->rigid ? 1u : 0u;
        s->n_terms += linkage->rigid ? reach.n : 0u;
    }
    s->n_slips = n[SLIP];
    s->n_stops = n[STOP];
    s->n_dampers = n[DAMPER];
    s->n_actuators = n[ACTUATOR];
}

static int take(struct kl_arena *arena, struct kl_struts *s, struct parts *p) {
    const uint32_t tables = 2u * (s->n_stops + s->n_dampers);
    p->term_start = kl_arena_take(arena, kl_count_struts(s) + 1u, sizeof *p->term_start);
    p->column = kl_arena_take(arena, s->n_terms, sizeof *p->column);
    p->factor = kl_arena_take(arena, s->n_terms, sizeof *p->factor);
    p->slip = kl_arena_take(arena, s->n_slips, sizeof *p->slip);
    p->bend_start = kl_arena_take(arena, tables + 1u, sizeof *p->bend_start);
    p->bend = kl_arena_take(arena, s->n_bends, sizeof *p->bend);
    p->input = kl_arena_take(arena, s->n_actuators, sizeof *p->input);
    s->term_start = p->term_start;
    s->column = p->column;
    s->factor = p->factor;
    s->slip = p->slip;
    s->bend_start = p->bend_start;
    s->bend = p->bend;
    s->input = p->input;
    return p->term_start != NULL && p->column != NULL && p->factor != NULL && p->slip != NULL &&
           p->bend_start != NULL && p->bend != NULL && p->input != NULL;
}

/* What was filled so far. */
struct filled {
    uint32_t struts;
    uint32_t terms;
    uint32_t bends;
    uint32_t tables;
    uint32_t slips;
    uint32_t inputs;
};

static void fill_table(const struct kl_table_def *t, struct parts *p, struct filled *f) {
    for (int side = 0; side < 2; side++) {
        p->bend_start[f->tables++] = (uint16_t)f->bends;
        bends_of(t, side, p->bend, &f->bends);
    }
}

static void fill_terms(const struct kl_reach *reach, struct parts *p, struct filled *f) {
    p->term_start[f->struts++] = (uint16_t)f->terms;
    for (uint32_t t = 0; t < reach->n; t++) {
        p->column[f->terms] = (uint16_t)reach->coordinate[t];
        p->factor[f->terms++] = (kl_real)reach->factor[t];
    }
}

/* Of rigid linkages. */
static void fill_linkages(const struct kl_vehicle_def *def, struct parts *p, struct filled *f) {
    for (uint32_t i = 0; i < def->n_linkages; i++) {
        if (def->linkages[i].rigid) {
            struct kl_reach reach;
            struct kl_linkage_rates rates;
            kl_reach_linkage(def, &def->linkages[i], &reach);
            kl_linkage_rates(def, i, &rates);
            fill_terms(&reach, p, f);
            set_slip(&rates.slip, (double)def->step_ns * 1e-9, &p->slip[f->slips++]);
        }
    }
}

static void fill(const struct kl_assembly *as, const struct kl_element_def *e, enum part part,
                 struct parts *p, struct filled *f) {
    struct kl_reach reach;
    kl_reach_element(as, e, e->along, &reach);
    fill_terms(&reach, p, f);
    switch (part) {
    case SLIP:
        set_slip(&e->slip, (double)as->def->step_ns * 1e-9, &p->slip[f->slips++]);
        break;
    case STOP:
        fill_table(&e->stop, p, f);
        break;
    case DAMPER:
        fill_table(&e->damper, p, f);
        break;
    default:
        p->input[f->inputs++] = (uint16_t)(e->actuator - 1u);
        break;
    }
}

enum kl_status kl_struts_build(const struct kl_vehicle_def *def, const double *axle_z_m,
                               struct kl_arena *arena, struct kl_struts *struts,
                               struct kl_diag *diag) {
    const struct kl_assembly as = {def, axle_z_m, NULL};
    const struct kl_struts blank = {0};
    struct parts p;
    struct filled f = {0};
    *struts = blank;
    count(&as, struts);
    if (kl_count_struts(struts) == 0) {
        return KL_OK;
    }
    if (struts->n_slips > KL_MAX_SLIPS) {
        return kl_report(diag, KL_ERR_CAPACITY,
                         "vehicle: more series dampers, friction elements and rigid linkages than "
                         "KL_MAX_SLIPS",
                         -1, struts->n_slips);
    }
    if (struts->n_terms > UINT16_MAX || struts->n_bends > UINT16_MAX) {
        return kl_report(diag, KL_ERR_CAPACITY, "vehicle: too many elements that are not linear",
                         -1, struts->n_terms);
    }
    if (!take(arena, struts, &p)) {
        return kl_report(diag, KL_ERR_MEMORY, "elements", -1, (double)arena->wanted);
    }
    for (int part = 0; part < PARTS; part++) {
        for (uint32_t i = 0; i < def->n_elements; i++) {
            if (has_part(&def->elements[i], (enum part)part)) {
                fill(&as, &def->elements[i], (enum part)part, &p, &f);
            }
        }
        if (part == SLIP) {
            fill_linkages(def, &p, &f);
        }
    }
    p.term_start[f.struts] = (uint16_t)f.terms;
    p.bend_start[f.tables] = (uint16_t)f.bends;
    return KL_OK;
}
