/*
 * model_schema.h - the two YAML formats as libcyaml fills them in. Private to the loader.
 * An absent optional key is a NULL pointer; members are named like the keys of the files.
 */
#ifndef MODEL_SCHEMA_H
#define MODEL_SCHEMA_H

#include <stdbool.h>

#include <cyaml/cyaml.h>
#include <stdint.h>

#include "klingel.h"

/* ---- vehicle.yaml ---- */

struct raw_arc {
    double radius_m;
    double slope_rad;
    double half_width_m;
};

struct raw_cone {
    double slope_rad;
    double half_width_m;
};

struct raw_profile { /* exactly one of points, file, arc and cone */
    char *points;
    char *file;
    struct raw_arc *arc;
    struct raw_cone *cone;
    double *smoothing_mm; /* of points and file; the rest of file alone */
    int *axes;            /* enum profile_axes */
    int *units;           /* enum raw_units */
    int *origin;          /* enum raw_origin */
    double *from_mm;
    double *to_mm;
    double *deepest_mm;
    double *canted_1_in;
};

enum raw_units { RAW_METRES = 0, RAW_MILLIMETRES = 1 };
enum raw_origin { RAW_TAPE_CIRCLE = 0, RAW_FLANGE_BACK = 1 };

struct raw_wheel_side { /* what one side has of its own */
    struct raw_profile *profile;
    double *radius_m;
};

struct raw_wheel {
    struct raw_profile
        *profile; /* this and radius_m may be absent where both sides have their own */
    double *radius_m;
    double *half_spacing_m;
    double *flange_back_m;
    double *tape_circle_m;
    struct raw_wheel_side *right;
    struct raw_wheel_side *left;
};

struct raw_rail_side {
    struct raw_profile *profile;
    double *cant_rad;
    double *cant_1_in;
};

struct raw_rail {
    struct raw_profile *profile; /* likewise */
    double *cant_rad;
    double *cant_1_in;
    double *half_spacing_m;
    double *gauge_m;
    double *gauge_depth_m;
    struct raw_rail_side *right;
    struct raw_rail_side *left;
};

struct raw_linear {
    double radius_m;
    double half_base_m;
    double conicity;
    double curvature_1_m;
};

struct raw_material {
    double shear_modulus_Pa;
    double poisson;
};

struct raw_flange {
    double stiffness_N_m;
    double damping_Ns_m;
};

struct raw_pair {
    char name[KL_NAME_SIZE];
    struct raw_wheel *wheel;
    struct raw_wheel *wheel_right;
    struct raw_wheel *wheel_left;
    struct raw_rail *rail;
    struct raw_rail *rail_right;
    struct raw_rail *rail_left;
    struct raw_linear *linear;
    int *kinematics; /* enum kl_kinematics; NULL: rigid */
    int *contacts;   /* enum kl_contact_model; NULL: two */
    struct raw_flange *flange;
    struct raw_material *material;
    double step_m;
    double range_m;
};

struct raw_falling {
    double ratio;
    double decay_s_m;
};

struct raw_creep_table {
    char *file;
    bool *compact;
};

struct raw_creep {
    int law;
    double *friction;
    struct raw_falling *falling;
    double *k_a;
    double *k_s;
    double *f11_N;
    double *f22_N;
    double *f23_Nm;
    double *f33_Nm2;
};

enum raw_wheels { RAW_SOLID = 0, RAW_INDEPENDENT = 1 };

struct raw_wheelset {
    char name[KL_NAME_SIZE];
    double mass_kg;
    double inertia_roll_kgm2;
    double inertia_spin_kgm2;
    double inertia_yaw_kgm2;
    double x_m;
    double load_N;
    char pair[KL_NAME_SIZE];
    int wheels; /* enum raw_wheels */
    double *coupling_Nms_rad;
    struct raw_creep creep;
};

struct raw_body {
    char name[KL_NAME_SIZE];
    double mass_kg;
    double inertia_roll_kgm2;
    double inertia_pitch_kgm2;
    double inertia_yaw_kgm2;
    double x_m;
    double height_m;
    uint32_t freedoms;
};

struct raw_point {
    double x_m;
    double y_m;
    double height_m;
};

enum raw_mirror { RAW_MIRROR_NONE = 0, RAW_MIRROR_LATERAL = 1 };

/* Of each pair the one that fits the direction: length or angle. */
struct raw_rod {
    double k_N_m;
    double c_Ns_m;
};

struct raw_series {
    double *k_N_m;
    double *k_Nm_rad;
    double *c_Ns_m;
    double *c_Nms_rad;
    double *limit_N;
    double *limit_Nm;
};

