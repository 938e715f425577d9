/*
 * kl_realtime_system.h - what the real-time loop asks of the operating system for the time of a
 * run, and how it is given back. Private to kl_realtime.c.
 */
#ifndef KL_REALTIME_SYSTEM_H
#define KL_REALTIME_SYSTEM_H

#include "kl_realtime.h"

#include <sched.h>

/* What there was before, to be put back. */
struct kl_realtime_before {
    int policy;
    struct sched_param param;
    cpu_set_t cpus;
    int timer_slack_ns; /* negative: not changed */
    int idle_states;    /* file that keeps deep idle states away while open; -1: none */
};

/* Asks for what the options want; says in `grants` what was given and warns of the rest. */
void kl_realtime_claim(const struct kl_realtime_options *options, struct kl_realtime_grants *grants,
                       struct kl_realtime_before *before);

/* Gives back what was granted. */
void kl_realtime_release(const struct kl_realtime_grants *grants,
                         const struct kl_realtime_before *before);

/* CLOCK_MONOTONIC with sleeps to absolute deadlines. */
extern const struct kl_realtime_clock kl_realtime_system_clock;

#endif
