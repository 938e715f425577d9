/* Layout, lookup and codec over the signal table; see kl_signals.h. */
#include "kl_signals.h"
#include "kl_math.h"

#define MAX_DIGITS 9u

/* ---- the bus of one vehicle ---- */

enum kl_status kl_layout_check(const struct kl_layout *layout) {
    if (layout == NULL || layout->n_wheelsets < 1 || layout->step_ns < 10000 ||
        layout->step_ns > INT64_C(1000000000) || layout->state_divider < 1 ||
        layout->state_divider > 1000) {
        return KL_ERR_ARGUMENT;
    }
    if (layout->n_bodies > KL_BUS_MAX_BODIES || layout->n_wheelsets > KL_BUS_MAX_WHEELSETS ||
        layout->n_actuators > KL_BUS_MAX_ACTUATORS) {
        return KL_ERR_CAPACITY;
    }
    return KL_OK;
}

uint32_t kl_message_instances(const struct kl_layout *layout, const struct kl_message *message) {
    if ((message->need == KL_NEEDS_FREE_SPEED && !layout->free_speed) ||
        (message->need == KL_NEEDS_INDEPENDENT_WHEELS && !layout->independent)) {
        return 0;
    }
    switch (message->repeat) {
    case KL_PER_BODY:
        return layout->n_bodies;
    case KL_PER_WHEELSET:
        return layout->n_wheelsets;
    case KL_PER_WHEEL:
        return KL_SIDES * layout->n_wheelsets;
    case KL_PER_ACTUATOR:
        return layout->n_actuators;
    case KL_ONCE:
        break;
    }
    return 1;
}

uint32_t kl_message_cycles(const struct kl_layout *layout, const struct kl_message *message) {
    if (message->period_us == 0) {
        return 0;
    }
    uint64_t period_ns = UINT64_C(1000) * message->period_us;
    uint64_t step_ns = (uint64_t)layout->step_ns;
    if (message->is_state) {
        period_ns *= layout->state_divider;
    }
    uint64_t cycles = (period_ns + step_ns / 2) / step_ns;
    return cycles < 1 ? 1 : cycles > UINT32_MAX ? UINT32_MAX : (uint32_t)cycles;
}

uint64_t kl_message_cycle_us(const struct kl_layout *layout, const struct kl_message *message) {
    return kl_message_cycles(layout, message) * (uint64_t)layout->step_ns / 1000;
}

bool kl_message_find(const struct kl_layout *layout, uint32_t id, uint32_t *index,
                     uint32_t *instance) {
    const struct kl_message *messages = kl_signal_messages();
    for (uint32_t i = 0; i < KL_MESSAGES; i++) {
        if (id >= messages[i].id &&
            id - messages[i].id < kl_message_instances(layout, &messages[i])) {
            *index = i;
            *instance = id - messages[i].id;
            return true;
        }
    }
    return false;
}

/* Appends to a text of `size` bytes with room kept for the zero. */
static size_t append(char *text, size_t size, size_t length, char letter) {
    if (length + 1 < size) {
        text[length++] = letter;
    }
    return length;
}

size_t kl_message_name(const struct kl_message *message, uint32_t instance, char *text,
                       size_t size) {
    size_t length = 0;
    bool per_wheel = message->repeat == KL_PER_WHEEL;
    uint32_t number = (per_wheel ? instance / KL_SIDES : instance) + 1;
    for (const char *c = message->name; *c != '\0'; c++) {
        if (*c != '#') {
            length = append(text, size, length, *c);
            continue;
        }
        if (number >= 10) {
            length = append(text, size, length, (char)('0' + number / 10 % 10));
        }
        length = append(text, size, length, (char)('0' + number % 10));
        if (per_wheel) {
            length = append(text, size, length, instance % KL_SIDES == KL_RIGHT ? 'R' : 'L');
        }
    }
    if (size > 0) {
        text[length] = '\0';
    }
    return length;
}

const struct kl_signal *kl_signal_find(const struct kl_message *message, const char *name) {
    for (uint32_t i = 0; i < message->n_signals; i++) {
        const char *a = message->signals[i].name;
        const char *b = name;
        while (*a != '\0' && *a == *b) {
            a++;
            b++;
        }
        if (*a == *b) {
            return &message->signals[i];
        }
    }
    return NULL;
}

