/*
 * critical_report.h - the branches of a hunting vehicle's cycles, as table, CSV and picture. Private
 * to cmd_critical.c.
 */
#ifndef CRITICAL_REPORT_H
#define CRITICAL_REPORT_H

#include "cycle.h"
#include "modes_critical.h"

#define CRITICAL_MOST_POINTS 2000

struct critical_point {
    double speed_m_s;
    bool unstable;
    struct cycle cycle;
};

struct critical_result {
    const char *name;     /* of the model */
    const char *wheelset; /* that is observed */
    double step_s;
    struct modes_scan linear;
    double linear_Hz[MODES_MAX_CROSSINGS];
    bool has_fold;
    double fold_low_m_s; /* here cycles decay */
    double fold_m_s;     /* here they stay */
    struct cycle fold;
    size_t n;
    struct critical_point *point; /* CRITICAL_MOST_POINTS */
};

void critical_print(const struct critical_result *result);
void critical_csv(FILE *file, const struct critical_result *result);
int critical_plot(const char *path, const struct critical_result *result);

#endif
