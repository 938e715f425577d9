/*
 * What the loader says to bad files. Each file in tests/tools/bad begins with the messages that it
 * must give: "# expect: @:<line>: <message>", @ being the file itself and ... any end. Then damage
 * of all sorts: nothing may crash, leak, or fail without a word. Run from the project's root.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>
#include <dirent.h>
#include <malloc.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "model_file.h"

#define BAD "tests/tools/bad"
#define TRACK "models/s_curve.yaml"
#define SEED 20240601u

static char said[65536];
static char spoilt_path[64]; /* of this process alone; removed at the end */

/* Loads and builds; what it said is in `said`. */
static int try_files(const char *vehicle, const char *track) {
    struct model_file mf;
    struct kl_model model;
    memset(said, 0, sizeof said);
    FILE *errors = fmemopen(said, sizeof said - 1, "w");
    assert_non_null(errors);
    int status = model_file_load(&mf, vehicle, track, errors);
    if (status == 0) {
        status = model_file_build(&mf, &model, errors);
    }
    model_file_free(&mf);
    fclose(errors);
    return status;
}

/*
 * A load gives back all memory that it took. mallinfo2 counts exactly only without the caches per
 * thread, see main(). (Where malloc is replaced it says 0; valgrind and the sanitizers look for
 * leaks themselves.)
 */
static void keeps_nothing(const char *vehicle, const char *track) {
    (void)try_files(vehicle, track); /* what the C library allocates once */
    size_t before = mallinfo2().uordblks;
    (void)try_files(vehicle, track);
    assert_int_equal(mallinfo2().uordblks, before);
}

static void expectation(const char *path, char *text, size_t size) {
    static const char mark[] = "# expect: ";
    char line[1024];
    size_t used = 0;
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    text[0] = '\0';
    while (fgets(line, sizeof line, file) != NULL && strncmp(line, mark, strlen(mark)) == 0) {
        const char *message = line + strlen(mark);
        used += (size_t)snprintf(text + used, size - used, "%s%s", *message == '@' ? path : "",
                                 *message == '@' ? message + 1 : message);
        assert_true(used < size);
    }
    fclose(file);
}

static void test_each_bad_file(void **state) {
    (void)state;
    static char expected[8192];
    struct dirent **entries;
    int files = 0;
    int n = scandir(BAD, &entries, NULL, alphasort);
    assert_true(n > 0);
    for (int i = 0; i < n; i++) {
        char path[512];
        const char *name = entries[i]->d_name;
        snprintf(path, sizeof path, BAD "/%s", name);
        if (strstr(name, ".yaml") != NULL && name[0] != '.') {
            int track = strncmp(name, "track_", 6) == 0;
            expectation(path, expected, sizeof expected);
            int status =
                try_files(track ? "models/restrained_wheelset.yaml" : path, track ? path : NULL);
            char *rest = strstr(expected, "...\n"); /* the core's own words: not fixed here */
            if (rest != NULL && strncmp(said, expected, (size_t)(rest - expected)) == 0) {
                assert_true(strlen(said) > (size_t)(rest - expected) + 1);
            } else {
                assert_string_equal(said, expected);
            }
            assert_int_equal(status, -1);
            keeps_nothing(track ? "models/restrained_wheelset.yaml" : path, track ? path : NULL);
            files++;
        }
        free(entries[i]);
    }
    free(entries);
    assert_true(files >= 80);
}

