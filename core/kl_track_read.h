/* kl_track_read.h - reading the track, in line for the step. Internal to the core (track room). */
#ifndef KL_TRACK_READ_H
#define KL_TRACK_READ_H

#include "kl_layout.h"
#include "kl_math.h"

/* The piece that holds s, from the bin that holds it and at most two borders on. */
static inline const struct kl_piece *kl_piece_at(const struct kl_track *track, kl_real s) {
    const kl_real top = (kl_real)(track->n_bins - 1u);
    const struct kl_piece *at =
        &track->piece[track->bin[(uint32_t)kl_clamp(s * track->inv_bin_1_m, KL_R(0), top)]];
    return at + ((s >= at[1].start_m) + (s >= at[2].start_m)); /* no branch */
}

/* The layout at s, within its length; `at` is the first column of a kl_track_layout. */
void kl_layout_read(const struct kl_track *track, kl_real s, kl_real *at);

/* The cubic B-spline of all four channels, as a polynomial in the place t = 0..1 between the two
 * inner ones of four control points. */
static inline void kl_irregularity_read(const struct kl_track *restrict track, kl_real s,
                                        struct kl_track_point *restrict point) {
    const uint32_t last = track->n_samples - 2u;
    const kl_real place = (s - track->start_m) * track->inv_step_1_m;
    const kl_real kept = kl_clamp(place, KL_R(0), (kl_real)(last + 1u));
    const uint32_t at = (uint32_t)kept;
    const uint32_t i = at < last ? at : last;
    const kl_real t = kept - (kl_real)i;
    const kl_real half_t = KL_R(0.5) * t;
    const kl_real inside = kl_lane_first(
        kl_lane_if_0(kl_lane_all(kept - place), kl_lane_all(KL_R(1)), kl_lane_all(KL_R(0))));
    const kl_real by = inside * track->inv_step_1_m;
    const kl_real by2 = by * track->inv_step_1_m;
    /* a row is four kl_real, channels beside each other */
    const kl_real *row = &track->irregularity[i].lateral_m;
    KL_EACH_WIDE(h) {
        const kl_wide p0 = kl_wide_load(row, h);
        const kl_wide p1 = kl_wide_load(row + 4, h);
        const kl_wide p2 = kl_wide_load(row + 8, h);
        const kl_wide p3 = kl_wide_load(row + 12, h);
        const kl_wide c1 = KL_R(0.5) * (p2 - p0);
        const kl_wide c2 = (p0 + p2) - (p1 + p1);           /* twice the coefficient of t^2 */
        const kl_wide c3 = (p3 - p0) + KL_R(3) * (p1 - p2); /* six times that of t^3 */
        const kl_wide more = t * c3;
        const kl_wide value =
            (p1 + KL_R(1.0 / 6.0) * c2) + t * (c1 + half_t * (c2 + KL_R(1.0 / 3.0) * more));
        kl_wide_store(&point->value.lateral_m, h, inside * value);
        kl_wide_store(&point->slope.lateral_m, h, by * (c1 + t * (c2 + KL_R(0.5) * more)));
        kl_wide_store(&point->second.lateral_m, h, by2 * (c2 + more));
    }
}

static inline void kl_track_read(const struct kl_track *restrict track, kl_real s,
                                 struct kl_track_point *restrict point) {
    kl_layout_read(track, s, &point->curvature_1_m);
    if (track->irregularity != NULL) {
        kl_irregularity_read(track, s, point);
    } else {
        const struct kl_irregularity_row zero = {0};
        point->value = zero;
        point->slope = zero;
        point->second = zero;
    }
}

#endif
