/* run_forces.c - which forces a run writes, and their columns. */
#include "run_forces.h"

#include <stdlib.h>
#include <string.h>

#define PARTS 11

/* ---- which ---- */

static bool has_part(const struct kl_element_def *e, int part) {
    switch (part) {
    case 6:
        return e->line_k_N_m > 0.0 || e->line_c_Ns_m > 0.0;
    case 7:
        return e->slip.k > 0.0;
    case 8:
        return e->stop.n > 0;
    case 9:
        return e->damper.n > 0;
    case 10:
        return e->actuator > 0;
    default:
        return e->k[part] > 0.0 || e->c[part] > 0.0;
    }
}

/* "primary_w1" names primary_w1_r and primary_w1_l as well. */
static bool is_named(const char *name, const char *wanted) {
    const size_t length = strlen(wanted);
    return strcmp(wanted, "all") == 0 || strcmp(name, wanted) == 0 ||
           (strncmp(name, wanted, length) == 0 &&
            (strcmp(name + length, "_r") == 0 || strcmp(name + length, "_l") == 0));
}

static bool is_chosen(const struct cli_list *names, const char *name) {
    for (size_t i = 0; i < names->n; i++) {
        if (is_named(name, names->item[i])) {
            return true;
        }
    }
    return false;
}

static int unknown_name(const struct kl_vehicle_def *def, const char *wanted) {
    const char *words[KL_MAX_ELEMENTS + KL_MAX_LINKAGES];
    size_t n = 0;
    for (uint32_t i = 0; i < def->n_elements; i++) {
        words[n++] = def->elements[i].name;
    }
    for (uint32_t i = 0; i < def->n_linkages; i++) {
        words[n++] = def->linkages[i].name;
    }
    for (size_t i = 0; i < n; i++) {
        if (is_named(words[i], wanted)) {
            return CLI_OK;
        }
    }
    const char *near = cli_nearest(wanted, words, n);
    return cli_misuse("--forces %s: the vehicle has no such element or linkage%s%s%s", wanted,
                      near != NULL ? "; did you mean " : "", near != NULL ? near : "",
                      near != NULL ? "?" : "");
}

int run_forces_choose(struct run_forces *forces, const struct kl_vehicle_def *def,
                      const struct cli_list *names) {
    *forces = (struct run_forces){.def = def};
    for (size_t i = 0; i < names->n; i++) {
        if (unknown_name(def, names->item[i]) != CLI_OK) {
            return CLI_USAGE;
        }
    }
    if (names->n == 0) {
        return CLI_OK;
    }
    forces->column =
        malloc((PARTS * def->n_elements + def->n_linkages + 1u) * sizeof forces->column[0]);
    if (forces->column == NULL) {
        return cli_fail("out of memory");
    }
    for (uint32_t i = 0; i < def->n_elements; i++) {
        for (int part = 0; part < PARTS; part++) {
            if (is_chosen(names, def->elements[i].name) && has_part(&def->elements[i], part)) {
                forces->column[forces->n++] = (struct run_force){false, i, part};
            }
        }
    }
    for (uint32_t i = 0; i < def->n_linkages; i++) {
        if (is_chosen(names, def->linkages[i].name)) {
            forces->column[forces->n++] = (struct run_force){true, i, 0};
        }
    }
    return CLI_OK;
}

void run_forces_free(struct run_forces *forces) {
    free(forces->column);
    *forces = (struct run_forces){0};
}

/* ---- columns ---- */

static bool is_length(const struct kl_linkage_def *linkage) {
    bool length = false;
    for (uint32_t i = 0; i < linkage->n_terms; i++) {
        length = length || linkage->term[i].freedom == KL_Y || linkage->term[i].freedom == KL_Z;
    }
    return length;
}

void run_forces_header(const struct run_forces *forces, FILE *file) {
    static const char *const part[PARTS] = {"x_N",      "y_N",    "z_N",     "roll_Nm",
                                            "pitch_Nm", "yaw_Nm", "line_N",  "series",
                                            "stop",     "damper", "actuator"};
    for (size_t i = 0; i < forces->n; i++) {
        const struct run_force *c = &forces->column[i];
        if (c->linkage) {
            const struct kl_linkage_def *linkage = &forces->def->linkages[c->index];
            fprintf(file, ",%s_%s", linkage->name, is_length(linkage) ? "N" : "Nm");
            continue;
        }
        const struct kl_element_def *e = &forces->def->elements[c->index];
        const bool friction = c->part == 7 && e->slip.c == 0.0;
        const bool angle = e->along >= KL_ALONG_ROLL && e->along <= KL_ALONG_YAW;
        fprintf(file, ",%s_%s%s", e->name, friction ? "friction" : part[c->part],
                c->part < 7 ? ""
                : angle     ? "_Nm"
                            : "_N");
    }
}

static kl_real part_of(const struct kl_element_force *f, int part) {
    const kl_real others[] = {f->line_N, f->slip, f->stop, f->damper, f->actuator};
    return part < 6 ? f->axis[part] : others[part - 6];
}

void run_forces_row(const struct run_forces *forces, const struct kl_model *model,
                    const struct kl_state *state, const struct kl_input *input, FILE *file) {
    static struct kl_output output; /* not wanted */
    struct kl_element_force force = {0};
    uint32_t found = UINT32_MAX;
    if (forces->n > 0) {
        kl_observe(model, state, input, &output, cli_work());
    }
    for (size_t i = 0; i < forces->n; i++) {
        const struct run_force *c = &forces->column[i];
        if (!c->linkage && c->index != found) {
            kl_element_force(forces->def, model, c->index, &force, cli_work());
            found = c->index;
        }
        fprintf(file, ",%.12g",
                (double)(c->linkage ? kl_linkage_force(forces->def, model, c->index, cli_work())
                                    : part_of(&force, c->part)));
    }
}
