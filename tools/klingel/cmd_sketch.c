/* cmd_sketch.c - klingel sketch: what a vehicle file describes, drawn. */
#include <string.h>

#include "cli_plot.h"
#include "sketch_vehicle.h"

#define MARGIN_MM 9.0
#define GAP_MM 9.0     /* between views */
#define CAPTION_MM 4.0 /* above a view */
#define FOOT_MM 14.0   /* dimensions below one */
#define PLAN_FOOT_MM 3.0
#define MOST_SCALE 30.0 /* mm per m */
#define LINE_MM 3.6     /* of the list */
#define LONGEST_M 75.0  /* more is not shown */
#define SHOWN_M 60.0
#define DETAIL_SCALE 13.0 /* below, the leading running gear is drawn again */
#define DETAIL_TOP_M 1.9
#define NEIGHBOURS_M 3.5 /* wheelsets nearer than that are one running gear */
#define LIST_POINTS 6.5

/* The sheet: the views are rows of it, the list stands below. */
struct layout {
    struct sketch_box_m extent;
    double low_x_m; /* what is shown of the length */
    double high_x_m;
    double scale;
    bool cut;    /* a long train: not all of it */
    bool detail; /* of the leading running gear */
    double detail_low_m;
    double detail_high_m;
    double detail_scale;
    double width_m;  /* over all */
    double height_m; /* above the rail */
    double top_mm;   /* of what is still free */
};

static double usable_mm(void) {
    return CLI_PLOT_WIDTH_MM - 2.0 * MARGIN_MM;
}

/* The leading wheelset and those close behind. */
static void find_detail(const struct kl_vehicle_def *def, struct layout *l) {
    double first = -HUGE_VAL;
    for (uint32_t i = 0; i < def->n_wheelsets; i++) {
        first = fmax(first, def->wheelsets[i].x_m);
    }
    double last = first;
    for (uint32_t n = 0; n < def->n_wheelsets; n++) {
        double next = last;
        for (uint32_t i = 0; i < def->n_wheelsets; i++) {
            const double x = def->wheelsets[i].x_m;
            next = x < next && last - x < NEIGHBOURS_M ? x : next;
        }
        last = next;
    }
    l->detail_low_m = last - 1.1;
    l->detail_high_m = first + 1.1;
}

static void lay_out(const struct kl_vehicle_def *def, struct layout *l) {
    sketch_extent(def, &l->extent);
    l->low_x_m = l->extent.low[0] - 0.3;
    l->high_x_m = l->extent.high[0] + 0.3;
    l->cut = l->high_x_m - l->low_x_m > LONGEST_M;
    l->low_x_m = l->cut ? l->high_x_m - SHOWN_M : l->low_x_m;
    l->width_m = 2.0 * fmax(l->extent.high[1], -l->extent.low[1]) + 0.6;
    l->height_m = -l->extent.low[2] + 0.2;
    const double length = l->high_x_m - l->low_x_m;
    l->scale = (usable_mm() - GAP_MM) / (length + l->width_m);
    l->detail = l->scale < DETAIL_SCALE;
    if (l->detail) {
        l->scale = usable_mm() / length;
        find_detail(def, l);
        l->detail_scale =
            fmin(MOST_SCALE, (usable_mm() - 2.0 * GAP_MM) /
                                 (2.0 * (l->detail_high_m - l->detail_low_m) + l->width_m));
    }
    l->scale = fmin(l->scale, MOST_SCALE);
}

static double symbol_mm(double scale) {
    return fmin(fmax(0.42 * scale, 4.6), 9.0);
}

/* A view in a row whose rail level or centre line is at `level_mm`; `left_mm` its left edge. */
static struct sketch_view a_view(struct sketch *s, const struct layout *l,
                                 enum sketch_projection projection, bool detail, double left_mm,
                                 double level_mm) {
    struct sketch_view v = {.sketch = s, .projection = projection};
    v.scale = detail ? l->detail_scale : l->scale;
    v.low_x_m = detail ? l->detail_low_m : l->low_x_m;
    v.high_x_m = detail ? l->detail_high_m : l->high_x_m;
    v.top_m = detail && projection == SKETCH_SIDE ? DETAIL_TOP_M : HUGE_VAL;
    v.symbol_mm = symbol_mm(v.scale);
    v.origin[0] = left_mm + (projection == SKETCH_END ? 0.5 * l->width_m : -v.low_x_m) * v.scale;
    v.origin[1] = level_mm;
    return v;
}

static void caption(struct sketch *s, double left_mm, double y_mm, const char *text) {
    sketch_word(s, CLI_PLOT_QUIET, (struct sketch_point){left_mm, y_mm}, 'l', 7.5, text);
}

