/* model_build.c - from definitions to a model, and from kl_diag back to a line of a file. */
#include <stdlib.h>
#include <string.h>

#include "model_file.h"
#include "model_source.h"

#define FIRST_ARENA_BYTES ((size_t)1 << 20)
#define MAX_TRIES 16

static int grow(struct model_file *mf, size_t wanted, FILE *errors) {
    size_t size = mf->arena_size == 0 ? FIRST_ARENA_BYTES : mf->arena_size;
    size = wanted > size ? wanted : size;
    if (mf->arena_memory != NULL && size == mf->arena_size) {
        size += size / 2; /* `wanted` did not grow: give more all the same */
    }
    free(mf->arena_memory);
    /* aligned_alloc wants a multiple of the alignment */
    mf->arena_size = (size + 63u) & ~(size_t)63u;
    mf->arena_memory = aligned_alloc(64, mf->arena_size);
    if (mf->arena_memory == NULL) {
        fprintf(errors, "%s: out of memory (%zu bytes for the model)\n", mf->vehicle_parts->path,
                mf->arena_size);
        mf->arena_size = 0;
        return -1;
    }
    return 0;
}

/* ---- where kl_diag points ---- */

static void say(struct model_parts *parts, const char *key, const struct kl_diag *diag) {
    const char *what = diag->what != NULL ? diag->what : kl_status_text(diag->status);
    if (diag->index >= 0 && key[0] == 'p') {
        model_error(parts, key, "%s (%g, point %d)", what, diag->value, (int)diag->index);
    } else {
        model_error(parts, key, "%s (%g)", what, diag->value);
    }
}

/* The file that a pair stands in, and its number there. */
static struct model_parts *pair_source(struct model_file *mf, uint32_t *index) {
    struct model_parts *parts = mf->vehicle_parts;
    if (parts->n_children == 0) {
        return parts;
    }
    const uint32_t train = *index;
    *index = parts->pair_index[train];
    return parts->child[parts->pair_child[train]].parts;
}

/* The pair that fails when built alone. */
static int blame_pair(struct model_file *mf) {
    for (uint32_t i = 0; i < mf->vehicle.n_pairs; i++) {
        struct kl_diag diag = {KL_OK, NULL, -1, 0.0};
        struct kl_arena arena;
        struct kl_pair pair;
        char key[64];
        kl_arena_init(&arena, mf->arena_memory, mf->arena_size);
        if (kl_pair_build(&mf->vehicle.pairs[i], &arena, &pair, &diag) != KL_OK) {
            uint32_t index = i;
            struct model_parts *parts = pair_source(mf, &index);
            snprintf(key, sizeof key, "pairs[%u]", index);
            say(parts, key, &diag);
            return 1;
        }
    }
    return 0;
}

/* Builds the track alone, with or without its cant: 1 if that fails. */
static int track_fails(struct model_file *mf, bool with_cant, struct kl_diag *diag) {
    struct kl_arena arena;
    struct kl_track track;
    struct kl_track_def def = mf->track;
    def.n_cant = with_cant ? def.n_cant : 0;
    kl_arena_init(&arena, mf->arena_memory, mf->arena_size);
    return kl_track_build(&def, &arena, &track, diag) != KL_OK;
}

static int blame_track(struct model_file *mf) {
    struct kl_diag diag = {KL_OK, NULL, -1, 0.0};
    if (mf->track_parts == NULL || !track_fails(mf, true, &diag)) {
        return 0;
    }
    bool in_cant = !track_fails(mf, false, &diag) && track_fails(mf, true, &diag);
    const struct outline *outline = &mf->track_parts->outline;
    bool own_list = outline_find(outline, "cant_segments", NULL) != OUTLINE_NONE;
    const char *list = in_cant && own_list ? "cant_segments" : "segments";
    char key[64] = "";
    if (diag.what != NULL && strncmp(diag.what, "irregularit", 11) == 0) {
        snprintf(key, sizeof key, "irregularities");
    } else if (diag.index >= 0) {
        snprintf(key, sizeof key, "%s[%d]", list, (int)diag.index);
    } else {
        snprintf(key, sizeof key, "%s", list);
    }
    say(mf->track_parts, key, &diag);
    return 1;
}

/* Elements of the definition are more than those of the file where some are mirrored; the name
 * leads back: it is the file's, or the file's and _r or _l. `skip`: the prefix of a train's. */
static void named_key(const struct model_parts *parts, const char *list, const char *whole,
                      size_t skip, char *key, size_t size) {
    char name[KL_NAME_SIZE];
    char path[64];
    const struct outline *outline = &parts->outline;
    snprintf(name, sizeof name, "%s", whole + skip);
    snprintf(path, sizeof path, "%s.%s", list, name);
    int32_t node = outline_find(outline, path, NULL);
    if (node == OUTLINE_NONE && strlen(name) > 2) {
        name[strlen(name) - 2] = '\0';
        snprintf(path, sizeof path, "%s.%s", list, name);
        node = outline_find(outline, path, NULL);
    }
    outline_path(outline, node != OUTLINE_NONE ? node : 0, key, size);
}

