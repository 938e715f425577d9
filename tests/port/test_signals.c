/* The signal table: its own consistency, the codec, bus load, and the texts made from it. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "kl_signals.h"

static const struct kl_layout wagon = {
    .n_bodies = 1, .n_wheelsets = 2, .step_ns = 1000000, .state_divider = 1};

static uint64_t random_bits(uint64_t *seed) { /* splitmix64 */
    uint64_t z = (*seed += UINT64_C(0x9E3779B97F4A7C15));
    z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
    return z ^ (z >> 31);
}

static const struct kl_signal *find(enum kl_message_index message, const char *name) {
    const struct kl_signal *signal = kl_signal_find(&kl_signal_messages()[message], name);
    assert_non_null(signal);
    return signal;
}

/* ---- the table ---- */

static void identifiers_are_unique_and_leave_canopen_free(void **state) {
    (void)state;
    static const struct kl_layout largest = {.n_bodies = KL_BUS_MAX_BODIES,
                                             .n_wheelsets = KL_BUS_MAX_WHEELSETS,
                                             .n_actuators = KL_BUS_MAX_ACTUATORS,
                                             .free_speed = true,
                                             .independent = true,
                                             .step_ns = 1000000,
                                             .state_divider = 1};
    static bool used[0x800];
    uint32_t total = 0;
    uint32_t found = 0;
    for (uint32_t i = 0; i < KL_MESSAGES; i++) {
        const struct kl_message *message = &kl_signal_messages()[i];
        for (uint32_t k = 0; k < kl_message_instances(&largest, message); k++) {
            uint32_t id = message->id + k;
            uint32_t index = 99;
            uint32_t instance = 99;
            assert_true(id <= 0x7FF && id != 0 && id != 0x080);
            assert_false((id >= 0x580 && id < 0x680) || (id >= 0x700 && id < 0x780));
            assert_false(used[id]);
            used[id] = true;
            total++;
            assert_true(kl_message_find(&largest, id, &index, &instance));
            assert_int_equal(index, i);
            assert_int_equal(instance, k);
        }
    }
    for (uint32_t id = 0; id < 0x1000; id++) {
        uint32_t index;
        uint32_t instance;
        found += kl_message_find(&largest, id, &index, &instance) ? 1u : 0u;
    }
    assert_int_equal(found, total);
    assert_int_equal(total, 14 + 3 * 32 + 4 * 32 + 5 * 64 + 32);
}

static void check_text(const char *text, bool may_be_empty) {
    assert_non_null(text);
    assert_true(may_be_empty || text[0] != '\0');
    assert_null(strpbrk(text, "\"\n|;"));
}

static void signals_fit_their_frames_without_overlap(void **state) {
    (void)state;
    for (uint32_t i = 0; i < KL_MESSAGES; i++) {
        const struct kl_message *message = &kl_signal_messages()[i];
        uint64_t taken = 0;
        assert_int_equal(message->length, 8);
        check_text(message->comment, false);
        for (uint32_t k = 0; k < message->n_signals; k++) {
            const struct kl_signal *s = &message->signals[k];
            uint64_t bits = ((UINT64_C(1) << s->length) - 1) << s->start;
            assert_true(s->length >= 1 && s->length <= 48 && s->start + s->length <= 64);
            assert_int_equal(taken & bits, 0);
            taken |= bits;
            assert_ptr_equal(kl_signal_find(message, s->name), s);
            assert_true(strlen(s->name) <= 32);
            check_text(s->comment, false);
            check_text(s->unit, true);
            assert_true(s->mantissa >= 1 && s->digits <= 9);
            assert_false(s->wraps && s->has_invalid);
            for (uint32_t v = 0; v < s->n_values; v++) {
                assert_in_range(s->values[v].raw, 0, kl_signal_raw_max(s));
                check_text(s->values[v].name, false);
            }
        }
    }
}

static void cyclic_states_carry_a_counter_and_commands_are_protected(void **state) {
    (void)state;
    for (uint32_t i = 0; i < KL_MESSAGES; i++) {
        const struct kl_message *message = &kl_signal_messages()[i];
        if (message->sender == KL_SENT_BY_BENCH) {
            assert_true(message->data_id != 0);
            const struct kl_signal *crc = find((enum kl_message_index)i, "Crc");
            const struct kl_signal *alive = find((enum kl_message_index)i, "Alive");
            assert_true(crc->start == 0 && crc->length == 8);
            assert_true(alive->start == 8 && alive->length == 4);
        } else if (message->period_us != 0) {
            const struct kl_signal *counter = find((enum kl_message_index)i, "Counter");
            assert_true(counter->start == 0 && counter->length == 16);
        }
    }
}

