/*
 * node_bench.h - a node with a small real model on a virtual bus, and the bench on the other end.
 */
#ifndef NODE_BENCH_H
#define NODE_BENCH_H

#include <stdlib.h>
#include <string.h>

#include "kl_node.h"
#include "kl_virtual_bus.h"
#include "klingel.h"

#define BENCH_RING 4096u
#define NODE_RING 256u

struct bench {
    unsigned char *memory;
    bool driven; /* set before the model is made: independent wheels, and a free speed */
    struct kl_model model;
    struct kl_state state;
    struct kl_state snapshot;
    struct kl_input input;
    struct kl_output output;
    struct kl_work work;
    struct kl_vbus bus;
    struct kl_vbus_node ends[2]; /* 0 the node, 1 the bench */
    struct kl_can_frame node_ring[NODE_RING];
    struct kl_can_frame bench_ring[BENCH_RING];
    struct kl_can can; /* the bench's end */
    struct kl_node_config config;
    struct kl_node node;
    uint8_t run_alive;
    uint8_t speed_alive;
    uint8_t force_alive[2];
    uint8_t drive_alive;
    uint8_t draw_alive;
    uint8_t request;
    /* what the bench has seen */
    uint64_t seen[KL_MESSAGES][64];
    uint64_t gaps; /* of the loss counters, frames missing */
    uint16_t counter[KL_MESSAGES][64];
    struct kl_can_frame last[KL_MESSAGES][64];
    uint64_t acks;
    uint64_t foreign;
};

/* A restrained wheelset with a body, on straight track. */
static inline enum kl_status bench_model(struct bench *b) {
    static const struct kl_body_def body = {.name = "body",
                                            .mass_kg = 10000,
                                            .inertia_kgm2 = {10000, 100000, 100000},
                                            .z_m = (kl_real)-1.5,
                                            .freedoms = KL_HAS(KL_Y) | KL_HAS(KL_YAW)};
    static const struct kl_wheelset_def wheelset = {
        .name = "wheelset",
        .mass_kg = 1250,
        .inertia_roll_kgm2 = 700,
        .inertia_spin_kgm2 = 100,
        .inertia_yaw_kgm2 = 700,
        .load_N = 50000,
        .creep = {.law = KL_CREEP_LINEAR, .f11_N = (kl_real)7.44e6, .f22_N = (kl_real)6.79e6}};
    /* the wheelset's own restraint is one of Wickens', stable below 75 m/s; the body rides along */
    static const struct kl_element_def springs[] = {{.name = "restraint",
                                                     .end_a = KL_WHEELSET_END(0),
                                                     .end_b = KL_GROUND_END,
                                                     .point_a_m = {0, 0, (kl_real)-0.45},
                                                     .point_b_m = {0, 0, (kl_real)-0.45},
                                                     .k = {0, 230000, 0, 0, 0, 2500000}},
                                                    {.name = "body to wheelset",
                                                     .end_a = 0,
                                                     .end_b = KL_WHEELSET_END(0),
                                                     .point_a_m = {0, 0, (kl_real)-0.45},
                                                     .point_b_m = {0, 0, (kl_real)-0.45},
                                                     .k = {0, 10000, 0, 0, 0, 10000},
                                                     .c = {0, 1000, 0, 0, 0, 1000},
                                                     .along = KL_ALONG_YAW,
                                                     .actuator = 2},
                                                    {.name = "body to ground",
                                                     .end_a = 0,
                                                     .end_b = KL_GROUND_END,
                                                     .point_a_m = {0, 0, (kl_real)-1.5},
                                                     .point_b_m = {0, 0, (kl_real)-1.5},
                                                     .k = {0, 100000, 0, 0, 0, 1000000},
                                                     .c = {0, 10000, 0, 0, 0, 10000},
                                                     .along = KL_ALONG_Y,
                                                     .actuator = 1}};
    static const struct kl_pair_def pair = {.kind = KL_PAIR_LINEAR,
                                            .radius_m = (kl_real)0.45,
                                            .half_base_m = (kl_real)0.7452,
                                            .conicity = (kl_real)0.1144,
                                            .curvature_1_m = 1,
                                            .material = {(kl_real)82e9, (kl_real)0.28},
                                            .step_m = (kl_real)1e-4,
                                            .range_m = (kl_real)0.02};
    static const struct kl_track_def track = {0};
    static const struct kl_vehicle_def vehicle = {.name = "bench",
                                                  .step_ns = 1000000,
                                                  .gravity_m_s2 = (kl_real)9.81,
                                                  .acceleration_limit_m_s2 = 1,
                                                  .n_bodies = 1,
                                                  .n_wheelsets = 1,
                                                  .n_elements = 3,
                                                  .n_pairs = 1,
                                                  .bodies = &body,
                                                  .wheelsets = &wheelset,
                                                  .elements = springs,
                                                  .pairs = &pair,
                                                  .track = &track};
    struct kl_wheelset_def split = wheelset;
    struct kl_vehicle_def driven = vehicle;
    const size_t size = 4u << 20;
    struct kl_arena arena;
    b->memory = malloc(size);
    kl_arena_init(&arena, b->memory, size);
    if (!b->driven) {
        return kl_build(&vehicle, &arena, &b->model, NULL);
    }
    split.independent = 1;
    driven.wheelsets = &split;
    driven.running.free = 1;
    return kl_build(&driven, &arena, &b->model, NULL);
}

