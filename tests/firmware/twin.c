/*
 * twin.c - what the firmware must have done, computed on the host with the same linked model.
 *
 * usage: twin SPEED_M_S STEPS [SPEED_M_S STEPS ...] [--state FILE]
 * Starts at the first speed, as the firmware is built to, and runs each number of steps with its
 * set-point. Prints
 *     state HASH bytes N
 *     frame ID DATA MASK     every state and info message of the last step; mask 0 where a counter is
 * With --state: the hash of the state in FILE, as it was read from the target's memory, instead.
 */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "kl_signals.h"
#include "klingel.h"

extern const struct kl_model KL_FIRMWARE_MODEL;

static struct kl_state state;
static struct kl_output output;
static struct kl_work work;

static int hash_of_file(const char *path) {
    FILE *file = fopen(path, "rb");
    size_t n = file != NULL ? fread(&state, 1, sizeof state, file) : 0;
    if (file != NULL) {
        (void)fclose(file);
    }
    if (n != sizeof state || state.n_states > KL_MAX_STATES) {
        (void)fprintf(stderr, "twin: %s holds no state\n", path);
        return 1;
    }
    printf("state %016" PRIx64 " tick %" PRIu64 "\n", kl_state_hash(&state), state.tick);
    return 0;
}

static void print_frame(const struct kl_message *message, uint32_t instance,
                        const struct kl_bus_view *view) {
    struct kl_can_frame frame;
    uint8_t mask[8];
    memset(mask, 0xFF, sizeof mask);
    kl_message_encode(message, instance, view, NULL, &frame);
    for (uint32_t i = 0; i < message->n_signals; i++) {
        if (message->signals[i].source == KL_FROM_COUNTER) {
            kl_signal_insert(&message->signals[i], 0, mask);
        }
    }
    printf("frame %03x ", message->id + instance);
    for (uint32_t i = 0; i < frame.length; i++) {
        printf("%02x", frame.data[i]);
    }
    printf(" ");
    for (uint32_t i = 0; i < frame.length; i++) {
        printf("%02x", mask[i]);
    }
    printf("\n");
}

static void print_frames(const struct kl_model *model) {
    const struct kl_layout layout = {.n_bodies = model->n_bodies,
                                     .n_wheelsets = model->n_wheelsets,
                                     .step_ns = model->step_ns,
                                     .state_divider = 1};
    const struct kl_bus_status status = {.model_hash = model->hash};
    const struct kl_bus_view view = {.output = &output, .status = &status};
    const struct kl_message *messages = kl_signal_messages();
    for (uint32_t m = 0; m < KL_MESSAGES; m++) {
        bool wanted = messages[m].is_state || m == KL_MSG_INFO_MODEL;
        for (uint32_t i = 0; wanted && i < kl_message_instances(&layout, &messages[m]); i++) {
            print_frame(&messages[m], i, &view);
        }
    }
}

int main(int argc, char **argv) {
    const struct kl_model *model = &KL_FIRMWARE_MODEL;
    struct kl_input input;
    if (argc == 3 && strcmp(argv[1], "--state") == 0) {
        return hash_of_file(argv[2]);
    }
    kl_input_init(&input);
    if (argc < 3 || kl_init(model, &state, 0, (kl_real)strtod(argv[1], NULL), &work) != KL_OK) {
        (void)fprintf(stderr, "usage: twin SPEED_M_S STEPS [SPEED_M_S STEPS ...] | --state FILE\n");
        return 2;
    }
    for (int a = 1; a + 1 < argc; a += 2) {
        input.speed_m_s = (kl_real)strtod(argv[a], NULL);
        for (unsigned long i = strtoul(argv[a + 1], NULL, 10); i > 0; i--) {
            (void)kl_step(model, &state, &input, &output, &work);
        }
    }
    printf("state %016" PRIx64 " bytes %zu\n", kl_state_hash(&state), sizeof state);
    print_frames(model);
    return 0;
}
