/* profile_file_simpack.c - Simpack wheel and rail profiles, .prw and .prr. */
#include <math.h>
#include <stddef.h>
#include <string.h>
#include <strings.h>

#include "profile_file_text.h"

enum value_kind { IS_TEXT, IS_NUMBER, IS_SWITCH };
enum section { IN_NONE = 0, IN_HEADER, IN_SPLINE, IN_POINTS };

struct simpack {
    double version;
    double type;
    double smooth;
    double type_of_source;
    double distance_min;
    double shift_y;
    double shift_z;
    double rotate;
    double y_min;
    double y_max;
    double z_min;
    double z_max;
    double mirror_y;
    double mirror_z;
    double inversion;
    double per_m;
    double per_rad;
    char length_unit[8];
    uint32_t seen; /* bit i: keys[i] stood in the file */
    enum section section;
    bool complete; /* point.end was read */
};

struct key {
    const char *name;
    enum section section;
    enum value_kind kind;
    size_t offset;
};

/* All that such files hold. A key that is not here might change the points: it is refused. */
static const struct key keys[] = {
    {"version", IN_HEADER, IS_NUMBER, offsetof(struct simpack, version)},
    {"type", IN_HEADER, IS_SWITCH, offsetof(struct simpack, type)},
    {"approx.smooth", IN_SPLINE, IS_NUMBER, offsetof(struct simpack, smooth)},
    {"file", IN_SPLINE, IS_TEXT, 0},
    {"file.mtime", IN_SPLINE, IS_TEXT, 0},
    {"comment", IN_SPLINE, IS_TEXT, 0},
    {"type", IN_SPLINE, IS_NUMBER, offsetof(struct simpack, type_of_source)},
    {"point.dist.min", IN_SPLINE, IS_NUMBER, offsetof(struct simpack, distance_min)},
    {"shift.y", IN_SPLINE, IS_NUMBER, offsetof(struct simpack, shift_y)},
    {"shift.z", IN_SPLINE, IS_NUMBER, offsetof(struct simpack, shift_z)},
    {"rotate", IN_SPLINE, IS_NUMBER, offsetof(struct simpack, rotate)},
    {"bound.y.min", IN_SPLINE, IS_NUMBER, offsetof(struct simpack, y_min)},
    {"bound.y.max", IN_SPLINE, IS_NUMBER, offsetof(struct simpack, y_max)},
    {"bound.z.min", IN_SPLINE, IS_NUMBER, offsetof(struct simpack, z_min)},
    {"bound.z.max", IN_SPLINE, IS_NUMBER, offsetof(struct simpack, z_max)},
    {"mirror.y", IN_SPLINE, IS_SWITCH, offsetof(struct simpack, mirror_y)},
    {"mirror.z", IN_SPLINE, IS_SWITCH, offsetof(struct simpack, mirror_z)},
    {"inversion", IN_SPLINE, IS_SWITCH, offsetof(struct simpack, inversion)},
    {"units.len", IN_SPLINE, IS_TEXT, offsetof(struct simpack, length_unit)},
    {"units.ang", IN_SPLINE, IS_TEXT, 0},
    {"units.len.f", IN_SPLINE, IS_NUMBER, offsetof(struct simpack, per_m)},
    {"units.ang.f", IN_SPLINE, IS_NUMBER, offsetof(struct simpack, per_rad)},
};
#define N_KEYS (sizeof keys / sizeof keys[0])

static const char *const section_name[] = {"", "header", "spline", "point"};

/* ---- lines ---- */

/* '!' begins a comment, but not inside quotes. */
static void cut_comment(char *line) {
    bool quoted = false;
    for (char *c = line; *c != '\0'; c++) {
        quoted = *c == '\'' ? !quoted : quoted;
        if (*c == '!' && !quoted) {
            *c = '\0';
            break;
        }
    }
    size_t length = strlen(line);
    while (length > 0 && strchr(" \t", line[length - 1]) != NULL) {
        line[--length] = '\0';
    }
}

static char *unquoted(char *value) {
    size_t length = strlen(value);
    if (length >= 2 && value[0] == '\'' && value[length - 1] == '\'') {
        value[length - 1] = '\0';
        return value + 1;
    }
    return value;
}

