/* kl_rates.c - the right-hand side of a whole vehicle: placing, suspension, motion. */
#include "kl_rates.h"

#include "kl_math.h"
#include "kl_track_read.h"

/* The usual body has all freedoms: nothing to pick. */
#define ALL_FREEDOMS (KL_HAS(KL_FREEDOMS) - 1u)

const kl_real *kl_unpack_body(const struct kl_body *body, const kl_real *x,
                              const struct kl_track_point *here, kl_real v,
                              struct kl_body_motion *motion) {
    if (body->freedoms == ALL_FREEDOMS) {
        for (uint32_t i = 0; i < 2u * KL_FREEDOMS; i += KL_SIDES) {
            KL_EACH_LANE(g) {
                kl_lane_store(&motion->x[i], g, kl_lane_load(&x[i], g));
            }
        }
        return x + 2u * KL_FREEDOMS;
    }
    const kl_real along = v * here->cant_s_1_m;
    const kl_real follow[KL_FREEDOMS] = {-(body->z_m * along), KL_R(0), along, KL_R(0),
                                         v * here->curvature_1_m};
    const uint32_t n = kl_freedoms_of(body);
    uint32_t i = 0;
    for (uint32_t f = 0; f < KL_FREEDOMS; f++) {
        const int has = (body->freedoms & KL_HAS(f)) != 0;
        motion->x[f] = has ? x[i] : KL_R(0);
        motion->x[KL_RATE + f] = has ? x[n + i] : follow[f];
        i += has ? 1u : 0u;
    }
    return x + 2u * n;
}

/* The other way: the rates of one body's states. Returns the next body's. */
static kl_real *pack_rates(const struct kl_body *body, const kl_real velocity[KL_FREEDOMS],
                           const kl_real acceleration[KL_FREEDOMS], kl_real *rate) {
    if (body->freedoms == ALL_FREEDOMS) {
        for (uint32_t f = 0; f < KL_FREEDOMS; f++) {
            rate[f] = velocity[f];
            rate[KL_FREEDOMS + f] = acceleration[f];
        }
        return rate + 2u * KL_FREEDOMS;
    }
    const uint32_t n = kl_freedoms_of(body);
    uint32_t i = 0;
    for (uint32_t f = 0; f < KL_FREEDOMS; f++) {
        if (body->freedoms & KL_HAS(f)) {
            rate[i] = velocity[f];
            rate[n + i] = acceleration[f];
            i++;
        }
    }
    return rate + 2u * n;
}

/* ---- placing ---- */

/* A coordinate of the suspension has its rate beside it, as a spring its damper: both at once. */
#define COORDINATE 0
#define RATE 1
struct motions {
    kl_both q[KL_MAX_COORDINATES];
};

static void set_motion(kl_both *q, kl_real coordinate, kl_real rate) {
    KL_EACH_LANE(g) {
        KL_LANE(*q, g) = kl_lane_of(coordinate, rate, g);
    }
}

/*
 * Absolute coordinates: relative to the straight frame that stands on the track at the reference
 * point. A point at height z is carried aside by the cant's change, -z (phi0 - phi0_ref).
 */
struct offsets {
    kl_real y;
    kl_real y_rate;
    kl_real roll;
    kl_real yaw;
};

static struct offsets offsets_at(const struct kl_track_point *here,
                                 const struct kl_track_point *reference, kl_real x, kl_real z,
                                 kl_real v) {
    const kl_real turn = here->heading_rad - reference->heading_rad;
    const kl_real roll = here->cant_rad - reference->cant_rad;
    const struct offsets o = {
        ((here->offset_m - reference->offset_m) - x * reference->heading_rad) - z * roll,
        v * (turn - x * reference->curvature_1_m) + z * (v * reference->cant_s_1_m), roll, turn};
    return o;
}

/* The track under everything, first of all: reading it is one long chain per place. */
static void read_track(const struct kl_model *model, const struct kl_stage *stage,
                       struct kl_evaluation *e) {
    const struct kl_track *track = &model->track;
    kl_layout_read(track, stage->s_m, &e->reference);
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        const kl_real x = model->bodies[b].x_m;
        e->at_body[b] = &e->reference;
        if (x != KL_R(0)) {
            kl_layout_read(track, stage->s_m + x, &e->own[b]);
            e->at_body[b] = &e->own[b];
        }
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        kl_track_read(track, stage->s_m + model->wheelsets[w].x_m, &e->axle[w].track);
    }
}

