/*
 * The signal table: every message and every signal on the bus. See kl_signals.h.
 *
 * Identifiers: 0x010 commands, 0x020 vehicle, 0x030 status, 0x040.. commands to
 * actuators, 0x060.. to wheelsets, 0x100.. states of every step, 0x200..
 * states of every tenth millisecond, 0x680 what never changes. Lower identifiers win the bus.
 * Resolutions are a hundredth or less of what a measuring wheelset or an axle-box sensor resolves;
 * ranges hold everything short of a wreck.
 */
#include "kl_signals.h"

#define COUNT(array) (uint8_t)(sizeof(array) / sizeof((array)[0]))
#define FIELD(type, member) (uint16_t) offsetof(struct type, member)

/* A real value in a signed field; `numerator / 10^decimals` is one step of it. */
#define SIGNED(label, bit, bits, numerator, decimals, unit_text, from, field, text)                \
    {                                                                                              \
        .name = label, .unit = unit_text, .comment = text, .start = bit, .length = bits,           \
        .is_signed = true, .has_invalid = true, .mantissa = numerator, .digits = decimals,         \
        .source = from, .type = KL_AS_REAL, .where = field                                         \
    }
/* A real value that is never negative. */
#define UNSIGNED(label, bit, bits, numerator, decimals, unit_text, from, field, text)              \
    {                                                                                              \
        .name = label, .unit = unit_text, .comment = text, .start = bit, .length = bits,           \
        .has_invalid = true, .mantissa = numerator, .digits = decimals, .source = from,            \
        .type = KL_AS_REAL, .where = field                                                         \
    }
/* An integer as it is; too large a one saturates. */
#define INTEGER(label, bit, bits, from, field, text)                                               \
    {                                                                                              \
        .name = label, .unit = "", .comment = text, .start = bit, .length = bits, .mantissa = 1,   \
        .source = from, .type = KL_AS_U32, .where = field                                          \
    }
/* A count that starts again at 0. */
#define WRAPPING(label, bit, bits, field, text)                                                    \
    {                                                                                              \
        .name = label, .unit = "", .comment = text, .start = bit, .length = bits, .wraps = true,   \
        .mantissa = 1, .source = KL_FROM_STATUS, .type = KL_AS_U64,                                \
        .where = FIELD(kl_bus_status, field)                                                       \
    }
/* An enumeration of a byte. */
#define CHOICE(label, bit, from, field, names, text)                                               \
    {                                                                                              \
        .name = label, .unit = "", .comment = text, .start = bit, .length = 8, .mantissa = 1,      \
        .source = from, .type = KL_AS_U32, .where = field, .n_values = COUNT(names),               \
        .values = names                                                                            \
    }
#define FLAG(label, bit, field, text)                                                              \
    INTEGER(label, bit, 1, KL_FROM_STATUS, FIELD(kl_bus_status, field), text)

#define COUNTER                                                                                    \
    {                                                                                              \
        .name = "Counter", .unit = "",                                                             \
        .comment = "Grows by one from frame to frame of this identifier, modulo 65536",            \
        .start = 0, .length = 16, .wraps = true, .mantissa = 1, .source = KL_FROM_COUNTER,         \
        .type = KL_AS_U32                                                                          \
    }
#define PROTECTION                                                                                 \
    {.name = "Crc",                                                                                \
     .unit = "",                                                                                   \
     .comment = "CRC-8 SAE J1850 over the data ID (low, high byte) and bytes 1..7, not inverted",  \
     .start = 0,                                                                                   \
     .length = 8,                                                                                  \
     .mantissa = 1,                                                                                \
     .source = KL_FROM_PROTECTION,                                                                 \
     .type = KL_AS_U32},                                                                           \
    {                                                                                              \
        .name = "Alive", .unit = "", .comment = "Alive counter 0..14 of the sender", .start = 8,   \
        .length = 4, .mantissa = 1, .source = KL_FROM_PROTECTION, .type = KL_AS_U32                \
    }

