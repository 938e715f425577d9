/* Recordings: what is read is what was written; damage is found; the recorder beside the loop loses and counts. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "hil_record.h"
#include "replay.h"

#define WAGON "models/two_axle_wagon.yaml"
#define ROOM 8192u

static char path[] = "/tmp/klingel_test_record_XXXXXX";
static struct cli_model m;
static const struct cli_target target = {.vehicle = WAGON};

static int open_model(void **unused) {
    (void)unused;
    const int fd = mkstemp(path);
    if (fd < 0) {
        return -1;
    }
    (void)close(fd);
    return cli_model_open(&m, &target);
}

static int close_model(void **unused) {
    (void)unused;
    (void)unlink(path);
    cli_model_close(&m);
    return 0;
}

/* Check value of the CRC catalogue (Williams) and of zlib's crc32. */
static void test_crc(void **unused) {
    (void)unused;
    assert_int_equal(record_crc(0, "123456789", 9), 0xcbf43926);
    assert_int_equal(record_crc(record_crc(0, "1234", 4), "56789", 5), 0xcbf43926);
    assert_int_equal(record_crc(0, "", 0), 0);
}

/* Every input that the step may read has a number of its own, and a name of its own. */
static void test_inputs_have_numbers(void **unused) {
    (void)unused;
    struct record_inputs inputs;
    struct kl_input input;
    record_inputs_of(&m.model, &inputs);
    assert_int_equal(inputs.n, 1 + 2 * 9 + 1);
    memset(&input, 0, sizeof input);
    for (uint32_t i = 0; i < inputs.n; i++) {
        record_input_set(&inputs, &input, i, (kl_real)(i + 1u));
    }
    char before[RECORD_INPUT_NAME] = "";
    char name[RECORD_INPUT_NAME];
    for (uint32_t i = 0; i < inputs.n; i++) {
        assert_true(record_input_get(&inputs, &input, i) == (kl_real)(i + 1u));
        record_input_name(&m.model, i, name);
        assert_string_not_equal(name, before);
        memcpy(before, name, sizeof name);
    }
    assert_true(input.speed_m_s == 1 && input.axle_torque_Nm[0] == 2);
    assert_true(input.friction_factor[0][KL_RIGHT] == 3 && input.friction_factor[0][KL_LEFT] == 4);
    assert_true(input.falling_decay_s_m[1][KL_LEFT] == 19 && input.side_force_N[0] == 20);
}

/* A train with all that may be: independent wheels, actuators, a free speed. */
static void test_rare_inputs_have_numbers(void **unused) {
    (void)unused;
    static struct cli_model train;
    static const struct cli_target of_train = {.vehicle = "tests/tools/good/train.yaml"};
    static char name[RECORD_MAX_INPUTS][RECORD_INPUT_NAME];
    struct record_inputs inputs;
    struct kl_input input;
    assert_int_equal(cli_model_open(&train, &of_train), CLI_OK);
    record_inputs_of(&train.model, &inputs);
    memset(&input, 0, sizeof input);
    for (uint32_t i = 0; i < inputs.n; i++) {
        record_input_set(&inputs, &input, i, (kl_real)(i + 1u));
        record_input_name(&train.model, i, name[i]);
        for (uint32_t k = 0; k < i; k++) {
            assert_string_not_equal(name[i], name[k]);
            assert_int_not_equal(inputs.place[i], inputs.place[k]);
        }
    }
    assert_int_equal(train.model.n_twists, 2);
    assert_string_equal(name[inputs.n - 1u], "draw_force_N");
    assert_true(input.draw_force_N == (kl_real)inputs.n);
    assert_string_equal(name[inputs.n - 2u], "last_rear.twist_torque_Nm");
    assert_true(input.twist_torque_Nm[3] == (kl_real)(inputs.n - 1u));
    assert_string_equal(name[inputs.n - 3u], "lead_rear.twist_torque_Nm");
    assert_true(input.twist_torque_Nm[1] == (kl_real)(inputs.n - 2u));
    cli_model_close(&train);
}

/* ---- a loop without a clock ---- */

struct loop {
    struct kl_state state;
    struct kl_input input;
    struct kl_node node; /* nothing but the pointers that the recorder looks at */
    struct hil_record record;
};

static void begin(struct loop *l, uint64_t every, uint64_t words) {
    memset(l, 0, sizeof *l);
    assert_int_equal(kl_init(&m.model, &l->state, 0, 20, cli_work()), KL_OK);
    kl_input_init(&l->input);
    l->input.speed_m_s = 20;
    l->node.config.state = &l->state;
    l->node.config.input = &l->input;
    assert_int_equal(
        hil_record_open(&l->record, path, &m.model, &target, &l->state, every, words, false),
        CLI_OK);
}

