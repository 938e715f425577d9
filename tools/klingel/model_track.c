/* model_track.c - track.yaml to kl_track_def: curvature, cant, irregularities. */
#include <math.h>
#include <string.h>

#include "kl_math.h" /* kl_atan: the same bits on every host, which libm does not promise */
#include "model_convert.h"
#include "model_table.h"

#define USUAL_CANT_BASE_M 1.5
#define MAX_CURVATURE_1_M 0.02
#define MAX_CANT_RAD 0.3
#define MIN_SAMPLES 4u
#define MAX_SAMPLES 1000000u

/* ERRI B176 (ORE B176/RP1), one-sided spectra: A of lateral and of vertical, m2 rad/m. */
static const double erri_lateral[] = {2.119e-7, 6.125e-7};
static const double erri_vertical[] = {4.032e-7, 1.080e-6};

/* What stands under one of two keys that mean the same, in SI. */
struct choice {
    bool given;
    double value;
};

static struct choice curvature(struct model_parts *parts, const double *curvature_1_m,
                               const double *radius_m, const char *key, const char *prefix) {
    struct choice result = {curvature_1_m != NULL || radius_m != NULL, 0.0};
    if (curvature_1_m != NULL && radius_m != NULL) {
        model_check(parts, false, "either a curvature or a radius, not both", "%s.%sradius_m", key,
                    prefix);
    } else if (curvature_1_m != NULL) {
        model_check(parts, kl_abs(*curvature_1_m) < MAX_CURVATURE_1_M,
                    "must be between -0.02 and 0.02", "%s.%scurvature_1_m", key, prefix);
        result.value = *curvature_1_m;
    } else if (radius_m != NULL) {
        bool ok = model_check(parts, kl_abs(*radius_m) > 1.0 / MAX_CURVATURE_1_M,
                              "must be above 50 (right-hand) or below -50 (left-hand)",
                              "%s.%sradius_m", key, prefix);
        result.value = ok ? 1.0 / *radius_m : 0.0;
    }
    return result;
}

/* Cant in mm is measured over the cant base along the canted rails' tops: an arc sine. */
static double cant_angle(double cant_mm, double base_m) {
    double sine = cant_mm / 1000.0 / base_m;
    return kl_atan(sine / kl_sqrt(1.0 - sine * sine));
}

static struct choice cant(struct model_parts *parts, const double *cant_rad, const double *cant_mm,
                          double base_m, const char *key, const char *prefix) {
    struct choice result = {cant_rad != NULL || cant_mm != NULL, 0.0};
    if (cant_rad != NULL && cant_mm != NULL) {
        model_check(parts, false, "either cant_rad or cant_mm, not both", "%s.%scant_mm", key,
                    prefix);
    } else if (cant_rad != NULL) {
        model_check(parts, kl_abs(*cant_rad) < MAX_CANT_RAD, "must be between -0.3 and 0.3",
                    "%s.%scant_rad", key, prefix);
        result.value = *cant_rad;
    } else if (cant_mm != NULL) {
        bool ok = kl_abs(*cant_mm) < 1000.0 * base_m * 0.29;
        ok = model_check(parts, ok, "must be less than 0.29 of the cant base, to either side",
                         "%s.%scant_mm", key, prefix);
        result.value = ok ? cant_angle(*cant_mm, base_m) : 0.0;
    }
    return result;
}

static void segment_ramp(struct kl_ramp_def *ramp, const struct raw_segment *raw,
                         struct choice to) {
    ramp->shape = to.given ? (enum kl_ramp_shape)raw->shape : KL_RAMP_CONSTANT;
    ramp->length_m = raw->length_m;
    ramp->to = to.value;
}

/* One segment into one ramp of curvature (NULL in cant_segments) and one of cant (NULL in segments
 * where cant has its own list). */
static void segment(struct model_parts *parts, const struct raw_segment *raw, double base_m,
                    const char *key, struct kl_ramp_def *curve_ramp,
                    struct kl_ramp_def *cant_ramp) {
    struct choice to_curvature =
        curvature(parts, raw->to_curvature_1_m, raw->to_radius_m, key, "to_");
    struct choice to_cant = cant(parts, raw->to_cant_rad, raw->to_cant_mm, base_m, key, "to_");
    model_check(parts, raw->length_m >= 0.001 && raw->length_m <= 1e6, "must be 0.001 to 1e6",
                "%s.length_m", key);
    if (raw->shape == KL_RAMP_CONSTANT) {
        model_check(parts, !to_curvature.given && !to_cant.given,
                    "a constant segment keeps its values: no to_... here", "%s.shape", key);
    } else {
        model_check(parts, to_curvature.given || to_cant.given,
                    curve_ramp == NULL ? "needs to_cant_mm or to_cant_rad"
                                       : "needs where it leads: to_radius_m, to_curvature_1_m, "
                                         "to_cant_mm or to_cant_rad",
                    "%s", key);
    }
    if (curve_ramp != NULL) {
        segment_ramp(curve_ramp, raw, to_curvature);
        model_check(parts, cant_ramp != NULL || !to_cant.given,
                    "cant stands in cant_segments already", "%s", key);
    }
    if (cant_ramp != NULL) {
        segment_ramp(cant_ramp, raw, to_cant);
    }
}