#define BODY(member) KL_FROM_BODY, FIELD(kl_body_output, member)
#define WHEELSET(member) KL_FROM_WHEELSET, FIELD(kl_wheelset_output, member)
#define WHEEL(member) KL_FROM_WHEEL, FIELD(kl_wheelset_output, member)
#define VEHICLE(member) KL_FROM_OUTPUT, FIELD(kl_output, member)
#define STATUS(member) KL_FROM_STATUS, FIELD(kl_bus_status, member)
#define COMMAND(member) KL_FROM_COMMAND, FIELD(kl_bus_command, member)

/* Lets BODY(...) and its like stand for two arguments. */
#define SIGNED_OF(...) SIGNED(__VA_ARGS__)
#define UNSIGNED_OF(...) UNSIGNED(__VA_ARGS__)
#define INTEGER_OF(...) INTEGER(__VA_ARGS__)
#define CHOICE_OF(...) CHOICE(__VA_ARGS__)

static const struct kl_value_name run_states[] = {{KL_RUN_INIT, "Init"},
                                                  {KL_RUN_RUNNING, "Running"},
                                                  {KL_RUN_PAUSED, "Paused"},
                                                  {KL_RUN_STOPPED, "Stopped"},
                                                  {KL_RUN_FAULT, "Fault"}};
static const struct kl_value_name run_commands[] = {
    {KL_COMMAND_NONE, "None"},         {KL_COMMAND_START, "Start"},    {KL_COMMAND_STOP, "Stop"},
    {KL_COMMAND_PAUSE, "Pause"},       {KL_COMMAND_STEP, "Step"},      {KL_COMMAND_RESET, "Reset"},
    {KL_COMMAND_SNAPSHOT, "Snapshot"}, {KL_COMMAND_RESTORE, "Restore"}};
static const struct kl_value_name ack_results[] = {{KL_ACK_DONE, "Done"},
                                                   {KL_ACK_WRONG_STATE, "WrongState"},
                                                   {KL_ACK_UNKNOWN_COMMAND, "UnknownCommand"},
                                                   {KL_ACK_NO_SNAPSHOT, "NoSnapshot"},
                                                   {KL_ACK_REPEATED, "Repeated"},
                                                   {KL_ACK_NO_MODEL_STATE, "NoModelState"}};
static const struct kl_value_name control_modes[] = {{0, "Release"}, {1, "Control"}};

static const struct kl_signal run_control[] = {
    PROTECTION,
    CHOICE_OF("Command", 16, COMMAND(command), run_commands, "What to do"),
    INTEGER_OF("RequestId", 24, 8, COMMAND(request_id), "Chosen by the sender, comes back in Ack"),
    INTEGER_OF("Argument", 32, 16, COMMAND(argument), "Step: number of steps, 0 counts as 1"),
};
static const struct kl_signal speed_setpoint[] = {
    PROTECTION,
    CHOICE_OF("Control", 16, COMMAND(control), control_modes,
              "Control: supervised, safe value 0 m/s when late. Release: set once, then free"),
    UNSIGNED_OF("Speed", 32, 16, 25, 4, "m/s", COMMAND(speed_m_s), "Set-point of the speed"),
};
static const struct kl_signal actuator[] = {
    PROTECTION,
    CHOICE_OF("Control", 16, COMMAND(control), control_modes,
              "Control: supervised, safe value 0 when late. Release: set once, then free"),
    SIGNED_OF("Force", 32, 24, 1, 0, "N", COMMAND(actuator_N),
              "Pushes the first end of its element and pulls the second, N m where it turns"),
};
static const struct kl_signal wheelset_drive[] = {
    PROTECTION,
    CHOICE_OF("Control", 16, COMMAND(control), control_modes,
              "Control: supervised, safe value 0 when late. Release: set once, then free"),
    SIGNED_OF("Torque", 24, 24, 1, 1, "Nm", COMMAND(torque_Nm),
              "On the axle, positive drives forward, half of it on either of independent wheels"),
    SIGNED_OF(
        "Twist", 48, 16, 5, 0, "Nm", COMMAND(twist_Nm),
        "More on the right and less on the left of independent wheels, a solid axle ignores it"),
};
static const struct kl_signal draw_force[] = {
    PROTECTION,
    CHOICE_OF("Control", 16, COMMAND(control), control_modes,
              "Control: supervised, safe value 0 when late. Release: set once, then free"),
    SIGNED_OF("Force", 32, 24, 10, 0, "N", COMMAND(draw_N),
              "On the whole train along the track, positive forward"),
};
static const struct kl_signal ack[] = {
    INTEGER_OF("RequestId", 0, 8, STATUS(ack_request), "Of the RunControl frame answered"),
    CHOICE_OF("Command", 8, STATUS(ack_command), run_commands, "Of the RunControl frame answered"),
    CHOICE_OF("Result", 16, STATUS(ack_result), ack_results, "Done, or why not"),
    CHOICE_OF("RunState", 24, STATUS(run_state), run_states, "Run state when answered"),
    WRAPPING("Step", 32, 32, step, "Model step when answered"),
};

