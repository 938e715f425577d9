/* The adapter's end of the LAWICEL protocol; see kl_slcan_link.h. */
#include "kl_slcan_link.h"

#include <stddef.h>

#define NO_BIT_RATE 0xFFu
#define PASS_ALL 0xFFFFFFFFu /* every bit of the mask: do not care */
#define TIME_MODULO_MS 60000u

/* ---- out ---- */

static bool write_line(struct kl_slcan_link *link, const char *text, uint32_t size) {
    bool written = kl_ring_write(link->config.tx, text, size);
    if (written && link->config.kick != NULL) {
        link->config.kick(link->config.kick_context);
    }
    return written;
}

static void answer(struct kl_slcan_link *link, const char *text, uint32_t size) {
    if (!write_line(link, text, size)) {
        link->stats.lost_answers++;
        link->flags |= KL_SLCAN_FLAG_SEND_FULL;
    }
}

static void refuse(struct kl_slcan_link *link) {
    static const char bell[] = {KL_SLCAN_BELL};
    link->stats.belled++;
    link->counts.refused++;
    answer(link, bell, sizeof bell);
}

static void answer_if(struct kl_slcan_link *link, bool done) {
    static const char cr[] = {KL_SLCAN_CR};
    if (done) {
        answer(link, cr, sizeof cr);
    } else {
        refuse(link);
    }
}

/* One half of the dual filter: 16 bits that stand where code and mask have theirs. */
static bool half_passes(uint32_t bits, uint32_t code, uint32_t mask) {
    return (((bits ^ code) & ~mask) & 0xFFFFu) == 0;
}

/*
 * SJA1000 data sheet, 6.4.15, dual filter. Extended: either half holds ID.28..ID.13. Standard: ID
 * and RTR stand in bits 15..4 of either half; the first also looks at data byte 1, whose upper
 * nibble stands in bits 3..0 of the first half and whose lower one in bits 3..0 of the second.
 */
static bool passes(const struct kl_slcan_link *link, const struct kl_can_frame *frame) {
    uint32_t code = link->filter_code;
    uint32_t mask = link->filter_mask;
    if ((frame->flags & KL_CAN_EXTENDED) != 0) {
        uint32_t bits = frame->id >> 13;
        return half_passes(bits, code >> 16, mask >> 16) || half_passes(bits, code, mask);
    }
    uint32_t remote = (frame->flags & KL_CAN_REMOTE) != 0 ? 1 : 0;
    uint32_t bits = frame->id << 5 | remote << 4;
    bool has_data = frame->length > 0 && remote == 0;
    uint32_t first = has_data ? frame->data[0] : 0;
    uint32_t nibbles = has_data ? 0x0Fu : 0; /* without data they do not count */
    bool upper = half_passes(bits | first >> 4, code >> 16, mask >> 16 | (nibbles ^ 0x0Fu));
    bool lower = (((first ^ code) & ~mask) & nibbles) == 0;
    return (upper && lower) || half_passes(bits, code, mask | 0x0Fu);
}

static enum kl_can_status link_send(void *context, const struct kl_can_frame *frame) {
    struct kl_slcan_link *link = context;
    char text[KL_SLCAN_LINE_BYTES];
    if (link == NULL || frame == NULL) {
        return KL_CAN_ARGUMENT;
    }
    uint32_t stamp = link->timestamps ? link->time_ms : KL_SLCAN_NO_TIME;
    uint32_t size = kl_slcan_encode(frame, stamp, text);
    if (size == 0) {
        link->counts.refused++;
        link->counts.send_dropped++;
        return KL_CAN_REFUSED;
    }
    if (link->closed) {
        link->counts.send_dropped++;
        return KL_CAN_DOWN;
    }
    if (link->channel != KL_SLCAN_CLOSED && !passes(link, frame)) {
        link->stats.filtered++;
    } else if (link->channel != KL_SLCAN_CLOSED && !write_line(link, text, size)) {
        link->counts.send_dropped++;
        link->flags |= KL_SLCAN_FLAG_SEND_FULL;
        return KL_CAN_BUSY;
    }
    link->counts.sent++;
    return KL_CAN_OK;
}

/* ---- commands ---- */

