/* cmd_bench.c - klingel bench: time and instructions of a step. */
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "bench_count.h"
#include "bench_time.h"

#define MIN_STEPS 1000
#define MAX_STEPS 1e8

/* Irregularities where no track is named: ERRI B176 low, as models/demo_track.yaml has them. */
#define IRREGULAR_SAMPLES 4000u
#define IRREGULAR_STEP_M 0.25

enum { STRAIGHT = 0, TRACK = 1, CASES = 2 };
static const char *const case_name[CASES] = {"straight", "track"};

struct arguments {
    uint64_t steps;
    double speed_m_s;
    const char *json;
    const char *count_only;
    bool instructions;
    struct cli_target target;
};

struct bench_case {
    struct cli_model m;
    struct bench_vehicle vehicle;
    struct bench_times times;
    double instructions; /* 0: not counted */
    double *series[3];
};

/* ---- the two cases ---- */

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

static int open_case(struct bench_case *c, int which, const struct arguments *a) {
    const struct cli_target *given = &a->target;
    struct cli_target target = {.vehicle = given->vehicle,
                                .track = which == TRACK ? given->track : NULL};
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
    if (which == TRACK && target.track == NULL) {
        status = synthesise(c);
    }
    if (status != CLI_OK) {
        cli_model_close(&c->m);
        return status;
    }
    c->vehicle.model = &c->m.model;
    c->vehicle.speed_m_s = a->speed_m_s;
    c->vehicle.displaced = which == TRACK;
    return cli_model_build(&c->m);
}

static void close_case(struct bench_case *c) {
    cli_model_close(&c->m);
    for (int i = 0; i < 3; i++) {
        free(c->series[i]);
    }
}

/* ---- results ---- */

static void print_case(const struct bench_case *c, int which, double calibration_ns) {
    const struct bench_times *t = &c->times;
    double real_time = 1e9 * (double)c->m.model.step_s / t->median;
    printf("%s\n", which == STRAIGHT ? "straight, smooth track" : "track with irregularities");
    printf("  ns per step, batches of %u:   min %.0f   median %.0f   p90 %.0f\n", BENCH_BATCH,
           t->min, t->median, t->p90);
    printf("  ns per step, singly:           median %.0f   p99 %.0f   p99.9 %.0f   max %.0f\n",
           t->single_median, t->p99, t->p999, t->max);
    printf("  %.0f x real time; %.3f of the calibration kernel\n", real_time,
           t->median / calibration_ns);
    if (c->instructions > 0.0) {
        printf("  %.0f instructions per step\n", c->instructions);
    }
}

static void json_case(FILE *file, const struct bench_case *c, int which) {
    const struct bench_times *t = &c->times;
    fprintf(file,
            ",\n  \"%s\": {\"min_ns\": %.1f, \"median_ns\": %.1f, \"p90_ns\": %.1f, "
            "\"single_median_ns\": %.1f, \"p99_ns\": %.1f, \"p99_9_ns\": %.1f, \"max_ns\": %.1f",
            case_name[which], t->min, t->median, t->p90, t->single_median, t->p99, t->p999, t->max);
    if (c->instructions > 0.0) {
        fprintf(file, ", \"instructions\": %.1f", c->instructions);
    }
    fprintf(file, "}");
}

static int write_json(const struct bench_case *cases, const struct arguments *a,
                      double calibration_ns) {
    struct cli_output output;
    int status = cli_output_open(&output, a->json);
    if (status != CLI_OK) {
        return status;
    }
    const struct kl_model *model = &cases[STRAIGHT].m.model;
    fprintf(output.file,
            "{\n  \"model\": \"%s\", \"model_hash\": \"%016" PRIx64 "\", \"step_ns\": %" PRId64
            ", \"speed_m_s\": %.9g,\n  \"steps\": %" PRIu64
            ", \"build_ms\": %.3f, \"states\": %u, \"state_bytes\": %zu,\n"
            "  \"clock_ns\": %.1f, \"calibration_ns\": %.1f",
            model->name, model->hash, model->step_ns, a->speed_m_s, a->steps,
            cases[STRAIGHT].m.build_ms, model->n_states, sizeof(struct kl_state),
            cases[STRAIGHT].times.clock_ns, calibration_ns);
    for (int i = 0; i < CASES; i++) {
        json_case(output.file, &cases[i], i);
    }
    fprintf(output.file, "\n}\n");
    return cli_output_close(&output, CLI_OK);
}

