/* The signal table as a DBC file; see kl_dbc.h. */
#include "kl_dbc.h"

#include "kl_signals_text.h"

struct writer {
    struct kl_text text;
    const struct kl_layout *layout;
};

/* One section is one walk over all instances. */
typedef void (*section)(struct writer *w, const struct kl_message *message, uint32_t instance);

static void each_message(struct writer *w, section write) {
    const struct kl_message *messages = kl_signal_messages();
    for (uint32_t i = 0; i < KL_MESSAGES; i++) {
        uint32_t n = kl_message_instances(w->layout, &messages[i]);
        for (uint32_t k = 0; k < n; k++) {
            write(w, &messages[i], k);
        }
    }
}

static void put(struct writer *w, const char *text) {
    kl_text_put(&w->text, text);
}

static void put_int(struct writer *w, int64_t value) {
    kl_text_int(&w->text, value);
}

static void put_scaled(struct writer *w, const struct kl_signal *signal, int64_t raw) {
    kl_signals_text_value(&w->text, signal, raw);
}

/* ` SG_ Name : start|length@1+ (factor,offset) [min|max] "unit" receiver` */
static void put_signal(struct writer *w, const struct kl_signal *signal, const char *to) {
    put(w, " SG_ ");
    put(w, signal->name);
    put(w, " : ");
    put_int(w, signal->start);
    put(w, "|");
    put_int(w, signal->length);
    put(w, signal->is_signed ? "@1- (" : "@1+ (");
    kl_text_decimal(&w->text, signal->mantissa, signal->digits);
    put(w, ",");
    put_scaled(w, signal, 0);
    put(w, ") [");
    put_scaled(w, signal, kl_signal_raw_min(signal));
    put(w, "|");
    put_scaled(w, signal, kl_signal_raw_max(signal));
    put(w, "] \"");
    put(w, signal->unit);
    put(w, "\" ");
    put(w, to);
    put(w, "\n");
}

static void put_message(struct writer *w, const struct kl_message *message, uint32_t instance) {
    char name[KL_MESSAGE_NAME];
    size_t length = kl_message_name(message, instance, name, sizeof name);
    put(w, "BO_ ");
    put_int(w, message->id + instance);
    put(w, " ");
    kl_text_bytes(&w->text, name, length);
    put(w, ": ");
    put_int(w, message->length);
    put(w, " ");
    put(w, kl_signals_text_sender(message));
    put(w, "\n");
    for (uint32_t i = 0; i < message->n_signals; i++) {
        put_signal(w, &message->signals[i], kl_signals_text_receiver(message));
    }
    put(w, "\n");
}

static void put_comments(struct writer *w, const struct kl_message *message, uint32_t instance) {
    put(w, "CM_ BO_ ");
    put_int(w, message->id + instance);
    put(w, " \"");
    put(w, message->comment);
    put(w, "\";\n");
    for (uint32_t i = 0; i < message->n_signals; i++) {
        put(w, "CM_ SG_ ");
        put_int(w, message->id + instance);
        put(w, " ");
        put(w, message->signals[i].name);
        put(w, " \"");
        put(w, message->signals[i].comment);
        put(w, "\";\n");
    }
}

static void put_attribute(struct writer *w, const char *attribute, uint32_t id, int64_t value) {
    put(w, "BA_ \"");
    put(w, attribute);
    put(w, "\" BO_ ");
    put_int(w, id);
    put(w, " ");
    put_int(w, value);
    put(w, ";\n");
}

static void put_attributes(struct writer *w, const struct kl_message *message, uint32_t instance) {
    uint32_t id = message->id + instance;
    int64_t cycle_us = (int64_t)kl_message_cycle_us(w->layout, message);
    if (cycle_us > 0) {
        put_attribute(w, "GenMsgCycleTime", id, cycle_us < 1500 ? 1 : (cycle_us + 500) / 1000);
        put_attribute(w, "CycleTime_us", id, cycle_us);
    }
    put_attribute(w, "GenMsgSendType", id, cycle_us > 0 ? 0 : 1);
    if (message->data_id != 0) {
        put_attribute(w, "E2EDataId", id, message->data_id + instance);
    }
    if (message->timeout_cycles != 0) {
        put_attribute(w, "TimeoutCycles", id, message->timeout_cycles);
    }
    for (uint32_t i = 0; i < message->n_signals; i++) {
        put(w, "BA_ \"GenSigStartValue\" SG_ ");
        put_int(w, id);
        put(w, " ");
        put(w, message->signals[i].name);
        put(w, " 0;\n");
    }
}

