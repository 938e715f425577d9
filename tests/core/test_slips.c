/*
 * Elements with a state of their own - series spring-damper, friction - and actuators: frequency
 * response, work, energy, order of convergence, snapshots. A heavy body on a spring drives them: what
 * they do to it is below 1e-3 of its own force.
 */
#include "fixtures.h"

#define DRIVER_KG 5e6

/* A heavy body that swings aside over the ground with the angular frequency omega, and the element
 * under test between both. */
static void driver(struct vehicle *v, double omega, struct kl_slip_def slip) {
    single_wheelset(v, linear_pair(0.1), 1e6, 1e6);
    v->wheelset[0].load_N = 1e5;
    v->element[1] = v->element[0];
    v->def.n_elements = 2;
    v->def.n_bodies = 1;
    set_name(v->body[0].name, "driver");
    v->body[0].mass_kg = DRIVER_KG;
    for (int k = 0; k < 3; k++) {
        v->body[0].inertia_kgm2[k] = 1e3;
    }
    v->body[0].z_m = -1.0;
    v->body[0].freedoms = KL_HAS(KL_Y);
    const struct kl_element_def e = {.end_a = 0,
                                     .end_b = KL_GROUND_END,
                                     .point_a_m = {0.0, 0.0, -1.0},
                                     .point_b_m = {0.0, 0.0, -1.0},
                                     .k = {0.0, DRIVER_KG * omega * omega},
                                     .along = KL_ALONG_Y,
                                     .slip = slip};
    v->element[0] = e;
    set_name(v->element[0].name, "element");
}

static void begin(const struct built *b, struct kl_state *x, double amplitude) {
    assert_int_equal(kl_init(&b->model, x, 0, 0, work()), KL_OK);
    x->x[0] = (kl_real)amplitude;
    kl_refresh(&b->model, x, work());
}

/* The force of the element in a state: k (d - u), within its limit. */
static double force_of(const struct built *b, const struct kl_state *x) {
    const struct kl_slip *s = &b->model.struts.slip[0];
    const double w = (double)x->x[0] - (double)x->x[b->model.n_states - 1];
    return (double)s->k * fmax(fmin(w, (double)s->most_m), -(double)s->most_m);
}

/*
 * Frequency response of the Maxwell element: F/D = k i omega tau/(1 + i omega tau). For any tau from
 * far below the step to far beyond a period.
 */
static void series_damper_answers_every_frequency(void **state) {
    (void)state;
    const double k = 1e4;
    const double hertz[] = {0.5, 2.0, 10.0};
    const double taus[] = {1e-6, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 30.0};
    for (size_t i = 0; i < COUNT(hertz) * COUNT(taus); i++) {
        const double omega = 2.0 * M_PI * hertz[i / COUNT(taus)];
        const double tau = taus[i % COUNT(taus)];
        const double amplitude = 1e-3;
        const int period = (int)(1000.0 / hertz[i / COUNT(taus)]);
        struct vehicle v;
        struct built b;
        struct kl_state x;
        driver(&v, omega, (struct kl_slip_def){.k = k, .c = k * tau});
        build(&v, &b);
        begin(&b, &x, amplitude);
        /* what is left of the beginning falls with exp(-t/tau): a steady part is taken off instead
         * of waiting, with one period begun in the steady state */
        const double q = omega * tau / (1.0 + omega * tau * omega * tau);
        const double w_cos = omega * tau * q; /* w = amplitude (w_cos cos - q sin) */
        x.x[b.model.n_states - 1] = (kl_real)(amplitude * (1.0 - w_cos));
        kl_refresh(&b.model, &x, work());
        double in_phase = 0.0;
        double ahead = 0.0;
        for (int n = 1; n <= period; n++) {
            assert_int_equal(coast(&b.model, &x, 1, NULL), 0);
            const double angle = 2.0 * M_PI * n / period;
            in_phase += 2.0 / period * force_of(&b, &x) * cos(angle);
            ahead -= 2.0 / period * force_of(&b, &x) * sin(angle);
        }
        const double size = k * amplitude * omega * tau / sqrt(1.0 + omega * tau * omega * tau);
        /* half a step behind where the damper alone acts: the mean velocity of the step */
        const double tolerance = size * (0.51 * omega * 1e-3 + 1e-3);
        assert_near(in_phase, k * amplitude * w_cos, tolerance);
        assert_near(ahead, k * amplitude * q, tolerance);
        unbuild(&b);
    }
}

/* A stiff damper on a light body, over all ratios: nothing grows, wherever the spring alone and the
 * damper alone would stay below the limits of the step. */
