/* sketch_pen.c - strokes gathered by ink; the symbols of force elements. */
#include "sketch_pen.h"

#include <stdlib.h>

#define PI 3.14159265358979323846
#define HALF_WIDTH_MM 0.95 /* of a symbol */
#define GRAIN 100.0        /* of a mm: coordinates are rounded, so that no platform differs */

static const struct {
    enum cli_plot_colour colour;
    enum cli_plot_pen pen;
    bool thin;
} inks[SKETCH_INKS] = {
    [SKETCH_RAIL] = {CLI_PLOT_QUIET, CLI_PLOT_SOLID, false},
    [SKETCH_BODY] = {CLI_PLOT_INK, CLI_PLOT_SOLID, true},
    [SKETCH_WHEELSET] = {CLI_PLOT_INK, CLI_PLOT_SOLID, true},
    [SKETCH_SPRING] = {CLI_PLOT_FIRST, CLI_PLOT_SOLID, true},
    [SKETCH_DAMPER] = {CLI_PLOT_SECOND, CLI_PLOT_SOLID, true},
    [SKETCH_STOP] = {CLI_PLOT_INK, CLI_PLOT_SOLID, true},
    [SKETCH_SLIP] = {CLI_PLOT_FOURTH, CLI_PLOT_SOLID, true},
    [SKETCH_ACTUATOR] = {CLI_PLOT_FIFTH, CLI_PLOT_SOLID, true},
    [SKETCH_LINKAGE] = {CLI_PLOT_THIRD, CLI_PLOT_DASHED, false},
    [SKETCH_DIMENSION] = {CLI_PLOT_QUIET, CLI_PLOT_SOLID, true},
};

enum cli_plot_colour sketch_colour(enum sketch_ink ink) {
    return inks[ink].colour;
}

enum sketch_ink sketch_ink_of(enum sketch_symbol symbol) {
    static const enum sketch_ink of[SKETCH_SYMBOLS] = {
        SKETCH_SPRING, SKETCH_DAMPER, SKETCH_STOP, SKETCH_SLIP, SKETCH_SLIP, SKETCH_ACTUATOR};
    return of[symbol];
}

static double rounded(double mm) {
    return round(mm * GRAIN) / GRAIN + 0.0; /* no -0 */
}

struct sketch_point sketch_project(const struct sketch_view *view, const double at_m[3]) {
    const double across = view->projection == SKETCH_END ? at_m[1] : at_m[0];
    const double up = view->projection == SKETCH_PLAN ? -at_m[1] : -at_m[2];
    return (struct sketch_point){view->origin[0] + view->scale * across,
                                 view->origin[1] + view->scale * up};
}

bool sketch_is_shown(const struct sketch_view *v, double x_m) {
    return x_m >= v->low_x_m && x_m <= v->high_x_m;
}

static void put_point(struct sketch *s, struct sketch_stroke *stroke, struct sketch_point at) {
    if (stroke->n == stroke->size) {
        const size_t size = stroke->size > 0 ? 2 * stroke->size : 256;
        double *x = realloc(stroke->x, size * sizeof x[0]);
        stroke->x = x != NULL ? x : stroke->x;
        double *y = realloc(stroke->y, size * sizeof y[0]);
        stroke->y = y != NULL ? y : stroke->y;
        if (x == NULL || y == NULL) {
            s->no_memory = true;
            return;
        }
        stroke->size = size;
    }
    stroke->x[stroke->n] = rounded(at.x);
    stroke->y[stroke->n] = rounded(at.y);
    stroke->n++;
}

void sketch_path(struct sketch *s, enum sketch_ink ink, const struct sketch_point *at, size_t n) {
    for (size_t i = 0; i < n; i++) {
        put_point(s, &s->stroke[ink], at[i]);
    }
    put_point(s, &s->stroke[ink], (struct sketch_point){(double)NAN, (double)NAN});
}

void sketch_line(struct sketch *s, enum sketch_ink ink, struct sketch_point a,
                 struct sketch_point b) {
    sketch_path(s, ink, (const struct sketch_point[]){a, b}, 2);
}

static struct sketch_point around(struct sketch_point centre, double radius_mm, double angle) {
    return (struct sketch_point){centre.x + radius_mm * cos(angle),
                                 centre.y + radius_mm * sin(angle)};
}

void sketch_circle(struct sketch *s, enum sketch_ink ink, struct sketch_point centre,
                   double radius_mm) {
    enum { CORNERS = 48 };
    struct sketch_point at[CORNERS + 1];
    for (int i = 0; i <= CORNERS; i++) {
        at[i] = around(centre, radius_mm, 2.0 * PI * i / CORNERS);
    }
    sketch_path(s, ink, at, CORNERS + 1);
}

