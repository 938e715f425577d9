/*
 * kl_slcan_link.h - a CAN back end (kl_can.h) over two rings of bytes: a UART, USB, or a pty.
 *
 * The link is the ADAPTER of the LAWICEL protocol and the bus behind it: whoever holds the other
 * end of the wire (python-can's slcan interface, slcand, a terminal) opens the channel, and from
 * then on is a node on the same bus as the owner of the link. While the channel is closed the bus
 * is up and frames go nowhere.
 *
 *     wire -> interrupt -> rx ring -> service: lines -> commands answered, frames queued -> receive
 *     send -> line -> tx ring -> kick -> interrupt -> wire
 *
 * Commands (each answered with CR, or BEL when refused):
 *     Sn sxxyy    bit rate, channel closed: remembered only, there is no line that has one
 *     O L C       open, open for listening only, close
 *     t T r R     a frame, channel open: answered z or Z and CR
 *     F           flags since the last F, channel open: bit 0 frames of the wire lost, 1 frames for
 *                 the wire lost, 3 bytes of the wire lost
 *     Zn          n 1: time stamps on, channel closed
 *     Mx.. mx..   acceptance code and mask, channel closed: as SJA1000 in dual filter mode; a
 *                 mask bit of 1 lets pass
 *     V N         version and serial number
 *     (empty)     answered CR
 *
 * Never late: nothing waits. A frame or an answer goes into the tx ring as a whole or not at all
 * (KL_CAN_BUSY, or lost_answers). kl_can_service reads at most KL_SLCAN_SERVICE_BYTES and the rest
 * next time, so that no storm of bytes takes longer than that. Bad bytes spoil their line and
 * nothing else: refused, counted, answered with BEL.
 *
 * Memory is the caller's: the struct, two rings, a queue of frames. One owner; only the two rings
 * are shared with an interrupt.
 */
#ifndef KL_SLCAN_LINK_H
#define KL_SLCAN_LINK_H

#include "kl_ring.h"
#include "kl_slcan.h"

#ifdef __cplusplus
extern "C" {
#endif

#define KL_SLCAN_SERVICE_BYTES 512u /* read from the wire per service */
#define KL_SLCAN_SERIAL_BYTES 4u
#define KL_SLCAN_FLAG_QUEUE_FULL 0x01u
#define KL_SLCAN_FLAG_SEND_FULL 0x02u
#define KL_SLCAN_FLAG_OVERRUN 0x08u

struct kl_slcan_link_config {
    struct kl_ring *rx;          /* from the wire */
    struct kl_ring *tx;          /* to the wire; at least KL_SLCAN_LINE_BYTES + 1 */
    void (*kick)(void *context); /* there are new bytes in tx; NULL: the driver polls */
    void *kick_context;
    struct kl_can_frame *queue; /* frames from the wire until they are received */
    uint32_t queue_frames;      /* >= 1 */
    const char *serial;         /* answer to N: 4 letters and digits; NULL: "KL01" */
};

enum kl_slcan_channel { KL_SLCAN_CLOSED = 0, KL_SLCAN_OPEN, KL_SLCAN_LISTENING };

/* Counts since kl_slcan_link_init, besides those of kl_can. */
struct kl_slcan_stats {
    uint64_t lines;        /* complete lines, spoilt ones too */
    uint64_t spoilt;       /* of these, damaged or too long */
    uint64_t belled;       /* answered with BEL, the spoilt ones too */
    uint64_t opened;       /* times that the channel was opened */
    uint64_t filtered;     /* frames that the acceptance filter kept from the wire */
    uint64_t lost_answers; /* answers that found no room */
    uint64_t lost_bytes;   /* bytes from the wire that found no room */
};

/* The fields are for the functions below; read them with those. */
struct kl_slcan_link {
    struct kl_slcan_link_config config;
    struct kl_slcan_reader reader;
    enum kl_slcan_channel channel;
    bool closed; /* by kl_can_close: for good */
    bool timestamps;
    uint8_t flags;         /* KL_SLCAN_FLAG_..., until the next F */
    uint8_t bit_rate_code; /* of S; 0xFF: none, or s */
    uint16_t bit_timing;   /* of s: BTR0, BTR1 */
    uint16_t time_ms;
    uint32_t filter_code;
    uint32_t filter_mask;
    uint32_t lost_seen; /* of rx->lost */
    uint32_t head;      /* oldest frame in the queue */
    uint32_t count;
    struct kl_can_counts counts;
    struct kl_slcan_stats stats;
};

/*
 * Prepares a link with its channel closed. KL_CAN_ARGUMENT: NULL, no room for a line, a serial
 * number that is not of 4 letters and digits. Bound: constant.
 */
enum kl_can_status kl_slcan_link_init(struct kl_slcan_link *link,
                                      const struct kl_slcan_link_config *config);

/*
 * The seam; `link` must outlive it. There is no bus that could go down: up until closed, recover
 * has nothing to do. Of the counts:
 *   sent          frames that went into the tx ring, or nowhere: channel closed, or filtered
 *   send_dropped  frames that found no room (KL_CAN_BUSY), and refused ones
 *   receive_dropped  frames from the wire that found no room in the queue
 *   refused       frames of the owner that do not exist here, and every line answered with BEL
 */
struct kl_can kl_slcan_link_can(struct kl_slcan_link *link);

/* Time for the stamps, from any clock of the owner; taken modulo 60 000 ms. */
void kl_slcan_link_set_time(struct kl_slcan_link *link, uint64_t time_ms);

/* The other end is gone (a cable pulled, a terminal closed): the channel closes, a begun line and
 * the tx ring are dropped, the settings are those of kl_slcan_link_init. Queued frames and counts
 * stay. Not while an interrupt may be getting from the tx ring. */
void kl_slcan_link_hang_up(struct kl_slcan_link *link);

enum kl_slcan_channel kl_slcan_link_channel(const struct kl_slcan_link *link);
void kl_slcan_link_get_stats(const struct kl_slcan_link *link, struct kl_slcan_stats *stats);

#ifdef __cplusplus
}
#endif
#endif
