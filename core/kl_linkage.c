/* kl_linkage.c - checking linkages, how stiff a rigid one can be, and whether all bodies are tied. */
#include "kl_diag.h"
#include "kl_math.h"
#include "kl_reach.h"

/*
 * A rigid linkage: its angular frequency times the step, of which the step bears 2, and its damping.
 * That is what it meets a blow with. To what lasts it does not give way: a multiplier takes over the
 * force, f = k (u + integral of u over T) + c u'. That swings up where c T is less than the inertia
 * of u, m: m s^3 + c s^2 + k s + k/T. The integral leaks, so that all of it is a stiffness at rest less
 * a series spring and damper:
 *     f/u = k (R + s tau)/(1 + s tau) = k R - k (R - 1) s tau/(1 + s tau),   tau = R T.
 */
#define RIGID_FREQUENCY 1.0
#define RIGID_DAMPING 0.333
#define RIGID_AT_REST 1000.0 /* R */
#define RIGID_SAFETY 1.5     /* c T/m */
/* of a factor, below which a sum of factors or a rest of an elimination is rounding */
#define ROUNDING 1e-9

static double place_of(const struct kl_vehicle_def *def, int32_t end) {
    return kl_is_wheelset(end) ? def->wheelsets[end - KL_WHEELSET_END(0)].x_m
                               : def->bodies[end].x_m;
}

/* Moves the whole vehicle aside, down, or about the vertical axis: u must stay. */
static int ties_to_track(const struct kl_vehicle_def *def, const struct kl_linkage_def *linkage) {
    double aside = 0.0;
    double down = 0.0;
    double turn = 0.0;
    double size = 0.0;
    for (uint32_t i = 0; i < linkage->n_terms; i++) {
        const struct kl_term_def *t = &linkage->term[i];
        const double x = place_of(def, t->end);
        aside += t->freedom == KL_Y ? t->factor : 0.0;
        down += t->freedom == KL_Z ? t->factor : 0.0;
        turn += t->freedom == KL_Y ? t->factor * x : t->freedom == KL_YAW ? t->factor : 0.0;
        size += kl_abs(t->factor) * (1.0 + kl_abs(x));
    }
    return kl_abs(aside) > ROUNDING * size || kl_abs(down) > ROUNDING * size ||
           kl_abs(turn) > ROUNDING * size;
}

static enum kl_status check_term(const struct kl_vehicle_def *def, const struct kl_term_def *t,
                                 int32_t index, struct kl_diag *diag) {
    if (t->end == KL_GROUND_END || !kl_is_end(def, t->end)) {
        return kl_report(diag, KL_ERR_REFERENCE, "linkage: no such body or wheelset", index,
                         t->end);
    }
    const int wheelset = kl_is_wheelset(t->end);
    if ((int)t->freedom < 0 || t->freedom >= KL_FREEDOMS || (wheelset && t->freedom == KL_PITCH)) {
        return kl_report(diag, KL_ERR_VALUE, "linkage: no such freedom", index, (double)t->freedom);
    }
    if (!wheelset && (def->bodies[t->end].freedoms & KL_HAS(t->freedom)) == 0) {
        return kl_report(diag, KL_ERR_VALUE, "linkage: the body does not have this freedom", index,
                         (double)t->freedom);
    }
    if (!(kl_abs(t->factor) < 1e3) || t->factor == 0.0) {
        return kl_report(diag, KL_ERR_VALUE, "linkage: factors must not be 0, nor 1000 or more",
                         index, t->factor);
    }
    return KL_OK;
}

static enum kl_status check_linkage(const struct kl_vehicle_def *def, uint32_t i,
                                    struct kl_diag *diag) {
    const struct kl_linkage_def *linkage = &def->linkages[i];
    const int32_t index = (int32_t)i;
    if (linkage->n_terms < 2 || linkage->n_terms > KL_MAX_TERMS) {
        return kl_report(diag, KL_ERR_VALUE, "linkage: needs 2 to 8 terms", index,
                         linkage->n_terms);
    }
    for (uint32_t t = 0; t < linkage->n_terms; t++) {
        const enum kl_status status = check_term(def, &linkage->term[t], index, diag);
        if (status != KL_OK) {
            return status;
        }
    }
    if (!(linkage->k >= 0.0 && linkage->k < 1e12 && linkage->c >= 0.0 && linkage->c < 1e12)) {
        return kl_report(diag, KL_ERR_VALUE, "linkage: stiffness and damping must be in 0..1e12",
                         index, linkage->k);
    }
    if (ties_to_track(def, linkage)) {
        return kl_report(diag, KL_ERR_VALUE,
                         "linkage: ties the vehicle to the track: shifting or turning all of it "
                         "sideways must change nothing",
                         index, 0.0);
    }
    return KL_OK;
}

