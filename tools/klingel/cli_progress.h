/*
 * cli_progress.h - how far long work has come, on a terminal's standard error; silent elsewhere.
 */
#ifndef CLI_PROGRESS_H
#define CLI_PROGRESS_H

#include "cli.h"

struct cli_progress {
    double began_s;
    double shown_s;
    bool terminal;
    bool anything; /* has been written */
};

void cli_progress_begin(struct cli_progress *progress);

/* `share` 0..1 of all work, negative where that is not known; `text` says at what it is. Looks at
 * the clock at every call, writes four times a second at most. */
void cli_progress_show(struct cli_progress *progress, double share, const char *text);

/* Wipes the line. */
void cli_progress_end(struct cli_progress *progress);

#endif
