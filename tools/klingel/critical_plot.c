/* critical_plot.c - the picture of amplitude over speed. */
#include <math.h>
#include <stdlib.h>

#include "cli_plot.h"
#include "critical_report.h"

static int by_speed(const void *a, const void *b) {
    const double *x = a;
    const double *y = b;
    return (x[0] > y[0]) - (x[0] < y[0]);
}

#define ROOM (CRITICAL_MOST_POINTS + 2)
struct room {
    double pair[ROOM][2]; /* to be sorted */
    double x[ROOM];
    double y[ROOM];
};

enum figure { AMPLITUDE, FREQUENCY, LEAST, MOST };

static double figure_of(const struct cycle *c, enum figure figure) {
    switch (figure) {
    case AMPLITUDE:
        return 1e3 * c->amplitude;
    case FREQUENCY:
        return c->frequency_Hz;
    case LEAST:
        return 1e3 * c->least;
    case MOST:
        break;
    }
    return 1e3 * c->most;
}

struct branch {
    const struct critical_result *result;
    unsigned number;
    bool unstable;
};

/* One figure over the speed, in order of speed, with the end of a stable branch. Returns how many. */
static size_t collect(const struct branch *b, enum figure figure, struct room *room) {
    const struct critical_result *r = b->result;
    const struct critical_end *end = &r->end[b->number];
    size_t n = 0;
    for (size_t i = 0; i < r->n; i++) {
        const struct critical_point *p = &r->point[i];
        if (p->branch == b->number && p->unstable == b->unstable &&
            (b->unstable || critical_hunts(&p->cycle))) {
            room->pair[n][0] = p->speed_m_s;
            room->pair[n++][1] = figure_of(&p->cycle, figure);
        }
    }
    if (end->found && n > 0) {
        room->pair[n][0] = end->hunts_m_s;
        room->pair[n++][1] = figure_of(&end->cycle, figure);
    }
    qsort(room->pair, n, sizeof room->pair[0], by_speed);
    for (size_t i = 0; i < n; i++) {
        room->x[i] = room->pair[i][0];
        room->y[i] = room->pair[i][1];
    }
    return n;
}

static bool is_irregular(const struct branch *b) {
    for (size_t i = 0; i < b->result->n; i++) {
        const struct critical_point *p = &b->result->point[i];
        if (p->branch == b->number && !p->unstable && p->cycle.end != CYCLE_STAYS &&
            critical_hunts(&p->cycle)) {
            return true;
        }
    }
    return false;
}

/* The smallest and largest period, where they are not the same. */
static void draw_spread(struct cli_plot *plot, const struct branch *b, struct room *room,
                        bool first) {
    const struct cli_plot_style dots = {.label = first ? "smallest and largest period" : NULL,
                                        .colour = CLI_PLOT_QUIET,
                                        .pen = CLI_PLOT_POINTS,
                                        .thin = true};
    struct cli_plot_style other = dots;
    other.label = NULL;
    size_t n = collect(b, LEAST, room);
    cli_plot_line(plot, &dots, room->x, room->y, n);
    n = collect(b, MOST, room);
    cli_plot_line(plot, &other, room->x, room->y, n);
}

static void draw_branch(struct cli_plot *plot, const struct branch *b, bool frequency,
                        const char *label, struct room *room) {
    const struct critical_result *r = b->result;
    size_t n = collect(b, frequency ? FREQUENCY : AMPLITUDE, room);
    const double critical = r->linear.n > 0 ? r->linear.crossing[0].speed_m_s : 0.0;
    if (b->unstable && n > 0 && room->x[n - 1] < critical) { /* begins at the linear one */
        room->x[n] = critical;
        room->y[n++] = frequency ? r->linear_Hz[0] : 0.0;
    }
    const struct cli_plot_style line = {.label = frequency ? NULL : label,
                                        .colour = b->unstable ? CLI_PLOT_SECOND : CLI_PLOT_FIRST,
                                        .pen = b->unstable ? CLI_PLOT_DASHED : CLI_PLOT_SOLID};
    const struct cli_plot_style dots = {
        .colour = line.colour, .pen = CLI_PLOT_POINTS, .thin = true};
    if (n > 0) {
        cli_plot_line(plot, &line, room->x, room->y, n);
        cli_plot_line(plot, &dots, room->x, room->y, n);
    }
}

