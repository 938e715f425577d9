/* model_pair.c - wheel-rail pairs: profiles, where they sit, and the table made of them. */
#include "kl_math.h" /* kl_atan: the same bits on every host, which libm does not promise */
#include "model_convert.h"
#include "model_table.h"

#define STEEL_SHEAR_MODULUS_PA 82e9
#define STEEL_POISSON 0.28
#define USUAL_GAUGE_DEPTH_M 0.014

static void points_profile(struct model_parts *parts, const char *file, const char *key,
                           struct kl_profile_def *def) {
    static const struct model_column columns[2] = {{"eta", "m", "mm", true},
                                                   {"zeta", "m", "mm", true}};
    char path[MODEL_PATH_SIZE];
    snprintf(path, sizeof path, "%s.profile.points", key);
    struct model_table table;
    if (model_table_read(parts, path, file, columns, 2, &table) != 0) {
        return;
    }
    if (table.n_rows < KL_PROFILE_MIN_POINTS || table.n_rows > KL_PROFILE_MAX_POINTS) {
        model_error(parts, path, "the file holds %u points, must be %d to %d", table.n_rows,
                    KL_PROFILE_MIN_POINTS, KL_PROFILE_MAX_POINTS);
    }
    for (uint32_t i = 1; i < table.n_rows; i++) {
        if (!(table.column[0][i] > table.column[0][i - 1])) {
            model_table_error(parts, &table, i, "eta must grow from point to point");
            break;
        }
    }
    def->kind = KL_PROFILE_POINTS;
    def->n_points = table.n_rows;
    def->eta_m = table.column[0];
    def->zeta_m = table.column[1];
}

static void profile(struct model_parts *parts, const struct raw_profile *raw, const char *key,
                    struct kl_profile_def *def) {
    int kinds = (raw->points != NULL) + (raw->arc != NULL) + (raw->cone != NULL);
    if (!model_check(parts, kinds == 1, "needs exactly one of points, arc, cone", "%s.profile",
                     key)) {
        return;
    }
    if (raw->points != NULL) {
        points_profile(parts, raw->points, key, def);
        return;
    }
    const char *kind = raw->arc != NULL ? "arc" : "cone";
    double radius = raw->arc != NULL ? raw->arc->radius_m : 0.0;
    double slope = raw->arc != NULL ? raw->arc->slope_rad : raw->cone->slope_rad;
    double half = raw->arc != NULL ? raw->arc->half_width_m : raw->cone->half_width_m;
    if (raw->arc != NULL) {
        model_positive(parts, radius, "%s.profile.arc.radius_m", key);
        model_check(parts, half < radius, "must be below radius_m", "%s.profile.arc.half_width_m",
                    key);
    }
    model_check(parts, slope > -0.5 && slope < 0.5, "must be between -0.5 and 0.5",
                "%s.profile.%s.slope_rad", key, kind);
    model_check(parts, half > 0.0 && half < 1.0, "must be > 0 and < 1",
                "%s.profile.%s.half_width_m", key, kind);
    def->kind = KL_PROFILE_ARC;
    def->radius_m = radius;
    def->slope_rad = slope;
    def->half_width_m = half;
}

static void wheel(struct model_parts *parts, const struct raw_wheel *raw, const char *key,
                  struct kl_wheel_def *def) {
    profile(parts, &raw->profile, key, &def->profile);
    model_positive(parts, raw->radius_m, "%s.radius_m", key);
    model_positive(parts, raw->half_spacing_m, "%s.half_spacing_m", key);
    def->radius_m = raw->radius_m;
    def->half_spacing_m = raw->half_spacing_m;
}

static double rail_cant(struct model_parts *parts, const struct raw_rail *raw, const char *key) {
    if (raw->cant_rad != NULL && raw->cant_1_in != NULL) {
        model_check(parts, false, "either cant_rad or cant_1_in, not both", "%s.cant_1_in", key);
        return 0.0;
    }
    if (raw->cant_1_in != NULL) {
        double n = *raw->cant_1_in;
        bool ok = model_check(parts, n >= 2.0 || n <= -2.0,
                              "must be 2 or more (1:n), or -2 or less", "%s.cant_1_in", key);
        return ok ? kl_atan(1.0 / n) : 0.0;
    }
    if (raw->cant_rad != NULL) {
        model_check(parts, kl_abs(*raw->cant_rad) < 0.5, "must be between -0.5 and 0.5",
                    "%s.cant_rad", key);
        return *raw->cant_rad;
    }
    return 0.0;
}

static void rail(struct model_parts *parts, const struct raw_rail *raw, const char *key,
                 struct kl_rail_def *def) {
    profile(parts, &raw->profile, key, &def->profile);
    def->cant_rad = rail_cant(parts, raw, key);
    bool by_gauge = raw->gauge_m != NULL;
    if (!model_check(parts, by_gauge != (raw->half_spacing_m != NULL),
                     "needs either gauge_m or half_spacing_m", "%s", key)) {
        return;
    }
    if (by_gauge) {
        double depth = raw->gauge_depth_m != NULL ? *raw->gauge_depth_m : USUAL_GAUGE_DEPTH_M;
        model_positive(parts, *raw->gauge_m, "%s.gauge_m", key);
        model_check(parts, depth > 0.0 && depth < 0.1, "must be > 0 and < 0.1", "%s.gauge_depth_m",
                    key);
        def->gauge_m = *raw->gauge_m;
        def->gauge_depth_m = depth;
    } else {
        model_check(parts, raw->gauge_depth_m == NULL, "goes with gauge_m only", "%s.gauge_depth_m",
                    key);
        model_positive(parts, *raw->half_spacing_m, "%s.half_spacing_m", key);
        def->half_spacing_m = *raw->half_spacing_m;
    }
}

