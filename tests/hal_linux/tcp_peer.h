/*
 * tcp_peer.h - a socketcand client for tests, written from the protocol and not with the server's
 * own text functions. Header only: every test program is one source file.
 */
#ifndef TCP_PEER_H
#define TCP_PEER_H

#include "kl_can.h"

#include <arpa/inet.h>
#include <errno.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

struct tcp_peer {
    int socket;
    size_t length;
    char text[8192];
};

static inline int64_t test_now_ns(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

static inline void test_sleep_us(int64_t us) {
    struct timespec t = {.tv_sec = us / 1000000, .tv_nsec = us % 1000000 * 1000};
    nanosleep(&t, NULL);
}

/* `receive_buffer_bytes` 0: the kernel's choice. */
static inline bool tcp_peer_connect(struct tcp_peer *peer, uint16_t port,
                                    int receive_buffer_bytes) {
    struct sockaddr_in address = {
        .sin_family = AF_INET, .sin_port = htons(port), .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    const int on = 1;
    memset(peer, 0, sizeof *peer);
    peer->socket = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (receive_buffer_bytes > 0)
        setsockopt(peer->socket, SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes,
                   sizeof receive_buffer_bytes);
    setsockopt(peer->socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    return connect(peer->socket, (struct sockaddr *)&address, sizeof address) == 0;
}

static inline void tcp_peer_close(struct tcp_peer *peer) {
    if (peer->socket >= 0)
        close(peer->socket);
    peer->socket = -1;
}

static inline bool tcp_peer_say(struct tcp_peer *peer, const char *text, size_t length) {
    return send(peer->socket, text, length, MSG_NOSIGNAL) == (ssize_t)length;
}

/* One read: its bytes are appended to text. <0 nothing there, 0 closed, else bytes. */
static inline ssize_t tcp_peer_read(struct tcp_peer *peer) {
    ssize_t got = recv(peer->socket, peer->text + peer->length,
                       sizeof peer->text - 1 - peer->length, MSG_DONTWAIT);
    if (got > 0)
        peer->length += (size_t)got;
    peer->text[peer->length] = '\0';
    return got;
}

/* Forgets the first bytes of text. */
static inline void tcp_peer_eat(struct tcp_peer *peer, size_t bytes) {
    memmove(peer->text, peer->text + bytes, peer->length - bytes);
    peer->length -= bytes;
    peer->text[peer->length] = '\0';
}

static inline bool tcp_peer_send(struct tcp_peer *peer, const struct kl_can_frame *frame) {
    char line[96];
    int at = snprintf(line, sizeof line, "< send %0*X %X ",
                      (frame->flags & KL_CAN_EXTENDED) != 0 ? 8 : 3, (unsigned)frame->id,
                      (unsigned)frame->length);
    for (int i = 0; i < frame->length; i++)
        at += snprintf(line + at, sizeof line - (size_t)at, "%x ", (unsigned)frame->data[i]);
    at += snprintf(line + at, sizeof line - (size_t)at, ">");
    return tcp_peer_say(peer, line, (size_t)at);
}

/* Takes the first "< frame ... >" out of text, if it is there whole. Other lines are passed over.
 */
static inline bool tcp_peer_take(struct tcp_peer *peer, struct kl_can_frame *frame) {
    for (;;) {
        char *start = strchr(peer->text, '<');
        char *end = start == NULL ? NULL : strchr(start, '>');
        if (end == NULL)
            return false;
        char id[16] = "";
        int data_at = 0;
        bool is_frame =
            sscanf(start, "< frame %15[0-9A-F] %*[0-9].%*6[0-9]%n", id, &data_at) == 1 &&
            data_at > 0;
        if (is_frame) {
            memset(frame, 0, sizeof *frame);
            frame->id = (uint32_t)strtoul(id, NULL, 16);
            frame->flags = strlen(id) == 8 ? KL_CAN_EXTENDED : 0;
            for (char *hex = start + data_at + 1; hex + 1 < end && *hex != ' '; hex += 2) {
                char two[3] = {hex[0], hex[1], '\0'};
                frame->data[frame->length++] = (uint8_t)strtoul(two, NULL, 16);
            }
        }
        tcp_peer_eat(peer, (size_t)(end + 1 - peer->text));
        if (is_frame)
            return true;
    }
}

/* Waits until text holds `wanted` and nothing else, calling the server's service meanwhile. */
static inline bool tcp_peer_expect(struct tcp_peer *peer, const struct kl_can *server,
                                   const char *wanted) {
    for (int i = 0; i < 2000; i++) {
        kl_can_service(server);
        tcp_peer_read(peer);
        if (peer->length >= strlen(wanted)) {
            bool same = strcmp(peer->text, wanted) == 0;
            tcp_peer_eat(peer, peer->length);
            return same;
        }
        test_sleep_us(500);
    }
    return false;
}

/* Connects and goes through the handshake; the peer streams when this returns true. */
static inline bool tcp_peer_join(struct tcp_peer *peer, const struct kl_can *server, uint16_t port,
                                 int receive_buffer_bytes) {
    static const char open_line[] = "< open vcan0 >";
    static const char raw_line[] = "< rawmode >";
    if (!tcp_peer_connect(peer, port, receive_buffer_bytes) ||
        !tcp_peer_expect(peer, server, "< hi >") ||
        !tcp_peer_say(peer, open_line, sizeof open_line - 1) ||
        !tcp_peer_expect(peer, server, "< ok >") ||
        !tcp_peer_say(peer, raw_line, sizeof raw_line - 1) ||
        !tcp_peer_expect(peer, server, "< ok >"))
        return false;
    test_sleep_us(25000);
    kl_can_service(server);
    return true;
}

#endif
