/* main.c - klingel: one command, its sub-commands. */
#include <string.h>

#include "cli.h"

static const struct sub_command {
    const char *name;
    int (*run)(int argc, char **argv);
    const char *what;
} sub_commands[] = {
    {"sketch", cmd_sketch, "a picture of the vehicle that a file describes"},
    {"geometry", cmd_geometry, "wheel-rail geometry: contact tables, conicity, jumps"},
    {"conicity", cmd_conicity, "equivalent conicity after EN 15302 against amplitude and gauge"},
    {"creep", cmd_creep, "creep forces of one contact, by law; the laws against CONTACT"},
    {"run", cmd_run, "simulate as fast as possible: states and forces as CSV, summary, hash"},
    {"replay", cmd_replay, "do a recording's steps again and compare the bits"},
    {"diff", cmd_diff, "the first difference of two recordings or CSV files, in units"},
    {"modes", cmd_modes, "eigenvalues and damping about an equilibrium; critical speeds"},
    {"critical", cmd_critical, "linear and nonlinear critical speed, hunting over the speed"},
    {"curve", cmd_curve, "steady running in curves: offsets, angles of attack, Y, Q, Y/Q"},
    {"ride", cmd_ride, "response to irregularities: EN 14363, Sperling, EN 12299, spectra"},
    {"bench", cmd_bench, "measure the time and the instructions of a step"},
    {"hil", cmd_hil, "run in real time on a CAN bus, or in lockstep with it"},
    {"dbc", cmd_dbc, "the bus as a DBC file"},
    {"signals", cmd_signals, "the bus as documentation, or as CSV"},
    {"build", cmd_build, "the model as C source, to be linked into firmware"},
};
#define N_SUB_COMMANDS (sizeof sub_commands / sizeof sub_commands[0])

static int print_help(void) {
    printf("usage: klingel COMMAND MODEL [...]\n\n"
           "Rail-vehicle dynamics in real time, from model files.\n\ncommands:\n");
    for (size_t i = 0; i < N_SUB_COMMANDS; i++) {
        printf("  %-10s %s\n", sub_commands[i].name, sub_commands[i].what);
    }
    printf("\n  klingel COMMAND --help   explains a command\n"
           "  klingel --version        prints the version\n");
    return cli_flush(CLI_OK);
}

static int unknown_command(const char *name) {
    const char *words[N_SUB_COMMANDS];
    for (size_t i = 0; i < N_SUB_COMMANDS; i++) {
        words[i] = sub_commands[i].name;
    }
    const char *near = cli_nearest(name, words, N_SUB_COMMANDS);
    if (near != NULL) {
        return cli_misuse("unknown command %s; did you mean %s?", name, near);
    }
    return cli_misuse("unknown command %s", name);
}

static int run(int argc, char **argv) {
    for (size_t i = 0; i < N_SUB_COMMANDS; i++) {
        if (strcmp(argv[0], sub_commands[i].name) == 0) {
            char name[32];
            snprintf(name, sizeof name, "klingel %s", argv[0]);
            cli_set_name(name);
            return sub_commands[i].run(argc, argv);
        }
    }
    return unknown_command(argv[0]);
}

int main(int argc, char **argv) {
    if (argc < 2) {
        return cli_misuse("a command is missing");
    }
    if (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0) {
        return print_help();
    }
    if (strcmp(argv[1], "help") == 0) {
        char help[] = "--help";
        char *arguments[] = {argc > 2 ? argv[2] : help, help, NULL};
        return argc > 2 ? run(2, arguments) : print_help();
    }
    if (strcmp(argv[1], "--version") == 0) {
        printf("klingel %s\n", KL_VERSION_TEXT);
        return cli_flush(CLI_OK);
    }
    return run(argc - 1, argv + 1);
}
