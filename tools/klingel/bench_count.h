/* bench_count.h - instructions of a step, counted by valgrind. Private to cmd_bench.c. */
#ifndef BENCH_COUNT_H
#define BENCH_COUNT_H

#include "cli.h"

/*
 * Instructions per step of the case `which` ("straight", "track"): this program is run by callgrind
 * for two numbers of steps, and the difference is divided. `arguments` are those of bench, ended by
 * NULL. CLI_OK, or CLI_FAILED (printed).
 */
int bench_count(char *const *arguments, const char *which, double *per_step);

#endif
