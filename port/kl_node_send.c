/* Schedule and sending of the node; see kl_node_send.h. */
#include "kl_node_send.h"

static enum kl_status add_slots(struct kl_node *node, uint32_t index) {
    const struct kl_message *message = &kl_signal_messages()[index];
    uint32_t cycles = kl_message_cycles(&node->layout, message);
    uint32_t n = kl_message_instances(&node->layout, message);
    if (cycles == 0 || message->sender != KL_SENT_BY_NODE) {
        return KL_OK;
    }
    for (uint32_t k = 0; k < n; k++) {
        uint32_t slower = 0; /* than one cycle: they share out the phases among them */
        if (node->n_slots == KL_NODE_SLOTS) {
            return KL_ERR_CAPACITY;
        }
        for (uint32_t i = 0; i < node->n_slots; i++) {
            slower += node->slots[i].cycles > 1 ? 1u : 0u;
        }
        node->slots[node->n_slots++] = (struct kl_node_slot){.cycles = cycles,
                                                             .wait = slower % cycles,
                                                             .counter = UINT16_MAX,
                                                             .message = (uint8_t)index,
                                                             .instance = (uint8_t)k,
                                                             .turn = KL_TURN_NONE};
    }
    return KL_OK;
}

enum kl_status kl_node_send_init(struct kl_node *node) {
    node->n_slots = 0;
    for (uint32_t i = 0; i < KL_MESSAGES; i++) {
        enum kl_status added = add_slots(node, i);
        if (added != KL_OK) {
            return added;
        }
    }
    return KL_OK;
}

void kl_node_send_ack(struct kl_node *node, const struct kl_node_ack *ack) {
    if (node->n_acks == KL_NODE_ACKS) {
        node->counts.dropped++;
        return;
    }
    node->acks[(node->ack_head + node->n_acks) % KL_NODE_ACKS] = *ack;
    node->n_acks++;
}

void kl_node_send_tick(struct kl_node *node) {
    for (uint32_t i = 0; i < node->n_slots; i++) {
        struct kl_node_slot *slot = &node->slots[i];
        if (slot->wait > 0) {
            slot->wait--;
            continue;
        }
        slot->wait = slot->cycles - 1;
        slot->counter = (uint16_t)(slot->counter + 1u);
        if (slot->turn == KL_TURN_NONE) {
            slot->turn = KL_TURN_NOW;
        } else {
            node->counts.dropped++; /* the frame before never went out */
        }
    }
}

/* Hands a frame over and keeps the books. */
static enum kl_can_status hand_over(struct kl_node *node, const struct kl_can_frame *frame) {
    enum kl_can_status sent = kl_can_send(&node->config.can, frame);
    switch (sent) {
    case KL_CAN_OK:
        node->counts.sent++;
        break;
    case KL_CAN_BUSY:
        node->counts.busy++;
        break;
    case KL_CAN_DOWN:
        node->bus_down = true;
        node->counts.send_errors++;
        break;
    default:
        node->counts.send_errors++;
        break;
    }
    return sent;
}

static struct kl_bus_view view_of(const struct kl_node *node, uint32_t counter) {
    return (struct kl_bus_view){
        .output = node->config.output, .status = &node->status, .counter = counter};
}

static enum kl_can_status send_ack(struct kl_node *node, const struct kl_node_ack *ack) {
    struct kl_bus_status status = node->status;
    struct kl_bus_view view = view_of(node, 0);
    struct kl_can_frame frame;
    status.ack_request = ack->request;
    status.ack_command = ack->command;
    status.ack_result = ack->result;
    status.run_state = ack->run_state;
    status.step = ack->step;
    view.status = &status;
    kl_message_encode(&kl_signal_messages()[KL_MSG_ACK], 0, &view, &node->codec, &frame);
    return hand_over(node, &frame);
}

static void drop_acks(struct kl_node *node) {
    node->counts.dropped += node->n_acks;
    node->n_acks = 0;
}

/* Until there are none, or the bus has no room. */
static void send_acks(struct kl_node *node) {
    for (uint32_t i = 0; i < KL_NODE_ACKS && node->n_acks > 0 && !node->bus_down; i++) {
        enum kl_can_status sent = send_ack(node, &node->acks[node->ack_head]);
        if (sent == KL_CAN_BUSY) {
            return;
        }
        node->counts.dropped += sent == KL_CAN_OK ? 0u : 1u;
        node->ack_head = (node->ack_head + 1u) % KL_NODE_ACKS;
        node->n_acks--;
    }
}

static enum kl_can_status send_slot(struct kl_node *node, const struct kl_node_slot *slot) {
    struct kl_bus_view view = view_of(node, slot->counter);
    struct kl_can_frame frame;
    kl_message_encode(&kl_signal_messages()[slot->message], slot->instance, &view, &node->codec,
                      &frame);
    return hand_over(node, &frame);
}

/* One pass over the slots whose turn it is in this way, from the first one that was refused last
 * time, so that a bus that is too slow serves all of them in turn. Frames that find no room stay as
 * they are. */
static void send_slots(struct kl_node *node, enum kl_node_turn turn, uint32_t *refused) {
    uint32_t first = node->first_slot;
    for (uint32_t i = 0; i < node->n_slots; i++) {
        uint32_t at = first + i < node->n_slots ? first + i : first + i - node->n_slots;
        struct kl_node_slot *slot = &node->slots[at];
        if (node->bus_down || *refused >= KL_NODE_BUSY_LIMIT) {
            return;
        }
        if (slot->turn != turn) {
            continue;
        }
        enum kl_can_status sent = send_slot(node, slot);
        if (sent == KL_CAN_BUSY) {
            node->first_slot = *refused == 0 ? at : node->first_slot;
            (*refused)++;
            continue;
        }
        node->counts.dropped += sent == KL_CAN_OK ? 0u : 1u;
        slot->turn = KL_TURN_NONE;
    }
}

/* What is left waits for the next cycle; on a bus that is down it is lost. */
static void settle(struct kl_node *node) {
    for (uint32_t i = 0; i < node->n_slots; i++) {
        struct kl_node_slot *slot = &node->slots[i];
        if (slot->turn == KL_TURN_NONE) {
            continue;
        }
        slot->turn = node->bus_down ? KL_TURN_NONE : KL_TURN_LATE;
        node->counts.dropped += node->bus_down ? 1u : 0u;
    }
    if (node->bus_down) {
        drop_acks(node);
    }
}

void kl_node_send_all(struct kl_node *node) {
    uint32_t refused = 0;
    if (!node->bus_down) {
        send_acks(node);
        send_slots(node, KL_TURN_LATE, &refused);
        send_slots(node, KL_TURN_NOW, &refused);
    }
    settle(node);
}
