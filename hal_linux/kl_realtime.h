/*
 * kl_realtime.h - the real-time loop: a callback at absolute deadlines, and a record of how well
 * they were kept.
 *
 * Tick k is due at start + k * period of the monotonic clock. The loop sleeps until then, runs the
 * callback, and looks whether the next tick is already due. If so, that tick is an overrun - one
 * per missed tick - and the policy decides: SKIP      missed ticks are left out; the callback is
 * told how many CATCH_UP  every tick is run, late ones at once, until the loop is on time again
 *   HALT      the loop ends at the first overrun
 * A missed tick is charged to the system if the callback before it took less than a period (the
 * loop was woken late), else to the callback; a virtual machine that is paused during the callback
 * is charged to it as well, since the two cannot be told apart.
 *
 * While it runs, the loop locks memory, touches its stack, asks for SCHED_FIFO, the finest timer
 * slack and no deep idle states, as far as it may; what it may not is a warning, never a failure.
 * It puts scheduling and locks back before it returns.
 *
 * Latency is wake-up minus deadline, for ticks that were slept for. Execution is the time in the
 * callback. Both in buckets of 1 us; longer ones are counted as overflow and still enter min,
 * average and max. No heap, no I/O in the loop. kl_realtime_stop() may be called from a signal
 * handler or from another thread; all else belongs to one thread. All times are nanoseconds.
 */
#ifndef KL_REALTIME_H
#define KL_REALTIME_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#define KL_HISTOGRAM_BUCKETS 2000u            /* of 1 us: 0..1999 us */
#define KL_REALTIME_STACK_BYTES (256u * 1024) /* touched before the loop starts */
#define KL_REALTIME_PRIORITY 80

struct kl_histogram {
    uint64_t count;
    uint64_t overflow; /* samples of 2000 us and more */
    int64_t min_ns;    /* of no sample: 0 */
    int64_t max_ns;
    int64_t sum_ns;
    uint32_t bucket[KL_HISTOGRAM_BUCKETS]; /* negative samples go to the first */
};

enum kl_realtime_policy { KL_REALTIME_SKIP = 0, KL_REALTIME_CATCH_UP, KL_REALTIME_HALT };

/* Why the loop ended. */
enum kl_realtime_end {
    KL_REALTIME_DONE = 0,     /* the wanted number of ticks was reached */
    KL_REALTIME_STOPPED,      /* kl_realtime_stop() */
    KL_REALTIME_CALLBACK,     /* the callback returned false */
    KL_REALTIME_HALTED,       /* an overrun, with policy HALT */
    KL_REALTIME_FAILED = -1,  /* the clock does not work */
    KL_REALTIME_ARGUMENT = -2 /* NULL, or an option out of range */
};

/* What the callback is told. */
struct kl_realtime_tick {
    uint64_t run;        /* callbacks before this one: 0, 1, 2, ... without gaps */
    uint64_t number;     /* k: ticks since the start, skipped ones included */
    uint64_t skipped;    /* ticks left out just before this one; 0 but for SKIP */
    int64_t deadline_ns; /* when it was due, monotonic clock */
    int64_t started_ns;  /* when it started */
};

/* Returns false to end the loop after this tick. */
typedef bool (*kl_realtime_callback)(void *context, const struct kl_realtime_tick *tick);

/* The clock of the loop. `sleep_until` returns 0, EINTR, or another errno value. */
struct kl_realtime_clock {
    int64_t (*now)(void *context);
    int (*sleep_until)(void *context, int64_t deadline_ns);
    void *context;
};

struct kl_realtime_options {
    int64_t period_ns; /* 10 us .. 10 s */
    uint64_t ticks;    /* ends when this many are over, skipped ones included; 0: no end */
    enum kl_realtime_policy policy;
    int priority; /* SCHED_FIFO 1..99; 0: leave scheduling, memory and idle states alone */
    int cpu;      /* the processor to stay on; negative: any */
    kl_realtime_callback callback;
    void *context;
    FILE *warnings;                        /* one line for each thing not granted; NULL: silent */
    const struct kl_realtime_clock *clock; /* NULL: CLOCK_MONOTONIC; for tests */
};

/* What was granted. */
struct kl_realtime_grants {
    bool memory_locked;
    bool fifo;
    bool cpu;
    bool idle_states;
};

/* About 17 KiB, owned by the caller. Fields are for reading after the run. */
struct kl_realtime {
    struct kl_realtime_options options;
    struct kl_realtime_grants grants;
    enum kl_realtime_end end;
    int error;         /* errno value with KL_REALTIME_FAILED, else 0 */
    uint64_t runs;     /* callbacks made */
    uint64_t ticks;    /* ticks over, skipped ones included */
    uint64_t overruns; /* missed ticks */
    uint64_t
        system_overruns;  /* of these: woken late, though the callback took less than a period */
    uint64_t overrun_run; /* missed ticks in a row up to now */
    uint64_t longest_run; /* most missed ticks in a row */
    int64_t started_ns;
    int64_t elapsed_ns;
    struct kl_histogram latency;
    struct kl_histogram execution;
    _Atomic int stop;
};

/* Checks the options and clears the record. KL_REALTIME_DONE or KL_REALTIME_ARGUMENT. */
enum kl_realtime_end kl_realtime_init(struct kl_realtime *loop,
                                      const struct kl_realtime_options *options);

/* Runs the loop in the calling thread; one run per kl_realtime_init(). A stop that came before the
 * run counts. */
enum kl_realtime_end kl_realtime_run(struct kl_realtime *loop);

/* Ends the loop after the tick that is running, or out of its sleep if a signal interrupts that, at
 * the latest one period later. Safe in signal handlers and other threads. */
void kl_realtime_stop(struct kl_realtime *loop);

/* "skip", "catch-up", "halt" and back; false for another word. */
const char *kl_realtime_policy_text(enum kl_realtime_policy policy);
bool kl_realtime_policy_parse(const char *text, enum kl_realtime_policy *policy);
const char *kl_realtime_end_text(enum kl_realtime_end end);

/* Empties a histogram; adds one sample; average (0 of none); the smallest whole us that a share of
 * the samples, 0..1, does not exceed (the overflow counts as the maximum). */
void kl_histogram_init(struct kl_histogram *histogram);
void kl_histogram_add(struct kl_histogram *histogram, int64_t sample_ns);
double kl_histogram_average_us(const struct kl_histogram *histogram);
double kl_histogram_quantile_us(const struct kl_histogram *histogram, double share);

/* The record as text in the manner of cyclictest, with the buckets that hold something if
 * `buckets`; and as one JSON object. 0, or an errno value if writing failed. */
int kl_realtime_report_text(const struct kl_realtime *loop, FILE *file, bool buckets);
int kl_realtime_report_json(const struct kl_realtime *loop, FILE *file);

#endif