static void any_ratio_is_stable(void **state) {
    (void)state;
    for (int i = 0; i < 40; i++) {
        const double mass = 1000.0;
        const double k = mass * 1e6 * 3.0;                  /* omega h = 1.73 < 2 */
        const double c = 1e-2 * pow(10.0, 0.3 * (double)i); /* up to 1e10 */
        struct vehicle v;
        struct built b;
        struct kl_state x;
        driver(&v, 0.0, (struct kl_slip_def){.k = k, .c = c});
        v.body[0].mass_kg = mass;
        build(&v, &b);
        begin(&b, &x, 0.0);
        x.x[1] = (kl_real)0.1;
        kl_refresh(&b.model, &x, work());
        for (int n = 0; n < 5000; n++) {
            assert_int_equal(coast(&b.model, &x, 1, NULL), 0);
            assert_at_most(fabs((double)x.x[1]), 0.2);
        }
        unbuild(&b);
    }
}

/* Work of a cycle of amplitude A: 4 F (A - F/k), whatever the frequency; nothing where it sticks. */
static void friction_takes_its_work_each_cycle(void **state) {
    (void)state;
    const double force = 5.0;
    const double k = 5e3; /* slides from 1 mm on */
    const double hertz[] = {0.5, 5.0};
    const double amplitudes[] = {0.5e-3, 2e-3, 10e-3};
    for (size_t i = 0; i < COUNT(hertz) * COUNT(amplitudes); i++) {
        const double omega = 2.0 * M_PI * hertz[i / COUNT(amplitudes)];
        const double amplitude = amplitudes[i % COUNT(amplitudes)];
        const int period = (int)(1000.0 / hertz[i / COUNT(amplitudes)]);
        struct vehicle v;
        struct built b;
        struct kl_state x;
        driver(&v, omega, (struct kl_slip_def){.k = k, .limit = force});
        build(&v, &b);
        begin(&b, &x, amplitude);
        double work = 0.0;
        for (int n = 0; n < 2 * period; n++) {
            const double d = (double)x.x[0];
            const double f = force_of(&b, &x);
            assert_int_equal(coast(&b.model, &x, 1, NULL), 0);
            work += n < period ? 0.0 : 0.5 * (f + force_of(&b, &x)) * ((double)x.x[0] - d);
        }
        const double slides = fmax(amplitude - force / k, 0.0);
        assert_near(work, 4.0 * force * slides, 2e-3 * 4.0 * force * amplitude);
        unbuild(&b);
    }
}

/* A spring and friction: each half swing loses 2 F/K (Den Hartog); then it sticks, and the slider
 * does not move by a bit. */
static void friction_stops_a_swing(void **state) {
    (void)state;
    const double mass = 1000.0;
    const double spring = 4e5;
    const double force = 200.0;
    struct vehicle v;
    struct built b;
    struct kl_state x;
    driver(&v, 0.0, (struct kl_slip_def){.k = 1e8, .limit = force});
    v.body[0].mass_kg = mass;
    v.element[0].k[1] = spring;
    v.element[0].c[1] = 20.0;
    build(&v, &b);
    begin(&b, &x, 5.25e-3);
    x.x[b.model.n_states - 1] = x.x[0];
    kl_refresh(&b.model, &x, work());
    double peak[4] = {0};
    int peaks = 0;
    for (int n = 0; n < 6000; n++) {
        const kl_real before = x.x[1];
        assert_int_equal(coast(&b.model, &x, 1, NULL), 0);
        if (before * x.x[1] < 0 && peaks < 4) {
            peak[peaks++] = fabs((double)x.x[0]);
        }
    }
    assert_int_equal(peaks, 4);
    for (int i = 0; i < 4; i++) { /* the little damper takes 1 % a half swing besides */
        assert_near(peak[i], 5.25e-3 - 2.0 * (i + 1) * force / spring, 2.5e-4);
    }
    const kl_real slider = x.x[b.model.n_states - 1];
    for (int n = 0; n < 10000; n++) {
        assert_int_equal(coast(&b.model, &x, 1, NULL), 0);
        assert_true(x.x[b.model.n_states - 1] == slider);
    }
    /* what swings on is elastic: F/k at the angular frequency of both springs */
    assert_at_most(fabs((double)x.x[1]), force / 1e8 * sqrt((1e8 + spring) / mass));
    unbuild(&b);
}

