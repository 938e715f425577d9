/* conicity_report.h - what klingel conicity has found, and how it is told. */
#ifndef CONICITY_REPORT_H
#define CONICITY_REPORT_H

#include "conicity_source.h"

/* A motion at one amplitude, or none. */
struct conicity_row {
    double gauge_m; /* of a sweep */
    double amplitude_m;
    enum conicity_status status;
    struct conicity_motion motion; /* where the status is CONICITY_OK */
};

struct conicity_report {
    char what[320]; /* where delta_r comes from */
    const struct conicity_source *source;
    double rolling_line_m;     /* y_em */
    struct conicity_row *rows; /* against amplitude */
    size_t n_rows;
    double at_m;                 /* the amplitude that is singled out: 3 mm */
    struct conicity_row single;  /* there */
    struct conicity_row *gauges; /* at at_m against gauge; NULL: no sweep */
    size_t n_gauges;
};

void conicity_report_text(const struct conicity_report *r);
void conicity_report_csv(const struct conicity_report *r, FILE *file);
void conicity_report_json(const struct conicity_report *r, FILE *file);
/* delta_r itself, in the form that --table reads. */
void conicity_report_curve(const struct conicity_report *r, FILE *file);
/* CLI_OK or CLI_FAILED or CLI_USAGE (printed). */
int conicity_report_plot(const struct conicity_report *r, const char *path);

#endif
