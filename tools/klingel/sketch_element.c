/* sketch_element.c - the symbols of force elements and linkages in a view. */
#include "sketch_element.h"

#define APART_MM 2.3 /* parallel symbols */
#define LEAST_LINE_MM 2.5

/* ---- elements ---- */

/* The axis of the vehicle that lies across the paper, up, and towards the eye. */
static const int axis_across[3] = {0, 0, 1};
static const int axis_up[3] = {2, 1, 2};
static const int axis_eye[3] = {4, 5, 3};

static double end_height(const struct kl_vehicle_def *def, int32_t end) {
    return end >= KL_WHEELSET_END(0) ? 0.46 : end >= 0 ? -def->bodies[end].z_m : 0.0;
}

static double end_x(const struct kl_vehicle_def *def, int32_t end, double otherwise) {
    return end >= KL_WHEELSET_END(0) ? def->wheelsets[end - KL_WHEELSET_END(0)].x_m
           : end >= 0                ? def->bodies[end].x_m
                                     : otherwise;
}

/* Where the symbol of one direction goes: from the element's place outwards, or centred on it. */
static void symbol_ends(const struct sketch_view *v, const struct sketch_what *what,
                        const struct kl_element_def *e, int axis, struct sketch_point ends[2]) {
    double at_m[3];
    sketch_place(e, at_m);
    const struct sketch_point at = sketch_project(v, at_m);
    const double length = v->symbol_mm;
    double from[2] = {0.0, 0.0};
    double to[2] = {0.0, 0.0};
    const int upright = axis == axis_up[v->projection];
    const double y_sign = at_m[1] < 0.0 ? -1.0 : 1.0;
    if (axis == KL_ALONG_Z) {
        const int32_t body = e->end_a >= 0 ? e->end_a : e->end_b;
        const double sign = -at_m[2] >= end_height(what->def, body) ? 1.0 : -1.0;
        from[1] = -0.5 * sign * length;
        to[1] = 0.5 * sign * length;
    } else if (axis == KL_ALONG_Y) {
        /* from the end it begins beside what stands upright there */
        from[upright] = upright ? 0.0 : 1.3 * APART_MM * y_sign;
        to[upright] = from[upright] + (upright ? -y_sign : y_sign) * length;
    } else {
        const double near = at_m[0] - end_x(what->def, e->end_a, at_m[0]);
        const double other = at_m[0] - end_x(what->def, e->end_b, at_m[0]);
        const double towards = fabs(near) > fabs(other) ? near : other;
        to[0] = (towards > 0.0 ? -1.0 : 1.0) * length;
    }
    ends[0] = (struct sketch_point){at.x + from[0], at.y + from[1]};
    ends[1] = (struct sketch_point){at.x + to[0], at.y + to[1]};
}

static bool has_axis(const struct sketch_part *part, size_t n, int axis) {
    for (size_t i = 0; i < n; i++) {
        if (part[i].axis == axis) {
            return true;
        }
    }
    return false;
}

/* The parts of one direction, side by side. */
static void draw_direction(struct sketch_view *v, const struct kl_element_def *e,
                           const struct sketch_part *part, size_t n_parts, int axis,
                           const struct sketch_point ends[2]) {
    size_t n = 0;
    size_t i = 0;
    for (size_t p = 0; p < n_parts; p++) {
        n += part[p].axis == axis ? 1u : 0u;
    }
    for (size_t p = 0; p < n_parts; p++) {
        if (part[p].axis == axis) {
            const double aside = APART_MM * ((double)i - 0.5 * (double)(n - 1));
            sketch_symbol(v->sketch, part[p].symbol, ends[0], ends[1], aside);
            i++;
        }
    }
    if (n > 0 && (e->end_a == KL_GROUND_END || e->end_b == KL_GROUND_END)) {
        sketch_ground(v->sketch, ends[0], ends[1]);
    }
    if (n > 0) {
        sketch_take_place(
            v, (struct sketch_point){0.5 * (ends[0].x + ends[1].x), 0.5 * (ends[0].y + ends[1].y)});
    }
}

