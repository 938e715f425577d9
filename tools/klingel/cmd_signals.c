/* cmd_signals.c - klingel signals: the bus of a vehicle as documentation. */
#include "cli.h"
#include "cli_bus.h"

/* The load of the bus as the last line of the documentation. */
static enum kl_status write_document(const struct kl_layout *layout,
                                     const struct kl_text_sink *sink) {
    struct kl_bus_load load;
    char text[160];
    enum kl_status status = kl_signals_markdown(layout, sink);
    if (status == KL_OK && kl_bus_load(layout, 1000000, &load) == KL_OK) {
        cli_bus_load_text(&load, 1000000, text, sizeof text);
        fprintf(sink->context, "\nBus load of this vehicle: %s.\n", text);
    }
    return status;
}

int cmd_signals(int argc, char **argv) {
    const char *csv = NULL;
    const char *file = "-";
    struct cli_bus bus = {.divider = 1};
    struct cli_target target;
    int status = CLI_OK;
    const struct cli_option options[] = {
        cli_output_option(&file, "write to FILE; default -, standard output"),
        cli_maybe_file_option("--csv", &csv,
                              "one line per signal of every message as CSV; without FILE, or\n"
                              "with -, to standard output in place of the document"),
        cli_divider_option(&bus),
    };
    const struct cli_command command = {
        .purpose = "Describes the messages and signals of a vehicle's bus as a Markdown document:\n"
                   "identifiers, cycle times, bits, factors, units, ranges, meanings; bus load.",
        .example = "klingel signals models/two_axle_wagon.yaml -o signals.md --csv signals.csv\n",
        .options = options,
        .n_options = sizeof options / sizeof options[0]};
    if (!cli_parse(&command, argc, argv, &target, &status)) {
        return status;
    }
    struct cli_model m;
    status = cli_model_load(&m, &target);
    if (status != CLI_OK) {
        return status;
    }
    if (csv != NULL) {
        status = cli_bus_write(&m, &bus, csv, kl_signals_csv);
    }
    if (status == CLI_OK && !cli_is_stdout(csv)) {
        status = cli_bus_write(&m, &bus, file, write_document);
    }
    cli_model_close(&m);
    return status;
}
