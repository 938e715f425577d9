/* The vehicle as a node on the bus; see kl_node.h. Sending is in kl_node_send.c. */
#include "kl_node.h"
#include "kl_node_send.h"
#include "klingel.h"

/* ---- forces and torques ---- */

/* Their number, and the one of number i: actuators, then wheelsets, then the train. */
static uint32_t n_forces(const struct kl_node *node) {
    return node->layout.n_actuators + node->layout.n_wheelsets +
           (node->layout.free_speed ? 1u : 0u);
}

struct force {
    struct kl_node_watch *watch;
    enum kl_message_index message;
    uint32_t instance;
};

static struct force force_of(struct kl_node *node, uint32_t i) {
    const struct kl_layout *layout = &node->layout;
    if (i < layout->n_actuators) {
        return (struct force){&node->actuator[i], KL_MSG_ACTUATOR, i};
    }
    i -= layout->n_actuators;
    if (i < layout->n_wheelsets) {
        return (struct force){&node->drive[i], KL_MSG_WHEELSET_DRIVE, i};
    }
    return (struct force){&node->draw, KL_MSG_DRAW_FORCE, 0};
}

static void put_force(struct kl_node *node, const struct force *force,
                      const struct kl_bus_command *command) {
    struct kl_input *input = node->config.input;
    if (force->message == KL_MSG_ACTUATOR) {
        input->actuator_N[force->instance] = command->actuator_N;
    } else if (force->message == KL_MSG_WHEELSET_DRIVE) {
        input->axle_torque_Nm[force->instance] = command->torque_Nm;
        input->twist_torque_Nm[force->instance] = command->twist_Nm;
    } else {
        input->draw_force_N = command->draw_N;
    }
}

static const struct kl_bus_command safe_force = {.actuator_N = (kl_real)KL_NODE_SAFE_FORCE_N,
                                                 .torque_Nm = (kl_real)KL_NODE_SAFE_FORCE_N,
                                                 .twist_Nm = (kl_real)KL_NODE_SAFE_FORCE_N,
                                                 .draw_N = (kl_real)KL_NODE_SAFE_FORCE_N};

/* ---- the model's state ---- */

static void set_run_state(struct kl_node *node, enum kl_run_state run_state) {
    if (run_state == KL_RUN_FAULT && node->run_state != KL_RUN_FAULT) {
        node->counts.faults++;
    }
    if (run_state != KL_RUN_PAUSED) {
        node->steps_left = 0;
    }
    node->run_state = run_state;
}

static void tell(const struct kl_node *node, enum kl_node_event event) {
    const struct kl_node_observer *observer = &node->config.observer;
    if (observer->told != NULL) {
        observer->told(observer->context, event, node);
    }
}

static enum kl_status load_initial(struct kl_node *node) {
    const struct kl_node_config *config = &node->config;
    enum kl_status loaded = kl_init(config->model, config->state, config->start_s_m,
                                    config->start_speed_m_s, config->work);
    if (loaded == KL_OK) {
        node->output_stale = true;
        if (!node->speed.supervised) {
            config->input->speed_m_s = config->start_speed_m_s;
        }
        for (uint32_t i = 0; i < n_forces(node); i++) {
            const struct force force = force_of(node, i);
            if (!force.watch->supervised) {
                put_force(node, &force, &safe_force);
            }
        }
    }
    return loaded;
}

/* After a load the outputs are those of the new state, though no step was made. */
static void refresh_output(struct kl_node *node) {
    const struct kl_node_config *config = &node->config;
    if (node->output_stale) {
        kl_observe(config->model, config->state, config->input, config->output, config->work);
        node->output_stale = false;
    }
}

static void step_model(struct kl_node *node) {
    const struct kl_node_config *config = &node->config;
    bool wanted = node->run_state == KL_RUN_RUNNING || node->run_state == KL_RUN_FAULT ||
                  (node->run_state == KL_RUN_PAUSED && node->steps_left > 0);
    if (!wanted) {
        refresh_output(node);
        return;
    }
    tell(node, KL_NODE_STEP);
    uint32_t faults =
        kl_step(config->model, config->state, config->input, config->output, config->work);
    node->output_stale = false;
    node->counts.steps++;
    if (node->steps_left > 0) {
        node->steps_left--;
    }
    if ((faults & KL_FAULTS_HOLD) != 0) {
        set_run_state(node, KL_RUN_FAULT);
    }
}

