/* cases.h - the conformance cases, for a bench chosen beforehand. */
#ifndef CASES_H
#define CASES_H

#include "bench.h"

/* Runs every case on one bench; returns the number of failed ones. */
int run_cases(const struct bench *bench);

#endif