static void names_carry_their_number(void **state) {
    (void)state;
    char name[KL_MESSAGE_NAME];
    const struct kl_message *messages = kl_signal_messages();
    assert_int_equal(kl_message_name(&messages[KL_MSG_STATUS], 0, name, sizeof name), 6);
    assert_string_equal(name, "Status");
    kl_message_name(&messages[KL_MSG_WHEELSET_MOTION], 0, name, sizeof name);
    assert_string_equal(name, "Wheelset1Motion");
    kl_message_name(&messages[KL_MSG_WHEEL_FORCES], 3, name, sizeof name);
    assert_string_equal(name, "Wheel2LForces");
    kl_message_name(&messages[KL_MSG_WHEEL_CONTACT], 62, name, sizeof name);
    assert_string_equal(name, "Wheel32RContact");
    assert_int_equal(kl_message_name(&messages[KL_MSG_STATUS], 0, name, 4), 3);
    assert_string_equal(name, "Sta");
    assert_int_equal(kl_message_name(&messages[KL_MSG_STATUS], 0, name, 0), 0);
}

/* ---- the codec ---- */

static void raw_and_physical_values_go_round(void **state) {
    (void)state;
    uint64_t seed = 1;
    for (uint32_t i = 0; i < KL_MESSAGES; i++) {
        const struct kl_message *message = &kl_signal_messages()[i];
        for (uint32_t k = 0; k < message->n_signals; k++) {
            const struct kl_signal *s = &message->signals[k];
            uint64_t span = (uint64_t)(kl_signal_raw_max(s) - kl_signal_raw_min(s)) + 1;
            for (unsigned n = 0; n < 2000; n++) {
                uint64_t pick = n == 0 ? 0 : n == 1 ? span - 1 : random_bits(&seed) % span;
                int64_t raw = kl_signal_raw_min(s) + (int64_t)pick;
                struct kl_codec_counts counts = {0};
                uint64_t noise = random_bits(&seed);
                uint8_t data[8];
                uint8_t before[8];
                memcpy(data, &noise, sizeof data);
                memcpy(before, data, sizeof data);
                assert_int_equal(kl_signal_quantise(s, kl_signal_physical(s, raw), &counts), raw);
                assert_int_equal(counts.saturated + counts.not_finite, 0);
                kl_signal_insert(s, raw, data);
                assert_int_equal(kl_signal_extract(s, data), raw);
                kl_signal_insert(s, kl_signal_extract(s, before), data); /* others untouched */
                assert_memory_equal(data, before, sizeof data);
            }
        }
    }
}

/* Bytes worked out by hand: Wheelset1Motion, counter 0x1234, y = -1.5 mm, yaw 2 mrad, 3.21 m/s2. */
static void a_frame_has_the_bytes_worked_out_by_hand(void **state) {
    (void)state;
    static struct kl_output output;
    static const uint8_t expected[8] = {0x34, 0x12, 0x24, 0xFA, 0xD0, 0x07, 0x41, 0x01};
    struct kl_can_frame frame;
    const struct kl_bus_view view = {.output = &output, .counter = 0x51234};
    output.wheelset[1].y_m = (kl_real)-0.0015;
    output.wheelset[1].yaw_rad = (kl_real)0.002;
    output.wheelset[1].y_acc_m_s2 = (kl_real)3.21;
    kl_message_encode(&kl_signal_messages()[KL_MSG_WHEELSET_MOTION], 1, &view, NULL, &frame);
    assert_int_equal(frame.id, 0x101);
    assert_int_equal(frame.length, 8);
    assert_int_equal(frame.flags, 0);
    assert_memory_equal(frame.data, expected, sizeof expected);
}

