/* modes_critical.c - critical speeds by bisection. */
#include "modes_critical.h"

#include <math.h>

#define BISECTED 1e-6 /* m/s */

static int look(struct modes_scan *scan, double speed_m_s, bool *stable) {
    const struct modes_request request = {
        .model = scan->model, .names = scan->names, .speed_m_s = speed_m_s, .at_m = scan->at_m};
    int status = modes_find(&request, scan->work);
    *stable = scan->work->largest_real < 0.0;
    return status;
}

/* The speed between the two at which stability changes; `stable` is that at `low`. */
static int bisect(struct modes_scan *scan, double low, double high, bool stable, double *speed) {
    while (high - low > BISECTED) {
        double middle = 0.5 * (low + high);
        bool there = false;
        int status = look(scan, middle, &there);
        if (status != CLI_OK) {
            return status;
        }
        if (there == stable) {
            low = middle;
        } else {
            high = middle;
        }
    }
    *speed = 0.5 * (low + high);
    return CLI_OK;
}

int modes_scan(struct modes_scan *scan) {
    bool stable = false;
    bool next_stable = false;
    double last = scan->low_m_s;
    scan->n = 0;
    int status = look(scan, last, &stable);
    scan->stable_at_low = stable;
    while (status == CLI_OK && last < scan->high_m_s) {
        double next = fmin(last + MODES_SCAN_STEP, scan->high_m_s);
        status = look(scan, next, &next_stable);
        if (status == CLI_OK && next_stable != stable) {
            if (scan->n == MODES_MAX_CROSSINGS) {
                return cli_fail("more than %d changes of stability", MODES_MAX_CROSSINGS);
            }
            struct modes_crossing *crossing = &scan->crossing[scan->n++];
            crossing->stable_below = stable;
            status = bisect(scan, last, next, stable, &crossing->speed_m_s);
            stable = next_stable;
        }
        last = next;
    }
    return status;
}

const struct mode *modes_least_stable(const struct modes *modes) {
    const struct mode *worst = NULL;
    for (uint32_t i = 0; i < modes->n_modes; i++) {
        const struct mode *mode = &modes->mode[i];
        if (hypot(mode->real, mode->imag) > MODES_NEUTRAL &&
            (worst == NULL || mode->real > worst->real)) {
            worst = mode;
        }
    }
    return worst;
}
