/* cli_progress.c - one line that is written over and over. */
#include "cli_progress.h"

#include <unistd.h>

#define EVERY_S 0.25

void cli_progress_begin(struct cli_progress *progress) {
    double now = cli_seconds();
    *progress = (struct cli_progress){
        .began_s = now, .shown_s = now, .terminal = isatty(STDERR_FILENO) != 0};
}

void cli_progress_show(struct cli_progress *progress, double share, const char *text) {
    double now = progress->terminal ? cli_seconds() : progress->shown_s;
    if (now - progress->shown_s < EVERY_S) {
        return;
    }
    progress->shown_s = now;
    progress->anything = true;
    if (share > 0.0) {
        fprintf(stderr, "\r%5.1f %%  %-46s %4.0f s to go ", 100.0 * share, text,
                (now - progress->began_s) * (1.0 / share - 1.0));
    } else {
        fprintf(stderr, "\r%-46s %4.0f s so far ", text, now - progress->began_s);
    }
}

void cli_progress_end(struct cli_progress *progress) {
    if (progress->anything) {
        fprintf(stderr, "\r%76s\r", "");
    }
    progress->anything = false;
}
