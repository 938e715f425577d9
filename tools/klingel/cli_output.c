/* cli_output.c - files that appear complete or not at all. */
#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "cli.h"

/* The file being written, for the signal handler: one at a time is all that any command needs. */
static char *volatile unfinished;

static void remove_unfinished(int number) {
    if (unfinished != NULL) {
        unlink(unfinished);
    }
    signal(number, SIG_DFL);
    raise(number);
}

static void guard(char *temporary) {
    static const int numbers[] = {SIGINT, SIGTERM, SIGHUP, SIGPIPE};
    unfinished = temporary;
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++) {
        struct sigaction now;
        if (sigaction(numbers[i], NULL, &now) == 0 && now.sa_handler == SIG_DFL) {
            signal(numbers[i], remove_unfinished);
        }
    }
}

bool cli_is_stdout(const char *path) {
    return path != NULL && strcmp(path, "-") == 0;
}

static bool ends_with(const char *text, const char *end) {
    size_t length = strlen(text);
    return length >= strlen(end) && strcmp(text + length - strlen(end), end) == 0;
}

static int open_temporary(struct cli_output *output) {
    size_t size = strlen(output->path) + sizeof ".XXXXXX";
    output->temporary = malloc(size);
    if (output->temporary == NULL) {
        return cli_fail("out of memory");
    }
    snprintf(output->temporary, size, "%s.XXXXXX", output->path);
    int fd = mkstemp(output->temporary);
    if (fd < 0) {
        int status = cli_fail("cannot write %s: %s", output->path, strerror(errno));
        free(output->temporary);
        output->temporary = NULL;
        return status;
    }
    guard(output->temporary);
    mode_t mask = umask(0);
    umask(mask);
    struct stat old;
    mode_t mode = stat(output->path, &old) == 0 ? old.st_mode & 0777 : 0666 & ~mask;
    (void)fchmod(fd, mode);
    output->file = fdopen(fd, "w");
    return output->file != NULL ? CLI_OK : cli_fail("cannot write %s", output->path);
}

int cli_output_open(struct cli_output *output, const char *path) {
    struct stat there;
    memset(output, 0, sizeof *output);
    if (ends_with(path, ".yaml") || ends_with(path, ".yml")) {
        return cli_misuse("%s: a model file shall not be written over; choose another name", path);
    }
    if (cli_is_stdout(path)) {
        output->file = stdout;
        return CLI_OK;
    }
    bool exists = stat(path, &there) == 0;
    output->path = exists ? realpath(path, NULL) : strdup(path); /* links stay links */
    if (output->path == NULL) {
        return cli_fail("cannot write %s: %s", path, strerror(errno));
    }
    int status = CLI_OK;
    if (exists && !S_ISREG(there.st_mode)) {
        output->file = fopen(output->path, "w");
        status =
            output->file != NULL ? CLI_OK : cli_fail("cannot write %s: %s", path, strerror(errno));
    } else {
        status = open_temporary(output);
    }
    if (status != CLI_OK) {
        free(output->path);
        memset(output, 0, sizeof *output);
    }
    return status;
}

static int finish(struct cli_output *output, int status) {
    int reason = errno; /* of the write that failed, if one did */
    bool failed = ferror(output->file) != 0;
    if (fflush(output->file) != 0) {
        reason = errno;
        failed = true;
    }
    if (output->file != stdout && fclose(output->file) != 0) {
        reason = errno;
        failed = true;
    }
    const char *name = output->path != NULL ? output->path : "standard output";
    if (failed) {
        return cli_fail("cannot write %s: %s", name, strerror(reason != 0 ? reason : EIO));
    }
    if (output->temporary != NULL && status == CLI_OK &&
        rename(output->temporary, output->path) != 0) {
        return cli_fail("cannot write %s: %s", name, strerror(errno));
    }
    return status;
}

int cli_output_close(struct cli_output *output, int status) {
    if (output->file == NULL) {
        return status;
    }
    int end = finish(output, status);
    if (output->temporary != NULL && end != CLI_OK) {
        (void)unlink(output->temporary);
    }
    unfinished = NULL;
    free(output->temporary);
    free(output->path);
    memset(output, 0, sizeof *output);
    return end;
}

int cli_flush(int status) {
    bool failed = ferror(stdout) != 0;
    failed = fflush(stdout) != 0 || failed;
    return failed && status == CLI_OK ? cli_fail("cannot write to standard output") : status;
}

void cli_csv_row(FILE *file, const double *values, size_t n) {
    for (size_t i = 0; i < n; i++) {
        fprintf(file, i == 0 ? "%.12g" : ",%.12g", values[i]);
    }
    fputc('\n', file);
}

int cli_sink_write(void *context, const char *text, size_t size) {
    return fwrite(text, 1, size, context) == size ? 0 : -1;
}
