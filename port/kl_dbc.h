/*
 * kl_dbc.h - the signal table as a DBC file, for python-can tools, SavvyCAN, CANalyzer and others.
 *
 * Nodes Klingel and Bench; every message with sender, cycle time, send type and comment; every
 * signal with exact decimal factor, offset, minimum and maximum, unit, receiver, start value,
 * comment and value names ("Invalid" for the raw value that stands for "not a number"). Attributes
 * of our own: CycleTime_us, TimeoutCycles (commands: late after so many cycles), E2EDataId
 * (protected messages, see kl_protect.h), SignalTableHash and StepTime_us of the network.
 */
#ifndef KL_DBC_H
#define KL_DBC_H

#include "kl_signals.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Writes the whole file. KL_ERR_ARGUMENT: NULL or a layout that kl_layout_check refuses;
 * KL_ERR_MEMORY: the sink refused. Bound: instances x signals, about 400 bytes each. */
enum kl_status kl_dbc_write(const struct kl_layout *layout, const struct kl_text_sink *sink);

#ifdef __cplusplus
}
#endif
#endif
