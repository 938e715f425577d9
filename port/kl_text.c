/* Numbers and strings into a sink; see kl_text.h. */
#include "kl_text.h"

#define MOST_DIGITS 24u

void kl_text_bytes(struct kl_text *text, const char *bytes, size_t size) {
    if (text->failed || size == 0) {
        return;
    }
    text->failed = text->sink->write(text->sink->context, bytes, size) != 0;
}

void kl_text_put(struct kl_text *text, const char *zero_terminated) {
    size_t size = 0;
    while (zero_terminated[size] != '\0') {
        size++;
    }
    kl_text_bytes(text, zero_terminated, size);
}

/* Digits of `value` in `base`, right-aligned in `buffer`, at least `least` of them. Returns where
 * they start. */
static uint32_t digits_of(uint64_t value, uint32_t base, uint32_t least, char buffer[MOST_DIGITS]) {
    static const char names[] = "0123456789abcdef";
    uint32_t at = MOST_DIGITS;
    while (at > 0 && (value != 0 || MOST_DIGITS - at < least)) {
        buffer[--at] = names[value % base];
        value /= base;
    }
    return at;
}

static uint64_t magnitude(int64_t value) {
    return value < 0 ? 0u - (uint64_t)value : (uint64_t)value;
}

void kl_text_int(struct kl_text *text, int64_t value) {
    kl_text_decimal(text, value, 0);
}

void kl_text_hex(struct kl_text *text, uint64_t value, uint32_t least_digits) {
    char buffer[MOST_DIGITS];
    uint32_t least = least_digits < 1 ? 1 : least_digits > 16 ? 16 : least_digits;
    uint32_t at = digits_of(value, 16, least, buffer);
    kl_text_bytes(text, buffer + at, MOST_DIGITS - at);
}

void kl_text_decimal(struct kl_text *text, int64_t value, uint32_t digits) {
    char buffer[MOST_DIGITS];
    uint32_t places = digits > 18 ? 18 : digits;
    uint32_t at = digits_of(magnitude(value), 10, places + 1, buffer);
    uint32_t end = MOST_DIGITS;
    uint32_t point = MOST_DIGITS - places;
    while (end > point && buffer[end - 1] == '0') {
        end--;
    }
    if (value < 0) {
        kl_text_put(text, "-");
    }
    kl_text_bytes(text, buffer + at, point - at);
    if (end > point) {
        kl_text_put(text, ".");
        kl_text_bytes(text, buffer + point, end - point);
    }
}

enum kl_status kl_text_end(const struct kl_text *text) {
    return text->failed ? KL_ERR_MEMORY : KL_OK;
}
