/*
 * critical_vehicle.h - a vehicle that hunts, as a system whose cycles can be followed: its parameter
 * is the speed, what is observed is the lateral displacement of one wheelset. Private to
 * cmd_critical.c.
 */
#ifndef CRITICAL_VEHICLE_H
#define CRITICAL_VEHICLE_H

#include "cli_progress.h"
#include "cycle.h"
#include "modes_steady.h"

struct critical_vehicle {
    const struct kl_model *model;
    const struct modes_names *names;
    struct kl_input input;
    int32_t observed; /* state */
    double at_m;
    struct cli_progress *progress;
    const char *doing; /* shown as progress */
    uint64_t steps;    /* made so far */
    struct kl_state scratch;
    struct modes_steady rest;
    double rest_m_s; /* speed of `rest`; negative: none yet */
};

void critical_vehicle_init(struct critical_vehicle *v, const struct kl_model *model,
                           const struct modes_names *names, uint32_t wheelset);

/* The vehicle as a cycle_system; `v` must outlive it. */
struct cycle_system critical_system(struct critical_vehicle *v);

/* At a speed, steady but for all wheelsets displaced by `aside_m`. CLI_OK or CLI_FAILED (printed). */
int critical_start(struct critical_vehicle *v, double speed_m_s, double aside_m,
                   struct kl_state *state);

#endif
