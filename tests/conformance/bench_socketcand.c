/* The socketcand server under test; the other node is a TCP client in this program. */
#include "bench.h"

#include "hal_linux/tcp_peer.h"
#include "kl_socketcand.h"

static struct kl_socketcand server;
static struct kl_can can_of_server;
static struct tcp_peer peer;

static const char *available(const char *argument) {
    (void)argument;
    return NULL;
}

/* Small buffers in the kernel, so that a client who does not read is soon noticed. */
static bool open_server(struct kl_can *can) {
    const struct kl_socketcand_options options = {.port = 0, .send_buffer_bytes = 4096};
    if (kl_socketcand_open(&server, &options) != KL_CAN_OK)
        return false;
    *can = can_of_server = kl_socketcand_can(&server);
    return tcp_peer_join(&peer, &can_of_server, kl_socketcand_port(&server), 4096);
}

static void close_server(void) {
    tcp_peer_close(&peer);
    kl_can_close(&can_of_server);
}

static bool peer_send(const struct kl_can_frame *frame) {
    bool sent = tcp_peer_send(&peer, frame);
    kl_can_service(&can_of_server);
    return sent;
}

static bool receive_within(struct kl_can_frame *frame, int milliseconds) {
    int64_t end = test_now_ns() + (int64_t)milliseconds * 1000000;
    do {
        kl_can_service(&can_of_server);
        tcp_peer_read(&peer);
        if (tcp_peer_take(&peer, frame))
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

static bool say(const char *text) {
    return tcp_peer_say(&peer, text, strlen(text));
}

static void rejoin(void) {
    tcp_peer_close(&peer);
    kl_can_service(&can_of_server);
    (void)tcp_peer_join(&peer, &can_of_server, kl_socketcand_port(&server), 4096);
}

static bool garbage(int k) {
    static const char *const lines[] = {"hello",
                                        "< send 123 4  >",
                                        "< send 123 9 1 2 3 4 5 6 7 8 9 >",
                                        "< send xyz 1 1 >",
                                        "< send 123 1 100 >",
                                        "< send 123 2 1 >",
                                        "< send 123 1 1 1 >",
                                        "< send 3FFFFFFF 0  >",
                                        "< send >",
                                        "< nonsense >",
                                        "<>",
                                        "< send 123 < echo >",
                                        "> > >"};
    const int n_lines = (int)(sizeof lines / sizeof lines[0]);
    if (k < n_lines)
        return say(lines[k]);
    if (k == n_lines) { /* every byte there is, in a pattern that repeats badly */
        char bytes[4096];
        uint32_t number = 1;
        for (size_t i = 0; i < sizeof bytes; i++) {
            number = number * 1664525u + 1013904223u;
            bytes[i] = (char)(number >> 24);
        }
        return tcp_peer_say(&peer, bytes, sizeof bytes) && say(">");
    }
    if (k == n_lines + 1) { /* a line that never ends, then one that does */
        for (int i = 0; i < 50; i++)
            (void)say("< send 123 8 1 1 1 1 1 1 1 1 1 1 1 1 1 ");
        for (int i = 0; i < 50; i++)
            (void)say("1234567890");
        return say(">");
    }
    if (k == n_lines + 2) { /* gone in the middle of a line, and another client comes */
        (void)say("< garbage > < send 12");
        kl_can_service(&can_of_server);
        rejoin();
        return true;
    }
    return false;
}

const struct bench bench_socketcand = {.name = "socketcand",
                                       .most_until_busy = 20000,
                                       .overflow_frames = 3000,
                                       .available = available,
                                       .open = open_server,
                                       .close = close_server,
                                       .peer_send = peer_send,
                                       .peer_receive = peer_receive,
                                       .peer_hears = peer_hears,
                                       .block = block,
                                       .unblock = unblock,
                                       .garbage = garbage};
