/* cycle.c - settling, folds and thresholds of limit cycles. */
#include "cycle.h"

#include <math.h>
#include <string.h>

#define HALVINGS 30         /* of the disturbance */
#define APART 1e-3          /* relative: closer to the stable cycle than that is the stable cycle */
#define LEAST_SHARE 1e-3    /* of a cycle; what grows from there has no threshold */
#define ABOVE_REST 3.0      /* and that much larger than what counts as rest */
#define STILL 1e-9          /* relative: of a cycle that lingers where it is unstable */
#define SURELY_DECAYS 0.3   /* of an amplitude that is known to decay */
#define ROUNDING 1e-12      /* relative; no smaller change means anything */
#define SETTLING_RATIO 0.98 /* of successive changes; above, their sum is not trusted */
#define ARMING 0.25         /* of the amplitude, below the level that begins a period */
#define QUIET_PERIODS 20.0  /* without a crossing, in units of the last period: no oscillation */

/* ---- periods of the observed signal ---- */

struct watch {
    double step_s;
    double before[2]; /* the last two samples */
    unsigned samples; /* 2 when both are there */
    double level;     /* whose upward crossings begin periods */
    bool armed;       /* it was well below since the last one */
    double high;      /* extremes of this period */
    double low;
    double crossed_s; /* when the period began; NAN: none has */
    double now_s;
    /* the last whole period */
    double amplitude;
    double mean;
    double period_s;
};

/* The top of the parabola through three samples, where the middle one is the largest. */
static double peak(double a, double b, double c) {
    double bend = a - 2.0 * b + c;
    return bend < 0.0 ? b - (c - a) * (c - a) / (8.0 * bend) : b;
}

static void begin_period(struct watch *w, double at_s, double value) {
    w->crossed_s = at_s;
    w->high = value;
    w->low = value;
}

/* Until the level has been crossed it is the middle of what has been seen. */
static void look_for_level(struct watch *w, double x) {
    w->high = w->samples == 0 ? x : fmax(w->high, x);
    w->low = w->samples == 0 ? x : fmin(w->low, x);
    w->level = 0.5 * (w->high + w->low);
}

/* Takes one sample in. True when a period has ended. */
static bool watch_sample(struct watch *w, double x) {
    bool ended = false;
    if (isnan(w->crossed_s)) {
        look_for_level(w, x);
    }
    const double a = w->before[0];
    const double b = w->before[1];
    w->armed = w->armed || x < w->level - ARMING * w->amplitude;
    if (w->samples == 2) {
        if (b >= a && b >= x) {
            w->high = fmax(w->high, peak(a, b, x));
        }
        if (b <= a && b <= x) {
            w->low = fmin(w->low, -peak(-a, -b, -x));
        }
        if (w->armed && b < w->level && x >= w->level) {
            w->armed = false;
            double at_s = w->now_s + w->step_s * (w->level - b) / (x - b);
            if (!isnan(w->crossed_s)) {
                w->amplitude = 0.5 * (w->high - w->low);
                w->mean = 0.5 * (w->high + w->low);
                w->period_s = at_s - w->crossed_s;
                w->level = w->mean;
                ended = true;
            }
            begin_period(w, at_s, w->level);
        }
    }
    w->samples += w->samples < 2;
    w->before[0] = b;
    w->before[1] = x;
    w->now_s += w->step_s;
    return ended;
}

/* ---- settling ---- */

struct average {
    unsigned n;
    double amplitude;
    double mean;
    double period_s;
};

static void add(struct average *a, const struct watch *w) {
    a->n++;
    a->amplitude += w->amplitude;
    a->mean += w->mean;
    a->period_s += w->period_s;
}

static void take(struct cycle *c, const struct average *a) {
    double n = a->n > 0 ? (double)a->n : 1.0;
    c->amplitude = a->amplitude / n;
    c->mean = a->mean / n;
    c->frequency_Hz = a->period_s > 0.0 ? n / a->period_s : 0.0;
}

/* Successive changes that shrink by a ratio add up to a remainder, which must be small. */
static bool has_settled(const double amplitude[3], double tolerance) {
    double before = amplitude[1] - amplitude[0];
    double now = amplitude[2] - amplitude[1];
    double size = fabs(amplitude[2]);
    if (fabs(now) <= ROUNDING * size) {
        return true;
    }
    double ratio = now / before;
    if (!(ratio < SETTLING_RATIO) || ratio < -SETTLING_RATIO) {
        return false;
    }
    double rest = ratio > 0.0 ? fabs(now * ratio / (1.0 - ratio)) : fabs(now);
    return fmax(rest, fabs(now)) < tolerance * size;
}

struct settling {
    const struct cycle_limits *limits;
    struct watch watch;
    struct average some;
    struct average late;
    double amplitude[3];
    unsigned averages;
};

