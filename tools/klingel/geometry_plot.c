/* geometry_plot.c - klingel geometry --plot. */
#include "geometry_plot.h"

#include <stdlib.h>
#include <string.h>

#include "cli_plot.h"

#define MM 1e3
#define LIFT_M 22e-3   /* of the wheels above the rails they touch */
#define AROUND_M 8e-3  /* shown beside rail and contacts */
#define LABEL_M 2.6e-3 /* least distance of two numbers */
#define PROFILE_STEPS 600
#define MOST_RAYS 400
#define MOST_JUMPS (KL_SIDES * KL_MAX_JUMPS)

static const char *const side_name[KL_SIDES] = {"right", "left"};
static const enum cli_plot_colour side_colour[KL_SIDES] = {CLI_PLOT_FIRST, CLI_PLOT_SECOND};

/* ---- against u_y ---- */

enum column {
    U_Y = 0,
    RADIUS, /* minus r0; two sides */
    ANGLE = RADIUS + 2,
    WHEEL = ANGLE + 2,
    RAIL = WHEEL + 2,
    DIFFERENCE = RAIL + 2,
    ROLL,
    COLUMNS
};

struct table {
    size_t n;
    double *column[COLUMNS];   /* mm, degrees, mrad; a gap (NaN) at every jump */
    double jump_m[MOST_JUMPS]; /* as u_y */
    enum kl_side jump_side[MOST_JUMPS];
    size_t n_jumps;
};

static void find_jumps(const struct kl_pair *pair, struct table *t) {
    for (int s = 0; s < KL_SIDES; s++) {
        const struct kl_side_table *side = &pair->side[s];
        for (uint32_t i = 0; i < side->n_jumps && i < KL_MAX_JUMPS; i++) {
            t->jump_m[t->n_jumps] = s == KL_RIGHT ? side->jumps[i].w_m : -side->jumps[i].w_m;
            t->jump_side[t->n_jumps++] = (enum kl_side)s;
        }
    }
}

/* True if a jump lies between two displacements. */
static bool jumps_between(const struct table *t, double low_m, double high_m) {
    for (size_t i = 0; i < t->n_jumps; i++) {
        if (t->jump_m[i] > low_m && t->jump_m[i] <= high_m) {
            return true;
        }
    }
    return false;
}

static void put_row(const struct kl_pair *pair, const struct kl_posture *p, struct table *t) {
    const size_t i = t->n++;
    t->column[U_Y][i] = p->u_y_m * MM;
    t->column[ROLL][i] = p->phi_rad * 1e3;
    for (int s = 0; s < KL_SIDES; s++) {
        const struct kl_row *row = &p->row[s];
        t->column[RADIUS + s][i] = ((double)row->radius_m - (double)pair->radius_m) * MM;
        t->column[ANGLE + s][i] = (double)row->delta_rail_rad / cli_unit("deg");
        t->column[WHEEL + s][i] = (double)row->eta_wheel_m * MM;
        t->column[RAIL + s][i] = (double)row->eta_rail_m * MM;
    }
    t->column[DIFFERENCE][i] = t->column[RADIUS + KL_RIGHT][i] - t->column[RADIUS + KL_LEFT][i];
}

/* -1: out of memory. */
static int tabulate(const struct kl_pair *pair, struct table *t) {
    const size_t most = 2u * (2u * (size_t)pair->half + 1u);
    const double step = (double)pair->step_m;
    double *memory = malloc(COLUMNS * most * sizeof *memory);
    memset(t, 0, sizeof *t);
    if (memory == NULL) {
        return -1;
    }
    for (int c = 0; c < COLUMNS; c++) {
        t->column[c] = memory + (size_t)c * most;
    }
    find_jumps(pair, t);
    for (size_t i = 0; i <= 2u * (size_t)pair->half; i++) {
        struct kl_posture posture;
        double u_y = ((double)i - (double)pair->half) * step;
        if (kl_pair_posture(pair, u_y, &posture) != KL_OK) {
            continue;
        }
        if (i > 0 && jumps_between(t, u_y - step, u_y)) {
            for (int c = 0; c < COLUMNS; c++) {
                t->column[c][t->n] = (double)NAN;
            }
            t->n++;
        }
        put_row(pair, &posture, t);
    }
    return 0;
}

static void plot_jumps(struct cli_plot *plot, const struct table *t, bool with_words) {
    for (size_t i = 0; i < t->n_jumps; i++) {
        char text[32];
        snprintf(text, sizeof text, "jump %.2f", t->jump_m[i] * MM);
        const struct cli_plot_style style = {.colour = CLI_PLOT_FIFTH, .pen = CLI_PLOT_DOTTED};
        cli_plot_mark(plot, &style, 'x', t->jump_m[i] * MM, with_words ? text : NULL);
    }
}

