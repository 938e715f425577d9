/* geometry_plot.h - the picture of a wheel-rail pair's contact geometry. */
#ifndef GEOMETRY_PLOT_H
#define GEOMETRY_PLOT_H

#include "cli.h"

struct geometry_picture {
    const char *title;
    const struct kl_pair_def *def;
    const struct kl_pair *pair; /* built from it */
    double every_m;             /* distance of the contact lines in u_y */
};

/*
 * Both wheels over their rails with lines that join the points in contact (profiles only), and
 * against u_y: rolling radii and their difference, contact angles, roll, contact points; jumps
 * marked everywhere. CLI_OK, CLI_FAILED or CLI_USAGE (printed). About 2 s.
 */
int geometry_plot(const struct geometry_picture *picture, const char *path);

#endif
