/* The slcan link under test; the other node holds the other end of the two rings, as a program at
 * an adapter does. */
#include "bench.h"

#include "kl_slcan_link.h"

#include <stddef.h>
#include <string.h>

#define RX_BYTES 4096u
#define TX_BYTES 8192u
#define QUEUE 256u

static unsigned char rx_bytes[RX_BYTES];
static unsigned char tx_bytes[TX_BYTES];
static struct kl_ring rx;
static struct kl_ring tx;
static struct kl_can_frame queue[QUEUE];
static struct kl_slcan_link link;
static struct kl_can can_of_link;
static struct kl_slcan_reader reader;

static const char *available(const char *argument) {
    (void)argument;
    return NULL;
}

static bool say(const char *bytes, size_t size) {
    for (size_t i = 0; i < size; i++) {
        if (kl_ring_room(&rx) < 2)
            kl_can_service(&can_of_link);
        (void)kl_ring_put(&rx, (unsigned char)bytes[i]);
    }
    kl_can_service(&can_of_link);
    return true;
}

static bool open_link(struct kl_can *can) {
    const struct kl_slcan_link_config config = {
        .rx = &rx, .tx = &tx, .queue = queue, .queue_frames = QUEUE};
    if (!kl_ring_init(&rx, rx_bytes, RX_BYTES) || !kl_ring_init(&tx, tx_bytes, TX_BYTES) ||
        kl_slcan_link_init(&link, &config) != KL_CAN_OK)
        return false;
    kl_slcan_reader_init(&reader, true);
    *can = can_of_link = kl_slcan_link_can(&link);
    return say("C\rS6\rO\r", 7);
}

static void close_link(void) {
    kl_can_close(&can_of_link);
}

static bool peer_send(const struct kl_can_frame *frame) {
    char text[KL_SLCAN_LINE_BYTES];
    uint32_t size = kl_slcan_encode(frame, KL_SLCAN_NO_TIME, text);
    return size > 0 && say(text, size);
}

/* The next frame among the answers. */
static bool peer_receive(struct kl_can_frame *frame) {
    unsigned char byte = 0;
    while (kl_ring_get(&tx, &byte)) {
        if (kl_slcan_read(&reader, byte) == KL_SLCAN_LINE &&
            kl_slcan_decode(reader.line, reader.length, frame, NULL) == KL_CAN_OK)
            return true;
    }
    return false;
}

/* Blocked by itself as long as the other end does not read. */
static void leave_alone(void) {
}

static bool garbage(int k) {
    static const char *const lines[] = {
        "hello\r", "t12\r", "t1239\r", "t1232A\r", "T123\r",  "tGGG0\r",   "\x80\xFF\r",
        "S6\r",    "O\r",   "\r\r\r",  "\a\a\r",   "t8000\r", "t123\r0\r", "T200000000\r"};
    const int n_lines = (int)(sizeof lines / sizeof lines[0]);
    if (k < n_lines)
        return say(lines[k], strlen(lines[k]));
    if (k == n_lines) { /* every byte there is, in a pattern that repeats badly */
        char bytes[4096];
        uint32_t number = 1;
        for (size_t i = 0; i < sizeof bytes; i++) {
            number = number * 1664525u + 1013904223u;
            bytes[i] = (char)(number >> 24);
        }
        return say(bytes, sizeof bytes) && say("\r", 1);
    }
    if (k == n_lines + 1) { /* a line that never ends, then does */
        for (int i = 0; i < 5000; i++)
            (void)say("1", 1);
        return say("\r", 1);
    }
    return false;
}

const struct bench bench_slcan = {.name = "slcan",
                                  .carries_remote = true,
                                  .most_until_busy = TX_BYTES / 22 + 2,
                                  .overflow_frames = QUEUE + 50,
                                  .available = available,
                                  .open = open_link,
                                  .close = close_link,
                                  .peer_send = peer_send,
                                  .peer_receive = peer_receive,
                                  .peer_hears = peer_receive,
                                  .block = leave_alone,
                                  .unblock = leave_alone,
                                  .garbage = garbage};
