/* The real-time loop on a clock of the test's own: overruns and policies to the tick; reports. */
#include "kl_realtime.h"

#include <errno.h>
#include <limits.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/time.h>
#include <time.h>

#include <cmocka.h>

#define MS 1000000
#define US 1000
#define MOST_RUNS 64

/* A world in which time passes only in sleeps and callbacks. */
static struct world {
    int64_t now_ns;
    int64_t late_ns;            /* every wake-up is late by this */
    int64_t work_ns[MOST_RUNS]; /* duration of the n-th callback */
    int interruptions;          /* sleeps that end early with EINTR */
    int sleep_error;            /* what sleeps return */
    uint64_t end_after;         /* the callback returns false in this run; 0: never */
    uint64_t stop_in; /* the callback asks for a stop in this run, counted from 1; 0: never */
    int sleeps;
    uint64_t n;
    struct kl_realtime_tick seen[MOST_RUNS];
} world;

static struct kl_realtime loop;

static int64_t fake_now(void *context) {
    return ((struct world *)context)->now_ns;
}

static int fake_sleep(void *context, int64_t deadline_ns) {
    struct world *w = context;
    w->sleeps++;
    if (w->interruptions > 0) {
        w->interruptions--;
        return EINTR;
    }
    if (w->now_ns < deadline_ns)
        w->now_ns = deadline_ns;
    w->now_ns += w->late_ns;
    return w->sleep_error;
}

static bool fake_work(void *context, const struct kl_realtime_tick *tick) {
    struct world *w = context;
    assert_true(w->n < MOST_RUNS);
    w->now_ns += w->work_ns[w->n];
    w->seen[w->n++] = *tick;
    if (w->n == w->stop_in)
        kl_realtime_stop(&loop);
    return w->n != w->end_after;
}

static const struct kl_realtime_clock fake_clock = {
    .now = fake_now, .sleep_until = fake_sleep, .context = &world};

static struct kl_realtime_options fake_options(enum kl_realtime_policy policy, uint64_t ticks) {
    return (struct kl_realtime_options){.period_ns = MS,
                                        .ticks = ticks,
                                        .policy = policy,
                                        .cpu = -1,
                                        .callback = fake_work,
                                        .context = &world,
                                        .clock = &fake_clock};
}

static enum kl_realtime_end run(enum kl_realtime_policy policy, uint64_t ticks) {
    const struct kl_realtime_options options = fake_options(policy, ticks);
    assert_int_equal(kl_realtime_init(&loop, &options), KL_REALTIME_DONE);
    return kl_realtime_run(&loop);
}

static int fresh_world(void **state) {
    (void)state;
    memset(&world, 0, sizeof world);
    world.now_ns = 5000 * (int64_t)MS;
    for (int i = 0; i < MOST_RUNS; i++)
        world.work_ns[i] = 100 * US;
    return 0;
}

/* ---- the grid ---- */

static void deadlines_lie_on_the_grid(void **state) {
    (void)state;
    world.late_ns = 37 * US;
    assert_int_equal(run(KL_REALTIME_SKIP, 10), KL_REALTIME_DONE);
    assert_int_equal(world.n, 10);
    for (uint64_t i = 0; i < 10; i++) {
        assert_int_equal(world.seen[i].run, i);
        assert_int_equal(world.seen[i].number, i);
        assert_int_equal(world.seen[i].skipped, 0);
        assert_int_equal(world.seen[i].deadline_ns, 5001 * (int64_t)MS + (int64_t)i * MS);
        assert_int_equal(world.seen[i].started_ns, world.seen[i].deadline_ns + 37 * US);
    }
    assert_int_equal(loop.overruns, 0);
    assert_int_equal(loop.longest_run, 0);
    assert_int_equal(loop.latency.count, 10);
    assert_int_equal(loop.latency.bucket[37], 10);
    assert_int_equal(loop.execution.bucket[100], 10);
    assert_int_equal(loop.latency.min_ns, 37 * US);
    assert_int_equal(loop.latency.max_ns, 37 * US);
}

