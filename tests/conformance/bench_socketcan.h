/* bench_socketcan.h - what tests of SocketCAN alone need of its bench. */
#ifndef BENCH_SOCKETCAN_H
#define BENCH_SOCKETCAN_H

#include "bench.h"

/* The interface under test. */
const char *vcan_name(void);
/* Runs a shell command; %s in the format, or %1$s as often as wanted, is the interface's name. */
void vcan_shell(const char *format);
/* Puts a struct can_frame or canfd_frame on the bus from the other node as it is. */
bool vcan_inject(const void *frame, size_t bytes);

/* Faults that only a real interface has; returns the number of failed cases. */
int run_vcan_faults(void);

#endif
