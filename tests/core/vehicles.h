/*
 * vehicles.h - the vehicles, profiles and tracks that the core's tests run, as definitions in C.
 *
 * No heap, no file, no libm: the golden program uses this header too. A `struct vehicle` points
 * into itself, so it must stay where it was filled; call vehicle_link after changing a count.
 */
#ifndef VEHICLES_H
#define VEHICLES_H

#include "klingel.h"

#define VEHICLE_MAX_BODIES 2
#define VEHICLE_MAX_WHEELSETS 2
#define VEHICLE_MAX_ELEMENTS 8
#define VEHICLE_MAX_RAMPS 16

struct vehicle {
    struct kl_body_def body[VEHICLE_MAX_BODIES];
    struct kl_wheelset_def wheelset[VEHICLE_MAX_WHEELSETS];
    struct kl_element_def element[VEHICLE_MAX_ELEMENTS];
    struct kl_pair_def pair[2];
    struct kl_ramp_def curvature[VEHICLE_MAX_RAMPS];
    struct kl_ramp_def cant[VEHICLE_MAX_RAMPS];
    struct kl_track_def track;
    struct kl_vehicle_def def;
};

/* Points of a wheel and of a rail, in m. */
struct profile_points {
    uint32_t n;
    const double *eta_m;
    const double *zeta_m;
};

static inline void vehicle_link(struct vehicle *v) {
    v->def.bodies = v->body;
    v->def.wheelsets = v->wheelset;
    v->def.elements = v->element;
    v->def.pairs = v->pair;
    v->track.curvature = v->curvature;
    v->track.cant = v->cant;
    v->def.track = &v->track;
}

static inline void set_name(char name[KL_NAME_SIZE], const char *text) {
    for (unsigned i = 0; i + 1u < KL_NAME_SIZE && text[i] != '\0'; i++) {
        name[i] = text[i];
    }
}

/* ---- pairs ---- */

/* Wickens, Fundamentals of Rail Vehicle Dynamics, 2.3: R_w delta0/l 0.01795, R_r delta0/l 0.00989.
 */
#define ARCS_R0 0.45
#define ARCS_L 0.7452
#define ARCS_DELTA0 0.0493
#define ARCS_R_WHEEL (0.01795 * ARCS_L / ARCS_DELTA0)
#define ARCS_R_RAIL (0.00989 * ARCS_L / ARCS_DELTA0)

static inline struct kl_material steel(void) {
    const struct kl_material material = {.shear_modulus_Pa = 82e9, .poisson = 0.28};
    return material;
}

static inline struct kl_profile_def arc(double radius, double slope, double half_width) {
    const struct kl_profile_def def = {
        .kind = KL_PROFILE_ARC, .radius_m = radius, .slope_rad = slope, .half_width_m = half_width};
    return def;
}

static inline struct kl_pair_def pair_of(struct kl_profile_def wheel, struct kl_profile_def rail,
                                         double radius, double half_spacing) {
    struct kl_pair_def def = {.kind = KL_PAIR_PROFILES,
                              .kinematics = KL_KINEMATICS_RIGID,
                              .material = steel(),
                              .step_m = 1e-4,
                              .range_m = 0.008};
    for (int s = 0; s < KL_SIDES; s++) {
        def.wheel[s].profile = wheel;
        def.wheel[s].radius_m = radius;
        def.wheel[s].half_spacing_m = half_spacing;
        def.rail[s].profile = rail;
        def.rail[s].half_spacing_m = half_spacing;
    }
    return def;
}

static inline struct kl_pair_def arcs_pair(enum kl_kinematics kinematics) {
    struct kl_pair_def def = pair_of(arc(ARCS_R_WHEEL, ARCS_DELTA0, 0.06),
                                     arc(ARCS_R_RAIL, ARCS_DELTA0, 0.04), ARCS_R0, ARCS_L);
    def.kinematics = kinematics;
    return def;
}

/* Straight cones on rails of 300 mm head radius. */
static inline struct kl_pair_def cones_pair(double slope) {
    return pair_of(arc(0.0, slope, 0.05), arc(0.3, slope, 0.036), ARCS_R0, ARCS_L);
}

static inline struct kl_pair_def linear_pair(double conicity) {
    const struct kl_pair_def def = {.kind = KL_PAIR_LINEAR,
                                    .radius_m = ARCS_R0,
                                    .half_base_m = ARCS_L,
                                    .conicity = conicity,
                                    .curvature_1_m = 3.33,
                                    .material = steel(),
                                    .step_m = 1e-4,
                                    .range_m = 0.01};
    return def;
}

/* S1002 and UIC60 1:40, gauge 1435 mm at 14 mm, flange backs 1360 mm apart, r0 460 mm at the tape.
 */
static inline struct kl_pair_def points_pair(struct profile_points wheel,
                                             struct profile_points rail) {
    const struct kl_profile_def w = {.kind = KL_PROFILE_POINTS,
                                     .n_points = wheel.n,
                                     .eta_m = wheel.eta_m,
                                     .zeta_m = wheel.zeta_m};
    const struct kl_profile_def r = {
        .kind = KL_PROFILE_POINTS, .n_points = rail.n, .eta_m = rail.eta_m, .zeta_m = rail.zeta_m};
    struct kl_pair_def def = pair_of(w, r, 0.46, 0.75);
    for (int s = 0; s < KL_SIDES; s++) {
        def.rail[s].half_spacing_m = 0.0;
        def.rail[s].cant_rad = 0.024994793618920156; /* atan(1/40) */
        def.rail[s].gauge_m = 1.435;
        def.rail[s].gauge_depth_m = 0.014;
    }
    return def;
}

