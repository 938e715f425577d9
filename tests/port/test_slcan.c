/* The LAWICEL text of frames, and the reader of a stream. Lines that end at a forbidden page show
 * any read outside. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <sys/mman.h>

#include <cmocka.h>

#include "kl_ring.h"
#include "kl_slcan.h"

#define PAGE 4096u

static char *page_end; /* the first byte that must not be touched */

static int map_pages(void **state) {
    (void)state;
    char *memory = mmap(NULL, 2 * PAGE, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED || mprotect(memory + PAGE, PAGE, PROT_NONE) != 0) {
        return -1;
    }
    page_end = memory + PAGE;
    return 0;
}

static enum kl_can_status decode(const char *bytes, uint32_t length, struct kl_can_frame *frame,
                                 uint16_t *time_ms) {
    char *line = page_end - length;
    memcpy(line, bytes, length);
    return kl_slcan_decode(line, length, frame, time_ms);
}

static uint32_t random_state;
static uint32_t random_below(uint32_t n) {
    random_state = random_state * 1664525u + 1013904223u;
    return (uint32_t)(((uint64_t)(random_state >> 8) * n) >> 24);
}

/* ---- frames ---- */

/* Examples of the LAWICEL CAN232 manual (commands t, T, r, R), and the limits of each field. */
static const struct {
    const char *line;
    struct kl_can_frame frame;
} examples[] = {
    {"t10021133", {.id = 0x100, .length = 2, .data = {0x11, 0x33}}},
    {"t0200", {.id = 0x020}},
    {"T0000010021133", {.id = 0x100, .flags = KL_CAN_EXTENDED, .length = 2, .data = {0x11, 0x33}}},
    {"r1002", {.id = 0x100, .flags = KL_CAN_REMOTE, .length = 2}},
    {"R000001002", {.id = 0x100, .flags = KL_CAN_EXTENDED | KL_CAN_REMOTE, .length = 2}},
    {"t7FF8FEDCBA9876543210",
     {.id = 0x7FF, .length = 8, .data = {0xFE, 0xDC, 0xBA, 0x98, 0x76, 0x54, 0x32, 0x10}}},
    {"T1FFFFFFF100", {.id = 0x1FFFFFFF, .flags = KL_CAN_EXTENDED, .length = 1}},
    {"r0008", {.flags = KL_CAN_REMOTE, .length = 8}},
};
#define EXAMPLES (sizeof examples / sizeof examples[0])

static void assert_same(const struct kl_can_frame *is, const struct kl_can_frame *wanted) {
    assert_int_equal(is->id, wanted->id);
    assert_int_equal(is->flags, wanted->flags);
    assert_int_equal(is->length, wanted->length);
    assert_memory_equal(is->data, wanted->data, wanted->length);
}

static void frames_are_written_as_the_manual_shows(void **state) {
    (void)state;
    for (size_t i = 0; i < EXAMPLES; i++) {
        char text[KL_SLCAN_LINE_BYTES];
        uint32_t length = (uint32_t)strlen(examples[i].line);
        assert_int_equal(kl_slcan_encode(&examples[i].frame, KL_SLCAN_NO_TIME, text), length + 1);
        assert_memory_equal(text, examples[i].line, length);
        assert_int_equal(text[length], '\r');
    }
}

static void frames_are_read_in_either_case(void **state) {
    (void)state;
    for (size_t i = 0; i < EXAMPLES; i++) {
        char line[32];
        struct kl_can_frame frame;
        uint32_t length = (uint32_t)strlen(examples[i].line);
        assert_int_equal(decode(examples[i].line, length, &frame, NULL), KL_CAN_OK);
        assert_same(&frame, &examples[i].frame);
        memcpy(line, examples[i].line, length + 1);
        for (uint32_t at = 1; at < length; at++) {
            line[at] = (char)(line[at] >= 'A' && line[at] <= 'F' ? line[at] + 32 : line[at]);
        }
        assert_int_equal(decode(line, length, &frame, NULL), KL_CAN_OK);
        assert_same(&frame, &examples[i].frame);
    }
}