static void take_frame(struct kl_slcan_link *link, const char *line, uint32_t length) {
    struct kl_can_frame frame;
    bool standard = line[0] == 't' || line[0] == 'r';
    if (link->channel != KL_SLCAN_OPEN ||
        kl_slcan_decode(line, length, &frame, NULL) != KL_CAN_OK) {
        refuse(link);
        return;
    }
    if (link->count < link->config.queue_frames) {
        link->config.queue[(link->head + link->count) % link->config.queue_frames] = frame;
        link->count++;
    } else {
        link->counts.receive_dropped++;
        link->flags |= KL_SLCAN_FLAG_QUEUE_FULL;
    }
    answer(link, standard ? "z\r" : "Z\r", 2); /* it was on the bus, lost by us or not */
}

static bool open_channel(struct kl_slcan_link *link, uint32_t length,
                         enum kl_slcan_channel channel) {
    if (length != 1 || link->channel != KL_SLCAN_CLOSED) {
        return false;
    }
    link->channel = channel;
    link->flags = 0;
    link->stats.opened++;
    return true;
}

static bool close_channel(struct kl_slcan_link *link, uint32_t length) {
    if (length != 1 || link->channel == KL_SLCAN_CLOSED) {
        return false;
    }
    link->channel = KL_SLCAN_CLOSED;
    return true;
}

/* S, s, Z, M, m: settings, which need a closed channel and their exact length. */
static bool set(struct kl_slcan_link *link, const char *line, uint32_t length) {
    uint32_t value = 0;
    uint32_t digits = line[0] == 'S' || line[0] == 'Z' ? 1 : line[0] == 's' ? 4 : 8;
    if (link->channel != KL_SLCAN_CLOSED || length != 1 + digits ||
        !kl_slcan_hex(line + 1, digits, &value)) {
        return false;
    }
    switch (line[0]) {
    case 'S':
        if (value > 9) { /* 9: 83.3 kbit/s, an addition that python-can knows */
            return false;
        }
        link->bit_rate_code = (uint8_t)value;
        return true;
    case 's':
        link->bit_rate_code = NO_BIT_RATE;
        link->bit_timing = (uint16_t)value;
        return true;
    case 'Z':
        link->timestamps = value == 1;
        return value <= 1;
    case 'M':
        link->filter_code = value;
        return true;
    default:
        link->filter_mask = value;
        return true;
    }
}

static void tell_flags(struct kl_slcan_link *link, uint32_t length) {
    static const char digits[] = "0123456789ABCDEF";
    if (length != 1 || link->channel == KL_SLCAN_CLOSED) {
        refuse(link);
        return;
    }
    const char text[4] = {'F', digits[link->flags >> 4], digits[link->flags & 15u], KL_SLCAN_CR};
    link->flags = 0;
    answer(link, text, sizeof text);
}

static void tell_serial(struct kl_slcan_link *link, uint32_t length) {
    char text[2 + KL_SLCAN_SERIAL_BYTES] = {'N'};
    if (length != 1) {
        refuse(link);
        return;
    }
    for (uint32_t i = 0; i < KL_SLCAN_SERIAL_BYTES; i++) {
        text[1 + i] = link->config.serial[i];
    }
    text[1 + KL_SLCAN_SERIAL_BYTES] = KL_SLCAN_CR;
    answer(link, text, sizeof text);
}

static void take_line(struct kl_slcan_link *link, const char *line, uint32_t length) {
    switch (length == 0 ? KL_SLCAN_CR : line[0]) {
    case KL_SLCAN_CR:
        answer_if(link, true);
        break;
    case 't':
    case 'T':
    case 'r':
    case 'R':
        take_frame(link, line, length);
        break;
    case 'O':
        answer_if(link, open_channel(link, length, KL_SLCAN_OPEN));
        break;
    case 'L':
        answer_if(link, open_channel(link, length, KL_SLCAN_LISTENING));
        break;
    case 'C':
        answer_if(link, close_channel(link, length));
        break;
    case 'S':
    case 's':
    case 'Z':
    case 'M':
    case 'm':
        answer_if(link, set(link, line, length));
        break;
    case 'F':
        tell_flags(link, length);
        break;
    case 'V':
        if (length == 1) {
            answer(link, "V0101\r", 6); /* hardware and software, two digits each */
        } else {
            refuse(link);
        }
        break;
    case 'N':
        tell_serial(link, length);
        break;
    default:
        refuse(link);
        break;
    }
}

/* ---- in ---- */

static void notice_lost_bytes(struct kl_slcan_link *link) {
    uint32_t lost = link->config.rx->lost;
    if (lost != link->lost_seen) {
        link->stats.lost_bytes += lost - link->lost_seen;
        link->lost_seen = lost;
        link->flags |= KL_SLCAN_FLAG_OVERRUN;
    }
}

