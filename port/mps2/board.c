/*
 * board.c - the MPS2 board: SysTick as the timer, APB UART 0 as the wire. Runs under
 * qemu-system-arm -machine mps2-an500 (and an386, an385).
 */
#include "board.h"

#include <stddef.h>

#include "mps2.h"

#define BAUD 921600u
#define NS_PER_S 1000000000
#define PRIORITY_RECEIVE 0x00u
#define PRIORITY_TIMER 0x40u
#define PRIORITY_TRANSMIT 0x80u

static struct board_wire *wire_in_use;
static volatile uint32_t ticks;
static uint32_t ticks_seen;
static uint32_t cycles_per_tick;

/* ---- timer ---- */

void mps2_systick(void) {
    ticks = ticks + 1;
}

static bool start_timer(int64_t tick_ns) {
    const int64_t cycles = tick_ns * (int64_t)(MPS2_CLOCK_HZ / 1000000u) / 1000;
    if (tick_ns <= 0 || cycles * NS_PER_S != tick_ns * (int64_t)MPS2_CLOCK_HZ || cycles < 2 ||
        cycles - 1 > (int64_t)MPS2_SYSTICK_MAX) {
        return false;
    }
    cycles_per_tick = (uint32_t)cycles;
    MPS2_SYSTICK_PRIORITY = PRIORITY_TIMER;
    MPS2_SYSTICK_LOAD = cycles_per_tick - 1;
    MPS2_SYSTICK_VALUE = 0;
    MPS2_SYSTICK_CTRL = MPS2_SYSTICK_RUN;
    return true;
}

/* With interrupts masked the look and the sleep cannot be parted; WFI wakes all the same. */
uint32_t board_wait_for_tick(void) {
    while (ticks == ticks_seen) {
        __asm__ volatile("cpsid i" ::: "memory");
        if (ticks == ticks_seen) {
            __asm__ volatile("dsb\n\twfi" ::: "memory");
        }
        __asm__ volatile("cpsie i\n\tisb" ::: "memory");
    }
    uint32_t now = ticks;
    uint32_t since = now - ticks_seen;
    ticks_seen = now;
    return since;
}

uint32_t board_since_tick_ns(void) {
    uint32_t whole = 0;
    uint32_t left = 0;
    do { /* a tick in between would make a reading of two halves */
        whole = ticks;
        left = MPS2_SYSTICK_VALUE;
    } while (whole != ticks);
    uint64_t cycles = (uint64_t)(whole - ticks_seen) * cycles_per_tick + (cycles_per_tick - left);
    uint64_t ns = cycles * (NS_PER_S / MPS2_CLOCK_HZ);
    return ns > UINT32_MAX ? UINT32_MAX : (uint32_t)ns;
}

/* ---- wire ---- */

void mps2_uart_receive(void) {
    MPS2_UART_INTERRUPT = MPS2_UART_INTERRUPT_RX;
    if ((MPS2_UART_STATE & MPS2_UART_RX_OVERRUN) != 0) {
        MPS2_UART_STATE = MPS2_UART_RX_OVERRUN;
        (void)kl_ring_put(&wire_in_use->rx, KL_RING_GAP);
    }
    if ((MPS2_UART_STATE & MPS2_UART_RX_FULL) != 0) {
        (void)kl_ring_put(&wire_in_use->rx, (unsigned char)MPS2_UART_DATA);
    }
}

/* One byte: the next interrupt comes when there is room again. */
static void transmit_one(void) {
    unsigned char byte = 0;
    if ((MPS2_UART_STATE & MPS2_UART_TX_FULL) == 0 && kl_ring_get(&wire_in_use->tx, &byte)) {
        MPS2_UART_DATA = byte;
    }
}

void mps2_uart_transmit(void) {
    MPS2_UART_INTERRUPT = MPS2_UART_INTERRUPT_TX;
    transmit_one();
}

/* The interrupt is kept out while this gets from the ring. */
void board_kick(void *context) {
    (void)context;
    MPS2_NVIC_DISABLE = 1u << MPS2_UART_TX_IRQ;
    __asm__ volatile("dsb\n\tisb" ::: "memory");
    transmit_one();
    MPS2_NVIC_ENABLE = 1u << MPS2_UART_TX_IRQ;
}

static void start_uart(void) {
    MPS2_UART_BAUDDIV = MPS2_CLOCK_HZ / BAUD;
    MPS2_UART_CTRL = MPS2_UART_ENABLE;
    MPS2_NVIC_PRIORITY(MPS2_UART_RX_IRQ) = PRIORITY_RECEIVE;
    MPS2_NVIC_PRIORITY(MPS2_UART_TX_IRQ) = PRIORITY_TRANSMIT;
    MPS2_NVIC_ENABLE = 1u << MPS2_UART_RX_IRQ | 1u << MPS2_UART_TX_IRQ;
}

/* ---- the rest ---- */

bool board_start(struct board_wire *wire, int64_t tick_ns) {
    if (wire == NULL) {
        return false;
    }
    wire_in_use = wire;
    start_uart();
    return start_timer(tick_ns);
}

_Noreturn void board_give_up(int code) {
    static volatile int given_up;
    given_up = code; /* for a debugger; the lamps of the board are not wired in QEMU */
    (void)given_up;
    for (;;) {
        __asm__ volatile("wfi");
    }
}
