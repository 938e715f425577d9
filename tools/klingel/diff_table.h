/* diff_table.h - where two sequences of numbers part, signal by signal. Private to cmd_diff.c. */
#ifndef DIFF_TABLE_H
#define DIFF_TABLE_H

#include "cli.h"

struct diff_signal {
    const char *name;
    const char *unit; /* "": the name has it */
    double scale;     /* of one SI unit in it */
    bool differs;
    uint64_t first; /* row or step */
    double first_a;
    double first_b;
    uint64_t worst;
    double worst_a;
    double worst_b;
};

struct diff_table {
    const char *row; /* what is counted: "step" or "row" */
    double absolute; /* a and b are the same if |a - b| <= absolute + relative max(|a|, |b|) */
    double relative;
    uint64_t rows; /* compared */
    size_t n;
    struct diff_signal *signals;
};

/* Takes in one row of both, n values each. Without a tolerance the bits count. */
void diff_row(struct diff_table *t, uint64_t row, const double *a, const double *b);

/* True if something differs. */
bool diff_any(const struct diff_table *t);

/* Says the first difference, and then of every signal that differs the first and the largest. A row
 * is `step_s` long, 0: not known. */
void diff_print(const struct diff_table *t, double step_s, FILE *file);

/* Two CSV files. CLI_OK: the same; CLI_FAILED: they differ, or printed. */
int diff_csv(const char *a, const char *b, double absolute, double relative);

#endif
