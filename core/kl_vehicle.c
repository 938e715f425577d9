/* kl_vehicle.c - from definitions to the model, and the model's identity. */
#include "kl_vehicle.h"

#include "kl_diag.h"
#include "kl_math.h"
#include "kl_saturate.h"
#include "kl_step.h"
#include "kl_suspension.h"

static int positive(double x, double limit) {
    return x > 0.0 && x < limit;
}

static enum kl_status check_body(const struct kl_body_def *b, int32_t i, struct kl_diag *diag) {
    if (!positive(b->mass_kg, 1e7)) {
        return kl_report(diag, KL_ERR_VALUE, "body: mass_kg must be in 0..1e7", i, b->mass_kg);
    }
    for (int k = 0; k < 3; k++) {
        if (!positive(b->inertia_kgm2[k], 1e9)) {
            return kl_report(diag, KL_ERR_VALUE, "body: inertia_kgm2 must be in 0..1e9", i,
                             b->inertia_kgm2[k]);
        }
    }
    if (!(kl_abs(b->x_m) < 1e3 && kl_abs(b->z_m) < 20.0)) {
        return kl_report(diag, KL_ERR_VALUE, "body: |x_m| must be below 1000, |z_m| below 20", i,
                         kl_abs(b->x_m) < 1e3 ? b->z_m : b->x_m);
    }
    if (b->freedoms == 0 || b->freedoms >= KL_HAS(KL_FREEDOMS)) {
        return kl_report(diag, KL_ERR_VALUE, "body: freedoms must be 1..31", i, b->freedoms);
    }
    return KL_OK;
}

/* k_A and k_S where they are not given. */
static kl_real or_one(kl_real k) {
    return k != KL_R(0) ? k : KL_R(1);
}

static enum kl_status check_creep(const struct kl_creep_def *c, int32_t i, struct kl_diag *diag) {
    if ((uint32_t)c->law >= (uint32_t)KL_CREEP_LAWS) {
        return kl_report(diag, KL_ERR_VALUE, "creep: unknown law", i, (double)c->law);
    }
    const struct kl_friction friction = {c->friction, c->falling_ratio, c->falling_decay_s_m,
                                         or_one(c->k_a), or_one(c->k_s)};
    const enum kl_status status = kl_friction_check(&friction, diag);
    if (status != KL_OK) {
        if (diag != NULL) {
            diag->index = i;
        }
        return status;
    }
    if (c->f11_N > KL_R(0) && !kl_saturates(c->law)) {
        return kl_report(diag, KL_ERR_VALUE,
                         "creep: f11..f33 go with the laws linear and she alone", i,
                         (double)c->f11_N);
    }
    const kl_real f[4] = {c->f11_N, c->f22_N, c->f23_Nm, c->f33_Nm2};
    for (int k = 0; k < 4; k++) {
        if (!(f[k] >= KL_R(0) && f[k] < KL_R(1e12))) {
            return kl_report(diag, KL_ERR_VALUE, "creep: f11..f33 must be in 0..1e12", i,
                             (double)f[k]);
        }
    }
    return KL_OK;
}

static enum kl_status check_wheelset(const struct kl_vehicle_def *def, uint32_t index,
                                     struct kl_diag *diag) {
    const struct kl_wheelset_def *w = &def->wheelsets[index];
    const int32_t i = (int32_t)index;
    if (!positive(w->mass_kg, 1e5)) {
        return kl_report(diag, KL_ERR_VALUE, "wheelset: mass_kg must be in 0..1e5", i, w->mass_kg);
    }
    const double inertia[3] = {w->inertia_roll_kgm2, w->inertia_spin_kgm2, w->inertia_yaw_kgm2};
    for (int k = 0; k < 3; k++) {
        if (!positive(inertia[k], 1e6)) {
            return kl_report(diag, KL_ERR_VALUE, "wheelset: inertias must be in 0..1e6 kg m2", i,
                             inertia[k]);
        }
    }
    if (!(kl_abs(w->x_m) < 1e3)) {
        return kl_report(diag, KL_ERR_VALUE, "wheelset: |x_m| must be below 1000", i, w->x_m);
    }
    if (!(w->load_N >= 0.0 && w->load_N < 1e7)) {
        return kl_report(diag, KL_ERR_VALUE, "wheelset: load_N must be in 0..1e7", i, w->load_N);
    }
    if (w->pair >= def->n_pairs) {
        return kl_report(diag, KL_ERR_REFERENCE, "wheelset: no such wheel-rail pair", i, w->pair);
    }
    if (!(w->coupling_Nms_rad >= 0.0 && w->coupling_Nms_rad < 1e9) ||
        (w->coupling_Nms_rad != 0.0 && w->independent == 0)) {
        return kl_report(diag, KL_ERR_VALUE,
                         "wheelset: coupling_Nms_rad must be in 0..1e9, and 0 on a solid axle", i,
                         w->coupling_Nms_rad);
    }
    return check_creep(&w->creep, i, diag);
}

