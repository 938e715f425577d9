/*
 * model_train.c - several vehicle files made one vehicle: each moved to its place, turned round where
 * it is reversed, its names behind a prefix; then what couples them.
 */
#include <stdlib.h>
#include <string.h>

#include "model_convert.h"

_Static_assert(MODEL_MAX_CHILD_PAIRS == KL_MAX_PAIRS, "a train's pairs have one origin each");

/* Room for all of them, and what is filled so far. */
struct gathered {
    struct kl_body_def body[KL_MAX_BODIES];
    struct kl_wheelset_def wheelset[KL_MAX_WHEELSETS];
    struct kl_element_def element[KL_MAX_ELEMENTS];
    struct kl_linkage_def linkage[KL_MAX_LINKAGES];
    struct kl_pair_def pair[KL_MAX_PAIRS];
    uint32_t pair_file[KL_MAX_PAIRS]; /* the vehicle that it is of, the first with that file */
    uint32_t pair_index[KL_MAX_PAIRS];
    bool pair_turned[KL_MAX_PAIRS];
};

/* One vehicle on its way into the train. */
struct passage {
    struct model_parts *parts; /* of the train */
    const struct raw_train *raw;
    struct kl_vehicle_def *train;
    struct gathered *to;
    struct kl_vehicle_def from;
    uint32_t index;
    double at_x_m;
    double sign; /* -1 where turned round: x and y, and what goes with them */
};

static void name_it(struct passage *p, char *name) {
    const char *prefix = p->raw->vehicles[p->index].prefix;
    char whole[2 * KL_NAME_SIZE + 1];
    int length = snprintf(whole, sizeof whole, "%s_%s", prefix, name);
    char what[128];
    snprintf(what, sizeof what, "%s is longer than %d characters", whole, KL_NAME_SIZE - 1);
    if (p->parts->n_errors == 0 && /* one such message is enough */
        model_check(p->parts, length < KL_NAME_SIZE, what, "vehicles[%u].prefix", p->index)) {
        memset(name, 0, KL_NAME_SIZE);
        memcpy(name, whole, (size_t)length);
    }
}

static void move_point(const struct passage *p, double point[3]) {
    point[0] = p->at_x_m + p->sign * point[0];
    point[1] = p->sign * point[1];
}

static int32_t move_end(const struct passage *p, int32_t end) {
    if (end == KL_GROUND_END) {
        return end;
    }
    return end >= KL_WHEELSET_END(0) ? end + (int32_t)p->train->n_wheelsets
                                     : end + (int32_t)p->train->n_bodies;
}

/* ---- wheel and rail ---- */

static bool same_profile(const struct kl_profile_def *a, const struct kl_profile_def *b) {
    if (a->kind != b->kind || a->n_points != b->n_points || a->smoothing_m != b->smoothing_m ||
        a->radius_m != b->radius_m || a->slope_rad != b->slope_rad ||
        a->half_width_m != b->half_width_m) {
        return false;
    }
    size_t bytes = a->n_points * sizeof(double);
    return bytes == 0 ||
           (memcmp(a->eta_m, b->eta_m, bytes) == 0 && memcmp(a->zeta_m, b->zeta_m, bytes) == 0);
}

/* A vehicle that is turned round brings its right wheel over the left rail. */
static bool turns_wheels(const struct passage *p, const struct kl_pair_def *pair) {
    const struct kl_wheel_def *r = &pair->wheel[KL_RIGHT];
    const struct kl_wheel_def *l = &pair->wheel[KL_LEFT];
    return p->sign < 0.0 && pair->kind == KL_PAIR_PROFILES &&
           !(r->radius_m == l->radius_m && r->half_spacing_m == l->half_spacing_m &&
             same_profile(&r->profile, &l->profile));
}

static uint32_t first_of_file(const struct raw_train *raw, uint32_t index) {
    uint32_t i = 0;
    while (strcmp(raw->vehicles[i].file, raw->vehicles[index].file) != 0) {
        i++;
    }
    return i;
}

/* The train's pair for one of the vehicle's: the same for all vehicles of a file. */
static uint32_t pair_of(struct passage *p, uint32_t index) {
    const struct kl_pair_def *pair = &p->from.pairs[index];
    struct gathered *to = p->to;
    const uint32_t file = first_of_file(p->raw, p->index);
    const bool turned = turns_wheels(p, pair);
    for (uint32_t i = 0; i < p->train->n_pairs; i++) {
        if (to->pair_file[i] == file && to->pair_index[i] == index &&
            to->pair_turned[i] == turned) {
            return i;
        }
    }
    if (!model_check(p->parts, p->train->n_pairs < KL_MAX_PAIRS,
                     "too many different pairs of wheel and rail in one train", "vehicles[%u].file",
                     p->index)) {
        return 0;
    }
    const uint32_t i = p->train->n_pairs++;
    to->pair[i] = *pair;
    if (turned) {
        to->pair[i].wheel[KL_RIGHT] = pair->wheel[KL_LEFT];
        to->pair[i].wheel[KL_LEFT] = pair->wheel[KL_RIGHT];
    }
    to->pair_file[i] = file;
    to->pair_index[i] = index;
    to->pair_turned[i] = turned;
    p->parts->pair_child[i] = p->index;
    p->parts->pair_index[i] = index;
    return i;
}

