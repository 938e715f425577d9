/* ride_assess.c - from signals to figures. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ride_filter.h"
#include "ride_report.h"
#include "ride_spectrum.h"

#define LOW 0.0015 /* percentiles of EN 14363 */
#define HIGH 0.9985
#define MEAN_OVER_M 2.0
#define Y_Q_LIMIT 0.8
#define COMFORT_S 5.0 /* EN 12299 */
#define WINDOW_S 8.0  /* of spectra */
#define WZ_FROM_HZ 0.2
#define WZ_TO_HZ 100.0

struct work {
    struct ride_result *result;
    double *x; /* the signal, filtered */
    double *sorted;
};

/* ---- statistics ---- */

static double rms_of(const double *x, size_t n) {
    double sum = 0.0;
    for (size_t i = 0; i < n; i++) {
        sum += x[i] * x[i];
    }
    return sqrt(sum / (double)n);
}

/* Samples of a section; what is left over at the end belongs to the last one. */
static size_t section_samples(const struct ride_result *r, size_t n) {
    const double each =
        r->section_m > 0.0 ? r->section_m / r->record->speed_m_s * r->record->rate_Hz : (double)n;
    return each < 1.0 ? 1 : (each < (double)n ? (size_t)each : n);
}

static void finish(struct work *k, struct ride_quantity *q) {
    const struct ride_record *r = k->result->record;
    const double *x = k->x + r->first;
    const size_t n = r->n - r->first;
    const size_t each = section_samples(k->result, n);
    const size_t sections = n / each;
    k->result->n_sections = sections;
    q->low = HUGE_VAL;
    q->high = -HUGE_VAL;
    for (size_t i = 0; i < sections; i++) {
        const size_t length = i + 1 == sections ? n - i * each : each;
        memcpy(k->sorted, x + i * each, length * sizeof(double));
        q->low = fmin(q->low, ride_quantile(k->sorted, length, LOW));
        q->high = fmax(q->high, ride_quantile(k->sorted, length, HIGH));
    }
    memcpy(k->sorted, x, n * sizeof(double));
    q->middle = ride_quantile(k->sorted, n, 0.5);
    q->rms = rms_of(x, n);
}

static struct ride_quantity *begin(struct work *k, const char *name, const char *what,
                                   const char *filter, const char *unit) {
    struct ride_quantity *q = &k->result->quantity[k->result->n++];
    snprintf(q->name, sizeof q->name, "%s", name);
    q->what = what;
    q->filter = filter;
    q->unit = unit;
    q->limit = (double)NAN;
    return q;
}

/* Filters `from` into the work; the filter starts where the signal does, as if that had always been
 * so. */
static void pass(struct work *k, const double *from, double low_Hz, double high_Hz) {
    struct ride_filter f;
    const struct ride_record *r = k->result->record;
    ride_band(&f, low_Hz, high_Hz, r->rate_Hz);
    const double level = from[0];
    for (size_t i = 0; i < r->n; i++) {
        k->x[i] = ride_filter_step(&f, from[i] - level) + (low_Hz > 0.0 ? 0.0 : level);
    }
}

void ride_sliding_mean(double *x, size_t n, double samples, double *work) {
    const size_t half = (size_t)llround(0.5 * samples);
    double sum = 0.0;
    size_t first = 0;
    size_t last = 0; /* of those in the sum, not included */
    for (size_t i = 0; i < n; i++) {
        const size_t from = i > half ? i - half : 0;
        const size_t to = i + half + 1 < n ? i + half + 1 : n;
        for (; last < to; last++) {
            sum += x[last];
        }
        for (; first < from; first++) {
            sum -= x[first];
        }
        work[i] = sum / (double)(to - from);
    }
    memcpy(x, work, n * sizeof(double));
}

static void mean_over_track(struct work *k) {
    const struct ride_record *r = k->result->record;
    ride_sliding_mean(k->x, r->n, MEAN_OVER_M / r->speed_m_s * r->rate_Hz, k->sorted);
}

/* ---- wheels ---- */

static void assess_wheel(struct work *k, uint32_t w, int side) {
    static const char *const side_name[] = {"right", "left"};
    const struct ride_record *r = k->result->record;
    char name[KL_NAME_SIZE + 16];
    snprintf(name, sizeof name, "%s %s", r->model->wheelsets[w].name, side_name[side]);
    pass(k, r->q_N[w][side], 0.0, 20.0);
    struct ride_quantity *q = begin(k, name, "Q", "20 Hz", "kN");
    finish(k, q);
    memcpy(r->q_N[w][side], k->x, r->n * sizeof(double)); /* filtered, for Y/Q */
    pass(k, r->y_N[w][side], 0.0, 20.0);
    for (size_t i = 0; i < r->n; i++) {
        k->x[i] /= fmax(r->q_N[w][side][i], 1.0);
    }
    mean_over_track(k);
    q = begin(k, name, "Y/Q", "20 Hz, mean of 2 m", "-");
    q->limit = Y_Q_LIMIT;
    finish(k, q);
}

