/*
 * klingel.h - real-time rail-vehicle dynamics. Include this one.
 *
 * What it is. A vehicle (bodies, wheelsets, springs and dampers), two wheel-rail profile pairs and
 * a track go in once; out comes a constant model. From then on kl_step advances a plain state by a
 * fixed time step, reading inputs and writing outputs. The core knows no heap, clock, file, bus or
 * library: it is freestanding C11.
 *
 * The way of the data
 *     definitions (kl_vehicle_def ...)  --kl_build-->  kl_model  --kl_step-->  kl_state, kl_output
 * never turns round. kl_build may search and iterate, within stated bounds; kl_step only looks up
 * and multiplies.
 *
 * Order of a step, after everything is carried on to its end:
 *   1. track      curvature, cant and irregularities at every wheelset and body
 *   2. geometry   each rail gives way sideways to its wheel; each wheel's row of the contact table
 *                 there, and whether its flange holds the rail; the wheelset's height and roll
 *   3. suspension forces between absolute coordinates, sparse matrix times vector
 *   4. contact    creepages and creep per newton; normal forces of treads and flanges from
 *                 vertical, roll and the rails' lateral equilibrium; creep forces
 *   5. motion     accelerations; the creep damping is taken implicitly, so every speed from 0 up is
 * stable
 *
 * Frames and signs. Right-handed track frame: x forward, y to the RIGHT, z DOWN. Yaw positive: nose
 * to the right; roll positive: right side down. Curvature positive: right-hand curve; cant
 * positive: right rail lower. Right wheel at y > 0. SI units and radians everywhere; a field's name
 * carries its unit.
 *
 * Memory. The caller owns everything. kl_build takes from a kl_arena; nothing else takes memory at
 * all. A kl_model holds pointers into that arena (or into flash) and is never written after the
 * build. A kl_state holds no pointer: copying it is a snapshot, and any number of states may run on
 * one model. What a step works out on the way goes into a kl_work, which vehicles that are stepped
 * in turn can share; the stack stays below 2 KiB.
 *
 * Time is tick * step, in integer nanoseconds. Threads: no function touches anything but its
 * arguments; two threads, each with its own kl_work, may step two states of one model.
 *
 * Determinism. The same model, state and inputs give the same bits on every target whose double (or
 * float) is IEEE 754, compiled from strict C11 without contraction (-ffp-contract=off) and without
 * fast-math. The core uses its own elementary functions; no sum depends on the compiler's order.
 *
 * Faults are values: see enum kl_fault. Nothing asserts, aborts or repairs in silence.
 */
#ifndef KLINGEL_H
#define KLINGEL_H

#include "kl_base.h"
#include "kl_contact.h"
#include "kl_force.h"
#include "kl_geometry.h"
#include "kl_profile.h"
#include "kl_step.h"
#include "kl_track.h"
#include "kl_vehicle.h"

/* Version of the library: major.minor.patch. */
#define KL_VERSION_MAJOR 0
#define KL_VERSION_MINOR 1
#define KL_VERSION_PATCH 0
#define KL_VERSION_TEXT "0.1.0"

#endif
