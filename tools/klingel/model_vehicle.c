/* model_vehicle.c - vehicle.yaml to kl_vehicle_def: names become indices, heights become -z. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "creep_file.h"
#include "model_convert.h"

#define GROUND MODEL_GROUND

static void body(struct model_parts *parts, const struct raw_body *raw, uint32_t i,
                 struct kl_body_def *def) {
    model_check_name(parts, raw->name, "bodies[%u].name", i);
    model_positive(parts, raw->mass_kg, "bodies[%u].mass_kg", i);
    model_positive(parts, raw->inertia_roll_kgm2, "bodies[%u].inertia_roll_kgm2", i);
    model_positive(parts, raw->inertia_pitch_kgm2, "bodies[%u].inertia_pitch_kgm2", i);
    model_positive(parts, raw->inertia_yaw_kgm2, "bodies[%u].inertia_yaw_kgm2", i);
    model_check(parts, raw->freedoms != 0, "needs at least one of y, z, roll, pitch, yaw",
                "bodies[%u].freedoms", i);
    memcpy(def->name, raw->name, sizeof def->name);
    def->mass_kg = raw->mass_kg;
    def->inertia_kgm2[0] = raw->inertia_roll_kgm2;
    def->inertia_kgm2[1] = raw->inertia_pitch_kgm2;
    def->inertia_kgm2[2] = raw->inertia_yaw_kgm2;
    def->x_m = raw->x_m;
    def->z_m = -raw->height_m;
    def->freedoms = raw->freedoms;
}

static double or_zero(const double *value) {
    return value != NULL ? *value : 0.0;
}

/* Falling friction, and what is left of the initial slope on a wet or oiled rail. */
static void adhesion(struct model_parts *parts, const struct raw_creep *raw, uint32_t i,
                     struct kl_creep_def *def) {
    double k_a = raw->k_a != NULL ? *raw->k_a : 1.0;
    double k_s = raw->k_s != NULL ? *raw->k_s : k_a;
    model_check(parts, k_a >= 0.01 && k_a <= 1.0, "must be 0.01 to 1", "wheelsets[%u].creep.k_a",
                i);
    model_check(parts, k_s >= 0.01 && k_s <= k_a, "must be 0.01 to k_a", "wheelsets[%u].creep.k_s",
                i);
    def->k_a = (kl_real)k_a;
    def->k_s = (kl_real)k_s;
    if (raw->falling != NULL) {
        model_check(parts, raw->falling->ratio >= 0.0 && raw->falling->ratio <= 1.0,
                    "must be 0 to 1", "wheelsets[%u].creep.falling.ratio", i);
        model_check(parts, raw->falling->decay_s_m >= 0.0 && raw->falling->decay_s_m <= 100.0,
                    "must be 0 to 100", "wheelsets[%u].creep.falling.decay_s_m", i);
        def->falls = 1;
        def->falling_ratio = (kl_real)raw->falling->ratio;
        def->falling_decay_s_m = (kl_real)raw->falling->decay_s_m;
    }
}

static void creep(struct model_parts *parts, const struct raw_creep *raw, uint32_t i,
                  struct kl_creep_def *def) {
    if (raw->law != KL_CREEP_LINEAR) {
        if (model_check(parts, raw->friction != NULL, "every law but linear needs friction",
                        "wheelsets[%u].creep", i)) {
            model_check(parts, *raw->friction >= 0.0 && *raw->friction <= 2.0, "must be 0 to 2",
                        "wheelsets[%u].creep.friction", i);
        }
    } else {
        model_check(parts, raw->friction == NULL, "law linear knows no friction",
                    "wheelsets[%u].creep.friction", i);
        model_check(parts, raw->falling == NULL, "law linear knows no friction",
                    "wheelsets[%u].creep.falling", i);
    }
    adhesion(parts, raw, i, def);
    int given = (raw->f11_N != NULL) + (raw->f22_N != NULL) + (raw->f23_Nm != NULL) +
                (raw->f33_Nm2 != NULL);
    model_check(parts, given == 0 || raw->law == KL_CREEP_LINEAR || raw->law == KL_CREEP_SHE,
                "f11_N to f33_Nm2 go with the laws linear and she alone", "wheelsets[%u].creep", i);
    if (model_check(parts, given == 0 || given == 4,
                    "needs all of f11_N, f22_N, f23_Nm, f33_Nm2, or none (Hertz and Kalker)",
                    "wheelsets[%u].creep", i) &&
        given == 4) {
        model_positive(parts, *raw->f11_N, "wheelsets[%u].creep.f11_N", i);
        model_positive(parts, *raw->f22_N, "wheelsets[%u].creep.f22_N", i);
        model_not_negative(parts, *raw->f23_Nm, "wheelsets[%u].creep.f23_Nm", i);
        model_not_negative(parts, *raw->f33_Nm2, "wheelsets[%u].creep.f33_Nm2", i);
    }
    def->law = (enum kl_creep_law)raw->law;
    def->friction = (kl_real)or_zero(raw->friction);
    def->f11_N = (kl_real)or_zero(raw->f11_N);
    def->f22_N = (kl_real)or_zero(raw->f22_N);
    def->f23_Nm = (kl_real)or_zero(raw->f23_Nm);
    def->f33_Nm2 = (kl_real)or_zero(raw->f33_Nm2);
}

