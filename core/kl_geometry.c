/* kl_geometry.c - the wheel-rail lookup table: built once from the tangency equations, read in
 * every step. */
#include "kl_geometry.h"

#include "kl_diag.h"
#include "kl_flange.h"
#include "kl_lookup.h"
#include "kl_math.h"
#include "kl_row.h"

#define JUMP_THRESHOLD_M 5e-4
#define JUMP_WIDTH_M 1e-6

static enum kl_status check_table(const struct kl_pair_def *def, uint32_t *half,
                                  struct kl_diag *diag) {
    if (!(def->step_m >= 1e-5 && def->step_m <= 1e-3)) {
        return kl_report(diag, KL_ERR_VALUE, "table step_m must be in 1e-5..1e-3", -1, def->step_m);
    }
    const double steps = def->range_m / def->step_m;
    if (!(steps >= 4.0 && steps < (double)KL_TABLE_MAX_HALF + 0.5)) {
        return kl_report(diag, KL_ERR_VALUE, "table range_m must be 4..2000 steps", -1,
                         def->range_m);
    }
    if (!(def->material.shear_modulus_Pa > 1e6 && def->material.shear_modulus_Pa < 1e13)) {
        return kl_report(diag, KL_ERR_VALUE, "shear_modulus_Pa must be in 1e6..1e13", -1,
                         def->material.shear_modulus_Pa);
    }
    if (!(def->material.poisson >= 0.0 && def->material.poisson <= 0.5)) {
        return kl_report(diag, KL_ERR_VALUE, "poisson must be in 0..0.5", -1,
                         def->material.poisson);
    }
    const double k = def->flange_stiffness_N_m;
    if (!(k == 0.0 || (k >= 1e5 && k <= 1e10))) {
        return kl_report(diag, KL_ERR_VALUE, "flange_stiffness_N_m must be in 1e5..1e10", -1, k);
    }
    if (!(def->flange_damping_Ns_m >= 0.0 && def->flange_damping_Ns_m <= 1e8)) {
        return kl_report(diag, KL_ERR_VALUE, "flange_damping_Ns_m must be in 0..1e8", -1,
                         def->flange_damping_Ns_m);
    }
    *half = (uint32_t)(steps + 0.5);
    return KL_OK;
}

/* ---- linear pair ---- */

static enum kl_status check_linear(const struct kl_pair_def *def, struct kl_diag *diag) {
    if (!(def->radius_m > 0.05 && def->radius_m < 2.0)) {
        return kl_report(diag, KL_ERR_VALUE, "linear pair: radius_m must be in 0.05..2", -1,
                         def->radius_m);
    }
    if (!(def->half_base_m > 0.1 && def->half_base_m < 2.0)) {
        return kl_report(diag, KL_ERR_VALUE, "linear pair: half_base_m must be in 0.1..2", -1,
                         def->half_base_m);
    }
    if (!(kl_abs(def->conicity) * def->range_m < 0.5 * def->radius_m)) {
        return kl_report(diag, KL_ERR_VALUE, "linear pair: conicity too large for radius and range",
                         -1, def->conicity);
    }
    if (!(def->curvature_1_m > 0.0 && def->curvature_1_m < 1e4)) {
        return kl_report(diag, KL_ERR_VALUE, "linear pair: curvature_1_m must be in 0..1e4", -1,
                         def->curvature_1_m);
    }
    return KL_OK;
}

/* ---- table ---- */

