/*
 * sketch_vehicle.h - one view of a vehicle: rails, wheelsets, bodies, elements, linkages.
 *
 * A model knows masses and points, not shapes. A body is drawn as the homogeneous box of its mass and
 * inertias, cut off at the rail; an element's symbol stands where it acts, as long as can be read.
 */
#ifndef SKETCH_VEHICLE_H
#define SKETCH_VEHICLE_H

#include "sketch_list.h"

struct sketch_box_m {
    double low[3]; /* vehicle frame; z down, so that low[2] is the top */
    double high[3];
};
void sketch_body_box(const struct kl_body_def *body, struct sketch_box_m *box);

double sketch_wheel_radius(const struct kl_vehicle_def *def, uint32_t wheelset);
double sketch_half_base(const struct kl_vehicle_def *def, uint32_t wheelset);

/* How far the vehicle reaches. */
void sketch_extent(const struct kl_vehicle_def *def, struct sketch_box_m *extent);

struct sketch_what {
    const struct kl_vehicle_def *def;
    const struct sketch_groups *groups;
    bool names;            /* of the bodies, in a side view */
    bool distances;        /* of the wheelsets, below a side view */
    double numbered_low_m; /* elements between these are numbered elsewhere */
    double numbered_high_m;
};
void sketch_draw(struct sketch_view *view, const struct sketch_what *what);

#endif
