/* conicity_source.h - where a delta_r function comes from: a wheel-rail pair, or a table in a file. */
#ifndef CONICITY_SOURCE_H
#define CONICITY_SOURCE_H

#include "cli.h"
#include "conicity.h"

/* A delta_r function, and the two lengths that make a wavelength of it. */
struct conicity_source {
    struct conicity_curve curve;
    double base_m;   /* e, distance of the contact points when central */
    double radius_m; /* r0, when central */
};

/*
 * Of a pair: the rigid contact every 0.1 mm over the range of its table, with a jump of delta_r at
 * every jump of the contact. `roll` false: the axle stays level, which is how EN 15302 defines its
 * reference cases; true: with the roll that the contacts impose, as in the tables of a vehicle. `name`
 * is for messages. CLI_OK or CLI_FAILED (printed). About 0.1 s.
 */
int conicity_source_pair(struct conicity_source *source, const struct kl_pair_def *def,
                         const char *name, bool roll);

/*
 * Of a text file: two columns, y and delta_r, separated by blanks, comma or semicolon; mm, unless a
 * first line names the columns y_m|y_mm and delta_r_m|delta_r_mm. '#' begins a comment. y rises; the
 * same y twice is a jump. Sets the curve only. CLI_OK or CLI_FAILED ("FILE:LINE: what", printed).
 */
int conicity_source_table(struct conicity_source *source, const char *path);

struct conicity_point {
    double y_m;
    double delta_r_m;
};

/* For the two above: points in order as the curve; `where` begins a message about bad ones. */
int conicity_source_points(struct conicity_source *source, const struct conicity_point *points,
                           size_t n, const char *where);

/* For conicity_source_pair: a level axle (conicity_flat.c); `central` is the posture at u_y = 0. */
int conicity_source_level(struct conicity_source *source, const struct kl_pair_def *def,
                          const struct kl_posture *central, const char *name);

void conicity_source_free(struct conicity_source *source);

#endif
