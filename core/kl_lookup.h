/* kl_lookup.h - cubic interpolation of the ride height between two rows. Internal to the core. */
#ifndef KL_LOOKUP_H
#define KL_LOOKUP_H

#include "kl_geometry.h"

struct kl_hermite {
    kl_real value;
    kl_real slope;  /* d/dw, the exact derivative of `value` */
    kl_real second; /* d2/dw2, likewise */
};

/* Hermite cubic over t = 0..1 between rows a and b, `step` apart. */
static inline struct kl_hermite kl_hermite(const struct kl_row *a, const struct kl_row *b,
                                           kl_real t, kl_real step_m, kl_real inv_step_1_m) {
    const kl_real rise = (b->height_m - a->height_m) * inv_step_1_m;
    const kl_real c2 = (kl_real)3 * rise - (kl_real)2 * a->height_w - b->height_w;
    const kl_real c3 = a->height_w + b->height_w - (kl_real)2 * rise;
    const struct kl_hermite h = {.value =
                                     a->height_m + step_m * t * (a->height_w + t * (c2 + t * c3)),
                                 .slope = a->height_w + t * ((kl_real)2 * c2 + (kl_real)3 * t * c3),
                                 .second = inv_step_1_m * ((kl_real)2 * c2 + (kl_real)6 * t * c3)};
    return h;
}

#endif