/* Everything but the node, which takes the config from here. */
static inline struct bench *bench_new_of(bool driven) {
    struct bench *b = calloc(1, sizeof *b);
    if (b == NULL) {
        abort();
    }
    b->driven = driven;
    if (bench_model(b) != KL_OK) {
        abort();
    }
    kl_vbus_init(&b->bus);
    kl_input_init(&b->input);
    b->config = (struct kl_node_config){.model = &b->model,
                                        .state = &b->state,
                                        .input = &b->input,
                                        .output = &b->output,
                                        .snapshot = &b->snapshot,
                                        .work = &b->work,
                                        .start_speed_m_s = 20};
    kl_vbus_join(&b->bus, &b->ends[0], b->node_ring, NODE_RING, &b->config.can);
    kl_vbus_join(&b->bus, &b->ends[1], b->bench_ring, BENCH_RING, &b->can);
    return b;
}

static inline struct bench *bench_new(void) {
    return bench_new_of(false);
}

static inline struct bench *bench_start_of(bool driven) {
    struct bench *b = bench_new_of(driven);
    if (kl_node_init(&b->node, &b->config) != KL_OK) {
        abort();
    }
    return b;
}

static inline struct bench *bench_start(void) {
    return bench_start_of(false);
}

static inline void bench_free(struct bench *b) {
    free(b->memory);
    free(b);
}

static inline const struct kl_signal *signal_named(enum kl_message_index message,
                                                   const char *name) {
    const struct kl_signal *signal = kl_signal_find(&kl_signal_messages()[message], name);
    if (signal == NULL) {
        abort();
    }
    return signal;
}

/* The raw value of a signal in the last frame of a message. */
static inline int64_t seen_raw(const struct bench *b, enum kl_message_index message,
                               uint32_t instance, const char *name) {
    return kl_signal_extract(signal_named(message, name), b->last[message][instance].data);
}

/* Takes everything that waits at the bench's end, and watches the loss counters. */
static inline void bench_listen(struct bench *b) {
    struct kl_can_frame frame;
    uint32_t i;
    uint32_t k;
    while (kl_can_receive(&b->can, &frame) == KL_CAN_OK) {
        if (!kl_message_find(&b->node.layout, frame.id, &i, &k)) {
            b->foreign++;
            continue;
        }
        if (i == KL_MSG_ACK) {
            b->acks++;
        } else {
            uint16_t counter = (uint16_t)(frame.data[0] | (frame.data[1] << 8));
            uint16_t expected = (uint16_t)(b->seen[i][k] == 0 ? 0 : b->counter[i][k] + 1);
            b->gaps += (uint16_t)(counter - expected);
            b->counter[i][k] = counter;
        }
        b->seen[i][k]++;
        b->last[i][k] = frame;
    }
}

