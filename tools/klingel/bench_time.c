/* bench_time.c - timing of steps, and of a kernel that tells how fast the machine is. */
#include "bench_time.h"

#include <math.h>
#include <stdlib.h>
#include <time.h>

#define WARM_UP 2000u
#define CALIBRATIONS 2001u
#define CLOCK_READINGS 10001u

struct bench_run {
    const struct bench_vehicle *vehicle;
    struct kl_state start;
    struct kl_state state;
    struct kl_input input;
    struct kl_output output;
};

static int64_t now_ns(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

static int by_value(const void *a, const void *b) {
    double x = *(const double *)a;
    double y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The value that a share of the sorted ones does not exceed. */
static double quantile(const double *sorted, size_t n, double share) {
    size_t i = (size_t)(share * (double)(n - 1) + 0.5);
    return sorted[i];
}

static void begin(struct bench_run *run, const struct bench_vehicle *vehicle) {
    run->vehicle = vehicle;
    kl_input_init(&run->input);
    run->input.speed_m_s = (kl_real)vehicle->speed_m_s;
    (void)kl_init(vehicle->model, &run->start, (kl_real)vehicle->start_m,
                  (kl_real)vehicle->speed_m_s, cli_work());
    if (vehicle->displaced) {
        for (uint32_t w = 0; w < vehicle->model->n_wheelsets; w++) {
            run->start.x[kl_wheelset_state_index(vehicle->model, w, KL_WS_Y)] = (kl_real)1e-3;
        }
        kl_refresh(vehicle->model, &run->start, cli_work());
    }
    run->state = run->start;
}

static void step(struct bench_run *run) {
    kl_step(run->vehicle->model, &run->state, &run->input, &run->output, cli_work());
}

/* Between measurements: back to the start of the track in time. */
static void rewind_run(struct bench_run *run) {
    double reach = (double)run->vehicle->model->step_s * run->vehicle->speed_m_s * BENCH_BATCH;
    if ((double)run->state.s_m + reach > run->vehicle->end_m || run->state.faults != 0) {
        run->state = run->start;
    }
}

uint64_t bench_steps(const struct bench_vehicle *vehicle, uint64_t steps) {
    struct bench_run run;
    begin(&run, vehicle);
    for (uint64_t i = 0; i < steps; i++) {
        if (i % BENCH_BATCH == 0) {
            rewind_run(&run);
        }
        step(&run);
    }
    return kl_state_hash(&run.state);
}

static double clock_cost(double *scratch) {
    for (size_t i = 0; i < CLOCK_READINGS; i++) {
        int64_t before = now_ns();
        scratch[i] = (double)(now_ns() - before);
    }
    qsort(scratch, CLOCK_READINGS, sizeof scratch[0], by_value);
    return quantile(scratch, CLOCK_READINGS, 0.5);
}

static void measure_batches(struct bench_run *run, double *scratch, struct bench_times *times) {
    const size_t n = (size_t)(times->steps / BENCH_BATCH);
    for (size_t i = 0; i < n; i++) {
        rewind_run(run);
        int64_t before = now_ns();
        for (unsigned k = 0; k < BENCH_BATCH; k++) {
            step(run);
        }
        scratch[i] = ((double)(now_ns() - before) - times->clock_ns) / BENCH_BATCH;
    }
    qsort(scratch, n, sizeof scratch[0], by_value);
    times->min = scratch[0];
    times->median = quantile(scratch, n, 0.5);
    times->p90 = quantile(scratch, n, 0.9);
}

static void measure_singly(struct bench_run *run, double *scratch, struct bench_times *times) {
    const size_t n = (size_t)times->steps;
    for (size_t i = 0; i < n; i++) {
        rewind_run(run);
        int64_t before = now_ns();
        step(run);
        double ns = (double)(now_ns() - before) - times->clock_ns;
        scratch[i] = ns > 1.0 ? ns : 1.0;
    }
    qsort(scratch, n, sizeof scratch[0], by_value);
    times->single_median = quantile(scratch, n, 0.5);
    times->p99 = quantile(scratch, n, 0.99);
    times->p999 = quantile(scratch, n, 0.999);
    times->max = scratch[n - 1];
}

int bench_measure(const struct bench_vehicle *vehicle, uint64_t steps, struct bench_times *times) {
    struct bench_run run;
    const size_t room = steps > CLOCK_READINGS ? (size_t)steps : CLOCK_READINGS;
    double *scratch = malloc(room * sizeof *scratch);
    if (scratch == NULL) {
        return cli_fail("out of memory for %llu measurements", (unsigned long long)steps);
    }
    times->steps = steps;
    times->clock_ns = clock_cost(scratch);
    begin(&run, vehicle);
    for (unsigned i = 0; i < WARM_UP; i++) {
        rewind_run(&run);
        step(&run);
    }
    measure_batches(&run, scratch, times);
    measure_singly(&run, scratch, times);
    free(scratch);
    return CLI_OK;
}

double bench_calibrate(void) {
    static double ns[CALIBRATIONS];
    volatile double result = 0.0;
    for (size_t i = 0; i < CALIBRATIONS; i++) {
        double x = 1.0 + 1e-9 * (double)i;
        int64_t before = now_ns();
        for (int k = 0; k < 1000; k++) {
            x = x * 0.999999 + 1e-6;
        }
        ns[i] = (double)(now_ns() - before);
        result = x;
    }
    (void)result;
    qsort(ns, CALIBRATIONS, sizeof ns[0], by_value);
    return quantile(ns, CALIBRATIONS, 0.5);
}
