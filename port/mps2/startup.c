/*
 * startup.c - from reset to main on a Cortex-M of the MPS2 board: vector table, memory, FPU.
 */
#include "mps2.h"

#ifndef MPS2_ENTRY
#define MPS2_ENTRY main /* tests begin elsewhere */
#endif
int MPS2_ENTRY(void);

/* From mps2.ld; their addresses are the values. */
extern uint32_t mps2_data_start[];
extern uint32_t mps2_data_end[];
extern const uint32_t mps2_data_source[];
extern uint32_t mps2_bss_start[];
extern uint32_t mps2_bss_end[];
extern uint32_t mps2_stack_bottom[];
extern uint32_t mps2_paint_end[]; /* below what mps2_reset itself stands on */
extern uint32_t mps2_stack_top[];

#define STACK_PAINT 0xC0DEC0DEu /* what was never used still holds it */

static void halt(void) {
    for (;;) {
        __asm__ volatile("wfi");
    }
}

/* What a vector holds: a handler, or in the first place the stack. */
union vector {
    void (*handler)(void);
    const void *stack;
};

#define VECTORS 48
extern const union vector mps2_vectors[VECTORS];
__attribute__((section(".vectors"), used)) const union vector mps2_vectors[VECTORS] = {
    {.stack = mps2_stack_top},
    {.handler = mps2_reset},
    {.handler = halt}, /* NMI */
    {.handler = halt}, /* hard fault */
    {.handler = halt}, /* memory management */
    {.handler = halt}, /* bus fault */
    {.handler = halt}, /* usage fault */
    [11] = {.handler = halt},
    [12] = {.handler = halt},
    [14] = {.handler = halt},
    [15] = {.handler = mps2_systick},
    [16 + MPS2_UART_RX_IRQ] = {.handler = mps2_uart_receive},
    [16 + MPS2_UART_TX_IRQ] = {.handler = mps2_uart_transmit},
};

static void enable_fpu(void) {
#ifdef __ARM_FP
    MPS2_COPROCESSORS |= 0xFu << 20; /* CP10 and CP11: full access */
    __asm__ volatile("dsb\n\tisb");
#endif
}

void mps2_reset(void) {
    const uint32_t *from = mps2_data_source;
    for (uint32_t *to = mps2_data_start; to < mps2_data_end; to++) {
        *to = *from++;
    }
    for (uint32_t *to = mps2_bss_start; to < mps2_bss_end; to++) {
        *to = 0;
    }
    for (uint32_t *to = mps2_stack_bottom; to < mps2_paint_end; to++) {
        *(volatile uint32_t *)to = STACK_PAINT;
    }
    enable_fpu();
    (void)MPS2_ENTRY();
    halt();
}
