/* cli_units.c - numbers with units on the command line. */
#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli.h"

enum dimension { LENGTH, TIME, SPEED, ANGLE, TURN, FORCE };

static const struct unit {
    const char *name;
    enum dimension dimension;
    double si;
} units[] = {
    {"m", LENGTH, 1.0},   {"mm", LENGTH, 1e-3},   {"km", LENGTH, 1e3},
    {"s", TIME, 1.0},     {"ms", TIME, 1e-3},     {"min", TIME, 60.0},
    {"m/s", SPEED, 1.0},  {"mm/s", SPEED, 1e-3},  {"km/h", SPEED, 1.0 / 3.6},
    {"rad", ANGLE, 1.0},  {"mrad", ANGLE, 1e-3},  {"deg", ANGLE, 0.017453292519943295},
    {"rad/s", TURN, 1.0}, {"mrad/s", TURN, 1e-3}, {"deg/s", TURN, 0.017453292519943295},
    {"N", FORCE, 1.0},    {"kN", FORCE, 1e3},
};
#define N_UNITS (sizeof units / sizeof units[0])

static const struct unit *find(const char *name) {
    for (size_t i = 0; i < N_UNITS; i++) {
        if (strcmp(units[i].name, name) == 0) {
            return &units[i];
        }
    }
    return NULL;
}

double cli_unit(const char *unit) {
    const struct unit *known = find(unit);
    return known != NULL ? known->si : 1.0;
}

/* strtod also reads hexadecimal, "inf" and "nan": none of them is meant by anybody here. */
static bool is_decimal(const char *text) {
    text += *text == '+' || *text == '-';
    if (!isdigit((unsigned char)text[0]) && !(text[0] == '.' && isdigit((unsigned char)text[1]))) {
        return false;
    }
    return !(text[0] == '0' && (text[1] == 'x' || text[1] == 'X'));
}

static void say_units(const struct unit *unit, char *why, size_t size) {
    size_t at = (size_t)snprintf(why, size, "the unit must be one of");
    for (size_t i = 0; i < N_UNITS && at < size; i++) {
        if (units[i].dimension == unit->dimension) {
            at += (size_t)snprintf(why + at, size - at, " %s", units[i].name);
        }
    }
}

bool cli_quantity(const char *text, const char *unit, double *si, char *why, size_t why_size) {
    const struct unit *meant = find(unit);
    char *end = NULL;
    if (!is_decimal(text)) {
        snprintf(why, why_size, "must be a number%s%s", meant != NULL ? " of " : "",
                 meant != NULL ? unit : "");
        return false;
    }
    double value = strtod(text, &end);
    while (*end == ' ') {
        end++;
    }
    if (*end != '\0' && meant == NULL) {
        snprintf(why, why_size, "must be a number, and nothing behind it");
        return false;
    }
    const struct unit *given = *end == '\0' ? meant : find(end);
    if (*end != '\0' && (given == NULL || given->dimension != meant->dimension)) {
        say_units(meant, why, why_size);
        return false;
    }
    if (!isfinite(value)) {
        snprintf(why, why_size, "is too large a number");
        return false;
    }
    *si = given != NULL ? value * given->si : value;
    return true;
}