/* A kind of parts, as kl_diag numbers them. */
struct kind {
    const char *word; /* with which kl_diag begins */
    const char *list;
    uint32_t count;
    const char *name; /* of the one that is meant */
};

static int find_kind(const struct model_file *mf, const struct kl_diag *diag, struct kind *kind) {
    const struct kl_vehicle_def *v = &mf->vehicle;
    const uint32_t i = diag->index >= 0 ? (uint32_t)diag->index : UINT32_MAX;
    const struct kind kinds[] = {
        {"body", "bodies", v->n_bodies, i < v->n_bodies ? v->bodies[i].name : ""},
        {"wheelset", "wheelsets", v->n_wheelsets, i < v->n_wheelsets ? v->wheelsets[i].name : ""},
        {"creep", "wheelsets", v->n_wheelsets, i < v->n_wheelsets ? v->wheelsets[i].name : ""},
        {"element", "elements", v->n_elements, i < v->n_elements ? v->elements[i].name : ""},
        {"linkage", "linkages", v->n_linkages, i < v->n_linkages ? v->linkages[i].name : ""}};
    for (size_t k = 0; k < sizeof kinds / sizeof kinds[0]; k++) {
        if (strncmp(diag->what, kinds[k].word, strlen(kinds[k].word)) == 0 && i < kinds[k].count) {
            *kind = kinds[k];
            return 1;
        }
    }
    return 0;
}

/* The file in which the i-th of a kind stands: the vehicle's, or one of a train's. */
static struct model_parts *source_of(struct model_parts *train, const struct kind *kind,
                                     uint32_t i) {
    struct model_parts *found = train;
    const bool own = (kind->list[0] == 'e' && i >= train->own_element) ||
                     (kind->list[0] == 'l' && i >= train->own_linkage);
    for (uint32_t c = 0; c < train->n_children && !own; c++) {
        const struct model_child *child = &train->child[c];
        const uint32_t first = kind->list[0] == 'b'   ? child->first_body
                               : kind->list[0] == 'w' ? child->first_wheelset
                               : kind->list[0] == 'e' ? child->first_element
                                                      : child->first_linkage;
        found = i >= first ? child->parts : found;
    }
    return found;
}

/* Behind the prefix: car1_body of the train is body of its file. A prefix has no end of its own, so
 * the shortest that leads to a name in the file counts. */
static void blame_vehicle(struct model_file *mf, const struct kl_diag *diag) {
    struct model_parts *parts = mf->vehicle_parts;
    char key[MODEL_PATH_SIZE] = "";
    struct kind kind;
    if (diag->what != NULL && find_kind(mf, diag, &kind)) {
        struct model_parts *train = parts;
        parts = source_of(train, &kind, (uint32_t)diag->index);
        size_t skip = 0;
        do {
            named_key(parts, kind.list, kind.name, skip, key, sizeof key);
            const char *next = strchr(kind.name + skip, '_');
            skip = next != NULL ? (size_t)(next - kind.name) + 1 : strlen(kind.name);
        } while (key[0] == '\0' && parts != train && kind.name[skip] != '\0');
    }
    say(parts, key, diag);
}

static void explain(struct model_file *mf, const struct kl_diag *diag, FILE *errors) {
    mf->vehicle_parts->errors = errors;
    mf->vehicle_parts->n_errors = 0;
    for (uint32_t i = 0; i < mf->vehicle_parts->n_children; i++) {
        mf->vehicle_parts->child[i].parts->errors = errors;
        mf->vehicle_parts->child[i].parts->n_errors = 0;
    }
    if (mf->track_parts != NULL) {
        mf->track_parts->errors = errors;
        mf->track_parts->n_errors = 0;
    }
    if (!blame_pair(mf) && !blame_track(mf)) {
        blame_vehicle(mf, diag);
    }
}

int model_file_build(struct model_file *mf, struct kl_model *model, FILE *errors) {
    struct kl_diag diag = {KL_OK, NULL, -1, 0.0};
    enum kl_status status = KL_ERR_MEMORY;
    size_t wanted = 0;
    if (mf->vehicle_parts == NULL) {
        fprintf(errors, "cannot build: no vehicle is loaded\n");
        return -1;
    }
    for (int tries = 0; tries < MAX_TRIES && status == KL_ERR_MEMORY; tries++) {
        struct kl_arena arena;
        if ((tries > 0 || mf->arena_memory == NULL) && grow(mf, wanted, errors) != 0) {
            return -1;
        }
        kl_arena_init(&arena, mf->arena_memory, mf->arena_size);
        status = kl_build(&mf->vehicle, &arena, model, &diag);
        wanted = arena.wanted;
    }
    if (status != KL_OK) {
        diag.status = status;
        explain(mf, &diag, errors);
        return -1;
    }
    return 0;
}
