/* state_signals.c - every number of a state with its name and unit. */
#include "state_signals.h"

#include <string.h>

static const struct {
    const char *name;
    const char *unit;
    const char *rate_unit;
} body_freedom[KL_FREEDOMS] = {{"y", "mm", "mm/s"},
                               {"z", "mm", "mm/s"},
                               {"roll", "mrad", "mrad/s"},
                               {"pitch", "mrad", "mrad/s"},
                               {"yaw", "mrad", "mrad/s"}},
  wheelset_state[KL_WHEELSET_STATES] = {{"y", "mm", "mm/s"},
                                        {"y_rate", "mm/s", "mm/s2"},
                                        {"yaw", "mrad", "mrad/s"},
                                        {"yaw_rate", "mrad/s", "mrad/s2"},
                                        {"spin", "rad/s", "rad/s2"}};

static double scale_of(const char *unit) {
    return unit[0] == 'm' && (unit[1] == 'm' || unit[1] == 'r') ? 1e3
           : unit[0] == 'k' && unit[1] == 'N'                   ? 1e-3
                                                                : 1.0;
}

static void add(struct state_signal *signals, uint32_t *n, const char *unit, const char *part,
                const char *name) {
    struct state_signal *s = &signals[(*n)++];
    snprintf(s->name, sizeof s->name, "%s%s%s", part, part[0] != '\0' ? "." : "", name);
    s->unit = unit;
    s->scale = scale_of(unit);
}

static uint32_t name_states(const struct kl_model *model, struct state_signal *signals, uint32_t n,
                            bool rates) {
    char name[32];
    const char *const next = rates ? ", next rate" : "";
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        for (uint32_t f = 0; f < KL_FREEDOMS; f++) {
            if ((model->bodies[b].freedoms & KL_HAS(f)) != 0) {
                const char *first = rates ? body_freedom[f].rate_unit : body_freedom[f].unit;
                const char *second = !rates                           ? body_freedom[f].rate_unit
                                     : body_freedom[f].unit[1] == 'm' ? "mm/s2"
                                                                      : "mrad/s2";
                snprintf(name, sizeof name, "%s%s", body_freedom[f].name, next);
                add(signals, &n, first, model->bodies[b].name, name);
                snprintf(name, sizeof name, "%s_rate%s", body_freedom[f].name, next);
                add(signals, &n, second, model->bodies[b].name, name);
            }
        }
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        for (uint32_t i = 0; i < KL_WHEELSET_STATES; i++) {
            snprintf(name, sizeof name, "%s%s", wheelset_state[i].name, next);
            add(signals, &n, rates ? wheelset_state[i].rate_unit : wheelset_state[i].unit,
                model->wheelsets[w].name, name);
        }
    }
    for (uint32_t i = 0; i < model->struts.n_slips; i++) {
        snprintf(name, sizeof name, "slip_%u%s", (unsigned)i, next);
        add(signals, &n, rates ? "mm/s" : "mm", "", name);
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        for (int s = 0; s < KL_SIDES && kl_rail_state_index(model, w, KL_RIGHT) >= 0; s++) {
            snprintf(name, sizeof name, "%s.rail%s", s == KL_RIGHT ? "right" : "left", next);
            add(signals, &n, rates ? "mm/s" : "mm", model->wheelsets[w].name, name);
        }
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        if (model->wheelsets[w].independent != 0) {
            snprintf(name, sizeof name, "twist%s", next);
            add(signals, &n, rates ? "rad/s2" : "rad/s", model->wheelsets[w].name, name);
        }
    }
    return n;
}

uint32_t state_signals(const struct kl_model *model, struct state_signal *signals) {
    uint32_t n = 0;
    add(signals, &n, "m", "", "s");
    add(signals, &n, "m/s", "", "speed");
    add(signals, &n, "", "", "faults");
    add(signals, &n, "steps", "", "tick");
    if (model->running.free != 0) {
        add(signals, &n, "m/s2", "", "speed, next rate");
    }
    n = name_states(model, signals, n, false);
    n = name_states(model, signals, n, true);
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        static const char *const lift[] = {"right.rise",     "left.rise",    "right.rise_rate",
                                           "left.rise_rate", "right.normal", "left.normal"};
        static const char *const unit[] = {"mm", "mm/s", "kN"};
        for (uint32_t i = 0; i < 3u * KL_SIDES; i++) {
            add(signals, &n, unit[i / KL_SIDES], model->wheelsets[w].name, lift[i]);
        }
    }
    return n;
}

void state_values(const struct kl_model *model, const struct kl_state *state, double *values) {
    uint32_t n = 0;
    values[n++] = (double)state->s_m;
    values[n++] = (double)state->speed_m_s;
    values[n++] = (double)state->faults;
    values[n++] = (double)state->tick;
    if (model->running.free != 0) {
        values[n++] = (double)state->speed_rate_m_s2;
    }
    for (uint32_t i = 0; i < model->n_states; i++) {
        values[n++] = (double)state->x[i];
    }
    for (uint32_t i = 0; i < model->n_states; i++) {
        values[n++] = (double)state->rate[i];
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct kl_lift *lift = &state->lift[w];
        for (int s = 0; s < KL_SIDES; s++) {
            values[n + (uint32_t)s] = (double)lift->rise_m[s];
            values[n + KL_SIDES + (uint32_t)s] = (double)lift->rate_m_s[s];
            values[n + 2u * KL_SIDES + (uint32_t)s] = (double)lift->normal_N[s];
        }
        n += 3u * KL_SIDES;
    }
}
