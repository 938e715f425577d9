/* kl_creep.c - the laws in closed form, friction, the rows of a lookup table. */
#include "kl_creep.h"

#include "kl_creep_lanes.h"
#include "kl_diag.h"
#include "kl_geometry.h"
#include "kl_saturate.h"

/* ---- friction ---- */

struct kl_friction kl_friction_constant(kl_real mu0) {
    const struct kl_friction friction = {mu0, KL_R(1), KL_R(0), KL_R(1), KL_R(1)};
    return friction;
}

enum kl_status kl_friction_check(const struct kl_friction *f, struct kl_diag *diag) {
    if (f == NULL) {
        return KL_ERR_ARGUMENT;
    }
    if (!(f->mu0 >= KL_R(0) && f->mu0 <= KL_R(2))) {
        return kl_report(diag, KL_ERR_VALUE, "friction: mu must be in 0..2", -1, (double)f->mu0);
    }
    if (!(f->ratio >= KL_R(0) && f->ratio <= KL_R(1))) {
        return kl_report(diag, KL_ERR_VALUE, "friction: A must be in 0..1", -1, (double)f->ratio);
    }
    if (!(f->decay_s_m >= KL_R(0) && f->decay_s_m <= KL_R(100))) {
        return kl_report(diag, KL_ERR_VALUE, "friction: B must be in 0..100 s/m", -1,
                         (double)f->decay_s_m);
    }
    if (!(f->k_a >= KL_R(0.01) && f->k_a <= KL_R(1))) {
        return kl_report(diag, KL_ERR_VALUE, "friction: k_A must be in 0.01..1", -1,
                         (double)f->k_a);
    }
    if (!(f->k_s >= KL_R(0.01) && f->k_s <= f->k_a)) {
        return kl_report(diag, KL_ERR_VALUE, "friction: k_S must be in 0.01..k_A", -1,
                         (double)f->k_s);
    }
    return KL_OK;
}

kl_real kl_friction_at(const struct kl_friction *f, kl_real slip_m_s) {
    return kl_lane_first(kl_lane_friction(kl_lane_all(f->mu0), kl_lane_all(f->ratio),
                                          kl_lane_all(f->decay_s_m), kl_lane_all(slip_m_s)));
}

/* ---- the closed forms ---- */

/* The linear moment reduced as the force is, and no more than that of rigid spin. */
static inline kl_lane moment(const struct kl_creep_lanes *in, kl_lane reduction) {
    const kl_lane m3 = reduction * (in->y * in->shape[0] - in->p * in->shape[1]);
    return kl_lane_min(kl_lane_max(m3, -in->shape[2]), in->shape[2]);
}

static void shen_hedrick_elkins(const struct kl_creep_lanes *in, struct kl_creep_lanes_force *out) {
    const kl_lane across = in->y + in->p;
    const kl_lane reduction = kl_lane_saturate(in->x, across, kl_lane_all(KL_R(1)));
    out->t1 = -(reduction * in->x);
    out->t2 = -(reduction * across);
    out->m3 = moment(in, reduction);
    out->reduction = reduction;
}

/*
 * Polach. With s_yC = s_y + omega a where that is larger than s_y, eps = pi/4 |(x, y_C)| and
 *     T = mu N 2/pi (k_A eps/(1 + (k_A eps)^2) + atan (k_S eps)) against (s_x, s_y)/s_C
 *     K_M = |eps_S| (d^3/3 - d^2/2 + 1/6) - (1 - d^2)^(3/2)/3,   d = (eps_S^2 - 1)/(eps_S^2 + 1)
 * for the lateral force of spin. With d put in, K_M = -2/3 eps_S/(1 + eps_S^2)^2, and the force is
 * p |y_C|/(s_C (1 + eps_S^2)^2) in the units of y: what follows. His creep coefficient c_jj takes
 * the direction of (s_x, s_y); here it is that of (s_x, s_yC), which is the same without spin and
 * has a limit where s_x and s_y are 0. The sum of both forces can be more than mu N, and is
 * limited.
 */
