#include "kl_socketcan.h"

#include <errno.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

/* Error frames and foreign frames that one receive passes over before it says "nothing". */
#define PASSED_OVER 8

static void note(struct kl_socketcan *port, const char *what, int error) {
    (void)snprintf(port->text, sizeof port->text, "%s: %s: %s", port->interface, what,
                   strerror(error));
}

bool kl_socketcan_available(void) {
    int probe = socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
    if (probe < 0)
        return errno != EAFNOSUPPORT && errno != EPROTONOSUPPORT;
    (void)close(probe);
    return true;
}

static void drop_socket(struct kl_socketcan *port) {
    if (port->socket >= 0)
        (void)close(port->socket);
    port->socket = -1;
    port->kernel_dropped = 0;
    port->up = false;
}

/* The options have to be set before the bind: frames arrive from then on. */
static bool set_options(struct kl_socketcan *port) {
    const int on = 1;
    const can_err_mask_t errors = CAN_ERR_BUSOFF;
    int bytes = port->receive_buffer_bytes;
    if (setsockopt(port->socket, SOL_SOCKET, SO_RCVBUFFORCE, &bytes, sizeof bytes) != 0)
        (void)setsockopt(port->socket, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
    (void)setsockopt(port->socket, SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on);
    (void)setsockopt(port->socket, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors);
    if (port->fd && setsockopt(port->socket, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on) != 0) {
        note(port, "FD frames", errno);
        return false;
    }
    return true;
}

/* Up and with a carrier: a controller that is bus-off has none. */
static bool running(const struct kl_socketcan *port) {
    struct ifreq request = {0};
    memcpy(request.ifr_name, port->interface, sizeof port->interface);
    return ioctl(port->socket, SIOCGIFFLAGS, &request) == 0 && (request.ifr_flags & IFF_UP) != 0 &&
           (request.ifr_flags & IFF_RUNNING) != 0;
}

static enum kl_can_status bind_socket(struct kl_socketcan *port) {
    struct ifreq request = {0};
    memcpy(request.ifr_name, port->interface, sizeof port->interface);
    if (ioctl(port->socket, SIOCGIFINDEX, &request) != 0) {
        note(port, "interface", errno);
        return KL_CAN_DOWN;
    }
    struct sockaddr_can address = {.can_family = AF_CAN, .can_ifindex = request.ifr_ifindex};
    if (port->fd &&
        (ioctl(port->socket, SIOCGIFMTU, &request) != 0 || request.ifr_mtu < (int)CANFD_MTU)) {
        (void)snprintf(port->text, sizeof port->text,
                       "%s: carries no FD frames (its mtu is below 72)", port->interface);
        return KL_CAN_FAILED;
    }
    if (bind(port->socket, (struct sockaddr *)&address, sizeof address) != 0) {
        note(port, "bind", errno);
        return errno == ENODEV || errno == ENETDOWN ? KL_CAN_DOWN : KL_CAN_FAILED;
    }
    port->reopen = false;
    if (!running(port)) {
        (void)snprintf(port->text, sizeof port->text, "%s: the interface is down", port->interface);
        return KL_CAN_DOWN;
    }
    return KL_CAN_OK;
}

/* A fresh socket on the interface of that name. While the interface does not exist, none is kept.
 */
static enum kl_can_status attach(struct kl_socketcan *port) {
    drop_socket(port);
    port->reopen = true;
    port->socket = socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
    if (port->socket < 0) {
        note(port, "socket", errno);
        return KL_CAN_FAILED;
    }
    enum kl_can_status status = set_options(port) ? bind_socket(port) : KL_CAN_FAILED;
    if (status == KL_CAN_FAILED) {
        drop_socket(port);
        return status;
    }
    if (port->reopen)
        drop_socket(port);
    port->up = status == KL_CAN_OK;
    return status;
}

enum kl_can_status kl_socketcan_open(struct kl_socketcan *port,
                                     const struct kl_socketcan_options *options) {
    if (port == NULL)
        return KL_CAN_ARGUMENT;
    memset(port, 0, sizeof *port);
    port->socket = -1;
    port->closed = true;
    if (options == NULL || options->interface == NULL || options->interface[0] == '\0' ||
        strlen(options->interface) >= sizeof port->interface)
        return KL_CAN_ARGUMENT;
    memcpy(port->interface, options->interface, strlen(options->interface) + 1);
    port->fd = options->fd;
    port->receive_buffer_bytes = options->receive_buffer_bytes > 0 ? options->receive_buffer_bytes
                                                                   : KL_SOCKETCAN_BUFFER_BYTES;
    enum kl_can_status status = attach(port);
    port->closed = status == KL_CAN_FAILED;
    return status;
}

const char *kl_socketcan_text(const struct kl_socketcan *port) {
    return port == NULL ? "" : port->text;
}

/* What an errno value of the socket says about the bus. */
static enum kl_can_status judge(struct kl_socketcan *port, const char *what, int error) {
    switch (error) {
    case ENOBUFS:
    case EAGAIN:
    case ENOMEM:
        return KL_CAN_BUSY;
    case EINVAL: /* the mtu of the interface was lowered below this kind of frame */
    case EMSGSIZE:
        return KL_CAN_REFUSED;
    case ENODEV:
    case ENXIO:
        port->reopen = true;
        port->up = false;
        break;
    case ENETDOWN:
    case ENETUNREACH:
        port->up = false;
        break;
    default:
        note(port, what, error);
        return KL_CAN_FAILED;
    }
    note(port, what, error);
    return KL_CAN_DOWN;
}

static size_t to_kernel(const struct kl_can_frame *frame, struct canfd_frame *out) {
    memset(out, 0, sizeof *out);
    out->can_id = frame->id;
    if ((frame->flags & KL_CAN_EXTENDED) != 0)
        out->can_id |= CAN_EFF_FLAG;
    if ((frame->flags & KL_CAN_REMOTE) != 0)
        out->can_id |= CAN_RTR_FLAG;
    out->len = frame->length;
    if ((frame->flags & KL_CAN_REMOTE) == 0)
        memcpy(out->data, frame->data, frame->length);
    if ((frame->flags & KL_CAN_FD) == 0)
        return CAN_MTU;
    out->flags = (frame->flags & KL_CAN_BRS) != 0 ? CANFD_BRS : 0;
    return CANFD_MTU;
}

static enum kl_can_status port_send(void *context, const struct kl_can_frame *frame) {
    struct kl_socketcan *port = context;
    if (port == NULL || frame == NULL)
        return KL_CAN_ARGUMENT;
    if (kl_can_check(frame) != KL_CAN_OK || ((frame->flags & KL_CAN_FD) != 0 && !port->fd)) {
        port->counts.refused++;
        port->counts.send_dropped++;
        return KL_CAN_REFUSED;
    }
    if (!port->up) {
        port->counts.send_dropped++;
        return KL_CAN_DOWN;
    }
    struct canfd_frame out;
    size_t size = to_kernel(frame, &out);
    if (send(port->socket, &out, size, MSG_DONTWAIT) == (ssize_t)size) {
        port->counts.sent++;
        return KL_CAN_OK;
    }
    enum kl_can_status status = judge(port, "send", errno);
    port->counts.refused += status == KL_CAN_REFUSED;
    port->counts.send_dropped++;
    return status;
}

/* The kernel tells, with each frame, how many it has dropped on this socket so far. */
static void take_drop_count(struct kl_socketcan *port, struct msghdr *message) {
    for (struct cmsghdr *part = CMSG_FIRSTHDR(message); part != NULL;
         part = CMSG_NXTHDR(message, part)) {
        if (part->cmsg_level == SOL_SOCKET && part->cmsg_type == SO_RXQ_OVFL) {
            uint32_t total;
            memcpy(&total, CMSG_DATA(part), sizeof total);
            port->counts.receive_dropped += (uint32_t)(total - port->kernel_dropped);
            port->kernel_dropped = total;
        }
    }
}

static ssize_t read_frame(struct kl_socketcan *port, struct canfd_frame *in) {
    union {
        char bytes[CMSG_SPACE(sizeof(uint32_t))];
        struct cmsghdr align;
    } control;
    struct iovec place = {.iov_base = in, .iov_len = sizeof *in};
    struct msghdr message = {.msg_iov = &place,
                             .msg_iovlen = 1,
                             .msg_control = control.bytes,
                             .msg_controllen = sizeof control.bytes};
    ssize_t size = recvmsg(port->socket, &message, MSG_DONTWAIT);
    if (size >= 0)
        take_drop_count(port, &message);
    return size;
}

static bool from_kernel(const struct canfd_frame *in, size_t size, struct kl_can_frame *frame) {
    struct kl_can_frame read = {0};
    if ((size != CAN_MTU && size != CANFD_MTU) || in->len > (size == CAN_MTU ? 8u : 64u))
        return false;
    read.length = in->len;
    if ((in->can_id & CAN_EFF_FLAG) != 0) {
        read.id = in->can_id & CAN_EFF_MASK;
        read.flags |= KL_CAN_EXTENDED;
    } else {
        read.id = in->can_id & CAN_SFF_MASK;
    }
    if (size == CANFD_MTU)
        read.flags =
            (uint8_t)(read.flags | KL_CAN_FD | ((in->flags & CANFD_BRS) != 0 ? KL_CAN_BRS : 0));
    if ((in->can_id & CAN_RTR_FLAG) != 0)
        read.flags |= KL_CAN_REMOTE;
    else
        memcpy(read.data, in->data, in->len);
    if (kl_can_check(&read) != KL_CAN_OK)
        return false;
    *frame = read;
    return true;
}

static enum kl_can_status port_receive(void *context, struct kl_can_frame *frame) {
    struct kl_socketcan *port = context;
    if (port == NULL || frame == NULL)
        return KL_CAN_ARGUMENT;
    if (port->socket < 0)
        return KL_CAN_DOWN;
    for (int passed = 0; passed < PASSED_OVER; passed++) {
        struct canfd_frame in;
        ssize_t size = read_frame(port, &in);
        if (size < 0) {
            enum kl_can_status status = judge(port, "receive", errno);
            if (status == KL_CAN_BUSY)
                return port->up ? KL_CAN_EMPTY : KL_CAN_DOWN;
            return status;
        }
        if ((in.can_id & CAN_ERR_FLAG) != 0) {
            if ((in.can_id & CAN_ERR_BUSOFF) != 0) {
                port->up = false;
                (void)snprintf(port->text, sizeof port->text, "%s: bus-off", port->interface);
            }
        } else if (from_kernel(&in, (size_t)size, frame)) {
            port->counts.received++;
            return KL_CAN_OK;
        } else {
            port->counts.refused++;
        }
    }
    return KL_CAN_EMPTY;
}

static bool port_is_up(void *context) {
    const struct kl_socketcan *port = context;
    return port != NULL && port->up;
}

static void port_counts(void *context, struct kl_can_counts *counts) {
    const struct kl_socketcan *port = context;
    if (port != NULL && counts != NULL)
        *counts = port->counts;
}

static enum kl_can_status port_recover(void *context) {
    struct kl_socketcan *port = context;
    if (port == NULL)
        return KL_CAN_ARGUMENT;
    if (port->up)
        return KL_CAN_OK;
    if (port->closed)
        return KL_CAN_DOWN;
    if (port->reopen) {
        if (attach(port) != KL_CAN_OK)
            return KL_CAN_DOWN;
    } else if (!running(port)) {
        return KL_CAN_DOWN;
    } else {
        /* The error of the time before would otherwise hit the first frame after it. */
        int error = 0;
        socklen_t size = sizeof error;
        (void)getsockopt(port->socket, SOL_SOCKET, SO_ERROR, &error, &size);
        if (error == ENODEV || error == ENXIO) {
            port->reopen = true;
            return KL_CAN_DOWN;
        }
        port->up = true;
    }
    port->counts.recoveries++;
    return KL_CAN_OK;
}

static void port_close(void *context) {
    struct kl_socketcan *port = context;
    if (port == NULL)
        return;
    drop_socket(port);
    port->closed = true;
}

struct kl_can kl_socketcan_can(struct kl_socketcan *port) {
    static const struct kl_can_ops ops = {.send = port_send,
                                          .receive = port_receive,
                                          .is_up = port_is_up,
                                          .counts = port_counts,
                                          .recover = port_recover,
                                          .service = NULL,
                                          .close = port_close};
    return (struct kl_can){.ops = &ops, .context = port};
}