static void plot_column(struct cli_plot *plot, const struct table *t, int column,
                        struct cli_plot_style style) {
    cli_plot_line(plot, &style, t->column[U_Y], t->column[column], t->n);
}

static void plot_sides(struct cli_plot *plot, const struct table *t, int column,
                       enum cli_plot_pen pen, const char *what) {
    for (int s = 0; s < KL_SIDES; s++) {
        char label[32];
        snprintf(label, sizeof label, "%s%s", side_name[s], what);
        plot_column(plot, t, column + s,
                    (struct cli_plot_style){.label = label, .colour = side_colour[s], .pen = pen});
    }
}

static void plot_against_u_y(struct cli_plot *plot, const struct table *t, int row) {
    const char *const u_y = "lateral displacement of the wheelset u_y [mm]";
    const struct cli_plot_style ink = {.label = "difference, right – left", .colour = CLI_PLOT_INK};
    cli_plot_panel(plot, &(struct cli_plot_panel){.title = "Rolling radii, and their difference",
                                                  .y_label = "r – r0, Δr [mm]",
                                                  .row = row});
    plot_jumps(plot, t, true);
    plot_sides(plot, t, RADIUS, CLI_PLOT_SOLID, ", r – r0");
    plot_column(plot, t, DIFFERENCE, ink);
    cli_plot_panel(
        plot, &(struct cli_plot_panel){
                  .title = "Contact angles", .y_label = "δ [degrees]", .row = row, .column = 1});
    plot_jumps(plot, t, false);
    plot_sides(plot, t, ANGLE, CLI_PLOT_SOLID, "");
    cli_plot_panel(plot, &(struct cli_plot_panel){.title = "Roll of the wheelset",
                                                  .x_label = u_y,
                                                  .y_label = "φ [mrad], right side down positive",
                                                  .row = row + 1});
    plot_jumps(plot, t, false);
    plot_column(plot, t, ROLL, (struct cli_plot_style){.colour = CLI_PLOT_INK});
    cli_plot_panel(plot, &(struct cli_plot_panel){.title = "Contact points",
                                                  .x_label = u_y,
                                                  .y_label = "η [mm], towards the flange positive",
                                                  .row = row + 1,
                                                  .column = 1});
    plot_jumps(plot, t, false);
    plot_sides(plot, t, WHEEL, CLI_PLOT_SOLID, " wheel");
    plot_sides(plot, t, RAIL, CLI_PLOT_DASHED, " rail");
}

/* ---- profiles with contact lines ---- */

/* One wheel over its rail, drawn in mm: y from the middle of the track, z up from the rail's
 * origin. */
struct drawing {
    struct kl_profile wheel;
    struct kl_profile rail;
    double sign;      /* +1 right, -1 left */
    double wheel_q_m; /* distance of eta = 0 from the middle when central */
    double rail_q_m;
    double rise_m;  /* of the wheel, so that it touches when central */
    double low_q_m; /* what is shown */
    double high_q_m;
    void *memory;
};

static int prepare(const struct geometry_picture *p, int s, struct drawing *d) {
    const size_t size = (size_t)1 << 20; /* two profiles of most points are a quarter of it */
    struct kl_arena arena;
    struct kl_posture central;
    memset(d, 0, sizeof *d);
    d->memory = malloc(size);
    if (d->memory == NULL) {
        return cli_fail("out of memory");
    }
    kl_arena_init(&arena, d->memory, size);
    enum kl_status status =
        kl_profile_build(&p->def->wheel[s].profile, 0.0, &arena, &d->wheel, NULL);
    status = status == KL_OK ? kl_profile_build(&p->def->rail[s].profile, p->def->rail[s].cant_rad,
                                                &arena, &d->rail, NULL)
                             : status;
    status = status == KL_OK ? kl_pair_posture(p->pair, 0.0, &central) : status;
    if (status != KL_OK) {
        return cli_fail("no picture of the profiles: %s", kl_status_text(status));
    }
    const struct kl_row *row = &central.row[s];
    const double eta_w = (double)row->eta_wheel_m;
    const double eta_r = (double)row->eta_rail_m;
    d->sign = s == KL_RIGHT ? 1.0 : -1.0;
    d->wheel_q_m = (double)row->arm_m + eta_w;
    d->rail_q_m = (double)row->arm_m + eta_r;
    d->rise_m = kl_profile_at(&d->rail, eta_r).zeta_m - kl_profile_at(&d->wheel, eta_w).zeta_m;
    return CLI_OK;
}

