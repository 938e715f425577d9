/*
 * flange.h - a wheelset of S1002 on UIC60 with tread and flange apart, pushed aside: what the tests
 * of flange contact share.
 */
#ifndef FLANGE_H
#define FLANGE_H

#include "fixtures.h"

/* S1002 on UIC60 1:40, both contacts. The table reaches as far as a flange holds. */
static inline struct kl_pair_def two_contacts(void) {
    struct kl_pair_def pair = s1002_uic60();
    pair.contacts = KL_CONTACTS_TWO;
    pair.range_m = 0.02;
    return pair;
}

/* Of the actuators of a pushed wheelset. */
enum { PUSH_Y = 0, PUSH_YAW = 1 };

/*
 * One wheelset under a dead load, which an actuator at the height of the rails pushes to the right, so
 * that the wheel loads stay, and another turns. A spring in yaw, dampers in y and yaw; none of them where `damping` is 0.
 */
static inline void pushed_wheelset(struct vehicle *v, double load, double k_yaw, double damping) {
    single_wheelset(v, two_contacts(), 0.0, k_yaw);
    v->wheelset[0].load_N = load;
    for (int i = 0; i < 2; i++) {
        v->element[i] = v->element[0];
        v->element[i].point_a_m[2] = 0.0;
        v->element[i].point_b_m[2] = 0.0;
        v->element[i].along = i == PUSH_Y ? KL_ALONG_Y : KL_ALONG_YAW;
        v->element[i].actuator = (uint32_t)i + 1u;
    }
    memset(v->element[1].k, 0, sizeof v->element[1].k);
    set_name(v->element[1].name, "turn");
    v->element[0].c[1] = damping;
    v->element[0].c[5] = 0.1 * damping;
    v->def.n_elements = 2;
}

/* What of the flange is on the rail, and of the tread. */
static inline int flange_touches(const struct kl_output *o, uint32_t w, int side) {
    return o->wheelset[w].flange.normal_N[side] > 0;
}
static inline int tread_is_off(const struct kl_output *o, uint32_t w, int side) {
    return o->wheelset[w].rise_m[side] > 0;
}

#endif
