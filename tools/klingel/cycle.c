/* cycle.c - settling, folds and thresholds of limit cycles. */
#include "cycle.h"

#include <math.h>
#include <string.h>

#define HALVINGS 20         /* of the disturbance */
#define APART 1e-3          /* relative: closer to the stable cycle than that is the stable cycle */
#define LEAST_SHARE 1e-3    /* of a cycle; what grows from there has no threshold */
#define ABOVE_REST 3.0      /* and that much larger than what counts as rest */
#define STILL 1e-9          /* relative: of a cycle that lingers where it is unstable */
#define SURELY_DECAYS 0.3   /* of an amplitude that is known to decay */
#define ROUNDING 1e-12      /* relative; no smaller change means anything */
#define SETTLING_RATIO 0.98 /* of successive changes; above, their sum is not trusted */
#define ARMING 0.25         /* of the amplitude, below the level that begins a period */
#define SETTLED_RUN 3u      /* comparisons in a row that must say so: one may do so by chance */
#define REST_PERIODS 5u     /* in a row, and all of them together no larger than rest */
#define QUIET_PERIODS 20.0  /* without a crossing: the level is looked for anew */
#define FIRST_WAIT_S 10.0   /* the same, before a period is known */
#define BLOCK 100u          /* periods whose mean is looked at for a trend */
#define NO_TREND 0.01       /* relative, from one block to the next, twice */
#define NO_TREND_SHARE 0.1  /* of what periods within a block differ by */
#define ALIKE 0.01          /* relative: periods that differ by less make one cycle */
#define PARTS 5u            /* of the time; the last three tell where it goes when that is over */
#define TO_NOTHING 0.2      /* relative: what is extrapolated to less decays */

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
    double looked_s; /* since when the level has been looked for, if no period has begun */
    double most;     /* extremes of the samples themselves, since they were last forgotten */
    double least;
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

static void forget_extremes(struct watch *w) {
    w->most = -HUGE_VAL;
    w->least = HUGE_VAL;
}

static void watch_begin(struct watch *w, double step_s) {
    memset(w, 0, sizeof *w);
    w->step_s = step_s;
    w->crossed_s = (double)NAN;
    forget_extremes(w);
}

/* The motion has gone elsewhere: begins again, with the middle of where it is. */
static void look_again(struct watch *w) {
    w->level = 0.5 * (w->most + w->least);
    w->amplitude = 0.5 * (w->most - w->least);
    w->period_s = 0.0;
    w->crossed_s = (double)NAN;
    w->looked_s = w->now_s;
    w->armed = false;
    forget_extremes(w);
}

