/* sketch_list.c - parts that are alike, and their lines. */
#include "sketch_list.h"

#include <stdarg.h>
#include <string.h>

#define SAME 1e-9

/* ---- what an element has ---- */

static void put_part(struct sketch_part *part, size_t *n, enum sketch_symbol symbol, int axis) {
    part[*n].symbol = symbol;
    part[*n].axis = axis;
    (*n)++;
}

size_t sketch_parts(const struct kl_element_def *e, struct sketch_part part[SKETCH_MAX_PARTS]) {
    size_t n = 0;
    for (int axis = 0; axis < 6; axis++) {
        if (e->k[axis] > 0.0) {
            put_part(part, &n, SKETCH_IS_SPRING, axis);
        }
        if (e->c[axis] > 0.0) {
            put_part(part, &n, SKETCH_IS_DAMPER, axis);
        }
    }
    if (e->line_k_N_m > 0.0) {
        put_part(part, &n, SKETCH_IS_SPRING, KL_ALONG_LINE);
    }
    if (e->line_c_Ns_m > 0.0) {
        put_part(part, &n, SKETCH_IS_DAMPER, KL_ALONG_LINE);
    }
    if (e->slip.k > 0.0) {
        put_part(part, &n, e->slip.c > 0.0 ? SKETCH_IS_SERIES : SKETCH_IS_FRICTION, (int)e->along);
    }
    if (e->stop.n > 0) {
        put_part(part, &n, SKETCH_IS_STOP, (int)e->along);
    }
    if (e->damper.n > 0) {
        put_part(part, &n, SKETCH_IS_DAMPER, (int)e->along);
    }
    if (e->actuator > 0) {
        put_part(part, &n, SKETCH_IS_ACTUATOR, (int)e->along);
    }
    return n;
}

void sketch_place(const struct kl_element_def *e, double at_m[3]) {
    for (int i = 0; i < 3; i++) {
        at_m[i] = 0.5 * (e->point_a_m[i] + e->point_b_m[i]);
    }
}

/* ---- alike ---- */

static bool same(double a, double b) {
    return fabs(a - b) <= SAME * (1.0 + fabs(a));
}

static bool same_table(const struct kl_table_def *a, const struct kl_table_def *b) {
    bool alike = a->n == b->n;
    for (uint32_t i = 0; alike && i < a->n; i++) { /* a mirrored one is the other turned round */
        alike =
            (same(a->at[i], b->at[i]) && same(a->force[i], b->force[i])) ||
            (same(a->at[i], -b->at[a->n - 1 - i]) && same(a->force[i], -b->force[a->n - 1 - i]));
    }
    return alike;
}

static bool same_slip(const struct kl_slip_def *a, const struct kl_slip_def *b) {
    return same(a->k, b->k) && same(a->c, b->c) && same(a->limit, b->limit);
}

static bool alike_elements(const struct kl_element_def *a, const struct kl_element_def *b) {
    double at_a[3];
    double at_b[3];
    sketch_place(a, at_a);
    sketch_place(b, at_b);
    bool alike = same(fabs(at_a[1]), fabs(at_b[1])) && same(at_a[2], at_b[2]) &&
                 a->sway == b->sway && same(a->line_k_N_m, b->line_k_N_m) &&
                 same(a->line_c_Ns_m, b->line_c_Ns_m) && a->along == b->along &&
                 same_slip(&a->slip, &b->slip) && same_table(&a->stop, &b->stop) &&
                 same_table(&a->damper, &b->damper) && a->actuator == b->actuator;
    for (int i = 0; i < 6; i++) {
        alike = alike && same(a->k[i], b->k[i]) && same(a->c[i], b->c[i]);
    }
    return alike;
}

static bool alike_linkages(const struct kl_linkage_def *a, const struct kl_linkage_def *b) {
    bool alike =
        a->n_terms == b->n_terms && same(a->k, b->k) && same(a->c, b->c) && a->rigid == b->rigid;
    for (uint32_t i = 0; alike && i < a->n_terms; i++) {
        alike =
            a->term[i].freedom == b->term[i].freedom && same(a->term[i].factor, b->term[i].factor);
    }
    return alike;
}

