/* cli_help.c - help texts and messages. */
#include "cli_help.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#define COLUMN 26

static char program_name[48] = "klingel";

void cli_set_name(const char *name) {
    snprintf(program_name, sizeof program_name, "%s", name);
}

const char *cli_name(void) {
    return program_name;
}

static void say(const char *format, va_list arguments) {
    char text[1024];
    vsnprintf(text, sizeof text, format, arguments);
    /* what users typed may hold anything; a terminal shall not act on it */
    for (char *at = text; *at != '\0'; at++) {
        if ((unsigned char)*at < 0x20 || *at == 0x7f) {
            *at = '?';
        }
    }
    fflush(stdout);
    fprintf(stderr, "%s: %s\n", program_name, text);
}

void cli_warn(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    say(format, arguments);
    va_end(arguments);
}

int cli_fail(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    say(format, arguments);
    va_end(arguments);
    return CLI_FAILED;
}

int cli_misuse(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    say(format, arguments);
    va_end(arguments);
    fprintf(stderr, "Try '%s --help'.\n", program_name);
    return CLI_USAGE;
}

/* ---- likeness of words ---- */

#define WORD 40

/* Levenshtein's distance of the first WORD - 1 characters. */
static size_t distance(const char *a, const char *b) {
    size_t row[WORD];
    size_t n = strnlen(b, WORD - 1);
    for (size_t j = 0; j <= n; j++) {
        row[j] = j;
    }
    for (size_t i = 0; i < WORD - 1 && a[i] != '\0'; i++) {
        size_t diagonal = row[0];
        row[0] = i + 1;
        for (size_t j = 1; j <= n; j++) {
            size_t best = diagonal + (a[i] != b[j - 1]);
            best = row[j] + 1 < best ? row[j] + 1 : best;
            best = row[j - 1] + 1 < best ? row[j - 1] + 1 : best;
            diagonal = row[j];
            row[j] = best;
        }
    }
    return row[n];
}

const char *cli_nearest(const char *text, const char *const *words, size_t n) {
    const char *nearest = NULL;
    size_t least = strlen(text) / 3 + 2; /* farther than that is another word */
    for (size_t i = 0; i < n && strlen(text) < WORD; i++) {
        size_t d = distance(text, words[i]);
        if (d < least) {
            least = d;
            nearest = words[i];
        }
    }
    return nearest;
}

/* ---- --help ---- */

static void print_indented(const char *text, size_t column) {
    while (*text != '\0') {
        size_t length = strcspn(text, "\n");
        printf("%.*s\n", (int)length, text);
        text += length + (text[length] == '\n');
        if (*text != '\0') {
            printf("%*s", (int)column, "");
        }
    }
}

static void print_option(const struct cli_option *option) {
    char head[80];
    bool maybe = option->kind == CLI_MAYBE;
    snprintf(head, sizeof head, "  %s%s%s%s%s%s%s", option->alias != NULL ? option->alias : "",
             option->alias != NULL ? ", " : "", option->name, option->argument != NULL ? " " : "",
             maybe ? "[" : "", option->argument != NULL ? option->argument : "", maybe ? "]" : "");
    if (strlen(head) >= COLUMN) {
        printf("%s\n%*s", head, COLUMN, "");
    } else {
        printf("%-*s", COLUMN, head);
    }
    print_indented(option->help, COLUMN);
}

const char *cli_operands(const struct cli_command *command) {
    if (command->operands != NULL) {
        return command->operands;
    }
    return command->takes_track ? "MODEL [TRACK]" : "MODEL";
}

int cli_help(const struct cli_command *command) {
    printf("usage: %s %s [options]\n\n%s\n\noptions:\n", program_name, cli_operands(command),
           command->purpose);
    for (size_t i = 0; i < command->n_options; i++) {
        if (command->options[i].kind != CLI_EXTRA_TEXT) {
            print_option(&command->options[i]);
        }
    }
    printf("%-*sthis text\n\nexample:\n  ", COLUMN, "  -h, --help");
    print_indented(command->example, 2);
    return cli_flush(CLI_OK);
}
