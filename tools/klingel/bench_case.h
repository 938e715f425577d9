/* bench_case.h - what klingel bench measures, and how it tells of it. Private to the bench. */
#ifndef BENCH_CASE_H
#define BENCH_CASE_H

#include "bench_stage.h"
#include "bench_time.h"

enum { BENCH_STRAIGHT = 0, BENCH_TRACK_CASE = 1, BENCH_CASES = 2 };
extern const char *const bench_case_name[BENCH_CASES];

struct bench_case {
    struct cli_model m;
    struct bench_vehicle vehicle;
    struct bench_times times;
    double instructions; /* 0: not counted */
    bool has_stages;
    double stage[BENCH_STAGES];
    double *series[3];
};

/* One vehicle in both cases, on one machine. */
struct bench_of_model {
    const char *path;
    double speed_m_s;
    uint64_t steps;
    double calibration_ns;
    struct bench_case of[BENCH_CASES];
};

/* Opens a case: straight smooth track; or TRACK or, if none was given, irregularities, displaced at
 * the start. CLI_OK, or printed. */
int bench_case_open(struct bench_case *c, int which, const struct cli_target *given,
                    double speed_m_s);
void bench_case_close(struct bench_case *c);

/* All of one model as text; one row of a table of many, with its head; as a JSON object. */
void bench_print(const struct bench_of_model *b, FILE *file);
void bench_table_head(bool instructions, FILE *file);
void bench_table_row(const struct bench_of_model *b, FILE *file);
void bench_json(const struct bench_of_model *b, FILE *file);

#endif
