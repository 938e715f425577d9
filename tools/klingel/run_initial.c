/* run_initial.c - "wheelset.y=3mm" into a state. */
#include <string.h>

#include "run_record.h"

/* What can be given for a body and for a wheelset. Rates are relative to the track. */
static const struct coordinate {
    const char *name;
    int wheelset; /* enum kl_wheelset_state; -1: a wheelset has none */
    int body;     /* enum kl_freedom; -1: a body has none */
    int rate;
    const char *unit;
} coordinates[] = {
    {"y", KL_WS_Y, KL_Y, 0, "m"},
    {"yaw", KL_WS_YAW, KL_YAW, 0, "rad"},
    {"z", -1, KL_Z, 0, "m"},
    {"roll", -1, KL_ROLL, 0, "rad"},
    {"pitch", -1, KL_PITCH, 0, "rad"},
    {"y_rate", KL_WS_Y_RATE, KL_Y, 1, "m/s"},
    {"yaw_rate", KL_WS_YAW_RATE, KL_YAW, 1, "rad/s"},
    {"z_rate", -1, KL_Z, 1, "m/s"},
    {"roll_rate", -1, KL_ROLL, 1, "rad/s"},
    {"pitch_rate", -1, KL_PITCH, 1, "rad/s"},
    {"spin", KL_WS_SPIN, -1, 1, "rad/s"},
    {"twist", KL_WS_TWIST, -1, 1, "rad/s"},
};
#define N_COORDINATES (sizeof coordinates / sizeof coordinates[0])

/* Index into state->x of a coordinate of part `name`; -1: the part does not have it, -2: there is
 * no such part. */
static int32_t locate(const struct kl_model *model, const char *part, size_t length,
                      const struct coordinate *c) {
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const char *name = model->wheelsets[w].name;
        if (strlen(name) == length && strncmp(name, part, length) == 0) {
            return c->wheelset < 0
                       ? -1
                       : kl_wheelset_state_index(model, w, (enum kl_wheelset_state)c->wheelset);
        }
    }
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        const char *name = model->bodies[b].name;
        if (strlen(name) == length && strncmp(name, part, length) == 0) {
            return c->body < 0 ? -1
                               : kl_body_state_index(model, b, (enum kl_freedom)c->body, c->rate);
        }
    }
    return -2;
}

static int no_such_part(const struct kl_model *model, const char *text, size_t length) {
    const char *names[KL_MAX_BODIES + KL_MAX_WHEELSETS];
    char part[KL_NAME_SIZE];
    size_t n = 0;
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        names[n++] = model->wheelsets[w].name;
    }
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        names[n++] = model->bodies[b].name;
    }
    snprintf(part, sizeof part, "%.*s", (int)length, text);
    const char *near = cli_nearest(part, names, n);
    return cli_misuse("--initial %s: the model has no body or wheelset '%s'; %s %s", text, part,
                      near != NULL ? "did you mean" : "its first wheelset is",
                      near != NULL ? near : names[0]);
}

static int no_such_coordinate(const struct kl_model *model, const char *text, const char *part,
                              size_t length) {
    char known[160] = "";
    for (size_t i = 0; i < N_COORDINATES; i++) {
        if (locate(model, part, length, &coordinates[i]) >= 0) {
            size_t at = strlen(known);
            snprintf(known + at, sizeof known - at, " %s", coordinates[i].name);
        }
    }
    return cli_misuse("--initial %s: %.*s has these:%s", text, (int)length, part, known);
}

int run_set_initial(const struct kl_model *model, struct kl_state *state, const char *assignment) {
    char why[160];
    const char *equals = strchr(assignment, '=');
    const char *dot = strchr(assignment, '.');
    if (equals == NULL || dot == NULL || dot > equals) {
        return cli_misuse("--initial %s: must be PART.COORDINATE=VALUE, such as %s.y=3mm",
                          assignment, model->wheelsets[0].name);
    }
    size_t part = (size_t)(dot - assignment);
    size_t length = (size_t)(equals - dot) - 1;
    if (locate(model, assignment, part, &coordinates[0]) == -2) {
        return no_such_part(model, assignment, part);
    }
    for (size_t i = 0; i < N_COORDINATES; i++) {
        const struct coordinate *c = &coordinates[i];
        if (strlen(c->name) != length || strncmp(c->name, dot + 1, length) != 0) {
            continue;
        }
        int32_t index = locate(model, assignment, part, c);
        double value = 0.0;
        if (index < 0) {
            break;
        }
        if (!cli_quantity(equals + 1, c->unit, &value, why, sizeof why)) {
            return cli_misuse("--initial %s: %s", assignment, why);
        }
        /* rates in the state hold what the track does as well; kl_init has put that in */
        bool added = c->rate != 0 && c->wheelset != KL_WS_SPIN && c->wheelset != KL_WS_TWIST;
        state->x[index] = (kl_real)value + (added ? state->x[index] : (kl_real)0);
        return CLI_OK;
    }
    return no_such_coordinate(model, assignment, assignment, part);
}