static bool draw_line_parts(struct sketch_view *v, const struct kl_element_def *e,
                            const struct sketch_part *part, size_t n) {
    const struct sketch_point ends[2] = {sketch_project(v, e->point_a_m),
                                         sketch_project(v, e->point_b_m)};
    if (!has_axis(part, n, KL_ALONG_LINE)) {
        return false;
    }
    if (hypot(ends[1].x - ends[0].x, ends[1].y - ends[0].y) < LEAST_LINE_MM) {
        sketch_circle(v->sketch, SKETCH_DIMENSION, ends[0], 0.8); /* end on */
        return false;
    }
    sketch_circle(v->sketch, SKETCH_BODY, ends[0], 0.5);
    sketch_circle(v->sketch, SKETCH_BODY, ends[1], 0.5);
    draw_direction(v, e, part, n, KL_ALONG_LINE, ends);
    return true;
}

/* What acts in roll alone, from above: a bar across with a lever at either end. */
static void draw_roll_bar(struct sketch_view *v, const double at_m[3]) {
    const struct sketch_point at = sketch_project(v, at_m);
    const double half = 0.6 * v->scale;
    const double lever = 0.5 * v->symbol_mm;
    const struct sketch_point bar[4] = {{at.x + lever, at.y + half},
                                        {at.x, at.y + half},
                                        {at.x, at.y - half},
                                        {at.x + lever, at.y - half}};
    sketch_path(v->sketch, SKETCH_SPRING, bar, 4);
    sketch_take_place(v, at);
}

/* True if there is anything of it to be seen from here. */
static bool draw_element(struct sketch_view *v, const struct sketch_what *what, uint32_t i) {
    const struct kl_element_def *e = &what->def->elements[i];
    const int across = axis_across[v->projection];
    const int up = axis_up[v->projection];
    struct sketch_part part[SKETCH_MAX_PARTS];
    const size_t n = sketch_parts(e, part);
    struct sketch_point ends[2];
    double at_m[3];
    bool any = draw_line_parts(v, e, part, n);
    sketch_place(e, at_m);
    if (has_axis(part, n, up)) {
        symbol_ends(v, what, e, up, ends);
        draw_direction(v, e, part, n, up, ends);
        any = true;
    }
    /* lengthwise springs show in the plan; in a side view only where they are alone */
    if (has_axis(part, n, across) && (v->projection != SKETCH_SIDE || !any)) {
        symbol_ends(v, what, e, across, ends);
        draw_direction(v, e, part, n, across, ends);
        any = true;
    }
    for (size_t p = 0; p < n; p++) {
        if (part[p].axis == axis_eye[v->projection]) {
            const struct sketch_point at = sketch_project(v, at_m);
            sketch_turning(v->sketch, part[p].symbol, at,
                           part[p].symbol == SKETCH_IS_SPRING ? 1.7 : 2.5);
            sketch_take_place(v, at);
            any = true;
        }
    }
    if (!any && v->projection == SKETCH_PLAN && has_axis(part, n, KL_ALONG_ROLL)) {
        draw_roll_bar(v, at_m);
        any = true;
    }
    return any;
}

/* In side and end views those on the left, or behind another one, are not drawn. */
static bool is_hidden(const struct sketch_view *v, const struct sketch_what *what, uint32_t i) {
    double at[3];
    sketch_place(&what->def->elements[i], at);
    if (!sketch_is_shown(v, at[0]) || -at[2] > v->top_m) {
        return true;
    }
    if (v->projection == SKETCH_SIDE) {
        return at[1] < 0.0;
    }
    for (uint32_t j = 0; v->projection == SKETCH_END && j < i; j++) {
        double other[3];
        sketch_place(&what->def->elements[j], other);
        if (what->groups->of_element[i] == what->groups->of_element[j] &&
            sketch_is_shown(v, other[0]) && at[1] * other[1] >= 0.0) {
            return true;
        }
    }
    return false;
}

