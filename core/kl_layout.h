/* kl_layout.h - integrals over one piece of track. Internal to the core (track room). */
#ifndef KL_LAYOUT_H
#define KL_LAYOUT_H

#include "kl_track.h"

/* int value ds over d from a piece's start, and the integral of that; c as in kl_piece. */
static inline kl_real kl_layout_heading(const kl_real c[4], kl_real d) {
    return d * (c[0] + d * ((kl_real)0.5 * c[1] +
                            d * ((kl_real)(1.0 / 3.0) * c[2] + d * ((kl_real)0.25 * c[3]))));
}
static inline kl_real kl_layout_offset(const kl_real c[4], kl_real d) {
    return (d * d) * ((kl_real)0.5 * c[0] +
                      d * ((kl_real)(1.0 / 6.0) * c[1] +
                           d * ((kl_real)(1.0 / 12.0) * c[2] + d * ((kl_real)0.05 * c[3]))));
}

/* The way in the earth frame over `length` from a piece's start. */
void kl_layout_path(const struct kl_piece *piece, double length, double *x, double *y);

#endif