/* Inputs that move in every step, in all their digits. */
static void step(struct loop *l, unsigned i) {
    l->input.speed_m_s = (kl_real)(20.0 + (double)i / 3e3);
    l->input.axle_torque_Nm[0] = (kl_real)(i % 7 == 0 ? 1e3 / 3.0 : -0.0);
    l->input.friction_factor[1][KL_LEFT] = (kl_real)(i % 50 < 25 ? 1.0 : 0.3);
    l->input.side_force_N[0] = (kl_real)(1e3 * (double)(i % 13) / 7.0);
    hil_record_told(&l->record, KL_NODE_STEP, &l->node);
    kl_step(&m.model, &l->state, &l->input, NULL, cli_work());
}

static enum replay_result replay_all(struct replay *p, bool until_end) {
    enum replay_result result = REPLAY_STEP;
    assert_int_equal(replay_open(p, path, &(struct cli_target){0}, false), CLI_OK);
    while (result == REPLAY_STEP) {
        result = replay_next(p);
    }
    assert_int_equal(result == REPLAY_END, until_end);
    return result;
}

static void test_replay_gives_the_same_bits(void **unused) {
    (void)unused;
    static struct loop l;
    static struct replay p;
    begin(&l, 100, ROOM);
    for (unsigned i = 0; i < 2000; i++) {
        step(&l, i);
        if (i % 20 == 19) {
            hil_record_drain(&l.record);
        }
    }
    assert_int_equal(hil_record_close(&l.record, &l.state), CLI_OK);
    (void)replay_all(&p, true);
    assert_int_equal(p.steps, 2000);
    assert_int_equal(p.checked, 19);
    assert_int_equal(p.parted, 0);
    assert_int_equal(p.lost, 0);
    assert_true(kl_state_hash(&p.state) == kl_state_hash(&l.state));
    assert_true(p.end_hash == kl_state_hash(&l.state));
    assert_memory_equal(&p.input, &l.input, sizeof l.input);
    replay_close(&p);
}

/* Loads and restores, between steps, in the same cycle, and as the last thing of all. */
static void test_replaced_states(void **unused) {
    (void)unused;
    static struct loop l;
    static struct replay p;
    static struct kl_state kept;
    begin(&l, 100, ROOM);
    for (unsigned i = 0; i < 400; i++) {
        if (i == 150) {
            kept = l.state;
        }
        if (i == 200 || i == 300) {
            assert_int_equal(kl_init(&m.model, &l.state, 5, 10, cli_work()), KL_OK);
            hil_record_told(&l.record, KL_NODE_REPLACED, &l.node);
            l.state = kept;
            hil_record_told(&l.record, KL_NODE_REPLACED, &l.node);
        }
        step(&l, i);
        hil_record_drain(&l.record);
    }
    assert_int_equal(kl_init(&m.model, &l.state, 7, 11, cli_work()), KL_OK);
    hil_record_told(&l.record, KL_NODE_REPLACED, &l.node);
    assert_int_equal(hil_record_close(&l.record, &l.state), CLI_OK);
    (void)replay_all(&p, true);
    assert_int_equal(p.steps, 400);
    assert_int_equal(p.replaced, 3);
    assert_int_equal(p.parted, 0);
    assert_true(p.end_hash == kl_state_hash(&p.state));
    replay_close(&p);
}

/* A writer that stands still: the loop goes on, steps are lost and counted, and behind the gap the recording
 * is right again. */
static void test_overrun_of_the_recorder(void **unused) {
    (void)unused;
    static struct loop l;
    static struct replay p;
    begin(&l, 100, ROOM);
    unsigned i = 0;
    for (; i < 3000; i++) {
        step(&l, i);
    }
    const uint64_t lost = atomic_load(&l.record.lost);
    assert_in_range(lost, 1, 2999);
    hil_record_drain(&l.record);
    for (; i < 3500; i++) {
        step(&l, i);
        hil_record_drain(&l.record);
    }
    assert_int_equal(atomic_load(&l.record.lost), lost);
    assert_int_equal(hil_record_close(&l.record, &l.state), CLI_OK);
    assert_int_equal(l.record.writer.lost, lost);
    assert_int_equal(l.record.writer.steps + lost, 3500);
    (void)replay_all(&p, true);
    assert_int_equal(p.lost, lost);
    assert_int_equal(p.gaps, 1);
    assert_int_equal(p.steps + lost, 3500);
    assert_int_equal(p.parted, 0);
    assert_true(p.end_hash == kl_state_hash(&p.state));
    replay_close(&p);
}

