/*
 * ride_spectrum.h - power spectral densities after Welch: Hann windows, half overlapping, of a
 * length that is a power of two. Private to cmd_ride.c.
 */
#ifndef RIDE_SPECTRUM_H
#define RIDE_SPECTRUM_H

#include <stdbool.h>
#include <stddef.h>

struct ride_spectrum {
    size_t n;          /* frequencies, from 0 on */
    double width_Hz;   /* between them */
    double *density;   /* one-sided, (unit of the signal)^2/Hz */
    size_t n_segments; /* averaged */
};

/* Of n samples; windows of about `window_s`, shorter if there are too few samples. The mean of the
 * whole is taken off. False: out of memory, or fewer than 16 samples. */
bool ride_spectrum_make(struct ride_spectrum *spectrum, const double *x, size_t n, double rate_Hz,
                        double window_s);
void ride_spectrum_free(struct ride_spectrum *spectrum);

#endif
