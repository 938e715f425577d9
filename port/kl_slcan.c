/* Frames as LAWICEL text; see kl_slcan.h. */
#include "kl_slcan.h"

#define STANDARD_DIGITS 3u
#define EXTENDED_DIGITS 8u
#define TIME_DIGITS 4u
#define NO_DIGIT 16u

/* ---- digits ---- */

static char digit_name(uint32_t value) {
    static const char names[] = "0123456789ABCDEF";
    return names[value & 15u];
}

static uint32_t put_hex(char *text, uint32_t at, uint32_t value, uint32_t digits) {
    for (uint32_t i = 0; i < digits; i++) {
        text[at + i] = digit_name(value >> (4u * (digits - 1u - i)));
    }
    return at + digits;
}

static uint32_t digit_value(char c) {
    if (c >= '0' && c <= '9') {
        return (uint32_t)(c - '0');
    }
    if (c >= 'A' && c <= 'F') {
        return (uint32_t)(c - 'A') + 10u;
    }
    return c >= 'a' && c <= 'f' ? (uint32_t)(c - 'a') + 10u : NO_DIGIT;
}

bool kl_slcan_hex(const char *text, uint32_t digits, uint32_t *value) {
    uint32_t sum = 0;
    for (uint32_t i = 0; i < digits; i++) {
        uint32_t digit = digit_value(text[i]);
        if (digit == NO_DIGIT) {
            return false;
        }
        sum = sum << 4 | digit;
    }
    *value = sum;
    return true;
}

/* ---- a frame ---- */

uint32_t kl_slcan_encode(const struct kl_can_frame *frame, uint32_t time_ms,
                         char text[KL_SLCAN_LINE_BYTES]) {
    if (text == NULL || kl_can_check(frame) != KL_CAN_OK || (frame->flags & KL_CAN_FD) != 0) {
        return 0;
    }
    bool extended = (frame->flags & KL_CAN_EXTENDED) != 0;
    bool remote = (frame->flags & KL_CAN_REMOTE) != 0;
    char standard_letter = remote ? 'r' : 't';
    char extended_letter = remote ? 'R' : 'T';
    text[0] = extended ? extended_letter : standard_letter;
    uint32_t at = put_hex(text, 1, frame->id, extended ? EXTENDED_DIGITS : STANDARD_DIGITS);
    text[at++] = digit_name(frame->length);
    for (uint32_t i = 0; i < frame->length && !remote; i++) {
        at = put_hex(text, at, frame->data[i], 2);
    }
    if (time_ms <= KL_SLCAN_MAX_TIME_MS) {
        at = put_hex(text, at, time_ms, TIME_DIGITS);
    }
    text[at] = KL_SLCAN_CR;
    return at + 1;
}

/* Data and time stamp after the length digit at `at`. */
static bool take_rest(const char *line, uint32_t at, struct kl_can_frame *frame,
                      uint32_t *time_ms) {
    bool remote = (frame->flags & KL_CAN_REMOTE) != 0;
    uint32_t bytes = remote ? 0 : frame->length;
    for (uint32_t i = 0; i < bytes; i++, at += 2) {
        uint32_t byte = 0;
        if (!kl_slcan_hex(line + at, 2, &byte)) {
            return false;
        }
        frame->data[i] = (uint8_t)byte;
    }
    return *time_ms == KL_SLCAN_NO_TIME ||
           (kl_slcan_hex(line + at, TIME_DIGITS, time_ms) && *time_ms <= KL_SLCAN_MAX_TIME_MS);
}

static bool is_frame_letter(char letter) {
    return letter == 't' || letter == 'T' || letter == 'r' || letter == 'R';
}

enum kl_can_status kl_slcan_decode(const char *line, uint32_t length, struct kl_can_frame *frame,
                                   uint16_t *time_ms) {
    struct kl_can_frame read = {0};
    uint32_t bytes = 0;
    if (line == NULL || frame == NULL) {
        return KL_CAN_ARGUMENT;
    }
    if (length < 2 + STANDARD_DIGITS || !is_frame_letter(line[0])) {
        return KL_CAN_REFUSED;
    }
    bool extended = line[0] == 'T' || line[0] == 'R';
    bool remote = line[0] == 'r' || line[0] == 'R';
    uint32_t digits = extended ? EXTENDED_DIGITS : STANDARD_DIGITS;
    uint32_t head = digits + 2; /* letter, identifier, length */
    if (length < head || !kl_slcan_hex(line + 1, digits, &read.id) ||
        !kl_slcan_hex(line + 1 + digits, 1, &bytes) || bytes > KL_CAN_CLASSIC_BYTES) {
        return KL_CAN_REFUSED;
    }
    read.flags = (uint8_t)((extended ? KL_CAN_EXTENDED : 0) | (remote ? KL_CAN_REMOTE : 0));
    read.length = (uint8_t)bytes;
    uint32_t plain = head + (remote ? 0 : 2 * bytes);
    bool stamped = time_ms != NULL && length == plain + TIME_DIGITS;
    uint32_t stamp = stamped ? 0 : KL_SLCAN_NO_TIME;
    if ((length != plain && !stamped) || !take_rest(line, head, &read, &stamp) ||
        kl_can_check(&read) != KL_CAN_OK) {
        return KL_CAN_REFUSED;
    }
    if (time_ms != NULL) {
        *time_ms = (uint16_t)stamp;
    }
    *frame = read;
    return KL_CAN_OK;
}

/* ---- a stream ---- */

void kl_slcan_reader_init(struct kl_slcan_reader *reader, bool bell_ends) {
    *reader = (struct kl_slcan_reader){.bell_ends = bell_ends};
}

static enum kl_slcan_event end_line(struct kl_slcan_reader *reader) {
    enum kl_slcan_event event = reader->spoilt ? KL_SLCAN_SPOILT : KL_SLCAN_LINE;
    if (reader->spoilt) {
        reader->length = 0;
    }
    reader->spoilt = false;
    reader->ended = true;
    return event;
}

enum kl_slcan_event kl_slcan_read(struct kl_slcan_reader *reader, unsigned char byte) {
    if (reader->ended) {
        reader->length = 0;
        reader->ended = false;
    }
    if (byte == (unsigned char)KL_SLCAN_CR) {
        return end_line(reader);
    }
    if (byte == (unsigned char)KL_SLCAN_BELL && reader->bell_ends) {
        reader->length = 0;
        reader->spoilt = false;
        return KL_SLCAN_BELLED;
    }
    if (byte == '\n') {
        return KL_SLCAN_NOTHING;
    }
    if (byte < 0x20 || byte > 0x7E || reader->length >= sizeof reader->line) {
        reader->spoilt = true;
    } else {
        reader->line[reader->length++] = (char)byte;
    }
    return KL_SLCAN_NOTHING;
}
