/* model_file.c - the loader's life cycle: load, set, build, free. */
#include "model_file.h"

#include <stdlib.h>
#include <string.h>

#include "model_convert.h"

#define TRACK_PREFIX "track."

/* What one file gives; swapped into struct model_file only when all of it is good. */
struct loaded {
    struct model_parts *parts;
    struct kl_vehicle_def vehicle;
    struct kl_track_def track;
    char track_name[KL_NAME_SIZE];
    double track_length_m;
};

/* Takes over loaded->parts; they are gone if this fails. */
static int finish(struct loaded *loaded, bool is_track) {
    if (loaded->parts == NULL) {
        return -1;
    }
    int status = is_track ? model_track_convert(loaded->parts, &loaded->track, loaded->track_name,
                                                &loaded->track_length_m)
                          : model_vehicle_convert(loaded->parts, &loaded->vehicle);
    loaded->parts->errors = NULL;
    if (status != 0) {
        model_source_free(loaded->parts);
        loaded->parts = NULL;
    }
    return status;
}

static void adopt_vehicle(struct model_file *mf, const struct loaded *from) {
    model_source_free(mf->vehicle_parts);
    mf->vehicle_parts = from->parts;
    mf->vehicle = from->vehicle;
    mf->vehicle.track = &mf->track;
}

static void adopt_track(struct model_file *mf, const struct loaded *from) {
    model_source_free(mf->track_parts);
    mf->track_parts = from->parts;
    mf->track = from->track;
    memcpy(mf->track_name, from->track_name, sizeof mf->track_name);
    mf->track_length_m = from->track_length_m;
}

int model_file_load(struct model_file *mf, const char *vehicle_path, const char *track_path,
                    FILE *errors) {
    struct loaded vehicle = {0};
    struct loaded track = {0};
    memset(mf, 0, sizeof *mf);
    vehicle.parts = model_source_open(vehicle_path, errors);
    int status = finish(&vehicle, false);
    if (track_path != NULL) {
        track.parts = model_source_open(track_path, errors);
        status = finish(&track, true) != 0 ? -1 : status;
    }
    if (status != 0) {
        model_source_free(vehicle.parts);
        model_source_free(track.parts);
        return -1;
    }
    adopt_vehicle(mf, &vehicle);
    if (track_path != NULL) {
        adopt_track(mf, &track);
    } else {
        memcpy(mf->track_name, "straight", sizeof "straight");
    }
    return 0;
}

/* ---- set ---- */

/* The assignments taken apart; those of the vehicle from the front, of the track from the back. */
struct assignments {
    char *text; /* copies */
    const char **key;
    const char **value;
    size_t n_vehicle;
    size_t n_track;
};

static void free_assignments(struct assignments *a) {
    free(a->text);
    free(a->key);
    free(a->value);
}

static int split(struct assignments *a, const char *const *texts, size_t n, FILE *errors) {
    size_t bytes = 1;
    for (size_t i = 0; i < n; i++) {
        bytes += strlen(texts[i]) + 1;
    }
    char *at = a->text = malloc(bytes);
    a->key = calloc(n + 1, sizeof *a->key);
    a->value = calloc(n + 1, sizeof *a->value);
    if (a->text == NULL || a->key == NULL || a->value == NULL) {
        fprintf(errors, "out of memory\n");
        return -1;
    }
    for (int pass = 0; pass < 2; pass++) {
        for (size_t i = 0; i < n; i++) {
            bool is_track = strncmp(texts[i], TRACK_PREFIX, strlen(TRACK_PREFIX)) == 0;
            size_t length = strcspn(texts[i], "=");
            if (texts[i][length] == '\0' || length == 0) {
                fprintf(errors, "cannot set '%s': must be key.path=value\n", texts[i]);
                return -1;
            }
            if (is_track != (pass == 1)) {
                continue;
            }
            size_t k = a->n_vehicle + a->n_track;
            *(is_track ? &a->n_track : &a->n_vehicle) += 1;
            strcpy(at, texts[i]);
            at[length] = '\0';
            a->key[k] = at + (is_track ? strlen(TRACK_PREFIX) : 0);
            a->value[k] = at + length + 1;
            at += strlen(texts[i]) + 1;
        }
    }
    return 0;
}

static int apply(struct model_file *mf, const struct assignments *a, FILE *errors) {
    struct loaded vehicle = {0};
    struct loaded track = {0};
    int status = 0;
    if (a->n_track > 0 && mf->track_parts == NULL) {
        fprintf(errors, "cannot set track.%s: there is no track file\n", a->key[a->n_vehicle]);
        return -1;
    }
    if (a->n_vehicle > 0) {
        vehicle.parts =
            model_source_edit(mf->vehicle_parts, a->key, a->value, a->n_vehicle, errors);
        status = finish(&vehicle, false);
    }
    if (a->n_track > 0) {
        track.parts = model_source_edit(mf->track_parts, a->key + a->n_vehicle,
                                        a->value + a->n_vehicle, a->n_track, errors);
        status = finish(&track, true) != 0 ? -1 : status;
    }
    if (status != 0) {
        model_source_free(vehicle.parts);
        model_source_free(track.parts);
        return -1;
    }
    if (vehicle.parts != NULL) {
        adopt_vehicle(mf, &vehicle);
    }
    if (track.parts != NULL) {
        adopt_track(mf, &track);
    }
    return 0;
}

int model_file_set(struct model_file *mf, const char *const *assignments, size_t n, FILE *errors) {
    struct assignments a = {0};
    if (mf->vehicle_parts == NULL) {
        fprintf(errors, "cannot set anything: no vehicle is loaded\n");
        return -1;
    }
    int status = split(&a, assignments, n, errors);
    if (status == 0) {
        status = apply(mf, &a, errors);
    }
    free_assignments(&a);
    return status;
}

const char *model_file_pair_name(const struct model_file *mf, uint32_t i) {
    char path[48];
    const struct model_parts *parts = mf->vehicle_parts;
    if (parts == NULL || i >= mf->vehicle.n_pairs) {
        return "?";
    }
    uint32_t index = i;
    if (parts->n_children > 0) {
        index = parts->pair_index[i];
        parts = parts->child[parts->pair_child[i]].parts;
    }
    const struct outline *outline = &parts->outline;
    snprintf(path, sizeof path, "pairs[%u].name", (unsigned)index);
    int32_t node = outline_find(outline, path, NULL);
    return node != OUTLINE_NONE && outline->nodes[node].text != NULL ? outline->nodes[node].text
                                                                     : "?";
}

void model_file_free(struct model_file *mf) {
    model_source_free(mf->vehicle_parts);
    model_source_free(mf->track_parts);
    free(mf->arena_memory);
    memset(mf, 0, sizeof *mf);
}
