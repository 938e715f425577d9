/*
 * semihosting.c - a test program with a main(argc, argv) and stdio on the MPS2 board: newlib over
 * semihosting, started by port/mps2/startup.c with -DMPS2_ENTRY=target_entry. Tests alone use it.
 * Source: Arm, Semihosting for AArch32 and AArch64 (SYS_GET_CMDLINE 0x15); newlib's librdimon.
 */
#include <stdlib.h>

#include "mps2.h"

#define SYS_GET_CMDLINE 0x15u
#define MAX_WORDS 16

int main(int argc, char **argv);
int target_entry(void);
void _fini(void);                      /* newlib's exit calls it; there are no destructors */
void initialise_monitor_handles(void); /* librdimon: opens stdin, stdout, stderr */

static uint32_t ask_host(uint32_t operation, void *block) {
    register uint32_t r0 __asm__("r0") = operation;
    register void *r1 __asm__("r1") = block;
    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

/* The interrupts of the board are off. */
void mps2_systick(void) {
}
void mps2_uart_receive(void) {
}
void mps2_uart_transmit(void) {
}

void _fini(void) {
}

int target_entry(void) {
    static char line[512];
    static char *words[MAX_WORDS + 1];
    struct {
        char *text;
        uint32_t size;
    } block = {line, sizeof line};
    int n = 0;
    initialise_monitor_handles();
    if (ask_host(SYS_GET_CMDLINE, &block) != 0) {
        line[0] = '\0';
    }
    for (char *at = line; *at != '\0' && n < MAX_WORDS; n++) {
        words[n] = at;
        while (*at != '\0' && *at != ' ') {
            at++;
        }
        if (*at == ' ') {
            *at++ = '\0';
        }
    }
    exit(main(n, words));
}
