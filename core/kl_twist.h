/*
 * kl_twist.h - wheels that turn by themselves, within a step. Internal to the core.
 *
 * Independent wheels roll while the wheelset yaws: of yaw and twist creep damps l psi' + r twist and
 * leaves the other combination alone. To damp either by itself would set slip against slip, each
 * answering the other's last step, and ring. So both are turned to the principal axes of their 2 x 2
 * damping, one that slips and one that rolls, and damped there (kl_damp.h).
 */
#ifndef KL_TWIST_H
#define KL_TWIST_H

#include "kl_rates.h"

/* Of no concern to most vehicles, whose step shall not make room for it. */
#ifdef __GNUC__
#define KL_APART __attribute__((noinline))
#else
#define KL_APART
#endif

/* Cuts their torques to +-1e6 N m and writes what is kept; what is not a number counts as 0. 1 where
 * something was changed. */
KL_APART int kl_twists_limit(const struct kl_model *model, const struct kl_input *restrict input,
                             struct kl_input *restrict kept);

/* Where the twists are after the time h, and the spin of either wheel; after the wheelsets. */
KL_APART void kl_twists_carry(const struct kl_model *model, const struct kl_origin *from,
                              struct kl_evaluation *e);

/* What becomes of them. Either wheel has half of I_y about its own axis, so
 *     I_y twist' = T_r - T_l - 4 c twist - (r T1)_r + (r T1)_l
 * with T_r - T_l twice the input's twist_torque_Nm and c between the wheels. */
KL_APART void kl_twists_move(const struct kl_model *model, const struct kl_input *restrict input,
                             struct kl_evaluation *restrict e);

/* The twists at the end of a step, and the yaw of their wheelsets in place of what it would be
 * without. */
KL_APART void kl_twists_finish(const struct kl_model *model, const struct kl_evaluation *e,
                               struct kl_state *state);

/* The twists of the wheelsets. */
KL_APART void kl_twists_output(const struct kl_model *model, const struct kl_state *state,
                               struct kl_output *output);

/* Takes off the rates of an evaluation where the state stands what creep stops; yaw as above. */
KL_APART void kl_twists_refresh(const struct kl_model *model, const struct kl_evaluation *e,
                                struct kl_state *state);

#endif
