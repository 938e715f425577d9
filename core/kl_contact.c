/* kl_contact.c - Hertz, Kalker, creep forces. */
#include "kl_contact.h"

#include "kl_math.h"
#include "kl_saturate.h"

/* Complete elliptic integrals for the modulus e with k = sqrt(1 - e^2): K, and D = (K - E)/e^2, by
 * the arithmetic-geometric mean. */
struct elliptic {
    double k;
    double d;
};

static struct elliptic elliptic(double k_complement) {
    double a = 1.0;
    double g = k_complement;
    /* (K - E)/e^2 = K (1/2 + sum 2^(n-1) c_n^2 / e^2); c_1^2/e^2 = (1 - k)/(4 (1 + k)) */
    double ratio = (1.0 - k_complement) / (4.0 * (1.0 + k_complement));
    double sum = 0.5;
    double power = 1.0;
    for (int i = 0; i < 8; i++) {
        sum += power * ratio;
        const double mean = 0.5 * (a + g);
        g = kl_sqrt(a * g);
        const double c = a - mean; /* = c_{n+1}; the next one is half of mean - g */
        const double shrink = c > 0.0 ? 0.5 * (mean - g) / c : 0.0;
        ratio *= shrink * shrink;
        a = mean;
        power *= 2.0;
    }
    const double k = KL_PI / (2.0 * a);
    const struct elliptic result = {k, k * sum};
    return result;
}

/* Ratio of the relative curvatures (across the minor axis over across the major axis) for
 * minor/major = k. */
static double curvature_ratio(double k) {
    const struct elliptic e = elliptic(k);
    return (e.k - e.d) / (k * k * e.d);
}

/* An ellipse without regard to which way it lies. */
struct patch {
    double major; /* semi-axis at 1 N */
    double ratio; /* minor over major */
};

static struct patch patch_of(double small, double large, double lowest_ratio, double effective_Pa) {
    double low = lowest_ratio;
    double high = 1.0;
    const double limit = large / curvature_ratio(low);
    small = small < limit ? limit : small;
    for (int i = 0; i < 60; i++) {
        const double middle = 0.5 * (low + high);
        if (curvature_ratio(middle) > large / small) {
            low = middle;
        } else {
            high = middle;
        }
    }
    const double k = 0.5 * (low + high);
    /* Johnson, Contact Mechanics, (4.26): major^3 = 3 N D / (2 pi E* small) at N = 1 */
    const double cube = 3.0 * elliptic(k).d / (2.0 * KL_PI * effective_Pa * small);
    const double major =
        cube * (double)kl_inverse_cbrt(KL_R(cube)) * (double)kl_inverse_cbrt(KL_R(cube));
    const struct patch patch = {major, k};
    return patch;
}

/* E* = G/(1 - nu) */
static double effective_modulus(double shear_modulus_Pa, double poisson) {
    return shear_modulus_Pa / (1.0 - poisson);
}

struct kl_ellipse kl_hertz(double a_1_m, double b_1_m, double shear_modulus_Pa, double poisson) {
    const int along_is_major = b_1_m >= a_1_m;
    const struct patch p =
        patch_of(along_is_major ? a_1_m : b_1_m, along_is_major ? b_1_m : a_1_m, KL_HERTZ_MIN_RATIO,
                 effective_modulus(shear_modulus_Pa, poisson));
    const struct kl_ellipse ellipse = {along_is_major ? p.major : p.ratio * p.major,
                                       along_is_major ? p.ratio * p.major : p.major};
    return ellipse;
}

double kl_hertz_approach(double a_1_m, double b_1_m, double shear_modulus_Pa, double poisson) {
    const double effective_Pa = effective_modulus(shear_modulus_Pa, poisson);
    const struct patch p = patch_of(b_1_m >= a_1_m ? a_1_m : b_1_m, b_1_m >= a_1_m ? b_1_m : a_1_m,
                                    KL_HERTZ_APPROACH_RATIO, effective_Pa);
    /* p0 minor K / E* with p0 = 3 N / (2 pi major minor) */
    return 3.0 * elliptic(p.ratio).k / (2.0 * KL_PI * effective_Pa * p.major);
}

/* Kalker 1990, table E.3: a/b = 0.1 .. 1, then b/a = 0.9 .. 0.1; C11, C22, C23 at nu = 0, 1/4, 1/2;
 * C33 at 1/4. */