static enum kl_status fill_tables(const struct kl_pair_def *def, const struct kl_tangency *t,
                                  const struct kl_pair_rows *tables, struct kl_diag *diag) {
    const struct kl_row_kind kind = kl_row_kind_of(def);
    const uint32_t half = tables->half;
    const int32_t first = t->symmetric ? 0 : -(int32_t)half;
    struct kl_touch touch = {.phi_rad = 0.0};
    double central_phi = 0.0;
    for (int32_t i = 0; i <= (int32_t)half; i++) {
        const double u = def->step_m * (double)i;
        const enum kl_status status = kl_tangency_solve(t, u, &touch, diag);
        if (status != KL_OK) {
            return status;
        }
        central_phi = i == 0 ? touch.phi_rad : central_phi;
        kl_row_fill(t, &kind, KL_RIGHT, u, &touch, &tables->rows[KL_RIGHT][(int32_t)half + i]);
        kl_row_fill(t, &kind, KL_LEFT, -u, &touch, &tables->rows[KL_LEFT][(int32_t)half - i]);
        if (t->symmetric) { /* the mirrored posture, to the last bit */
            tables->rows[KL_RIGHT][(int32_t)half - i] = tables->rows[KL_LEFT][(int32_t)half - i];
            tables->rows[KL_LEFT][(int32_t)half + i] = tables->rows[KL_RIGHT][(int32_t)half + i];
        }
    }
    touch.phi_rad = central_phi; /* as the way to the other end began: sides swapped, same bits */
    for (int32_t i = -1; i >= first; i--) {
        const double u = def->step_m * (double)i;
        const enum kl_status status = kl_tangency_solve(t, u, &touch, diag);
        if (status != KL_OK) {
            return status;
        }
        kl_row_fill(t, &kind, KL_RIGHT, u, &touch, &tables->rows[KL_RIGHT][(int32_t)half + i]);
        kl_row_fill(t, &kind, KL_LEFT, -u, &touch, &tables->rows[KL_LEFT][(int32_t)half - i]);
    }
    if (t->symmetric) { /* u = 0: both sides are one row, exactly level */
        tables->rows[KL_RIGHT][half].height_m = KL_R(0);
        tables->rows[KL_LEFT][half] = tables->rows[KL_RIGHT][half];
    }
    return KL_OK;
}

/* One place between two rows while a jump is closed in on. */
static enum kl_status contact_at(const struct kl_tangency *t, enum kl_side s, double w,
                                 struct kl_touch *touch, double *eta, struct kl_diag *diag) {
    const enum kl_status status = kl_tangency_solve(t, s == KL_RIGHT ? w : -w, touch, diag);
    *eta = touch->eta_wheel_m[s];
    return status;
}

/* Halves an interval in which the contact point moves far, to tell a jump from a fast slide.
 * `touch` holds a roll to begin with. */
static enum kl_status locate_jump(const struct kl_tangency *t, enum kl_side s, double w_low,
                                  double w_high, struct kl_touch *touch, struct kl_jump *jump,
                                  struct kl_diag *diag) {
    double eta_low = 0.0;
    double eta_high = 0.0;
    enum kl_status status = contact_at(t, s, w_low, touch, &eta_low, diag);
    if (status == KL_OK) {
        status = contact_at(t, s, w_high, touch, &eta_high, diag);
    }
    for (int i = 0; i < 12 && status == KL_OK && w_high - w_low > JUMP_WIDTH_M; i++) {
        const double middle = 0.5 * (w_low + w_high);
        double eta = 0.0;
        status = contact_at(t, s, middle, touch, &eta, diag);
        if (kl_abs(eta - eta_low) < kl_abs(eta - eta_high)) {
            w_low = middle;
            eta_low = eta;
        } else {
            w_high = middle;
            eta_high = eta;
        }
    }
    jump->w_m = 0.5 * (w_low + w_high);
    jump->eta_before_m = eta_low;
    jump->eta_after_m = eta_high;
    return status;
}

