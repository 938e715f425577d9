/*
 * ride_report.h - assessment quantities of a run: EN 14363, EN 12299, Sperling. Private to
 * cmd_ride.c.
 */
#ifndef RIDE_REPORT_H
#define RIDE_REPORT_H

#include "ride_signals.h"

#define RIDE_MAX_QUANTITIES (6 * RIDE_MAX_POINTS + 5 * KL_MAX_WHEELSETS)

/* One assessed signal. Percentiles are those of the section in which they are worst. */
struct ride_quantity {
    char name[KL_NAME_SIZE + 24];
    const char *what;   /* "sum of Y, 2 m" */
    const char *filter; /* "20 Hz, mean of 2 m" */
    const char *unit;
    double low;    /* 0.15 % */
    double middle; /* 50 % of the whole */
    double high;   /* 99.85 % */
    double rms;    /* of the whole */
    double limit;  /* of the absolute value; NAN: none is known here */
};

/* Comfort at one point. */
struct ride_comfort {
    double wz_lateral; /* Sperling */
    double wz_vertical;
    double rms_lateral; /* weighted after EN 12299: whole run, m/s2 */
    double rms_vertical;
    double c95_lateral; /* 95 % of the means of 5 s */
    double c95_vertical;
    double n_mv; /* 6 sqrt(c95_lateral^2 + c95_vertical^2): without the longitudinal part */
};

struct ride_result {
    struct ride_record *record;
    double section_m; /* 0: the whole run is one */
    size_t n_sections;
    size_t n;
    struct ride_quantity quantity[RIDE_MAX_QUANTITIES];
    struct ride_comfort comfort[RIDE_MAX_POINTS]; /* of floor points */
};

/* CLI_OK or CLI_FAILED (printed). */
int ride_assess(struct ride_result *result);

/* Sliding mean over a length of track, centred; in place. */
void ride_sliding_mean(double *x, size_t n, double samples, double *work);

void ride_print(const struct ride_result *result);
void ride_csv(FILE *file, const struct ride_result *result);
void ride_series(FILE *file, const struct ride_record *record);
int ride_plot(const char *path, const struct ride_result *result, const char *track);

#endif
