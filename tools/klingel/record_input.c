/* record_input.c - the inputs of a model by number, and the CRC of recordings. */
#include <string.h>

#include "record.h"

/* A struct kl_input is reals and nothing else. */
#define PLACE(member) ((uint16_t)(offsetof(struct kl_input, member) / sizeof(kl_real)))
_Static_assert(sizeof(struct kl_input) % sizeof(kl_real) == 0, "kl_input holds reals alone");
_Static_assert(sizeof(struct kl_input) / sizeof(kl_real) <= RECORD_MAX_INPUTS,
               "an input has no number: name it here and in RECORD_MAX_INPUTS");

static const struct {
    const char *name;
    uint16_t place;
} of_wheel[] = {{"friction_factor", PLACE(friction_factor)},
                {"slope_factor", PLACE(slope_factor)},
                {"falling_factor", PLACE(falling_factor)},
                {"falling_decay_s_m", PLACE(falling_decay_s_m)}};
#define OF_WHEEL (sizeof of_wheel / sizeof of_wheel[0])
#define OF_WHEELSET (1u + KL_SIDES * (uint32_t)OF_WHEEL)

static uint32_t count_actuators(const struct kl_model *model) {
    uint32_t n = 0;
    for (uint32_t i = 0; i < model->struts.n_actuators; i++) {
        n = model->struts.input[i] >= n ? model->struts.input[i] + 1u : n;
    }
    return n;
}

void record_inputs_of(const struct kl_model *model, struct record_inputs *inputs) {
    uint32_t n = 0;
    inputs->place[n++] = PLACE(speed_m_s);
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        inputs->place[n++] = (uint16_t)(PLACE(axle_torque_Nm) + w);
        for (uint32_t k = 0; k < KL_SIDES * OF_WHEEL; k++) {
            inputs->place[n++] =
                (uint16_t)(of_wheel[k / KL_SIDES].place + KL_SIDES * w + k % KL_SIDES);
        }
    }
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        inputs->place[n++] = (uint16_t)(PLACE(side_force_N) + b);
    }
    for (uint32_t i = 0; i < count_actuators(model); i++) {
        inputs->place[n++] = (uint16_t)(PLACE(actuator_N) + i);
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        if (model->wheelsets[w].independent != 0) {
            inputs->place[n++] = (uint16_t)(PLACE(twist_torque_Nm) + w);
        }
    }
    if (model->running.free != 0) {
        inputs->place[n++] = PLACE(draw_force_N);
    }
    inputs->n = n;
}

/* The i-th wheelset with independent wheels. */
static const char *independent(const struct kl_model *model, uint32_t i) {
    uint32_t w = 0;
    for (uint32_t n = 0; w + 1u < model->n_wheelsets; w++) {
        n += model->wheelsets[w].independent;
        if (n > i) {
            break;
        }
    }
    return model->wheelsets[w].name;
}

void record_input_name(const struct kl_model *model, uint32_t i, char name[RECORD_INPUT_NAME]) {
    const uint32_t bodies = 1u + OF_WHEELSET * model->n_wheelsets;
    const uint32_t twists = bodies + model->n_bodies + count_actuators(model);
    if (i == 0) {
        snprintf(name, RECORD_INPUT_NAME, "speed_m_s");
    } else if (i < bodies) {
        const char *wheelset = model->wheelsets[(i - 1u) / OF_WHEELSET].name;
        const uint32_t k = (i - 1u) % OF_WHEELSET;
        if (k == 0) {
            snprintf(name, RECORD_INPUT_NAME, "%s.axle_torque_Nm", wheelset);
        } else {
            snprintf(name, RECORD_INPUT_NAME, "%s.%s.%s", wheelset,
                     (k - 1u) % KL_SIDES == KL_RIGHT ? "right" : "left",
                     of_wheel[(k - 1u) / KL_SIDES].name);
        }
    } else if (i < bodies + model->n_bodies) {
        snprintf(name, RECORD_INPUT_NAME, "%s.side_force_N", model->bodies[i - bodies].name);
    } else if (i >= twists + model->n_twists) {
        snprintf(name, RECORD_INPUT_NAME, "draw_force_N");
    } else if (i >= twists) {
        snprintf(name, RECORD_INPUT_NAME, "%s.twist_torque_Nm", independent(model, i - twists));
    } else {
        snprintf(name, RECORD_INPUT_NAME, "actuator_%u_N",
                 (unsigned)(i - bodies - model->n_bodies + 1u));
    }
}

kl_real record_input_get(const struct record_inputs *inputs, const struct kl_input *input,
                         uint32_t i) {
    return ((const kl_real *)input)[inputs->place[i]];
}

void record_input_set(const struct record_inputs *inputs, struct kl_input *input, uint32_t i,
                      kl_real value) {
    ((kl_real *)input)[inputs->place[i]] = value;
}

uint32_t record_crc(uint32_t crc, const void *data, size_t size_bytes) {
    const unsigned char *bytes = data;
    crc = ~crc;
    for (size_t i = 0; i < size_bytes; i++) {
        crc ^= bytes[i];
        for (int bit = 0; bit < 8; bit++) {
            crc = (crc >> 1) ^ (UINT32_C(0xedb88320) & (0u - (crc & 1u)));
        }
    }
    return ~crc;
}
