/*
 * modes_track.h - modes followed over a range of speeds, and their names. Private to cmd_modes.c.
 *
 * From one speed to the next each mode is given to the track whose last mode looks most like it: by
 * the modal assurance criterion of the eigenvectors, weighted with the inertias, and by how far the
 * eigenvalue has moved. Two real eigenvalues that become a pair, and the reverse, end tracks and
 * begin others.
 */
#ifndef MODES_TRACK_H
#define MODES_TRACK_H

#include "modes_linear.h"

#define MODES_MAX_TRACKS 256
#define MODES_NAME_SIZE 48

struct modes_track {
    char name[MODES_NAME_SIZE]; /* by the freedoms that hold most of the energy where it begins */
    size_t n;
    size_t room;
    double *speed_m_s;
    double *real;
    double *imag;
    double least_damping; /* of those that swing; HUGE_VAL if none does */
};

struct modes_tracks {
    const struct modes_names *names;
    uint32_t n;
    struct modes_track track[MODES_MAX_TRACKS];
    struct modes *last; /* the modes at the last speed, and the track of each */
    uint32_t last_track[KL_MAX_STATES];
    bool any;
};

/* What the freedoms of a mode make of it: "body lateral + roll", "front, rear yaw". */
void modes_title(const struct modes_names *names, const struct mode *mode, char *title,
                 size_t size);

/* CLI_OK or CLI_FAILED (out of memory, printed). */
int modes_tracks_begin(struct modes_tracks *tracks, const struct modes_names *names);

/* Takes the modes of the next speed, with parts; `of` receives the track of each, MODES_MAX_TRACKS
 * where there are too many. CLI_OK or CLI_FAILED (printed). */
int modes_tracks_add(struct modes_tracks *tracks, const struct modes *modes, double speed_m_s,
                     uint32_t of[KL_MAX_STATES]);

void modes_tracks_free(struct modes_tracks *tracks);

#endif
