/*
 * kl_signals_text.h - what the documents of the signal table share: DBC, CSV, Markdown.
 * Internal to port/.
 */
#ifndef KL_SIGNALS_TEXT_H
#define KL_SIGNALS_TEXT_H

#include "kl_signals.h"

/* Checks the arguments of a document and begins its text. KL_ERR_ARGUMENT, or what kl_layout_check
 * says: the document is not to be written. */
enum kl_status kl_signals_text_begin(struct kl_text *text, const struct kl_layout *layout,
                                     const struct kl_text_sink *sink);

/* Writes the physical value of a raw one, exactly. */
void kl_signals_text_value(struct kl_text *text, const struct kl_signal *signal, int64_t raw);

/* The two nodes of the network by their names in all documents. */
const char *kl_signals_text_sender(const struct kl_message *message);
const char *kl_signals_text_receiver(const struct kl_message *message);

#endif