void sketch_group(const struct kl_vehicle_def *def, struct sketch_groups *groups) {
    uint32_t n = 0;
    for (uint32_t i = 0; i < def->n_elements; i++) {
        groups->of_element[i] = n;
        for (uint32_t j = 0; j < i && groups->of_element[i] == n; j++) {
            if (alike_elements(&def->elements[i], &def->elements[j])) {
                groups->of_element[i] = groups->of_element[j];
            }
        }
        n += groups->of_element[i] == n ? 1u : 0u;
    }
    groups->n_element_groups = n;
    for (uint32_t i = 0; i < def->n_linkages; i++) {
        groups->of_linkage[i] = n;
        for (uint32_t j = 0; j < i && groups->of_linkage[i] == n; j++) {
            if (alike_linkages(&def->linkages[i], &def->linkages[j])) {
                groups->of_linkage[i] = groups->of_linkage[j];
            }
        }
        n += groups->of_linkage[i] == n ? 1u : 0u;
    }
    groups->n_groups = n;
}

/* ---- lines ---- */

static void add(char line[SKETCH_LINE_SIZE], const char *format, ...)
    __attribute__((format(printf, 2, 3)));
static void add(char line[SKETCH_LINE_SIZE], const char *format, ...) {
    const size_t used = strlen(line);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(line + used, SKETCH_LINE_SIZE - used, format, arguments);
    va_end(arguments);
}

/* n values with a common prefix of their unit; nothing where all are 0. */
static void add_values(char line[SKETCH_LINE_SIZE], const char *what, const double *v, size_t n,
                       const char *unit) {
    double most = 0.0;
    for (size_t i = 0; i < n; i++) {
        most = fmax(most, fabs(v[i]));
    }
    if (most == 0.0) {
        return;
    }
    const double one = most >= 0.5e6 ? 1e6 : most >= 1e3 ? 1e3 : 1.0;
    add(line, "; %s", what);
    for (size_t i = 0; i < n; i++) {
        add(line, "%s%.5g", i > 0 ? ", " : " ", v[i] / one);
    }
    add(line, " %s%s", one == 1e6 ? "M" : one == 1e3 ? "k" : "", unit);
}

static void add_table(char line[SKETCH_LINE_SIZE], const char *what,
                      const struct kl_table_def *table, bool length, const char *unit) {
    if (table->n > 0) {
        const double at = table->at[table->n - 1];
        add(line, "; %s to %.4g %s at %.4g %s", what, table->force[table->n - 1] / 1e3,
            length ? "kN" : "kN m", at * 1e3, unit);
    }
}

static void add_figures(const struct kl_element_def *e, char line[SKETCH_LINE_SIZE]) {
    static const char *const sways[] = {"", "; its load sways, clamped",
                                        "; its load sways, pinned"};
    static const char *const axes[] = {"x", "y", "z", "roll", "pitch", "yaw", "its line"};
    const bool length = e->along <= KL_ALONG_Z || e->along == KL_ALONG_LINE;
    double at[3];
    sketch_place(e, at);
    add(line, ": at y %s%.4g, h %.4g m", at[1] != 0.0 ? "\xc2\xb1" : "", fabs(at[1]), -at[2]);
    add_values(line, "k", e->k, 3, "N/m");
    add_values(line, "c", e->c, 3, "N s/m");
    add_values(line, "about axes k", e->k + 3, 3, "N m");
    add_values(line, "about axes c", e->c + 3, 3, "N m s");
    add_values(line, "rod k", &e->line_k_N_m, 1, "N/m");
    add_values(line, "rod c", &e->line_c_Ns_m, 1, "N s/m");
    if (e->slip.k > 0.0 || e->stop.n > 0 || e->damper.n > 0 || e->actuator > 0) {
        add(line, "; along %s", axes[e->along]);
    }
    if (e->slip.k > 0.0) {
        add_values(line, e->slip.c > 0.0 ? "series k" : "friction k", &e->slip.k, 1,
                   length ? "N/m" : "N m");
        add_values(line, "c", &e->slip.c, 1, length ? "N s/m" : "N m s");
        add_values(line, e->slip.c > 0.0 ? "blows off at" : "slides at", &e->slip.limit, 1,
                   length ? "N" : "N m");
    }
    add_table(line, "stop", &e->stop, length, length ? "mm" : "mrad");
    add_table(line, "damper", &e->damper, length, length ? "mm/s" : "mrad/s");
    if (e->actuator > 0) {
        add(line, "; actuator %u", e->actuator - 1);
    }
    add(line, "%s", sways[e->sway]);
}

