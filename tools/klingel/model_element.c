/* model_element.c - force elements and linkages: names to ends, units by direction, mirrored ones. */
#include <stdlib.h>
#include <string.h>

#include "model_convert.h"

void model_append(char *text, size_t size, const char *name) {
    size_t used = strlen(text);
    snprintf(text + used, size - used, "%s%s", used > 0 ? ", " : "", name);
}

int32_t model_end(struct model_parts *parts, const struct kl_vehicle_def *def, const char *name,
                  const char *key) {
    char known[400] = "";
    if (strcmp(name, MODEL_GROUND) == 0) {
        return KL_GROUND_END;
    }
    for (uint32_t b = 0; b < def->n_bodies; b++) {
        if (strcmp(def->bodies[b].name, name) == 0) {
            return (int32_t)b;
        }
        model_append(known, sizeof known, def->bodies[b].name);
    }
    for (uint32_t w = 0; w < def->n_wheelsets; w++) {
        if (strcmp(def->wheelsets[w].name, name) == 0) {
            return KL_WHEELSET_END((int32_t)w);
        }
        model_append(known, sizeof known, def->wheelsets[w].name);
    }
    char what[480];
    snprintf(what, sizeof what, "no such body or wheelset; known: %s, " MODEL_GROUND, known);
    model_check(parts, false, what, "%s", key);
    return NO_END;
}

/* ---- numbers that are in N and m, or in N m and rad ---- */

/* The one that fits; the other must not be given. `needed`: one must be. */
static double fitting(struct model_parts *parts, bool turns, const double *length,
                      const double *angle, const char *key, const char *names, bool needed) {
    const double *right = turns ? angle : length;
    const double *wrong = turns ? length : angle;
    char what[120];
    snprintf(what, sizeof what, "%s %s, the one that fits the direction",
             needed || wrong != NULL ? "needs one of" : "may have one of", names);
    if (!model_check(parts, wrong == NULL && (right != NULL || !needed), what, "%s", key) ||
        right == NULL) {
        return 0.0;
    }
    model_check(parts, *right > 0.0, "its numbers must be > 0", "%s", key);
    return *right;
}

static bool turns(const struct kl_element_def *def) {
    return def->along == KL_ALONG_ROLL || def->along == KL_ALONG_PITCH ||
           def->along == KL_ALONG_YAW;
}

static void series(struct model_parts *parts, const struct raw_series *raw, uint32_t i,
                   struct kl_element_def *def) {
    char key[48];
    snprintf(key, sizeof key, "elements[%u].series", i);
    bool t = turns(def);
    def->slip.k = fitting(parts, t, raw->k_N_m, raw->k_Nm_rad, key, "k_N_m, k_Nm_rad", true);
    def->slip.c = fitting(parts, t, raw->c_Ns_m, raw->c_Nms_rad, key, "c_Ns_m, c_Nms_rad", true);
    def->slip.limit =
        fitting(parts, t, raw->limit_N, raw->limit_Nm, key, "limit_N, limit_Nm", false);
}

static void friction(struct model_parts *parts, const struct raw_friction *raw, uint32_t i,
                     struct kl_element_def *def) {
    char key[48];
    snprintf(key, sizeof key, "elements[%u].friction", i);
    bool t = turns(def);
    def->slip.k = fitting(parts, t, raw->k_N_m, raw->k_Nm_rad, key, "k_N_m, k_Nm_rad", true);
    def->slip.limit =
        fitting(parts, t, raw->force_N, raw->moment_Nm, key, "force_N, moment_Nm", true);
}

/* ---- tables ---- */

struct list {
    const double *value;
    uint32_t n;
};

static struct list fitting_list(struct model_parts *parts, bool turned, struct list length,
                                struct list angle, const char *key, const char *names) {
    struct list right = turned ? angle : length;
    struct list wrong = turned ? length : angle;
    char what[120];
    snprintf(what, sizeof what, "needs one of %s, the one that fits the direction", names);
    model_check(parts, right.n > 0 && wrong.n == 0, what, "%s", key);
    return right;
}

static void reverse(double *to, const double *from, uint32_t n) {
    for (uint32_t i = 0; i < n; i++) {
        to[i] = -from[n - 1 - i];
    }
}

