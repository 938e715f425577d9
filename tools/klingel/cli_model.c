/* cli_model.c - the model that a sub-command works on. */
#include <string.h>
#include <time.h>

#include "cli.h"

double cli_seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

int cli_model_load(struct cli_model *m, const struct cli_target *target) {
    memset(m, 0, sizeof *m);
    if (model_file_load(&m->file, target->vehicle, target->track, stderr) != 0) {
        return CLI_FAILED;
    }
    if (target->set.n > 0 &&
        model_file_set(&m->file, target->set.item, target->set.n, stderr) != 0) {
        model_file_free(&m->file);
        return CLI_FAILED;
    }
    return CLI_OK;
}

int cli_model_build(struct cli_model *m) {
    double before = cli_seconds();
    if (model_file_build(&m->file, &m->model, stderr) != 0) {
        model_file_free(&m->file);
        return CLI_FAILED;
    }
    m->build_ms = 1e3 * (cli_seconds() - before);
    return CLI_OK;
}

int cli_model_open(struct cli_model *m, const struct cli_target *target) {
    int status = cli_model_load(m, target);
    return status == CLI_OK ? cli_model_build(m) : status;
}

void cli_model_close(struct cli_model *m) {
    model_file_free(&m->file);
}
