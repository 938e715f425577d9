/* conicity_report.c - text, CSV, JSON and picture of klingel conicity. */
#include "conicity_report.h"

#include <stdlib.h>
#include <string.h>

#include "cli_plot.h"

#define MM 1e3
#define NONLINEAR_LOW_M 2e-3 /* the amplitudes of the nonlinearity parameter */
#define NONLINEAR_HIGH_M 4e-3
#define CURVE_STEPS 200 /* of the conicity drawn */

static enum conicity_status motion_at(const struct conicity_report *r, double amplitude_m,
                                      struct conicity_motion *motion) {
    return conicity_at(&r->source->curve, amplitude_m, r->source->base_m, r->source->radius_m,
                       motion);
}

/* (tan gamma_e(4 mm) - tan gamma_e(2 mm)) / 2: whether conicity grows with amplitude. NaN: the
 * motions are not there. */
static double nonlinearity(const struct conicity_report *r) {
    struct conicity_motion low;
    struct conicity_motion high;
    bool both = motion_at(r, NONLINEAR_LOW_M, &low) == CONICITY_OK &&
                motion_at(r, NONLINEAR_HIGH_M, &high) == CONICITY_OK;
    return both ? 0.5 * (high.conicity - low.conicity) : (double)NAN;
}

/* ---- text ---- */

static void text_row(const struct conicity_row *row) {
    if (row->status == CONICITY_OK) {
        const struct conicity_motion *m = &row->motion;
        printf(" %12.4f %12.4f %12.3f %9.3f %9.3f\n", m->conicity, m->regression, m->wavelength_m,
               m->low_m * MM, m->high_m * MM);
    } else {
        printf("   %s\n", row->status == CONICITY_BEYOND ? "leaves the range of delta_r"
                                                         : "no closed motion of this amplitude");
    }
}

static void text_head(const char *first) {
    printf("\n%10s %12s %12s %12s %9s %9s\n%10s %12s %12s %12s %9s %9s\n", first, "tan gamma_e",
           "regression", "wavelength", "y_min", "y_max", "mm", "-", "-", "m", "mm", "mm");
}

void conicity_report_text(const struct conicity_report *r) {
    const struct conicity_curve *c = &r->source->curve;
    printf("equivalent conicity after EN 15302\n"
           "  delta_r     %s\n"
           "              y %g..%g mm, %zu points; r_right - r_left, y to the right\n"
           "  e           %.3f mm    distance of the contact points when central\n"
           "  r0          %.3f mm    rolling radius when central\n"
           "  y_em        %.4f mm    rolling line: delta_r = 0\n"
           "  tan gamma_e by integration of y'' + delta_r / (e r0) = 0 over one wavelength (Annex "
           "B):\n"
           "              (pi / wavelength)^2 2 e r0; amplitude = half the distance y_min..y_max\n"
           "  regression  half the slope of the least-squares line from y_min to y_max (Annex C)\n",
           r->what, c->y_m[0] * MM, c->y_m[c->n - 1] * MM, c->n, r->source->base_m * MM,
           r->source->radius_m * MM, r->rolling_line_m * MM);
    text_head("amplitude");
    for (size_t i = 0; i < r->n_rows; i++) {
        printf("%10.3f", r->rows[i].amplitude_m * MM);
        text_row(&r->rows[i]);
    }
    if (r->single.status == CONICITY_OK) {
        printf("\ntan gamma_e at %g mm: %.4f\n", r->at_m * MM, r->single.motion.conicity);
    } else {
        printf("\ntan gamma_e at %g mm: none, %s\n", r->at_m * MM,
               r->single.status == CONICITY_BEYOND ? "delta_r does not reach so far"
                                                   : "there is no closed motion");
    }
    double parameter = nonlinearity(r);
    if (isfinite(parameter)) {
        printf("nonlinearity, (tan gamma_e at 4 mm - at 2 mm) / 2: %.4f\n", parameter);
    }
    if (r->n_gauges > 0) {
        printf("\nat amplitude %g mm, against the gauge\n", r->at_m * MM);
        text_head("gauge");
    }
    for (size_t i = 0; i < r->n_gauges; i++) {
        printf("%10.3f", r->gauges[i].gauge_m * MM);
        text_row(&r->gauges[i]);
    }
}

/* ---- files ---- */

static void csv_lengths(const struct conicity_report *r, FILE *file) {
    fprintf(file, "# EN 15302, delta_r: %s\n", r->what);
    fprintf(file, "# e %.9g m, r0 %.9g m, rolling line %.9g m\n", r->source->base_m,
            r->source->radius_m, r->rolling_line_m);
}

