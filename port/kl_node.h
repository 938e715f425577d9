/*
 * kl_node.h - the vehicle as a node on the bus: commands in, steps, states out.
 *
 * One cycle (kl_node_cycle) is, in this order:
 *   1. bus        service the back end; if it is down, ask it to recover at a modest rate
 *   2. commands   fetch at most KL_NODE_MAX_RECEIVED frames; carry out what is right, count the
 * rest
 *   3. watch      a command that is late is replaced by its safe value
 *   4. model      at most one kl_step, when the run state wants one
 *   5. states     send what is due in this cycle, and what the bus had no room for before
 * A caller with a clock calls it once per step; in lockstep it does step 3 to 5 only when a SYNC
 * frame arrived, and takes no frame after that SYNC, so that the order on the bus alone decides
 * what happens: same bus traffic, same bits, at any speed.
 *
 * Run states (enum kl_run_state) and commands:
 *   INIT     the initial state is loaded; cyclic frames are sent, time stands
 *   start    INIT, PAUSED: run on. STOPPED: load the initial state and run. FAULT: refused
 *   pause    RUNNING: PAUSED; n steps still to do are dropped
 *   step n   INIT, PAUSED: do n steps, one per cycle, then PAUSED. Refused elsewhere
 *   stop     any but FAULT: STOPPED, the last state is held
 *   reset    any: load the initial state, faults clear, INIT. The snapshot stays
 *   snapshot any but FAULT: copy the state
 *   restore  any: copy the state back, with the faults it had; RUNNING stays RUNNING, others become
 *            PAUSED (FAULT if the snapshot holds one)
 * A latched holding fault (KL_FAULTS_HOLD) makes it FAULT: the core holds the motion and goes on
 * counting steps, and so do we. Pause, stop, reset and restore all leave the bus schedule alone:
 * counters of cyclic frames never jump. Every RunControl frame with a right CRC is answered by Ack;
 * a repeated one is answered but not carried out; the first frame and one after a gap are.
 *
 * Set-point. SpeedSetpoint with control 1 takes the speed over and starts its supervision: no right
 * frame for timeout_cycles periods (5 x 100 ms) and the SAFE VALUE holds: set-point 0 m/s, so that
 * the vehicle brakes to a stand at the model's acceleration limit. Status then shows SpeedLate, and
 * the events are counted. The next right frame ends it. Control 0 sets the speed once and ends the
 * supervision: for tools that do not stay. Before the first frame the caller's own kl_input rules.
 * A speed that is invalid or above KL_MAX_SPEED_M_S counts as a bad frame and changes nothing.
 * Supervision runs in cycles, in every run state. Reset and start put the speed set-point back to
 * the configured one, but a supervised set-point stays in force.
 *
 * Forces and torques. Actuator# frames set kl_input's actuator_N in just the same way, Wheelset#Drive
 * frames axle_torque_Nm and twist_torque_Nm, and DrawForce, where the speed is free, draw_force_N; each
 * with a supervision of its own: late after 5 periods (50 ms, DrawForce 500 ms), safe value 0. They are
 * limited by the model (actuators to 1e7 N). Reset and start put those that are not supervised to 0.
 * StatusBus tells whether any is late or supervised.
 *
 * Sending. A message of period n cycles goes out in the cycles whose number is its phase modulo n;
 * phases 0, 1, 2, ... are given out in the table's order to all messages slower than one cycle, so
 * that these spread evenly. BUSY: the message is marked, and the NEWEST state is sent in its place
 * in the next cycle, marked ones first, in turn; if its next turn comes before that, one drop is
 * counted. After KL_NODE_BUSY_LIMIT refusals in one cycle the rest is marked unsent. DOWN:
 * everything due is dropped and counted, nothing is kept. Acknowledges wait in a ring of
 * KL_NODE_ACKS.
 *
 * Nothing received and nothing that the bus does changes the number of model steps in real time.
 * The node owns no memory besides its struct, uses no heap and no clock, and is not for several
 * threads at once. Per cycle: one service, one recover, KL_NODE_MAX_RECEIVED receives (each may ask
 * for one kl_init or one copy of the state), one kl_step or one kl_observe, KL_NODE_ACKS sends plus
 * one per instance.
 */