/* ---- vehicles ---- */

static inline void blank_vehicle(struct vehicle *v) {
    const struct vehicle blank = {0};
    *v = blank;
    v->def.step_ns = 1000000;
    v->def.gravity_m_s2 = 9.81;
    v->def.acceleration_limit_m_s2 = 1.0;
    vehicle_link(v);
}

static inline struct kl_wheelset_def wickens_wheelset(const char *name, double x) {
    struct kl_wheelset_def w = {.mass_kg = 1250.0,
                                .inertia_roll_kgm2 = 700.0,
                                .inertia_spin_kgm2 = 100.0,
                                .inertia_yaw_kgm2 = 700.0,
                                .x_m = x,
                                .creep = {.law = KL_CREEP_SHE, .friction = (kl_real)0.3}};
    set_name(w.name, name);
    return w;
}

/* f11 7.44 MN, f22 6.79 MN, no spin: the constants of Wickens' example. */
static inline struct kl_creep_def constant_creep(void) {
    const struct kl_creep_def creep = {
        .law = KL_CREEP_LINEAR, .f11_N = (kl_real)7.44e6, .f22_N = (kl_real)6.79e6};
    return creep;
}

/* One wheelset with ground springs at its centre; the pair is the caller's. */
static inline void single_wheelset(struct vehicle *v, struct kl_pair_def pair, double k_y,
                                   double k_yaw) {
    blank_vehicle(v);
    set_name(v->def.name, "wheelset");
    v->def.n_pairs = 1;
    v->pair[0] = pair;
    v->def.n_wheelsets = 1;
    v->wheelset[0] = wickens_wheelset("wheelset", 0.0);
    v->def.n_elements = 1;
    set_name(v->element[0].name, "restraint");
    v->element[0].end_a = KL_WHEELSET_END(0);
    v->element[0].end_b = KL_GROUND_END;
    v->element[0].point_a_m[2] = -ARCS_R0;
    v->element[0].point_b_m[2] = -ARCS_R0;
    v->element[0].k[1] = k_y;
    v->element[0].k[5] = k_yaw;
}

static inline void corner(struct kl_element_def *e, const char *name, int32_t wheelset, double x,
                          double y) {
    const struct kl_element_def def = {.end_a = 0,
                                       .end_b = KL_WHEELSET_END(wheelset),
                                       .point_a_m = {x, y, -0.5},
                                       .point_b_m = {x, y, -0.5},
                                       .k = {2.0e6, 0.4e6, 1.1e6, 0.0, 0.0, 0.0},
                                       .c = {10e3, 20e3, 20e3, 0.0, 0.0, 0.0}};
    *e = def;
    set_name(e->name, name);
}

/* A two-axle wagon of 40 t, wheelbase 9 m: the numbers of models/two_axle_wagon.yaml. */
static inline void wagon(struct vehicle *v, struct kl_pair_def pair) {
    blank_vehicle(v);
    set_name(v->def.name, "wagon");
    v->def.n_pairs = 1;
    v->pair[0] = pair;
    v->def.n_bodies = 1;
    set_name(v->body[0].name, "body");
    v->body[0].mass_kg = 37200.0;
    v->body[0].inertia_kgm2[0] = 34.4e3;
    v->body[0].inertia_kgm2[1] = 623e3;
    v->body[0].inertia_kgm2[2] = 627e3;
    v->body[0].z_m = -1.65;
    v->body[0].freedoms = 31;
    v->def.n_wheelsets = 2;
    v->wheelset[0] = wickens_wheelset("front", 4.5);
    v->wheelset[1] = wickens_wheelset("rear", -4.5);
    for (int i = 0; i < 2; i++) {
        v->wheelset[i].mass_kg = 1400.0;
        v->wheelset[i].inertia_roll_kgm2 = 750.0;
        v->wheelset[i].inertia_yaw_kgm2 = 750.0;
    }
    v->def.n_elements = 4;
    corner(&v->element[0], "front right", 0, 4.5, 1.0);
    corner(&v->element[1], "front left", 0, 4.5, -1.0);
    corner(&v->element[2], "rear right", 1, -4.5, 1.0);
    corner(&v->element[3], "rear left", 1, -4.5, -1.0);
}

/* ---- tracks ---- */

static inline void add_ramp(struct kl_ramp_def *list, uint32_t *n, enum kl_ramp_shape shape,
                            double length, double to) {
    const struct kl_ramp_def ramp = {shape, length, to};
    list[*n] = ramp;
    (*n)++;
}

/* Straight, a transition, a curve, a transition, straight for ever; cant runs along. */
static inline void one_curve(struct vehicle *v, enum kl_ramp_shape shape, double curvature,
                             double cant) {
    const double straight = 30.0;
    const double transition = 60.0;
    const double curve = 100.0;
    v->track.n_curvature = 0;
    v->track.n_cant = 0;
    struct kl_ramp_def *lists[2] = {v->curvature, v->cant};
    uint32_t *counts[2] = {&v->track.n_curvature, &v->track.n_cant};
    const double value[2] = {curvature, cant};
    for (int i = 0; i < 2; i++) {
        add_ramp(lists[i], counts[i], KL_RAMP_CONSTANT, straight, 0.0);
        add_ramp(lists[i], counts[i], shape, transition, value[i]);
        add_ramp(lists[i], counts[i], KL_RAMP_CONSTANT, curve, 0.0);
        add_ramp(lists[i], counts[i], shape, transition, 0.0);
    }
}

/* For ever in one curve. */
static inline void endless_curve(struct vehicle *v, double curvature, double cant) {
    v->track.curvature_start_1_m = curvature;
    v->track.cant_start_rad = cant;
}

#endif
