/* kl_flange.c - where a flange meets the gauge face. */
#include "kl_flange.h"

#include "kl_math.h"

/* One side at one height and roll, as in kl_tangency.c. A wheel's point (eta_w, zeta_w) stands on
 * the rail's level base + zeta_w cosine - eta_w turn. */
struct setting {
    const struct kl_contact_side *side;
    double base;
    double cosine;
    double sine;
    double turn;           /* sine, or 0 under the printed equations */
    double radius;         /* that turns a point aside: at zeta_w = 0 */
    double radius_by_zeta; /* and with zeta_w */
};

/* A point of the flange on the gauge face at its own level. */
struct meeting {
    double eta_w;
    double eta_r;
    double place;    /* W */
    double slope;    /* of the rail */
    double residual; /* dW/deta_w: 0 where both are tangent */
};

static struct setting set(const struct kl_tangency *t, const struct kl_contact_side *side,
                          double height, double phi_s) {
    struct setting s = {side, height + side->rise0_m, 1.0, phi_s, 0.0, side->radius0_m, 0.0};
    if (t->kinematics == KL_KINEMATICS_RIGID) {
        const double cosine = kl_cos(phi_s);
        const double sine = kl_sin(phi_s);
        s.base += side->spacing_m * sine - (side->spacing_m - side->eta0_m) * phi_s -
                  side->radius_m * (1.0 - cosine);
        s.cosine = cosine;
        s.sine = sine;
        s.turn = sine;
        s.radius = side->radius_m;
        s.radius_by_zeta = 1.0;
    }
    return s;
}

static double level_of(const struct setting *s, double eta_w, double zeta_w) {
    return s->base + zeta_w * s->cosine - eta_w * s->turn;
}

/* First sample of the rail inboard of its top. */
static uint32_t gauge_side(const struct kl_contact_side *side) {
    uint32_t top = 0;
    for (uint32_t i = 1; i < KL_RAIL_SAMPLES; i++) {
        top = side->rail_zeta[i] < side->rail_zeta[top] ? i : top;
    }
    return top;
}

static double place_of(const struct setting *s, double eta_w, double zeta_w, double eta_r) {
    const double spacing = s->side->spacing_m;
    return s->side->offset_m + spacing - (spacing - eta_w) * s->cosine - eta_r +
           s->sine * (s->radius + s->radius_by_zeta * zeta_w);
}

/* The exact meeting of one point of the wheel, from a place on the rail nearby. */
static struct meeting meet(const struct setting *s, double eta_w, double eta_r) {
    const struct kl_profile_point pw = kl_profile_at(&s->side->wheel, eta_w);
    const double level = level_of(s, eta_w, pw.zeta_m);
    struct kl_profile_point pr = kl_profile_at(&s->side->rail, eta_r);
    for (int i = 0; i < 4 && pr.slope > 1e-3; i++) {
        eta_r -= (pr.zeta_m - level) / pr.slope;
        pr = kl_profile_at(&s->side->rail, eta_r);
    }
    const struct meeting m = {eta_w, eta_r, place_of(s, eta_w, pw.zeta_m, eta_r), pr.slope,
                              s->cosine + s->turn * pw.slope -
                                  (pw.slope * s->cosine - s->turn) / pr.slope};
    return m;
}

/* Tangency between two samples beside the least one: halving and the secant by turns. */
static struct meeting refine(const struct setting *s, double step, struct meeting middle) {
    struct meeting low = meet(s, middle.eta_w - step, middle.eta_r);
    struct meeting high = meet(s, middle.eta_w + step, middle.eta_r);
    if (!(low.residual < 0.0 && high.residual > 0.0)) {
        return middle;
    }
    for (int i = 0; i < KL_FLANGE_ROUNDS && high.eta_w - low.eta_w > 1e-14; i++) {
        const double part = i % 3 == 2 ? 0.5 : low.residual / (low.residual - high.residual);
        const double eta = low.eta_w + part * (high.eta_w - low.eta_w);
        if (!(eta > low.eta_w && eta < high.eta_w)) {
            break;
        }
        middle = meet(s, eta, middle.eta_r);
        if (middle.residual < 0.0) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return middle;
}

int kl_flange_solve(const struct kl_tangency *t, enum kl_side side_index, double height_m,
                    double phi_s_rad, struct kl_flange_contact *contact) {
    const struct kl_contact_side *side = &t->side[side_index];
    const struct setting s = set(t, side, height_m, phi_s_rad);
    const uint32_t top = gauge_side(side);
    double least = 1e9;
    uint32_t at = 0;
    double eta_r_at = 0.0;
    uint32_t j = top;
    /* levels rise with the flange down to its tip, so the rail is passed through once */
    double before = -1e9;
    for (uint32_t i = side->flange_at; i < KL_WHEEL_SAMPLES; i++) {
        const double eta_w = side->wheel.eta_min_m + side->wheel_step_m * (double)i;
        const double zeta_w = side->wheel_zeta[i];
        const double level = level_of(&s, eta_w, zeta_w);
        if (level < before) {
            break; /* beyond the tip */
        }
        before = level;
        if (level < side->rail_zeta[top]) {
            continue; /* above the rail */
        }
        while (j + 1u < KL_RAIL_SAMPLES && side->rail_zeta[j + 1u] < level) {
            j++;
        }
        if (j + 1u >= KL_RAIL_SAMPLES) {
            break; /* below the profile */
        }
        const double rise = side->rail_zeta[j + 1u] - side->rail_zeta[j];
        const double part = rise > 0.0 ? (level - side->rail_zeta[j]) / rise : 0.0;
        const double eta_r = side->rail.eta_min_m + side->rail_step_m * ((double)j + part);
        const double place = place_of(&s, eta_w, zeta_w, eta_r);
        if (place < least) {
            least = place;
            at = i;
            eta_r_at = eta_r;
        }
    }
    if (least > 1e8) {
        return 0;
    }
    const double eta_w = side->wheel.eta_min_m + side->wheel_step_m * (double)at;
    const struct meeting m = refine(&s, side->wheel_step_m, meet(&s, eta_w, eta_r_at));
    contact->place_m = m.place;
    contact->eta_wheel_m = m.eta_w;
    contact->eta_rail_m = m.eta_r;
    contact->slope = m.slope;
    return 1;
}