static double cant_base(struct model_parts *parts, const struct raw_track *raw) {
    if (raw->cant_base_m == NULL) {
        return USUAL_CANT_BASE_M;
    }
    bool ok = model_check(parts, *raw->cant_base_m >= 0.3 && *raw->cant_base_m <= 3.0,
                          "must be 0.3 to 3", "cant_base_m");
    return ok ? *raw->cant_base_m : USUAL_CANT_BASE_M;
}

static void alignment(struct model_parts *parts, const struct raw_track *raw,
                      struct kl_track_def *def, double *length_m) {
    double base_m = cant_base(parts, raw);
    bool own_cant = raw->n_cant_segments > 0;
    uint32_t n_cant = own_cant ? raw->n_cant_segments : raw->n_segments;
    struct kl_ramp_def *curve = model_take(parts, raw->n_segments + 1u, sizeof *curve);
    struct kl_ramp_def *cants = model_take(parts, n_cant + 1u, sizeof *cants);
    if (curve == NULL || cants == NULL) {
        return;
    }
    if (raw->start != NULL) {
        const struct raw_start *start = raw->start;
        def->curvature_start_1_m =
            curvature(parts, start->curvature_1_m, start->radius_m, "start", "").value;
        def->cant_start_rad =
            cant(parts, start->cant_rad, start->cant_mm, base_m, "start", "").value;
    }
    char key[64];
    double end_m[2] = {0.0, 0.0};
    for (uint32_t i = 0; i < raw->n_segments; i++) {
        snprintf(key, sizeof key, "segments[%u]", i);
        segment(parts, &raw->segments[i], base_m, key, &curve[i], own_cant ? NULL : &cants[i]);
        end_m[0] += raw->segments[i].length_m;
    }
    for (uint32_t i = 0; i < raw->n_cant_segments; i++) {
        snprintf(key, sizeof key, "cant_segments[%u]", i);
        segment(parts, &raw->cant_segments[i], base_m, key, NULL, &cants[i]);
        end_m[1] += raw->cant_segments[i].length_m;
    }
    def->n_curvature = raw->n_segments;
    def->curvature = curve;
    def->n_cant = n_cant;
    def->cant = cants;
    *length_m = end_m[0] > end_m[1] ? end_m[0] : end_m[1];
}

/* ---- irregularities ---- */

static void sampled(struct model_parts *parts, const char *file, struct kl_irregularity_def *def) {
    static const struct model_column columns[5] = {{"s", "m", "mm", true},
                                                   {"lateral", "m", "mm", false},
                                                   {"vertical", "m", "mm", false},
                                                   {"cross", "rad", "mrad", false},
                                                   {"gauge", "m", "mm", false}};
    static const char key[] = "irregularities.samples";
    struct model_table table;
    if (model_table_read(parts, key, file, columns, 5, &table) != 0) {
        return;
    }
    if (table.n_rows < MIN_SAMPLES) {
        model_error(parts, key, "the file holds %u samples, must be %u or more", table.n_rows,
                    MIN_SAMPLES);
        return;
    }
    const double *s = table.column[0];
    double step = (s[table.n_rows - 1] - s[0]) / (table.n_rows - 1u);
    for (uint32_t i = 1; i < table.n_rows; i++) {
        if (!(s[i] > s[i - 1]) || fabs(s[i] - s[0] - i * step) > 0.01 * step) {
            model_table_error(parts, &table, i, "s must grow by equal steps, within 1 %");
            break;
        }
    }
    def->n_samples = table.n_rows;
    def->start_m = s[0];
    def->step_m = step;
    def->lateral_m = table.column[1];
    def->vertical_m = table.column[2];
    def->cross_rad = table.column[3];
    def->gauge_m = table.column[4];
}

static double amplitude(struct model_parts *parts, const double *own, const char *name) {
    if (own != NULL) {
        model_not_negative(parts, *own, "irregularities.spectrum.%s", name);
    }
    return own != NULL ? *own : 0.0;
}