/* Heights of the rows, from which that of the sheet follows. */
static double side_row_mm(const struct layout *l) {
    return CAPTION_MM + l->height_m * l->scale + FOOT_MM;
}
static double plan_row_mm(const struct layout *l) {
    return CAPTION_MM + l->width_m * l->scale + PLAN_FOOT_MM;
}
static double detail_row_mm(const struct layout *l) {
    return l->detail ? CAPTION_MM + fmax(l->height_m, l->width_m) * l->detail_scale + FOOT_MM : 0.0;
}

static void draw_whole(struct sketch *s, const struct layout *l, struct sketch_what what) {
    double top = l->top_mm;
    const double left = MARGIN_MM;
    double level = top - CAPTION_MM - l->height_m * l->scale;
    struct sketch_view v = a_view(s, l, SKETCH_SIDE, false, left, level);
    what.names = true;
    what.distances = true;
    what.numbered_low_m = l->detail ? l->detail_low_m : HUGE_VAL;
    what.numbered_high_m = l->detail ? l->detail_high_m : -HUGE_VAL;
    caption(s, left, top - 1.0,
            l->cut ? "side view, the leading end; forward is to the right"
                   : "side view, forward is to the right");
    sketch_draw(&v, &what);
    what.distances = false;
    what.names = false;
    if (!l->detail) {
        const double end_left = left + (l->high_x_m - l->low_x_m) * l->scale + GAP_MM;
        v = a_view(s, l, SKETCH_END, false, end_left, level);
        caption(s, end_left, top - 1.0, "seen from behind");
        sketch_draw(&v, &what);
    }
    top -= side_row_mm(l);
    level = top - CAPTION_MM - 0.5 * l->width_m * l->scale;
    v = a_view(s, l, SKETCH_PLAN, false, left, level);
    caption(s, left, top - 1.0, "plan, the right side below");
    sketch_draw(&v, &what);
}

static void draw_detail(struct sketch *s, const struct layout *l, struct sketch_what what) {
    const double top = l->top_mm - side_row_mm(l) - plan_row_mm(l);
    const double length = (l->detail_high_m - l->detail_low_m) * l->detail_scale;
    const double bottom = top - detail_row_mm(l) + FOOT_MM;
    double left = MARGIN_MM;
    struct sketch_view v = a_view(s, l, SKETCH_SIDE, true, left, bottom);
    what.distances = true;
    what.numbered_low_m = HUGE_VAL;
    what.numbered_high_m = -HUGE_VAL;
    caption(s, left, bottom + fmin(l->height_m, DETAIL_TOP_M) * l->detail_scale + 4.0,
            "the leading running gear, side view");
    sketch_draw(&v, &what);
    what.distances = false;
    left += length + GAP_MM;
    v = a_view(s, l, SKETCH_PLAN, true, left,
               bottom + 0.5 * fmax(l->height_m, l->width_m) * l->detail_scale);
    caption(s, left, top - 1.0, "its plan");
    sketch_draw(&v, &what);
    left += length + GAP_MM;
    v = a_view(s, l, SKETCH_END, true, left, bottom);
    caption(s, left, top - 1.0, "seen from behind");
    sketch_draw(&v, &what);
}

/* ---- the list of parts ---- */

struct list {
    struct sketch *sketch; /* NULL: the lines are counted only */
    double y_mm;
    uint32_t lines;
};

static void put_line(struct list *list, const char *number, const char *text) {
    if (list->sketch != NULL && number != NULL) {
        sketch_balloon(list->sketch, (struct sketch_point){MARGIN_MM + 1.5, list->y_mm}, number);
    }
    if (list->sketch != NULL) {
        sketch_word(list->sketch, CLI_PLOT_INK, (struct sketch_point){MARGIN_MM + 5.0, list->y_mm},
                    'l', LIST_POINTS, text);
    }
    list->y_mm -= LINE_MM;
    list->lines++;
}

static void put_list(struct list *list, const struct cli_model *m,
                     const struct sketch_groups *groups) {
    const struct kl_vehicle_def *def = &m->file.vehicle;
    char line[SKETCH_LINE_SIZE];
    for (uint32_t i = 0; i < def->n_bodies; i++) {
        if (sketch_body_line(def, i, line) > 0) {
            put_line(list, NULL, line);
        }
    }
    for (uint32_t i = 0; i < def->n_wheelsets; i++) {
        if (sketch_wheelset_line(m, i, line) > 0) {
            put_line(list, NULL, line);
        }
    }
    list->y_mm -= 1.0;
    for (uint32_t g = 0; g < groups->n_groups; g++) {
        char number[12];
        snprintf(number, sizeof number, "%u", g + 1);
        sketch_group_line(def, groups, g, line);
        put_line(list, number, line);
    }
}