/* Every branch of one panel; a legend names each kind once. */
static void draw_branches(struct cli_plot *plot, const struct critical_result *r, bool frequency,
                          struct room *room) {
    bool spread = false;
    bool unstable = false;
    for (unsigned i = 0; i < r->n_branches; i++) {
        struct branch b = {r, i, false};
        if (!frequency && is_irregular(&b)) {
            draw_spread(plot, &b, room, !spread);
            spread = true;
        }
        draw_branch(plot, &b, frequency, i == 0 ? "hunting" : NULL, room);
        b.unstable = true;
        draw_branch(plot, &b, frequency, unstable ? NULL : "unstable: what exceeds it grows", room);
        unstable = unstable || collect(&b, AMPLITUDE, room) > 0;
    }
}

/* The steady state itself: stable below the first linear critical speed. */
static void draw_rest(struct cli_plot *plot, const struct critical_result *r, const double x[2]) {
    const struct cli_plot_style stable = {.colour = CLI_PLOT_FIRST};
    const struct cli_plot_style unstable = {.colour = CLI_PLOT_SECOND, .pen = CLI_PLOT_DASHED};
    const double zero[2] = {0.0, 0.0};
    double from = x[0];
    bool is_stable = r->linear.stable_at_low;
    for (size_t i = 0; i <= r->linear.n; i++) {
        const double to = i < r->linear.n ? r->linear.crossing[i].speed_m_s : x[1];
        const double piece[2] = {fmax(from, x[0]), fmin(to, x[1])};
        if (piece[0] < piece[1]) {
            cli_plot_line(plot, is_stable ? &stable : &unstable, piece, zero, 2);
        }
        from = to;
        is_stable = !is_stable;
    }
}

/* What the branches cover, and a little on both sides. */
static void speed_range(const struct critical_result *r, double x[2]) {
    x[0] = HUGE_VAL;
    x[1] = -HUGE_VAL;
    for (size_t i = 0; i < r->n; i++) {
        x[0] = fmin(x[0], r->point[i].speed_m_s);
        x[1] = fmax(x[1], r->point[i].speed_m_s);
    }
    for (unsigned b = 0; b < r->n_branches; b++) {
        x[0] = r->end[b].found ? fmin(x[0], r->end[b].hunts_m_s) : x[0];
    }
    if (r->n == 0) {
        x[0] = r->linear.low_m_s;
        x[1] = r->linear.high_m_s;
    }
    x[0] -= 0.06 * (x[1] - x[0]) + 0.1;
}

static void mark_speeds(struct cli_plot *plot, const struct critical_result *r) {
    const struct cli_plot_style linear = {.colour = CLI_PLOT_INK, .pen = CLI_PLOT_DOTTED};
    const struct cli_plot_style fold = {.colour = CLI_PLOT_THIRD, .pen = CLI_PLOT_DOTTED};
    char text[96];
    for (size_t i = 0; i < r->linear.n; i++) {
        const double speed = r->linear.crossing[i].speed_m_s;
        snprintf(text, sizeof text, "linear %.2f m/s", speed);
        if (i == 0) {
            cli_plot_mark(plot, &linear, 'x', speed, text);
        }
    }
    const struct critical_end *end = critical_lowest_end(r);
    if (end != NULL) {
        snprintf(text, sizeof text, "nonlinear %.2f m/s", end->hunts_m_s);
        cli_plot_mark(plot, &fold, 'x', end->hunts_m_s, text);
    }
}

int critical_plot(const char *path, const struct critical_result *r) {
    struct cli_plot plot;
    char title[96];
    char notes[160];
    struct room *room = malloc(sizeof *room);
    if (room == NULL) {
        return cli_fail("out of memory");
    }
    snprintf(title, sizeof title, "%s: hunting over the speed", r->name);
    snprintf(notes, sizeof notes, "amplitude of the lateral displacement of %s; steps of %g ms",
             r->wheelset, 1e3 * r->step_s);
    int status = cli_plot_open(&plot, path, title, notes);
    if (status == CLI_OK) {
        double x[2];
        speed_range(r, x);
        cli_plot_panel(&plot, &(struct cli_plot_panel){.title = "Limit cycles",
                                                       .x_label = "speed [m/s]",
                                                       .y_label = "amplitude [mm]",
                                                       .x_low = x[0],
                                                       .x_high = x[1],
                                                       .columns = 2,
                                                       .rows = 2});
        draw_branches(&plot, r, false, room);
        draw_rest(&plot, r, x);
        mark_speeds(&plot, r);
        cli_plot_panel(&plot, &(struct cli_plot_panel){.title = "Frequency",
                                                       .x_label = "speed [m/s]",
                                                       .y_label = "frequency [Hz]",
                                                       .x_low = x[0],
                                                       .x_high = x[1],
                                                       .column = 2,
                                                       .rows = 2});
        draw_branches(&plot, r, true, room);
        status = cli_plot_close(&plot, status);
    }
    free(room);
    return status;
}
