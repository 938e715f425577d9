/* emit_model.c - the model as C source. Order of the fields as in the headers. */
#include "emit_model.h"

#include <inttypes.h>
#include <stddef.h>

#include "creep_file.h"

/* Exact, and of the real type: no conversion is left to the compiler. */
static void real(FILE *f, kl_real value) {
    fprintf(f, sizeof(kl_real) == sizeof(float) ? "%af" : "%a", (double)value);
}

static void reals(FILE *f, const kl_real *values, size_t n) {
    fputc('{', f);
    for (size_t i = 0; i < n; i++) {
        fputs(i == 0 ? "" : i % 6 == 0 ? ",\n     " : ", ", f);
        real(f, values[i]);
    }
    fputc('}', f);
}

static void field(FILE *f, const char *name, kl_real value) {
    fprintf(f, ".%s = ", name);
    real(f, value);
    fputs(", ", f);
}

/* Several fields, three to a line; `indent` begins the next one. */
struct named {
    const char *name;
    kl_real value;
};
#define OF(whole, member)                                                                          \
    { #member, (whole)->member }
#define FIELDS(f, indent, ...)                                                                     \
    fields(f, indent, (const struct named[]){__VA_ARGS__},                                         \
           sizeof((const struct named[]){__VA_ARGS__}) / sizeof(struct named))

static void fields(FILE *f, const char *indent, const struct named *named, size_t n) {
    for (size_t i = 0; i < n; i++) {
        fputs(i > 0 && i % 3 == 0 ? indent : "", f);
        field(f, named[i].name, named[i].value);
    }
}

static void words(FILE *f, const char *name, const char *what, const uint16_t *values, size_t n) {
    fprintf(f, "static const uint16_t %s_%s[] = {", name, what);
    for (size_t i = 0; i < n; i++) {
        fprintf(f, "%s%u", i == 0 ? "" : i % 24 == 0 ? ",\n    " : ", ", (unsigned)values[i]);
    }
    fputs("};\n", f);
}

/* ---- the arrays behind the model ---- */

static void bodies(FILE *f, const struct kl_model *m, const char *name) {
    if (m->n_bodies == 0) {
        return;
    }
    fprintf(f, "static const struct kl_body %s_bodies[] = {\n", name);
    for (uint32_t i = 0; i < m->n_bodies; i++) {
        const struct kl_body *b = &m->bodies[i];
        fprintf(f, "    {.name = \"%s\", ", b->name);
        field(f, "mass_kg", b->mass_kg);
        fputs("\n     .inertia_kgm2 = ", f);
        reals(f, b->inertia_kgm2, 3);
        fputs(",\n     .inverse = ", f);
        reals(f, b->inverse, KL_FREEDOMS);
        fputs(",\n     ", f);
        FIELDS(f, "\n     ", OF(b, x_m), OF(b, z_m));
        fprintf(f, ".freedoms = %" PRIu32 "},\n", b->freedoms);
    }
    fputs("};\n\n", f);
}

static const char *const law_name[KL_CREEP_LAWS] = {[KL_CREEP_LINEAR] = "KL_CREEP_LINEAR",
                                                    [KL_CREEP_SHE] = "KL_CREEP_SHE",
                                                    [KL_CREEP_POLACH] = "KL_CREEP_POLACH",
                                                    [KL_CREEP_FASTSIM] = "KL_CREEP_FASTSIM",
                                                    [KL_CREEP_FASTSIM_ELLIPTIC] =
                                                        "KL_CREEP_FASTSIM_ELLIPTIC",
                                                    [KL_CREEP_TABLE] = "KL_CREEP_TABLE"};

static void creep(FILE *f, const struct kl_creep_def *c) {
    fprintf(f, ".creep = {.law = %s, ", law_name[c->law]);
    field(f, "friction", c->friction);
    fprintf(f, ".falls = %" PRIu32 ", ", c->falls);
    FIELDS(f, "\n     ", OF(c, falling_ratio), OF(c, falling_decay_s_m), OF(c, k_a), OF(c, k_s),
           OF(c, f11_N), OF(c, f22_N), OF(c, f23_Nm), OF(c, f33_Nm2));
    fputs("}", f);
}

static void wheelsets(FILE *f, const struct kl_model *m, const char *name) {
    fprintf(f, "static const struct kl_wheelset %s_wheelsets[] = {\n", name);
    for (uint32_t i = 0; i < m->n_wheelsets; i++) {
        const struct kl_wheelset *w = &m->wheelsets[i];
        fprintf(f, "    {.name = \"%s\", ", w->name);
        FIELDS(f, "\n     ", OF(w, mass_kg), OF(w, inertia_roll_kgm2), OF(w, inertia_spin_kgm2),
               OF(w, inertia_yaw_kgm2), OF(w, inv_spin_1_kgm2), OF(w, inv_yaw_1_kgm2), OF(w, x_m));
        fputs("\n     .preload = ", f);
        reals(f, w->preload, 4);
        fputs(",\n     ", f);
        field(f, "static_load_N", w->static_load_N);
        fprintf(f, ".pair = %" PRIu32 ",\n     ", w->pair);
        if (w->independent != 0) {
            fprintf(f, ".independent = %" PRIu32 ", ", w->independent);
            field(f, "coupling_Nms_rad", w->coupling_Nms_rad);
            fputs("\n     ", f);
        }
        creep(f, &w->creep);
        fputs("},\n", f);
    }
    fputs("};\n\n", f);
}

/* A row is nothing but kl_real columns, the last of them an array. */
static void contact_row(FILE *f, const struct kl_row *row) {
    const size_t n = offsetof(struct kl_row, shape) / sizeof(kl_real);
    const kl_real *column = (const kl_real *)row;
    fputc('{', f);
    for (size_t i = 0; i < n; i++) {
        real(f, column[i]);
        fputs(", ", f);
    }
    reals(f, row->shape, KL_CREEP_SHAPES);
    fputc('}', f);
}

static void rows(FILE *f, const struct kl_pair *pair, const char *name, uint32_t index) {
    static const char *const side[KL_SIDES] = {"right", "left"};
    for (int s = 0; s < KL_SIDES; s++) {
        fprintf(f, "static const struct kl_row %s_rows_%" PRIu32 "_%s[] = {\n", name, index,
                side[s]);
        for (uint32_t i = 0; i < 2 * pair->half + 1; i++) {
            fputs("    ", f);
            contact_row(f, &pair->side[s].rows[i]);
            fputs(",\n", f);
        }
        fputs("};\n\n", f);
    }
}

static void flanges(FILE *f, const struct kl_pair *pair, const char *name, uint32_t index) {
    static const char *const side[KL_SIDES] = {"right", "left"};
    for (int s = 0; s < KL_SIDES; s++) {
        fprintf(f, "static const struct kl_flange_row %s_flange_%" PRIu32 "_%s[] = {\n", name,
                index, side[s]);
        for (uint32_t i = 0; i < pair->flange[s].n_rows; i++) {
            const struct kl_flange_row *row = &pair->flange[s].rows[i];
            fputs("    {", f);
            FIELDS(f, "\n     ", OF(row, place_m), OF(row, place_h), OF(row, inv_sin),
                   OF(row, inv_cos));
            fputs("\n     .contact = ", f);
            contact_row(f, &row->contact);
            fputs("},\n", f);
        }
        fputs("};\n\n", f);
    }
}

static void jumps(FILE *f, const struct kl_side_table *table) {
    fputs("          .jumps = {", f);
    for (uint32_t i = 0; i < table->n_jumps && i < KL_MAX_JUMPS; i++) {
        const struct kl_jump *j = &table->jumps[i];
        fprintf(f, "%s{%a, %a, %a}", i == 0 ? "" : ",\n                    ", j->w_m,
                j->eta_before_m, j->eta_after_m);
    }
    if (table->n_jumps == 0) {
        fputs("{0.0, 0.0, 0.0}", f);
    }
    fprintf(f, "},\n          .n_jumps = %" PRIu32 "},\n", table->n_jumps);
}

static void pairs(FILE *f, const struct kl_model *m, const char *name) {
    for (uint32_t i = 0; i < m->n_pairs; i++) {
        rows(f, &m->pairs[i], name, i);
        flanges(f, &m->pairs[i], name, i);
    }
    fprintf(f, "static const struct kl_pair %s_pairs[] = {\n", name);
    for (uint32_t i = 0; i < m->n_pairs; i++) {
        const struct kl_pair *p = &m->pairs[i];
        fputs("    {.side = {\n", f);
        for (int s = 0; s < KL_SIDES; s++) {
            fprintf(f, "         {.rows = %s_rows_%" PRIu32 "_%s,\n", name, i,
                    s == KL_RIGHT ? "right" : "left");
            jumps(f, &p->side[s]);
        }
        fputs("     },\n     .flange = {\n", f);
        for (int s = 0; s < KL_SIDES; s++) {
            fprintf(f, "         {.rows = %s_flange_%" PRIu32 "_%s, .n_rows = %" PRIu32 ", ", name,
                    i, s == KL_RIGHT ? "right" : "left", p->flange[s].n_rows);
            field(f, "top_m", p->flange[s].top_m);
            fputs("},\n", f);
        }
        fprintf(f, "     },\n     .half = %" PRIu32 ", ", p->half);
        FIELDS(f, "\n     ", OF(p, step_m), OF(p, inv_step_1_m), OF(p, range_m), OF(p, base_m),
               OF(p, inv_base_1_m));
        fputs("\n     .share = ", f);
        reals(f, p->share, KL_SIDES);
        fputs(", .tread_end = ", f);
        reals(f, p->tread_end, KL_SIDES);
        fputs(",\n     .central_tan = ", f);
        reals(f, p->central_tan, KL_SIDES);
        fputs(", ", f);
        FIELDS(f, "\n     ", OF(p, gives), OF(p, radius_m), OF(p, flange_stiffness_N_m),
               OF(p, flange_damping_Ns_m));
        fprintf(f, ".law = %s, .n_shapes = %" PRIu32, law_name[p->law], p->n_shapes);
        fputs("},\n", f);
    }
    fputs("};\n\n", f);
}

static void suspension(FILE *f, const struct kl_model *m, const char *name) {
    const struct kl_suspension *s = &m->suspension;
    words(f, name, "twins", s->twins, 3 * kl_count_twins(s));
    if (s->n_entries == 0) { /* arrays all the same: kl_model_check wants no NULL */
        fprintf(f, "static const uint16_t %s_place[] = {0};\n", name);
        fprintf(f, "static const struct kl_spring %s_spring[] = {{0, 0}};\n\n", name);
        return;
    }
    words(f, name, "place", s->place, s->n_entries);
    fprintf(f, "static const struct kl_spring %s_spring[] = {\n", name);
    for (uint32_t i = 0; i < 2 * s->n_entries; i++) {
        fputs("    {", f);
        real(f, s->spring[i].k);
        fputs(", ", f);
        real(f, s->spring[i].c);
        fputs("},\n", f);
    }
    fputs("};\n\n", f);
}

static void slips(FILE *f, const struct kl_struts *s, const char *name) {
    fprintf(f, "static const struct kl_slip %s_slip[] = {\n", name);
    for (uint32_t i = 0; i < s->n_slips; i++) {
        const struct kl_slip *slip = &s->slip[i];
        fputs("    {", f);
        FIELDS(f, "\n     ", OF(slip, k), OF(slip, inv_c), OF(slip, most_m), OF(slip, gain),
               OF(slip, carry));
        fputs("},\n", f);
    }
    fputs("};\n", f);
}

static void bends(FILE *f, const struct kl_struts *s, const char *name) {
    words(f, name, "bend_start", s->bend_start, 2 * (size_t)(s->n_stops + s->n_dampers) + 1);
    fprintf(f, "static const struct kl_bend %s_bend[] = {\n", name);
    for (uint32_t i = 0; i < s->n_bends; i++) {
        fputs("    {", f);
        FIELDS(f, "\n     ", OF(&s->bend[i], at), OF(&s->bend[i], slope));
        fputs("},\n", f);
    }
    fputs(s->n_bends > 0 ? "};\n" : "    {0}};\n", f);
}

static void struts(FILE *f, const struct kl_model *m, const char *name) {
    const struct kl_struts *s = &m->struts;
    if (kl_count_struts(s) == 0) {
        return;
    }
    words(f, name, "term_start", s->term_start, kl_count_struts(s) + 1);
    words(f, name, "term_column", s->column, s->n_terms);
    fprintf(f, "static const kl_real %s_term_factor[] = ", name);
    reals(f, s->factor, s->n_terms);
    fputs(";\n", f);
    if (s->n_slips > 0) {
        slips(f, s, name);
    }
    if (s->n_stops + s->n_dampers > 0) {
        bends(f, s, name);
    }
    if (s->n_actuators > 0) {
        words(f, name, "actuator_input", s->input, s->n_actuators);
    }
    fputc('\n', f);
}

static void pieces(FILE *f, const struct kl_track *t, const char *name) {
    if (t->n_pieces > 0) {
        fprintf(f, "static const struct kl_piece %s_piece[] = {\n", name);
    }
    for (uint32_t i = 0; t->n_pieces > 0 && i < t->n_pieces + 2; i++) {
        const struct kl_piece *piece = &t->piece[i];
        fputs("    {", f);
        FIELDS(f, "\n     ", OF(piece, start_m), OF(piece, path_x_m), OF(piece, path_y_m));
        fputs(".power = {", f);
        for (int k = 0; k < KL_LAYOUT_POWERS; k++) {
            fputs("\n      ", f);
            reals(f, &piece->power[k].curvature, 4);
            fputc(',', f);
        }
        fputs("},\n     .cant_power = {", f);
        for (int k = 0; k < KL_CANT_POWERS; k++) {
            reals(f, &piece->cant_power[k].first, 2);
            fputs(k + 1 < KL_CANT_POWERS ? ", " : "}},\n", f);
        }
    }
    fputs(t->n_pieces > 0 ? "};\n" : "", f);
    if (t->n_bins > 0) {
        words(f, name, "bin", t->bin, t->n_bins);
    }
    fputc('\n', f);
}

static void irregularities(FILE *f, const struct kl_track *t, const char *name) {
    if (t->irregularity == NULL) {
        return;
    }
    fprintf(f, "static const struct kl_irregularity_row %s_irregularity[] = {\n", name);
    for (uint32_t i = 0; i < t->n_samples + 2; i++) {
        const struct kl_irregularity_row *row = &t->irregularity[i];
        const kl_real values[4] = {row->lateral_m, row->vertical_m, row->cross_rad, row->gauge_m};
        fputs("    ", f);
        reals(f, values, 4);
        fputs(",\n", f);
    }
    fputs("};\n\n", f);
}

/* ---- the model ---- */

static void track_fields(FILE *f, const struct kl_track *t, const char *name) {
    fprintf(f, "    .track = {.n_pieces = %" PRIu32 ", .n_bins = %" PRIu32 ",", t->n_pieces,
            t->n_bins);
    if (t->n_pieces > 0) {
        fprintf(f, " .piece = %s_piece,", name);
    }
    if (t->n_bins > 0) {
        fprintf(f, " .bin = %s_bin,", name);
    }
    if (t->irregularity != NULL) {
        fprintf(f, " .irregularity = %s_irregularity,", name);
    }
    fprintf(f, "\n              .n_samples = %" PRIu32 ", ", t->n_samples);
    FIELDS(f, "\n              ", OF(t, inv_bin_1_m), OF(t, start_m), OF(t, step_m),
           OF(t, inv_step_1_m));
    fputs("},\n", f);
}

static void suspension_fields(FILE *f, const struct kl_suspension *s, const char *name) {
    fprintf(f,
            "    .suspension = {.n_coordinates = %" PRIu32 ", .n_entries = %" PRIu32
            ", .twins = %s_twins,\n"
            "                   .place = %s_place, .spring = %s_spring},\n",
            s->n_coordinates, s->n_entries, name, name, name);
}

static void strut_fields(FILE *f, const struct kl_struts *s, const char *name) {
    if (kl_count_struts(s) == 0) {
        return;
    }
    fprintf(f,
            "    .struts = {.n_slips = %" PRIu32 ", .n_stops = %" PRIu32 ", .n_dampers = %" PRIu32
            ", .n_actuators = %" PRIu32 ",\n               .n_terms = %" PRIu32
            ", .n_bends = %" PRIu32 ", .term_start = %s_term_start,\n"
            "               .column = %s_term_column, .factor = %s_term_factor",
            s->n_slips, s->n_stops, s->n_dampers, s->n_actuators, s->n_terms, s->n_bends, name,
            name, name);
    if (s->n_slips > 0) {
        fprintf(f, ",\n               .slip = %s_slip", name);
    }
    if (s->n_stops + s->n_dampers > 0) {
        fprintf(f, ",\n               .bend_start = %s_bend_start, .bend = %s_bend", name, name);
    }
    if (s->n_actuators > 0) {
        fprintf(f, ",\n               .input = %s_actuator_input", name);
    }
    fputs("},\n", f);
}

static void definition(FILE *f, const struct kl_model *m, const char *name) {
    fprintf(f, "extern const struct kl_model %s;\nconst struct kl_model %s = {\n", name, name);
    fprintf(f,
            "    .version = %" PRIu32 ", .real_bytes = %" PRIu32 ", .name = \"%s\",\n"
            "    .step_ns = INT64_C(%" PRId64 "), ",
            m->version, m->real_bytes, m->name, m->step_ns);
    FIELDS(f, "\n    ", OF(m, step_s), OF(m, gravity_m_s2), OF(m, acceleration_limit_m_s2));
    if (m->running.free != 0) {
        const struct kl_running *r = &m->running;
        fprintf(f, "\n    .running = {.free = %" PRIu32 ", ", r->free);
        FIELDS(f, "\n                ", OF(r, mass_kg), OF(r, rolling_kg), OF(r, resistance_N),
               OF(r, resistance_Ns_m), OF(r, resistance_Ns2_m2));
        fputs("},", f);
    }
    fprintf(f,
            "\n    .n_bodies = %" PRIu32 ", .n_wheelsets = %" PRIu32 ", .n_pairs = %" PRIu32
            ",\n    .n_rails = %" PRIu32 ", .n_twists = %" PRIu32 ", .n_states = %" PRIu32
            ",\n    ",
            m->n_bodies, m->n_wheelsets, m->n_pairs, m->n_rails, m->n_twists, m->n_states);
    if (m->n_bodies > 0) {
        fprintf(f, ".bodies = %s_bodies, ", name);
    }
    fprintf(f, ".wheelsets = %s_wheelsets, .pairs = %s_pairs,\n", name, name);
    suspension_fields(f, &m->suspension, name);
    strut_fields(f, &m->struts, name);
    track_fields(f, &m->track, name);
    if (m->creep_table != NULL) {
        fprintf(f, "    .creep_table = &%s_creep_table,\n", name);
    }
    fprintf(f, "    .hash = UINT64_C(0x%016" PRIx64 ")};\n", m->hash);
}

static void head(FILE *f, const struct kl_model *m, const char *name) {
    fprintf(f,
            "/* Model \"%s\", written by klingel build; not to be edited. State %u values, "
            "constant data about %zu bytes. */\n"
            "#include \"klingel.h\"\n\n"
            "#if KL_MODEL_VERSION != %" PRIu32 "u\n"
            "#error \"%s belongs to another version of the core: build it again\"\n#endif\n"
            "#if KL_MAX_BODIES < %" PRIu32 " || KL_MAX_WHEELSETS < %" PRIu32
            " || KL_MAX_SLIPS < %" PRIu32 "\n"
            "#error \"%s needs larger KL_MAX_BODIES, KL_MAX_WHEELSETS or KL_MAX_SLIPS\"\n#endif\n"
            "_Static_assert(sizeof(kl_real) == %zu, \"%s was built for another real type\");\n\n",
            m->name, (unsigned)m->n_states, emit_model_bytes(m), m->version, name, m->n_bodies,
            m->n_wheelsets, m->struts.n_slips, name, sizeof(kl_real), name);
}

void emit_model(FILE *file, const struct kl_model *model, const char *name) {
    head(file, model, name);
    bodies(file, model, name);
    wheelsets(file, model, name);
    pairs(file, model, name);
    suspension(file, model, name);
    struts(file, model, name);
    pieces(file, &model->track, name);
    irregularities(file, &model->track, name);
    if (model->creep_table != NULL) {
        char table[KL_NAME_SIZE + 16];
        snprintf(table, sizeof table, "%.*s_creep_table", KL_NAME_SIZE, name);
        emit_creep_table(file, model->creep_table, table, true);
    }
    definition(file, model, name);
}

size_t emit_model_bytes(const struct kl_model *m) {
    const struct kl_suspension *s = &m->suspension;
    size_t bytes =
        sizeof *m + m->n_bodies * sizeof *m->bodies + m->n_wheelsets * sizeof *m->wheelsets +
        m->n_pairs * sizeof *m->pairs + (3 * kl_count_twins(s) + s->n_entries) * sizeof(uint16_t) +
        2 * s->n_entries * sizeof(struct kl_spring) +
        (m->track.n_pieces + 2) * sizeof(struct kl_piece) + m->track.n_bins * sizeof(uint16_t);
    const struct kl_struts *struts = &m->struts;
    bytes += (kl_count_struts(struts) + struts->n_terms + struts->n_actuators) * sizeof(uint16_t) +
             struts->n_terms * sizeof(kl_real) + struts->n_slips * sizeof(struct kl_slip) +
             struts->n_bends * sizeof(struct kl_bend);
    for (uint32_t i = 0; i < m->n_pairs; i++) {
        const struct kl_flange_table *flange = m->pairs[i].flange;
        bytes += KL_SIDES * (2 * m->pairs[i].half + 1) * sizeof(struct kl_row) +
                 (flange[KL_RIGHT].n_rows + flange[KL_LEFT].n_rows) * sizeof *flange->rows;
    }
    bytes += m->creep_table != NULL ? kl_creep_table_bytes(m->creep_table) : 0;
    return bytes + (m->track.irregularity != NULL
                        ? (m->track.n_samples + 2) * sizeof(struct kl_irregularity_row)
                        : 0);
}