/* ---- numbers ---- */

static double power_of_ten(uint32_t digits) {
    static const double powers[MAX_DIGITS + 1] = {1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9};
    return powers[digits > MAX_DIGITS ? MAX_DIGITS : digits];
}

static bool is_finite(double value) {
    double zero = value - value; /* NaN for a NaN and for an infinity */
    return zero >= 0.0 && zero <= 0.0;
}

static double not_a_number(void) {
    const union {
        uint64_t bits;
        double value;
    } quiet = {.bits = UINT64_C(0x7FF8000000000000)};
    return quiet.value;
}

static int64_t lowest(const struct kl_signal *signal) {
    return signal->is_signed ? -(INT64_C(1) << (signal->length - 1u)) : 0;
}

static int64_t highest(const struct kl_signal *signal) {
    return (INT64_C(1) << (signal->length - (signal->is_signed ? 1u : 0u))) - 1;
}

int64_t kl_signal_raw_min(const struct kl_signal *signal) {
    return lowest(signal) + (signal->has_invalid && signal->is_signed ? 1 : 0);
}

int64_t kl_signal_raw_max(const struct kl_signal *signal) {
    return highest(signal) - (signal->has_invalid && !signal->is_signed ? 1 : 0);
}

int64_t kl_signal_raw_invalid(const struct kl_signal *signal) {
    return signal->is_signed ? lowest(signal) : highest(signal);
}

double kl_signal_physical(const struct kl_signal *signal, int64_t raw) {
    /* the product is exact, so that one rounding is all there is */
    double units = (double)(raw + signal->raw_offset) * (double)signal->mantissa;
    return units / power_of_ten(signal->digits);
}

double kl_signal_factor(const struct kl_signal *signal) {
    return (double)signal->mantissa / power_of_ten(signal->digits);
}

double kl_signal_offset(const struct kl_signal *signal) {
    return kl_signal_physical(signal, 0);
}

int64_t kl_signal_quantise(const struct kl_signal *signal, double physical,
                           struct kl_codec_counts *counts) {
    struct kl_codec_counts unwanted = {0};
    struct kl_codec_counts *count = counts == NULL ? &unwanted : counts;
    int64_t low = kl_signal_raw_min(signal);
    int64_t high = kl_signal_raw_max(signal);
    if (!is_finite(physical)) {
        count->not_finite++;
        return signal->has_invalid ? kl_signal_raw_invalid(signal) : low;
    }
    double x = physical * power_of_ten(signal->digits) / (double)signal->mantissa -
               (double)signal->raw_offset;
    if (x >= (double)high + 0.5) {
        count->saturated++;
        return high;
    }
    if (x <= (double)low - 0.5) {
        count->saturated++;
        return low;
    }
    int64_t whole = (int64_t)x;
    double rest = x - (double)whole; /* exact: |x| < 2^48 */
    return whole + (rest >= 0.5 ? 1 : 0) - (rest <= -0.5 ? 1 : 0);
}

/* ---- bits ---- */

void kl_signal_insert(const struct kl_signal *signal, int64_t raw, uint8_t data[8]) {
    uint64_t mask = (UINT64_C(1) << signal->length) - 1;
    uint64_t bits = ((uint64_t)raw & mask) << signal->start;
    mask <<= signal->start;
    for (uint32_t i = 0; i < 8; i++) {
        uint8_t keep = (uint8_t) ~(mask >> (8 * i));
        data[i] = (uint8_t)((data[i] & keep) | (uint8_t)(bits >> (8 * i)));
    }
}

int64_t kl_signal_extract(const struct kl_signal *signal, const uint8_t data[8]) {
    uint64_t bits = 0;
    for (uint32_t i = 0; i < 8; i++) {
        bits |= (uint64_t)data[i] << (8 * i);
    }
    bits = (bits >> signal->start) & ((UINT64_C(1) << signal->length) - 1);
    return (int64_t)bits > highest(signal) ? (int64_t)bits - (INT64_C(1) << signal->length)
                                           : (int64_t)bits;
}

/* ---- values ---- */