void model_table_mirror(struct model_parts *parts, struct kl_table_def *table) {
    double *at = model_take(parts, 2 * (size_t)table->n + 1, sizeof *at);
    if (at == NULL || table->n == 0) {
        return;
    }
    double *force = at + table->n;
    reverse(at, table->at, table->n);
    reverse(force, table->force, table->n);
    table->at = at;
    table->force = force;
}

/* Points from 0 up, and their mirror images. */
static void both_sides(double *at, double *force, struct list x, struct list f,
                       struct kl_table_def *def) {
    uint32_t skip = x.value[0] == 0.0 ? 1 : 0;
    uint32_t n = x.n - skip;
    reverse(at, x.value + skip, n);
    reverse(force, f.value + skip, n);
    memcpy(at + n, x.value, x.n * sizeof *at);
    memcpy(force + n, f.value, f.n * sizeof *force);
    def->n = n + x.n;
}

static void table(struct model_parts *parts, const struct raw_table *raw, const char *key,
                  bool over_velocity, bool turned, struct kl_table_def *def) {
    struct list length = {raw->deflection_m, raw->n_deflection_m};
    struct list angle = {raw->angle_rad, raw->n_angle_rad};
    struct list speed = {raw->velocity_m_s, raw->n_velocity_m_s};
    struct list rate = {raw->rate_rad_s, raw->n_rate_rad_s};
    struct list n = {raw->force_N, raw->n_force_N};
    struct list nm = {raw->moment_Nm, raw->n_moment_Nm};
    struct list x =
        over_velocity ? fitting_list(parts, turned, speed, rate, key, "velocity_m_s, rate_rad_s")
                      : fitting_list(parts, turned, length, angle, key, "deflection_m, angle_rad");
    struct list f = fitting_list(parts, turned, n, nm, key, "force_N, moment_Nm");
    double *room = model_take(parts, 4 * (size_t)KL_MAX_TABLE_POINTS, sizeof *room);
    if (room == NULL || x.n == 0 || f.n == 0 ||
        !model_check(parts, x.n == f.n, "its two rows must be of the same length", "%s", key)) {
        return;
    }
    double *at = room;
    double *force = room + 2 * KL_MAX_TABLE_POINTS;
    def->at = at;
    def->force = force;
    if (raw->two_sided) {
        model_check(parts, x.value[0] >= 0.0, "two_sided states the positive side alone", "%s",
                    key);
        both_sides(at, force, x, f, def);
        model_check(parts, def->n <= KL_MAX_TABLE_POINTS, "has too many points for two sides", "%s",
                    key);
    } else {
        memcpy(at, x.value, x.n * sizeof *at);
        memcpy(force, f.value, f.n * sizeof *force);
        def->n = x.n;
    }
}

/* ---- elements ---- */

static void points(struct model_parts *parts, const struct raw_element *raw, uint32_t i,
                   struct kl_element_def *def) {
    bool one = raw->at != NULL && raw->at_a == NULL && raw->at_b == NULL;
    bool two = raw->at == NULL && raw->at_a != NULL && raw->at_b != NULL;
    if (!model_check(parts, one || two, "needs either at (both ends), or at_a and at_b",
                     "elements[%u]", i)) {
        return;
    }
    const struct raw_point *a = one ? raw->at : raw->at_a;
    const struct raw_point *b = one ? raw->at : raw->at_b;
    if (raw->mirror == RAW_MIRROR_LATERAL) {
        model_check(parts, a->y_m > 0.0, "with mirror: lateral the right one is stated, y_m > 0",
                    "elements[%u].%s.y_m", i, one ? "at" : "at_a");
    }
    def->point_a_m[0] = a->x_m;
    def->point_a_m[1] = a->y_m;
    def->point_a_m[2] = -a->height_m;
    def->point_b_m[0] = b->x_m;
    def->point_b_m[1] = b->y_m;
    def->point_b_m[2] = -b->height_m;
}

