/* cmd_bench.c - klingel bench: time and instructions of a step. */
#include <dirent.h>
#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "bench_case.h"
#include "bench_count.h"

#define MIN_STEPS 1000
#define MAX_STEPS 1e8
#define MAX_MODELS 256

struct arguments {
    uint64_t steps;
    double speed_m_s;
    const char *json;
    const char *all;
    const char *count_only;
    bool instructions;
    bool stages;
    struct cli_target target;
};

/* What callgrind runs: "straight:1000". */
static int count_only(const struct arguments *a) {
    static struct bench_case c;
    const char *colon = strchr(a->count_only, ':');
    const char *track = bench_case_name[BENCH_TRACK_CASE];
    int which = strncmp(a->count_only, track, strlen(track)) == 0;
    int status = bench_case_open(&c, which, &a->target, a->speed_m_s);
    if (status == CLI_OK) {
        uint64_t steps = colon != NULL ? strtoull(colon + 1, NULL, 10) : 0;
        printf("%016" PRIx64 "\n", bench_steps(&c.vehicle, steps));
        bench_case_close(&c);
    }
    return status;
}

/* ---- one model ---- */

static int count(struct bench_case *c, int which, const struct arguments *a,
                 const struct cli_target *target) {
    /* for callgrind: the same operands and --set, nothing else */
    char *again[2 + 2 * CLI_MAX_LIST + 4];
    char set_option[] = "--set";
    char speed[48];
    size_t n = 0;
    int status = CLI_OK;
    again[n++] = (char *)(uintptr_t)target->vehicle;
    if (target->track != NULL) {
        again[n++] = (char *)(uintptr_t)target->track;
    }
    for (size_t i = 0; i < target->set.n; i++) {
        again[n++] = set_option;
        again[n++] = (char *)(uintptr_t)target->set.item[i];
    }
    snprintf(speed, sizeof speed, "--speed=%.17g", a->speed_m_s);
    again[n++] = speed;
    again[n] = NULL;
    if (a->stages) {
        status = bench_count_stages(again, bench_case_name[which], c->stage);
        c->has_stages = status == CLI_OK;
        for (int i = 0; i < BENCH_STAGES; i++) {
            c->instructions += c->stage[i];
        }
    } else if (a->instructions) {
        status = bench_count("bench", again, bench_case_name[which], &c->instructions);
    }
    return status;
}

/* Measures; to be closed in any case. */
static int measure(struct bench_of_model *b, const struct arguments *a,
                   const struct cli_target *target) {
    int status = CLI_OK;
    memset(b, 0, sizeof *b);
    b->path = target->vehicle;
    b->speed_m_s = a->speed_m_s;
    b->steps = a->steps;
    for (int i = 0; i < BENCH_CASES && status == CLI_OK; i++) {
        status = bench_case_open(&b->of[i], i, target, a->speed_m_s);
    }
    b->calibration_ns = bench_calibrate();
    for (int i = 0; i < BENCH_CASES && status == CLI_OK; i++) {
        status = bench_measure(&b->of[i].vehicle, a->steps, &b->of[i].times);
        status = status == CLI_OK ? count(&b->of[i], i, a, target) : status;
    }
    return status;
}

static void close_all(struct bench_of_model *b) {
    for (int i = 0; i < BENCH_CASES; i++) {
        bench_case_close(&b->of[i]);
    }
}

static int bench_one(struct bench_of_model *b, const struct arguments *a) {
    struct cli_output json = {0};
    int status = measure(b, a, &a->target);
    if (status == CLI_OK && !cli_is_stdout(a->json)) {
        bench_print(b, stdout);
    }
    if (status == CLI_OK && a->json != NULL) {
        status = cli_output_open(&json, a->json);
        if (status == CLI_OK) {
            bench_json(b, json.file);
            fputc('\n', json.file);
            status = cli_output_close(&json, CLI_OK);
        }
    }
    close_all(b);
    return status;
}

/* ---- all of a folder ---- */

/* A vehicle file has a line that begins with "wheelsets:", as no track file has. */
static bool is_vehicle(const char *path) {
    char text[256];
    bool found = false;
    FILE *file = fopen(path, "r");
    while (file != NULL && !found && fgets(text, sizeof text, file) != NULL) {
        found = strncmp(text, "wheelsets:", 10) == 0;
    }
    if (file != NULL) {
        (void)fclose(file);
    }
    return found;
}