/* The wheelset of a wheel, moved on by the wheel's side: whatever there is of each side is then found
 * at its offset. */
static const unsigned char *wheel_of(const struct kl_output *output, uint32_t instance) {
    uint32_t wheelset = instance / KL_SIDES;
    return output == NULL || wheelset >= KL_MAX_WHEELSETS
               ? NULL
               : (const unsigned char *)&output->wheelset[wheelset] +
                     (instance % KL_SIDES) * sizeof(kl_real);
}

static double real_at(const void *source, size_t where) {
    return (double)*(const kl_real *)(const void *)((const unsigned char *)source + where);
}

/* The struct that holds a signal's field; NULL if there is none. */
static const void *source_of(const struct kl_signal *signal, uint32_t instance,
                             const struct kl_bus_view *view) {
    switch (signal->source) {
    case KL_FROM_OUTPUT:
        return view->output;
    case KL_FROM_BODY:
        return view->output == NULL || instance >= KL_MAX_BODIES ? NULL
                                                                 : &view->output->body[instance];
    case KL_FROM_WHEELSET:
        return view->output == NULL || instance >= KL_MAX_WHEELSETS
                   ? NULL
                   : &view->output->wheelset[instance];
    case KL_FROM_WHEEL:
    case KL_FROM_ADHESION:
        return wheel_of(view->output, instance);
    case KL_FROM_WHEEL_SPIN:
        return view->output == NULL || instance / KL_SIDES >= KL_MAX_WHEELSETS
                   ? NULL
                   : &view->output->wheelset[instance / KL_SIDES];
    case KL_FROM_STATUS:
        return view->status;
    case KL_FROM_COMMAND:
        return view->command;
    case KL_FROM_COUNTER:
        return &view->counter;
    case KL_FROM_PROTECTION:
        break;
    }
    return NULL;
}

/* |T| / N; a wheel without load uses none. */
static double adhesion(const void *wheel) {
    double n = real_at(wheel, offsetof(struct kl_wheelset_output, tread.normal_N));
    double t1 = real_at(wheel, offsetof(struct kl_wheelset_output, tread.t1_N));
    double t2 = real_at(wheel, offsetof(struct kl_wheelset_output, tread.t2_N));
    if (!is_finite(n) || !is_finite(t1) || !is_finite(t2)) {
        return not_a_number();
    }
    return n > 0.0 ? kl_sqrt(t1 * t1 + t2 * t2) / n : 0.0;
}

/* The right wheel turns by so much faster than the mean as the left one turns slower. */
static double wheel_spin(const struct kl_wheelset_output *wheelset, uint32_t instance) {
    const double twist = (double)wheelset->twist_rad_s;
    return (double)wheelset->spin_rad_s + (instance % KL_SIDES == KL_RIGHT ? twist : -twist);
}

static int64_t integer_raw(const struct kl_signal *signal, uint64_t value,
                           struct kl_codec_counts *counts) {
    uint64_t high = (uint64_t)kl_signal_raw_max(signal);
    if (signal->wraps) {
        return (int64_t)(value & high);
    }
    if (value > high) {
        counts->saturated++;
        return (int64_t)high;
    }
    return (int64_t)value;
}

static int64_t raw_of(const struct kl_signal *signal, uint32_t instance, const void *source,
                      struct kl_codec_counts *counts) {
    if (source == NULL) {
        return kl_signal_quantise(signal, not_a_number(), counts);
    }
    if (signal->source == KL_FROM_ADHESION) {
        return kl_signal_quantise(signal, adhesion(source), counts);
    }
    if (signal->source == KL_FROM_WHEEL_SPIN) {
        return kl_signal_quantise(signal, wheel_spin(source, instance), counts);
    }
    const void *field = (const unsigned char *)source + signal->where;
    switch (signal->type) {
    case KL_AS_REAL:
        return kl_signal_quantise(signal, real_at(source, signal->where), counts);
    case KL_AS_U32:
        return integer_raw(signal, *(const uint32_t *)field, counts);
    case KL_AS_U64:
        break;
    }
    return integer_raw(signal, *(const uint64_t *)field, counts);
}

