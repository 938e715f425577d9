/*
 * Small motions of a two-axle wagon: every eigenvalue of the textbook's matrices (computed by
 * LAPACK, tests/reference/two_axle_modes.py) is an eigenvalue of the model's right-hand side.
 */
#include <complex.h>

#include "fixtures.h"

#define MAX_N 24

typedef double _Complex number;

static const number imaginary = (number)I;

/* The wagon of two_axle_modes.py: y, roll and yaw of the body, no gravity, no spin creep. */
static void textbook_wagon(struct vehicle *v, int damped) {
    wagon(v, linear_pair(0.1144));
    v->def.gravity_m_s2 = 0.0;
    v->body[0].mass_kg = 22000.0;
    v->body[0].inertia_kgm2[0] = 30000.0;
    v->body[0].inertia_kgm2[2] = 240000.0;
    v->body[0].z_m = -1.5;
    v->body[0].freedoms = KL_HAS(KL_Y) | KL_HAS(KL_ROLL) | KL_HAS(KL_YAW);
    for (int i = 0; i < 2; i++) {
        v->wheelset[i].mass_kg = 1250.0;
        v->wheelset[i].inertia_yaw_kgm2 = 700.0;
        v->wheelset[i].creep = constant_creep();
    }
    for (int i = 0; i < 4; i++) {
        const double k[3] = {1e6, 0.4e6, 1.2e6};
        const double c[3] = {8e3, 12e3, 25e3};
        for (int d = 0; d < 3; d++) {
            v->element[i].k[d] = k[d];
            v->element[i].c[d] = damped ? c[d] : 0.0;
        }
        v->element[i].point_a_m[2] = -0.6;
        v->element[i].point_b_m[2] = -0.6;
    }
}

/* d rates/d states about rolling straight, by central differences: exact for a linear model. */
static void linearise(const struct kl_model *m, double speed, double a[MAX_N][MAX_N]) {
    struct kl_state x;
    struct kl_input input;
    kl_real up[KL_MAX_STATES];
    kl_real down[KL_MAX_STATES];
    const double d = 1e-6;
    assert_int_equal(kl_init(m, &x, 0, (kl_real)speed, work()), KL_OK);
    kl_input_init(&input);
    input.speed_m_s = (kl_real)speed;
    for (uint32_t j = 0; j < m->n_states; j++) {
        const kl_real kept = x.x[j];
        x.x[j] = kept + (kl_real)d;
        kl_rates(m, &x, &input, up, work());
        x.x[j] = kept - (kl_real)d;
        kl_rates(m, &x, &input, down, work());
        x.x[j] = kept;
        for (uint32_t i = 0; i < m->n_states; i++) {
            a[i][j] = (double)(up[i] - down[i]) / (2.0 * d);
        }
    }
}

/* Solves (A - shift) w = v in place of v, by Gauss elimination with pivoting. */
static void solve(double a[MAX_N][MAX_N], uint32_t n, number shift, number *v) {
    number m[MAX_N][MAX_N];
    for (uint32_t i = 0; i < n; i++) {
        for (uint32_t j = 0; j < n; j++) {
            m[i][j] = a[i][j] - (i == j ? shift : 0.0);
        }
    }
    for (uint32_t i = 0; i < n; i++) {
        uint32_t pivot = i;
        for (uint32_t r = i + 1u; r < n; r++) {
            pivot = cabs(m[r][i]) > cabs(m[pivot][i]) ? r : pivot;
        }
        for (uint32_t j = 0; j < n; j++) {
            const number swap = m[i][j];
            m[i][j] = m[pivot][j];
            m[pivot][j] = swap;
        }
        const number swap = v[i];
        v[i] = v[pivot];
        v[pivot] = swap;
        for (uint32_t r = i + 1u; r < n; r++) {
            const number part = m[r][i] / m[i][i];
            for (uint32_t j = i; j < n; j++) {
                m[r][j] -= part * m[i][j];
            }
            v[r] -= part * v[i];
        }
    }
    for (uint32_t i = n; i-- > 0;) {
        for (uint32_t j = i + 1u; j < n; j++) {
            v[i] -= m[i][j] * v[j];
        }
        v[i] /= m[i][i];
    }
}

/* The eigenvalue of A that is nearest to `guess`, by inverse iteration. */
static number nearest(double a[MAX_N][MAX_N], uint32_t n, number guess) {
    number v[MAX_N];
    number w[MAX_N];
    number eigenvalue = guess;
    uint64_t seed = 71;
    for (uint32_t i = 0; i < n; i++) {
        v[i] = random_between(&seed, 0.5, 1.5);
    }
    for (int round = 0; round < 12; round++) {
        number vv = 0.0;
        number vw = 0.0;
        double size = 0.0;
        memcpy(w, v, sizeof w);
        solve(a, n, guess, w);
        for (uint32_t i = 0; i < n; i++) {
            vv += conj(v[i]) * v[i];
            vw += conj(v[i]) * w[i];
            size += creal(conj(w[i]) * w[i]);
        }
        eigenvalue = guess + vv / vw;
        for (uint32_t i = 0; i < n; i++) {
            v[i] = w[i] / sqrt(size);
        }
    }
    return eigenvalue;
}

static void eigenvalues_are_the_textbooks(void **state) {
    (void)state;
    struct csv csv;
    int rows = 0;
    double worst = 0.0;
    csv_open(&csv, "tests/reference/two_axle_modes.csv");
    while (csv_next(&csv)) {
        struct vehicle v;
        struct built b;
        double a[MAX_N][MAX_N];
        textbook_wagon(&v, csv_is(&csv, "vehicle", "damped"));
        build(&v, &b);
        assert_true(b.model.n_states <= MAX_N);
        linearise(&b.model, csv_named(&csv, "speed_m_s"), a);
        const number want = csv_named(&csv, "real_1_s") + imaginary * csv_named(&csv, "imag_rad_s");
        const double size = cabs(want);
        /* begin a little aside, so that the matrix is not singular where it should be */
        const number got =
            nearest(a, b.model.n_states, want + 1e-7 * size * (1.0 + 0.5 * imaginary));
        const double off = cabs(got - want) / size;
        worst = fmax(worst, off);
        if (!(off < 1e-5)) { /* two fast modes nearly coincide at 20 m/s: sensitive to 1e-5 */
            fail_msg("%s:%u: %.9g%+.9gi, wanted %.9g%+.9gi", csv.path, csv.line_number, creal(got),
                     cimag(got), creal(want), cimag(want));
        }
        unbuild(&b);
        rows++;
    }
    csv_close(&csv);
    print_message("%d eigenvalues, largest difference %.1e of the value\n", rows, worst);
    assert_true(rows > 60);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(eigenvalues_are_the_textbooks),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
