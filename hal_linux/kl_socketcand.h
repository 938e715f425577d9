/*
 * kl_socketcand.h - a CAN bus over TCP, for machines without CAN: a server on 127.0.0.1 that speaks
 * the raw mode of the socketcand protocol, behind port/kl_can.h.
 *
 * python-can (interface='socketcand') and SavvyCAN connect to it. The server is a bus: what its
 * owner sends goes to every client, what a client sends goes to the owner and to every other
 * client, nobody hears himself. With no client the bus is up and frames simply go nowhere.
 *
 *   server < hi >    client < open NAME >    server < ok >    client < rawmode >    server < ok >
 *   server < frame 123 1700000000.123456 1A220344 >      3 hex digits standard, 8 extended
 *   client < send 123 2 1 ab >                           id, length, bytes
 *   client < echo >  server < echo >                     and < error TEXT > for what is not
 * understood
 *
 * Streaming starts KL_SOCKETCAND_QUIET_MS after the last ok, because clients expect each reply
 * alone in one read. Every line that follows is led by a newline: python-can 4.1 skips one byte
 * after each read that ends inside a line.
 *
 * Extended identifiers: 8 digits, or bit 31 set (SavvyCAN), or a value above 0x7FF. python-can
 * sends extended identifiers below 0x800 as if they were standard and shows every frame as
 * extended: use standard ones with it. Remote and FD frames do not exist in this protocol: refused
 * and counted.
 *
 * Never late: every socket is non-blocking. kl_can_send() only writes to the clients' rings;
 * kl_can_service() moves each ring on with one system call and at most KL_SOCKETCAND_FLUSH_BYTES.
 * A client that does not read loses frames, which are counted, and nobody else does. Commands are
 * read in kl_can_service(), and once more by the first kl_can_receive() after it that finds
 * nothing.
 *
 * Memory: the struct, owned by the caller (large: make it static); no heap. One thread per struct.
 */
#ifndef KL_SOCKETCAND_H
#define KL_SOCKETCAND_H

#include "kl_can.h"

#ifdef __cplusplus
extern "C" {
#endif

#define KL_SOCKETCAND_PORT 29536u

#ifndef KL_SOCKETCAND_CLIENTS
#define KL_SOCKETCAND_CLIENTS 8 /* connections at a time; more are told so and closed */
#endif
#ifndef KL_SOCKETCAND_RING_BYTES
#define KL_SOCKETCAND_RING_BYTES 262144u /* per client; a power of two. A frame takes 33..54 */
#endif
#if KL_SOCKETCAND_CLIENTS < 1 || KL_SOCKETCAND_CLIENTS > 64
#error "KL_SOCKETCAND_CLIENTS must be 1..64"
#endif
#if KL_SOCKETCAND_RING_BYTES < 1024 ||                                                             \
    (KL_SOCKETCAND_RING_BYTES & (KL_SOCKETCAND_RING_BYTES - 1)) != 0
#error "KL_SOCKETCAND_RING_BYTES must be a power of two, at least 1024"
#endif

#define KL_SOCKETCAND_QUEUE 512u         /* frames from clients, waiting for kl_can_receive() */
#define KL_SOCKETCAND_LINE_BYTES 128u    /* longest line of a client, without < and > */
#define KL_SOCKETCAND_FLUSH_BYTES 32768u /* most a client is sent per kl_can_service() */
#define KL_SOCKETCAND_READ_BYTES 2048u   /* most a client is read at a time */
#define KL_SOCKETCAND_QUIET_MS 20        /* from the last ok to the first frame */
#define KL_SOCKETCAND_HANDSHAKE_MS 30000 /* a client that is not in raw mode by then is closed */
#define KL_SOCKETCAND_SEND_BUFFER_BYTES (1 << 18)
#define KL_SOCKETCAND_TEXT_BYTES 128u

struct kl_socketcand_options {
    uint16_t port;         /* 0: any free one, see kl_socketcand_port() */
    const char *channel;   /* the only name that < open > takes, at most 31 characters; NULL: any */
    int send_buffer_bytes; /* SO_SNDBUF per client; 0: KL_SOCKETCAND_SEND_BUFFER_BYTES */
};

enum kl_socketcand_stage {
    KL_SOCKETCAND_FREE = 0, /* no connection in this slot */
    KL_SOCKETCAND_GREETED,  /* < hi > said */
    KL_SOCKETCAND_OPENED,   /* < open > done */
    KL_SOCKETCAND_QUIET,    /* < rawmode > done, waiting for the quiet time to pass */
    KL_SOCKETCAND_STREAMING
};

struct kl_socketcand_client {
    enum kl_socketcand_stage stage;
    int socket;
    int64_t since_ns; /* monotonic: of the greeting, then of the last ok */
    uint32_t head;    /* ring: bytes written, modulo 2^32 */
    uint32_t tail;    /* ring: bytes sent */
    uint32_t line_length;
    bool in_line; /* after <, before > */
    bool garbage; /* in a run of bytes outside < >, counted already */
    char line[KL_SOCKETCAND_LINE_BYTES];
    char ring[KL_SOCKETCAND_RING_BYTES];
};

/* Counts since opening, besides those of kl_can. */
struct kl_socketcand_stats {
    uint32_t clients;     /* connected now */
    uint32_t streaming;   /* of these, in raw mode and receiving */
    uint64_t accepted;    /* connections taken since opening */
    uint64_t turned_away; /* connections refused because every slot was taken */
    uint64_t client_lost; /* frames that single clients lost, summed over all clients there were */
};

/* The fields are for the functions below; read them with those. */
struct kl_socketcand {
    int listener; /* -1: closed */
    uint16_t port;
    bool read_due;
    int send_buffer_bytes;
    uint32_t queue_head;
    uint32_t queue_tail;
    struct kl_can_counts counts;
    struct kl_socketcand_stats stats;
    char channel[32];
    char text[KL_SOCKETCAND_TEXT_BYTES];
    struct kl_can_frame queue[KL_SOCKETCAND_QUEUE];
    struct kl_socketcand_client client[KL_SOCKETCAND_CLIENTS];
};

/*
 * Starts to listen on 127.0.0.1. `options` NULL: the defaults with KL_SOCKETCAND_PORT.
 *   KL_CAN_OK        listening
 *   KL_CAN_FAILED    the port is taken, or no socket is to be had; kl_socketcand_text() says which
 *   KL_CAN_ARGUMENT  NULL, or a channel name that is too long
 */
enum kl_can_status kl_socketcand_open(struct kl_socketcand *server,
                                      const struct kl_socketcand_options *options);

/*
 * The seam; `server` must outlive it. Of the counts:
 *   sent          frames that went into every ring that had room, or nowhere for want of clients
 *   send_dropped  frames for which no streaming client had room (KL_CAN_BUSY), and refused ones. A
 *                 frame that only some clients lost is `sent`; stats.client_lost counts each of
 *                 those losses.
 *   received, receive_dropped  frames from clients; dropped if the owner did not fetch in time
 *   refused       frames of the owner that do not exist here, and whatever clients said that was
 *                 not understood
 */
struct kl_can kl_socketcand_can(struct kl_socketcand *server);

/* The TCP port it listens on; 0 when closed. */
uint16_t kl_socketcand_port(const struct kl_socketcand *server);

void kl_socketcand_get_stats(const struct kl_socketcand *server, struct kl_socketcand_stats *stats);

/* What the last failure was, in English; "" if there was none. Never NULL. */
const char *kl_socketcand_text(const struct kl_socketcand *server);

#ifdef __cplusplus
}
#endif
#endif
