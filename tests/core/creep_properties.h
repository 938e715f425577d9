/* creep_properties.h - what every creep law must keep to, whichever it is. */
#ifndef CREEP_PROPERTIES_H
#define CREEP_PROPERTIES_H

#include "creep_cases.h"

/* A contact somewhere in practice and beyond: any ellipse, up to some ten times saturation. */
static inline struct kl_creep_contact creep_anything(uint64_t *seed, enum kl_creep_law law,
                                                     const struct kl_creep_table *table) {
    const double root = pow(10.0, random_between(seed, -0.5, 0.5));
    struct kl_creep_contact c =
        contact_of(law, table, 5e-3 * root, 5e-3 / root, random_between(seed, 1e3, 2e5), 0.3);
    const double size = pow(10.0, random_between(seed, -5.0, -1.0));
    c.creepage.gamma1 = ROUNDED(size * random_between(seed, -1.0, 1.0));
    c.creepage.gamma2 = ROUNDED(size * random_between(seed, -1.0, 1.0));
    c.creepage.omega3_1_m =
        ROUNDED(pow(10.0, random_between(seed, -3.0, 1.0)) * random_between(seed, -1.0, 1.0));
    return c;
}

/* The mirror image and the reversal, to the bit, with creepages that are 0 too. */
static inline void creep_symmetry(enum kl_creep_law law, const struct kl_creep_table *table,
                                  int n) {
    uint64_t seed = 31;
    for (int i = 0; i < n; i++) {
        struct kl_creep_contact c = creep_anything(&seed, law, table);
        c.creepage.gamma1 = i % 5 == 1 ? 0 : c.creepage.gamma1;
        c.creepage.gamma2 = i % 7 == 1 ? 0 : c.creepage.gamma2;
        c.creepage.omega3_1_m = i % 3 == 1 ? 0 : c.creepage.omega3_1_m;
        const struct kl_creep_force f = kl_creep_force(law, table, &c);
        struct kl_creep_contact m = c;
        m.creepage.gamma2 = -c.creepage.gamma2;
        m.creepage.omega3_1_m = -c.creepage.omega3_1_m;
        const struct kl_creep_force mirror = kl_creep_force(law, table, &m);
        m = c;
        m.creepage.gamma1 = -c.creepage.gamma1;
        const struct kl_creep_force back = kl_creep_force(law, table, &m);
        if (!(f.t1_N == mirror.t1_N && f.t2_N == -mirror.t2_N && f.m3_Nm == -mirror.m3_Nm &&
              f.reduction == mirror.reduction && f.t1_N == -back.t1_N && f.t2_N == back.t2_N &&
              f.m3_Nm == back.m3_Nm && f.reduction == back.reduction)) {
            fail_msg("law %d, case %d: %.17g %.17g %.17g", (int)law, i, (double)f.t1_N,
                     (double)f.t2_N, (double)f.m3_Nm);
        }
    }
}

/* A small move in creepage changes forces by no more than a small part, wherever it is: `step` in
 * normalised creepage, `most` in mu N. */
static inline void creep_continuity(enum kl_creep_law law, const struct kl_creep_table *table,
                                    int n, double step, double most) {
    uint64_t seed = 32;
    for (int i = 0; i < n; i++) {
        struct kl_creep_contact c = creep_anything(&seed, law, table);
        const double normal = (double)c.normal_N;
        const double limit = 0.3 * normal;
        if (i % 4 == 1) { /* across the places where signs change */
            c.creepage.omega3_1_m = ROUNDED(-0.5 * step * limit / ((double)c.row.f23_1 * normal));
        } else if (i % 4 == 2) {
            c.creepage.gamma1 =
                ROUNDED(-0.5 * step * limit / ((double)c.row.f11_1 * pow(normal, 2.0 / 3.0)));
        } else if (i % 4 == 3) {
            c.creepage.gamma1 = 0;
            c.creepage.gamma2 =
                ROUNDED(-0.5 * step * limit / ((double)c.row.f22_1 * pow(normal, 2.0 / 3.0)));
        }
        const struct kl_creep_force f = kl_creep_force(law, table, &c);
        struct kl_creep_contact m = c;
        m.creepage.gamma1 += ROUNDED(step * limit / ((double)c.row.f11_1 * pow(normal, 2.0 / 3.0)));
        m.creepage.gamma2 += ROUNDED(step * limit / ((double)c.row.f22_1 * pow(normal, 2.0 / 3.0)));
        m.creepage.omega3_1_m += ROUNDED(step * limit / ((double)c.row.f23_1 * normal));
        const struct kl_creep_force g = kl_creep_force(law, table, &m);
        const double moved = hypot((double)(f.t1_N - g.t1_N), (double)(f.t2_N - g.t2_N)) / limit;
        if (!(moved <= most)) {
            fail_msg("law %d, case %d: moved by %g mu N", (int)law, i, moved);
        }
    }
}

