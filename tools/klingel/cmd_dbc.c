/* cmd_dbc.c - klingel dbc: the bus of a vehicle as a DBC file. */
#include "cli.h"
#include "cli_bus.h"
#include "kl_dbc.h"

int cmd_dbc(int argc, char **argv) {
    const char *file = "-";
    struct cli_bus bus = {.divider = 1};
    struct cli_target target;
    int status = CLI_OK;
    const struct cli_option options[] = {
        cli_output_option(&file, "write to FILE; default -, standard output"),
        cli_divider_option(&bus),
    };
    const struct cli_command command = {
        .purpose =
            "Writes the messages and signals of a vehicle's bus as a DBC file, for python-can,\n"
            "SavvyCAN, CANalyzer and others.",
        .example = "klingel dbc models/two_axle_wagon.yaml -o wagon.dbc\n",
        .options = options,
        .n_options = sizeof options / sizeof options[0]};
    if (!cli_parse(&command, argc, argv, &target, &status)) {
        return status;
    }
    struct cli_model m;
    status = cli_model_load(&m, &target);
    if (status == CLI_OK) {
        status = cli_bus_write(&m, &bus, file, kl_dbc_write);
        cli_model_close(&m);
    }
    return status;
}
