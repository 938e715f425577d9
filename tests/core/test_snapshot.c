/* Snapshot, restore, hash: the same bits afterwards, and nothing damaged or foreign is let in. */
#include "fixtures.h"

static struct built model;

static int set_up(void **state) {
    (void)state;
    static double lateral[400];
    struct vehicle v;
    uint64_t seed = 51;
    for (int i = 0; i < 400; i++) {
        lateral[i] = random_between(&seed, -1e-3, 1e-3);
    }
    wagon(&v, arcs_pair(KL_KINEMATICS_RIGID));
    v.pair[0].range_m = 0.012;
    one_curve(&v, KL_RAMP_BLOSS, 0.0008, 0.05);
    v.track.irregularity.n_samples = 400;
    v.track.irregularity.step_m = 1.0;
    v.track.irregularity.lateral_m = lateral;
    build(&v, &model);
    return 0;
}

static int tear_down(void **state) {
    (void)state;
    unbuild(&model);
    return 0;
}

static void started(struct kl_state *x) {
    assert_int_equal(kl_init(&model.model, x, 0, 25, work()), KL_OK);
    assert_int_equal(coast(&model.model, x, 777, NULL), 0);
}

/* Straight run, run through bytes, run through a plain copy: one result, and every output too. */
static void restored_and_straight_runs_are_one(void **state) {
    (void)state;
    unsigned char bytes[KL_SNAPSHOT_SIZE];
    size_t used = 0;
    struct kl_state straight;
    struct kl_state restored;
    struct kl_output a;
    struct kl_output b;
    memset(&a, 0, sizeof a);
    memset(&b, 0, sizeof b);
    started(&straight);
    for (int round = 0; round < 20; round++) {
        assert_int_equal(kl_snapshot(&model.model, &straight, bytes, sizeof bytes, &used), KL_OK);
        memset(&restored, 0xff, sizeof restored);
        assert_int_equal(kl_restore(&model.model, &restored, bytes, used), KL_OK);
        assert_memory_equal(&restored, &straight, sizeof straight);
        assert_true(kl_state_hash(&restored) == kl_state_hash(&straight));
        assert_int_equal(coast(&model.model, &straight, 331, &a), 0);
        assert_int_equal(coast(&model.model, &restored, 331, &b), 0);
        assert_memory_equal(&restored, &straight, sizeof straight);
        assert_memory_equal(&a, &b, sizeof a);
    }
}

/* Nothing that scratch holds reaches a state or an output, be it rubbish or another vehicle's. */
static void scratch_means_nothing(void **state) {
    (void)state;
    static const unsigned char rubbish[] = {0x00, 0xff, 0x3c};
    struct kl_state x[4];
    struct kl_output o[4];
    kl_real rates[2][KL_MAX_STATES];
    struct kl_input input;
    kl_input_init(&input);
    input.speed_m_s = 30;
    memset(o, 0, sizeof o);
    for (int i = 0; i < 4; i++) {
        memset(work(), rubbish[i % 3], sizeof(struct kl_work));
        assert_int_equal(kl_init(&model.model, &x[i], 0, 25, work()), KL_OK);
    }
    assert_int_equal(coast(&model.model, &x[3], 500, NULL), 0); /* is elsewhere */
    for (int step = 0; step < 2000; step++) {
        for (int i = 0; i < 3; i++) {
            memset(work(), rubbish[i], sizeof(struct kl_work));
            assert_int_equal(kl_step(&model.model, &x[i], &input, &o[i], work()), 0);
        }
        assert_memory_equal(&x[0], &x[1], sizeof x[0]);
        assert_memory_equal(&o[0], &o[1], sizeof o[0]);
        assert_memory_equal(&x[0], &x[2], sizeof x[0]);
        assert_int_equal(kl_step(&model.model, &x[3], &input, &o[3], work()), 0);
        assert_int_equal(kl_step(&model.model, &x[2], &input, &o[2], work()), 0);
        x[2] = x[0];
    }
    for (int i = 0; i < 2; i++) {
        memset(work(), rubbish[i], sizeof(struct kl_work));
        kl_rates(&model.model, &x[0], &input, rates[i], work());
        memset(work(), rubbish[i], sizeof(struct kl_work));
        kl_observe(&model.model, &x[0], &input, &o[i], work());
        memset(work(), rubbish[i], sizeof(struct kl_work));
        kl_refresh(&model.model, &x[i], work());
    }
    assert_memory_equal(rates[0], rates[1], x[0].n_states * sizeof(kl_real));
    assert_memory_equal(&o[0], &o[1], sizeof o[0]);
    assert_memory_equal(&x[0], &x[1], sizeof x[0]);
}

