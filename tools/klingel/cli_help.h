/* cli_help.h - --help of a sub-command, made of its option table. */
#ifndef CLI_HELP_H
#define CLI_HELP_H

#include "cli.h"

/* Prints to standard output; CLI_OK, or CLI_FAILED if that failed. */
int cli_help(const struct cli_command *command);

#endif
