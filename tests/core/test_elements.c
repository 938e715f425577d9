/*
 * Force elements and linkages of which the state has no part: against hand formulas, and the same
 * vehicle described in two ways. A body over the ground stands beside a wheelset that only makes
 * the model complete; forces are read off its accelerations.
 */
#include "fixtures.h"

#define MASS 2000.0
#define INERTIA_ROLL 1500.0
#define INERTIA_PITCH 9000.0
#define INERTIA_YAW 8000.0
#define HEIGHT 1.5 /* of the centre of mass */

/* A body with these freedoms, tied to the ground by element 0, which is blank. */
static void body_over_ground(struct vehicle *v, uint32_t freedoms) {
    single_wheelset(v, linear_pair(0.1), 1e6, 1e6);
    v->wheelset[0].load_N = 1e5;
    v->element[1] = v->element[0];
    v->def.n_elements = 2;
    v->def.n_bodies = 1;
    set_name(v->body[0].name, "body");
    v->body[0].mass_kg = MASS;
    v->body[0].inertia_kgm2[0] = INERTIA_ROLL;
    v->body[0].inertia_kgm2[1] = INERTIA_PITCH;
    v->body[0].inertia_kgm2[2] = INERTIA_YAW;
    v->body[0].z_m = -HEIGHT;
    v->body[0].freedoms = freedoms;
    const struct kl_element_def tie = {.end_a = 0,
                                       .end_b = KL_GROUND_END,
                                       .point_a_m = {0.0, 0.0, -HEIGHT},
                                       .point_b_m = {0.0, 0.0, -HEIGHT}};
    v->element[0] = tie;
    set_name(v->element[0].name, "tie");
}

static void at_rest(const struct kl_model *m, struct kl_state *x) {
    assert_int_equal(kl_init(m, x, 0, 0, work()), KL_OK);
}

/* Generalised force on a body's freedom, displaced and moving as the state says. */
static double force_on(const struct kl_model *m, const struct kl_state *x, uint32_t body,
                       enum kl_freedom f) {
    kl_real rates[KL_MAX_STATES];
    struct kl_input input;
    kl_input_init(&input);
    kl_rates(m, x, &input, rates, work());
    const struct kl_body *b = &m->bodies[body];
    const double inertia = (double)(f < KL_ROLL ? b->mass_kg : b->inertia_kgm2[f - KL_ROLL]);
    return inertia * (double)rates[kl_body_state_index(m, body, f, 1)];
}

static void put(const struct kl_model *m, struct kl_state *x, uint32_t body, enum kl_freedom f,
                int rate, double value) {
    x->x[kl_body_state_index(m, body, f, rate)] = (kl_real)value;
}

/* ---- linear ones ---- */

/* Springs at y = +-b give 2 k b^2 in roll; a bar about x adds its own, and nothing in bounce. */
static void anti_roll_bar_stiffens_roll_alone(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    struct kl_state x;
    const double half = 1.1;
    const double k = 4e5;
    const double bar = 9.4e5;
    body_over_ground(&v, KL_HAS(KL_Z) | KL_HAS(KL_ROLL));
    v.def.n_elements = 4;
    for (int i = 0; i < 2; i++) {
        v.element[i + 2] = v.element[0];
        v.element[i + 2].k[2] = k;
        v.element[i + 2].point_a_m[1] = v.element[i + 2].point_b_m[1] = i == 0 ? half : -half;
    }
    v.element[0].k[3] = bar;
    build(&v, &b);
    at_rest(&b.model, &x);
    put(&b.model, &x, 0, KL_ROLL, 0, 2e-3);
    assert_near(force_on(&b.model, &x, 0, KL_ROLL), -(2.0 * k * half * half + bar) * 2e-3, 1e-6);
    put(&b.model, &x, 0, KL_ROLL, 0, 0.0);
    put(&b.model, &x, 0, KL_Z, 0, 1e-3);
    assert_near(force_on(&b.model, &x, 0, KL_Z), -2.0 * k * 1e-3, 1e-6);
    assert_near(force_on(&b.model, &x, 0, KL_ROLL), 0.0, 1e-6);
    unbuild(&b);
}

/* A level rod h below the centre of mass: a pitch of chi draws it by h chi; -k h^2 chi comes back. A
 * steep one, 3 forward and 4 down, has the length's direction (0.6, 0, -0.8) at its upper end. */
