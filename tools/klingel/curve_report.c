/* curve_report.c - what an engineer wants to know of a curve. */
#include "curve_report.h"

#include <math.h>
#include <stdlib.h>

#include "cli_plot.h"

#define Y_Q_LIMIT 0.8 /* EN 14363, in curves of 250 m and more */

double curve_outward_N(const struct kl_wheelset_output *o, int side) {
    return side == KL_RIGHT ? (double)o->y_N[side] : -(double)o->y_N[side];
}

double curve_attack_rad(const struct curve_result *r, uint32_t w) {
    const double yaw = (double)r->steady.output.wheelset[w].yaw_rad;
    return r->at.curvature_1_m >= 0.0 ? -yaw : yaw;
}

double curve_limit_N(const struct kl_model *model, uint32_t w) {
    return 10e3 + (double)model->wheelsets[w].static_load_N / 3.0;
}

/* ---- text ---- */

static void print_balance(const struct curve_result *r) {
    const double weight = r->weight_N > 0.0 ? r->weight_N : 1.0;
    printf(
        "  sum of all Y %.3f kN, needed %.3f kN: off by %.2e of the weight; sum of all Q %.3f kN "
        "off by %.2e\n",
        1e-3 * (r->aside_N + r->lateral_N), 1e-3 * r->aside_N, r->lateral_N / weight,
        1e-3 * (r->weight_N + r->vertical_N), r->vertical_N / weight);
    if (r->grounded) {
        printf("  elements to the ground carry a part of that\n");
    }
    printf("  largest rate that is left: %.1e (m/s2, rad/s2)%s\n", r->steady.residual,
           r->way == CURVE_SIMULATED ? ", settled by simulation" : "");
    if (r->unstable) {
        printf("  UNSTABLE: a vehicle that is disturbed there does not come back; it hunts\n");
    }
}

static void print_wheel(const struct kl_wheelset_output *o, int side) {
    const double q = (double)o->q_N[side];
    const double outward = curve_outward_N(o, side);
    printf("    %-6s %9.3f %9.3f %8.3f %9.3f %9.3f %8.2f %9.3f\n",
           side == KL_RIGHT ? "right" : "left", 1e-3 * q, 1e-3 * outward,
           q > 0.0 ? outward / q : 0.0, 1e-3 * (double)o->tread.t1_N[side],
           1e-3 * (double)o->tread.t2_N[side], 1e3 * (double)o->tread.delta_rad[side],
           1e-3 * (double)o->flange.normal_N[side]);
}

void curve_print(const struct kl_model *model, const struct curve_result *r) {
    printf("R = %g m (%s-hand), V = %.3f m/s (%.1f km/h), cant %.1f mm, cant deficiency %.1f mm\n",
           fabs(r->at.radius_m), r->at.radius_m >= 0.0 ? "right" : "left", r->at.speed_m_s,
           3.6 * r->at.speed_m_s, 1e3 * r->at.cant_m, 1e3 * r->at.deficiency_m);
    if (r->way == CURVE_NONE) {
        printf("  no steady running: %s\n", r->why);
        return;
    }
    print_balance(r);
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        const struct kl_body_output *o = &r->steady.output.body[b];
        printf("  %-12s y %8.3f mm  roll %8.3f mrad  yaw %8.3f mrad\n", model->bodies[b].name,
               1e3 * (double)o->position[KL_Y], 1e3 * (double)o->position[KL_ROLL],
               1e3 * (double)o->position[KL_YAW]);
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct kl_wheelset_output *o = &r->steady.output.wheelset[w];
        printf("  %-12s y %8.3f mm  angle of attack %7.3f mrad  sum of Y %8.3f kN (limit %.1f)\n",
               model->wheelsets[w].name, 1e3 * (double)o->y_m, 1e3 * curve_attack_rad(r, w),
               1e-3 * (double)o->force_y_N, 1e-3 * curve_limit_N(model, w));
        printf("    %-6s %9s %9s %8s %9s %9s %8s %9s\n", "wheel", "Q kN", "Y kN", "Y/Q", "T1 kN",
               "T2 kN", "mrad", "flange kN");
        for (int s = 0; s < KL_SIDES; s++) {
            print_wheel(o, s);
        }
    }
}