static void polach(const struct kl_creep_lanes *in, struct kl_creep_lanes_force *out) {
    const kl_lane one = kl_lane_all(KL_R(1));
    const kl_lane least = kl_lane_all(KL_R(1e-15));
    const kl_lane k = KL_R(0.5) * (in->k_a + in->k_s);
    const kl_lane y_c = kl_lane_max(kl_lane_abs(in->y), kl_lane_abs(in->y + in->p * in->shape[3]));
    const kl_lane eps =
        kl_lane_max(KL_R(KL_PI / 4.0) * kl_lane_sqrt(in->x * in->x + y_c * y_c), least);
    const kl_lane adhesion = in->k_a * eps;
    const kl_lane force = KL_R(2.0 / KL_PI) * (adhesion / (KL_R(1) + adhesion * adhesion) +
                                               kl_lane_atan_positive(in->k_s * eps));
    const kl_lane s_x = in->x * in->shape[5]; /* slip, in the scale of y */
    const kl_lane s_c = kl_lane_max(kl_lane_sqrt(s_x * s_x + y_c * y_c), least);
    const kl_lane by = KL_R(1) / s_c;
    const kl_lane eps_s = in->shape[4] * y_c;
    const kl_lane fading = KL_R(1) / (KL_R(1) + eps_s * eps_s);
    const kl_lane spin = k * in->p * (fading * fading);
    const kl_lane t1 = force * (s_x * by);
    const kl_lane t2 = force * (in->y * by) + spin * (y_c * by);
    const kl_lane size = kl_lane_sqrt(t1 * t1 + t2 * t2);
    const kl_lane limited = KL_R(1) / kl_lane_max(size, one);
    const kl_lane across = in->y + in->p;
    const kl_lane linear = k * kl_lane_max(kl_lane_sqrt(in->x * in->x + across * across), least);
    out->t1 = -(t1 * limited);
    out->t2 = -(t2 * limited);
    out->m3 = moment(in, k * kl_lane_min(size * limited / linear, one));
    /* a bound on the slopes: of the creep force, which turns with the slip and not with x and y,
     * and falls as |y_C| grows, also where y is on the other side; and of the force of spin */
    const kl_lane skew = kl_lane_max(in->shape[5], KL_R(1) / in->shape[5]);
    const kl_lane against =
        kl_lane_max(-(in->y * (in->y + in->p * in->shape[3])), kl_lane_all(KL_R(0)));
    const kl_lane creep =
        skew * (KL_R(KL_PI / 4.0) * force / eps) * (KL_R(1) + against * (by * by));
    const kl_lane spins = kl_lane_abs(spin) * (by + KL_R(4) * in->shape[4] * (eps_s * fading));
    out->reduction = kl_lane_min(creep + spins, one);
}

void kl_lane_creep(enum kl_creep_law law, const struct kl_creep_table *table,
                   const struct kl_creep_lanes *in, struct kl_creep_lanes_force *out) {
    switch (law) {
    case KL_CREEP_POLACH:
        polach(in, out);
        break;
    case KL_CREEP_FASTSIM:
    case KL_CREEP_FASTSIM_ELLIPTIC:
        kl_lane_creep_fastsim(law == KL_CREEP_FASTSIM_ELLIPTIC, in, out);
        break;
    case KL_CREEP_TABLE:
        kl_lane_creep_table(table, in, out);
        break;
    case KL_CREEP_LINEAR:
    case KL_CREEP_SHE:
    default:
        shen_hedrick_elkins(in, out);
        break;
    }
}

/* ---- one contact ---- */

static struct kl_creep_force linear(const struct kl_creep_contact *c, kl_real normal) {
    const kl_real y = kl_inverse_cbrt(kl_max_real(normal, KL_R(1)));
    const kl_real two_thirds = normal * y;
    const struct kl_creep_row *row = &c->row;
    const struct kl_creep_coefficients f = {row->f11_1 * two_thirds, row->f22_1 * two_thirds,
                                            row->f23_1 * normal,
                                            row->f33_1 * (normal * (two_thirds * y))};
    const struct kl_creepage creepage = {
        kl_clamp(c->creepage.gamma1, KL_R(-KL_CREEP_MOST), KL_R(KL_CREEP_MOST)),
        kl_clamp(c->creepage.gamma2, KL_R(-KL_CREEP_MOST), KL_R(KL_CREEP_MOST)),
        kl_clamp(c->creepage.omega3_1_m, KL_R(-KL_CREEP_MOST), KL_R(KL_CREEP_MOST))};
    return kl_creep(KL_CREEP_LINEAR, &f, KL_R(0), normal, &creepage);
}