/* Motions that do not exist are left out. */
void conicity_report_csv(const struct conicity_report *r, FILE *file) {
    const bool sweep = r->n_gauges > 0;
    const struct conicity_row *rows = sweep ? r->gauges : r->rows;
    const size_t n = sweep ? r->n_gauges : r->n_rows;
    csv_lengths(r, file);
    fprintf(file, "%samplitude_m,conicity,regression,wavelength_m,y_min_m,y_max_m\n",
            sweep ? "gauge_m," : "");
    for (size_t i = 0; i < n; i++) {
        const struct conicity_motion *m = &rows[i].motion;
        const double values[] = {rows[i].gauge_m, m->amplitude_m, m->conicity, m->regression,
                                 m->wavelength_m, m->low_m,       m->high_m};
        if (rows[i].status == CONICITY_OK) {
            cli_csv_row(file, sweep ? values : values + 1, sweep ? 7 : 6);
        }
    }
}

static void json_rows(FILE *file, const char *key, const struct conicity_row *rows, size_t n,
                      bool gauge) {
    fprintf(file, ",\n  \"%s\": [", key);
    const char *comma = "";
    for (size_t i = 0; i < n; i++) {
        const struct conicity_motion *m = &rows[i].motion;
        if (rows[i].status != CONICITY_OK) {
            continue;
        }
        fprintf(file, "%s\n    {", comma);
        if (gauge) {
            fprintf(file, "\"gauge_m\": %.9g, ", rows[i].gauge_m);
        }
        fprintf(file,
                "\"amplitude_m\": %.9g, \"conicity\": %.9g, \"regression\": %.9g, "
                "\"wavelength_m\": %.9g, \"y_min_m\": %.9g, \"y_max_m\": %.9g}",
                m->amplitude_m, m->conicity, m->regression, m->wavelength_m, m->low_m, m->high_m);
        comma = ",";
    }
    fprintf(file, "%s]", n > 0 ? "\n  " : "");
}

void conicity_report_json(const struct conicity_report *r, FILE *file) {
    fprintf(file, "{\n  \"method\": \"EN 15302\", \"delta_r\": \"");
    for (const char *at = r->what; *at != '\0'; at++) {
        bool plain = (unsigned char)*at >= 0x20 && *at != '"' && *at != '\\';
        fprintf(file, plain ? "%c" : "\\u%04x", (unsigned char)*at);
    }
    fprintf(file,
            "\",\n  \"base_m\": %.9g, \"radius_m\": %.9g, \"rolling_line_m\": %.9g, "
            "\"largest_amplitude_m\": %.9g",
            r->source->base_m, r->source->radius_m, r->rolling_line_m,
            conicity_largest(&r->source->curve));
    if (isfinite(nonlinearity(r))) {
        fprintf(file, ", \"nonlinearity\": %.9g", nonlinearity(r));
    }
    json_rows(file, "motions", r->rows, r->n_rows, false);
    json_rows(file, "gauges", r->gauges, r->n_gauges, true);
    fprintf(file, "\n}\n");
}

void conicity_report_curve(const struct conicity_report *r, FILE *file) {
    const struct conicity_curve *c = &r->source->curve;
    csv_lengths(r, file);
    fprintf(file, "y_m,delta_r_m\n");
    for (size_t i = 0; i < c->n; i++) {
        const double values[2] = {c->y_m[i], c->delta_r_m[i]};
        cli_csv_row(file, values, 2);
    }
}

/* ---- picture ---- */

static void plot_conicity(const struct conicity_report *r, struct cli_plot *plot) {
    double amplitude[CURVE_STEPS + 1];
    double conicity[CURVE_STEPS + 1];
    double regression[CURVE_STEPS + 1];
    const double low = r->rows[0].amplitude_m;
    const double high = r->rows[r->n_rows - 1].amplitude_m;
    for (int i = 0; i <= CURVE_STEPS; i++) {
        struct conicity_motion m;
        double a = low + (high - low) * i / CURVE_STEPS;
        bool there = motion_at(r, a, &m) == CONICITY_OK;
        amplitude[i] = a * MM;
        conicity[i] = there ? m.conicity : (double)NAN;
        regression[i] = there ? m.regression : (double)NAN;
    }
    cli_plot_panel(plot, &(struct cli_plot_panel){.title = "Equivalent conicity",
                                                  .x_label = "amplitude [mm]",
                                                  .y_label = "tan γe [–]"});
    const struct cli_plot_style zero = {.colour = CLI_PLOT_QUIET, .thin = true};
    const struct cli_plot_style line = {.label = "integration (Annex B)"};
    const struct cli_plot_style dashed = {
        .label = "linear regression (Annex C)", .colour = CLI_PLOT_SECOND, .pen = CLI_PLOT_DASHED};
    cli_plot_mark(plot, &zero, 'y', 0.0, NULL);
    cli_plot_line(plot, &line, amplitude, conicity, CURVE_STEPS + 1);
    cli_plot_line(plot, &dashed, amplitude, regression, CURVE_STEPS + 1);
    if (r->single.status == CONICITY_OK) {
        char text[48];
        const double x[1] = {r->at_m * MM};
        const double y[1] = {r->single.motion.conicity};
        snprintf(text, sizeof text, "%.3f at %g mm", y[0], x[0]);
        const struct cli_plot_style mark = {.colour = CLI_PLOT_QUIET, .pen = CLI_PLOT_DOTTED};
        const struct cli_plot_style dot = {.label = text, .pen = CLI_PLOT_POINTS};
        cli_plot_mark(plot, &mark, 'x', x[0], NULL);
        cli_plot_line(plot, &dot, x, y, 1);
    }
}