static void time_stamps_come_and_go(void **state) {
    (void)state;
    char text[KL_SLCAN_LINE_BYTES];
    struct kl_can_frame frame;
    uint16_t time_ms = 0;
    assert_int_equal(kl_slcan_encode(&examples[0].frame, 0x1234, text), 14);
    assert_memory_equal(text, "t100211331234\r", 14);
    assert_int_equal(decode(text, 13, &frame, &time_ms), KL_CAN_OK);
    assert_int_equal(time_ms, 0x1234);
    assert_same(&frame, &examples[0].frame);
    assert_int_equal(decode(text, 13, &frame, NULL), KL_CAN_REFUSED);
    assert_int_equal(decode(text, 9, &frame, &time_ms), KL_CAN_OK);
    assert_int_equal(time_ms, KL_SLCAN_NO_TIME);
    /* 60 000 ms is no time; the manual ends at 0xEA5F */
    assert_int_equal(decode("t0000EA5F", 9, &frame, &time_ms), KL_CAN_OK);
    assert_int_equal(decode("t0000EA60", 9, &frame, &time_ms), KL_CAN_REFUSED);
    const struct kl_can_frame longest = {
        .id = 0x1FFFFFFF, .flags = KL_CAN_EXTENDED, .length = 8, .data = {1, 2, 3, 4, 5, 6, 7, 8}};
    assert_int_equal(kl_slcan_encode(&longest, 59999, text), KL_SLCAN_LINE_BYTES);
}

static void what_is_no_frame_is_refused(void **state) {
    (void)state;
    static const char *const lines[] = {"",
                                        "t",
                                        "t123",
                                        "t1239",
                                        "t123G",
                                        "t1232112",
                                        "t123211223",
                                        "tg001",
                                        "t12 1 0",
                                        "t80000",
                                        "T200000000",
                                        "T0000",
                                        "T000001",
                                        "r1009",
                                        "r100211",
                                        "R00000100",
                                        "R0000010021",
                                        "x1230",
                                        "O",
                                        "t1230\r",
                                        "t-120",
                                        "T+00000000",
                                        "t00081122334455667",
                                        "t0008112233445566778G",
                                        "t001811223344556677889"};
    struct kl_can_frame frame;
    struct kl_can_frame pattern;
    memset(&frame, 0xA5, sizeof frame);
    memset(&pattern, 0xA5, sizeof pattern);
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        uint16_t time_ms = 7;
        uint32_t length = (uint32_t)strlen(lines[i]);
        assert_int_equal(decode(lines[i], length, &frame, NULL), KL_CAN_REFUSED);
        assert_int_equal(decode(lines[i], length, &frame, &time_ms), KL_CAN_REFUSED);
        assert_memory_equal(&frame, &pattern, sizeof frame);
        assert_int_equal(time_ms, 7);
    }
    assert_int_equal(kl_slcan_decode(NULL, 5, &frame, NULL), KL_CAN_ARGUMENT);
    assert_int_equal(kl_slcan_decode("t1230", 5, NULL, NULL), KL_CAN_ARGUMENT);
}

static void frames_without_text_are_not_written(void **state) {
    (void)state;
    char text[KL_SLCAN_LINE_BYTES] = "untouched";
    const struct kl_can_frame bad[] = {{.id = 0x800},
                                       {.length = 9},
                                       {.flags = KL_CAN_FD, .length = 8},
                                       {.id = 0x20000000, .flags = KL_CAN_EXTENDED}};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        assert_int_equal(kl_slcan_encode(&bad[i], KL_SLCAN_NO_TIME, text), 0);
        assert_string_equal(text, "untouched");
    }
    assert_int_equal(kl_slcan_encode(NULL, 0, text), 0);
    assert_int_equal(kl_slcan_encode(&examples[0].frame, 0, NULL), 0);
}

static struct kl_can_frame random_frame(void) {
    struct kl_can_frame frame = {.flags = (uint8_t)random_below(4),
                                 .length = (uint8_t)random_below(9)};
    frame.id = random_below((frame.flags & KL_CAN_EXTENDED) != 0 ? 1u << 24 : 0x800u);
    for (uint32_t i = 0; i < frame.length && (frame.flags & KL_CAN_REMOTE) == 0; i++) {
        frame.data[i] = (uint8_t)random_below(256);
    }
    return frame;
}

static void every_frame_comes_back(void **state) {
    (void)state;
    random_state = 20;
    for (int i = 0; i < 20000; i++) {
        struct kl_can_frame frame = random_frame();
        struct kl_can_frame back;
        char text[KL_SLCAN_LINE_BYTES];
        uint16_t time_ms = 0;
        uint32_t stamp = random_below(2) ? random_below(60000) : KL_SLCAN_NO_TIME;
        uint32_t size = kl_slcan_encode(&frame, stamp, text);
        assert_true(size > 0);
        assert_int_equal(decode(text, size - 1, &back, &time_ms), KL_CAN_OK);
        assert_same(&back, &frame);
        assert_int_equal(time_ms, stamp);
    }
}

