/* critical_follow.c - branches of limit cycles. */
#include "critical_follow.h"

#include <math.h>

#define HARDLY 2.0       /* times what counts as rest: the weak disturbance */
#define SURELY_REST 1e-3 /* times that: the weak disturbance has decayed */
#define FIRST_ABOVE 0.5  /* m/s above the linear critical speed, doubled until it leaves rest */
#define SAME 0.03        /* relative: cycles of such amplitudes are one */
#define SMALL 0.2        /* relative */
#define AT_LINEAR 0.1    /* m/s: an end of hunting nearer than that is the linear critical speed */
static const double below_the_end[] = {0.95, 0.85, 0.7, 0.5, 0.3}; /* of the end of a branch */

static bool is_full(const struct critical_search *s) {
    return s->result->n == CRITICAL_MOST_POINTS;
}

static void add_point(struct critical_search *s, double speed_m_s, const struct cycle *cycle,
                      const struct kl_state *state) {
    struct critical_result *r = s->result;
    if (!is_full(s)) {
        r->point[r->n] = (struct critical_point){
            .speed_m_s = speed_m_s, .branch = r->n_branches, .cycle = *cycle};
        s->state[r->n++] = *state;
    }
}

static void say_doing(struct critical_search *s, const char *what, double speed_m_s) {
    snprintf(s->doing, sizeof s->doing, "%s at %.4g m/s", what, speed_m_s);
    s->vehicle->doing = s->doing;
}

/* Disturbed at one speed. */
static int disturb(struct critical_search *s, double speed_m_s, double aside_m,
                   struct kl_state *state, struct cycle *cycle) {
    say_doing(s, "disturbed", speed_m_s);
    int status = critical_start(s->vehicle, speed_m_s, aside_m, state);
    if (status == CLI_OK) {
        cycle_settle(&s->system, &s->limits, state, cycle);
    }
    return status;
}

static void settle_at(struct critical_search *s, double speed_m_s, struct kl_state *state,
                      struct cycle *cycle) {
    say_doing(s, "hunting", speed_m_s);
    s->system.retune(s->system.context, state, speed_m_s);
    cycle_settle(&s->system, &s->limits, state, cycle);
}

/* ---- down one branch ---- */

static void end_branch(struct critical_search *s, double low, double high, struct kl_state *state,
                       const struct cycle *last) {
    struct critical_end *end = &s->result->end[s->result->n_branches];
    say_doing(s, "end of hunting", high);
    end->cycle = *last;
    end->rest_m_s = low;
    end->hunts_m_s = high;
    s->system.retune(s->system.context, state, high);
    end->found = cycle_fold(&s->system, &s->limits, s->near_m_s, &end->rest_m_s, &end->hunts_m_s,
                            state, &end->cycle);
}

/* From a cycle at `speed` on. Returns the speed at which it is no longer followed. */
static double go_down(struct critical_search *s, double speed, struct kl_state *state,
                      const struct cycle *first) {
    struct critical_result *r = s->result;
    struct cycle last = *first;
    const double from = speed;
    add_point(s, speed, first, state);
    for (double i = 1.0; from - i * s->step_m_s >= s->low_m_s - 1e-9 && !is_full(s); i += 1.0) {
        const double next = from - i * s->step_m_s;
        struct kl_state here = *state;
        struct cycle cycle;
        settle_at(s, next, &here, &cycle);
        if (cycle.end == CYCLE_REST) {
            end_branch(s, next, speed, state, &last);
            speed = r->end[r->n_branches].rest_m_s;
            break;
        }
        add_point(s, next, &cycle, &here);
        speed = next;
        if (cycle.end == CYCLE_LOST) {
            break;
        }
        *state = here;
        last = cycle;
    }
    r->n_branches++;
    return speed;
}

/* ---- from above ---- */

/* Strongly disturbed at the highest speed and down from there until it hunts, and follows that. */
static int from_above(struct critical_search *s) {
    for (double speed = s->high_m_s; speed >= s->low_m_s; speed -= s->step_m_s) {
        struct kl_state state;
        struct cycle cycle;
        int status = disturb(s, speed, s->aside_m, &state, &cycle);
        if (status != CLI_OK) {
            return status;
        }
        if (critical_hunts(&cycle)) {
            (void)go_down(s, speed, &state, &cycle);
            return CLI_OK;
        }
        add_point(s, speed, &cycle, &state);
    }
    return CLI_OK;
}

/* Where the last branch ended, something else may still hunt if disturbed. */
static int below_all(struct critical_search *s) {
    const struct critical_result *r = s->result;
    const size_t n = sizeof below_the_end / sizeof below_the_end[0];
    double base = r->n_branches > 0 && r->end[r->n_branches - 1].found
                      ? r->end[r->n_branches - 1].rest_m_s
                      : 0.0;
    for (size_t i = 0; i < n && r->n_branches < CRITICAL_MOST_BRANCHES - 1; i++) {
        const double speed = below_the_end[i] * base;
        struct kl_state state;
        struct cycle cycle;
        if (speed < s->low_m_s) {
            break;
        }
        int status = disturb(s, speed, s->aside_m, &state, &cycle);
        if (status != CLI_OK) {
            return status;
        }
        if (critical_hunts(&cycle)) {
            base = go_down(s, speed, &state, &cycle);
            i = (size_t)-1; /* and again below that */
        }
    }
    return CLI_OK;
}

/* ---- from below ---- */

static bool is_same(const struct cycle *a, const struct cycle *b) {
    const double apart = fabs(a->amplitude - b->amplitude);
    return apart < SAME * a->amplitude || apart < 0.5 * (a->most - a->least);
}