static void spectrum_amplitudes(struct model_parts *parts, const struct raw_spectrum *raw,
                                struct kl_spectrum_def *def) {
    bool own = raw->lateral_A_m2rad_m != NULL || raw->vertical_A_m2rad_m != NULL ||
               raw->cross_A_m2rad_m != NULL;
    model_check(parts, own != (raw->level != NULL),
                "needs either level, or at least one of lateral_A_m2rad_m, vertical_A_m2rad_m, "
                "cross_A_m2rad_m",
                "irregularities.spectrum");
    if (raw->level != NULL) {
        def->lateral_A = erri_lateral[*raw->level];
        def->vertical_A = erri_vertical[*raw->level];
        def->cross_A = erri_vertical[*raw->level];
    } else {
        def->lateral_A = amplitude(parts, raw->lateral_A_m2rad_m, "lateral_A_m2rad_m");
        def->vertical_A = amplitude(parts, raw->vertical_A_m2rad_m, "vertical_A_m2rad_m");
        def->cross_A = amplitude(parts, raw->cross_A_m2rad_m, "cross_A_m2rad_m");
    }
}

static bool spectrum_numbers(struct model_parts *parts, const struct raw_spectrum *raw) {
    static const char key[] = "irregularities.spectrum";
    unsigned before = parts->n_errors;
    model_check(parts, raw->waves >= 1 && raw->waves <= 4096, "must be 1 to 4096", "%s.waves", key);
    if (model_positive(parts, raw->step_m, "%s.step_m", key)) {
        model_check(parts, raw->shortest_m > 2.0 * raw->step_m, "must be above two steps of step_m",
                    "%s.shortest_m", key);
        double samples = raw->length_m / raw->step_m + 1.0;
        model_check(parts, samples >= MIN_SAMPLES && samples <= MAX_SAMPLES,
                    "must be 3 to 999999 steps of step_m", "%s.length_m", key);
    }
    model_check(parts, raw->longest_m > raw->shortest_m, "must be above shortest_m", "%s.longest_m",
                key);
    model_check(parts, raw->taper_m >= 0.0 && 2.0 * raw->taper_m <= raw->length_m,
                "must be >= 0 and at most half of length_m", "%s.taper_m", key);
    return parts->n_errors == before;
}

static void synthesised(struct model_parts *parts, const struct raw_spectrum *raw,
                        struct kl_irregularity_def *def) {
    struct kl_spectrum_def spectrum = {0};
    unsigned before = parts->n_errors;
    spectrum_amplitudes(parts, raw, &spectrum);
    if (!spectrum_numbers(parts, raw) || parts->n_errors != before) {
        return;
    }
    spectrum.shortest_m = raw->shortest_m;
    spectrum.longest_m = raw->longest_m;
    spectrum.taper_m = raw->taper_m;
    spectrum.n_waves = raw->waves;
    spectrum.seed = raw->seed;
    uint32_t n = (uint32_t)(raw->length_m / raw->step_m + 1e-6) + 1u;
    double *lateral = model_take(parts, n, sizeof *lateral);
    double *vertical = model_take(parts, n, sizeof *vertical);
    double *cross = model_take(parts, n, sizeof *cross);
    if (lateral == NULL || vertical == NULL || cross == NULL) {
        return;
    }
    enum kl_status status =
        kl_spectrum_synthesise(&spectrum, raw->step_m, n, lateral, vertical, cross);
    model_check(parts, status == KL_OK, kl_status_text(status), "irregularities.spectrum");
    def->n_samples = n;
    def->start_m = raw->start_m;
    def->step_m = raw->step_m;
    def->lateral_m = spectrum.lateral_A > 0.0 ? lateral : NULL;
    def->vertical_m = spectrum.vertical_A > 0.0 ? vertical : NULL;
    def->cross_rad = spectrum.cross_A > 0.0 ? cross : NULL;
}

static void irregularities(struct model_parts *parts, const struct raw_irregularities *raw,
                           struct kl_irregularity_def *def) {
    bool one = (raw->samples != NULL) != (raw->spectrum != NULL);
    if (!model_check(parts, one, "needs exactly one of samples, spectrum", "irregularities")) {
        return;
    }
    if (raw->samples != NULL) {
        sampled(parts, raw->samples, def);
    } else {
        synthesised(parts, raw->spectrum, def);
    }
}

int model_track_convert(struct model_parts *parts, struct kl_track_def *def,
                        char name[KL_NAME_SIZE], double *length_m) {
    struct raw_track *raw = model_source_load(parts, &raw_track_schema);
    if (raw == NULL) {
        return -1;
    }
    memset(def, 0, sizeof *def);
    memcpy(name, raw->name, KL_NAME_SIZE);
    model_check_title(parts, raw->name);
    alignment(parts, raw, def, length_m);
    if (raw->irregularities != NULL) {
        irregularities(parts, raw->irregularities, &def->irregularity);
    }
    model_source_unload(&raw_track_schema, raw);
    return parts->n_errors == 0 ? 0 : -1;
}