/* What is accepted is a frame that is written the same again, but for the case of its digits. */
static void nonsense_is_refused_or_means_what_it_says(void **state) {
    (void)state;
    static const char alphabet[] = "tTrR0123456789ABCDEFabcdef0000\r\a zG";
    int accepted = 0;
    random_state = 21;
    for (int i = 0; i < 200000; i++) {
        char line[40];
        char text[KL_SLCAN_LINE_BYTES];
        struct kl_can_frame frame;
        uint16_t time_ms = 0;
        uint32_t length = random_below(sizeof line);
        for (uint32_t at = 0; at < length; at++) {
            line[at] = alphabet[random_below(at == 0 ? 4 : sizeof alphabet - 1)];
        }
        if (decode(line, length, &frame, &time_ms) != KL_CAN_OK) {
            continue;
        }
        accepted++;
        assert_int_equal(kl_can_check(&frame), KL_CAN_OK);
        assert_int_equal(kl_slcan_encode(&frame, time_ms, text), length + 1);
        for (uint32_t at = 1; at < length; at++) {
            assert_int_equal(line[at] >= 'a' ? line[at] - 32 : line[at], text[at]);
        }
    }
    assert_true(accepted > 100);
}

/* ---- the stream ---- */

static enum kl_slcan_event feed(struct kl_slcan_reader *reader, const char *bytes, size_t size) {
    enum kl_slcan_event event = KL_SLCAN_NOTHING;
    for (size_t i = 0; i < size; i++) {
        event = kl_slcan_read(reader, (unsigned char)bytes[i]);
    }
    return event;
}

static void assert_reads_a_line(struct kl_slcan_reader *reader) {
    assert_int_equal(feed(reader, "t10021133\r", 10), KL_SLCAN_LINE);
    assert_int_equal(reader->length, 9);
    assert_memory_equal(reader->line, "t10021133", 9);
}

static void a_stream_is_cut_at_cr(void **state) {
    (void)state;
    struct kl_slcan_reader reader;
    kl_slcan_reader_init(&reader, false);
    assert_reads_a_line(&reader);
    assert_int_equal(feed(&reader, "\r", 1), KL_SLCAN_LINE);
    assert_int_equal(reader.length, 0);
    assert_int_equal(feed(&reader, "\nO\r", 3), KL_SLCAN_LINE); /* CR LF of a terminal */
    assert_int_equal(reader.length, 1);
    assert_reads_a_line(&reader);
}

static void damage_spoils_one_line_only(void **state) {
    (void)state;
    static const char *const damaged[] = {"t1230\x80\r",
                                          "\x01\r",
                                          "t1\a230\r",
                                          "\x7Ft1230\r",
                                          "T1FFFFFFF80011223344556677EA5F9\r",
                                          "tttttttttttttttttttttttttttttttttttttttttttttttttt\r"};
    struct kl_slcan_reader reader;
    kl_slcan_reader_init(&reader, false);
    for (size_t i = 0; i < sizeof damaged / sizeof damaged[0]; i++) {
        assert_int_equal(feed(&reader, damaged[i], strlen(damaged[i])), KL_SLCAN_SPOILT);
        assert_reads_a_line(&reader);
    }
    assert_int_equal(feed(&reader,
                          "t12\0"
                          "30\r",
                          7),
                     KL_SLCAN_SPOILT); /* a gap */
    assert_reads_a_line(&reader);
}

static void bell_is_an_answer_at_the_other_end(void **state) {
    (void)state;
    struct kl_slcan_reader reader;
    kl_slcan_reader_init(&reader, true);
    assert_int_equal(feed(&reader, "\a", 1), KL_SLCAN_BELLED);
    assert_int_equal(feed(&reader, "t12\a", 4), KL_SLCAN_BELLED);
    assert_reads_a_line(&reader);
}

