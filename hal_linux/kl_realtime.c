#include "kl_realtime.h"

#include "kl_realtime_system.h"

#include <errno.h>
#include <string.h>

#define MIN_PERIOD_NS 10000
#define MAX_PERIOD_NS INT64_C(10000000000)

static bool good(const struct kl_realtime_options *options) {
    return options->callback != NULL && options->period_ns >= MIN_PERIOD_NS &&
           options->period_ns <= MAX_PERIOD_NS && options->priority >= 0 &&
           options->priority <= 99 && options->cpu < CPU_SETSIZE &&
           (options->policy == KL_REALTIME_SKIP || options->policy == KL_REALTIME_CATCH_UP ||
            options->policy == KL_REALTIME_HALT);
}

enum kl_realtime_end kl_realtime_init(struct kl_realtime *loop,
                                      const struct kl_realtime_options *options) {
    if (loop == NULL)
        return KL_REALTIME_ARGUMENT;
    memset(loop, 0, sizeof *loop);
    atomic_init(&loop->stop, 0);
    loop->end = KL_REALTIME_ARGUMENT;
    if (options == NULL || !good(options))
        return KL_REALTIME_ARGUMENT;
    loop->options = *options;
    kl_histogram_init(&loop->latency);
    kl_histogram_init(&loop->execution);
    loop->end = KL_REALTIME_DONE;
    return KL_REALTIME_DONE;
}

void kl_realtime_stop(struct kl_realtime *loop) {
    atomic_store(&loop->stop, 1);
}

static bool stopping(struct kl_realtime *loop) {
    return atomic_load(&loop->stop) != 0;
}

/* False: a stop was asked for, or the clock does not work. */
static bool sleep_until(struct kl_realtime *loop, const struct kl_realtime_clock *clock,
                        int64_t deadline_ns) {
    int error = EINTR;
    while (error == EINTR && !stopping(loop))
        error = clock->sleep_until(clock->context, deadline_ns);
    if (error != 0 && error != EINTR) {
        loop->error = error;
        loop->end = KL_REALTIME_FAILED;
        return false;
    }
    if (stopping(loop)) {
        loop->end = KL_REALTIME_STOPPED;
        return false;
    }
    return true;
}

static void count_overruns(struct kl_realtime *loop, uint64_t missed, bool by_system) {
    loop->overruns += missed;
    loop->system_overruns += by_system ? missed : 0;
    loop->overrun_run += missed;
    if (loop->overrun_run > loop->longest_run)
        loop->longest_run = loop->overrun_run;
}

/* How many of the ticks after `tick` are due by now; none after the last one that is wanted. */
static uint64_t missed_ticks(const struct kl_realtime *loop, const struct kl_realtime_tick *tick,
                             int64_t now_ns) {
    int64_t late_ns = now_ns - (tick->deadline_ns + loop->options.period_ns);
    uint64_t missed = late_ns < 0 ? 0 : (uint64_t)(late_ns / loop->options.period_ns) + 1;
    if (loop->options.ticks == 0)
        return missed;
    uint64_t left = loop->options.ticks - 1 - tick->number;
    return missed < left ? missed : left;
}

/*
 * Books the overruns after a callback and moves on to the next tick. Returns whether it is to be
 * slept for. In a catch-up only the next tick is booked: those behind it will be in their turn.
 */
static bool advance(struct kl_realtime *loop, struct kl_realtime_tick *tick, int64_t now_ns) {
    uint64_t missed = missed_ticks(loop, tick, now_ns);
    uint64_t step = 1;
    tick->skipped = 0;
    if (missed == 0) {
        loop->overrun_run = 0;
    } else if (loop->options.policy == KL_REALTIME_CATCH_UP) {
        count_overruns(loop, 1, now_ns - tick->started_ns < loop->options.period_ns);
    } else {
        loop->overrun_run = 0; /* the tick just run was on its grid: the row begins anew */
        count_overruns(loop, missed, now_ns - tick->started_ns < loop->options.period_ns);
        tick->skipped = missed;
        step += missed;
    }
    tick->run++;
    tick->number += step;
    tick->deadline_ns += (int64_t)step * loop->options.period_ns;
    return missed == 0 || loop->options.policy != KL_REALTIME_CATCH_UP;
}

/* After a callback: whether the loop is over, and why. */
static bool over(struct kl_realtime *loop, bool go_on) {
    if (!go_on)
        loop->end = KL_REALTIME_CALLBACK;
    else if (loop->overruns > 0 && loop->options.policy == KL_REALTIME_HALT)
        loop->end = KL_REALTIME_HALTED;
    else if (loop->options.ticks > 0 && loop->ticks >= loop->options.ticks)
        loop->end = KL_REALTIME_DONE;
    else if (stopping(loop))
        loop->end = KL_REALTIME_STOPPED;
    else
        return false;
    return true;
}

static void run_ticks(struct kl_realtime *loop, const struct kl_realtime_clock *clock) {
    struct kl_realtime_tick tick = {.deadline_ns = loop->started_ns};
    bool sleep = true;
    bool go_on = true;
    do {
        if (sleep && !sleep_until(loop, clock, tick.deadline_ns))
            return;
        tick.started_ns = clock->now(clock->context);
        if (sleep)
            kl_histogram_add(&loop->latency, tick.started_ns - tick.deadline_ns);
        go_on = loop->options.callback(loop->options.context, &tick);
        int64_t now_ns = clock->now(clock->context);
        kl_histogram_add(&loop->execution, now_ns - tick.started_ns);
        sleep = advance(loop, &tick, now_ns);
        loop->runs = tick.run;
        loop->ticks = tick.number;
    } while (!over(loop, go_on));
}

enum kl_realtime_end kl_realtime_run(struct kl_realtime *loop) {
    if (loop == NULL || loop->end != KL_REALTIME_DONE || loop->runs != 0)
        return KL_REALTIME_ARGUMENT;
    const struct kl_realtime_clock *clock =
        loop->options.clock != NULL ? loop->options.clock : &kl_realtime_system_clock;
    struct kl_realtime_before before;
    kl_realtime_claim(&loop->options, &loop->grants, &before);
    /* The first tick is one period away, so that claiming does not count as lateness. */
    loop->started_ns = clock->now(clock->context) + loop->options.period_ns;
    run_ticks(loop, clock);
    loop->elapsed_ns = clock->now(clock->context) - loop->started_ns;
    kl_realtime_release(&loop->grants, &before);
    return loop->end;
}
