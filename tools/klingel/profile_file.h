/*
 * profile_file.h - cross-sections from the files that measuring and simulation programs write.
 * Private to the loader.
 *
 * .prw .prr   Simpack: sections of "key = value", points between point.begin and point.end. The
 *             header's own steps are taken in the order in which such files number them: 1
 *             point.dist.min, 2 shift, 3 rotate (must be 0), 4 bound (in force where min < max;
 *             points outside are dropped), 5 mirror, 6 inversion, 7 units. The result is a right
 *             wheel or rail, y to the right and z down: axes outboard_down.
 * .whl .ban   MiniProf: "Key=value" lines, then rows in mm, XOffset and YOffset added. ColumnDef
 *             names the columns, XYPoints counts the rows; other keys describe the measurement.
 *             Which way X and Y grow differs from file to file and is not taken from the keys.
 * others      two numbers to a line; units must be stated.
 *
 * Where the model states no axes for the last two, a wheel's flange tells them: inboard and down,
 * more than 8 mm below the tape circle. A rail's must be stated.
 *
 * All become Klingel's coordinates (kl_profile.h), in order of eta. A wheel's height is moved so
 * that it is zero at the tape circle, where radius_m is its radius.
 */
#ifndef PROFILE_FILE_H
#define PROFILE_FILE_H

#include "klingel.h"
#include "model_source.h"

/* Which way the first and the second number of a point grow. */
enum profile_axes {
    PROFILE_INBOARD_DOWN = 0,
    PROFILE_INBOARD_UP = 1,
    PROFILE_OUTBOARD_DOWN = 2,
    PROFILE_OUTBOARD_UP = 3,
    PROFILE_AXES_OF_FILE = 4
};

struct profile_request {
    const char *name; /* of the file, relative to the model file */
    bool wheel;       /* or rail */
    enum profile_axes axes;
    double unit_m;       /* length of a file's unit; 0: not stated */
    double flange_m;     /* eta of the file's zero: the tape circle's distance from the flange back
                            where the file is measured from there, else 0 */
    double from_m;       /* what is kept: eta from .. to, and no deeper than `deepest_m` below */
    double to_m;         /* the tape circle or the rail's top; the part about these two points */
    double deepest_m;    /* if there are several */
    bool smoothing_said; /* so that the file's own smoothing does not count */
    double smoothing_m;
};

/* Reads, checks and converts; `key` is the profile's in the YAML, for messages. The arrays live as
 * long as parts. -1: printed, with file and line where there is one. */
int profile_file_read(struct model_parts *parts, const char *key,
                      const struct profile_request *request, struct kl_profile_def *def);

#endif
