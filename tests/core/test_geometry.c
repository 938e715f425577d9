/* Wheel-rail geometry on circular arcs, cones and the linear pair, against physics.md section 3 and
 * the 50-digit solutions in tests/reference. */
#include "fixtures.h"

#define ARENA_BYTES (1u << 20)

static void solve(const struct kl_pair_def *def, struct memory *m, double u,
                  struct kl_posture *posture) {
    struct kl_diag diag = {.what = ""};
    const enum kl_status status = kl_pair_solve(def, &m->arena, u, posture, &diag);
    if (status != KL_OK) {
        fail_msg("u_y %g: %s", u, diag.what);
    }
}

static struct kl_linear_geometry linear_of(const struct kl_pair_def *def, struct memory *m) {
    struct kl_linear_geometry linear;
    assert_int_equal(kl_pair_linear(def, &m->arena, &linear, NULL), KL_OK);
    return linear;
}

/* physics.md section 3: the full solution of the printed equations, every figure quoted there. */
static void the_figures_of_section_3(void **state) {
    (void)state;
    static const double quoted[][5] = {
        /* u_y, delta_wr, delta_wl, phi, u_z */
        {1e-3, 0.0578560116, 0.0407475280, -6.82462139e-5, -4.37519572e-6},
        {3e-3, 0.0749814082, 0.0236504625, -2.04799373e-4, -3.93831739e-5}};
    const struct kl_pair_def def = arcs_pair(KL_KINEMATICS_PRINTED);
    struct memory m = take_memory(ARENA_BYTES);
    for (size_t i = 0; i < COUNT(quoted); i++) {
        struct kl_posture p;
        solve(&def, &m, quoted[i][0], &p);
        assert_near((double)p.row[KL_RIGHT].delta_wheel_rad, quoted[i][1], 1e-9);
        assert_near((double)p.row[KL_LEFT].delta_wheel_rad, quoted[i][2], 1e-9);
        assert_near(p.phi_rad, quoted[i][3], 1e-12);
        assert_near(p.u_z_m, quoted[i][4], 1e-13);
    }
    give_memory(&m);
}

/* Against the formulas, which are of first order in delta0: 0.15 % there; the figures in print. */
static void linear_parameters_follow_the_formulas(void **state) {
    (void)state;
    const struct kl_pair_def def = arcs_pair(KL_KINEMATICS_PRINTED);
    struct memory m = take_memory(ARENA_BYTES);
    const struct kl_linear_geometry g = linear_of(&def, &m);
    const double d0 = ARCS_DELTA0;
    const double l = ARCS_L;
    const double solidus = 1.0 - ARCS_R0 * d0 / l;
    const double across = (ARCS_R_WHEEL - ARCS_R_RAIL) * solidus;
    const double epsilon = l * (1.0 + ARCS_R_WHEEL * d0 / l) / across;
    const double epsilon_star = l * (1.0 + ARCS_R_RAIL * d0 / l) / across;
    const double lambda = d0 * ARCS_R_WHEEL * (1.0 + ARCS_R_RAIL * d0 / l) / across;
    assert_near(g.radius_m, ARCS_R0, 1e-12);
    assert_near(g.half_base_m, l, 1e-12);
    assert_near(g.delta0_rad, d0, 1e-12);
    assert_near(g.epsilon_rail, epsilon, 1.5e-3 * epsilon);
    assert_near(g.epsilon_wheel, epsilon_star, 1.5e-3 * epsilon_star);
    assert_near(g.conicity, lambda, 1.5e-3 * lambda);
    assert_near(g.phi_y_rad_m, -(d0 / l) / solidus, 1.5e-3 * d0 / l);
    assert_near(g.sigma, d0, 1.5e-3 * d0);
    /* as printed: 6.42, 6.37, 0.1144 */
    assert_near(g.epsilon_rail, 6.42, 0.01);
    assert_near(g.epsilon_wheel, 6.37, 0.01);
    assert_near(g.conicity, 0.1144, 2e-4);
    /* u_z = -(R_w - R_r) epsilon^2 u^2/(2 l^2) takes epsilon for both: 3.5 % (see the reference) */
    assert_near(g.z_yy_1_m, -(ARCS_R_WHEEL - ARCS_R_RAIL) * epsilon * epsilon / (l * l),
                0.035 * 9.0);
    give_memory(&m);
}

