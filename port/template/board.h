/*
 * board.h - everything that the firmware (main.c) asks of a board.
 *
 * A port is one file that fulfils this page, the start-up code and the linker script of its
 * processor: board.c in this folder is an empty one to be copied; ../mps2 is a real one. Besides
 * this page a port supplies memcpy, memmove, memset and memcmp where its tool chain does not
 * (docs/porting.md).
 *
 * What runs where:
 *     interrupt of the wire   kl_ring_put for every byte in, kl_ring_get for every byte out
 *     interrupt of the timer  counts the tick, nothing else
 *     main loop               waits for the tick, then one cycle of the node: commands, step, states
 * so that nothing on the wire can hold up a tick, and the step is never cut in two by another step.
 * Priorities, highest first: bytes in (one must be fetched before the next one comes), timer, bytes
 * out.
 */
#ifndef KL_BOARD_H
#define KL_BOARD_H

#include <stdint.h>

#include "kl_ring.h"

/* The wire, a UART or USB, as two rings: the driver puts into rx and gets from tx. */
struct board_wire {
    struct kl_ring rx;
    struct kl_ring tx;
};

/*
 * Called once, with interrupts off or not yet enabled: starts the clock, the timer with a tick every
 * `tick_ns`, and the wire; enables interrupts. `wire` stays valid for good. False: the board cannot
 * make that tick exactly.
 */
bool board_start(struct board_wire *wire, int64_t tick_ns);

/*
 * Sleeps until the timer ticks. Returns the ticks since the last call (since board_start the first
 * time), 1 or more: above 1, the rest was missed. Does not sleep if there is one already.
 */
uint32_t board_wait_for_tick(void);

/* Nanoseconds since the tick that board_wait_for_tick returned for; saturates at 2^32 - 1. */
uint32_t board_since_tick_ns(void);

/* There are new bytes in wire->tx: start sending if nothing is being sent. `context` is unused.
 * Called from the main loop, often; must not wait. */
void board_kick(void *context);

/* The firmware cannot start (`code` is an enum kl_status, or -100 for the board itself): a place
 * for a lamp. Must not return. */
_Noreturn void board_give_up(int code);

#endif
