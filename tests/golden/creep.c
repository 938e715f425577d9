/*
 * creep.c - creep forces of many contacts: a hash of all of them, or a check of each. Links the core and
 * a table that klingel creep wrote.
 *
 *   creep hash N    the hash of N contacts under each law (FASTSIM: a hundredth), for creep.py
 *   creep storm N   N contacts, half of them absurd, under all laws by turns: finite, |T| <= mu N; exit 1
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "kl_creep.h"
#include "kl_geometry.h"

extern const struct kl_creep_table creep_table;

#define ROUNDED(x) ((kl_real)(x))
#define ROWS 64

static uint64_t random_bits(uint64_t *seed) {
    *seed ^= *seed >> 12;
    *seed ^= *seed << 25;
    *seed ^= *seed >> 27;
    return *seed * UINT64_C(0x2545f4914f6cdd1d);
}

static double between(uint64_t *seed, double low, double high) {
    return low + (high - low) * ((double)(random_bits(seed) >> 11) * (1.0 / 9007199254740992.0));
}

/* Every law's rows of ellipses 0.1 .. 10, made once. */
static struct kl_creep_row row[KL_CREEP_LAWS][ROWS];

static void make_rows(void) {
    const struct kl_material steel = {82e9, 0.28};
    double root = 0.31622776601683794;
    for (int i = 0; i < ROWS; i++) {
        const struct kl_ellipse e = {1.3e-4 * root, 1.3e-4 / root};
        for (int law = 0; law < KL_CREEP_LAWS; law++) {
            (void)kl_creep_row_build((enum kl_creep_law)law, &creep_table, &e, &steel,
                                     &row[law][i]);
        }
        root *= 1.0372; /* 0.1 to 10 in a/b; no libm in what is hashed */
    }
}

/* Any bits but those of NaN. */
static kl_real absurd(uint64_t *seed) {
    const uint64_t bits = random_bits(seed);
    double x;
    memcpy(&x, &bits, sizeof x);
    return x == x ? ROUNDED(x) : ROUNDED(0.0);
}

static kl_real special(uint64_t *seed) {
    static const double value[] = {
        0.0,  -0.0,  5e-324, -5e-324, 1e308, -1e308, (double)INFINITY, -(double)INFINITY,
        1e-3, -1e-3, 1.0,    2e-308};
    return ROUNDED(value[random_bits(seed) % (sizeof value / sizeof value[0])]);
}

static struct kl_creep_contact contact(enum kl_creep_law law, uint64_t *seed, int kind) {
    struct kl_creep_contact c = {.row = row[law][random_bits(seed) % ROWS]};
    kl_real v[5];
    for (int k = 0; k < 5; k++) {
        v[k] = kind == 1   ? absurd(seed)
               : kind == 2 ? special(seed)
                           : ROUNDED(between(seed, -1.0, 1.0));
    }
    const kl_real size = kind == 0 ? ROUNDED(0.02) : ROUNDED(1.0);
    c.creepage = (struct kl_creepage){size * v[0], size * v[1], v[2]};
    c.normal_N = kind == 0 ? ROUNDED(between(seed, 0.0, 2e5)) : v[3];
    c.speed_m_s = kind == 0 ? ROUNDED(between(seed, 0.0, 120.0)) : v[4];
    const kl_real k_a = ROUNDED(between(seed, 0.01, 1.0));
    c.friction = (struct kl_friction){
        ROUNDED(between(seed, 0.0, 2.0)), ROUNDED(between(seed, 0.0, 1.0)),
        ROUNDED(between(seed, 0.0, 100.0)), k_a, k_a * ROUNDED(between(seed, 0.01, 1.0))};
    return c;
}

static void hash_all(uint64_t n) {
    for (int law = 0; law < KL_CREEP_LAWS; law++) {
        const int slow = law == KL_CREEP_FASTSIM || law == KL_CREEP_FASTSIM_ELLIPTIC;
        uint64_t seed = 51;
        uint64_t h = KL_HASH_SEED;
        for (uint64_t i = 0; i < n / (slow ? 100 : 1); i++) {
            const struct kl_creep_contact c = contact((enum kl_creep_law)law, &seed, 0);
            const struct kl_creep_force f =
                kl_creep_force((enum kl_creep_law)law, &creep_table, &c);
            h = kl_hash_bytes(h, &f, sizeof f);
        }
        printf("%d %016llx\n", law, (unsigned long long)h);
    }
}

static int good(const struct kl_creep_contact *c, const struct kl_creep_force *f) {
    double n = (double)c->normal_N;
    n = n > 0.0 ? (n < 1e12 ? n : 1e12) : 0.0;
    const double limit = (double)c->friction.mu0 * n; /* mu(w) is no more */
    const double size = hypot((double)f->t1_N, (double)f->t2_N);
    return size <= limit * (1.0 + 1e-12) + 1e-300 && isfinite((double)f->m3_Nm) &&
           f->reduction >= 0 && f->reduction <= 1;
}

static int storm(uint64_t n) {
    /* of thirty contacts one for each FASTSIM, which takes fifty times as long */
    uint64_t seed = 52;
    for (uint64_t i = 0; i < n; i++) {
        const unsigned turn = (unsigned)(i % 30);
        const enum kl_creep_law law = turn == 0   ? KL_CREEP_FASTSIM
                                      : turn == 1 ? KL_CREEP_FASTSIM_ELLIPTIC
                                      : turn < 8  ? KL_CREEP_SHE
                                      : turn < 16 ? KL_CREEP_POLACH
                                                  : KL_CREEP_TABLE;
        const int kind = (i / 30) % 4 < 2 ? 0 : (int)((i / 30) % 4) - 1;
        const struct kl_creep_contact c = contact(law, &seed, kind);
        const struct kl_creep_force f = kl_creep_force(law, &creep_table, &c);
        if (!good(&c, &f)) {
            printf("law %d, contact %llu: creepage %g %g %g, N %g: T %g %g, M %g, reduction %g\n",
                   (int)law, (unsigned long long)i, (double)c.creepage.gamma1,
                   (double)c.creepage.gamma2, (double)c.creepage.omega3_1_m, (double)c.normal_N,
                   (double)f.t1_N, (double)f.t2_N, (double)f.m3_Nm, (double)f.reduction);
            return 1;
        }
    }
    printf("%llu contacts, all finite and within mu N\n", (unsigned long long)n);
    return 0;
}

int main(int argc, char **argv) {
    if (argc != 3 || kl_creep_table_check(&creep_table) != KL_OK) {
        fprintf(stderr, "usage: creep hash|storm N\n");
        return 2;
    }
    make_rows();
    const uint64_t n = strtoull(argv[2], NULL, 10);
    if (strcmp(argv[1], "hash") == 0) {
        hash_all(n);
        return 0;
    }
    return storm(n);
}