static void faults_travel_along(void **state) {
    (void)state;
    unsigned char bytes[KL_SNAPSHOT_SIZE];
    size_t used = 0;
    struct kl_state x;
    struct kl_state y;
    struct kl_input input;
    started(&x);
    kl_input_init(&input);
    input.speed_m_s = (kl_real)NAN;
    kl_step(&model.model, &x, &input, NULL, work());
    assert_int_equal(x.faults, KL_FAULT_INPUT);
    assert_int_equal(kl_snapshot(&model.model, &x, bytes, sizeof bytes, &used), KL_OK);
    assert_int_equal(kl_restore(&model.model, &y, bytes, used), KL_OK);
    assert_int_equal(y.faults, KL_FAULT_INPUT);
    assert_int_equal(y.fault_tick, 778);
    assert_int_equal(y.tick, 778);
}

/* Two vehicles on one model do not know of each other. */
static void two_states_on_one_model(void **state) {
    (void)state;
    struct kl_state alone;
    struct kl_state a;
    struct kl_state b;
    started(&alone);
    a = alone;
    assert_int_equal(kl_init(&model.model, &b, 100, 40, work()), KL_OK);
    for (int i = 0; i < 500; i++) {
        coast(&model.model, &alone, 1, NULL);
    }
    for (int i = 0; i < 500; i++) {
        coast(&model.model, &a, 1, NULL);
        coast(&model.model, &b, 1, NULL);
    }
    assert_memory_equal(&a, &alone, sizeof a);
}

static void every_damaged_bit_is_refused(void **state) {
    (void)state;
    unsigned char bytes[KL_SNAPSHOT_SIZE];
    size_t used = 0;
    struct kl_state x;
    struct kl_state y;
    struct kl_state kept;
    started(&x);
    assert_int_equal(kl_snapshot(&model.model, &x, bytes, sizeof bytes, &used), KL_OK);
    memset(&y, 0x11, sizeof y);
    kept = y;
    for (size_t i = 0; i < used; i++) {
        for (int bit = 0; bit < 8; bit++) {
            bytes[i] ^= (unsigned char)(1u << bit);
            assert_int_equal(kl_restore(&model.model, &y, bytes, used), KL_ERR_SNAPSHOT);
            assert_memory_equal(&y, &kept, sizeof y);
            bytes[i] ^= (unsigned char)(1u << bit);
        }
    }
    for (size_t n = 0; n < used; n++) {
        assert_int_equal(kl_restore(&model.model, &y, bytes, n), KL_ERR_SNAPSHOT);
    }
    assert_int_equal(kl_restore(&model.model, &y, bytes, used + 8u), KL_ERR_SNAPSHOT);
    assert_memory_equal(&y, &kept, sizeof y);
    assert_int_equal(kl_restore(&model.model, &y, bytes, used), KL_OK);
}

static void other_models_are_refused(void **state) {
    (void)state;
    unsigned char bytes[KL_SNAPSHOT_SIZE];
    size_t used = 0;
    struct vehicle v;
    struct built other;
    struct kl_state x;
    struct kl_state y;
    started(&x);
    assert_int_equal(kl_snapshot(&model.model, &x, bytes, sizeof bytes, &used), KL_OK);
    wagon(&v, arcs_pair(KL_KINEMATICS_RIGID)); /* same shape, another track */
    build(&v, &other);
    assert_int_equal(other.model.n_states, model.model.n_states);
    assert_int_equal(kl_restore(&other.model, &y, bytes, used), KL_ERR_SNAPSHOT);
    unbuild(&other);
    single_wheelset(&v, arcs_pair(KL_KINEMATICS_RIGID), 1e5, 1e5);
    build(&v, &other);
    assert_int_equal(kl_restore(&other.model, &y, bytes, used), KL_ERR_SNAPSHOT);
    assert_int_equal(kl_snapshot(&other.model, &x, bytes, sizeof bytes, &used), KL_ERR_ARGUMENT);
    unbuild(&other);
}

