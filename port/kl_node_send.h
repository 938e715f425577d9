/*
 * kl_node_send.h - the sending half of the node: schedule, newest state per identifier,
 * acknowledges. Internal to port/; the rules are told in kl_node.h.
 */
#ifndef KL_NODE_SEND_H
#define KL_NODE_SEND_H

#include "kl_node.h"

/* Lays out the slots of all cyclic messages of node->layout. KL_ERR_CAPACITY: too many. */
enum kl_status kl_node_send_init(struct kl_node *node);

/* Queues an acknowledge; a full ring drops the new one and counts it. */
void kl_node_send_ack(struct kl_node *node, const struct kl_node_ack *ack);

/* Advances the schedule by one cycle: what is due from now on? */
void kl_node_send_tick(struct kl_node *node);

/* Sends acknowledges, then late frames, then those due now, as far as the bus takes them. */
void kl_node_send_all(struct kl_node *node);

#endif
