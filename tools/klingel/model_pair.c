/* model_pair.c - wheel-rail pairs: profiles, where they sit, and the table made of them. */
#include "kl_math.h" /* kl_atan: the same bits on every host, which libm does not promise */
#include "model_convert.h"
#include "model_table.h"
#include "profile_file.h"

#define STEEL_SHEAR_MODULUS_PA 82e9
#define STEEL_POISSON 0.28
#define USUAL_GAUGE_DEPTH_M 0.014
#define USUAL_TAPE_CIRCLE_M 0.070

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
    for (uint32_t i = 1; i < table.n_rows && def->smoothing_m == 0.0; i++) {
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

/* Where a profile belongs, which its file may need to know. */
struct place {
    bool wheel;
    double tape_circle_m; /* of a wheel, from the flange back */
};

static bool is_from_flange(const struct raw_profile *raw) {
    return raw != NULL && raw->origin != NULL && *raw->origin == RAW_FLANGE_BACK;
}

static void file_profile(struct model_parts *parts, const struct raw_profile *raw,
                         const struct place *place, const char *key, struct kl_profile_def *def) {
    const bool from_flange = is_from_flange(raw);
    const struct profile_request request = {
        .name = raw->file,
        .wheel = place->wheel,
        .axes = raw->axes != NULL ? (enum profile_axes) * raw->axes : PROFILE_AXES_OF_FILE,
        .unit_m = raw->units == NULL          ? 0.0
                  : *raw->units == RAW_METRES ? 1.0
                                              : 1e-3,
        .flange_m = from_flange ? place->tape_circle_m : 0.0,
        .from_m = raw->from_mm != NULL ? *raw->from_mm / 1000.0 : -1.0,
        .to_m = raw->to_mm != NULL ? *raw->to_mm / 1000.0 : 1.0,
        .deepest_m = raw->deepest_mm != NULL ? *raw->deepest_mm / 1000.0 : 1.0,
        .smoothing_said = raw->smoothing_mm != NULL,
        .smoothing_m = def->smoothing_m};
    bool ok = model_check(parts, request.from_m < request.to_m, "must be above from_mm",
                          "%s.profile.to_mm", key);
    ok = model_check(parts, request.deepest_m > 0.0, "must be > 0", "%s.profile.deepest_mm", key) &&
         ok;
    ok = model_check(parts, place->wheel || raw->origin == NULL, "goes with a wheel",
                     "%s.profile.origin", key) &&
         ok;
    ok = model_check(parts, !place->wheel || raw->canted_1_in == NULL, "goes with a rail",
                     "%s.profile.canted_1_in", key) &&
         ok;
    char path[MODEL_PATH_SIZE];
    snprintf(path, sizeof path, "%s.profile.file", key);
    if (ok) {
        (void)profile_file_read(parts, path, &request, def);
    }
}

static void round_profile(struct model_parts *parts, const struct raw_profile *raw, const char *key,
                          struct kl_profile_def *def) {
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

/* Keys that say how to read a file, where there is none. */
static bool keys_belong(struct model_parts *parts, const struct raw_profile *raw, const char *key) {
    const struct {
        const char *name;
        bool there;
        bool belongs;
    } list[] = {
        {"smoothing_mm", raw->smoothing_mm != NULL, raw->file != NULL || raw->points != NULL},
        {"axes", raw->axes != NULL, raw->file != NULL},
        {"units", raw->units != NULL, raw->file != NULL},
        {"origin", raw->origin != NULL, raw->file != NULL},
        {"from_mm", raw->from_mm != NULL, raw->file != NULL},
        {"to_mm", raw->to_mm != NULL, raw->file != NULL},
        {"deepest_mm", raw->deepest_mm != NULL, raw->file != NULL},
        {"canted_1_in", raw->canted_1_in != NULL, raw->file != NULL}};
    bool ok = true;
    for (size_t i = 0; i < sizeof list / sizeof list[0]; i++) {
        ok = model_check(parts, !list[i].there || list[i].belongs,
                         i == 0 ? "goes with file or points" : "goes with file", "%s.profile.%s",
                         key, list[i].name) &&
             ok;
    }
    return ok;
}

static void profile(struct model_parts *parts, const struct raw_profile *raw,
                    const struct place *place, const char *key, struct kl_profile_def *def) {
    int kinds =
        (raw->points != NULL) + (raw->file != NULL) + (raw->arc != NULL) + (raw->cone != NULL);
    if (!model_check(parts, kinds == 1, "needs exactly one of file, points, arc, cone",
                     "%s.profile", key) ||
        !keys_belong(parts, raw, key)) {
        return;
    }
    const struct kl_profile_def blank = {0};
    *def = blank;
    if (raw->smoothing_mm != NULL) {
        const double mm = *raw->smoothing_mm;
        model_check(parts, mm == 0.0 || (mm >= 1e-4 && mm <= 1.0), "must be 0 or 0.0001 to 1",
                    "%s.profile.smoothing_mm", key);
        def->smoothing_m = mm / 1000.0;
    }
    if (raw->points != NULL) {
        points_profile(parts, raw->points, key, def);
    } else if (raw->file != NULL) {
        file_profile(parts, raw, place, key, def);
    } else {
        round_profile(parts, raw, key, def);
    }
}

/* ---- wheels ---- */

/* What a key of both sides may be left out for: each side has its own. */
static void needs(struct model_parts *parts, bool there, bool of_right, bool of_left,
                  const char *name, const char *key) {
    char text[100];
    snprintf(text, sizeof text, "%s is missing, here or in its right and left", name);
    model_check(parts, there || (of_right && of_left), text, "%s", key);
}

/* Half the distance of the tape circles, stated as it is or by the flange backs. */
static double wheel_spacing(struct model_parts *parts, const struct raw_wheel *raw, const char *key,
                            double tape_circle) {
    const bool by_flange = raw->flange_back_m != NULL;
    const bool from_flange = is_from_flange(raw->profile) ||
                             (raw->right != NULL && is_from_flange(raw->right->profile)) ||
                             (raw->left != NULL && is_from_flange(raw->left->profile));
    model_check(parts, raw->tape_circle_m == NULL || by_flange || from_flange,
                "goes with flange_back_m, or with a profile of origin: flange_back",
                "%s.tape_circle_m", key);
    model_check(parts, tape_circle > 0.0 && tape_circle < 0.2, "must be > 0 and < 0.2",
                "%s.tape_circle_m", key);
    if (!model_check(parts, by_flange != (raw->half_spacing_m != NULL),
                     "needs either flange_back_m or half_spacing_m", "%s", key)) {
        return 0.0;
    }
    if (by_flange) {
        model_positive(parts, *raw->flange_back_m, "%s.flange_back_m", key);
        return 0.5 * *raw->flange_back_m + tape_circle;
    }
    model_positive(parts, *raw->half_spacing_m, "%s.half_spacing_m", key);
    return *raw->half_spacing_m;
}

static void wheel(struct model_parts *parts, const struct raw_wheel *raw, const char *key,
                  struct kl_wheel_def *def) {
    const double tape = raw->tape_circle_m != NULL ? *raw->tape_circle_m : USUAL_TAPE_CIRCLE_M;
    const struct place place = {true, tape};
    const struct raw_wheel_side none = {NULL, NULL};
    const struct raw_wheel_side *right = raw->right != NULL ? raw->right : &none;
    const struct raw_wheel_side *left = raw->left != NULL ? raw->left : &none;
    def->half_spacing_m = wheel_spacing(parts, raw, key, tape);
    needs(parts, raw->profile != NULL, right->profile != NULL, left->profile != NULL, "profile",
          key);
    needs(parts, raw->radius_m != NULL, right->radius_m != NULL, left->radius_m != NULL, "radius_m",
          key);
    if (raw->profile != NULL) {
        profile(parts, raw->profile, &place, key, &def->profile);
    }
    if (raw->radius_m != NULL) {
        model_positive(parts, *raw->radius_m, "%s.radius_m", key);
        def->radius_m = *raw->radius_m;
    }
}

/* What one side has of its own instead. */
static void wheel_side(struct model_parts *parts, const struct raw_wheel *raw,
                       const struct raw_wheel_side *own, const char *key,
                       struct kl_wheel_def *def) {
    const double tape = raw->tape_circle_m != NULL ? *raw->tape_circle_m : USUAL_TAPE_CIRCLE_M;
    const struct place place = {true, tape};
    if (own->profile != NULL) {
        profile(parts, own->profile, &place, key, &def->profile);
    }
    if (own->radius_m != NULL) {
        model_positive(parts, *own->radius_m, "%s.radius_m", key);
        def->radius_m = *own->radius_m;
    }
}

/* ---- rails ---- */

static double one_in(struct model_parts *parts, double n, const char *key, const char *name) {
    bool ok = model_check(parts, n >= 2.0 || n <= -2.0, "must be 2 or more (1:n), or -2 or less",
                          "%s.%s", key, name);
    return ok ? kl_atan(1.0 / n) : 0.0;
}

static double rail_cant(struct model_parts *parts, const double *cant_rad, const double *cant_1_in,
                        const char *key) {
    if (cant_rad != NULL && cant_1_in != NULL) {
        model_check(parts, false, "either cant_rad or cant_1_in, not both", "%s.cant_1_in", key);
        return 0.0;
    }
    if (cant_1_in != NULL) {
        return one_in(parts, *cant_1_in, key, "cant_1_in");
    }
    if (cant_rad != NULL) {
        model_check(parts, kl_abs(*cant_rad) < 0.5, "must be between -0.5 and 0.5", "%s.cant_rad",
                    key);
        return *cant_rad;
    }
    return 0.0;
}

/* The inclination that is in the profile's points already. */
static double cant_of_file(struct model_parts *parts, const struct raw_profile *raw,
                           const char *key) {
    return raw != NULL && raw->canted_1_in != NULL
               ? one_in(parts, *raw->canted_1_in, key, "profile.canted_1_in")
               : 0.0;
}

static void rail_side(struct model_parts *parts, const struct raw_rail *raw,
                      const struct raw_rail_side *own, const char *key, struct kl_rail_def *def) {
    const struct place place = {false, 0.0};
    const bool own_cant = own->cant_rad != NULL || own->cant_1_in != NULL;
    if (own->profile != NULL) {
        profile(parts, own->profile, &place, key, &def->profile);
    }
    def->cant_rad = rail_cant(parts, own_cant ? own->cant_rad : raw->cant_rad,
                              own_cant ? own->cant_1_in : raw->cant_1_in, key) -
                    cant_of_file(parts, own->profile != NULL ? own->profile : raw->profile, key);
}

static void rail(struct model_parts *parts, const struct raw_rail *raw, const char *key,
                 struct kl_rail_def *def) {
    const struct place place = {false, 0.0};
    needs(parts, raw->profile != NULL, raw->right != NULL && raw->right->profile != NULL,
          raw->left != NULL && raw->left->profile != NULL, "profile", key);
    if (raw->profile != NULL) {
        profile(parts, raw->profile, &place, key, &def->profile);
    }
    def->cant_rad = rail_cant(parts, raw->cant_rad, raw->cant_1_in, key) -
                    cant_of_file(parts, raw->profile, key);
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

static const char *const side_name[KL_SIDES] = {"right", "left"};

static void wheels(struct model_parts *parts, const struct raw_pair *raw, uint32_t i,
                   struct kl_pair_def *def) {
    const struct raw_wheel *single[KL_SIDES] = {raw->wheel_right, raw->wheel_left};
    char key[64];
    snprintf(key, sizeof key, "pairs[%u].wheel", i);
    if (raw->wheel != NULL) {
        wheel(parts, raw->wheel, key, &def->wheel[KL_RIGHT]);
        def->wheel[KL_LEFT] = def->wheel[KL_RIGHT];
    }
    for (int s = 0; s < KL_SIDES; s++) {
        const struct raw_wheel *w = raw->wheel != NULL ? raw->wheel : single[s];
        const struct raw_wheel_side *own[KL_SIDES] = {w->right, w->left};
        if (raw->wheel == NULL) {
            snprintf(key, sizeof key, "pairs[%u].wheel_%s", i, side_name[s]);
            wheel(parts, w, key, &def->wheel[s]);
            model_check(parts, own[0] == NULL && own[1] == NULL,
                        "its right and left go with a wheel of both sides", "%s", key);
        } else if (own[s] != NULL) {
            snprintf(key, sizeof key, "pairs[%u].wheel.%s", i, side_name[s]);
            wheel_side(parts, w, own[s], key, &def->wheel[s]);
        }
    }
}

static void rails(struct model_parts *parts, const struct raw_pair *raw, uint32_t i,
                  struct kl_pair_def *def) {
    const struct raw_rail *single[KL_SIDES] = {raw->rail_right, raw->rail_left};
    char key[64];
    snprintf(key, sizeof key, "pairs[%u].rail", i);
    if (raw->rail != NULL) {
        rail(parts, raw->rail, key, &def->rail[KL_RIGHT]);
        def->rail[KL_LEFT] = def->rail[KL_RIGHT];
    }
    for (int s = 0; s < KL_SIDES; s++) {
        const struct raw_rail *r = raw->rail != NULL ? raw->rail : single[s];
        const struct raw_rail_side *own[KL_SIDES] = {r->right, r->left};
        if (raw->rail == NULL) {
            snprintf(key, sizeof key, "pairs[%u].rail_%s", i, side_name[s]);
            rail(parts, r, key, &def->rail[s]);
            model_check(parts, own[0] == NULL && own[1] == NULL,
                        "its right and left go with a rail of both sides", "%s", key);
        } else if (own[s] != NULL) {
            snprintf(key, sizeof key, "pairs[%u].rail.%s", i, side_name[s]);
            rail_side(parts, r, own[s], key, &def->rail[s]);
        }
    }
}

static void flange(struct model_parts *parts, const struct raw_flange *raw, uint32_t i,
                   struct kl_pair_def *def) {
    model_check(parts, raw->stiffness_N_m >= 1e5 && raw->stiffness_N_m <= 1e10,
                "must be 1e5 to 1e10", "pairs[%u].flange.stiffness_N_m", i);
    model_check(parts, raw->damping_Ns_m >= 0.0 && raw->damping_Ns_m <= 1e8, "must be 0 to 1e8",
                "pairs[%u].flange.damping_Ns_m", i);
    def->flange_stiffness_N_m = raw->stiffness_N_m;
    def->flange_damping_Ns_m = raw->damping_Ns_m;
}

static void profile_pair(struct model_parts *parts, const struct raw_pair *raw, uint32_t i,
                         struct kl_pair_def *def) {
    def->kind = KL_PAIR_PROFILES;
    def->kinematics =
        raw->kinematics != NULL ? (enum kl_kinematics) * raw->kinematics : KL_KINEMATICS_RIGID;
    def->contacts =
        raw->contacts != NULL ? (enum kl_contact_model) * raw->contacts : KL_CONTACTS_TWO;
    if (raw->flange != NULL) {
        flange(parts, raw->flange, i, def);
    }
    if (two_sides(parts, i, "wheel", raw->wheel, raw->wheel_right, raw->wheel_left)) {
        wheels(parts, raw, i, def);
    }
    if (two_sides(parts, i, "rail", raw->rail, raw->rail_right, raw->rail_left)) {
        rails(parts, raw, i, def);
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
        bool with_profiles =
            pair->wheel != NULL || pair->wheel_right != NULL || pair->wheel_left != NULL ||
            pair->rail != NULL || pair->rail_right != NULL || pair->rail_left != NULL ||
            pair->kinematics != NULL || pair->contacts != NULL || pair->flange != NULL;
        if (pair->linear == NULL) {
            profile_pair(parts, pair, i, &pairs[i]);
        } else if (model_check(parts, !with_profiles,
                               "goes without wheel, rail, kinematics, contacts and flange",
                               "pairs[%u].linear", i)) {
            linear_pair(parts, pair->linear, i, &pairs[i]);
        }
        pair_table(parts, pair, i, &pairs[i]);
    }
}
