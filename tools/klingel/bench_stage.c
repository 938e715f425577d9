/* bench_stage.c - instructions of a step by its stages. */
#include "bench_stage.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>
#include <unistd.h>

#include "bench_count.h"

static const char *const stage_name[BENCH_STAGES] = {
    "track", "placing", "suspension", "contact", "motion", "inputs_outputs", "other"};

const char *bench_stage_name(enum bench_stage stage) {
    return stage_name[stage];
}

/* Beginnings of the names of the core's functions. The first that fits decides. */
static const struct {
    const char *begins;
    enum bench_stage stage;
} functions[] = {
    {"read_track", BENCH_TRACK},
    {"kl_track_", BENCH_TRACK},
    {"kl_layout_", BENCH_TRACK},
    {"kl_irregularity_", BENCH_TRACK},
    {"kl_piece_", BENCH_TRACK},
    {"place_", BENCH_PLACING},
    {"carry_", BENCH_PLACING},
    {"offsets_at", BENCH_PLACING},
    {"kl_axle_place", BENCH_PLACING},
    {"kl_axle_look_up", BENCH_PLACING},
    {"kl_axle_posture", BENCH_PLACING},
    {"kl_axle_meet_flange", BENCH_PLACING},
    {"kl_axle_carry", BENCH_PLACING},
    {"kl_contact_", BENCH_PLACING},
    {"suspension_forces", BENCH_SUSPENSION},
    {"slips_of", BENCH_SUSPENSION},
    {"kl_strut", BENCH_SUSPENSION},
    {"rub_wheelsets", BENCH_CONTACT},
    {"load_wheelsets", BENCH_CONTACT},
    {"write_wheel", BENCH_EDGE},
    {"write_contact", BENCH_EDGE},
    {"kl_axle_accelerate", BENCH_MOTION},
    {"kl_axle_stiffness", BENCH_MOTION},
    {"kl_axle_keep", BENCH_MOTION},
    {"kl_axle_", BENCH_CONTACT},
    {"kl_creep_", BENCH_CONTACT},
    {"kl_flange_", BENCH_CONTACT},
    {"move_wheelsets", BENCH_CONTACT},
    {"move_bodies", BENCH_MOTION},
    {"finish", BENCH_MOTION},
    {"damp", BENCH_MOTION},
    {"carried_part", BENCH_MOTION},
    {"is_sound", BENCH_MOTION},
    {"settle", BENCH_MOTION},
    {"check_input", BENCH_EDGE},
    {"kl_write_output", BENCH_EDGE},
    {"kl_evaluate", BENCH_MOTION},
    {"kl_step", BENCH_MOTION},
};
#define N_FUNCTIONS (sizeof functions / sizeof functions[0])

static enum bench_stage stage_of(const char *name) {
    for (size_t i = 0; i < N_FUNCTIONS; i++) {
        if (strncmp(name, functions[i].begins, strlen(functions[i].begins)) == 0) {
            return functions[i].stage;
        }
    }
    return BENCH_OTHER;
}

/* ---- costs by address ---- */

struct cost {
    uint64_t address;
    double count;
};
struct costs {
    size_t n;
    size_t room;
    struct cost *item;
    double total; /* of all objects */
};

static bool add(struct costs *c, uint64_t address, double count) {
    if (c->n == c->room) {
        size_t room = 2 * c->room + 4096;
        struct cost *more = realloc(c->item, room * sizeof *more);
        if (more == NULL) {
            return false;
        }
        c->item = more;
        c->room = room;
    }
    c->item[c->n++] = (struct cost){address, count};
    return true;
}

static int by_address(const void *a, const void *b) {
    const struct cost *x = a;
    const struct cost *y = b;
    return (x->address > y->address) - (x->address < y->address);
}

static void merge(struct costs *c) {
    size_t n = 0;
    if (c->n > 0) {
        qsort(c->item, c->n, sizeof *c->item, by_address);
    }
    for (size_t i = 0; i < c->n; i++) {
        if (n > 0 && c->item[n - 1].address == c->item[i].address) {
            c->item[n - 1].count += c->item[i].count;
        } else {
            c->item[n++] = c->item[i];
        }
    }
    c->n = n;
}

/* callgrind's file: "ob=OBJECT", then "0xADDRESS LINE COUNT"; a line behind "calls=" is of what was
 * called, and counted there. */
static int read_costs(FILE *file, const char *program, double sign, struct costs *c) {
    char *text = NULL;
    size_t room = 0;
    bool mine = false;
    bool called = false;
    bool held = true;
    while (held && getline(&text, &room, file) > 0) {
        char *end = NULL;
        if (strncmp(text, "ob=", 3) == 0) {
            text[strcspn(text, "\n")] = '\0';
            mine = strcmp(text + 3, program) == 0;
        } else if (strncmp(text, "calls=", 6) == 0) {
            called = true;
        } else if (strncmp(text, "0x", 2) == 0) {
            const uint64_t address = strtoull(text, &end, 16);
            (void)strtoull(end, &end, 10);
            const double count = strtod(end, NULL);
            if (!called) {
                c->total += sign * count;
                held = !mine || add(c, address, sign * count);
            }
            called = false;
        }
    }
    free(text);
    return held ? CLI_OK : cli_fail("out of memory");
}

