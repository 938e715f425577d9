/*
 * golden.c - runs vehicles and prints what they did, to the last bit.
 *
 * usage: golden [--steps N] [--linked] [SCENARIO]
 *     all scenarios, those alone whose models are linked, or one; each for at most N steps
 * Output, one item a line:
 *     version N                                    KL_MODEL_VERSION
 *     columns NAME t_s state output front.y_mm ...  what stands in the trace of a scenario
 *     trace NAME TIME_S STATE OUTPUT NUMBER ...
 *     scenario NAME model HASH state HASH output HASH faults N steps N
 * `state` is a hash over the hashes of the state after every step up to there, `output` one over all
 * numbers of the outputs; a run that ends early has the same rows as far as it went. The scenarios
 * here are definitions in C, built by the core where this runs; those of linked.inc are models that
 * klingel build made of files. golden.py writes profiles.inc from models/profiles, and linked.inc.
 * Nothing here needs libm or a file, so the program runs on a target as well.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "vehicles.h"

#include "profiles.inc"

#define TRACE_EVERY 500u
#define SAMPLES 1200u

static unsigned char memory[1u << 20];
static double irregularity[3][SAMPLES];
static double zeta_s1002[PROFILE_S1002_POINTS];
static double eta_s1002[PROFILE_S1002_POINTS];
static double zeta_uic60[PROFILE_UIC60_POINTS];
static double eta_uic60[PROFILE_UIC60_POINTS];

static struct kl_pair_def s1002_uic60(void) {
    for (unsigned i = 0; i < PROFILE_S1002_POINTS; i++) {
        eta_s1002[i] = 1e-3 * profile_s1002[i][0];
        zeta_s1002[i] = 1e-3 * profile_s1002[i][1];
    }
    for (unsigned i = 0; i < PROFILE_UIC60_POINTS; i++) {
        eta_uic60[i] = 1e-3 * profile_uic60[i][0];
        zeta_uic60[i] = 1e-3 * profile_uic60[i][1];
    }
    const struct profile_points wheel = {PROFILE_S1002_POINTS, eta_s1002, zeta_s1002};
    const struct profile_points rail = {PROFILE_UIC60_POINTS, eta_uic60, zeta_uic60};
    return points_pair(wheel, rail);
}

/* ERRI B176 low, over 300 m from s = 0. */
static int rough_track(struct vehicle *v) {
    const struct kl_spectrum_def spectrum = {.lateral_A = 2.119e-7,
                                             .vertical_A = 4.032e-7,
                                             .cross_A = 4.032e-7,
                                             .shortest_m = 3.0,
                                             .longest_m = 100.0,
                                             .taper_m = 20.0,
                                             .n_waves = 200,
                                             .seed = 20};
    struct kl_irregularity_def *r = &v->track.irregularity;
    r->n_samples = SAMPLES;
    r->step_m = 0.25;
    r->lateral_m = irregularity[0];
    r->vertical_m = irregularity[1];
    r->cross_rad = irregularity[2];
    return kl_spectrum_synthesise(&spectrum, 0.25, SAMPLES, irregularity[0], irregularity[1],
                                  irregularity[2]) == KL_OK;
}

/* ---- what is run ---- */

struct run {
    double from_m;
    double speed_m_s;  /* at the start */
    double target_m_s; /* set-point of all steps */
    double y_m;        /* of the first wheelset at the start */
    unsigned steps;
};

static int lone_wheelset(struct vehicle *v, struct run *run) {
    struct kl_pair_def pair = arcs_pair(KL_KINEMATICS_RIGID);
    single_wheelset(v, pair, 1e6, 1e6);
    v->wheelset[0].load_N = 87737.5;
    run->speed_m_s = run->target_m_s = 30.0;
    run->y_m = 3e-3;
    run->steps = 3000;
    return 1;
}

static int wagon_in_a_curve(struct vehicle *v, struct run *run) {
    wagon(v, s1002_uic60());
    one_curve(v, KL_RAMP_BLOSS, 1.0 / 600.0, 0.06);
    run->speed_m_s = 18.0;
    run->target_m_s = 25.0;
    run->steps = 12000;
    return rough_track(v);
}

static int crawling_wagon(struct vehicle *v, struct run *run) {
    wagon(v, s1002_uic60());
    one_curve(v, KL_RAMP_HALF_SINE, -1.0 / 300.0, -0.1);
    run->target_m_s = 3.0;
    run->y_m = 1e-3;
    run->steps = 12000;
    return rough_track(v);
}