/* ---- run commands ---- */

static enum kl_ack_result start(struct kl_node *node) {
    if (node->run_state == KL_RUN_FAULT) {
        return KL_ACK_WRONG_STATE;
    }
    if (node->run_state == KL_RUN_STOPPED) {
        if (load_initial(node) != KL_OK) {
            return KL_ACK_NO_MODEL_STATE;
        }
        tell(node, KL_NODE_REPLACED);
    }
    set_run_state(node, KL_RUN_RUNNING);
    return KL_ACK_DONE;
}

static enum kl_ack_result stop(struct kl_node *node) {
    if (node->run_state == KL_RUN_FAULT) {
        return KL_ACK_WRONG_STATE;
    }
    set_run_state(node, KL_RUN_STOPPED);
    return KL_ACK_DONE;
}

static enum kl_ack_result pause(struct kl_node *node) {
    if (node->run_state != KL_RUN_RUNNING && node->run_state != KL_RUN_PAUSED) {
        return KL_ACK_WRONG_STATE;
    }
    set_run_state(node, KL_RUN_PAUSED);
    node->steps_left = 0;
    return KL_ACK_DONE;
}

static enum kl_ack_result step(struct kl_node *node, uint32_t steps) {
    uint32_t more = steps == 0 ? 1 : steps;
    if (node->run_state != KL_RUN_INIT && node->run_state != KL_RUN_PAUSED) {
        return KL_ACK_WRONG_STATE;
    }
    set_run_state(node, KL_RUN_PAUSED);
    node->steps_left = more > UINT32_MAX - node->steps_left ? UINT32_MAX : node->steps_left + more;
    return KL_ACK_DONE;
}

static enum kl_ack_result reset(struct kl_node *node) {
    if (load_initial(node) != KL_OK) {
        return KL_ACK_NO_MODEL_STATE;
    }
    tell(node, KL_NODE_REPLACED);
    set_run_state(node, KL_RUN_INIT);
    return KL_ACK_DONE;
}

static enum kl_ack_result take_snapshot(struct kl_node *node) {
    if (node->run_state == KL_RUN_FAULT) {
        return KL_ACK_WRONG_STATE;
    }
    if (node->config.snapshot == NULL) {
        return KL_ACK_NO_SNAPSHOT;
    }
    *node->config.snapshot = *node->config.state;
    node->has_snapshot = true;
    return KL_ACK_DONE;
}

static enum kl_ack_result restore(struct kl_node *node) {
    if (!node->has_snapshot) {
        return KL_ACK_NO_SNAPSHOT;
    }
    *node->config.state = *node->config.snapshot;
    node->output_stale = true;
    tell(node, KL_NODE_REPLACED);
    if ((node->config.state->faults & KL_FAULTS_HOLD) != 0) {
        set_run_state(node, KL_RUN_FAULT);
    } else if (node->run_state != KL_RUN_RUNNING) {
        set_run_state(node, KL_RUN_PAUSED);
        node->steps_left = 0;
    }
    return KL_ACK_DONE;
}

enum kl_ack_result kl_node_command(struct kl_node *node, enum kl_run_command command,
                                   uint32_t argument) {
    switch (command) {
    case KL_COMMAND_NONE:
        return KL_ACK_DONE;
    case KL_COMMAND_START:
        return start(node);
    case KL_COMMAND_STOP:
        return stop(node);
    case KL_COMMAND_PAUSE:
        return pause(node);
    case KL_COMMAND_STEP:
        return step(node, argument);
    case KL_COMMAND_RESET:
        return reset(node);
    case KL_COMMAND_SNAPSHOT:
        return take_snapshot(node);
    case KL_COMMAND_RESTORE:
        return restore(node);
    }
    return KL_ACK_UNKNOWN_COMMAND;
}

/* ---- frames in ---- */

static bool well_formed(struct kl_node *node, enum kl_message_index index,
                        const struct kl_can_frame *frame) {
    if (frame->flags != 0 || frame->length != kl_signal_messages()[index].length) {
        node->counts.malformed++;
        return false;
    }
    return true;
}