static int collect(char *const *arguments, const char *which, const char *steps,
                   const char *program, double sign, struct costs *c) {
    char path[] = "/tmp/klingel_stages_XXXXXX";
    double instructions = 0.0;
    int fd = mkstemp(path);
    if (fd < 0) {
        return cli_fail("cannot write %s: %s", path, strerror(errno));
    }
    close(fd);
    int status = bench_callgrind("bench", arguments, which, steps, path, &instructions);
    FILE *file = status == CLI_OK ? fopen(path, "r") : NULL;
    if (file != NULL) {
        status = read_costs(file, program, sign, c);
        (void)fclose(file);
    }
    (void)unlink(path);
    return status;
}

/* ---- addresses to functions ---- */

static int write_addresses(const char *path, const struct costs *c) {
    FILE *file = fopen(path, "w");
    if (file == NULL) {
        return cli_fail("cannot write %s: %s", path, strerror(errno));
    }
    for (size_t i = 0; i < c->n; i++) {
        (void)fprintf(file, "0x%llx\n", (unsigned long long)c->item[i].address);
    }
    return fclose(file) == 0 ? CLI_OK : cli_fail("cannot write %s", path);
}

/* addr2line -a -i -f: the address, then function and place by turns, innermost first. */
static size_t read_functions(FILE *file, const struct costs *c, double per_stage[BENCH_STAGES]) {
    char *text = NULL;
    size_t room = 0;
    size_t i = 0; /* addresses seen */
    bool function = false;
    enum bench_stage stage = BENCH_OTHER;
    size_t named = 0;
    while (getline(&text, &room, file) > 0) {
        if (strncmp(text, "0x", 2) == 0) {
            if (i > 0 && i <= c->n) {
                per_stage[stage] += c->item[i - 1].count;
            }
            i++;
            stage = BENCH_OTHER;
            function = true;
        } else {
            stage = function && stage == BENCH_OTHER ? stage_of(text) : stage;
            named += function && text[0] != '?';
            function = !function;
        }
    }
    if (i > 0 && i <= c->n) {
        per_stage[stage] += c->item[i - 1].count;
    }
    free(text);
    return named;
}

static int resolve(const char *program, const struct costs *c, double per_stage[BENCH_STAGES]) {
    char path[] = "/tmp/klingel_stages_XXXXXX";
    char command[4200];
    int fd = mkstemp(path);
    if (fd < 0) {
        return cli_fail("cannot write %s: %s", path, strerror(errno));
    }
    close(fd);
    int status = write_addresses(path, c);
    if (strchr(program, '\'') != NULL) {
        status = cli_fail("--stages: a program named %s cannot be looked into", program);
    }
    snprintf(command, sizeof command, "addr2line -a -i -f -e '%s' <%s 2>/dev/null", program, path);
    FILE *pipe = status == CLI_OK ? popen(command, "r") : NULL;
    if (pipe != NULL) {
        const size_t named = read_functions(pipe, c, per_stage);
        if (pclose(pipe) != 0 || named == 0) {
            status = cli_fail("--stages: addr2line (Debian package binutils) found no functions");
        }
    } else if (status == CLI_OK) {
        status = cli_fail("--stages: cannot start addr2line");
    }
    (void)unlink(path);
    return status;
}

int bench_count_stages(char *const *arguments, const char *which, double per_step[BENCH_STAGES]) {
    char program[4096];
    struct costs c = {0};
    const double steps = strtod(BENCH_MANY, NULL) - strtod(BENCH_FEW, NULL);
    ssize_t length = readlink("/proc/self/exe", program, sizeof program - 1);
    if (length < 0) {
        return cli_fail("--stages: cannot find this program");
    }
    program[length] = '\0';
    for (int i = 0; i < BENCH_STAGES; i++) {
        per_step[i] = 0.0;
    }
    int status = collect(arguments, which, BENCH_MANY, program, 1.0, &c);
    status = status == CLI_OK ? collect(arguments, which, BENCH_FEW, program, -1.0, &c) : status;
    if (status == CLI_OK) {
        merge(&c);
        status = resolve(program, &c, per_step);
    }
    double known = 0.0;
    for (int i = 0; i < BENCH_OTHER; i++) {
        per_step[i] /= steps;
        known += per_step[i];
    }
    per_step[BENCH_OTHER] = c.total / steps - known;
    free(c.item);
    return status;
}