/* The cycle that a known branch has at a speed: from its nearest point. */
static bool cycle_of_branch(struct critical_search *s, unsigned branch, double speed_m_s,
                            struct cycle *cycle) {
    const struct critical_result *r = s->result;
    size_t nearest = CRITICAL_MOST_POINTS;
    double least = 3.0 * s->step_m_s;
    for (size_t i = 0; i < r->n; i++) {
        const struct critical_point *p = &r->point[i];
        const double apart = fabs(p->speed_m_s - speed_m_s);
        if (p->branch == branch && critical_hunts(&p->cycle) && apart < least) {
            nearest = i;
            least = apart;
        }
    }
    if (nearest == CRITICAL_MOST_POINTS) {
        return false;
    }
    struct kl_state state = s->state[nearest];
    settle_at(s, speed_m_s, &state, cycle);
    return critical_hunts(cycle);
}

/* Hardly disturbed: also what is smaller than rest may grow. */
static int disturb_hardly(struct critical_search *s, double speed_m_s, struct kl_state *state,
                          struct cycle *cycle) {
    const double rest = s->limits.rest;
    s->limits.rest = SURELY_REST * rest;
    int status = disturb(s, speed_m_s, HARDLY * rest, state, cycle);
    s->limits.rest = rest;
    return status;
}

/* Hardly disturbed above the linear critical speed, as near to it as it leaves rest and settles in
 * time. */
static int leave_rest(struct critical_search *s, double critical_m_s, double *speed,
                      struct kl_state *state, struct cycle *cycle) {
    for (double above = FIRST_ABOVE; critical_m_s + above <= s->high_m_s; above *= 2.0) {
        *speed = critical_m_s + above;
        int status = disturb_hardly(s, *speed, state, cycle);
        if (status != CLI_OK || cycle->end == CYCLE_LOST ||
            (critical_hunts(cycle) && cycle->end != CYCLE_UNSETTLED)) {
            return status;
        }
    }
    *speed = 0.0;
    return CLI_OK;
}

static int from_below(struct critical_search *s, double critical_m_s) {
    struct critical_result *r = s->result;
    struct kl_state state;
    struct cycle cycle;
    double speed = 0.0;
    int status = leave_rest(s, critical_m_s, &speed, &state, &cycle);
    if (status != CLI_OK || speed == 0.0) {
        return status;
    }
    r->grows = cycle;
    r->grows_m_s = speed;
    if (!critical_hunts(&cycle)) {
        return CLI_OK;
    }
    for (unsigned b = 0; b < r->n_branches; b++) {
        struct cycle known;
        if (cycle_of_branch(s, b, speed, &known) && is_same(&known, &cycle)) {
            r->grows_into = (int)b;
            return CLI_OK;
        }
    }
    r->grows_into = (int)r->n_branches;
    (void)go_down(s, speed, &state, &cycle);
    return CLI_OK;
}

/* ---- the kind ---- */

/* By the end of the branch that a small disturbance grows into. */
static enum critical_kind kind_of(const struct critical_result *r, double critical_m_s) {
    if (r->grows_m_s > 0.0 && r->grows.end == CYCLE_LOST) {
        return CRITICAL_UNBOUNDED;
    }
    if (r->grows_into < 0) {
        return CRITICAL_UNKNOWN;
    }
    const struct critical_end *end = &r->end[r->grows_into];
    double lowest = HUGE_VAL; /* at which that branch was seen */
    for (size_t i = 0; i < r->n; i++) {
        if (r->point[i].branch == (unsigned)r->grows_into && critical_hunts(&r->point[i].cycle)) {
            lowest = fmin(lowest, r->point[i].speed_m_s);
        }
    }
    if (end->found && end->hunts_m_s >= critical_m_s - AT_LINEAR) {
        return CRITICAL_SOFT;
    }
    if (end->found && end->cycle.end == CYCLE_UNSETTLED &&
        end->cycle.amplitude < SMALL * r->grows.amplitude) {
        return CRITICAL_UNKNOWN; /* a slow decay below a soft one may be all that is seen there */
    }
    lowest = end->found ? end->hunts_m_s : lowest;
    return lowest < critical_m_s - AT_LINEAR ? CRITICAL_HARD : CRITICAL_UNKNOWN;
}

int critical_follow(struct critical_search *s) {
    struct critical_result *r = s->result;
    const bool linear = r->linear.n > 0 && r->linear.stable_at_low;
    r->grows_into = -1;
    int status = from_above(s);
    if (status == CLI_OK) {
        status = below_all(s);
    }
    if (status == CLI_OK && linear && r->n_branches < CRITICAL_MOST_BRANCHES - 1) {
        status = from_below(s, r->linear.crossing[0].speed_m_s);
    }
    if (status == CLI_OK && linear) {
        r->kind = kind_of(r, r->linear.crossing[0].speed_m_s);
    }
    return status;
}

/* ---- thresholds ---- */

void critical_thresholds(struct critical_search *s) {
    struct critical_result *r = s->result;
    const size_t stable = r->n;
    for (size_t i = 0; i < stable && !is_full(s); i++) {
        const struct critical_point p = r->point[i];
        struct cycle cycle;
        if (!critical_hunts(&p.cycle) || p.cycle.end == CYCLE_UNSETTLED ||
            (r->linear.n > 0 && p.speed_m_s >= r->linear.crossing[0].speed_m_s)) {
            continue;
        }
        say_doing(s, "threshold", p.speed_m_s);
        if (cycle_unstable(&s->system, &s->limits, &s->state[i], p.cycle.amplitude, &cycle)) {
            add_point(s, p.speed_m_s, &cycle, &s->state[i]);
            r->point[r->n - 1].unstable = true;
            r->point[r->n - 1].branch = p.branch;
        }
    }
}
