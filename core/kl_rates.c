/* kl_rates.c - the right-hand side of a whole vehicle: placing, suspension, motion. */
#include "kl_rates.h"

#include "kl_math.h"
#include "kl_track_read.h"
#include "kl_twist.h"

/*
 * The end of the time h: the rate goes on straight, the coordinate by the mean of its rates. What
 * the frame itself does, `drift`, is taken off the state's rate to give the coordinate's.
 */
static inline void carry_on(const kl_real *x, const kl_real *rate, kl_real h, kl_real drift,
                            kl_real *next, kl_real *next_rate) {
    const kl_real moving = x[1] + h * rate[1];
    const kl_real change = moving - drift;
    next[0] = x[0] + (KL_R(0.5) * h) * (rate[0] + change);
    next[1] = moving;
    next_rate[0] = change;
}

/* Carries one body on. Returns how many states it has. */
static uint32_t carry_body(const struct kl_body *body, const struct kl_origin *from, uint32_t first,
                           const struct kl_track_layout *here, kl_real v,
                           struct kl_body_motion *motion) {
    const kl_real along = v * here->cant_s_1_m;
    const kl_real drift[KL_FREEDOMS] = {-(body->z_m * along), KL_R(0), along, KL_R(0),
                                        v * here->curvature_1_m};
    if (body->freedoms == KL_ALL_FREEDOMS) {
        KL_UNROLL_5 for (uint32_t f = 0; f < KL_FREEDOMS; f++) {
            const uint32_t i = first + 2u * f;
            carry_on(&from->x[i], &from->rate[i], from->h, drift[f], &motion->x[2u * f],
                     &motion->rate[2u * f]);
        }
        return 2u * KL_FREEDOMS;
    }
    uint32_t i = first;
    for (uint32_t f = 0; f < KL_FREEDOMS; f++) {
        kl_real *x = &motion->x[2u * f];
        if (body->freedoms & KL_HAS(f)) {
            carry_on(&from->x[i], &from->rate[i], from->h, drift[f], x, &motion->rate[2u * f]);
            i += 2u;
        } else {
            x[0] = KL_R(0);
            x[1] = drift[f];
        }
    }
    return i - first;
}

/* ---- placing ---- */

/* A coordinate of the suspension has its rate beside it, as a spring its damper: both at once. */
#define COORDINATE 0
#define RATE 1

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

static inline struct offsets offsets_at(kl_real heading_rad, kl_real offset_m, kl_real cant_rad,
                                        const struct kl_track_layout *reference, kl_real x,
                                        kl_real z, kl_real v) {
    const kl_real turn = heading_rad - reference->heading_rad;
    const kl_real roll = cant_rad - reference->cant_rad;
    const struct offsets o = {
        ((offset_m - reference->offset_m) - x * reference->heading_rad) - z * roll,
        v * (turn - x * reference->curvature_1_m) + z * (v * reference->cant_s_1_m), roll, turn};
    return o;
}

/* The track under the wheels, first of all: reading it is one long chain per place. */
static void read_track(const struct kl_model *model, const struct kl_stage *stage,
                       struct kl_evaluation *e) {
    const struct kl_track *track = &model->track;
    kl_layout_read(track, stage->s_m, &e->reference.curvature_1_m);
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        kl_track_read(track, stage->s_m + model->wheelsets[w].x_m, &e->axle[w].track);
    }
}

static void place_bodies(const struct kl_model *model, const struct kl_origin *from,
                         const struct kl_stage *stage, struct kl_evaluation *e) {
    const kl_real v = stage->speed_m_s;
    const kl_real roll_rate = v * e->reference.cant_s_1_m;
    const kl_real yaw_rate = v * e->reference.curvature_1_m;
    uint32_t first = 0;
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        const struct kl_body *body = &model->bodies[b];
        const kl_real *x = e->body[b].x;
        struct kl_track_layout here = e->reference;
        if (body->x_m != KL_R(0)) {
            kl_layout_read(&model->track, stage->s_m + body->x_m, &here.curvature_1_m);
        }
        first += carry_body(body, from, first, &here, v, &e->body[b]);
        e->body[b].aside = here.curvature_1_m * (v * v) - model->gravity_m_s2 * here.cant_rad;
        const struct offsets o = offsets_at(here.heading_rad, here.offset_m, here.cant_rad,
                                            &e->reference, body->x_m, body->z_m, v);
        kl_both *qb = &e->motion[kl_body_coordinate(b)];
        set_motion(&qb[KL_Y], x[2 * KL_Y] + o.y, x[2 * KL_Y + 1] + o.y_rate);
        set_motion(&qb[KL_Z], x[2 * KL_Z], x[2 * KL_Z + 1]);
        set_motion(&qb[KL_ROLL], x[2 * KL_ROLL] + o.roll, x[2 * KL_ROLL + 1] - roll_rate);
        set_motion(&qb[KL_PITCH], x[2 * KL_PITCH], x[2 * KL_PITCH + 1]);
        set_motion(&qb[KL_YAW], x[2 * KL_YAW] + o.yaw, x[2 * KL_YAW + 1] - yaw_rate);
    }
}

