/* kl_tangency.c - search for the contact that touches first, then Newton-Raphson on the tangency
 * equations. */
#include "kl_tangency.h"

#include "kl_diag.h"
#include "kl_math.h"

#define REFINE_ROUNDS 60

/* One side at a trial posture: everything the Newton step needs. */
struct side_terms {
    double eta_w;
    double eta_r;
    double height;   /* H */
    double residual; /* F = delta_w - delta_r - phi_s */
    double f_eta;    /* dF/deta_w */
    double f_phi;    /* dF/dphi_s */
    double f_w;      /* dF/dw */
    double h_eta;
    double h_phi;
    double h_w;
};

static int is_rigid(const struct kl_tangency *t) {
    return t->kinematics == KL_KINEMATICS_RIGID;
}

/*
 * The wheel turned about the axle by phi_s. A point q outboard of the axle's middle and rho below it
 * comes to w + q cos - rho sin and u_z + q sin + rho cos: all of it, for on the flange phi reaches
 * 10 mrad, where q (1 - cos) = 40 um turns into as much of the rolling radius. The printed equations
 * stop at the first order and leave out the contact's own eta and zeta.
 */
struct turn {
    double sine;
    double cosine;
};

static struct turn turn_of(const struct kl_tangency *t, double phi_s) {
    const struct turn rigid = {kl_sin(phi_s), kl_cos(phi_s)};
    const struct turn printed = {phi_s, 1.0};
    return is_rigid(t) ? rigid : printed;
}

/* rho of a point, as far as the kinematics know it. */
static double turning_radius(const struct kl_tangency *t, const struct kl_contact_side *side,
                             double zeta_w) {
    return is_rigid(t) ? side->radius_m + zeta_w : side->radius0_m;
}

static double rail_eta_at(const struct kl_contact_side *side, struct turn turn, double w,
                          double eta_w, double rho) {
    return side->offset_m + side->spacing_m - w - (side->spacing_m - eta_w) * turn.cosine +
           rho * turn.sine;
}

double kl_tangency_rail_eta(const struct kl_tangency *tangency, enum kl_side side_index, double w,
                            double phi_s, double eta_w) {
    const struct kl_contact_side *side = &tangency->side[side_index];
    const double zeta_w = kl_profile_at(&side->wheel, eta_w).zeta_m;
    return rail_eta_at(side, turn_of(tangency, phi_s), w, eta_w,
                       turning_radius(tangency, side, zeta_w));
}

#define NO_RAIL_UNDER 1e9

/* The ride height that every sampled point of the wheel would allow, and the lowest of them. */
static double sample_gaps(const struct kl_tangency *t, const struct kl_contact_side *side, double w,
                          double phi_s) {
    /* the rail's place under a sample is linear in the sample, but for the turning of the wheel */
    const double inv_step = 1.0 / side->rail_step_m;
    const struct turn turn = turn_of(t, phi_s);
    const double turning = is_rigid(t) ? turn.sine : 0.0;
    const double first =
        rail_eta_at(side, turn, w, side->wheel.eta_min_m, turning_radius(t, side, 0.0)) -
        side->rail.eta_min_m;
    double lowest = NO_RAIL_UNDER;
    for (uint32_t i = 0; i < side->searched; i++) {
        const double along = side->wheel_step_m * (double)i;
        const double zeta_w = side->wheel_zeta[i];
        const double place = (first + along * turn.cosine + turning * zeta_w) * inv_step;
        double gap = NO_RAIL_UNDER;
        if (place >= 0.0 && place < (double)(KL_RAIL_SAMPLES - 1u)) {
            const uint32_t j = (uint32_t)place;
            const double fraction = place - (double)j;
            const double rise = side->rail_zeta[j + 1] - side->rail_zeta[j];
            const double m0 = side->rail_slope[j];
            const double m1 = side->rail_slope[j + 1];
            const double bend =
                3.0 * rise - 2.0 * m0 - m1 + fraction * (m0 + m1 - 2.0 * rise); /* Hermite cubic */
            const double zeta_r = side->rail_zeta[j] + fraction * (m0 + fraction * bend);
            /* the turning of the wheel decides where it touches, also under the printed equations
             */
            gap = zeta_r - zeta_w * turn.cosine +
                  turn.sine * (side->wheel.eta_min_m + along - side->eta0_m);
        }
        side->gap[i] = gap;
        lowest = gap < lowest ? gap : lowest;
    }
    return lowest;
}

