/* bench_case.c - the two cases that are measured of a model. */
#include "bench_case.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Irregularities where no track is named: ERRI B176 low, as models/demo_track.yaml has them. */
#define IRREGULAR_SAMPLES 4000u
#define IRREGULAR_STEP_M 0.25

const char *const bench_case_name[BENCH_CASES] = {"straight", "track"};

static int synthesise(struct bench_case *c) {
    const struct kl_spectrum_def spectrum = {.lateral_A = 2.119e-7,
                                             .vertical_A = 4.032e-7,
                                             .cross_A = 4.032e-7,
                                             .shortest_m = 3.0,
                                             .longest_m = 100.0,
                                             .taper_m = 20.0,
                                             .n_waves = 300,
                                             .seed = 1};
    for (int i = 0; i < 3; i++) {
        c->series[i] = calloc(IRREGULAR_SAMPLES, sizeof *c->series[i]);
        if (c->series[i] == NULL) {
            return cli_fail("out of memory");
        }
    }
    enum kl_status status = kl_spectrum_synthesise(&spectrum, IRREGULAR_STEP_M, IRREGULAR_SAMPLES,
                                                   c->series[0], c->series[1], c->series[2]);
    c->m.file.track.irregularity = (struct kl_irregularity_def){.n_samples = IRREGULAR_SAMPLES,
                                                                .step_m = IRREGULAR_STEP_M,
                                                                .lateral_m = c->series[0],
                                                                .vertical_m = c->series[1],
                                                                .cross_rad = c->series[2]};
    c->vehicle.end_m = IRREGULAR_SAMPLES * IRREGULAR_STEP_M;
    return status == KL_OK ? CLI_OK : cli_fail("irregularities: %s", kl_status_text(status));
}

int bench_case_open(struct bench_case *c, int which, const struct cli_target *given,
                    double speed_m_s) {
    struct cli_target target = {.vehicle = given->vehicle,
                                .track = which == BENCH_TRACK_CASE ? given->track : NULL};
    /* the straight case has no track file whose values could be set */
    for (size_t i = 0; i < given->set.n; i++) {
        if (target.track != NULL || given->track == NULL ||
            strncmp(given->set.item[i], "track.", 6) != 0) {
            target.set.item[target.set.n++] = given->set.item[i];
        }
    }
    int status = cli_model_load(&c->m, &target);
    if (status != CLI_OK) {
        return status;
    }
    c->vehicle.end_m =
        target.track != NULL && c->m.file.track_length_m > 0.0 ? c->m.file.track_length_m : 1e6;
    if (which == BENCH_TRACK_CASE && target.track == NULL) {
        status = synthesise(c);
    }
    if (status != CLI_OK) {
        cli_model_close(&c->m);
        return status;
    }
    c->vehicle.model = &c->m.model;
    c->vehicle.speed_m_s = speed_m_s;
    c->vehicle.displaced = which == BENCH_TRACK_CASE;
    return cli_model_build(&c->m);
}

void bench_case_close(struct bench_case *c) {
    cli_model_close(&c->m);
    for (int i = 0; i < 3; i++) {
        free(c->series[i]);
    }
}
