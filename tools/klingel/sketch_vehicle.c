/* sketch_vehicle.c - a view of a vehicle. */
#include "sketch_vehicle.h"

#include <string.h>

#define LEAST_HALF_M 0.12 /* of a box */
#define CLEARANCE_M 0.05  /* of a box above the rail */
#define AXLE_HALF_M 1.0
#define TYRE_M 0.135 /* width of a wheel, and where it lies about the tape circle */
#define TYRE_INSIDE_M 0.07
#define FLANGE_M 0.028
#define RAIL_HEAD_M 0.072
#define RAIL_HEIGHT_M 0.172
#define LOW_BODY_M 1.2
#define APART_MM 2.3 /* parallel symbols */
#define LEAST_LINE_MM 2.5

/* ---- sizes ---- */

void sketch_body_box(const struct kl_body_def *body, struct sketch_box_m *box) {
    const double *inertia = body->inertia_kgm2;
    const double sum = inertia[0] + inertia[1] + inertia[2];
    const double centre[3] = {body->x_m, 0.0, body->z_m};
    for (int i = 0; i < 3; i++) { /* I_y + I_z - I_x = m L^2/6 */
        const double square = 6.0 * (sum - 2.0 * inertia[i]) / body->mass_kg;
        double half = fmax(0.5 * sqrt(fmax(square, 0.0)), LEAST_HALF_M);
        if (i == 2 && body->z_m < -2.0 * CLEARANCE_M) {
            half = fmin(half, -body->z_m - CLEARANCE_M);
        }
        box->low[i] = centre[i] - half;
        box->high[i] = centre[i] + half;
    }
}

static const struct kl_pair_def *pair_of(const struct kl_vehicle_def *def, uint32_t i) {
    return &def->pairs[def->wheelsets[i].pair];
}

double sketch_wheel_radius(const struct kl_vehicle_def *def, uint32_t wheelset) {
    const struct kl_pair_def *pair = pair_of(def, wheelset);
    return pair->kind == KL_PAIR_LINEAR ? pair->radius_m : pair->wheel[KL_RIGHT].radius_m;
}

double sketch_half_base(const struct kl_vehicle_def *def, uint32_t wheelset) {
    const struct kl_pair_def *pair = pair_of(def, wheelset);
    return pair->kind == KL_PAIR_LINEAR ? pair->half_base_m : pair->wheel[KL_RIGHT].half_spacing_m;
}

static void include(struct sketch_box_m *extent, const double low[3], const double high[3]) {
    for (int i = 0; i < 3; i++) {
        extent->low[i] = fmin(extent->low[i], low[i]);
        extent->high[i] = fmax(extent->high[i], high[i]);
    }
}

void sketch_extent(const struct kl_vehicle_def *def, struct sketch_box_m *extent) {
    *extent = (struct sketch_box_m){{HUGE_VAL, -1.1, -1.0}, {-HUGE_VAL, 1.1, 0.0}};
    for (uint32_t i = 0; i < def->n_wheelsets; i++) {
        const double r = sketch_wheel_radius(def, i) + 0.1;
        const double x = def->wheelsets[i].x_m;
        include(extent, (const double[3]){x - r, -AXLE_HALF_M, -2.0 * r},
                (const double[3]){x + r, AXLE_HALF_M, 0.0});
    }
    for (uint32_t i = 0; i < def->n_bodies; i++) {
        struct sketch_box_m box;
        sketch_body_box(&def->bodies[i], &box);
        include(extent, box.low, box.high);
    }
    for (uint32_t i = 0; i < def->n_elements; i++) {
        include(extent, def->elements[i].point_a_m, def->elements[i].point_a_m);
        include(extent, def->elements[i].point_b_m, def->elements[i].point_b_m);
    }
}

/* ---- what keeps apart ---- */

