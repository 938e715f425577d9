/* profile_file_columns.c - MiniProf's .whl and .ban, and plain columns of numbers. */
#include <stdlib.h>
#include <string.h>

#include "profile_file_text.h"

struct miniprof {
    double x_offset_mm;
    double y_offset_mm;
    double n_points; /* -1: not said */
    int n_columns;   /* 0: not said, two */
    int x_column;
    int y_column;
};

/* Letters with commas between: X and Y are places; A, C, N and K other things measured there. */
static int take_columns(const struct profile_text *text, struct miniprof *m, char *value) {
    m->n_columns = 0;
    m->x_column = -1;
    m->y_column = -1;
    for (char *word = strsep(&value, ", \t"); word != NULL; word = strsep(&value, ", \t")) {
        int *place = strcmp(word, "X") == 0 ? &m->x_column : &m->y_column;
        bool is_place = strcmp(word, "X") == 0 || strcmp(word, "Y") == 0;
        if (strlen(word) != 1 || strchr("XYACNK", word[0]) == NULL ||
            m->n_columns == PROFILE_MAX_VALUES || (is_place && *place >= 0)) {
            return profile_say(text, text->line,
                               "ColumnDef, %.20s: must be X and Y once, and A, C, N, K, at most %d",
                               word, PROFILE_MAX_VALUES);
        }
        if (is_place) {
            *place = m->n_columns;
        }
        m->n_columns++;
    }
    if (m->x_column < 0 || m->y_column < 0) {
        return profile_say(text, text->line, "ColumnDef must name X and Y");
    }
    return 0;
}

static int take_header(const struct profile_text *text, struct miniprof *m, char *line,
                       char *equals) {
    static const char *const names[] = {"XOffset", "YOffset", "XYPoints"};
    double *const places[] = {&m->x_offset_mm, &m->y_offset_mm, &m->n_points};
    char *value = equals + 1 + strspn(equals + 1, " \t");
    size_t length = (size_t)(equals - line);
    while (length > 0 && strchr(" \t", line[length - 1]) != NULL) {
        length--;
    }
    line[length] = '\0';
    if (strcasecmp(line, "ColumnDef") == 0) {
        return take_columns(text, m, value);
    }
    for (int i = 0; i < 3; i++) {
        if (strcasecmp(line, names[i]) == 0 && !profile_number(value, places[i])) {
            return profile_say(text, text->line, "%s = %.40s: must be a finite number", line,
                               value);
        }
    }
    return 0;
}

int profile_read_miniprof(struct profile_text *text) {
    struct miniprof m = {.n_points = -1.0, .x_column = 0, .y_column = 1};
    for (char *line = profile_next_line(text); line != NULL; line = profile_next_line(text)) {
        double v[PROFILE_MAX_VALUES];
        char *equals = strchr(line, '=');
        if (line[0] == '\0' || strchr("!\"%#", line[0]) != NULL) {
            continue;
        }
        if (equals != NULL) {
            if (text->n > 0) {
                return profile_say(text, text->line, "%.40s: a key behind the points", line);
            }
            if (take_header(text, &m, line, equals) != 0) {
                return -1;
            }
            continue;
        }
        const int n = m.n_columns > 0 ? m.n_columns : 2;
        if (profile_row(text, line, n, n, v) < 0) {
            return -1;
        }
        profile_add_point(text, (v[m.x_column] + m.x_offset_mm) / 1000.0,
                          (v[m.y_column] + m.y_offset_mm) / 1000.0);
    }
    if (m.n_points >= 0.0 && m.n_points != (double)text->n) {
        return profile_say(text, text->line, "%u points, must be XYPoints = %g", text->n,
                           m.n_points);
    }
    return 0;
}

int profile_read_columns(struct profile_text *text) {
    for (char *line = profile_next_line(text); line != NULL; line = profile_next_line(text)) {
        double v[PROFILE_MAX_VALUES];
        if (line[0] == '\0' || strchr("!\"%#;", line[0]) != NULL) {
            continue;
        }
        line[strcspn(line, "!%#")] = '\0';
        if (profile_row(text, line, 2, 2, v) < 0) {
            return -1;
        }
        profile_add_point(text, v[0] * text->request->unit_m, v[1] * text->request->unit_m);
    }
    return 0;
}
