/* kl_layout.h - the polynomials of one piece of track. Internal to the core (track room). */
#ifndef KL_LAYOUT_H
#define KL_LAYOUT_H

#include "kl_track.h"

/* Those of curvature c and cant, about the piece's start, with what has been integrated up to there. */
void kl_layout_set(struct kl_piece *piece, const kl_real c[4], const kl_real cant[4],
                   kl_real heading_rad, kl_real offset_m);

/* Heading and offset at d from the start. */
kl_real kl_layout_heading(const struct kl_piece *piece, kl_real d);
kl_real kl_layout_offset(const struct kl_piece *piece, kl_real d);

/* The way in the earth frame over `length` from a piece's start. */
void kl_layout_path(const struct kl_piece *piece, double length, double *x, double *y);

#endif
