/*
 * dbc_peer - our codec for a test in another language to talk to.
 *
 * usage: dbc_peer dbc BODIES WHEELSETS        print the DBC of that bus
 *        dbc_peer frames BODIES WHEELSETS N   N random frames per message:
 *                                             "id hex", then per signal "name raw physical"
 *        dbc_peer quantise BODIES WHEELSETS   per input line "id name value": print the raw value
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "kl_dbc.h"

static uint64_t random_bits(uint64_t *seed) { /* splitmix64 */
    uint64_t z = (*seed += UINT64_C(0x9E3779B97F4A7C15));
    z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
    return z ^ (z >> 31);
}

static int to_stdout(void *context, const char *text, size_t size) {
    (void)context;
    return fwrite(text, 1, size, stdout) == size ? 0 : -1;
}

static void print_frame(const struct kl_message *message, uint32_t instance, uint64_t *seed) {
    uint8_t data[8] = {0};
    int64_t raw[64];
    for (uint32_t i = 0; i < message->n_signals; i++) {
        const struct kl_signal *s = &message->signals[i];
        uint64_t span = (uint64_t)(kl_signal_raw_max(s) - kl_signal_raw_min(s)) + 1;
        raw[i] = kl_signal_raw_min(s) + (int64_t)(random_bits(seed) % span);
        kl_signal_insert(s, raw[i], data);
    }
    printf("%u ", (unsigned)(message->id + instance));
    for (uint32_t i = 0; i < 8; i++) {
        printf("%02x", (unsigned)data[i]);
    }
    for (uint32_t i = 0; i < message->n_signals; i++) {
        const struct kl_signal *s = &message->signals[i];
        printf(" %s %lld %.17g", s->name, (long long)raw[i], kl_signal_physical(s, raw[i]));
    }
    printf("\n");
}

static int frames(const struct kl_layout *layout, unsigned long n) {
    uint64_t seed = 20260101;
    for (uint32_t i = 0; i < KL_MESSAGES; i++) {
        const struct kl_message *message = &kl_signal_messages()[i];
        for (uint32_t k = 0; k < kl_message_instances(layout, message); k++) {
            for (unsigned long j = 0; j < n; j++) {
                print_frame(message, k, &seed);
            }
        }
    }
    return 0;
}

static int quantise(const struct kl_layout *layout) {
    unsigned id;
    char name[64];
    double value;
    while (scanf("%u %63s %lf", &id, name, &value) == 3) {
        uint32_t index;
        uint32_t instance;
        const struct kl_signal *signal = kl_message_find(layout, id, &index, &instance)
                                             ? kl_signal_find(&kl_signal_messages()[index], name)
                                             : NULL;
        if (signal == NULL) {
            return 1;
        }
        printf("%lld\n", (long long)kl_signal_quantise(signal, value, NULL));
    }
    return 0;
}

int main(int argc, char **argv) {
    const struct kl_text_sink sink = {.write = to_stdout};
    if (argc < 5) {
        fprintf(stderr, "usage: dbc_peer dbc|frames|quantise BODIES WHEELSETS ACTUATORS [N]\n");
        return 2;
    }
    const struct kl_layout layout = {.n_bodies = (uint32_t)atoi(argv[2]),
                                     .n_wheelsets = (uint32_t)atoi(argv[3]),
                                     .n_actuators = (uint32_t)atoi(argv[4]),
                                     .free_speed = true,
                                     .independent = true,
                                     .step_ns = 1000000,
                                     .state_divider = 1};
    if (strcmp(argv[1], "dbc") == 0) {
        return kl_dbc_write(&layout, &sink) == KL_OK ? 0 : 1;
    }
    if (strcmp(argv[1], "frames") == 0) {
        return frames(&layout, argc > 5 ? strtoul(argv[5], NULL, 10) : 10);
    }
    return strcmp(argv[1], "quantise") == 0 ? quantise(&layout) : 2;
}
