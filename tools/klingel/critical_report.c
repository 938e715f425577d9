/* critical_report.c - amplitude over speed. */
#include "critical_report.h"

#include <stdlib.h>
#include <string.h>

#include "cli_plot.h"

static const char *const ending[] = {"decays", "stays", "does not settle", "derails"};

static void print_linear(const struct critical_result *r) {
    const struct modes_scan *linear = &r->linear;
    printf("linear: %s at %g m/s\n", linear->stable_at_low ? "stable" : "unstable",
           linear->low_m_s);
    for (size_t i = 0; i < linear->n; i++) {
        const struct modes_crossing *c = &linear->crossing[i];
        printf("  %10.4f m/s (%.2f km/h): becomes %s, %.4f Hz\n", c->speed_m_s, 3.6 * c->speed_m_s,
               c->stable_below ? "unstable" : "stable", r->linear_Hz[i]);
    }
    if (linear->n == 0) {
        printf("  no critical speed up to %g m/s\n", linear->high_m_s);
    }
}

static void print_fold(const struct critical_result *r) {
    if (!r->has_fold) {
        printf("nonlinear: no end of the hunting was found in this range of speeds\n");
        return;
    }
    printf("nonlinear: hunting ends between %.4f and %.4f m/s (%.2f km/h); there %.4f mm at "
           "%.4f Hz\n",
           r->fold_low_m_s, r->fold_m_s, 3.6 * r->fold_m_s, 1e3 * r->fold.amplitude,
           r->fold.frequency_Hz);
}

void critical_print(const struct critical_result *r) {
    printf("%s: stability, steps of %g ms\n", r->name, 1e3 * r->step_s);
    print_linear(r);
    print_fold(r);
    printf("  %10s  %-8s %12s %12s %12s %10s\n", "speed m/s", "cycle", "amplitude mm",
           "frequency Hz", "mean mm", "settled s");
    for (size_t i = 0; i < r->n; i++) {
        const struct critical_point *p = &r->point[i];
        if (p->cycle.end == CYCLE_STAYS || p->cycle.end == CYCLE_UNSETTLED || p->unstable) {
            printf("  %10.4f  %-8s %12.4f %12.4f %12.4f %10.1f%s\n", p->speed_m_s,
                   p->unstable ? "unstable" : "stable", 1e3 * p->cycle.amplitude,
                   p->cycle.frequency_Hz, 1e3 * p->cycle.mean, p->cycle.time_s,
                   !p->unstable && p->cycle.end == CYCLE_UNSETTLED
                       ? "  (does not settle: means of the last quarter)"
                       : "");
        } else {
            printf("  %10.4f  %s\n", p->speed_m_s, ending[p->cycle.end]);
        }
    }
    printf("amplitude and mean are those of the lateral displacement of %s: half and middle of its "
           "extremes\n",
           r->wheelset);
}

void critical_csv(FILE *file, const struct critical_result *r) {
    static const char *const word[] = {"rest", "stable", "unsettled", "derailed"};
    fprintf(file, "# linear critical speeds m/s:");
    for (size_t i = 0; i < r->linear.n; i++) {
        fprintf(file, " %.9g (%s, %.6g Hz)", r->linear.crossing[i].speed_m_s,
                r->linear.crossing[i].stable_below ? "unstable" : "stable", r->linear_Hz[i]);
    }
    fprintf(file, "\n");
    if (r->has_fold) {
        fprintf(file, "# hunting ends between m/s: %.9g %.9g\n", r->fold_low_m_s, r->fold_m_s);
    }
    fprintf(file, "speed_m_s,cycle,amplitude_m,frequency_Hz,mean_m,settled_s\n");
    for (size_t i = 0; i < r->n; i++) {
        const struct critical_point *p = &r->point[i];
        fprintf(file, "%.12g,%s,%.12g,%.12g,%.12g,%.6g\n", p->speed_m_s,
                p->unstable ? "unstable" : word[p->cycle.end], p->cycle.amplitude,
                p->cycle.frequency_Hz, p->cycle.mean, p->cycle.time_s);
    }
}

/* ---- the picture ---- */

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

/* Speed and amplitude (mm) or frequency of one branch, in order of speed. Returns how many. */
static size_t branch(const struct critical_result *r, bool unstable, bool frequency,
                     double (*out)[2]) {
    size_t n = 0;
    for (size_t i = 0; i < r->n; i++) {
        const struct critical_point *p = &r->point[i];
        const bool swings = p->cycle.end == CYCLE_STAYS || p->cycle.end == CYCLE_UNSETTLED;
        if (p->unstable == unstable && (unstable || swings)) {
            out[n][0] = p->speed_m_s;
            out[n++][1] = frequency ? p->cycle.frequency_Hz : 1e3 * p->cycle.amplitude;
        }
    }
    if (r->has_fold && n > 0) {
        out[n][0] = r->fold_m_s;
        out[n++][1] = frequency ? r->fold.frequency_Hz : 1e3 * r->fold.amplitude;
    }
    qsort(out, n, sizeof out[0], by_speed);
    return n;
}

static void draw_branch(struct cli_plot *plot, const struct critical_result *r, bool unstable,
                        bool frequency, struct room *room) {
    double *x = room->x;
    double *y = room->y;
    size_t n = branch(r, unstable, frequency, room->pair);
    const double critical = r->linear.n > 0 ? r->linear.crossing[0].speed_m_s : 0.0;
    for (size_t i = 0; i < n; i++) {
        x[i] = room->pair[i][0];
        y[i] = room->pair[i][1];
    }
    if (unstable && n > 0 && x[n - 1] < critical) { /* begins at the linear critical speed */
        x[n] = critical;
        y[n++] = frequency ? r->linear_Hz[0] : 0.0;
    }
    const struct cli_plot_style line = {
        .label = frequency ? NULL : (unstable ? "unstable: what exceeds it grows" : "stable"),
        .colour = unstable ? CLI_PLOT_SECOND : CLI_PLOT_FIRST,
        .pen = unstable ? CLI_PLOT_DASHED : CLI_PLOT_SOLID};
    const struct cli_plot_style dots = {
        .colour = line.colour, .pen = CLI_PLOT_POINTS, .thin = true};
    if (n > 0) {
        cli_plot_line(plot, &line, x, y, n);
        cli_plot_line(plot, &dots, x, y, n);
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
    if (r->has_fold) {
        x[0] = fmin(x[0], r->fold_m_s);
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
    if (r->has_fold) {
        snprintf(text, sizeof text, "nonlinear %.2f m/s", r->fold_m_s);
        cli_plot_mark(plot, &fold, 'x', r->fold_m_s, text);
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
        draw_branch(&plot, r, false, false, room);
        draw_branch(&plot, r, true, false, room);
        draw_rest(&plot, r, x);
        mark_speeds(&plot, r);
        cli_plot_panel(&plot, &(struct cli_plot_panel){.title = "Frequency",
                                                       .x_label = "speed [m/s]",
                                                       .y_label = "frequency [Hz]",
                                                       .x_low = x[0],
                                                       .x_high = x[1],
                                                       .column = 2,
                                                       .rows = 2});
        draw_branch(&plot, r, false, true, room);
        draw_branch(&plot, r, true, true, room);
        status = cli_plot_close(&plot, status);
    }
    free(room);
    return status;
}