void sketch_box(struct sketch *s, enum sketch_ink ink, struct sketch_point a, struct sketch_point b,
                unsigned edges) {
    const struct cli_plot_style style = {.colour = inks[ink].colour};
    const struct sketch_point at[5] = {a, {b.x, a.y}, b, {a.x, b.y}, a};
    static const unsigned of[4] = {SKETCH_BOTTOM, SKETCH_RIGHT, SKETCH_TOP, SKETCH_LEFT};
    double x[4];
    double y[4];
    for (int i = 0; i < 4; i++) {
        x[i] = rounded(at[i].x);
        y[i] = rounded(at[i].y);
        if ((edges & of[i]) != 0) {
            sketch_line(s, ink, at[i], at[i + 1]);
        }
    }
    cli_plot_fill(&s->plot, &style, x, y, 4);
}

void sketch_word(struct sketch *s, enum cli_plot_colour colour, struct sketch_point at, char align,
                 double points, const char *text) {
    const struct cli_plot_word word = {
        .text = text, .x = rounded(at.x), .y = rounded(at.y), .points = points, .align = align};
    cli_plot_word(&s->plot, colour, &word);
}

void sketch_balloon(struct sketch *s, struct sketch_point at, const char *text) {
    const struct cli_plot_word word = {.text = text,
                                       .x = rounded(at.x),
                                       .y = rounded(at.y),
                                       .points = 5.5,
                                       .align = 'c',
                                       .boxed = true};
    cli_plot_word(&s->plot, CLI_PLOT_INK, &word);
}

/* ---- what keeps apart ---- */

void sketch_take_place(struct sketch_view *v, struct sketch_point at) {
    if (v->n_places < SKETCH_MAX_PLACES) {
        v->place[v->n_places][0] = at.x;
        v->place[v->n_places][1] = at.y;
        v->n_places++;
    }
}

static double room_at(const struct sketch_view *v, struct sketch_point at) {
    double least = HUGE_VAL;
    for (size_t i = 0; i < v->n_places; i++) {
        least = fmin(least, hypot(v->place[i][0] - at.x, v->place[i][1] - at.y));
    }
    return least;
}

/* Nearer places are tried first. */
void sketch_number(struct sketch_view *v, struct sketch_point at, const char *text) {
    static const double radii[] = {4.2, 5.6, 7.5, 9.5};
    const double enough = 3.9;
    struct sketch_point best = at;
    double most = -1.0;
    for (size_t r = 0; r < sizeof radii / sizeof radii[0] && most < enough; r++) {
        for (int i = 0; i < 12; i++) {
            const double angle = (1.5 + i) * 0.5235987755982988;
            const struct sketch_point there = {at.x + radii[r] * cos(angle),
                                               at.y + radii[r] * sin(angle)};
            const double room = room_at(v, there);
            if (room > most + 1e-6) {
                most = room;
                best = there;
            }
        }
    }
    sketch_line(v->sketch, SKETCH_DIMENSION, at, best);
    sketch_balloon(v->sketch, best, text);
    sketch_take_place(v, best);
}

/* ---- symbols ---- */

#define GAP (float)NAN, 0
#define MAX_CORNERS 32

/* Corners of each: along its length, 0 to 1, and across, in half widths. */
static const struct shape {
    size_t n;
    float corner[2 * MAX_CORNERS];
} shapes[SKETCH_SYMBOLS] = {
    [SKETCH_IS_SPRING] = {11, {0,  0,    .14f, 0,    .19f, 1,    .29f, -1,   .39f, 1, .49f,
                               -1, .59f, 1,    .69f, -1,   .79f, 1,    .86f, 0,    1, 0}},
    [SKETCH_IS_DAMPER] = {13, {0,    0, .5f,  0,  GAP, .5f, .7f, .5f,  -.7f, GAP, .3f, 1,
                               .72f, 1, .72f, -1, .3f, -1,  GAP, .72f, 0,    1,   0}},
    [SKETCH_IS_STOP] = {13, {0,    0,  .36f, 0, GAP,  .36f, 1,   .36f, -1, GAP, .54f, 1,
                             .54f, -1, .8f,  0, .54f, 1,    GAP, .8f,  0,  1,   0}},
    [SKETCH_IS_SERIES] = {19, {0,    0, .06f, 0, .1f,  1,  .17f, -1,   .24f, 1,    .31f, -1,
                               .38f, 1, .43f, 0, .64f, 0,  GAP,  .64f, .7f,  .64f, -.7f, GAP,
                               .52f, 1, .82f, 1, .82f, -1, .52f, -1,   GAP,  .82f, 0}},
    [SKETCH_IS_FRICTION] = {14, {0,   .3f, .75f, .3f, GAP, .25f, -.3f, 1,   -.3f, GAP,  .3f,  .3f,
                                 .4f, 1,   GAP,  .6f, .3f, .7f,  1,    GAP, .45f, -.3f, .35f, -1}},
    [SKETCH_IS_ACTUATOR] = {19, {0,   0,    .2f, 0,   GAP,  .2f, 1,    .8f, 1,    .8f,  -1,
                                 .2f, -1,   .2f, 1,   GAP,  .8f, 0,    1,   0,    GAP,  .32f,
                                 0,   .68f, 0,   GAP, .52f, .5f, .68f, 0,   .52f, -.5f, GAP}},
};

