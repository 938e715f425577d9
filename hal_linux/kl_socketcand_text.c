#include "kl_socketcand_text.h"

#include <stdio.h>
#include <string.h>

#define EXTENDED_BIT 0x80000000u
#define NANOSECONDS 1000000000

size_t kl_socketcand_format(const struct kl_can_frame *frame, int64_t time_ns,
                            char line[KL_SOCKETCAND_FRAME_BYTES]) {
    static const char digits[] = "0123456789ABCDEF";
    if (kl_can_check(frame) != KL_CAN_OK || (frame->flags & ~KL_CAN_EXTENDED) != 0)
        return 0;
    int width = (frame->flags & KL_CAN_EXTENDED) != 0 ? 8 : 3;
    int start = snprintf(line, KL_SOCKETCAND_FRAME_BYTES, "\n< frame %0*X %lld.%06lld ", width,
                         (unsigned)frame->id, (long long)(time_ns / NANOSECONDS),
                         (long long)(time_ns % NANOSECONDS / 1000));
    if (start < 0)
        return 0;
    size_t at = (size_t)start;
    for (size_t i = 0; i < frame->length; i++) {
        line[at++] = digits[frame->data[i] >> 4];
        line[at++] = digits[frame->data[i] & 15u];
    }
    memcpy(line + at, " >", 3);
    return at + 2;
}

const char *kl_socketcand_word(const char *line, size_t length, unsigned number,
                               size_t *word_length) {
    size_t at = 0;
    for (unsigned word = 0;; word++) {
        while (at < length && line[at] == ' ')
            at++;
        if (at == length)
            return NULL;
        size_t start = at;
        while (at < length && line[at] != ' ')
            at++;
        if (word == number) {
            *word_length = at - start;
            return line + start;
        }
    }
}

bool kl_socketcand_is(const char *line, size_t length, const char *word) {
    size_t found_length = 0;
    const char *found = kl_socketcand_word(line, length, 0, &found_length);
    return found != NULL && found_length == strlen(word) && memcmp(found, word, found_length) == 0;
}

static int hex_digit(char c) {
    if (c >= '0' && c <= '9')
        return c - '0';
    if (c >= 'a' && c <= 'f')
        return c - 'a' + 10;
    if (c >= 'A' && c <= 'F')
        return c - 'A' + 10;
    return -1;
}

/* The word at *rest as a hexadecimal number of at most `most` digits; *rest moves behind it.
 * Returns the number of digits, 0 if the word is not of that kind. */
static unsigned take_hex(const char **rest, const char *end, unsigned most, uint32_t *value) {
    const char *at = *rest;
    while (at < end && *at == ' ')
        at++;
    unsigned digits = 0;
    uint32_t number = 0;
    for (; at < end && *at != ' '; at++, digits++) {
        int digit = hex_digit(*at);
        if (digit < 0 || digits == most)
            return 0;
        number = number << 4 | (uint32_t)digit;
    }
    *rest = at;
    *value = number;
    return digits;
}

enum kl_can_status kl_socketcand_parse(const char *line, size_t length,
                                       struct kl_can_frame *frame) {
    size_t word_length = 0;
    const char *word = kl_socketcand_word(line, length, 0, &word_length);
    if (!kl_socketcand_is(line, length, "send"))
        return KL_CAN_REFUSED;
    const char *rest = word + word_length;
    const char *end = line + length;

    struct kl_can_frame read = {0};
    uint32_t bytes = 0;
    unsigned id_digits = take_hex(&rest, end, 8, &read.id);
    if (id_digits == 0 || take_hex(&rest, end, 1, &bytes) == 0 || bytes > KL_CAN_CLASSIC_BYTES)
        return KL_CAN_REFUSED;
    if ((read.id & EXTENDED_BIT) != 0 || id_digits == 8 || read.id > KL_CAN_MAX_STANDARD_ID)
        read.flags = KL_CAN_EXTENDED;
    read.id &= ~EXTENDED_BIT;
    read.length = (uint8_t)bytes;
    for (uint32_t i = 0; i < bytes; i++) {
        uint32_t value = 0;
        if (take_hex(&rest, end, 2, &value) == 0)
            return KL_CAN_REFUSED;
        read.data[i] = (uint8_t)value;
    }
    while (rest < end && *rest == ' ')
        rest++;
    if (rest != end || kl_can_check(&read) != KL_CAN_OK)
        return KL_CAN_REFUSED;
    *frame = read;
    return KL_CAN_OK;
}