static void compare(struct settling *s, struct cycle *c) {
    take(c, &s->some);
    memset(&s->some, 0, sizeof s->some);
    memmove(s->amplitude, s->amplitude + 1, 2 * sizeof s->amplitude[0]);
    s->amplitude[2] = c->amplitude;
    s->averages++;
    double change = fabs(s->amplitude[2] - s->amplitude[1]) / fmax(fabs(c->amplitude), 1e-300);
    if (s->averages > 2 && change < c->slowest_change) {
        c->slowest_change = change;
        c->slowest = c->amplitude;
        c->slowest_Hz = c->frequency_Hz;
    }
}

/* After a period. True when the outcome is known. */
static bool judge(struct settling *s, struct cycle *c) {
    add(&s->some, &s->watch);
    if (c->time_s > 0.75 * s->limits->longest_s) {
        add(&s->late, &s->watch);
    }
    if (s->watch.amplitude < s->limits->rest) {
        c->end = CYCLE_REST;
        return true;
    }
    if (s->some.n < s->limits->averaged) {
        return false;
    }
    compare(s, c);
    if (s->limits->grown > 0.0 && c->amplitude > s->limits->grown) {
        c->end = CYCLE_STAYS;
        return true;
    }
    if (s->averages >= 3 && has_settled(s->amplitude, s->limits->tolerance)) {
        c->end = CYCLE_STAYS;
        return true;
    }
    return false;
}

/* No crossing of the level for long: what does not swing is at rest. */
static bool is_quiet(const struct settling *s) {
    const struct watch *w = &s->watch;
    double since = w->now_s - (isnan(w->crossed_s) ? 0.0 : w->crossed_s);
    return w->period_s > 0.0 && since > QUIET_PERIODS * w->period_s;
}

void cycle_settle(const struct cycle_system *system, const struct cycle_limits *limits, void *state,
                  struct cycle *c) {
    struct settling s = {.limits = limits};
    s.watch.step_s = system->step_s;
    s.watch.crossed_s = (double)NAN;
    memset(c, 0, sizeof *c);
    c->end = CYCLE_UNSETTLED;
    c->slowest_change = HUGE_VAL;
    while (c->time_s < limits->longest_s) {
        double x = 0.0;
        if (!system->advance(system->context, state, &x)) {
            c->end = CYCLE_LOST;
            return;
        }
        c->time_s += system->step_s;
        if (watch_sample(&s.watch, x)) {
            if (judge(&s, c)) {
                return;
            }
        } else if (is_quiet(&s)) {
            c->end = CYCLE_REST;
            return;
        }
    }
    if (s.late.n == 0) {
        c->end = CYCLE_REST; /* it does not swing at all */
    } else {
        take(c, &s.late);
    }
}

/* ---- the fold ---- */

bool cycle_fold(const struct cycle_system *system, const struct cycle_limits *limits, double near,
                double *low, double *high, void *state, struct cycle *cycle) {
    void *tried = system->scratch;
    while (fabs(*high - *low) > near) {
        double middle = 0.5 * (*low + *high);
        struct cycle found;
        if (middle == *low || middle == *high) {
            break;
        }
        memcpy(tried, state, system->state_size);
        system->retune(system->context, tried, middle);
        cycle_settle(system, limits, tried, &found);
        if (found.end == CYCLE_LOST) {
            return false;
        }
        if (found.end == CYCLE_REST) {
            *low = middle;
        } else {
            *high = middle;
            *cycle = found;
            memcpy(state, tried, system->state_size);
        }
    }
    return true;
}

/* ---- the threshold ---- */

bool cycle_unstable(const struct cycle_system *system, const struct cycle_limits *limits,
                    const void *state, double stable, struct cycle *cycle) {
    void *tried = system->scratch;
    double decays = fmax(LEAST_SHARE, ABOVE_REST * limits->rest / stable);
    double grows = 1.0;
    struct cycle found;
    struct cycle_limits quick = *limits;
    quick.tolerance = STILL;
    quick.grown = stable * (1.0 - APART);
    quick.averaged = 1; /* what passes by shall be seen */
    system->scale(system->context, tried, state, decays);
    cycle_settle(system, &quick, tried, &found);
    if (found.end != CYCLE_REST) {
        return false;
    }
    *cycle = found;
    for (int i = 0; i < HALVINGS; i++) {
        double middle = sqrt(decays * grows);
        system->scale(system->context, tried, state, middle);
        cycle_settle(system, &quick, tried, &found);
        if (found.end == CYCLE_STAYS && found.amplitude < quick.grown) {
            *cycle = found; /* lingers so long that it counts as settled */
            return true;
        }
        if (found.end == CYCLE_REST) {
            decays = middle;
            quick.rest = fmax(limits->rest, SURELY_DECAYS * decays * stable);
            *cycle = found;
        } else {
            grows = middle;
        }
    }
    cycle->amplitude = cycle->slowest;
    cycle->frequency_Hz = cycle->slowest_Hz;
    return true;
}
