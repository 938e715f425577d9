/* The adapter's end of the LAWICEL protocol: commands and their answers, the acceptance filter,
 * what happens when there is no room, and storms of bytes. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "kl_slcan_link.h"

#define RX_BYTES 1024u
#define TX_BYTES 256u
#define QUEUE 4u

static struct {
    unsigned char rx_bytes[RX_BYTES];
    unsigned char tx_bytes[TX_BYTES];
    struct kl_can_frame queue[QUEUE];
    struct kl_ring rx;
    struct kl_ring tx;
    struct kl_slcan_link link;
    struct kl_can can;
    int kicks;
} wire;

static void count_kick(void *context) {
    ++*(int *)context;
}

static int set_up(void **state) {
    (void)state;
    memset(&wire, 0, sizeof wire);
    (void)kl_ring_init(&wire.rx, wire.rx_bytes, RX_BYTES);
    (void)kl_ring_init(&wire.tx, wire.tx_bytes, TX_BYTES);
    const struct kl_slcan_link_config config = {.rx = &wire.rx,
                                                .tx = &wire.tx,
                                                .kick = count_kick,
                                                .kick_context = &wire.kicks,
                                                .queue = wire.queue,
                                                .queue_frames = QUEUE,
                                                .serial = "A123"};
    wire.can = kl_slcan_link_can(&wire.link);
    return kl_slcan_link_init(&wire.link, &config) == KL_CAN_OK ? 0 : -1;
}

static void put(const char *bytes, size_t size) {
    for (size_t i = 0; i < size; i++) {
        (void)kl_ring_put(&wire.rx, (unsigned char)bytes[i]);
    }
}

/* What came over the wire since the last call; CR is shown as '.', BEL as '!'. */
static const char *heard(void) {
    static char text[TX_BYTES + 1];
    unsigned char bytes[TX_BYTES];
    uint32_t n = kl_ring_read(&wire.tx, bytes, sizeof bytes);
    for (uint32_t i = 0; i < n; i++) {
        text[i] = (char)(bytes[i] == '\r' ? '.' : bytes[i] == '\a' ? '!' : bytes[i]);
    }
    text[n] = '\0';
    return text;
}

/* Says one line, with '.' for CR, and returns the answer. */
static const char *say(const char *line) {
    for (const char *at = line; *at != '\0'; at++) {
        put(*at == '.' ? "\r" : at, 1);
    }
    kl_can_service(&wire.can);
    return heard();
}

static enum kl_can_status send(uint32_t id, unsigned flags, uint8_t length, uint8_t first) {
    const struct kl_can_frame frame = {
        .id = id, .flags = (uint8_t)flags, .length = length, .data = {first}};
    return kl_can_send(&wire.can, &frame);
}

static struct kl_slcan_stats stats_now(void) {
    struct kl_slcan_stats stats;
    kl_slcan_link_get_stats(&wire.link, &stats);
    return stats;
}

static struct kl_can_counts counts_now(void) {
    struct kl_can_counts counts;
    kl_can_get_counts(&wire.can, &counts);
    return counts;
}

/* ---- commands ---- */

/* Answers as in the LAWICEL CAN232 and CANUSB manuals: which commands need the channel open, which
 * closed. */
