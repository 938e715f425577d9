/* model_check.c - the checks of single values that several files of the loader share. */
#include <ctype.h>
#include <stdarg.h>
#include <string.h>

#include "model_convert.h"

static void format_key(char key[MODEL_PATH_SIZE], const char *format, va_list args) {
    vsnprintf(key, MODEL_PATH_SIZE, format, args);
}

bool model_positive(struct model_parts *parts, double value, const char *key_format, ...) {
    char key[MODEL_PATH_SIZE];
    va_list args;
    va_start(args, key_format);
    format_key(key, key_format, args);
    va_end(args);
    return model_check(parts, value > 0.0, "must be > 0", "%s", key);
}

bool model_not_negative(struct model_parts *parts, double value, const char *key_format, ...) {
    char key[MODEL_PATH_SIZE];
    va_list args;
    va_start(args, key_format);
    format_key(key, key_format, args);
    va_end(args);
    return model_check(parts, value >= 0.0, "must be >= 0", "%s", key);
}

void model_check_name(struct model_parts *parts, const char *name, const char *key_format, ...) {
    bool good = isalpha((unsigned char)name[0]) != 0;
    for (const char *c = name; *c != '\0'; c++) {
        good = good && (isalnum((unsigned char)*c) != 0 || *c == '_');
    }
    char key[MODEL_PATH_SIZE];
    va_list args;
    va_start(args, key_format);
    format_key(key, key_format, args);
    va_end(args);
    model_check(parts, good, "must be a letter followed by letters, digits and _", "%s", key);
}

void model_check_title(struct model_parts *parts, const char *title) {
    bool good = true;
    for (const char *c = title; *c != '\0'; c++) {
        good = good && *c >= ' ' && *c <= '~' && strchr("\"'\\", *c) == NULL;
    }
    model_check(parts, good, "must be printable ASCII without quotes and backslashes", "name");
}