/* Every size below the need is refused and nothing is written beyond it. */
static void small_buffers_are_refused(void **state) {
    (void)state;
    unsigned char bytes[KL_SNAPSHOT_SIZE + 16];
    size_t need = 0;
    size_t used = 0;
    struct kl_state x;
    started(&x);
    assert_int_equal(kl_snapshot(&model.model, &x, bytes, sizeof bytes, &need), KL_OK);
    assert_true(need <= KL_SNAPSHOT_SIZE);
    for (size_t size = 0; size <= need; size++) {
        memset(bytes, 0xee, sizeof bytes);
        const enum kl_status status = kl_snapshot(&model.model, &x, bytes, size, &used);
        assert_int_equal(status, size < need ? KL_ERR_MEMORY : KL_OK);
        for (size_t i = size; i < sizeof bytes; i++) {
            assert_int_equal(bytes[i], 0xee);
        }
    }
}

static void null_arguments_are_refused(void **state) {
    (void)state;
    unsigned char bytes[KL_SNAPSHOT_SIZE];
    size_t used = 0;
    struct kl_state x;
    started(&x);
    assert_int_equal(kl_snapshot(NULL, &x, bytes, sizeof bytes, &used), KL_ERR_ARGUMENT);
    assert_int_equal(kl_snapshot(&model.model, NULL, bytes, sizeof bytes, &used), KL_ERR_ARGUMENT);
    assert_int_equal(kl_snapshot(&model.model, &x, NULL, sizeof bytes, &used), KL_ERR_ARGUMENT);
    assert_int_equal(kl_snapshot(&model.model, &x, bytes, sizeof bytes, NULL), KL_ERR_ARGUMENT);
    assert_int_equal(kl_restore(NULL, &x, bytes, used), KL_ERR_ARGUMENT);
    assert_int_equal(kl_restore(&model.model, NULL, bytes, used), KL_ERR_ARGUMENT);
    assert_int_equal(kl_restore(&model.model, &x, NULL, used), KL_ERR_ARGUMENT);
}

/* Any bit of the used part changes the hash; what lies beyond n_states does not. */
static void hash_sees_every_bit(void **state) {
    (void)state;
    struct kl_state x;
    started(&x);
    const uint64_t hash = kl_state_hash(&x);
    unsigned char *bytes = (unsigned char *)&x;
    const size_t used = offsetof(struct kl_state, x) + x.n_states * sizeof(kl_real);
    for (size_t i = 0; i < used; i++) {
        for (int bit = 0; bit < 8; bit++) {
            if (i >= offsetof(struct kl_state, n_states) &&
                i < offsetof(struct kl_state, n_states) + sizeof x.n_states) {
                continue; /* a wrong number of states is another state altogether */
            }
            bytes[i] ^= (unsigned char)(1u << bit);
            assert_true(kl_state_hash(&x) != hash);
            bytes[i] ^= (unsigned char)(1u << bit);
        }
    }
    x.x[x.n_states] = 5;
    assert_true(kl_state_hash(&x) == hash);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(restored_and_straight_runs_are_one),
        cmocka_unit_test(scratch_means_nothing),
        cmocka_unit_test(faults_travel_along),
        cmocka_unit_test(two_states_on_one_model),
        cmocka_unit_test(every_damaged_bit_is_refused),
        cmocka_unit_test(other_models_are_refused),
        cmocka_unit_test(small_buffers_are_refused),
        cmocka_unit_test(null_arguments_are_refused),
        cmocka_unit_test(hash_sees_every_bit),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
