/* modes_shapes.c - mode shapes as a table and as pictures. */
#include <math.h>
#include <string.h>

#include "cli_plot.h"
#include "modes_plot.h"

#define TWO_PI 6.283185307179586
#define DRAWN_M 0.45       /* the largest displacement in a picture */
#define HALF_WIDTH_M 1.2   /* of a body */
#define WHEEL_M 0.75       /* from the middle of the axle */
#define RIM 24             /* corners of a wheel from the side */
#define LEAST_LENGTH_M 0.8 /* half of a body's that nothing is attached to */

/* Displacement of one freedom, as a complex amplitude. */
struct phasor {
    double re;
    double im;
};

static struct phasor phasor_of(const struct modes *modes, uint32_t k, int32_t state) {
    if (state < 0) {
        return (struct phasor){0.0, 0.0};
    }
    const uint32_t at = (uint32_t)state * modes->n + modes->mode[k].column;
    return (struct phasor){modes->vector_re[at], modes->vector_im[at]};
}

/* The largest displacement, m or rad. */
static struct phasor largest(const struct modes_names *names, const struct modes *modes,
                             uint32_t k) {
    struct phasor most = {0.0, 0.0};
    for (uint32_t f = 0; f < names->n; f++) {
        const struct phasor p = phasor_of(modes, k, names->freedom[f].position);
        most = hypot(p.re, p.im) > hypot(most.re, most.im) ? p : most;
    }
    return most;
}

void modes_print_shapes(const struct modes_names *names, const struct modes *modes,
                        const uint32_t *chosen, uint32_t n) {
    for (uint32_t i = 0; i < n; i++) {
        const struct mode *m = &modes->mode[chosen[i]];
        const struct phasor most = largest(names, modes, chosen[i]);
        char title[96];
        modes_title(names, m, title, sizeof title);
        printf("  shape of %s, %.5g Hz, damping %.4f\n    %-20s %9s %8s\n", title, m->imag / TWO_PI,
               -m->real / hypot(m->real, m->imag), "freedom", "amplitude", "phase");
        for (uint32_t f = 0; f < names->n; f++) {
            if (names->freedom[f].position < 0) {
                continue;
            }
            const struct phasor p = phasor_of(modes, chosen[i], names->freedom[f].position);
            const double size = hypot(p.re, p.im) / hypot(most.re, most.im);
            const bool angle = strstr(names->freedom[f].name, ".y") == NULL &&
                               strstr(names->freedom[f].name, ".z") == NULL;
            const bool yaw = strstr(names->freedom[f].name, ".yaw") != NULL;
            const double phase = remainder(atan2(p.im, p.re) - atan2(most.im, most.re), TWO_PI);
            printf("    %-20s %9.4f %-4s", names->freedom[f].name, size,
                   angle || yaw ? "rad" : "m");
            if (size >= 5e-5) {
                printf(" %+5.0f deg", phase * 360.0 / TWO_PI);
            }
            printf("\n");
        }
    }
}

/* ---- where things are at a phase ---- */

struct pose {
    double y;
    double z;
    double roll;
    double pitch;
    double yaw;
};

struct view {
    const struct modes_shapes *shapes;
    uint32_t mode;
    double scale_re; /* real part of (scale * displacement) is drawn */
    double scale_im;
};

static double drawn(const struct view *v, int32_t state) {
    const struct phasor p = phasor_of(v->shapes->modes, v->mode, state);
    return v->scale_re * p.re - v->scale_im * p.im;
}

static struct pose pose_of_body(const struct view *v, uint32_t body) {
    const struct kl_model *m = v->shapes->model;
    return (struct pose){drawn(v, kl_body_state_index(m, body, KL_Y, 0)),
                         drawn(v, kl_body_state_index(m, body, KL_Z, 0)),
                         drawn(v, kl_body_state_index(m, body, KL_ROLL, 0)),
                         drawn(v, kl_body_state_index(m, body, KL_PITCH, 0)),
                         drawn(v, kl_body_state_index(m, body, KL_YAW, 0))};
}

static struct pose pose_of_wheelset(const struct view *v, uint32_t w) {
    const struct kl_model *m = v->shapes->model;
    return (struct pose){.y = drawn(v, kl_wheelset_state_index(m, w, KL_WS_Y)),
                         .yaw = drawn(v, kl_wheelset_state_index(m, w, KL_WS_YAW))};
}