/* dT1/dgamma1 = -f11 and so on where creepages are small. */
static inline void creep_slopes(enum kl_creep_law law, const struct kl_creep_table *table,
                                const struct kl_creep_contact *c, double tolerance,
                                double spin_tolerance, double moment_tolerance) {
    const double normal = (double)c->normal_N;
    const double f11 = (double)c->row.f11_1 * pow(normal, 2.0 / 3.0);
    const double f22 = (double)c->row.f22_1 * pow(normal, 2.0 / 3.0);
    const double f23 = (double)c->row.f23_1 * normal;
    const double f33 = (double)c->row.f33_1 * pow(normal, 4.0 / 3.0);
    const double little = 1e-6 * 0.3 * normal;
    struct kl_creep_contact m = *c;
    m.creepage.gamma1 = ROUNDED(little / f11);
    struct kl_creep_force f = kl_creep_force(law, table, &m);
    assert_near((double)f.t1_N / little, -1.0, tolerance);
    m = *c;
    m.creepage.gamma2 = ROUNDED(little / f22);
    f = kl_creep_force(law, table, &m);
    assert_near((double)f.t2_N / little, -1.0, tolerance);
    assert_near((double)f.m3_Nm / (f23 / f22 * little), 1.0, moment_tolerance);
    m = *c;
    m.creepage.omega3_1_m = ROUNDED(little / f23);
    f = kl_creep_force(law, table, &m);
    assert_near((double)f.t2_N / little, -1.0, spin_tolerance);
    assert_near((double)f.m3_Nm / (f33 / f23 * little), -1.0, moment_tolerance);
}

/* `reduction` is 0..1, and no less than a slope unless that is above 1. */
static inline void creep_reduction(enum kl_creep_law law, const struct kl_creep_table *table, int n,
                                   double tolerance) {
    uint64_t seed = 33;
    for (int i = 0; i < n; i++) {
        const struct kl_creep_contact c = creep_anything(&seed, law, table);
        const double normal = (double)c.normal_N;
        const double step = 1e-6 * 0.3 * normal;
        const double f11 = (double)c.row.f11_1 * pow(normal, 2.0 / 3.0);
        const double f22 = (double)c.row.f22_1 * pow(normal, 2.0 / 3.0);
        const struct kl_creep_force f = kl_creep_force(law, table, &c);
        struct kl_creep_contact m = c;
        m.creepage.gamma1 += ROUNDED(step / f11);
        const double along = (double)(f.t1_N - kl_creep_force(law, table, &m).t1_N) / step;
        m = c;
        m.creepage.gamma2 += ROUNDED(step / f22);
        const double across = (double)(f.t2_N - kl_creep_force(law, table, &m).t2_N) / step;
        const double slope = fmin(fmax(along, across), 1.0);
        if (!((double)f.reduction >= slope - tolerance) ||
            !(f.reduction >= 0 && f.reduction <= 1)) {
            fail_msg("law %d, case %d: slopes %g, %g, reduction %g", (int)law, i, along, across,
                     (double)f.reduction);
        }
    }
}

/* The wheel lifts and comes back: forces go to 0 with N, without a step on the way. */
static inline void creep_unloading(enum kl_creep_law law, const struct kl_creep_table *table) {
    struct kl_creep_contact c = contact_of(law, table, 6e-3, 4e-3, 60e3, 0.3);
    c.creepage = (struct kl_creepage){ROUNDED(1e-3), ROUNDED(-2e-3), ROUNDED(0.3)};
    double last[3] = {0.0, 0.0, 0.0};
    for (int i = 0; i <= 100000; i++) {
        const double normal = 1e-4 * (double)i * (double)i * 1e-2;
        c.normal_N = ROUNDED(normal);
        const struct kl_creep_force f = kl_creep_force(law, table, &c);
        const double now[3] = {(double)f.t1_N, (double)f.t2_N, (double)f.m3_Nm};
        const double grown = 2e-6 * (double)i;
        for (int k = 0; k < 3; k++) {
            assert_at_most(fabs(now[k] - last[k]), 0.6 * grown + 1e-9);
            last[k] = now[k];
        }
        assert_at_most(hypot(now[0], now[1]), 0.3 * normal * (1.0 + 1e-12));
    }
    c.normal_N = ROUNDED(-1.0);
    const struct kl_creep_force none = kl_creep_force(law, table, &c);
    assert_true(none.t1_N == 0 && none.t2_N == 0 && none.m3_Nm == 0);
}

#endif