static void any_stream_is_survived(void **state) {
    (void)state;
    struct {
        unsigned char before[16];
        struct kl_slcan_reader reader;
        unsigned char after[16];
    } guarded;
    memset(&guarded, 0x5A, sizeof guarded);
    kl_slcan_reader_init(&guarded.reader, false);
    random_state = 22;
    for (int i = 0; i < 200000; i++) {
        unsigned char byte = (unsigned char)random_below(256);
        if (random_below(4) == 0) {
            byte = (unsigned char)"tT0\r"[random_below(4)];
        }
        (void)kl_slcan_read(&guarded.reader, byte);
        assert_true(guarded.reader.length <= sizeof guarded.reader.line);
        if (i % 1000 == 0) {
            (void)feed(&guarded.reader, "\r", 1);
            assert_reads_a_line(&guarded.reader);
        }
    }
    for (size_t i = 0; i < 16; i++) {
        assert_int_equal(guarded.before[i], 0x5A);
        assert_int_equal(guarded.after[i], 0x5A);
    }
}

/* ---- the ring ---- */

static void a_ring_keeps_order_over_its_end(void **state) {
    (void)state;
    unsigned char bytes[16];
    struct kl_ring ring;
    assert_false(kl_ring_init(&ring, bytes, 15));
    assert_false(kl_ring_init(&ring, bytes, 0));
    assert_false(kl_ring_init(&ring, NULL, 16));
    assert_true(kl_ring_init(&ring, bytes, 16));
    ring.head = ring.tail = 0xFFFFFFF8u; /* the counts run over as well */
    unsigned char put = 0;
    unsigned char got = 0;
    random_state = 23;
    for (int i = 0; i < 5000; i++) {
        unsigned char byte = 0;
        if (random_below(2) && kl_ring_room(&ring) > 0) {
            assert_true(kl_ring_put(&ring, put++));
        } else if (kl_ring_get(&ring, &byte)) {
            assert_int_equal(byte, got++);
        }
        assert_int_equal(kl_ring_count(&ring), (unsigned char)(put - got));
        assert_int_equal(kl_ring_count(&ring) + kl_ring_room(&ring), 16);
    }
    assert_int_equal(ring.lost, 0);
}

static void a_full_ring_marks_the_gap(void **state) {
    (void)state;
    unsigned char bytes[4];
    unsigned char got[8];
    struct kl_ring ring;
    assert_true(kl_ring_init(&ring, bytes, sizeof bytes));
    for (int i = 0; i < 7; i++) {
        assert_int_equal(kl_ring_put(&ring, (unsigned char)('a' + i)), i < 4);
    }
    assert_int_equal(ring.lost, 3);
    assert_int_equal(kl_ring_read(&ring, got, 1), 1);
    assert_false(kl_ring_put(&ring, 'h')); /* the mark and the byte need two places */
    assert_int_equal(kl_ring_read(&ring, got + 1, 1), 1);
    assert_true(kl_ring_put(&ring, 'i'));
    assert_int_equal(kl_ring_read(&ring, got + 2, 8), 4);
    assert_memory_equal(got, "abcd\0i", 6);
    assert_int_equal(ring.lost, 4);
}

static void a_ring_takes_all_or_nothing(void **state) {
    (void)state;
    unsigned char bytes[8];
    unsigned char got[8];
    struct kl_ring ring;
    assert_true(kl_ring_init(&ring, bytes, sizeof bytes));
    assert_true(kl_ring_write(&ring, "12345", 5));
    assert_false(kl_ring_write(&ring, "6789", 4));
    assert_int_equal(kl_ring_count(&ring), 5);
    assert_true(kl_ring_write(&ring, "678", 3));
    assert_int_equal(kl_ring_read(&ring, got, 8), 8);
    assert_memory_equal(got, "12345678", 8);
    assert_true(kl_ring_write(&ring, "x", 1));
    kl_ring_clear(&ring);
    assert_false(kl_ring_get(&ring, got));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(frames_are_written_as_the_manual_shows),
        cmocka_unit_test(frames_are_read_in_either_case),
        cmocka_unit_test(time_stamps_come_and_go),
        cmocka_unit_test(what_is_no_frame_is_refused),
        cmocka_unit_test(frames_without_text_are_not_written),
        cmocka_unit_test(every_frame_comes_back),
        cmocka_unit_test(nonsense_is_refused_or_means_what_it_says),
        cmocka_unit_test(a_stream_is_cut_at_cr),
        cmocka_unit_test(damage_spoils_one_line_only),
        cmocka_unit_test(bell_is_an_answer_at_the_other_end),
        cmocka_unit_test(any_stream_is_survived),
        cmocka_unit_test(a_ring_keeps_order_over_its_end),
        cmocka_unit_test(a_full_ring_marks_the_gap),
        cmocka_unit_test(a_ring_takes_all_or_nothing),
    };
    return cmocka_run_group_tests(tests, map_pages, NULL);
}