/* Takes one sample in. True when a period has ended. */
static bool watch_sample(struct watch *w, double x) {
    bool ended = false;
    w->most = fmax(w->most, x);
    w->least = fmin(w->least, x);
    if (isnan(w->crossed_s) && w->looked_s == 0.0) { /* the middle of what has been seen */
        w->level = 0.5 * (w->most + w->least);
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

/* Many periods that need not be alike. */
struct block {
    struct average sum;
    double least;
    double most;
};

struct settling {
    const struct cycle_limits *limits;
    struct watch watch;
    struct block block;
    struct block done[2]; /* the two before; n 0: none */
    struct average some;
    struct block part[PARTS]; /* of the time */
    double amplitude[3];
    unsigned averages;
    unsigned agreed; /* comparisons in a row that found it settled */
    unsigned small;  /* periods in a row that were rest */
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

static void keep(struct block *b, const struct watch *w) {
    b->least = b->sum.n == 0 ? w->amplitude : fmin(b->least, w->amplitude);
    b->most = b->sum.n == 0 ? w->amplitude : fmax(b->most, w->amplitude);
    add(&b->sum, w);
}

static void take_block(struct cycle *c, const struct block *b) {
    take(c, &b->sum);
    c->least = b->least;
    c->most = b->most;
}

/*
 * The motion stays as it is though its periods differ: three blocks have the same mean, as far as
 * that can be told, and what differs is no slow growth or decay.
 */
static bool is_stationary(struct settling *s, struct cycle *c) {
    keep(&s->block, &s->watch);
    if (s->block.sum.n < BLOCK) {
        return false;
    }
    const struct block all[3] = {s->done[0], s->done[1], s->block};
    s->done[0] = s->done[1];
    s->done[1] = s->block;
    memset(&s->block, 0, sizeof s->block);
    if (all[0].sum.n == 0) {
        return false;
    }
    double mean[3];
    double spread = HUGE_VAL;
    for (int i = 0; i < 3; i++) {
        mean[i] = all[i].sum.amplitude / (double)BLOCK;
        spread = fmin(spread, all[i].most - all[i].least);
    }
    const double drift = fmax(fabs(mean[1] - mean[0]), fabs(mean[2] - mean[1]));
    if (drift > NO_TREND * mean[2] || drift > NO_TREND_SHARE * spread) {
        return false;
    }
    take_block(c, &all[2]);
    c->end = c->most - c->least < ALIKE * c->amplitude ? CYCLE_STAYS : CYCLE_IRREGULAR;
    return true;
}

static void keep_part(struct settling *s, const struct cycle *c) {
    const double at = c->time_s / s->limits->longest_s * (double)PARTS;
    const unsigned part = at < (double)PARTS ? (unsigned)at : PARTS - 1u;
    keep(&s->part[part], &s->watch);
}

/*
 * When the time is over: a decay too slow to have ended. Its amplitude falls, and the geometric
 * series of its changes adds up to nearly all of it.
 */
static bool is_decaying(const struct settling *s) {
    double mean[3];
    for (unsigned i = 0; i < 3; i++) {
        const struct block *b = &s->part[PARTS - 3u + i];
        if (b->sum.n == 0) {
            return false;
        }
        mean[i] = b->sum.amplitude / (double)b->sum.n;
    }
    const double ratio = (mean[2] - mean[1]) / (mean[1] - mean[0]);
    if (!(mean[2] < mean[1] && mean[1] < mean[0] && ratio < 1.0)) {
        return false;
    }
    return mean[2] + (mean[2] - mean[1]) * ratio / (1.0 - ratio) < TO_NOTHING * mean[2];
}

/* Small periods alone can be ripple on something slower. */
static bool is_rest(struct settling *s) {
    if (!(s->watch.amplitude < s->limits->rest)) {
        s->small = 0;
        return false;
    }
    if (s->small++ == 0) {
        forget_extremes(&s->watch);
    }
    return s->small > REST_PERIODS && 0.5 * (s->watch.most - s->watch.least) < s->limits->rest;
}

/* After a period. True when the outcome is known. */
static bool judge(struct settling *s, struct cycle *c) {
    add(&s->some, &s->watch);
    keep_part(s, c);
    if (is_rest(s)) {
        c->end = CYCLE_REST;
        return true;
    }
    if (is_stationary(s, c)) {
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
    const bool settled = s->averages >= 3 && has_settled(s->amplitude, s->limits->tolerance);
    s->agreed = settled ? s->agreed + 1 : 0;
    if (s->agreed == SETTLED_RUN && c->amplitude >= s->limits->rest) {
        c->end = CYCLE_STAYS;
        c->least = c->amplitude;
        c->most = c->amplitude;
        return true;
    }
    return false;
}

/* No crossing of the level for long: at rest, or somewhere else. True when it is rest. */
static bool is_quiet(struct settling *s) {
    struct watch *w = &s->watch;
    const double since = w->now_s - (isnan(w->crossed_s) ? w->looked_s : w->crossed_s);
    if (since < (w->period_s > 0.0 ? QUIET_PERIODS * w->period_s : FIRST_WAIT_S)) {
        return false;
    }
    if (0.5 * (w->most - w->least) < s->limits->rest) {
        return true;
    }
    look_again(w);
    memset(&s->some, 0, sizeof s->some);
    memset(&s->block, 0, sizeof s->block);
    memset(s->done, 0, sizeof s->done);
    s->averages = 0;
    s->agreed = 0;
    s->small = 0;
    return false;
}

void cycle_settle(const struct cycle_system *system, const struct cycle_limits *limits, void *state,
                  struct cycle *c) {
    struct settling s = {.limits = limits};
    watch_begin(&s.watch, system->step_s);
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
            c->mean = x;
            return;
        }
    }
    take_block(c, &s.part[PARTS - 1u]);
    c->end = is_decaying(&s) ? CYCLE_REST : CYCLE_UNSETTLED;
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
