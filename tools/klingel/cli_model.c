/* cli_model.c - the model that a sub-command works on. */
#include <string.h>
#include <time.h>

#include "cli.h"

double cli_seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Messages name the file: a terminal shall not act on what stands there. */
static bool is_printable(const char *path) {
    for (; path != NULL && *path != '\0'; path++) {
        if ((unsigned char)*path < 0x20 || *path == 0x7f) {
            return false;
        }
    }
    return true;
}

struct kl_work *cli_work(void) {
    static struct kl_work work;
    return &work;
}

int cli_model_load(struct cli_model *m, const struct cli_target *target) {
    memset(m, 0, sizeof *m);
    if (!is_printable(target->vehicle) || !is_printable(target->track)) {
        return cli_fail("a file's name must not hold control characters");
    }
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

void cli_model_hold_speed(struct cli_model *m) {
    m->file.vehicle.running = (struct kl_running_def){0};
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

int cli_model_endless(struct cli_model *m, double curvature_1_m, double cant_rad) {
    m->file.track =
        (struct kl_track_def){.curvature_start_1_m = curvature_1_m, .cant_start_rad = cant_rad};
    return cli_model_build(m);
}

int cli_model_layout(struct cli_model *m, double s_m, double *curvature_1_m, double *cant_rad) {
    struct kl_track_layout here;
    int status = cli_model_build(m);
    if (status == CLI_OK) {
        kl_track_layout_at(&m->model.track, (kl_real)s_m, &here);
        *curvature_1_m = (double)here.curvature_1_m;
        *cant_rad = (double)here.cant_rad;
    }
    return status;
}

int cli_model_step(struct cli_model *m, double step_s) {
    if (!isnan(step_s)) {
        const double ns = 1e9 * step_s;
        if (fabs(ns - round(ns)) > 1e-6 * ns) {
            return cli_misuse("--step: must be a whole number of nanoseconds");
        }
        m->file.vehicle.step_ns = llround(ns);
    }
    return CLI_OK;
}

void cli_model_close(struct cli_model *m) {
    model_file_free(&m->file);
}
