/* creep_compare.h - every creep law held against solutions of CONTACT, and timed. Private to
 * cmd_creep.c. */
#ifndef CREEP_COMPARE_H
#define CREEP_COMPARE_H

#include "cli.h"
#include "kl_creep.h"

extern const char *const creep_law_name[KL_CREEP_LAWS];

/* Differences over all points: force over mu N, moment over mu N c. */
struct creep_difference {
    double force_mean;
    double force_max;
    double moment_mean;
    double moment_max;
    size_t n;
};

struct creep_points {
    double (*value)[7]; /* a/b, X, Y, Z, fx, fy, mz, see tests/reference/creep_check_points.csv */
    size_t n;
};

/* CLI_OK, or CLI_FAILED (printed). */
int creep_points_read(struct creep_points *points, const char *path);
void creep_points_free(struct creep_points *points);

/* One of the solutions of tests/reference/creep_forces.csv. */
struct creep_solution {
    double a_m;
    double b_m;
    double normal_N;
    double friction;
    double creepage[3]; /* gamma1, gamma2, omega3 in 1/m */
    double fx;          /* over mu N */
    double fy;
};
struct creep_solutions {
    struct creep_solution *value;
    size_t n;
};

/* Those of CONTACT's full method, not of its FASTSIM. CLI_OK, or CLI_FAILED (printed). */
int creep_solutions_read(struct creep_solutions *solutions, const char *path);
void creep_solutions_free(struct creep_solutions *solutions);

/* With |spin| of phi_n (see kl_creep.h: p) up to `spin_most`. */
struct creep_difference creep_difference(enum kl_creep_law law, const struct kl_creep_table *table,
                                         const struct creep_points *points, double spin_most);

/* Nanoseconds per contact: both wheels of an axle at once, the points taken as they come; the least
 * of several rounds. */
double creep_time(enum kl_creep_law law, const struct kl_creep_table *table,
                  const struct creep_points *points);

/* Does `n` contacts, for counting. Returns something that depends on all of them. */
double creep_repeat(enum kl_creep_law law, const struct kl_creep_table *table, uint64_t n);

#endif
