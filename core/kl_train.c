/* kl_train.c - the speed as a freedom of the train. */
#include "kl_train.h"

#include "kl_damp.h"
#include "kl_math.h"

#define MOST_PULL_N 1e8

int kl_train_limit(const struct kl_input *restrict input, struct kl_input *restrict kept) {
    const kl_real given = input->draw_force_N;
    const kl_real number = given - given == KL_R(0) ? given : KL_R(0);
    kept->draw_force_N = kl_clamp(number, KL_R(-MOST_PULL_N), KL_R(MOST_PULL_N));
    return kept->draw_force_N != given;
}

struct kl_stage kl_train_carry(const struct kl_model *model, const struct kl_state *state) {
    const kl_real h = model->step_s;
    const kl_real v =
        kl_clamp(state->speed_m_s + h * state->speed_rate_m_s2, KL_R(0), KL_R(KL_MAX_SPEED_M_S));
    const struct kl_stage end = {state->s_m + h * (KL_R(0.5) * (state->speed_m_s + v)), v,
                                 (v - state->speed_m_s) / h};
    return end;
}

/* What creep of one contact of both wheels has along the track. */
static kl_real along(const struct kl_axle *axle, const struct kl_contact_forces *f,
                     const kl_both *arm, const kl_both *cos_delta, const kl_both *inv_cos) {
    const kl_real kappa = axle->track.curvature_1_m;
    const kl_real yaw = axle->x[KL_WS_YAW];
    kl_both x;
    KL_EACH_LANE_LOOP(g) {
        const kl_lane sign = kl_lane_of(KL_R(1), KL_R(-1), g);
        const kl_lane ahead = KL_R(1) - sign * (KL_LANE(*arm, g) * kappa);
        KL_LANE(x, g) =
            (KL_LANE(f->t1, g) * ahead - KL_LANE(f->t2, g) * (yaw * KL_LANE(*inv_cos, g))) +
            KL_LANE(f->m3, g) * (kappa * KL_LANE(*cos_delta, g));
    }
    return KL_SUM(x);
}

/* X - R(V) + D. The constant part of R is that of a train that moves: at rest it holds. */
static kl_real pull(const struct kl_model *model, const struct kl_evaluation *e) {
    const struct kl_running *running = &model->running;
    const kl_real v = e->forces[0].speed_m_s;
    kl_real sum =
        e->kept.draw_force_N -
        (running->resistance_N + v * (running->resistance_Ns_m + v * running->resistance_Ns2_m2));
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct kl_axle *axle = &e->axle[w];
        const struct kl_axle_forces *f = &e->forces[w];
        sum += along(axle, &f->tread, &axle->arm, &axle->cos_delta, &axle->inv_cos) +
               along(axle, &f->flange, &axle->flange.arm, &axle->flange.cos_delta,
                     &axle->flange.inv_cos);
    }
    return sum;
}

/* One axle: omega' = a - part V', of which sigma is carried on. */
struct share {
    kl_real inertia; /* I_y/r0 */
    kl_real inv_radius;
    kl_real turning; /* Omega' */
    kl_real a;
    kl_real part;
    kl_real sigma;
};

static struct share share_of(const struct kl_model *model, const struct kl_evaluation *e,
                             uint32_t w, kl_real carried) {
    const struct kl_wheelset *wheelset = &model->wheelsets[w];
    const struct kl_axle *axle = &e->axle[w];
    struct kl_stiffness z;
    kl_axle_stiffness(wheelset, &model->pairs[wheelset->pair], axle, &e->forces[w], model->step_s,
                      &z);
    const kl_real inv_radius = KL_R(1) / model->pairs[wheelset->pair].radius_m;
    const kl_real half_z = KL_R(0.5) * z.spin;
    const kl_real sigma = kl_lane_first(kl_carried_part(kl_lane_all(z.spin)));
    const kl_real weight = KL_R(1) / (KL_R(1) + (KL_R(2) - sigma) * half_z);
    const kl_real turning = axle->rate[KL_WS_SPIN] + axle->spin_drift;
    const struct share share = {
        wheelset->inertia_spin_kgm2 * inv_radius, inv_radius,          turning,
        weight * (turning + half_z * carried),    weight * inv_radius, sigma};
    return share;
}