static const struct kl_signal vehicle_motion[] = {
    COUNTER,
    UNSIGNED_OF("Speed", 16, 16, 25, 4, "m/s", VEHICLE(speed_m_s), "Speed along the track"),
    SIGNED_OF("Distance", 32, 32, 1, 3, "m", VEHICLE(s_m),
              "Distance of the reference point along the track"),
};
static const struct kl_signal vehicle_track[] = {
    COUNTER,
    SIGNED_OF("Acceleration", 16, 16, 1, 3, "m/s2", VEHICLE(acceleration_m_s2),
              "Longitudinal acceleration"),
    SIGNED_OF("Curvature", 32, 16, 1, 6, "1/m", VEHICLE(track.curvature_1_m),
              "Of the track at the reference point, positive in a right-hand curve"),
    SIGNED_OF("Cant", 48, 16, 1, 5, "rad", VEHICLE(track.cant_rad),
              "Of the track at the reference point, positive with the right rail lower"),
};

static const struct kl_signal status[] = {
    COUNTER,
    CHOICE_OF("RunState", 16, STATUS(run_state), run_states, "Run state of the node"),
    INTEGER_OF("Faults", 24, 8, STATUS(faults),
               "Latched bits: 1 not finite, 2 derailed, 4 wheel lift, 8 input out of range"),
    WRAPPING("Step", 32, 32, step, "Model step since the initial state"),
};
static const struct kl_signal status_time[] = {
    COUNTER,
    {.name = "Time",
     .unit = "s",
     .comment = "Simulated time since the initial state",
     .start = 16,
     .length = 48,
     .wraps = true,
     .mantissa = 1,
     .digits = 6,
     .source = KL_FROM_STATUS,
     .type = KL_AS_U64,
     .where = FIELD(kl_bus_status, time_us)},
};
static const struct kl_signal status_timing[] = {
    COUNTER,
    UNSIGNED_OF("ExecLast", 16, 16, 1, 1, "us", STATUS(exec_last_us),
                "Execution time of the last cycle"),
    UNSIGNED_OF("ExecMax", 32, 16, 1, 1, "us", STATUS(exec_max_us),
                "Longest execution time of a cycle so far"),
    WRAPPING("Overruns", 48, 16, overruns, "Missed ticks of the real-time loop"),
};
static const struct kl_signal status_bus[] = {
    COUNTER,
    FLAG("SpeedLate", 16, speed_late, "Set-point missing, safe value 0 m/s in force"),
    FLAG("SpeedControl", 17, speed_control, "Set-point supervised"),
    FLAG("HasSnapshot", 18, has_snapshot, "Restore is possible"),
    FLAG("Lockstep", 19, lockstep, "One cycle per SYNC frame"),
    FLAG("BusDown", 20, bus_down, "The bus was down in the cycle before"),
    FLAG("ActuatorLate", 21, actuator_late,
         "A force or torque is missing, its safe value 0 in force"),
    FLAG("ActuatorControl", 22, actuator_control, "At least one force or torque supervised"),
    WRAPPING("CommandsLate", 24, 8, commands_late, "Times that the safe value stepped in"),
    WRAPPING("SendDropped", 32, 16, send_dropped, "Frames due that did not go out"),
    WRAPPING("ReceiveBad", 48, 16, receive_bad,
             "Frames received that were unknown, malformed, corrupt or repeated"),
};
static const struct kl_signal status_codec[] = {
    COUNTER,
    WRAPPING("Saturated", 16, 16, saturated, "Values limited to the range of their signal"),
    WRAPPING("NotFinite", 32, 16, not_finite, "Values sent as Invalid"),
    WRAPPING("Recoveries", 48, 16, recoveries, "Times that the bus came back"),
};