static void link_service(void *context) {
    struct kl_slcan_link *link = context;
    unsigned char byte = 0;
    if (link == NULL || link->closed) {
        return;
    }
    notice_lost_bytes(link);
    for (uint32_t i = 0; i < KL_SLCAN_SERVICE_BYTES && kl_ring_get(link->config.rx, &byte); i++) {
        enum kl_slcan_event event = kl_slcan_read(&link->reader, byte);
        if (event == KL_SLCAN_LINE) {
            link->stats.lines++;
            take_line(link, link->reader.line, link->reader.length);
        } else if (event == KL_SLCAN_SPOILT) {
            link->stats.lines++;
            link->stats.spoilt++;
            refuse(link);
        }
    }
}

static enum kl_can_status link_receive(void *context, struct kl_can_frame *frame) {
    struct kl_slcan_link *link = context;
    if (link == NULL || frame == NULL) {
        return KL_CAN_ARGUMENT;
    }
    if (link->closed) {
        return KL_CAN_DOWN;
    }
    if (link->count == 0) {
        return KL_CAN_EMPTY;
    }
    *frame = link->config.queue[link->head];
    link->head = (link->head + 1) % link->config.queue_frames;
    link->count--;
    link->counts.received++;
    return KL_CAN_OK;
}

static bool link_is_up(void *context) {
    const struct kl_slcan_link *link = context;
    return link != NULL && !link->closed;
}

static void link_counts(void *context, struct kl_can_counts *counts) {
    const struct kl_slcan_link *link = context;
    if (link != NULL && counts != NULL) {
        *counts = link->counts;
    }
}

static enum kl_can_status link_recover(void *context) {
    return link_is_up(context) ? KL_CAN_OK : KL_CAN_DOWN;
}

static void link_close(void *context) {
    struct kl_slcan_link *link = context;
    if (link != NULL) {
        link->closed = true;
        link->channel = KL_SLCAN_CLOSED;
    }
}

struct kl_can kl_slcan_link_can(struct kl_slcan_link *link) {
    static const struct kl_can_ops ops = {.send = link_send,
                                          .receive = link_receive,
                                          .is_up = link_is_up,
                                          .counts = link_counts,
                                          .recover = link_recover,
                                          .service = link_service,
                                          .close = link_close};
    return (struct kl_can){.ops = &ops, .context = link};
}

/* ---- life cycle ---- */

static bool is_serial(const char *serial) {
    bool good = true;
    for (uint32_t i = 0; i < KL_SLCAN_SERIAL_BYTES && good; i++) {
        char c = serial[i];
        good = (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
    }
    return good && serial[KL_SLCAN_SERIAL_BYTES] == '\0';
}

static void forget_settings(struct kl_slcan_link *link) {
    kl_slcan_reader_init(&link->reader, false);
    link->channel = KL_SLCAN_CLOSED;
    link->timestamps = false;
    link->flags = 0;
    link->bit_rate_code = NO_BIT_RATE;
    link->bit_timing = 0;
    link->filter_code = 0;
    link->filter_mask = PASS_ALL;
}

enum kl_can_status kl_slcan_link_init(struct kl_slcan_link *link,
                                      const struct kl_slcan_link_config *config) {
    if (link == NULL || config == NULL || config->rx == NULL || config->tx == NULL ||
        config->tx->size < KL_SLCAN_LINE_BYTES + 1 || config->queue == NULL ||
        config->queue_frames < 1 || (config->serial != NULL && !is_serial(config->serial))) {
        return KL_CAN_ARGUMENT;
    }
    *link = (struct kl_slcan_link){.config = *config};
    if (config->serial == NULL) {
        link->config.serial = "KL01";
    }
    link->lost_seen = config->rx->lost;
    forget_settings(link);
    return KL_CAN_OK;
}

void kl_slcan_link_hang_up(struct kl_slcan_link *link) {
    forget_settings(link);
    kl_ring_clear(link->config.tx);
}

void kl_slcan_link_set_time(struct kl_slcan_link *link, uint64_t time_ms) {
    link->time_ms = (uint16_t)(time_ms % TIME_MODULO_MS);
}

enum kl_slcan_channel kl_slcan_link_channel(const struct kl_slcan_link *link) {
    return link->channel;
}

void kl_slcan_link_get_stats(const struct kl_slcan_link *link, struct kl_slcan_stats *stats) {
    if (link != NULL && stats != NULL) {
        *stats = link->stats;
    }
}