static enum kl_status check_running(const struct kl_running_def *r, struct kl_diag *diag) {
    const double given[3] = {r->resistance_N, r->resistance_Ns_m, r->resistance_Ns2_m2};
    for (int k = 0; k < 3; k++) {
        if (!(given[k] >= 0.0 && given[k] < 1e8)) {
            return kl_report(diag, KL_ERR_VALUE, "vehicle: running resistances must be in 0..1e8",
                             -1, given[k]);
        }
        if (given[k] != 0.0 && r->free == 0) {
            return kl_report(diag, KL_ERR_VALUE, "vehicle: a running resistance needs a free speed",
                             -1, given[k]);
        }
    }
    return KL_OK;
}

static enum kl_status check_vehicle(const struct kl_vehicle_def *def, struct kl_diag *diag) {
    if (def->n_bodies > KL_MAX_BODIES || def->n_wheelsets > KL_MAX_WHEELSETS ||
        def->n_pairs > KL_MAX_PAIRS || def->n_elements > KL_MAX_ELEMENTS ||
        def->n_linkages > KL_MAX_LINKAGES) {
        return kl_report(diag, KL_ERR_CAPACITY,
                         "vehicle: too many bodies, wheelsets, pairs, elements or linkages", -1,
                         0.0);
    }
    if (def->n_wheelsets == 0 || def->n_pairs == 0 || def->wheelsets == NULL ||
        def->pairs == NULL || (def->n_bodies != 0 && def->bodies == NULL) ||
        (def->n_elements != 0 && def->elements == NULL) ||
        (def->n_linkages != 0 && def->linkages == NULL) || def->track == NULL) {
        return kl_report(diag, KL_ERR_ARGUMENT, "vehicle: needs a wheelset, a pair and a track", -1,
                         0.0);
    }
    if (def->step_ns < 10000 || def->step_ns > 10000000) {
        return kl_report(diag, KL_ERR_VALUE, "vehicle: step_ns must be in 10000..10000000", -1,
                         (double)def->step_ns);
    }
    if (!(def->gravity_m_s2 >= 0.0 && def->gravity_m_s2 <= 20.0)) {
        return kl_report(diag, KL_ERR_VALUE, "vehicle: gravity_m_s2 must be in 0..20", -1,
                         def->gravity_m_s2);
    }
    if (!positive(def->acceleration_limit_m_s2, 1e3)) {
        return kl_report(diag, KL_ERR_VALUE, "vehicle: acceleration_limit_m_s2 must be in 0..1000",
                         -1, def->acceleration_limit_m_s2);
    }
    enum kl_status status = check_running(&def->running, diag);
    for (uint32_t i = 0; i < def->n_bodies && status == KL_OK; i++) {
        status = check_body(&def->bodies[i], (int32_t)i, diag);
    }
    for (uint32_t i = 0; i < def->n_wheelsets && status == KL_OK; i++) {
        status = check_wheelset(def, i, diag);
    }
    return status;
}

static void copy_name(char *to, const char *from) {
    uint32_t i = 0;
    for (; i + 1u < KL_NAME_SIZE && from[i] != '\0'; i++) {
        to[i] = from[i];
    }
    for (; i < KL_NAME_SIZE; i++) {
        to[i] = '\0';
    }
}

