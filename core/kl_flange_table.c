/* kl_flange_table.c - the table of a flange, and where it ends that of its tread. */
#include "kl_flange.h"

#include "kl_lookup.h"
#include "kl_math.h"

/* The flattest contact by which a flange still holds, as the tangent of its angle. */
#define FLANGE_LAST_SLOPE 0.4
/* Where no axle ever comes. */
#define OUT_OF_REACH_M 1e3

/* Row of a flange table at ride height H, and how far beyond; t in 0..1, also outside the table. */
static const struct kl_flange_row *flange_row(const struct kl_flange_table *table, kl_real inv_step,
                                              kl_real height, kl_real *t) {
    const kl_real last = (kl_real)(table->n_rows - 1u);
    const kl_real place = kl_clamp((table->top_m - height) * inv_step, KL_R(0), last);
    const uint32_t i = (uint32_t)place < table->n_rows - 1u ? (uint32_t)place : table->n_rows - 2u;
    *t = place - (kl_real)i;
    return &table->rows[i];
}

/* How far outboard of its flange's first touch a side at height H would be. */
static double overlap_at(const struct kl_flange_table *table, const struct kl_pair *pair, double w,
                         double height) {
    kl_real t;
    const struct kl_flange_row *row = flange_row(table, pair->inv_step_1_m, (kl_real)height, &t);
    return w - (double)kl_flange_place(row, t, pair->step_m, pair->inv_step_1_m).value;
}

void kl_flange_none(struct kl_flange_row rows[2], struct kl_flange_table *table) {
    for (int i = 0; i < 2; i++) {
        const struct kl_flange_row blank = {0};
        rows[i] = blank;
        rows[i].place_m = KL_R(OUT_OF_REACH_M);
        rows[i].inv_sin = KL_R(1);
        rows[i].contact.radius_m = KL_R(1);
    }
    table->rows = rows;
    table->n_rows = 2;
    table->top_m = KL_R(-OUT_OF_REACH_M);
}

/* Fills rows from the lowest height to the last that holds; returns how many, 0 where the flange
 * meets nothing. `across_m` is the height of the opposite side, which stays on its tread. */
static uint32_t fill_flange(const struct kl_tangency *t, const struct kl_row_kind *kind,
                            enum kl_side s, double step, double across_m, double *top,
                            struct kl_flange_row *rows) {
    const double base = t->side[KL_RIGHT].half_base_m + t->side[KL_LEFT].half_base_m;
    const uint32_t tries = KL_FLANGE_MAX_ROWS;
    uint32_t n = 0;
    for (uint32_t i = 0; i < tries; i++) {
        const double height = step * ((double)(tries / 6u) - (double)i);
        struct kl_flange_contact contact;
        const int met = kl_flange_solve(t, s, height, (height - across_m) / base, &contact);
        if (n > 0 && (!met || contact.slope < FLANGE_LAST_SLOPE)) {
            break;
        }
        if (n > 0 && !(contact.place_m > (double)rows[n - 1u].place_m)) {
            n = 0; /* so far it was the flange's foot that touched, below where treads ever ride */
        }
        if (!met) {
            continue;
        }
        const struct kl_row_place at = {contact.eta_wheel_m, contact.eta_rail_m, height,
                                        -contact.slope};
        *top = n == 0 ? height : *top;
        rows[n].place_m = (kl_real)contact.place_m;
        kl_row_set(t, kind, s, &at, &rows[n].contact);
        rows[n].inv_sin = KL_R(1) / rows[n].contact.sin_delta;
        rows[n].inv_cos = KL_R(1) / rows[n].contact.cos_delta;
        n++;
    }
    for (uint32_t i = 0; i < n && n > 1u; i++) {
        const uint32_t low = i > 0 ? i - 1u : 0u;
        const uint32_t high = i + 1u < n ? i + 1u : n - 1u;
        rows[i].place_h = (kl_real)(-(double)(rows[high].place_m - rows[low].place_m) /
                                    (step * (double)(high - low)));
    }
    return n > 3u ? n : 0u;
}