static void values_round_to_nearest_and_saturate(void **state) {
    (void)state;
    const struct kl_signal *q = find(KL_MSG_WHEEL_FORCES, "Q"); /* 10 N, 16 bit signed */
    struct kl_codec_counts counts = {0};
    assert_int_equal(kl_signal_quantise(q, 14.9, &counts), 1);
    assert_int_equal(kl_signal_quantise(q, 15.0, &counts), 2);
    assert_int_equal(kl_signal_quantise(q, -15.0, &counts), -2);
    assert_int_equal(kl_signal_quantise(q, -14.9, &counts), -1);
    assert_int_equal(kl_signal_quantise(q, 4.999999999999999, &counts), 0);
    assert_int_equal(kl_signal_quantise(q, -0.0, &counts), 0);
    assert_int_equal(kl_signal_quantise(q, 327674.9, &counts), 32767);
    assert_int_equal(counts.saturated, 0);
    assert_int_equal(kl_signal_quantise(q, 327675.0, &counts), 32767);
    assert_int_equal(kl_signal_quantise(q, -327675.0, &counts), -32767);
    assert_int_equal(kl_signal_quantise(q, 1e300, &counts), 32767);
    assert_int_equal(kl_signal_quantise(q, -1e300, NULL), -32767);
    assert_int_equal(counts.saturated, 3);
    const struct kl_signal *speed = find(KL_MSG_VEHICLE_MOTION, "Speed");
    assert_int_equal(kl_signal_quantise(speed, -1.0, &counts), 0);
    assert_int_equal(counts.saturated, 4);
    assert_int_equal(counts.not_finite, 0);
}

static void what_is_not_finite_becomes_invalid(void **state) {
    (void)state;
    const struct kl_signal *q = find(KL_MSG_WHEEL_FORCES, "Q");
    const struct kl_signal *speed = find(KL_MSG_VEHICLE_MOTION, "Speed");
    struct kl_codec_counts counts = {0};
    assert_int_equal(kl_signal_quantise(q, (double)NAN, &counts), -32768);
    assert_int_equal(kl_signal_quantise(q, (double)INFINITY, &counts), -32768);
    assert_int_equal(kl_signal_quantise(speed, -(double)INFINITY, &counts), 65535);
    assert_int_equal(counts.not_finite, 3);
    assert_int_equal(counts.saturated, 0);
    assert_int_equal(kl_signal_raw_min(q), -32767);
    assert_int_equal(kl_signal_raw_max(speed), 65534);
}

static void every_output_may_be_nan_or_missing(void **state) {
    (void)state;
    static struct kl_output output;
    memset(&output, 0xFF, sizeof output); /* every real a NaN */
    for (uint32_t i = 0; i < KL_MESSAGES; i++) {
        const struct kl_message *message = &kl_signal_messages()[i];
        const struct kl_bus_view views[2] = {{.output = &output}, {.output = NULL}};
        for (uint32_t k = 0; k < 2 && message->is_state; k++) {
            struct kl_codec_counts counts = {0};
            struct kl_can_frame frame;
            kl_message_encode(message, k == 0 ? 0 : 63, &views[k], &counts, &frame);
            assert_int_equal(counts.not_finite, message->n_signals - 1);
            assert_int_equal(counts.saturated, 0);
        }
    }
}

static void counts_wrap_and_small_integers_saturate(void **state) {
    (void)state;
    const struct kl_bus_status status = {.send_dropped = 0x12345,
                                         .time_us = UINT64_C(0xABCDEF0123456789),
                                         .n_bodies = 300,
                                         .faults = 2};
    const struct kl_bus_view view = {.status = &status};
    const struct kl_message *messages = kl_signal_messages();
    struct kl_codec_counts counts = {0};
    struct kl_can_frame frame;
    kl_message_encode(&messages[KL_MSG_STATUS_BUS], 0, &view, &counts, &frame);
    assert_int_equal(kl_signal_extract(find(KL_MSG_STATUS_BUS, "SendDropped"), frame.data), 0x2345);
    kl_message_encode(&messages[KL_MSG_STATUS_TIME], 0, &view, &counts, &frame);
    assert_int_equal(kl_signal_extract(find(KL_MSG_STATUS_TIME, "Time"), frame.data),
                     INT64_C(0xEF0123456789));
    assert_int_equal(counts.saturated, 0);
    kl_message_encode(&messages[KL_MSG_INFO_VERSION], 0, &view, &counts, &frame);
    assert_int_equal(kl_signal_extract(find(KL_MSG_INFO_VERSION, "Bodies"), frame.data), 255);
    assert_int_equal(counts.saturated, 1);
}