static struct side_terms terms_at(const struct kl_tangency *t, const struct kl_contact_side *side,
                                  double w, double phi_s, double eta_w) {
    const struct kl_profile_point pw = kl_profile_at(&side->wheel, eta_w);
    const double rho = turning_radius(t, side, pw.zeta_m);
    const struct turn turn = turn_of(t, phi_s);
    const double f = is_rigid(t) ? 1.0 : 0.0;
    const double q = side->spacing_m - eta_w;
    const double l = side->spacing_m - side->eta0_m;
    const double eta_r = rail_eta_at(side, turn, w, eta_w, rho);
    const struct kl_profile_point pr = kl_profile_at(&side->rail, eta_r);
    const double along = turn.cosine + f * turn.sine * pw.slope; /* deta_r/deta_w */
    const double round = rho * turn.cosine + f * q * turn.sine;  /* deta_r/dphi */
    const double bend_w = pw.second_1_m / (1.0 + pw.slope * pw.slope);
    const double bend_r = pr.second_1_m / (1.0 + pr.slope * pr.slope);
    /* l phi - q sin phi + rho (1 - cos phi): what turning does to u_z + l phi */
    const double lift = f * (l * phi_s - q * turn.sine + rho * (1.0 - turn.cosine));
    const double lift_phi = f * (l - q * turn.cosine + rho * turn.sine);
    const struct side_terms terms = {.eta_w = eta_w,
                                     .eta_r = eta_r,
                                     .height = pr.zeta_m - pw.zeta_m + lift - side->rise0_m,
                                     .residual = kl_atan(pw.slope) - kl_atan(pr.slope) - phi_s,
                                     .f_eta = bend_w - bend_r * along,
                                     .f_phi = -bend_r * round - 1.0,
                                     .f_w = bend_r,
                                     .h_eta =
                                         pr.slope * along - pw.slope * turn.cosine + f * turn.sine,
                                     .h_phi = pr.slope * round + lift_phi,
                                     .h_w = -pr.slope};
    return terms;
}

/*
 * The tangency F = 0 between two samples around a local minimum of the gap: F falls from + to -
 * there. Newton, kept inside the bracket by halving. Where the samples do not bracket a root the
 * sample itself stands.
 */
static struct side_terms refine(const struct kl_tangency *t, const struct kl_contact_side *side,
                                double w, double phi_s, double low, double middle, double high) {
    struct side_terms now = terms_at(t, side, w, phi_s, middle);
    if (!(terms_at(t, side, w, phi_s, low).residual > 0.0 &&
          terms_at(t, side, w, phi_s, high).residual < 0.0)) {
        return now;
    }
    for (int i = 0; i < REFINE_ROUNDS; i++) {
        if (now.residual > 0.0) {
            low = now.eta_w;
        } else {
            high = now.eta_w;
        }
        double next = now.f_eta < 0.0 ? now.eta_w - now.residual / now.f_eta : low;
        if (!(next > low && next < high)) {
            next = 0.5 * (low + high);
        }
        if (kl_abs(next - now.eta_w) < 1e-15) {
            break;
        }
        now = terms_at(t, side, w, phi_s, next);
    }
    return now;
}

/* Contact with the edge at which a wheel was cut off: a point of the wheel, whatever the angles. */
static struct side_terms edge_terms(const struct kl_tangency *t, const struct kl_contact_side *side,
                                    double w, double phi_s, double eta_w) {
    struct side_terms edge = terms_at(t, side, w, phi_s, eta_w);
    edge.f_eta = 0.0;
    return edge;
}

/*
 * The contact that touches first: smallest ride height over all points of the wheel. All local
 * minima within `close` of the best sample are refined, so that two nearly equal contacts are told
 * apart exactly.
 */