/* ---- CSV ---- */

void curve_csv_header(FILE *file) {
    static const char *const side[] = {"right", "left"};
    fprintf(file, "radius_m,speed_m_s,cant_m,deficiency_m,wheelset,found,y_m,yaw_rad,attack_rad,"
                  "sum_y_N,residual,lateral_N,vertical_N");
    for (int s = 0; s < KL_SIDES; s++) {
        fprintf(file,
                ",%s_q_N,%s_y_outward_N,%s_y_q,%s_t1_N,%s_t2_N,%s_delta_rad,%s_flange_normal_N,"
                "%s_gamma1,%s_gamma2",
                side[s], side[s], side[s], side[s], side[s], side[s], side[s], side[s], side[s]);
    }
    fputc('\n', file);
}

void curve_csv(FILE *file, const struct kl_model *model, const struct curve_result *r) {
    static const char *const way[] = {"newton", "simulated", "none"};
    for (uint32_t w = 0; w < model->n_wheelsets && r->way != CURVE_NONE; w++) {
        const struct kl_wheelset_output *o = &r->steady.output.wheelset[w];
        fprintf(file, "%.12g,%.12g,%.12g,%.12g,%s,%s,%.12g,%.12g,%.12g,%.12g,%.6g,%.6g,%.6g",
                r->at.radius_m, r->at.speed_m_s, r->at.cant_m, r->at.deficiency_m,
                model->wheelsets[w].name, way[r->way], (double)o->y_m, (double)o->yaw_rad,
                curve_attack_rad(r, w), (double)o->force_y_N, r->steady.residual, r->lateral_N,
                r->vertical_N);
        for (int s = 0; s < KL_SIDES; s++) {
            const double q = (double)o->q_N[s];
            const double outward = curve_outward_N(o, s);
            fprintf(file, ",%.12g,%.12g,%.12g,%.12g,%.12g,%.12g,%.12g,%.12g,%.12g", q, outward,
                    q > 0.0 ? outward / q : 0.0, (double)o->tread.t1_N[s], (double)o->tread.t2_N[s],
                    (double)o->tread.delta_rad[s], (double)o->flange.normal_N[s],
                    (double)o->tread.gamma1[s], (double)o->tread.gamma2[s]);
        }
        fputc('\n', file);
    }
}

/* ---- the picture ---- */

enum quantity { OFFSET, ATTACK, TRACK_SHIFT, RATIO, LOAD_OUTER, LOAD_INNER, CREEP };

static int outer_side(const struct curve_result *r) {
    return r->at.curvature_1_m >= 0.0 ? KL_LEFT : KL_RIGHT;
}

/* Lateral things count towards the outer rail. */
static double value(const struct curve_result *r, uint32_t w, enum quantity quantity) {
    const struct kl_wheelset_output *o = &r->steady.output.wheelset[w];
    const int outer = outer_side(r);
    const int inner = outer == KL_RIGHT ? KL_LEFT : KL_RIGHT;
    const double outwards = outer == KL_RIGHT ? 1.0 : -1.0;
    if (r->way == CURVE_NONE) {
        return (double)NAN;
    }
    switch (quantity) {
    case OFFSET:
        return 1e3 * outwards * (double)o->y_m;
    case ATTACK:
        return 1e3 * curve_attack_rad(r, w);
    case TRACK_SHIFT:
        return 1e-3 * outwards * (double)o->force_y_N;
    case RATIO:
        return curve_outward_N(o, outer) / fmax((double)o->q_N[outer], 1.0);
    case LOAD_OUTER:
        return 1e-3 * (double)o->q_N[outer];
    case LOAD_INNER:
        return 1e-3 * (double)o->q_N[inner];
    case CREEP:
        break;
    }
    return 1e-3 * (double)o->tread.t1_N[outer];
}

