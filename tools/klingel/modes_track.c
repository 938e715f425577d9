/* modes_track.c - which mode is which at the next speed. */
#include "modes_track.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define NONE MODES_MAX_TRACKS
#define LEAST_LIKENESS 0.05 /* below, a mode begins a track of its own */
#define SWINGS 1e-6         /* rad/s */

/* ---- names ---- */

/* Splits "front.yaw" and puts the coordinate in words. */
static const char *split(const char *freedom, char *part, size_t size) {
    static const char *const word[][2] = {{"y", "lateral"}, {"z", "bounce"},    {"roll", "roll"},
                                          {"yaw", "yaw"},   {"pitch", "pitch"}, {"spin", "spin"}};
    const char *dot = strrchr(freedom, '.');
    snprintf(part, size, "%.*s", (int)(dot - freedom), freedom);
    for (size_t i = 0; i < sizeof word / sizeof word[0]; i++) {
        if (strcmp(dot + 1, word[i][0]) == 0) {
            return word[i][1];
        }
    }
    return dot + 1;
}

void modes_title(const struct modes_names *names, const struct mode *mode, char *title,
                 size_t size) {
    char part[2][KL_NAME_SIZE + 8];
    if (mode->n_parts == 0) {
        snprintf(title, size, "neutral");
        return;
    }
    const char *first = split(names->freedom[mode->part[0].freedom].name, part[0], sizeof part[0]);
    snprintf(title, size, "%s %s", part[0], first);
    if (mode->n_parts < 2 || mode->part[1].share < 0.1) {
        return;
    }
    const char *second = split(names->freedom[mode->part[1].freedom].name, part[1], sizeof part[1]);
    const char *joint = cos(mode->part[1].phase_rad) < -0.5 ? "-" : "+";
    if (strcmp(part[0], part[1]) == 0) {
        snprintf(title, size, "%s %s %s %s", part[0], first, joint, second);
    } else if (strcmp(first, second) == 0) {
        snprintf(title, size, "%s %s %s %s", part[0], joint, part[1], first);
    } else {
        snprintf(title, size, "%s %s, %s %s", part[0], first, part[1], second);
    }
}

/* ---- likeness ---- */

struct sum {
    double re;
    double im;
};

/* <a, b> of two eigenvectors, weighted with the inertias of the rates. */
static struct sum product(const struct modes_names *names, const struct modes *a, uint32_t ka,
                          const struct modes *b, uint32_t kb) {
    struct sum s = {0.0, 0.0};
    for (uint32_t f = 0; f < names->n; f++) {
        const uint32_t i = (uint32_t)names->freedom[f].rate * a->n;
        const double m = names->freedom[f].inertia;
        const double ar = a->vector_re[i + ka];
        const double ai = a->vector_im[i + ka];
        const double br = b->vector_re[i + kb];
        const double bi = b->vector_im[i + kb];
        s.re += m * (ar * br + ai * bi);
        s.im += m * (ar * bi - ai * br);
    }
    return s;
}

static double likeness(const struct modes_names *names, const struct modes *a, uint32_t i,
                       const struct modes *b, uint32_t k) {
    const struct mode *ma = &a->mode[i];
    const struct mode *mb = &b->mode[k];
    if ((ma->imag > SWINGS) != (mb->imag > SWINGS)) {
        return 0.0;
    }
    const struct sum s = product(names, a, ma->column, b, mb->column);
    const double own_a = product(names, a, ma->column, a, ma->column).re;
    const double own_b = product(names, b, mb->column, b, mb->column).re;
    const double alike = own_a * own_b > 0.0 ? (s.re * s.re + s.im * s.im) / (own_a * own_b) : 0.0;
    const double size = hypot(ma->real, ma->imag) + hypot(mb->real, mb->imag) + MODES_NEUTRAL;
    const double away = hypot(ma->real - mb->real, ma->imag - mb->imag) / size;
    return alike * exp(-8.0 * away);
}

/* ---- tracks ---- */

int modes_tracks_begin(struct modes_tracks *tracks, const struct modes_names *names) {
    memset(tracks, 0, sizeof *tracks);
    tracks->names = names;
    tracks->last = malloc(sizeof *tracks->last);
    return tracks->last != NULL ? CLI_OK : cli_fail("out of memory");
}

