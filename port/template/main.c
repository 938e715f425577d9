/*
 * main.c - the firmware: one vehicle as a node on an slcan wire, stepped by a timer. The same for
 * every board; what differs stands behind board.h.
 *
 * The model is constant data, written by `klingel build` and linked into flash. At each tick: bytes
 * of the wire become commands, the model makes its step, states become bytes (kl_node.h). Ticks
 * that were missed are counted as overruns and left out, as `klingel hil --policy skip` does.
 * Nothing on the wire changes when a step is made or what it computes, but for commands that
 * arrived whole and right.
 *
 * Set with -D:
 *     KL_FIRMWARE_MODEL          name of the model (needed)
 *     KL_FIRMWARE_SPEED_M_S      speed at the start and first set-point; 0
 *     KL_FIRMWARE_PLACE_M        where on the track to start; 0
 *     KL_FIRMWARE_STATE_DIVIDER  states go out so many times more slowly; 20
 *     KL_FIRMWARE_RX_BYTES, _TX_BYTES  rings, powers of two; 512 and 4096
 */
#include "board.h"
#include "kl_node.h"
#include "kl_slcan_link.h"
#include "klingel.h"

#ifndef KL_FIRMWARE_SPEED_M_S
#define KL_FIRMWARE_SPEED_M_S 0
#endif
#ifndef KL_FIRMWARE_PLACE_M
#define KL_FIRMWARE_PLACE_M 0
#endif
#ifndef KL_FIRMWARE_STATE_DIVIDER
#define KL_FIRMWARE_STATE_DIVIDER 20
#endif
#ifndef KL_FIRMWARE_RX_BYTES
#define KL_FIRMWARE_RX_BYTES 512
#endif
#ifndef KL_FIRMWARE_TX_BYTES
#define KL_FIRMWARE_TX_BYTES 4096
#endif
#define RECEIVED_FRAMES 16

extern const struct kl_model KL_FIRMWARE_MODEL;

/* All memory there is; a debugger finds it here. */
struct firmware {
    struct kl_state state;
    struct kl_state snapshot;
    struct kl_input input;
    struct kl_output output;
    struct kl_work work;
    struct kl_node node;
    struct kl_slcan_link link;
    struct board_wire wire;
    struct kl_can_frame queue[RECEIVED_FRAMES];
    unsigned char rx_bytes[KL_FIRMWARE_RX_BYTES];
    unsigned char tx_bytes[KL_FIRMWARE_TX_BYTES];
};
struct firmware firmware;
extern struct firmware firmware;

static enum kl_status prepare(struct firmware *f) {
    const struct kl_slcan_link_config wire = {.rx = &f->wire.rx,
                                              .tx = &f->wire.tx,
                                              .kick = board_kick,
                                              .queue = f->queue,
                                              .queue_frames = RECEIVED_FRAMES};
    const struct kl_node_config config = {.model = &KL_FIRMWARE_MODEL,
                                          .state = &f->state,
                                          .input = &f->input,
                                          .output = &f->output,
                                          .snapshot = &f->snapshot,
                                          .work = &f->work,
                                          .can = kl_slcan_link_can(&f->link),
                                          .start_s_m = (kl_real)KL_FIRMWARE_PLACE_M,
                                          .start_speed_m_s = (kl_real)KL_FIRMWARE_SPEED_M_S,
                                          .state_divider = KL_FIRMWARE_STATE_DIVIDER};
    if (!kl_ring_init(&f->wire.rx, f->rx_bytes, sizeof f->rx_bytes) ||
        !kl_ring_init(&f->wire.tx, f->tx_bytes, sizeof f->tx_bytes) ||
        kl_slcan_link_init(&f->link, &wire) != KL_CAN_OK) {
        return KL_ERR_ARGUMENT;
    }
    /* flash may hold a model of another build, or be worn */
    enum kl_status status = kl_model_check(&KL_FIRMWARE_MODEL);
    kl_input_init(&f->input);
    return status == KL_OK ? kl_node_init(&f->node, &config) : status;
}

int main(void) {
    struct firmware *f = &firmware;
    struct kl_node_timing timing = {0};
    enum kl_status status = prepare(f);
    if (status != KL_OK) {
        board_give_up(status);
    }
    if (!board_start(&f->wire, KL_FIRMWARE_MODEL.step_ns)) {
        board_give_up(-100);
    }
    for (;;) {
        timing.overruns += board_wait_for_tick() - 1u;
        kl_slcan_link_set_time(&f->link, (uint64_t)f->output.time_ns / 1000000u);
        (void)kl_node_cycle(&f->node, &timing);
        timing.exec_last_ns = board_since_tick_ns();
        if (timing.exec_last_ns > timing.exec_max_ns) {
            timing.exec_max_ns = timing.exec_last_ns;
        }
    }
}