static void work_that_just_fits_is_no_overrun(void **state) {
    (void)state;
    world.work_ns[2] = MS - 1;
    world.work_ns[5] = MS; /* done exactly when the next is due: that one is missed */
    assert_int_equal(run(KL_REALTIME_SKIP, 20), KL_REALTIME_DONE);
    assert_int_equal(loop.overruns, 1);
    assert_int_equal(loop.system_overruns, 0);
}

/* ---- policies: tick 3 takes 3.5 ms, so ticks 4, 5 and 6 are due before it is done ---- */

static void skip_leaves_missed_ticks_out(void **state) {
    (void)state;
    world.work_ns[3] = 3500 * US;
    assert_int_equal(run(KL_REALTIME_SKIP, 12), KL_REALTIME_DONE);
    assert_int_equal(world.n, 9);
    assert_int_equal(world.seen[4].number, 7);
    assert_int_equal(world.seen[4].run, 4);
    assert_int_equal(world.seen[4].skipped, 3);
    assert_int_equal(world.seen[4].deadline_ns, 5008 * (int64_t)MS);
    assert_int_equal(world.seen[5].skipped, 0);
    assert_int_equal(loop.ticks, 12);
    assert_int_equal(loop.runs, 9);
    assert_int_equal(loop.overruns, 3);
    assert_int_equal(loop.system_overruns, 0);
    assert_int_equal(loop.longest_run, 3);
    assert_int_equal(loop.latency.count, 9);
}

static void catch_up_runs_every_tick(void **state) {
    (void)state;
    world.work_ns[3] = 3500 * US;
    assert_int_equal(run(KL_REALTIME_CATCH_UP, 12), KL_REALTIME_DONE);
    assert_int_equal(world.n, 12);
    for (uint64_t i = 0; i < 12; i++) {
        assert_int_equal(world.seen[i].number, i);
        assert_int_equal(world.seen[i].skipped, 0);
    }
    /* 3.5 ms after 5004: 5007.5; ticks 4 to 6 at once, 0.1 ms each; tick 7 on time at 5008 */
    assert_int_equal(world.seen[4].started_ns, 5007500 * (int64_t)US);
    assert_int_equal(world.seen[6].started_ns, 5007700 * (int64_t)US);
    assert_int_equal(world.seen[7].started_ns, 5008 * (int64_t)MS);
    assert_int_equal(loop.overruns, 3);
    assert_int_equal(loop.longest_run, 3);
    assert_int_equal(loop.latency.count, 9); /* those that were slept for */
    assert_int_equal(loop.execution.count, 12);
}

static void runs_of_overruns_are_told_apart(void **state) {
    (void)state;
    world.work_ns[3] = 3500 * US;  /* 3 missed */
    world.work_ns[20] = 5400 * US; /* 5 missed */
    world.work_ns[40] = 2500 * US; /* 2 missed */
    assert_int_equal(run(KL_REALTIME_CATCH_UP, 60), KL_REALTIME_DONE);
    assert_int_equal(loop.overruns, 10);
    assert_int_equal(loop.longest_run, 5);
    assert_int_equal(fresh_world(NULL), 0);
    world.work_ns[3] = 3500 * US;
    world.work_ns[4] = 2500 * US; /* a tick that ran parts the two rows */
    assert_int_equal(run(KL_REALTIME_SKIP, 60), KL_REALTIME_DONE);
    assert_int_equal(loop.overruns, 5);
    assert_int_equal(loop.longest_run, 3);
}

static void halt_ends_at_the_first_overrun(void **state) {
    (void)state;
    world.work_ns[3] = 3500 * US;
    assert_int_equal(run(KL_REALTIME_HALT, 12), KL_REALTIME_HALTED);
    assert_int_equal(world.n, 4);
    assert_int_equal(loop.overruns, 3);
    assert_string_equal(kl_realtime_end_text(loop.end), "halted at an overrun");
}

static void late_wake_up_is_charged_to_the_system(void **state) {
    (void)state;
    world.late_ns = 1500 * US;
    assert_int_equal(run(KL_REALTIME_SKIP, 10), KL_REALTIME_DONE);
    /* ticks 0, 2, 4, 6, 8 run, each makes the next one missed; the last of them misses tick 9 */
    assert_int_equal(world.n, 5);
    assert_int_equal(loop.overruns, 5);
    assert_int_equal(loop.system_overruns, 5);
    assert_int_equal(loop.longest_run, 1);
}

