/*
 * curve_steady.h - a vehicle's steady running in one curve. Private to cmd_curve.c.
 */
#ifndef CURVE_STEADY_H
#define CURVE_STEADY_H

#include "modes_linear.h"

/* Where and how fast. Curvature and cant are signed as everywhere: positive in right-hand curves. */
struct curve_case {
    double radius_m;
    double speed_m_s;
    double cant_m; /* height of the outer rail over the inner one */
    double deficiency_m;
    double curvature_1_m;
    double cant_rad;
};

enum curve_way {
    CURVE_FOUND,     /* every rate is zero but for rounding */
    CURVE_SIMULATED, /* settled in time; the rates that are left are small */
    CURVE_NONE
};

struct curve_result {
    struct curve_case at;
    enum curve_way way;
    struct modes_steady steady;
    /* What does not add up, N: of all wheels' Y against the centrifugal force less what the cant
     * carries, and of all Q against the weight. Relative to the weight: divide by it. */
    double lateral_N;
    double vertical_N;
    double weight_N;
    double aside_N; /* centrifugal force less what the cant carries, positive right */
    bool
        grounded; /* elements to the ground take forces too: the balance is not that of the wheels */
};

/*
 * Newton from the state of `before` (NULL: none) moved into this curve, then from the centre of the
 * track; where neither is good, simulation for `longest_s` at most, and Newton from there. CLI_OK,
 * also where nothing was found, or CLI_FAILED (printed).
 */
int curve_find(const struct cli_model *m, const struct modes_names *names,
               const struct curve_case *at, const struct curve_result *before, double longest_s,
               struct curve_result *result);

#endif