/* Lost to the end: the hash is still that of the last state. */
static void test_overrun_at_the_end(void **unused) {
    (void)unused;
    static struct loop l;
    static struct replay p;
    begin(&l, 100, ROOM);
    for (unsigned i = 0; i < 3000; i++) {
        step(&l, i);
    }
    assert_int_equal(hil_record_close(&l.record, &l.state), CLI_OK);
    (void)replay_all(&p, true);
    assert_true(p.lost > 0);
    assert_true(p.end_hash == kl_state_hash(&p.state));
    replay_close(&p);
}

/* ---- damage ---- */

static size_t read_file(unsigned char *bytes, size_t size) {
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    const size_t n = fread(bytes, 1, size, file);
    (void)fclose(file);
    assert_true(n < size);
    return n;
}

static void write_file(const unsigned char *bytes, size_t n) {
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, n, file), n);
    (void)fclose(file);
}

/* Of a recording cut anywhere, and with a bit turned anywhere, what is read is what was written up to there:
 * all states that it holds are met, and a file with a fault is never taken for whole. */
static void test_damage(void **unused) {
    (void)unused;
    static struct loop l;
    static struct replay p;
    static unsigned char whole[400000];
    static unsigned char bad[400000];
    begin(&l, 50, ROOM);
    for (unsigned i = 0; i < 600; i++) {
        step(&l, i);
        hil_record_drain(&l.record);
        if (i % 100 == 99) {
            record_end_block(&l.record.writer);
        }
    }
    assert_int_equal(hil_record_close(&l.record, &l.state), CLI_OK);
    const size_t n = read_file(whole, sizeof whole);
    const unsigned char *first = memmem(whole, n, "crc ", 4);
    assert_non_null(first);
    const size_t head = (size_t)(first - whole) + 13;
    uint64_t most = 0;
    for (size_t at = head; at < n; at += 997) {
        write_file(whole, at);
        (void)replay_all(&p, false);
        assert_true(p.steps % 100 == 0 && p.steps >= most && p.parted == 0);
        assert_non_null(strstr(p.reader.why, "cut off"));
        most = p.steps;
        replay_close(&p);
        memcpy(bad, whole, n);
        bad[at] ^= (unsigned char)(1u << at % 8);
        write_file(bad, n);
        (void)replay_all(&p, false);
        assert_true(p.steps % 100 == 0 && p.parted == 0);
        replay_close(&p);
    }
    assert_true(most >= 500);
}

/* Files that are none end in an error, not in a crash; with right CRCs as well. */
static void test_nonsense(void **unused) {
    (void)unused;
    static struct record_reader r;
    static const char *const text[] = {
        "",
        "klingel recording 2\n",
        "klingel recording 1\n",
        "klingel recording 1\nmodel\n",
        "klingel recording 1\nvehicle x\nstep_ns -1\n",
        "klingel recording 1\nvehicle x\nstep_ns 1000\ninput 1 y\n",
        "klingel recording 1\nvehicle x\nstep_ns 1000\ninput 0 y\nstart 0\n",
        "klingel recording 1\nvehicle x\nstep_ns 1000\ninput 0 y\nstart xy\n",
        "klingel recording 1\nvehicle x\nstep_ns 1000\ninput 0 y\n",
        "klingel recording 1\nnothing known\n"};
    for (size_t i = 0; i < sizeof text / sizeof text[0]; i++) {
        char all[400];
        const int n = snprintf(all, sizeof all, "%scrc %08x\n", text[i],
                               (unsigned)record_crc(0, text[i], strlen(text[i])));
        write_file((const unsigned char *)all, (size_t)n);
        assert_int_equal(record_read_open(&r, path), CLI_FAILED);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_crc),
        cmocka_unit_test(test_inputs_have_numbers),
        cmocka_unit_test(test_rare_inputs_have_numbers),
        cmocka_unit_test(test_replay_gives_the_same_bits),
        cmocka_unit_test(test_replaced_states),
        cmocka_unit_test(test_overrun_of_the_recorder),
        cmocka_unit_test(test_overrun_at_the_end),
        cmocka_unit_test(test_damage),
        cmocka_unit_test(test_nonsense),
    };
    return cmocka_run_group_tests(tests, open_model, close_model);
}