static enum kl_status find_jumps(const struct kl_pair_def *def, const struct kl_tangency *t,
                                 const struct kl_pair_rows *tables, enum kl_side s,
                                 struct kl_side_table *table, struct kl_diag *diag) {
    const double base = t->side[KL_RIGHT].half_base_m + t->side[KL_LEFT].half_base_m;
    const enum kl_side other = s == KL_RIGHT ? KL_LEFT : KL_RIGHT;
    for (uint32_t i = 0; i < 2u * tables->half; i++) {
        const struct kl_row *here = &tables->rows[s][i];
        const struct kl_row *across = &tables->rows[other][2u * tables->half - i];
        if (kl_abs((double)(here[1].eta_wheel_m - here[0].eta_wheel_m)) < JUMP_THRESHOLD_M) {
            continue;
        }
        const double w = def->step_m * ((double)i - (double)tables->half);
        const double roll = (double)(here->height_m - across->height_m) / base;
        struct kl_touch touch = {.phi_rad = s == KL_RIGHT ? roll : -roll};
        struct kl_jump jump;
        const enum kl_status status = locate_jump(t, s, w, w + def->step_m, &touch, &jump, diag);
        if (status != KL_OK) {
            return status;
        }
        if (kl_abs(jump.eta_after_m - jump.eta_before_m) > KL_LEAST_JUMP_M) {
            if (table->n_jumps < KL_MAX_JUMPS) {
                table->jumps[table->n_jumps] = jump;
            }
            table->n_jumps++;
        }
    }
    return KL_OK;
}

/* Jumps on the tread, and where the flange comes in. */
static enum kl_status finish_side(const struct kl_pair_def *def, const struct kl_tangency *t,
                                  const struct kl_pair_rows *tables, enum kl_side s,
                                  struct kl_pair *pair, struct kl_diag *diag) {
    const enum kl_status status = find_jumps(def, t, tables, s, &pair->side[s], diag);
    return status == KL_OK ? kl_flange_end_tread(def, t, tables, s, pair, diag) : status;
}

static enum kl_status build_from_profiles(const struct kl_pair_def *def, struct kl_arena *arena,
                                          const struct kl_pair_rows *tables, struct kl_pair *pair,
                                          struct kl_diag *diag) {
    size_t kept = arena->used;
    struct kl_flange_row *rows =
        kl_arena_take(arena, 2u * KL_FLANGE_MAX_ROWS, sizeof(struct kl_flange_row));
    if (rows == NULL) {
        return kl_report(diag, KL_ERR_MEMORY, "flange table", -1, (double)arena->wanted);
    }
    struct kl_tangency t; /* profiles and samples are scratch */
    enum kl_status status = kl_tangency_build(def, arena, &t, diag);
    if (status == KL_OK) {
        if (def->contacts == KL_CONTACTS_TWO) {
            kl_tangency_treads_only(&t);
        }
        status = fill_tables(def, &t, tables, diag);
    }
    if (status == KL_OK) {
        kl_flanges_build(def, &t, tables, rows, pair);
        const struct kl_flange_table *last = &pair->flange[t.symmetric ? KL_RIGHT : KL_LEFT];
        const struct kl_flange_row *end = last->rows + last->n_rows;
        kept = ((size_t)((const unsigned char *)end - arena->base) + 15u) & ~(size_t)15u;
    }
    for (int s = 0; s < KL_SIDES && status == KL_OK; s++) {
        if (t.symmetric && s == KL_LEFT) {
            const struct kl_side_table *right = &pair->side[KL_RIGHT];
            struct kl_side_table *left = &pair->side[KL_LEFT];
            left->n_jumps = right->n_jumps;
            for (uint32_t i = 0; i < KL_MAX_JUMPS; i++) {
                left->jumps[i] = right->jumps[i];
            }
            for (uint32_t i = 0; i <= 2u * tables->half; i++) {
                tables->rows[KL_LEFT][i] = tables->rows[KL_RIGHT][i];
            }
            pair->tread_end[KL_LEFT] = pair->tread_end[KL_RIGHT];
        } else {
            status = finish_side(def, &t, tables, (enum kl_side)s, pair, diag);
        }
    }
    arena->used = kept;
    if (status != KL_OK) {
        return status;
    }
    const double l_r = t.side[KL_RIGHT].half_base_m;
    const double l_l = t.side[KL_LEFT].half_base_m;
    pair->base_m = (kl_real)(l_r + l_l);
    pair->inv_base_1_m = (kl_real)(1.0 / (l_r + l_l));
    pair->share[KL_RIGHT] = (kl_real)(l_l / (l_r + l_l));
    pair->share[KL_LEFT] = (kl_real)(l_r / (l_r + l_l));
    pair->radius_m = (kl_real)(0.5 * (t.side[KL_RIGHT].radius0_m + t.side[KL_LEFT].radius0_m));
    for (int s = 0; s < KL_SIDES; s++) {
        const struct kl_row *central = &tables->rows[s][tables->half];
        pair->central_tan[s] = central->sin_delta / central->cos_delta;
        pair->gives = pair->flange[s].n_rows > 2u ? KL_R(1) : pair->gives;
    }
    return KL_OK;
}

