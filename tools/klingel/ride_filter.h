/*
 * ride_filter.h - filters of the assessment of running behaviour and comfort. Private to cmd_ride.c.
 *
 * All are chains of second-order sections, run forward in time. Analogue transfer functions become
 * digital ones by the bilinear rule, each corner frequency prewarped, so that response and
 * definition agree at the corners.
 */
#ifndef RIDE_FILTER_H
#define RIDE_FILTER_H

#include <stddef.h>

#define RIDE_MAX_SECTIONS 6

/* y = (b0 + b1 z + b2 z^2)/(1 + a1 z + a2 z^2) x, z the delay by one sample. */
struct ride_section {
    double b[3];
    double a[2];
};

struct ride_filter {
    size_t n;
    struct ride_section section[RIDE_MAX_SECTIONS];
    double memory[RIDE_MAX_SECTIONS][2];
};

/* Butterworth of order 4 (24 dB per octave), -3 dB at the corners; 0 Hz: no such corner. */
void ride_band(struct ride_filter *filter, double low_Hz, double high_Hz, double rate_Hz);

/*
 * Frequency weightings of EN 12299 (before it, UIC 513): with w = 2 pi f,
 *   band      s^2/(s^2 + s w1/Q1 + w1^2), w2^2/(s^2 + s w2/Q1 + w2^2), f1 0.4, f2 100 Hz, Q1 1/sqrt 2
 *   W_b, W_d  (1 + s/w3)/(1 + s/(Q2 w4) + (s/w4)^2)
 *   W_b       K (1 + s/(Q3 w5) + (s/w5)^2)/(1 + s/(Q4 w6) + (s/w6)^2)
 * W_b, vertical: f3 = f4 = 16, f5 2.5, f6 4 Hz, Q2 0.63, Q3 = Q4 = 0.8, K 0.4; W_d, lateral: f3 = f4 =
 * 2 Hz, Q2 0.63.
 */
enum ride_weight { RIDE_WB, RIDE_WD };
void ride_weighting(struct ride_filter *filter, enum ride_weight weight, double rate_Hz);

/* The next sample. Starts from rest. */
double ride_filter_step(struct ride_filter *filter, double x);

/* The gain at a frequency, of the digital filter. */
double ride_filter_gain(const struct ride_filter *filter, double frequency_Hz, double rate_Hz);

/*
 * The weighting B(f) of Sperling's comfort index, 1/(cm/s2), vertical; lateral it is 1.25 times that:
 * B = 0.588 sqrt((1.911 f^2 + (0.25 f^2)^2)/((1 - 0.277 f^2)^2 + (1.563 f - 0.0368 f^3)^2)).
 * Wz = (sum of (B a)^2)^0.15 over the harmonics, a their amplitudes in cm/s2. Source: Garg and
 * Dukkipati, Dynamics of Railway Vehicle Systems, 1984.
 */
double ride_sperling(double frequency_Hz);

/* The quantile q (0..1) of n values, by their order, linear between them; sorts `values`. */
double ride_quantile(double *values, size_t n, double q);

#endif