static void take_run_control(struct kl_node *node, const struct kl_can_frame *frame) {
    struct kl_bus_command command = {0};
    enum kl_ack_result result = KL_ACK_REPEATED;
    if (!well_formed(node, KL_MSG_RUN_CONTROL, frame)) {
        return;
    }
    enum kl_protect_result judged =
        kl_protect_check(&node->run_control, frame->data, frame->length);
    if (judged == KL_PROTECT_BAD_CRC || judged == KL_PROTECT_REPEATED) {
        node->counts.protection++;
    }
    if (judged == KL_PROTECT_BAD_CRC ||
        kl_message_decode(&kl_signal_messages()[KL_MSG_RUN_CONTROL], frame, &command) != KL_OK) {
        return;
    }
    if (judged != KL_PROTECT_REPEATED) {
        result = kl_node_command(node, (enum kl_run_command)command.command, command.argument);
    }
    if (result == KL_ACK_DONE) {
        node->counts.run_commands++;
    } else {
        node->counts.run_refused++;
    }
    const struct kl_node_ack ack = {.step = node->config.state->tick,
                                    .request = (uint8_t)command.request_id,
                                    .command = (uint8_t)command.command,
                                    .result = (uint8_t)result,
                                    .run_state = (uint8_t)node->run_state};
    kl_node_send_ack(node, &ack);
}

/* False for a NaN as well. */
static bool speed_in_range(kl_real speed_m_s) {
    return speed_m_s >= 0 && speed_m_s <= (kl_real)KL_MAX_SPEED_M_S;
}

static bool is_finite(kl_real value) {
    return value - value == 0;
}

/* The values of a command; those that its message has not are 0. */
static bool in_range(const struct kl_bus_command *command) {
    return command->control <= 1 && speed_in_range(command->speed_m_s) &&
           is_finite(command->actuator_N) && is_finite(command->torque_Nm) &&
           is_finite(command->twist_Nm) && is_finite(command->draw_N);
}

/* Reads a value's command; true where it is right, and then begins its time again. */
static bool take_command(struct kl_node *node, enum kl_message_index index,
                         struct kl_node_watch *watch, const struct kl_can_frame *frame,
                         struct kl_bus_command *command) {
    if (!well_formed(node, index, frame)) {
        return false;
    }
    enum kl_protect_result judged = kl_protect_check(&watch->protect, frame->data, frame->length);
    if (judged == KL_PROTECT_BAD_CRC || judged == KL_PROTECT_REPEATED) {
        node->counts.protection++;
        return false;
    }
    if (kl_message_decode(&kl_signal_messages()[index], frame, command) != KL_OK ||
        !in_range(command)) {
        node->counts.malformed++;
        return false;
    }
    watch->supervised = command->control == 1;
    watch->late = false;
    watch->wait = 0;
    return true;
}

static void take_setpoint(struct kl_node *node, const struct kl_can_frame *frame) {
    struct kl_bus_command command = {0};
    if (take_command(node, KL_MSG_SPEED_SETPOINT, &node->speed, frame, &command)) {
        node->config.input->speed_m_s = command.speed_m_s;
        node->counts.setpoints++;
    }
}

static void take_force(struct kl_node *node, const struct force *force,
                       const struct kl_can_frame *frame) {
    struct kl_bus_command command = {0};
    if (take_command(node, force->message, force->watch, frame, &command)) {
        put_force(node, force, &command);
        node->counts.forces++;
    }
}

/* True where the safe value steps in. */
static bool becomes_late(struct kl_node *node, struct kl_node_watch *watch) {
    if (!watch->supervised || watch->late) {
        return false;
    }
    watch->late = watch->wait >= watch->timeout;
    node->counts.late += watch->late ? 1u : 0u;
    watch->wait++;
    return watch->late;
}

static void watch_commands(struct kl_node *node) {
    if (becomes_late(node, &node->speed)) {
        node->config.input->speed_m_s = (kl_real)KL_NODE_SAFE_SPEED_M_S;
    }
    for (uint32_t i = 0; i < n_forces(node); i++) {
        const struct force force = force_of(node, i);
        if (becomes_late(node, force.watch)) {
            put_force(node, &force, &safe_force);
        }
    }
}

