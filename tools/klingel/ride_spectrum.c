/* ride_spectrum.c - spectra. */
#include "ride_spectrum.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
#define LEAST 16u

struct number {
    double re;
    double im;
};

/* In place, n a power of two (Cooley and Tukey). */
static void transform(struct number *x, size_t n) {
    for (size_t i = 1, j = 0; i < n; i++) {
        size_t bit = n >> 1;
        for (; (j & bit) != 0; bit >>= 1) {
            j ^= bit;
        }
        j |= bit;
        if (i < j) {
            const struct number swap = x[i];
            x[i] = x[j];
            x[j] = swap;
        }
    }
    for (size_t half = 1; half < n; half *= 2) {
        for (size_t k = 0; k < half; k++) {
            const double c = cos(PI * (double)k / (double)half);
            const double s = sin(PI * (double)k / (double)half);
            for (size_t i = k; i < n; i += 2 * half) {
                const struct number even = x[i];
                const struct number there = x[i + half];
                const struct number odd = {c * there.re + s * there.im,
                                           c * there.im - s * there.re};
                x[i] = (struct number){even.re + odd.re, even.im + odd.im};
                x[i + half] = (struct number){even.re - odd.re, even.im - odd.im};
            }
        }
    }
}

static double mean_of(const double *x, size_t n) {
    double sum = 0.0;
    for (size_t i = 0; i < n; i++) {
        sum += x[i];
    }
    return sum / (double)n;
}

bool ride_spectrum_make(struct ride_spectrum *s, const double *x, size_t n, double rate_Hz,
                        double window_s) {
    memset(s, 0, sizeof *s);
    size_t size = LEAST;
    while ((double)size < window_s * rate_Hz) {
        size *= 2;
    }
    while (size > n) {
        size /= 2;
    }
    if (size < LEAST) {
        return false;
    }
    struct number *work = malloc(size * sizeof *work);
    s->n = size / 2 + 1;
    s->density = calloc(s->n, sizeof(double));
    if (work == NULL || s->density == NULL) {
        free(work);
        ride_spectrum_free(s);
        return false;
    }
    const double mean = mean_of(x, n);
    const double power = 0.375 * (double)size; /* sum of the squares of a Hann window */
    for (size_t start = 0; start + size <= n; start += size / 2) {
        for (size_t i = 0; i < size; i++) {
            const double hann = 0.5 - 0.5 * cos(2.0 * PI * (double)i / (double)size);
            work[i] = (struct number){hann * (x[start + i] - mean), 0.0};
        }
        transform(work, size);
        for (size_t k = 0; k < s->n; k++) {
            const double sides = k == 0 || k == size / 2 ? 1.0 : 2.0;
            const double amplitude = hypot(work[k].re, work[k].im);
            s->density[k] += sides * amplitude * amplitude / (power * rate_Hz);
        }
        s->n_segments++;
    }
    for (size_t k = 0; k < s->n; k++) {
        s->density[k] /= (double)s->n_segments;
    }
    s->width_Hz = rate_Hz / (double)size;
    free(work);
    return true;
}

void ride_spectrum_free(struct ride_spectrum *s) {
    free(s->density);
    memset(s, 0, sizeof *s);
}
