/* model_convert.h - from what libcyaml loaded to the core's definitions. Private to the loader. */
#ifndef MODEL_CONVERT_H
#define MODEL_CONVERT_H

#include "klingel.h"
#include "model_schema.h"
#include "model_source.h"

/* Each loads parts->text by its schema and fills the definition; arrays live as long as parts.
 * 0, or -1 with everything that is wrong printed. `track` of the vehicle is left NULL. */
int model_vehicle_convert(struct model_parts *parts, struct kl_vehicle_def *def);
int model_track_convert(struct model_parts *parts, struct kl_track_def *def,
                        char name[KL_NAME_SIZE], double *length_m);

/* The name of the track in `between`. */
#define MODEL_GROUND "ground"

/* What ties the parts together, of a vehicle or of a train. */
struct raw_ties {
    const struct raw_element *elements;
    uint32_t n_elements;
    const struct raw_linkage *linkages;
    uint32_t n_linkages;
};

/* Adds elements (model_element.c) and linkages to those that `def` has; its bodies and wheelsets must
 * be there. */
void model_ties_convert(struct model_parts *parts, const struct raw_ties *raw,
                        struct kl_vehicle_def *def);

/* A body, a wheelset or the ground by name; says so and gives NO_END where there is none. */
#define NO_END INT32_MIN
int32_t model_end(struct model_parts *parts, const struct kl_vehicle_def *def, const char *name,
                  const char *key);

/* Mirrors a table of force over deflection about 0. */
void model_table_mirror(struct model_parts *parts, struct kl_table_def *table);

/* A file with `vehicles:`: several vehicle files made one (model_train.c); called by
 * model_vehicle_convert. */
int model_train_convert(struct model_parts *parts, struct kl_vehicle_def *def);

/* Adds a name to a list with commas. */
void model_append(char *text, size_t size, const char *name);

/* The pairs of a vehicle (model_pair.c), called by model_vehicle_convert. */
void model_pairs_convert(struct model_parts *parts, const struct raw_vehicle *raw,
                         struct kl_pair_def *pairs);

/* What the files of a vehicle and of a train have in common: checked and taken over. */
struct model_head {
    const char *name; /* KL_NAME_SIZE */
    int64_t step_ns;
    double gravity_m_s2;
    double acceleration_limit_m_s2;
    int speed; /* enum raw_speed */
    const struct raw_resistance *resistance;
};
void model_head_convert(struct model_parts *parts, const struct model_head *raw,
                        struct kl_vehicle_def *def);

/* Checks of single numbers: print and return false where they fail. */
bool model_positive(struct model_parts *parts, double value, const char *key_format, ...)
    __attribute__((format(printf, 3, 4)));
bool model_not_negative(struct model_parts *parts, double value, const char *key_format, ...)
    __attribute__((format(printf, 3, 4)));

/* Names of parts become names of signals and columns: a letter, then letters, digits and _. */
void model_check_name(struct model_parts *parts, const char *name, const char *key_format, ...)
    __attribute__((format(printf, 3, 4)));
/* Titles of vehicles and tracks: printable ASCII without quotes and backslashes. */
void model_check_title(struct model_parts *parts, const char *title);

#endif