static void adhesion_is_creep_force_over_load(void **state) {
    (void)state;
    static struct kl_output output;
    const struct kl_bus_view view = {.output = &output};
    const struct kl_signal *adhesion = find(KL_MSG_WHEEL_CREEP, "Adhesion");
    struct kl_contact_output *tread = &output.wheelset[0].tread;
    struct kl_can_frame frame;
    tread->t1_N[KL_LEFT] = -3000;
    tread->t2_N[KL_LEFT] = 4000;
    tread->normal_N[KL_LEFT] = 50000;
    kl_message_encode(&kl_signal_messages()[KL_MSG_WHEEL_CREEP], 1, &view, NULL, &frame);
    assert_int_equal(kl_signal_extract(adhesion, frame.data), 5000); /* 0.1 in units of 2e-5 */
    tread->normal_N[KL_LEFT] = 0;
    kl_message_encode(&kl_signal_messages()[KL_MSG_WHEEL_CREEP], 1, &view, NULL, &frame);
    assert_int_equal(kl_signal_extract(adhesion, frame.data), 0);
}

static void commands_survive_the_wire(void **state) {
    (void)state;
    const struct kl_message *control = &kl_signal_messages()[KL_MSG_RUN_CONTROL];
    const struct kl_message *setpoint = &kl_signal_messages()[KL_MSG_SPEED_SETPOINT];
    const struct kl_bus_command sent = {.command = KL_COMMAND_STEP,
                                        .request_id = 77,
                                        .argument = 54321,
                                        .control = 1,
                                        .speed_m_s = (kl_real)33.335};
    const struct kl_bus_view view = {.command = &sent};
    struct kl_bus_command got = {0};
    struct kl_can_frame frame;
    kl_message_encode(control, 0, &view, NULL, &frame);
    assert_int_equal(kl_message_decode(control, &frame, &got), KL_OK);
    kl_message_encode(setpoint, 0, &view, NULL, &frame);
    assert_int_equal(kl_message_decode(setpoint, &frame, &got), KL_OK);
    assert_int_equal(got.command, KL_COMMAND_STEP);
    assert_int_equal(got.request_id, 77);
    assert_int_equal(got.argument, 54321);
    assert_int_equal(got.control, 1);
    assert_true(fabs((double)got.speed_m_s - 33.335) < 1e-5);
    memset(frame.data, 0xFF, 8);
    assert_int_equal(kl_message_decode(setpoint, &frame, &got), KL_OK);
    assert_true(isnan((double)got.speed_m_s));
}

static void decoding_checks_the_frame_first(void **state) {
    (void)state;
    const struct kl_message *control = &kl_signal_messages()[KL_MSG_RUN_CONTROL];
    struct kl_bus_command got = {.request_id = 5};
    for (unsigned length = 0; length <= 64; length++) {
        const struct kl_can_frame frame = {.id = control->id, .length = (uint8_t)length};
        assert_int_equal(kl_message_decode(control, &frame, &got),
                         length == 8 ? KL_OK : KL_ERR_VALUE);
    }
    for (unsigned flags = 1; flags < 16; flags++) {
        const struct kl_can_frame frame = {.id = control->id, .flags = (uint8_t)flags, .length = 8};
        assert_int_equal(kl_message_decode(control, &frame, &got), KL_ERR_VALUE);
    }
    const struct kl_can_frame status = {.id = 0x030, .length = 8};
    assert_int_equal(kl_message_decode(&kl_signal_messages()[KL_MSG_STATUS], &status, &got),
                     KL_ERR_ARGUMENT);
    assert_int_equal(kl_message_decode(NULL, &status, &got), KL_ERR_ARGUMENT);
}

/* ---- schedule and load ---- */

static void periods_become_whole_cycles(void **state) {
    (void)state;
    struct kl_layout layout = wagon;
    const struct kl_message *motion = &kl_signal_messages()[KL_MSG_WHEELSET_MOTION];
    const struct kl_message *status = &kl_signal_messages()[KL_MSG_STATUS];
    assert_int_equal(kl_message_cycles(&layout, motion), 1);
    assert_int_equal(kl_message_cycles(&layout, status), 10);
    assert_int_equal(kl_message_cycles(&layout, &kl_signal_messages()[KL_MSG_ACK]), 0);
    layout.state_divider = 5;
    assert_int_equal(kl_message_cycles(&layout, motion), 5);
    assert_int_equal(kl_message_cycles(&layout, status), 10);
    layout.step_ns = 100000;
    assert_int_equal(kl_message_cycles(&layout, motion), 50);
    layout.step_ns = 10000000;
    layout.state_divider = 1;
    assert_int_equal(kl_message_cycles(&layout, motion), 1);
    assert_int_equal(kl_message_cycle_us(&layout, motion), 10000);
}

