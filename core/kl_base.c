/* kl_base.c - status texts, arena, hash. */
#include "kl_base.h"

const char *kl_status_text(enum kl_status status) {
    switch (status) {
    case KL_OK:
        return "ok";
    case KL_ERR_ARGUMENT:
        return "argument is NULL or out of range";
    case KL_ERR_MEMORY:
        return "the memory given is too small";
    case KL_ERR_CAPACITY:
        return "more than this build can hold";
    case KL_ERR_VALUE:
        return "value out of range or not a number";
    case KL_ERR_PROFILE:
        return "profile has too few points or is not monotonic";
    case KL_ERR_CONTACT:
        return "wheel and rail have no contact";
    case KL_ERR_CONVERGE:
        return "contact equations did not converge";
    case KL_ERR_SINGULAR:
        return "no static equilibrium";
    case KL_ERR_SNAPSHOT:
        return "snapshot is damaged or belongs to another model";
    case KL_ERR_REFERENCE:
        return "refers to something that does not exist";
    }
    return "unknown status";
}

void kl_arena_init(struct kl_arena *arena, void *memory, size_t size_bytes) {
    /* start at the first 16-byte boundary */
    const size_t skip = (size_t)(-(uintptr_t)memory & 15u);
    arena->base = (unsigned char *)memory + (skip < size_bytes ? skip : size_bytes);
    arena->size = skip < size_bytes ? size_bytes - skip : 0;
    arena->used = 0;
    arena->wanted = skip;
}

void *kl_arena_take(struct kl_arena *arena, size_t count, size_t element_bytes) {
    if (element_bytes != 0 && count > (SIZE_MAX / 4) / element_bytes) {
        arena->wanted = SIZE_MAX / 2;
        return NULL;
    }
    const size_t bytes = (count * element_bytes + 15u) & ~(size_t)15u;
    if (arena->wanted <= SIZE_MAX / 2 - bytes) {
        arena->wanted += bytes;
    }
    if (bytes > arena->size - arena->used) {
        return NULL;
    }
    void *block = arena->base + arena->used;
    arena->used += bytes;
    return block;
}

uint64_t kl_hash_bytes(uint64_t seed, const void *data, size_t size_bytes) {
    const unsigned char *p = (const unsigned char *)data;
    uint64_t hash = seed;
    for (size_t i = 0; i < size_bytes; i++) {
        hash = (hash ^ p[i]) * UINT64_C(0x100000001b3);
    }
    return hash;
}