static void place_bodies(const struct kl_model *model, const kl_real *x,
                         const struct kl_stage *stage, struct kl_evaluation *e,
                         struct motions *motions) {
    const kl_real v = stage->speed_m_s;
    const kl_real roll_rate = v * e->reference.cant_s_1_m;
    const kl_real yaw_rate = v * e->reference.curvature_1_m;
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        const struct kl_body *body = &model->bodies[b];
        const struct kl_body_motion *m = &e->body[b];
        x = kl_unpack_body(body, x, e->at_body[b], v, &e->body[b]);
        const struct offsets o = offsets_at(e->at_body[b], &e->reference, body->x_m, body->z_m, v);
        kl_both *qb = &motions->q[kl_body_coordinate(b)];
        set_motion(&qb[KL_Y], m->x[KL_Y] + o.y, m->x[KL_RATE + KL_Y] + o.y_rate);
        set_motion(&qb[KL_Z], m->x[KL_Z], m->x[KL_RATE + KL_Z]);
        set_motion(&qb[KL_ROLL], m->x[KL_ROLL] + o.roll, m->x[KL_RATE + KL_ROLL] - roll_rate);
        set_motion(&qb[KL_PITCH], m->x[KL_PITCH], m->x[KL_RATE + KL_PITCH]);
        set_motion(&qb[KL_YAW], m->x[KL_YAW] + o.yaw, m->x[KL_RATE + KL_YAW] - yaw_rate);
    }
}

static void place_wheelsets(const struct kl_model *model, const kl_real *x,
                            const struct kl_stage *stage, struct kl_evaluation *e,
                            struct motions *motions) {
    const kl_real v = stage->speed_m_s;
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct kl_wheelset *wheelset = &model->wheelsets[w];
        const struct kl_pair *pair = &model->pairs[wheelset->pair];
        struct kl_axle *axle = &e->axle[w];
        kl_axle_posture(pair, x, v, stage->speed_rate_m_s2, axle);
        x += KL_WHEELSET_STATES;
        e->faults |= axle->faults;
        const struct offsets o =
            offsets_at(&axle->track, &e->reference, wheelset->x_m, -pair->radius_m, v);
        kl_both *qw = &motions->q[kl_wheelset_coordinate(model->n_bodies, w)];
        const kl_real rolling = v * (axle->track.cant_s_1_m - e->reference.cant_s_1_m);
        const kl_real turning = v * e->reference.curvature_1_m;
        set_motion(&qw[0], axle->y + o.y, axle->y_abs_rate + o.y_rate);
        set_motion(&qw[1], axle->z, axle->z_rate);
        set_motion(&qw[2], axle->roll + o.roll, axle->roll_rate + rolling);
        set_motion(&qw[3], axle->yaw + o.yaw, axle->yaw_abs_rate - turning);
    }
}

static void suspension_forces(const struct kl_suspension *restrict suspension,
                              const struct motions *restrict motions, kl_real *restrict force) {
    const struct kl_spring *spring = suspension->spring;
    const uint16_t *column = suspension->column;
    const uint16_t *row_start = suspension->row_start;
    for (size_t i = 0, rows = suspension->n_coordinates; i < rows; i++) {
        kl_both sum = {KL_R(0), KL_R(0)}; /* elastic, viscous */
        for (uint32_t n = (uint32_t)row_start[i + 1u] - row_start[i]; n != 0; n--) {
            KL_EACH_LANE(g) {
                KL_LANE(sum, g) += kl_lane_load(&spring->k, g) * KL_LANE(motions->q[*column], g);
            }
            spring++;
            column++;
        }
        force[i] = -KL_SUM(sum);
    }
}

/* ---- moving ---- */

static void move_bodies(const struct kl_model *model, const struct kl_stage *stage,
                        const struct kl_input *input, const kl_real *force, struct kl_evaluation *e,
                        kl_real *rate) {
    const kl_real v = stage->speed_m_s;
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        const struct kl_body *body = &model->bodies[b];
        const struct kl_track_point *here = e->at_body[b];
        const kl_real *moving = &e->body[b].x[KL_RATE];
        const kl_real *acting = &force[kl_body_coordinate(b)];
        kl_real *a = e->body_acceleration[b];
        a[KL_Y] = (acting[KL_Y] + input->side_force_N[b]) / body->mass_kg;
        a[KL_Z] = acting[KL_Z] / body->mass_kg;
        a[KL_ROLL] = acting[KL_ROLL] / body->inertia_kgm2[0];
        a[KL_PITCH] = acting[KL_PITCH] / body->inertia_kgm2[1];
        a[KL_YAW] = acting[KL_YAW] / body->inertia_kgm2[2];
        const kl_real along = v * here->cant_s_1_m;
        const kl_real aside = here->curvature_1_m * (v * v) - model->gravity_m_s2 * here->cant_rad;
        const kl_real velocity[KL_FREEDOMS] = {moving[KL_Y] + body->z_m * along, moving[KL_Z],
                                               moving[KL_ROLL] - along, moving[KL_PITCH],
                                               moving[KL_YAW] - v * here->curvature_1_m};
        const kl_real acceleration[KL_FREEDOMS] = {a[KL_Y] - aside, a[KL_Z], a[KL_ROLL],
                                                   a[KL_PITCH], a[KL_YAW]};
        rate = pack_rates(body, velocity, acceleration, rate);
    }
}