static int touch_first(const struct kl_tangency *t, const struct kl_contact_side *side, double w,
                       double phi_s, struct side_terms *best) {
    const double close = 1e-6;
    const double lowest = sample_gaps(t, side, w, phi_s);
    const double *gap = side->gap;
    int found = 0;
    int refined = 0;
    /* a minimum at a profile's end, where its neighbour has no rail under it, is no contact */
    const uint32_t last = side->searched - 1u;
    for (uint32_t i = 1; i < last && refined < 8; i++) {
        if (gap[i] <= lowest + close && gap[i] <= gap[i - 1u] && gap[i] < gap[i + 1u] &&
            gap[i - 1u] < NO_RAIL_UNDER && gap[i + 1u] < NO_RAIL_UNDER) {
            const double middle = side->wheel.eta_min_m + side->wheel_step_m * (double)i;
            const struct side_terms candidate =
                refine(t, side, w, phi_s, middle - 2.0 * side->wheel_step_m, middle,
                       middle + 2.0 * side->wheel_step_m);
            if (!found || candidate.height < best->height) {
                *best = candidate;
            }
            found = 1;
            refined++;
        }
    }
    if (last + 1u < KL_WHEEL_SAMPLES && gap[last] <= lowest + close && gap[last] < gap[last - 1u]) {
        const struct side_terms edge = edge_terms(
            t, side, w, phi_s, side->wheel.eta_min_m + side->wheel_step_m * (double)last);
        *best = !found || edge.height < best->height ? edge : *best;
        found = 1;
    }
    return found;
}

/* How H of one side follows phi and w, the contact point sliding along so that F stays 0. */
struct follow {
    double by_phi;
    double by_w;
    double by_residual;
};

static struct follow follow_of(const struct side_terms *s) {
    struct follow f = {s->h_phi, s->h_w, 0.0};
    if (s->f_eta < -1e-6) {
        const double ratio = s->h_eta / s->f_eta;
        f.by_phi -= ratio * s->f_phi;
        f.by_w -= ratio * s->f_w;
        f.by_residual = -ratio;
    }
    return f;
}

/* Newton on all three unknowns (both contact points and phi) at once; stops when it no longer
 * moves. */
static void polish(const struct kl_tangency *t, double u, struct side_terms terms[KL_SIDES],
                   double *phi) {
    const double base = t->side[KL_RIGHT].half_base_m + t->side[KL_LEFT].half_base_m;
    for (int round = 0; round < 3; round++) {
        struct side_terms *r = &terms[KL_RIGHT];
        struct side_terms *l = &terms[KL_LEFT];
        if (!(r->f_eta < -1e-6 && l->f_eta < -1e-6)) {
            return;
        }
        const struct follow fr = follow_of(r);
        const struct follow fl = follow_of(l);
        const double miss = *phi * base - (r->height - l->height);
        const double change = (fr.by_residual * r->residual - fl.by_residual * l->residual - miss) /
                              (base - (fr.by_phi + fl.by_phi));
        const double move_r = -(r->residual + r->f_phi * change) / r->f_eta;
        const double move_l = -(l->residual - l->f_phi * change) / l->f_eta;
        if (!(kl_abs(move_r) < 1e-5 && kl_abs(move_l) < 1e-5 && kl_abs(change) < 1e-5)) {
            return; /* the bracketed solution stands */
        }
        *phi += change;
        *r = terms_at(t, &t->side[KL_RIGHT], u, *phi, r->eta_w + move_r);
        *l = terms_at(t, &t->side[KL_LEFT], -u, -*phi, l->eta_w + move_l);
    }
}

static void finish(const struct kl_tangency *t, const struct side_terms terms[KL_SIDES], double phi,
                   struct kl_touch *touch) {
    const double base = t->side[KL_RIGHT].half_base_m + t->side[KL_LEFT].half_base_m;
    const struct follow fr = follow_of(&terms[KL_RIGHT]);
    const struct follow fl = follow_of(&terms[KL_LEFT]);
    touch->phi_rad = phi;
    touch->phi_y_rad_m = (fr.by_w + fl.by_w) / (base - (fr.by_phi + fl.by_phi));
    touch->height_w[KL_RIGHT] = fr.by_w + fr.by_phi * touch->phi_y_rad_m;
    touch->height_w[KL_LEFT] = fl.by_w + fl.by_phi * touch->phi_y_rad_m;
    for (int s = 0; s < KL_SIDES; s++) {
        touch->height_m[s] = terms[s].height;
        touch->eta_wheel_m[s] = terms[s].eta_w;
    }
}

