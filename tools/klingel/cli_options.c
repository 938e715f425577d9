/* cli_options.c - arguments of a sub-command into the values of its option table. */
#include <assert.h>
#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "cli.h"
#include "cli_help.h"

static const struct cli_option *find(const struct cli_command *command, const char *name,
                                     size_t length) {
    for (size_t i = 0; i < command->n_options; i++) {
        const struct cli_option *option = &command->options[i];
        if ((strlen(option->name) == length && strncmp(option->name, name, length) == 0) ||
            (option->alias != NULL && strlen(option->alias) == length &&
             strncmp(option->alias, name, length) == 0)) {
            return option;
        }
    }
    return NULL;
}

static int unknown(const struct cli_command *command, const char *name, size_t length) {
    const char *words[CLI_MAX_OPTIONS + 2] = {"--help"};
    char text[64];
    size_t n = 1;
    for (size_t i = 0; i < command->n_options; i++) {
        if (command->options[i].kind != CLI_EXTRA_TEXT) {
            words[n++] = command->options[i].name;
        }
    }
    snprintf(text, sizeof text, "%.*s", (int)length, name);
    const char *near = cli_nearest(text, words, n);
    if (near != NULL) {
        return cli_misuse("unknown option %s; did you mean %s?", text, near);
    }
    return cli_misuse("unknown option %s", text);
}

/* ---- values ---- */

static int take_number(const struct cli_option *option, const char *text) {
    char why[160];
    double value = 0.0;
    if (!cli_quantity(text, option->unit, &value, why, sizeof why)) {
        return cli_misuse("%s %s: %s", option->name, text, why);
    }
    /* the ends of a range belong to it, whatever a unit's factor rounds to */
    double slack = 1e-12 * (option->high - option->low);
    if (!(value >= option->low - slack && value <= option->high + slack)) {
        double si = cli_unit(option->unit);
        return cli_misuse("%s %s: must be within %g..%g%s%s", option->name, text, option->low / si,
                          option->high / si, option->unit[0] != '\0' ? " " : "", option->unit);
    }
    value = value < option->low ? option->low : value;
    *(double *)option->value = value > option->high ? option->high : value;
    return CLI_OK;
}

static int take_count(const struct cli_option *option, const char *text) {
    char *end = NULL;
    errno = 0;
    unsigned long long value = strtoull(text, &end, 10);
    bool digits = text[0] != '\0' && strspn(text, "0123456789") == strlen(text);
    if (!digits || errno != 0 || (double)value < option->low || (double)value > option->high) {
        return cli_misuse("%s %s: must be a whole number within %.0f..%.0f", option->name, text,
                          option->low, option->high);
    }
    *(uint64_t *)option->value = value;
    return CLI_OK;
}

static int take_choice(const struct cli_option *option, const char *text) {
    const char *at = option->argument;
    for (int number = 0; *at != '\0'; number++) {
        size_t length = strcspn(at, "|");
        if (strlen(text) == length && strncmp(at, text, length) == 0) {
            *(int *)option->value = number;
            return CLI_OK;
        }
        at += length + (at[length] == '|');
    }
    return cli_misuse("%s %s: must be one of %s", option->name, text, option->argument);
}

static int take_list(const struct cli_option *option, const char *text) {
    struct cli_list *list = option->value;
    if (list->n == CLI_MAX_LIST) {
        return cli_misuse("%s %s: given more than %d times", option->name, text, CLI_MAX_LIST);
    }
    list->item[list->n++] = text;
    return CLI_OK;
}

static int take(const struct cli_option *option, const char *text) {
    if (option->kind != CLI_FLAG && text[0] == '\0') {
        return cli_misuse("%s: its value is empty; give %s", option->name, option->argument);
    }
    switch (option->kind) {
    case CLI_FLAG:
        *(bool *)option->value = true;
        return CLI_OK;
    case CLI_NUMBER:
        return take_number(option, text);
    case CLI_COUNT:
        return take_count(option, text);
    case CLI_TEXT:
    case CLI_MAYBE:
    case CLI_EXTRA_TEXT:
        *(const char **)option->value = text;
        return CLI_OK;
    case CLI_LIST:
        return take_list(option, text);
    case CLI_CHOICE:
        return take_choice(option, text);
    }
    return CLI_FAILED;
}

/* ---- the line ---- */

/* True if `next` can be the value of an option and is not an option itself; numbers, and lists of
 * them, may be negative. */
static bool is_value(const struct cli_option *option, const char *next) {
    if (next == NULL || strncmp(next, "--", 2) == 0) {
        return false;
    }
    bool number = option->kind == CLI_NUMBER || option->kind == CLI_COUNT ||
                  strspn(next + 1, "0123456789.") > 0;
    return next[0] != '-' || next[1] == '\0' || number;
}

