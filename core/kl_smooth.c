/* kl_smooth.c - penalised B-spline over arc length through measured points. */
#include "kl_smooth.h"

#include "kl_diag.h"
#include "kl_math.h"

#define BAND 4            /* diagonal and three beside it: cubic B-splines, third differences */
#define ROUNDS 3          /* of places and stiffness before the last fit */
#define WINDOW 8u         /* spans to both sides over which the stiffness is evened out */
#define SOFTEST 1e-2      /* bounds the stiffness to 100 times the mean */
#define LEAST_POWER (-20) /* lambda = 2^power */
#define MOST_POWER 36
#define CAUTION 1.4 /* what a freedom counts: above 1 guards against too rough a curve */
#define REFINED 10  /* halvings between two powers */

/* The work of one curve. */
struct fit {
    const struct kl_smooth_points *points;
    uint32_t n_spans;
    uint32_t n;     /* coefficients: spans + 3 */
    double *s;      /* place of each point, in spans */
    double *w;      /* its weight; their sum is the number of spans */
    double *normal; /* n rows of BAND: sum w b b^T, upper half */
    double *factor; /* likewise, of normal + lambda penalty: L D L^T */
    double *load[2];
    double *coefficient[2];
    double *change;    /* of the coefficients, while they are refined */
    double *inverse;   /* likewise, of the inverse */
    double *stiffness; /* of each third difference: what it costs, in lambda */
    double *roughness; /* of each third difference: its square */
};

/* ---- places of the points ---- */

static double distance(const struct kl_smooth_points *p, uint32_t a, uint32_t b) {
    const double x = p->x_m[b] - p->x_m[a];
    const double y = p->y_m[b] - p->y_m[a];
    return kl_sqrt(x * x + y * y);
}

/* The next corner of the chain of chords: the first point far enough away, or the last one. */
static uint32_t next_corner(const struct kl_smooth_points *p, uint32_t from) {
    uint32_t to = from + 1u;
    while (to + 1u < p->n && distance(p, from, to) < KL_SMOOTH_CHORD_M) {
        to++;
    }
    return to;
}

static double chain_length(const struct kl_smooth_points *p) {
    double length = 0.0;
    for (uint32_t at = 0; at + 1u < p->n;) {
        const uint32_t to = next_corner(p, at);
        length += distance(p, at, to);
        at = to;
    }
    return length;
}

uint32_t kl_smooth_size(const struct kl_smooth_points *points) {
    const double spans = chain_length(points) / KL_SMOOTH_KNOT_M;
    if (!(spans >= 4.0 && spans < (double)KL_SMOOTH_MAX_SPANS)) {
        return 0;
    }
    return (uint32_t)spans + 2u; /* the spans are a little shorter than KL_SMOOTH_KNOT_M */
}

/* Between corners by projection on the chord. */
static void place_points(struct fit *fit) {
    const struct kl_smooth_points *p = fit->points;
    const double scale = (double)fit->n_spans / chain_length(p);
    double start = 0.0;
    fit->s[0] = 0.0;
    for (uint32_t at = 0; at + 1u < p->n;) {
        const uint32_t to = next_corner(p, at);
        const double length = distance(p, at, to);
        const double inverse = length > 0.0 ? 1.0 / length : 0.0;
        const double ux = (p->x_m[to] - p->x_m[at]) * inverse;
        const double uy = (p->y_m[to] - p->y_m[at]) * inverse;
        for (uint32_t i = at + 1u; i < to; i++) {
            const double along = (p->x_m[i] - p->x_m[at]) * ux + (p->y_m[i] - p->y_m[at]) * uy;
            fit->s[i] = scale * (start + (along > 0.0 ? along : 0.0));
        }
        start += length;
        fit->s[to] = scale * start;
        at = to;
    }
}

/* Half the way to the neighbours on both sides: a dense stretch counts no more than a sparse one.
 * No weight is zero, so that every point has a say. */