enum kl_status kl_pair_build(const struct kl_pair_def *def, struct kl_arena *arena,
                             struct kl_pair *pair, struct kl_diag *diag) {
    if (def == NULL || arena == NULL || pair == NULL) {
        return kl_report(diag, KL_ERR_ARGUMENT, "kl_pair_build: NULL", -1, 0.0);
    }
    const struct kl_pair blank = {0};
    struct kl_pair_rows tables;
    *pair = blank;
    enum kl_status status = check_table(def, &tables.half, diag);
    if (status != KL_OK) {
        return status;
    }
    for (int s = 0; s < KL_SIDES; s++) {
        tables.rows[s] = kl_arena_take(arena, 2u * tables.half + 1u, sizeof(struct kl_row));
        if (tables.rows[s] == NULL) {
            return kl_report(diag, KL_ERR_MEMORY, "contact table", -1, (double)arena->wanted);
        }
        pair->side[s].rows = tables.rows[s];
        pair->tread_end[s] = (kl_real)(2u * tables.half);
    }
    pair->half = tables.half;
    pair->step_m = (kl_real)def->step_m;
    pair->inv_step_1_m = (kl_real)(1.0 / def->step_m);
    pair->range_m = (kl_real)(def->step_m * (double)tables.half);
    pair->law = def->law;
    pair->n_shapes = kl_row_kind_of(def).law == KL_CREEP_LINEAR ? 0u : KL_CREEP_SHAPES;
    const int stated = def->flange_stiffness_N_m > 0.0;
    pair->flange_stiffness_N_m =
        stated ? (kl_real)def->flange_stiffness_N_m : KL_R(KL_FLANGE_STIFFNESS_N_M);
    pair->flange_damping_Ns_m =
        stated ? (kl_real)def->flange_damping_Ns_m : KL_R(KL_FLANGE_DAMPING_NS_M);
    if (def->contacts != KL_CONTACTS_TWO && def->contacts != KL_CONTACTS_RIGID) {
        return kl_report(diag, KL_ERR_VALUE, "pair: unknown contacts", -1, (double)def->contacts);
    }
    if ((uint32_t)def->law >= (uint32_t)KL_CREEP_LAWS ||
        (def->law == KL_CREEP_TABLE && def->creep_table == NULL)) {
        return kl_report(diag, KL_ERR_VALUE, "pair: unknown creep law, or no table for it", -1,
                         (double)def->law);
    }
    if (def->kind == KL_PAIR_PROFILES) {
        return build_from_profiles(def, arena, &tables, pair, diag);
    }
    if (def->kind != KL_PAIR_LINEAR) {
        return kl_report(diag, KL_ERR_VALUE, "pair: unknown kind", -1, (double)def->kind);
    }
    status = check_linear(def, diag);
    if (status != KL_OK) {
        return status;
    }
    for (uint32_t i = 0; i <= 2u * tables.half; i++) {
        const double w = def->step_m * ((double)i - (double)tables.half);
        kl_row_linear(def, w, &tables.rows[KL_RIGHT][i]);
        tables.rows[KL_LEFT][i] = tables.rows[KL_RIGHT][i];
    }
    struct kl_flange_row *rows = kl_arena_take(arena, 2u, sizeof *rows);
    if (rows == NULL) {
        return kl_report(diag, KL_ERR_MEMORY, "flange table", -1, (double)arena->wanted);
    }
    kl_flange_none(rows, &pair->flange[KL_RIGHT]);
    kl_flange_none(rows, &pair->flange[KL_LEFT]);
    pair->base_m = (kl_real)(2.0 * def->half_base_m);
    pair->inv_base_1_m = (kl_real)(0.5 / def->half_base_m);
    pair->share[KL_RIGHT] = KL_R(0.5);
    pair->share[KL_LEFT] = KL_R(0.5);
    pair->radius_m = (kl_real)def->radius_m;
    return KL_OK;
}

