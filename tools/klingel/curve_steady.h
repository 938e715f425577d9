/*
 * curve_steady.h - a vehicle's steady running in one curve. Private to cmd_curve.c.
 */
#ifndef CURVE_STEADY_H
#define CURVE_STEADY_H

#include "modes_steady.h"

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
    bool unstable; /* disturbed by ever so little, the vehicle leaves this state */
    char why[280]; /* none was found */
    /* What does not add up, N: of all wheels' Y against the centrifugal force less what the cant
     * carries, and of all Q against the weight. Relative to the weight: divide by it. */
    double lateral_N;
    double vertical_N;
    double weight_N;
    double aside_N; /* centrifugal force less what the cant carries, positive right */
    bool
        grounded; /* elements to the ground take forces too: the balance is not that of the wheels */
};

/* A model whose track can be bent as often as wanted: the vehicle is built once. */
struct curve_bench {
    struct cli_model *m;
    struct modes_names names;
    struct modes modes;              /* large; for the stability */
    unsigned char memory[64 * 1024]; /* of the track */
};

/*
 * The steady state is followed from `before` (NULL: none) to this curve and its speed, curvature,
 * cant and speed together, by Newton's method with the secant as its guess, in steps that shorten
 * where that fails; from straight track if there is no way from `before`; and last by simulation
 * for `longest_s` at most, and Newton from there. CLI_OK, also where nothing was found, or
 * CLI_FAILED (printed).
 */
int curve_find(struct curve_bench *bench, const struct curve_case *at,
               const struct curve_result *before, double longest_s, struct curve_result *result);

#endif
