/*
 * modes_critical.h - the speeds at which the stability of the linearised vehicle changes. Private to
 * cmd_modes.c and cmd_critical.c.
 */
#ifndef MODES_CRITICAL_H
#define MODES_CRITICAL_H

#include "modes_linear.h"

#define MODES_MAX_CROSSINGS 64
#define MODES_SCAN_STEP 0.5    /* m/s, between two looks at the stability */
#define MODES_MANY_STATES 200u /* of a train; above, looks take long, and are */
#define MODES_WIDE_STEP 2.5    /* m/s apart */

struct modes_crossing {
    double speed_m_s; /* to 1e-6 m/s */
    bool stable_below;
};

struct modes_scan {
    const struct kl_model *model;
    const struct modes_names *names;
    double at_m;
    double low_m_s;
    double high_m_s;
    struct modes *work; /* large; holds nothing afterwards */
    /* results */
    bool stable_at_low;
    size_t n;
    struct modes_crossing crossing[MODES_MAX_CROSSINGS]; /* in order of rising speed */
};

/* Looks from low to high in steps of MODES_SCAN_STEP (trains: MODES_WIDE_STEP), then bisects. Two changes within one step stay
 * unseen. CLI_OK, or CLI_FAILED (printed). */
int modes_scan(struct modes_scan *scan);

/* The mode with the largest real part that is not neutral; NULL: there is none. */
const struct mode *modes_least_stable(const struct modes *modes);

#endif