static void linear(struct model_parts *parts, const struct raw_element *raw, uint32_t i,
                   struct kl_element_def *def) {
    for (uint32_t axis = 0; axis < 3; axis++) {
        model_not_negative(parts, raw->k_N_m[axis], "elements[%u].k_N_m[%u]", i, axis);
        model_not_negative(parts, raw->k_Nm_rad[axis], "elements[%u].k_Nm_rad[%u]", i, axis);
        model_not_negative(parts, raw->c_Ns_m[axis], "elements[%u].c_Ns_m[%u]", i, axis);
        model_not_negative(parts, raw->c_Nms_rad[axis], "elements[%u].c_Nms_rad[%u]", i, axis);
        def->k[axis] = raw->k_N_m[axis];
        def->k[3 + axis] = raw->k_Nm_rad[axis];
        def->c[axis] = raw->c_Ns_m[axis];
        def->c[3 + axis] = raw->c_Nms_rad[axis];
    }
    if (raw->rod != NULL) {
        model_not_negative(parts, raw->rod->k_N_m, "elements[%u].rod.k_N_m", i);
        model_not_negative(parts, raw->rod->c_Ns_m, "elements[%u].rod.c_Ns_m", i);
        def->line_k_N_m = raw->rod->k_N_m;
        def->line_c_Ns_m = raw->rod->c_Ns_m;
    }
    def->sway = raw->sway != NULL ? (enum kl_sway) * raw->sway : KL_SWAY_NONE;
}

/* What works in one direction. */
static void directed(struct model_parts *parts, const struct raw_element *raw, uint32_t i,
                     struct kl_element_def *def) {
    bool any = raw->series != NULL || raw->friction != NULL || raw->stop != NULL ||
               raw->damper != NULL || raw->actuator != NULL;
    char key[48];
    model_check(parts, any || raw->along == NULL,
                "says where series, friction, stop, damper or actuator work; there is none",
                "elements[%u].along", i);
    if (!any ||
        !model_check(parts, raw->along != NULL,
                     "series, friction, stop, damper and actuator need along", "elements[%u]", i)) {
        return;
    }
    def->along = (enum kl_along) * raw->along;
    model_check(parts, raw->series == NULL || raw->friction == NULL,
                "has series and friction: make two elements of it", "elements[%u]", i);
    if (raw->series != NULL) {
        series(parts, raw->series, i, def);
    } else if (raw->friction != NULL) {
        friction(parts, raw->friction, i, def);
    }
    if (raw->stop != NULL) {
        snprintf(key, sizeof key, "elements[%u].stop", i);
        table(parts, raw->stop, key, false, turns(def), &def->stop);
    }
    if (raw->damper != NULL) {
        snprintf(key, sizeof key, "elements[%u].damper", i);
        table(parts, raw->damper, key, true, turns(def), &def->damper);
    }
    if (raw->actuator != NULL) {
        char what[48];
        snprintf(what, sizeof what, "inputs are 0 to %d", KL_MAX_ACTUATORS - 1);
        model_check(parts, *raw->actuator < KL_MAX_ACTUATORS, what, "elements[%u].actuator", i);
        model_check(parts, raw->mirror != RAW_MIRROR_LATERAL, "cannot be mirrored: state both",
                    "elements[%u].actuator", i);
        def->actuator = *raw->actuator + 1;
    }
}

/* The right one is as stated, the left one its mirror image; names get _r and _l. */
static void mirror(struct model_parts *parts, uint32_t i, struct kl_element_def *right,
                   struct kl_element_def *left) {
    size_t length = strlen(right->name);
    if (!model_check(parts, length + 2 < KL_NAME_SIZE, "too long to be mirrored: 29 at most",
                     "elements[%u].name", i)) {
        return;
    }
    *left = *right;
    memcpy(right->name + length, "_r", 3);
    memcpy(left->name + length, "_l", 3);
    left->point_a_m[1] = -left->point_a_m[1];
    left->point_b_m[1] = -left->point_b_m[1];
    if (left->along == KL_ALONG_Y || left->along == KL_ALONG_ROLL || left->along == KL_ALONG_YAW) {
        model_table_mirror(parts, &left->stop);
        model_table_mirror(parts, &left->damper);
    }
}

/* Fills one definition, or two where mirrored; how many. */
static uint32_t element(struct model_parts *parts, const struct raw_element *raw, uint32_t i,
                        const struct kl_vehicle_def *vehicle, struct kl_element_def *def) {
    char key[48];
    model_check_name(parts, raw->name, "elements[%u].name", i);
    memcpy(def->name, raw->name, sizeof def->name);
    snprintf(key, sizeof key, "elements[%u].between[0]", i);
    def->end_a = model_end(parts, vehicle, raw->between[0], key);
    snprintf(key, sizeof key, "elements[%u].between[1]", i);
    def->end_b = model_end(parts, vehicle, raw->between[1], key);
    model_check(parts, def->end_a != def->end_b || def->end_a == NO_END,
                "must name two different ends", "elements[%u].between", i);
    points(parts, raw, i, def);
    linear(parts, raw, i, def);
    directed(parts, raw, i, def);
    if (raw->mirror != RAW_MIRROR_LATERAL) {
        return 1;
    }
    mirror(parts, i, def, def + 1);
    return 2;
}