static void put_values(struct writer *w, const struct kl_message *message, uint32_t instance) {
    for (uint32_t i = 0; i < message->n_signals; i++) {
        const struct kl_signal *signal = &message->signals[i];
        if (signal->n_values == 0 && !signal->has_invalid) {
            continue;
        }
        put(w, "VAL_ ");
        put_int(w, message->id + instance);
        put(w, " ");
        put(w, signal->name);
        for (uint32_t k = 0; k < signal->n_values; k++) {
            put(w, " ");
            put_int(w, signal->values[k].raw);
            put(w, " \"");
            put(w, signal->values[k].name);
            put(w, "\"");
        }
        if (signal->has_invalid) {
            put(w, " ");
            put_int(w, kl_signal_raw_invalid(signal));
            put(w, " \"Invalid\"");
        }
        put(w, " ;\n");
    }
}

static void put_head(struct writer *w) {
    put(w, "VERSION \"\"\n\nNS_ :\n\tCM_\n\tBA_DEF_\n\tBA_\n\tVAL_\n\tBA_DEF_DEF_\n\n"
           "BS_:\n\nBU_: Klingel Bench\n\n");
}

static void put_network_comments(struct writer *w) {
    put(w, "CM_ \"Klingel: rail-vehicle dynamics. SI units; x forward, y to the right, z down.\";\n"
           "CM_ BU_ Klingel \"The simulated vehicle\";\n"
           "CM_ BU_ Bench \"Whoever commands it and listens\";\n");
}

static void put_definitions(struct writer *w) {
    put(w, "BA_DEF_ \"BusType\" STRING ;\n"
           "BA_DEF_ \"SignalTableHash\" STRING ;\n"
           "BA_DEF_ \"StepTime_us\" INT 0 1000000;\n"
           "BA_DEF_ BO_ \"GenMsgCycleTime\" INT 0 2000000;\n"
           "BA_DEF_ BO_ \"CycleTime_us\" INT 0 2000000000;\n"
           "BA_DEF_ BO_ \"GenMsgSendType\" ENUM \"Cyclic\",\"Event\";\n"
           "BA_DEF_ BO_ \"E2EDataId\" INT 0 65535;\n"
           "BA_DEF_ BO_ \"TimeoutCycles\" INT 0 65535;\n"
           "BA_DEF_ SG_ \"GenSigStartValue\" INT 0 0;\n"
           "BA_DEF_DEF_ \"BusType\" \"CAN\";\n"
           "BA_DEF_DEF_ \"SignalTableHash\" \"\";\n"
           "BA_DEF_DEF_ \"StepTime_us\" 1000;\n"
           "BA_DEF_DEF_ \"GenMsgCycleTime\" 0;\n"
           "BA_DEF_DEF_ \"CycleTime_us\" 0;\n"
           "BA_DEF_DEF_ \"GenMsgSendType\" \"Event\";\n"
           "BA_DEF_DEF_ \"E2EDataId\" 0;\n"
           "BA_DEF_DEF_ \"TimeoutCycles\" 0;\n"
           "BA_DEF_DEF_ \"GenSigStartValue\" 0;\n");
    put(w, "BA_ \"BusType\" \"CAN\";\nBA_ \"SignalTableHash\" \"");
    kl_text_hex(&w->text, kl_signals_hash(w->layout), 16);
    put(w, "\";\nBA_ \"StepTime_us\" ");
    put_int(w, w->layout->step_ns / 1000);
    put(w, ";\n");
}

enum kl_status kl_dbc_write(const struct kl_layout *layout, const struct kl_text_sink *sink) {
    struct writer w = {.layout = layout};
    enum kl_status begun = kl_signals_text_begin(&w.text, layout, sink);
    if (begun != KL_OK) {
        return begun;
    }
    put_head(&w);
    each_message(&w, put_message);
    put_network_comments(&w);
    each_message(&w, put_comments);
    put_definitions(&w);
    each_message(&w, put_attributes);
    each_message(&w, put_values);
    return kl_text_end(&w.text);
}