/* True for a SYNC. */
static bool take_frame(struct kl_node *node, const struct kl_can_frame *frame) {
    uint32_t index = 0;
    uint32_t instance = 0;
    bool standard = (frame->flags & KL_CAN_EXTENDED) == 0;
    node->counts.received++;
    if (frame->id == KL_BUS_SYNC_ID && frame->flags == 0 && frame->length <= KL_CAN_CLASSIC_BYTES) {
        node->counts.syncs++;
        return true;
    }
    if (!standard || !kl_message_find(&node->layout, frame->id, &index, &instance)) {
        node->counts.unknown++;
    } else if (index == KL_MSG_RUN_CONTROL) {
        take_run_control(node, frame);
    } else if (index == KL_MSG_SPEED_SETPOINT) {
        take_setpoint(node, frame);
    } else if (index == KL_MSG_ACTUATOR) {
        const struct force force = force_of(node, instance);
        take_force(node, &force, frame);
    } else if (index == KL_MSG_WHEELSET_DRIVE) {
        const struct force force = force_of(node, node->layout.n_actuators + instance);
        take_force(node, &force, frame);
    } else if (index == KL_MSG_DRAW_FORCE) {
        const struct force force = force_of(node, n_forces(node) - 1u);
        take_force(node, &force, frame);
    } else {
        node->counts.unknown++; /* somebody else sends what only we should */
    }
    return false;
}

/* Fetches what is waiting, in lockstep up to and with the first SYNC. True if there was one. */
static bool take_frames(struct kl_node *node) {
    bool synced = false;
    for (uint32_t i = 0; i < KL_NODE_MAX_RECEIVED; i++) {
        struct kl_can_frame frame;
        enum kl_can_status got = kl_can_receive(&node->config.can, &frame);
        if (got != KL_CAN_OK) {
            node->counts.receive_errors += got == KL_CAN_EMPTY || got == KL_CAN_DOWN ? 0u : 1u;
            break;
        }
        synced = take_frame(node, &frame) || synced;
        if (synced && node->config.lockstep) {
            break;
        }
    }
    return synced;
}

/* ---- the cycle ---- */

static void mind_bus(struct kl_node *node) {
    const struct kl_can *can = &node->config.can;
    kl_can_service(can);
    bool up = kl_can_is_up(can);
    if (!up) {
        if (node->recover_wait == 0) {
            node->counts.recover_calls++;
            up = kl_can_recover(can) == KL_CAN_OK && kl_can_is_up(can);
            node->recover_wait = node->recover_cycles;
        }
        node->recover_wait--;
        node->counts.down_cycles++;
        node->was_down = true;
    }
    if (up && node->was_down) {
        node->counts.recoveries++;
        node->recover_wait = 0;
        node->was_down = false;
    }
    node->bus_down = !up;
}

static void update_status(struct kl_node *node, const struct kl_node_timing *timing) {
    struct kl_bus_status *status = &node->status;
    const struct kl_node_counts *counts = &node->counts;
    status->run_state = node->run_state;
    status->faults = node->config.output->faults;
    status->speed_late = node->speed.late ? 1 : 0;
    status->speed_control = node->speed.supervised ? 1 : 0;
    status->actuator_late = 0;
    status->actuator_control = 0;
    for (uint32_t i = 0; i < n_forces(node); i++) {
        const struct kl_node_watch *watch = force_of(node, i).watch;
        status->actuator_late |= watch->late ? 1u : 0u;
        status->actuator_control |= watch->supervised ? 1u : 0u;
    }
    status->has_snapshot = node->has_snapshot ? 1 : 0;
    status->step = node->config.output->tick;
    status->time_us = (uint64_t)(node->config.output->time_ns / 1000);
    status->send_dropped = counts->dropped;
    status->receive_bad = counts->unknown + counts->malformed + counts->protection;
    status->commands_late = counts->late;
    status->saturated = node->codec.saturated;
    status->not_finite = node->codec.not_finite;
    status->recoveries = counts->recoveries;
    if (timing != NULL) {
        status->overruns = timing->overruns;
        status->exec_last_us = (kl_real)timing->exec_last_ns / 1000;
        status->exec_max_us = (kl_real)timing->exec_max_ns / 1000;
    }
}

bool kl_node_cycle(struct kl_node *node, const struct kl_node_timing *timing) {
    uint64_t down_before = node->counts.down_cycles;
    mind_bus(node);
    bool synced = take_frames(node);
    if (node->config.lockstep && !synced) {
        kl_node_send_all(node);
        return false;
    }
    watch_commands(node);
    step_model(node);
    update_status(node, timing);
    node->status.bus_down = node->counts.down_cycles != down_before ? 1 : 0;
    node->counts.cycles++;
    kl_node_send_tick(node);
    kl_node_send_all(node);
    return true;
}