static void commands_are_answered_as_the_manual_says(void **state) {
    (void)state;
    static const struct {
        const char *said;
        const char *answer;
    } talk[] = {
        {".", "."},          {"V.", "V0101."},      {"N.", "NA123."},   {"C.", "!"},
        {"F.", "!"},         {"t1230.", "!"},       {"S6.", "."},       {"S.", "!"},
        {"SA.", "!"},        {"S66.", "!"},         {"s031C.", "."},    {"s031.", "!"},
        {"s031G.", "!"},     {"Z1.", "."},          {"Z2.", "!"},       {"Z0.", "."},
        {"M00000000.", "."}, {"mFFFFFFFF.", "."},   {"M0000000.", "!"}, {"m000000000.", "!"},
        {"O1.", "!"},        {"O.", "."},           {"O.", "!"},        {"L.", "!"},
        {"S6.", "!"},        {"s031C.", "!"},       {"Z1.", "!"},       {"M00000000.", "!"},
        {"mFFFFFFFF.", "!"}, {"F.", "F00."},        {"V.", "V0101."},   {"N.", "NA123."},
        {"t1230.", "z."},    {"T000001230.", "Z."}, {"r1230.", "z."},   {"R000001230.", "Z."},
        {"t123.", "!"},      {"t12309999.", "!"},   {"C.", "."},        {"C.", "!"},
        {"L.", "."},         {"t1230.", "!"},       {"F.", "F00."},     {"C1.", "!"},
        {"C.", "."},         {"X1.", "!"},          {"hello.", "!"},    {"O.C.O.", "..."},
    };
    for (size_t i = 0; i < sizeof talk / sizeof talk[0]; i++) {
        const char *answer = say(talk[i].said);
        if (strcmp(answer, talk[i].answer) != 0) {
            print_message("%s\n", talk[i].said);
        }
        assert_string_equal(answer, talk[i].answer);
    }
    assert_int_equal(wire.link.bit_timing, 0x031C);
    assert_int_equal(stats_now().opened, 4);
}

static void a_channel_carries_frames_only_while_open(void **state) {
    (void)state;
    struct kl_can_frame frame;
    assert_int_equal(send(0x123, 0, 1, 0xAB), KL_CAN_OK);
    assert_string_equal(heard(), "");
    assert_string_equal(say("O."), ".");
    assert_int_equal(send(0x123, 0, 1, 0xAB), KL_CAN_OK);
    assert_string_equal(heard(), "t1231AB.");
    assert_string_equal(say("t7FF2beEF."), "z.");
    assert_int_equal(kl_can_receive(&wire.can, &frame), KL_CAN_OK);
    assert_int_equal(frame.id, 0x7FF);
    assert_int_equal(frame.data[1], 0xEF);
    assert_string_equal(say("C.L."), "..");
    assert_int_equal(send(0x123, KL_CAN_EXTENDED, 1, 0xAC), KL_CAN_OK);
    assert_string_equal(heard(), "T000001231AC.");
    assert_int_equal(counts_now().sent, 3);
    assert_true(wire.kicks >= 5);
}

static void time_stamps_are_those_of_the_owner(void **state) {
    (void)state;
    assert_string_equal(say("Z1.O."), "..");
    kl_slcan_link_set_time(&wire.link, 59999);
    assert_int_equal(send(0x123, 0, 0, 0), KL_CAN_OK);
    assert_string_equal(heard(), "t1230EA5F.");
    kl_slcan_link_set_time(&wire.link, UINT64_C(60000) * 5 + 1);
    assert_int_equal(send(0x123, 0, 0, 0), KL_CAN_OK);
    assert_string_equal(heard(), "t12300001.");
}

/* ---- acceptance filter ---- */

static bool passes(uint32_t id, unsigned flags, uint8_t length, uint8_t first) {
    assert_int_equal(send(id, flags, length, first), KL_CAN_OK);
    return heard()[0] != '\0';
}

/* SJA1000 data sheet, dual filter mode: bits as in its figures, worked out by hand. */
static void the_filter_is_that_of_the_sja1000(void **state) {
    (void)state;
    /* first half: 0x123 = 001 0010 0011 -> 0010 0100 011, RTR 0; second: 0x456 -> 1000 1010 110 */
    assert_string_equal(say("M24608AC0.m000F000F.O."), "...");
    assert_true(passes(0x123, 0, 0, 0));
    assert_true(passes(0x123, 0, 2, 0xFF));
    assert_true(passes(0x456, 0, 1, 7));
    assert_false(passes(0x124, 0, 0, 0));
    assert_false(passes(0x123, KL_CAN_REMOTE, 0, 0));
    assert_false(passes(0x7FF, 0, 8, 0));
    /* the first half alone also wants data byte 1 to be 0x5A; the second passes nothing near */
    assert_string_equal(say("C.M2465FFFA.m00000000.O."), "....");
    assert_true(passes(0x123, 0, 1, 0x5A));
    assert_false(passes(0x123, 0, 1, 0x5B));
    assert_false(passes(0x123, 0, 1, 0x4A));
    assert_true(passes(0x123, 0, 0, 0)); /* no data: the nibbles do not count */
    /* extended: ID.28..ID.13 in either half: 0x02468000 >> 13 = 0x1234 */
    assert_string_equal(say("C.M1234FFFF.m00000000.O."), "....");
    assert_true(passes(0x02468000, KL_CAN_EXTENDED, 1, 0));
    assert_true(passes(0x02469FFF, KL_CAN_EXTENDED, 1, 0));
    assert_true(passes(0x1FFFFFFF, KL_CAN_EXTENDED, 1, 0));
    assert_false(passes(0x0246A000, KL_CAN_EXTENDED, 1, 0));
    assert_int_equal(stats_now().filtered, 6);
}

