/* emit_creep.c - a creep-force table as C source. Order of the fields as in kl_creep.h. */
#include <inttypes.h>

#include "creep_file.h"

/* Nine digits tell every float, "%a" every double. */
static void floats(FILE *f, const char *name, const char *what, const float *values, size_t n) {
    fprintf(f, "static const float %s_%s[%zu] = {", name, what, n);
    for (size_t i = 0; i < n; i++) {
        fprintf(f, "%s%.8eF", i == 0 ? "\n    " : i % 6 == 0 ? ",\n    " : ", ", (double)values[i]);
    }
    fputs("};\n\n", f);
}

static void axis_arrays(FILE *f, const char *name, const char *axis,
                        const struct kl_creep_axis *a) {
    const char *suffix = sizeof(kl_real) == sizeof(float) ? "f" : "";
    fprintf(f, "static const struct kl_creep_cell %s_%s[%" PRIu32 "] = {", name, axis, a->n - 1);
    for (uint32_t i = 0; i + 1 < a->n; i++) {
        fprintf(f, "%s{%a%s, %a%s, %a%s}", i == 0 ? "\n    " : ",\n    ", (double)a->cell[i].low,
                suffix, (double)a->cell[i].next, suffix, (double)a->cell[i].inverse, suffix);
    }
    fprintf(f, "};\nstatic const uint8_t %s_%s_bin[KL_CREEP_BINS + 1] = {", name, axis);
    for (int i = 0; i <= KL_CREEP_BINS; i++) {
        fprintf(f, "%s%u", i == 0 ? "\n    " : i % 16 == 0 ? ",\n    " : ", ", (unsigned)a->bin[i]);
    }
    fputs("};\n\n", f);
}

static void axis_field(FILE *f, const char *name, const char *axis, const struct kl_creep_axis *a) {
    fprintf(f, "    .%s = {.n = %" PRIu32 ", .cell = %s_%s, .bin = %s_%s_bin},\n", axis, a->n, name,
            axis, name, axis);
}

static void ratios(FILE *f, const struct kl_creep_table *t, const char *name) {
    fprintf(f, "static const double %s_log_ratio[%" PRIu32 "] = {", name, t->n_ratio);
    for (uint32_t i = 0; i < t->n_ratio; i++) {
        fprintf(f, "%s%a", i == 0 ? "\n    " : i % 4 == 0 ? ",\n    " : ", ", t->log_ratio[i]);
    }
    fprintf(f, "};\nstatic const double %s_log_c_ij[%" PRIu32 "][3] = {", name, t->n_ratio);
    for (uint32_t i = 0; i < t->n_ratio; i++) {
        const double *c = t->log_c_ij[i];
        fprintf(f, "%s{%a, %a, %a}", i == 0 ? "\n    " : ",\n    ", c[0], c[1], c[2]);
    }
    fputs("};\n\n", f);
}

void emit_creep_table(FILE *f, const struct kl_creep_table *t, const char *name, bool is_static) {
    fprintf(f,
            "/* Creep-force table, %" PRIu32 " x %" PRIu32 " x %" PRIu32 " x %" PRIu32
            " nodes, %zu bytes; written by klingel, not to be edited. */\n",
            t->n_ratio, t->spin.n, t->creep.n, t->angle.n, kl_creep_table_bytes(t));
    if (!is_static) {
        fprintf(f, "#include \"kl_creep.h\"\n\n");
    }
    fprintf(f,
            "_Static_assert(sizeof(kl_real) == %zu, \"%s was built for another real type\");\n\n",
            sizeof(kl_real), name);
    axis_arrays(f, name, "spin", &t->spin);
    axis_arrays(f, name, "creep", &t->creep);
    axis_arrays(f, name, "angle", &t->angle);
    ratios(f, t, name);
    floats(f, name, "pure", t->pure, kl_creep_table_pure(t));
    floats(f, name, "rest", t->rest, kl_creep_table_rest(t));
    floats(f, name, "stiffness", t->stiffness, kl_creep_table_stiffness(t));
    if (is_static) {
        fprintf(f, "static const struct kl_creep_table %s = {\n", name);
    } else {
        fprintf(f, "extern const struct kl_creep_table %s;\nconst struct kl_creep_table %s = {\n",
                name, name);
    }
    fprintf(f,
            "    .n_ratio = %" PRIu32 ", .alpha = (kl_real)%a, .beta = (kl_real)%a,\n"
            "    .gamma = (kl_real)%a,\n",
            t->n_ratio, (double)t->alpha, (double)t->beta, (double)t->gamma);
    axis_field(f, name, "spin", &t->spin);
    axis_field(f, name, "creep", &t->creep);
    axis_field(f, name, "angle", &t->angle);
    fprintf(f,
            "    .log_ratio = %s_log_ratio, .log_c_ij = %s_log_c_ij,\n"
            "    .pure = %s_pure, .rest = %s_rest, .stiffness = %s_stiffness,\n"
            "    .hash = UINT64_C(0x%016" PRIx64 ")};\n",
            name, name, name, name, name, t->hash);
}
