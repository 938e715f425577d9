/* The slcan pty under test; the other node opens the terminal as a client does. */
#include "bench.h"

#include "hal_linux/tcp_peer.h"
#include "kl_slcan_pty.h"

#include <errno.h>
#include <fcntl.h>

static struct kl_slcan_pty pty;
static struct kl_can can_of_pty;
static struct kl_slcan_reader reader;
static unsigned char bytes[4096]; /* read, not looked at yet */
static size_t n_bytes;
static size_t at_byte;
static int client = -1;

static const char *available(const char *argument) {
    (void)argument;
    return NULL;
}

/* All of it, with the back end at work in between. */
static bool say(const char *text, size_t size) {
    for (int patience = 0; size > 0 && patience < 10000; patience++) {
        ssize_t written = write(client, text, size);
        if (written > 0) {
            text += written;
            size -= (size_t)written;
        } else if (errno != EAGAIN) {
            return false;
        }
        kl_can_service(&can_of_pty);
    }
    return size == 0;
}

static bool join(void) {
    client = open(kl_slcan_pty_name(&pty), O_RDWR | O_NOCTTY | O_NONBLOCK);
    kl_slcan_reader_init(&reader, true);
    n_bytes = at_byte = 0;
    kl_can_service(&can_of_pty);
    return client >= 0 && say("O\r", 2);
}

static bool open_pty(struct kl_can *can) {
    if (kl_slcan_pty_open(&pty, NULL) != KL_CAN_OK)
        return false;
    *can = can_of_pty = kl_slcan_pty_can(&pty);
    if (!join())
        return false;
    for (int i = 0; i < 100 && kl_slcan_link_channel(&pty.link) != KL_SLCAN_OPEN; i++) {
        test_sleep_us(100);
        kl_can_service(&can_of_pty);
    }
    return kl_slcan_link_channel(&pty.link) == KL_SLCAN_OPEN;
}

static void close_pty(void) {
    (void)close(client);
    client = -1;
    kl_can_close(&can_of_pty);
}

static bool peer_send(const struct kl_can_frame *frame) {
    char text[KL_SLCAN_LINE_BYTES];
    uint32_t size = kl_slcan_encode(frame, KL_SLCAN_NO_TIME, text);
    return size > 0 && say(text, size);
}

static bool next_frame(struct kl_can_frame *frame) {
    if (at_byte == n_bytes) {
        ssize_t size = read(client, bytes, sizeof bytes);
        n_bytes = size > 0 ? (size_t)size : 0;
        at_byte = 0;
    }
    while (at_byte < n_bytes) {
        if (kl_slcan_read(&reader, bytes[at_byte++]) == KL_SLCAN_LINE &&
            kl_slcan_decode(reader.line, reader.length, frame, NULL) == KL_CAN_OK)
            return true;
    }
    return false;
}

static bool receive_within(struct kl_can_frame *frame, int milliseconds) {
    int64_t end = test_now_ns() + (int64_t)milliseconds * 1000000;
    do {
        kl_can_service(&can_of_pty);
        if (next_frame(frame))
            return true;
        test_sleep_us(50);
    } while (test_now_ns() < end);
    return false;
}

static bool peer_receive(struct kl_can_frame *frame) {
    return receive_within(frame, 1000);
}

static bool peer_hears(struct kl_can_frame *frame) {
    return receive_within(frame, 20);
}

/* The bus is blocked by itself as long as the client does not read. */
static void block(void) {
}

static void unblock(void) {
    struct kl_can_frame frame;
    while (peer_hears(&frame)) {
    }
}

static bool garbage(int k) {
    static const char *const lines[] = {"hello\r", "t12\r", "t1239\r", "\x80\xFF\r", "S6\r", "\r"};
    const int n_lines = (int)(sizeof lines / sizeof lines[0]);
    if (k < n_lines)
        return say(lines[k], strlen(lines[k]));
    if (k == n_lines) { /* gone in the middle of a line, and another client comes */
        (void)say("t1232A", 6);
        (void)close(client);
        for (int i = 0; i < 3; i++)
            kl_can_service(&can_of_pty);
        return join();
    }
    return false;
}

const struct bench bench_slcan_pty = {.name = "slcan-pty",
                                      .carries_remote = true,
                                      .most_until_busy = 20000,
                                      .overflow_frames = KL_SLCAN_PTY_QUEUE + 50,
                                      .available = available,
                                      .open = open_pty,
                                      .close = close_pty,
                                      .peer_send = peer_send,
                                      .peer_receive = peer_receive,
                                      .peer_hears = peer_hears,
                                      .block = block,
                                      .unblock = unblock,
                                      .garbage = garbage};
