/* One side puts, one side gets; see kl_ring.h. */
#include "kl_ring.h"

#include <stdatomic.h>
#include <stddef.h>

bool kl_ring_init(struct kl_ring *ring, unsigned char *bytes, uint32_t size) {
    if (ring == NULL || bytes == NULL || size < 2 || (size & (size - 1)) != 0) {
        return false;
    }
    *ring = (struct kl_ring){.bytes = bytes, .size = size};
    return true;
}

uint32_t kl_ring_count(const struct kl_ring *ring) {
    return ring->head - ring->tail;
}

uint32_t kl_ring_room(const struct kl_ring *ring) {
    return ring->size - kl_ring_count(ring);
}

/* The other side may look as soon as head moves: the bytes must be there before. */
static void publish(struct kl_ring *ring, uint32_t head) {
    atomic_thread_fence(memory_order_release);
    ring->head = head;
}

static void place(struct kl_ring *ring, uint32_t at, unsigned char byte) {
    ring->bytes[at & (ring->size - 1)] = byte;
}

bool kl_ring_put(struct kl_ring *ring, unsigned char byte) {
    uint32_t head = ring->head;
    uint32_t needed = ring->gap ? 2 : 1;
    if (kl_ring_room(ring) < needed) {
        ring->lost = ring->lost + 1;
        ring->gap = true;
        return false;
    }
    if (ring->gap) {
        place(ring, head++, KL_RING_GAP);
        ring->gap = false;
    }
    place(ring, head++, byte);
    publish(ring, head);
    return true;
}

bool kl_ring_write(struct kl_ring *ring, const char *bytes, uint32_t size) {
    uint32_t head = ring->head;
    if (kl_ring_room(ring) < size) {
        return false;
    }
    for (uint32_t i = 0; i < size; i++) {
        place(ring, head + i, (unsigned char)bytes[i]);
    }
    publish(ring, head + size);
    return true;
}

uint32_t kl_ring_read(struct kl_ring *ring, unsigned char *bytes, uint32_t size) {
    uint32_t waiting = kl_ring_count(ring);
    uint32_t tail = ring->tail;
    uint32_t n = size < waiting ? size : waiting;
    atomic_thread_fence(memory_order_acquire);
    for (uint32_t i = 0; i < n; i++) {
        bytes[i] = ring->bytes[(tail + i) & (ring->size - 1)];
    }
    atomic_thread_fence(memory_order_release); /* read before the place is given back */
    ring->tail = tail + n;
    return n;
}

bool kl_ring_get(struct kl_ring *ring, unsigned char *byte) {
    return kl_ring_read(ring, byte, 1) == 1;
}

void kl_ring_clear(struct kl_ring *ring) {
    ring->tail = ring->head;
}