/* ---- no room ---- */

static void lines_go_out_whole_or_not_at_all(void **state) {
    (void)state;
    static const char line[] = "t12380102030405060708.";
    const struct kl_can_frame frame = {.id = 0x123, .length = 8, .data = {1, 2, 3, 4, 5, 6, 7, 8}};
    unsigned sent = 0;
    assert_string_equal(say("O."), ".");
    while (kl_can_send(&wire.can, &frame) == KL_CAN_OK) {
        sent++;
    }
    assert_int_equal(sent, TX_BYTES / (sizeof line - 1));
    assert_int_equal(counts_now().send_dropped, 1);
    const char *text = heard();
    for (unsigned i = 0; i < sent; i++) {
        assert_memory_equal(text + i * (sizeof line - 1), line, sizeof line - 1);
    }
    assert_int_equal(strlen(text), sent * (sizeof line - 1));
    assert_string_equal(say("F."), "F02.");
    assert_string_equal(say("F."), "F00.");
}

static void answers_without_room_are_counted(void **state) {
    (void)state;
    for (uint32_t i = 0; i < TX_BYTES + 10; i++) {
        put("\r", 1);
        kl_can_service(&wire.can);
    }
    assert_int_equal(stats_now().lost_answers, 10);
    assert_int_equal(strlen(heard()), TX_BYTES);
}

static void a_full_queue_drops_the_new_frame(void **state) {
    (void)state;
    struct kl_can_frame frame;
    assert_string_equal(say("O."), ".");
    assert_string_equal(say("t0010.t0020.t0030.t0040.t0050.t0060."), "z.z.z.z.z.z.");
    assert_int_equal(counts_now().receive_dropped, 2);
    for (uint32_t id = 1; id <= QUEUE; id++) {
        assert_int_equal(kl_can_receive(&wire.can, &frame), KL_CAN_OK);
        assert_int_equal(frame.id, id);
    }
    assert_int_equal(kl_can_receive(&wire.can, &frame), KL_CAN_EMPTY);
    assert_string_equal(say("F."), "F01.");
}

/* A gap must not make one frame of two halves. */
static void lost_bytes_join_no_lines(void **state) {
    (void)state;
    struct kl_can_frame frame;
    assert_string_equal(say("O."), ".");
    for (uint32_t i = 0; i < RX_BYTES / 6; i++) {
        put("t1110\r", 6); /* 1020 bytes */
    }
    put("t2221AA\rt33", 11); /* 4 of these fit: t222 */
    (void)kl_ring_read(&wire.rx, (unsigned char[4 * 6]){0}, 4 * 6);
    put("0\r", 2); /* without the mark: t2220 */
    for (int i = 0; i < 4; i++) {
        kl_can_service(&wire.can);
        while (kl_can_receive(&wire.can, &frame) == KL_CAN_OK) {
            assert_int_equal(frame.id, 0x111);
        }
        (void)heard();
    }
    assert_int_equal(stats_now().lost_bytes, 7);
    assert_int_equal(stats_now().spoilt, 1);
    assert_string_equal(say("F."), "F09.");
}

static void service_is_bounded(void **state) {
    (void)state;
    for (uint32_t i = 0; i < RX_BYTES; i++) {
        put("x", 1);
    }
    kl_can_service(&wire.can);
    assert_int_equal(kl_ring_count(&wire.rx), RX_BYTES - KL_SLCAN_SERVICE_BYTES);
}

/* ---- storms ---- */