static void weigh_points(struct fit *fit) {
    const uint32_t n = fit->points->n;
    double sum = 0.0;
    for (uint32_t i = 0; i < n; i++) {
        const double before = i > 0 ? fit->s[i] - fit->s[i - 1u] : 0.0;
        const double after = i + 1u < n ? fit->s[i + 1u] - fit->s[i] : 0.0;
        fit->w[i] = 0.5 * (kl_abs(before) + kl_abs(after)) + 1e-9;
        sum += fit->w[i];
    }
    for (uint32_t i = 0; i < n; i++) {
        fit->w[i] *= (double)fit->n_spans / sum;
    }
}

/* ---- the curve ---- */

/* The span of a place and the four basis functions there. */
static uint32_t basis(const struct fit *fit, double s, double b[4]) {
    uint32_t span = s > 0.0 ? (uint32_t)s : 0u;
    span = span < fit->n_spans ? span : fit->n_spans - 1u;
    const double u = s - (double)span;
    const double v = 1.0 - u;
    b[0] = v * v * v / 6.0;
    b[1] = (3.0 * u * u * u - 6.0 * u * u + 4.0) / 6.0;
    b[2] = (3.0 * v * v * v - 6.0 * v * v + 4.0) / 6.0;
    b[3] = u * u * u / 6.0;
    return span;
}

static void basis_slope(double s, uint32_t span, double b[4]) {
    const double u = s - (double)span;
    const double v = 1.0 - u;
    b[0] = -0.5 * v * v;
    b[1] = 1.5 * u * u - 2.0 * u;
    b[2] = 2.0 * v - 1.5 * v * v;
    b[3] = 0.5 * u * u;
}

static double combine(const double *c, const double b[4]) {
    return b[0] * c[0] + b[1] * c[1] + b[2] * c[2] + b[3] * c[3];
}

/* A point's deviation from the curve, along its tangent (in spans) and along its normal. */
struct deviation {
    double along;
    double across_m;
};

static struct deviation deviation_of(const struct fit *fit, uint32_t i) {
    double b[4];
    const uint32_t span = basis(fit, fit->s[i], b);
    const double *cx = &fit->coefficient[0][span];
    const double *cy = &fit->coefficient[1][span];
    const double dx = fit->points->x_m[i] - combine(cx, b);
    const double dy = fit->points->y_m[i] - combine(cy, b);
    basis_slope(fit->s[i], span, b);
    const double tx = combine(cx, b);
    const double ty = combine(cy, b);
    const double square = tx * tx + ty * ty + 1e-30;
    const struct deviation d = {(dx * tx + dy * ty) / square,
                                (dy * tx - dx * ty) / kl_sqrt(square)};
    return d;
}

static double mean_deviation(const struct fit *fit) {
    double sum = 0.0;
    for (uint32_t i = 0; i < fit->points->n; i++) {
        const double across = deviation_of(fit, i).across_m;
        sum += fit->w[i] * across * across;
    }
    return kl_sqrt(sum / (double)fit->n_spans);
}

/* ---- least squares ---- */

static void assemble(struct fit *fit) {
    for (uint32_t k = 0; k < fit->n * BAND; k++) {
        fit->normal[k] = 0.0;
    }
    for (uint32_t k = 0; k < fit->n; k++) {
        fit->load[0][k] = 0.0;
        fit->load[1][k] = 0.0;
    }
    for (uint32_t i = 0; i < fit->points->n; i++) {
        double b[4];
        const uint32_t span = basis(fit, fit->s[i], b);
        for (uint32_t j = 0; j < 4u; j++) {
            const double wb = fit->w[i] * b[j];
            double *row = &fit->normal[(span + j) * BAND];
            for (uint32_t k = j; k < 4u; k++) {
                row[k - j] += wb * b[k];
            }
            fit->load[0][span + j] += wb * fit->points->x_m[i];
            fit->load[1][span + j] += wb * fit->points->y_m[i];
        }
    }
}

