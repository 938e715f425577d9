/* ride_report.c - table, CSV and picture of a ride. */
#include "ride_report.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli_plot.h"
#include "ride_filter.h"
#include "ride_spectrum.h"

#define WINDOW_S 8.0
#define DRAWN_TO_HZ 30.0
#define MOST_DRAWN 4000u /* points of a line */

static double scale_of(const struct ride_quantity *q) {
    return strcmp(q->unit, "kN") == 0 ? 1e-3 : 1.0;
}

void ride_print(const struct ride_result *result) {
    const struct ride_record *r = result->record;
    printf("%s at %.2f m/s (%.1f km/h), s = %.1f to %.1f m in %zu section%s\n", r->model->name,
           r->speed_m_s, 3.6 * r->speed_m_s, r->s_m[r->first], r->s_m[r->n - 1], result->n_sections,
           result->n_sections == 1 ? "" : "s; percentiles of the worst");
    printf("EN 14363\n  %-20s %-11s %-19s %9s %9s %9s %9s  %s\n", "where", "quantity", "filter",
           "0.15 %", "50 %", "99.85 %", "rms", "limit");
    for (size_t i = 0; i < result->n; i++) {
        const struct ride_quantity *q = &result->quantity[i];
        const double k = scale_of(q);
        printf("  %-20s %-11s %-19s %9.4g %9.4g %9.4g %9.4g  ", q->name, q->what, q->filter,
               k * q->low, k * q->middle, k * q->high, k * q->rms);
        if (isnan(q->limit)) {
            printf("%s\n", q->unit);
        } else {
            const bool over = fmax(fabs(q->low), fabs(q->high)) > q->limit;
            printf("%.4g %s%s\n", k * q->limit, q->unit, over ? "  EXCEEDED" : "");
        }
    }
    printf("comfort\n  %-20s %11s %11s %14s %14s %8s\n", "where", "Wz lateral", "Wz vertical",
           "W_d rms m/s2", "W_b rms m/s2", "N_MV");
    for (uint32_t p = 0; p < r->n_points; p++) {
        const struct ride_comfort *c = &result->comfort[p];
        if (r->point[p].floor) {
            printf("  %-20s %11.3f %11.3f %14.4f %14.4f ", r->point[p].name, c->wz_lateral,
                   c->wz_vertical, c->rms_lateral, c->rms_vertical);
            if (isnan(c->n_mv)) { /* less than 5 s */
                printf("%8s\n", "-");
            } else {
                printf("%8.3f\n", c->n_mv);
            }
        }
    }
    if ((r->faults & (uint32_t)KL_FAULT_WHEEL_LIFT) != 0) {
        printf("a wheel carried no load at times\n");
    }
}

void ride_csv(FILE *file, const struct ride_result *result) {
    fprintf(file, "where,quantity,filter,unit,p0_15,p50,p99_85,rms,limit\n");
    for (size_t i = 0; i < result->n; i++) {
        const struct ride_quantity *q = &result->quantity[i];
        fprintf(file, "%s,%s,\"%s\",%s,%.9g,%.9g,%.9g,%.9g,", q->name, q->what, q->filter,
                strcmp(q->unit, "kN") == 0 ? "N" : q->unit, q->low, q->middle, q->high, q->rms);
        if (!isnan(q->limit)) {
            fprintf(file, "%.9g", q->limit);
        }
        fputc('\n', file);
    }
    for (uint32_t p = 0; p < result->record->n_points; p++) {
        const struct ride_comfort *c = &result->comfort[p];
        const char *name = result->record->point[p].name;
        if (result->record->point[p].floor) {
            fprintf(file, "%s,Wz lateral,Sperling,-,,,,%.9g,\n", name, c->wz_lateral);
            fprintf(file, "%s,Wz vertical,Sperling,-,,,,%.9g,\n", name, c->wz_vertical);
            fprintf(file, "%s,y'' comfort,W_d,m/s2,,,,%.9g,\n", name, c->rms_lateral);
            fprintf(file, "%s,z'' comfort,W_b,m/s2,,,,%.9g,\n", name, c->rms_vertical);
        }
    }
}

void ride_series(FILE *file, const struct ride_record *r) {
    fprintf(file, "s_m");
    for (uint32_t p = 0; p < r->n_points; p++) {
        fprintf(file, ",%s lateral_m_s2,%s vertical_m_s2", r->point[p].name, r->point[p].name);
    }
    for (uint32_t w = 0; w < r->model->n_wheelsets; w++) {
        const char *name = r->model->wheelsets[w].name;
        fprintf(file, ",%s sum_y_N,%s right_y_N,%s right_q_N,%s left_y_N,%s left_q_N", name, name,
                name, name, name);
    }
    fputc('\n', file);
    for (size_t i = 0; i < r->n; i++) {
        fprintf(file, "%.9g", r->s_m[i]);
        for (uint32_t p = 0; p < r->n_points; p++) {
            fprintf(file, ",%.7g,%.7g", r->lateral[p][i], r->vertical[p][i]);
        }
        for (uint32_t w = 0; w < r->model->n_wheelsets; w++) {
            fprintf(file, ",%.7g", r->sum_y_N[w][i]);
            for (int s = 0; s < KL_SIDES; s++) {
                fprintf(file, ",%.7g,%.7g", r->y_N[w][s][i], r->q_N[w][s][i]);
            }
        }
        fputc('\n', file);
    }
}

/* ---- the picture ---- */

struct picture {
    struct cli_plot plot;
    const struct ride_result *result;
    double *x;
    double *y;
};

