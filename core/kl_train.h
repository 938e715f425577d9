/*
 * kl_train.h - the speed as a freedom of the train, within a step. Internal to the core.
 *
 * All bodies and axles share V, and axle i turns with Omega_i = V/r0_i + omega_i. Creep ties V and
 * Omega as stiffly as it damps omega. So the momentum of what rolls takes the place of V,
 *     P = (sum m + sum I_y/r0^2) V + sum I_y/r0 omega,
 *     P' = X - R(V) + D + sum (I_y Omega')/r0,
 * in which creep forces cancel but for what r differs from r0 and what they have against the yaw:
 *     X = sum T1 (1 - s l kappa) - T2 psi/cos delta + M3 kappa cos delta,
 * the part of creep's power that goes with V; D pulls and R resists. P' is not stiff and is
 * integrated by the trapezoidal rule; the omega as they always are (kl_damp.h), with the V' that
 * belongs to them in the same step. V' is linear in these, so no iteration is needed.
 */
#ifndef KL_TRAIN_H
#define KL_TRAIN_H

#include "kl_twist.h"

/* Cuts the pull to +-1e8 N and writes what is kept; what is not a number counts as 0. 1 where it was
 * changed. */
KL_APART int kl_train_limit(const struct kl_input *restrict input, struct kl_input *restrict kept);

/* Where a step ends, V as it goes on by itself. */
KL_APART struct kl_stage kl_train_carry(const struct kl_model *model, const struct kl_state *state);

/* After the evaluation at that end: V there, `end` and what belongs to it of the axles; the rate with
 * which V goes on to *carried. V stays within 0..KL_MAX_SPEED_M_S; returns KL_FAULT_INPUT where it
 * would have gone beyond that, else 0. */
KL_APART uint32_t kl_train_move(const struct kl_model *model, const struct kl_state *state,
                                struct kl_evaluation *restrict e, struct kl_stage *restrict end,
                                kl_real *restrict carried);

/* V' of an evaluation where the state stands. */
KL_APART kl_real kl_train_acceleration(const struct kl_model *model, const struct kl_evaluation *e);

/* The rates of V and of the axles' rotation beside V/r0 for a state as it stands. */
KL_APART void kl_train_refresh(const struct kl_model *model, const struct kl_evaluation *e,
                               struct kl_state *state);

#endif
