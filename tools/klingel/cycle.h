/*
 * cycle.h - limit cycles of a stepped system that depends on a parameter: how large, how fast, down
 * to which value of the parameter, and what separates them from rest. Private to cmd_critical.c.
 *
 * The system is known by three functions alone, so that anything with a step can be followed: a
 * vehicle at its speed, or the normal form of a Hopf bifurcation in a test. Stable cycles are found
 * by letting the system settle; the fold, where they end, by bisection between a parameter at which
 * the cycle stays and one at which it decays, always started from the nearest cycle that stays; the
 * unstable cycle, which a disturbance must exceed to grow, by bisection of the disturbance.
 */
#ifndef CYCLE_H
#define CYCLE_H

#include <stdbool.h>
#include <stddef.h>

struct cycle_system {
    void *context;
    size_t state_size; /* of a state, plain data */
    void *scratch;     /* room for one more state, for cycle_fold and cycle_unstable */
    double step_s;
    /* One step; what is observed. False: the system has left its range. */
    bool (*advance)(void *context, void *state, double *observed);
    /* Takes a state over to another parameter. */
    void (*retune)(void *context, void *state, double parameter);
    /* out = rest + share (state - rest), at the parameter of `state`; rest is the system's own. */
    void (*scale)(void *context, void *out, const void *state, double share);
};

struct cycle_limits {
    double rest;       /* an amplitude below this is rest */
    double grown;      /* one above is a cycle that stays, settled or not; 0: all must settle */
    double tolerance;  /* of the settled amplitude, relative */
    double longest_s;  /* simulated time to settle in; also the longest wait for a period */
    unsigned averaged; /* periods whose amplitudes are averaged before they are compared, >= 1 */
};

enum cycle_end {
    CYCLE_REST,      /* it decayed, or will, as far as its amplitudes tell */
    CYCLE_STAYS,     /* a settled cycle */
    CYCLE_IRREGULAR, /* it goes on for good, but no two periods are alike: means of 100 */
    CYCLE_UNSETTLED, /* neither within the time: figures are means of its last fifth, 0: none */
    CYCLE_LOST       /* the system left its range */
};

struct cycle {
    enum cycle_end end;
    double amplitude; /* half the distance of the extremes, mean of periods */
    double mean;      /* midway between the extremes */
    double frequency_Hz;
    double time_s;         /* simulated */
    double least;          /* amplitudes of the smallest and the largest period that went into */
    double most;           /* the means */
    double slowest;        /* the amplitude at which it changed least */
    double slowest_Hz;     /* its frequency */
    double slowest_change; /* relative, from one average to the next */
};

/* Lets `state` settle, in place. */
void cycle_settle(const struct cycle_system *system, const struct cycle_limits *limits, void *state,
                  struct cycle *cycle);

/*
 * The parameter at which cycles end, between `low`, where one started from `state` decays, and
 * `high`, where `state` stays; `state` becomes the last one that stays, and `cycle` its figures.
 * `*low` and `*high` move together until they are `near` each other. False: lost on the way.
 */
bool cycle_fold(const struct cycle_system *system, const struct cycle_limits *limits, double near,
                double *low, double *high, void *state, struct cycle *cycle);

/*
 * The unstable cycle between rest and the stable one in `state`, whose amplitude is `stable`, at its
 * parameter: the amplitude at which a start between both lingers. False: what is nearly at rest
 * grows, so there is none.
 */
bool cycle_unstable(const struct cycle_system *system, const struct cycle_limits *limits,
                    const void *state, double stable, struct cycle *cycle);

#endif