static void set_body(struct kl_body *to, const struct kl_body_def *from) {
    copy_name(to->name, from->name);
    to->mass_kg = (kl_real)from->mass_kg;
    to->inverse[KL_Y] = (kl_real)(1.0 / from->mass_kg);
    to->inverse[KL_Z] = to->inverse[KL_Y];
    for (int k = 0; k < 3; k++) {
        to->inertia_kgm2[k] = (kl_real)from->inertia_kgm2[k];
        to->inverse[KL_ROLL + k] = (kl_real)(1.0 / from->inertia_kgm2[k]);
    }
    to->x_m = (kl_real)from->x_m;
    to->z_m = (kl_real)from->z_m;
    to->freedoms = from->freedoms;
}

static void set_wheelset(struct kl_wheelset *to, const struct kl_wheelset_def *from,
                         const double *preload, double gravity) {
    copy_name(to->name, from->name);
    to->mass_kg = (kl_real)from->mass_kg;
    to->inertia_roll_kgm2 = (kl_real)from->inertia_roll_kgm2;
    to->inertia_spin_kgm2 = (kl_real)from->inertia_spin_kgm2;
    to->inertia_yaw_kgm2 = (kl_real)from->inertia_yaw_kgm2;
    to->inv_spin_1_kgm2 = (kl_real)(1.0 / from->inertia_spin_kgm2);
    to->inv_yaw_1_kgm2 = (kl_real)(1.0 / from->inertia_yaw_kgm2);
    to->x_m = (kl_real)from->x_m;
    for (int k = 0; k < 4; k++) {
        to->preload[k] = (kl_real)preload[k];
    }
    to->static_load_N = (kl_real)(preload[1] + from->mass_kg * gravity);
    to->pair = from->pair;
    to->independent = from->independent != 0 ? 1u : 0u;
    to->coupling_Nms_rad = (kl_real)from->coupling_Nms_rad;
    to->creep = from->creep;
    to->creep.falls = from->creep.falls != 0 ? 1u : 0u;
    to->creep.k_a = or_one(from->creep.k_a);
    to->creep.k_s = from->creep.k_s != KL_R(0) ? from->creep.k_s : to->creep.k_a;
}

static void set_running(const struct kl_vehicle_def *def, struct kl_model *model) {
    double mass = 0.0;
    double rolling = 0.0;
    if (def->running.free == 0) {
        return;
    }
    for (uint32_t i = 0; i < def->n_bodies; i++) {
        mass += def->bodies[i].mass_kg;
    }
    for (uint32_t i = 0; i < def->n_wheelsets; i++) {
        const double r0 = (double)model->pairs[def->wheelsets[i].pair].radius_m;
        mass += def->wheelsets[i].mass_kg;
        rolling += def->wheelsets[i].inertia_spin_kgm2 / (r0 * r0);
    }
    model->running.free = 1u;
    model->running.mass_kg = (kl_real)mass;
    model->running.rolling_kg = (kl_real)(mass + rolling);
    model->running.resistance_N = (kl_real)def->running.resistance_N;
    model->running.resistance_Ns_m = (kl_real)def->running.resistance_Ns_m;
    model->running.resistance_Ns2_m2 = (kl_real)def->running.resistance_Ns2_m2;
}

/* The law whose coefficients a pair's rows must hold. Linear and saturated creep share theirs. */
static enum kl_status find_law(const struct kl_vehicle_def *def, uint32_t pair,
                               enum kl_creep_law *law, struct kl_diag *diag) {
    int found = 0;
    *law = KL_CREEP_SHE;
    for (uint32_t w = 0; w < def->n_wheelsets; w++) {
        enum kl_creep_law own = def->wheelsets[w].creep.law;
        own = own == KL_CREEP_LINEAR ? KL_CREEP_SHE : own;
        if (def->wheelsets[w].pair != pair) {
            continue;
        }
        if (found && own != *law) {
            return kl_report(diag, KL_ERR_VALUE,
                             "wheelset: of another creep law than others on its pair; give it a "
                             "pair of its own",
                             (int32_t)w, (double)own);
        }
        *law = own;
        found = 1;
    }
    if (*law == KL_CREEP_TABLE && kl_creep_table_check(def->creep_table) != KL_OK) {
        return kl_report(diag, KL_ERR_VALUE, "pair: the law table needs a sound creep table",
                         (int32_t)pair, 0.0);
    }
    return KL_OK;
}

