/*
 * kl_ring.h - bytes between an interrupt and the rest of the program.
 *
 * One side puts, the other gets; each may be an interrupt handler, a DMA callback, a thread or a
 * loop that polls. Neither waits nor locks: `head` belongs to the side that puts, `tail` to the one
 * that gets, both count bytes modulo 2^32. The memory is the caller's.
 *
 * A byte that finds no room is lost and counted, and the GAP IS MARKED: before the next byte that
 * fits, KL_RING_GAP is put in its place, so that what stood before and after the gap is never read
 * as one line. A driver marks a framing or overrun error of its own by putting KL_RING_GAP itself.
 *
 * Every call is bounded by its argument, most by a constant.
 */
#ifndef KL_RING_H
#define KL_RING_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define KL_RING_GAP 0x00u /* no text holds it */

/* Fields are for the functions below; `lost` may be read at any time. */
struct kl_ring {
    unsigned char *bytes;
    uint32_t size;          /* a power of two */
    volatile uint32_t head; /* bytes put */
    volatile uint32_t tail; /* bytes got */
    volatile uint32_t lost; /* bytes that found no room, modulo 2^32 */
    bool gap;               /* the last byte was lost: a mark is due */
};

/* An empty ring over `bytes`. False: NULL, or `size` is no power of two from 2 to 2^31. */
bool kl_ring_init(struct kl_ring *ring, unsigned char *bytes, uint32_t size);

/* Bytes waiting, and room for more. */
uint32_t kl_ring_count(const struct kl_ring *ring);
uint32_t kl_ring_room(const struct kl_ring *ring);

/* The side that puts. False: lost and counted. */
bool kl_ring_put(struct kl_ring *ring, unsigned char byte);

/* The side that puts: all bytes, or none and false; nothing is counted and no gap marked. Bound:
 * `size`. */
bool kl_ring_write(struct kl_ring *ring, const char *bytes, uint32_t size);

/* The side that gets. False: nothing waits, `byte` is untouched. */
bool kl_ring_get(struct kl_ring *ring, unsigned char *byte);

/* The side that gets: up to `size` bytes; returns how many. Bound: `size`. */
uint32_t kl_ring_read(struct kl_ring *ring, unsigned char *bytes, uint32_t size);

/* The side that gets: drops what waits. */
void kl_ring_clear(struct kl_ring *ring);

#ifdef __cplusplus
}
#endif
#endif