/* ---- rigid linkages ---- */

/* 1 / inertia of a coordinate; wheelsets' heights and rolls follow the track. */
static double mobility(const struct kl_vehicle_def *def, const struct kl_term_def *t) {
    if (kl_is_wheelset(t->end)) {
        const struct kl_wheelset_def *w = &def->wheelsets[t->end - KL_WHEELSET_END(0)];
        return t->freedom == KL_Y     ? 1.0 / w->mass_kg
               : t->freedom == KL_YAW ? 1.0 / w->inertia_yaw_kgm2
                                      : 0.0;
    }
    const struct kl_body_def *b = &def->bodies[t->end];
    return 1.0 / (t->freedom < KL_ROLL ? b->mass_kg : b->inertia_kgm2[t->freedom - KL_ROLL]);
}

static int share_a_coordinate(const struct kl_linkage_def *a, const struct kl_linkage_def *b) {
    for (uint32_t i = 0; i < a->n_terms; i++) {
        for (uint32_t j = 0; j < b->n_terms; j++) {
            if (a->term[i].end == b->term[j].end && a->term[i].freedom == b->term[j].freedom) {
                return 1;
            }
        }
    }
    return 0;
}

/* What a rigid linkage moves. Each alone has angular frequency omega on what it ties; n of them that
 * share coordinates have at most omega sqrt(n) together, so each gets 1/n of its stiffness. */
struct moved {
    double yields;   /* the acceleration of u by a unit of force, times n */
    double heaviest; /* inertia of u where all but one coordinate are held, as creep holds wheels */
};

static struct moved moved_by(const struct kl_vehicle_def *def,
                             const struct kl_linkage_def *linkage) {
    struct moved moved = {0.0, 0.0};
    double sharing = 0.0;
    for (uint32_t i = 0; i < def->n_linkages; i++) {
        const struct kl_linkage_def *other = &def->linkages[i];
        sharing += other->rigid && share_a_coordinate(linkage, other) ? 1.0 : 0.0;
    }
    for (uint32_t i = 0; i < linkage->n_terms; i++) {
        const struct kl_term_def *t = &linkage->term[i];
        const double yields = mobility(def, t) * (t->factor * t->factor);
        if (yields > 0.0) {
            moved.yields += sharing * yields;
            moved.heaviest = 1.0 / yields > moved.heaviest ? 1.0 / yields : moved.heaviest;
        }
    }
    return moved;
}

void kl_linkage_rates(const struct kl_vehicle_def *def, uint32_t index,
                      struct kl_linkage_rates *r) {
    const struct kl_linkage_def *linkage = &def->linkages[index];
    const struct kl_linkage_rates given = {.k = linkage->k, .c = linkage->c};
    const struct moved nothing = {0.0, 0.0};
    const struct moved moved = linkage->rigid ? moved_by(def, linkage) : nothing;
    *r = given;
    if (!(moved.yields > 0.0)) {
        return;
    }
    const double omega = RIGID_FREQUENCY / ((double)def->step_ns * 1e-9);
    const double quick = omega * omega / moved.yields;
    r->k = RIGID_AT_REST * quick;
    r->c = 2.0 * RIGID_DAMPING * omega / moved.yields;
    r->slip.k = quick - r->k;
    r->slip.c = r->slip.k * (RIGID_AT_REST * RIGID_SAFETY * (moved.heaviest / r->c));
}

/* Rigid linkages are rows; a row that those before it make up is a loop. Elimination, each row by
 * the largest entry that it has left; pivot[r] is where. */
