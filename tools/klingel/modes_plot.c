/* modes_plot.c - the root locus, and which modes are worth a look. */
#include "modes_plot.h"

#include <math.h>
#include <stdlib.h>

#include "cli_plot.h"

#define TWO_PI 6.283185307179586
#define NAMED 6u        /* tracks with a colour of their own */
#define DAMPED_MOST 0.6 /* beyond, a mode is not shown in the root locus */

enum axis { REAL, FREQUENCY, DAMPING, SPEED };

static double value(const struct modes_track *t, size_t i, enum axis axis) {
    switch (axis) {
    case REAL:
        return t->real[i];
    case FREQUENCY:
        return t->imag[i] / TWO_PI;
    case DAMPING:
        return -100.0 * t->real[i] / hypot(t->real[i], t->imag[i]);
    case SPEED:
        break;
    }
    return t->speed_m_s[i];
}

static bool is_shown(const struct modes_track *t) {
    return t->least_damping < DAMPED_MOST;
}

static int by_damping(const void *a, const void *b) {
    const struct modes_track *const *x = a;
    const struct modes_track *const *y = b;
    return ((*x)->least_damping > (*y)->least_damping) -
           ((*x)->least_damping < (*y)->least_damping);
}

static void draw_tracks(struct cli_plot *plot, const struct modes_track *const *order, uint32_t n,
                        const enum axis axes[2], bool legend, double *room[2]) {
    for (uint32_t t = 0; t < n; t++) {
        const struct modes_track *track = order[t];
        const bool named = t < NAMED;
        for (size_t i = 0; i < track->n; i++) {
            room[0][i] = value(track, i, axes[0]);
            room[1][i] = value(track, i, axes[1]);
        }
        const struct cli_plot_style style = {.label = legend && named ? track->name : NULL,
                                             .colour =
                                                 named ? (enum cli_plot_colour)t : CLI_PLOT_QUIET,
                                             .thin = !named};
        cli_plot_line(plot, &style, room[0], room[1], track->n);
        if (axes[1] == FREQUENCY && axes[0] == REAL) {
            const struct cli_plot_style start = {.colour = style.colour, .pen = CLI_PLOT_POINTS};
            cli_plot_line(plot, &start, room[0], room[1], 1);
        }
    }
}

int modes_plot_locus(const char *path, const struct kl_model *model,
                     const struct modes_tracks *tracks) {
    static const enum axis locus[2] = {REAL, FREQUENCY};
    static const enum axis frequency[2] = {SPEED, FREQUENCY};
    static const enum axis damping[2] = {SPEED, DAMPING};
    const struct modes_track *order[MODES_MAX_TRACKS];
    const struct cli_plot_style limit = {.colour = CLI_PLOT_INK, .thin = true};
    struct cli_plot plot;
    char title[96];
    uint32_t n = 0;
    size_t longest = 1;
    for (uint32_t t = 0; t < tracks->n; t++) {
        if (is_shown(&tracks->track[t])) {
            order[n++] = &tracks->track[t];
            longest = tracks->track[t].n > longest ? tracks->track[t].n : longest;
        }
    }
    qsort(order, n, sizeof order[0], by_damping);
    double *room[2] = {malloc(longest * sizeof(double)), malloc(longest * sizeof(double))};
    snprintf(title, sizeof title, "%s: modes over the speed", model->name);
    int status = room[0] != NULL && room[1] != NULL
                     ? cli_plot_open(&plot, path, title,
                                     "the least damped modes in colour; dots: lowest speed; modes "
                                     "damped by more than 60 % are left out")
                     : cli_fail("out of memory");
    if (status == CLI_OK) {
        cli_plot_panel(&plot, &(struct cli_plot_panel){.title = "Root locus",
                                                       .x_label = "real part [1/s]",
                                                       .y_label = "frequency [Hz]",
                                                       .rows = 2});
        cli_plot_mark(&plot, &limit, 'x', 0.0, NULL);
        draw_tracks(&plot, order, n, locus, true, room);
        cli_plot_panel(&plot, &(struct cli_plot_panel){.title = "Frequency",
                                                       .x_label = "speed [m/s]",
                                                       .y_label = "frequency [Hz]",
                                                       .column = 1});
        draw_tracks(&plot, order, n, frequency, false, room);
        cli_plot_panel(&plot, &(struct cli_plot_panel){.title = "Damping",
                                                       .x_label = "speed [m/s]",
                                                       .y_label = "damping ratio [%]",
                                                       .row = 1,
                                                       .column = 1});
        cli_plot_mark(&plot, &limit, 'y', 0.0, "stable above");
        draw_tracks(&plot, order, n, damping, false, room);
        status = cli_plot_close(&plot, status);
    }
    free(room[0]);
    free(room[1]);
    return status;
}

/* ---- which modes ---- */

uint32_t modes_choose(const struct modes *modes, uint32_t most, uint32_t chosen[MODES_MAX_SHAPES]) {
    bool taken[KL_MAX_STATES] = {false};
    uint32_t n = 0;
    most = most < MODES_MAX_SHAPES ? most : MODES_MAX_SHAPES;
    for (uint32_t i = 0; i < most; i++) {
        uint32_t best = KL_MAX_STATES;
        double least = HUGE_VAL;
        for (uint32_t k = 0; k < modes->n_modes; k++) {
            const struct mode *m = &modes->mode[k];
            const double damping = -m->real / hypot(m->real, m->imag);
            if (m->imag > MODES_NEUTRAL && !taken[k] && damping < least) {
                least = damping;
                best = k;
            }
        }
        if (best < KL_MAX_STATES) {
            taken[best] = true;
        }
    }
    for (uint32_t k = 0; k < modes->n_modes; k++) {
        if (taken[k]) {
            chosen[n++] = k;
        }
    }
    return n;
}