/* The opposite side's height while this flange touches: twice, because it moves the flange. */
static double height_across(const struct kl_tangency *t, const struct kl_pair_rows *tables,
                            enum kl_side s, double step) {
    const double base = t->side[KL_RIGHT].half_base_m + t->side[KL_LEFT].half_base_m;
    const enum kl_side other = s == KL_RIGHT ? KL_LEFT : KL_RIGHT;
    double across = 0.0;
    for (int round = 0; round < 2; round++) {
        struct kl_flange_contact contact;
        if (!kl_flange_solve(t, s, 0.0, -across / base, &contact)) {
            return 0.0;
        }
        const double last = 2.0 * (double)tables->half;
        const double place = (double)tables->half - contact.place_m / step;
        const double kept = place > last ? last : place;
        across = (double)tables->rows[other][kept > 0.0 ? (uint32_t)kept : 0u].height_m;
    }
    return across;
}

/* Both flanges, one after the other in one block, of which the rest is given back. */
void kl_flanges_build(const struct kl_pair_def *def, const struct kl_tangency *t,
                      const struct kl_pair_rows *tables, struct kl_flange_row *rows,
                      struct kl_pair *pair) {
    const struct kl_row_kind kind = kl_row_kind_of(def);
    for (int s = 0; s < KL_SIDES; s++) {
        struct kl_flange_table *table = &pair->flange[s];
        if (s == KL_LEFT && t->symmetric) {
            *table = pair->flange[KL_RIGHT];
            return;
        }
        double top = 0.0;
        uint32_t n = 0;
        if (def->contacts == KL_CONTACTS_TWO && t->side[s].flange_at < KL_WHEEL_SAMPLES) {
            const double across = height_across(t, tables, (enum kl_side)s, def->step_m);
            n = fill_flange(t, &kind, (enum kl_side)s, def->step_m, across, &top, rows);
        }
        table->rows = rows;
        table->n_rows = n;
        table->top_m = (kl_real)top;
        if (n == 0) {
            kl_flange_none(rows, table);
        }
        rows += table->n_rows;
    }
}

/* The row before which a side's flange touches while it rides on its tread; 0 where it does not. */
static uint32_t find_touch(const struct kl_pair *pair, enum kl_side s) {
    for (uint32_t i = 0; i <= 2u * pair->half; i++) {
        const double w = (double)pair->step_m * ((double)i - (double)pair->half);
        const double height = (double)pair->side[s].rows[i].height_m;
        if (overlap_at(&pair->flange[s], pair, w, height) > 0.0) {
            return i;
        }
    }
    return 0;
}

/* The tread's row just where the flange touches: between `low`, with roll to begin with, and the row
 * after it. */
static enum kl_status locate_touch(const struct kl_pair *pair, const struct kl_tangency *t,
                                   const struct kl_row_kind *kind, enum kl_side s, double low,
                                   double roll, double *touch, struct kl_row *row,
                                   struct kl_diag *diag) {
    double high = low + (double)pair->step_m;
    struct kl_touch at = {.phi_rad = roll};
    for (int i = 0; i < 20; i++) {
        const double w = 0.5 * (low + high);
        const enum kl_status status = kl_tangency_solve(t, s == KL_RIGHT ? w : -w, &at, diag);
        if (status != KL_OK) {
            return status;
        }
        if (overlap_at(&pair->flange[s], pair, w, at.height_m[s]) > 0.0) {
            high = w;
        } else {
            low = w;
        }
    }
    *touch = low;
    const enum kl_status status = kl_tangency_solve(t, s == KL_RIGHT ? low : -low, &at, diag);
    kl_row_fill(t, kind, s, low, &at, row);
    return status;
}

/*
 * Where the flange touches the tread's table ends. The row after that becomes the one with which
 * interpolation meets `end` there: beyond, the tread might jump, and a bend of it between the rows
 * would be felt before. Further rows are never read in a step.
 */
