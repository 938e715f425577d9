/* bench_count.c - runs this program under valgrind's callgrind. */
#include "bench_count.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#define MAX_ARGUMENTS 160

static void exec_valgrind(const char *command, char *const *arguments, const char *which,
                          const char *steps, const char *out, const char *log) {
    char program[4096];
    char count[64];
    char log_option[64];
    char out_option[128];
    const char *argv[MAX_ARGUMENTS] = {"valgrind", "--tool=callgrind", out_option, log_option};
    size_t n = 4;
    if (out != NULL) {
        argv[n++] = "--dump-instr=yes";
        argv[n++] = "--compress-pos=no";
        argv[n++] = "--compress-strings=no";
    }
    argv[n++] = program;
    argv[n++] = command;
    ssize_t length = readlink("/proc/self/exe", program, sizeof program - 1);
    if (length < 0) {
        _exit(126);
    }
    program[length] = '\0';
    snprintf(out_option, sizeof out_option, "--callgrind-out-file=%s",
             out != NULL ? out : "/dev/null");
    snprintf(log_option, sizeof log_option, "--log-file=%s", log);
    snprintf(count, sizeof count, "--count-only=%s:%s", which, steps);
    for (size_t i = 0; arguments[i] != NULL && n < MAX_ARGUMENTS - 2; i++) {
        argv[n++] = arguments[i];
    }
    argv[n++] = count;
    argv[n] = NULL;
    if (freopen("/dev/null", "w", stdout) == NULL) {
        _exit(126);
    }
    execvp("valgrind", (char *const *)argv);
    _exit(127);
}

/* "==123== Collected : 4711" */
static int read_log(const char *log, double *instructions) {
    char line[512];
    int status = CLI_FAILED;
    FILE *file = fopen(log, "r");
    while (file != NULL && fgets(line, sizeof line, file) != NULL) {
        const char *at = strstr(line, "Collected :");
        if (at != NULL) {
            *instructions = strtod(at + strlen("Collected :"), NULL);
            status = *instructions > 0.0 ? CLI_OK : CLI_FAILED;
        }
    }
    if (file != NULL) {
        fclose(file);
    }
    return status;
}

int bench_callgrind(const char *command, char *const *arguments, const char *which,
                    const char *steps, const char *out, double *instructions) {
    char log[] = "/tmp/klingel_bench_XXXXXX";
    int status = 0;
    int fd = mkstemp(log);
    if (fd < 0) {
        return cli_fail("cannot write %s: %s", log, strerror(errno));
    }
    close(fd);
    pid_t child = fork();
    if (child == 0) {
        exec_valgrind(command, arguments, which, steps, out, log);
    }
    pid_t ended = -1;
    do {
        ended = child > 0 ? waitpid(child, &status, 0) : -1;
    } while (ended < 0 && errno == EINTR);
    bool ran = ended > 0 && WIFEXITED(status) && WEXITSTATUS(status) == 0;
    int read = ran ? read_log(log, instructions) : CLI_FAILED;
    (void)unlink(log);
    if (ended > 0 && WIFEXITED(status) && WEXITSTATUS(status) == 127) {
        return cli_fail("--instructions: there is no valgrind; install it or leave the option out");
    }
    return read == CLI_OK ? CLI_OK
                          : cli_fail("--instructions: valgrind failed; it cannot read the debug "
                                     "information of every compiler (clang: add -gdwarf-4)");
}

int bench_count(const char *command, char *const *arguments, const char *which, double *per_step) {
    double few = 0.0;
    double many = 0.0;
    int status = bench_callgrind(command, arguments, which, BENCH_FEW, NULL, &few);
    status = status == CLI_OK ? bench_callgrind(command, arguments, which, BENCH_MANY, NULL, &many)
                              : status;
    *per_step = (many - few) / (strtod(BENCH_MANY, NULL) - strtod(BENCH_FEW, NULL));
    return status;
}