static void traction_rod_works_through_its_heights(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    struct kl_state x;
    const double k = 5e6;
    const double chi = 1e-3;
    body_over_ground(&v, KL_HAS(KL_Z) | KL_HAS(KL_PITCH));
    v.element[0].k[2] = 1e5;
    v.element[0].k[4] = 1e5;
    v.def.n_elements = 3;
    v.element[2] = v.element[0];
    memset(v.element[2].k, 0, sizeof v.element[2].k);
    v.element[2].line_k_N_m = k;
    v.element[2].line_c_Ns_m = 3e4;
    const double below = 0.9;
    v.element[2].point_a_m[0] = 1.0;
    v.element[2].point_b_m[0] = -2.0;
    v.element[2].point_a_m[2] = v.element[2].point_b_m[2] = below - HEIGHT;
    build(&v, &b);
    at_rest(&b.model, &x);
    put(&b.model, &x, 0, KL_PITCH, 0, chi);
    assert_near(force_on(&b.model, &x, 0, KL_PITCH), -(k * below * below + 1e5) * chi, 1e-6);
    put(&b.model, &x, 0, KL_PITCH, 0, 0.0);
    put(&b.model, &x, 0, KL_PITCH, 1, 0.5);
    assert_near(force_on(&b.model, &x, 0, KL_PITCH), -3e4 * below * below * 0.5, 1e-6);
    unbuild(&b);

    v.element[2].point_a_m[0] = 0.0;
    v.element[2].point_b_m[0] = -3.0;
    v.element[2].point_a_m[2] = -HEIGHT;
    v.element[2].point_b_m[2] = -HEIGHT + 4.0;
    build(&v, &b);
    at_rest(&b.model, &x);
    put(&b.model, &x, 0, KL_Z, 0, 1e-3); /* down: shorter by 0.8 mm */
    assert_near(force_on(&b.model, &x, 0, KL_Z), -(0.64 * k + 1e5) * 1e-3, 1e-6);
    unbuild(&b);
}

/* ---- the load at rest ---- */

/* A mass hung on links of length l is a pendulum: y'' = -g y/l, whatever it weighs. On struts of
 * that length it falls over with g/l. */
static void links_make_a_pendulum(void **state) {
    (void)state;
    const double length = 0.23;
    for (int hung = 0; hung < 2; hung++) {
        struct vehicle v;
        struct built b;
        struct kl_state x;
        body_over_ground(&v, KL_HAS(KL_Y) | KL_HAS(KL_Z));
        v.element[0].k[2] = 3e6;
        v.element[0].sway = KL_SWAY_PINNED;
        v.element[0].point_b_m[2] = v.element[0].point_a_m[2] + (hung ? -length : length);
        build(&v, &b);
        at_rest(&b.model, &x);
        put(&b.model, &x, 0, KL_Y, 0, 1e-3);
        const double want = MASS * 9.81 / length * 1e-3;
        assert_near(force_on(&b.model, &x, 0, KL_Y), hung ? -want : want, 1e-9 * want);
        unbuild(&b);
    }
}

/*
 * An air spring under each side, h_c below the centre of mass, b from the middle, on the ground. By
 * hand, moments about the body's centre, displaced by y and leaning by phi: the spring's shear s = y
 * - h_c phi, its force k_s s + P phi/2 (half the lean is the spring's), each end half of P s:
 *   F_y = -k_s s + P phi/2,   M = -k_z b^2 phi + h_c k_s s - h_c P phi/2 + P s/2 + h_c P phi
 */
