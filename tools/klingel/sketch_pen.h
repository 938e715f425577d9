/*
 * sketch_pen.h - lines and symbols of a sketch, on a sheet of paper.
 *
 * Strokes are gathered by ink and drawn at the end, one line of the plot per ink. Lengths on paper
 * are in mm from the sheet's lower left corner, those of the vehicle in m in the vehicle frame
 * (x forward, y to the right, z down).
 */
#ifndef SKETCH_PEN_H
#define SKETCH_PEN_H

#include "cli_plot.h"

/* By what is drawn. */
enum sketch_ink {
    SKETCH_RAIL = 0,
    SKETCH_BODY,
    SKETCH_WHEELSET,
    SKETCH_SPRING,
    SKETCH_DAMPER,
    SKETCH_STOP,
    SKETCH_SLIP, /* friction, and springs in series with dampers */
    SKETCH_ACTUATOR,
    SKETCH_LINKAGE,
    SKETCH_DIMENSION,
    SKETCH_INKS
};

enum sketch_symbol {
    SKETCH_IS_SPRING = 0,
    SKETCH_IS_DAMPER,
    SKETCH_IS_STOP,
    SKETCH_IS_SERIES,
    SKETCH_IS_FRICTION,
    SKETCH_IS_ACTUATOR,
    SKETCH_SYMBOLS
};

struct sketch_stroke {
    double *x;
    double *y;
    size_t n;
    size_t size;
};

struct sketch {
    struct cli_plot plot;
    struct sketch_stroke stroke[SKETCH_INKS];
    bool no_memory;
};

enum sketch_projection { SKETCH_SIDE = 0, SKETCH_PLAN, SKETCH_END };

#define SKETCH_MAX_PLACES 512 /* of symbols and balloons of a view, so that they keep apart */

/* A view: where the vehicle frame's origin lies on the sheet, its scale, and what of x it shows. */
struct sketch_view {
    struct sketch *sketch;
    enum sketch_projection projection;
    double origin[2]; /* mm */
    double scale;     /* mm on paper per m */
    double low_x_m;
    double high_x_m;
    double top_m;     /* heights above are cut off */
    double symbol_mm; /* length of a symbol */
    size_t n_places;
    double place[SKETCH_MAX_PLACES][2];
};

struct sketch_point {
    double x;
    double y;
};

/* A point of the vehicle on paper. */
struct sketch_point sketch_project(const struct sketch_view *view, const double at_m[3]);

bool sketch_is_shown(const struct sketch_view *view, double x_m);

/* n points, joined. A NAN breaks the line. */
void sketch_path(struct sketch *s, enum sketch_ink ink, const struct sketch_point *at, size_t n);
void sketch_line(struct sketch *s, enum sketch_ink ink, struct sketch_point a,
                 struct sketch_point b);
void sketch_circle(struct sketch *s, enum sketch_ink ink, struct sketch_point centre,
                   double radius_mm);
/* A pale rectangle from its lower left to its upper right corner, with these of its edges. */
#define SKETCH_LEFT 1u
#define SKETCH_RIGHT 2u
#define SKETCH_BOTTOM 4u
#define SKETCH_TOP 8u
#define SKETCH_EDGES 15u
void sketch_box(struct sketch *s, enum sketch_ink ink, struct sketch_point a, struct sketch_point b,
                unsigned edges);
void sketch_word(struct sketch *s, enum cli_plot_colour colour, struct sketch_point at, char align,
                 double points, const char *text);
/* A number in a circle. */
void sketch_balloon(struct sketch *s, struct sketch_point at, const char *text);

/* What stands at a place of a view keeps others away from it: a balloon beside `at` goes where there is
 * most room. */
void sketch_take_place(struct sketch_view *v, struct sketch_point at);
void sketch_number(struct sketch_view *v, struct sketch_point at, const char *text);

enum sketch_ink sketch_ink_of(enum sketch_symbol symbol);
enum cli_plot_colour sketch_colour(enum sketch_ink ink);

/* A symbol from a to b on paper, aside by `aside_mm` to the left of that direction. */
void sketch_symbol(struct sketch *s, enum sketch_symbol symbol, struct sketch_point a,
                   struct sketch_point b, double aside_mm);
/* One that acts about the axis on which one looks. */
void sketch_turning(struct sketch *s, enum sketch_symbol symbol, struct sketch_point centre,
                    double radius_mm);
/* What does not move: hatching at `at`, which is the end of a line from `from`. */
void sketch_ground(struct sketch *s, struct sketch_point from, struct sketch_point at);
/* A dimension between two points at the same height of the sheet. */
void sketch_dimension(struct sketch *s, double x0, double x1, double y, const char *text);

/* Gives the strokes to the plot and their memory back. */
void sketch_finish(struct sketch *s);

#endif
