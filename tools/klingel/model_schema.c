/* model_schema.c - the formats' keys for libcyaml. What a key means: models/README.md. */
#include "model_schema.h"

#include "profile_file.h"

#define MUST CYAML_FLAG_DEFAULT
#define MAY CYAML_FLAG_OPTIONAL
#define STRICT_MUST CYAML_FLAG_STRICT
#define STRICT_MAY (CYAML_FLAG_STRICT | CYAML_FLAG_OPTIONAL)

/* Numbers and sub-mappings; OPT ones leave a NULL pointer behind. */
#define NUMBER(type, member) CYAML_FIELD_FLOAT(#member, STRICT_MUST, struct type, member)
#define NUMBER_OR_0(type, member) CYAML_FIELD_FLOAT(#member, STRICT_MAY, struct type, member)
#define OPT_NUMBER(type, member) CYAML_FIELD_FLOAT_PTR(#member, STRICT_MAY, struct type, member)
#define NAME(type, member) CYAML_FIELD_STRING(#member, MUST, struct type, member, 1)
#define OPT_PATH(type, member)                                                                     \
    CYAML_FIELD_STRING_PTR(#member, MAY | CYAML_FLAG_POINTER, struct type, member, 1, 200)
#define PART(type, member, fields) CYAML_FIELD_MAPPING(#member, MUST, struct type, member, fields)
#define OPT_PART(type, member, fields)                                                             \
    CYAML_FIELD_MAPPING_PTR(#member, MAY | CYAML_FLAG_POINTER, struct type, member, fields)
#define LIST(type, member, count, flags, entry, least, most)                                       \
    CYAML_FIELD_SEQUENCE_COUNT(#member, (flags) | CYAML_FLAG_POINTER, struct type, member, count,  \
                               entry, least, most)
#define TRIPLE(type, member)                                                                       \
    CYAML_FIELD_SEQUENCE_FIXED(#member, MAY, struct type, member, &number, 3)

static const cyaml_schema_value_t number = {CYAML_VALUE_FLOAT(STRICT_MUST, double)};

/* ---- vehicle ---- */

static const cyaml_schema_field_t arc_fields[] = {NUMBER(raw_arc, radius_m),
                                                  NUMBER(raw_arc, slope_rad),
                                                  NUMBER(raw_arc, half_width_m), CYAML_FIELD_END};

static const cyaml_schema_field_t cone_fields[] = {NUMBER(raw_cone, slope_rad),
                                                   NUMBER(raw_cone, half_width_m), CYAML_FIELD_END};

static const cyaml_strval_t axes[] = {{"inboard_down", PROFILE_INBOARD_DOWN},
                                      {"inboard_up", PROFILE_INBOARD_UP},
                                      {"outboard_down", PROFILE_OUTBOARD_DOWN},
                                      {"outboard_up", PROFILE_OUTBOARD_UP}};
static const cyaml_strval_t units[] = {{"m", RAW_METRES}, {"mm", RAW_MILLIMETRES}};
static const cyaml_strval_t origins[] = {{"tape_circle", RAW_TAPE_CIRCLE},
                                         {"flange_back", RAW_FLANGE_BACK}};

static const cyaml_schema_field_t profile_fields[] = {
    OPT_PATH(raw_profile, points),
    OPT_PATH(raw_profile, file),
    OPT_PART(raw_profile, arc, arc_fields),
    OPT_PART(raw_profile, cone, cone_fields),
    OPT_NUMBER(raw_profile, smoothing_mm),
    CYAML_FIELD_ENUM_PTR("axes", STRICT_MAY, struct raw_profile, axes, axes, CYAML_ARRAY_LEN(axes)),
    CYAML_FIELD_ENUM_PTR("units", STRICT_MAY, struct raw_profile, units, units,
                         CYAML_ARRAY_LEN(units)),
    CYAML_FIELD_ENUM_PTR("origin", STRICT_MAY, struct raw_profile, origin, origins,
                         CYAML_ARRAY_LEN(origins)),
    OPT_NUMBER(raw_profile, from_mm),
    OPT_NUMBER(raw_profile, to_mm),
    OPT_NUMBER(raw_profile, deepest_mm),
    OPT_NUMBER(raw_profile, canted_1_in),
    CYAML_FIELD_END};

static const cyaml_schema_field_t wheel_side_fields[] = {
    OPT_PART(raw_wheel_side, profile, profile_fields), OPT_NUMBER(raw_wheel_side, radius_m),
    CYAML_FIELD_END};

static const cyaml_schema_field_t wheel_fields[] = {
    OPT_PART(raw_wheel, profile, profile_fields), OPT_NUMBER(raw_wheel, radius_m),
    OPT_NUMBER(raw_wheel, half_spacing_m),        OPT_NUMBER(raw_wheel, flange_back_m),
    OPT_NUMBER(raw_wheel, tape_circle_m),         OPT_PART(raw_wheel, right, wheel_side_fields),
    OPT_PART(raw_wheel, left, wheel_side_fields), CYAML_FIELD_END};

static const cyaml_schema_field_t rail_side_fields[] = {
    OPT_PART(raw_rail_side, profile, profile_fields), OPT_NUMBER(raw_rail_side, cant_rad),
    OPT_NUMBER(raw_rail_side, cant_1_in), CYAML_FIELD_END};

static const cyaml_schema_field_t rail_fields[] = {OPT_PART(raw_rail, profile, profile_fields),
                                                   OPT_NUMBER(raw_rail, cant_rad),
                                                   OPT_NUMBER(raw_rail, cant_1_in),
                                                   OPT_NUMBER(raw_rail, half_spacing_m),
                                                   OPT_NUMBER(raw_rail, gauge_m),
                                                   OPT_NUMBER(raw_rail, gauge_depth_m),
                                                   OPT_PART(raw_rail, right, rail_side_fields),
                                                   OPT_PART(raw_rail, left, rail_side_fields),
                                                   CYAML_FIELD_END};

static const cyaml_schema_field_t linear_fields[] = {
    NUMBER(raw_linear, radius_m), NUMBER(raw_linear, half_base_m), NUMBER(raw_linear, conicity),
    NUMBER(raw_linear, curvature_1_m), CYAML_FIELD_END};

static const cyaml_schema_field_t material_fields[] = {
    NUMBER(raw_material, shear_modulus_Pa), NUMBER(raw_material, poisson), CYAML_FIELD_END};

static const cyaml_strval_t kinematics[] = {{"rigid", KL_KINEMATICS_RIGID},
                                            {"printed", KL_KINEMATICS_PRINTED}};

static const cyaml_strval_t contacts[] = {{"two", KL_CONTACTS_TWO}, {"rigid", KL_CONTACTS_RIGID}};

static const cyaml_schema_field_t flange_fields[] = {
    NUMBER(raw_flange, stiffness_N_m), NUMBER(raw_flange, damping_Ns_m), CYAML_FIELD_END};

static const cyaml_schema_field_t pair_fields[] = {
    NAME(raw_pair, name),
    OPT_PART(raw_pair, wheel, wheel_fields),
    OPT_PART(raw_pair, wheel_right, wheel_fields),
    OPT_PART(raw_pair, wheel_left, wheel_fields),
    OPT_PART(raw_pair, rail, rail_fields),
    OPT_PART(raw_pair, rail_right, rail_fields),
    OPT_PART(raw_pair, rail_left, rail_fields),
    OPT_PART(raw_pair, linear, linear_fields),
    CYAML_FIELD_ENUM_PTR("kinematics", STRICT_MAY, struct raw_pair, kinematics, kinematics,
                         CYAML_ARRAY_LEN(kinematics)),
    CYAML_FIELD_ENUM_PTR("contacts", STRICT_MAY, struct raw_pair, contacts, contacts,
                         CYAML_ARRAY_LEN(contacts)),
    OPT_PART(raw_pair, flange, flange_fields),
    OPT_PART(raw_pair, material, material_fields),
    NUMBER(raw_pair, step_m),
    NUMBER(raw_pair, range_m),
    CYAML_FIELD_END};

static const cyaml_strval_t creep_laws[] = {{"linear", KL_CREEP_LINEAR},
                                            {"she", KL_CREEP_SHE},
                                            {"polach", KL_CREEP_POLACH},
                                            {"fastsim", KL_CREEP_FASTSIM},
                                            {"fastsim_elliptic", KL_CREEP_FASTSIM_ELLIPTIC},
                                            {"table", KL_CREEP_TABLE}};

static const cyaml_schema_field_t falling_fields[] = {
    NUMBER(raw_falling, ratio), NUMBER(raw_falling, decay_s_m), CYAML_FIELD_END};

static const cyaml_schema_field_t creep_table_fields[] = {
    OPT_PATH(raw_creep_table, file),
    CYAML_FIELD_BOOL_PTR("compact", STRICT_MAY, struct raw_creep_table, compact), CYAML_FIELD_END};

static const cyaml_schema_field_t creep_fields[] = {
    CYAML_FIELD_ENUM("law", STRICT_MUST, struct raw_creep, law, creep_laws,
                     CYAML_ARRAY_LEN(creep_laws)),
    OPT_NUMBER(raw_creep, friction),
    OPT_PART(raw_creep, falling, falling_fields),
    OPT_NUMBER(raw_creep, k_a),
    OPT_NUMBER(raw_creep, k_s),
    OPT_NUMBER(raw_creep, f11_N),
    OPT_NUMBER(raw_creep, f22_N),
    OPT_NUMBER(raw_creep, f23_Nm),
    OPT_NUMBER(raw_creep, f33_Nm2),
    CYAML_FIELD_END};

static const cyaml_strval_t wheels[] = {{"solid", RAW_SOLID}, {"independent", RAW_INDEPENDENT}};

static const cyaml_schema_field_t wheelset_fields[] = {
    NAME(raw_wheelset, name),
    NUMBER(raw_wheelset, mass_kg),
    NUMBER(raw_wheelset, inertia_roll_kgm2),
    NUMBER(raw_wheelset, inertia_spin_kgm2),
    NUMBER(raw_wheelset, inertia_yaw_kgm2),
    NUMBER(raw_wheelset, x_m),
    NUMBER_OR_0(raw_wheelset, load_N),
    NAME(raw_wheelset, pair),
    CYAML_FIELD_ENUM("wheels", STRICT_MAY, struct raw_wheelset, wheels, wheels,
                     CYAML_ARRAY_LEN(wheels)),
    OPT_NUMBER(raw_wheelset, coupling_Nms_rad),
    PART(raw_wheelset, creep, creep_fields),
    CYAML_FIELD_END};

static const cyaml_strval_t freedoms[] = {{"y", KL_HAS(KL_Y)},
                                          {"z", KL_HAS(KL_Z)},
                                          {"roll", KL_HAS(KL_ROLL)},
                                          {"pitch", KL_HAS(KL_PITCH)},
                                          {"yaw", KL_HAS(KL_YAW)}};

static const cyaml_schema_field_t body_fields[] = {
    NAME(raw_body, name),
    NUMBER(raw_body, mass_kg),
    NUMBER(raw_body, inertia_roll_kgm2),
    NUMBER(raw_body, inertia_pitch_kgm2),
    NUMBER(raw_body, inertia_yaw_kgm2),
    NUMBER(raw_body, x_m),
    NUMBER(raw_body, height_m),
    CYAML_FIELD_FLAGS("freedoms", STRICT_MUST, struct raw_body, freedoms, freedoms,
                      CYAML_ARRAY_LEN(freedoms)),
    CYAML_FIELD_END};

static const cyaml_schema_field_t point_fields[] = {NUMBER(raw_point, x_m), NUMBER(raw_point, y_m),
                                                    NUMBER(raw_point, height_m), CYAML_FIELD_END};

static const cyaml_strval_t mirrors[] = {{"none", RAW_MIRROR_NONE},
                                         {"lateral", RAW_MIRROR_LATERAL}};

static const cyaml_schema_value_t end_name = {
    CYAML_VALUE_STRING(MUST, char[KL_NAME_SIZE], 1, KL_NAME_SIZE - 1)};

static const cyaml_strval_t sways[] = {
    {"none", KL_SWAY_NONE}, {"clamped", KL_SWAY_CLAMPED}, {"pinned", KL_SWAY_PINNED}};

static const cyaml_strval_t directions[] = {{"x", KL_ALONG_X},         {"y", KL_ALONG_Y},
                                            {"z", KL_ALONG_Z},         {"roll", KL_ALONG_ROLL},
                                            {"pitch", KL_ALONG_PITCH}, {"yaw", KL_ALONG_YAW},
                                            {"line", KL_ALONG_LINE}};

static const cyaml_schema_field_t rod_fields[] = {NUMBER(raw_rod, k_N_m),
                                                  NUMBER_OR_0(raw_rod, c_Ns_m), CYAML_FIELD_END};

static const cyaml_schema_field_t series_fields[] = {OPT_NUMBER(raw_series, k_N_m),
                                                     OPT_NUMBER(raw_series, k_Nm_rad),
                                                     OPT_NUMBER(raw_series, c_Ns_m),
                                                     OPT_NUMBER(raw_series, c_Nms_rad),
                                                     OPT_NUMBER(raw_series, limit_N),
                                                     OPT_NUMBER(raw_series, limit_Nm),
                                                     CYAML_FIELD_END};

static const cyaml_schema_field_t friction_fields[] = {
    OPT_NUMBER(raw_friction, k_N_m), OPT_NUMBER(raw_friction, k_Nm_rad),
    OPT_NUMBER(raw_friction, force_N), OPT_NUMBER(raw_friction, moment_Nm), CYAML_FIELD_END};

#define NUMBERS(type, member) LIST(type, member, n_##member, MAY, &number, 1, KL_MAX_TABLE_POINTS)
#define SWITCH(type, member) CYAML_FIELD_BOOL(#member, STRICT_MAY, struct type, member)

static const cyaml_schema_field_t stop_fields[] = {
    NUMBERS(raw_table, deflection_m), NUMBERS(raw_table, angle_rad), NUMBERS(raw_table, force_N),
    NUMBERS(raw_table, moment_Nm),    SWITCH(raw_table, two_sided),  CYAML_FIELD_END};

static const cyaml_schema_field_t damper_fields[] = {
    NUMBERS(raw_table, velocity_m_s), NUMBERS(raw_table, rate_rad_s), NUMBERS(raw_table, force_N),
    NUMBERS(raw_table, moment_Nm),    SWITCH(raw_table, two_sided),   CYAML_FIELD_END};

static const cyaml_schema_field_t element_fields[] = {
    NAME(raw_element, name),
    CYAML_FIELD_SEQUENCE_FIXED("between", MUST, struct raw_element, between, &end_name, 2),
    OPT_PART(raw_element, at, point_fields),
    OPT_PART(raw_element, at_a, point_fields),
    OPT_PART(raw_element, at_b, point_fields),
    CYAML_FIELD_ENUM("mirror", STRICT_MAY, struct raw_element, mirror, mirrors,
                     CYAML_ARRAY_LEN(mirrors)),
    TRIPLE(raw_element, k_N_m),
    TRIPLE(raw_element, k_Nm_rad),
    TRIPLE(raw_element, c_Ns_m),
    TRIPLE(raw_element, c_Nms_rad),
    CYAML_FIELD_ENUM_PTR("sway", STRICT_MAY, struct raw_element, sway, sways,
                         CYAML_ARRAY_LEN(sways)),
    CYAML_FIELD_ENUM_PTR("along", STRICT_MAY, struct raw_element, along, directions,
                         CYAML_ARRAY_LEN(directions)),
    OPT_PART(raw_element, rod, rod_fields),
    OPT_PART(raw_element, series, series_fields),
    OPT_PART(raw_element, friction, friction_fields),
    OPT_PART(raw_element, stop, stop_fields),
    OPT_PART(raw_element, damper, damper_fields),
    CYAML_FIELD_UINT_PTR("actuator", STRICT_MAY, struct raw_element, actuator),
    CYAML_FIELD_END};

static const cyaml_strval_t term_freedoms[] = {
    {"y", KL_Y}, {"z", KL_Z}, {"roll", KL_ROLL}, {"pitch", KL_PITCH}, {"yaw", KL_YAW}};

static const cyaml_schema_field_t term_fields[] = {
    NAME(raw_term, of),
    CYAML_FIELD_ENUM("freedom", STRICT_MUST, struct raw_term, freedom, term_freedoms,
                     CYAML_ARRAY_LEN(term_freedoms)),
    NUMBER(raw_term, factor), CYAML_FIELD_END};

static const cyaml_schema_value_t term = {CYAML_VALUE_MAPPING(MUST, struct raw_term, term_fields)};

static const cyaml_schema_field_t linkage_fields[] = {
    NAME(raw_linkage, name),
    LIST(raw_linkage, terms, n_terms, MUST, &term, 2, KL_MAX_TERMS),
    OPT_NUMBER(raw_linkage, k_N_m),
    OPT_NUMBER(raw_linkage, k_Nm_rad),
    OPT_NUMBER(raw_linkage, c_Ns_m),
    OPT_NUMBER(raw_linkage, c_Nms_rad),
    SWITCH(raw_linkage, rigid),
    CYAML_FIELD_END};

static const cyaml_schema_value_t linkage = {
    CYAML_VALUE_MAPPING(MUST, struct raw_linkage, linkage_fields)};

static const cyaml_schema_value_t body = {CYAML_VALUE_MAPPING(MUST, struct raw_body, body_fields)};
static const cyaml_schema_value_t wheelset = {
    CYAML_VALUE_MAPPING(MUST, struct raw_wheelset, wheelset_fields)};
static const cyaml_schema_value_t pair = {CYAML_VALUE_MAPPING(MUST, struct raw_pair, pair_fields)};
static const cyaml_schema_value_t element = {
    CYAML_VALUE_MAPPING(MUST, struct raw_element, element_fields)};

static const cyaml_strval_t speeds[] = {{"prescribed", RAW_PRESCRIBED}, {"free", RAW_FREE}};

static const cyaml_schema_field_t resistance_fields[] = {
    NUMBER_OR_0(raw_resistance, constant_N), NUMBER_OR_0(raw_resistance, linear_Ns_m),
    NUMBER_OR_0(raw_resistance, quadratic_Ns2_m2), CYAML_FIELD_END};

static const cyaml_schema_field_t vehicle_fields[] = {
    NAME(raw_vehicle, name),
    CYAML_FIELD_INT("step_ns", MUST, struct raw_vehicle, step_ns),
    NUMBER(raw_vehicle, gravity_m_s2),
    NUMBER(raw_vehicle, acceleration_limit_m_s2),
    CYAML_FIELD_ENUM("speed", STRICT_MAY, struct raw_vehicle, speed, speeds,
                     CYAML_ARRAY_LEN(speeds)),
    OPT_PART(raw_vehicle, running_resistance, resistance_fields),
    LIST(raw_vehicle, bodies, n_bodies, MAY, &body, 0, KL_MAX_BODIES),
    LIST(raw_vehicle, wheelsets, n_wheelsets, MUST, &wheelset, 1, KL_MAX_WHEELSETS),
    LIST(raw_vehicle, pairs, n_pairs, MUST, &pair, 1, KL_MAX_PAIRS),
    LIST(raw_vehicle, elements, n_elements, MAY, &element, 0, KL_MAX_ELEMENTS),
    OPT_PART(raw_vehicle, creep_table, creep_table_fields),
    LIST(raw_vehicle, linkages, n_linkages, MAY, &linkage, 0, KL_MAX_LINKAGES),
    CYAML_FIELD_END};

const cyaml_schema_value_t raw_vehicle_schema = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_POINTER, struct raw_vehicle, vehicle_fields)};

/* ---- train ---- */

static const cyaml_schema_field_t part_fields[] = {
    NAME(raw_part, prefix),
    CYAML_FIELD_STRING_PTR("file", MUST | CYAML_FLAG_POINTER, struct raw_part, file, 1, 200),
    NUMBER(raw_part, at_x_m), SWITCH(raw_part, reversed), CYAML_FIELD_END};

static const cyaml_schema_value_t part = {CYAML_VALUE_MAPPING(MUST, struct raw_part, part_fields)};

static const cyaml_schema_field_t train_fields[] = {
    NAME(raw_train, name),
    CYAML_FIELD_INT("step_ns", MUST, struct raw_train, step_ns),
    NUMBER(raw_train, gravity_m_s2),
    NUMBER(raw_train, acceleration_limit_m_s2),
    CYAML_FIELD_ENUM("speed", STRICT_MAY, struct raw_train, speed, speeds, CYAML_ARRAY_LEN(speeds)),
    OPT_PART(raw_train, running_resistance, resistance_fields),
    LIST(raw_train, vehicles, n_vehicles, MUST, &part, 1, KL_MAX_WHEELSETS),
    LIST(raw_train, elements, n_elements, MAY, &element, 0, KL_MAX_ELEMENTS),
    LIST(raw_train, linkages, n_linkages, MAY, &linkage, 0, KL_MAX_LINKAGES),
    CYAML_FIELD_END};

const cyaml_schema_value_t raw_train_schema = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_POINTER, struct raw_train, train_fields)};

