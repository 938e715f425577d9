/* Lines of the socketcand protocol: what the clients of the world write and read, and nonsense. */
#include "kl_socketcand_text.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define TIME_NS (INT64_C(1700000000123456) * 1000 + 789)

/* The lines of can-bench.md and of python-can 4.1's own converter. */
static void formats_frames(void **state) {
    (void)state;
    static const struct {
        struct kl_can_frame frame;
        const char *line;
    } cases[] = {
        {{.id = 0x123, .length = 4, .data = {0x1A, 0x22, 0x03, 0x44}},
         "\n< frame 123 1700000000.123456 1A220344 >"},
        {{.id = 0x7, .length = 0}, "\n< frame 007 1700000000.123456  >"},
        {{.id = 0x7, .length = 1, .flags = KL_CAN_EXTENDED},
         "\n< frame 00000007 1700000000.123456 00 >"},
        {{.id = 0x1FFFFFFF,
          .flags = KL_CAN_EXTENDED,
          .length = 8,
          .data = {255, 254, 253, 252, 251, 250, 249, 248}},
         "\n< frame 1FFFFFFF 1700000000.123456 FFFEFDFCFBFAF9F8 >"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char line[KL_SOCKETCAND_FRAME_BYTES];
        assert_int_equal(kl_socketcand_format(&cases[i].frame, TIME_NS, line),
                         strlen(cases[i].line));
        assert_string_equal(line, cases[i].line);
    }
}

static void longest_line_fits(void **state) {
    (void)state;
    const struct kl_can_frame frame = {.id = 0x1FFFFFFF, .flags = KL_CAN_EXTENDED, .length = 8};
    char line[KL_SOCKETCAND_FRAME_BYTES];
    memset(line, 'x', sizeof line);
    size_t length = kl_socketcand_format(&frame, INT64_MAX, line);
    assert_true(length > 0 && length < sizeof line);
    assert_int_equal(line[length], '\0');
}

static void formats_no_others(void **state) {
    (void)state;
    const struct kl_can_frame bad[] = {{.id = 1, .flags = KL_CAN_FD, .length = 8},
                                       {.id = 1, .flags = KL_CAN_REMOTE},
                                       {.id = 0x800},
                                       {.id = 1, .length = 9}};
    char line[KL_SOCKETCAND_FRAME_BYTES];
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        assert_int_equal(kl_socketcand_format(&bad[i], TIME_NS, line), 0);
}

static enum kl_can_status parse(const char *line, struct kl_can_frame *frame) {
    /* An allocation of just that size: valgrind sees a byte too many. */
    size_t length = strlen(line);
    char *copy = malloc(length > 0 ? length : 1);
    memcpy(copy, line, length);
    enum kl_can_status status = kl_socketcand_parse(copy, length, frame);
    free(copy);
    return status;
}

static void parses_what_clients_send(void **state) {
    (void)state;
    static const struct {
        const char *line;
        struct kl_can_frame frame;
    } cases[] = {
        {" send 123 2 1 ab ", {.id = 0x123, .length = 2, .data = {1, 0xAB}}}, /* python-can */
        {" send 7FF 0  ", {.id = 0x7FF}}, /* the same, no data */
        {"send 0 1 0", {.id = 0, .length = 1}},
        {" send 123 8 1 2 3 4 5 6 7 FF ",
         {.id = 0x123, .length = 8, .data = {1, 2, 3, 4, 5, 6, 7, 255}}},
        {" send 00000123 1 05 ", /* socketcand: eight digits are an extended identifier */
         {.id = 0x123, .flags = KL_CAN_EXTENDED, .length = 1, .data = {5}}},
        {" send 80000123 1 5 ", /* SavvyCAN: bit 31 */
         {.id = 0x123, .flags = KL_CAN_EXTENDED, .length = 1, .data = {5}}},
        {" send 9FFFFFFF 0 ", {.id = 0x1FFFFFFF, .flags = KL_CAN_EXTENDED}},
        {" send 18FF1234 0 ", {.id = 0x18FF1234, .flags = KL_CAN_EXTENDED}},
        {" send 800 0 ", {.id = 0x800, .flags = KL_CAN_EXTENDED}}, /* can only be extended */
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct kl_can_frame frame;
        memset(&frame, 0x55, sizeof frame);
        assert_int_equal(parse(cases[i].line, &frame), KL_CAN_OK);
        assert_int_equal(frame.id, cases[i].frame.id);
        assert_int_equal(frame.flags, cases[i].frame.flags);
        assert_int_equal(frame.length, cases[i].frame.length);
        assert_memory_equal(frame.data, cases[i].frame.data, sizeof frame.data);
    }
}

static void refuses_the_rest_and_leaves_the_frame_alone(void **state) {
    (void)state;
    static const char *const lines[] = {
        "",
        " ",
        "send",
        " send 123 ",
        " send 123 4  ",                        /* a remote frame of python-can */
        " send 123 C 1 2 3 4 5 6 7 8 9 a b c ", /* an FD frame of python-can */
        " send 123 9 1 2 3 4 5 6 7 8 9 ",
        " send 123 02 1 2 ",
        " send 123 -1 ",
        " send 123 2 1 ",
        " send 123 1 1 2 ",
        " send 123 1 123 ",
        " send 123 1 0x1 ",
        " send 123 1 g ",
        " send xyz 1 1 ",
        " send 123456789 0 ",
        " send 3FFFFFFF 0 ", /* bit 29 */
        " send C0000001 0 ", /* bits 31 and 30 */
        " send 123\t1 1 ",
        " Send 123 0 ",
        " sendx 123 0 ",
        " frame 123 1.0 00 ",
    };
    struct kl_can_frame frame;
    struct kl_can_frame pattern;
    memset(&frame, 0x55, sizeof frame);
    memset(&pattern, 0x55, sizeof pattern);
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        assert_int_equal(parse(lines[i], &frame), KL_CAN_REFUSED);
        assert_memory_equal(&frame, &pattern, sizeof frame);
    }
}