/* ---- single postures ---- */

/* In steps from the centre, each begun with the roll of the one before: in flange contact a level
 * axle is no guess. */
static enum kl_status solve_from_centre(const struct kl_tangency *t, double u_y_m,
                                        struct kl_touch *touch, struct kl_diag *diag) {
    const double longest = 5e-4;
    const uint32_t steps = (uint32_t)(kl_abs(u_y_m) / longest) + 1u;
    enum kl_status status = KL_OK;
    for (uint32_t i = 1; i <= steps && status == KL_OK; i++) {
        const double u = i == steps ? u_y_m : u_y_m * (double)i / (double)steps;
        status = kl_tangency_solve(t, u, touch, diag);
    }
    return status;
}

/* The posture that a touch is. */
static void read_touch(const struct kl_tangency *t, const struct kl_row_kind *kind,
                       const struct kl_touch *touch, struct kl_posture *p) {
    const double l_r = t->side[KL_RIGHT].half_base_m;
    const double l_l = t->side[KL_LEFT].half_base_m;
    kl_row_fill(t, kind, KL_RIGHT, p->u_y_m, touch, &p->row[KL_RIGHT]);
    kl_row_fill(t, kind, KL_LEFT, -p->u_y_m, touch, &p->row[KL_LEFT]);
    p->phi_rad = touch->phi_rad;
    p->phi_y_rad_m = touch->phi_y_rad_m;
    p->u_z_m = (l_l * touch->height_m[KL_RIGHT] + l_r * touch->height_m[KL_LEFT]) / (l_r + l_l);
    p->z_y = (l_l * touch->height_w[KL_RIGHT] - l_r * touch->height_w[KL_LEFT]) / (l_r + l_l);
}

/* Hertz's approach under a wheel's vertical load. */
static double approach_of(const struct kl_row *row, const struct kl_material *material,
                          double wheel_load_N) {
    if (!(wheel_load_N > 0.0)) {
        return 0.0;
    }
    const double along = 0.5 * kl_cos((double)row->delta_wheel_rad) / (double)row->radius_m;
    const double across = 0.5 * (double)(row->curv_rail_1_m - row->curv_wheel_1_m);
    const double normal_N = wheel_load_N / (double)row->cos_delta;
    return kl_hertz_approach(along, across > 1e-6 ? across : 1e-6, material->shear_modulus_Pa,
                             material->poisson) *
           normal_N * (double)kl_inverse_cbrt((kl_real)normal_N);
}

/* The rail of one side, moved away along the normal of its contact. */
static void move_rail(const struct kl_contact_side *unloaded, const struct kl_row *row,
                      double approach_m, struct kl_contact_side *side) {
    side->offset_m = unloaded->offset_m + approach_m * (double)row->sin_delta;
    side->rise0_m = unloaded->rise0_m - approach_m * (double)row->cos_delta;
}

/* From the wheel's own surface to the middle of the patch. */
static void to_the_patch(struct kl_row *row, double approach_m) {
    row->arm_m -= (kl_real)(0.5 * approach_m) * row->sin_delta;
    row->radius_m -= (kl_real)(0.5 * approach_m) * row->cos_delta;
}

/* Lets the rails give way until both approaches are those of the load; `touch` and `posture` hold
 * the unloaded solution. */