static void air_spring_sways_by_hand(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    struct kl_state x;
    const double k_s = 3.2e5;
    const double k_z = 8.6e5;
    const double half = 1.0;
    const double below = 0.7;
    body_over_ground(&v, KL_HAS(KL_Y) | KL_HAS(KL_Z) | KL_HAS(KL_ROLL));
    v.def.n_elements = 3;
    for (int i = 0; i < 2; i++) {
        struct kl_element_def *e = &v.element[i == 0 ? 0 : 2];
        *e = v.element[0];
        e->sway = KL_SWAY_CLAMPED;
        memset(e->k, 0, sizeof e->k);
        e->k[1] = 0.5 * k_s;
        e->k[2] = 0.5 * k_z;
        e->point_a_m[1] = e->point_b_m[1] = i == 0 ? half : -half;
        e->point_a_m[2] = e->point_b_m[2] = below - HEIGHT;
    }
    build(&v, &b);
    const double load = MASS * 9.81;
    const double cases[3][2] = {{2e-3, 0.0}, {0.0, 1e-3}, {-1e-3, 3e-3}};
    for (size_t i = 0; i < COUNT(cases); i++) {
        const double y = cases[i][0];
        const double phi = cases[i][1];
        const double s = y - below * phi;
        at_rest(&b.model, &x);
        put(&b.model, &x, 0, KL_Y, 0, y);
        put(&b.model, &x, 0, KL_ROLL, 0, phi);
        assert_near(force_on(&b.model, &x, 0, KL_Y), -k_s * s + 0.5 * load * phi, 1e-6);
        assert_near(force_on(&b.model, &x, 0, KL_ROLL),
                    -k_z * half * half * phi + below * (k_s * s - 0.5 * load * phi) +
                        0.5 * load * s + below * load * phi,
                    1e-6);
    }
    unbuild(&b);
}

/*
 * Forces between two bodies know nothing of a common turn. Turn upper and lower body together by
 * phi about the lower centre, d below the upper one: to second order the upper body sinks by d
 * phi^2/2, and its weight gives W d phi^2/2. So the elements between them must hold -W d phi^2/2,
 * whatever their heights; the elements below them are the same in both models and cancel.
 */
static void sway_knows_no_common_turn(void **state) {
    (void)state;
    const double phi = 1e-3;
    const double z_upper = -1.8;
    const double z_lower = -0.6;
    const enum kl_sway kinds[3] = {KL_SWAY_CLAMPED, KL_SWAY_PINNED, KL_SWAY_PINNED};
    const double upper_end[3] = {-0.8, -1.1, -0.5}; /* the last hangs below its bearing */
    const double lower_end[3] = {-0.8, -0.6, -0.9};
    for (int i = 0; i < 3; i++) {
        double held[2];
        for (int sways = 0; sways < 2; sways++) {
            struct vehicle v;
            struct built b;
            struct kl_state x;
            body_over_ground(&v, KL_HAS(KL_Y) | KL_HAS(KL_Z) | KL_HAS(KL_ROLL));
            v.def.n_bodies = 2;
            v.body[1] = v.body[0];
            set_name(v.body[1].name, "lower");
            v.body[0].z_m = z_upper;
            v.body[1].z_m = z_lower;
            v.element[2] = v.element[0];
            v.element[2].end_a = 1;
            v.element[2].k[2] = v.element[2].k[1] = v.element[2].k[3] = 1e6;
            v.def.n_elements = 3;
            v.element[0].end_b = 1;
            v.element[0].k[2] = 5e5;
            v.element[0].k[1] = 2e5;
            v.element[0].k[3] = 1e6;
            v.element[0].point_a_m[2] = upper_end[i];
            v.element[0].point_b_m[2] = lower_end[i];
            v.element[0].sway = sways ? kinds[i] : KL_SWAY_NONE;
            build(&v, &b);
            at_rest(&b.model, &x);
            const double aside = (z_lower - z_upper) * phi;
            put(&b.model, &x, 0, KL_Y, 0, aside);
            put(&b.model, &x, 0, KL_ROLL, 0, phi);
            put(&b.model, &x, 1, KL_ROLL, 0, phi);
            held[sways] =
                -0.5 *
                (aside * force_on(&b.model, &x, 0, KL_Y) +
                 phi * (force_on(&b.model, &x, 0, KL_ROLL) + force_on(&b.model, &x, 1, KL_ROLL)));
            unbuild(&b);
        }
        const double want = -0.5 * MASS * 9.81 * (z_lower - z_upper) * phi * phi;
        assert_near(held[1] - held[0], want, 1e-7 * fabs(want));
    }
}

/* ---- tables ---- */