/* Davis, Burns et al. 2007: an 8-byte frame with an 11-bit identifier takes at most 135 bits, one
 * without data 55. The wagon sends 2 + 4 + 2 messages a millisecond, 5 + 16 + 2 + 1 and two
 * torques in ten, one set-point in a hundred and three messages a second. */
static void bus_load_is_the_sum_of_longest_frames(void **state) {
    (void)state;
    struct kl_bus_load load;
    uint64_t frames = 8 * 1000 + 26 * 100 + 10 + 3;
    assert_int_equal(kl_frame_bits(8), 135);
    assert_int_equal(kl_frame_bits(0), 55);
    assert_int_equal(kl_bus_load(&wagon, 0, &load), KL_OK);
    assert_int_equal(load.frames_per_s, frames);
    assert_int_equal(load.bits_per_s, frames * 135);
    assert_int_equal(load.permille, 0);
    assert_int_equal(load.verdict, KL_LOAD_OK);
}

static void bus_load_warns_above_70_and_refuses_above_100_percent(void **state) {
    (void)state;
    struct kl_bus_load load;
    const uint32_t bits = (8 * 1000 + 26 * 100 + 10 + 3) * 135;
    assert_int_equal(kl_bus_load(&wagon, bits, &load), KL_OK);
    assert_int_equal(load.permille, 1000);
    assert_int_equal(load.verdict, KL_LOAD_HIGH);
    kl_bus_load(&wagon, bits - 1, &load);
    assert_int_equal(load.verdict, KL_LOAD_EXCEEDED);
    kl_bus_load(&wagon, (uint32_t)((uint64_t)bits * 1000 / 700) + 1, &load);
    assert_int_equal(load.permille, 700);
    assert_int_equal(load.verdict, KL_LOAD_OK);
    struct kl_layout slow = wagon;
    slow.state_divider = 6;
    kl_bus_load(&slow, 500000, &load);
    assert_int_equal(load.verdict, KL_LOAD_OK);
}

static void layouts_out_of_range_are_refused(void **state) {
    (void)state;
    struct kl_bus_load load;
    struct kl_layout bad[5] = {wagon, wagon, wagon, wagon, wagon};
    bad[0].n_wheelsets = 0;
    bad[1].step_ns = 0;
    bad[2].state_divider = 0;
    bad[3].n_bodies = KL_BUS_MAX_BODIES + 1;
    bad[4].n_wheelsets = KL_BUS_MAX_WHEELSETS + 1;
    for (unsigned i = 0; i < 5; i++) {
        enum kl_status expected = i < 3 ? KL_ERR_ARGUMENT : KL_ERR_CAPACITY;
        assert_int_equal(kl_layout_check(&bad[i]), expected);
        assert_int_equal(kl_bus_load(&bad[i], 0, &load), expected);
    }
    assert_int_equal(kl_layout_check(NULL), KL_ERR_ARGUMENT);
    assert_int_equal(kl_bus_load(&wagon, 0, NULL), KL_ERR_ARGUMENT);
}

/* ---- texts ---- */

struct buffer {
    char text[200000];
    size_t used;
    size_t room;
};

static int collect(void *context, const char *text, size_t size) {
    struct buffer *buffer = context;
    if (size > buffer->room - buffer->used) {
        return -1;
    }
    memcpy(buffer->text + buffer->used, text, size);
    buffer->used += size;
    buffer->text[buffer->used] = '\0';
    return 0;
}