static void take_place(struct sketch_view *v, struct sketch_point at) {
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

/* A balloon beside a symbol, where there is most room; nearer places are tried first. */
static void put_number(struct sketch_view *v, struct sketch_point at, const char *text) {
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
    take_place(v, best);
}

/* ---- rails, wheelsets, bodies ---- */

static void draw_rails(const struct sketch_view *v, const struct sketch_what *what) {
    const double half = sketch_half_base(what->def, 0);
    const double from = v->low_x_m;
    const double to = v->high_x_m;
    struct sketch *s = v->sketch;
    for (int side = -1; side <= 1; side += 2) {
        const double y = side * half;
        if (v->projection == SKETCH_END) {
            const double web = 0.2 * RAIL_HEAD_M;
            const double foot = 0.14;
            const double h = RAIL_HEIGHT_M;
            const double neck = 0.045;
            const double outline[][2] = {{-1, 0}, {1, 0}, {1, neck}, {0, neck}, {0, h}, {2, h}};
            struct sketch_point at[12];
            for (int i = 0; i < 6; i++) {
                const double dy = outline[i][0] == 0.0   ? web / 2
                                  : outline[i][0] == 2.0 ? foot / 2
                                                         : outline[i][0] * RAIL_HEAD_M / 2;
                at[i] = sketch_project(v, (const double[3]){0, y + dy, outline[i][1]});
                at[11 - i] =
                    sketch_project(v, (const double[3]){0, y - (i == 0 ? -dy : dy), outline[i][1]});
            }
            at[11] = at[0] = sketch_project(v, (const double[3]){0, y - RAIL_HEAD_M / 2, 0});
            sketch_path(s, SKETCH_RAIL, at, 12);
        } else {
            sketch_line(s, SKETCH_RAIL, sketch_project(v, (const double[3]){from, y, 0}),
                        sketch_project(v, (const double[3]){to, y, 0}));
        }
    }
}

static bool is_shown(const struct sketch_view *v, double x_m) {
    return x_m >= v->low_x_m && x_m <= v->high_x_m;
}

/* A box of the vehicle, in this view; cut off where the view ends. */
static void draw_box(const struct sketch_view *v, enum sketch_ink ink, const double low[3],
                     const double high[3]) {
    double a[3] = {fmax(low[0], v->low_x_m), low[1], high[2]};
    double b[3] = {fmin(high[0], v->high_x_m), high[1], fmax(low[2], -v->top_m)};
    unsigned edges = SKETCH_EDGES;
    if (a[0] >= b[0] || a[2] <= b[2]) {
        return;
    }
    if (v->projection != SKETCH_END) {
        edges &= ~(a[0] > low[0] ? SKETCH_LEFT : 0u) & ~(b[0] < high[0] ? SKETCH_RIGHT : 0u);
    }
    if (v->projection != SKETCH_PLAN && b[2] > low[2]) {
        edges &= ~SKETCH_TOP;
    }
    if (v->projection == SKETCH_PLAN) { /* right is down */
        const double y = a[1];
        a[1] = b[1];
        b[1] = y;
    }
    sketch_box(v->sketch, ink, sketch_project(v, a), sketch_project(v, b), edges);
}

static void draw_wheel(const struct sketch_view *v, double x, double r, double half, int side) {
    const double inner = half - TYRE_INSIDE_M;
    const double outer = inner + TYRE_M;
    const double flange = r + FLANGE_M;
    const double tread[2] = {side > 0 ? inner : -outer, side > 0 ? outer : -inner};
    const double lip[2] = {side > 0 ? inner : -inner - 0.03, side > 0 ? inner + 0.03 : -inner};
    draw_box(v, SKETCH_WHEELSET, (const double[3]){x - r, tread[0], -2.0 * r},
             (const double[3]){x + r, tread[1], 0.0});
    draw_box(v, SKETCH_WHEELSET, (const double[3]){x - flange, lip[0], -r - flange},
             (const double[3]){x + flange, lip[1], flange - r});
}

static void draw_wheelset(const struct sketch_view *v, const struct sketch_what *what, uint32_t i) {
    const double x = what->def->wheelsets[i].x_m;
    const double r = sketch_wheel_radius(what->def, i);
    const double half = sketch_half_base(what->def, i);
    if (v->projection == SKETCH_SIDE) {
        const struct sketch_point centre = sketch_project(v, (const double[3]){x, 0, -r});
        sketch_circle(v->sketch, SKETCH_WHEELSET, centre, v->scale * r);
        sketch_circle(v->sketch, SKETCH_WHEELSET, centre, v->scale * (r - 0.06));
        sketch_circle(v->sketch, SKETCH_WHEELSET, centre, v->scale * 0.08);
        return;
    }
    /* of wheels that turn by themselves a low beam between stubs */
    const bool apart = what->def->wheelsets[i].independent != 0;
    const double beam = apart ? 0.22 : 0.0;
    const double reach = apart ? half - 0.15 : AXLE_HALF_M + 0.1;
    draw_box(v, SKETCH_WHEELSET, (const double[3]){x - 0.08, -reach, beam - r - 0.08},
             (const double[3]){x + 0.08, reach, beam - r + 0.08});
    for (int side = -1; apart && side <= 1; side += 2) {
        const double inner = side * reach;
        const double outer = side * (AXLE_HALF_M + 0.1);
        draw_box(v, SKETCH_WHEELSET, (const double[3]){x - 0.06, fmin(inner, outer), -r - 0.06},
                 (const double[3]){x + 0.06, fmax(inner, outer), -r + 0.06});
    }
    draw_wheel(v, x, r, half, 1);
    draw_wheel(v, x, r, half, -1);
}

/* The mark of a centre of mass. */
static void draw_centre(const struct sketch_view *v, const double at_m[3]) {
    const double size = 1.3;
    const struct sketch_point at = sketch_project(v, at_m);
    sketch_circle(v->sketch, SKETCH_BODY, at, size);
    sketch_line(v->sketch, SKETCH_BODY, (struct sketch_point){at.x - 1.5 * size, at.y},
                (struct sketch_point){at.x + 1.5 * size, at.y});
    sketch_line(v->sketch, SKETCH_BODY, (struct sketch_point){at.x, at.y - 1.5 * size},
                (struct sketch_point){at.x, at.y + 1.5 * size});
}

static void draw_body(struct sketch_view *v, const struct sketch_what *what, uint32_t i) {
    const struct kl_body_def *body = &what->def->bodies[i];
    const double centre[3] = {body->x_m, 0.0, body->z_m};
    struct sketch_box_m box;
    sketch_body_box(body, &box);
    draw_box(v, SKETCH_BODY, box.low, box.high);
    if (!is_shown(v, body->x_m) || -body->z_m > v->top_m) {
        return;
    }
    draw_centre(v, centre);
    struct sketch_point at = sketch_project(v, centre);
    take_place(v, at);
    if (what->names) { /* above what stands on a low body, or in a high one */
        const bool low = box.high[2] - box.low[2] < LOW_BODY_M;
        at.y = low ? sketch_project(v, box.low).y + 5.5 : at.y + 3.4;
        sketch_word(v->sketch, CLI_PLOT_INK, at, 'c', 6.5, body->name);
    }
}

/* From the end, one of several that look the same is enough. */
static bool seen_before(const struct sketch_view *v, const struct kl_vehicle_def *def, uint32_t i) {
    struct sketch_box_m a;
    sketch_body_box(&def->bodies[i], &a);
    for (uint32_t j = 0; j < i; j++) {
        struct sketch_box_m b;
        sketch_body_box(&def->bodies[j], &b);
        if (b.high[0] >= v->low_x_m && b.low[0] <= v->high_x_m && a.high[1] == b.high[1] &&
            a.low[2] == b.low[2] && a.high[2] == b.high[2]) {
            return true;
        }
    }
    return false;
}

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
        take_place(
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
    take_place(v, at);
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
            take_place(v, at);
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
    if (!is_shown(v, at[0]) || -at[2] > v->top_m) {
        return true;
    }
    if (v->projection == SKETCH_SIDE) {
        return at[1] < 0.0;
    }
    for (uint32_t j = 0; v->projection == SKETCH_END && j < i; j++) {
        double other[3];
        sketch_place(&what->def->elements[j], other);
        if (what->groups->of_element[i] == what->groups->of_element[j] && is_shown(v, other[0]) &&
            at[1] * other[1] >= 0.0) {
            return true;
        }
    }
    return false;
}

static void draw_elements(struct sketch_view *v, const struct sketch_what *what) {
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
            put_number(v, sketch_project(v, at_m), text);
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
        if (is_shown(v, x[t])) {
            sketch_circle(v->sketch, SKETCH_BODY, at, 0.7);
            any = true;
        }
        last = at;
    }
    if (number && any) {
        char text[12];
        snprintf(text, sizeof text, "%u", what->groups->of_linkage[i] + 1);
        put_number(v, (struct sketch_point){0.5 * (first.x + last.x), last.y}, text);
    }
}