struct kl_creep_force kl_creep_force(enum kl_creep_law law, const struct kl_creep_table *table,
                                     const struct kl_creep_contact *c) {
    const kl_real normal = kl_clamp(c->normal_N, KL_R(0), KL_R(1e12));
    if (law == KL_CREEP_LINEAR) {
        return linear(c, normal);
    }
    const struct kl_creepage *g = &c->creepage;
    const kl_real most = KL_R(KL_CREEP_MOST);
    const kl_real along = kl_clamp(g->gamma1, -most, most);
    const kl_real across = kl_clamp(g->gamma2, -most, most);
    const kl_real slip = kl_sqrt_real(along * along + across * across);
    const kl_real mu = kl_friction_at(&c->friction, kl_clamp(c->speed_m_s, KL_R(0), most) * slip);
    const kl_real k = KL_R(0.5) * (c->friction.k_a + c->friction.k_s);
    const kl_real by =
        (law == KL_CREEP_POLACH ? KL_R(1) : k) / kl_max_real(mu, KL_R(KL_LEAST_FRICTION));
    const kl_real inv_cbrt = kl_inverse_cbrt(kl_max_real(normal, KL_R(1)));
    struct kl_creep_lanes in;
    struct kl_creep_lanes_force out;
    kl_lane_normalise(kl_lane_all(c->row.f11_1 * along), kl_lane_all(c->row.f22_1 * across),
                      kl_lane_all(c->row.f23_1 * kl_clamp(g->omega3_1_m, -most, most)),
                      kl_lane_all(by), kl_lane_all(inv_cbrt), &in);
    in.k_a = kl_lane_all(c->friction.k_a);
    in.k_s = kl_lane_all(c->friction.k_s);
    for (int i = 0; i < KL_CREEP_SHAPES; i++) {
        in.shape[i] = kl_lane_all(c->row.shape[i]);
    }
    kl_lane_creep(law, table, &in, &out);
    const kl_real limit = mu * normal;
    const kl_real third = normal * (inv_cbrt * inv_cbrt);
    const kl_real reduction = kl_lane_first(out.reduction);
    const struct kl_creep_force force = {
        limit * kl_lane_first(out.t1), limit * kl_lane_first(out.t2),
        limit * third * kl_lane_first(out.m3), law == KL_CREEP_POLACH ? reduction : k * reduction};
    return force;
}

/* ---- rows ---- */

/* Where a/b is between the table's ratios, and the coefficients there: ln C linear in ln a/b. */
static double place(const struct kl_creep_table *table, double a_over_b, struct kl_kalker *c) {
    const double log = kl_log(a_over_b);
    uint32_t i = 0;
    while (i + 2 < table->n_ratio && log >= table->log_ratio[i + 1]) {
        i++;
    }
    const double width = table->log_ratio[i + 1] - table->log_ratio[i];
    double t = (log - table->log_ratio[i]) / width;
    t = t < 0.0 ? 0.0 : (t > 1.0 ? 1.0 : t);
    const double *low = table->log_c_ij[i];
    const double *high = table->log_c_ij[i + 1];
    c->c11 = kl_exp(low[0] + t * (high[0] - low[0]));
    c->c22 = kl_exp(low[1] + t * (high[1] - low[1]));
    c->c23 = kl_exp(low[2] + t * (high[2] - low[2]));
    return (double)i + t;
}

static void closed_shape(const struct kl_kalker *k, double a, double b, kl_real *shape) {
    const double c = kl_sqrt(a * b);
    shape[0] = (kl_real)(c * k->c23 / k->c22);
    shape[1] = (kl_real)(c * k->c33 / k->c23);
    shape[2] = (kl_real)(c * kl_spin_moment(a / b));
    shape[3] = (kl_real)(a * k->c22 / (c * k->c23));
    shape[4] =
        (kl_real)(8.0 / 3.0 * (b / c) * (k->c23 / k->c22) / (1.0 + 6.3 * (1.0 - kl_exp(-a / b))));
    shape[5] = (kl_real)(k->c22 / k->c11);
}

enum kl_status kl_creep_row_build(enum kl_creep_law law, const struct kl_creep_table *table,
                                  const struct kl_ellipse *ellipse,
                                  const struct kl_material *material, struct kl_creep_row *row) {
    if (ellipse == NULL || material == NULL || row == NULL || (int)law < 0 ||
        (int)law >= KL_CREEP_LAWS || (law == KL_CREEP_TABLE && table == NULL)) {
        return KL_ERR_ARGUMENT;
    }
    const double a = ellipse->semi_a_1;
    const double b = ellipse->semi_b_1;
    const double c = kl_sqrt(a * b);
    const double cc = a * b;
    const double g = material->shear_modulus_Pa;
    struct kl_kalker k = kl_kalker_coefficients(a / b, material->poisson);
    for (int i = 0; i < KL_CREEP_SHAPES; i++) {
        row->shape[i] = KL_R(0);
    }
    if (law == KL_CREEP_TABLE) {
        const double longer = a > b ? a / b : b / a;
        row->shape[0] = (kl_real)place(table, a / b, &k);
        row->shape[1] = (kl_real)(kl_sqrt(k.c11 * k.c22) / k.c23 * kl_sqrt(longer));
        row->shape[2] = (kl_real)(c * kl_spin_moment(a / b));
    } else if (law == KL_CREEP_FASTSIM || law == KL_CREEP_FASTSIM_ELLIPTIC) {
        row->shape[0] = (kl_real)a;
        row->shape[1] = (kl_real)b;
        row->shape[2] = (kl_real)(b / a);
    } else {
        closed_shape(&k, a, b, row->shape);
    }
    row->f11_1 = (kl_real)(g * cc * k.c11);
    row->f22_1 = (kl_real)(g * cc * k.c22);
    row->f23_1 = (kl_real)(g * cc * c * k.c23);
    row->f33_1 = (kl_real)(g * cc * cc * k.c33);
    return KL_OK;
}