static void permanent_overload_with_catch_up_still_ends(void **state) {
    (void)state;
    for (int i = 0; i < MOST_RUNS; i++)
        world.work_ns[i] = 1200 * US;
    world.stop_in = 20;
    assert_int_equal(run(KL_REALTIME_CATCH_UP, 0), KL_REALTIME_STOPPED);
    assert_int_equal(world.n, 20);
    assert_int_equal(world.sleeps, 1);
    assert_int_equal(loop.overruns, 20);
    assert_int_equal(loop.longest_run, 20);
}

static void ticks_after_the_last_are_not_missed(void **state) {
    (void)state;
    world.work_ns[4] = 7 * MS;
    assert_int_equal(run(KL_REALTIME_SKIP, 5), KL_REALTIME_DONE);
    assert_int_equal(loop.overruns, 0);
    assert_int_equal(loop.ticks, 5);
}

/* ---- ends ---- */

static void stop_flag_ends_the_loop(void **state) {
    (void)state;
    world.stop_in = 4;
    assert_int_equal(run(KL_REALTIME_SKIP, 0), KL_REALTIME_STOPPED);
    assert_int_equal(world.n, 4);
}

static void stop_before_the_run_counts(void **state) {
    (void)state;
    const struct kl_realtime_options options = fake_options(KL_REALTIME_SKIP, 0);
    assert_int_equal(kl_realtime_init(&loop, &options), KL_REALTIME_DONE);
    kl_realtime_stop(&loop);
    assert_int_equal(kl_realtime_run(&loop), KL_REALTIME_STOPPED);
    assert_int_equal(world.n, 0);
}

static void callback_ends_the_loop(void **state) {
    (void)state;
    world.end_after = 6;
    assert_int_equal(run(KL_REALTIME_SKIP, 0), KL_REALTIME_CALLBACK);
    assert_int_equal(loop.runs, 6);
}

static void interrupted_sleep_goes_on(void **state) {
    (void)state;
    world.interruptions = 5;
    assert_int_equal(run(KL_REALTIME_SKIP, 3), KL_REALTIME_DONE);
    assert_int_equal(world.sleeps, 8);
    assert_int_equal(world.seen[0].started_ns, 5001 * (int64_t)MS);
}

static void broken_clock_is_told(void **state) {
    (void)state;
    world.sleep_error = EINVAL;
    assert_int_equal(run(KL_REALTIME_SKIP, 3), KL_REALTIME_FAILED);
    assert_int_equal(loop.error, EINVAL);
    assert_int_equal(world.n, 0);
}

static void bad_options_are_refused(void **state) {
    (void)state;
    const struct kl_realtime_options good = fake_options(KL_REALTIME_SKIP, 3);
    struct kl_realtime_options bad[8];
    for (int i = 0; i < 8; i++)
        bad[i] = good;
    bad[0].period_ns = 9999;
    bad[1].period_ns = INT64_C(10000000001);
    bad[2].callback = NULL;
    bad[3].priority = 100;
    bad[4].priority = -1;
    bad[5].cpu = INT_MAX;
    bad[6].policy = (enum kl_realtime_policy)3;
    bad[7].period_ns = -MS;
    for (int i = 0; i < 8; i++) {
        assert_int_equal(kl_realtime_init(&loop, &bad[i]), KL_REALTIME_ARGUMENT);
        assert_int_equal(kl_realtime_run(&loop), KL_REALTIME_ARGUMENT);
    }
    assert_int_equal(kl_realtime_init(NULL, &good), KL_REALTIME_ARGUMENT);
    assert_int_equal(kl_realtime_init(&loop, NULL), KL_REALTIME_ARGUMENT);
    assert_int_equal(kl_realtime_init(&loop, &good), KL_REALTIME_DONE);
    assert_int_equal(kl_realtime_run(NULL), KL_REALTIME_ARGUMENT);
    assert_int_equal(kl_realtime_run(&loop), KL_REALTIME_DONE);
    assert_int_equal(kl_realtime_run(&loop), KL_REALTIME_ARGUMENT); /* one run per init */
}

