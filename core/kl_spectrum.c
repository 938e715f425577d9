/* kl_spectrum.c - track irregularities from power spectral densities. */
#include "kl_diag.h"
#include "kl_math.h"
#include "kl_track.h"

#define OMEGA_C 0.8246
#define OMEGA_R 0.0206
#define OMEGA_S 0.4380
#define HALF_GAUGE_M 0.75

/* splitmix64 (Steele, Lea, Flood 2014); 53 bits to a number in 0..1 */
static double uniform(uint64_t *state) {
    *state += UINT64_C(0x9e3779b97f4a7c15);
    uint64_t z = *state;
    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    z ^= z >> 31;
    return (double)(z >> 11) * (1.0 / 9007199254740992.0);
}

static double density(double a, double omega, int cross_level) {
    const double w2 = omega * omega;
    const double c2 = OMEGA_C * OMEGA_C;
    const double base = a * c2 / ((w2 + OMEGA_R * OMEGA_R) * (w2 + c2));
    return cross_level ? base * w2 / ((w2 + OMEGA_S * OMEGA_S) * (HALF_GAUGE_M * HALF_GAUGE_M))
                       : base;
}

static void add_waves(const struct kl_spectrum_def *def, double a, int cross_level,
                      uint64_t *random, double step, uint32_t n, double *out) {
    const double low = 2.0 * KL_PI / def->longest_m;
    const double high = 2.0 * KL_PI / def->shortest_m;
    const double width = (high - low) / (double)def->n_waves;
    for (uint32_t i = 0; i < n; i++) {
        out[i] = 0.0;
    }
    for (uint32_t k = 0; k < def->n_waves; k++) {
        const double omega = low + width * ((double)k + 0.5);
        const double phase = 2.0 * KL_PI * uniform(random);
        const double amplitude = kl_sqrt(2.0 * density(a, omega, cross_level) * width);
        for (uint32_t i = 0; i < n; i++) {
            out[i] += amplitude * kl_cos(omega * step * (double)i + phase);
        }
    }
    const double length = step * (double)(n - 1u);
    for (uint32_t i = 0; i < n; i++) {
        const double s = step * (double)i;
        const double edge = s < length - s ? s : length - s;
        if (edge < def->taper_m) {
            out[i] *= 0.5 * (1.0 - kl_cos(KL_PI * edge / def->taper_m));
        }
    }
}

enum kl_status kl_spectrum_synthesise(const struct kl_spectrum_def *def, double step_m, uint32_t n,
                                      double *lateral_m, double *vertical_m, double *cross_rad) {
    if (def == NULL || lateral_m == NULL || vertical_m == NULL || cross_rad == NULL || n < 4u) {
        return KL_ERR_ARGUMENT;
    }
    const int ok = step_m > 0.0 && def->shortest_m > 2.0 * step_m &&
                   def->longest_m > def->shortest_m && def->longest_m < 1e4 &&
                   def->taper_m >= 0.0 && def->taper_m < 1e5 && def->n_waves >= 1u &&
                   def->n_waves <= 4096u && def->lateral_A >= 0.0 && def->lateral_A < 1.0 &&
                   def->vertical_A >= 0.0 && def->vertical_A < 1.0 && def->cross_A >= 0.0 &&
                   def->cross_A < 1.0 && step_m * (double)n * 2.0 * KL_PI < 1e6 * def->shortest_m;
    if (!ok) {
        return KL_ERR_VALUE;
    }
    uint64_t random = def->seed;
    add_waves(def, def->lateral_A, 0, &random, step_m, n, lateral_m);
    add_waves(def, def->vertical_A, 0, &random, step_m, n, vertical_m);
    add_waves(def, def->cross_A, 1, &random, step_m, n, cross_rad);
    return KL_OK;
}
