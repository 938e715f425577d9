/*
 * critical_report.h - the branches of a hunting vehicle's cycles, as table, CSV and picture. Private
 * to cmd_critical.c.
 */
#ifndef CRITICAL_REPORT_H
#define CRITICAL_REPORT_H

#include "cycle.h"
#include "modes_critical.h"

#define CRITICAL_MOST_POINTS 2000
#define CRITICAL_MOST_BRANCHES 10

struct critical_point {
    double speed_m_s;
    bool unstable;
    unsigned branch;
    struct cycle cycle;
};

/* Where a branch of cycles ends. */
struct critical_end {
    bool found;
    double rest_m_s;    /* here cycles decay */
    double hunts_m_s;   /* here they stay */
    struct cycle cycle; /* the last that stays */
};

/* What happens at the linear critical speed. */
enum critical_kind {
    CRITICAL_UNKNOWN,
    CRITICAL_HARD, /* subcritical Hopf bifurcation: the cycle it grows into exists below it too */
    CRITICAL_SOFT, /* supercritical: that cycle begins there with amplitude 0 */
    CRITICAL_UNBOUNDED /* it grows until a wheelset leaves its contact table */
};

struct critical_result {
    const char *name;     /* of the model */
    const char *wheelset; /* that is observed */
    double step_s;
    struct modes_scan linear;
    bool followed; /* the rest was looked for */
    double linear_Hz[MODES_MAX_CROSSINGS];
    double longest_s; /* in which it had to settle */
    double rest_m;    /* amplitudes below count as rest */
    double low_m_s;   /* the range of speeds */
    double high_m_s;
    unsigned n_branches;
    struct critical_end end[CRITICAL_MOST_BRANCHES];
    enum critical_kind kind;
    struct cycle grows; /* what a weak disturbance grows into */
    double grows_m_s;   /* ... at this speed; 0: it was not tried, or does not grow in time */
    int grows_into;     /* ... the branch; -1: none */
    size_t n;
    struct critical_point *point; /* CRITICAL_MOST_POINTS */
};

/* Whether it goes on: stable, irregular or not settled. */
bool critical_hunts(const struct cycle *cycle);

/* The branch whose end is lowest; NULL: none has an end. */
const struct critical_end *critical_lowest_end(const struct critical_result *result);

void critical_print(const struct critical_result *result);
void critical_csv(FILE *file, const struct critical_result *result);
int critical_plot(const char *path, const struct critical_result *result);

#endif