static enum kl_status build_pairs(const struct kl_vehicle_def *def, struct kl_arena *arena,
                                  struct kl_model *model, struct kl_diag *diag) {
    struct kl_pair *pairs = kl_arena_take(arena, def->n_pairs, sizeof *pairs);
    if (pairs == NULL) {
        return kl_report(diag, KL_ERR_MEMORY, "pairs", -1, (double)arena->wanted);
    }
    for (uint32_t i = 0; i < def->n_pairs; i++) {
        struct kl_pair_def pair = def->pairs[i];
        enum kl_status status = find_law(def, i, &pair.law, diag);
        pair.creep_table = def->creep_table;
        status = status == KL_OK ? kl_pair_build(&pair, arena, &pairs[i], diag) : status;
        if (status != KL_OK) {
            if (diag != NULL && diag->index < 0) {
                diag->index = (int32_t)i;
            }
            return status;
        }
    }
    model->pairs = pairs;
    model->n_pairs = def->n_pairs;
    return KL_OK;
}

static enum kl_status build_parts(const struct kl_vehicle_def *def, struct kl_arena *arena,
                                  struct kl_model *model, struct kl_diag *diag) {
    struct kl_body *bodies = kl_arena_take(arena, def->n_bodies + 1u, sizeof *bodies);
    struct kl_wheelset *wheelsets = kl_arena_take(arena, def->n_wheelsets, sizeof *wheelsets);
    if (bodies == NULL || wheelsets == NULL) {
        return kl_report(diag, KL_ERR_MEMORY, "bodies and wheelsets", -1, (double)arena->wanted);
    }
    double axle_z_m[KL_MAX_WHEELSETS];
    double preload[4 * KL_MAX_WHEELSETS];
    for (uint32_t i = 0; i < def->n_wheelsets; i++) {
        axle_z_m[i] = -(double)model->pairs[def->wheelsets[i].pair].radius_m;
    }
    enum kl_status status =
        kl_suspension_build(def, axle_z_m, arena, &model->suspension, preload, diag);
    status = status == KL_OK ? kl_struts_build(def, axle_z_m, arena, &model->struts, diag) : status;
    if (status != KL_OK) {
        return status;
    }
    model->n_states = KL_WHEELSET_STATES * def->n_wheelsets + model->struts.n_slips;
    for (uint32_t i = 0; i < def->n_bodies; i++) {
        set_body(&bodies[i], &def->bodies[i]);
        model->n_states += 2u * kl_freedoms_of(&bodies[i]);
    }
    for (uint32_t i = 0; i < def->n_wheelsets; i++) {
        model->n_rails += model->pairs[def->wheelsets[i].pair].gives > KL_R(0) ? 1u : 0u;
        set_wheelset(&wheelsets[i], &def->wheelsets[i], &preload[4u * i], def->gravity_m_s2);
        model->n_twists += wheelsets[i].independent;
        if (!(wheelsets[i].static_load_N >= KL_R(0))) {
            return kl_report(diag, KL_ERR_VALUE, "wheelset: static load is negative", (int32_t)i,
                             (double)wheelsets[i].static_load_N);
        }
    }
    model->n_states += KL_SIDES * model->n_rails + model->n_twists;
    model->n_bodies = def->n_bodies;
    model->n_wheelsets = def->n_wheelsets;
    model->bodies = bodies;
    model->wheelsets = wheelsets;
    return KL_OK;
}

enum kl_status kl_build(const struct kl_vehicle_def *def, struct kl_arena *arena,
                        struct kl_model *model, struct kl_diag *diag) {
    if (def == NULL || arena == NULL || model == NULL) {
        return kl_report(diag, KL_ERR_ARGUMENT, "kl_build: NULL", -1, 0.0);
    }
    const struct kl_model blank = {0};
    *model = blank;
    (void)kl_report(diag, KL_OK, "", -1, 0.0);
    enum kl_status status = check_vehicle(def, diag);
    status = status == KL_OK ? build_pairs(def, arena, model, diag) : status;
    status = status == KL_OK ? build_parts(def, arena, model, diag) : status;
    status = status == KL_OK ? kl_track_build(def->track, arena, &model->track, diag) : status;
    if (status != KL_OK) {
        return status;
    }
    model->version = KL_MODEL_VERSION;
    model->real_bytes = sizeof(kl_real);
    copy_name(model->name, def->name);
    model->step_ns = def->step_ns;
    model->step_s = (kl_real)((double)def->step_ns * 1e-9);
    model->gravity_m_s2 = (kl_real)def->gravity_m_s2;
    model->acceleration_limit_m_s2 = (kl_real)def->acceleration_limit_m_s2;
    set_running(def, model);
    for (uint32_t i = 0; i < model->n_pairs; i++) {
        if (model->pairs[i].law == KL_CREEP_TABLE) {
            model->creep_table = def->creep_table;
        }
    }
    model->hash = kl_model_hash(model);
    return KL_OK;
}

