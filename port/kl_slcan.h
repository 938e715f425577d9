/*
 * kl_slcan.h - CAN frames as text: the LAWICEL protocol ("slcan") that USB adapters speak.
 *
 * A line ends with CR; the other end answers each command with CR (done), BEL (refused), or its
 * answer and CR. Frames stand as
 *     t iii l dd..      standard data frame: 3 hex digits, length 0..8, two digits per byte
 *     T iiiiiiii l dd.. extended data frame: 8 hex digits
 *     r iii l, R iiiiiiii l   remote requests
 * with four more hex digits, milliseconds 0..59999, where time stamps are on. Upper-case digits go
 * out; both cases come in. FD frames do not exist here. There is no check sum: what must not be
 * damaged carries its own (kl_protect.h).
 *
 * Here are the codec of one line and the reader that cuts a stream of bytes into lines;
 * kl_slcan_link.h makes a CAN back end of them. All functions are pure but for their arguments.
 * Source: LAWICEL CAN232 manual V3 and CANUSB manual 1.0.
 */
#ifndef KL_SLCAN_H
#define KL_SLCAN_H

#include "kl_can.h"

#ifdef __cplusplus
extern "C" {
#endif

#define KL_SLCAN_LINE_BYTES 31u  /* the longest line: T, 8, 1, 16 and 4 digits, CR */
#define KL_SLCAN_NO_TIME 0xFFFFu /* no time stamp */
#define KL_SLCAN_MAX_TIME_MS 59999u
#define KL_SLCAN_CR '\r'
#define KL_SLCAN_BELL '\a'

/*
 * Writes a frame as one line with its CR, not zero-terminated, and returns its length. `time_ms`:
 * 0..59999, or KL_SLCAN_NO_TIME. 0: NULL, or a frame that is malformed or FD; `text` is then
 * untouched. Bound: constant.
 */
uint32_t kl_slcan_encode(const struct kl_can_frame *frame, uint32_t time_ms,
                         char text[KL_SLCAN_LINE_BYTES]);

/*
 * Reads one line, without its CR. `time_ms` NULL: a time stamp is refused; else it becomes the
 * stamp, or KL_SLCAN_NO_TIME where there is none. KL_CAN_REFUSED: not exactly one frame;
 * KL_CAN_ARGUMENT: NULL. `frame` is untouched unless KL_CAN_OK. Bound: `length` is compared before
 * a byte is read, then constant.
 */
enum kl_can_status kl_slcan_decode(const char *line, uint32_t length, struct kl_can_frame *frame,
                                   uint16_t *time_ms);

/* Reads exactly `digits` (1..8) hex digits. False: one is none; `value` is then untouched. */
bool kl_slcan_hex(const char *text, uint32_t digits, uint32_t *value);

/* What a byte made of a stream. */
enum kl_slcan_event {
    KL_SLCAN_NOTHING = 0, /* in a line, or between two */
    KL_SLCAN_LINE,        /* a line is complete: reader->line, reader->length */
    KL_SLCAN_BELLED,      /* BEL, where it ends lines; what stood before it is gone */
    KL_SLCAN_SPOILT       /* CR of a line that was too long or held a byte that is no text */
};

struct kl_slcan_reader {
    uint32_t length; /* bytes in line, 0..KL_SLCAN_LINE_BYTES - 1 */
    bool bell_ends;  /* BEL is an answer, not damage */
    bool spoilt;     /* drop everything up to the end of the line */
    bool ended;      /* the line is complete: the next byte begins another */
    char line[KL_SLCAN_LINE_BYTES - 1];
};

/* `bell_ends`: true at the end that gives commands, where BEL is an answer; false at the adapter's
 * end, where it is damage as any other control character. */
void kl_slcan_reader_init(struct kl_slcan_reader *reader, bool bell_ends);

/*
 * Takes one byte. Text is 0x20..0x7E; LF is skipped. Whatever came before, the reader is in order
 * again after the next CR. A complete line stays readable until the next byte. Bound: constant.
 */
enum kl_slcan_event kl_slcan_read(struct kl_slcan_reader *reader, unsigned char byte);

#ifdef __cplusplus
}
#endif
#endif
