/* CRC-8 SAE J1850 and the alive counter; see kl_protect.h. */
#include "kl_protect.h"

#define POLYNOMIAL 0x1Du

static uint8_t crc_byte(uint8_t crc, uint8_t byte) {
    unsigned shift = (unsigned)crc ^ byte;
    for (unsigned bit = 0; bit < 8; bit++) {
        shift = (shift & 0x80u) != 0 ? (shift << 1) ^ POLYNOMIAL : shift << 1;
    }
    return (uint8_t)(shift & 0xFFu);
}

uint8_t kl_crc8_j1850(const uint8_t *data, size_t size_bytes) {
    uint8_t crc = 0xFFu;
    for (size_t i = 0; i < size_bytes; i++) {
        crc = crc_byte(crc, data[i]);
    }
    return (uint8_t)(crc ^ 0xFFu);
}

/* Data ID, low byte first, then the frame without its CRC; not inverted at either end, which is
 * what profile 11 comes to. */
static uint8_t frame_crc(uint16_t data_id, const uint8_t *data, size_t length) {
    uint8_t crc = crc_byte(0, (uint8_t)(data_id & 0xFFu));
    crc = crc_byte(crc, (uint8_t)(data_id >> 8));
    for (size_t i = 1; i < length; i++) {
        crc = crc_byte(crc, data[i]);
    }
    return crc;
}

void kl_protect_init(struct kl_protect *protect, uint16_t data_id) {
    *protect = (struct kl_protect){.data_id = data_id, .last = KL_PROTECT_NO_COUNTER};
}

void kl_protect_seal(uint16_t data_id, uint8_t *counter, uint8_t *data, size_t length) {
    if (length < KL_PROTECT_BYTES) {
        return;
    }
    unsigned now = *counter < KL_PROTECT_MODULUS ? *counter : 0u;
    data[1] = (uint8_t)((data[1] & 0xF0u) | now);
    data[0] = frame_crc(data_id, data, length);
    *counter = (uint8_t)((now + 1u) % KL_PROTECT_MODULUS);
}

enum kl_protect_result kl_protect_check(struct kl_protect *protect, const uint8_t *data,
                                        size_t length) {
    unsigned now = length < KL_PROTECT_BYTES ? KL_PROTECT_MODULUS : data[1] & 0x0Fu;
    if (now >= KL_PROTECT_MODULUS || frame_crc(protect->data_id, data, length) != data[0]) {
        protect->bad_crc++;
        return KL_PROTECT_BAD_CRC;
    }
    unsigned last = protect->last;
    protect->last = (uint8_t)now;
    if (now == last) {
        protect->repeated++;
        return KL_PROTECT_REPEATED;
    }
    if (last != KL_PROTECT_NO_COUNTER && now != (last + 1u) % KL_PROTECT_MODULUS) {
        protect->gaps++;
        return KL_PROTECT_GAP;
    }
    protect->ok++;
    return KL_PROTECT_OK;
}

const char *kl_protect_text(enum kl_protect_result result) {
    switch (result) {
    case KL_PROTECT_OK:
        return "ok";
    case KL_PROTECT_REPEATED:
        return "repeated";
    case KL_PROTECT_GAP:
        return "sequence gap";
    case KL_PROTECT_BAD_CRC:
        return "bad CRC";
    }
    return "unknown protection result";
}
