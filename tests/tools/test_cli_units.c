/* Numbers with units, likeness of words, and files that appear complete or not at all. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "cli.h"

static void quantities(void **state) {
    (void)state;
    static const struct {
        const char *text;
        const char *unit;
        double si;
    } good[] = {
        {"3", "mm", 0.003},          {"3m", "mm", 3.0},
        {"-2.5 mm", "m", -0.0025},   {"36km/h", "m/s", 10.0},
        {"1e3mm/s", "m/s", 1.0},     {"180deg", "rad", 3.14159265358979312},
        {"+.5", "s", 0.5},           {"2min", "s", 120.0},
        {"250ms", "s", 0.25},        {"7", "", 7.0},
        {"1mrad/s", "rad/s", 0.001}, {"50kN", "N", 50000.0},
        {"2km", "m", 2000.0},
    };
    char why[160];
    for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
        double si = -1.0;
        assert_true(cli_quantity(good[i].text, good[i].unit, &si, why, sizeof why));
        assert_true(fabs(si - good[i].si) <= 1e-15 * (1.0 + fabs(good[i].si)));
    }
    static const char *const bad[][2] = {
        {"", "m"},      {"m", "m"},   {"3s", "m"},    {"3q", "m"},     {"nan", "m"},
        {"inf", "m"},   {"0x1", "m"}, {"3mmm", "m"},  {"1e999", "m"},  {"3m", ""},
        {" 3", "m"},    {"--3", "m"}, {"3 m x", "m"}, {".", "m"},      {"3,5", "m"},
        {"1.2.3", "m"}, {"-", "m/s"}, {"e3", "m"},    {"3km/h", "rad"}};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        double si = -1.0;
        why[0] = '\0';
        assert_false(cli_quantity(bad[i][0], bad[i][1], &si, why, sizeof why));
        assert_true(si == -1.0);
        assert_true(why[0] != '\0');
    }
}

static void likeness(void **state) {
    (void)state;
    static const char *const words[] = {"--speed", "--speeds", "--csv", "--critical"};
    char longest[5000];
    memset(longest, 'x', sizeof longest - 1);
    longest[sizeof longest - 1] = '\0';
    assert_string_equal(cli_nearest("--sped", words, 4), "--speed");
    assert_string_equal(cli_nearest("--speedss", words, 4), "--speeds");
    assert_string_equal(cli_nearest("--scv", words, 4), "--csv");
    assert_null(cli_nearest("--output", words, 4));
    assert_null(cli_nearest("", words, 4));
    assert_null(cli_nearest(longest, words, 4));
    assert_null(cli_nearest("--csv", words, 0));
}

static char folder[] = "/tmp/klingel_cli_XXXXXX";

static int make_folder(void **state) {
    (void)state;
    return mkdtemp(folder) == NULL;
}

static int remove_folder(void **state) {
    (void)state;
    return rmdir(folder); /* fails if a test left a file */
}

static void files(void **state) {
    (void)state;
    char path[128];
    char text[16] = "";
    struct stat there;
    struct cli_output output;
    snprintf(path, sizeof path, "%s/out.txt", folder);
    /* not there until it is closed */
    assert_int_equal(cli_output_open(&output, path), CLI_OK);
    fprintf(output.file, "first");
    fflush(output.file);
    assert_int_not_equal(stat(path, &there), 0);
    assert_int_equal(cli_output_close(&output, CLI_OK), CLI_OK);
    assert_int_equal(stat(path, &there), 0);
    assert_int_equal(there.st_size, 5);
    /* a failed command leaves the old one */
    assert_int_equal(cli_output_open(&output, path), CLI_OK);
    fprintf(output.file, "second, longer");
    assert_int_equal(cli_output_close(&output, CLI_FAILED), CLI_FAILED);
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    assert_non_null(fgets(text, sizeof text, file));
    fclose(file);
    assert_string_equal(text, "first");
    assert_int_equal(unlink(path), 0);
    /* closing what is not open keeps the status */
    assert_int_equal(cli_output_close(&output, CLI_USAGE), CLI_USAGE);
}

static void refusals(void **state) {
    (void)state;
    struct cli_output output;
    assert_int_equal(cli_output_open(&output, "x.yaml"), CLI_USAGE);
    assert_int_equal(cli_output_open(&output, "x.yml"), CLI_USAGE);
    assert_int_equal(cli_output_open(&output, "/nowhere/x"), CLI_FAILED);
    assert_null(output.file);
    assert_true(cli_is_stdout("-"));
    assert_false(cli_is_stdout(""));
    assert_false(cli_is_stdout(NULL));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(quantities),
        cmocka_unit_test(likeness),
        cmocka_unit_test_setup_teardown(files, make_folder, remove_folder),
        cmocka_unit_test(refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