static enum kl_status find_loop(const struct kl_vehicle_def *def, struct kl_arena *arena,
                                struct kl_diag *diag) {
    const size_t n = KL_COORDINATES(def->n_bodies, def->n_wheelsets);
    double *rows = kl_arena_take(arena, def->n_linkages * n, sizeof *rows);
    uint32_t *pivot = kl_arena_take(arena, def->n_linkages, sizeof *pivot);
    if (rows == NULL || pivot == NULL) {
        return kl_report(diag, KL_ERR_MEMORY, "linkages", -1, (double)arena->wanted);
    }
    uint32_t found = 0;
    for (uint32_t l = 0; l < def->n_linkages; l++) {
        if (!def->linkages[l].rigid) {
            continue;
        }
        struct kl_reach reach;
        double size = 0.0;
        double *row = &rows[found * n];
        kl_reach_linkage(def, &def->linkages[l], &reach);
        for (size_t i = 0; i < n; i++) {
            row[i] = 0.0;
        }
        for (uint32_t i = 0; i < reach.n; i++) {
            row[reach.coordinate[i]] = reach.factor[i];
            size = kl_abs(reach.factor[i]) > size ? kl_abs(reach.factor[i]) : size;
        }
        for (uint32_t r = 0; r < found; r++) {
            const double *above = &rows[r * n];
            const double part = row[pivot[r]] / above[pivot[r]];
            for (size_t i = 0; i < n; i++) {
                row[i] -= part * above[i];
            }
            row[pivot[r]] = 0.0;
        }
        uint32_t largest = 0;
        for (uint32_t i = 1; i < n; i++) {
            largest = kl_abs(row[i]) > kl_abs(row[largest]) ? i : largest;
        }
        if (!(kl_abs(row[largest]) > ROUNDING * size)) {
            return kl_report(diag, KL_ERR_SINGULAR,
                             "linkage: closes a loop: the rigid linkages before it imply it",
                             (int32_t)l, 0.0);
        }
        pivot[found++] = largest;
    }
    return KL_OK;
}

/* ---- is everything tied? ---- */

#define HELD KL_MAX_BODIES /* the group of wheelsets and ground */

static uint32_t group_of(int32_t end) {
    return end == KL_GROUND_END || kl_is_wheelset(end) ? HELD : (uint32_t)end;
}

static void join(uint32_t *group, uint32_t a, uint32_t b) {
    const uint32_t from = group[a];
    const uint32_t to = group[b];
    for (uint32_t i = 0; i <= HELD; i++) {
        group[i] = group[i] == from ? to : group[i];
    }
}

static int holds(const struct kl_element_def *e) {
    double sum = e->line_k_N_m + e->line_c_Ns_m + e->slip.k + (double)(e->stop.n + e->damper.n);
    for (int i = 0; i < 6; i++) {
        sum += e->k[i] + e->c[i];
    }
    return sum > 0.0;
}

static enum kl_status check_tied(const struct kl_vehicle_def *def, struct kl_diag *diag) {
    uint32_t group[KL_MAX_BODIES + 1];
    for (uint32_t i = 0; i <= HELD; i++) {
        group[i] = i;
    }
    for (uint32_t i = 0; i < def->n_elements; i++) {
        const struct kl_element_def *e = &def->elements[i];
        if (holds(e)) {
            join(group, group_of(e->end_a), group_of(e->end_b));
        }
    }
    for (uint32_t i = 0; i < def->n_linkages; i++) {
        const struct kl_linkage_def *l = &def->linkages[i];
        for (uint32_t t = 1; t < l->n_terms; t++) {
            join(group, group_of(l->term[0].end), group_of(l->term[t].end));
        }
    }
    for (uint32_t b = 0; b < def->n_bodies; b++) {
        if (group[b] != group[HELD]) {
            return kl_report(diag, KL_ERR_SINGULAR,
                             "body is not held: nothing ties it to a wheelset or to the ground",
                             (int32_t)b, 0.0);
        }
    }
    return KL_OK;
}

enum kl_status kl_linkages_check(const struct kl_vehicle_def *def, struct kl_arena *arena,
                                 struct kl_diag *diag) {
    enum kl_status status = KL_OK;
    for (uint32_t i = 0; i < def->n_linkages && status == KL_OK; i++) {
        status = check_linkage(def, i, diag);
    }
    status = status == KL_OK ? find_loop(def, arena, diag) : status;
    return status == KL_OK ? check_tied(def, diag) : status;
}
