/* The signal table as text: CSV for machines and for the hash, Markdown for people. */
#include "kl_signals_text.h"

/* ---- of all documents ---- */

enum kl_status kl_signals_text_begin(struct kl_text *text, const struct kl_layout *layout,
                                     const struct kl_text_sink *sink) {
    enum kl_status checked = kl_layout_check(layout);
    if (checked != KL_OK || sink == NULL || sink->write == NULL) {
        return checked != KL_OK ? checked : KL_ERR_ARGUMENT;
    }
    *text = (struct kl_text){.sink = sink};
    return KL_OK;
}

void kl_signals_text_value(struct kl_text *text, const struct kl_signal *signal, int64_t raw) {
    kl_text_decimal(text, (raw + signal->raw_offset) * signal->mantissa, signal->digits);
}

const char *kl_signals_text_sender(const struct kl_message *message) {
    return message->sender == KL_SENT_BY_NODE ? "Klingel" : "Bench";
}

const char *kl_signals_text_receiver(const struct kl_message *message) {
    return message->sender == KL_SENT_BY_NODE ? "Bench" : "Klingel";
}

/* ---- CSV ---- */

static void put_values(struct kl_text *text, const struct kl_signal *signal, const char *between) {
    for (uint32_t i = 0; i < signal->n_values; i++) {
        kl_text_put(text, i == 0 ? "" : between);
        kl_text_int(text, signal->values[i].raw);
        kl_text_put(text, "=");
        kl_text_put(text, signal->values[i].name);
    }
}

static void csv_signal(struct kl_text *text, const struct kl_signal *signal) {
    kl_text_put(text, signal->name);
    kl_text_put(text, ",");
    kl_text_int(text, signal->start);
    kl_text_put(text, ",");
    kl_text_int(text, signal->length);
    kl_text_put(text, signal->is_signed ? ",1," : ",0,");
    kl_text_decimal(text, signal->mantissa, signal->digits);
    kl_text_put(text, ",");
    kl_signals_text_value(text, signal, 0);
    kl_text_put(text, ",");
    kl_signals_text_value(text, signal, kl_signal_raw_min(signal));
    kl_text_put(text, ",");
    kl_signals_text_value(text, signal, kl_signal_raw_max(signal));
    kl_text_put(text, ",");
    if (signal->has_invalid) {
        kl_text_int(text, kl_signal_raw_invalid(signal));
    }
    kl_text_put(text, ",");
    kl_text_put(text, signal->unit);
    kl_text_put(text, ",");
    put_values(text, signal, "|");
    kl_text_put(text, "\n");
}

static void csv_message(struct kl_text *text, const struct kl_layout *layout,
                        const struct kl_message *message, uint32_t instance) {
    char name[KL_MESSAGE_NAME];
    size_t length = kl_message_name(message, instance, name, sizeof name);
    for (uint32_t i = 0; i < message->n_signals; i++) {
        kl_text_put(text, "0x");
        kl_text_hex(text, message->id + instance, 3);
        kl_text_put(text, ",");
        kl_text_bytes(text, name, length);
        kl_text_put(text, ",");
        kl_text_put(text, kl_signals_text_sender(message));
        kl_text_put(text, ",");
        kl_text_int(text, (int64_t)kl_message_cycle_us(layout, message));
        kl_text_put(text, ",");
        kl_text_int(text, message->length);
        kl_text_put(text, ",");
        kl_text_int(text, message->data_id + (message->data_id != 0 ? instance : 0u));
        kl_text_put(text, ",");
        kl_text_int(text, message->timeout_cycles);
        kl_text_put(text, ",");
        csv_signal(text, &message->signals[i]);
    }
}

enum kl_status kl_signals_csv(const struct kl_layout *layout, const struct kl_text_sink *sink) {
    struct kl_text text;
    enum kl_status begun = kl_signals_text_begin(&text, layout, sink);
    if (begun != KL_OK) {
        return begun;
    }
    const struct kl_message *messages = kl_signal_messages();
    kl_text_put(&text, "id,message,sender,cycle_us,bytes,data_id,timeout_cycles,signal,start,"
                       "length,signed,factor,offset,minimum,maximum,invalid_raw,unit,values\n");
    for (uint32_t i = 0; i < KL_MESSAGES; i++) {
        uint32_t n = kl_message_instances(layout, &messages[i]);
        for (uint32_t k = 0; k < n; k++) {
            csv_message(&text, layout, &messages[i], k);
        }
    }
    return kl_text_end(&text);
}

static int hash_write(void *context, const char *text, size_t size) {
    uint64_t *hash = context;
    *hash = kl_hash_bytes(*hash, text, size);
    return 0;
}