static const struct kl_signal wheelset_motion[] = {
    COUNTER,
    SIGNED_OF("Y", 16, 16, 1, 6, "m", WHEELSET(y_m),
              "Lateral displacement from the track centre line, positive right"),
    SIGNED_OF("Yaw", 32, 16, 1, 6, "rad", WHEELSET(yaw_rad),
              "Yaw relative to the track, positive nose right"),
    SIGNED_OF("AccY", 48, 16, 1, 2, "m/s2", WHEELSET(y_acc_m_s2),
              "Lateral acceleration of the axle box, absolute, without gravity"),
};
static const struct kl_signal wheelset_spin[] = {
    COUNTER,
    SIGNED_OF("Spin", 16, 24, 1, 3, "rad/s", WHEELSET(spin_rad_s),
              "Speed of rotation, positive rolling forward"),
    SIGNED_OF("AccZ", 40, 16, 1, 2, "m/s2", WHEELSET(z_acc_m_s2),
              "Vertical acceleration of the axle box, positive down"),
};
static const struct kl_signal wheel_spin[] = {
    COUNTER,
    SIGNED("Spin", 16, 24, 1, 3, "rad/s", KL_FROM_WHEEL_SPIN, 0,
           "Speed of rotation of the wheel, positive rolling forward"),
};
static const struct kl_signal body_position[] = {
    COUNTER,
    SIGNED_OF("Y", 16, 16, 1, 5, "m", BODY(position[KL_Y]),
              "Lateral displacement of the centre of mass relative to the track, positive right"),
    SIGNED_OF("Z", 32, 16, 1, 5, "m", BODY(position[KL_Z]),
              "Vertical displacement of the centre of mass, positive down"),
    SIGNED_OF("Roll", 48, 16, 1, 5, "rad", BODY(position[KL_ROLL]),
              "Roll relative to the canted track, positive right side down"),
};
static const struct kl_signal body_motion[] = {
    COUNTER,
    SIGNED_OF("Yaw", 16, 16, 2, 6, "rad", BODY(position[KL_YAW]),
              "Yaw relative to the track, positive nose right"),
    SIGNED_OF("AccY", 32, 16, 2, 3, "m/s2", BODY(acceleration[KL_Y]),
              "Lateral acceleration at the centre of mass, as a body-fixed accelerometer"),
    SIGNED_OF("AccZ", 48, 16, 2, 3, "m/s2", BODY(acceleration[KL_Z]),
              "Vertical acceleration at the centre of mass, positive down"),
};