/*
 * phi * 2l = H_r - H_l is monotonic in phi as long as the wheelset does not jam between the rails,
 * and continuous even where a contact jumps: Newton, with a bracket to fall back on.
 */
enum kl_status kl_tangency_solve(const struct kl_tangency *t, double u, struct kl_touch *touch,
                                 struct kl_diag *diag) {
    const double base = t->side[KL_RIGHT].half_base_m + t->side[KL_LEFT].half_base_m;
    struct side_terms terms[KL_SIDES];
    double phi = touch->phi_rad;
    double low = -0.1;
    double high = 0.1;
    int converged = 0;
    for (int round = 0; round < KL_POSTURE_ROUNDS && !converged; round++) {
        if (!touch_first(t, &t->side[KL_RIGHT], u, phi, &terms[KL_RIGHT]) ||
            !touch_first(t, &t->side[KL_LEFT], -u, -phi, &terms[KL_LEFT])) {
            return kl_report(diag, KL_ERR_CONTACT,
                             "the contact runs off a profile's end at this displacement", -1, u);
        }
        const double slope =
            base - (follow_of(&terms[KL_RIGHT]).by_phi + follow_of(&terms[KL_LEFT]).by_phi);
        const double miss = phi * base - (terms[KL_RIGHT].height - terms[KL_LEFT].height);
        if (miss > 0.0) {
            high = phi;
        } else {
            low = phi;
        }
        double next = phi - miss / slope;
        if (!(slope > 0.05 * base)) {
            return kl_report(diag, KL_ERR_CONTACT, "the wheelset jams between the rails", -1, u);
        }
        if (!(next >= low && next <= high) || round > 12) {
            next = 0.5 * (low + high);
        }
        converged = kl_abs(next - phi) < 1e-11 || high - low < 1e-11;
        phi = converged ? phi : next;
    }
    if (!converged) {
        return kl_report(diag, KL_ERR_CONVERGE, "roll of the wheelset did not converge", -1, u);
    }
    polish(t, u, terms, &phi);
    finish(t, terms, phi, touch);
    return KL_OK;
}

/* ---- preparation ---- */

/* Where the rail's eta = 0 stands for a given gauge: its gauge face is `depth` below the highest
 * point of the head. */
static enum kl_status spacing_by_gauge(const struct kl_rail_def *def, const struct kl_profile *rail,
                                       double *spacing, struct kl_diag *diag) {
    const uint32_t n = 20000;
    const double step = (rail->eta_max_m - rail->eta_min_m) / (double)n;
    double top = 1e9;
    uint32_t top_i = 0;
    for (uint32_t i = 0; i <= n; i++) {
        const double z = kl_profile_at(rail, rail->eta_min_m + step * (double)i).zeta_m;
        if (z < top) {
            top = z;
            top_i = i;
        }
    }
    double before = top;
    for (uint32_t i = top_i + 1u; i <= n; i++) {
        const double z = kl_profile_at(rail, rail->eta_min_m + step * (double)i).zeta_m;
        if (z >= top + def->gauge_depth_m) {
            const double part = (top + def->gauge_depth_m - before) / (z - before);
            *spacing = 0.5 * def->gauge_m + rail->eta_min_m + step * ((double)i - 1.0 + part);
            return KL_OK;
        }
        before = z;
    }
    return kl_report(diag, KL_ERR_PROFILE,
                     "rail profile does not reach down to the depth at which the gauge is measured",
                     -1, def->gauge_depth_m);
}

