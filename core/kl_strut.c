/* kl_strut.c - series dampers, friction, stops, damper characteristics and actuators. */
#include "kl_strut.h"

#include "kl_math.h"

/* Lanes of a motion. */
#define COORDINATE 0
#define RATE 1

#define MOST_ACTUATOR_N 1e7

static void deflection(const struct kl_struts *s, uint32_t strut, const kl_both *q, kl_both *d) {
    kl_both sum = {KL_R(0), KL_R(0)};
    for (uint32_t t = s->term_start[strut]; t < s->term_start[strut + 1u]; t++) {
        KL_EACH_LANE(g) {
            KL_LANE(sum, g) += s->factor[t] * KL_LANE(q[s->column[t]], g);
        }
    }
    KL_EACH_LANE(g) {
        KL_LANE(*d, g) = KL_LANE(sum, g);
    }
}

/* A strut pulls its ends together by f. */
static void pull(const struct kl_struts *s, uint32_t strut, kl_real f, kl_real *force) {
    for (uint32_t t = s->term_start[strut]; t < s->term_start[strut + 1u]; t++) {
        force[s->column[t]] -= s->factor[t] * f;
    }
}

/*
 * Spring k in series with damper c: f = k w, w' = d' - w/tau, tau = c/k. Where d goes straight over
 * the step h this is solved exactly, z = h/tau:
 *     w = e^-z w0 + (d - d0)(1 - e^-z)/z = gain (d - u0) + carry u0',
 * with u = d - w how far the damper has moved, u' = w/tau, gain = (1 - e^-z)/z, carry = tau (e^-z -
 * gain). So any ratio of k and c is stable. Without damper gain = 1, carry = 0: a spring that its
 * slider holds; at the limit the slider goes along (return mapping: Simo and Hughes, Computational
 * Inelasticity, 1.4).
 */
static kl_real slip(const struct kl_slip *s, const struct kl_slip_origin *from, uint32_t i,
                    kl_real d, struct kl_slipped *slipped) {
    const kl_real stretch = d - from->u[i];
    const int moves = from->h != KL_R(0); /* the same for a whole run: no branch on data */
    const kl_real w = moves ? s->gain * stretch + s->carry * from->rate[i] : stretch;
    const kl_real held = kl_clamp(w, -s->most_m, s->most_m);
    const kl_real f = s->k * held;
    slipped->u[i] = from->u[i] + (stretch - held);
    slipped->rate[i] = f * s->inv_c;
    return f;
}

/* A table of straight lines as the sum of its bends, away from 0 to either side. No search: the same
 * operations wherever x is. */
static kl_real bent(const struct kl_struts *s, uint32_t table, kl_real x) {
    const uint16_t *start = &s->bend_start[2u * table];
    kl_real f = KL_R(0);
    for (uint32_t i = start[0]; i < start[1]; i++) {
        f += s->bend[i].slope * kl_max_real(x - s->bend[i].at, KL_R(0));
    }
    for (uint32_t i = start[1]; i < start[2]; i++) {
        f += s->bend[i].slope * kl_min_real(x - s->bend[i].at, KL_R(0));
    }
    return f;
}

/* Twice its integral. */
static kl_real bent_energy(const struct kl_struts *s, uint32_t table, kl_real x) {
    const uint16_t *start = &s->bend_start[2u * table];
    kl_real twice = KL_R(0);
    for (uint32_t i = start[0]; i < start[2]; i++) {
        const kl_real past = x - s->bend[i].at;
        const kl_real beyond =
            i < start[1] ? kl_max_real(past, KL_R(0)) : kl_min_real(past, KL_R(0));
        twice += s->bend[i].slope * (beyond * beyond);
    }
    return twice;
}

void kl_struts_act(const struct kl_struts *restrict struts,
                   const struct kl_slip_origin *restrict from, kl_both *restrict q,
                   const struct kl_input *restrict input, kl_real *restrict force,
                   struct kl_slipped *restrict slipped) {
    /* C11 does not make a pointer to arrays one to constant arrays by itself */
    const kl_both *motion = (const kl_both *)q;
    uint32_t strut = 0;
    uint32_t table = 0;
    kl_both d;
    for (uint32_t i = 0; i < struts->n_slips; i++, strut++) {
        deflection(struts, strut, motion, &d);
        pull(struts, strut, slip(&struts->slip[i], from, i, d[COORDINATE], slipped), force);
    }
    for (uint32_t i = 0; i < struts->n_stops; i++, strut++, table++) {
        deflection(struts, strut, motion, &d);
        pull(struts, strut, bent(struts, table, d[COORDINATE]), force);
    }
    for (uint32_t i = 0; i < struts->n_dampers; i++, strut++, table++) {
        deflection(struts, strut, motion, &d);
        pull(struts, strut, bent(struts, table, d[RATE]), force);
    }
    for (uint32_t i = 0; i < struts->n_actuators; i++, strut++) {
        pull(struts, strut, -input->actuator_N[struts->input[i]], force);
    }
}

kl_real kl_strut_force(const struct kl_strut_view *view, uint32_t strut) {
    const struct kl_struts *s = view->struts;
    const uint32_t first_damper = s->n_slips + s->n_stops;
    const uint32_t first_actuator = first_damper + s->n_dampers;
    kl_both d;
    deflection(s, strut, view->q, &d);
    if (strut < s->n_slips) {
        return s->slip[strut].k * (d[COORDINATE] - view->slipped->u[strut]);
    }
    if (strut < first_actuator) {
        return bent(s, strut - s->n_slips, d[strut < first_damper ? COORDINATE : RATE]);
    }
    return -view->input->actuator_N[s->input[strut - first_actuator]];
}

kl_real kl_struts_energy(const struct kl_struts *struts, const kl_real *u, kl_both *q) {
    const kl_both *motion = (const kl_both *)q;
    kl_real sum = KL_R(0);
    kl_both d;
    for (uint32_t i = 0; i < struts->n_slips; i++) {
        const struct kl_slip *s = &struts->slip[i];
        deflection(struts, i, motion, &d);
        const kl_real held = kl_clamp(d[COORDINATE] - u[i], -s->most_m, s->most_m);
        sum += s->k * (held * held);
    }
    for (uint32_t i = 0; i < struts->n_stops; i++) {
        deflection(struts, struts->n_slips + i, motion, &d);
        sum += bent_energy(struts, i, d[COORDINATE]);
    }
    return sum;
}

int kl_struts_limit(const struct kl_struts *struts, const struct kl_input *restrict input,
                    struct kl_input *restrict kept) {
    int changed = 0;
    for (uint32_t i = 0; i < struts->n_actuators; i++) {
        const uint16_t at = struts->input[i];
        const kl_real given = input->actuator_N[at];
        const kl_real number = given - given == KL_R(0) ? given : KL_R(0);
        kept->actuator_N[at] = kl_clamp(number, KL_R(-MOST_ACTUATOR_N), KL_R(MOST_ACTUATOR_N));
        changed |= kept->actuator_N[at] != given;
    }
    return changed;
}
