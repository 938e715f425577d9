/* kl_diag.h - one way to report a definition's fault. Internal to the core. */
#ifndef KL_DIAG_H
#define KL_DIAG_H

#include "kl_base.h"

static inline enum kl_status kl_report(struct kl_diag *diag, enum kl_status status,
                                       const char *what, int32_t index, double value) {
    if (diag != NULL) {
        diag->status = status;
        diag->what = what;
        diag->index = index;
        diag->value = value;
    }
    return status;
}

#endif