static uint32_t pair_index(struct model_parts *parts, const struct raw_vehicle *raw, uint32_t i) {
    char known[200] = "";
    for (uint32_t p = 0; p < raw->n_pairs; p++) {
        if (strcmp(raw->pairs[p].name, raw->wheelsets[i].pair) == 0) {
            return p;
        }
        model_append(known, sizeof known, raw->pairs[p].name);
    }
    char what[240];
    snprintf(what, sizeof what, "no such pair; known: %s", known);
    model_check(parts, false, what, "wheelsets[%u].pair", i);
    return 0;
}

static void wheelset(struct model_parts *parts, const struct raw_vehicle *vehicle, uint32_t i,
                     struct kl_wheelset_def *def) {
    const struct raw_wheelset *raw = &vehicle->wheelsets[i];
    model_check_name(parts, raw->name, "wheelsets[%u].name", i);
    model_positive(parts, raw->mass_kg, "wheelsets[%u].mass_kg", i);
    model_positive(parts, raw->inertia_roll_kgm2, "wheelsets[%u].inertia_roll_kgm2", i);
    model_positive(parts, raw->inertia_spin_kgm2, "wheelsets[%u].inertia_spin_kgm2", i);
    model_positive(parts, raw->inertia_yaw_kgm2, "wheelsets[%u].inertia_yaw_kgm2", i);
    model_not_negative(parts, raw->load_N, "wheelsets[%u].load_N", i);
    memcpy(def->name, raw->name, sizeof def->name);
    def->mass_kg = raw->mass_kg;
    def->inertia_roll_kgm2 = raw->inertia_roll_kgm2;
    def->inertia_spin_kgm2 = raw->inertia_spin_kgm2;
    def->inertia_yaw_kgm2 = raw->inertia_yaw_kgm2;
    def->x_m = raw->x_m;
    def->load_N = raw->load_N;
    def->pair = pair_index(parts, vehicle, i);
    def->independent = raw->wheels == RAW_INDEPENDENT;
    if (raw->coupling_Nms_rad != NULL) {
        model_check(parts, def->independent, "couples independent wheels; these are solid",
                    "wheelsets[%u].coupling_Nms_rad", i);
        model_not_negative(parts, *raw->coupling_Nms_rad, "wheelsets[%u].coupling_Nms_rad", i);
        def->coupling_Nms_rad = *raw->coupling_Nms_rad;
    }
    creep(parts, &raw->creep, i, &def->creep);
}

/* ---- names: bodies and wheelsets share one space, elements and pairs have their own ---- */

struct name_list {
    const char *name[2 * KL_MAX_ELEMENTS];
    char key[2 * KL_MAX_ELEMENTS][32];
    uint32_t n;
};

static void add_name(struct model_parts *parts, struct name_list *list, const char *name,
                     const char *array, uint32_t index) {
    char key[32];
    snprintf(key, sizeof key, "%s[%u].name", array, index);
    for (uint32_t i = 0; i < list->n; i++) {
        char what[80];
        snprintf(what, sizeof what, "this name is taken by %.*s", (int)strlen(list->key[i]) - 5,
                 list->key[i]);
        if (!model_check(parts, strcmp(list->name[i], name) != 0, what, "%s", key)) {
            return;
        }
    }
    list->name[list->n] = name;
    memcpy(list->key[list->n++], key, sizeof key);
}

static void check_names(struct model_parts *parts, const struct raw_vehicle *raw) {
    struct name_list *list = model_take(parts, 1, sizeof *list);
    if (list == NULL) {
        return;
    }
    for (uint32_t i = 0; i < raw->n_bodies; i++) {
        model_check(parts, strcmp(raw->bodies[i].name, GROUND) != 0, "is the track's name",
                    "bodies[%u].name", i);
        add_name(parts, list, raw->bodies[i].name, "bodies", i);
    }
    for (uint32_t i = 0; i < raw->n_wheelsets; i++) {
        model_check(parts, strcmp(raw->wheelsets[i].name, GROUND) != 0, "is the track's name",
                    "wheelsets[%u].name", i);
        add_name(parts, list, raw->wheelsets[i].name, "wheelsets", i);
    }
    list->n = 0;
    for (uint32_t i = 0; i < raw->n_pairs; i++) {
        add_name(parts, list, raw->pairs[i].name, "pairs", i);
    }
    list->n = 0;
    for (uint32_t i = 0; i < raw->n_elements; i++) {
        add_name(parts, list, raw->elements[i].name, "elements", i);
    }
    list->n = 0;
    for (uint32_t i = 0; i < raw->n_linkages; i++) {
        add_name(parts, list, raw->linkages[i].name, "linkages", i);
    }
}