static int parse_option(const struct cli_command *command, char **argv, int *at) {
    const char *argument = argv[*at];
    const char *equals = strncmp(argument, "--", 2) == 0 ? strchr(argument, '=') : NULL;
    size_t length = equals != NULL ? (size_t)(equals - argument) : strlen(argument);
    const struct cli_option *option = find(command, argument, length);
    if (option == NULL) {
        return unknown(command, argument, length);
    }
    if (option->kind == CLI_FLAG) {
        return equals == NULL ? take(option, "") : cli_misuse("%s takes no value", option->name);
    }
    if (equals != NULL) {
        return take(option, equals + 1);
    }
    if (is_value(option, argv[*at + 1])) {
        *at += 1;
        return take(option, argv[*at]);
    }
    if (option->kind == CLI_MAYBE) {
        return take(option, "-");
    }
    return cli_misuse("%s needs a value: %s", option->name, option->argument);
}

static bool wants_help(int argc, char **argv) {
    for (int i = 1; i < argc && strcmp(argv[i], "--") != 0; i++) {
        if (strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-h") == 0) {
            return true;
        }
    }
    return false;
}

static int parse(const struct cli_command *command, int argc, char **argv,
                 struct cli_target *target) {
    const char **const all[] = {&target->file, &target->vehicle, &target->track};
    const char **const *operand = command->takes_file ? all : all + 1;
    const size_t most = 1u + (command->takes_file ? 1u : 0u) + (command->takes_track ? 1u : 0u);
    size_t n = 0;
    bool options = true;
    int status = CLI_OK;
    for (int i = 1; i < argc && status == CLI_OK; i++) {
        if (options && strcmp(argv[i], "--") == 0) {
            options = false;
        } else if (options && argv[i][0] == '-' && argv[i][1] != '\0') {
            status = parse_option(command, argv, &i);
        } else if (n == most) {
            status = cli_misuse("'%s' is one argument too many: expected %s", argv[i],
                                cli_operands(command));
        } else {
            *operand[n++] = argv[i];
        }
    }
    const bool missing = command->takes_file ? target->file == NULL
                                             : target->vehicle == NULL && command->operands == NULL;
    if (status == CLI_OK && missing) {
        status = cli_misuse("an argument is missing: expected %s", cli_operands(command));
    }
    return status;
}

bool cli_parse(const struct cli_command *command, int argc, char **argv, struct cli_target *target,
               int *status) {
    struct cli_option options[CLI_MAX_OPTIONS + 1];
    struct cli_command whole = *command;
    memset(target, 0, sizeof *target);
    assert(command->n_options <= CLI_MAX_OPTIONS);
    memcpy(options, command->options, command->n_options * sizeof options[0]);
    options[whole.n_options++] = (struct cli_option){
        .name = "--set",
        .argument = "KEY=VALUE",
        .kind = CLI_LIST,
        .value = &target->set,
        .help = "replace a value of the model file, as often as wanted:\n"
                "elements.restraint.k_N_m[1]=1e6, track.irregularities.spectrum.seed=7"};
    whole.options = options;
    if (wants_help(argc, argv)) {
        *status = cli_help(&whole);
        return false;
    }
    *status = parse(&whole, argc, argv, target);
    return *status == CLI_OK;
}

/* ---- options of several sub-commands ---- */

static struct cli_option number(const char *name, const char *argument, double *value,
                                const char *help) {
    return (struct cli_option){
        .name = name, .argument = argument, .kind = CLI_NUMBER, .value = value, .help = help};
}

struct cli_option cli_speed_option(const char *name, double *value, double low, const char *help) {
    struct cli_option option = number(name, "V", value, help);
    option.unit = "m/s";
    option.low = low;
    option.high = KL_MAX_SPEED_M_S;
    return option;
}

struct cli_option cli_place_option(const char *name, double *value, const char *help) {
    struct cli_option option = number(name, "S", value, help);
    option.unit = "m";
    option.low = -1e6;
    option.high = 1e6;
    return option;
}

struct cli_option cli_time_option(const char *name, double *value, double high, const char *help) {
    struct cli_option option = number(name, "T", value, help);
    option.unit = "s";
    option.high = high;
    return option;
}

struct cli_option cli_file_option(const char *name, const char **value, const char *help) {
    return (struct cli_option){
        .name = name, .argument = "FILE", .kind = CLI_TEXT, .value = value, .help = help};
}

struct cli_option cli_maybe_file_option(const char *name, const char **value, const char *help) {
    struct cli_option option = cli_file_option(name, value, help);
    option.kind = CLI_MAYBE;
    return option;
}

struct cli_option cli_output_option(const char **value, const char *help) {
    struct cli_option option = cli_file_option("--output", value, help);
    option.alias = "-o";
    return option;
}