/* A series over the distance, thinned. */
static void draw_series(struct picture *p, const double *values, double scale,
                        const struct cli_plot_style *style) {
    const struct ride_record *r = p->result->record;
    const size_t every = (r->n - r->first) / MOST_DRAWN + 1;
    size_t n = 0;
    for (size_t i = r->first; i < r->n; i += every) {
        p->x[n] = r->s_m[i];
        p->y[n++] = scale * values[i];
    }
    cli_plot_line(&p->plot, style, p->x, p->y, n);
}

static void draw_accelerations(struct picture *p, bool vertical) {
    const struct ride_record *r = p->result->record;
    double *filtered = malloc(r->n * sizeof(double));
    uint32_t drawn = 0;
    for (uint32_t i = 0; i < r->n_points && filtered != NULL; i++) {
        const double *from = vertical ? r->vertical[i] : r->lateral[i];
        const struct cli_plot_style style = {.label = vertical ? NULL : r->point[i].name,
                                             .colour = (enum cli_plot_colour)(drawn % 6u),
                                             .thin = true};
        struct ride_filter f;
        if (!r->point[i].floor) {
            continue;
        }
        ride_band(&f, 0.4, 10.0, r->rate_Hz);
        for (size_t k = 0; k < r->n; k++) {
            filtered[k] = ride_filter_step(&f, from[k] - from[0]);
        }
        draw_series(p, filtered, 1.0, &style);
        drawn++;
    }
    free(filtered);
}

static void draw_spectra(struct picture *p, bool vertical) {
    const struct ride_record *r = p->result->record;
    uint32_t drawn = 0;
    for (uint32_t i = 0; i < r->n_points; i++) {
        const struct cli_plot_style style = {.colour = (enum cli_plot_colour)(drawn % 6u),
                                             .thin = true};
        const double *x = vertical ? r->vertical[i] : r->lateral[i];
        struct ride_spectrum s;
        size_t n = 0;
        if (!r->point[i].floor ||
            !ride_spectrum_make(&s, x + r->first, r->n - r->first, r->rate_Hz, WINDOW_S)) {
            continue;
        }
        for (size_t k = 1; k < s.n && (double)k * s.width_Hz <= DRAWN_TO_HZ; k++) {
            p->x[n] = (double)k * s.width_Hz;
            p->y[n++] = s.density[k];
        }
        cli_plot_line(&p->plot, &style, p->x, p->y, n);
        ride_spectrum_free(&s);
        drawn++;
    }
}

static void draw_sums(struct picture *p) {
    const struct ride_record *r = p->result->record;
    for (uint32_t w = 0; w < r->model->n_wheelsets; w++) {
        const struct cli_plot_style style = {.label = r->model->wheelsets[w].name,
                                             .colour = (enum cli_plot_colour)(w % 6u),
                                             .thin = true};
        draw_series(p, r->sum_y_N[w], 1e-3, &style);
    }
}

static void draw_loads(struct picture *p) {
    const struct ride_record *r = p->result->record;
    for (uint32_t w = 0; w < r->model->n_wheelsets; w++) {
        for (int s = 0; s < KL_SIDES; s++) {
            const struct cli_plot_style style = {.colour = (enum cli_plot_colour)(w % 6u),
                                                 .pen = s == KL_RIGHT ? CLI_PLOT_SOLID
                                                                      : CLI_PLOT_DOTTED,
                                                 .thin = true};
            draw_series(p, r->q_N[w][s], 1e-3, &style);
        }
    }
}

static void draw_panels(struct picture *p) {
    static const char *const direction[] = {"lateral", "vertical"};
    char text[96];
    for (int v = 0; v < 2; v++) {
        snprintf(text, sizeof text, "Floor, %s, 0.4 to 10 Hz", direction[v]);
        cli_plot_panel(&p->plot, &(struct cli_plot_panel){.title = text,
                                                          .x_label = "distance [m]",
                                                          .y_label = "acceleration [m/s2]",
                                                          .row = v,
                                                          .columns = 2});
        draw_accelerations(p, v == 1);
        snprintf(text, sizeof text, "Spectrum, %s", direction[v]);
        cli_plot_panel(&p->plot, &(struct cli_plot_panel){.title = text,
                                                          .x_label = "frequency [Hz]",
                                                          .y_label = "density [(m/s2)2/Hz]",
                                                          .row = v,
                                                          .column = 2,
                                                          .x_log = true,
                                                          .y_log = true});
        draw_spectra(p, v == 1);
    }
    cli_plot_panel(&p->plot, &(struct cli_plot_panel){.title = "Track shifting force, mean of 2 m",
                                                      .x_label = "distance [m]",
                                                      .y_label = "sum of Y [kN]",
                                                      .row = 2,
                                                      .columns = 2});
    draw_sums(p);
    cli_plot_panel(&p->plot,
                   &(struct cli_plot_panel){.title = "Wheel loads: right, left dotted; 20 Hz",
                                            .x_label = "distance [m]",
                                            .y_label = "Q [kN]",
                                            .row = 2,
                                            .column = 2});
    draw_loads(p);
}

int ride_plot(const char *path, const struct ride_result *result, const char *track) {
    struct picture p = {.result = result};
    const struct ride_record *r = result->record;
    char title[128];
    char notes[160];
    snprintf(title, sizeof title, "%s: ride on %s", r->model->name, track);
    snprintf(notes, sizeof notes, "%.1f m/s (%.0f km/h)", r->speed_m_s, 3.6 * r->speed_m_s);
    p.x = malloc((r->n + 1) * sizeof(double));
    p.y = malloc((r->n + 1) * sizeof(double));
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