/* A damper that blows off never pulls harder than its limit, and recovers. */
static void series_damper_blows_off(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    struct kl_state x;
    double most = 0.0;
    driver(&v, 2.0 * M_PI, (struct kl_slip_def){.k = 8e6, .c = 4e5, .limit = 12e3});
    build(&v, &b);
    begin(&b, &x, 10e-3);
    double quiet = 0.0;
    for (int n = 0; n < 4000; n++) {
        assert_int_equal(coast(&b.model, &x, 1, NULL), 0);
        most = fmax(most, fabs(force_of(&b, &x)));
        /* at the turns of the motion force and velocity are small */
        quiet =
            n > 1000 && fabs((double)x.x[1]) < 4e-4 ? fmax(quiet, fabs(force_of(&b, &x))) : quiet;
    }
    assert_near(most, 12e3, 1e-6);
    assert_at_most(quiet, 4e5 * (4e-4 + 62.8e-3 * 0.3)); /* lags by tau = 50 ms at most */
    unbuild(&b);
}

/* ---- in a vehicle ---- */

/* The wagon with all of it. */
static void equip(struct vehicle *v) {
    static const double at[] = {-0.02, -0.003, 0.003, 0.02};
    static const double force[] = {-5e4, 0.0, 0.0, 5e4};
    static const double speed[] = {-1.0, -0.05, 0.05, 1.0};
    static const double damping[] = {-8e3, -4e3, 4e3, 8e3};
    wagon(v, arcs_pair(KL_KINEMATICS_RIGID));
    for (int i = 0; i < 4; i++) {
        struct kl_element_def *e = &v->element[i];
        memset(e->c, 0, sizeof e->c);
        e->along = i < 2 ? KL_ALONG_Y : KL_ALONG_Z;
        e->slip = i % 2 == 0 ? (struct kl_slip_def){.k = 5e6, .limit = 2e3}
                             : (struct kl_slip_def){.k = 5e6, .c = 3e4, .limit = 8e3};
        e->stop = (struct kl_table_def){COUNT(at), at, force};
        e->damper = (struct kl_table_def){COUNT(speed), speed, damping};
    }
}

static void disturb(const struct kl_model *m, struct kl_state *x) {
    const double place[KL_FREEDOMS] = {6e-3, 5e-3, 4e-3, 1e-3, -1e-3};
    for (int f = 0; f < KL_FREEDOMS; f++) {
        x->x[kl_body_state_index(m, 0, (enum kl_freedom)f, 0)] = (kl_real)place[f];
    }
    kl_refresh(m, x, work());
}

/* At standstill, without creep: passive elements only take. */
static void energy_never_grows(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    struct kl_state x;
    equip(&v);
    v.wheelset[0].creep.friction = v.wheelset[1].creep.friction = 0;
    build(&v, &b);
    assert_int_equal(kl_init(&b.model, &x, 0, 0, work()), KL_OK);
    const double rest = (double)kl_energy(&b.model, &x, work());
    disturb(&b.model, &x);
    const double first = (double)kl_energy(&b.model, &x, work()) - rest;
    double least = first;
    double rise = 0.0;
    for (int n = 0; n < 8000; n++) {
        assert_int_equal(coast(&b.model, &x, 1, NULL) & KL_FAULTS_HOLD, 0);
        const double now = (double)kl_energy(&b.model, &x, work()) - rest;
        rise = fmax(rise, now - least);
        least = fmin(least, now);
    }
    print_message("%.4f of the energy left after 8 s; largest rise %.1e of it\n", least / first,
                  rise / first);
    assert_at_most(rise, 3e-3 * first);
    assert_at_most(least, 0.1 * first);
    unbuild(&b);
}

/* Halving the step: without kinks (no stop is met, no slider slips) the order is two. */
static void converges_with_the_second_order(void **state) {
    (void)state;
    kl_real at_end[4][KL_MAX_STATES];
    uint32_t n_states = 0;
    for (int i = 0; i < 4; i++) {
        struct vehicle v;
        struct built b;
        struct kl_state x;
        equip(&v);
        for (int k = 0; k < 4; k++) {
            v.element[k].damper.n = 0;
            v.element[k].stop.n = 0;
            v.element[k].slip.c = 3e4;
            v.element[k].slip.limit = 0.0;
            v.element[k].c[1] = v.element[k].c[2] = 1e4;
        }
        v.wheelset[0].creep = v.wheelset[1].creep = constant_creep();
        v.def.step_ns = i < 3 ? 1000000 >> i : 15625;
        build(&v, &b);
        assert_int_equal(kl_init(&b.model, &x, 0, 30, work()), KL_OK);
        disturb(&b.model, &x);
        const uint64_t steps = (uint64_t)(500000000 / v.def.step_ns);
        assert_int_equal(coast(&b.model, &x, steps, NULL), 0);
        memcpy(at_end[i], x.x, sizeof at_end[i]);
        n_states = b.model.n_states;
        unbuild(&b);
    }
    double error[3] = {0};
    for (int i = 0; i < 3; i++) {
        for (uint32_t k = 0; k < n_states; k++) {
            const double off = (double)(at_end[i][k] - at_end[3][k]);
            error[i] += off * off;
        }
    }
    const double order = 0.5 * log2(error[0] / error[1]);
    const double finer = 0.5 * log2(error[1] / error[2]);
    print_message("order %.2f from 1 ms, %.2f from 0.5 ms\n", order, finer);
    assert_true(order > 1.8 && finer > 1.8);
}