static double wheel_y(const struct drawing *d, double eta) {
    return d->sign * (d->wheel_q_m - eta) * MM;
}
static double wheel_z(const struct drawing *d, double eta) {
    return (LIFT_M - d->rise_m - kl_profile_at(&d->wheel, eta).zeta_m) * MM;
}
static double rail_y(const struct drawing *d, double eta) {
    return d->sign * (d->rail_q_m - eta) * MM;
}
static double rail_z(const struct drawing *d, double eta) {
    return -kl_profile_at(&d->rail, eta).zeta_m * MM;
}

static struct cli_plot_ray ray_of(const struct drawing *d, const struct kl_row *row) {
    const double eta_w = (double)row->eta_wheel_m;
    const double eta_r = (double)row->eta_rail_m;
    return (struct cli_plot_ray){wheel_y(d, eta_w), wheel_z(d, eta_w), rail_y(d, eta_r),
                                 rail_z(d, eta_r)};
}

/* The part of the profiles that matters: where the contacts are. */
static void frame(struct drawing *d, const struct cli_plot_ray *rays, size_t n) {
    double low = HUGE_VAL;
    double high = -HUGE_VAL;
    for (size_t i = 0; i < n; i++) {
        const double q[2] = {d->sign * rays[i].x0 / MM, d->sign * rays[i].x1 / MM};
        low = fmin(low, fmin(q[0], q[1]));
        high = fmax(high, fmax(q[0], q[1]));
    }
    d->low_q_m = low - AROUND_M;
    d->high_q_m = high + AROUND_M;
    /* of a rail that is not much wider than its contacts, all of it */
    const double rail[2] = {d->rail_q_m - d->rail.eta_max_m, d->rail_q_m - d->rail.eta_min_m};
    d->low_q_m = rail[0] > d->low_q_m - 0.03 ? fmin(d->low_q_m, rail[0] - 2e-3) : d->low_q_m;
    d->high_q_m = rail[1] < d->high_q_m + 0.03 ? fmax(d->high_q_m, rail[1] + 2e-3) : d->high_q_m;
}

static void plot_profile(struct cli_plot *plot, const struct drawing *d, bool wheel) {
    const struct kl_profile *profile = wheel ? &d->wheel : &d->rail;
    const double q0 = wheel ? d->wheel_q_m : d->rail_q_m;
    const double low = fmax(profile->eta_min_m, q0 - d->high_q_m);
    const double high = fmin(profile->eta_max_m, q0 - d->low_q_m);
    double x[PROFILE_STEPS + 1];
    double y[PROFILE_STEPS + 1];
    for (int i = 0; i <= PROFILE_STEPS; i++) {
        double eta = low + (high - low) * i / PROFILE_STEPS;
        x[i] = wheel ? wheel_y(d, eta) : rail_y(d, eta);
        y[i] = wheel ? wheel_z(d, eta) : rail_z(d, eta);
    }
    const struct cli_plot_style style = {.colour = CLI_PLOT_INK};
    cli_plot_line(plot, &style, x, y, PROFILE_STEPS + 1);
}

/* u_y in mm at the wheel's end of the lines, from the centre outwards, where there is room. */
static void number_rays(struct cli_plot *plot, enum cli_plot_colour colour,
                        const struct cli_plot_ray *rays, const double *u_y_m, size_t n) {
    double taken[MOST_RAYS];
    size_t n_taken = 0;
    for (size_t k = 0; k < n; k++) {
        size_t i = k % 2 == 0 ? n / 2 + k / 2 : n / 2 - (k + 1) / 2;
        bool room = true;
        for (size_t j = 0; j < n_taken; j++) {
            room = room && fabs(rays[i].x0 - taken[j]) >= LABEL_M * MM;
        }
        if (room) {
            char text[16];
            snprintf(text, sizeof text, "%g", u_y_m[i] * MM);
            cli_plot_text(plot, colour, rays[i].x0, rays[i].y0 + 1.6, text);
            taken[n_taken++] = rays[i].x0;
        }
    }
}

