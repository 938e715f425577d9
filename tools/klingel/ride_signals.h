/*
 * ride_signals.h - a run over irregular track and what is measured on the way. Private to
 * cmd_ride.c.
 */
#ifndef RIDE_SIGNALS_H
#define RIDE_SIGNALS_H

#include "cli_progress.h"

#define RIDE_MAX_POINTS 16

/* An accelerometer on a body: feels the lateral acceleration, gravity by the body's lean included,
 * and the vertical one. */
struct ride_point {
    char name[KL_NAME_SIZE + 16];
    uint32_t body;
    double ahead_m;  /* of the body's centre of mass */
    double height_m; /* above the rail */
    bool floor;      /* of the car body, else on a frame */
};

struct ride_record {
    const struct kl_model *model;
    double rate_Hz;
    double speed_m_s;
    uint32_t n_points;
    struct ride_point point[RIDE_MAX_POINTS];
    size_t n;     /* samples */
    size_t first; /* ... to be assessed: those before let filters settle */
    double *s_m;
    double *lateral[RIDE_MAX_POINTS]; /* m/s2 */
    double *vertical[RIDE_MAX_POINTS];
    double *y_N[KL_MAX_WHEELSETS][KL_SIDES]; /* outwards positive */
    double *q_N[KL_MAX_WHEELSETS][KL_SIDES];
    double *sum_y_N[KL_MAX_WHEELSETS];
    uint32_t faults;
    double ended_s; /* simulated time; early where it derailed */
};

/* Where accelerations are measured if nobody says so: on the heaviest body at floor height over the
 * leading and the trailing wheelsets and in the middle between, and on every other body that has
 * the freedom y. */
void ride_points(struct ride_record *record, double floor_m);

struct ride_run {
    double from_m;
    double to_m;
    double assess_from_m;
    struct cli_progress *progress;
};

/* CLI_OK or CLI_FAILED (printed). To be freed in any case. */
int ride_simulate(struct ride_record *record, const struct ride_run *run);
void ride_free(struct ride_record *record);

#endif