static enum kl_status press(const struct kl_pair_def *def, struct kl_tangency *t,
                            double wheel_load_N, struct kl_touch *touch, struct kl_posture *posture,
                            struct kl_diag *diag) {
    const double settled_m = 1e-11;
    const struct kl_row_kind kind = kl_row_kind_of(def);
    const struct kl_contact_side unloaded[KL_SIDES] = {t->side[KL_RIGHT], t->side[KL_LEFT]};
    for (int round = 0; round < KL_LOAD_ROUNDS; round++) {
        double change = 0.0;
        for (int s = 0; s < KL_SIDES; s++) {
            const struct kl_row *row = &posture->row[s];
            const double approach = approach_of(row, &def->material, wheel_load_N);
            change += kl_abs(approach - posture->approach_m[s]);
            posture->approach_m[s] = approach;
            move_rail(&unloaded[s], row, approach, &t->side[s]);
        }
        if (change < settled_m) {
            to_the_patch(&posture->row[KL_RIGHT], posture->approach_m[KL_RIGHT]);
            to_the_patch(&posture->row[KL_LEFT], posture->approach_m[KL_LEFT]);
            return KL_OK;
        }
        const enum kl_status status = kl_tangency_solve(t, posture->u_y_m, touch, diag);
        if (status != KL_OK) {
            return status;
        }
        read_touch(t, &kind, touch, posture);
    }
    return kl_report(diag, KL_ERR_CONVERGE, "two contacts of a wheel share the load", -1,
                     posture->u_y_m);
}

/* The linear pair: level contacts, the same on either side. */
static enum kl_status solve_linear(const struct kl_pair_def *def, double wheel_load_N,
                                   struct kl_posture *posture, struct kl_diag *diag) {
    const enum kl_status status = check_linear(def, diag);
    for (int s = 0; s < KL_SIDES && status == KL_OK; s++) {
        struct kl_row *row = &posture->row[s];
        kl_row_linear(def, s == KL_RIGHT ? posture->u_y_m : -posture->u_y_m, row);
        posture->approach_m[s] = approach_of(row, &def->material, wheel_load_N);
        posture->u_z_m += 0.5 * posture->approach_m[s];
        row->height_m = (kl_real)posture->approach_m[s];
        to_the_patch(row, posture->approach_m[s]);
    }
    return status;
}

enum kl_status kl_pair_solve_loaded(const struct kl_pair_def *def, struct kl_arena *scratch,
                                    const struct kl_loaded_place *at, struct kl_posture *posture,
                                    struct kl_diag *diag) {
    if (def == NULL || scratch == NULL || at == NULL || posture == NULL ||
        !(kl_abs(at->u_y_m) <= 0.1)) {
        return kl_report(diag, KL_ERR_ARGUMENT, "kl_pair_solve: NULL or u_y not within 0.1 m", -1,
                         at != NULL ? at->u_y_m : 0.0);
    }
    if (!(at->wheel_load_N >= 0.0 && at->wheel_load_N <= 1e6)) {
        return kl_report(diag, KL_ERR_ARGUMENT, "kl_pair_solve: wheel load must be 0..1e6 N", -1,
                         at->wheel_load_N);
    }
    const struct kl_posture blank = {.u_y_m = at->u_y_m};
    *posture = blank;
    if (def->kind == KL_PAIR_LINEAR) {
        return solve_linear(def, at->wheel_load_N, posture, diag);
    }
    const struct kl_row_kind kind = kl_row_kind_of(def);
    const size_t mark = scratch->used;
    struct kl_tangency t;
    struct kl_touch touch = {.phi_rad = 0.0};
    enum kl_status status = kl_tangency_build(def, scratch, &t, diag);
    if (status == KL_OK) {
        status = solve_from_centre(&t, at->u_y_m, &touch, diag);
    }
    if (status == KL_OK) {
        read_touch(&t, &kind, &touch, posture);
        status = at->wheel_load_N > 0.0 ? press(def, &t, at->wheel_load_N, &touch, posture, diag)
                                        : KL_OK;
    }
    scratch->used = mark;
    return status;
}

