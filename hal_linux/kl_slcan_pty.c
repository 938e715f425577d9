#include "kl_slcan_pty.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

/* ---- bytes ---- */

/* What the kernel keeps for the other end goes away by the other end alone. */
static void drop_unread(const struct kl_slcan_pty *pty) {
    int slave = open(pty->name, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (slave >= 0) {
        (void)tcflush(slave, TCIFLUSH);
        (void)close(slave);
    }
}

/* Whatever was under way was meant for the client that has gone. */
static void hang_up(struct kl_slcan_pty *pty) {
    if (pty->attached) {
        kl_slcan_link_hang_up(&pty->link);
        kl_ring_clear(&pty->rx);
        pty->n_pending = 0;
        pty->attached = false;
        drop_unread(pty);
    }
}

/* As much as the ring has room for: the rest waits in the kernel, nothing is lost. EIO: nobody
 * holds the other end. */
static void pull(struct kl_slcan_pty *pty) {
    unsigned char bytes[KL_SLCAN_PTY_RX_BYTES];
    uint32_t room = kl_ring_room(&pty->rx);
    ssize_t size = room > 0 ? read(pty->master, bytes, room) : 0;
    if (size < 0 && errno == EIO) {
        hang_up(pty);
        return;
    }
    pty->attached = true;
    for (ssize_t i = 0; i < size; i++)
        (void)kl_ring_put(&pty->rx, bytes[i]);
}

static void push(struct kl_slcan_pty *pty) {
    pty->n_pending += kl_ring_read(&pty->tx, pty->pending + pty->n_pending,
                                   KL_SLCAN_PTY_FLUSH_BYTES - pty->n_pending);
    if (pty->n_pending == 0)
        return;
    ssize_t size = write(pty->master, pty->pending, pty->n_pending);
    if (size > 0) {
        pty->n_pending -= (uint32_t)size;
        memmove(pty->pending, pty->pending + size, pty->n_pending);
    }
}

/* ---- the seam ---- */

static struct kl_can inner(void *context) {
    struct kl_slcan_pty *pty = context;
    return kl_slcan_link_can(pty == NULL ? NULL : &pty->link);
}

static enum kl_can_status pty_send(void *context, const struct kl_can_frame *frame) {
    const struct kl_can can = inner(context);
    return kl_can_send(&can, frame);
}

static enum kl_can_status pty_receive(void *context, struct kl_can_frame *frame) {
    const struct kl_can can = inner(context);
    return kl_can_receive(&can, frame);
}

static bool pty_is_up(void *context) {
    const struct kl_can can = inner(context);
    return kl_can_is_up(&can);
}

static void pty_counts(void *context, struct kl_can_counts *counts) {
    const struct kl_can can = inner(context);
    if (context != NULL && counts != NULL)
        kl_can_get_counts(&can, counts);
}

static enum kl_can_status pty_recover(void *context) {
    const struct kl_can can = inner(context);
    return kl_can_recover(&can);
}

static void pty_service(void *context) {
    struct kl_slcan_pty *pty = context;
    const struct kl_can can = inner(context);
    if (pty == NULL || pty->master < 0)
        return;
    pull(pty);
    kl_can_service(&can);
    if (pty->attached)
        push(pty);
}

static void remove_link(struct kl_slcan_pty *pty) {
    char target[KL_SLCAN_PTY_PATH_BYTES] = "";
    if (pty->path[0] != '\0' && readlink(pty->path, target, sizeof target - 1) > 0 &&
        strcmp(target, pty->name) == 0)
        (void)unlink(pty->path); /* ours still */
    pty->path[0] = '\0';
}

static void pty_close(void *context) {
    struct kl_slcan_pty *pty = context;
    const struct kl_can can = inner(context);
    if (pty == NULL || pty->master < 0)
        return;
    kl_can_close(&can);
    remove_link(pty);
    (void)close(pty->master);
    pty->master = -1;
    pty->name[0] = '\0';
}

struct kl_can kl_slcan_pty_can(struct kl_slcan_pty *pty) {
    static const struct kl_can_ops ops = {.send = pty_send,
                                          .receive = pty_receive,
                                          .is_up = pty_is_up,
                                          .counts = pty_counts,
                                          .recover = pty_recover,
                                          .service = pty_service,
                                          .close = pty_close};
    return (struct kl_can){.ops = &ops, .context = pty};
}

/* ---- life cycle ---- */

static enum kl_can_status failed(struct kl_slcan_pty *pty, const char *what) {
    (void)snprintf(pty->text, sizeof pty->text, "%s: %s", what, strerror(errno));
    if (pty->master >= 0)
        (void)close(pty->master);
    pty->master = -1;
    pty->name[0] = '\0';
    return KL_CAN_FAILED;
}

/* Bytes as they are, no echo. Opened and closed once, the terminal says EIO while nobody holds it. */
static bool make_raw(const char *name) {
    struct termios settings;
    int slave = open(name, O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (slave < 0)
        return false;
    bool done = tcgetattr(slave, &settings) == 0;
    if (done) {
        cfmakeraw(&settings);
        done = tcsetattr(slave, TCSANOW, &settings) == 0;
    }
    (void)close(slave);
    return done;
}

static bool make_link(struct kl_slcan_pty *pty, const char *path) {
    struct stat there;
    if (lstat(path, &there) == 0) {
        if (!S_ISLNK(there.st_mode)) {
            errno = EEXIST;
            return false;
        }
        (void)unlink(path);
    }
    if (symlink(pty->name, path) != 0)
        return false;
    (void)snprintf(pty->path, sizeof pty->path, "%s", path);
    return true;
}

static bool prepare_link(struct kl_slcan_pty *pty) {
    const struct kl_slcan_link_config config = {
        .rx = &pty->rx, .tx = &pty->tx, .queue = pty->queue, .queue_frames = KL_SLCAN_PTY_QUEUE};
    return kl_ring_init(&pty->rx, pty->rx_bytes, KL_SLCAN_PTY_RX_BYTES) &&
           kl_ring_init(&pty->tx, pty->tx_bytes, KL_SLCAN_PTY_TX_BYTES) &&
           kl_slcan_link_init(&pty->link, &config) == KL_CAN_OK;
}

enum kl_can_status kl_slcan_pty_open(struct kl_slcan_pty *pty, const char *path) {
    if (pty == NULL || (path != NULL && strlen(path) >= KL_SLCAN_PTY_PATH_BYTES))
        return KL_CAN_ARGUMENT;
    memset(pty, 0, sizeof *pty);
    pty->master = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (pty->master < 0 || grantpt(pty->master) != 0 || unlockpt(pty->master) != 0 ||
        ptsname_r(pty->master, pty->name, sizeof pty->name) != 0 || !make_raw(pty->name) ||
        !prepare_link(pty))
        return failed(pty, "pseudo-terminal");
    if (path != NULL && path[0] != '\0' && !make_link(pty, path))
        return failed(pty, path);
    return KL_CAN_OK;
}

const char *kl_slcan_pty_name(const struct kl_slcan_pty *pty) {
    return pty == NULL ? "" : pty->name;
}

const char *kl_slcan_pty_text(const struct kl_slcan_pty *pty) {
    return pty == NULL ? "" : pty->text;
}