/* The same parameters as derivatives of the 50-digit solution, to the accuracy of differences. */
static void linear_parameters_are_the_derivatives(void **state) {
    (void)state;
    const struct kl_pair_def def = arcs_pair(KL_KINEMATICS_PRINTED);
    struct memory m = take_memory(ARENA_BYTES);
    const struct kl_linear_geometry g = linear_of(&def, &m);
    const struct {
        const char *name;
        double value;
    } got[] = {{"epsilon_rail", g.epsilon_rail},
               {"epsilon_wheel", g.epsilon_wheel},
               {"conicity", g.conicity},
               {"phi_y_rad_m", g.phi_y_rad_m},
               {"z_yy_1_m", g.z_yy_1_m}};
    struct csv csv;
    size_t seen = 0;
    csv_open(&csv, "tests/reference/geometry_arcs_linear.csv");
    while (csv_next(&csv)) {
        for (size_t i = 0; i < COUNT(got); i++) {
            if (csv_is(&csv, "name", got[i].name) &&
                csv_is(&csv, "origin", "derivative of the full solution")) {
                const double want = csv_named(&csv, "value");
                assert_near(got[i].value, want, 1e-6 * fabs(want));
                seen++;
            }
        }
    }
    csv_close(&csv);
    assert_int_equal(seen, COUNT(got));
    give_memory(&m);
}

static void check_side(const struct csv *csv, const char *side, const struct kl_row *row) {
    static const char *const names[] = {"delta_wheel", "delta_rail", "eta_wheel",
                                        "eta_rail",    "radius",     "arm"};
    const double got[] = {(double)row->delta_wheel_rad, (double)row->delta_rail_rad,
                          (double)row->eta_wheel_m,     (double)row->eta_rail_m,
                          (double)row->radius_m,        (double)row->arm_m};
    for (size_t i = 0; i < COUNT(got); i++) {
        char column[64];
        (void)snprintf(column, sizeof column, "%s_%s_%s", names[i], side, i < 2 ? "rad" : "m");
        assert_near(got[i], csv_named(csv, column), 1e-9);
    }
}

/* u_y from -8 to 8 mm, to 1e-8 and better. */
static void full_solution_of_the_printed_equations(void **state) {
    (void)state;
    const struct kl_pair_def def = arcs_pair(KL_KINEMATICS_PRINTED);
    struct memory m = take_memory(ARENA_BYTES);
    struct csv csv;
    int rows = 0;
    csv_open(&csv, "tests/reference/geometry_arcs.csv");
    while (csv_next(&csv)) {
        struct kl_posture p;
        solve(&def, &m, csv_named(&csv, "u_y_m"), &p);
        assert_near(p.u_z_m, csv_named(&csv, "u_z_m"), 1e-11);
        assert_near(p.phi_rad, csv_named(&csv, "phi_rad"), 1e-11);
        assert_near(p.phi_y_rad_m, csv_named(&csv, "phi_y_rad_m"), 1e-9);
        assert_near(p.z_y, csv_named(&csv, "z_y"), 1e-9);
        check_side(&csv, "right", &p.row[KL_RIGHT]);
        check_side(&csv, "left", &p.row[KL_LEFT]);
        rows++;
    }
    csv_close(&csv);
    assert_int_equal(rows, 65);
    give_memory(&m);
}

/*
 * The wheelset turned as a rigid body. KL_KINEMATICS_RIGID keeps the terms phi eta and phi zeta and
 * leaves out phi^2: u_z within 3e-4 of its range, slopes and radii within 1e-5 of theirs.
 */
