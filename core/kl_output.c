/* kl_output.c - what a step tells of the vehicle. */
#include "kl_rates.h"

#include "kl_math.h"
#include "kl_twist.h"

/* ---- wheelsets ---- */

static inline void store(kl_real *to, const kl_both *x) {
    KL_EACH_LANE(g) {
        kl_lane_store(to, g, KL_LANE(*x, g));
    }
}

/* One contact of both wheels, and where it is found: the rows of the tables below, how far apart
 * rows are, and how far on between two of them. */
struct contact {
    const struct kl_contact_forces *forces;
    const struct kl_row *row[KL_SIDES];
    size_t stride;
    const kl_both *t;
    const kl_both *radius;
};

/* Two neighbouring columns of the tables. */
#define COLUMNS(contact, field, first, second)                                                     \
    kl_lane_columns(&(contact)->row[KL_RIGHT]->field, &(contact)->row[KL_LEFT]->field,             \
                    (contact)->stride, (*(contact)->t)[KL_RIGHT], (*(contact)->t)[KL_LEFT], first, \
                    second)

static inline void write_contact(const struct contact *contact, struct kl_contact_output *o) {
    const struct kl_contact_forces *f = contact->forces;
    kl_both delta;
    kl_both eta_wheel;
    store(o->normal_N, &f->normal);
    store(o->t1_N, &f->t1);
    store(o->t2_N, &f->t2);
    store(o->m3_Nm, &f->m3);
    store(o->gamma1, &f->creepages.gamma1);
    store(o->gamma2, &f->creepages.gamma2);
    store(o->omega3_1_m, &f->creepages.omega3);
    store(o->reduction, &f->reduction);
    store(o->radius_m, contact->radius);
    COLUMNS(contact, delta_rail_rad, &delta, &eta_wheel);
    KL_EACH_LANE(g) {
        kl_lane_store(o->delta_rad, g, KL_LANE(delta, g));
        kl_lane_store(o->eta_wheel_m, g, KL_LANE(eta_wheel, g));
    }
}

static inline void write_contacts(const struct kl_axle *axle, const struct kl_axle_forces *forces,
                                  struct kl_wheelset_output *o) {
    const struct kl_flange_row *const *flange = axle->flange.row;
    const struct contact on_tread = {&forces->tread,
                                     {axle->cells.below[KL_RIGHT], axle->cells.below[KL_LEFT]},
                                     sizeof(struct kl_row) / sizeof(kl_real),
                                     &axle->cells.t,
                                     &axle->radius};
    const struct contact on_flange = {&forces->flange,
                                      {&flange[KL_RIGHT]->contact, &flange[KL_LEFT]->contact},
                                      sizeof(struct kl_flange_row) / sizeof(kl_real),
                                      &axle->flange.t,
                                      &axle->flange.radius};
    write_contact(&on_tread, &o->tread);
    write_contact(&on_flange, &o->flange);
}

/* What acts on the rails: the opposite of what acts on the wheels. */
static inline void write_wheels(const struct kl_axle *axle, const struct kl_axle_forces *forces,
                                struct kl_wheelset_output *o) {
    const struct kl_contact_forces *tread = &forces->tread;
    const struct kl_contact_forces *flange = &forces->flange;
    kl_both y;
    KL_EACH_LANE(g) {
        const kl_lane sign = kl_lane_of(KL_R(1), KL_R(-1), g);
        const kl_lane n = KL_LANE(tread->normal, g);
        const kl_lane t2 = KL_LANE(tread->t2, g);
        const kl_lane sin_delta = KL_LANE(axle->sin_delta, g);
        const kl_lane cos_delta = KL_LANE(axle->cos_delta, g);
        const kl_lane flange_n = KL_LANE(flange->normal, g);
        const kl_lane flange_t2 = KL_LANE(flange->t2, g);
        const kl_lane flange_sin = KL_LANE(axle->flange.sin_delta, g);
        const kl_lane flange_cos = KL_LANE(axle->flange.cos_delta, g);
        KL_LANE(y, g) = sign * (n * sin_delta + flange_n * flange_sin) -
                        (t2 * cos_delta + flange_t2 * flange_cos);
        kl_lane_store(o->q_N, g,
                      (n * cos_delta + flange_n * flange_cos) +
                          sign * (t2 * sin_delta + flange_t2 * flange_sin));
        kl_lane_store(o->y_N, g, KL_LANE(y, g));
        kl_lane_store(o->rise_m, g, KL_LANE(axle->rise, g));
        kl_lane_store(o->rail_m, g, KL_LANE(axle->rail.q, g));
    }
    o->force_y_N = KL_SUM(y);
}