static void any_bytes_are_survived(void **state) {
    (void)state;
    static const char *const pieces[] = {
        "t123", "0",    "2AABB", "T00000", "R",          "r7FF", "\r", "\r",       "\rO\r",
        "C\r",  "S6\r", "F\r",   "m0\r",   "\rC\rZ1\rV", "\a",   "8",  "\rt1230\r"};
    const uint32_t seed = 30;
    uint32_t number = seed;
    struct kl_can_frame frame;
    for (int round = 0; round < 20000; round++) {
        for (int i = 0; i < 8; i++) {
            number = number * 1664525u + 1013904223u;
            const char byte = (char)(number >> 24);
            const char *piece = pieces[(number >> 16) % (sizeof pieces / sizeof pieces[0])];
            bool wild = (number >> 13 & 7u) == 0;
            put(wild ? &byte : piece, wild ? 1 : strlen(piece));
        }
        kl_can_service(&wire.can);
        (void)send(0x10, 0, 8, 1);
        while (kl_can_receive(&wire.can, &frame) == KL_CAN_OK) {
            assert_int_equal(kl_can_check(&frame), KL_CAN_OK);
        }
        (void)heard();
        assert_true(kl_can_is_up(&wire.can));
    }
    struct kl_slcan_stats stats = stats_now();
    assert_true(stats.spoilt > 100 && stats.opened > 100 && counts_now().received > 100);
    assert_true(stats.belled <= stats.lines);
    (void)say("\r\r");
    (void)say("C.");
    assert_string_equal(say("mFFFFFFFF.O.t1230."), "..z.");
}

static void a_hang_up_closes_the_channel(void **state) {
    (void)state;
    assert_string_equal(say("Z1.m00000000.O."), "...");
    (void)send(1, 0, 0, 0);
    put("t12", 3);
    kl_can_service(&wire.can);
    kl_slcan_link_hang_up(&wire.link);
    assert_string_equal(heard(), "");
    assert_int_equal(kl_slcan_link_channel(&wire.link), KL_SLCAN_CLOSED);
    assert_string_equal(say("O."), ".");
    assert_int_equal(send(0x123, 0, 0, 0), KL_CAN_OK);
    assert_string_equal(heard(), "t1230.");
}

static void wrong_arguments_are_refused(void **state) {
    (void)state;
    struct kl_slcan_link link;
    unsigned char few[16];
    struct kl_ring small;
    assert_true(kl_ring_init(&small, few, sizeof few));
    struct kl_slcan_link_config config = wire.link.config;
    assert_int_equal(kl_slcan_link_init(NULL, &config), KL_CAN_ARGUMENT);
    assert_int_equal(kl_slcan_link_init(&link, NULL), KL_CAN_ARGUMENT);
    config.tx = &small;
    assert_int_equal(kl_slcan_link_init(&link, &config), KL_CAN_ARGUMENT);
    config = wire.link.config;
    config.serial = "A12";
    assert_int_equal(kl_slcan_link_init(&link, &config), KL_CAN_ARGUMENT);
    config.serial = "A12\r";
    assert_int_equal(kl_slcan_link_init(&link, &config), KL_CAN_ARGUMENT);
    config = wire.link.config;
    config.queue_frames = 0;
    assert_int_equal(kl_slcan_link_init(&link, &config), KL_CAN_ARGUMENT);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(commands_are_answered_as_the_manual_says, set_up),
        cmocka_unit_test_setup(a_channel_carries_frames_only_while_open, set_up),
        cmocka_unit_test_setup(time_stamps_are_those_of_the_owner, set_up),
        cmocka_unit_test_setup(the_filter_is_that_of_the_sja1000, set_up),
        cmocka_unit_test_setup(lines_go_out_whole_or_not_at_all, set_up),
        cmocka_unit_test_setup(answers_without_room_are_counted, set_up),
        cmocka_unit_test_setup(a_full_queue_drops_the_new_frame, set_up),
        cmocka_unit_test_setup(lost_bytes_join_no_lines, set_up),
        cmocka_unit_test_setup(service_is_bounded, set_up),
        cmocka_unit_test_setup(any_bytes_are_survived, set_up),
        cmocka_unit_test_setup(a_hang_up_closes_the_channel, set_up),
        cmocka_unit_test_setup(wrong_arguments_are_refused, set_up),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