/* The rows on both sides of every jump of this side. */
static void plot_jump_rays(struct cli_plot *plot, const struct geometry_picture *p,
                           const struct drawing *d, const struct table *t, int s) {
    const double step = (double)p->pair->step_m;
    struct cli_plot_ray rays[2 * KL_MAX_JUMPS];
    size_t n = 0;
    for (size_t i = 0; i < t->n_jumps; i++) {
        const double row = floor(t->jump_m[i] / step);
        for (int k = 0; k < 2 && t->jump_side[i] == (enum kl_side)s; k++) {
            struct kl_posture posture;
            if (kl_pair_posture(p->pair, (row + k) * step, &posture) == KL_OK) {
                rays[n++] = ray_of(d, &posture.row[s]);
            }
        }
    }
    const struct cli_plot_style style = {
        .label = "before and after a jump", .colour = CLI_PLOT_FIFTH, .pen = CLI_PLOT_DASHED};
    if (n > 0) {
        cli_plot_rays(plot, &style, rays, n);
    }
}

static int plot_side(struct cli_plot *plot, const struct geometry_picture *p, const struct table *t,
                     int s) {
    struct cli_plot_ray rays[MOST_RAYS];
    double u_y_m[MOST_RAYS];
    struct drawing d;
    int status = prepare(p, s, &d);
    const double range = (double)p->pair->range_m;
    const double every = fmax(p->every_m, 2.0 * range / (MOST_RAYS - 2));
    const int half = (int)floor(range / every * (1.0 + 1e-12));
    size_t n = 0;
    for (int i = -half; i <= half && status == CLI_OK; i++) {
        struct kl_posture posture;
        u_y_m[n] = fmin(fmax(i * every, -range), range);
        if (kl_pair_posture(p->pair, u_y_m[n], &posture) == KL_OK) {
            rays[n++] = ray_of(&d, &posture.row[s]);
        }
    }
    if (status == CLI_OK && n > 0) {
        char title[80];
        frame(&d, rays, n);
        double end[2] = {d.sign * d.low_q_m * MM, d.sign * d.high_q_m * MM};
        snprintf(title, sizeof title, "%s wheel, lifted %g mm, and rail",
                 s == KL_RIGHT ? "Right" : "Left", LIFT_M * MM);
        cli_plot_panel(plot,
                       &(struct cli_plot_panel){.title = title,
                                                .x_label = "y from the middle of the track [mm]",
                                                .y_label = "height [mm]",
                                                .column = s == KL_RIGHT,
                                                .equal = true,
                                                .x_low = fmin(end[0], end[1]),
                                                .x_high = fmax(end[0], end[1])});
        char label[80];
        snprintf(label, sizeof label, "contact at u_y, every %g mm", every * MM);
        const struct cli_plot_style thin = {.label = label, .colour = side_colour[s], .thin = true};
        cli_plot_rays(plot, &thin, rays, n);
        plot_jump_rays(plot, p, &d, t, s);
        plot_profile(plot, &d, true);
        plot_profile(plot, &d, false);
        number_rays(plot, side_colour[s], rays, u_y_m, n);
    }
    free(d.memory);
    return status;
}

/* ---- the picture ---- */

static void describe(const struct geometry_picture *p, char *text, size_t size) {
    const struct kl_pair *pair = p->pair;
    int at = snprintf(text, size, "r0 %.3f mm,  contact points %.3f mm apart when central",
                      (double)pair->radius_m * MM, (double)pair->base_m * MM);
    const struct kl_rail_def *rail = &p->def->rail[KL_RIGHT];
    if (p->def->kind == KL_PAIR_PROFILES && rail->half_spacing_m == 0.0 && at > 0 &&
        (size_t)at < size) {
        at += snprintf(text + at, size - (size_t)at, ";  gauge %g mm at %g mm below the rail top",
                       rail->gauge_m * MM, rail->gauge_depth_m * MM);
    }
    if (p->def->kind == KL_PAIR_PROFILES && rail->cant_rad != 0.0 && at > 0 && (size_t)at < size) {
        snprintf(text + at, size - (size_t)at, ";  rails inclined 1:%.4g",
                 1.0 / tan(rail->cant_rad));
    }
}

int geometry_plot(const struct geometry_picture *picture, const char *path) {
    struct cli_plot plot;
    struct table table;
    char notes[256];
    describe(picture, notes, sizeof notes);
    if (tabulate(picture->pair, &table) != 0) {
        return cli_fail("out of memory");
    }
    int status = cli_plot_open(&plot, path, picture->title, notes);
    if (status == CLI_OK) {
        bool profiles = picture->def->kind == KL_PAIR_PROFILES;
        for (int s = 0; s < KL_SIDES && profiles && status == CLI_OK; s++) {
            status = plot_side(&plot, picture, &table, s);
        }
        plot_against_u_y(&plot, &table, profiles ? 1 : 0);
        status = cli_plot_close(&plot, status);
    }
    free(table.column[0]);
    return status;
}