static const double kalker_table[19][10] = {
    {2.51, 3.31, 4.85, 2.51, 2.52, 2.53, 0.334, 0.473, 0.731, 8.28},
    {2.59, 3.37, 4.81, 2.59, 2.63, 2.66, 0.483, 0.603, 0.809, 4.27},
    {2.68, 3.44, 4.80, 2.68, 2.75, 2.81, 0.607, 0.715, 0.889, 2.96},
    {2.78, 3.53, 4.82, 2.78, 2.88, 2.98, 0.720, 0.823, 0.977, 2.32},
    {2.88, 3.62, 4.83, 2.88, 3.01, 3.14, 0.827, 0.929, 1.07, 1.93},
    {2.98, 3.72, 4.91, 2.98, 3.14, 3.31, 0.930, 1.03, 1.18, 1.68},
    {3.09, 3.81, 4.97, 3.09, 3.28, 3.48, 1.03, 1.14, 1.29, 1.50},
    {3.19, 3.91, 5.05, 3.19, 3.41, 3.65, 1.13, 1.25, 1.40, 1.37},
    {3.29, 4.01, 5.12, 3.29, 3.54, 3.82, 1.23, 1.36, 1.51, 1.27},
    {3.40, 4.12, 5.20, 3.40, 3.67, 3.98, 1.33, 1.47, 1.63, 1.19},
    {3.51, 4.22, 5.30, 3.51, 3.81, 4.16, 1.44, 1.59, 1.77, 1.11},
    {3.65, 4.36, 5.42, 3.65, 3.99, 4.39, 1.58, 1.75, 1.94, 1.04},
    {3.82, 4.54, 5.58, 3.82, 4.21, 4.67, 1.76, 1.95, 2.18, 0.965},
    {4.06, 4.78, 5.80, 4.06, 4.50, 5.04, 2.01, 2.23, 2.50, 0.892},
    {4.37, 5.10, 6.11, 4.37, 4.90, 5.56, 2.35, 2.62, 2.96, 0.819},
    {4.84, 5.57, 6.57, 4.84, 5.48, 6.31, 2.88, 3.24, 3.70, 0.747},
    {5.57, 6.34, 7.34, 5.57, 6.40, 7.51, 3.79, 4.32, 5.01, 0.674},
    {6.96, 7.78, 8.82, 6.96, 8.14, 9.79, 5.72, 6.63, 7.89, 0.601},
    {10.7, 11.7, 12.9, 10.7, 12.8, 16.0, 12.2, 14.6, 18.0, 0.526}};

struct kl_kalker kl_kalker_coefficients(double a_over_b, double poisson) {
    double ratio = a_over_b < 0.1 ? 0.1 : a_over_b;
    ratio = ratio > 10.0 ? 10.0 : ratio;
    const double nu = poisson < 0.0 ? 0.0 : (poisson > 0.5 ? 0.5 : poisson);
    /* place 0..18 in the table, equal steps of the smaller-over-larger axis */
    const double place = ratio <= 1.0 ? 10.0 * ratio - 1.0 : 19.0 - 10.0 / ratio;
    int row = (int)place;
    row = row < 0 ? 0 : (row > 17 ? 17 : row);
    const double t = place - (double)row;
    /* Lagrange through nu = 0, 1/4, 1/2 */
    const double x = 4.0 * nu;
    const double w[3] = {0.5 * (x - 1.0) * (x - 2.0), x * (2.0 - x), 0.5 * x * (x - 1.0)};
    double c[4];
    for (int i = 0; i < 3; i++) {
        const double *a = &kalker_table[row][3 * i];
        const double *b = &kalker_table[row + 1][3 * i];
        const double at_a = w[0] * a[0] + w[1] * a[1] + w[2] * a[2];
        const double at_b = w[0] * b[0] + w[1] * b[1] + w[2] * b[2];
        c[i] = at_a + t * (at_b - at_a);
    }
    c[3] = kalker_table[row][9] + t * (kalker_table[row + 1][9] - kalker_table[row][9]);
    const struct kl_kalker result = {c[0], c[1], c[2], c[3]};
    return result;
}

double kl_spin_moment(double a_over_b) {
    const double g = a_over_b < 1.0 ? a_over_b : 1.0 / a_over_b;
    const struct elliptic e = elliptic(g);
    return 0.375 / kl_sqrt(g) * (e.k - (1.0 - g * g) * e.d); /* E = K - e^2 D */
}

struct kl_creep_force kl_creep(enum kl_creep_law law, const struct kl_creep_coefficients *f,
                               kl_real friction, kl_real normal_N,
                               const struct kl_creepage *creepage) {
    const kl_real t1 = -f->f11_N * creepage->gamma1;
    const kl_real t2 = -f->f22_N * creepage->gamma2 - f->f23_Nm * creepage->omega3_1_m;
    const kl_real m3 = f->f23_Nm * creepage->gamma2 - f->f33_Nm2 * creepage->omega3_1_m;
    const kl_real reduction = kl_saturate(law, t1, t2, friction * normal_N);
    const struct kl_creep_force force = {reduction * t1, reduction * t2, reduction * m3, reduction};
    return force;
}
