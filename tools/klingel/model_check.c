/* model_check.c - the checks of single values that several files of the loader share. */
#include <ctype.h>
#include <stdarg.h>
#include <string.h>

#include "model_convert.h"

static bool check_at(struct model_parts *parts, bool ok, const char *what, const char *key_format,
                     va_list args) {
    char key[MODEL_PATH_SIZE];
    vsnprintf(key, sizeof key, key_format, args);
    return model_check(parts, ok, what, "%s", key);
}

bool model_positive(struct model_parts *parts, double value, const char *key_format, ...) {
    va_list args;
    va_start(args, key_format);
    bool ok = check_at(parts, value > 0.0, "must be > 0", key_format, args);
    va_end(args);
    return ok;
}

bool model_not_negative(struct model_parts *parts, double value, const char *key_format, ...) {
    va_list args;
    va_start(args, key_format);
    bool ok = check_at(parts, value >= 0.0, "must be >= 0", key_format, args);
    va_end(args);
    return ok;
}

void model_check_name(struct model_parts *parts, const char *name, const char *key_format, ...) {
    bool good = isalpha((unsigned char)name[0]) != 0;
    for (const char *c = name; *c != '\0'; c++) {
        good = good && (isalnum((unsigned char)*c) != 0 || *c == '_');
    }
    va_list args;
    va_start(args, key_format);
    check_at(parts, good, "must be a letter followed by letters, digits and _", key_format, args);
    va_end(args);
}

void model_check_title(struct model_parts *parts, const char *title) {
    bool good = true;
    for (const char *c = title; *c != '\0'; c++) {
        good = good && *c >= ' ' && *c <= '~' && strchr("\"'\\", *c) == NULL;
    }
    model_check(parts, good, "must be printable ASCII without quotes and backslashes", "name");
}
