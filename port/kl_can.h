/*
 * kl_can.h - the seam between Klingel and a CAN controller.
 *
 * A back end is an ops table and a context that the caller owns. Nothing here blocks, allocates or
 * reads a clock: frames are handed over and fetched when the owner calls. A back end that has no
 * room says KL_CAN_BUSY and counts the drop; a bus that is away says KL_CAN_DOWN, keeps saying so,
 * and works again by itself after `recover` once it is back. One owner per context; two contexts
 * are independent. tests/conformance holds every back end to this page.
 */
#ifndef KL_CAN_H
#define KL_CAN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define KL_CAN_MAX_STANDARD_ID 0x7FFu
#define KL_CAN_MAX_EXTENDED_ID 0x1FFFFFFFu
#define KL_CAN_CLASSIC_BYTES 8u
#define KL_CAN_FD_BYTES 64u

enum kl_can_flag {
    KL_CAN_EXTENDED = 1 << 0, /* 29-bit identifier */
    KL_CAN_REMOTE = 1 << 1,   /* remote request, no data */
    KL_CAN_FD = 1 << 2,       /* FD frame, up to 64 bytes */
    KL_CAN_BRS = 1 << 3       /* FD with bit-rate switch */
};

struct kl_can_frame {
    uint32_t id;    /* without flag bits */
    uint8_t flags;  /* enum kl_can_flag bits */
    uint8_t length; /* bytes: 0..8 classic, 0..8,12,16,20,24,32,48,64 FD */
    uint8_t data[KL_CAN_FD_BYTES];
};

enum kl_can_status {
    KL_CAN_OK = 0,
    KL_CAN_EMPTY = 1,     /* receive: nothing waiting (not an error) */
    KL_CAN_BUSY = -1,     /* send: no room now, the frame was dropped and counted */
    KL_CAN_DOWN = -2,     /* the bus or the interface is away */
    KL_CAN_REFUSED = -3,  /* the frame is malformed or of a kind this back end does not carry */
    KL_CAN_ARGUMENT = -4, /* NULL */
    KL_CAN_FAILED = -5    /* anything else; the back end's own text says what */
};

/* A short English text; never NULL. */
const char *kl_can_status_text(enum kl_can_status status);

/* Counts since opening; they never go back. */
struct kl_can_counts {
    uint64_t sent;
    uint64_t received;
    uint64_t send_dropped;    /* frames handed over that did not go out, refused ones too */
    uint64_t receive_dropped; /* frames lost before the caller fetched them, where the back end can
                                 know */
    uint64_t refused;         /* malformed or unsupported frames, both directions */
    uint64_t recoveries;      /* successful ones */
};

/* Mandatory: send, receive, is_up, counts. Optional (NULL allowed): recover, service, close. */
struct kl_can_ops {
    /* Hands one frame over. Never blocks. */
    enum kl_can_status (*send)(void *context, const struct kl_can_frame *frame);
    /* Fetches the oldest waiting frame. Never blocks. `frame` is untouched unless KL_CAN_OK. */
    enum kl_can_status (*receive)(void *context, struct kl_can_frame *frame);
    /* True while frames can go out. */
    bool (*is_up)(void *context);
    void (*counts)(void *context, struct kl_can_counts *counts);
    /* Tries once to bring a bus back. KL_CAN_OK or KL_CAN_DOWN. Never blocks. Called at a modest
     * rate by the owner. */
    enum kl_can_status (*recover)(void *context);
    /* Housekeeping (accept clients, flush rings); bounded work. Called once per step by the owner.
     */
    void (*service)(void *context);
    void (*close)(void *context);
};

struct kl_can {
    const struct kl_can_ops *ops;
    void *context;
};

/* Checks a frame's id, flags and length against each other. KL_CAN_OK or KL_CAN_REFUSED. */
enum kl_can_status kl_can_check(const struct kl_can_frame *frame);

/* Call through the table; optional operations that are absent do nothing and return KL_CAN_OK. */
enum kl_can_status kl_can_send(const struct kl_can *can, const struct kl_can_frame *frame);
enum kl_can_status kl_can_receive(const struct kl_can *can, struct kl_can_frame *frame);
bool kl_can_is_up(const struct kl_can *can);
void kl_can_get_counts(const struct kl_can *can, struct kl_can_counts *counts);
enum kl_can_status kl_can_recover(const struct kl_can *can);
void kl_can_service(const struct kl_can *can);
void kl_can_close(const struct kl_can *can);

#ifdef __cplusplus
}
#endif
#endif