static void load_wheelsets(const struct kl_model *model, const struct kl_stage *stage,
                           const struct kl_input *input, const kl_real *force,
                           struct kl_evaluation *e) {
    const kl_real v = stage->speed_m_s;
    const kl_real inv_creep_speed = KL_R(1) / kl_max_real(v, KL_R(KL_MIN_CREEP_SPEED_M_S));
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct kl_wheelset *wheelset = &model->wheelsets[w];
        struct kl_axle_forces *f = &e->forces[w];
        const kl_real *acting = &force[kl_wheelset_coordinate(model->n_bodies, w)];
        f->torque_Nm = input->axle_torque_Nm[w];
        f->speed_m_s = v;
        f->inv_creep_speed_s_m = inv_creep_speed;
        f->gravity_m_s2 = model->gravity_m_s2;
        KL_EACH_LANE(g) {
            KL_LANE(f->friction, g) =
                wheelset->creep.friction * kl_lane_load(input->friction_factor[w], g);
        }
        kl_axle_prepare(wheelset, &e->axle[w], acting, f);
    }
}

static void move_wheelsets(const struct kl_model *model, const struct kl_stage *stage,
                           struct kl_evaluation *e, kl_real *rate) {
    rate += model->n_states - KL_WHEELSET_STATES * model->n_wheelsets;
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        kl_axle_balance(&e->forces[w]);
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct kl_axle *axle = &e->axle[w];
        struct kl_axle_forces *f = &e->forces[w];
        kl_axle_accelerate(&model->wheelsets[w], axle, f);
        const kl_real yaw_rate = axle->yaw_abs_rate - stage->speed_m_s * axle->track.curvature_1_m;
        KL_EACH_LANE(g) {
            kl_lane_store(&rate[KL_WS_Y], g, kl_lane_of(axle->y_rate, yaw_rate, g));
            kl_lane_store(&rate[KL_WS_Y_RATE], g, kl_lane_of(f->y_acc, f->yaw_acc, g));
        }
        rate[KL_WS_SPIN] = f->spin_acc;
        const kl_real least = kl_min_real(f->normal[KL_RIGHT], f->normal[KL_LEFT]);
        const int loaded = least > KL_R(0) || !(model->wheelsets[w].static_load_N > KL_R(0));
        e->faults |= loaded ? 0u : (uint32_t)KL_FAULT_WHEEL_LIFT;
        rate += KL_WHEELSET_STATES;
    }
}

void kl_evaluate(const struct kl_model *model, const kl_real *restrict x,
                 const struct kl_stage *stage, const struct kl_input *restrict input,
                 struct kl_evaluation *restrict e, kl_real *restrict rate) {
    struct motions motions;
    kl_real force[KL_MAX_COORDINATES];
    const kl_real *x_wheelsets = x + (model->n_states - KL_WHEELSET_STATES * model->n_wheelsets);
    e->faults = 0;
    read_track(model, stage, e);
    place_bodies(model, x, stage, e, &motions);
    place_wheelsets(model, x_wheelsets, stage, e, &motions);
    suspension_forces(&model->suspension, &motions, force);
    load_wheelsets(model, stage, input, force, e);
    move_bodies(model, stage, input, force, e, rate);
    move_wheelsets(model, stage, e, rate);
}

kl_real kl_energy(const struct kl_model *model, const struct kl_state *state) {
    struct kl_evaluation e;
    struct motions motions;
    kl_real force[KL_MAX_COORDINATES];
    const struct kl_stage stage = {state->s_m, state->speed_m_s, KL_R(0)};
    const kl_real *x = state->x;
    e.faults = 0;
    read_track(model, &stage, &e);
    place_bodies(model, x, &stage, &e, &motions);
    place_wheelsets(model, x + (model->n_states - KL_WHEELSET_STATES * model->n_wheelsets), &stage,
                    &e, &motions);
    for (uint32_t i = 0; i < model->suspension.n_coordinates; i++) {
        motions.q[i][RATE] = KL_R(0);
    }
    suspension_forces(&model->suspension, &motions, force);
    kl_real twice = KL_R(0);
    for (uint32_t i = 0; i < model->suspension.n_coordinates; i++) {
        twice -= motions.q[i][COORDINATE] * force[i];
    }
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        const struct kl_body *body = &model->bodies[b];
        for (uint32_t f = 0; f < KL_FREEDOMS; f++) {
            const kl_real rate = e.body[b].x[KL_RATE + f];
            const kl_real inertia =
                f < (uint32_t)KL_ROLL ? body->mass_kg : body->inertia_kgm2[f - KL_ROLL];
            twice += inertia * (rate * rate);
        }
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct kl_wheelset *ws = &model->wheelsets[w];
        const struct kl_axle *axle = &e.axle[w];
        const kl_real p = axle->y_abs_rate;
        const kl_real yaw = axle->yaw_abs_rate;
        const kl_real spin = axle->spin;
        twice += ws->mass_kg * (p * p + axle->z_rate * axle->z_rate) +
                 ws->inertia_roll_kgm2 * (axle->roll_rate * axle->roll_rate) +
                 ws->inertia_yaw_kgm2 * (yaw * yaw) + ws->inertia_spin_kgm2 * (spin * spin);
        const kl_real down = ws->preload[1] + ws->mass_kg * model->gravity_m_s2;
        twice -= KL_R(2) * ((down * axle->z + ws->preload[2] * axle->roll) +
                            (ws->preload[0] * axle->y + ws->preload[3] * axle->yaw));
    }
    return KL_R(0.5) * twice;
}