static enum kl_status prepare_side(const struct kl_wheel_def *wheel, const struct kl_rail_def *rail,
                                   struct kl_arena *arena, struct kl_contact_side *side,
                                   struct kl_diag *diag) {
    if (!(wheel->radius_m > 0.05 && wheel->radius_m < 2.0)) {
        return kl_report(diag, KL_ERR_VALUE, "wheel radius_m must be in 0.05..2", -1,
                         wheel->radius_m);
    }
    if (!(wheel->half_spacing_m > 0.1 && wheel->half_spacing_m < 2.0)) {
        return kl_report(diag, KL_ERR_VALUE, "wheel half_spacing_m must be in 0.1..2", -1,
                         wheel->half_spacing_m);
    }
    enum kl_status status = kl_profile_build(&wheel->profile, 0.0, arena, &side->wheel, diag);
    if (status == KL_OK) {
        status = kl_profile_build(&rail->profile, rail->cant_rad, arena, &side->rail, diag);
    }
    if (status != KL_OK) {
        return status;
    }
    double spacing = rail->half_spacing_m;
    if (!(spacing >= 0.0 && spacing < 2.0)) {
        return kl_report(diag, KL_ERR_VALUE, "rail half_spacing_m must be in 0..2", -1, spacing);
    }
    if (spacing == 0.0) {
        if (!(rail->gauge_m > 0.2 && rail->gauge_m < 3.0 && rail->gauge_depth_m > 0.0 &&
              rail->gauge_depth_m < 0.05)) {
            return kl_report(diag, KL_ERR_VALUE,
                             "rail gauge_m must be in 0.2..3 and gauge_depth_m in 0..0.05", -1,
                             rail->gauge_m);
        }
        status = spacing_by_gauge(rail, &side->rail, &spacing, diag);
        if (status != KL_OK) {
            return status;
        }
    }
    side->radius_m = wheel->radius_m;
    side->spacing_m = wheel->half_spacing_m;
    side->offset_m = spacing - wheel->half_spacing_m;
    return KL_OK;
}

static enum kl_status sample_side(struct kl_arena *arena, struct kl_contact_side *side,
                                  struct kl_diag *diag) {
    side->wheel_zeta = kl_arena_take(arena, KL_WHEEL_SAMPLES, sizeof(double));
    side->rail_zeta = kl_arena_take(arena, KL_RAIL_SAMPLES, sizeof(double));
    side->rail_slope = kl_arena_take(arena, KL_RAIL_SAMPLES, sizeof(double));
    side->gap = kl_arena_take(arena, KL_WHEEL_SAMPLES, sizeof(double));
    if (side->wheel_zeta == NULL || side->rail_zeta == NULL || side->rail_slope == NULL ||
        side->gap == NULL) {
        return kl_report(diag, KL_ERR_MEMORY, "profile samples", -1, (double)arena->wanted);
    }
    side->wheel_step_m =
        (side->wheel.eta_max_m - side->wheel.eta_min_m) / (double)(KL_WHEEL_SAMPLES - 1u);
    side->rail_step_m =
        (side->rail.eta_max_m - side->rail.eta_min_m) / (double)(KL_RAIL_SAMPLES - 1u);
    for (uint32_t i = 0; i < KL_WHEEL_SAMPLES; i++) {
        const double eta = side->wheel.eta_min_m + side->wheel_step_m * (double)i;
        side->wheel_zeta[i] = kl_profile_at(&side->wheel, eta).zeta_m;
    }
    for (uint32_t i = 0; i < KL_RAIL_SAMPLES; i++) {
        const double eta = side->rail.eta_min_m + side->rail_step_m * (double)i;
        const struct kl_profile_point point = kl_profile_at(&side->rail, eta);
        side->rail_zeta[i] = point.zeta_m;
        side->rail_slope[i] = point.slope * side->rail_step_m;
    }
    return KL_OK;
}