#define LEAST_PART 0.02
static void end_tread(struct kl_pair *pair, enum kl_side s, double touch, const struct kl_row *end,
                      struct kl_row *rows) {
    const double place = touch / (double)pair->step_m + (double)pair->half;
    const uint32_t below = (uint32_t)place;
    const double t = place - (double)below;
    const int whole = t < LEAST_PART; /* the row below is the end */
    pair->tread_end[s] = (kl_real)(whole ? (double)below : place);
    for (uint32_t i = below + 1u; i <= 2u * pair->half; i++) {
        rows[i] = *end;
        rows[i].height_w = KL_R(0);
    }
    if (whole || below >= 2u * pair->half) {
        return;
    }
    const kl_real *a = (const kl_real *)&rows[below];
    const kl_real *e = (const kl_real *)end;
    kl_real *b = (kl_real *)&rows[below + 1u];
    for (size_t column = 0; column < sizeof(struct kl_row) / sizeof(kl_real); column++) {
        b[column] = (kl_real)((double)a[column] + ((double)e[column] - (double)a[column]) / t);
    }
    /* the cubic of kl_lookup.h, found from its value and slope at t */
    const double step = (double)pair->step_m;
    const double from = (double)rows[below].height_w;
    const double mean = ((double)end->height_m - (double)rows[below].height_m) / (step * t);
    const double c3 = (((double)end->height_w - from) - 2.0 * (mean - from)) / (t * t);
    const double c2 = (3.0 * (mean - from) - ((double)end->height_w - from)) / t;
    const double rise = from + c2 + c3;
    rows[below + 1u].height_m = (kl_real)((double)rows[below].height_m + step * rise);
    rows[below + 1u].height_w = (kl_real)(c3 - from + 2.0 * rise);
}

/* The jump from the tread to the flange is a side's last, if the contact point leaps there. */
static void set_flange_jump(const struct kl_pair *pair, enum kl_side s, double touch,
                            const struct kl_row *tread, struct kl_side_table *table) {
    kl_real t;
    const struct kl_flange_row *row =
        flange_row(&pair->flange[s], pair->inv_step_1_m, tread->height_m, &t);
    const kl_real eta =
        row[0].contact.eta_wheel_m + t * (row[1].contact.eta_wheel_m - row[0].contact.eta_wheel_m);
    uint32_t kept = 0;
    while (kept < table->n_jumps && kept < KL_MAX_JUMPS && table->jumps[kept].w_m < touch) {
        kept++;
    }
    table->n_jumps = kept;
    const struct kl_jump jump = {touch, (double)tread->eta_wheel_m, (double)eta};
    if (kept < KL_MAX_JUMPS && jump.eta_after_m - jump.eta_before_m > KL_LEAST_JUMP_M) {
        table->jumps[kept] = jump;
        table->n_jumps++;
    }
}

enum kl_status kl_flange_end_tread(const struct kl_pair_def *def, const struct kl_tangency *t,
                                   const struct kl_pair_rows *tables, enum kl_side s,
                                   struct kl_pair *pair, struct kl_diag *diag) {
    const uint32_t after = find_touch(pair, s);
    if (after == 0) {
        return KL_OK;
    }
    const enum kl_side other = s == KL_RIGHT ? KL_LEFT : KL_RIGHT;
    const kl_real across = tables->rows[other][2u * tables->half - (after - 1u)].height_m;
    const double base = t->side[KL_RIGHT].half_base_m + t->side[KL_LEFT].half_base_m;
    const double roll = (double)(tables->rows[s][after - 1u].height_m - across) / base;
    const double low = def->step_m * ((double)(after - 1u) - (double)tables->half);
    const struct kl_row_kind kind = kl_row_kind_of(def);
    struct kl_row end;
    double touch;
    const enum kl_status located =
        locate_touch(pair, t, &kind, s, low, s == KL_RIGHT ? roll : -roll, &touch, &end, diag);
    if (located == KL_OK) {
        set_flange_jump(pair, s, touch, &end, &pair->side[s]);
        end_tread(pair, s, touch, &end, tables->rows[s]);
    }
    return located;
}