uint64_t kl_signals_hash(const struct kl_layout *layout) {
    uint64_t hash = KL_HASH_SEED;
    const struct kl_text_sink sink = {.write = hash_write, .context = &hash};
    return kl_signals_csv(layout, &sink) == KL_OK ? hash : 0;
}

/* ---- Markdown ---- */

static const char *repeat_text(enum kl_message_repeat repeat) {
    switch (repeat) {
    case KL_PER_BODY:
        return " + body - 1";
    case KL_PER_WHEELSET:
        return " + wheelset - 1";
    case KL_PER_WHEEL:
        return " + 2 (wheelset - 1), left wheel + 1";
    case KL_PER_ACTUATOR:
        return " + actuator - 1";
    case KL_ONCE:
        break;
    }
    return "";
}

static void put_cycle(struct kl_text *text, const struct kl_layout *layout,
                      const struct kl_message *message) {
    if (message->period_us == 0) {
        kl_text_put(text, "on event");
        return;
    }
    kl_text_decimal(text, (int64_t)kl_message_cycle_us(layout, message), 3);
    kl_text_put(text, " ms");
}

static void put_identifier(struct kl_text *text, const struct kl_message *message) {
    kl_text_put(text, "0x");
    kl_text_hex(text, message->id, 3);
    kl_text_put(text, repeat_text(message->repeat));
}

static void markdown_row(struct kl_text *text, const struct kl_layout *layout,
                         const struct kl_message *message) {
    kl_text_put(text, "| ");
    put_identifier(text, message);
    kl_text_put(text, " | ");
    kl_text_put(text, message->name);
    kl_text_put(text, " | ");
    kl_text_put(text, kl_signals_text_sender(message));
    kl_text_put(text, " | ");
    put_cycle(text, layout, message);
    kl_text_put(text, " | ");
    kl_text_put(text, message->comment);
    kl_text_put(text, " |\n");
}

static void markdown_signal(struct kl_text *text, const struct kl_signal *signal) {
    kl_text_put(text, "| ");
    kl_text_put(text, signal->name);
    kl_text_put(text, " | ");
    kl_text_int(text, signal->start);
    kl_text_put(text, " | ");
    kl_text_int(text, signal->length);
    kl_text_put(text, signal->is_signed ? " signed | " : " | ");
    kl_text_decimal(text, signal->mantissa, signal->digits);
    kl_text_put(text, " | ");
    kl_signals_text_value(text, signal, kl_signal_raw_min(signal));
    kl_text_put(text, " .. ");
    kl_signals_text_value(text, signal, kl_signal_raw_max(signal));
    kl_text_put(text, " | ");
    kl_text_put(text, signal->unit);
    kl_text_put(text, " | ");
    kl_text_put(text, signal->comment);
    if (signal->n_values > 0) {
        kl_text_put(text, ": ");
        put_values(text, signal, ", ");
    }
    kl_text_put(text, " |\n");
}

static void markdown_message(struct kl_text *text, const struct kl_message *message) {
    kl_text_put(text, "\n### ");
    kl_text_put(text, message->name);
    kl_text_put(text, "\n\n");
    put_identifier(text, message);
    kl_text_put(text, ". ");
    kl_text_put(text, message->comment);
    kl_text_put(text, ".");
    if (message->data_id != 0) {
        kl_text_put(text, " Protected, data ID 0x");
        kl_text_hex(text, message->data_id, 4);
        kl_text_put(text, repeat_text(message->repeat));
        kl_text_put(text, ".");
    }
    if (message->timeout_cycles != 0) {
        kl_text_put(text, " Late after ");
        kl_text_int(text, message->timeout_cycles);
        kl_text_put(text, " cycles.");
    }
    kl_text_put(text, "\n\n| Signal | Start | Bits | Factor | Range | Unit | Meaning |\n"
                      "|---|---|---|---|---|---|---|\n");
    for (uint32_t i = 0; i < message->n_signals; i++) {
        markdown_signal(text, &message->signals[i]);
    }
}

enum kl_status kl_signals_markdown(const struct kl_layout *layout,
                                   const struct kl_text_sink *sink) {
    struct kl_text text;
    enum kl_status begun = kl_signals_text_begin(&text, layout, sink);
    if (begun != KL_OK) {
        return begun;
    }
    const struct kl_message *messages = kl_signal_messages();
    kl_text_put(&text, "| Identifier | Message | Sender | Cycle | Meaning |\n"
                       "|---|---|---|---|---|\n");
    for (uint32_t i = 0; i < KL_MESSAGES; i++) {
        if (kl_message_instances(layout, &messages[i]) > 0) {
            markdown_row(&text, layout, &messages[i]);
        }
    }
    for (uint32_t i = 0; i < KL_MESSAGES; i++) {
        if (kl_message_instances(layout, &messages[i]) > 0) {
            markdown_message(&text, &messages[i]);
        }
    }
    return kl_text_end(&text);
}