#ifndef KL_NODE_H
#define KL_NODE_H

#include "kl_can.h"
#include "kl_protect.h"
#include "kl_signals.h"

#ifdef __cplusplus
extern "C" {
#endif

#define KL_NODE_MAX_RECEIVED 64u   /* frames fetched per cycle */
#define KL_NODE_BUSY_LIMIT 8u      /* refused sends per cycle after which the rest waits */
#define KL_NODE_ACKS 16u           /* acknowledges waiting to go out */
#define KL_NODE_RECOVER_US 100000u /* between two attempts to recover a bus that is down */
#define KL_NODE_SAFE_SPEED_M_S 0.0 /* set-point when commands are late */
#define KL_NODE_SAFE_FORCE_N 0.0   /* of forces and torques, likewise */

/* Most instances of cyclic messages of the largest vehicle. */
#define KL_NODE_SLOTS (10u + 3u * KL_MAX_BODIES + 3u * KL_MAX_WHEELSETS + 10u * KL_MAX_WHEELSETS)

struct kl_node;

/* What happens to the state, told in this order as it happens: all that a recorder needs in order to
 * have the same steps done again. */
enum kl_node_event {
    KL_NODE_REPLACED = 0, /* the state is another: loaded or restored */
    KL_NODE_STEP = 1      /* the state is about to be stepped with node->config.input */
};

/* Called inside kl_node_cycle and kl_node_command: it must not block, and its time is the cycle's. It
 * changes nothing of what the node points to. */
struct kl_node_observer {
    void (*told)(void *context, enum kl_node_event event, const struct kl_node *node);
    void *context;
};

/* All pointers stay the caller's and must outlive the node. */
struct kl_node_config {
    const struct kl_model *model;
    struct kl_state *state;    /* loaded by kl_node_init */
    struct kl_input *input;    /* initialised by the caller; speed_m_s becomes start_speed_m_s */
    struct kl_output *output;  /* always holds the outputs of the current state */
    struct kl_state *snapshot; /* NULL: snapshot and restore are refused */
    struct kl_work *work;      /* scratch; nodes of one thread can share it */
    struct kl_can can;
    kl_real start_s_m;
    kl_real start_speed_m_s;          /* initial speed and set-point, 0..KL_MAX_SPEED_M_S */
    uint32_t state_divider;           /* see struct kl_layout; 0 counts as 1 */
    uint32_t bit_rate;                /* for the load check; 0: unlimited */
    bool lockstep;                    /* one step per SYNC */
    bool start_running;               /* begin in RUNNING instead of INIT */
    struct kl_node_observer observer; /* told NULL: none. The load of kl_node_init is not told */
};

/* From the real-time layer, about the cycles before this one. */
struct kl_node_timing {
    uint64_t overruns;
    uint64_t exec_last_ns;
    uint64_t exec_max_ns;
};

/* Everything is counted since kl_node_init. */
struct kl_node_counts {
    uint64_t cycles;
    uint64_t steps;          /* model steps done, over all runs */
    uint64_t syncs;          /* SYNC frames seen */
    uint64_t sent;           /* frames the back end took */
    uint64_t dropped;        /* due frames that did not go out, acknowledges included */
    uint64_t busy;           /* sends answered BUSY */
    uint64_t send_errors;    /* sends answered DOWN, REFUSED or FAILED */
    uint64_t received;       /* frames fetched */
    uint64_t receive_errors; /* receives answered with an error other than DOWN */
    uint64_t unknown;        /* identifiers that are no command */
    uint64_t malformed;  /* command frames of wrong length or kind, or with a value out of range */
    uint64_t protection; /* command frames with a bad CRC or repeated */
    uint64_t run_commands; /* RunControl frames carried out */
    uint64_t run_refused;  /* RunControl frames refused */
    uint64_t setpoints;    /* SpeedSetpoint frames in force */
    uint64_t forces;       /* Actuator, Wheelset#Drive and DrawForce frames in force */
    uint64_t late;         /* times that the safe value stepped in */
    uint64_t faults;       /* times that the run state became FAULT */
    uint64_t down_cycles;  /* cycles that found the bus down */
    uint64_t recover_calls;
    uint64_t recoveries; /* cycles that found the bus up again */
};

/* One instance of a cyclic message. */
struct kl_node_slot {
    uint32_t cycles;  /* period */
    uint32_t wait;    /* cycles until its next turn */
    uint16_t counter; /* of the frame whose turn it is, or was last */
    uint8_t message;  /* index into the table */
    uint8_t instance;
    uint8_t turn; /* enum kl_node_turn */
};
enum kl_node_turn {
    KL_TURN_NONE = 0, /* nothing to send */
    KL_TURN_NOW = 1,  /* due in this cycle */
    KL_TURN_LATE = 2  /* was due before, the bus had no room */
};

/* A commanded value: its protection, and whether it keeps coming. */
struct kl_node_watch {
    struct kl_protect protect;
    bool supervised;
    bool late;
    uint32_t wait;    /* cycles since the last right frame */
    uint32_t timeout; /* cycles */
};

struct kl_node_ack {
    uint64_t step;
    uint8_t request;
    uint8_t command;
    uint8_t result;
    uint8_t run_state;
};

/* 4.1 KB with 8 bodies, wheelsets and actuators; fields are for reading. */
struct kl_node {
    struct kl_node_config config;
    struct kl_layout layout;
    struct kl_bus_load load;
    struct kl_bus_status status;
    struct kl_node_counts counts;
    struct kl_codec_counts codec;
    struct kl_protect run_control;
    struct kl_node_watch speed;
    struct kl_node_watch actuator[KL_MAX_ACTUATORS];
    struct kl_node_watch drive[KL_MAX_WHEELSETS];
    struct kl_node_watch draw;
    enum kl_run_state run_state;
    uint32_t steps_left; /* of step commands */
    bool output_stale;   /* the state was loaded, the output is not yet its own */
    bool has_snapshot;
    bool bus_down;         /* in this cycle */
    bool was_down;         /* and not yet recovered */
    uint32_t recover_wait; /* cycles until the next attempt */
    uint32_t recover_cycles;
    uint32_t n_slots;
    uint32_t first_slot; /* where sending begins: the first one refused last time */
    struct kl_node_slot slots[KL_NODE_SLOTS];
    uint32_t ack_head;
    uint32_t n_acks;
    struct kl_node_ack acks[KL_NODE_ACKS];
};

/*
 * Prepares a node and loads the initial state; sends nothing. KL_ERR_ARGUMENT: NULL, a speed out of
 * range, an incomplete back end; KL_ERR_CAPACITY: more bodies or wheelsets than the build or the
 * bus has room for; KL_ERR_VALUE: the bus load at `bit_rate` is above 100 % (`node->load` says by
 * how much; above 70 % it is node->load.verdict that warns). Else what kl_init returns.
 */
enum kl_status kl_node_init(struct kl_node *node, const struct kl_node_config *config);

/*
 * One cycle as told above. `timing` may be NULL. Returns true if a cycle was done; false only in
 * lockstep, when no SYNC has arrived: waiting frames were then sent if the bus had room, nothing
 * else happened, and the caller should wait for traffic and call again.
 */
bool kl_node_cycle(struct kl_node *node, const struct kl_node_timing *timing);

/* Carries out a run command as if it came from the bus, without an acknowledge: for a command line
 * or a key. */
enum kl_ack_result kl_node_command(struct kl_node *node, enum kl_run_command command,
                                   uint32_t argument);

#ifdef __cplusplus
}
#endif
#endif
