/*
 * kl_signals.h - the one signal table, and everything that is read out of it.
 *
 * What it is. kl_signal_messages() is constant data: every message on the bus, with its signals,
 * their bits, units and comments, and the field of a C struct that each value comes from or goes
 * to. The codec below, the DBC (kl_dbc.h), the documentation and the schedule of the node
 * (kl_node.h) all read this table; there is no second description of the bus anywhere.
 *
 * Templates. A message is either single or repeated per body, wheelset, wheel or actuator; instance k
 * has the identifier id + k and a name that carries its number from 1 (and R or L for a wheel:
 * instance 2 i + side). struct kl_layout says how many there are, so that table and vehicle size
 * give the whole bus.
 *
 * Values. Little-endian, 8-byte classic frames, standard identifiers; CANopen's 0x000, 0x080,
 * 0x580..0x67F and 0x700..0x77F are never used. A signal's physical value is
 *     (raw + raw_offset) * mantissa / 10^digits
 * so that factor, offset, minimum and maximum are exact decimal numbers. Encoding rounds to
 * nearest (halves away from zero), saturates at minimum or maximum and counts that. A value that is
 * not finite is sent as the signal's invalid raw value (lowest of a signed, highest of an unsigned
 * signal; outside minimum..maximum) and counted. Integer sources (counters, enumerations, bit
 * flags) are sent as they are; those marked wrapping are taken modulo 2^length.
 *
 * Loss. Each cyclic state message carries `Counter`, which grows by one (modulo 2^16) from frame to
 * frame of the same identifier; a step that is not 1 is loss. Commands carry alive counter and CRC
 * (kl_protect.h).
 *
 * No function here keeps anything; all may be called from any thread.
 */
#ifndef KL_SIGNALS_H
#define KL_SIGNALS_H

#include "kl_can.h"
#include "kl_step.h"
#include "kl_text.h"