/* normal + lambda D^T S D, D the third difference, S the stiffness, as L D L^T in rows of the upper half. */
static void factorise(struct fit *fit, double lambda) {
    static const double third[4] = {-1.0, 3.0, -3.0, 1.0};
    const uint32_t n = fit->n;
    double *f = fit->factor;
    for (uint32_t k = 0; k < n * BAND; k++) {
        f[k] = fit->normal[k];
    }
    for (uint32_t d = 0; d + 3u < n; d++) {
        for (uint32_t j = 0; j < 4u; j++) {
            for (uint32_t k = j; k < 4u; k++) {
                f[(d + j) * BAND + k - j] += lambda * fit->stiffness[d] * third[j] * third[k];
            }
        }
    }
    for (uint32_t i = 0; i < n; i++) {
        double *row = &f[i * BAND];
        const double inverse = 1.0 / row[0];
        for (uint32_t j = 1; j < BAND && i + j < n; j++) {
            const double ratio = row[j] * inverse;
            for (uint32_t k = j; k < BAND && i + k < n; k++) {
                f[(i + j) * BAND + k - j] -= ratio * row[k];
            }
        }
        for (uint32_t j = 1; j < BAND; j++) {
            row[j] *= inverse;
        }
    }
}

static void substitute(const struct fit *fit, double *x) {
    const double *f = fit->factor;
    const uint32_t n = fit->n;
    for (uint32_t i = 0; i < n; i++) {
        for (uint32_t j = 1; j < BAND && i + j < n; j++) {
            x[i + j] -= f[i * BAND + j] * x[i];
        }
    }
    for (uint32_t i = n; i-- > 0;) {
        double sum = x[i] / f[i * BAND];
        for (uint32_t j = 1; j < BAND && i + j < n; j++) {
            sum -= f[i * BAND + j] * x[i + j];
        }
        x[i] = sum;
    }
}

static double third_difference(const double *c) {
    return (c[3] - c[0]) - 3.0 * (c[2] - c[1]);
}

/* load - (normal + lambda D^T S D) c, the penalty by differences of c: nothing large is subtracted.
 */
static void residual(const struct fit *fit, double lambda, const double *load, const double *c,
                     double *out) {
    const uint32_t n = fit->n;
    for (uint32_t i = 0; i < n; i++) {
        out[i] = load[i];
    }
    for (uint32_t i = 0; i < n; i++) {
        const double *row = &fit->normal[i * BAND];
        out[i] -= row[0] * c[i];
        for (uint32_t j = 1; j < BAND && i + j < n; j++) {
            out[i] -= row[j] * c[i + j];
            out[i + j] -= row[j] * c[i];
        }
    }
    for (uint32_t d = 0; d + 3u < n; d++) {
        const double t = lambda * fit->stiffness[d] * third_difference(&c[d]);
        out[d] += t;
        out[d + 1u] -= 3.0 * t;
        out[d + 2u] += 3.0 * t;
        out[d + 3u] -= t;
    }
}

/* The curve for a lambda; gives its deviation. */
static double solve(struct fit *fit, double lambda) {
    factorise(fit, lambda);
    for (int axis = 0; axis < 2; axis++) {
        double *c = fit->coefficient[axis];
        for (uint32_t i = 0; i < fit->n; i++) {
            c[i] = fit->load[axis][i];
        }
        substitute(fit, c);
        residual(fit, lambda, fit->load[axis], c, fit->change);
        substitute(fit, fit->change); /* lambda may be 1e12 times the data's weight */
        for (uint32_t i = 0; i < fit->n; i++) {
            c[i] += fit->change[i];
        }
    }
    return mean_deviation(fit);
}

/* ---- how smooth ---- */

/*
 * How many free numbers the curve takes from the points: the trace of normal (L D L^T)^-1. Of the
 * inverse only the band is needed, which follows from its own last rows (K. Takahashi et al. 1973).
 */