static const char *end_name(const struct kl_vehicle_def *def, int32_t end) {
    return end >= KL_WHEELSET_END(0) ? def->wheelsets[end - KL_WHEELSET_END(0)].name
           : end >= 0                ? def->bodies[end].name
                                     : "ground";
}

static void add_terms(const struct kl_vehicle_def *def, const struct kl_linkage_def *linkage,
                      char line[SKETCH_LINE_SIZE]) {
    static const char *const freedoms[] = {"y", "z", "roll", "pitch", "yaw"};
    bool length = false;
    add(line, ":");
    for (uint32_t i = 0; i < linkage->n_terms; i++) {
        const struct kl_term_def *t = &linkage->term[i];
        length = length || t->freedom == KL_Y || t->freedom == KL_Z;
        add(line, " %s", t->factor < 0.0 ? "\xe2\x88\x92 " : i > 0 ? "+ " : "");
        if (fabs(t->factor) != 1.0) {
            add(line, "%.4g ", fabs(t->factor));
        }
        add(line, "%s(%s)", freedoms[t->freedom], end_name(def, t->end));
    }
    if (linkage->rigid != 0) {
        add(line, "; rigid");
    }
    add_values(line, "k", &linkage->k, 1, length ? "N/m" : "N m");
    add_values(line, "c", &linkage->c, 1, length ? "N s/m" : "N m s");
}

/* A name without the _r or _l of its side. */
static void add_name(char line[SKETCH_LINE_SIZE], const char *name, bool sided) {
    const size_t length = strlen(name);
    const bool strip = sided && length > 2 && name[length - 2] == '_' &&
                       (name[length - 1] == 'r' || name[length - 1] == 'l');
    add(line, "%.*s", (int)(strip ? length - 2 : length), name);
}

void sketch_group_line(const struct kl_vehicle_def *def, const struct sketch_groups *groups,
                       uint32_t group, char line[SKETCH_LINE_SIZE]) {
    const bool linkage = group >= groups->n_element_groups;
    const uint32_t total = linkage ? def->n_linkages : def->n_elements;
    uint32_t count = 0;
    uint32_t first = 0;
    uint32_t last = 0;
    for (uint32_t i = 0; i < total; i++) {
        if ((linkage ? groups->of_linkage[i] : groups->of_element[i]) == group) {
            first = count == 0 ? i : first;
            last = i;
            count++;
        }
    }
    const char *name = linkage ? def->linkages[first].name : def->elements[first].name;
    const char *end = linkage ? def->linkages[last].name : def->elements[last].name;
    line[0] = '\0';
    add_name(line, name, !linkage && count > 1);
    if (count > (linkage ? 1u : 2u)) {
        add(line, " .. ");
        add_name(line, end, !linkage);
    }
    if (count > 1) {
        add(line, " (%u)", count);
    }
    if (linkage) {
        add_terms(def, &def->linkages[first], line);
    } else {
        add_figures(&def->elements[first], line);
    }
}