static void running(struct model_parts *parts, const struct model_head *raw,
                    struct kl_running_def *def) {
    def->free = raw->speed == RAW_FREE;
    if (raw->resistance == NULL ||
        !model_check(parts, def->free,
                     "acts on a free speed, and here it is prescribed: speed: free",
                     "running_resistance")) {
        return;
    }
    model_not_negative(parts, raw->resistance->constant_N, "running_resistance.constant_N");
    model_not_negative(parts, raw->resistance->linear_Ns_m, "running_resistance.linear_Ns_m");
    model_not_negative(parts, raw->resistance->quadratic_Ns2_m2,
                       "running_resistance.quadratic_Ns2_m2");
    def->resistance_N = raw->resistance->constant_N;
    def->resistance_Ns_m = raw->resistance->linear_Ns_m;
    def->resistance_Ns2_m2 = raw->resistance->quadratic_Ns2_m2;
}

void model_head_convert(struct model_parts *parts, const struct model_head *raw,
                        struct kl_vehicle_def *def) {
    model_check_title(parts, raw->name);
    model_check(parts, raw->step_ns >= 10000 && raw->step_ns <= 10000000,
                "must be 10000 to 10000000 (10 us to 10 ms)", "step_ns");
    model_check(parts, raw->gravity_m_s2 >= 0.0 && raw->gravity_m_s2 <= 20.0, "must be 0 to 20",
                "gravity_m_s2");
    model_positive(parts, raw->acceleration_limit_m_s2, "acceleration_limit_m_s2");
    memcpy(def->name, raw->name, sizeof def->name);
    def->step_ns = raw->step_ns;
    def->gravity_m_s2 = raw->gravity_m_s2;
    def->acceleration_limit_m_s2 = raw->acceleration_limit_m_s2;
    running(parts, raw, &def->running);
}

/* The table that wheelsets of law `table` read. */
static void creep_table(struct model_parts *parts, const struct raw_vehicle *raw,
                        struct kl_vehicle_def *def) {
    bool wanted = false;
    for (uint32_t i = 0; i < raw->n_wheelsets; i++) {
        wanted = wanted || raw->wheelsets[i].creep.law == KL_CREEP_TABLE;
    }
    const struct raw_creep_table *table = raw->creep_table;
    if (!model_check(parts, !wanted || table != NULL, "law table needs a creep_table",
                     "wheelsets") ||
        table == NULL) {
        return;
    }
    if (!model_check(parts, table->file != NULL, "needs a file", "creep_table") || !wanted) {
        return;
    }
    char *path = model_beside(parts, table->file);
    parts->creep_table = calloc(1, sizeof *parts->creep_table);
    if (path == NULL || parts->creep_table == NULL) {
        model_check(parts, false, "out of memory", "creep_table");
        return;
    }
    bool compact = table->compact != NULL && *table->compact;
    if (creep_file_load(parts->creep_table, path, compact, parts->errors) != 0) {
        free(parts->creep_table);
        parts->creep_table = NULL;
        model_check(parts, false, "the table cannot be read", "creep_table.file");
        return;
    }
    def->creep_table = &parts->creep_table->table;
}

static void convert(struct model_parts *parts, const struct raw_vehicle *raw,
                    struct kl_vehicle_def *def) {
    struct kl_body_def *bodies = model_take(parts, raw->n_bodies + 1u, sizeof *bodies);
    struct kl_wheelset_def *wheelsets = model_take(parts, raw->n_wheelsets, sizeof *wheelsets);
    struct kl_pair_def *pairs = model_take(parts, raw->n_pairs, sizeof *pairs);
    if (bodies == NULL || wheelsets == NULL || pairs == NULL) {
        return;
    }
    const struct model_head head = {raw->name,         raw->step_ns,
                                    raw->gravity_m_s2, raw->acceleration_limit_m_s2,
                                    raw->speed,        raw->running_resistance};
    model_head_convert(parts, &head, def);
    check_names(parts, raw);
    for (uint32_t i = 0; i < raw->n_bodies; i++) {
        body(parts, &raw->bodies[i], i, &bodies[i]);
    }
    for (uint32_t i = 0; i < raw->n_wheelsets; i++) {
        wheelset(parts, raw, i, &wheelsets[i]);
    }
    model_pairs_convert(parts, raw, pairs);
    creep_table(parts, raw, def);
    def->n_bodies = raw->n_bodies;
    def->n_wheelsets = raw->n_wheelsets;
    def->n_pairs = raw->n_pairs;
    def->bodies = bodies;
    def->wheelsets = wheelsets;
    def->pairs = pairs;
    const struct raw_ties ties = {raw->elements, raw->n_elements, raw->linkages, raw->n_linkages};
    model_ties_convert(parts, &ties, def);
}

int model_vehicle_convert(struct model_parts *parts, struct kl_vehicle_def *def) {
    if (outline_find(&parts->outline, "vehicles", NULL) != OUTLINE_NONE) {
        return model_train_convert(parts, def);
    }
    struct raw_vehicle *raw = model_source_load(parts, &raw_vehicle_schema);
    if (raw == NULL) {
        return -1;
    }
    memset(def, 0, sizeof *def);
    convert(parts, raw, def);
    model_source_unload(&raw_vehicle_schema, raw);
    return parts->n_errors == 0 ? 0 : -1;
}