/* A table, and what lies between its points by hand. */
static void stop_follows_its_table(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    struct kl_state x;
    static const double at[] = {-0.05, -0.03, -0.02, 0.025, 0.03, 0.04};
    static const double force[] = {-9e4, -1e4, 0.0, 0.0, 2e3, 3e4};
    const double cases[][2] = {{0.0, 0.0},   {0.01, 0.0},      {0.025, 0.0},  {0.0275, 1e3},
                               {0.03, 2e3},  {0.035, 16e3},    {0.05, 58e3},  {-0.01, 0.0},
                               {-0.02, 0.0}, {-0.025, -0.5e4}, {-0.04, -5e4}, {-0.06, -13e4}};
    body_over_ground(&v, KL_HAS(KL_Y));
    v.element[0].k[5] = 1.0;
    v.element[0].along = KL_ALONG_Y;
    v.element[0].stop = (struct kl_table_def){COUNT(at), at, force};
    build(&v, &b);
    at_rest(&b.model, &x);
    for (size_t i = 0; i < COUNT(cases); i++) {
        put(&b.model, &x, 0, KL_Y, 0, cases[i][0]);
        assert_near(force_on(&b.model, &x, 0, KL_Y), -cases[i][1],
                    1e-9 * (1.0 + fabs(cases[i][1])));
    }
    unbuild(&b);
}

/* Free over the gap g, then a spring k: the body goes on to g + v sqrt(m/k) and comes back with what
 * it had. */
static void stop_gives_its_energy_back(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    struct kl_state x;
    const double gap = 0.02;
    const double k = 1e6;
    const double speed = 0.4;
    static const double at[] = {-1.0, -0.02, 0.02, 1.0};
    static const double force[] = {-0.98e6, 0.0, 0.0, 0.98e6};
    body_over_ground(&v, KL_HAS(KL_Y));
    v.element[0].along = KL_ALONG_Y;
    v.element[0].stop = (struct kl_table_def){COUNT(at), at, force};
    build(&v, &b);
    at_rest(&b.model, &x);
    put(&b.model, &x, 0, KL_Y, 1, speed);
    kl_refresh(&b.model, &x, work());
    const double first = (double)kl_energy(&b.model, &x, work());
    double most = 0.0;
    double worst = 0.0;
    for (int i = 0; i < 20000; i++) {
        assert_int_equal(coast(&b.model, &x, 1, NULL), 0);
        most = fmax(most, (double)x.x[0]);
        worst = fmax(worst, fabs((double)kl_energy(&b.model, &x, work()) - first));
    }
    const double kinetic = 0.5 * MASS * speed * speed;
    print_message("stop: %.6f m deep, by hand %.6f; energy within %.1e of it\n", most,
                  gap + speed * sqrt(MASS / k), worst / kinetic);
    assert_near(most, gap + speed * sqrt(MASS / k), 2e-5);
    assert_at_most(worst, 2e-2 * kinetic); /* it swings by (omega h)^2/4 and a kink a hit */
    assert_near(fabs((double)x.x[1]), speed, 2e-3 * speed);
    unbuild(&b);
}

/* v' = -F(v)/m: beyond 0.1 m/s with the small slope, below with the large one; both have closed
 * solutions. */
static void damper_follows_its_table(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    struct kl_state x;
    static const double at[] = {-1.1, -0.1, 0.1, 1.1};
    static const double force[] = {-6e3, -4e3, 4e3, 6e3};
    body_over_ground(&v, KL_HAS(KL_Y));
    v.element[0].along = KL_ALONG_Y;
    v.element[0].damper = (struct kl_table_def){COUNT(at), at, force};
    build(&v, &b);
    at_rest(&b.model, &x);
    put(&b.model, &x, 0, KL_Y, 1, 0.5);
    kl_refresh(&b.model, &x, work());
    /* v + 1.9 falls with 2e3/m from 2.4 to 2.0; then v falls with 4e4/m */
    const double bend = MASS / 2e3 * log(2.4 / 2.0);
    for (int i = 1; i <= 400; i++) {
        assert_int_equal(coast(&b.model, &x, 1, NULL), 0);
        const double t = 1e-3 * i;
        const double want =
            t < bend ? 2.4 * exp(-2e3 / MASS * t) - 1.9 : 0.1 * exp(-4e4 / MASS * (t - bend));
        assert_near((double)x.x[1], want, 2e-4);
    }
    unbuild(&b);
}

/* ---- linkages ---- */

static struct kl_linkage_def link_of(int32_t a, enum kl_freedom fa, double factor_a, int32_t b,
                                     enum kl_freedom fb, double factor_b) {
    const struct kl_linkage_def linkage = {
        .name = "link", .n_terms = 2, .term = {{a, fa, factor_a}, {b, fb, factor_b}}};
    return linkage;
}