static void elements(struct model_parts *parts, const struct raw_ties *raw,
                     struct kl_vehicle_def *def) {
    struct kl_element_def *list =
        model_take(parts, def->n_elements + 2 * (size_t)raw->n_elements + 1, sizeof *list);
    if (list == NULL) {
        return;
    }
    if (def->n_elements > 0) {
        memcpy(list, def->elements, def->n_elements * sizeof *list);
    }
    for (uint32_t i = 0; i < raw->n_elements; i++) {
        def->n_elements += element(parts, &raw->elements[i], i, def, &list[def->n_elements]);
    }
    char what[64];
    snprintf(what, sizeof what, "with mirrored ones %u; at most %d", def->n_elements,
             KL_MAX_ELEMENTS);
    model_check(parts, def->n_elements <= KL_MAX_ELEMENTS, what, "elements");
    def->elements = list;
}

/* ---- linkages ---- */

/* Angles and lengths cannot be told apart by the freedoms: levers turn one into the other. So the
 * unit of the stiffness says what the combination counts in, and nothing is checked. */
static double either(struct model_parts *parts, const double *length, const double *angle,
                     const char *names, uint32_t i) {
    char what[64];
    snprintf(what, sizeof what, "may have one of %s", names);
    model_check(parts, length == NULL || angle == NULL, what, "linkages[%u]", i);
    const double *given = length != NULL ? length : angle;
    if (given != NULL) {
        model_check(parts, *given >= 0.0, "its numbers must be >= 0", "linkages[%u]", i);
    }
    return given != NULL ? *given : 0.0;
}

static void linkage(struct model_parts *parts, const struct raw_linkage *raw, uint32_t i,
                    const struct kl_vehicle_def *vehicle, struct kl_linkage_def *def) {
    char key[48];
    model_check_name(parts, raw->name, "linkages[%u].name", i);
    memcpy(def->name, raw->name, sizeof def->name);
    def->n_terms = raw->n_terms;
    for (uint32_t t = 0; t < raw->n_terms; t++) {
        snprintf(key, sizeof key, "linkages[%u].terms[%u].of", i, t);
        def->term[t].end = model_end(parts, vehicle, raw->terms[t].of, key);
        model_check(parts, def->term[t].end != KL_GROUND_END, "the ground has no freedoms", "%s",
                    key);
        def->term[t].freedom = (enum kl_freedom)raw->terms[t].freedom;
        def->term[t].factor = raw->terms[t].factor;
    }
    def->k = either(parts, raw->k_N_m, raw->k_Nm_rad, "k_N_m, k_Nm_rad", i);
    def->c = either(parts, raw->c_Ns_m, raw->c_Nms_rad, "c_Ns_m, c_Nms_rad", i);
    def->rigid = raw->rigid ? 1 : 0;
    model_check(parts, raw->rigid ? def->k == 0.0 && def->c == 0.0 : def->k > 0.0 || def->c > 0.0,
                "needs either rigid: true, or a stiffness or a damping", "linkages[%u]", i);
}

static void linkages(struct model_parts *parts, const struct raw_ties *raw,
                     struct kl_vehicle_def *def) {
    struct kl_linkage_def *list =
        model_take(parts, (size_t)def->n_linkages + raw->n_linkages + 1, sizeof *list);
    if (list == NULL) {
        return;
    }
    if (def->n_linkages > 0) {
        memcpy(list, def->linkages, def->n_linkages * sizeof *list);
    }
    for (uint32_t i = 0; i < raw->n_linkages; i++) {
        linkage(parts, &raw->linkages[i], i, def, &list[def->n_linkages++]);
    }
    def->linkages = list;
}

void model_ties_convert(struct model_parts *parts, const struct raw_ties *raw,
                        struct kl_vehicle_def *def) {
    elements(parts, raw, def);
    linkages(parts, raw, def);
}
