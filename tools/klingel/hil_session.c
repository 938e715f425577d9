/* hil_session.c - the loop: by the clock, or by the bus. */
#include "hil_session.h"

#include <pthread.h>
#include <signal.h>
#include <sys/prctl.h>
#include <time.h>
#include <unistd.h>

#define IDLE_NS 50000       /* lockstep: how long to sleep while there is no SYNC */
#define SPINS 200           /* looks at the bus before sleeping: a quick peer answers at once */
#define STATUS_NS 500000000 /* between two status lines */

static int64_t now_ns(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

static void sleep_ns(long ns) {
    const struct timespec pause = {.tv_sec = ns / 1000000000, .tv_nsec = ns % 1000000000};
    (void)clock_nanosleep(CLOCK_MONOTONIC, 0, &pause, NULL);
}

static void show(struct hil_session *s) {
    const struct kl_node *node = &s->node;
    struct hil_shown *shown = &s->shown;
    atomic_store_explicit(&shown->cycles, node->counts.cycles, memory_order_relaxed);
    atomic_store_explicit(&shown->time_ms, (uint64_t)s->output.time_ns / 1000000,
                          memory_order_relaxed);
    atomic_store_explicit(&shown->speed_mm_s, (uint64_t)((double)s->output.speed_m_s * 1e3 + 0.5),
                          memory_order_relaxed);
    atomic_store_explicit(&shown->run_state, (uint32_t)node->run_state, memory_order_relaxed);
    atomic_store_explicit(&shown->bus_down, node->bus_down, memory_order_relaxed);
    atomic_store_explicit(&shown->overruns, s->loop.overruns, memory_order_relaxed);
    atomic_store_explicit(&shown->dropped, node->counts.dropped, memory_order_relaxed);
}

/* What the bus is told of the cycles before this one. */
static struct kl_node_timing timing(struct hil_session *s) {
    const struct kl_histogram *execution = &s->loop.execution;
    const struct kl_node_timing t = {.overruns = s->loop.overruns,
                                     .exec_last_ns =
                                         (uint64_t)(execution->sum_ns - s->execution_sum_ns),
                                     .exec_max_ns = (uint64_t)execution->max_ns};
    s->execution_sum_ns = execution->sum_ns;
    return t;
}

bool hil_session_tick(void *context, const struct kl_realtime_tick *tick) {
    struct hil_session *s = context;
    const struct kl_node_timing before = timing(s);
    (void)tick;
    (void)kl_node_cycle(&s->node, &before);
    show(s);
    return true;
}

static bool ended(struct hil_session *s) {
    return atomic_load(&s->loop.stop) != 0 ||
           (s->cycles_wanted > 0 && s->node.counts.cycles >= s->cycles_wanted);
}

/* The bus is the clock: one cycle per SYNC. Between two the bus is looked at again and again, then
 * slept for: the peer's own pace decides. */
static void run_lockstep(struct hil_session *s) {
    unsigned idle = 0;
    s->loop.started_ns = now_ns();
    (void)prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
    while (!ended(s)) {
        const struct kl_node_timing before = timing(s);
        int64_t began = now_ns();
        if (kl_node_cycle(&s->node, &before)) {
            kl_can_service(&s->bus.can); /* the peer waits for these frames: do not let them lie */
            kl_histogram_add(&s->loop.execution, now_ns() - began);
            idle = 0;
            show(s);
        } else if (++idle > SPINS) {
            sleep_ns(IDLE_NS);
        }
    }
    s->loop.elapsed_ns = now_ns() - s->loop.started_ns;
    s->loop.end = atomic_load(&s->loop.stop) != 0 ? KL_REALTIME_STOPPED : KL_REALTIME_DONE;
}

void hil_session_run(struct hil_session *session) {
    if (session->clock == HIL_LOCKSTEP) {
        run_lockstep(session);
    } else {
        (void)kl_realtime_run(&session->loop);
    }
}

/* ---- status line ---- */

static pthread_t status_thread;
static _Atomic int status_running;

static void print_status(const struct hil_shown *shown) {
    static const char *const names[] = {"init", "running", "paused", "stopped", "FAULT"};
    uint32_t state = atomic_load(&shown->run_state);
    double speed = 1e-3 * (double)atomic_load(&shown->speed_mm_s);
    fprintf(stderr,
            "\r%-7s t %9.1f s  V %6.2f m/s (%5.1f km/h)  cycles %llu  overruns %llu  dropped "
            "%llu%s\033[K",
            state < sizeof names / sizeof names[0] ? names[state] : "?",
            1e-3 * (double)atomic_load(&shown->time_ms), speed, 3.6 * speed,
            (unsigned long long)atomic_load(&shown->cycles),
            (unsigned long long)atomic_load(&shown->overruns),
            (unsigned long long)atomic_load(&shown->dropped),
            atomic_load(&shown->bus_down) != 0 ? "  BUS DOWN" : "");
}

static void *status_loop(void *context) {
    const struct hil_session *session = context;
    while (atomic_load(&status_running) != 0) {
        print_status(&session->shown);
        sleep_ns(STATUS_NS);
    }
    fprintf(stderr, "\r\033[K");
    return NULL;
}

void hil_status_begin(struct hil_session *session) {
    sigset_t all;
    sigset_t before;
    if (!isatty(STDERR_FILENO)) {
        return;
    }
    /* signals shall wake the loop, not this thread */
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    atomic_store(&status_running, 1);
    if (pthread_create(&status_thread, NULL, status_loop, session) != 0) {
        atomic_store(&status_running, 0);
    }
    pthread_sigmask(SIG_SETMASK, &before, NULL);
}

void hil_status_end(void) {
    if (atomic_exchange(&status_running, 0) != 0) {
        (void)pthread_join(status_thread, NULL);
    }
}
