/*
 * critical_follow.h - the branches of a vehicle's limit cycles over the speed, and what kind of loss
 * of stability they make. Private to cmd_critical.c.
 *
 * Cycles are started from both sides. From above: strongly disturbed at the highest speed, the
 * vehicle settles, and is slowed down step by step, each time until it has settled again; where it
 * comes to rest, the end of the branch is bisected. Below that end it is strongly disturbed again at
 * a few speeds, and what hunts there is followed in the same way. From below: hardly disturbed just
 * above the linear critical speed, where it must leave the steady state; unless it goes over to the
 * cycle that is known, that one is followed down too. Where it ends tells the kind of bifurcation.
 */
#ifndef CRITICAL_FOLLOW_H
#define CRITICAL_FOLLOW_H

#include "critical_report.h"
#include "critical_vehicle.h"

struct critical_search {
    struct critical_vehicle *vehicle;
    struct cycle_system system;
    struct cycle_limits limits;
    double low_m_s; /* the range of speeds, and the step through it */
    double high_m_s;
    double step_m_s;
    double near_m_s;        /* to what an end of hunting is bisected */
    double aside_m;         /* the strong disturbance */
    struct kl_state *state; /* of each point of the result */
    char doing[64];
    struct critical_result *result;
};

/* Everything but the unstable cycles; result->linear must be there. CLI_OK or CLI_FAILED (printed). */
int critical_follow(struct critical_search *search);

/* The unstable cycles at the speeds of stable ones below the linear critical speed. */
void critical_thresholds(struct critical_search *search);

#endif