void kl_message_encode(const struct kl_message *message, uint32_t instance,
                       const struct kl_bus_view *view, struct kl_codec_counts *counts,
                       struct kl_can_frame *frame) {
    struct kl_codec_counts unwanted = {0};
    struct kl_codec_counts *count = counts == NULL ? &unwanted : counts;
    *frame = (struct kl_can_frame){.id = message->id + instance, .length = message->length};
    for (uint32_t i = 0; i < message->n_signals; i++) {
        const struct kl_signal *signal = &message->signals[i];
        if (signal->source != KL_FROM_PROTECTION) {
            const void *source = source_of(signal, instance, view);
            kl_signal_insert(signal, raw_of(signal, instance, source, count), frame->data);
        }
    }
}

static void store(const struct kl_signal *signal, int64_t raw, struct kl_bus_command *command) {
    void *field = (unsigned char *)command + signal->where;
    bool invalid = signal->has_invalid && raw == kl_signal_raw_invalid(signal);
    switch (signal->type) {
    case KL_AS_REAL:
        *(kl_real *)field = (kl_real)(invalid ? not_a_number() : kl_signal_physical(signal, raw));
        break;
    case KL_AS_U32:
        *(uint32_t *)field = (uint32_t)raw;
        break;
    case KL_AS_U64:
        *(uint64_t *)field = (uint64_t)raw;
        break;
    }
}

/* Instances of a command that the bus can have. */
static bool is_instance(const struct kl_message *message, uint32_t id) {
    const uint32_t most = message->repeat == KL_PER_ACTUATOR   ? KL_BUS_MAX_ACTUATORS
                          : message->repeat == KL_PER_WHEELSET ? KL_BUS_MAX_WHEELSETS
                                                               : 1u;
    return id >= message->id && id - message->id < most;
}

enum kl_status kl_message_decode(const struct kl_message *message, const struct kl_can_frame *frame,
                                 struct kl_bus_command *command) {
    if (message == NULL || frame == NULL || command == NULL ||
        message->sender != KL_SENT_BY_BENCH) {
        return KL_ERR_ARGUMENT;
    }
    if (frame->flags != 0 || frame->length != message->length || !is_instance(message, frame->id)) {
        return KL_ERR_VALUE;
    }
    for (uint32_t i = 0; i < message->n_signals; i++) {
        const struct kl_signal *signal = &message->signals[i];
        if (signal->source == KL_FROM_COMMAND) {
            store(signal, kl_signal_extract(signal, frame->data), command);
        }
    }
    return KL_OK;
}

/* ---- load ---- */

uint32_t kl_frame_bits(uint32_t data_bytes) {
    uint32_t bytes = data_bytes > KL_CAN_CLASSIC_BYTES ? KL_CAN_CLASSIC_BYTES : data_bytes;
    uint32_t stuffable = 34 + 8 * bytes; /* start of frame to CRC */
    return stuffable + 13 + (stuffable - 1) / 4;
}

enum kl_status kl_bus_load(const struct kl_layout *layout, uint32_t bit_rate,
                           struct kl_bus_load *load) {
    enum kl_status checked = load == NULL ? KL_ERR_ARGUMENT : kl_layout_check(layout);
    if (checked != KL_OK) {
        return checked;
    }
    *load = (struct kl_bus_load){0};
    const struct kl_message *messages = kl_signal_messages();
    for (uint32_t i = 0; i < KL_MESSAGES; i++) {
        uint64_t period_us = kl_message_cycle_us(layout, &messages[i]);
        if (period_us > 0) {
            uint64_t frames = UINT64_C(1000000) * kl_message_instances(layout, &messages[i]);
            uint64_t bits = frames * kl_frame_bits(messages[i].length);
            load->frames_per_s += (frames + period_us - 1) / period_us;
            load->bits_per_s += (bits + period_us - 1) / period_us;
        }
    }
    if (bit_rate > 0) {
        uint64_t permille = (1000 * load->bits_per_s + bit_rate - 1) / bit_rate;
        load->permille = permille > UINT32_MAX ? UINT32_MAX : (uint32_t)permille;
        load->verdict = permille > 1000  ? KL_LOAD_EXCEEDED
                        : permille > 700 ? KL_LOAD_HIGH
                                         : KL_LOAD_OK;
    }
    return KL_OK;
}
