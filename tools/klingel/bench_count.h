/* bench_count.h - instructions of a step, counted by valgrind. Private to cmd_bench.c and cmd_creep.c. */
#ifndef BENCH_COUNT_H
#define BENCH_COUNT_H

#include "cli.h"

/* Numbers of steps of the two runs. */
#define BENCH_FEW "1000"
#define BENCH_MANY "3000"

/* One run under callgrind: all instructions of the program; `out`, if not NULL, is the file of
 * callgrind's own that tells of each. CLI_OK, or CLI_FAILED (printed). */
int bench_callgrind(const char *command, char *const *arguments, const char *which,
                    const char *steps, const char *out, double *instructions);

/*
 * Instructions per step of the case `which`: this program is run by callgrind as `command` (bench:
 * "straight", "track"; creep: a law, per contact) with --count-only=which:steps for two numbers of steps,
 * and the difference is divided. `arguments` are the other ones of the command, ended by NULL. CLI_OK, or CLI_FAILED (printed).
 */
int bench_count(const char *command, char *const *arguments, const char *which, double *per_step);

#endif
