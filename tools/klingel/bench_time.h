/* bench_time.h - how long a step takes. Private to cmd_bench.c. */
#ifndef BENCH_TIME_H
#define BENCH_TIME_H

#include "cli.h"

#define BENCH_BATCH 100u

/* Nanoseconds per step. */
struct bench_times {
    uint64_t steps;
    double min; /* these three over batches of BENCH_BATCH steps */
    double median;
    double p90;
    double single_median; /* these over single steps, the clock's own time taken off */
    double p99;
    double p999;
    double max;
    double clock_ns; /* what was taken off */
};

/* A vehicle that is stepped at constant speed and put back to its start before the track ends. */
struct bench_vehicle {
    const struct kl_model *model;
    double speed_m_s;
    double start_m;
    double end_m; /* HUGE_VAL: no end */
    bool displaced;
};

/* Measures `steps` steps in batches and as many singly. CLI_OK or CLI_FAILED (printed). */
int bench_measure(const struct bench_vehicle *vehicle, uint64_t steps, struct bench_times *times);

/* Does `steps` steps and nothing else. Returns the hash of the state, so that they are needed. */
uint64_t bench_steps(const struct bench_vehicle *vehicle, uint64_t steps);

/* Nanoseconds of the calibration kernel: 1000 dependent multiply-adds of doubles, the median. */
double bench_calibrate(void);

#endif
