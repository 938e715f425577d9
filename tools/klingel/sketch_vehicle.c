/* sketch_vehicle.c - a view of a vehicle: its rails, wheelsets and bodies. */
#include "sketch_vehicle.h"

#include "sketch_element.h"

#define LEAST_HALF_M 0.12 /* of a box */
#define CLEARANCE_M 0.05  /* of a box above the rail */
#define AXLE_HALF_M 1.0
#define TYRE_M 0.135 /* width of a wheel, and where it lies about the tape circle */
#define TYRE_INSIDE_M 0.07
#define FLANGE_M 0.028
#define RAIL_HEAD_M 0.072
#define RAIL_HEIGHT_M 0.172
#define LOW_BODY_M 1.2

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
    if (!sketch_is_shown(v, body->x_m) || -body->z_m > v->top_m) {
        return;
    }
    draw_centre(v, centre);
    struct sketch_point at = sketch_project(v, centre);
    sketch_take_place(v, at);
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
        if (!sketch_is_shown(v, def->wheelsets[i].x_m)) {
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
        if (sketch_is_shown(view, def->wheelsets[i].x_m) &&
            (view->projection != SKETCH_END || !wheels)) {
            draw_wheelset(view, what, i);
            wheels = true;
        }
    }
    for (uint32_t i = 0; i < def->n_bodies; i++) {
        if (view->projection != SKETCH_END || !seen_before(view, def, i)) {
            draw_body(view, what, i);
        }
    }
    sketch_draw_elements(view, what);
    if (view->projection == SKETCH_PLAN) {
        sketch_draw_linkages(view, what);
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