/* ---- identity ---- */

static uint64_t hash_real(uint64_t h, kl_real x) {
    return kl_hash_bytes(h, &x, sizeof x);
}

static uint64_t hash_u32(uint64_t h, uint32_t x) {
    return kl_hash_bytes(h, &x, sizeof x);
}

static uint64_t hash_bodies(uint64_t h, const struct kl_model *m) {
    for (uint32_t i = 0; i < m->n_bodies; i++) {
        const struct kl_body *b = &m->bodies[i];
        h = kl_hash_bytes(h, b->name, sizeof b->name);
        h = hash_real(h, b->mass_kg);
        h = kl_hash_bytes(h, b->inertia_kgm2, sizeof b->inertia_kgm2);
        h = hash_real(hash_real(h, b->x_m), b->z_m);
        h = hash_u32(h, b->freedoms);
    }
    for (uint32_t i = 0; i < m->n_wheelsets; i++) {
        const struct kl_wheelset *w = &m->wheelsets[i];
        const kl_real values[] = {w->mass_kg,
                                  w->inertia_roll_kgm2,
                                  w->inertia_spin_kgm2,
                                  w->inertia_yaw_kgm2,
                                  w->x_m,
                                  w->preload[0],
                                  w->preload[1],
                                  w->preload[2],
                                  w->preload[3],
                                  w->static_load_N,
                                  w->creep.friction,
                                  w->creep.f11_N,
                                  w->creep.f22_N,
                                  w->creep.f23_Nm,
                                  w->creep.f33_Nm2,
                                  w->creep.falling_ratio,
                                  w->creep.falling_decay_s_m,
                                  w->creep.k_a,
                                  w->creep.k_s};
        h = kl_hash_bytes(h, w->name, sizeof w->name);
        h = kl_hash_bytes(h, values, sizeof values);
        h = hash_u32(hash_u32(h, w->pair), (uint32_t)w->creep.law);
        h = hash_u32(h, w->creep.falls);
        h = w->independent != 0 ? hash_real(hash_u32(h, 1u), w->coupling_Nms_rad) : h;
    }
    return h;
}

static uint64_t hash_pairs(uint64_t h, const struct kl_model *m) {
    for (uint32_t i = 0; i < m->n_pairs; i++) {
        const struct kl_pair *p = &m->pairs[i];
        const kl_real values[] = {p->step_m,
                                  p->inv_step_1_m,
                                  p->range_m,
                                  p->base_m,
                                  p->inv_base_1_m,
                                  p->radius_m,
                                  p->share[KL_RIGHT],
                                  p->share[KL_LEFT],
                                  p->tread_end[KL_RIGHT],
                                  p->tread_end[KL_LEFT],
                                  p->central_tan[KL_RIGHT],
                                  p->central_tan[KL_LEFT],
                                  p->gives,
                                  p->flange_stiffness_N_m,
                                  p->flange_damping_Ns_m};
        h = hash_u32(hash_u32(hash_u32(h, p->half), (uint32_t)p->law), p->n_shapes);
        h = kl_hash_bytes(h, values, sizeof values);
        for (int s = 0; s < KL_SIDES; s++) {
            h = kl_hash_bytes(h, p->side[s].rows, (2u * p->half + 1u) * sizeof(struct kl_row));
            h = kl_hash_bytes(h, p->flange[s].rows,
                              p->flange[s].n_rows * sizeof(struct kl_flange_row));
            h = kl_hash_bytes(h, &p->flange[s].top_m, sizeof p->flange[s].top_m);
        }
    }
    return h;
}

