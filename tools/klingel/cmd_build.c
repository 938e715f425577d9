/* cmd_build.c - klingel build: the model as C source. */
#include <ctype.h>
#include <inttypes.h>
#include <string.h>

#include "emit_model.h"

#define MAX_NAME 31 /* characters that C11 promises to tell apart in external names */

/* Words of C11 that are no names; those with underscores first are refused anyway. */
static bool is_keyword(const char *name) {
    static const char *const words[] = {
        "auto",     "break",   "case",   "char",     "const",  "continue", "default",
        "do",       "double",  "else",   "enum",     "extern", "float",    "for",
        "goto",     "if",      "inline", "int",      "long",   "main",     "register",
        "restrict", "return",  "short",  "signed",   "sizeof", "static",   "struct",
        "switch",   "typedef", "union",  "unsigned", "void",   "volatile", "while"};
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
        if (strcmp(name, words[i]) == 0) {
            return true;
        }
    }
    return false;
}

static int check_name(const char *name) {
    bool good = isalpha((unsigned char)name[0]) != 0 && strlen(name) <= MAX_NAME;
    for (const char *at = name; *at != '\0'; at++) {
        good = good && (isalnum((unsigned char)*at) != 0 || *at == '_');
    }
    if (!good || is_keyword(name) || strncmp(name, "kl_", 3) == 0) {
        return cli_misuse("--name %s: must be a C name of at most %d letters, digits and _, not a "
                          "keyword and not kl_...",
                          name, MAX_NAME);
    }
    return CLI_OK;
}

/* The model's own name made fit for C: what is not a letter or a digit becomes _. */
static void default_name(const struct kl_model *model, char name[MAX_NAME + 1]) {
    size_t n = 0;
    for (const char *at = model->name; *at != '\0' && n < MAX_NAME; at++) {
        bool fit = isalnum((unsigned char)*at) != 0 && (n > 0 || !isdigit((unsigned char)*at));
        name[n++] = *at;
        if (!fit) {
            name[n - 1] = '_';
        }
    }
    name[n] = '\0';
    if (!isalpha((unsigned char)name[0]) || is_keyword(name) || strncmp(name, "kl_", 3) == 0) {
        snprintf(name, MAX_NAME + 1, "vehicle_model");
    }
}

static int perform(const struct kl_model *model, const char *file, const char *given) {
    char name[MAX_NAME + 1];
    struct cli_output output;
    default_name(model, name);
    int status = cli_output_open(&output, file);
    if (status != CLI_OK) {
        return status;
    }
    emit_model(output.file, model, given != NULL ? given : name);
    status = cli_output_close(&output, CLI_OK);
    if (status == CLI_OK && !cli_is_stdout(file)) {
        printf("%s: const struct kl_model %s, about %zu bytes of constant data, hash %016" PRIx64
               "\n",
               file, given != NULL ? given : name, emit_model_bytes(model), model->hash);
    }
    return status;
}

int cmd_build(int argc, char **argv) {
    const char *file = NULL;
    const char *name = NULL;
    struct cli_target target;
    int status = CLI_OK;
    const struct cli_option options[] = {
        cli_output_option(&file, "the C source; - is standard output; needed"),
        {.name = "--name",
         .argument = "NAME",
         .kind = CLI_TEXT,
         .value = &name,
         .help = "name of the model in C; default: that of the model file"},
    };
    const struct cli_command command = {
        .takes_track = true,
        .purpose =
            "Builds a model and writes it as C source that defines `const struct kl_model NAME`,\n"
            "to be compiled with the core into firmware: the very same numbers, bit by bit, that\n"
            "the other commands use. kl_model_check() proves it there.",
        .example = "klingel build models/two_axle_wagon.yaml models/demo_track.yaml -o wagon.c\n",
        .options = options,
        .n_options = sizeof options / sizeof options[0]};
    if (!cli_parse(&command, argc, argv, &target, &status)) {
        return status;
    }
    if (file == NULL) {
        return cli_misuse("-o FILE is missing");
    }
    if (name != NULL && (status = check_name(name)) != CLI_OK) {
        return status;
    }
    struct cli_model m;
    status = cli_model_open(&m, &target);
    if (status == CLI_OK) {
        status = perform(&m.model, file, name);
        cli_model_close(&m);
    }
    return cli_flush(status);
}