void modes_tracks_free(struct modes_tracks *tracks) {
    for (uint32_t t = 0; t < tracks->n; t++) {
        free(tracks->track[t].speed_m_s);
        free(tracks->track[t].real);
        free(tracks->track[t].imag);
    }
    free(tracks->last);
    memset(tracks, 0, sizeof *tracks);
}

static bool append(double **list, size_t n, size_t room, double value) {
    double *grown = realloc(*list, room * sizeof(double));
    if (grown != NULL) {
        *list = grown;
        grown[n] = value;
    }
    return grown != NULL;
}

static int extend(struct modes_track *track, const struct mode *mode, double speed_m_s) {
    track->room = track->n < track->room ? track->room : 2 * track->room + 32;
    if (!append(&track->speed_m_s, track->n, track->room, speed_m_s) ||
        !append(&track->real, track->n, track->room, mode->real) ||
        !append(&track->imag, track->n, track->room, mode->imag)) {
        return cli_fail("out of memory");
    }
    track->n++;
    if (mode->imag > SWINGS) {
        double damping = -mode->real / hypot(mode->real, mode->imag);
        track->least_damping = fmin(track->least_damping, damping);
    }
    return CLI_OK;
}

/* A name that no other track has. */
static uint32_t begin_track(struct modes_tracks *tracks, const struct mode *mode) {
    if (tracks->n == MODES_MAX_TRACKS) {
        return NONE;
    }
    struct modes_track *track = &tracks->track[tracks->n];
    char title[MODES_NAME_SIZE - 8];
    modes_title(tracks->names, mode, title, sizeof title);
    snprintf(track->name, sizeof track->name, "%s", title);
    unsigned number = 1;
    for (uint32_t t = 0; t < tracks->n; t++) {
        if (strcmp(tracks->track[t].name, track->name) == 0) {
            snprintf(track->name, sizeof track->name, "%s (%u)", title, ++number);
            t = (uint32_t)-1; /* and look again */
        }
    }
    track->least_damping = HUGE_VAL;
    return tracks->n++;
}

/* The most alike first, until nothing is left that is alike. */
static void match(const struct modes_tracks *tracks, const struct modes *modes,
                  uint32_t of[KL_MAX_STATES]) {
    static double like[KL_MAX_STATES][KL_MAX_STATES];
    const struct modes *last = tracks->last;
    for (uint32_t i = 0; i < last->n_modes; i++) {
        for (uint32_t k = 0; k < modes->n_modes; k++) {
            like[i][k] = likeness(tracks->names, last, i, modes, k);
        }
    }
    for (;;) {
        double best = LEAST_LIKENESS;
        uint32_t from = 0;
        uint32_t to = KL_MAX_STATES;
        for (uint32_t i = 0; i < last->n_modes; i++) {
            for (uint32_t k = 0; k < modes->n_modes; k++) {
                if (like[i][k] > best) {
                    best = like[i][k];
                    from = i;
                    to = k;
                }
            }
        }
        if (to == KL_MAX_STATES) {
            return;
        }
        of[to] = tracks->last_track[from];
        for (uint32_t k = 0; k < modes->n_modes; k++) {
            like[from][k] = 0.0;
        }
        for (uint32_t i = 0; i < last->n_modes; i++) {
            like[i][to] = 0.0;
        }
    }
}

int modes_tracks_add(struct modes_tracks *tracks, const struct modes *modes, double speed_m_s,
                     uint32_t of[KL_MAX_STATES]) {
    for (uint32_t k = 0; k < KL_MAX_STATES; k++) {
        of[k] = NONE;
    }
    if (tracks->any) {
        match(tracks, modes, of);
    }
    for (uint32_t k = 0; k < modes->n_modes; k++) {
        of[k] = of[k] == NONE ? begin_track(tracks, &modes->mode[k]) : of[k];
        if (of[k] != NONE) {
            int status = extend(&tracks->track[of[k]], &modes->mode[k], speed_m_s);
            if (status != CLI_OK) {
                return status;
            }
        }
    }
    memcpy(tracks->last, modes, sizeof *modes);
    memcpy(tracks->last_track, of, sizeof tracks->last_track);
    tracks->any = true;
    return CLI_OK;
}