/* Random lines of the protocol's own alphabet: whatever is accepted is a good classic data frame.
 */
static void fuzzed_lines_give_good_frames_or_none(void **state) {
    (void)state;
    static const char alphabet[] = "0123456789abcdefABCDEF    <>\t-x";
    uint32_t number = 20240917;
    unsigned accepted = 0;
    for (unsigned round = 0; round < 200000; round++) {
        char line[64] = " send ";
        size_t length = 6 + number % 30;
        for (size_t i = 6; i < length; i++) {
            number = number * 1664525u + 1013904223u;
            line[i] = alphabet[(number >> 16) % (round % 2 ? sizeof alphabet - 1 : 26)];
        }
        line[length] = '\0';
        struct kl_can_frame frame;
        number = number * 1664525u + 1013904223u;
        if (parse(line, &frame) == KL_CAN_OK) {
            accepted++;
            assert_int_equal(kl_can_check(&frame), KL_CAN_OK);
            assert_int_equal(frame.flags & ~KL_CAN_EXTENDED, 0);
        }
    }
    assert_true(accepted > 100); /* the alphabet does reach the parser's depths */
}

static void words(void **state) {
    (void)state;
    size_t length = 0;
    const char *line = "  open  vcan0 ";
    assert_memory_equal(kl_socketcand_word(line, 14, 0, &length), "open", 4);
    assert_int_equal(length, 4);
    assert_memory_equal(kl_socketcand_word(line, 14, 1, &length), "vcan0", 5);
    assert_int_equal(length, 5);
    assert_null(kl_socketcand_word(line, 14, 2, &length));
    assert_null(kl_socketcand_word(line, 0, 0, &length));
    assert_true(kl_socketcand_is(line, 14, "open"));
    assert_false(kl_socketcand_is(line, 5, "open"));
    assert_false(kl_socketcand_is(line, 14, "ope"));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(formats_frames),
        cmocka_unit_test(longest_line_fits),
        cmocka_unit_test(formats_no_others),
        cmocka_unit_test(parses_what_clients_send),
        cmocka_unit_test(refuses_the_rest_and_leaves_the_frame_alone),
        cmocka_unit_test(fuzzed_lines_give_good_frames_or_none),
        cmocka_unit_test(words),
    };
    return cmocka_run_group_tests_name("kl_socketcand_text", tests, NULL, NULL);
}
