#include "kl_realtime_system.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#define SECOND 1000000000

static int64_t system_now(void *context) {
    (void)context;
    struct timespec now = {0};
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * SECOND + now.tv_nsec;
}

static int system_sleep_until(void *context, int64_t deadline_ns) {
    (void)context;
    struct timespec until = {.tv_sec = deadline_ns / SECOND, .tv_nsec = deadline_ns % SECOND};
    return clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL);
}

const struct kl_realtime_clock kl_realtime_system_clock = {
    .now = system_now, .sleep_until = system_sleep_until, .context = NULL};

static void warn(const struct kl_realtime_options *options, const char *what, const char *remedy,
                 int error) {
    if (options->warnings != NULL)
        (void)fprintf(options->warnings, "warning: %s (%s); timing may suffer; %s\n", what,
                      strerror(error), remedy);
}

/* Touches the stack, so that no page of it is missing later. */
__attribute__((noinline)) static void touch_stack(void) {
    volatile unsigned char page[KL_REALTIME_STACK_BYTES];
    for (size_t i = 0; i < sizeof page; i += 1024)
        page[i] = 0;
    page[sizeof page - 1] = 0;
}

/* Locking what comes later too would make later allocations fail under a limit: then only lock what
 * there is. */
static bool lock_memory(void) {
    struct rlimit limit;
    bool unlimited = geteuid() == 0 ||
                     (getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur == RLIM_INFINITY);
    return mlockall(unlimited ? MCL_CURRENT | MCL_FUTURE : MCL_CURRENT) == 0;
}

static void claim_processor(const struct kl_realtime_options *options,
                            struct kl_realtime_grants *grants, struct kl_realtime_before *before) {
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET((size_t)options->cpu, &one);
    grants->cpu = sched_getaffinity(0, sizeof before->cpus, &before->cpus) == 0 &&
                  sched_setaffinity(0, sizeof one, &one) == 0;
    if (!grants->cpu)
        warn(options, "cannot stay on the wanted processor", "choose one that exists", errno);
}

static void claim_idle_states(struct kl_realtime_grants *grants,
                              struct kl_realtime_before *before) {
    const int32_t latency_us = 0;
    before->idle_states = open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC);
    if (before->idle_states < 0)
        return; /* many kernels do not offer it, and without it things are merely as usual */
    grants->idle_states =
        write(before->idle_states, &latency_us, sizeof latency_us) == (ssize_t)sizeof latency_us;
}

void kl_realtime_claim(const struct kl_realtime_options *options, struct kl_realtime_grants *grants,
                       struct kl_realtime_before *before) {
    memset(grants, 0, sizeof *grants);
    memset(before, 0, sizeof *before);
    before->timer_slack_ns = -1;
    before->idle_states = -1;
    if (options->cpu >= 0)
        claim_processor(options, grants, before);
    if (options->priority == 0)
        return;
    touch_stack();
    grants->memory_locked = lock_memory();
    if (!grants->memory_locked)
        warn(options, "memory is not locked", "run as root or raise `ulimit -l`", errno);
    before->timer_slack_ns = prctl(PR_GET_TIMERSLACK);
    if (before->timer_slack_ns >= 0)
        (void)prctl(PR_SET_TIMERSLACK, 1);
    claim_idle_states(grants, before);
    const struct sched_param wanted = {.sched_priority = options->priority};
    before->policy = sched_getscheduler(0);
    grants->fifo = before->policy >= 0 && sched_getparam(0, &before->param) == 0 &&
                   sched_setscheduler(0, SCHED_FIFO, &wanted) == 0;
    if (!grants->fifo)
        warn(options, "no real-time scheduling", "run as root or raise `ulimit -r`", errno);
}

void kl_realtime_release(const struct kl_realtime_grants *grants,
                         const struct kl_realtime_before *before) {
    if (grants->fifo)
        (void)sched_setscheduler(0, before->policy, &before->param);
    if (before->idle_states >= 0)
        (void)close(before->idle_states);
    if (before->timer_slack_ns >= 0)
        (void)prctl(PR_SET_TIMERSLACK, (unsigned long)before->timer_slack_ns);
    if (grants->memory_locked)
        (void)munlockall();
    if (grants->cpu)
        (void)sched_setaffinity(0, sizeof before->cpus, &before->cpus);
}
