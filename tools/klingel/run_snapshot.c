/* run_snapshot.c - states as files: kl_snapshot's bytes and nothing else. */
#include <errno.h>
#include <string.h>

#include "run_record.h"

int run_snapshot_write(const char *path, const struct kl_model *model,
                       const struct kl_state *state) {
    unsigned char bytes[KL_SNAPSHOT_SIZE];
    struct cli_output output;
    size_t n = 0;
    if (kl_snapshot(model, state, bytes, sizeof bytes, &n) != KL_OK) {
        return cli_fail("%s: the state does not fit the model", path);
    }
    int status = cli_output_open(&output, path);
    if (status != CLI_OK) {
        return status;
    }
    (void)fwrite(bytes, 1, n, output.file);
    return cli_output_close(&output, CLI_OK);
}

int run_snapshot_read(const char *path, const struct kl_model *model, struct kl_state *state) {
    unsigned char bytes[KL_SNAPSHOT_SIZE + 1];
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        return cli_fail("cannot open %s: %s", path, strerror(errno));
    }
    errno = 0;
    const size_t n = fread(bytes, 1, sizeof bytes, file);
    const bool failed = ferror(file) != 0;
    const int reason = errno;
    (void)fclose(file);
    if (failed) {
        return cli_fail("cannot read %s: %s", path, strerror(reason));
    }
    if (n > KL_SNAPSHOT_SIZE || kl_restore(model, state, bytes, n) != KL_OK) {
        return cli_fail("%s: no snapshot of this model (hash %016llx), or a damaged one", path,
                        (unsigned long long)model->hash);
    }
    return CLI_OK;
}
