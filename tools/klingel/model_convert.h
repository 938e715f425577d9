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

/* The pairs of a vehicle (model_pair.c), called by model_vehicle_convert. */
void model_pairs_convert(struct model_parts *parts, const struct raw_vehicle *raw,
                         struct kl_pair_def *pairs);

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