/* P', and sum I_y/r0 omega' = sum_a - sum_part V'; of it what is carried on. */
struct momentum {
    kl_real rate;
    kl_real a;
    kl_real part;
    kl_real carried_a;
    kl_real carried_part;
};

static struct momentum add_up(const struct kl_model *model, const struct kl_state *state,
                              const struct kl_evaluation *e) {
    struct momentum p = {pull(model, e), KL_R(0), KL_R(0), KL_R(0), KL_R(0)};
    const uint32_t first = kl_wheelset_states(model) + (uint32_t)KL_WS_SPIN;
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct share s = share_of(model, e, w, state->rate[first + KL_WHEELSET_STATES * w]);
        p.rate += s.inertia * s.turning;
        p.a += s.inertia * s.a;
        p.part += s.inertia * s.part;
        p.carried_a += s.inertia * (s.sigma * s.a);
        p.carried_part += s.inertia * (s.sigma * s.part);
    }
    return p;
}

uint32_t kl_train_move(const struct kl_model *model, const struct kl_state *state,
                       struct kl_evaluation *restrict e, struct kl_stage *restrict end,
                       kl_real *restrict carried) {
    const kl_real h = model->step_s;
    const kl_real whole = model->running.rolling_kg;
    const kl_real before = state->speed_rate_m_s2;
    const kl_real most = KL_R(KL_MAX_SPEED_M_S);
    const struct momentum p = add_up(model, state, e);
    const kl_real free_rate = (p.rate - p.a) / (whole - p.part);
    const kl_real goes_on = (p.rate - (p.carried_a - p.carried_part * free_rate)) / whole;
    const kl_real v = state->speed_m_s + h * (free_rate + KL_R(0.5) * (before - goes_on));
    /* at rest, and at the end of the range, V' is what leads there */
    const kl_real kept = kl_clamp(v, KL_R(0), most);
    const int held = !(v > KL_R(0) && v < most);
    const kl_real there = (kept - state->speed_m_s) / h;
    const kl_real rate = held ? there - KL_R(0.5) * before : free_rate;
    *carried = held ? KL_R(0) : goes_on;
    end->speed_m_s = kept;
    end->speed_rate_m_s2 = rate;
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        struct kl_axle *axle = &e->axle[w];
        const kl_real inv_radius = KL_R(1) / model->pairs[model->wheelsets[w].pair].radius_m;
        const kl_real turning = axle->rate[KL_WS_SPIN] + axle->spin_drift;
        axle->rate[KL_WS_SPIN] = turning - rate * inv_radius;
        axle->spin_drift = there * inv_radius;
    }
    return v > most ? (uint32_t)KL_FAULT_INPUT : 0u;
}

kl_real kl_train_acceleration(const struct kl_model *model, const struct kl_evaluation *e) {
    const kl_real rate = pull(model, e) / model->running.mass_kg;
    return e->forces[0].speed_m_s > KL_R(0) ? rate : kl_max_real(rate, KL_R(0));
}

void kl_train_refresh(const struct kl_model *model, const struct kl_evaluation *e,
                      struct kl_state *state) {
    const kl_real rate = kl_train_acceleration(model, e);
    const uint32_t first = kl_wheelset_states(model) + (uint32_t)KL_WS_SPIN;
    kl_real sum = model->running.rolling_kg * rate;
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct share s = share_of(model, e, w, KL_R(0));
        const kl_real whole = s.turning - rate * s.inv_radius;
        state->rate[first + KL_WHEELSET_STATES * w] = s.sigma * whole;
        sum += s.inertia * (whole - s.sigma * whole);
    }
    state->speed_rate_m_s2 = sum / model->running.rolling_kg;
}