static int plot_curve(const struct conicity_report *r, struct cli_plot *plot) {
    const struct conicity_curve *c = &r->source->curve;
    double *mm = malloc(2 * c->n * sizeof *mm);
    if (mm == NULL) {
        return cli_fail("out of memory");
    }
    for (size_t i = 0; i < c->n; i++) {
        mm[i] = c->y_m[i] * MM;
        mm[c->n + i] = c->delta_r_m[i] * MM;
    }
    cli_plot_panel(plot, &(struct cli_plot_panel){.title = "Rolling-radius difference",
                                                  .x_label = "lateral displacement y [mm]",
                                                  .y_label = "Δr = r right – r left [mm]",
                                                  .column = 1});
    const struct cli_plot_style quiet = {.colour = CLI_PLOT_QUIET, .pen = CLI_PLOT_DOTTED};
    cli_plot_mark(plot, &quiet, 'y', 0.0, NULL);
    cli_plot_mark(plot, &quiet, 'x', r->rolling_line_m * MM,
                  fabs(r->rolling_line_m) > 1e-5 ? "rolling line" : NULL);
    const struct cli_plot_style line = {.label = NULL};
    cli_plot_line(plot, &line, mm, mm + c->n, c->n);
    if (r->single.status == CONICITY_OK) {
        char label[64];
        const struct conicity_motion *m = &r->single.motion;
        const double x[2] = {m->low_m * MM, m->high_m * MM};
        const double middle = 0.5 * (x[0] + x[1]);
        /* the cone that runs with the same wavelength */
        const double y[2] = {2.0 * m->conicity * (x[0] - middle),
                             2.0 * m->conicity * (x[1] - middle)};
        snprintf(label, sizeof label, "equivalent cone, %g mm", r->at_m * MM);
        const struct cli_plot_style cone = {
            .label = label, .colour = CLI_PLOT_SECOND, .pen = CLI_PLOT_DASHED};
        cli_plot_line(plot, &cone, x, y, 2);
    }
    free(mm);
    return CLI_OK;
}

static int plot_gauges(const struct conicity_report *r, struct cli_plot *plot) {
    double *values = malloc(2 * r->n_gauges * sizeof *values);
    char title[80];
    if (values == NULL) {
        return cli_fail("out of memory");
    }
    for (size_t i = 0; i < r->n_gauges; i++) {
        values[i] = r->gauges[i].gauge_m * MM;
        values[r->n_gauges + i] =
            r->gauges[i].status == CONICITY_OK ? r->gauges[i].motion.conicity : (double)NAN;
    }
    snprintf(title, sizeof title, "Equivalent conicity at %g mm against the gauge", r->at_m * MM);
    cli_plot_panel(plot, &(struct cli_plot_panel){.title = title,
                                                  .x_label = "gauge [mm]",
                                                  .y_label = "tan γe [–]",
                                                  .row = 1,
                                                  .columns = 2});
    const struct cli_plot_style line = {.label = NULL};
    const struct cli_plot_style zero = {.colour = CLI_PLOT_QUIET, .thin = true};
    cli_plot_mark(plot, &zero, 'y', 0.0, NULL);
    const struct cli_plot_style dots = {.pen = CLI_PLOT_POINTS};
    cli_plot_line(plot, &line, values, values + r->n_gauges, r->n_gauges);
    cli_plot_line(plot, &dots, values, values + r->n_gauges, r->n_gauges);
    free(values);
    return CLI_OK;
}

int conicity_report_plot(const struct conicity_report *r, const char *path) {
    struct cli_plot plot;
    char notes[640];
    snprintf(notes, sizeof notes, "Δr: %s;  e %.1f mm,  r0 %.1f mm,  rolling line at %.2f mm",
             r->what, r->source->base_m * MM, r->source->radius_m * MM, r->rolling_line_m * MM);
    int status = cli_plot_open(&plot, path, "Equivalent conicity after EN 15302", notes);
    if (status != CLI_OK) {
        return status;
    }
    plot_conicity(r, &plot);
    status = plot_curve(r, &plot);
    status = status == CLI_OK && r->n_gauges > 0 ? plot_gauges(r, &plot) : status;
    return cli_plot_close(&plot, status);
}