/* ---- track ---- */

static const cyaml_strval_t shapes[] = {{"constant", KL_RAMP_CONSTANT},
                                        {"linear", KL_RAMP_LINEAR},
                                        {"bloss", KL_RAMP_BLOSS},
                                        {"half_sine", KL_RAMP_HALF_SINE}};

static const cyaml_schema_field_t segment_fields[] = {
    NUMBER(raw_segment, length_m),
    CYAML_FIELD_ENUM("shape", STRICT_MUST, struct raw_segment, shape, shapes,
                     CYAML_ARRAY_LEN(shapes)),
    OPT_NUMBER(raw_segment, to_curvature_1_m),
    OPT_NUMBER(raw_segment, to_radius_m),
    OPT_NUMBER(raw_segment, to_cant_rad),
    OPT_NUMBER(raw_segment, to_cant_mm),
    CYAML_FIELD_END};

static const cyaml_schema_field_t cant_segment_fields[] = {
    NUMBER(raw_segment, length_m),
    CYAML_FIELD_ENUM("shape", STRICT_MUST, struct raw_segment, shape, shapes,
                     CYAML_ARRAY_LEN(shapes)),
    OPT_NUMBER(raw_segment, to_cant_rad), OPT_NUMBER(raw_segment, to_cant_mm), CYAML_FIELD_END};

