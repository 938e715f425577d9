/*
 * kl_protect.h - protection of command frames against corruption, repetition and loss.
 *
 * After AUTOSAR end-to-end profile 11, variant A (both bytes of the data ID in the CRC): byte 0 of
 * the frame is the CRC, the low nibble of byte 1 an alive counter that runs 0..14 and starts again
 * at 0 (15 is never sent). The CRC is CRC-8 SAE J1850 (polynomial 0x1D) over the low and the high
 * byte of the message's data ID and then every byte of the frame but the CRC; the data ID itself is
 * not sent, so that a frame under a wrong identifier does not pass. As in the profile, register and
 * result are not inverted for this use; kl_crc8_j1850 alone is the plain CRC with check value 0x4B.
 *
 * One struct per sender, one per receiver; a message has one sender at a time.
 */
#ifndef KL_PROTECT_H
#define KL_PROTECT_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define KL_PROTECT_BYTES 2u        /* CRC, then counter in the low nibble */
#define KL_PROTECT_MODULUS 15u     /* counter values 0..14 */
#define KL_PROTECT_NO_COUNTER 255u /* nothing received yet */

enum kl_protect_result {
    KL_PROTECT_OK = 0,       /* the counter is one ahead of the last, or this is the first frame */
    KL_PROTECT_REPEATED = 1, /* right CRC, counter of the last frame: seen already */
    KL_PROTECT_GAP = 2,      /* right CRC, one frame or more missing between the last and this */
    KL_PROTECT_BAD_CRC = 3   /* corrupt, foreign, too short, or counter 15 */
};

/* Receiver's side. Zero the counts and set `last` to KL_PROTECT_NO_COUNTER: kl_protect_init. */
struct kl_protect {
    uint16_t data_id;
    uint8_t last; /* last counter with a right CRC */
    uint64_t ok;
    uint64_t repeated;
    uint64_t gaps; /* events, not frames missing */
    uint64_t bad_crc;
};

/* CRC-8 SAE J1850: polynomial 0x1D, start 0xFF, result inverted; 0x4B over "123456789". Bound: 8
 * shifts per byte. */
uint8_t kl_crc8_j1850(const uint8_t *data, size_t size_bytes);

void kl_protect_init(struct kl_protect *protect, uint16_t data_id);

/*
 * Writes counter and CRC into a frame's data (length >= KL_PROTECT_BYTES, otherwise nothing is
 * written) and advances *counter (0..14; a larger value counts as 0). The high nibble of byte 1 is
 * kept.
 */
void kl_protect_seal(uint16_t data_id, uint8_t *counter, uint8_t *data, size_t length);

/*
 * Judges one received frame and counts it. After KL_PROTECT_BAD_CRC the expected counter is
 * unchanged; after any other result it follows the frame. A frame shorter than KL_PROTECT_BYTES is
 * KL_PROTECT_BAD_CRC. Bound: as the CRC.
 */
enum kl_protect_result kl_protect_check(struct kl_protect *protect, const uint8_t *data,
                                        size_t length);

/* A short English text; never NULL. */
const char *kl_protect_text(enum kl_protect_result result);

#ifdef __cplusplus
}
#endif
#endif