/* Carries one wheelset on. The wheels' rotation changes with the speed at any rate. */
static void carry_wheelset(const struct kl_pair *pair, const struct kl_origin *from, uint32_t first,
                           const struct kl_stage *stage, struct kl_axle *axle) {
    const kl_real v = stage->speed_m_s;
    const kl_real *x = &from->x[first];
    const kl_real *rate = &from->rate[first];
    const struct kl_track_point *here = &axle->track;
    carry_on(&x[KL_WS_Y], &rate[KL_WS_Y], from->h, pair->radius_m * (v * here->cant_s_1_m),
             &axle->x[KL_WS_Y], &axle->rate[KL_WS_Y]);
    carry_on(&x[KL_WS_YAW], &rate[KL_WS_YAW], from->h, v * here->curvature_1_m, &axle->x[KL_WS_YAW],
             &axle->rate[KL_WS_YAW]);
    axle->spin_drift = stage->speed_rate_m_s2 / pair->radius_m;
    const kl_real spin = x[KL_WS_SPIN] + from->h * (rate[KL_WS_SPIN] + axle->spin_drift);
    axle->x[KL_WS_SPIN] = spin;
    KL_EACH_LANE(g) {
        KL_LANE(axle->spin, g) = kl_lane_all(spin);
    }
}

/* The rails before the step. Returns how many states they have. */
static uint32_t carry_rails(const struct kl_pair *pair, const struct kl_origin *from,
                            uint32_t first, struct kl_axle *axle) {
    const int gives = pair->gives > KL_R(0);
    KL_EACH_LANE(g) {
        const kl_lane none = kl_lane_all(KL_R(0));
        KL_LANE(axle->rail.start, g) = gives ? kl_lane_load(&from->x[first], g) : none;
        KL_LANE(axle->rail.start_rate, g) = gives ? kl_lane_load(&from->rate[first], g) : none;
    }
    return gives ? KL_SIDES : 0u;
}

static void place_wheelsets(const struct kl_model *model, const struct kl_origin *from,
                            const struct kl_stage *stage, struct kl_evaluation *e) {
    const kl_real v = stage->speed_m_s;
    uint32_t first = kl_wheelset_states(model);
    uint32_t rail = kl_rail_states(model);
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct kl_wheelset *wheelset = &model->wheelsets[w];
        const struct kl_pair *pair = &model->pairs[wheelset->pair];
        struct kl_axle *axle = &e->axle[w];
        carry_wheelset(pair, from, first, stage, axle);
        first += KL_WHEELSET_STATES;
        kl_axle_carry(&from->lift[w], from->h, axle);
        rail += carry_rails(pair, from, rail, axle);
        kl_axle_expect(axle, &e->forces[w]);
        kl_axle_place(pair, v, stage->speed_rate_m_s2, KL_R(0.5) * wheelset->static_load_N,
                      model->step_s, axle);
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        kl_axle_look_up(&model->pairs[model->wheelsets[w].pair], &e->axle[w]);
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        struct kl_axle *axle = &e->axle[w];
        kl_axle_meet_flange(&model->pairs[model->wheelsets[w].pair], model->step_s, axle);
        e->faults |= axle->faults;
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct kl_wheelset *wheelset = &model->wheelsets[w];
        const struct kl_pair *pair = &model->pairs[wheelset->pair];
        struct kl_axle *axle = &e->axle[w];
        kl_axle_posture(pair, v, stage->speed_rate_m_s2, axle);
        const struct kl_track_point *here = &axle->track;
        const struct offsets o = offsets_at(here->heading_rad, here->offset_m, here->cant_rad,
                                            &e->reference, wheelset->x_m, -pair->radius_m, v);
        kl_both *qw = &e->motion[kl_wheelset_coordinate(model->n_bodies, w)];
        const kl_real rolling = v * (axle->track.cant_s_1_m - e->reference.cant_s_1_m);
        const kl_real turning = v * e->reference.curvature_1_m;
        set_motion(&qw[0], axle->x[KL_WS_Y] + o.y, axle->x[KL_WS_Y_RATE] + o.y_rate);
        set_motion(&qw[1], axle->z, axle->z_rate);
        set_motion(&qw[2], axle->roll + o.roll, axle->roll_rate + rolling);
        set_motion(&qw[3], axle->x[KL_WS_YAW] + o.yaw, axle->x[KL_WS_YAW_RATE] - turning);
    }
}

