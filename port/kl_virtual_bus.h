/*
 * kl_virtual_bus.h - a CAN bus in memory: deterministic, for tests, targets without a bus, and the
 * fastest run in lockstep.
 *
 * A bus joins up to KL_VBUS_MAX_NODES nodes, each a back end of kl_can.h. A frame sent by one node
 * arrives at once, and in order, in the ring of every other node (never at the sender). All memory
 * is the caller's: one struct for the bus, one per node, one ring of frames per node. A receiver
 * whose ring is full loses the NEW frame and counts it in receive_dropped; the sender does not
 * notice, as on a real bus. With a send budget the bus carries so many frames of a node per
 * kl_vbus_tick and then says KL_CAN_BUSY: a bus of limited speed.
 *
 * Faults are injected by number, so that a test can walk through every k: see struct kl_vbus_fault.
 * Not for several threads.
 */
#ifndef KL_VIRTUAL_BUS_H
#define KL_VIRTUAL_BUS_H

#include "kl_can.h"

#ifdef __cplusplus
extern "C" {
#endif

#define KL_VBUS_MAX_NODES 8u
#define KL_VBUS_MAX_FAULTS 4u

enum kl_vbus_fault_kind {
    KL_VBUS_NO_FAULT = 0,
    KL_VBUS_SEND_FAILS,    /* send returns KL_CAN_FAILED, the frame is gone */
    KL_VBUS_SEND_BUSY,     /* send returns KL_CAN_BUSY, the frame is gone */
    KL_VBUS_SEND_LOST,     /* send returns KL_CAN_OK, the frame never arrives anywhere */
    KL_VBUS_SEND_CORRUPT,  /* send returns KL_CAN_OK, one bit of the data arrives inverted */
    KL_VBUS_RECEIVE_FAILS, /* receive returns KL_CAN_FAILED, a waiting frame stays */
    KL_VBUS_GOES_DOWN,     /* this node's link goes down at this call: send or receive */
    KL_VBUS_CALL_FAILS     /* the k-th call of any kind (send, receive, recover) fails */
};

/* Strikes the first..last-th call of its kind, counted from 1 since the fault was set; last 0: no
 * end; every 0 or 1: each of them, otherwise each every-th from the first. */
struct kl_vbus_fault {
    enum kl_vbus_fault_kind kind;
    uint64_t first;
    uint64_t last;
    uint64_t every;
    uint64_t calls; /* calls of its kind so far; the bus counts here */
};

struct kl_vbus;

struct kl_vbus_node {
    struct kl_vbus *bus;
    struct kl_can_frame *ring;
    uint32_t capacity; /* frames in ring, >= 1 */
    uint32_t head;     /* oldest waiting frame */
    uint32_t count;    /* waiting frames */
    uint32_t index;    /* of this node on the bus */
    bool down;         /* latched until recover succeeds */
    uint64_t budget;   /* frames per tick; 0: unlimited */
    uint64_t spent;    /* frames sent since the last tick */
    struct kl_can_counts counts;
    struct kl_vbus_fault faults[KL_VBUS_MAX_FAULTS];
};

struct kl_vbus {
    struct kl_vbus_node *nodes[KL_VBUS_MAX_NODES];
    uint32_t n_nodes;
    bool up;
    uint64_t frames; /* carried since kl_vbus_init, lost and corrupt ones included */
    uint64_t ticks;
};

/* An empty bus that is up. */
void kl_vbus_init(struct kl_vbus *bus);

/*
 * Joins a node and fills in `can`, its back end. `node`, `ring` and the bus must outlive `can`.
 * KL_CAN_ARGUMENT: NULL or capacity 0; KL_CAN_REFUSED: the bus already has KL_VBUS_MAX_NODES nodes.
 * The node leaves the bus by the back end's close; its place is then free again.
 */
enum kl_can_status kl_vbus_join(struct kl_vbus *bus, struct kl_vbus_node *node,
                                struct kl_can_frame *ring, uint32_t capacity, struct kl_can *can);

/* Takes the bus away (up = false: every node says KL_CAN_DOWN) or brings it back (each node then
 * works after its own recover). Frames already in rings stay. */
void kl_vbus_set_up(struct kl_vbus *bus, bool up);

/* Frames a node may send per tick; 0: unlimited. */
void kl_vbus_set_budget(struct kl_vbus_node *node, uint64_t frames_per_tick);

/* Starts a new tick for all budgets. Bound: the number of nodes. */
void kl_vbus_tick(struct kl_vbus *bus);

/* Adds a fault (counting from this call on); false: all KL_VBUS_MAX_FAULTS places are taken.
 * kl_vbus_clear_faults frees them. */
bool kl_vbus_inject(struct kl_vbus_node *node, struct kl_vbus_fault fault);
void kl_vbus_clear_faults(struct kl_vbus_node *node);

#ifdef __cplusplus
}
#endif
#endif
