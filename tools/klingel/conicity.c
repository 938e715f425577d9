/* conicity.c - the integral of y'' + delta_r / (e r0) = 0 over one wavelength, stretch by stretch. */
#include "conicity.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
#define HALVINGS 100

/* ---- the function ---- */

static long first_fault(const double *y, const double *r, size_t n) {
    if (n < CONICITY_MIN_POINTS || n > CONICITY_MAX_POINTS) {
        return (long)n + 1;
    }
    for (size_t i = 0; i < n; i++) {
        bool back = i > 0 && !(y[i] >= y[i - 1]);
        bool third = i > 1 && y[i] <= y[i - 2];
        if (!isfinite(y[i]) || !isfinite(r[i]) || back || third) {
            return (long)i + 1;
        }
    }
    return 0;
}

long conicity_curve_make(struct conicity_curve *curve, const double *y_m, const double *delta_r_m,
                         size_t n) {
    memset(curve, 0, sizeof *curve);
    long fault = first_fault(y_m, delta_r_m, n);
    if (fault != 0) {
        return fault;
    }
    double *memory = malloc(3 * n * sizeof *memory);
    if (memory == NULL) {
        return -1;
    }
    *curve = (struct conicity_curve){n, memory, memory + n, memory + 2 * n};
    memcpy(curve->y_m, y_m, n * sizeof *y_m);
    memcpy(curve->delta_r_m, delta_r_m, n * sizeof *delta_r_m);
    curve->integral_m2[0] = 0.0;
    for (size_t i = 1; i < n; i++) {
        curve->integral_m2[i] = curve->integral_m2[i - 1] +
                                0.5 * (y_m[i] - y_m[i - 1]) * (delta_r_m[i] + delta_r_m[i - 1]);
    }
    return 0;
}

void conicity_curve_free(struct conicity_curve *curve) {
    free(curve->y_m);
    memset(curve, 0, sizeof *curve);
}

