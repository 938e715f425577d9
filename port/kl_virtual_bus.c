/* A bus in memory with faults on demand; see kl_virtual_bus.h. */
#include "kl_virtual_bus.h"

void kl_vbus_init(struct kl_vbus *bus) {
    *bus = (struct kl_vbus){.up = true};
}

void kl_vbus_set_up(struct kl_vbus *bus, bool up) {
    bus->up = up;
    for (uint32_t i = 0; i < KL_VBUS_MAX_NODES; i++) {
        if (!up && bus->nodes[i] != NULL) {
            bus->nodes[i]->down = true;
        }
    }
}

void kl_vbus_set_budget(struct kl_vbus_node *node, uint64_t frames_per_tick) {
    node->budget = frames_per_tick;
    node->spent = 0;
}

void kl_vbus_tick(struct kl_vbus *bus) {
    bus->ticks++;
    for (uint32_t i = 0; i < KL_VBUS_MAX_NODES; i++) {
        if (bus->nodes[i] != NULL) {
            bus->nodes[i]->spent = 0;
        }
    }
}

bool kl_vbus_inject(struct kl_vbus_node *node, struct kl_vbus_fault fault) {
    for (uint32_t i = 0; i < KL_VBUS_MAX_FAULTS; i++) {
        if (node->faults[i].kind == KL_VBUS_NO_FAULT) {
            fault.calls = 0;
            node->faults[i] = fault;
            return true;
        }
    }
    return false;
}

void kl_vbus_clear_faults(struct kl_vbus_node *node) {
    for (uint32_t i = 0; i < KL_VBUS_MAX_FAULTS; i++) {
        node->faults[i] = (struct kl_vbus_fault){0};
    }
}

enum call { CALL_SEND, CALL_RECEIVE, CALL_RECOVER };

static bool concerns(enum kl_vbus_fault_kind kind, enum call call) {
    switch (kind) {
    case KL_VBUS_SEND_FAILS:
    case KL_VBUS_SEND_BUSY:
    case KL_VBUS_SEND_LOST:
    case KL_VBUS_SEND_CORRUPT:
        return call == CALL_SEND;
    case KL_VBUS_RECEIVE_FAILS:
        return call == CALL_RECEIVE;
    case KL_VBUS_GOES_DOWN:
        return call == CALL_SEND || call == CALL_RECEIVE;
    case KL_VBUS_CALL_FAILS:
        return true;
    case KL_VBUS_NO_FAULT:
        break;
    }
    return false;
}

/* Counts a call in every fault that it concerns and returns the first that strikes. */
static enum kl_vbus_fault_kind strike(struct kl_vbus_node *node, enum call call) {
    enum kl_vbus_fault_kind found = KL_VBUS_NO_FAULT;
    for (uint32_t i = 0; i < KL_VBUS_MAX_FAULTS; i++) {
        struct kl_vbus_fault *fault = &node->faults[i];
        if (!concerns(fault->kind, call)) {
            continue;
        }
        uint64_t k = ++fault->calls;
        uint64_t every = fault->every == 0 ? 1 : fault->every;
        bool hit = k >= fault->first && (fault->last == 0 || k <= fault->last) &&
                   (k - fault->first) % every == 0;
        if (hit && found == KL_VBUS_NO_FAULT) {
            found = fault->kind;
        }
    }
    return found;
}

static void deliver(struct kl_vbus_node *node, const struct kl_can_frame *frame) {
    if (node->count == node->capacity) {
        node->counts.receive_dropped++;
        return;
    }
    node->ring[(node->head + node->count) % node->capacity] = *frame;
    node->count++;
}

static void broadcast(const struct kl_vbus_node *sender, const struct kl_can_frame *frame) {
    const struct kl_vbus *bus = sender->bus;
    for (uint32_t i = 0; i < KL_VBUS_MAX_NODES; i++) {
        if (bus->nodes[i] != NULL && bus->nodes[i] != sender && !bus->nodes[i]->down) {
            deliver(bus->nodes[i], frame);
        }
    }
}

/* Which bit flips follows from the number of frames sent, so that a run can be repeated. */
static struct kl_can_frame corrupted(const struct kl_vbus_node *node,
                                     const struct kl_can_frame *frame) {
    struct kl_can_frame bad = *frame;
    if (bad.length > 0) {
        uint64_t bit = node->counts.sent % (8u * (uint64_t)bad.length);
        bad.data[bit / 8u] = (uint8_t)(bad.data[bit / 8u] ^ (1u << (bit % 8u)));
    }
    return bad;
}

