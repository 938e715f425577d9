/* creep_cases.h - what the tests of the creep laws share: one contact, forces over mu N. */
#ifndef CREEP_CASES_H
#define CREEP_CASES_H

#include "fixtures.h"
#include "kl_creep.h"
#include "kl_geometry.h"

#define ROUNDED(x) ((kl_real)(x))

static const struct kl_material creep_steel = {82e9, 0.28};

/* A contact with that ellipse (m, at its normal force), no creepage yet. */
static inline struct kl_creep_contact contact_of(enum kl_creep_law law,
                                                 const struct kl_creep_table *table, double a_m,
                                                 double b_m, double normal_N, double friction) {
    struct kl_creep_contact c;
    const double third = cbrt(normal_N);
    const struct kl_ellipse at_1 = {a_m / third, b_m / third};
    memset(&c, 0, sizeof c);
    assert_int_equal(kl_creep_row_build(law, table, &at_1, &creep_steel, &c.row), KL_OK);
    c.friction = kl_friction_constant(ROUNDED(friction));
    c.normal_N = ROUNDED(normal_N);
    return c;
}

/* Forces over mu N, the moment over mu N c, as the references have them. */
struct creep_result {
    double fx;
    double fy;
    double mz;
    double reduction;
};

static inline struct creep_result creep_result(enum kl_creep_law law,
                                               const struct kl_creep_table *table,
                                               const struct kl_creep_contact *c, double c_m) {
    const struct kl_creep_force f = kl_creep_force(law, table, c);
    const double limit = (double)c->friction.mu0 * (double)c->normal_N;
    const struct creep_result r = {(double)f.t1_N / limit, (double)f.t2_N / limit,
                                   (double)f.m3_Nm / (limit * c_m), (double)f.reduction};
    return r;
}

/* Sums up differences. */
struct creep_error {
    double force;
    double force_max;
    double moment;
    double moment_max;
    int n;
};

static inline void creep_compare(struct creep_error *e, const struct creep_result *r, double fx,
                                 double fy, double mz) {
    const double force = hypot(r->fx - fx, r->fy - fy);
    const double moment = fabs(r->mz - mz);
    e->force += force;
    e->moment += moment;
    e->force_max = fmax(e->force_max, force);
    e->moment_max = fmax(e->moment_max, moment);
    e->n++;
}

/* Every row of creep_forces.csv of one method against a law. */
static inline struct creep_error
against_forces(enum kl_creep_law law, const struct kl_creep_table *table, const char *method) {
    struct creep_error e = {0.0, 0.0, 0.0, 0.0, 0};
    struct csv csv;
    csv_open(&csv, "tests/reference/creep_forces.csv");
    while (csv_next(&csv)) {
        if (!csv_is(&csv, "method", method)) {
            continue;
        }
        const double a = 1e-3 * csv_named(&csv, "a_mm");
        const double b = 1e-3 * csv_named(&csv, "b_mm");
        struct kl_creep_contact c =
            contact_of(law, table, a, b, csv_named(&csv, "normal_N"), csv_named(&csv, "friction"));
        c.creepage.gamma1 = ROUNDED(csv_named(&csv, "xi"));
        c.creepage.gamma2 = ROUNDED(csv_named(&csv, "eta"));
        c.creepage.omega3_1_m = ROUNDED(csv_named(&csv, "phi_1_m"));
        const struct creep_result r = creep_result(law, table, &c, sqrt(a * b));
        creep_compare(&e, &r, csv_named(&csv, "fx"), csv_named(&csv, "fy"), csv_named(&csv, "mz"));
    }
    csv_close(&csv);
    e.force /= e.n;
    e.moment /= e.n;
    return e;
}

/* The 800 points of creep_check_points.csv. */
static inline struct creep_error against_points(enum kl_creep_law law,
                                                const struct kl_creep_table *table) {
    struct creep_error e = {0.0, 0.0, 0.0, 0.0, 0};
    const double c_m = 5e-3;
    const double normal = 60e3;
    const double friction = 0.3;
    const double by = friction * normal / (creep_steel.shear_modulus_Pa * c_m * c_m);
    struct csv csv;
    csv_open(&csv, "tests/reference/creep_check_points.csv");
    while (csv_next(&csv)) {
        const double root = sqrt(csv_named(&csv, "a_over_b"));
        struct kl_creep_contact c =
            contact_of(law, table, c_m * root, c_m / root, normal, friction);
        c.creepage.gamma1 = ROUNDED(by * csv_named(&csv, "X"));
        c.creepage.gamma2 = ROUNDED(by * csv_named(&csv, "Y"));
        c.creepage.omega3_1_m = ROUNDED(by / c_m * csv_named(&csv, "Z"));
        const struct creep_result r = creep_result(law, table, &c, c_m);
        creep_compare(&e, &r, csv_named(&csv, "fx"), csv_named(&csv, "fy"), csv_named(&csv, "mz"));
    }
    csv_close(&csv);
    e.force /= e.n;
    e.moment /= e.n;
    return e;
}

#endif
