/*
 * kl_slcan_pty.h - a CAN bus on a pseudo-terminal that looks like an slcan USB adapter, behind
 * port/kl_can.h.
 *
 * python-can (interface='slcan', sleep_after_open=0), SavvyCAN or slcand open the terminal as they
 * would open /dev/ttyUSB0. The protocol, and what is refused, counted and dropped, is that of
 * port/kl_slcan_link.h; here are the terminal and its system calls. One client at a time: a
 * terminal has one other end. When it closes the terminal (and a service sees that), the channel closes with it, and the next
 * client finds nothing of what was meant for the last.
 *
 * Never late: the terminal does not block. kl_can_service() makes one read, of at most the room in
 * the ring, and one write of at most KL_SLCAN_PTY_FLUSH_BYTES. A client that does not read loses
 * frames, which are counted (KL_CAN_BUSY).
 *
 * Memory: the struct, owned by the caller (large: make it static); no heap. One thread per struct.
 */
#ifndef KL_SLCAN_PTY_H
#define KL_SLCAN_PTY_H

#include "kl_slcan_link.h"

#ifdef __cplusplus
extern "C" {
#endif

#define KL_SLCAN_PTY_RX_BYTES 4096u
#define KL_SLCAN_PTY_TX_BYTES 65536u
#define KL_SLCAN_PTY_FLUSH_BYTES 4096u
#define KL_SLCAN_PTY_QUEUE 256u
#define KL_SLCAN_PTY_PATH_BYTES 108u
#define KL_SLCAN_PTY_TEXT_BYTES 192u

/* The fields are for the functions below; read them with those. */
struct kl_slcan_pty {
    int master;         /* -1: closed */
    bool attached;      /* somebody holds the other end */
    uint32_t n_pending; /* bytes taken from the ring that the terminal did not take yet */
    struct kl_slcan_link link;
    struct kl_ring rx;
    struct kl_ring tx;
    char name[KL_SLCAN_PTY_PATH_BYTES]; /* of the terminal: /dev/pts/N */
    char path[KL_SLCAN_PTY_PATH_BYTES]; /* of our symbolic link; "": none */
    char text[KL_SLCAN_PTY_TEXT_BYTES];
    unsigned char rx_bytes[KL_SLCAN_PTY_RX_BYTES];
    unsigned char tx_bytes[KL_SLCAN_PTY_TX_BYTES];
    unsigned char pending[KL_SLCAN_PTY_FLUSH_BYTES];
    struct kl_can_frame queue[KL_SLCAN_PTY_QUEUE];
};

/*
 * Makes a terminal and, unless `path` is NULL or "", a symbolic link to it there, in place of an
 * older symbolic link.
 *   KL_CAN_OK        open; kl_slcan_pty_name() says which terminal
 *   KL_CAN_FAILED    no terminal is to be had, or the link cannot be made; kl_slcan_pty_text() says
 *                    which
 *   KL_CAN_ARGUMENT  NULL, or a path of KL_SLCAN_PTY_PATH_BYTES or more
 */
enum kl_can_status kl_slcan_pty_open(struct kl_slcan_pty *pty, const char *path);

/* The seam; `pty` must outlive it. Counts as in kl_slcan_link.h. Its close removes the link. */
struct kl_can kl_slcan_pty_can(struct kl_slcan_pty *pty);

/* "/dev/pts/N", or "" when closed. Never NULL. */
const char *kl_slcan_pty_name(const struct kl_slcan_pty *pty);

/* What the last failure was, in English; "" if there was none. Never NULL. */
const char *kl_slcan_pty_text(const struct kl_slcan_pty *pty);

#ifdef __cplusplus
}
#endif
#endif