/* What one coordinate and its rate add to two rows. */
static inline void add_entry(const struct kl_spring *spring, const kl_real *q, kl_wide *sum) {
    KL_EACH_WIDE(h) {
        sum[h] += kl_wide_load(&spring->k, h) * kl_wide_twice(q, h);
    }
}

/* Two rows at a time: every coordinate is read once for both. */
static void suspension_forces(const struct kl_suspension *restrict suspension,
                              const kl_real *restrict motion, kl_real *restrict force) {
    const struct kl_spring *spring = suspension->spring;
    const uint16_t *place = suspension->place;
    const uint16_t *twins = suspension->twins;
    const uint16_t *end = twins + 3u * kl_count_twins(suspension);
    for (; twins != end; twins += 3) {
        kl_wide sum[4 / KL_WIDE] = {0};
        kl_real first;
        kl_real second;
        for (const uint16_t *last = place + twins[2]; place != last; place += 2, spring += 4) {
            add_entry(spring, &motion[place[0]], sum); /* one after the other */
            add_entry(spring + 2, &motion[place[1]], sum);
        }
        kl_wide_sums(sum, &first, &second);
        force[twins[0]] = -first;
        force[twins[1]] = -second;
    }
}

static struct kl_slip_origin slips_of(const struct kl_model *model, const struct kl_origin *from) {
    const uint32_t first = kl_slip_states(model);
    const struct kl_slip_origin slips = {&from->x[first], &from->rate[first], from->h};
    return slips;
}

/* ---- moving ---- */

static void move_bodies(const struct kl_model *model, const struct kl_input *input,
                        struct kl_evaluation *e) {
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        const struct kl_body *body = &model->bodies[b];
        const kl_real *acting = &e->force[kl_body_coordinate(b)];
        kl_real *rate = e->body[b].rate;
        rate[2 * KL_Y + 1] =
            (acting[KL_Y] + input->side_force_N[b]) * body->inverse[KL_Y] - e->body[b].aside;
        KL_UNROLL_4 for (uint32_t f = KL_Z; f < KL_FREEDOMS; f++) {
            rate[2u * f + 1u] = acting[f] * body->inverse[f];
        }
    }
}

/* Creep waits for no load, and while others sum those up its chain of operations gets on. */
static void rub_wheelsets(const struct kl_model *model, const struct kl_stage *stage,
                          const struct kl_input *input, struct kl_evaluation *e) {
    const kl_real v = stage->speed_m_s;
    const kl_real inv_creep_speed = KL_R(1) / kl_max_real(v, KL_R(KL_MIN_CREEP_SPEED_M_S));
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct kl_wheelset *wheelset = &model->wheelsets[w];
        struct kl_axle_forces *f = &e->forces[w];
        f->torque_Nm = input->axle_torque_Nm[w];
        f->speed_m_s = v;
        f->inv_creep_speed_s_m = inv_creep_speed;
        f->gravity_m_s2 = model->gravity_m_s2;
        f->table = model->creep_table;
        KL_EACH_LANE(g) {
            const struct kl_creep_def *creep = &wheelset->creep;
            KL_LANE(f->friction, g) = creep->friction * kl_lane_load(input->friction_factor[w], g);
            KL_LANE(f->slope, g) =
                (KL_R(0.5) * (creep->k_a + creep->k_s)) * kl_lane_load(input->slope_factor[w], g);
            if (creep->falls != 0) {
                KL_LANE(f->ratio, g) =
                    creep->falling_ratio * kl_lane_load(input->falling_factor[w], g);
                KL_LANE(f->decay, g) = kl_lane_all(creep->falling_decay_s_m) +
                                       kl_lane_load(input->falling_decay_s_m[w], g);
            }
        }
        kl_axle_find_creep(wheelset, &e->axle[w], f);
    }
}

static void load_wheelsets(const struct kl_model *model, struct kl_evaluation *e) {
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct kl_wheelset *wheelset = &model->wheelsets[w];
        const kl_real *acting = &e->force[kl_wheelset_coordinate(model->n_bodies, w)];
        kl_axle_prepare(wheelset, &model->pairs[wheelset->pair], &e->axle[w], acting,
                        &e->forces[w]);
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct kl_wheelset *wheelset = &model->wheelsets[w];
        kl_axle_weigh(wheelset, &model->pairs[wheelset->pair], &e->axle[w], &e->forces[w]);
    }
}