static const struct kl_signal wheel_forces[] = {
    COUNTER,
    SIGNED_OF("Q", 16, 16, 10, 0, "N", WHEEL(q_N), "Vertical wheel load on the rail"),
    SIGNED_OF("Y", 32, 16, 10, 0, "N", WHEEL(y_N),
              "Lateral force of the wheel on the rail, positive right"),
    UNSIGNED_OF("Reduction", 48, 16, 2, 5, "", WHEEL(tread.reduction),
                "Creep force over that of the linear law: 1 linear, 0 full sliding"),
};
static const struct kl_signal wheel_creep[] = {
    COUNTER,
    SIGNED_OF("T1", 16, 16, 10, 0, "N", WHEEL(tread.t1_N), "Longitudinal creep force on the wheel"),
    SIGNED_OF("T2", 32, 16, 10, 0, "N", WHEEL(tread.t2_N),
              "Lateral creep force on the wheel in the contact plane"),
    UNSIGNED("Adhesion", 48, 16, 2, 5, "", KL_FROM_ADHESION, 0,
             "Adhesion used: resulting creep force over normal force"),
};
static const struct kl_signal wheel_contact[] = {
    COUNTER,
    SIGNED_OF("Delta", 16, 16, 1, 4, "rad", WHEEL(tread.delta_rad), "Contact angle"),
    UNSIGNED_OF("Radius", 32, 16, 2, 5, "m", WHEEL(tread.radius_m),
                "Rolling radius at the contact"),
    SIGNED_OF("Eta", 48, 16, 1, 5, "m", WHEEL(tread.eta_wheel_m),
              "Contact point on the wheel profile, positive towards the flange"),
};
static const struct kl_signal wheel_flange[] = {
    COUNTER,
    UNSIGNED_OF("Normal", 16, 16, 10, 0, "N", WHEEL(flange.normal_N),
                "Normal force of the flange's contact, 0 where it is free"),
    SIGNED_OF("Rail", 32, 16, 1, 6, "m", WHEEL(rail_m),
              "By which the rail has given way outboard, from its place under the wheel at rest"),
    UNSIGNED_OF("Rise", 48, 16, 1, 6, "m", WHEEL(rise_m),
                "Of the tread off the rail, 0 in contact"),
};
static const struct kl_signal wheelset_posture[] = {
    COUNTER,
    SIGNED_OF("Z", 16, 16, 2, 6, "m", WHEELSET(z_m), "Vertical displacement, positive down"),
    SIGNED_OF("Roll", 32, 16, 2, 6, "rad", WHEELSET(roll_rad),
              "Roll relative to the canted track, positive right side down"),
    SIGNED_OF("ForceY", 48, 16, 10, 0, "N", WHEELSET(force_y_N),
              "Track shifting force: sum of Y over both wheels"),
};
static const struct kl_signal body_rates[] = {
    COUNTER,
    SIGNED_OF("Pitch", 16, 16, 2, 6, "rad", BODY(position[KL_PITCH]), "Pitch, positive nose up"),
    SIGNED_OF("RollRate", 32, 16, 1, 4, "rad/s", BODY(rate[KL_ROLL]),
              "Roll rate relative to the track"),
    SIGNED_OF("YawRate", 48, 16, 1, 4, "rad/s", BODY(rate[KL_YAW]),
              "Yaw rate relative to the track"),
};

static const struct kl_signal info_version[] = {
    COUNTER,
    INTEGER_OF("Major", 16, 8, STATUS(version[0]), "Library version, first number"),
    INTEGER_OF("Minor", 24, 8, STATUS(version[1]), "Library version, second number"),
    INTEGER_OF("Patch", 32, 8, STATUS(version[2]), "Library version, third number"),
    INTEGER_OF("Bodies", 40, 8, STATUS(n_bodies), "Bodies of the vehicle"),
    INTEGER_OF("Wheelsets", 48, 8, STATUS(n_wheelsets), "Wheelsets of the vehicle"),
    INTEGER_OF("Protocol", 56, 8, STATUS(protocol), "Version of the meaning of this table"),
};
static const struct kl_signal info_model[] = {
    COUNTER,
    WRAPPING("ModelHash", 16, 48, model_hash, "Low 48 bits of the hash of the model"),
};
static const struct kl_signal info_signals[] = {
    COUNTER,
    WRAPPING("SignalHash", 16, 48, signal_hash,
             "Low 48 bits of the hash of this table, see attribute SignalTableHash"),
};

#define SIGNALS(table) .length = 8, .n_signals = COUNT(table), .signals = table
#define EVERY_10_MS .period_us = 10000
#define STATE(milliseconds) .period_us = 1000 * (milliseconds), .is_state = true