/* "w1 .. w4 (4)"; false: an earlier one is alike. */
static uint32_t add_alike(char line[SKETCH_LINE_SIZE], const char *first, const char *last,
                          uint32_t count) {
    line[0] = '\0';
    add(line, "%s", first);
    if (count > 1) {
        add(line, " .. %s (%u)", last, count);
    }
    return count;
}

static bool alike_bodies(const struct kl_body_def *a, const struct kl_body_def *b) {
    return same(a->mass_kg, b->mass_kg) && same(a->z_m, b->z_m) && a->freedoms == b->freedoms &&
           same(a->inertia_kgm2[0], b->inertia_kgm2[0]) &&
           same(a->inertia_kgm2[1], b->inertia_kgm2[1]) &&
           same(a->inertia_kgm2[2], b->inertia_kgm2[2]);
}

uint32_t sketch_body_line(const struct kl_vehicle_def *def, uint32_t i,
                          char line[SKETCH_LINE_SIZE]) {
    const struct kl_body_def *body = &def->bodies[i];
    uint32_t count = 0;
    uint32_t last = i;
    for (uint32_t j = 0; j < def->n_bodies; j++) {
        if (alike_bodies(body, &def->bodies[j])) {
            if (j < i) {
                return 0;
            }
            last = j;
            count++;
        }
    }
    add_alike(line, body->name, def->bodies[last].name, count);
    add(line, ": %.5g t, centre at h %.4g m", body->mass_kg / 1e3, -body->z_m);
    add(line, "; I %.5g, %.5g, %.5g t m\xc2\xb2", body->inertia_kgm2[0] / 1e3,
        body->inertia_kgm2[1] / 1e3, body->inertia_kgm2[2] / 1e3);
    return count;
}

static bool alike_wheelsets(const struct cli_model *m, uint32_t i, uint32_t j) {
    const struct kl_vehicle_def *def = &m->file.vehicle;
    const struct kl_model *model = &m->model;
    const struct kl_wheelset_def *a = &def->wheelsets[i];
    const struct kl_wheelset_def *b = &def->wheelsets[j];
    const double load = (double)model->wheelsets[i].static_load_N;
    return same(a->mass_kg, b->mass_kg) && same(a->inertia_yaw_kgm2, b->inertia_yaw_kgm2) &&
           a->pair == b->pair &&
           fabs((double)model->wheelsets[j].static_load_N - load) < 1e-6 * fabs(load) + 1e-3;
}

uint32_t sketch_wheelset_line(const struct cli_model *m, uint32_t i, char line[SKETCH_LINE_SIZE]) {
    const struct kl_vehicle_def *def = &m->file.vehicle;
    const struct kl_model *model = &m->model;
    const struct kl_wheelset_def *w = &def->wheelsets[i];
    const struct kl_pair_def *pair = &def->pairs[w->pair];
    const bool linear = pair->kind == KL_PAIR_LINEAR;
    uint32_t count = 0;
    uint32_t last = i;
    for (uint32_t j = 0; j < def->n_wheelsets; j++) {
        if (alike_wheelsets(m, i, j)) {
            if (j < i) {
                return 0;
            }
            last = j;
            count++;
        }
    }
    add_alike(line, w->name, def->wheelsets[last].name, count);
    add(line, ": %.5g t", w->mass_kg / 1e3);
    add(line, "; I %.4g, %.4g, %.4g t m\xc2\xb2", w->inertia_roll_kgm2 / 1e3,
        w->inertia_spin_kgm2 / 1e3, w->inertia_yaw_kgm2 / 1e3);
    add(line, "; radius %.4g m", linear ? pair->radius_m : pair->wheel[KL_RIGHT].radius_m);
    if (linear) {
        add(line, ", conicity %.4g", pair->conicity);
    } else {
        add(line, ", %s", model_file_pair_name(&m->file, w->pair));
    }
    if (w->independent != 0) {
        add(line, "; wheels turn by themselves");
    }
    if (model->wheelsets[i].static_load_N > 0) {
        add(line, "; axle load %.5g kN", (double)model->wheelsets[i].static_load_N / 1e3);
    }
    return count;
}
