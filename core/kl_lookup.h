/* kl_lookup.h - cubic interpolation of the ride height between two rows. Internal to the core. */
#ifndef KL_LOOKUP_H
#define KL_LOOKUP_H

#include "kl_geometry.h"
#include "kl_lanes.h"

struct kl_lane_hermite {
    kl_lane value;
    kl_lane slope;  /* d/dw, the exact derivative of `value` */
    kl_lane second; /* d2/dw2, likewise */
};

/* Hermite cubic over t = 0..1 between heights a and b with slopes a_w and b_w, `step` apart. */
static inline struct kl_lane_hermite kl_lane_hermite(kl_lane a, kl_lane a_w, kl_lane b, kl_lane b_w,
                                                     kl_lane t, kl_real step_m,
                                                     kl_real inv_step_1_m) {
    const kl_lane rise = (b - a) * inv_step_1_m;
    const kl_lane c2 = ((kl_real)3 * rise - (kl_real)2 * a_w) - b_w;
    const kl_lane c3 = (a_w + b_w) - (kl_real)2 * rise;
    const struct kl_lane_hermite h = {.value = a + step_m * t * (a_w + t * (c2 + t * c3)),
                                      .slope = a_w + t * ((kl_real)2 * c2 + (kl_real)3 * t * c3),
                                      .second =
                                          inv_step_1_m * ((kl_real)2 * c2 + (kl_real)6 * t * c3)};
    return h;
}

struct kl_hermite {
    kl_real value;
    kl_real slope;
    kl_real second;
};

/* The same for one side alone. */
static inline struct kl_hermite kl_hermite(const struct kl_row *a, const struct kl_row *b,
                                           kl_real t, kl_real step_m, kl_real inv_step_1_m) {
    const struct kl_lane_hermite both = kl_lane_hermite(
        kl_lane_all(a->height_m), kl_lane_all(a->height_w), kl_lane_all(b->height_m),
        kl_lane_all(b->height_w), kl_lane_all(t), step_m, inv_step_1_m);
    const struct kl_hermite h = {kl_lane_first(both.value), kl_lane_first(both.slope),
                                 kl_lane_first(both.second)};
    return h;
}

/* Where a flange touches, between its rows a and b, the next upwards: `slope` is -dW/dH. */
static inline struct kl_lane_hermite kl_lane_flange_place(kl_lane a, kl_lane a_h, kl_lane b,
                                                          kl_lane b_h, kl_lane t, kl_real step_m,
                                                          kl_real inv_step_1_m) {
    return kl_lane_hermite(a, -a_h, b, -b_h, t, step_m, inv_step_1_m);
}

static inline struct kl_hermite kl_flange_place(const struct kl_flange_row *row, kl_real t,
                                                kl_real step_m, kl_real inv_step_1_m) {
    const struct kl_lane_hermite both = kl_lane_flange_place(
        kl_lane_all(row[0].place_m), kl_lane_all(row[0].place_h), kl_lane_all(row[1].place_m),
        kl_lane_all(row[1].place_h), kl_lane_all(t), step_m, inv_step_1_m);
    const struct kl_hermite h = {kl_lane_first(both.value), kl_lane_first(both.slope),
                                 kl_lane_first(both.second)};
    return h;
}

#endif