enum kl_status kl_pair_solve(const struct kl_pair_def *def, struct kl_arena *scratch, double u_y_m,
                             struct kl_posture *posture, struct kl_diag *diag) {
    const struct kl_loaded_place at = {.u_y_m = u_y_m, .wheel_load_N = 0.0};
    return kl_pair_solve_loaded(def, scratch, &at, posture, diag);
}

enum kl_status kl_pair_posture(const struct kl_pair *pair, double u_y_m,
                               struct kl_posture *posture) {
    if (pair == NULL || posture == NULL || !(kl_abs(u_y_m) <= (double)pair->range_m)) {
        return KL_ERR_ARGUMENT;
    }
    kl_row_read(pair, &pair->side[KL_RIGHT], (kl_real)u_y_m, &posture->row[KL_RIGHT]);
    kl_row_read(pair, &pair->side[KL_LEFT], (kl_real)-u_y_m, &posture->row[KL_LEFT]);
    const struct kl_row *r = &posture->row[KL_RIGHT];
    const struct kl_row *l = &posture->row[KL_LEFT];
    posture->u_y_m = u_y_m;
    posture->u_z_m =
        (double)(pair->share[KL_RIGHT] * r->height_m + pair->share[KL_LEFT] * l->height_m);
    posture->z_y =
        (double)(pair->share[KL_RIGHT] * r->height_w - pair->share[KL_LEFT] * l->height_w);
    posture->phi_rad = (double)((r->height_m - l->height_m) * pair->inv_base_1_m);
    posture->phi_y_rad_m = (double)((r->height_w + l->height_w) * pair->inv_base_1_m);
    return KL_OK;
}

enum kl_status kl_pair_linear(const struct kl_pair_def *def, struct kl_arena *scratch,
                              struct kl_linear_geometry *linear, struct kl_diag *diag) {
    if (linear == NULL) {
        return kl_report(diag, KL_ERR_ARGUMENT, "kl_pair_linear: NULL", -1, 0.0);
    }
    const double d = 1e-5;
    struct kl_posture at[3];
    for (int i = 0; i < 3; i++) {
        const enum kl_status status =
            kl_pair_solve(def, scratch, d * (double)(i - 1), &at[i], diag);
        if (status != KL_OK) {
            return status;
        }
    }
    const struct kl_row *plus_r = &at[2].row[KL_RIGHT];
    const struct kl_row *plus_l = &at[2].row[KL_LEFT];
    const struct kl_row *minus_r = &at[0].row[KL_RIGHT];
    const struct kl_row *minus_l = &at[0].row[KL_LEFT];
    const struct kl_row *mid_r = &at[1].row[KL_RIGHT];
    const struct kl_row *mid_l = &at[1].row[KL_LEFT];
    const double l = 0.5 * (double)(mid_r->arm_m + mid_l->arm_m);
    const double r0 = 0.5 * (double)(mid_r->radius_m + mid_l->radius_m);
    const double by = 1.0 / (4.0 * d);
    linear->radius_m = r0;
    linear->half_base_m = l;
    linear->delta0_rad = 0.5 * (double)(mid_r->delta_rail_rad + mid_l->delta_rail_rad);
    linear->conicity = by * (double)((plus_r->radius_m - plus_l->radius_m) -
                                     (minus_r->radius_m - minus_l->radius_m));
    linear->epsilon_rail = l * by *
                           (double)((plus_r->delta_rail_rad - plus_l->delta_rail_rad) -
                                    (minus_r->delta_rail_rad - minus_l->delta_rail_rad));
    linear->epsilon_wheel = l * by *
                            (double)((plus_r->delta_wheel_rad - plus_l->delta_wheel_rad) -
                                     (minus_r->delta_wheel_rad - minus_l->delta_wheel_rad));
    linear->phi_y_rad_m = at[1].phi_y_rad_m;
    linear->sigma = -l * at[1].phi_y_rad_m * (1.0 - r0 * linear->delta0_rad / l);
    linear->z_yy_1_m = (at[2].z_y - at[0].z_y) / (2.0 * d);
    return KL_OK;
}
