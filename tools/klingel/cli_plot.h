/*
 * cli_plot.h - pictures of any sub-command, drawn by Matplotlib.
 *
 * A command describes its picture; nothing here knows what it shows, and nothing in Python knows
 * what klingel computes. Between open and close the description is written as JSON to a temporary
 * file; close starts tools/plot.py with it as standard input and the picture's file as standard
 * output. The protocol is described at the top of tools/klingel_plot/figure.py, the house style
 * (colours, fonts, sizes) is in tools/klingel_plot/style.py.
 *
 *     cli_plot_open     then any number of
 *     cli_plot_panel      a panel in the grid, and what is in it, drawn in this order:
 *     cli_plot_line, _rays, _mark, _text, _fill, _word
 *     cli_plot_close    draws, always to be called once open succeeded
 *
 * Numbers are in the unit that the axis label names. Not finite: a gap in the line.
 * plot.py is looked for in tools/ of the folders above the program; KLINGEL_PLOT names another one.
 */
#ifndef CLI_PLOT_H
#define CLI_PLOT_H

#include "cli.h"

/* By role, not by hue: the same thing has the same colour in every panel. */
enum cli_plot_colour {
    CLI_PLOT_FIRST = 0, /* right wheel, main result */
    CLI_PLOT_SECOND,    /* left wheel, what it is compared with */
    CLI_PLOT_THIRD,
    CLI_PLOT_FOURTH,
    CLI_PLOT_FIFTH,
    CLI_PLOT_SIXTH,
    CLI_PLOT_INK,  /* profiles, reference */
    CLI_PLOT_QUIET /* what is only there for orientation */
};

#define CLI_PLOT_WIDTH_MM 279.4 /* of every picture; WIDTH_IN of style.py */

enum cli_plot_pen { CLI_PLOT_SOLID = 0, CLI_PLOT_DASHED, CLI_PLOT_DOTTED, CLI_PLOT_POINTS };

struct cli_plot_style {
    const char *label; /* in the legend; NULL: none */
    enum cli_plot_colour colour;
    enum cli_plot_pen pen;
    bool thin;
};

/* A panel, `rows` x `columns` cells of the grid from (row, column) on; 0 means 1. */
struct cli_plot_panel {
    const char *title;
    const char *x_label; /* with the unit: "lateral displacement [mm]"; NULL: none */
    const char *y_label;
    int row;
    int column;
    int rows;
    int columns;
    bool equal;  /* the same scale on both axes */
    bool y_down; /* grows downwards, as z does */
    bool x_log;  /* logarithmic; what is not positive is not shown */
    bool y_log;
    double
        sheet_mm; /* not 0: no axes, but a sheet of paper as wide as the picture and so high, drawn
                        on in mm from its lower left corner; the only panel */
    double x_low; /* range of x; both 0: as the data */
    double x_high;
    double y_low; /* range of y, likewise */
    double y_high;
};

struct cli_plot {
    FILE *json;
    struct cli_output picture;
    bool panel;   /* one is open */
    bool content; /* the open panel holds something */
};

/* Begins a picture: PNG, PDF or SVG by the path's ending; "-" is PNG on standard output. `notes`
 * stand small under the title, may be NULL. CLI_OK, or CLI_FAILED or CLI_USAGE (printed). */
int cli_plot_open(struct cli_plot *plot, const char *path, const char *title, const char *notes);

void cli_plot_panel(struct cli_plot *plot, const struct cli_plot_panel *panel);

/* n points, joined or marked. */
void cli_plot_line(struct cli_plot *plot, const struct cli_plot_style *style, const double *x,
                   const double *y, size_t n);

/* n separate straight lines, from (x0, y0) to (x1, y1). */
struct cli_plot_ray {
    double x0;
    double y0;
    double x1;
    double y1;
};
void cli_plot_rays(struct cli_plot *plot, const struct cli_plot_style *style,
                   const struct cli_plot_ray *rays, size_t n);

/* A line across the panel at a value of x ('x') or y ('y'), with a word beside it (or NULL). */
void cli_plot_mark(struct cli_plot *plot, const struct cli_plot_style *style, char axis, double at,
                   const char *text);

/* A word centred at a place of the panel. */
void cli_plot_text(struct cli_plot *plot, enum cli_plot_colour colour, double x, double y,
                   const char *text);

/* A closed polygon of n corners in a pale tone of the colour, without an edge. */
void cli_plot_fill(struct cli_plot *plot, const struct cli_plot_style *style, const double *x,
                   const double *y, size_t n);

/* A word of a size and place of its own. */
struct cli_plot_word {
    const char *text;
    double x;
    double y;
    double points; /* height of the type */
    char align;    /* 'l': begins there, 'c': centred, 'r': ends there */
    bool boxed;    /* in a white circle with a rim of the colour */
};
void cli_plot_word(struct cli_plot *plot, enum cli_plot_colour colour,
                   const struct cli_plot_word *word);

/* Draws and waits; `status` is what the command has come to. The picture is kept only where that is
 * 0 and all went well. Returns the status, or CLI_FAILED (printed). About a second. */
int cli_plot_close(struct cli_plot *plot, int status);

/* --plot, for the option table of a command. */
struct cli_option cli_plot_option(const char **value, const char *help);

#endif
