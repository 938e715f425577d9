/* kl_reach.c - how the ends of elements and linkages move with the coordinates. */
#include "kl_reach.h"

#include "kl_math.h"
#include "kl_suspension.h"

int kl_is_end(const struct kl_vehicle_def *def, int32_t end) {
    return end == KL_GROUND_END || (end >= 0 && end < (int32_t)def->n_bodies) ||
           (kl_is_wheelset(end) && end <= KL_WHEELSET_END((int32_t)def->n_wheelsets - 1));
}

static void add(struct kl_reach *reach, uint32_t coordinate, double factor) {
    if (factor == 0.0) {
        return;
    }
    for (uint32_t i = 0; i < reach->n; i++) {
        if (reach->coordinate[i] == coordinate) {
            reach->factor[i] += factor;
            return;
        }
    }
    reach->coordinate[reach->n] = coordinate;
    reach->factor[reach->n] = factor;
    reach->n++;
}

double kl_reach_below(const struct kl_assembly *as, int32_t end, const double point[3]) {
    if (end == KL_GROUND_END) {
        return point[2];
    }
    const int32_t w = end - KL_WHEELSET_END(0);
    return point[2] - (kl_is_wheelset(end) ? as->axle_z_m[w] : as->def->bodies[end].z_m);
}

/* d = translation + theta x r. */
void kl_reach_point(const struct kl_assembly *as, int32_t end, const double point[3], int direction,
                    int with_pitch, double factor, struct kl_reach *reach) {
    if (end == KL_GROUND_END) {
        return;
    }
    const struct kl_vehicle_def *def = as->def;
    const int wheelset = kl_is_wheelset(end);
    const uint32_t i = (uint32_t)(wheelset ? end - KL_WHEELSET_END(0) : end);
    const uint32_t base =
        wheelset ? kl_wheelset_coordinate(def->n_bodies, i) : kl_body_coordinate(i);
    const uint32_t yaw = base + (wheelset ? 3u : (uint32_t)KL_YAW);
    const uint32_t y = base;
    const uint32_t z = base + 1u;
    const uint32_t roll = base + 2u;
    const uint32_t pitch = base + 3u; /* bodies only */
    const double rx = point[0] - (wheelset ? def->wheelsets[i].x_m : def->bodies[i].x_m);
    const double ry = point[1];
    const double rz = kl_reach_below(as, end, point);
    switch (direction) {
    case KL_ALONG_X:
        add(reach, yaw, -factor * ry);
        add(reach, pitch, wheelset || !with_pitch ? 0.0 : factor * rz);
        break;
    case KL_ALONG_Y:
        add(reach, y, factor);
        add(reach, yaw, factor * rx);
        add(reach, roll, -factor * rz);
        break;
    case KL_ALONG_Z:
        add(reach, z, factor);
        add(reach, roll, factor * ry);
        add(reach, pitch, wheelset ? 0.0 : -factor * rx);
        break;
    case KL_ALONG_ROLL:
        add(reach, roll, factor);
        break;
    case KL_ALONG_PITCH:
        add(reach, pitch, wheelset ? 0.0 : factor);
        break;
    default:
        add(reach, yaw, factor);
        break;
    }
}

void kl_reach_element(const struct kl_assembly *as, const struct kl_element_def *e,
                      enum kl_along along, struct kl_reach *reach) {
    const int with_pitch = !kl_is_wheelset(e->end_a) && !kl_is_wheelset(e->end_b);
    reach->n = 0;
    if (along != KL_ALONG_LINE) {
        kl_reach_point(as, e->end_a, e->point_a_m, (int)along, with_pitch, 1.0, reach);
        kl_reach_point(as, e->end_b, e->point_b_m, (int)along, with_pitch, -1.0, reach);
        return;
    }
    double to_a[3];
    double square = 0.0;
    for (int k = 0; k < 3; k++) {
        to_a[k] = e->point_a_m[k] - e->point_b_m[k];
        square += to_a[k] * to_a[k];
    }
    const double length = kl_sqrt(square);
    for (int k = 0; k < 3; k++) {
        kl_reach_point(as, e->end_a, e->point_a_m, k, with_pitch, to_a[k] / length, reach);
        kl_reach_point(as, e->end_b, e->point_b_m, k, with_pitch, -to_a[k] / length, reach);
    }
}

void kl_reach_linkage(const struct kl_vehicle_def *def, const struct kl_linkage_def *linkage,
                      struct kl_reach *reach) {
    static const uint32_t of_wheelset[KL_FREEDOMS] = {0, 1, 2, 0, 3};
    reach->n = 0;
    for (uint32_t i = 0; i < linkage->n_terms; i++) {
        const struct kl_term_def *t = &linkage->term[i];
        const uint32_t w = (uint32_t)(t->end - KL_WHEELSET_END(0));
        const uint32_t coordinate =
            kl_is_wheelset(t->end)
                ? kl_wheelset_coordinate(def->n_bodies, w) + of_wheelset[t->freedom]
                : kl_body_coordinate((uint32_t)t->end) + (uint32_t)t->freedom;
        add(reach, coordinate, t->factor);
    }
}
