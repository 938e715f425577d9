/*
 * kl_socketcan.h - a CAN interface of the Linux kernel behind port/kl_can.h.
 *
 * One raw socket, bound to one interface, never blocking. Frames of this socket do not come back to
 * it; every other socket on the same interface sees them, as a node on the bus would.
 *
 * Full:      ENOBUFS (queue of the interface) and EAGAIN (buffer of the socket) are KL_CAN_BUSY;
 * the frame is dropped and counted. The next send tries again by itself. Away:      an interface
 * that was set down, unplugged, renamed or went bus-off is KL_CAN_DOWN until kl_can_recover() finds
 * it running again; frames handed over meanwhile are dropped and counted. An interface that was
 * unplugged is opened afresh by its name. Lost:      frames that the kernel dropped because nobody
 * fetched them in time are counted as receive_dropped as soon as the next frame is fetched
 * (SO_RXQ_OVFL).
 *
 * Memory: the struct, owned by the caller; no heap. Every call makes at most a fixed number of
 * system calls. One thread per struct; two structs are independent.
 */
#ifndef KL_SOCKETCAN_H
#define KL_SOCKETCAN_H

#include "kl_can.h"

#ifdef __cplusplus
extern "C" {
#endif

#define KL_SOCKETCAN_NAME_BYTES 16u  /* IFNAMSIZ, with the closing 0 */
#define KL_SOCKETCAN_TEXT_BYTES 128u /* last error, with the closing 0 */
#define KL_SOCKETCAN_BUFFER_BYTES (1 << 20)

struct kl_socketcan_options {
    const char *interface;    /* "can0"; 1..15 characters; copied */
    bool fd;                  /* also carry FD frames; classic ones always */
    int receive_buffer_bytes; /* SO_RCVBUF; 0: KL_SOCKETCAN_BUFFER_BYTES; the kernel may give less
                               */
};

/* The fields are for the functions below; read them with those. */
struct kl_socketcan {
    char interface[KL_SOCKETCAN_NAME_BYTES];
    char text[KL_SOCKETCAN_TEXT_BYTES];
    struct kl_can_counts counts;
    int socket; /* -1: not open */
    int receive_buffer_bytes;
    uint32_t kernel_dropped; /* last SO_RXQ_OVFL figure of this socket */
    bool fd;
    bool up;
    bool reopen; /* the socket lost its interface */
    bool closed;
};

/* True if the kernel has raw CAN sockets at all. */
bool kl_socketcan_available(void);

/*
 * Opens the interface.
 *   KL_CAN_OK        running
 *   KL_CAN_DOWN      no such interface, or it is not up; the struct is good, kl_can_recover() tries
 *                    again, kl_can_close() ends it
 *   KL_CAN_FAILED    the kernel has no CAN, no permission, or FD is wanted and not carried by the
 *                    interface; the struct is closed; kl_socketcan_text() says why
 *   KL_CAN_ARGUMENT  NULL, or a name that is empty or too long
 */
enum kl_can_status kl_socketcan_open(struct kl_socketcan *port,
                                     const struct kl_socketcan_options *options);

/* The seam; `port` must outlive it. */
struct kl_can kl_socketcan_can(struct kl_socketcan *port);

/* What the last failure was, in English; "" if there was none. Never NULL. */
const char *kl_socketcan_text(const struct kl_socketcan *port);

#ifdef __cplusplus
}
#endif
#endif