static int by_name(const void *a, const void *b) {
    return strcmp(*(char *const *)a, *(char *const *)b);
}

/* The vehicle files of a folder, sorted; the caller frees the names. */
static int find_vehicles(const char *folder, char **names, size_t *n) {
    char path[4096];
    DIR *directory = opendir(folder);
    const struct dirent *entry = NULL;
    *n = 0;
    if (directory == NULL) {
        return cli_fail("--all %s: %s", folder, strerror(errno));
    }
    while (*n < MAX_MODELS && (entry = readdir(directory)) != NULL) {
        const char *end = strrchr(entry->d_name, '.');
        const char *slash = folder[strlen(folder) - 1] == '/' ? "" : "/";
        const int length = snprintf(path, sizeof path, "%s%s%s", folder, slash, entry->d_name);
        if (end != NULL && strcmp(end, ".yaml") == 0 && length < (int)sizeof path &&
            is_vehicle(path)) {
            names[*n] = strdup(path);
            *n += names[*n] != NULL;
        }
    }
    (void)closedir(directory);
    qsort(names, *n, sizeof names[0], by_name);
    return *n > 0 ? CLI_OK : cli_fail("--all %s: no vehicle file (*.yaml) is in it", folder);
}

static int bench_folder(struct bench_of_model *b, const struct arguments *a) {
    static char *names[MAX_MODELS];
    struct cli_output json = {0};
    size_t n = 0;
    const bool text = !cli_is_stdout(a->json);
    int status = find_vehicles(a->all, names, &n);
    if (status == CLI_OK && a->json != NULL) {
        status = cli_output_open(&json, a->json);
    }
    if (status == CLI_OK && text) {
        printf("ns per step; real time: of the median; kernel: median over that of the calibration "
               "kernel\n");
        bench_table_head(a->instructions || a->stages, stdout);
    }
    for (size_t i = 0; i < n; i++) {
        const struct cli_target target = {.vehicle = names[i], .track = a->target.vehicle};
        if (status == CLI_OK) {
            status = measure(b, a, &target);
            if (status == CLI_OK && text) {
                bench_table_row(b, stdout);
            }
            if (status == CLI_OK && json.file != NULL) {
                fprintf(json.file, i == 0 ? "{\"models\": [" : ",\n");
                bench_json(b, json.file);
            }
            close_all(b);
        }
        free(names[i]);
    }
    if (json.file != NULL) {
        fprintf(json.file, "]}\n");
    }
    return cli_output_close(&json, status);
}

/* ---- the command ---- */

static int check(const struct arguments *a) {
    if (a->all == NULL) {
        return a->target.vehicle != NULL ? CLI_OK
                                         : cli_misuse("an argument is missing: expected MODEL "
                                                      "[TRACK], or --all FOLDER [TRACK]");
    }
    if (a->target.track != NULL || a->target.set.n > 0) {
        return cli_misuse("--all FOLDER takes one argument, the TRACK of all, and no --set");
    }
    return CLI_OK;
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
        {.name = "--stages",
         .kind = CLI_FLAG,
         .value = &a.stages,
         .help = "and by the stages of a step: track, placing, suspension, contact, motion,\n"
                 "inputs and outputs; some 20 s"},
        {.name = "--all",
         .argument = "FOLDER",
         .kind = CLI_TEXT,
         .value = &a.all,
         .help = "every vehicle file of a folder, as a table; the one argument is TRACK"},
        {.name = "--count-only",
         .argument = "CASE:N",
         .kind = CLI_EXTRA_TEXT,
         .value = &a.count_only,
         .help = ""},
    };
    const struct cli_command command = {
        .takes_track = true,
        .operands = "MODEL [TRACK]",
        .purpose =
            "Measures what a step costs: on straight smooth track, and displaced on TRACK or, if\n"
            "none is given, on straight track with irregularities. Median over batches of 100\n"
            "steps; the high quantiles are those of single steps and hold what the system did\n"
            "meanwhile. The calibration kernel, a fixed piece of arithmetic, makes figures of\n"
            "different machines comparable: give them as a ratio to it.",
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
    if ((status = check(&a)) != CLI_OK) {
        return status;
    }
    struct bench_of_model *b = calloc(1, sizeof *b);
    status = b == NULL       ? cli_fail("out of memory")
             : a.all != NULL ? bench_folder(b, &a)
                             : bench_one(b, &a);
    free(b);
    return cli_flush(status);
}