static inline void write_wheelset(const struct kl_axle *axle, const struct kl_axle_forces *forces,
                                  const struct kl_pair *pair, const kl_real *x,
                                  struct kl_wheelset_output *o) {
    const struct kl_track_point *here = &axle->track;
    const kl_real v = forces->speed_m_s;
    kl_both lifted; /* upward acceleration of the centre by what the treads rise */
    KL_EACH_LANE(g) {
        KL_LANE(lifted, g) =
            kl_lane_load(pair->share, g) * KL_LANE(forces->lifting.acceleration, g);
    }
    o->y_m = x[KL_WS_Y];
    o->yaw_rad = x[KL_WS_YAW];
    o->z_m = axle->z;
    o->roll_rad = axle->roll;
    o->spin_rad_s = x[KL_WS_SPIN];
    o->twist_rad_s = KL_R(0);
    o->y_rate_m_s = x[KL_WS_Y_RATE] - pair->radius_m * (v * here->cant_s_1_m);
    o->yaw_rate_rad_s = x[KL_WS_YAW_RATE] - v * here->curvature_1_m;
    o->y_acc_m_s2 = axle->rate[KL_WS_Y_RATE] + here->curvature_1_m * (v * v);
    o->z_acc_m_s2 = (axle->z_y * axle->rate[KL_WS_Y_RATE] + axle->z_rest) - KL_SUM(lifted);
    o->irregularity = here->value;
    write_wheels(axle, forces, o);
    write_contacts(axle, forces, o);
}

/* ---- bodies ---- */

/* Returns how many states it has. */
static inline uint32_t write_body(uint32_t freedoms, const struct kl_body_motion *motion,
                                  const kl_real *x, struct kl_body_output *o) {
    if (freedoms == KL_ALL_FREEDOMS) {
        KL_UNROLL_5 for (uint32_t f = 0; f < KL_FREEDOMS; f++) {
            o->position[f] = motion->x[2u * f];
            o->rate[f] = x[2u * f + 1u] - (motion->x[2u * f + 1u] - motion->rate[2u * f]);
            o->acceleration[f] = motion->rate[2u * f + 1u];
        }
        o->acceleration[KL_Y] += motion->aside;
        return 2u * KL_FREEDOMS;
    }
    uint32_t i = 0;
    for (uint32_t f = 0; f < KL_FREEDOMS; f++) {
        const int has = (freedoms & KL_HAS(f)) != 0;
        const kl_real frame = motion->x[2u * f + 1u] - motion->rate[2u * f];
        o->position[f] = motion->x[2u * f];
        o->rate[f] = has ? x[i + 1u] - frame : KL_R(0);
        o->acceleration[f] = has ? motion->rate[2u * f + 1u] : KL_R(0);
        i += has ? 2u : 0u;
    }
    o->acceleration[KL_Y] += (freedoms & KL_HAS(KL_Y)) != 0 ? motion->aside : KL_R(0);
    return i;
}

/* ---- the vehicle ---- */

void kl_write_output(const struct kl_model *model, const struct kl_state *state,
                     const struct kl_stage *stage, const struct kl_evaluation *restrict e,
                     struct kl_output *restrict output) {
    const kl_real *x = state->x;
    output->tick = state->tick;
    output->time_ns = (int64_t)state->tick * model->step_ns;
    output->faults = state->faults;
    output->s_m = state->s_m;
    output->speed_m_s = state->speed_m_s;
    output->acceleration_m_s2 = stage->speed_rate_m_s2;
    output->track = e->reference;
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        x += write_body(model->bodies[b].freedoms, &e->body[b], x, &output->body[b]);
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        write_wheelset(&e->axle[w], &e->forces[w], &model->pairs[model->wheelsets[w].pair], x,
                       &output->wheelset[w]);
        x += KL_WHEELSET_STATES;
    }
    if (model->n_twists != 0) {
        kl_twists_output(model, state, output);
    }
}
