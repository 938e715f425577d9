/*
 * mps2.h - the few registers of Arm's MPS2 board that this port uses. One port for three images of
 * its FPGA: AN500 (Cortex-M7), AN386 (M4) and AN385 (M3), which differ in the processor alone.
 * Source: Arm application notes AN385 table 3-1, AN386, AN500; Cortex-M System Design Kit (APB UART);
 * ARMv7-M Architecture Reference Manual B3.2 (SCS), B3.3 (SysTick), B3.4 (NVIC).
 */
#ifndef MPS2_H
#define MPS2_H

#include <stdint.h>

#define MPS2_CLOCK_HZ 25000000u

#define MPS2_REGISTER(address) (*(volatile uint32_t *)(uintptr_t)(address))

/* APB UART 0 */
#define MPS2_UART_DATA MPS2_REGISTER(0x40004000u)
#define MPS2_UART_STATE MPS2_REGISTER(0x40004004u)
#define MPS2_UART_CTRL MPS2_REGISTER(0x40004008u)
#define MPS2_UART_INTERRUPT MPS2_REGISTER(0x4000400Cu) /* status; write 1 to clear */
#define MPS2_UART_BAUDDIV MPS2_REGISTER(0x40004010u)
#define MPS2_UART_TX_FULL (1u << 0)
#define MPS2_UART_RX_FULL (1u << 1)
#define MPS2_UART_RX_OVERRUN (1u << 3) /* in STATE; write 1 to clear */
#define MPS2_UART_ENABLE 0x0Fu         /* TX, RX, TX interrupt, RX interrupt */
#define MPS2_UART_INTERRUPT_TX (1u << 0)
#define MPS2_UART_INTERRUPT_RX (1u << 1)
#define MPS2_UART_RX_IRQ 0u
#define MPS2_UART_TX_IRQ 1u

/* SysTick */
#define MPS2_SYSTICK_CTRL MPS2_REGISTER(0xE000E010u)
#define MPS2_SYSTICK_LOAD MPS2_REGISTER(0xE000E014u)
#define MPS2_SYSTICK_VALUE MPS2_REGISTER(0xE000E018u)
#define MPS2_SYSTICK_RUN 7u        /* enabled, with interrupt, from the processor's clock */
#define MPS2_SYSTICK_COUNT_ONLY 5u /* the same without interrupt */
#define MPS2_SYSTICK_MAX 0x00FFFFFFu

/* NVIC and system control */
#define MPS2_NVIC_ENABLE MPS2_REGISTER(0xE000E100u)
#define MPS2_NVIC_DISABLE MPS2_REGISTER(0xE000E180u)
#define MPS2_NVIC_PRIORITY(irq) (*(volatile uint8_t *)(uintptr_t)(0xE000E400u + (irq)))
#define MPS2_SYSTICK_PRIORITY (*(volatile uint8_t *)(uintptr_t)0xE000ED23u)
#define MPS2_INTERRUPT_STATE MPS2_REGISTER(0xE000ED04u) /* ICSR */
#define MPS2_SYSTICK_PENDING (1u << 26)
#define MPS2_COPROCESSORS MPS2_REGISTER(0xE000ED88u) /* CPACR */

/* Handlers of the vector table in startup.c. */
void mps2_reset(void);
void mps2_systick(void);
void mps2_uart_receive(void);
void mps2_uart_transmit(void);

#endif