static int fast_wagon(struct vehicle *v, struct run *run) {
    wagon(v, linear_pair(0.05));
    v->def.step_ns = 500000;
    v->wheelset[1].creep = constant_creep();
    for (int i = 0; i < 4; i++) {
        v->element[i].k[0] = 1e7;
        v->element[i].c[0] = 1e5;
    }
    run->speed_m_s = 80.0;
    run->target_m_s = 90.0;
    run->y_m = 2e-3;
    run->steps = 10000;
    return rough_track(v);
}

static const struct {
    const char *name;
    int (*define)(struct vehicle *v, struct run *run);
} scenarios[] = {{"lone_wheelset", lone_wheelset},
                 {"wagon_in_a_curve", wagon_in_a_curve},
                 {"crawling_wagon", crawling_wagon},
                 {"fast_wagon", fast_wagon}};

/* Those that golden.py had made of files. */
struct linked {
    const char *name;
    const struct kl_model *model;
    struct run run;
};
#include "linked.inc"

/* ---- hashing and printing ---- */

/* As numbers, so that padding and the width of a pointer do not matter; -0 is 0. */
static uint64_t add_real(uint64_t hash, kl_real x) {
    const double value = (double)x + 0.0;
    unsigned char bytes[sizeof value];
    memcpy(bytes, &value, sizeof bytes);
    return kl_hash_bytes(hash, bytes, sizeof bytes);
}

static uint64_t add_contact(uint64_t h, const struct kl_contact_output *c, int s) {
    const kl_real values[] = {c->normal_N[s], c->t1_N[s],      c->t2_N[s],       c->m3_Nm[s],
                              c->gamma1[s],   c->gamma2[s],    c->omega3_1_m[s], c->reduction[s],
                              c->radius_m[s], c->delta_rad[s], c->eta_wheel_m[s]};
    for (unsigned i = 0; i < sizeof values / sizeof values[0]; i++) {
        h = add_real(h, values[i]);
    }
    return h;
}

static uint64_t add_wheel(uint64_t h, const struct kl_wheelset_output *w, int s) {
    h = add_real(add_real(h, w->q_N[s]), w->y_N[s]);
    h = add_real(add_real(h, w->rise_m[s]), w->rail_m[s]);
    return add_contact(add_contact(h, &w->tread, s), &w->flange, s);
}

static uint64_t add_output(uint64_t h, const struct kl_model *m, const struct kl_output *o) {
    h = add_real(add_real(h, o->s_m), o->speed_m_s);
    for (uint32_t b = 0; b < m->n_bodies; b++) {
        for (unsigned f = 0; f < KL_FREEDOMS; f++) {
            h = add_real(h, o->body[b].position[f]);
            h = add_real(h, o->body[b].rate[f]);
            h = add_real(h, o->body[b].acceleration[f]);
        }
    }
    for (uint32_t w = 0; w < m->n_wheelsets; w++) {
        const struct kl_wheelset_output *s = &o->wheelset[w];
        h = add_real(add_real(add_real(h, s->z_m), s->roll_rad), s->force_y_N);
        h = add_real(add_real(h, s->y_acc_m_s2), s->z_acc_m_s2);
        h = add_wheel(add_wheel(h, s, KL_RIGHT), s, KL_LEFT);
    }
    return h;
}

static uint64_t add_hash(uint64_t h, uint64_t other) {
    unsigned char bytes[8];
    for (int i = 0; i < 8; i++) {
        bytes[i] = (unsigned char)(other >> (8 * i));
    }
    return kl_hash_bytes(h, bytes, sizeof bytes);
}

/* Of everything up to now. */
struct streams {
    uint64_t states;
    uint64_t outputs;
};

static void print_columns(const char *name, const struct kl_model *m) {
    printf("columns %s t_s state output", name);
    for (uint32_t w = 0; w < m->n_wheelsets; w++) {
        const char *part = m->wheelsets[w].name;
        printf(" %s.y_mm %s.yaw_mrad %s.right.Q_kN %s.Y_kN", part, part, part, part);
    }
    for (uint32_t b = 0; b < m->n_bodies; b++) {
        const char *part = m->bodies[b].name;
        printf(" %s.y_mm %s.z_mm %s.roll_mrad", part, part, part);
    }
    printf("\n");
}

