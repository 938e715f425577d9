/* ride_filter.c - analogue definitions, digital filters. */
#include "ride_filter.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

/* (n0 + n1 s + n2 s^2)/(d0 + d1 s + d2 s^2), s in units of 1 rad/s. */
struct analogue {
    double n[3];
    double d[3];
};

/* By s = c (1 - z)/(1 + z); c makes the frequency `match_Hz` come out exactly. */
static void add(struct ride_filter *filter, const struct analogue *h, double match_Hz,
                double rate_Hz) {
    const double w = 2.0 * PI * match_Hz;
    const double c = w / tan(0.5 * w / rate_Hz);
    const double d0 = h->d[0] + c * h->d[1] + c * c * h->d[2];
    struct ride_section *to = &filter->section[filter->n++];
    to->b[0] = (h->n[0] + c * h->n[1] + c * c * h->n[2]) / d0;
    to->b[1] = 2.0 * (h->n[0] - c * c * h->n[2]) / d0;
    to->b[2] = (h->n[0] - c * h->n[1] + c * c * h->n[2]) / d0;
    to->a[0] = 2.0 * (h->d[0] - c * c * h->d[2]) / d0;
    to->a[1] = (h->d[0] - c * h->d[1] + c * c * h->d[2]) / d0;
}

/* s^2 or w^2 over s^2 + s w/Q + w^2. */
static void add_corner(struct ride_filter *filter, double f_Hz, double q, int high_pass,
                       double rate_Hz) {
    const double w = 2.0 * PI * f_Hz;
    struct analogue h = {{0.0, 0.0, 0.0}, {w * w, w / q, 1.0}};
    h.n[high_pass ? 2 : 0] = high_pass ? 1.0 : w * w;
    add(filter, &h, f_Hz, rate_Hz);
}

void ride_band(struct ride_filter *filter, double low_Hz, double high_Hz, double rate_Hz) {
    memset(filter, 0, sizeof *filter);
    for (int i = 0; i < 2; i++) {
        const double q = 0.5 / cos(PI * (2 * i + 1) / 8.0); /* poles of Butterworth's order 4 */
        if (low_Hz > 0.0) {
            add_corner(filter, low_Hz, q, 1, rate_Hz);
        }
        if (high_Hz > 0.0) {
            add_corner(filter, high_Hz, q, 0, rate_Hz);
        }
    }
}

void ride_weighting(struct ride_filter *filter, enum ride_weight weight, double rate_Hz) {
    const double w4 = 2.0 * PI * (weight == RIDE_WB ? 16.0 : 2.0);
    const double f4 = w4 / (2.0 * PI);
    const double w5 = 2.0 * PI * 2.5;
    const double w6 = 2.0 * PI * 4.0;
    const struct analogue transition = {{1.0, 1.0 / w4, 0.0},
                                        {1.0, 1.0 / (0.63 * w4), 1.0 / (w4 * w4)}};
    const struct analogue step = {{0.4, 0.4 / (0.8 * w5), 0.4 / (w5 * w5)},
                                  {1.0, 1.0 / (0.8 * w6), 1.0 / (w6 * w6)}};
    memset(filter, 0, sizeof *filter);
    add_corner(filter, 0.4, sqrt(0.5), 1, rate_Hz);
    if (100.0 < 0.5 * rate_Hz) {
        add_corner(filter, 100.0, sqrt(0.5), 0, rate_Hz);
    }
    add(filter, &transition, f4, rate_Hz);
    if (weight == RIDE_WB) {
        add(filter, &step, 4.0, rate_Hz);
    }
}

double ride_filter_step(struct ride_filter *filter, double x) {
    for (size_t i = 0; i < filter->n; i++) {
        const struct ride_section *s = &filter->section[i];
        double *m = filter->memory[i];
        const double y = s->b[0] * x + m[0];
        m[0] = s->b[1] * x - s->a[0] * y + m[1];
        m[1] = s->b[2] * x - s->a[1] * y;
        x = y;
    }
    return x;
}

/* |c0 + c1 z + c2 z^2|^2 at z = exp(-j angle). */
static double size2(double c0, double c1, double c2, double angle) {
    const double re = c0 + c1 * cos(angle) + c2 * cos(2.0 * angle);
    const double im = c1 * sin(angle) + c2 * sin(2.0 * angle);
    return re * re + im * im;
}

double ride_filter_gain(const struct ride_filter *filter, double frequency_Hz, double rate_Hz) {
    const double angle = 2.0 * PI * frequency_Hz / rate_Hz;
    double gain2 = 1.0;
    for (size_t i = 0; i < filter->n; i++) {
        const struct ride_section *s = &filter->section[i];
        gain2 *= size2(s->b[0], s->b[1], s->b[2], angle) / size2(1.0, s->a[0], s->a[1], angle);
    }
    return sqrt(gain2);
}

double ride_sperling(double f) {
    const double f2 = f * f;
    const double over = 1.911 * f2 + (0.25 * f2) * (0.25 * f2);
    const double a = 1.0 - 0.277 * f2;
    const double b = 1.563 * f - 0.0368 * f2 * f;
    return 0.588 * sqrt(over / (a * a + b * b));
}

static int by_value(const void *a, const void *b) {
    const double x = *(const double *)a;
    const double y = *(const double *)b;
    return (x > y) - (x < y);
}

double ride_quantile(double *values, size_t n, double q) {
    if (n == 0) {
        return (double)NAN;
    }
    qsort(values, n, sizeof values[0], by_value);
    const double at = q * (double)(n - 1);
    const size_t i = at < (double)(n - 1) ? (size_t)at : n - 1;
    return i + 1 < n ? values[i] + (at - (double)i) * (values[i + 1] - values[i]) : values[i];
}
