/* modes_critical.c - critical speeds by bisection. */
#include "modes_critical.h"

#include <math.h>

#define BISECTED 1e-6 /* m/s */

static int look(struct modes_scan *scan, double speed_m_s, double *real) {
    const struct modes_request request = {
        .model = scan->model, .names = scan->names, .speed_m_s = speed_m_s, .at_m = scan->at_m};
    int status = modes_find(&request, scan->work);
    *real = scan->work->largest_real;
    return status;
}

/*
 * Where the largest real part changes its sign, between two speeds: by the secant, with its stale end
 * halved (Illinois), as long as that is quicker than bisection.
 */
static int bisect(struct modes_scan *scan, double low, double high, double at_low, double at_high,
                  double *speed) {
    const bool stable = at_low < 0.0;
    for (int i = 0; high - low > BISECTED; i++) {
        double next = low - at_low * (high - low) / (at_high - at_low);
        double real = 0.0;
        const bool secant = i % 3 != 2 && isfinite(next) && next > low && next < high;
        next = secant ? fmin(fmax(next, low + 0.3 * BISECTED), high - 0.3 * BISECTED)
                      : 0.5 * (low + high);
        int status = look(scan, next, &real);
        if (status != CLI_OK) {
            return status;
        }
        if ((real < 0.0) == stable) {
            low = next;
            at_low = real;
            at_high *= 0.5;
        } else {
            high = next;
            at_high = real;
            at_low *= 0.5;
        }
    }
    *speed = 0.5 * (low + high);
    return CLI_OK;
}

int modes_scan(struct modes_scan *scan) {
    double real = 0.0;
    double next_real = 0.0;
    double last = scan->low_m_s;
    scan->n = 0;
    int status = look(scan, last, &real);
    scan->stable_at_low = real < 0.0;
    const double step =
        scan->model->n_states > MODES_MANY_STATES ? MODES_WIDE_STEP : MODES_SCAN_STEP;
    while (status == CLI_OK && last < scan->high_m_s) {
        double next = fmin(last + step, scan->high_m_s);
        status = look(scan, next, &next_real);
        if (status == CLI_OK && (next_real < 0.0) != (real < 0.0)) {
            if (scan->n == MODES_MAX_CROSSINGS) {
                return cli_fail("more than %d changes of stability", MODES_MAX_CROSSINGS);
            }
            struct modes_crossing *crossing = &scan->crossing[scan->n++];
            crossing->stable_below = real < 0.0;
            status = bisect(scan, last, next, real, next_real, &crossing->speed_m_s);
        }
        real = next_real;
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