/* The symbols that occur, with their names. */
static void put_legend(struct sketch *s, const struct kl_vehicle_def *def, double y_mm) {
    static const char *const names[SKETCH_SYMBOLS] = {
        "spring", "damper", "stop", "spring and damper in series", "friction", "actuator"};
    bool used[SKETCH_SYMBOLS] = {false};
    double x = MARGIN_MM;
    for (uint32_t i = 0; i < def->n_elements; i++) {
        struct sketch_part part[SKETCH_MAX_PARTS];
        const size_t n = sketch_parts(&def->elements[i], part);
        for (size_t p = 0; p < n; p++) {
            used[part[p].symbol] = true;
        }
    }
    for (int k = 0; k < SKETCH_SYMBOLS; k++) {
        if (used[k]) {
            sketch_symbol(s, (enum sketch_symbol)k, (struct sketch_point){x, y_mm},
                          (struct sketch_point){x + 9.0, y_mm}, 0.0);
            sketch_word(s, CLI_PLOT_INK, (struct sketch_point){x + 10.5, y_mm}, 'l', 7.0, names[k]);
            x += 17.0 + 1.35 * (double)strlen(names[k]);
        }
    }
    if (def->n_linkages > 0) {
        sketch_line(s, SKETCH_LINKAGE, (struct sketch_point){x, y_mm},
                    (struct sketch_point){x + 9.0, y_mm});
        sketch_word(s, CLI_PLOT_INK, (struct sketch_point){x + 10.5, y_mm}, 'l', 7.0, "linkage");
    }
}

static void draw_sheet(struct sketch *s, struct layout *l, const struct cli_model *m,
                       const struct sketch_groups *groups) {
    struct list list = {0};
    put_list(&list, m, groups);
    const double list_mm = LINE_MM * (list.lines + 1.0);
    const double legend_mm = 7.0;
    l->top_mm = side_row_mm(l) + plan_row_mm(l) + detail_row_mm(l) + legend_mm + list_mm + 3.0;
    cli_plot_panel(&s->plot, &(struct cli_plot_panel){.sheet_mm = round(l->top_mm * 10.0) / 10.0});
    const struct sketch_what what = {.def = &m->file.vehicle, .groups = groups};
    draw_whole(s, l, what);
    if (l->detail) {
        draw_detail(s, l, what);
    }
    put_legend(s, &m->file.vehicle, list_mm + 0.5 * legend_mm + 1.0);
    list = (struct list){.sketch = s, .y_mm = list_mm - 1.5};
    put_list(&list, m, groups);
    sketch_finish(s);
}

static int perform(const struct cli_model *m, const char *path) {
    static struct sketch_groups groups; /* large */
    static const char notes[] =
        "bodies as homogeneous boxes of their mass and inertia; symbols stand "
        "where an element acts; numbers: see the list";
    struct sketch s = {0};
    struct layout l = {0};
    char title[96];
    sketch_group(&m->file.vehicle, &groups);
    lay_out(&m->file.vehicle, &l);
    snprintf(title, sizeof title, "%s", m->model.name);
    int status = cli_plot_open(&s.plot, path, title, notes);
    if (status == CLI_OK) {
        draw_sheet(&s, &l, m, &groups);
        status = s.no_memory ? cli_fail("out of memory") : CLI_OK;
        status = cli_plot_close(&s.plot, status);
    }
    return status;
}

int cmd_sketch(int argc, char **argv) {
    const char *path = NULL;
    struct cli_target target;
    int status = CLI_OK;
    const struct cli_option options[] = {
        cli_output_option(&path, "the picture: .png, .pdf or .svg; - is PNG on standard output;\n"
                                 "needed"),
    };
    const struct cli_command command = {
        .purpose =
            "Draws what a vehicle file describes: bodies, wheelsets and every force element and\n"
            "linkage where it acts, from the side, from above and from behind, with distances and "
            "a\nlist of the parts and their figures.",
        .example = "klingel sketch models/manchester_vehicle1.yaml -o coach.png\n"
                   "klingel sketch models/two_axle_wagon.yaml -o wagon.svg\n",
        .options = options,
        .n_options = sizeof options / sizeof options[0]};
    if (!cli_parse(&command, argc, argv, &target, &status)) {
        return status;
    }
    if (path == NULL) {
        return cli_misuse("-o PICTURE is missing");
    }
    struct cli_model m;
    status = cli_model_open(&m, &target);
    if (status == CLI_OK) {
        status = perform(&m, path);
        cli_model_close(&m);
    }
    return cli_flush(status);
}
