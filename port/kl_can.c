/* The checks and the calls that every CAN back end shares; see kl_can.h. */
#include "kl_can.h"

const char *kl_can_status_text(enum kl_can_status status) {
    switch (status) {
    case KL_CAN_OK:
        return "ok";
    case KL_CAN_EMPTY:
        return "nothing waiting";
    case KL_CAN_BUSY:
        return "bus busy, frame dropped";
    case KL_CAN_DOWN:
        return "bus down";
    case KL_CAN_REFUSED:
        return "frame refused";
    case KL_CAN_ARGUMENT:
        return "bad argument";
    case KL_CAN_FAILED:
        return "back end failed";
    }
    return "unknown CAN status";
}

static bool is_fd_length(uint32_t length) {
    switch (length) {
    case 12:
    case 16:
    case 20:
    case 24:
    case 32:
    case 48:
    case 64:
        return true;
    default:
        return length <= KL_CAN_CLASSIC_BYTES;
    }
}

enum kl_can_status kl_can_check(const struct kl_can_frame *frame) {
    const unsigned known = KL_CAN_EXTENDED | KL_CAN_REMOTE | KL_CAN_FD | KL_CAN_BRS;
    if (frame == NULL) {
        return KL_CAN_ARGUMENT;
    }
    unsigned flags = frame->flags;
    uint32_t largest =
        (flags & KL_CAN_EXTENDED) != 0 ? KL_CAN_MAX_EXTENDED_ID : KL_CAN_MAX_STANDARD_ID;
    bool fd = (flags & KL_CAN_FD) != 0;
    if ((flags & ~known) != 0 || frame->id > largest) {
        return KL_CAN_REFUSED;
    }
    /* FD has no remote frames, and only FD can switch the bit rate. */
    if ((fd && (flags & KL_CAN_REMOTE) != 0) || (!fd && (flags & KL_CAN_BRS) != 0)) {
        return KL_CAN_REFUSED;
    }
    bool fits = fd ? is_fd_length(frame->length) : frame->length <= KL_CAN_CLASSIC_BYTES;
    return fits ? KL_CAN_OK : KL_CAN_REFUSED;
}

static bool is_bound(const struct kl_can *can) {
    return can != NULL && can->ops != NULL;
}

enum kl_can_status kl_can_send(const struct kl_can *can, const struct kl_can_frame *frame) {
    if (!is_bound(can) || can->ops->send == NULL || frame == NULL) {
        return KL_CAN_ARGUMENT;
    }
    return can->ops->send(can->context, frame);
}

enum kl_can_status kl_can_receive(const struct kl_can *can, struct kl_can_frame *frame) {
    if (!is_bound(can) || can->ops->receive == NULL || frame == NULL) {
        return KL_CAN_ARGUMENT;
    }
    return can->ops->receive(can->context, frame);
}

bool kl_can_is_up(const struct kl_can *can) {
    return is_bound(can) && can->ops->is_up != NULL && can->ops->is_up(can->context);
}

void kl_can_get_counts(const struct kl_can *can, struct kl_can_counts *counts) {
    if (counts == NULL) {
        return;
    }
    *counts = (struct kl_can_counts){0};
    if (is_bound(can) && can->ops->counts != NULL) {
        can->ops->counts(can->context, counts);
    }
}

enum kl_can_status kl_can_recover(const struct kl_can *can) {
    if (!is_bound(can)) {
        return KL_CAN_ARGUMENT;
    }
    return can->ops->recover == NULL ? KL_CAN_OK : can->ops->recover(can->context);
}

void kl_can_service(const struct kl_can *can) {
    if (is_bound(can) && can->ops->service != NULL) {
        can->ops->service(can->context);
    }
}

void kl_can_close(const struct kl_can *can) {
    if (is_bound(can) && can->ops->close != NULL) {
        can->ops->close(can->context);
    }
}