static void policies_have_names(void **state) {
    (void)state;
    enum kl_realtime_policy policy = KL_REALTIME_HALT;
    assert_true(kl_realtime_policy_parse("skip", &policy));
    assert_int_equal(policy, KL_REALTIME_SKIP);
    assert_true(kl_realtime_policy_parse("catch-up", &policy));
    assert_int_equal(policy, KL_REALTIME_CATCH_UP);
    assert_true(kl_realtime_policy_parse("halt", &policy));
    assert_int_equal(policy, KL_REALTIME_HALT);
    assert_false(kl_realtime_policy_parse("Skip", &policy));
    assert_int_equal(policy, KL_REALTIME_HALT);
}

/* ---- the record ---- */

static void histogram_counts_every_sample_once(void **state) {
    (void)state;
    static const int64_t samples[] = {-5, 0, 999, 1000, 1999999, 2000000, INT64_C(3600000000000)};
    struct kl_histogram h;
    kl_histogram_init(&h);
    assert_true(kl_histogram_average_us(&h) == 0.0);
    assert_true(kl_histogram_quantile_us(&h, 0.5) == 0.0);
    for (size_t i = 0; i < sizeof samples / sizeof samples[0]; i++)
        kl_histogram_add(&h, samples[i]);
    assert_int_equal(h.count, 7);
    assert_int_equal(h.bucket[0], 3);
    assert_int_equal(h.bucket[1], 1);
    assert_int_equal(h.bucket[1999], 1);
    assert_int_equal(h.overflow, 2);
    assert_int_equal(h.min_ns, -5);
    assert_int_equal(h.max_ns, INT64_C(3600000000000));
    assert_true(kl_histogram_quantile_us(&h, 0.5) == 2.0);
    assert_true(kl_histogram_quantile_us(&h, 1.0) == 3.6e9);
}

static void quantiles_of_a_known_set(void **state) {
    (void)state;
    struct kl_histogram h;
    kl_histogram_init(&h);
    for (int64_t i = 0; i < 100; i++) /* one in each of the first hundred buckets */
        kl_histogram_add(&h, i * US + 500);
    assert_true(kl_histogram_quantile_us(&h, 0.01) == 1.0);
    assert_true(kl_histogram_quantile_us(&h, 0.5) == 50.0);
    assert_true(kl_histogram_quantile_us(&h, 0.99) == 99.0);
    assert_true(kl_histogram_average_us(&h) == 50.0);
}

static char *written(bool json, bool buckets) {
    char *text = NULL;
    size_t size = 0;
    FILE *file = open_memstream(&text, &size);
    assert_int_equal(json ? kl_realtime_report_json(&loop, file)
                          : kl_realtime_report_text(&loop, file, buckets),
                     0);
    fclose(file);
    return text;
}

static void reports_say_what_happened(void **state) {
    (void)state;
    world.late_ns = 12 * US;
    world.work_ns[3] = 3500 * US;
    assert_int_equal(run(KL_REALTIME_SKIP, 12), KL_REALTIME_DONE);
    char *text = written(false, true);
    assert_non_null(strstr(text, "policy skip"));
    assert_non_null(strstr(
        text, "overruns         3 (3 of the loop's own making, 0 woken late); longest run 3"));
    assert_non_null(strstr(text, "000012 00000009   00000000\n"));
    assert_non_null(strstr(text, "000100 00000000   00000008\n"));
    free(text);
    text = written(false, false);
    assert_null(strstr(text, "000012"));
    free(text);
    text = written(true, false);
    assert_non_null(strstr(text, "\"overruns\": 3"));
    assert_non_null(strstr(text, "\"histogram\": {\"12\": 9}"));
    assert_non_null(strstr(text, "\"overflow\": 1"));
    free(text);
}

