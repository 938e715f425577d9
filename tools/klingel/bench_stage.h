/* bench_stage.h - instructions of a step by its stages. Private to the bench. */
#ifndef BENCH_STAGE_H
#define BENCH_STAGE_H

#include "cli.h"

/* In the order of core/klingel.h; then what surrounds them. */
enum bench_stage {
    BENCH_TRACK = 0,  /* curvature, cant, irregularities at every wheelset and body */
    BENCH_PLACING,    /* places and speeds at the end of the step; rows of the contact tables */
    BENCH_SUSPENSION, /* springs, dampers, struts */
    BENCH_CONTACT,    /* normal forces, creepages, creep forces */
    BENCH_MOTION,     /* accelerations, the integrator, faults */
    BENCH_EDGE,       /* inputs checked, outputs written */
    BENCH_OTHER,      /* what belongs to none, the loop of the bench itself among it */
    BENCH_STAGES
};
const char *bench_stage_name(enum bench_stage stage);

/*
 * Instructions per step of each stage. callgrind counts every instruction of this program, addr2line
 * (binutils) tells which functions it was compiled from, inlined ones as well, and the innermost one
 * that belongs to a stage decides. `arguments` and `which` as for bench_count. CLI_OK, or CLI_FAILED
 * (printed): no valgrind, no addr2line, or no debug information.
 */
int bench_count_stages(char *const *arguments, const char *which, double per_step[BENCH_STAGES]);

#endif