static bool reaches_view(const struct sketch_view *v, const struct sketch_what *what, uint32_t i) {
    const struct kl_linkage_def *linkage = &what->def->linkages[i];
    for (uint32_t t = 0; t < linkage->n_terms; t++) {
        if (is_shown(v, end_x(what->def, linkage->term[t].end, 0.0))) {
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

static void draw_linkages(struct sketch_view *v, const struct sketch_what *what) {
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

/* ---- all of it ---- */

static void put_distance(const struct sketch_view *v, double x0, double x1, double down_mm) {
    const struct sketch_point a = sketch_project(v, (const double[3]){x0, 0, 0});
    const struct sketch_point b = sketch_project(v, (const double[3]){x1, 0, 0});
    char text[24];
    snprintf(text, sizeof text, "%.4g m", fabs(x1 - x0));
    if (fabs(b.x - a.x) > 7.0) {
        sketch_dimension(v->sketch, fmin(a.x, b.x), fmax(a.x, b.x), a.y - down_mm, text);
    }
}

/* Between neighbours that are shown, and over all of them. */
static void draw_distances(const struct sketch_view *v, const struct kl_vehicle_def *def) {
    double x[KL_MAX_WHEELSETS];
    uint32_t n = 0;
    for (uint32_t i = 0; i < def->n_wheelsets; i++) {
        uint32_t k = n;
        if (!is_shown(v, def->wheelsets[i].x_m)) {
            continue;
        }
        for (; k > 0 && x[k - 1] > def->wheelsets[i].x_m; k--) {
            x[k] = x[k - 1];
        }
        x[k] = def->wheelsets[i].x_m;
        n++;
    }
    for (uint32_t i = 1; i < n; i++) {
        put_distance(v, x[i - 1], x[i], 5.0);
    }
    if (n > 2) {
        put_distance(v, x[0], x[n - 1], 10.0);
    }
}

void sketch_draw(struct sketch_view *view, const struct sketch_what *what) {
    const struct kl_vehicle_def *def = what->def;
    bool wheels = false;
    draw_rails(view, what);
    for (uint32_t i = 0; i < def->n_wheelsets; i++) {
        if (is_shown(view, def->wheelsets[i].x_m) && (view->projection != SKETCH_END || !wheels)) {
            draw_wheelset(view, what, i);
            wheels = true;
        }
    }
    for (uint32_t i = 0; i < def->n_bodies; i++) {
        if (view->projection != SKETCH_END || !seen_before(view, def, i)) {
            draw_body(view, what, i);
        }
    }
    draw_elements(view, what);
    if (view->projection == SKETCH_PLAN) {
        draw_linkages(view, what);
    }
    if (what->distances) {
        draw_distances(view, def);
    }
    if (view->projection == SKETCH_END) {
        const double half = sketch_half_base(def, 0);
        char text[24];
        const struct sketch_point a = sketch_project(view, (const double[3]){0, -half, 0});
        const struct sketch_point b = sketch_project(view, (const double[3]){0, half, 0});
        snprintf(text, sizeof text, "%.4g m", 2.0 * half);
        sketch_dimension(view->sketch, a.x, b.x, a.y - RAIL_HEIGHT_M * view->scale - 4.0, text);
    }
}
