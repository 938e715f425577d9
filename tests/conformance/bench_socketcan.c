/* SocketCAN under test on a real vcan; the other node is a plain raw socket of this program. */
#include "bench_socketcan.h"

#include "kl_socketcan.h"

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

static char interface[IFNAMSIZ] = "vcan0";
static struct kl_socketcan port;
static struct kl_can can_of_port;
static int peer = -1;

void vcan_shell(const char *format) {
    char command[256];
    (void)snprintf(command, sizeof command, format, interface);
    if (system(command) != 0)
        (void)fprintf(stderr, "bench_socketcan: failed: %s\n", command);
}

const char *vcan_name(void) {
    return interface;
}

bool vcan_inject(const void *frame, size_t bytes) {
    return send(peer, frame, bytes, 0) == (ssize_t)bytes;
}

static const char *available(const char *argument) {
    if (!kl_socketcan_available())
        return "this kernel has no CAN (tests/conformance/run_vcan.sh runs it in a guest)";
    if (argument[0] != '\0')
        (void)snprintf(interface, sizeof interface, "%s", argument);
    if (if_nametoindex(interface) == 0)
        return "there is no such interface";
    return NULL;
}

static bool open_peer(void) {
    const int on = 1;
    const int bytes = 1 << 22;
    struct ifreq request = {0};
    memcpy(request.ifr_name, interface, sizeof interface);
    peer = socket(PF_CAN, SOCK_RAW, CAN_RAW);
    if (peer < 0 || ioctl(peer, SIOCGIFINDEX, &request) != 0)
        return false;
    struct sockaddr_can address = {.can_family = AF_CAN, .can_ifindex = request.ifr_ifindex};
    return setsockopt(peer, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on) == 0 &&
           setsockopt(peer, SOL_SOCKET, SO_RCVBUFFORCE, &bytes, sizeof bytes) == 0 &&
           bind(peer, (struct sockaddr *)&address, sizeof address) == 0;
}

static bool open_port(struct kl_can *can, bool fd) {
    /* A small buffer, so that it can be made to overflow. */
    const struct kl_socketcan_options options = {
        .interface = interface, .fd = fd, .receive_buffer_bytes = 1 << 17};
    vcan_shell("tc qdisc del dev %s root 2>/dev/null; ip link set %1$s up");
    if (kl_socketcan_open(&port, &options) != KL_CAN_OK) {
        (void)fprintf(stderr, "bench_socketcan: %s\n", kl_socketcan_text(&port));
        return false;
    }
    *can = can_of_port = kl_socketcan_can(&port);
    return open_peer();
}

static bool open_classic(struct kl_can *can) {
    return open_port(can, false);
}

static bool open_fd(struct kl_can *can) {
    return open_port(can, true);
}

static void close_port(void) {
    kl_can_close(&can_of_port);
    (void)close(peer);
}

static bool peer_send(const struct kl_can_frame *frame) {
    bool fd = (frame->flags & KL_CAN_FD) != 0;
    struct canfd_frame out = {.can_id = frame->id, .len = frame->length};
    out.can_id |= (frame->flags & KL_CAN_EXTENDED) != 0 ? CAN_EFF_FLAG : 0;
    out.can_id |= (frame->flags & KL_CAN_REMOTE) != 0 ? CAN_RTR_FLAG : 0;
    out.flags = fd && (frame->flags & KL_CAN_BRS) != 0 ? CANFD_BRS : 0;
    memcpy(out.data, frame->data, sizeof out.data);
    size_t size = fd ? CANFD_MTU : CAN_MTU;
    return send(peer, &out, size, 0) == (ssize_t)size;
}

static bool receive_within(struct kl_can_frame *frame, int milliseconds) {
    struct pollfd waiting = {.fd = peer, .events = POLLIN};
    struct canfd_frame in;
    if (poll(&waiting, 1, milliseconds) <= 0)
        return false;
    ssize_t size = recv(peer, &in, sizeof in, MSG_DONTWAIT);
    if (size < 0) /* the news that the interface went down; the next one is a frame */
        size = recv(peer, &in, sizeof in, MSG_DONTWAIT);
    if (size < 0)
        return false;
    memset(frame, 0, sizeof *frame);
    bool extended = (in.can_id & CAN_EFF_FLAG) != 0;
    frame->id = in.can_id & (extended ? CAN_EFF_MASK : CAN_SFF_MASK);
    unsigned flags = (extended ? KL_CAN_EXTENDED : 0u) |
                     ((in.can_id & CAN_RTR_FLAG) != 0 ? KL_CAN_REMOTE : 0u) |
                     (size == CANFD_MTU ? KL_CAN_FD : 0u) |
                     (size == CANFD_MTU && (in.flags & CANFD_BRS) != 0 ? KL_CAN_BRS : 0u);
    frame->flags = (uint8_t)flags;
    frame->length = in.len;
    memcpy(frame->data, in.data, in.len);
    return true;
}

static bool peer_receive(struct kl_can_frame *frame) {
    return receive_within(frame, 1000);
}

static bool peer_hears(struct kl_can_frame *frame) {
    return receive_within(frame, 10);
}

/* About 60 frames a second, and room for ten. */
static void block(void) {
    vcan_shell("tc qdisc add dev %s root tbf rate 8kbit burst 64 limit 160");
}

static void unblock(void) {
    vcan_shell("tc qdisc del dev %s root");
}

static void take_down(void) {
    vcan_shell("ip link set %s down");
}

static void bring_up(void) {
    vcan_shell("ip link set %s up");
}

static void replace(void) {
    vcan_shell("ip link del %s && ip link add dev %1$s type vcan && ip link set %1$s mtu 72 up");
    (void)close(peer);
    (void)open_peer();
}

/* What a raw socket can put on a bus besides good frames. */
static bool garbage(int k) {
    struct canfd_frame out = {.can_id = 0x55, .len = 8};
    switch (k) {
    case 0: /* an error frame that is nobody's business here */
        out.can_id = CAN_ERR_FLAG | CAN_ERR_CRTL;
        return send(peer, &out, CAN_MTU, 0) == (ssize_t)CAN_MTU;
    case 1: /* an FD length that CAN does not have */
        out.len = 13;
        (void)send(peer, &out, CANFD_MTU, 0);
        return true;
    default:
        return false;
    }
}

#define COMMON                                                                                     \
    .carries_remote = true, .carries_bus_faults = true, .most_until_busy = 200,                    \
    .overflow_frames = 2000, .available = available, .close = close_port, .peer_send = peer_send,  \
    .peer_receive = peer_receive, .peer_hears = peer_hears, .block = block, .unblock = unblock,    \
    .take_down = take_down, .bring_up = bring_up, .replace = replace, .garbage = garbage

const struct bench bench_socketcan = {.name = "socketcan", .open = open_classic, COMMON};
const struct bench bench_socketcan_fd = {
    .name = "socketcan-fd", .carries_fd = true, .open = open_fd, COMMON};