static void move_wheelsets(const struct kl_model *model, struct kl_evaluation *e) {
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        kl_axle_balance(&model->wheelsets[w], &e->axle[w], &e->forces[w]);
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct kl_axle_forces *f = &e->forces[w];
        kl_axle_accelerate(&model->wheelsets[w], &e->axle[w], &e->forces[w]);
        const kl_real least = kl_min_real(f->tread.normal[KL_RIGHT], f->tread.normal[KL_LEFT]);
        const int loaded = least > KL_R(0) || !(model->wheelsets[w].static_load_N > KL_R(0));
        e->faults |= loaded ? 0u : (uint32_t)KL_FAULT_WHEEL_LIFT;
    }
}

void kl_evaluate(const struct kl_model *model, const struct kl_origin *from,
                 const struct kl_stage *stage, const struct kl_input *restrict input,
                 struct kl_evaluation *restrict e) {
    e->faults = 0;
    read_track(model, stage, e);
    place_bodies(model, from, stage, e);
    place_wheelsets(model, from, stage, e);
    if (model->n_twists != 0) {
        kl_twists_carry(model, from, e);
    }
    rub_wheelsets(model, stage, input, e);
    suspension_forces(&model->suspension, (const kl_real *)e->motion, e->force);
    const struct kl_slip_origin slips = slips_of(model, from);
    kl_struts_act(&model->struts, &slips, e->motion, input, e->force, &e->slipped);
    load_wheelsets(model, e);
    move_bodies(model, input, e);
    move_wheelsets(model, e);
    if (model->n_twists != 0) {
        kl_twists_move(model, input, e);
    }
}

/* Twice what is in the linear springs. */
static kl_real elastic_energy(const struct kl_suspension *suspension, const kl_real *motion) {
    const struct kl_spring *spring = suspension->spring;
    const uint16_t *place = suspension->place;
    const uint16_t *twins = suspension->twins;
    kl_real twice = KL_R(0);
    for (uint32_t t = kl_count_twins(suspension); t != 0; t--, twins += 3) {
        const kl_real first = motion[KL_PLACE(twins[0])];
        const int alone = twins[1] == suspension->n_coordinates;
        const kl_real second = alone ? KL_R(0) : motion[KL_PLACE(twins[1])];
        for (uint32_t n = twins[2]; n != 0; n--, spring += 2, place++) {
            twice += (first * spring[0].k + second * spring[1].k) * motion[*place];
        }
    }
    return twice;
}

kl_real kl_energy(const struct kl_model *model, const struct kl_state *state,
                  struct kl_work *work) {
    struct kl_evaluation *e = kl_evaluation_in(work);
    const struct kl_stage stage = {state->s_m, state->speed_m_s, KL_R(0)};
    const struct kl_origin here = {state->x, state->rate, state->lift, KL_R(0)};
    kl_input_init(&e->kept);
    kl_evaluate(model, &here, &stage, &e->kept, e);
    kl_real twice = elastic_energy(&model->suspension, (const kl_real *)e->motion) +
                    kl_struts_energy(&model->struts, slips_of(model, &here).u, e->motion);
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        const struct kl_body *body = &model->bodies[b];
        for (uint32_t f = 0; f < KL_FREEDOMS; f++) {
            const kl_real rate = e->body[b].x[2u * f + 1u];
            const kl_real inertia =
                f < (uint32_t)KL_ROLL ? body->mass_kg : body->inertia_kgm2[f - KL_ROLL];
            twice += inertia * (rate * rate);
        }
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct kl_wheelset *ws = &model->wheelsets[w];
        const struct kl_axle *axle = &e->axle[w];
        const kl_real p = axle->x[KL_WS_Y_RATE];
        const kl_real yaw = axle->x[KL_WS_YAW_RATE];
        const kl_real right = axle->spin[KL_RIGHT];
        const kl_real left = axle->spin[KL_LEFT];
        const kl_real spin = KL_R(0.5) * (right * right + left * left);
        twice += ws->mass_kg * (p * p + axle->z_rate * axle->z_rate) +
                 ws->inertia_roll_kgm2 * (axle->roll_rate * axle->roll_rate) +
                 ws->inertia_yaw_kgm2 * (yaw * yaw) + ws->inertia_spin_kgm2 * spin;
        const struct kl_pair *pair = &model->pairs[ws->pair];
        for (int s = 0; s < KL_SIDES; s++) {
            const kl_real q = axle->rail.q[s];
            twice +=
                q * (pair->flange_stiffness_N_m * q + ws->static_load_N * pair->central_tan[s]);
        }
        const kl_real down = ws->preload[1] + ws->mass_kg * model->gravity_m_s2;
        twice -=
            KL_R(2) * ((down * axle->z + ws->preload[2] * axle->roll) +
                       (ws->preload[0] * axle->x[KL_WS_Y] + ws->preload[3] * axle->x[KL_WS_YAW]));
    }
    return KL_R(0.5) * twice;
}
