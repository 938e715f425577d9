/*
 * conformance - holds CAN back ends to port/kl_can.h.
 * usage: conformance [--help] [BENCH ...]     BENCH: virtual | slcan | slcan-pty | socketcand | socketcan[:INTERFACE]
 * Without a BENCH: all that can run here. Exit status: 0 passed, 1 failed, 2 usage, 77 if a BENCH
 * that was asked for cannot run here and nothing failed.
 */
#include "bench_socketcan.h"
#include "cases.h"

#include <stdio.h>
#include <string.h>

#define STATUS_SKIPPED 77

static const struct bench *const benches[] = {&bench_virtual,   &bench_slcan,
                                              &bench_slcan_pty, &bench_socketcand,
                                              &bench_socketcan, &bench_socketcan_fd};
enum { BENCHES = sizeof benches / sizeof benches[0] };

/* Negative: cannot run here; else the number of failures. */
static int run_one(const struct bench *bench, const char *argument) {
    const char *why_not = bench->available(argument);
    if (why_not != NULL) {
        (void)printf("conformance: %s%s%s skipped: %s\n", bench->name, argument[0] ? ":" : "",
                     argument, why_not);
        return -1;
    }
    (void)printf("conformance: %s\n", bench->name);
    int failures = run_cases(bench);
    if (failures >= 0 && bench == &bench_socketcan)
        failures += run_vcan_faults();
    return failures < 0 ? 1 : failures;
}

static const struct bench *find(const char *word, const char **argument) {
    size_t length = strcspn(word, ":");
    *argument = word[length] == ':' ? word + length + 1 : "";
    for (int i = 0; i < BENCHES; i++) {
        if (strlen(benches[i]->name) == length && strncmp(benches[i]->name, word, length) == 0)
            return benches[i];
    }
    return NULL;
}

int main(int argc, char **argv) {
    int failures = 0;
    int skipped = 0;
    (void)setvbuf(stdout, NULL, _IOLBF, 0);
    if (argc > 1 && strcmp(argv[1], "--help") == 0) {
        (void)printf("usage: conformance [virtual | slcan | slcan-pty | socketcand | "
                     "socketcan[:INTERFACE] | "
                     "socketcan-fd[:INTERFACE]] ...\nHolds CAN back ends to port/kl_can.h; without "
                     "arguments all that can run here.\n");
        return 0;
    }
    for (int i = 0; argc == 1 && i < BENCHES; i++) {
        int result = run_one(benches[i], "");
        failures += result > 0 ? result : 0;
    }
    for (int i = 1; i < argc; i++) {
        const char *argument = "";
        const struct bench *bench = find(argv[i], &argument);
        if (bench == NULL) {
            (void)fprintf(stderr, "conformance: no bench '%s' (see --help)\n", argv[i]);
            return 2;
        }
        int result = run_one(bench, argument);
        failures += result > 0 ? result : 0;
        skipped += result < 0;
    }
    if (failures > 0)
        return 1;
    return skipped > 0 ? STATUS_SKIPPED : 0;
}