/* Half the length of a body: as far as its elements reach. */
static double reach(const struct modes_shapes *s, uint32_t body) {
    double most = LEAST_LENGTH_M;
    for (uint32_t i = 0; i < s->vehicle->n_elements; i++) {
        const struct kl_element_def *e = &s->vehicle->elements[i];
        const double x_m = s->vehicle->bodies[body].x_m;
        if (e->end_a == (int32_t)body) {
            most = fmax(most, fabs(e->point_a_m[0] - x_m) + 0.3);
        }
        if (e->end_b == (int32_t)body) {
            most = fmax(most, fabs(e->point_b_m[0] - x_m) + 0.3);
        }
    }
    return most;
}

/* A closed outline of four corners as rays. */
static void box(struct cli_plot *plot, const struct cli_plot_style *style, const double x[4],
                const double y[4]) {
    struct cli_plot_ray ray[4];
    for (int i = 0; i < 4; i++) {
        ray[i] = (struct cli_plot_ray){x[i], y[i], x[(i + 1) % 4], y[(i + 1) % 4]};
    }
    cli_plot_rays(plot, style, ray, 4);
}

enum face { ABOVE, SIDE, BEHIND };

/* Corners of a body, at (along, across) from its centre; what the pose does to them. */
static void draw_body(struct cli_plot *plot, const struct cli_plot_style *style,
                      const struct view *v, uint32_t body, enum face face) {
    static const double sign[4][2] = {{-1.0, -1.0}, {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}};
    const struct pose p = pose_of_body(v, body);
    const struct kl_body *b = &v->shapes->model->bodies[body];
    const double half = reach(v->shapes, body);
    const double high = fmax(0.15, fmin(1.1, -0.6 * (double)b->z_m));
    double x[4];
    double y[4];
    for (int i = 0; i < 4; i++) {
        const double along = sign[i][0] * half;
        const double width = half < 3.0 ? 0.75 * HALF_WIDTH_M : HALF_WIDTH_M;
        if (face == ABOVE) {
            x[i] = (double)b->x_m + along - p.yaw * sign[i][1] * width;
            y[i] = p.y + p.yaw * along + sign[i][1] * width;
        } else if (face == SIDE) {
            x[i] = (double)b->x_m + along + p.pitch * sign[i][1] * high;
            y[i] = (double)b->z_m + p.z - p.pitch * along + sign[i][1] * high;
        } else {
            const double across = sign[i][0] * width;
            x[i] = p.y + across - p.roll * sign[i][1] * high;
            y[i] = (double)b->z_m + p.z + p.roll * across + sign[i][1] * high;
        }
    }
    box(plot, style, x, y);
}

static void draw_wheelset(struct cli_plot *plot, const struct cli_plot_style *style,
                          const struct view *v, uint32_t w, enum face face) {
    const struct pose p = pose_of_wheelset(v, w);
    const struct kl_wheelset *ws = &v->shapes->model->wheelsets[w];
    const double r = (double)v->shapes->model->pairs[ws->pair].radius_m;
    const double x = (double)ws->x_m;
    struct cli_plot_ray ray[RIM];
    if (face == SIDE) {
        for (int i = 0; i < RIM; i++) {
            const double a = TWO_PI * i / RIM;
            const double b = TWO_PI * (i + 1) / RIM;
            ray[i] = (struct cli_plot_ray){x + r * cos(a), -r + r * sin(a), x + r * cos(b),
                                           -r + r * sin(b)};
        }
        cli_plot_rays(plot, style, ray, RIM);
        return;
    }
    if (face == ABOVE) {
        for (int i = 0; i < 2; i++) { /* wheels, turned by the yaw */
            const double side = i == 0 ? WHEEL_M : -WHEEL_M;
            const double cx = x - p.yaw * side;
            const double cy = p.y + side;
            ray[i] = (struct cli_plot_ray){cx - r, cy - p.yaw * r, cx + r, cy + p.yaw * r};
        }
        ray[2] = (struct cli_plot_ray){x - p.yaw * WHEEL_M, p.y + WHEEL_M, x + p.yaw * WHEEL_M,
                                       p.y - WHEEL_M};
    } else {
        for (int i = 0; i < 2; i++) {
            const double at = p.y + (i == 0 ? WHEEL_M : -WHEEL_M);
            ray[i] = (struct cli_plot_ray){at, -2.0 * r, at, 0.0};
        }
        ray[2] = (struct cli_plot_ray){ray[0].x0, -r, ray[1].x0, -r};
    }
    cli_plot_rays(plot, style, ray, 3);
}

static void draw_vehicle(struct cli_plot *plot, const struct view *v, enum face face,
                         const struct cli_plot_style *style) {
    const struct kl_model *m = v->shapes->model;
    for (uint32_t b = 0; b < m->n_bodies; b++) {
        draw_body(plot, style, v, b, face);
    }
    for (uint32_t w = 0; w < m->n_wheelsets; w++) {
        draw_wheelset(plot, style, v, w, face);
    }
}

/* ---- the picture ---- */