void sketch_draw_elements(struct sketch_view *v, const struct sketch_what *what) {
    const struct kl_vehicle_def *def = what->def;
    bool seen[KL_MAX_ELEMENTS] = {false};
    bool numbered[KL_MAX_ELEMENTS] = {false};
    for (uint32_t i = 0; i < def->n_elements; i++) {
        seen[i] = !is_hidden(v, what, i) && draw_element(v, what, i);
    }
    for (uint32_t i = 0; i < def->n_elements; i++) {
        double at_m[3];
        sketch_place(&def->elements[i], at_m);
        if (at_m[0] >= what->numbered_low_m && at_m[0] <= what->numbered_high_m) {
            numbered[what->groups->of_element[i]] = true;
        }
    }
    for (uint32_t i = 0; i < def->n_elements; i++) {
        const uint32_t group = what->groups->of_element[i];
        double at_m[3];
        char text[12];
        sketch_place(&def->elements[i], at_m);
        if (seen[i] && !numbered[group]) {
            snprintf(text, sizeof text, "%u", group + 1);
            sketch_number(v, sketch_project(v, at_m), text);
            numbered[group] = true;
        }
    }
}

/* ---- linkages: in the plan, between the centres that they tie ---- */

static void centre_of(const struct kl_vehicle_def *def, int32_t end, double at[3]) {
    at[0] = end_x(def, end, 0.0);
    at[1] = 0.0;
    at[2] = 0.0;
}

static void draw_linkage(struct sketch_view *v, const struct sketch_what *what, uint32_t i,
                         bool number) {
    const struct kl_linkage_def *linkage = &what->def->linkages[i];
    const double aside = (i % 2 == 0 ? 1.0 : -1.0) * (0.16 + 0.1 * (double)(i / 2 % 3));
    double x[2 * KL_MAX_TERMS];
    uint32_t n = 0;
    for (uint32_t t = 0; t < linkage->n_terms; t++) { /* sorted, each once */
        double at[3];
        uint32_t k = n;
        centre_of(what->def, linkage->term[t].end, at);
        for (; k > 0 && x[k - 1] > at[0]; k--) {
            x[k] = x[k - 1];
        }
        x[k] = at[0];
        n++;
    }
    struct sketch_point last = {0, 0};
    struct sketch_point first = {0, 0};
    bool any = false;
    for (uint32_t t = 0; t < n; t++) {
        const double inside = fmin(fmax(x[t], v->low_x_m), v->high_x_m);
        const struct sketch_point at = sketch_project(v, (const double[3]){inside, aside, 0});
        if (t > 0) {
            sketch_line(v->sketch, SKETCH_LINKAGE, last, at);
        } else {
            first = at;
        }
        if (sketch_is_shown(v, x[t])) {
            sketch_circle(v->sketch, SKETCH_BODY, at, 0.7);
            any = true;
        }
        last = at;
    }
    if (number && any) {
        char text[12];
        snprintf(text, sizeof text, "%u", what->groups->of_linkage[i] + 1);
        sketch_number(v, (struct sketch_point){0.5 * (first.x + last.x), last.y}, text);
    }
}

static bool reaches_view(const struct sketch_view *v, const struct sketch_what *what, uint32_t i) {
    const struct kl_linkage_def *linkage = &what->def->linkages[i];
    for (uint32_t t = 0; t < linkage->n_terms; t++) {
        if (sketch_is_shown(v, end_x(what->def, linkage->term[t].end, 0.0))) {
            return true;
        }
    }
    return false;
}

/* It is numbered elsewhere. */
static bool ties_between(const struct sketch_what *what, uint32_t i) {
    const struct kl_linkage_def *linkage = &what->def->linkages[i];
    for (uint32_t t = 0; t < linkage->n_terms; t++) {
        const double x = end_x(what->def, linkage->term[t].end, 0.0);
        if (x >= what->numbered_low_m && x <= what->numbered_high_m) {
            return true;
        }
    }
    return false;
}

void sketch_draw_linkages(struct sketch_view *v, const struct sketch_what *what) {
    bool numbered[KL_MAX_ELEMENTS + KL_MAX_LINKAGES] = {false};
    for (uint32_t i = 0; i < what->def->n_linkages; i++) {
        if (ties_between(what, i)) {
            numbered[what->groups->of_linkage[i]] = true;
        }
    }
    for (uint32_t i = 0; i < what->def->n_linkages; i++) {
        const uint32_t group = what->groups->of_linkage[i];
        if (reaches_view(v, what, i)) {
            draw_linkage(v, what, i, !numbered[group]);
            numbered[group] = true;
        }
    }
}