/* ---- parts ---- */

/* The directions that change sign with the vehicle's turn: what points along x or y. */
static bool changes_sign(enum kl_along along) {
    return along == KL_ALONG_X || along == KL_ALONG_Y || along == KL_ALONG_ROLL ||
           along == KL_ALONG_PITCH;
}

/* The deflection and the actuator change their signs with it. */
static void swap_ends(struct kl_element_def *e) {
    const struct kl_element_def was = *e;
    e->end_a = was.end_b;
    e->end_b = was.end_a;
    memcpy(e->point_a_m, was.point_b_m, sizeof e->point_a_m);
    memcpy(e->point_b_m, was.point_a_m, sizeof e->point_b_m);
}

static void move_element(struct passage *p, struct kl_element_def *e) {
    name_it(p, e->name);
    e->end_a = move_end(p, e->end_a);
    e->end_b = move_end(p, e->end_b);
    move_point(p, e->point_a_m);
    move_point(p, e->point_b_m);
    if (p->sign > 0.0 || !changes_sign(e->along)) {
        return;
    }
    if (e->actuator != 0) {
        swap_ends(e); /* what pushed a forward pushes it back now */
    } else {
        model_table_mirror(p->parts, &e->stop);
        model_table_mirror(p->parts, &e->damper);
    }
}

static void move_linkage(struct passage *p, struct kl_linkage_def *l) {
    name_it(p, l->name);
    for (uint32_t t = 0; t < l->n_terms; t++) {
        const enum kl_freedom f = l->term[t].freedom;
        l->term[t].end = move_end(p, l->term[t].end);
        l->term[t].factor *= f == KL_Y || f == KL_ROLL || f == KL_PITCH ? p->sign : 1.0;
    }
}

static bool has_room(struct passage *p) {
    const struct kl_vehicle_def *a = p->train;
    const struct kl_vehicle_def *b = &p->from;
    char what[160];
    snprintf(what, sizeof what,
             "the train would have %u bodies, %u wheelsets, %u elements, %u linkages; at most "
             "%d, %d, %d, %d",
             a->n_bodies + b->n_bodies, a->n_wheelsets + b->n_wheelsets,
             a->n_elements + b->n_elements, a->n_linkages + b->n_linkages, KL_MAX_BODIES,
             KL_MAX_WHEELSETS, KL_MAX_ELEMENTS, KL_MAX_LINKAGES);
    return model_check(p->parts,
                       a->n_bodies + b->n_bodies <= KL_MAX_BODIES &&
                           a->n_wheelsets + b->n_wheelsets <= KL_MAX_WHEELSETS &&
                           a->n_elements + b->n_elements <= KL_MAX_ELEMENTS &&
                           a->n_linkages + b->n_linkages <= KL_MAX_LINKAGES,
                       what, "vehicles[%u]", p->index);
}

static void gather(struct passage *p) {
    struct gathered *to = p->to;
    struct kl_vehicle_def *train = p->train;
    struct kl_vehicle_def *from = &p->from;
    /* ends count from what is there already: bodies and wheelsets last */
    for (uint32_t i = 0; i < from->n_elements; i++) {
        to->element[train->n_elements + i] = from->elements[i];
        move_element(p, &to->element[train->n_elements + i]);
    }
    for (uint32_t i = 0; i < from->n_linkages; i++) {
        to->linkage[train->n_linkages + i] = from->linkages[i];
        move_linkage(p, &to->linkage[train->n_linkages + i]);
    }
    for (uint32_t i = 0; i < from->n_bodies; i++) {
        struct kl_body_def *body = &to->body[train->n_bodies + i];
        *body = from->bodies[i];
        name_it(p, body->name);
        body->x_m = p->at_x_m + p->sign * body->x_m;
    }
    for (uint32_t i = 0; i < from->n_wheelsets; i++) {
        struct kl_wheelset_def *wheelset = &to->wheelset[train->n_wheelsets + i];
        *wheelset = from->wheelsets[i];
        name_it(p, wheelset->name);
        wheelset->x_m = p->at_x_m + p->sign * wheelset->x_m;
        wheelset->pair = pair_of(p, wheelset->pair);
    }
    if (from->creep_table != NULL) {
        model_check(
            p->parts,
            train->creep_table == NULL || train->creep_table->hash == from->creep_table->hash,
            "has another creep table than a vehicle before it", "vehicles[%u].file", p->index);
        train->creep_table = from->creep_table;
    }
    if (train->running.free) { /* else those of the vehicles rest, as their speeds do */
        train->running.resistance_N += from->running.resistance_N;
        train->running.resistance_Ns_m += from->running.resistance_Ns_m;
        train->running.resistance_Ns2_m2 += from->running.resistance_Ns2_m2;
    }
    train->n_bodies += from->n_bodies;
    train->n_wheelsets += from->n_wheelsets;
    train->n_elements += from->n_elements;
    train->n_linkages += from->n_linkages;
}