static const cyaml_schema_field_t start_fields[] = {
    OPT_NUMBER(raw_start, curvature_1_m), OPT_NUMBER(raw_start, radius_m),
    OPT_NUMBER(raw_start, cant_rad), OPT_NUMBER(raw_start, cant_mm), CYAML_FIELD_END};

static const cyaml_strval_t levels[] = {{"erri_low", RAW_ERRI_LOW}, {"erri_high", RAW_ERRI_HIGH}};

static const cyaml_schema_field_t spectrum_fields[] = {
    CYAML_FIELD_ENUM_PTR("level", STRICT_MAY, struct raw_spectrum, level, levels,
                         CYAML_ARRAY_LEN(levels)),
    OPT_NUMBER(raw_spectrum, lateral_A_m2rad_m),
    OPT_NUMBER(raw_spectrum, vertical_A_m2rad_m),
    OPT_NUMBER(raw_spectrum, cross_A_m2rad_m),
    CYAML_FIELD_UINT("seed", MUST, struct raw_spectrum, seed),
    CYAML_FIELD_UINT("waves", MUST, struct raw_spectrum, waves),
    NUMBER(raw_spectrum, shortest_m),
    NUMBER(raw_spectrum, longest_m),
    NUMBER(raw_spectrum, taper_m),
    NUMBER(raw_spectrum, start_m),
    NUMBER(raw_spectrum, length_m),
    NUMBER(raw_spectrum, step_m),
    CYAML_FIELD_END};

static const cyaml_schema_field_t irregularity_fields[] = {
    OPT_PATH(raw_irregularities, samples), OPT_PART(raw_irregularities, spectrum, spectrum_fields),
    CYAML_FIELD_END};

static const cyaml_schema_value_t segment = {
    CYAML_VALUE_MAPPING(MUST, struct raw_segment, segment_fields)};
static const cyaml_schema_value_t cant_segment = {
    CYAML_VALUE_MAPPING(MUST, struct raw_segment, cant_segment_fields)};

static const cyaml_schema_field_t track_fields[] = {
    NAME(raw_track, name),
    OPT_NUMBER(raw_track, cant_base_m),
    OPT_PART(raw_track, start, start_fields),
    LIST(raw_track, segments, n_segments, MAY, &segment, 0, KL_TRACK_MAX_RAMPS),
    LIST(raw_track, cant_segments, n_cant_segments, MAY, &cant_segment, 0, KL_TRACK_MAX_RAMPS),
    OPT_PART(raw_track, irregularities, irregularity_fields),
    CYAML_FIELD_END};

const cyaml_schema_value_t raw_track_schema = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_POINTER, struct raw_track, track_fields)};