static void write_file(const void *bytes, size_t size) {
    FILE *file = fopen(spoilt_path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

static char *read_file(const char *path, size_t *size) {
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    char *bytes = malloc(1 << 16);
    assert_non_null(bytes);
    *size = fread(bytes, 1, 1 << 16, file);
    fclose(file);
    return bytes;
}

static void test_good_files_leak_nothing(void **state) {
    (void)state;
    keeps_nothing("models/two_axle_wagon.yaml", "models/s_curve.yaml");
    keeps_nothing("tests/tools/good/full.yaml", "tests/tools/good/full_track.yaml");
}

/* The spoilt file is refused with exactly this behind its name. */
static void spoilt_says(const char *expected) {
    char whole[256];
    snprintf(whole, sizeof whole, "%s%s", spoilt_path, expected);
    assert_int_equal(try_files(spoilt_path, NULL), -1);
    assert_string_equal(said, whole);
}

static void test_no_text_at_all(void **state) {
    (void)state;
    static char large[300 * 1024];
    static const char binary[] = "name: a\0b\nstep_ns: 1\n";
    static const char control[] = "name: \x01\x02\n";
    assert_int_equal(try_files(BAD "/nowhere.yaml", NULL), -1);
    assert_string_equal(said, BAD "/nowhere.yaml: cannot open: No such file or directory\n");
    assert_int_equal(try_files(BAD, NULL), -1);
    assert_string_equal(said, BAD ": cannot read: Is a directory\n");
    write_file("", 0);
    spoilt_says(":1: the file is empty\n");
    write_file("# only this\n", 12);
    spoilt_says(":1: the file is empty\n");
    write_file(binary, sizeof binary - 1);
    spoilt_says(": not a text file (it holds a NUL byte)\n");
    write_file(control, sizeof control - 1);
    spoilt_says(":1: not valid YAML: control characters are not allowed\n");
    memset(large, '#', sizeof large);
    write_file(large, sizeof large);
    spoilt_says(": larger than 262144 bytes\n");
    for (size_t i = 0; i < sizeof large; i += 2) {
        memcpy(large + i, "[,", 2); /* deep */
    }
    write_file(large, 200000);
    assert_int_equal(try_files(spoilt_path, NULL), -1);
    memcpy(large, "a: [", 4);
    for (size_t i = 4; i < sizeof large; i += 2) {
        memcpy(large + i, "1,", 2); /* wide */
    }
    write_file(large, 200000);
    spoilt_says(":1: the file holds too many values\n");
}

static uint32_t next_random(uint32_t *x) {
    *x ^= *x << 13;
    *x ^= *x >> 17;
    *x ^= *x << 5;
    return *x;
}

/* One damaged copy of a file: it may load or not, but a refusal has words. */
static void try_damaged(const char *bytes, size_t size, int as_track) {
    write_file(bytes, size);
    int status = try_files(as_track ? "models/restrained_wheelset.yaml" : spoilt_path,
                           as_track ? spoilt_path : NULL);
    assert_true(status == 0 ? said[0] == '\0' : strstr(said, spoilt_path) != NULL);
}

static void damage(const char *path, int as_track) {
    size_t size;
    char *good = read_file(path, &size);
    char *spoilt = malloc(2 * size);
    uint32_t random = SEED;
    assert_non_null(spoilt);
    try_damaged(good, size, as_track);
    for (size_t cut = 0; cut < size; cut += 7) {
        try_damaged(good, cut, as_track);
    }
    for (int round = 0; round < 400; round++) {
        static const char salt[] = "{}[]:,-#&*!|>'\"%@`\n \t09.eyx";
        memcpy(spoilt, good, size);
        for (uint32_t k = 1 + next_random(&random) % 4; k > 0; k--) {
            uint32_t r = next_random(&random);
            spoilt[next_random(&random) % size] =
                round % 8 == 0 ? (char)(r & 0xffu) : salt[r % (sizeof salt - 1)];
        }
        try_damaged(spoilt, size, as_track);
    }
    for (int round = 0; round < 100; round++) { /* a piece of it twice, somewhere else */
        size_t from = next_random(&random) % size;
        size_t length = next_random(&random) % (size - from);
        size_t at = next_random(&random) % size;
        memcpy(spoilt, good, at);
        memcpy(spoilt + at, good + from, length);
        memcpy(spoilt + at + length, good + at, size - at);
        try_damaged(spoilt, size + length, as_track);
    }
    free(spoilt);
    free(good);
}

static void test_damaged_vehicle(void **state) {
    (void)state;
    damage("models/restrained_wheelset.yaml", 0);
    damage("tests/tools/good/full.yaml", 0);
}

static void test_damaged_track(void **state) {
    (void)state;
    damage(TRACK, 1);
    damage("tests/tools/good/full_track.yaml", 1);
}

static int remove_spoilt(void **state) {
    (void)state;
    (void)unlink(spoilt_path);
    return 0;
}

int main(int argc, char **argv) {
    static const char caches[] = "glibc.malloc.tcache_count=0";
    const char *now = getenv("GLIBC_TUNABLES");
    const char *preload = getenv("LD_PRELOAD");
    int valgrind = preload != NULL && strstr(preload, "vgpreload") != NULL;
    if (argc > 0 && !valgrind && (now == NULL || strstr(now, caches) == NULL)) {
        setenv("GLIBC_TUNABLES", caches, 1);
        execv("/proc/self/exe", argv); /* the setting counts at the start of a process only */
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_each_bad_file),  cmocka_unit_test(test_good_files_leak_nothing),
        cmocka_unit_test(test_no_text_at_all), cmocka_unit_test(test_damaged_vehicle),
        cmocka_unit_test(test_damaged_track),
    };
    snprintf(spoilt_path, sizeof spoilt_path, "/tmp/klingel_model_%ld.yaml", (long)getpid());
    printf("seed of the damage: %u\n", SEED);
    return cmocka_run_group_tests(tests, NULL, remove_spoilt);
}