/* u = y_f - y_r - a (psi_f + psi_r), wheelsets 2a apart: shear bracing. By hand Q_i = -k u factor. */
static void elastic_linkage_spreads_its_force(void **state) {
    (void)state;
    struct vehicle v;
    struct built b[2];
    kl_real rates[2][KL_MAX_STATES];
    struct kl_linkage_def shear =
        link_of(KL_WHEELSET_END(0), KL_Y, 1.0, KL_WHEELSET_END(1), KL_Y, -1.0);
    shear.n_terms = 4;
    shear.term[2] = (struct kl_term_def){KL_WHEELSET_END(0), KL_YAW, -4.5};
    shear.term[3] = (struct kl_term_def){KL_WHEELSET_END(1), KL_YAW, -4.5};
    shear.k = 3e5;
    shear.c = 2e3;
    const double y = 1e-3;
    const double psi = 2e-3;
    for (int i = 0; i < 2; i++) {
        struct kl_state x;
        struct kl_input input;
        wagon(&v, linear_pair(0.1));
        v.def.linkages = &shear;
        v.def.n_linkages = (uint32_t)i;
        build(&v, &b[i]);
        at_rest(&b[i].model, &x);
        wheelset_x(&b[i].model, &x, 0)[KL_WS_Y] = (kl_real)y;
        wheelset_x(&b[i].model, &x, 1)[KL_WS_YAW] = (kl_real)psi;
        wheelset_x(&b[i].model, &x, 1)[KL_WS_YAW_RATE] = (kl_real)0.01;
        kl_input_init(&input);
        kl_rates(&b[i].model, &x, &input, rates[i], work());
    }
    const double f = -(3e5 * (y - 4.5 * psi) + 2e3 * (-4.5 * 0.01));
    const double want[2][2] = {{f, -4.5 * f}, {-f, -4.5 * f}};
    for (uint32_t w = 0; w < 2; w++) {
        const int32_t y_rate = kl_wheelset_state_index(&b[0].model, w, KL_WS_Y_RATE);
        const int32_t yaw_rate = kl_wheelset_state_index(&b[0].model, w, KL_WS_YAW_RATE);
        assert_near(1400.0 * (double)(rates[1][y_rate] - rates[0][y_rate]), want[w][0], 1e-5);
        assert_near(750.0 * (double)(rates[1][yaw_rate] - rates[0][yaw_rate]), want[w][1], 1e-5);
    }
    unbuild(&b[0]);
    unbuild(&b[1]);
}

/* The yaw angles of the wheelsets, equal and opposite to the body's eyes, tied rigidly: psi_f - psi_b
 * = -(psi_r - psi_b). From standstill to 120 m/s it holds them, and nothing grows. */
static void rigid_linkage_holds_at_every_speed(void **state) {
    (void)state;
    const double speeds[] = {0.0, 0.5, 5.0, 40.0, 120.0};
    struct kl_linkage_def steer =
        link_of(KL_WHEELSET_END(0), KL_YAW, 1.0, KL_WHEELSET_END(1), KL_YAW, 1.0);
    steer.n_terms = 3;
    steer.term[2] = (struct kl_term_def){0, KL_YAW, -2.0};
    steer.rigid = 1;
    for (size_t i = 0; i < COUNT(speeds); i++) {
        double most[2];
        for (uint32_t linked = 0; linked < 2; linked++) {
            struct vehicle v;
            struct built b;
            struct kl_state x;
            wagon(&v, linear_pair(0.002));
            v.def.linkages = &steer;
            v.def.n_linkages = linked;
            build(&v, &b);
            assert_int_equal(kl_init(&b.model, &x, 0, (kl_real)speeds[i], work()), KL_OK);
            put(&b.model, &x, 0, KL_Y, 1, 0.05);
            wheelset_x(&b.model, &x, 0)[KL_WS_Y_RATE] = (kl_real)0.05;
            kl_refresh(&b.model, &x, work());
            most[linked] = 0.0;
            for (int k = 0; k < 4000; k++) {
                assert_int_equal(coast(&b.model, &x, 1, NULL) & KL_FAULTS_HOLD, 0);
                const double front = (double)wheelset_x(&b.model, &x, 0)[KL_WS_YAW];
                const double rear = (double)wheelset_x(&b.model, &x, 1)[KL_WS_YAW];
                const double body = (double)x.x[kl_body_state_index(&b.model, 0, KL_YAW, 0)];
                most[linked] = fmax(most[linked], fabs(front + rear - 2.0 * body));
                assert_at_most(fabs(front), 5e-3);
            }
            unbuild(&b);
        }
        print_message("%g m/s: %.2e rad apart, without the linkage %.2e\n", speeds[i], most[1],
                      most[0]);
        assert_at_most(most[1], 0.08 * most[0]);
    }
}

