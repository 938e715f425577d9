/*
 * board.c - an empty port, to be copied. It compiles and does nothing; every TO FILL IN says what
 * belongs there. ../mps2/board.c is the same file for a real board, and half of it is registers.
 */
#include "board.h"

#include <stddef.h>

static struct board_wire *the_wire;
static volatile uint32_t ticks;
static uint32_t ticks_seen;

/* The handler of the timer's interrupt. Its name is that of your vector table. */
void board_timer_handler(void);
void board_timer_handler(void) {
    /* TO FILL IN: clear the interrupt at the timer, if it needs that. */
    ticks = ticks + 1;
}

/* The handler of a byte that came. */
void board_receive_handler(void);
void board_receive_handler(void) {
    unsigned char byte = 0;
    /* TO FILL IN: read the byte; where the UART reports a framing, noise or overrun error with it,
     * put KL_RING_GAP instead: the line it stood in is then refused as a whole. */
    if (the_wire != NULL) {
        (void)kl_ring_put(&the_wire->rx, byte);
    }
}

/* The handler of "the transmitter has room"; also called by board_kick. */
void board_transmit_handler(void);
void board_transmit_handler(void) {
    unsigned char byte = 0;
    /* TO FILL IN: only if the transmitter has room ... */
    if (the_wire != NULL && kl_ring_get(&the_wire->tx, &byte)) {
        /* TO FILL IN: ... write the byte into it. */
    }
}

bool board_start(struct board_wire *wire, int64_t tick_ns) {
    the_wire = wire;
    /* TO FILL IN: clocks and pins; the UART with its interrupts; the timer, as the last one. */
    return tick_ns > 0;
}

uint32_t board_wait_for_tick(void) {
    /* TO FILL IN: sleep while there is no tick. The look and the sleep must not be parted by the
     * interrupt: on a Cortex-M look with interrupts masked, WFI wakes all the same. */
    uint32_t now = ticks;
    uint32_t since = now - ticks_seen;
    ticks_seen = now;
    return since > 0 ? since : 1;
}

uint32_t board_since_tick_ns(void) {
    /* TO FILL IN: the timer's counter, in nanoseconds, and whole ticks that came meanwhile. Only
     * told to the bus: 0 is allowed. */
    return 0;
}

void board_kick(void *context) {
    (void)context;
    /* TO FILL IN: keep the transmit interrupt out while this runs: one side may get at a time. */
    board_transmit_handler();
}

_Noreturn void board_give_up(int code) {
    (void)code;
    for (;;) {
    }
}