/* A snapshot holds the slips: going on from it is going on. */
static void snapshots_hold_the_slips(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    struct kl_state x;
    struct kl_state y;
    static unsigned char bytes[KL_SNAPSHOT_SIZE];
    size_t used = 0;
    equip(&v);
    build(&v, &b);
    assert_int_equal(kl_init(&b.model, &x, 0, 20, work()), KL_OK);
    disturb(&b.model, &x);
    (void)coast(&b.model, &x, 500, NULL);
    const uint64_t before = kl_state_hash(&x);
    assert_int_equal(kl_snapshot(&b.model, &x, bytes, sizeof bytes, &used), KL_OK);
    assert_int_equal(kl_restore(&b.model, &y, bytes, used), KL_OK);
    assert_true(kl_state_hash(&y) == before);
    (void)coast(&b.model, &x, 500, NULL);
    (void)coast(&b.model, &y, 500, NULL);
    assert_true(kl_state_hash(&x) == kl_state_hash(&y));
    assert_true(kl_state_hash(&x) != before);
    y.x[b.model.n_states - 1] += (kl_real)1e-9;
    assert_true(kl_state_hash(&x) != kl_state_hash(&y));
    unbuild(&b);
}

/* An actuator over the ground is a force at a height: wind on the side of a car body. */
static void actuators_push_where_they_are(void **state) {
    (void)state;
    struct vehicle v;
    struct built b;
    struct kl_state x;
    kl_real rates[2][KL_MAX_STATES];
    struct kl_input input;
    wagon(&v, linear_pair(0.1));
    v.element[4].end_a = 0;
    v.element[4].end_b = KL_GROUND_END;
    v.element[4].point_a_m[0] = v.element[4].point_b_m[0] = 2.0;
    v.element[4].point_a_m[2] = v.element[4].point_b_m[2] = -2.4; /* 0.75 above the centre */
    v.element[4].along = KL_ALONG_Y;
    v.element[4].actuator = 3;
    v.def.n_elements = 5;
    build(&v, &b);
    assert_int_equal(kl_init(&b.model, &x, 0, 20, work()), KL_OK);
    kl_input_init(&input);
    input.speed_m_s = 20;
    kl_rates(&b.model, &x, &input, rates[0], work());
    input.actuator_N[2] = 10000;
    kl_rates(&b.model, &x, &input, rates[1], work());
    const enum kl_freedom freedom[3] = {KL_Y, KL_ROLL, KL_YAW};
    const double want[3] = {1e4 / 37200.0, 0.75e4 / 34.4e3, 2e4 / 627e3};
    for (int i = 0; i < 3; i++) {
        const int32_t at = kl_body_state_index(&b.model, 0, freedom[i], 1);
        assert_near((double)(rates[1][at] - rates[0][at]), want[i], 1e-12);
    }
    input.actuator_N[2] = (kl_real)NAN;
    assert_int_equal(kl_step(&b.model, &x, &input, NULL, work()), KL_FAULT_INPUT);
    kl_clear_faults(&x);
    input.actuator_N[2] = (kl_real)2e7;
    assert_int_equal(kl_step(&b.model, &x, &input, NULL, work()), KL_FAULT_INPUT);
    kl_clear_faults(&x);
    input.actuator_N[2] = (kl_real)1e4;
    assert_int_equal(kl_step(&b.model, &x, &input, NULL, work()), 0);
    unbuild(&b);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(series_damper_answers_every_frequency),
        cmocka_unit_test(any_ratio_is_stable),
        cmocka_unit_test(friction_takes_its_work_each_cycle),
        cmocka_unit_test(friction_stops_a_swing),
        cmocka_unit_test(series_damper_blows_off),
        cmocka_unit_test(energy_never_grows),
        cmocka_unit_test(converges_with_the_second_order),
        cmocka_unit_test(snapshots_hold_the_slips),
        cmocka_unit_test(actuators_push_where_they_are),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
