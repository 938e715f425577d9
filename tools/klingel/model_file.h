/*
 * model_file.h - vehicle.yaml and track.yaml in, the core's definitions and a built model out.
 *
 * Host side: this reads files and takes memory. The formats are described in models/README.md; the
 * units stand in the key names, so a number without its unit is an unknown key. What is wrong with
 * a file is printed as
 *     models/wagon.yaml:17: bodies[0].mass_kg = -3: must be > 0
 * one line per error; several are found at once where that makes sense. Nothing is guessed, and
 * nothing in a file is ignored.
 *
 * Life: load, set (any number of times), build, use the model, free. A struct model_file must not
 * be moved in memory between load and free: its definitions point into it.
 */
#ifndef MODEL_FILE_H
#define MODEL_FILE_H

#include <stdio.h>

#include "klingel.h"

struct model_parts; /* memory behind the definitions; private */

struct model_file {
    struct kl_vehicle_def vehicle; /* complete: vehicle.track points at `track` below */
    struct kl_track_def track;
    char track_name[KL_NAME_SIZE];
    double track_length_m; /* where the last segment ends, from s = 0; 0: straight without end */
    struct model_parts *vehicle_parts;
    struct model_parts *track_parts; /* NULL without a track file */
    void *arena_memory;              /* of the model last built */
    size_t arena_size;
};

/*
 * Reads a vehicle file, and a track file (NULL: straight, level and smooth). Files named inside are
 * found relative to the file that names them. Prints what is wrong to `errors` and returns -1; `mf`
 * is then empty, as after model_file_free. 0: `mf` holds the definitions.
 */
int model_file_load(struct model_file *mf, const char *vehicle_path, const char *track_path,
                    FILE *errors);

/*
 * Replaces values before a build. Each assignment is "key.path=value" as on a command line, the
 * value written as in the file: "elements.restraint.k_N_m[1]=1e6",
 * "wheelsets[0].creep.friction=0.2". An entry of a list is named by its index or by its `name`; a
 * path that begins with "track." is in the track file. The key must already stand in the file. All
 * `n` are applied together, then the whole file is checked again. -1: printed, and nothing was
 * changed.
 */
int model_file_set(struct model_file *mf, const char *const *assignments, size_t n, FILE *errors);

/*
 * Builds the model with kl_build, in memory that belongs to `mf` (taken as large as it must be).
 * `model` is good until the next build with the same `mf`, or model_file_free. -1: printed, with
 * the line of the culprit where kl_diag names one.
 */
int model_file_build(struct model_file *mf, struct kl_model *model, FILE *errors);

/* The name of the i-th pair in the vehicle file, good until the next set or free; "?" where there
 * is no such pair. (The definitions number the pairs; their names are the file's alone.) */
const char *model_file_pair_name(const struct model_file *mf, uint32_t i);

/* Gives everything back and leaves `mf` all zero. Harmless on an all-zero or failed `mf`. */
void model_file_free(struct model_file *mf);

#endif
