/* cmd_dbc.c - klingel dbc: the bus of a vehicle as a DBC file. */
#include "cli.h"
#include "cli_bus.h"
#include "kl_dbc.h"

int cmd_dbc(int argc, char **argv) {
    const char *file = "-";
    struct cli_bus bus = {.divider = 1};
    struct cli_list set = {0};
    const char *operand[CLI_MAX_OPERANDS];
    int status = CLI_OK;
    const struct cli_option options[] = {
        {.name = "--output",
         .alias = "-o",
         .argument = "FILE",
         .kind = CLI_TEXT,
         .value = &file,
         .help = "write to FILE; default -, standard output"},
        CLI_DIVIDER_OPTION(&bus),
        CLI_SET_OPTION(&set),
    };
    const struct cli_command command = {
        .operands = "MODEL",
        .least = 1,
        .most = 1,
        .purpose =
            "Writes the messages and signals of a vehicle's bus as a DBC file, for python-can,\n"
            "SavvyCAN, CANalyzer and others.",
        .example = "klingel dbc models/two_axle_wagon.yaml -o wagon.dbc\n",
        .options = options,
        .n_options = sizeof options / sizeof options[0]};
    if (!cli_parse(&command, argc, argv, operand, &status)) {
        return status;
    }
    struct cli_model m;
    status = cli_model_load(&m, operand[0], NULL, &set);
    if (status == CLI_OK) {
        status = cli_bus_write(&m, &bus, file, kl_dbc_write);
        cli_model_close(&m);
    }
    return status;
}
