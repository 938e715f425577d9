/* hil_session.h - a vehicle running on a bus, and what is told of it. Private to cmd_hil.c. */
#ifndef HIL_SESSION_H
#define HIL_SESSION_H

#include <stdatomic.h>

#include "hil_bus.h"
#include "hil_record.h"
#include "kl_node.h"
#include "kl_realtime.h"

enum hil_clock { HIL_REALTIME = 0, HIL_LOCKSTEP };

/* What the status line shows; written by the loop in every cycle, read by another thread. */
struct hil_shown {
    _Atomic uint64_t cycles;
    _Atomic uint64_t time_ms; /* simulated */
    _Atomic uint64_t speed_mm_s;
    _Atomic uint32_t run_state;
    _Atomic uint32_t bus_down;
    _Atomic uint64_t overruns;
    _Atomic uint64_t dropped;
};

/* Large: make it static. */
struct hil_session {
    struct kl_state state;
    struct kl_state snapshot;
    struct kl_input input;
    struct kl_output output;
    struct kl_work work;
    struct kl_node node;
    struct hil_bus bus;
    struct kl_realtime loop; /* of lockstep: the execution histogram and times alone */
    enum hil_clock clock;
    uint64_t cycles_wanted; /* lockstep; 0: no end */
    int64_t execution_sum_ns;
    struct hil_shown shown;
    struct hil_record record;
    bool recorded;
};

/* The callback of session->loop; `context` is the session. */
bool hil_session_tick(void *context, const struct kl_realtime_tick *tick);

/* Runs until the end; the loop or kl_realtime_stop() ends it. */
void hil_session_run(struct hil_session *session);

/* One line of status on a terminal, twice a second, from a thread of its own, until ended. */
void hil_status_begin(struct hil_session *session);
void hil_status_end(void);

/* At the end. */
void hil_report_text(const struct hil_session *session, FILE *file);
void hil_report_json(const struct hil_session *session, FILE *file);

#endif