struct picture {
    struct cli_plot plot;
    const struct kl_model *model;
    const struct curve_result *results;
    size_t n;
    double *x;
    double *y;
};

static void draw(struct picture *p, enum quantity quantity, enum cli_plot_pen pen, bool legend) {
    for (uint32_t w = 0; w < p->model->n_wheelsets; w++) {
        for (size_t i = 0; i < p->n; i++) {
            p->x[i] = fabs(p->results[i].at.radius_m);
            p->y[i] = value(&p->results[i], w, quantity);
        }
        const struct cli_plot_style style = {.label = legend ? p->model->wheelsets[w].name : NULL,
                                             .colour = (enum cli_plot_colour)(w % 6u),
                                             .pen = pen,
                                             .thin = pen == CLI_PLOT_DASHED};
        const struct cli_plot_style dot = {
            .colour = style.colour, .pen = CLI_PLOT_POINTS, .thin = true};
        cli_plot_line(&p->plot, &style, p->x, p->y, p->n);
        cli_plot_line(&p->plot, &dot, p->x, p->y, p->n);
    }
}

static void draw_panels(struct picture *p) {
    static const struct {
        const char *title;
        const char *label;
        enum quantity quantity;
    } panel[] = {
        {"Offset of the wheelsets, outwards", "y [mm]", OFFSET},
        {"Angle of attack", "angle [mrad]", ATTACK},
        {"Longitudinal creep force, outer tread", "T1 [kN]", CREEP},
        {"Track shifting force, outwards", "sum of Y [kN]", TRACK_SHIFT},
        {"Outer wheel: Y/Q", "Y/Q [-]", RATIO},
        {"Wheel loads: outer, inner dashed", "Q [kN]", LOAD_OUTER},
    };
    const struct cli_plot_style limit = {.colour = CLI_PLOT_QUIET, .pen = CLI_PLOT_DOTTED};
    for (int i = 0; i < 6; i++) {
        cli_plot_panel(&p->plot, &(struct cli_plot_panel){.title = panel[i].title,
                                                          .x_label = "radius [m]",
                                                          .y_label = panel[i].label,
                                                          .row = i / 3,
                                                          .column = i % 3});
        draw(p, panel[i].quantity, CLI_PLOT_SOLID, i == 0);
        if (panel[i].quantity == LOAD_OUTER) {
            draw(p, LOAD_INNER, CLI_PLOT_DASHED, false);
        } else if (panel[i].quantity == RATIO) {
            cli_plot_mark(&p->plot, &limit, 'y', Y_Q_LIMIT, "limit of EN 14363");
        } else if (panel[i].quantity == TRACK_SHIFT) {
            cli_plot_mark(&p->plot, &limit, 'y', 1e-3 * curve_limit_N(p->model, 0),
                          "limit of EN 14363");
        }
    }
}

int curve_plot(const char *path, const struct kl_model *model, const struct curve_result *results,
               size_t n) {
    struct picture p = {.model = model, .results = results, .n = n};
    char title[96];
    char notes[160];
    const struct curve_case *first = &results[0].at;
    p.x = malloc((n + 1) * sizeof(double));
    p.y = malloc((n + 1) * sizeof(double));
    snprintf(title, sizeof title, "%s: steady running in curves", model->name);
    snprintf(notes, sizeof notes,
             "%s-hand curves; at the first one: %.1f m/s, cant %.0f mm, cant deficiency %.0f mm",
             first->radius_m >= 0.0 ? "right" : "left", first->speed_m_s, 1e3 * first->cant_m,
             1e3 * first->deficiency_m);
    int status = p.x != NULL && p.y != NULL ? cli_plot_open(&p.plot, path, title, notes)
                                            : cli_fail("out of memory");
    if (status == CLI_OK) {
        draw_panels(&p);
        status = cli_plot_close(&p.plot, status);
    }
    free(p.x);
    free(p.y);
    return status;
}