static void rigid_kinematics_agree_with_the_rotated_body(void **state) {
    (void)state;
    const struct kl_pair_def def = arcs_pair(KL_KINEMATICS_RIGID);
    struct memory m = take_memory(ARENA_BYTES);
    struct csv csv;
    int rows = 0;
    csv_open(&csv, "tests/reference/geometry_arcs_rotated.csv");
    while (csv_next(&csv)) {
        struct kl_posture p;
        solve(&def, &m, csv_named(&csv, "u_y_m"), &p);
        assert_near(p.u_z_m, csv_named(&csv, "u_z_m"), 3e-4 * 2.9e-4);
        assert_near(p.z_y, csv_named(&csv, "z_y"), 3e-4 * 0.073);
        assert_near(p.phi_rad, csv_named(&csv, "phi_rad"), 1e-4 * 5.5e-4);
        assert_near((double)p.row[KL_RIGHT].delta_wheel_rad,
                    csv_named(&csv, "delta_wheel_right_rad"), 1e-5);
        assert_near((double)p.row[KL_LEFT].delta_wheel_rad, csv_named(&csv, "delta_wheel_left_rad"),
                    1e-5);
        assert_near((double)p.row[KL_RIGHT].delta_rail_rad, csv_named(&csv, "delta_rail_right_rad"),
                    1e-5);
        assert_near((double)p.row[KL_RIGHT].radius_m, csv_named(&csv, "radius_right_m"), 1e-6);
        assert_near((double)p.row[KL_LEFT].radius_m, csv_named(&csv, "radius_left_m"), 1e-6);
        rows++;
    }
    csv_close(&csv);
    assert_int_equal(rows, 17);
    give_memory(&m);
}

/*
 * eq. 16-34 with R_w infinite: epsilon0 = delta0/(1 - r0 delta0/l), epsilon0* = 0 and lambda0 =
 * delta0 (1 + R_r delta0/l)/(1 - r0 delta0/l), which a sharp rail's R_r = 0 makes the short form.
 */
static void cones(void **state) {
    (void)state;
    struct memory m = take_memory(ARENA_BYTES);
    const double rail_radius[] = {0.3, 0.03};
    for (int k = 0; k < 4; k++) {
        const double r = rail_radius[k / 2];
        struct kl_pair_def def = pair_of(arc(0.0, 0.05, 0.05), arc(r, 0.05, 0.02), ARCS_R0, ARCS_L);
        def.kinematics = k % 2 == 0 ? KL_KINEMATICS_RIGID : KL_KINEMATICS_PRINTED;
        const struct kl_linear_geometry g = linear_of(&def, &m);
        const double sharp = 0.05 / (1.0 - ARCS_R0 * 0.05 / ARCS_L);
        /* tan against angle: 0.08 % in every delta0 */
        assert_near(g.conicity, sharp * (1.0 + r * 0.05 / ARCS_L), 2e-3 * sharp);
        assert_near(g.epsilon_rail, sharp, 2e-3 * sharp);
        assert_near(g.epsilon_wheel, 0.0, 1e-6);
        assert_near(g.delta0_rad, 0.05, 1e-12);
    }
    give_memory(&m);
}

static void linear_pair_is_what_it_says(void **state) {
    (void)state;
    struct memory m = take_memory(ARENA_BYTES);
    const struct kl_pair_def def = linear_pair(0.1144);
    struct kl_pair pair;
    assert_int_equal(kl_pair_build(&def, &m.arena, &pair, NULL), KL_OK);
    for (double u = -0.0099; u < 0.01; u += 0.00037) {
        struct kl_posture solved;
        struct kl_posture read;
        solve(&def, &m, u, &solved);
        assert_int_equal(kl_pair_posture(&pair, u, &read), KL_OK);
        const struct kl_posture *both[] = {&solved, &read};
        for (int i = 0; i < 2; i++) {
            const struct kl_posture *p = both[i];
            assert_near((double)p->row[KL_RIGHT].radius_m, 0.45 + 0.1144 * u, 1e-15);
            assert_near((double)p->row[KL_LEFT].radius_m, 0.45 - 0.1144 * u, 1e-15);
            assert_near((double)p->row[KL_LEFT].arm_m, 0.7452, 0.0);
            assert_near((double)p->row[KL_LEFT].sin_delta, 0.0, 0.0);
            assert_near(p->phi_rad, 0.0, 0.0);
            assert_near(p->u_z_m, 0.0, 0.0);
        }
    }
    const struct kl_linear_geometry g = linear_of(&def, &m);
    assert_near(g.conicity, 0.1144, 1e-10);
    assert_near(g.half_base_m, 0.7452, 1e-15);
    give_memory(&m);
}