static inline struct kl_can_frame command_frame(struct bench *b, enum kl_message_index message,
                                                struct kl_bus_command command) {
    const struct kl_message *m = &kl_signal_messages()[message];
    const struct kl_bus_view view = {.command = &command};
    struct kl_can_frame frame;
    kl_message_encode(m, 0, &view, NULL, &frame);
    kl_protect_seal(m->data_id, message == KL_MSG_RUN_CONTROL ? &b->run_alive : &b->speed_alive,
                    frame.data, frame.length);
    return frame;
}

static inline void bench_command(struct bench *b, uint32_t command, uint32_t argument) {
    struct kl_can_frame frame = command_frame(
        b, KL_MSG_RUN_CONTROL,
        (struct kl_bus_command){
            .command = command, .request_id = ++b->request & 0xFFu, .argument = argument});
    kl_can_send(&b->can, &frame);
}

static inline void bench_speed(struct bench *b, double speed_m_s, uint32_t control) {
    struct kl_can_frame frame =
        command_frame(b, KL_MSG_SPEED_SETPOINT,
                      (struct kl_bus_command){.control = control, .speed_m_s = (kl_real)speed_m_s});
    kl_can_send(&b->can, &frame);
}

/* A protected command of one instance. */
static inline struct kl_can_frame instance_frame(enum kl_message_index message, uint32_t i,
                                                 const struct kl_bus_command *command,
                                                 uint8_t *alive) {
    const struct kl_message *m = &kl_signal_messages()[message];
    const struct kl_bus_view view = {.command = command};
    struct kl_can_frame frame;
    kl_message_encode(m, i, &view, NULL, &frame);
    kl_protect_seal((uint16_t)(m->data_id + i), alive, frame.data, frame.length);
    return frame;
}

/* To actuator i of the model's two: 0 pushes the body aside, 1 turns it. */
static inline struct kl_can_frame force_frame(struct bench *b, uint32_t i, double force_N,
                                              uint32_t control) {
    const struct kl_bus_command command = {.control = control, .actuator_N = (kl_real)force_N};
    return instance_frame(KL_MSG_ACTUATOR, i, &command, &b->force_alive[i]);
}

static inline void bench_drive(struct bench *b, double torque_Nm, double twist_Nm,
                               uint32_t control) {
    const struct kl_bus_command command = {
        .control = control, .torque_Nm = (kl_real)torque_Nm, .twist_Nm = (kl_real)twist_Nm};
    struct kl_can_frame frame = instance_frame(KL_MSG_WHEELSET_DRIVE, 0, &command, &b->drive_alive);
    kl_can_send(&b->can, &frame);
}

static inline void bench_draw(struct bench *b, double draw_N, uint32_t control) {
    const struct kl_bus_command command = {.control = control, .draw_N = (kl_real)draw_N};
    struct kl_can_frame frame = instance_frame(KL_MSG_DRAW_FORCE, 0, &command, &b->draw_alive);
    kl_can_send(&b->can, &frame);
}

static inline void bench_force(struct bench *b, uint32_t i, double force_N, uint32_t control) {
    struct kl_can_frame frame = force_frame(b, i, force_N, control);
    kl_can_send(&b->can, &frame);
}

static inline void bench_cycles(struct bench *b, unsigned n) {
    for (unsigned i = 0; i < n; i++) {
        kl_vbus_tick(&b->bus);
        kl_node_cycle(&b->node, NULL);
        bench_listen(b);
    }
}

/* Sends a command, runs one cycle and returns the result acknowledged; -1 without an answer. */
static inline int64_t bench_ask(struct bench *b, uint32_t command, uint32_t argument) {
    uint64_t acks = b->acks;
    bench_command(b, command, argument);
    bench_cycles(b, 1);
    if (b->acks != acks + 1 || seen_raw(b, KL_MSG_ACK, 0, "RequestId") != b->request) {
        return -1;
    }
    return seen_raw(b, KL_MSG_ACK, 0, "Result");
}

#endif
