/*
 * kl_base.h - what every room of the core shares: the real type, status codes, memory.
 */
#ifndef KL_BASE_H
#define KL_BASE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The real type of model and state, that is of the step. `double` is the reference; -DKL_REAL_FLOAT
 * makes the second build. Definitions and the builder are double always, so tables do not lose by
 * the way they were made. */
#ifdef KL_REAL_FLOAT
typedef float kl_real;
#else
typedef double kl_real;
#endif

/* For what is worked on two at a time. */
#ifdef __cplusplus
#define KL_ALIGN(bytes) alignas(bytes)
#else
#define KL_ALIGN(bytes) _Alignas(bytes)
#endif

/* Capacities: the largest vehicle, or train, that a kl_state can hold. Override with -D; the same
 * values must be used for everything that is linked together. Unless told otherwise a target with
 * an operating system has room for a train of ten four-axle vehicles, bare metal for one vehicle. */
#if defined(__unix__) || defined(__APPLE__) || defined(_WIN32)
#define KL_ROOM(train, vehicle) (train)
#else
#define KL_ROOM(train, vehicle) (vehicle)
#endif
#ifndef KL_MAX_BODIES
#define KL_MAX_BODIES KL_ROOM(32, 8)
#endif
#ifndef KL_MAX_WHEELSETS
#define KL_MAX_WHEELSETS KL_ROOM(40, 8)
#endif
#if KL_MAX_BODIES < 1 || KL_MAX_BODIES > 127
#error "KL_MAX_BODIES must be 1..127"
#endif
#if KL_MAX_WHEELSETS < 1 || KL_MAX_WHEELSETS > 127
#error "KL_MAX_WHEELSETS must be 1..127"
#endif

/* Sides of a wheelset. The mirror image of a model swaps the two and nothing else. */
enum kl_side { KL_RIGHT = 0, KL_LEFT = 1, KL_SIDES = 2 };

/* 0 is success, negative values are errors. */
enum kl_status {
    KL_OK = 0,
    KL_ERR_ARGUMENT = -1,  /* NULL or out-of-range argument */
    KL_ERR_MEMORY = -2,    /* the caller's memory is too small */
    KL_ERR_CAPACITY = -3,  /* more bodies, wheelsets or elements than the build supports */
    KL_ERR_VALUE = -4,     /* a definition holds a value outside its range, or a NaN */
    KL_ERR_PROFILE = -5,   /* a profile has too few points or is not monotonic */
    KL_ERR_CONTACT = -6,   /* wheel and rail do not touch, or the contact left the profile */
    KL_ERR_CONVERGE = -7,  /* Newton-Raphson did not converge within its bound */
    KL_ERR_SINGULAR = -8,  /* a body is not supported: the static equilibrium does not exist */
    KL_ERR_SNAPSHOT = -9,  /* a snapshot is damaged or belongs to another model */
    KL_ERR_REFERENCE = -10 /* a definition names a body, wheelset or pair that does not exist */
};

/* A short English text for a status; never NULL, also for unknown values. Bound: constant. */
const char *kl_status_text(enum kl_status status);

/*
 * What the builder found wrong, or was doing when it failed. `what` is a static string; `index` is
 * the element of the definition concerned (-1 where none applies); `value` is the offending number.
 */
struct kl_diag {
    enum kl_status status;
    const char *what;
    int32_t index;
    double value;
};

/*
 * A bump allocator over the caller's memory. All blocks are aligned to 16 bytes. Nothing is ever
 * freed singly; `used` can be put back to an earlier value to drop scratch. It fails if and only if
 * the rest is too small: kl_arena_take then returns NULL and leaves `used` alone. `wanted` is the
 * sum of all requests, the failed one too: give at least that much and retry.
 */
struct kl_arena {
    unsigned char *base;
    size_t size;
    size_t used;
    size_t wanted;
};

void kl_arena_init(struct kl_arena *arena, void *memory, size_t size_bytes);
void *kl_arena_take(struct kl_arena *arena, size_t count, size_t element_bytes);

/* FNV-1a, 64 bit, over bytes; `seed` is KL_HASH_SEED or an earlier result. */
#define KL_HASH_SEED UINT64_C(0xcbf29ce484222325)
uint64_t kl_hash_bytes(uint64_t seed, const void *data, size_t size_bytes);

#ifdef __cplusplus
}
#endif
#endif