/*
 * The table between its rows against the solution there: heights by cubics (4th order), the rest
 * linear (2nd order; step^2/8 times the second derivative).
 */
static void table_agrees_with_the_solution(void **state) {
    (void)state;
    struct memory m = take_memory(ARENA_BYTES);
    const enum kl_kinematics kinematics[] = {KL_KINEMATICS_RIGID, KL_KINEMATICS_PRINTED};
    for (int k = 0; k < 2; k++) {
        const struct kl_pair_def def = arcs_pair(kinematics[k]);
        struct kl_pair pair;
        assert_int_equal(kl_pair_build(&def, &m.arena, &pair, NULL), KL_OK);
        assert_int_equal(pair.side[KL_RIGHT].n_jumps + pair.side[KL_LEFT].n_jumps, 0);
        for (double u = -0.00795; u < 0.008; u += 0.00031) {
            struct kl_posture solved;
            struct kl_posture read;
            solve(&def, &m, u, &solved);
            assert_int_equal(kl_pair_posture(&pair, u, &read), KL_OK);
            assert_near(read.u_z_m, solved.u_z_m, 1e-12);
            assert_near(read.z_y, solved.z_y, 1e-8);
            assert_near(read.phi_rad, solved.phi_rad, 1e-12);
            assert_near(read.phi_y_rad_m, solved.phi_y_rad_m, 1e-8);
            for (int s = 0; s < KL_SIDES; s++) {
                const struct kl_row *a = &read.row[s];
                const struct kl_row *b = &solved.row[s];
                assert_near((double)a->radius_m, (double)b->radius_m, 5e-8);
                assert_near((double)a->delta_rail_rad, (double)b->delta_rail_rad, 1e-7);
                assert_near((double)a->arm_m, (double)b->arm_m, 1e-7);
                assert_near((double)a->f11_1, (double)b->f11_1, 1e-6 * (double)b->f11_1);
                assert_near((double)a->semi_a_1, (double)b->semi_a_1, 1e-6 * (double)b->semi_a_1);
            }
        }
    }
    give_memory(&m);
}

/* A symmetric pair at -u is the mirror image of the pair at +u, to the last bit. */
static void table_is_its_own_mirror_image(void **state) {
    (void)state;
    struct memory m = take_memory(4u * ARENA_BYTES);
    const struct kl_pair_def defs[] = {arcs_pair(KL_KINEMATICS_RIGID), s1002_uic60(),
                                       linear_pair(0.1)};
    for (size_t d = 0; d < COUNT(defs); d++) {
        struct kl_pair pair;
        assert_int_equal(kl_pair_build(&defs[d], &m.arena, &pair, NULL), KL_OK);
        for (double u = 0.0; u < 0.008; u += 0.000173) {
            struct kl_posture right;
            struct kl_posture left;
            assert_int_equal(kl_pair_posture(&pair, u, &right), KL_OK);
            assert_int_equal(kl_pair_posture(&pair, -u, &left), KL_OK);
            assert_true(right.u_z_m == left.u_z_m && right.phi_rad == -left.phi_rad);
            assert_true(right.z_y == -left.z_y && right.phi_y_rad_m == left.phi_y_rad_m);
            assert_memory_equal(&right.row[KL_RIGHT], &left.row[KL_LEFT], sizeof(struct kl_row));
            assert_memory_equal(&right.row[KL_LEFT], &left.row[KL_RIGHT], sizeof(struct kl_row));
        }
    }
    give_memory(&m);
}

/* Wheels 1 mm apart in radius: the right one stands higher, so central means rolled by nothing but
 * the radii stay what they are and the table is no mirror image. */