/* ---- the same vehicle in two ways ---- */

/* Runs two models side by side; the largest difference of their wheelsets and bodies. */
static double apart(struct vehicle *v, struct vehicle *w, double shift, double speed) {
    struct built a;
    struct built b;
    struct kl_state x;
    struct kl_state y;
    double worst = 0.0;
    build(v, &a);
    build(w, &b);
    assert_int_equal(kl_init(&a.model, &x, 0, (kl_real)speed, work()), KL_OK);
    assert_int_equal(kl_init(&b.model, &y, (kl_real)-shift, (kl_real)speed, work()), KL_OK);
    wheelset_x(&a.model, &x, 0)[KL_WS_Y] = (kl_real)2e-3;
    wheelset_x(&b.model, &y, 0)[KL_WS_Y] = (kl_real)2e-3;
    kl_refresh(&a.model, &x, work());
    kl_refresh(&b.model, &y, work());
    for (int i = 0; i < 8000; i++) {
        assert_int_equal(coast(&a.model, &x, 1, NULL) & KL_FAULTS_HOLD, 0);
        assert_int_equal(coast(&b.model, &y, 1, NULL) & KL_FAULTS_HOLD, 0);
        for (uint32_t k = 0; k < a.model.n_states; k++) {
            worst = fmax(worst, fabs((double)x.x[k] - (double)y.x[k]));
        }
    }
    unbuild(&a);
    unbuild(&b);
    return worst;
}

static void in_a_curve(struct vehicle *v) {
    wagon(v, arcs_pair(KL_KINEMATICS_RIGID));
    one_curve(v, KL_RAMP_BLOSS, 1.0 / 2500.0, 0.02);
}

/* Half the stiffness twice; everything 7 m further on, the track read 7 m back; a linkage for an
 * element. */
static void two_descriptions_run_alike(void **state) {
    (void)state;
    struct vehicle v;
    struct vehicle w;
    in_a_curve(&v);
    in_a_curve(&w);
    w.def.n_elements = 8;
    for (int i = 0; i < 4; i++) {
        for (int k = 0; k < 6; k++) {
            w.element[i].k[k] *= 0.5;
            w.element[i].c[k] *= 0.5;
        }
        w.element[i + 4] = w.element[i];
    }
    assert_at_most(apart(&v, &w, 0.0, 22.0), 1e-9);

    in_a_curve(&w);
    w.body[0].x_m += 7.0;
    for (int i = 0; i < 4; i++) {
        w.element[i].point_a_m[0] += 7.0;
        w.element[i].point_b_m[0] += 7.0;
    }
    w.wheelset[0].x_m += 7.0;
    w.wheelset[1].x_m += 7.0;
    const double shifted = apart(&v, &w, 7.0, 22.0);
    print_message("shifted by 7 m: %.1e apart after 176 m with a curve\n", shifted);
    assert_at_most(shifted, 1e-9);

    const struct kl_linkage_def yaw = {
        .name = "yaw",
        .n_terms = 2,
        .term = {{0, KL_YAW, 1.0}, {KL_WHEELSET_END(1), KL_YAW, -1.0}},
        .k = 3e6,
        .c = 1e4};
    in_a_curve(&v);
    in_a_curve(&w);
    v.element[2].k[5] = 3e6;
    v.element[2].c[5] = 1e4;
    w.def.linkages = &yaw;
    w.def.n_linkages = 1;
    assert_at_most(apart(&v, &w, 0.0, 22.0), 1e-9);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(anti_roll_bar_stiffens_roll_alone),
        cmocka_unit_test(traction_rod_works_through_its_heights),
        cmocka_unit_test(links_make_a_pendulum),
        cmocka_unit_test(air_spring_sways_by_hand),
        cmocka_unit_test(sway_knows_no_common_turn),
        cmocka_unit_test(stop_follows_its_table),
        cmocka_unit_test(stop_gives_its_energy_back),
        cmocka_unit_test(damper_follows_its_table),
        cmocka_unit_test(elastic_linkage_spreads_its_force),
        cmocka_unit_test(rigid_linkage_holds_at_every_speed),
        cmocka_unit_test(two_descriptions_run_alike),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