static double freedoms(const struct fit *fit) {
    const uint32_t n = fit->n;
    double *z = fit->inverse; /* rows of the upper half, as the factor's */
    double trace = 0.0;
    for (uint32_t i = n; i-- > 0;) {
        const double *row = &fit->factor[i * BAND];
        const double *a = &fit->normal[i * BAND];
        z[i * BAND] = 1.0 / row[0];
        for (uint32_t k = BAND - 1u; k > 0u; k--) {
            double sum = 0.0;
            for (uint32_t j = 1; j < BAND && i + k < n && i + j < n; j++) {
                const uint32_t low = j < k ? j : k;
                const uint32_t apart = j < k ? k - j : j - k;
                sum -= row[j] * z[(i + low) * BAND + apart];
            }
            z[i * BAND + k] = sum;
            z[i * BAND] -= row[k] * sum;
            trace += 2.0 * a[k] * sum;
        }
        trace += a[0] * z[i * BAND];
    }
    return trace;
}

static double power_of_two(int power) {
    double value = 1.0;
    for (int i = 0; i < (power < 0 ? -power : power); i++) {
        value *= power < 0 ? 0.5 : 2.0;
    }
    return value;
}

/* Generalised cross-validation: how badly the curve foretells points that it has not seen. */
static double score(struct fit *fit, int power) {
    const double deviation = solve(fit, power_of_two(power));
    const double rest = 1.0 - CAUTION * freedoms(fit) / (double)fit->points->n;
    return rest > 0.0 ? deviation * deviation / (rest * rest) : 1e30;
}

/* The power of two for lambda with the best score: every fourth from `first` to `last`, then their
 * neighbours. */
static int best_power(struct fit *fit, int first, int last) {
    int best = first;
    double least = 1e31;
    for (int power = first; power <= last; power += 4) {
        const double now = score(fit, power);
        best = now < least ? power : best;
        least = now < least ? now : least;
    }
    for (int step = 2; step >= 1; step--) {
        const int centre = best;
        for (int side = -1; side <= 1; side += 2) {
            const double now = score(fit, centre + side * step);
            best = now < least ? centre + side * step : best;
            least = now < least ? now : least;
        }
    }
    return best;
}

/* The largest lambda up to 2^power that is within the tolerance; the deviation grows with lambda.
 * Gives the deviation. */
static double stay_within(struct fit *fit, double tolerance, int power) {
    const double deviation = solve(fit, power_of_two(power));
    int low = LEAST_POWER; /* taken to be within, which the caller looks at */
    int high = power;
    if (deviation <= tolerance) {
        return deviation;
    }
    for (int i = 0; i < 6 && high - low > 1; i++) {
        const int middle = low + (high - low) / 2;
        if (solve(fit, power_of_two(middle)) <= tolerance) {
            low = middle;
        } else {
            high = middle;
        }
    }
    double lambda = power_of_two(low);
    double step = lambda;
    for (int i = 0; i < REFINED; i++) {
        step *= 0.5;
        if (solve(fit, lambda + step) <= tolerance) {
            lambda += step;
        }
    }
    return solve(fit, lambda);
}

/* Every point to the foot of its normal, at most one span at a time. */
static void move_to_feet(struct fit *fit) {
    for (uint32_t i = 0; i < fit->points->n; i++) {
        double step = deviation_of(fit, i).along;
        step = step > 1.0 ? 1.0 : step;
        step = step < -1.0 ? -1.0 : step;
        double s = fit->s[i] + step;
        s = s < (double)fit->n_spans ? s : (double)fit->n_spans;
        fit->s[i] = s > 0.0 ? s : 0.0;
    }
}

/* The penalty anew: in inverse proportion to the square of the third difference that the curve has
 * thereabouts. */
static void adapt(struct fit *fit) {
    const uint32_t n = fit->n - 3u;
    double sum = 0.0;
    for (uint32_t d = 0; d < n; d++) {
        const double x = third_difference(&fit->coefficient[0][d]);
        const double y = third_difference(&fit->coefficient[1][d]);
        fit->roughness[d] = x * x + y * y;
        sum += fit->roughness[d];
    }
    const double inverse_mean = sum > 0.0 ? (double)n / sum : 0.0;
    for (uint32_t d = 0; d < n; d++) {
        const uint32_t from = d > WINDOW ? d - WINDOW : 0u;
        const uint32_t to = d + WINDOW < n ? d + WINDOW : n - 1u;
        double g = 0.0;
        for (uint32_t k = from; k <= to; k++) {
            g += fit->roughness[k];
        }
        g *= inverse_mean / (double)(to - from + 1u);
        fit->stiffness[d] = 1.0 / (g + SOFTEST);
    }
}

