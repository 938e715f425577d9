/* profile_file_text.c - lines, numbers and messages of profile files. */
#include "profile_file_text.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

int profile_say(const struct profile_text *text, unsigned line, const char *format, ...) {
    va_list arguments;
    fprintf(text->parts->errors, line > 0 ? "%s:%u: " : "%s: ", text->path, line);
    va_start(arguments, format);
    vfprintf(text->parts->errors, format, arguments);
    va_end(arguments);
    fputc('\n', text->parts->errors);
    text->parts->n_errors++;
    return -1;
}

char *profile_next_line(struct profile_text *text) {
    if (text->rest == NULL) {
        return NULL;
    }
    text->line++;
    char *line = strsep(&text->rest, "\n");
    line += strspn(line, " \t\r");
    size_t length = strlen(line);
    while (length > 0 && strchr(" \t\r", line[length - 1]) != NULL) {
        line[--length] = '\0';
    }
    return line;
}

bool profile_number(const char *word, double *value) {
    char *end;
    if (word[0] == '\0' || word[strspn(word, "0123456789+-.eE")] != '\0') {
        return false;
    }
    *value = strtod(word, &end);
    return *end == '\0' && isfinite(*value);
}

int profile_row(const struct profile_text *text, char *line, int least, int most,
                double values[PROFILE_MAX_VALUES]) {
    int n = 0;
    for (char *word = strsep(&line, " \t,;"); word != NULL; word = strsep(&line, " \t,;")) {
        if (word[0] == '\0') {
            continue;
        }
        if (n == most) {
            return profile_say(text, text->line, "more than %d numbers: %.40s", most, word);
        }
        if (!profile_number(word, &values[n])) {
            return profile_say(text, text->line, "%.40s: must be a finite number", word);
        }
        n++;
    }
    if (n < least) {
        return profile_say(text, text->line, "%d numbers, must be %d", n, least);
    }
    return n;
}

void profile_add_point(struct profile_text *text, double first, double second) {
    text->first[text->n] = first;
    text->second[text->n] = second;
    text->line_of[text->n] = text->line;
    text->n++;
}