static void different_wheels_on_the_two_sides(void **state) {
    (void)state;
    struct memory m = take_memory(ARENA_BYTES);
    struct kl_pair_def def = arcs_pair(KL_KINEMATICS_RIGID);
    def.wheel[KL_RIGHT].radius_m = 0.451;
    struct kl_pair pair;
    assert_int_equal(kl_pair_build(&def, &m.arena, &pair, NULL), KL_OK);
    for (double u = -0.006; u < 0.0061; u += 0.001) {
        struct kl_posture solved;
        struct kl_posture read;
        solve(&def, &m, u, &solved);
        assert_int_equal(kl_pair_posture(&pair, u, &read), KL_OK);
        assert_near(read.phi_rad, solved.phi_rad, 1e-10);
        assert_near(read.u_z_m, solved.u_z_m, 1e-10);
        assert_near((double)solved.row[KL_RIGHT].radius_m - (double)solved.row[KL_LEFT].radius_m,
                    0.001 + 2.0 * 0.1144 * u, 0.00012);
    }
    give_memory(&m);
}

/* Cylinders on arcs, by hand: no load is the rigid solution to the bit, a central axle goes down by
 * d/cos delta less what the rails' giving way sideways adds, d grows with N^(2/3), and both bodies
 * give way by half. */
static void load_presses_wheels_and_rails_together(void **state) {
    (void)state;
    const struct kl_pair_def def = arcs_pair(KL_KINEMATICS_RIGID);
    struct memory m = take_memory(ARENA_BYTES);
    struct kl_posture rigid;
    struct kl_posture p;
    solve(&def, &m, 3e-3, &rigid);
    const struct kl_loaded_place none = {3e-3, 0.0};
    assert_int_equal(kl_pair_solve_loaded(&def, &m.arena, &none, &p, NULL), KL_OK);
    assert_memory_equal(&p, &rigid, sizeof p);

    const struct kl_loaded_place central = {0.0, 50e3};
    assert_int_equal(kl_pair_solve_loaded(&def, &m.arena, &central, &p, NULL), KL_OK);
    const double along = 0.5 * cos(ARCS_DELTA0) / ARCS_R0;
    const double across = 0.5 * (1.0 / ARCS_R_RAIL - 1.0 / ARCS_R_WHEEL);
    const double normal = 50e3 / cos(ARCS_DELTA0);
    const double d =
        kl_hertz_approach(along, across, def.material.shear_modulus_Pa, def.material.poisson) *
        pow(normal, 2.0 / 3.0);
    assert_near(p.approach_m[KL_RIGHT], d, 1e-3 * d);
    assert_true(p.approach_m[KL_RIGHT] == p.approach_m[KL_LEFT]);
    assert_near(p.phi_rad, 0.0, 1e-12);
    assert_near(p.u_z_m, d / cos(ARCS_DELTA0), 1e-3 * d);
    solve(&def, &m, 0.0, &rigid);
    const double sunk = (double)(rigid.row[KL_RIGHT].radius_m - p.row[KL_RIGHT].radius_m);
    const double slide = (double)(rigid.row[KL_RIGHT].eta_wheel_m - p.row[KL_RIGHT].eta_wheel_m);
    assert_near(sunk, 0.5 * d * cos(ARCS_DELTA0) + ARCS_DELTA0 * slide, 1e-3 * d);

    const struct kl_loaded_place eightfold = {0.0, 400e3};
    struct kl_posture more;
    assert_int_equal(kl_pair_solve_loaded(&def, &m.arena, &eightfold, &more, NULL), KL_OK);
    assert_near(more.approach_m[KL_RIGHT], 4.0 * p.approach_m[KL_RIGHT], 4e-3 * d);

    const struct kl_loaded_place bad = {0.0, -1.0};
    assert_int_equal(kl_pair_solve_loaded(&def, &m.arena, &bad, &p, NULL), KL_ERR_ARGUMENT);
    give_memory(&m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_figures_of_section_3),
        cmocka_unit_test(linear_parameters_follow_the_formulas),
        cmocka_unit_test(linear_parameters_are_the_derivatives),
        cmocka_unit_test(full_solution_of_the_printed_equations),
        cmocka_unit_test(rigid_kinematics_agree_with_the_rotated_body),
        cmocka_unit_test(cones),
        cmocka_unit_test(linear_pair_is_what_it_says),
        cmocka_unit_test(table_agrees_with_the_solution),
        cmocka_unit_test(table_is_its_own_mirror_image),
        cmocka_unit_test(different_wheels_on_the_two_sides),
        cmocka_unit_test(load_presses_wheels_and_rails_together),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