void sketch_symbol(struct sketch *s, enum sketch_symbol symbol, struct sketch_point a,
                   struct sketch_point b, double aside_mm) {
    const struct shape *shape = &shapes[symbol];
    const double length = hypot(b.x - a.x, b.y - a.y);
    struct sketch_point at[MAX_CORNERS];
    if (!(length > 0.0)) {
        return;
    }
    const double u[2] = {(b.x - a.x) / length, (b.y - a.y) / length};
    for (size_t i = 0; i < shape->n; i++) {
        const double along = length * (double)shape->corner[2 * i];
        const double across = aside_mm + HALF_WIDTH_MM * (double)shape->corner[2 * i + 1];
        at[i] = (struct sketch_point){a.x + u[0] * along - u[1] * across,
                                      a.y + u[1] * along + u[0] * across};
    }
    sketch_path(s, sketch_ink_of(symbol), at, shape->n);
}

void sketch_turning(struct sketch *s, enum sketch_symbol symbol, struct sketch_point centre,
                    double radius_mm) {
    enum { CORNERS = 40 };
    const enum sketch_ink ink = sketch_ink_of(symbol);
    struct sketch_point at[CORNERS + 1];
    const bool spiral = symbol == SKETCH_IS_SPRING;
    for (int i = 0; i <= CORNERS; i++) {
        const double t = (double)i / CORNERS;
        at[i] = around(centre, radius_mm * (spiral ? 0.15 + 0.85 * t : 1.0),
                       spiral ? 5.0 * PI * t : PI * (0.15 + 1.5 * t));
    }
    sketch_path(s, ink, at, CORNERS + 1);
    if (!spiral) { /* between two radial plates */
        sketch_line(s, ink, around(centre, 0.6 * radius_mm, 0.15 * PI),
                    around(centre, 1.4 * radius_mm, 0.15 * PI));
        sketch_line(s, ink, around(centre, 0.6 * radius_mm, 1.65 * PI),
                    around(centre, 1.4 * radius_mm, 1.65 * PI));
    }
}

void sketch_ground(struct sketch *s, struct sketch_point from, struct sketch_point at) {
    const double length = hypot(at.x - from.x, at.y - from.y);
    if (!(length > 0.0)) {
        return;
    }
    const double u[2] = {(at.x - from.x) / length, (at.y - from.y) / length};
    const double half = 1.8;
    for (int i = -2; i <= 2; i++) {
        const struct sketch_point root = {at.x - u[1] * half * i / 2, at.y + u[0] * half * i / 2};
        const struct sketch_point tip = {root.x + u[0] - u[1], root.y + u[1] + u[0]};
        sketch_line(s, SKETCH_DIMENSION, root, tip);
    }
    sketch_line(s, SKETCH_BODY, (struct sketch_point){at.x - u[1] * half, at.y + u[0] * half},
                (struct sketch_point){at.x + u[1] * half, at.y - u[0] * half});
}

void sketch_dimension(struct sketch *s, double x0, double x1, double y, const char *text) {
    const double end = 0.9;
    const double middle = 0.5 * (x0 + x1);
    sketch_line(s, SKETCH_DIMENSION, (struct sketch_point){x0, y}, (struct sketch_point){x1, y});
    for (int i = 0; i < 2; i++) {
        const double x = i == 0 ? x0 : x1;
        sketch_line(s, SKETCH_DIMENSION, (struct sketch_point){x - end, y - end},
                    (struct sketch_point){x + end, y + end});
    }
    sketch_word(s, CLI_PLOT_INK, (struct sketch_point){middle, y + 1.7}, 'c', 6.0, text);
}

void sketch_finish(struct sketch *s) {
    for (int ink = 0; ink < SKETCH_INKS; ink++) {
        struct sketch_stroke *stroke = &s->stroke[ink];
        const struct cli_plot_style style = {
            .colour = inks[ink].colour, .pen = inks[ink].pen, .thin = inks[ink].thin};
        if (stroke->n > 0) {
            cli_plot_line(&s->plot, &style, stroke->x, stroke->y, stroke->n);
        }
        free(stroke->x);
        free(stroke->y);
        *stroke = (struct sketch_stroke){0};
    }
}