static enum kl_can_status drop(struct kl_vbus_node *node, enum kl_can_status why) {
    node->counts.send_dropped++;
    return why;
}

static enum kl_can_status vbus_send(void *context, const struct kl_can_frame *frame) {
    struct kl_vbus_node *node = context;
    if (node == NULL || frame == NULL) {
        return KL_CAN_ARGUMENT;
    }
    enum kl_vbus_fault_kind fault = strike(node, CALL_SEND);
    if (node->bus == NULL) {
        return drop(node, KL_CAN_DOWN);
    }
    if (kl_can_check(frame) != KL_CAN_OK) {
        node->counts.refused++;
        return drop(node, KL_CAN_REFUSED);
    }
    node->down = node->down || fault == KL_VBUS_GOES_DOWN;
    if (node->down) {
        return drop(node, KL_CAN_DOWN);
    }
    if (fault == KL_VBUS_SEND_FAILS || fault == KL_VBUS_CALL_FAILS) {
        return drop(node, KL_CAN_FAILED);
    }
    if (fault == KL_VBUS_SEND_BUSY || (node->budget != 0 && node->spent >= node->budget)) {
        return drop(node, KL_CAN_BUSY);
    }
    if (fault == KL_VBUS_SEND_CORRUPT) {
        struct kl_can_frame bad = corrupted(node, frame);
        broadcast(node, &bad);
    } else if (fault != KL_VBUS_SEND_LOST) {
        broadcast(node, frame);
    }
    node->spent++;
    node->counts.sent++;
    node->bus->frames++;
    return KL_CAN_OK;
}

static enum kl_can_status vbus_receive(void *context, struct kl_can_frame *frame) {
    struct kl_vbus_node *node = context;
    if (node == NULL || frame == NULL) {
        return KL_CAN_ARGUMENT;
    }
    enum kl_vbus_fault_kind fault = strike(node, CALL_RECEIVE);
    node->down = node->down || fault == KL_VBUS_GOES_DOWN;
    if (fault == KL_VBUS_RECEIVE_FAILS || fault == KL_VBUS_CALL_FAILS) {
        return KL_CAN_FAILED;
    }
    if (node->count == 0) {
        return node->bus == NULL || node->down ? KL_CAN_DOWN : KL_CAN_EMPTY;
    }
    *frame = node->ring[node->head];
    node->head = (node->head + 1u) % node->capacity;
    node->count--;
    node->counts.received++;
    return KL_CAN_OK;
}

static bool vbus_is_up(void *context) {
    const struct kl_vbus_node *node = context;
    return node != NULL && node->bus != NULL && !node->down;
}

static void vbus_counts(void *context, struct kl_can_counts *counts) {
    const struct kl_vbus_node *node = context;
    if (node != NULL && counts != NULL) {
        *counts = node->counts;
    }
}

static enum kl_can_status vbus_recover(void *context) {
    struct kl_vbus_node *node = context;
    if (node == NULL) {
        return KL_CAN_ARGUMENT;
    }
    if (strike(node, CALL_RECOVER) != KL_VBUS_NO_FAULT || node->bus == NULL || !node->bus->up) {
        return KL_CAN_DOWN;
    }
    if (node->down) {
        node->down = false;
        node->counts.recoveries++;
    }
    return KL_CAN_OK;
}

static void vbus_close(void *context) {
    struct kl_vbus_node *node = context;
    if (node != NULL && node->bus != NULL) {
        node->bus->nodes[node->index] = NULL;
        node->bus->n_nodes--;
        node->bus = NULL;
    }
}

static const struct kl_can_ops vbus_ops = {
    .send = vbus_send,
    .receive = vbus_receive,
    .is_up = vbus_is_up,
    .counts = vbus_counts,
    .recover = vbus_recover,
    .close = vbus_close,
};

enum kl_can_status kl_vbus_join(struct kl_vbus *bus, struct kl_vbus_node *node,
                                struct kl_can_frame *ring, uint32_t capacity, struct kl_can *can) {
    if (bus == NULL || node == NULL || ring == NULL || capacity == 0 || can == NULL) {
        return KL_CAN_ARGUMENT;
    }
    for (uint32_t i = 0; i < KL_VBUS_MAX_NODES; i++) {
        if (bus->nodes[i] == NULL) {
            *node = (struct kl_vbus_node){
                .bus = bus, .ring = ring, .capacity = capacity, .index = i, .down = !bus->up};
            bus->nodes[i] = node;
            bus->n_nodes++;
            can->ops = &vbus_ops;
            can->context = node;
            return KL_CAN_OK;
        }
    }
    return KL_CAN_REFUSED;
}