/* Somebody else's parser agrees that it is JSON, also for a loop that never ran. */
static void json_is_json(void **state) {
    (void)state;
    for (uint64_t ticks = 0; ticks < 2; ticks++) {
        const struct kl_realtime_options options = fake_options(KL_REALTIME_SKIP, 20);
        assert_int_equal(kl_realtime_init(&loop, &options), KL_REALTIME_DONE);
        if (ticks > 0)
            kl_realtime_run(&loop);
        FILE *judge = popen("/usr/bin/python3 -m json.tool >/dev/null", "w");
        assert_non_null(judge);
        assert_int_equal(kl_realtime_report_json(&loop, judge), 0);
        assert_int_equal(pclose(judge), 0);
    }
}

static void failed_writing_is_told(void **state) {
    (void)state;
    FILE *full = fopen("/dev/full", "w");
    assert_non_null(full);
    assert_int_equal(kl_realtime_report_text(&loop, full, true), EIO);
    assert_int_equal(kl_realtime_report_json(&loop, full), EIO);
    fclose(full);
}

/* ---- the real clock ---- */

static bool count_only(void *context, const struct kl_realtime_tick *tick) {
    (void)tick;
    ++*(int *)context;
    return true;
}

static void real_clock_keeps_the_average(void **state) {
    (void)state;
    int count = 0;
    const struct kl_realtime_options options = {.period_ns = MS,
                                                .ticks = 200,
                                                .policy = KL_REALTIME_CATCH_UP,
                                                .priority = KL_REALTIME_PRIORITY,
                                                .cpu = -1,
                                                .callback = count_only,
                                                .context = &count};
    assert_int_equal(kl_realtime_init(&loop, &options), KL_REALTIME_DONE);
    assert_int_equal(kl_realtime_run(&loop), KL_REALTIME_DONE);
    assert_int_equal(count, 200);
    /* The last tick is due 199 ms after the first; a busy machine may be late, never early. */
    assert_true(loop.elapsed_ns >= 199 * (int64_t)MS);
    assert_true(loop.latency.min_ns >= 0);
}

static void on_alarm(int number) {
    (void)number;
    kl_realtime_stop(&loop);
}

static void signal_ends_a_long_sleep(void **state) {
    (void)state;
    int count = 0;
    const struct kl_realtime_options options = {.period_ns = INT64_C(10000000000),
                                                .policy = KL_REALTIME_SKIP,
                                                .cpu = -1,
                                                .callback = count_only,
                                                .context = &count};
    const struct itimerval soon = {.it_value = {.tv_usec = 50000}};
    const struct sigaction action = {.sa_handler = on_alarm};
    time_t began = time(NULL);
    assert_int_equal(kl_realtime_init(&loop, &options), KL_REALTIME_DONE);
    sigaction(SIGALRM, &action, NULL);
    setitimer(ITIMER_REAL, &soon, NULL);
    assert_int_equal(kl_realtime_run(&loop), KL_REALTIME_STOPPED);
    assert_int_equal(count, 0);
    assert_true(time(NULL) - began < 5);
}

int main(void) {
#define CASE(name) cmocka_unit_test_setup(name, fresh_world)
    const struct CMUnitTest tests[] = {
        CASE(deadlines_lie_on_the_grid),
        CASE(work_that_just_fits_is_no_overrun),
        CASE(skip_leaves_missed_ticks_out),
        CASE(catch_up_runs_every_tick),
        CASE(runs_of_overruns_are_told_apart),
        CASE(halt_ends_at_the_first_overrun),
        CASE(late_wake_up_is_charged_to_the_system),
        CASE(permanent_overload_with_catch_up_still_ends),
        CASE(ticks_after_the_last_are_not_missed),
        CASE(stop_flag_ends_the_loop),
        CASE(stop_before_the_run_counts),
        CASE(callback_ends_the_loop),
        CASE(interrupted_sleep_goes_on),
        CASE(broken_clock_is_told),
        CASE(bad_options_are_refused),
        CASE(policies_have_names),
        CASE(histogram_counts_every_sample_once),
        CASE(quantiles_of_a_known_set),
        CASE(reports_say_what_happened),
        CASE(json_is_json),
        CASE(failed_writing_is_told),
        CASE(real_clock_keeps_the_average),
        CASE(signal_ends_a_long_sleep),
    };
    return cmocka_run_group_tests_name("kl_realtime", tests, NULL, NULL);
}