struct raw_friction {
    double *k_N_m;
    double *k_Nm_rad;
    double *force_N;
    double *moment_Nm;
};

struct raw_table {
    double *deflection_m;
    double *angle_rad;
    double *velocity_m_s;
    double *rate_rad_s;
    double *force_N;
    double *moment_Nm;
    uint32_t n_deflection_m;
    uint32_t n_angle_rad;
    uint32_t n_velocity_m_s;
    uint32_t n_rate_rad_s;
    uint32_t n_force_N;
    uint32_t n_moment_Nm;
    bool two_sided;
};

struct raw_element {
    char name[KL_NAME_SIZE];
    char between[2][KL_NAME_SIZE];
    struct raw_point *at;
    struct raw_point *at_a;
    struct raw_point *at_b;
    int mirror;
    int *sway;  /* enum kl_sway */
    int *along; /* enum kl_along */
    struct raw_rod *rod;
    struct raw_series *series;
    struct raw_friction *friction;
    struct raw_table *stop;
    struct raw_table *damper;
    uint32_t *actuator;
    double k_N_m[3];
    double k_Nm_rad[3];
    double c_Ns_m[3];
    double c_Nms_rad[3];
};

struct raw_term {
    char of[KL_NAME_SIZE];
    int freedom; /* enum kl_freedom */
    double factor;
};

struct raw_linkage {
    char name[KL_NAME_SIZE];
    struct raw_term *terms;
    uint32_t n_terms;
    double *k_N_m;
    double *k_Nm_rad;
    double *c_Ns_m;
    double *c_Nms_rad;
    bool rigid;
};

enum raw_speed { RAW_PRESCRIBED = 0, RAW_FREE = 1 };

struct raw_resistance {
    double constant_N;
    double linear_Ns_m;
    double quadratic_Ns2_m2;
};

struct raw_vehicle {
    char name[KL_NAME_SIZE];
    int64_t step_ns;
    double gravity_m_s2;
    double acceleration_limit_m_s2;
    int speed; /* enum raw_speed */
    struct raw_resistance *running_resistance;
    struct raw_body *bodies;
    uint32_t n_bodies;
    struct raw_wheelset *wheelsets;
    uint32_t n_wheelsets;
    struct raw_pair *pairs;
    uint32_t n_pairs;
    struct raw_element *elements;
    uint32_t n_elements;
    struct raw_creep_table *creep_table;
    struct raw_linkage *linkages;
    uint32_t n_linkages;
};

extern const cyaml_schema_value_t raw_vehicle_schema;

/* ---- train.yaml ---- */

struct raw_part {
    char prefix[KL_NAME_SIZE];
    char *file;
    double at_x_m;
    bool reversed;
};

struct raw_train {
    char name[KL_NAME_SIZE];
    int64_t step_ns;
    double gravity_m_s2;
    double acceleration_limit_m_s2;
    int speed;
    struct raw_resistance *running_resistance;
    struct raw_part *vehicles;
    uint32_t n_vehicles;
    struct raw_element *elements;
    uint32_t n_elements;
    struct raw_linkage *linkages;
    uint32_t n_linkages;
};

extern const cyaml_schema_value_t raw_train_schema;

/* ---- track.yaml ---- */

struct raw_start {
    double *curvature_1_m;
    double *radius_m;
    double *cant_rad;
    double *cant_mm;
};

struct raw_segment {
    double length_m;
    int shape; /* enum kl_ramp_shape */
    double *to_curvature_1_m;
    double *to_radius_m;
    double *to_cant_rad;
    double *to_cant_mm;
};

enum raw_spectrum_level { RAW_ERRI_LOW = 0, RAW_ERRI_HIGH = 1 };

struct raw_spectrum {
    int *level;
    double *lateral_A_m2rad_m;
    double *vertical_A_m2rad_m;
    double *cross_A_m2rad_m;
    uint32_t seed;
    uint32_t waves;
    double shortest_m;
    double longest_m;
    double taper_m;
    double start_m;
    double length_m;
    double step_m;
};

struct raw_irregularities { /* exactly one */
    char *samples;
    struct raw_spectrum *spectrum;
};

struct raw_track {
    char name[KL_NAME_SIZE];
    double *cant_base_m;
    struct raw_start *start;
    struct raw_segment *segments;
    uint32_t n_segments;
    struct raw_segment *cant_segments;
    uint32_t n_cant_segments;
    struct raw_irregularities *irregularities;
};

extern const cyaml_schema_value_t raw_track_schema;

#endif