static int take_value(const struct profile_text *text, struct simpack *s, size_t k, char *value) {
    const struct key *key = &keys[k];
    if ((s->seen >> k & 1u) != 0) {
        return profile_say(text, text->line, "%s stands here a second time", key->name);
    }
    s->seen |= 1u << k;
    if (key->kind == IS_TEXT) {
        if (key->offset != 0) {
            snprintf(s->length_unit, sizeof s->length_unit, "%s", unquoted(value));
        }
        return 0;
    }
    double number;
    if (!profile_number(value, &number)) {
        return profile_say(text, text->line, "%s = %.40s: must be a finite number", key->name,
                           value);
    }
    if (key->kind == IS_SWITCH && number != 0.0 && number != 1.0) {
        return profile_say(text, text->line, "%s = %.40s: must be 0 or 1", key->name, value);
    }
    memcpy((char *)s + key->offset, &number, sizeof number);
    return 0;
}

static int unknown_key(const struct profile_text *text, const struct simpack *s, const char *key) {
    char known[400] = "";
    size_t used = 0;
    for (size_t k = 0; k < N_KEYS; k++) {
        if (keys[k].section == s->section) {
            used += (size_t)snprintf(known + used, sizeof known - used, "%s%s",
                                     used > 0 ? ", " : "", keys[k].name);
        }
    }
    return profile_say(text, text->line, "%.40s: unknown key; known here: %s", key, known);
}

static int take_key(const struct profile_text *text, struct simpack *s, char *line) {
    char *value = strchr(line, '=');
    if (value == NULL) {
        return profile_say(text, text->line,
                           "%.40s: must be key = value, or begin or end a section", line);
    }
    line[strcspn(line, " \t=")] = '\0';
    value += 1 + strspn(value + 1, " \t");
    for (size_t k = 0; k < N_KEYS; k++) {
        if (keys[k].section == s->section && strcasecmp(keys[k].name, line) == 0) {
            return take_value(text, s, k, value);
        }
    }
    return unknown_key(text, s, line);
}

/* 1: the line begins or ends a section; 0: it does not; -1: it does, in the wrong place. */
static int take_section(const struct profile_text *text, struct simpack *s, const char *line) {
    static const enum section outer[] = {IN_NONE, IN_NONE, IN_NONE, IN_SPLINE};
    for (int i = IN_HEADER; i <= IN_POINTS; i++) {
        char begin[24];
        char end[24];
        snprintf(begin, sizeof begin, "%s.begin", section_name[i]);
        snprintf(end, sizeof end, "%s.end", section_name[i]);
        if (strcasecmp(line, begin) == 0) {
            if (s->section != outer[i] || s->complete) {
                return profile_say(text, text->line, "%s does not belong here", begin);
            }
            s->section = (enum section)i;
            return 1;
        }
        if (strcasecmp(line, end) == 0) {
            if ((int)s->section != i) {
                return profile_say(text, text->line, "%s without %s", end, begin);
            }
            s->complete = s->complete || i == IN_POINTS;
            s->section = outer[i];
            return 1;
        }
    }
    return 0;
}

static int take_point(struct profile_text *text, char *line) {
    double v[PROFILE_MAX_VALUES];
    int n = profile_row(text, line, 2, 3, v);
    if (n == 3 && v[2] != 1.0) {
        return profile_say(text, text->line, "weight %g: must be 1", v[2]);
    }
    if (n > 0) {
        profile_add_point(text, v[0], v[1]);
    }
    return n < 0 ? -1 : 0;
}

static int read_lines(struct profile_text *text, struct simpack *s) {
    for (char *line = profile_next_line(text); line != NULL; line = profile_next_line(text)) {
        cut_comment(line);
        if (line[0] == '\0') {
            continue;
        }
        int status = take_section(text, s, line);
        if (status == 0) {
            status = s->section == IN_POINTS ? take_point(text, line) : take_key(text, s, line);
        }
        if (status < 0) {
            return -1;
        }
    }
    if (s->section != IN_NONE || !s->complete) {
        return profile_say(text, text->line, "the file ends before %s.end",
                           s->section != IN_NONE ? section_name[s->section] : "point");
    }
    return 0;
}

/* ---- what the header asks for ---- */