static const struct kl_message messages[KL_MESSAGES] = {
    [KL_MSG_RUN_CONTROL] = {.name = "RunControl",
                            .comment = "Run control of the simulation, answered by Ack",
                            .id = 0x010,
                            .sender = KL_SENT_BY_BENCH,
                            .data_id = 0x1010,
                            SIGNALS(run_control)},
    [KL_MSG_SPEED_SETPOINT] = {.name = "SpeedSetpoint",
                               .comment = "Set-point of the vehicle's speed",
                               .id = 0x011,
                               .sender = KL_SENT_BY_BENCH,
                               .period_us = 100000,
                               .data_id = 0x1011,
                               .timeout_cycles = 5,
                               SIGNALS(speed_setpoint)},
    [KL_MSG_ACTUATOR] = {.name = "Actuator#",
                         .comment = "Force of an actuator, number 1 being input 0 of the model",
                         .id = 0x040,
                         .repeat = KL_PER_ACTUATOR,
                         .sender = KL_SENT_BY_BENCH,
                         .period_us = 10000,
                         .data_id = 0x1040,
                         .timeout_cycles = 5,
                         SIGNALS(actuator)},
    [KL_MSG_WHEELSET_DRIVE] = {.name = "Wheelset#Drive",
                               .comment = "Torque of drive and brake on a wheelset",
                               .id = 0x060,
                               .repeat = KL_PER_WHEELSET,
                               .sender = KL_SENT_BY_BENCH,
                               .period_us = 10000,
                               .data_id = 0x1060,
                               .timeout_cycles = 5,
                               SIGNALS(wheelset_drive)},
    [KL_MSG_DRAW_FORCE] = {.name = "DrawForce",
                           .comment = "What draws or buffs a train whose speed is free",
                           .id = 0x013,
                           .need = KL_NEEDS_FREE_SPEED,
                           .sender = KL_SENT_BY_BENCH,
                           .period_us = 100000,
                           .data_id = 0x1013,
                           .timeout_cycles = 5,
                           SIGNALS(draw_force)},
    [KL_MSG_ACK] = {.name = "Ack", .comment = "Answer to RunControl", .id = 0x012, SIGNALS(ack)},
    [KL_MSG_VEHICLE_MOTION] = {.name = "VehicleMotion",
                               .comment = "Motion of the vehicle along the track",
                               .id = 0x020,
                               STATE(1),
                               SIGNALS(vehicle_motion)},
    [KL_MSG_VEHICLE_TRACK] = {.name = "VehicleTrack",
                              .comment = "Acceleration, and the track under the vehicle",
                              .id = 0x021,
                              STATE(1),
                              SIGNALS(vehicle_track)},
    [KL_MSG_STATUS] = {.name = "Status",
                       .comment = "Run state, faults and step counter",
                       .id = 0x030,
                       EVERY_10_MS,
                       SIGNALS(status)},
    [KL_MSG_STATUS_TIME] = {.name = "StatusTime",
                            .comment = "Simulated time",
                            .id = 0x031,
                            EVERY_10_MS,
                            SIGNALS(status_time)},
    [KL_MSG_STATUS_TIMING] = {.name = "StatusTiming",
                              .comment = "How the real-time loop keeps its time",
                              .id = 0x032,
                              EVERY_10_MS,
                              SIGNALS(status_timing)},
    [KL_MSG_STATUS_BUS] = {.name = "StatusBus",
                           .comment = "Commands and bus: flags and counts",
                           .id = 0x033,
                           EVERY_10_MS,
                           SIGNALS(status_bus)},
    [KL_MSG_STATUS_CODEC] = {.name = "StatusCodec",
                             .comment = "Values that did not fit, and recoveries of the bus",
                             .id = 0x034,
                             EVERY_10_MS,
                             SIGNALS(status_codec)},
    [KL_MSG_WHEELSET_MOTION] = {.name = "Wheelset#Motion",
                                .comment = "Lateral and yaw motion of a wheelset",
                                .id = 0x100,
                                .repeat = KL_PER_WHEELSET,
                                STATE(1),
                                SIGNALS(wheelset_motion)},
    [KL_MSG_WHEELSET_SPIN] = {.name = "Wheelset#Spin",
                              .comment = "Rotation and vertical acceleration of a wheelset",
                              .id = 0x120,
                              .repeat = KL_PER_WHEELSET,
                              STATE(1),
                              SIGNALS(wheelset_spin)},
    [KL_MSG_WHEEL_SPIN] = {.name = "Wheel#Spin",
                           .comment = "Rotation of a wheel, where wheels turn by themselves",
                           .id = 0x180,
                           .repeat = KL_PER_WHEEL,
                           .need = KL_NEEDS_INDEPENDENT_WHEELS,
                           STATE(1),
                           SIGNALS(wheel_spin)},
    [KL_MSG_BODY_POSITION] = {.name = "Body#Position",
                              .comment = "Displacements and roll of a body",
                              .id = 0x140,
                              .repeat = KL_PER_BODY,
                              STATE(1),
                              SIGNALS(body_position)},
    [KL_MSG_BODY_MOTION] = {.name = "Body#Motion",
                            .comment = "Yaw and accelerations of a body",
                            .id = 0x160,
                            .repeat = KL_PER_BODY,
                            STATE(1),
                            SIGNALS(body_motion)},
    [KL_MSG_WHEEL_FORCES] = {.name = "Wheel#Forces",
                             .comment = "Guiding force and wheel load",
                             .id = 0x200,
                             .repeat = KL_PER_WHEEL,
                             STATE(10),
                             SIGNALS(wheel_forces)},
    [KL_MSG_WHEEL_CREEP] = {.name = "Wheel#Creep",
                            .comment = "Creep forces of a wheel",
                            .id = 0x240,
                            .repeat = KL_PER_WHEEL,
                            STATE(10),
                            SIGNALS(wheel_creep)},
    [KL_MSG_WHEEL_CONTACT] = {.name = "Wheel#Contact",
                              .comment = "Where and how a wheel touches its rail",
                              .id = 0x280,
                              .repeat = KL_PER_WHEEL,
                              STATE(10),
                              SIGNALS(wheel_contact)},
    [KL_MSG_WHEEL_FLANGE] = {.name = "Wheel#Flange",
                             .comment =
                                 "Contact of a flange, and how far its tread is off the rail",
                             .id = 0x300,
                             .repeat = KL_PER_WHEEL,
                             STATE(10),
                             SIGNALS(wheel_flange)},
    [KL_MSG_WHEELSET_POSTURE] = {.name = "Wheelset#Posture",
                                 .comment = "Height and roll of a wheelset, track shifting force",
                                 .id = 0x2C0,
                                 .repeat = KL_PER_WHEELSET,
                                 STATE(10),
                                 SIGNALS(wheelset_posture)},
    [KL_MSG_BODY_RATES] = {.name = "Body#Rates",
                           .comment = "Pitch and angular rates of a body",
                           .id = 0x2E0,
                           .repeat = KL_PER_BODY,
                           STATE(10),
                           SIGNALS(body_rates)},
    [KL_MSG_INFO_VERSION] = {.name = "InfoVersion",
                             .comment = "Version of the library and size of the vehicle",
                             .id = 0x680,
                             .period_us = 1000000,
                             SIGNALS(info_version)},
    [KL_MSG_INFO_MODEL] = {.name = "InfoModel",
                           .comment = "Which model runs",
                           .id = 0x681,
                           .period_us = 1000000,
                           SIGNALS(info_model)},
    [KL_MSG_INFO_SIGNALS] = {.name = "InfoSignals",
                             .comment = "Which signal table is spoken",
                             .id = 0x682,
                             .period_us = 1000000,
                             SIGNALS(info_signals)},
};

const struct kl_message *kl_signal_messages(void) {
    return messages;
}
