#include "kl_socketcand.h"

#include "kl_socketcand_text.h"

#include <arpa/inet.h>
#include <errno.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

#define MILLISECOND 1000000
#define NOBODY (-1)
#define OVERLONG (KL_SOCKETCAND_LINE_BYTES + 1u) /* line_length of a line that did not fit */

static int64_t clock_ns(clockid_t clock) {
    struct timespec now = {0};
    (void)clock_gettime(clock, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

/* ---- one client ---- */

static void drop_client(struct kl_socketcand *server, struct kl_socketcand_client *client) {
    if (client->stage == KL_SOCKETCAND_STREAMING)
        server->stats.streaming--;
    if (client->stage != KL_SOCKETCAND_FREE)
        server->stats.clients--;
    (void)close(client->socket);
    client->stage = KL_SOCKETCAND_FREE;
    client->socket = -1;
}

static bool put(struct kl_socketcand_client *client, const char *text, size_t length) {
    if (length > KL_SOCKETCAND_RING_BYTES - (client->head - client->tail))
        return false;
    size_t at = client->head & (KL_SOCKETCAND_RING_BYTES - 1);
    size_t first = KL_SOCKETCAND_RING_BYTES - at;
    if (first > length)
        first = length;
    memcpy(client->ring + at, text, first);
    memcpy(client->ring, text + first, length - first);
    client->head += (uint32_t)length;
    return true;
}

/* One system call. False: the connection is dead. */
static bool flush(struct kl_socketcand_client *client) {
    size_t waiting = client->head - client->tail;
    if (waiting == 0)
        return true;
    if (waiting > KL_SOCKETCAND_FLUSH_BYTES)
        waiting = KL_SOCKETCAND_FLUSH_BYTES;
    size_t at = client->tail & (KL_SOCKETCAND_RING_BYTES - 1);
    size_t first = KL_SOCKETCAND_RING_BYTES - at;
    if (first > waiting)
        first = waiting;
    struct iovec parts[2] = {{.iov_base = client->ring + at, .iov_len = first},
                             {.iov_base = client->ring, .iov_len = waiting - first}};
    struct msghdr message = {.msg_iov = parts, .msg_iovlen = first == waiting ? 1 : 2};
    ssize_t sent = sendmsg(client->socket, &message, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (sent >= 0)
        client->tail += (uint32_t)sent;
    return sent >= 0 || errno == EAGAIN || errno == EINTR || errno == ENOBUFS || errno == ENOMEM;
}

/* A reply goes out at once; a full ring swallows it: who does not read needs no answer. Between
 * frames it is led by a newline as they are. */
static void reply(struct kl_socketcand_client *client, const char *text) {
    if (client->stage != KL_SOCKETCAND_STREAMING || put(client, "\n", 1))
        (void)put(client, text, strlen(text));
    (void)flush(client); /* a dead connection shows at the next read */
}

/* ---- the bus ---- */

/* Puts a frame into the ring of every streaming client but one. Returns how many took it. */
static uint32_t broadcast(struct kl_socketcand *server, const struct kl_can_frame *frame, int but) {
    char line[KL_SOCKETCAND_FRAME_BYTES];
    size_t length = kl_socketcand_format(frame, clock_ns(CLOCK_REALTIME), line);
    uint32_t taken = 0;
    for (int i = 0; i < KL_SOCKETCAND_CLIENTS; i++) {
        struct kl_socketcand_client *client = &server->client[i];
        if (client->stage != KL_SOCKETCAND_STREAMING || i == but)
            continue;
        if (put(client, line, length))
            taken++;
        else
            server->stats.client_lost++;
    }
    return taken;
}

static void deliver(struct kl_socketcand *server, const struct kl_can_frame *frame, int from) {
    if (server->stats.streaming > 0)
        (void)broadcast(server, frame, from);
    if (server->queue_head - server->queue_tail == KL_SOCKETCAND_QUEUE) {
        server->counts.receive_dropped++;
        return;
    }
    server->queue[server->queue_head % KL_SOCKETCAND_QUEUE] = *frame;
    server->queue_head++;
}

/* ---- what clients say ---- */

static bool channel_fits(const struct kl_socketcand *server, const char *line, size_t length) {
    size_t name_length = 0;
    const char *name = kl_socketcand_word(line, length, 1, &name_length);
    if (name == NULL)
        return false;
    return server->channel[0] == '\0' || (name_length == strlen(server->channel) &&
                                          memcmp(name, server->channel, name_length) == 0);
}

static void misunderstood(struct kl_socketcand *server, struct kl_socketcand_client *client,
                          const char *answer) {
    server->counts.refused++;
    reply(client, answer);
}

static void handle_line(struct kl_socketcand *server, int index) {
    struct kl_socketcand_client *client = &server->client[index];
    const char *line = client->line;
    size_t length = client->line_length;
    bool raw = client->stage == KL_SOCKETCAND_QUIET || client->stage == KL_SOCKETCAND_STREAMING;
    if (length > KL_SOCKETCAND_LINE_BYTES) {
        misunderstood(server, client, "< error line too long >");
    } else if (raw && kl_socketcand_is(line, length, "send")) {
        struct kl_can_frame frame;
        if (kl_socketcand_parse(line, length, &frame) == KL_CAN_OK)
            deliver(server, &frame, index);
        else
            misunderstood(server, client, "< error not a classic data frame >");
    } else if (kl_socketcand_is(line, length, "echo")) {
        reply(client, "< echo >");
    } else if (client->stage == KL_SOCKETCAND_GREETED && kl_socketcand_is(line, length, "open")) {
        if (channel_fits(server, line, length)) {
            client->stage = KL_SOCKETCAND_OPENED;
            reply(client, "< ok >");
        } else {
            misunderstood(server, client, "< error could not open bus >");
        }
    } else if (client->stage == KL_SOCKETCAND_OPENED && kl_socketcand_is(line, length, "rawmode")) {
        client->stage = KL_SOCKETCAND_QUIET;
        client->since_ns = clock_ns(CLOCK_MONOTONIC);
        reply(client, "< ok >");
    } else {
        misunderstood(server, client, "< error unknown command >");
    }
}

/* A run of bytes outside < > counts once; white space between lines is welcome. */
static void outside(struct kl_socketcand *server, struct kl_socketcand_client *client, char c) {
    bool space = c == ' ' || c == '\n' || c == '\r' || c == '\t';
    if (!space && !client->garbage) {
        client->garbage = true;
        server->counts.refused++;
    }
}

static void take_byte(struct kl_socketcand *server, int index, char c) {
    struct kl_socketcand_client *client = &server->client[index];
    if (c == '<') {
        if (client->in_line)
            server->counts.refused++; /* the line before was cut off */
        client->in_line = true;
        client->garbage = false;
        client->line_length = 0;
    } else if (!client->in_line) {
        outside(server, client, c);
    } else if (c == '>') {
        client->in_line = false;
        handle_line(server, index);
    } else if (client->line_length < KL_SOCKETCAND_LINE_BYTES) {
        client->line[client->line_length++] = c;
    } else {
        client->line_length = OVERLONG;
    }
}

static void read_client(struct kl_socketcand *server, int index) {
    struct kl_socketcand_client *client = &server->client[index];
    char bytes[KL_SOCKETCAND_READ_BYTES];
    ssize_t size = recv(client->socket, bytes, sizeof bytes, MSG_DONTWAIT);
    if (size == 0 || (size < 0 && errno != EAGAIN && errno != EINTR)) {
        drop_client(server, client);
        return;
    }
    for (ssize_t i = 0; i < size; i++)
        take_byte(server, index, bytes[i]);
}

/* ---- connections ---- */

static void turn_away(struct kl_socketcand *server, int connection) {
    static const char text[] = "< error too many clients >";
    (void)send(connection, text, sizeof text - 1, MSG_DONTWAIT | MSG_NOSIGNAL);
    (void)close(connection);
    server->stats.turned_away++;
}

static void accept_client(struct kl_socketcand *server) {
    const int on = 1;
    int connection = accept4(server->listener, NULL, NULL, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (connection < 0)
        return;
    struct kl_socketcand_client *client = server->client;
    while (client < server->client + KL_SOCKETCAND_CLIENTS && client->stage != KL_SOCKETCAND_FREE)
        client++;
    if (client == server->client + KL_SOCKETCAND_CLIENTS) {
        turn_away(server, connection);
        return;
    }
    (void)setsockopt(connection, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    (void)setsockopt(connection, SOL_SOCKET, SO_SNDBUF, &server->send_buffer_bytes,
                     sizeof server->send_buffer_bytes);
    client->stage = KL_SOCKETCAND_GREETED;
    client->socket = connection;
    client->since_ns = clock_ns(CLOCK_MONOTONIC);
    client->head = client->tail = 0;
    client->line_length = 0;
    client->in_line = client->garbage = false;
    server->stats.accepted++;
    server->stats.clients++;
    reply(client, "< hi >");
}

/* One poll, at most one accept, and one read of every client that has something. */
static void listen_to_all(struct kl_socketcand *server) {
    struct pollfd polled[KL_SOCKETCAND_CLIENTS + 1];
    for (int i = 0; i < KL_SOCKETCAND_CLIENTS; i++)
        polled[i] = (struct pollfd){.fd = server->client[i].socket, .events = POLLIN};
    polled[KL_SOCKETCAND_CLIENTS] = (struct pollfd){.fd = server->listener, .events = POLLIN};
    if (poll(polled, KL_SOCKETCAND_CLIENTS + 1, 0) <= 0)
        return;
    for (int i = 0; i < KL_SOCKETCAND_CLIENTS; i++) {
        if (polled[i].revents != 0)
            read_client(server, i);
    }
    if (polled[KL_SOCKETCAND_CLIENTS].revents != 0)
        accept_client(server);
}

static void advance(struct kl_socketcand *server, struct kl_socketcand_client *client,
                    int64_t now_ns) {
    int64_t waited_ms = (now_ns - client->since_ns) / MILLISECOND;
    if (client->stage == KL_SOCKETCAND_QUIET && waited_ms >= KL_SOCKETCAND_QUIET_MS) {
        client->stage = KL_SOCKETCAND_STREAMING;
        server->stats.streaming++;
    } else if ((client->stage == KL_SOCKETCAND_GREETED || client->stage == KL_SOCKETCAND_OPENED) &&
               waited_ms >= KL_SOCKETCAND_HANDSHAKE_MS) {
        drop_client(server, client);
    }
}

/* ---- the seam ---- */

static enum kl_can_status server_send(void *context, const struct kl_can_frame *frame) {
    struct kl_socketcand *server = context;
    if (server == NULL || frame == NULL)
        return KL_CAN_ARGUMENT;
    if (kl_can_check(frame) != KL_CAN_OK || (frame->flags & ~KL_CAN_EXTENDED) != 0) {
        server->counts.refused++;
        server->counts.send_dropped++;
        return KL_CAN_REFUSED;
    }
    if (server->listener < 0) {
        server->counts.send_dropped++;
        return KL_CAN_DOWN;
    }
    if (server->stats.streaming > 0 && broadcast(server, frame, NOBODY) == 0) {
        server->counts.send_dropped++;
        return KL_CAN_BUSY;
    }
    server->counts.sent++;
    return KL_CAN_OK;
}

static enum kl_can_status server_receive(void *context, struct kl_can_frame *frame) {
    struct kl_socketcand *server = context;
    if (server == NULL || frame == NULL)
        return KL_CAN_ARGUMENT;
    if (server->listener < 0)
        return KL_CAN_DOWN;
    if (server->queue_head == server->queue_tail && server->read_due) {
        server->read_due = false;
        listen_to_all(server);
    }
    if (server->queue_head == server->queue_tail)
        return KL_CAN_EMPTY;
    *frame = server->queue[server->queue_tail % KL_SOCKETCAND_QUEUE];
    server->queue_tail++;
    server->counts.received++;
    return KL_CAN_OK;
}

static bool server_is_up(void *context) {
    const struct kl_socketcand *server = context;
    return server != NULL && server->listener >= 0;
}

static void server_counts(void *context, struct kl_can_counts *counts) {
    const struct kl_socketcand *server = context;
    if (server != NULL && counts != NULL)
        *counts = server->counts;
}

static enum kl_can_status server_recover(void *context) {
    return server_is_up(context) ? KL_CAN_OK : KL_CAN_DOWN;
}

static void server_service(void *context) {
    struct kl_socketcand *server = context;
    if (!server_is_up(server))
        return;
    listen_to_all(server);
    int64_t now_ns = clock_ns(CLOCK_MONOTONIC);
    for (int i = 0; i < KL_SOCKETCAND_CLIENTS; i++) {
        struct kl_socketcand_client *client = &server->client[i];
        if (client->stage == KL_SOCKETCAND_FREE)
            continue;
        if (flush(client))
            advance(server, client, now_ns);
        else
            drop_client(server, client);
    }
    server->read_due = true;
}

static void server_close(void *context) {
    struct kl_socketcand *server = context;
    if (!server_is_up(server))
        return;
    for (int i = 0; i < KL_SOCKETCAND_CLIENTS; i++) {
        if (server->client[i].stage != KL_SOCKETCAND_FREE)
            drop_client(server, &server->client[i]);
    }
    (void)close(server->listener);
    server->listener = -1;
    server->port = 0;
}

struct kl_can kl_socketcand_can(struct kl_socketcand *server) {
    static const struct kl_can_ops ops = {.send = server_send,
                                          .receive = server_receive,
                                          .is_up = server_is_up,
                                          .counts = server_counts,
                                          .recover = server_recover,
                                          .service = server_service,
                                          .close = server_close};
    return (struct kl_can){.ops = &ops, .context = server};
}

/* ---- life cycle ---- */

static enum kl_can_status failed(struct kl_socketcand *server, const char *what, uint16_t port) {
    (void)snprintf(server->text, sizeof server->text, "%s 127.0.0.1:%u: %s", what, (unsigned)port,
                   strerror(errno));
    if (server->listener >= 0)
        (void)close(server->listener);
    server->listener = -1;
    return KL_CAN_FAILED;
}

static enum kl_can_status start_listening(struct kl_socketcand *server, uint16_t port) {
    const int on = 1;
    struct sockaddr_in address = {
        .sin_family = AF_INET, .sin_port = htons(port), .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t size = sizeof address;
    server->listener = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (server->listener < 0)
        return failed(server, "socket for", port);
    (void)setsockopt(server->listener, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (bind(server->listener, (struct sockaddr *)&address, size) != 0)
        return failed(server, "bind", port);
    if (listen(server->listener, KL_SOCKETCAND_CLIENTS) != 0 ||
        getsockname(server->listener, (struct sockaddr *)&address, &size) != 0)
        return failed(server, "listen", port);
    server->port = ntohs(address.sin_port);
    return KL_CAN_OK;
}

enum kl_can_status kl_socketcand_open(struct kl_socketcand *server,
                                      const struct kl_socketcand_options *options) {
    if (server == NULL)
        return KL_CAN_ARGUMENT;
    memset(server, 0, sizeof *server);
    server->listener = -1;
    for (int i = 0; i < KL_SOCKETCAND_CLIENTS; i++)
        server->client[i].socket = -1;
    uint16_t port = options != NULL ? options->port : KL_SOCKETCAND_PORT;
    server->send_buffer_bytes = options != NULL && options->send_buffer_bytes > 0
                                    ? options->send_buffer_bytes
                                    : KL_SOCKETCAND_SEND_BUFFER_BYTES;
    if (options != NULL && options->channel != NULL) {
        if (strlen(options->channel) >= sizeof server->channel)
            return KL_CAN_ARGUMENT;
        memcpy(server->channel, options->channel, strlen(options->channel) + 1);
    }
    return start_listening(server, port);
}

uint16_t kl_socketcand_port(const struct kl_socketcand *server) {
    return server == NULL ? 0 : server->port;
}

void kl_socketcand_get_stats(const struct kl_socketcand *server,
                             struct kl_socketcand_stats *stats) {
    if (server != NULL && stats != NULL)
        *stats = server->stats;
}

const char *kl_socketcand_text(const struct kl_socketcand *server) {
    return server == NULL ? "" : server->text;
}
