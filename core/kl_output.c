/* kl_output.c - what a step tells of the vehicle. */
#include "kl_rates.h"

#include "kl_math.h"

void kl_write_output(const struct kl_model *model, const struct kl_state *state,
                     const struct kl_stage *stage, const struct kl_evaluation *restrict e,
                     struct kl_output *restrict output) {
    const kl_real *x = state->x;
    const kl_real v = stage->speed_m_s;
    output->tick = state->tick;
    output->time_ns = (int64_t)state->tick * model->step_ns;
    output->faults = state->faults;
    output->s_m = state->s_m;
    output->speed_m_s = state->speed_m_s;
    output->acceleration_m_s2 = stage->speed_rate_m_s2;
    output->track = e->reference;
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        const struct kl_body *body = &model->bodies[b];
        const struct kl_body_motion *motion = &e->body[b];
        struct kl_body_output *o = &output->body[b];
        for (uint32_t f = 0; f < KL_FREEDOMS; f++) {
            const int has = (body->freedoms & KL_HAS(f)) != 0;
            o->position[f] = motion->x[2u * f];
            o->rate[f] = has ? x[1] - (motion->x[2u * f + 1u] - motion->rate[2u * f]) : KL_R(0);
            o->acceleration[f] = has ? motion->rate[2u * f + 1u] : KL_R(0);
            x += has ? 2 : 0;
        }
        o->acceleration[KL_Y] += (body->freedoms & KL_HAS(KL_Y)) != 0 ? motion->aside : KL_R(0);
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct kl_axle *axle = &e->axle[w];
        struct kl_wheelset_output *o = &output->wheelset[w];
        const struct kl_pair *pair = &model->pairs[model->wheelsets[w].pair];
        kl_axle_output(axle, &e->forces[w], pair, o);
        o->y_m = x[KL_WS_Y];
        o->yaw_rad = x[KL_WS_YAW];
        o->spin_rad_s = x[KL_WS_SPIN];
        o->y_rate_m_s = x[KL_WS_Y_RATE] - pair->radius_m * (v * axle->track.cant_s_1_m);
        o->yaw_rate_rad_s = x[KL_WS_YAW_RATE] - v * axle->track.curvature_1_m;
        x += KL_WHEELSET_STATES;
    }
}