/* units.len.f counts units to the metre; a name alone will do, and both must agree. */
static int find_unit(const struct profile_text *text, struct simpack *s) {
    static const struct {
        const char *name;
        double per_m;
    } units[] = {{"m", 1.0}, {"cm", 100.0}, {"mm", 1000.0}, {"in", 1.0 / 0.0254}};
    double named = 0.0;
    for (size_t i = 0; i < sizeof units / sizeof units[0]; i++) {
        named = strcmp(s->length_unit, units[i].name) == 0 ? units[i].per_m : named;
    }
    if (s->length_unit[0] != '\0' && named == 0.0) {
        return profile_say(text, 0, "units.len = %s: must be m, cm, mm or in", s->length_unit);
    }
    if (s->per_m == 0.0) {
        s->per_m = named;
    }
    if (!(s->per_m >= 1e-3 && s->per_m <= 1e6)) {
        return profile_say(text, 0, "units.len.f = %g: must be 1e-3 to 1e6 units to the metre",
                           s->per_m);
    }
    if (named != 0.0 && fabs(s->per_m / named - 1.0) > 1e-6) {
        return profile_say(text, 0, "units.len = %s and units.len.f = %g disagree", s->length_unit,
                           s->per_m);
    }
    return 0;
}

static int check_header(const struct profile_text *text, struct simpack *s) {
    const bool wheel = text->request->wheel;
    if (s->type != (wheel ? 1.0 : 0.0)) {
        return profile_say(text, 0, "type = %g: must be %s", s->type,
                           wheel ? "1, a wheel" : "0, a rail");
    }
    if (s->rotate != 0.0) {
        return profile_say(text, 0, "rotate = %g: must be 0; a rail is inclined by cant_1_in",
                           s->rotate);
    }
    if (s->smooth != 0.0 && !text->request->smoothing_said) {
        return profile_say(text, 0,
                           "approx.smooth = %g: must be 0, or the model must state smoothing_mm",
                           s->smooth);
    }
    if (s->distance_min < 0.0) {
        return profile_say(text, 0, "point.dist.min = %g: must be >= 0", s->distance_min);
    }
    return find_unit(text, s);
}

static bool outside(double value, double low, double high) {
    return low < high && (value < low || value > high);
}

static void keep_point(struct profile_text *text, uint32_t to, uint32_t from, double y, double z) {
    text->first[to] = y;
    text->second[to] = z;
    text->line_of[to] = text->line_of[from];
}

/* Steps 1 to 4, in the file's units. */
static void drop_and_shift(struct profile_text *text, const struct simpack *s) {
    uint32_t n = 0;
    for (uint32_t i = 0; i < text->n; i++) {
        double y = text->first[i];
        double z = text->second[i];
        if (n == 0 || hypot(y - text->first[n - 1], z - text->second[n - 1]) >= s->distance_min) {
            keep_point(text, n++, i, y, z);
        }
    }
    text->n = n;
    n = 0;
    for (uint32_t i = 0; i < text->n; i++) {
        double y = text->first[i] + s->shift_y;
        double z = text->second[i] + s->shift_z;
        if (!outside(y, s->y_min, s->y_max) && !outside(z, s->z_min, s->z_max)) {
            keep_point(text, n++, i, y, z);
        }
    }
    text->n = n;
}

/* Steps 5 to 7. */
static void mirror_and_scale(struct profile_text *text, const struct simpack *s) {
    const double y_unit = (s->mirror_y != 0.0 ? -1.0 : 1.0);
    const double z_unit = (s->mirror_z != 0.0 ? -1.0 : 1.0);
    for (uint32_t i = 0; i < text->n; i++) {
        text->first[i] = y_unit * text->first[i] / s->per_m;
        text->second[i] = z_unit * text->second[i] / s->per_m;
    }
    for (uint32_t i = 0; s->inversion != 0.0 && i < text->n / 2; i++) {
        const uint32_t j = text->n - 1 - i;
        const double y = text->first[i];
        const double z = text->second[i];
        const uint32_t line = text->line_of[i];
        keep_point(text, i, j, text->first[j], text->second[j]);
        text->first[j] = y;
        text->second[j] = z;
        text->line_of[j] = line;
    }
}

int profile_read_simpack(struct profile_text *text) {
    struct simpack s = {.type = -1.0, .y_min = 1.0, .z_min = 1.0, .per_rad = 1.0};
    if (read_lines(text, &s) != 0 || check_header(text, &s) != 0) {
        return -1;
    }
    drop_and_shift(text, &s);
    mirror_and_scale(text, &s);
    return 0;
}