static int take_memory(struct fit *fit, struct kl_arena *arena) {
    const uint32_t n = fit->points->n;
    fit->s = kl_arena_take(arena, n, sizeof(double));
    fit->w = kl_arena_take(arena, n, sizeof(double));
    fit->normal = kl_arena_take(arena, (size_t)fit->n * BAND, sizeof(double));
    fit->factor = kl_arena_take(arena, (size_t)fit->n * BAND, sizeof(double));
    fit->inverse = kl_arena_take(arena, (size_t)fit->n * BAND, sizeof(double));
    fit->change = kl_arena_take(arena, fit->n, sizeof(double));
    fit->stiffness = kl_arena_take(arena, fit->n, sizeof(double));
    fit->roughness = kl_arena_take(arena, fit->n, sizeof(double));
    int ok = fit->s != NULL && fit->w != NULL && fit->normal != NULL && fit->factor != NULL &&
             fit->inverse != NULL && fit->change != NULL && fit->stiffness != NULL &&
             fit->roughness != NULL;
    for (int axis = 0; axis < 2; axis++) {
        fit->load[axis] = kl_arena_take(arena, fit->n, sizeof(double));
        fit->coefficient[axis] = kl_arena_take(arena, fit->n, sizeof(double));
        ok = ok && fit->load[axis] != NULL && fit->coefficient[axis] != NULL;
    }
    return ok;
}

static double fit_curve(struct fit *fit, double tolerance) {
    place_points(fit);
    weigh_points(fit);
    for (uint32_t d = 0; d < fit->n; d++) {
        fit->stiffness[d] = 1.0;
    }
    int first = LEAST_POWER;
    int last = MOST_POWER;
    for (int round = 0; round < ROUNDS; round++) {
        assemble(fit);
        const int power = best_power(fit, first, last);
        (void)stay_within(fit, tolerance, power);
        move_to_feet(fit);
        adapt(fit);
        /* the stiffness keeps its scale, so lambda does not go far */
        first = power - 8 > LEAST_POWER ? power - 8 : LEAST_POWER;
        last = power + 8 < MOST_POWER ? power + 8 : MOST_POWER;
    }
    assemble(fit);
    return stay_within(fit, tolerance, best_power(fit, first, last));
}

enum kl_status kl_smooth(const struct kl_smooth_points *points, double tolerance_m,
                         struct kl_arena *arena, double *x_out_m, double *y_out_m,
                         struct kl_diag *diag) {
    const uint32_t size = kl_smooth_size(points);
    const size_t mark = arena->used;
    struct fit fit = {.points = points, .n_spans = size - 1u, .n = size + 2u};
    if (size == 0) {
        return kl_report(diag, KL_ERR_PROFILE,
                         "profile: the points must extend over 1 to 500 mm to be smoothed", -1,
                         chain_length(points));
    }
    if (!take_memory(&fit, arena)) {
        arena->used = mark;
        return kl_report(diag, KL_ERR_MEMORY, "profile smoothing", -1, (double)arena->wanted);
    }
    const double reached = fit_curve(&fit, tolerance_m);
    if (reached <= tolerance_m) {
        for (uint32_t k = 0; k < size; k++) {
            double b[4];
            const uint32_t span = basis(&fit, (double)k, b);
            x_out_m[k] = combine(&fit.coefficient[0][span], b);
            y_out_m[k] = combine(&fit.coefficient[1][span], b);
        }
    }
    arena->used = mark;
    if (!(reached <= tolerance_m)) {
        return kl_report(diag, KL_ERR_PROFILE,
                         "profile: smoothing_m is less than a curve can come near the points", -1,
                         reached);
    }
    return KL_OK;
}