/* The stretch [i, i + 1] that holds y; of none of no length. */
static size_t stretch_of(const struct conicity_curve *c, double y) {
    size_t low = 0;
    size_t high = c->n - 1;
    while (high - low > 1) {
        size_t middle = (low + high) / 2;
        if (c->y_m[middle] <= y) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low > 0 && c->y_m[low] >= c->y_m[low + 1] ? low - 1 : low;
}

struct place {
    double delta_r;
    double integral;
};

static struct place place_in(const struct conicity_curve *c, size_t i, double y) {
    double length = c->y_m[i + 1] - c->y_m[i];
    double along = fmin(fmax(y - c->y_m[i], 0.0), length);
    double rise = length > 0.0 ? (c->delta_r_m[i + 1] - c->delta_r_m[i]) * along / length : 0.0;
    return (struct place){c->delta_r_m[i] + rise,
                          c->integral_m2[i] + along * (c->delta_r_m[i] + 0.5 * rise)};
}

static struct place place_at(const struct conicity_curve *c, double y) {
    return place_in(c, stretch_of(c, y), y);
}

double conicity_delta_r(const struct conicity_curve *curve, double y_m) {
    for (size_t i = 1; i < curve->n; i++) {
        if (curve->y_m[i] == y_m && curve->y_m[i - 1] == y_m) {
            return 0.5 * (curve->delta_r_m[i] + curve->delta_r_m[i - 1]);
        }
    }
    return place_at(curve, y_m).delta_r;
}

int conicity_rolling_line(const struct conicity_curve *curve, double *y_m) {
    int found = -1;
    for (size_t i = 0; i + 1 < curve->n; i++) {
        double here = curve->delta_r_m[i];
        double next = curve->delta_r_m[i + 1];
        if (!(here <= 0.0 && next >= 0.0 && next > here)) {
            continue;
        }
        double y = curve->y_m[i] + (curve->y_m[i + 1] - curve->y_m[i]) * here / (here - next);
        if (found != 0 || fabs(y) < fabs(*y_m)) {
            *y_m = y;
            found = 0;
        }
    }
    return found;
}

/* ---- one motion ---- */

/* How much more of P lies behind y + 2 amplitude than behind y: zero where they are turning points. */
static double excess(const struct conicity_curve *c, double low, double amplitude) {
    return place_at(c, low + 2.0 * amplitude).integral - place_at(c, low).integral;
}

/* A search for the motion of one amplitude. */
struct search {
    const struct conicity_curve *curve;
    double amplitude;
    double centre; /* the rolling line */
    double low;    /* lower turning point of the motion found */
    bool found;
};

/* True if P stays below its value at the turning points all the way between them: otherwise the
 * wheelset turns round earlier, or hangs on the top. */
static bool is_open(const struct conicity_curve *c, double low, double high) {
    const double level = place_at(c, low).integral;
    const double margin = 1e-9 * (high - low); /* a point may be the turning point itself */
    for (size_t i = 0; i + 1 < c->n; i++) {
        double y0 = c->y_m[i];
        double f0 = c->delta_r_m[i];
        double f1 = c->delta_r_m[i + 1];
        bool inside = y0 > low + margin && y0 < high - margin;
        if (inside && !(c->integral_m2[i] < level)) {
            return false;
        }
        if (f0 > 0.0 && f1 < 0.0) { /* a top between the points */
            double along = (c->y_m[i + 1] - y0) * f0 / (f0 - f1);
            inside = y0 + along > low && y0 + along < high;
            if (inside && !(c->integral_m2[i] + 0.5 * along * f0 < level)) {
                return false;
            }
        }
    }
    return true;
}

/* Halves [low, high], where `excess` goes from below to above zero, and keeps the motion if it is one
 * and nearer than what was found. */
static void take_between(struct search *s, double low, double high) {
    for (int i = 0; i < HALVINGS && high - low > 1e-16; i++) {
        double middle = 0.5 * (low + high);
        if (excess(s->curve, middle, s->amplitude) < 0.0) {
            low = middle;
        } else {
            high = middle;
        }
    }
    double y = 0.5 * (low + high);
    double away = fabs(y + s->amplitude - s->centre);
    if ((!s->found || away < fabs(s->low + s->amplitude - s->centre)) &&
        is_open(s->curve, y, y + 2.0 * s->amplitude)) {
        s->low = y;
        s->found = true;
    }
}

/*
 * `excess` is piecewise quadratic; its pieces end where either turning point meets a point of the
 * function, so a walk over these ends meets every change of sign.
 */
static enum conicity_status find_motion(struct search *s) {
    const struct conicity_curve *c = s->curve;
    const double wide = c->y_m[c->n - 1] - c->y_m[0];
    double last = c->y_m[c->n - 1] - 2.0 * s->amplitude;
    if (last < c->y_m[0] - 1e-12 * wide) {
        return CONICITY_BEYOND;
    }
    last = fmax(last, c->y_m[0]);
    double at = c->y_m[0];
    const double first = excess(c, at, s->amplitude);
    const double tiny = 1e-8 * wide * fabs(conicity_delta_r(c, c->y_m[c->n - 1]));
    double here = fabs(first) <= tiny ? 0.0 : first; /* the ends belong to the range */
    if (here == 0.0) {
        take_between(s, at, at);
    }
    size_t i = 0;
    size_t j = 0;
    while (at < last) {
        for (; i < c->n && c->y_m[i] <= at; i++) {
        }
        for (; j < c->n && c->y_m[j] - 2.0 * s->amplitude <= at; j++) {
        }
        double next = i < c->n ? fmin(c->y_m[i], last) : last;
        next = j < c->n ? fmin(next, c->y_m[j] - 2.0 * s->amplitude) : next;
        double there = excess(c, next, s->amplitude);
        there = next == last && fabs(there) <= tiny ? 0.0 : there;
        if (here < 0.0 && there >= 0.0) {
            take_between(s, at, next);
        }
        at = next;
        here = there;
    }
    if (!s->found) { /* a motion about a line nearer to an end than its amplitude */
        return first > 0.0 || here < 0.0 ? CONICITY_BEYOND : CONICITY_NONE;
    }
    return CONICITY_OK;
}

/* Distance (over sqrt(e r0)) that the wheelset rolls while it crosses a stretch; v are the slopes of
 * the path at its ends. With d the phase: tan(d / 2) = w dy / (v0 + v1), in which nothing cancels
 * and a turning point (v = 0) is a place like any other. */
static double crossing(double dy, double rise, double v0, double v1) {
    const double w = sqrt(fabs(rise) / dy);
    const double z = w * dy / (v0 + v1);
    if (z < 1e-6) {
        return 2.0 * dy / (v0 + v1); /* straight: the next term is z^2 / 3 of it */
    }
    return 2.0 / w * (rise > 0.0 ? atan(z) : atanh(z));
}

struct sums {
    double half_wave; /* over sqrt(e r0) */
    double moment;    /* integral of (y - middle) delta_r dy */
};

/* A turning point that all but meets a point of the function is taken to be there: beside it, the
 * difference of two values of P would be all rounding. */
static double settle(const struct conicity_curve *c, double y, double margin) {
    size_t i = stretch_of(c, y);
    if (fabs(y - c->y_m[i]) <= margin) {
        return c->y_m[i];
    }
    return fabs(y - c->y_m[i + 1]) <= margin ? c->y_m[i + 1] : y;
}

static struct sums integrate(const struct conicity_curve *c, double low, double high) {
    const double margin = 1e-9 * (high - low);
    const double middle = 0.5 * (low + high);
    struct sums sums = {0.0, 0.0};
    low = settle(c, low, margin);
    high = settle(c, high, margin);
    const double level = 0.5 * (place_at(c, low).integral + place_at(c, high).integral);
    for (size_t i = stretch_of(c, low); i + 1 < c->n && c->y_m[i] < high; i++) {
        bool first = c->y_m[i] <= low;
        bool last = c->y_m[i + 1] >= high;
        double a = first ? low : c->y_m[i];
        double b = last ? high : c->y_m[i + 1];
        double fa = first ? place_in(c, i, low).delta_r : c->delta_r_m[i];
        double fb = last ? place_in(c, i, high).delta_r : c->delta_r_m[i + 1];
        if (!(b > a)) {
            continue; /* a jump */
        }
        /* beside a turning point P is known from there without cancellation */
        double gain = (b - a) * fabs(fa + fb);
        double to_level0 = last ? gain : 2.0 * (level - c->integral_m2[i]);
        double to_level1 = first ? gain : 2.0 * (level - c->integral_m2[i + 1]);
        double v0 = first ? 0.0 : sqrt(fmax(to_level0, 0.0));
        double v1 = last ? 0.0 : sqrt(fmax(to_level1, 0.0));
        sums.half_wave += crossing(b - a, fb - fa, v0, v1);
        sums.moment +=
            (b - a) / 6.0 * ((a - middle) * (2.0 * fa + fb) + (b - middle) * (fa + 2.0 * fb));
    }
    return sums;
}

enum conicity_status conicity_at(const struct conicity_curve *curve, double amplitude_m,
                                 double base_m, double radius_m, struct conicity_motion *motion) {
    struct search search = {.curve = curve, .amplitude = amplitude_m};
    memset(motion, 0, sizeof *motion);
    if (!(amplitude_m > 0.0) || conicity_rolling_line(curve, &search.centre) != 0) {
        return CONICITY_NONE;
    }
    enum conicity_status status = find_motion(&search);
    if (status != CONICITY_OK) {
        return status;
    }
    const double length = 2.0 * amplitude_m;
    const struct sums sums = integrate(curve, search.low, search.low + length);
    const double wave = 2.0 * sums.half_wave;
    if (!(isfinite(wave) && wave > 0.0)) {
        return CONICITY_NONE;
    }
    motion->amplitude_m = amplitude_m;
    motion->low_m = search.low;
    motion->high_m = search.low + length;
    motion->wavelength_m = wave * sqrt(base_m * radius_m);
    motion->conicity = 2.0 * (PI / wave) * (PI / wave);
    motion->regression = 6.0 * sums.moment / (length * length * length);
    return CONICITY_OK;
}

double conicity_largest(const struct conicity_curve *curve) {
    /* the larger a motion, the nearer its turning points to the ends: a scan, then halvings, because
     * motions of some smaller amplitudes may be missing */
    struct conicity_motion motion;
    const double most = 0.5 * (curve->y_m[curve->n - 1] - curve->y_m[0]);
    const int steps = 200;
    double high = most;
    for (int i = steps; i > 0; i--) {
        double low = most * i / steps;
        if (conicity_at(curve, low, 1.0, 1.0, &motion) != CONICITY_OK) {
            high = low;
            continue;
        }
        while (high - low > 1e-9) {
            double middle = 0.5 * (low + high);
            if (conicity_at(curve, middle, 1.0, 1.0, &motion) == CONICITY_OK) {
                low = middle;
            } else {
                high = middle;
            }
        }
        return low;
    }
    return 0.0;
}
