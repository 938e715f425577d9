/*
 * kl_socketcand_text.h - frames as lines of the socketcand protocol. Pure functions, for the server
 * and its tests. Layout of the lines: kl_socketcand.h.
 */
#ifndef KL_SOCKETCAND_TEXT_H
#define KL_SOCKETCAND_TEXT_H

#include "kl_can.h"

#define KL_SOCKETCAND_FRAME_BYTES 72u /* room for the longest frame line with a closing 0 */

/*
 * Writes "\n< frame ... >" for a good classic data frame at a time of the day (ns since 1970, not
 * negative) and returns its length, 33..54; 0 for a frame that the protocol does not have.
 */
size_t kl_socketcand_format(const struct kl_can_frame *frame, int64_t time_ns,
                            char line[KL_SOCKETCAND_FRAME_BYTES]);

/* True if the first word between < and > is `word`. */
bool kl_socketcand_is(const char *line, size_t length, const char *word);

/* The word with the given number, 0 the first, of a line: its start, and its length in
 * `word_length`. NULL if there are fewer. */
const char *kl_socketcand_word(const char *line, size_t length, unsigned number,
                               size_t *word_length);

/*
 * Reads what stands between < and > of a send line. `line` needs no closing 0 and may hold any
 * byte. KL_CAN_OK, or KL_CAN_REFUSED with `frame` untouched. Bound: length.
 */
enum kl_can_status kl_socketcand_parse(const char *line, size_t length, struct kl_can_frame *frame);

#endif
