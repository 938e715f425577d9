#include "cli_bus.h"

struct cli_option cli_divider_option(struct cli_bus *bus) {
    return (struct cli_option){.name = "--state-divider",
                               .argument = "N",
                               .kind = CLI_COUNT,
                               .value = &bus->divider,
                               .low = 1,
                               .high = 1000,
                               .help = "send states only every Nth time; 1..1000, default 1"};
}

struct cli_option cli_bit_rate_option(struct cli_bus *bus) {
    return (struct cli_option){
        .name = "--bit-rate",
        .argument = "RATE",
        .kind = CLI_COUNT,
        .value = &bus->bit_rate,
        .low = 0,
        .high = 1e6,
        .help = "bit/s of the bus, for its load; default 0, a virtual bus without limit"};
}

struct kl_layout cli_bus_layout(const struct cli_model *m, const struct cli_bus *bus) {
    uint32_t n_actuators = 0;
    for (uint32_t i = 0; i < m->file.vehicle.n_elements; i++) {
        const uint32_t input = m->file.vehicle.elements[i].actuator;
        n_actuators = input > n_actuators ? input : n_actuators;
    }
    bool independent = false;
    for (uint32_t i = 0; i < m->file.vehicle.n_wheelsets; i++) {
        independent = independent || m->file.vehicle.wheelsets[i].independent != 0;
    }
    return (struct kl_layout){.n_bodies = m->file.vehicle.n_bodies,
                              .n_wheelsets = m->file.vehicle.n_wheelsets,
                              .n_actuators = n_actuators,
                              .free_speed = m->file.vehicle.running.free != 0,
                              .independent = independent,
                              .step_ns = m->file.vehicle.step_ns,
                              .state_divider = (uint32_t)bus->divider};
}

int cli_bus_write(const struct cli_model *m, const struct cli_bus *bus, const char *path,
                  cli_bus_writer writer) {
    struct cli_output output;
    int status = cli_output_open(&output, path);
    if (status != CLI_OK) {
        return status;
    }
    const struct kl_layout layout = cli_bus_layout(m, bus);
    const struct kl_text_sink sink = {cli_sink_write, output.file};
    enum kl_status written = writer(&layout, &sink);
    if (written != KL_OK && written != KL_ERR_MEMORY) { /* MEMORY: cli_output_close knows more */
        status = cli_fail("cannot describe the bus: %s", kl_status_text(written));
    }
    return cli_output_close(&output, status);
}

void cli_bus_load_text(const struct kl_bus_load *load, uint64_t bit_rate, char *text, size_t size) {
    int n = snprintf(text, size, "%llu frames/s, %.2f Mbit/s",
                     (unsigned long long)load->frames_per_s, (double)load->bits_per_s * 1e-6);
    if (bit_rate > 0 && n > 0 && (size_t)n < size) {
        snprintf(text + n, size - (size_t)n, ", %.1f %% of %.0f kbit/s%s",
                 0.1 * (double)load->permille, (double)bit_rate * 1e-3,
                 load->verdict == KL_LOAD_HIGH       ? " (high: above 70 %)"
                 : load->verdict == KL_LOAD_EXCEEDED ? " (more than there is)"
                                                     : "");
    }
}
