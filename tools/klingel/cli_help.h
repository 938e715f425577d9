/* cli_help.h - --help of a sub-command, made of its option table. */
#ifndef CLI_HELP_H
#define CLI_HELP_H

#include "cli.h"

/* The operands as shown to the user: "MODEL [TRACK]". */
const char *cli_operands(const struct cli_command *command);

/* Prints to standard output; CLI_OK, or CLI_FAILED if that failed. */
int cli_help(const struct cli_command *command);

#endif
