/* kl_row.h - filling and reading the rows of contact tables. Internal to the core (geometry room). */
#ifndef KL_ROW_H
#define KL_ROW_H

#include "kl_tangency.h"

/* What the coefficients of a row depend on besides its curvatures. */
struct kl_row_kind {
    struct kl_material material;
    enum kl_creep_law law;
    const struct kl_creep_table *table;
};

struct kl_row_kind kl_row_kind_of(const struct kl_pair_def *def);

/* Where a contact is, and its heights. */
struct kl_row_place {
    double eta_wheel_m;
    double eta_rail_m;
    double height_m;
    double height_w;
};

/* A contact of given place; its curvatures and coefficients follow. */
void kl_row_set(const struct kl_tangency *t, const struct kl_row_kind *kind, enum kl_side s,
                const struct kl_row_place *at, struct kl_row *row);

/* The row of one side for a solved posture; the row of the linear pair. */
void kl_row_fill(const struct kl_tangency *t, const struct kl_row_kind *kind, enum kl_side s,
                 double w, const struct kl_touch *touch, struct kl_row *row);
void kl_row_linear(const struct kl_pair_def *def, double w, struct kl_row *row);

/* Between two rows: heights by the cubic that also meets the slopes, the rest linear. */
void kl_row_read(const struct kl_pair *pair, const struct kl_side_table *table, kl_real w,
                 struct kl_row *out);

#endif