static void trace(const char *name, const struct kl_model *m, const struct kl_output *o,
                  const struct streams *streams) {
    printf("trace %s %.3f %016llx %016llx", name, 1e-9 * (double)o->time_ns,
           (unsigned long long)streams->states, (unsigned long long)streams->outputs);
    for (uint32_t i = 0; i < m->n_wheelsets; i++) {
        const struct kl_wheelset_output *w = &o->wheelset[i];
        printf(" %.6f %.6f %.6f %.6f", 1e3 * (double)w->y_m, 1e3 * (double)w->yaw_rad,
               1e-3 * (double)w->q_N[KL_RIGHT], 1e-3 * (double)w->force_y_N);
    }
    for (uint32_t i = 0; i < m->n_bodies; i++) {
        const kl_real *at = o->body[i].position;
        printf(" %.6f %.6f %.6f", 1e3 * (double)at[KL_Y], 1e3 * (double)at[KL_Z],
               1e3 * (double)at[KL_ROLL]);
    }
    printf("\n");
}

static int run_model(const char *name, const struct kl_model *model, const struct run *run,
                     unsigned most_steps) {
    static struct kl_output o;
    static struct kl_state x;
    static struct kl_work work;
    struct kl_input input;
    const struct kl_output blank = {0};
    o = blank;
    if (kl_model_check(model) != KL_OK ||
        kl_init(model, &x, (kl_real)run->from_m, (kl_real)run->speed_m_s, &work) != KL_OK) {
        printf("failed %s: model\n", name);
        return 1;
    }
    x.x[kl_wheelset_state_index(model, 0, KL_WS_Y)] += (kl_real)run->y_m;
    kl_refresh(model, &x, &work);
    kl_input_init(&input);
    print_columns(name, model);
    input.speed_m_s = (kl_real)run->target_m_s;
    struct streams streams = {KL_HASH_SEED, KL_HASH_SEED};
    uint32_t faults = 0;
    unsigned steps = run->steps < most_steps ? run->steps : most_steps;
    for (unsigned i = 1; i <= steps; i++) {
        faults = kl_step(model, &x, &input, &o, &work);
        streams.states = add_hash(streams.states, kl_state_hash(&x));
        streams.outputs = add_output(streams.outputs, model, &o);
        if (i % TRACE_EVERY == 0) {
            trace(name, model, &o, &streams);
        }
    }
    printf("scenario %s model %016llx state %016llx output %016llx faults %u steps %u\n", name,
           (unsigned long long)model->hash, (unsigned long long)streams.states,
           (unsigned long long)streams.outputs, (unsigned)faults, steps);
    return 0;
}

static int run_built(const char *name, int (*define)(struct vehicle *, struct run *),
                     unsigned most_steps) {
    static struct vehicle v;
    struct kl_arena arena;
    struct kl_model model;
    struct kl_diag diag = {.what = "track"};
    struct run run = {0};
    kl_arena_init(&arena, memory, sizeof memory);
    if (!define(&v, &run) || kl_build(&v.def, &arena, &model, &diag) != KL_OK) {
        printf("failed %s: %s\n", name, diag.what);
        return 1;
    }
    return run_model(name, &model, &run, most_steps);
}

int main(int argc, char **argv) {
    const char *only = NULL;
    unsigned most_steps = ~0u;
    int linked_alone = 0;
    int failed = 0;
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--steps") == 0 && i + 1 < argc) {
            most_steps = (unsigned)strtoul(argv[++i], NULL, 10);
        } else if (strcmp(argv[i], "--linked") == 0) {
            linked_alone = 1;
        } else {
            only = argv[i];
        }
    }
    printf("version %u\n", (unsigned)KL_MODEL_VERSION);
    for (unsigned i = 0; i < sizeof scenarios / sizeof scenarios[0] && !linked_alone; i++) {
        if (only == NULL || strcmp(only, scenarios[i].name) == 0) {
            failed |= run_built(scenarios[i].name, scenarios[i].define, most_steps);
        }
    }
    for (const struct linked *l = linked; l->name != NULL; l++) {
        if (only == NULL || strcmp(only, l->name) == 0) {
            failed |= run_model(l->name, l->model, &l->run, most_steps);
        }
    }
    return failed;
}