/* The flange: inboard of the central contact, what is nearly as steep as its steepest. */
static uint32_t find_flange(const struct kl_contact_side *side) {
    double steepest = 0.0;
    uint32_t first = KL_WHEEL_SAMPLES;
    for (int pass = 0; pass < 2; pass++) {
        for (uint32_t i = KL_WHEEL_SAMPLES; i-- > 0;) {
            const double eta = side->wheel.eta_min_m + side->wheel_step_m * (double)i;
            const double angle = kl_atan(kl_profile_at(&side->wheel, eta).slope);
            if (eta > side->eta0_m && pass == 0) {
                steepest = angle > steepest ? angle : steepest;
            } else if (eta > side->eta0_m && angle >= steepest - KL_FLANGE_SPREAD_RAD) {
                first = i;
            }
        }
        if (steepest < KL_FLANGE_LEAST_RAD) {
            return KL_WHEEL_SAMPLES;
        }
    }
    return first;
}

void kl_tangency_treads_only(struct kl_tangency *tangency) {
    for (int s = 0; s < KL_SIDES; s++) {
        tangency->side[s].searched = tangency->side[s].flange_at;
    }
}

/* Step one: the central contact, with phi = 0, sets the origin of the data. */
static enum kl_status centre_side(struct kl_tangency *t, struct kl_contact_side *side,
                                  struct kl_diag *diag) {
    struct side_terms central;
    side->eta0_m = 0.0;
    side->rise0_m = 0.0;
    side->radius0_m = side->radius_m;
    side->half_base_m = side->spacing_m;
    side->searched = KL_WHEEL_SAMPLES;
    if (!touch_first(t, side, 0.0, 0.0, &central)) {
        return kl_report(diag, KL_ERR_CONTACT, "wheel and rail do not touch when central", -1, 0.0);
    }
    side->eta0_m = central.eta_w;
    side->rise0_m = central.height;
    side->radius0_m = side->radius_m + kl_profile_at(&side->wheel, central.eta_w).zeta_m;
    side->half_base_m = side->spacing_m - central.eta_w;
    side->flange_at = find_flange(side);
    return KL_OK;
}

static int same_profile(const struct kl_profile_def *a, const struct kl_profile_def *b) {
    if (a->kind != b->kind) {
        return 0;
    }
    if (a->kind == KL_PROFILE_ARC) {
        return a->radius_m == b->radius_m && a->slope_rad == b->slope_rad &&
               a->half_width_m == b->half_width_m;
    }
    if (a->n_points != b->n_points || a->smoothing_m != b->smoothing_m) {
        return 0;
    }
    if (a->eta_m == b->eta_m && a->zeta_m == b->zeta_m) {
        return 1;
    }
    for (uint32_t i = 0; i < a->n_points; i++) {
        if (a->eta_m[i] != b->eta_m[i] || a->zeta_m[i] != b->zeta_m[i]) {
            return 0;
        }
    }
    return 1;
}

static int is_symmetric(const struct kl_pair_def *def) {
    const struct kl_wheel_def *w = def->wheel;
    const struct kl_rail_def *r = def->rail;
    return w[0].radius_m == w[1].radius_m && w[0].half_spacing_m == w[1].half_spacing_m &&
           r[0].cant_rad == r[1].cant_rad && r[0].half_spacing_m == r[1].half_spacing_m &&
           r[0].gauge_m == r[1].gauge_m && r[0].gauge_depth_m == r[1].gauge_depth_m &&
           same_profile(&w[0].profile, &w[1].profile) && same_profile(&r[0].profile, &r[1].profile);
}

enum kl_status kl_tangency_build(const struct kl_pair_def *def, struct kl_arena *arena,
                                 struct kl_tangency *t, struct kl_diag *diag) {
    t->kinematics = def->kinematics;
    t->material = def->material;
    t->symmetric = is_symmetric(def);
    for (int s = 0; s < KL_SIDES; s++) {
        struct kl_contact_side *side = &t->side[s];
        if (s == KL_LEFT && t->symmetric) {
            *side = t->side[KL_RIGHT]; /* searched one after the other, so they share the scratch */
            break;
        }
        enum kl_status status = prepare_side(&def->wheel[s], &def->rail[s], arena, side, diag);
        if (status == KL_OK) {
            status = sample_side(arena, side, diag);
        }
        if (status == KL_OK) {
            status = centre_side(t, side, diag);
        }
        if (status != KL_OK) {
            return status;
        }
    }
    return KL_OK;
}