#ifdef __cplusplus
extern "C" {
#endif

#define KL_BUS_PROTOCOL 1u       /* grows when the meaning of the table changes */
#define KL_BUS_MAX_BODIES 32u    /* room between the identifiers of the templates */
#define KL_BUS_MAX_WHEELSETS 32u /* likewise */
#define KL_BUS_MAX_ACTUATORS 32u /* likewise */
#define KL_BUS_SYNC_ID 0x080u    /* CANopen SYNC: one step each in lockstep; any length 0..8 */

/* ---- what is on the bus besides the model's output ---- */

enum kl_run_state {
    KL_RUN_INIT = 0,    /* initial state loaded, time stands */
    KL_RUN_RUNNING = 1, /* one model step per cycle */
    KL_RUN_PAUSED = 2,  /* time stands, can go on */
    KL_RUN_STOPPED = 3, /* ended by command: start begins again from the initial state */
    KL_RUN_FAULT = 4    /* a holding fault is latched: motion is held, steps are still counted */
};

enum kl_run_command {
    KL_COMMAND_NONE = 0, /* answered, does nothing: a way to look whether the node is there */
    KL_COMMAND_START = 1,
    KL_COMMAND_STOP = 2,
    KL_COMMAND_PAUSE = 3,
    KL_COMMAND_STEP = 4, /* argument: number of steps, 0 counts as 1 */
    KL_COMMAND_RESET = 5,
    KL_COMMAND_SNAPSHOT = 6,
    KL_COMMAND_RESTORE = 7
};

enum kl_ack_result {
    KL_ACK_DONE = 0,
    KL_ACK_WRONG_STATE = 1,     /* not possible in this run state */
    KL_ACK_UNKNOWN_COMMAND = 2, /* no such command */
    KL_ACK_NO_SNAPSHOT = 3,     /* restore without a snapshot */
    KL_ACK_REPEATED = 4,        /* alive counter of the last frame: not carried out again */
    KL_ACK_NO_MODEL_STATE = 5   /* the model refused to start */
};

/* What the node tells of itself. Counts wrap on the bus where their signal is narrower. */
struct kl_bus_status {
    uint32_t run_state;        /* enum kl_run_state */
    uint32_t faults;           /* enum kl_fault bits, latched by the model */
    uint32_t speed_late;       /* 1: set-point missing, safe value in force */
    uint32_t speed_control;    /* 1: a set-point from the bus is in force or supervised */
    uint32_t has_snapshot;     /* 1: restore is possible */
    uint32_t actuator_late;    /* 1: a force or torque is missing, its safe value in force */
    uint32_t actuator_control; /* 1: a force or torque is supervised */
    uint32_t lockstep;         /* 1: one cycle per SYNC */
    uint32_t bus_down;    /* 1: the bus was down in the last cycle (seen on other buses and logs) */
    uint64_t step;        /* kl_output.tick */
    uint64_t time_us;     /* simulated time */
    uint64_t overruns;    /* missed ticks, from the real-time layer */
    kl_real exec_last_us; /* execution time of the last cycle */
    kl_real exec_max_us;  /* longest so far */
    uint64_t send_dropped;  /* cyclic frames and acknowledges that did not go out */
    uint64_t receive_bad;   /* unknown, malformed, badly protected or repeated frames */
    uint64_t commands_late; /* times that a command was replaced by its safe value */
    uint64_t saturated;     /* values limited to their signal's range */
    uint64_t not_finite;    /* values sent as invalid */
    uint64_t recoveries;    /* times that the bus came back */
    uint32_t version[3];    /* major, minor, patch */
    uint32_t protocol;      /* KL_BUS_PROTOCOL */
    uint32_t n_bodies;
    uint32_t n_wheelsets;
    uint64_t model_hash;  /* kl_model.hash; the low 48 bits go out */
    uint64_t signal_hash; /* kl_signals_hash; likewise */
    uint32_t ack_request;
    uint32_t ack_command;
    uint32_t ack_result; /* enum kl_ack_result */
};

/* What a command frame carries; the bench fills it in, the node reads it. */
struct kl_bus_command {
    uint32_t command;    /* enum kl_run_command, or a number that is none */
    uint32_t request_id; /* 0..255, comes back in the acknowledge */
    uint32_t argument;   /* 0..65535 */
    uint32_t control;    /* 1: set-point under supervision; 0: set it once and release it */
    kl_real speed_m_s;   /* NaN when sent as invalid */
    kl_real actuator_N;  /* likewise; or N m */
    kl_real torque_Nm;   /* likewise, of an axle */
    kl_real twist_Nm;    /* likewise, of its wheels against each other */
    kl_real draw_N;      /* likewise, along the train */
};

/* ---- the table ---- */

/* Where a signal's value comes from or goes to. `where` is an offset into the struct named. */
enum kl_signal_source {
    KL_FROM_OUTPUT = 0, /* struct kl_output */
    KL_FROM_BODY,       /* struct kl_body_output of the instance */
    KL_FROM_WHEELSET,   /* struct kl_wheelset_output of the instance */
    KL_FROM_WHEEL,      /* likewise, the instance's side of one real per side */
    KL_FROM_ADHESION,   /* computed: |T| / N of the instance's wheel; 0 for a lifted wheel */
    KL_FROM_WHEEL_SPIN, /* computed: speed of rotation of the instance's wheel */
    KL_FROM_STATUS,     /* struct kl_bus_status */
    KL_FROM_COMMAND,    /* struct kl_bus_command: written by the bench, read by the node */
    KL_FROM_COUNTER,    /* the message's loss counter */
    KL_FROM_PROTECTION  /* CRC and alive counter: kl_protect.h fills them in */
};

/* How the field is stored. Integers are raw values, reals physical ones. */
enum kl_signal_type { KL_AS_REAL = 0, KL_AS_U32, KL_AS_U64 };

struct kl_value_name {
    int32_t raw;
    const char *name; /* a C identifier */
};

struct kl_signal {
    const char *name;    /* unique in its message */
    const char *unit;    /* "" for none */
    const char *comment; /* one line, without quotes, bars and semicolons */
    uint8_t start;       /* first bit, little-endian numbering */
    uint8_t length;      /* bits, 1..48 */
    bool is_signed;
    bool wraps; /* integers: modulo 2^length instead of saturating */
    bool has_invalid;
    uint8_t digits;     /* factor = mantissa / 10^digits; 0..9 */
    int32_t mantissa;   /* >= 1 */
    int32_t raw_offset; /* offset = raw_offset * factor */
    enum kl_signal_source source;
    enum kl_signal_type type;
    uint16_t where; /* offset in bytes */
    uint8_t n_values;
    const struct kl_value_name *values; /* NULL: not an enumeration */
};

enum kl_message_repeat { KL_ONCE = 0, KL_PER_BODY, KL_PER_WHEELSET, KL_PER_WHEEL, KL_PER_ACTUATOR };
/* What a vehicle must have for a message to be on its bus. */
enum kl_message_need { KL_NEEDS_NOTHING = 0, KL_NEEDS_FREE_SPEED, KL_NEEDS_INDEPENDENT_WHEELS };
enum kl_message_sender { KL_SENT_BY_NODE = 0, KL_SENT_BY_BENCH };

struct kl_message {
    const char *name;    /* instances: with their number inserted at '#', see kl_message_name */
    const char *comment; /* one line, without quotes, bars and semicolons */
    uint16_t id;         /* of instance 0 */
    uint8_t length;      /* bytes */
    enum kl_message_repeat repeat;
    enum kl_message_need need;
    enum kl_message_sender sender;
    uint32_t period_us;      /* 0: sent on event */
    bool is_state;           /* period is multiplied by kl_layout.state_divider */
    uint16_t data_id;        /* of instance 0, k has data_id + k; 0: not protected */
    uint16_t timeout_cycles; /* commands: late after so many periods; 0: not supervised */
    uint8_t n_signals;
    const struct kl_signal *signals;
};

/* Names of the messages in the table's order: kl_signal_messages()[KL_MSG_STATUS] and so on. */
enum kl_message_index {
    KL_MSG_RUN_CONTROL = 0,
    KL_MSG_SPEED_SETPOINT,
    KL_MSG_ACTUATOR,
    KL_MSG_WHEELSET_DRIVE,
    KL_MSG_DRAW_FORCE,
    KL_MSG_ACK,
    KL_MSG_VEHICLE_MOTION,
    KL_MSG_VEHICLE_TRACK,
    KL_MSG_STATUS,
    KL_MSG_STATUS_TIME,
    KL_MSG_STATUS_TIMING,
    KL_MSG_STATUS_BUS,
    KL_MSG_STATUS_CODEC,
    KL_MSG_WHEELSET_MOTION,
    KL_MSG_WHEELSET_SPIN,
    KL_MSG_WHEEL_SPIN,
    KL_MSG_BODY_POSITION,
    KL_MSG_BODY_MOTION,
    KL_MSG_WHEEL_FORCES,
    KL_MSG_WHEEL_CREEP,
    KL_MSG_WHEEL_CONTACT,
    KL_MSG_WHEEL_FLANGE,
    KL_MSG_WHEELSET_POSTURE,
    KL_MSG_BODY_RATES,
    KL_MSG_INFO_VERSION,
    KL_MSG_INFO_MODEL,
    KL_MSG_INFO_SIGNALS,
    KL_MESSAGES
};

/* The table: KL_MESSAGES rows. */
const struct kl_message *kl_signal_messages(void);

/* ---- the bus of one vehicle ---- */

struct kl_layout {
    uint32_t n_bodies;      /* 0..KL_BUS_MAX_BODIES */
    uint32_t n_wheelsets;   /* 1..KL_BUS_MAX_WHEELSETS */
    uint32_t n_actuators;   /* 0..KL_BUS_MAX_ACTUATORS */
    bool free_speed;        /* the speed is a freedom of the train */
    bool independent;       /* a wheelset's wheels turn by themselves */
    int64_t step_ns;        /* cycle of the node; periods are rounded to whole cycles, at least 1 */
    uint32_t state_divider; /* 1..1000: state messages come so many times more slowly */
};

/* KL_ERR_ARGUMENT: NULL or out of range; KL_ERR_CAPACITY: more bodies, wheelsets or
 * actuators than identifiers. */
enum kl_status kl_layout_check(const struct kl_layout *layout);

/* Number of instances of a message (0 where the vehicle has none). */
uint32_t kl_message_instances(const struct kl_layout *layout, const struct kl_message *message);

/* Cycles of the node between two frames of a message: period / step, rounded, at least 1; 0 where
 * it is sent on event. The same in microseconds. */
uint32_t kl_message_cycles(const struct kl_layout *layout, const struct kl_message *message);
uint64_t kl_message_cycle_us(const struct kl_layout *layout, const struct kl_message *message);

/* Finds message and instance of an identifier; false: none on this bus. Bound: KL_MESSAGES. */
bool kl_message_find(const struct kl_layout *layout, uint32_t id, uint32_t *index,
                     uint32_t *instance);

/* Writes an instance's name, zero-terminated, and returns its length; `size` >= KL_MESSAGE_NAME is
 * always enough, a smaller one cuts it off. */
#define KL_MESSAGE_NAME 33u
size_t kl_message_name(const struct kl_message *message, uint32_t instance, char *text,
                       size_t size);

/* ---- the codec ---- */

/* Raw values a signal may take: without the invalid one. Both inclusive. */
int64_t kl_signal_raw_min(const struct kl_signal *signal);
int64_t kl_signal_raw_max(const struct kl_signal *signal);
int64_t kl_signal_raw_invalid(const struct kl_signal *signal);

/* The nearest double to the physical value of a raw one; factor and offset likewise. */
double kl_signal_physical(const struct kl_signal *signal, int64_t raw);
double kl_signal_factor(const struct kl_signal *signal);
double kl_signal_offset(const struct kl_signal *signal);

/* What happened to values on their way to raw; only ever counted up. */
struct kl_codec_counts {
    uint64_t saturated;
    uint64_t not_finite;
};

/* Rounds and saturates a physical value. `counts` may be NULL. Not finite: the invalid raw value,
 * or raw minimum where the signal has none. */
int64_t kl_signal_quantise(const struct kl_signal *signal, double physical,
                           struct kl_codec_counts *counts);

/* Writes a raw value (modulo 2^length) into a frame's 8 bytes; reads it back with its sign. */
void kl_signal_insert(const struct kl_signal *signal, int64_t raw, uint8_t data[8]);
int64_t kl_signal_extract(const struct kl_signal *signal, const uint8_t data[8]);

/* Where the values of a frame come from; pointers that its signals do not use may be NULL. */
struct kl_bus_view {
    const struct kl_output *output;
    const struct kl_bus_status *status;
    const struct kl_bus_command *command;
    uint32_t counter;
};

/*
 * Makes the frame of one instance. Protected frames are not sealed yet (kl_protect_seal). Unused
 * bits are 0. A source that is NULL or beyond KL_MAX_BODIES or KL_MAX_WHEELSETS is sent as not
 * finite. Bound: the message's signals.
 */
void kl_message_encode(const struct kl_message *message, uint32_t instance,
                       const struct kl_bus_view *view, struct kl_codec_counts *counts,
                       struct kl_can_frame *frame);

/*
 * Reads a command frame, of any instance, into the fields of `command` that the message has. KL_ERR_ARGUMENT: NULL or
 * not a command; KL_ERR_VALUE: wrong length or kind of frame; `command` is then untouched.
 * Protection is not looked at. An invalid raw value arrives as NaN. Bound: the message's signals.
 */
enum kl_status kl_message_decode(const struct kl_message *message, const struct kl_can_frame *frame,
                                 struct kl_bus_command *command);

/* Finds a signal by name in a message; NULL if there is none. */
const struct kl_signal *kl_signal_find(const struct kl_message *message, const char *name);

/* ---- load, hash, documentation ---- */

enum kl_bus_load_verdict {
    KL_LOAD_OK = 0,
    KL_LOAD_HIGH = 1,    /* above 70 %: late frames and busy controllers are to be expected */
    KL_LOAD_EXCEEDED = 2 /* above 100 %: refused */
};

struct kl_bus_load {
    uint64_t frames_per_s; /* all cyclic messages, commands included, rounded up */
    uint64_t bits_per_s;   /* worst-case stuffing and 3 bits between frames, rounded up */
    uint32_t permille;     /* of the bit rate, rounded up; 0 for an unlimited bus */
    enum kl_bus_load_verdict verdict;
};

/* Bit rate 0: a virtual bus without limit. KL_ERR_ARGUMENT as kl_layout_check. Bound: KL_MESSAGES.
 */
enum kl_status kl_bus_load(const struct kl_layout *layout, uint32_t bit_rate,
                           struct kl_bus_load *load);

/* Longest a standard classic frame can take on the wire, in bits: frame with worst-case stuffing,
 * and intermission. 8 bytes: 135. Source: ISO 11898-1; Davis, Burns et al. 2007, eq. 1. */
uint32_t kl_frame_bits(uint32_t data_bytes);

/* One line per signal of every instance: what is on the wire, without comments. */
enum kl_status kl_signals_csv(const struct kl_layout *layout, const struct kl_text_sink *sink);

/* The documentation: a Markdown table of messages and one of signals per message, templates once.
 */
enum kl_status kl_signals_markdown(const struct kl_layout *layout, const struct kl_text_sink *sink);

/* FNV-1a over the text of kl_signals_csv: two ends with the same hash understand each other. */
uint64_t kl_signals_hash(const struct kl_layout *layout);

#ifdef __cplusplus
}
#endif
#endif
