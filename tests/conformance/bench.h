/*
 * bench.h - what the conformance suite needs of a back end's surroundings: another node on the same
 * bus, and, where they can be had, ways to block the bus, take it away, and shout garbage at it.
 * One bench exists per back end; open makes a fresh bus with both nodes.
 */
#ifndef BENCH_H
#define BENCH_H

#include "kl_can.h"

struct bench {
    const char *name;
    bool carries_fd;
    bool carries_remote;
    bool carries_bus_faults; /* down, up: the back end has a bus that can go away */
    int most_until_busy;     /* frames after which a blocked bus must have said BUSY */
    int overflow_frames;     /* frames that nobody fetches and that certainly do not fit */

    /* NULL if it can run here, else why not. `argument` is what followed the name, or "". */
    const char *(*available)(const char *argument);
    bool (*open)(struct kl_can *can);
    void (*close)(void);

    /* The other node. Its receive gives up after a second. Both keep the back end serviced. */
    bool (*peer_send)(const struct kl_can_frame *frame);
    bool (*peer_receive)(struct kl_can_frame *frame);
    /* Whether something waits at the other node, after giving it the time to arrive. */
    bool (*peer_hears)(struct kl_can_frame *frame);

    /* No room on the bus, and room again. */
    void (*block)(void);
    void (*unblock)(void);
    /* The bus goes away and comes back; and is replaced by a new one. NULL where that cannot be. */
    void (*take_down)(void);
    void (*bring_up)(void);
    void (*replace)(void);
    /* Sends the k-th of some kinds of nonsense; false after the last. NULL where there is none. */
    bool (*garbage)(int k);
};

extern const struct bench bench_virtual;
extern const struct bench bench_slcan;
extern const struct bench bench_slcan_pty;
extern const struct bench bench_socketcand;
extern const struct bench bench_socketcan;
/* The same, opened with FD frames. */
extern const struct bench bench_socketcan_fd;

#endif
