/* kl_static.c - the static equilibrium. */
#include "kl_diag.h"
#include "kl_math.h"
#include "kl_reach.h"
#include "kl_suspension.h"

/* 1 where the coordinate moves freely under forces: a body's freedom. */
int kl_is_free(const struct kl_vehicle_def *def, uint32_t coordinate) {
    const uint32_t b = coordinate / KL_FREEDOMS;
    return b < def->n_bodies && (def->bodies[b].freedoms & KL_HAS(coordinate % KL_FREEDOMS)) != 0;
}

/*
 * Static equilibrium of the bodies under their weight, wheelsets held: K q = W by Gauss elimination
 * with row pivoting. A freedom that nothing holds has an empty row; it is an error only if a load
 * asks for it.
 */
static enum kl_status solve_static(double *a, double *q, const uint32_t *body_of, uint32_t n,
                                   struct kl_diag *diag) {
    double largest = 0.0;
    for (size_t i = 0; i < (size_t)n * n; i++) {
        largest = kl_abs(a[i]) > largest ? kl_abs(a[i]) : largest;
    }
    double load = 0.0;
    for (uint32_t i = 0; i < n; i++) {
        load = kl_abs(q[i]) > load ? kl_abs(q[i]) : load;
    }
    for (uint32_t i = 0; i < n; i++) {
        uint32_t pivot = i;
        for (uint32_t r = i + 1u; r < n; r++) {
            pivot = kl_abs(a[(size_t)r * n + i]) > kl_abs(a[(size_t)pivot * n + i]) ? r : pivot;
        }
        if (!(kl_abs(a[(size_t)pivot * n + i]) > 1e-11 * largest)) {
            a[(size_t)i * n + i] = 0.0;
            continue;
        }
        for (uint32_t j = 0; j < n; j++) {
            const double swap = a[(size_t)i * n + j];
            a[(size_t)i * n + j] = a[(size_t)pivot * n + j];
            a[(size_t)pivot * n + j] = swap;
        }
        const double swap = q[i];
        q[i] = q[pivot];
        q[pivot] = swap;
        for (uint32_t r = i + 1u; r < n; r++) {
            const double part = a[(size_t)r * n + i] / a[(size_t)i * n + i];
            for (uint32_t j = i; j < n; j++) {
                a[(size_t)r * n + j] -= part * a[(size_t)i * n + j];
            }
            q[r] -= part * q[i];
        }
    }
    for (uint32_t i = n; i-- > 0;) {
        if (a[(size_t)i * n + i] == 0.0) {
            if (kl_abs(q[i]) > 1e-9 * load) {
                return kl_report(diag, KL_ERR_SINGULAR,
                                 "body is not held vertically, in roll or in pitch",
                                 (int32_t)body_of[i], 0.0);
            }
            q[i] = 0.0;
            continue;
        }
        double sum = q[i];
        for (uint32_t j = i + 1u; j < n; j++) {
            sum -= a[(size_t)i * n + j] * q[j];
        }
        q[i] = sum / a[(size_t)i * n + i];
    }
    return KL_OK;
}

static void find_reactions(const struct kl_vehicle_def *def, const struct kl_dense *m,
                           const double *q, double *preload) {
    for (uint32_t w = 0; w < def->n_wheelsets; w++) {
        const uint32_t first = kl_wheelset_coordinate(def->n_bodies, w);
        for (uint32_t d = 0; d < 4u; d++) {
            double force = 0.0;
            double size = 0.0;
            for (uint32_t i = 0; i < first; i++) {
                const double part = m->k[(size_t)(first + d) * m->n + i] * q[i];
                force -= part;
                size += kl_abs(part);
            }
            preload[4u * w + d] = kl_abs(force) > 1e-10 * size ? force : 0.0;
        }
        preload[4u * w + 1u] += def->wheelsets[w].load_N;
    }
}

enum kl_status kl_static_solve(const struct kl_vehicle_def *def, const struct kl_dense *m,
                               struct kl_arena *arena, double *q, double *preload,
                               struct kl_diag *diag) {
    double *a = kl_arena_take(arena, (size_t)m->n * m->n, sizeof *a);
    double *free_q = kl_arena_take(arena, m->n, sizeof *free_q);
    uint32_t *coordinate = kl_arena_take(arena, m->n, sizeof *coordinate);
    uint32_t *body_of = kl_arena_take(arena, m->n, sizeof *body_of);
    if (a == NULL || free_q == NULL || coordinate == NULL || body_of == NULL) {
        return kl_report(diag, KL_ERR_MEMORY, "static equilibrium", -1, (double)arena->wanted);
    }
    uint32_t n = 0;
    for (uint32_t i = 0; i < m->n; i++) {
        q[i] = 0.0;
        if (kl_is_free(def, i)) {
            body_of[n] = i / KL_FREEDOMS;
            coordinate[n++] = i;
        }
    }
    for (uint32_t i = 0; i < n; i++) {
        for (uint32_t j = 0; j < n; j++) {
            a[(size_t)i * n + j] = m->k[(size_t)coordinate[i] * m->n + coordinate[j]];
        }
        const int vertical = coordinate[i] % KL_FREEDOMS == (uint32_t)KL_Z;
        free_q[i] = vertical ? def->bodies[body_of[i]].mass_kg * def->gravity_m_s2 : 0.0;
    }
    const enum kl_status status = solve_static(a, free_q, body_of, n, diag);
    for (uint32_t i = 0; i < n; i++) {
        q[coordinate[i]] = free_q[i];
    }
    if (status == KL_OK) {
        find_reactions(def, m, q, preload);
    }
    return status;
}
