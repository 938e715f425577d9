/* kl_row.c - the rows of contact tables. */
#include "kl_row.h"

#include "kl_contact.h"
#include "kl_lookup.h"
#include "kl_math.h"
#include "kl_saturate.h"

struct kl_row_kind kl_row_kind_of(const struct kl_pair_def *def) {
    const struct kl_row_kind kind = {
        def->material, kl_saturates(def->law) ? KL_CREEP_LINEAR : def->law, def->creep_table};
    return kind;
}

static void set_contact_coefficients(struct kl_row *row, double a_1_m, double b_1_m,
                                     const struct kl_row_kind *kind) {
    const struct kl_ellipse e =
        kl_hertz(a_1_m, b_1_m, kind->material.shear_modulus_Pa, kind->material.poisson);
    struct kl_creep_row creep = {.f11_1 = KL_R(0)};
    (void)kl_creep_row_build(kind->law, kind->table, &e, &kind->material, &creep);
    row->semi_a_1 = (kl_real)e.semi_a_1;
    row->semi_b_1 = (kl_real)e.semi_b_1;
    row->f11_1 = creep.f11_1;
    row->f22_1 = creep.f22_1;
    row->f23_1 = creep.f23_1;
    row->f33_1 = creep.f33_1;
    for (int i = 0; i < KL_CREEP_SHAPES; i++) {
        row->shape[i] = kind->law == KL_CREEP_LINEAR ? KL_R(0) : creep.shape[i];
    }
}

void kl_row_set(const struct kl_tangency *t, const struct kl_row_kind *kind, enum kl_side s,
                const struct kl_row_place *at, struct kl_row *row) {
    const struct kl_contact_side *side = &t->side[s];
    const struct kl_profile_point pw = kl_profile_at(&side->wheel, at->eta_wheel_m);
    const struct kl_profile_point pr = kl_profile_at(&side->rail, at->eta_rail_m);
    const double cos_w = 1.0 / kl_sqrt(1.0 + pw.slope * pw.slope);
    const double cos_r = 1.0 / kl_sqrt(1.0 + pr.slope * pr.slope);
    const double radius = side->radius_m + pw.zeta_m;
    const double curv_w = pw.second_1_m * cos_w * cos_w * cos_w;
    const double curv_r = pr.second_1_m * cos_r * cos_r * cos_r;
    row->height_m = (kl_real)at->height_m;
    row->height_w = (kl_real)at->height_w;
    row->arm_m = (kl_real)(side->spacing_m - at->eta_wheel_m);
    row->radius_m = (kl_real)radius;
    row->sin_delta = (kl_real)(pr.slope * cos_r);
    row->cos_delta = (kl_real)cos_r;
    row->eta_wheel_m = (kl_real)at->eta_wheel_m;
    row->eta_rail_m = (kl_real)at->eta_rail_m;
    row->delta_wheel_rad = (kl_real)kl_atan(pw.slope);
    row->delta_rail_rad = (kl_real)kl_atan(pr.slope);
    row->curv_wheel_1_m = (kl_real)curv_w;
    row->curv_rail_1_m = (kl_real)curv_r;
    /* half the relative curvatures; a conformal contact is limited by kl_hertz */
    const double across = 0.5 * (curv_r - curv_w);
    set_contact_coefficients(row, 0.5 * cos_w / radius, across > 1e-6 ? across : 1e-6, kind);
}

/* The row of one side for a solved posture. */
void kl_row_fill(const struct kl_tangency *t, const struct kl_row_kind *kind, enum kl_side s,
                 double w, const struct kl_touch *touch, struct kl_row *row) {
    const double phi_s = s == KL_RIGHT ? touch->phi_rad : -touch->phi_rad;
    const double eta_w = touch->eta_wheel_m[s];
    const struct kl_row_place at = {eta_w, kl_tangency_rail_eta(t, s, w, phi_s, eta_w),
                                    touch->height_m[s], touch->height_w[s]};
    kl_row_set(t, kind, s, &at, row);
}

void kl_row_linear(const struct kl_pair_def *def, double w, struct kl_row *row) {
    const struct kl_row blank = {0};
    *row = blank;
    row->arm_m = (kl_real)def->half_base_m;
    row->radius_m = (kl_real)(def->radius_m + def->conicity * w);
    row->cos_delta = (kl_real)1;
    row->curv_rail_1_m = (kl_real)def->curvature_1_m;
    const struct kl_row_kind kind = kl_row_kind_of(def);
    set_contact_coefficients(row, 0.5 / def->radius_m, 0.5 * def->curvature_1_m, &kind);
}

/* Interpolation in a row pair: heights by the cubic that also meets the slopes, the rest linear. */
void kl_row_read(const struct kl_pair *pair, const struct kl_side_table *table, kl_real w,
                 struct kl_row *out) {
    const kl_real from_start = w * pair->inv_step_1_m + (kl_real)pair->half;
    const kl_real place = kl_clamp(from_start, KL_R(0), pair->tread_end[table - pair->side]);
    uint32_t i = (uint32_t)place;
    i = i < 2u * pair->half ? i : 2u * pair->half - 1u;
    const kl_real t = place - (kl_real)i;
    /* a row is nothing but kl_real columns */
    const kl_real *a = (const kl_real *)&table->rows[i];
    const kl_real *b = (const kl_real *)&table->rows[i + 1u];
    kl_real *o = (kl_real *)out;
    for (size_t column = 0; column < sizeof(struct kl_row) / sizeof(kl_real); column++) {
        o[column] = a[column] + t * (b[column] - a[column]);
    }
    const struct kl_hermite h =
        kl_hermite(&table->rows[i], &table->rows[i + 1u], t, pair->step_m, pair->inv_step_1_m);
    out->height_m = h.value;
    out->height_w = h.slope;
}