/* Half the height and the pitch of a mode's energy against lateral, roll and yaw. */
static bool is_vertical(const struct modes_shapes *s, uint32_t k) {
    const struct modes *m = s->modes;
    double vertical = 0.0;
    double total = 0.0;
    for (uint32_t f = 0; f < s->names->n; f++) {
        const char *name = strrchr(s->names->freedom[f].name, '.');
        const struct phasor p = phasor_of(m, k, s->names->freedom[f].rate);
        const double energy = s->names->freedom[f].inertia * (p.re * p.re + p.im * p.im);
        total += energy;
        vertical += strcmp(name, ".z") == 0 || strcmp(name, ".pitch") == 0 ? energy : 0.0;
    }
    return vertical > 0.5 * total;
}

/* The displacement that is drawn largest: angles count with their bodies' half length. */
static struct phasor drawn_largest(const struct modes_shapes *s, uint32_t k) {
    struct phasor most = {0.0, 0.0};
    for (uint32_t f = 0; f < s->names->n; f++) {
        const char *name = strrchr(s->names->freedom[f].name, '.');
        struct phasor p = phasor_of(s->modes, k, s->names->freedom[f].position);
        double arm = 1.0;
        if (strcmp(name, ".yaw") == 0 || strcmp(name, ".pitch") == 0) {
            for (uint32_t b = 0; b < s->model->n_bodies; b++) {
                const size_t length = strlen(s->model->bodies[b].name);
                if (strncmp(s->names->freedom[f].name, s->model->bodies[b].name, length) == 0 &&
                    s->names->freedom[f].name[length] == '.') {
                    arm = reach(s, b);
                }
            }
        }
        p = (struct phasor){arm * p.re, arm * p.im};
        most = hypot(p.re, p.im) > hypot(most.re, most.im) ? p : most;
    }
    return most;
}

static void draw_mode(struct cli_plot *plot, const struct modes_shapes *s, uint32_t row) {
    static const struct cli_plot_style quarter = {
        .colour = CLI_PLOT_SECOND, .pen = CLI_PLOT_DASHED, .thin = true};
    static const struct cli_plot_style now = {.colour = CLI_PLOT_FIRST};
    static const struct cli_plot_style rest = {.colour = CLI_PLOT_QUIET, .thin = true};
    const uint32_t k = s->chosen[row];
    const struct mode *m = &s->modes->mode[k];
    const struct phasor most = drawn_largest(s, k);
    const double size = most.re * most.re + most.im * most.im;
    /* turns the largest displacement to the real axis, as large as it shall be drawn */
    const struct view still = {s, k, 0.0, 0.0};
    const struct view first = {s, k, DRAWN_M * most.re / size, -DRAWN_M * most.im / size};
    const struct view later = {s, k, -first.scale_im, first.scale_re};
    const enum face face = is_vertical(s, k) ? SIDE : ABOVE;
    char title[160];
    char name[96];
    modes_title(s->names, m, name, sizeof name);
    snprintf(title, sizeof title, "%s: %.3g Hz, damping %.1f %%", name, m->imag / TWO_PI,
             -100.0 * m->real / hypot(m->real, m->imag));
    for (int panel = 0; panel < 2; panel++) {
        const enum face seen = panel == 0 ? face : BEHIND;
        cli_plot_panel(plot, &(struct cli_plot_panel){
                                 .title = panel == 0 ? title : "from behind",
                                 .x_label = panel == 0 ? "x [m], forward" : "y [m], right",
                                 .y_label = seen == ABOVE ? "y [m], right" : "z [m], down",
                                 .row = (int)row,
                                 .column = panel == 0 ? 0 : 3,
                                 .columns = panel == 0 ? 3 : 1,
                                 .equal = true,
                                 .y_down = true});
        draw_vehicle(plot, &still, seen, &rest);
        draw_vehicle(plot, &later, seen, &quarter);
        draw_vehicle(plot, &first, seen, &now);
    }
}

int modes_plot_shapes(const char *path, const struct modes_shapes *shapes) {
    struct cli_plot plot;
    char title[128];
    snprintf(title, sizeof title, "%s: mode shapes at %g m/s", shapes->model->name,
             shapes->speed_m_s);
    if (shapes->n == 0) {
        return cli_fail("no mode swings at %g m/s: there is no shape to draw", shapes->speed_m_s);
    }
    int status = cli_plot_open(&plot, path, title,
                               "blue: at the largest displacement; orange: a quarter of a period "
                               "later; grey: at rest; displacements not to scale");
    if (status != CLI_OK) {
        return status;
    }
    for (uint32_t i = 0; i < shapes->n; i++) {
        draw_mode(&plot, shapes, i);
    }
    return cli_plot_close(&plot, status);
}