/* Only where there are any: so models without are known by the hash that they had before. */
static uint64_t hash_struts(uint64_t h, const struct kl_struts *s) {
    const uint32_t n = kl_count_struts(s);
    if (n == 0) {
        return h;
    }
    h = hash_u32(hash_u32(h, s->n_slips), s->n_stops);
    h = hash_u32(hash_u32(h, s->n_dampers), s->n_actuators);
    h = kl_hash_bytes(h, s->term_start, (n + 1u) * sizeof(uint16_t));
    h = kl_hash_bytes(h, s->column, s->n_terms * sizeof(uint16_t));
    h = kl_hash_bytes(h, s->factor, s->n_terms * sizeof(kl_real));
    h = kl_hash_bytes(h, s->slip, s->n_slips * sizeof(struct kl_slip));
    const uint32_t tables = s->n_stops + s->n_dampers;
    if (tables > 0) {
        h = kl_hash_bytes(h, s->bend_start, (2u * tables + 1u) * sizeof(uint16_t));
        h = kl_hash_bytes(h, s->bend, s->n_bends * sizeof(struct kl_bend));
    }
    return kl_hash_bytes(h, s->input, s->n_actuators * sizeof(uint16_t));
}

uint64_t kl_model_hash(const struct kl_model *m) {
    uint64_t h = KL_HASH_SEED;
    h = hash_u32(hash_u32(h, m->version), m->real_bytes);
    h = kl_hash_bytes(h, m->name, sizeof m->name);
    h = kl_hash_bytes(h, &m->step_ns, sizeof m->step_ns);
    h = hash_u32(hash_u32(hash_real(h, m->step_s), m->n_states), m->n_rails);
    h = hash_real(hash_real(h, m->gravity_m_s2), m->acceleration_limit_m_s2);
    h = hash_u32(hash_u32(hash_u32(h, m->n_bodies), m->n_wheelsets), m->n_pairs);
    if (m->running.free != 0) {
        const kl_real values[] = {m->running.mass_kg, m->running.rolling_kg,
                                  m->running.resistance_N, m->running.resistance_Ns_m,
                                  m->running.resistance_Ns2_m2};
        h = kl_hash_bytes(hash_u32(h, m->running.free), values, sizeof values);
    }
    h = hash_bodies(h, m);
    h = hash_pairs(h, m);
    if (m->creep_table != NULL) {
        h = kl_hash_bytes(h, &m->creep_table->hash, sizeof m->creep_table->hash);
    }
    const struct kl_suspension *s = &m->suspension;
    h = hash_u32(hash_u32(h, s->n_coordinates), s->n_entries);
    h = kl_hash_bytes(h, s->twins, 3u * kl_count_twins(s) * sizeof(uint16_t));
    h = kl_hash_bytes(h, s->place, s->n_entries * sizeof(uint16_t));
    h = kl_hash_bytes(h, s->spring, 2u * s->n_entries * sizeof(struct kl_spring));
    h = hash_struts(h, &m->struts);
    h = hash_u32(hash_u32(h, m->track.n_pieces), m->track.n_bins);
    h = hash_real(h, m->track.inv_bin_1_m);
    h = kl_hash_bytes(h, m->track.piece, (m->track.n_pieces + 2u) * sizeof(struct kl_piece));
    h = kl_hash_bytes(h, m->track.bin, m->track.n_bins * sizeof(uint16_t));
    h = hash_u32(h, m->track.irregularity != NULL ? m->track.n_samples : 0u);
    if (m->track.irregularity != NULL) {
        h = hash_real(hash_real(h, m->track.start_m), m->track.step_m);
        h = kl_hash_bytes(h, m->track.irregularity,
                          (m->track.n_samples + 2u) * sizeof(struct kl_irregularity_row));
    }
    return h;
}