static void csv_and_markdown_show_the_table(void **state) {
    (void)state;
    static struct buffer buffer = {.room = sizeof buffer.text - 1};
    const struct kl_text_sink sink = {.write = collect, .context = &buffer};
    assert_int_equal(kl_signals_csv(&wagon, &sink), KL_OK);
    assert_non_null(strstr(buffer.text, "\n0x100,Wheelset1Motion,Klingel,1000,8,0,0,Y,16,16,1,"
                                        "0.000001,0,-0.032767,0.032767,-32768,m,\n"));
    assert_non_null(strstr(buffer.text, "\n0x011,SpeedSetpoint,Bench,100000,8,4113,5,Speed,32,16,0,"
                                        "0.0025,0,0,163.835,65535,m/s,\n"));
    assert_non_null(strstr(buffer.text, "0=Init|1=Running|2=Paused|3=Stopped|4=Fault\n"));
    buffer.used = 0;
    assert_int_equal(kl_signals_markdown(&wagon, &sink), KL_OK);
    assert_non_null(strstr(buffer.text, "| 0x240 + 2 (wheelset - 1), left wheel + 1 | Wheel#Creep "
                                        "| Klingel | 10 ms | Creep forces of a wheel |\n"));
    assert_non_null(strstr(buffer.text, "| Q | 16 | 16 signed | 10 | -327670 .. 327670 | N |"));
    buffer.used = 0;
    buffer.room = 100;
    assert_int_equal(kl_signals_markdown(&wagon, &sink), KL_ERR_MEMORY);
    assert_int_equal(kl_signals_csv(&wagon, &sink), KL_ERR_MEMORY);
    assert_int_equal(kl_signals_csv(&wagon, NULL), KL_ERR_ARGUMENT);
}

static void the_hash_knows_what_is_on_the_wire(void **state) {
    (void)state;
    struct kl_layout other = wagon;
    uint64_t hash = kl_signals_hash(&wagon);
    assert_true(hash != 0 && hash == kl_signals_hash(&wagon));
    other.n_wheelsets = 4;
    assert_true(kl_signals_hash(&other) != hash);
    other = wagon;
    other.state_divider = 2;
    assert_true(kl_signals_hash(&other) != hash);
    other.n_wheelsets = 0;
    assert_int_equal(kl_signals_hash(&other), 0);
}

static void numbers_are_written_exactly(void **state) {
    (void)state;
    static struct buffer buffer = {.room = 1000};
    const struct kl_text_sink sink = {.write = collect, .context = &buffer};
    struct kl_text text = {.sink = &sink};
    kl_text_int(&text, INT64_MIN);
    kl_text_put(&text, " ");
    kl_text_int(&text, 0);
    kl_text_put(&text, " ");
    kl_text_decimal(&text, -5, 3);
    kl_text_put(&text, " ");
    kl_text_decimal(&text, 1250, 3);
    kl_text_put(&text, " ");
    kl_text_decimal(&text, 7000, 3);
    kl_text_put(&text, " ");
    kl_text_hex(&text, 0x1F, 4);
    assert_string_equal(buffer.text, "-9223372036854775808 0 -0.005 1.25 7 001f");
    assert_int_equal(kl_text_end(&text), KL_OK);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(identifiers_are_unique_and_leave_canopen_free),
        cmocka_unit_test(signals_fit_their_frames_without_overlap),
        cmocka_unit_test(cyclic_states_carry_a_counter_and_commands_are_protected),
        cmocka_unit_test(names_carry_their_number),
        cmocka_unit_test(raw_and_physical_values_go_round),
        cmocka_unit_test(a_frame_has_the_bytes_worked_out_by_hand),
        cmocka_unit_test(values_round_to_nearest_and_saturate),
        cmocka_unit_test(what_is_not_finite_becomes_invalid),
        cmocka_unit_test(every_output_may_be_nan_or_missing),
        cmocka_unit_test(counts_wrap_and_small_integers_saturate),
        cmocka_unit_test(adhesion_is_creep_force_over_load),
        cmocka_unit_test(commands_survive_the_wire),
        cmocka_unit_test(decoding_checks_the_frame_first),
        cmocka_unit_test(periods_become_whole_cycles),
        cmocka_unit_test(bus_load_is_the_sum_of_longest_frames),
        cmocka_unit_test(bus_load_warns_above_70_and_refuses_above_100_percent),
        cmocka_unit_test(layouts_out_of_range_are_refused),
        cmocka_unit_test(csv_and_markdown_show_the_table),
        cmocka_unit_test(the_hash_knows_what_is_on_the_wire),
        cmocka_unit_test(numbers_are_written_exactly),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