static void assess_wheelset(struct work *k, uint32_t w) {
    const struct ride_record *r = k->result->record;
    pass(k, r->sum_y_N[w], 0.0, 20.0);
    mean_over_track(k);
    struct ride_quantity *q =
        begin(k, r->model->wheelsets[w].name, "sum of Y", "20 Hz, mean of 2 m", "kN");
    q->limit = 10e3 + (double)r->model->wheelsets[w].static_load_N / 3.0;
    finish(k, q);
    memcpy(r->sum_y_N[w], k->x, r->n * sizeof(double)); /* drawn */
    for (int s = 0; s < KL_SIDES; s++) {
        assess_wheel(k, w, s);
    }
}

/* ---- accelerations ---- */

static void assess_band(struct work *k, const double *from, const char *name, const char *what,
                        const char *filter, const double band_Hz[2]) {
    pass(k, from, band_Hz[0], band_Hz[1]);
    finish(k, begin(k, name, what, filter, "m/s2"));
}

static void assess_point(struct work *k, uint32_t p) {
    static const double safety_y[2] = {0.0, 6.0};
    static const double safety_z[2] = {0.4, 4.0};
    static const double frame[2] = {0.0, 10.0};
    static const double ride[2] = {0.4, 10.0};
    const struct ride_record *r = k->result->record;
    const struct ride_point *point = &r->point[p];
    if (!point->floor) {
        assess_band(k, r->lateral[p], point->name, "y'' safety", "10 Hz", frame);
        return;
    }
    assess_band(k, r->lateral[p], point->name, "y'' safety", "6 Hz", safety_y);
    assess_band(k, r->vertical[p], point->name, "z'' safety", "0.4..4 Hz", safety_z);
    assess_band(k, r->lateral[p], point->name, "y'' ride", "0.4..10 Hz", ride);
    assess_band(k, r->vertical[p], point->name, "z'' ride", "0.4..10 Hz", ride);
}

/* ---- comfort ---- */

static double sperling_of(const struct work *k, const double *x, double factor) {
    const struct ride_record *r = k->result->record;
    struct ride_spectrum s;
    double sum = 0.0;
    if (!ride_spectrum_make(&s, x + r->first, r->n - r->first, r->rate_Hz, WINDOW_S)) {
        return (double)NAN;
    }
    for (size_t i = 1; i < s.n; i++) {
        const double f = (double)i * s.width_Hz;
        if (f >= WZ_FROM_HZ && f <= WZ_TO_HZ) {
            const double b = factor * ride_sperling(f);
            sum += b * b * 2.0 * 1e4 * s.density[i] * s.width_Hz; /* amplitudes, cm/s2 */
        }
    }
    ride_spectrum_free(&s);
    return pow(sum, 0.15);
}

/* Weighted rms of the whole; `c95`: of means of 5 s, 95 %. */
static double comfort_of(struct work *k, const double *x, enum ride_weight weight, double *c95) {
    const struct ride_record *r = k->result->record;
    const size_t block = (size_t)(COMFORT_S * r->rate_Hz);
    struct ride_filter f;
    size_t blocks = 0;
    ride_weighting(&f, weight, r->rate_Hz);
    for (size_t i = 0; i < r->n; i++) {
        k->x[i] = ride_filter_step(&f, x[i] - x[0]);
    }
    for (size_t i = r->first; i + block <= r->n; i += block) {
        k->sorted[blocks++] = rms_of(k->x + i, block);
    }
    *c95 = ride_quantile(k->sorted, blocks, 0.95);
    return rms_of(k->x + r->first, r->n - r->first);
}

static void assess_comfort(struct work *k, uint32_t p) {
    struct ride_comfort *c = &k->result->comfort[p];
    const struct ride_record *r = k->result->record;
    c->wz_lateral = sperling_of(k, r->lateral[p], 1.25);
    c->wz_vertical = sperling_of(k, r->vertical[p], 1.0);
    c->rms_lateral = comfort_of(k, r->lateral[p], RIDE_WD, &c->c95_lateral);
    c->rms_vertical = comfort_of(k, r->vertical[p], RIDE_WB, &c->c95_vertical);
    c->n_mv = 6.0 * hypot(c->c95_lateral, c->c95_vertical);
}

int ride_assess(struct ride_result *result) {
    const struct ride_record *r = result->record;
    struct work k = {.result = result};
    if ((double)(r->n - r->first) < r->rate_Hz) {
        return cli_fail("less than a second of the run is left to be assessed");
    }
    k.x = malloc(r->n * sizeof(double));
    k.sorted = malloc(r->n * sizeof(double));
    int status = k.x != NULL && k.sorted != NULL ? CLI_OK : cli_fail("out of memory");
    for (uint32_t p = 0; p < r->n_points && status == CLI_OK; p++) {
        assess_point(&k, p);
        if (r->point[p].floor) {
            assess_comfort(&k, p);
        }
    }
    for (uint32_t w = 0; w < r->model->n_wheelsets && status == CLI_OK; w++) {
        assess_wheelset(&k, w);
    }
    free(k.x);
    free(k.sorted);
    return status;
}