/* Terms and bends in order and within the model, inputs within kl_input. */
static int has_sound_struts(const struct kl_model *m) {
    const struct kl_struts *s = &m->struts;
    const uint32_t most = KL_MAX_ELEMENTS;
    if (s->n_slips > KL_MAX_SLIPS || s->n_stops > most || s->n_dampers > most ||
        s->n_actuators > most || s->n_terms > UINT16_MAX || s->n_bends > UINT16_MAX) {
        return 0;
    }
    const uint32_t n = kl_count_struts(s);
    const uint32_t tables = 2u * (s->n_stops + s->n_dampers);
    if (n == 0) {
        return 1;
    }
    if (s->term_start == NULL || s->column == NULL || s->factor == NULL ||
        (s->n_slips != 0 && s->slip == NULL) ||
        (tables != 0 && (s->bend_start == NULL || s->bend == NULL)) ||
        (s->n_actuators != 0 && s->input == NULL) || s->term_start[n] != s->n_terms ||
        (tables != 0 && s->bend_start[tables] != s->n_bends)) {
        return 0;
    }
    int sound = 1;
    for (uint32_t i = 0; i < n; i++) {
        sound = sound && s->term_start[i] <= s->term_start[i + 1u];
    }
    for (uint32_t i = 0; i < tables; i++) {
        sound = sound && s->bend_start[i] <= s->bend_start[i + 1u];
    }
    for (uint32_t i = 0; i < s->n_terms; i++) {
        sound = sound && s->column[i] < m->suspension.n_coordinates;
    }
    for (uint32_t i = 0; i < s->n_actuators; i++) {
        sound = sound && s->input[i] < KL_MAX_ACTUATORS;
    }
    return sound;
}

/* What the hash itself and the step rely on without asking. */
static int has_sound_tables(const struct kl_model *m) {
    if (m->wheelsets == NULL || m->pairs == NULL || (m->n_bodies != 0 && m->bodies == NULL) ||
        m->suspension.twins == NULL || m->suspension.place == NULL ||
        m->suspension.spring == NULL || m->track.piece == NULL || m->track.bin == NULL) {
        return 0;
    }
    if (m->n_pairs == 0 || m->n_pairs > KL_MAX_PAIRS || m->track.n_pieces == 0 ||
        m->track.n_bins == 0 || m->track.n_bins > KL_TRACK_MAX_BINS ||
        m->suspension.n_coordinates != KL_COORDINATES(m->n_bodies, m->n_wheelsets) ||
        m->suspension.n_entries > m->suspension.n_coordinates * m->suspension.n_coordinates) {
        return 0;
    }
    for (uint32_t i = 0; i < m->n_pairs; i++) {
        const struct kl_pair *p = &m->pairs[i];
        if (p->half < 4u || p->half > KL_TABLE_MAX_HALF || p->side[KL_RIGHT].rows == NULL ||
            p->side[KL_LEFT].rows == NULL) {
            return 0;
        }
        if (p->law == KL_CREEP_TABLE && kl_creep_table_check(m->creep_table) != KL_OK) {
            return 0;
        }
        for (int s = 0; s < KL_SIDES; s++) {
            const struct kl_flange_table *flange = &p->flange[s];
            if (flange->rows == NULL || flange->n_rows < 2u ||
                flange->n_rows > KL_FLANGE_MAX_ROWS) {
                return 0;
            }
        }
    }
    uint32_t twists = 0;
    for (uint32_t i = 0; i < m->n_wheelsets; i++) {
        if (m->wheelsets[i].pair >= m->n_pairs || m->wheelsets[i].independent > 1u) {
            return 0;
        }
        twists += m->wheelsets[i].independent;
    }
    const int runs = m->running.free == 0 ||
                     (m->running.mass_kg > KL_R(0) && m->running.rolling_kg >= m->running.mass_kg);
    return runs && twists == m->n_twists && has_sound_struts(m);
}

enum kl_status kl_model_check(const struct kl_model *model) {
    if (model == NULL) {
        return KL_ERR_ARGUMENT;
    }
    if (model->version != KL_MODEL_VERSION || model->real_bytes != sizeof(kl_real) ||
        model->n_bodies > KL_MAX_BODIES || model->n_wheelsets > KL_MAX_WHEELSETS ||
        model->n_wheelsets == 0 || model->n_states > KL_MAX_STATES || !has_sound_tables(model)) {
        return KL_ERR_VALUE;
    }
    return model->hash == kl_model_hash(model) ? KL_OK : KL_ERR_VALUE;
}