/* Opens and converts one vehicle's file; its memory and its lines are kept in parts->child. */
static bool load(struct passage *p) {
    struct model_parts *parts = p->parts;
    const struct raw_part *raw = &p->raw->vehicles[p->index];
    char *path = model_beside(parts, raw->file);
    struct model_parts *child = path != NULL ? model_source_open(path, parts->errors) : NULL;
    if (child == NULL) {
        model_error(parts, "vehicles", "vehicle %u (%s): its file cannot be read", p->index,
                    raw->file);
        return false;
    }
    parts->child[parts->n_children].parts = child;
    parts->child[parts->n_children].first_body = p->train->n_bodies;
    parts->child[parts->n_children].first_wheelset = p->train->n_wheelsets;
    parts->child[parts->n_children].first_element = p->train->n_elements;
    parts->child[parts->n_children].first_linkage = p->train->n_linkages;
    parts->n_children++;
    char key[48];
    snprintf(key, sizeof key, "vehicles[%u].file", p->index);
    if (outline_find(&child->outline, "vehicles", NULL) != OUTLINE_NONE) {
        model_error(parts, key, "is a train itself");
        return false;
    }
    if (model_vehicle_convert(child, &p->from) != 0) {
        parts->n_errors += child->n_errors > 0 ? child->n_errors : 1;
        return false;
    }
    model_check(parts, p->from.step_ns == p->raw->step_ns, "has another step_ns than the train",
                "%s", key);
    model_check(parts, p->from.gravity_m_s2 == p->raw->gravity_m_s2,
                "has another gravity_m_s2 than the train", "%s", key);
    return has_room(p);
}

static void convert(struct model_parts *parts, const struct raw_train *raw,
                    struct kl_vehicle_def *def) {
    struct passage p = {.parts = parts, .raw = raw, .train = def};
    p.to = model_take(parts, 1, sizeof *p.to);
    parts->child = calloc(raw->n_vehicles, sizeof *parts->child);
    if (p.to == NULL || parts->child == NULL) {
        return;
    }
    def->bodies = p.to->body;
    def->wheelsets = p.to->wheelset;
    def->elements = p.to->element;
    def->linkages = p.to->linkage;
    def->pairs = p.to->pair;
    for (uint32_t i = 0; i < raw->n_vehicles && parts->n_errors == 0; i++) {
        model_check_name(parts, raw->vehicles[i].prefix, "vehicles[%u].prefix", i);
        for (uint32_t k = 0; k < i; k++) {
            model_check(parts, strcmp(raw->vehicles[i].prefix, raw->vehicles[k].prefix) != 0,
                        "this prefix is taken", "vehicles[%u].prefix", i);
        }
        p.index = i;
        p.at_x_m = raw->vehicles[i].at_x_m;
        p.sign = raw->vehicles[i].reversed ? -1.0 : 1.0;
        if (load(&p)) {
            gather(&p);
        }
    }
    if (parts->n_errors == 0) {
        parts->own_element = def->n_elements;
        parts->own_linkage = def->n_linkages;
        const struct raw_ties ties = {raw->elements, raw->n_elements, raw->linkages,
                                      raw->n_linkages};
        model_ties_convert(parts, &ties, def);
    }
}

int model_train_convert(struct model_parts *parts, struct kl_vehicle_def *def) {
    struct raw_train *raw = model_source_load(parts, &raw_train_schema);
    if (raw == NULL) {
        return -1;
    }
    memset(def, 0, sizeof *def);
    const struct model_head head = {raw->name,         raw->step_ns,
                                    raw->gravity_m_s2, raw->acceleration_limit_m_s2,
                                    raw->speed,        raw->running_resistance};
    model_head_convert(parts, &head, def);
    convert(parts, raw, def);
    model_source_unload(&raw_train_schema, raw);
    return parts->n_errors == 0 ? 0 : -1;
}