/* ---- preparation ---- */

static enum kl_status check_config(const struct kl_node_config *config) {
    if (config == NULL || config->model == NULL || config->state == NULL || config->input == NULL ||
        config->output == NULL || config->work == NULL || config->can.ops == NULL) {
        return KL_ERR_ARGUMENT;
    }
    const struct kl_can_ops *ops = config->can.ops;
    if (ops->send == NULL || ops->receive == NULL || ops->is_up == NULL || ops->counts == NULL ||
        !speed_in_range(config->start_speed_m_s)) {
        return KL_ERR_ARGUMENT;
    }
    if (config->model->n_bodies > KL_MAX_BODIES || config->model->n_wheelsets > KL_MAX_WHEELSETS) {
        return KL_ERR_CAPACITY;
    }
    return KL_OK;
}

static void init_status(struct kl_node *node) {
    const struct kl_model *model = node->config.model;
    node->status = (struct kl_bus_status){
        .lockstep = node->config.lockstep ? 1 : 0,
        .version = {KL_VERSION_MAJOR, KL_VERSION_MINOR, KL_VERSION_PATCH},
        .protocol = KL_BUS_PROTOCOL,
        .n_bodies = model->n_bodies,
        .n_wheelsets = model->n_wheelsets,
        .model_hash = model->hash,
        .signal_hash = kl_signals_hash(&node->layout),
    };
}

static void init_watch(const struct kl_node *node, struct kl_node_watch *watch,
                       enum kl_message_index index, uint32_t instance) {
    const struct kl_message *message = &kl_signal_messages()[index];
    kl_protect_init(&watch->protect, (uint16_t)(message->data_id + instance));
    watch->timeout = message->timeout_cycles * kl_message_cycles(&node->layout, message);
}

static void init_watches(struct kl_node *node) {
    uint64_t step_ns = (uint64_t)node->layout.step_ns;
    kl_protect_init(&node->run_control, kl_signal_messages()[KL_MSG_RUN_CONTROL].data_id);
    init_watch(node, &node->speed, KL_MSG_SPEED_SETPOINT, 0);
    for (uint32_t i = 0; i < n_forces(node); i++) {
        const struct force force = force_of(node, i);
        init_watch(node, force.watch, force.message, force.instance);
    }
    node->recover_cycles = (uint32_t)(UINT64_C(1000) * KL_NODE_RECOVER_US / step_ns);
    if (node->recover_cycles < 1) {
        node->recover_cycles = 1;
    }
}

/* The inputs that the model's actuators read. */
static uint32_t count_actuators(const struct kl_model *model) {
    uint32_t n = 0;
    for (uint32_t i = 0; i < model->struts.n_actuators; i++) {
        n = model->struts.input[i] >= n ? model->struts.input[i] + 1u : n;
    }
    return n;
}

enum kl_status kl_node_init(struct kl_node *node, const struct kl_node_config *config) {
    enum kl_status done = node == NULL ? KL_ERR_ARGUMENT : check_config(config);
    if (done != KL_OK) {
        return done;
    }
    *node = (struct kl_node){.config = *config};
    node->layout =
        (struct kl_layout){.n_bodies = config->model->n_bodies,
                           .n_wheelsets = config->model->n_wheelsets,
                           .n_actuators = count_actuators(config->model),
                           .free_speed = config->model->running.free != 0,
                           .independent = config->model->n_twists > 0,
                           .step_ns = config->model->step_ns,
                           .state_divider = config->state_divider == 0 ? 1 : config->state_divider};
    done = kl_bus_load(&node->layout, config->bit_rate, &node->load);
    if (done == KL_OK && node->load.verdict == KL_LOAD_EXCEEDED) {
        done = KL_ERR_VALUE;
    }
    if (done == KL_OK) {
        done = kl_node_send_init(node);
    }
    if (done == KL_OK) {
        done = load_initial(node);
    }
    if (done != KL_OK) {
        return done;
    }
    init_status(node);
    init_watches(node);
    refresh_output(node);
    set_run_state(node, config->start_running ? KL_RUN_RUNNING : KL_RUN_INIT);
    update_status(node, NULL);
    return KL_OK;
}