static void print_all(const struct bench_case *cases, const struct arguments *a,
                      double calibration_ns) {
    const struct kl_model *model = &cases[STRAIGHT].m.model;
    printf("%s: %u states, step %g ms, %g m/s, %" PRIu64 " steps measured twice\n", model->name,
           model->n_states, 1e3 * (double)model->step_s, a->speed_m_s, a->steps);
    printf("model built in %.2f ms; state %zu bytes; calibration kernel (1000 dependent "
           "multiply-adds) %.0f ns\n",
           cases[STRAIGHT].m.build_ms, sizeof(struct kl_state), calibration_ns);
    for (int i = 0; i < CASES; i++) {
        print_case(&cases[i], i, calibration_ns);
    }
    if (cases[STRAIGHT].instructions > 0.0) {
        printf("instructions, worst case over best: %.3f\n",
               fmax(cases[TRACK].instructions, cases[STRAIGHT].instructions) /
                   fmin(cases[TRACK].instructions, cases[STRAIGHT].instructions));
    }
}

/* ---- the command ---- */

/* What callgrind runs: "straight:1000". */
static int count_only(const struct arguments *a) {
    static struct bench_case c;
    const char *colon = strchr(a->count_only, ':');
    int which = strncmp(a->count_only, case_name[TRACK], strlen(case_name[TRACK])) == 0;
    int status = open_case(&c, which, a);
    if (status == CLI_OK) {
        uint64_t steps = colon != NULL ? strtoull(colon + 1, NULL, 10) : 0;
        printf("%016" PRIx64 "\n", bench_steps(&c.vehicle, steps));
        close_case(&c);
    }
    return status;
}

static int perform(struct bench_case *cases, const struct arguments *a, char *const *arguments) {
    int opened = 0;
    int status = CLI_OK;
    while (opened < CASES && status == CLI_OK) {
        status = open_case(&cases[opened], opened, a);
        opened += status == CLI_OK;
    }
    double calibration_ns = bench_calibrate();
    for (int i = 0; i < CASES && status == CLI_OK; i++) {
        status = bench_measure(&cases[i].vehicle, a->steps, &cases[i].times);
        if (status == CLI_OK && a->instructions) {
            status = bench_count("bench", arguments, case_name[i], &cases[i].instructions);
        }
    }
    if (status == CLI_OK && !cli_is_stdout(a->json)) {
        print_all(cases, a, calibration_ns);
    }
    if (status == CLI_OK && a->json != NULL) {
        status = write_json(cases, a, calibration_ns);
    }
    for (int i = 0; i < opened; i++) {
        close_case(&cases[i]);
    }
    return status;
}

int cmd_bench(int argc, char **argv) {
    struct arguments a = {.steps = 100000, .speed_m_s = 27.0};
    int status = CLI_OK;
    const struct cli_option options[] = {
        {.name = "--steps",
         .argument = "N",
         .kind = CLI_COUNT,
         .value = &a.steps,
         .low = MIN_STEPS,
         .high = MAX_STEPS,
         .help = "steps to measure; default 100000"},
        cli_speed_option("--speed", &a.speed_m_s, 0.0,
                         "speed of the vehicle, m/s or with a unit; default 27 m/s"),
        cli_maybe_file_option("--json", &a.json,
                              "the figures as JSON; without FILE, or with -, to standard output\n"
                              "in place of the text"),
        {.name = "--instructions",
         .kind = CLI_FLAG,
         .value = &a.instructions,
         .help = "count instructions per step as well: runs under valgrind, some 10 s"},
        {.name = "--count-only",
         .argument = "CASE:N",
         .kind = CLI_EXTRA_TEXT,
         .value = &a.count_only,
         .help = ""},
    };
    const struct cli_command command = {
        .takes_track = true,
        .purpose =
            "Measures what a step costs: on straight smooth track, and displaced on TRACK or, if\n"
            "none is given, on straight track with irregularities. Median over batches of 100\n"
            "steps; the high quantiles are those of single steps and hold what the system did\n"
            "meanwhile. The calibration kernel, a fixed piece of arithmetic, makes figures of\n"
            "different machines comparable.",
        .example =
            "klingel bench models/two_axle_wagon.yaml models/demo_track.yaml --json bench.json\n",
        .options = options,
        .n_options = sizeof options / sizeof options[0]};
    if (!cli_parse(&command, argc, argv, &a.target, &status)) {
        return status;
    }
    if (a.count_only != NULL) {
        return count_only(&a);
    }
    struct bench_case *cases = calloc(CASES, sizeof *cases);
    /* for callgrind: the same operands and --set, nothing else */
    char *again[2 + 2 * CLI_MAX_LIST + 4];
    char set_option[] = "--set";
    char speed[48];
    size_t n = 0;
    again[n++] = (char *)(uintptr_t)a.target.vehicle;
    if (a.target.track != NULL) {
        again[n++] = (char *)(uintptr_t)a.target.track;
    }
    for (size_t i = 0; i < a.target.set.n; i++) {
        again[n++] = set_option;
        again[n++] = (char *)(uintptr_t)a.target.set.item[i];
    }
    snprintf(speed, sizeof speed, "--speed=%.17g", a.speed_m_s);
    again[n++] = speed;
    again[n] = NULL;
    status = cases != NULL ? perform(cases, &a, again) : cli_fail("out of memory");
    free(cases);
    return cli_flush(status);
}
