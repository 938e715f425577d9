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
 * Of a pair: the rigid contact at every row of its table (at most 0.1 mm apart), with a jump of
 * delta_r at every jump of the contact. `name` is for messages. CLI_OK or CLI_FAILED (printed).
 * About 30 ms.
 */
int conicity_source_pair(struct conicity_source *source, const struct kl_pair_def *def,
                         const char *name);

/*
 * Of a text file: two columns, y and delta_r, separated by blanks, comma or semicolon; mm, unless a
 * first line names the columns y_m|y_mm and delta_r_m|delta_r_mm. '#' begins a comment. y rises; the
 * same y twice is a jump. Sets the curve only. CLI_OK or CLI_FAILED ("FILE:LINE: what", printed).
 */
int conicity_source_table(struct conicity_source *source, const char *path);

void conicity_source_free(struct conicity_source *source);

#endif