/* "wheel" for both sides, or "wheel_right" and "wheel_left"; `what` says so where it is neither. */
static bool two_sides(struct model_parts *parts, uint32_t i, const char *what, const void *both,
                      const void *right, const void *left) {
    bool ok = both != NULL ? right == NULL && left == NULL : right != NULL && left != NULL;
    char text[80];
    snprintf(text, sizeof text, "needs either %s, or %s_right and %s_left", what, what, what);
    return model_check(parts, ok, text, "pairs[%u]", i);
}

static void profile_pair(struct model_parts *parts, const struct raw_pair *raw, uint32_t i,
                         struct kl_pair_def *def) {
    static const char *const side_name[KL_SIDES] = {"_right", "_left"};
    bool wheels = two_sides(parts, i, "wheel", raw->wheel, raw->wheel_right, raw->wheel_left);
    bool rails = two_sides(parts, i, "rail", raw->rail, raw->rail_right, raw->rail_left);
    const struct raw_wheel *wheel_of[KL_SIDES] = {raw->wheel_right, raw->wheel_left};
    const struct raw_rail *rail_of[KL_SIDES] = {raw->rail_right, raw->rail_left};
    char key[64];
    def->kind = KL_PAIR_PROFILES;
    def->kinematics =
        raw->kinematics != NULL ? (enum kl_kinematics) * raw->kinematics : KL_KINEMATICS_RIGID;
    for (int side = 0; side < KL_SIDES && wheels; side++) {
        if (raw->wheel != NULL && side == KL_LEFT) {
            def->wheel[KL_LEFT] = def->wheel[KL_RIGHT];
            break;
        }
        snprintf(key, sizeof key, "pairs[%u].wheel%s", i,
                 raw->wheel != NULL ? "" : side_name[side]);
        wheel(parts, raw->wheel != NULL ? raw->wheel : wheel_of[side], key, &def->wheel[side]);
    }
    for (int side = 0; side < KL_SIDES && rails; side++) {
        if (raw->rail != NULL && side == KL_LEFT) {
            def->rail[KL_LEFT] = def->rail[KL_RIGHT];
            break;
        }
        snprintf(key, sizeof key, "pairs[%u].rail%s", i, raw->rail != NULL ? "" : side_name[side]);
        rail(parts, raw->rail != NULL ? raw->rail : rail_of[side], key, &def->rail[side]);
    }
}

static void linear_pair(struct model_parts *parts, const struct raw_linear *raw, uint32_t i,
                        struct kl_pair_def *def) {
    model_positive(parts, raw->radius_m, "pairs[%u].linear.radius_m", i);
    model_positive(parts, raw->half_base_m, "pairs[%u].linear.half_base_m", i);
    model_positive(parts, raw->curvature_1_m, "pairs[%u].linear.curvature_1_m", i);
    model_check(parts, kl_abs(raw->conicity) < 1.0, "must be between -1 and 1",
                "pairs[%u].linear.conicity", i);
    def->kind = KL_PAIR_LINEAR;
    def->radius_m = raw->radius_m;
    def->half_base_m = raw->half_base_m;
    def->conicity = raw->conicity;
    def->curvature_1_m = raw->curvature_1_m;
}

static void pair_table(struct model_parts *parts, const struct raw_pair *raw, uint32_t i,
                       struct kl_pair_def *def) {
    struct raw_material steel = {STEEL_SHEAR_MODULUS_PA, STEEL_POISSON};
    const struct raw_material *material = raw->material != NULL ? raw->material : &steel;
    model_positive(parts, material->shear_modulus_Pa, "pairs[%u].material.shear_modulus_Pa", i);
    model_check(parts, material->poisson >= 0.0 && material->poisson <= 0.5, "must be 0 to 0.5",
                "pairs[%u].material.poisson", i);
    def->material.shear_modulus_Pa = material->shear_modulus_Pa;
    def->material.poisson = material->poisson;
    bool step = model_check(parts, raw->step_m >= 1e-5 && raw->step_m <= 1e-3,
                            "must be 1e-5 to 1e-3", "pairs[%u].step_m", i);
    double steps = step ? raw->range_m / raw->step_m : 4.0;
    char what[64];
    snprintf(what, sizeof what, "must be 4 to %d steps of step_m", KL_TABLE_MAX_HALF);
    /* a range of exactly that many steps must not fail by its last bit */
    model_check(parts, steps >= 4.0 - 1e-9 && steps <= KL_TABLE_MAX_HALF * (1.0 + 1e-12), what,
                "pairs[%u].range_m", i);
    def->step_m = raw->step_m;
    def->range_m = raw->range_m;
}

void model_pairs_convert(struct model_parts *parts, const struct raw_vehicle *raw,
                         struct kl_pair_def *pairs) {
    for (uint32_t i = 0; i < raw->n_pairs; i++) {
        const struct raw_pair *pair = &raw->pairs[i];
        model_check_name(parts, pair->name, "pairs[%u].name", i);
        bool with_profiles = pair->wheel != NULL || pair->wheel_right != NULL ||
                             pair->wheel_left != NULL || pair->rail != NULL ||
                             pair->rail_right != NULL || pair->rail_left != NULL ||
                             pair->kinematics != NULL;
        if (pair->linear == NULL) {
            profile_pair(parts, pair, i, &pairs[i]);
        } else if (model_check(parts, !with_profiles, "goes without wheel, rail and kinematics",
                               "pairs[%u].linear", i)) {
            linear_pair(parts, pair->linear, i, &pairs[i]);
        }
        pair_table(parts, pair, i, &pairs[i]);
    }
}
