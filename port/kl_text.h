/*
 * kl_text.h - text out of portable code: numbers without stdio, through the caller's sink.
 */
#ifndef KL_TEXT_H
#define KL_TEXT_H

#include "kl_base.h"
#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Takes `size` bytes (not zero-terminated). 0: taken; anything else ends the writing. */
struct kl_text_sink {
    int (*write)(void *context, const char *text, size_t size);
    void *context;
};

/* A writer: remembers the first failure and is silent after it. */
struct kl_text {
    const struct kl_text_sink *sink;
    bool failed;
};

void kl_text_put(struct kl_text *text, const char *zero_terminated);
void kl_text_bytes(struct kl_text *text, const char *bytes, size_t size);
void kl_text_int(struct kl_text *text, int64_t value);
void kl_text_hex(struct kl_text *text, uint64_t value, uint32_t least_digits);
/* value / 10^digits, exact, without trailing zeros: kl_text_decimal(t, 1250, 3) writes 1.25.
 * digits 0..18. */
void kl_text_decimal(struct kl_text *text, int64_t value, uint32_t digits);

/* KL_OK, or KL_ERR_MEMORY if the sink refused something. */
enum kl_status kl_text_end(const struct kl_text *text);

#ifdef __cplusplus
}
#endif
#endif
