/*
 * Profiles from files: every format gives the same contact table; cant, places and sides; what a bad
 * file is told; damage of all sorts. Run from the project's root.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "model_file.h"
#include "model_source.h"
#include "profile_file.h"

#define FOLDER "tests/tools/fixtures/"
#define SEED 20240607u

static char said[65536];
static char path[64]; /* of this process alone, without its ending; removed in the end */

/* ---- one file at a time ---- */

static void write_profile(const char *suffix, const void *bytes, size_t size) {
    char name[80];
    snprintf(name, sizeof name, "%s%s", path, suffix);
    FILE *file = fopen(name, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

/* Reads a file and gives its definition to `check` (may be NULL); what was said is in `said`. */
static int read_profile(const char *name, struct profile_request request,
                        void (*check)(const struct kl_profile_def *)) {
    memset(said, 0, sizeof said);
    FILE *errors = fmemopen(said, sizeof said - 1, "w");
    assert_non_null(errors);
    struct model_parts *parts = model_source_open(FOLDER "profile_formats.yaml", errors);
    assert_non_null(parts);
    struct kl_profile_def def = {0};
    request.name = name;
    parts->errors = errors;
    int status = profile_file_read(parts, "pairs[0].wheel.profile.file", &request, &def);
    if (status == 0 && check != NULL) {
        check(&def);
    }
    model_source_free(parts);
    fclose(errors);
    return status;
}

static struct profile_request wheel_request(void) {
    const struct profile_request r = {
        .wheel = true, .axes = PROFILE_AXES_OF_FILE, .from_m = -1, .to_m = 1, .deepest_m = 1};
    return r;
}

static struct profile_request column_request(void) {
    struct profile_request r = wheel_request();
    r.axes = PROFILE_INBOARD_DOWN;
    r.unit_m = 1e-3;
    return r;
}

/* The file is refused, with exactly these words behind its name. */
static void refused(const char *suffix, struct profile_request request, const char *text,
                    const char *words) {
    char expected[800];
    char name[80];
    snprintf(name, sizeof name, "%s%s", path, suffix);
    snprintf(expected, sizeof expected, "%s%s\n", name, words);
    write_profile(suffix, text, strlen(text));
    assert_int_equal(read_profile(name, request, NULL), -1);
    assert_string_equal(said, expected);
}

/* ---- the same table from every format ---- */

static struct model_file formats;

static int load_formats(void **state) {
    (void)state;
    snprintf(path, sizeof path, "/tmp/klingel_profile_%ld", (long)getpid());
    return model_file_load(&formats, FOLDER "profile_formats.yaml", NULL, stderr);
}

static int unload_formats(void **state) {
    (void)state;
    static const char *const suffixes[] = {".prw", ".prr", ".whl", ".ban", ".txt"};
    for (size_t i = 0; i < sizeof suffixes / sizeof suffixes[0]; i++) {
        char name[80];
        snprintf(name, sizeof name, "%s%s", path, suffixes[i]);
        (void)unlink(name);
    }
    model_file_free(&formats);
    return 0;
}

static void build(struct model_file *mf, struct kl_model *model) {
    assert_int_equal(model_file_build(mf, model, stderr), 0);
}

static void test_formats_agree(void **state) {
    (void)state;
    struct kl_model model;
    build(&formats, &model);
    assert_int_equal(model.n_pairs, 4);
    const struct kl_pair *a = &model.pairs[0];
    for (uint32_t p = 1; p < model.n_pairs; p++) {
        const struct kl_pair *b = &model.pairs[p];
        assert_int_equal(a->half, b->half);
        for (int s = 0; s < KL_SIDES; s++) {
            assert_int_equal(a->side[s].n_jumps, b->side[s].n_jumps);
            for (uint32_t j = 0; j < a->side[s].n_jumps; j++) {
                assert_true(fabs(a->side[s].jumps[j].w_m - b->side[s].jumps[j].w_m) < 5e-6);
            }
            for (uint32_t i = 0; i <= (uint32_t)a->tread_end[s]; i++) {
                const struct kl_row *x = &a->side[s].rows[i];
                const struct kl_row *y = &b->side[s].rows[i];
                assert_true(fabs((double)(x->height_m - y->height_m)) < 1e-10);
                assert_true(fabs((double)(x->eta_wheel_m - y->eta_wheel_m)) < 1e-6);
                assert_true(fabs((double)(x->radius_m - y->radius_m)) < 1e-8);
                assert_true(fabs((double)(x->delta_rail_rad - y->delta_rail_rad)) < 1e-6);
                assert_true(fabs((double)(x->semi_b_1 / y->semi_b_1) - 1.0) < 1e-3);
            }
        }
    }
}

static void test_fixtures_are_what_the_script_writes(void **state) {
    (void)state;
    assert_int_equal(
        system("/usr/bin/python3 -B tests/tools/fixtures/profiles/generate.py --check"), 0);
}

/* ---- places ---- */

static double first_zeta(const struct model_file *mf) {
    const struct kl_profile_def *def = &mf->vehicle.pairs[1].wheel[KL_RIGHT].profile;
    return def->zeta_m[0];
}

static void set(struct model_file *mf, const char *assignment) {
    assert_int_equal(model_file_set(mf, &assignment, 1, stderr), 0);
}

static void test_places(void **state) {
    (void)state;
    struct model_file mf;
    assert_int_equal(model_file_load(&mf, FOLDER "profile_formats.yaml", NULL, stderr), 0);
    /* 1360 mm between the flange backs, 70 mm from there to the tape circle */
    assert_true(fabs(mf.vehicle.pairs[1].wheel[KL_RIGHT].half_spacing_m - 0.75) < 1e-15);
    /* wheels of different radius, and cants that the files have already */
    assert_true(mf.vehicle.pairs[3].wheel[KL_RIGHT].radius_m == 0.46);
    assert_true(fabs(mf.vehicle.pairs[3].rail[KL_LEFT].cant_rad - atan(1.0 / 40.0)) < 1e-15);
    assert_true(fabs(first_zeta(&mf) + 0.00263567638) < 1e-9); /* S1002 at -60 mm */
    set(&mf, "pairs.simpack.wheel.tape_circle_m=0.0705");
    assert_true(fabs(mf.vehicle.pairs[1].wheel[KL_LEFT].half_spacing_m - 0.7505) < 1e-15);
    /* measured from the flange back, the tape circle's place moves along the profile */
    const struct kl_profile_def *def = &mf.vehicle.pairs[2].wheel[KL_RIGHT].profile;
    const double before = def->eta_m[0];
    assert_int_equal(model_file_set(&mf,
                                    (const char *[]){"pairs.miniprof.wheel.flange_back_m=1.362"}, 1,
                                    stderr),
                     0);
    def = &mf.vehicle.pairs[2].wheel[KL_RIGHT].profile;
    assert_true(def->eta_m[0] == before);
    assert_true(fabs(mf.vehicle.pairs[2].wheel[KL_RIGHT].half_spacing_m - 0.751) < 1e-15);
    model_file_free(&mf);
}

/* A file already canted 1:40, used at 1:40, is not turned; used upright, it is turned back. */
static void test_canted_file(void **state) {
    (void)state;
    struct model_file mf;
    assert_int_equal(model_file_load(&mf, FOLDER "profile_formats.yaml", NULL, stderr), 0);
    set(&mf, "pairs.columns.rail.profile.canted_1_in=40");
    set(&mf, "pairs.columns.rail.cant_1_in=40");
    assert_true(fabs(mf.vehicle.pairs[3].rail[KL_RIGHT].cant_rad - atan(1.0 / 40.0)) < 1e-15);
    model_file_free(&mf);
    static const char vehicle[] = "tests/tools/fixtures/profile_canted.yaml";
    assert_int_equal(model_file_load(&mf, vehicle, NULL, stderr), 0);
    assert_true(mf.vehicle.pairs[0].rail[KL_RIGHT].cant_rad == 0.0);
    assert_true(fabs(mf.vehicle.pairs[0].rail[KL_LEFT].cant_rad -
                     (atan(1.0 / 20.0) - atan(1.0 / 40.0))) < 1e-15);
    assert_true(mf.vehicle.pairs[0].wheel[KL_LEFT].radius_m == 0.459);
    assert_true(fabs(mf.vehicle.pairs[0].wheel[KL_LEFT].profile.smoothing_m - 1.5e-5) < 1e-20);
    struct kl_model model;
    build(&mf, &model);
    /* gauge measured 14 mm below the top: the wheelset's play does not know about cant */
    assert_true(fabs((double)model.pairs[0].base_m - 1.5) < 0.02);
    model_file_free(&mf);
}

/* Nothing above the two sides but what places them. */
static void test_sides_of_their_own(void **state) {
    (void)state;
    struct model_file mf;
    assert_int_equal(model_file_load(&mf, FOLDER "profile_sides.yaml", NULL, stderr), 0);
    const struct kl_pair_def *pair = &mf.vehicle.pairs[0];
    assert_true(pair->wheel[KL_RIGHT].radius_m == 0.458 && pair->wheel[KL_LEFT].radius_m == 0.457);
    assert_true(pair->wheel[KL_RIGHT].profile.smoothing_m > 0.0);
    assert_true(pair->wheel[KL_LEFT].profile.smoothing_m == 0.0);
    for (int s = 0; s < KL_SIDES; s++) {
        assert_true(fabs(pair->wheel[s].half_spacing_m - 0.75) < 1e-15);
    }
    assert_true(fabs(pair->rail[KL_RIGHT].cant_rad - atan(1.0 / 40.0)) < 1e-15);
    assert_true(fabs(pair->rail[KL_LEFT].cant_rad - (atan(1.0 / 20.0) - atan(1.0 / 40.0))) < 1e-15);
    struct kl_model model;
    build(&mf, &model);
    const struct kl_row *rows[KL_SIDES];
    for (int s = 0; s < KL_SIDES; s++) {
        rows[s] = &model.pairs[0].side[s].rows[model.pairs[0].half];
    }
    const double by_radius = (double)(rows[KL_RIGHT]->radius_m - rows[KL_LEFT]->radius_m);
    assert_true(fabs(by_radius - 1e-3) < 2e-4); /* the contacts are not at the tape circle */
    model_file_free(&mf);
}

/* A wheel's zero is its tape circle, whatever height its file gives it. */
static void is_zero_at_the_tape_circle(const struct kl_profile_def *def) {
    for (uint32_t i = 0; i < def->n_points; i++) {
        if (def->eta_m[i] == 0.0) {
            assert_true(fabs(def->zeta_m[i]) < 1e-12);
            return;
        }
    }
    fail();
}

static void test_height_of_the_tape_circle(void **state) {
    (void)state;
    static const char wheel[] =
        "-40 2.5\n-30 2\n-20 1.5\n-10 1\n0 .5\n10 0\n20 -.5\n30 -1\n40 -1.5\n";
    struct profile_request r = column_request();
    char name[80];
    snprintf(name, sizeof name, "%s.txt", path);
    write_profile(".txt", wheel, sizeof wheel - 1);
    r.axes = PROFILE_INBOARD_UP;
    assert_int_equal(read_profile(name, r, is_zero_at_the_tape_circle), 0);
}

/* ---- axes that nobody states ---- */

/* A tread of 1:20 with 28 mm of flange, 8 points, with either axis turned and moved by `shift_mm`. */
static size_t flanged(char *text, double across, double down, double shift_mm) {
    static const double points[][2] = {{-60, -3}, {-40, -2}, {-20, -1}, {0, 0},
                                       {20, 1.5}, {35, 5},   {40, 18},  {50, 28}};
    size_t used = 0;
    for (size_t i = 0; i < sizeof points / sizeof points[0]; i++) {
        used += (size_t)sprintf(text + used, "%g %g\n", across * (points[i][0] - shift_mm),
                                down * points[i][1]);
    }
    return used;
}

/* The flange is inboard and down. */
static void is_flanged(const struct kl_profile_def *def) {
    assert_int_equal(def->n_points, 8);
    assert_true(fabs(def->eta_m[0] + 0.06) < 1e-12 && fabs(def->eta_m[7] - 0.05) < 1e-12);
    assert_true(fabs(def->zeta_m[7] - 0.028) < 1e-12);
}

static void test_flange_tells_the_axes(void **state) {
    (void)state;
    char text[400];
    char name[80];
    snprintf(name, sizeof name, "%s.whl", path);
    for (int turn = 0; turn < 8; turn++) {
        const double across = turn & 1 ? -1.0 : 1.0;
        const double down = turn & 2 ? -1.0 : 1.0;
        struct profile_request r = wheel_request();
        r.flange_m = turn & 4 ? 0.07 : 0.0; /* measured from the flange back */
        const size_t size = flanged(text, across, down, 1e3 * r.flange_m);
        write_profile(".whl", text, size);
        assert_int_equal(read_profile(name, r, is_flanged), 0);
        r.axes = across > 0.0 ? (down > 0.0 ? PROFILE_INBOARD_DOWN : PROFILE_INBOARD_UP)
                              : (down > 0.0 ? PROFILE_OUTBOARD_DOWN : PROFILE_OUTBOARD_UP);
        assert_int_equal(read_profile(name, r, is_flanged), 0); /* as stated */
        r.axes = across < 0.0 ? PROFILE_INBOARD_DOWN : PROFILE_OUTBOARD_UP;
        assert_int_equal(read_profile(name, r, NULL), -1); /* stated wrongly */
    }
}

/* Nothing tells on which side the gauge corner is. */
static void test_rails_need_axes(void **state) {
    (void)state;
    struct profile_request r = wheel_request();
    r.wheel = false;
    refused(
        ".ban", r, "-30 3\n-20 1\n-10 .2\n0 0\n10 .2\n20 1\n30 3\n33 5\n",
        ": needs axes: inboard_down or outboard_down; the points do not tell the gauge corner's "
        "side");
    refused(
        ".ban", r, "-30 -3\n-20 -1\n-10 -.2\n0 0\n10 -.2\n20 -1\n30 -3\n33 -5\n",
        ": needs axes: inboard_up or outboard_up; the points do not tell the gauge corner's side");
}

/* ---- what bad files are told ---- */

#define WHEEL_ROWS "-40 -2\n-30 -1.5\n-20 -1\n-10 -.5\n0 0\n10 .5\n20 1\n30 2\n"

static void test_bad_columns(void **state) {
    (void)state;
    const struct profile_request r = column_request();
    refused(".txt", r, "", ": the file holds no points");
    refused(".txt", r, "# nothing\n", ": the file holds no points");
    refused(".txt", r, "1 2\n3 x\n", ":2: x: must be a finite number");
    refused(".txt", r, "1 nan\n", ":1: nan: must be a finite number");
    refused(".txt", r, "1 1e999\n", ":1: 1e999: must be a finite number");
    refused(".txt", r, "1 0x10\n", ":1: 0x10: must be a finite number");
    refused(".txt", r, "1\n", ":1: 1 numbers, must be 2");
    refused(".txt", r, "1 2 3\n", ":1: more than 2 numbers: 3");
    refused(".txt", r, "1 2000\n", ":1: the point is 1 mm, 2000 mm off, must be below 1 m");
    refused(".txt", r, "1 2\n2 3\n",
            ": 2 points within from_mm, to_mm and deepest_mm, must be 8 to 4096");
    refused(
        ".txt", r, WHEEL_ROWS "25 3\n",
        ":9: eta = 25.000000 mm behind 30.000000 mm: must grow from point to point; cut off what "
        "lies behind with from_mm, to_mm or deepest_mm");
    refused(
        ".txt", r, WHEEL_ROWS "30.01 4\n",
        ":9: steeper than 89.4 degrees at eta = 30.010000 mm: cut it off with from_mm, to_mm or "
        "deepest_mm");
    struct profile_request cut = r;
    cut.to_m = -0.005;
    refused(".txt", cut, WHEEL_ROWS,
            ":5: from_mm, to_mm and deepest_mm cut off the tape circle (eta 0.000 mm)");
    struct profile_request up = r;
    up.axes = PROFILE_INBOARD_UP;
    refused(
        ".txt", up, WHEEL_ROWS "35 20\n",
        ":9: the wheel's flange must be inboard and down, but eta = 35.000 mm is -20.000 mm below "
        "the tape circle: are the axes right?");
    struct profile_request rail = r;
    rail.wheel = false;
    refused(".txt", rail, WHEEL_ROWS,
            ":1: the rail is highest at an end (eta -40.000 mm): are the axes right?");
    struct profile_request aside = r;
    aside.flange_m = 0.07;
    refused(".txt", aside, WHEEL_ROWS,
            ": eta = 30.000 to 100.000 mm: must reach over the tape circle, 0");
}

#define HEAD "header.begin\nversion = 1\ntype = 1\nheader.end\nspline.begin\n"
#define POINTS "point.begin\n40 -2\n30 -1.5\n20 -1\n10 -.5\n0 0\n-10 .5\n-20 1\n-30 2\npoint.end\n"
#define MM "units.len.f = 1e3\n"

static void test_bad_simpack(void **state) {
    (void)state;
    const struct profile_request r = wheel_request();
    refused(".prw", r, "", ":1: the file ends before point.end");
    refused(".prw", r, HEAD MM, ":7: the file ends before spline.end");
    refused(".prw", r, HEAD MM "point.begin\n1 2\n", ":9: the file ends before point.end");
    refused(".prw", r, "point.begin\n", ":1: point.begin does not belong here");
    refused(".prw", r, HEAD "header.end\n", ":6: header.end without header.begin");
    refused(".prw", r, HEAD MM POINTS POINTS "spline.end\n",
            ":17: point.begin does not belong here");
    refused(".prw", r, HEAD "stretch = 2\n",
            ":6: stretch: unknown key; known here: approx.smooth, file, file.mtime, comment, type, "
            "point.dist.min, shift.y, shift.z, rotate, bound.y.min, bound.y.max, bound.z.min, "
            "bound.z.max, mirror.y, mirror.z, inversion, units.len, units.ang, units.len.f, "
            "units.ang.f");
    refused(".prw", r, HEAD "mirror.y = 2\n", ":6: mirror.y = 2: must be 0 or 1");
    refused(".prw", r, HEAD "shift.y = inf\n", ":6: shift.y = inf: must be a finite number");
    refused(".prw", r, HEAD "shift.y\n",
            ":6: shift.y: must be key = value, or begin or end a section");
    refused(".prw", r, HEAD "shift.y = 1\nshift.y = 1\n", ":7: shift.y stands here a second time");
    refused(".prw", r, HEAD POINTS "spline.end\n",
            ": units.len.f = 0: must be 1e-3 to 1e6 units to the metre");
    refused(".prw", r, HEAD "units.len = 'ell'\n" POINTS "spline.end\n",
            ": units.len = ell: must be m, cm, mm or in");
    refused(".prw", r, HEAD MM "units.len = 'm'\n" POINTS "spline.end\n",
            ": units.len = m and units.len.f = 1000 disagree");
    refused(".prw", r, HEAD MM "rotate = 0.1\n" POINTS "spline.end\n",
            ": rotate = 0.1: must be 0; a rail is inclined by cant_1_in");
    refused(".prw", r, HEAD MM "approx.smooth = 1e-3\n" POINTS "spline.end\n",
            ": approx.smooth = 0.001: must be 0, or the model must state smoothing_mm");
    refused(".prw", r, HEAD MM "point.dist.min = -1\n" POINTS "spline.end\n",
            ": point.dist.min = -1: must be >= 0");
    refused(".prw", r, HEAD MM "point.begin\n1 2 0.5\n", ":8: weight 0.5: must be 1");
    refused(".prw", r, HEAD MM "point.begin\n1 2 1 1\n", ":8: more than 3 numbers: 1");
    struct profile_request rail = r;
    rail.wheel = false;
    refused(".prr", rail, HEAD MM POINTS "spline.end\n", ": type = 1: must be 0, a rail");
}

static void test_bad_miniprof(void **state) {
    (void)state;
    struct profile_request r = wheel_request();
    r.axes = PROFILE_INBOARD_DOWN;
    refused(".whl", r, "ColumnDef=X,Z\n",
            ":1: ColumnDef, Z: must be X and Y once, and A, C, N, K, at "
            "most 8");
    refused(".whl", r, "ColumnDef=X,Y,X\n",
            ":1: ColumnDef, X: must be X and Y once, and A, C, N, K, "
            "at most 8");
    refused(".whl", r, "ColumnDef=X,A\n", ":1: ColumnDef must name X and Y");
    refused(".whl", r, "ColumnDef=X,Y,A\n\n1 2\n", ":3: 2 numbers, must be 3");
    refused(".whl", r, "XOffset=one\n", ":1: XOffset = one: must be a finite number");
    refused(".whl", r, "\n1 2 3\n", ":2: more than 2 numbers: 3");
    refused(".whl", r, "\n1 2\nCar=7\n", ":3: Car=7: a key behind the points");
    refused(".whl", r, "XYPoints=9\n\n" WHEEL_ROWS, ":11: 8 points, must be XYPoints = 9");
}

static void test_wrong_requests(void **state) {
    (void)state;
    struct profile_request r = wheel_request();
    write_profile(".whl", WHEEL_ROWS, strlen(WHEEL_ROWS));
    char name[80];
    snprintf(name, sizeof name, "%s.whl", path);
    assert_int_equal(read_profile(name, r, NULL), -1);
    assert_non_null(strstr(
        said, "needs axes: inboard_down, inboard_up, outboard_down or outboard_up; no flange "
              "more than 8 mm below the tape circle tells which"));
    r.axes = PROFILE_INBOARD_DOWN;
    r.unit_m = 1.0;
    assert_int_equal(read_profile(name, r, NULL), -1);
    assert_non_null(strstr(said, "has its own units"));
    r.unit_m = 0.0;
    r.wheel = false;
    assert_int_equal(read_profile(name, r, NULL), -1);
    assert_non_null(strstr(said, "is a wheel profile, must be of a rail"));
    assert_int_equal(read_profile("nowhere.txt", column_request(), NULL), -1);
    assert_non_null(strstr(said, FOLDER "nowhere.txt: cannot open"));
    assert_int_equal(read_profile("../fixtures", column_request(), NULL), -1);
    assert_non_null(strstr(said, "cannot read: Is a directory"));
}

/* ---- damage ---- */

static uint32_t next_random(uint32_t *x) {
    *x ^= *x << 13;
    *x ^= *x >> 17;
    *x ^= *x << 5;
    return *x;
}

/* What comes through is sound: finite, and the core has built it already. */
static void is_sound(const struct kl_profile_def *def) {
    assert_true(def->n_points >= KL_PROFILE_MIN_POINTS && def->n_points <= KL_PROFILE_MAX_POINTS);
    for (uint32_t i = 0; i < def->n_points; i++) {
        assert_true(fabs(def->eta_m[i]) < 1.1 && fabs(def->zeta_m[i]) < 2.1);
    }
}

static void try_damaged(const char *suffix, struct profile_request r, const char *bytes,
                        size_t size) {
    char name[80];
    snprintf(name, sizeof name, "%s%s", path, suffix);
    write_profile(suffix, bytes, size);
    const int status = read_profile(name, r, is_sound);
    assert_true(status == 0 ? said[0] == '\0' : strstr(said, name) != NULL);
}

static void damage(const char *file, const char *suffix, struct profile_request r) {
    static const char salt[] = " \t\n\r,;=!'.eE+-0123456789nxybdgi#";
    char name[80];
    snprintf(name, sizeof name, FOLDER "profiles/%s", file);
    FILE *in = fopen(name, "rb");
    assert_non_null(in);
    static char good[65536];
    static char spoilt[2 * sizeof good];
    const size_t size = fread(good, 1, sizeof good, in);
    fclose(in);
    uint32_t random = SEED;
    for (size_t cut = 0; cut < size; cut += 1 + size / 150) {
        try_damaged(suffix, r, good, cut);
    }
    for (int round = 0; round < 400; round++) {
        memcpy(spoilt, good, size);
        for (uint32_t k = 1 + next_random(&random) % 6; k > 0; k--) {
            const uint32_t bits = next_random(&random);
            const size_t at = next_random(&random) % (round % 2 == 0 ? 700 : size);
            spoilt[at] = round % 8 == 0 ? (char)(bits & 0xffu) : salt[bits % (sizeof salt - 1)];
        }
        try_damaged(suffix, r, spoilt, size);
    }
    for (int round = 0; round < 60; round++) { /* a piece of it twice, somewhere else */
        const size_t from = next_random(&random) % size;
        const size_t length = next_random(&random) % (size - from);
        const size_t at = next_random(&random) % size;
        memcpy(spoilt, good, at);
        memcpy(spoilt + at, good + from, length);
        memcpy(spoilt + at + length, good + at, size - at);
        try_damaged(suffix, r, spoilt, size + length);
    }
}

static void test_damaged_files(void **state) {
    (void)state;
    struct profile_request wheel = wheel_request();
    struct profile_request rail = wheel_request();
    rail.wheel = false;
    damage("s1002.prw", ".prw", wheel);
    damage("uic60.prr", ".prr", rail);
    wheel.axes = PROFILE_OUTBOARD_UP;
    wheel.flange_m = 0.07;
    damage("s1002.whl", ".whl", wheel);
    rail.axes = PROFILE_INBOARD_UP;
    rail.smoothing_m = 1e-5;
    damage("uic60.ban", ".ban", rail);
    struct profile_request columns = column_request();
    columns.axes = PROFILE_OUTBOARD_DOWN;
    columns.to_m = 0.0497;
    damage("s1002.txt", ".txt", columns);
}

static void test_huge_files(void **state) {
    (void)state;
    const size_t size = 9u << 20;
    char *text = malloc(size);
    assert_non_null(text);
    for (size_t i = 0; i < size; i++) {
        text[i] = "1 2\n"[i % 4];
    }
    write_profile(".txt", text, size);
    char name[80];
    snprintf(name, sizeof name, "%s.txt", path);
    assert_int_equal(read_profile(name, column_request(), NULL), -1);
    assert_non_null(strstr(said, "larger than 8388608 bytes"));
    for (size_t i = 0; i + 1 < size; i++) {
        text[i] = '7'; /* one line, one number */
    }
    write_profile(".txt", text, 4u << 20);
    assert_int_equal(read_profile(name, column_request(), NULL), -1);
    assert_non_null(strstr(said, "must be a finite number"));
    size_t used = 0;
    for (int i = 0; i < 100000; i++) {
        used += (size_t)sprintf(text + used, "%.5f %.5f\n", -40.0 + 0.0009 * i, -2.0 + 4e-5 * i);
    }
    write_profile(".txt", text, used);
    assert_int_equal(read_profile(name, column_request(), NULL), -1);
    assert_non_null(strstr(said, "points within from_mm, to_mm and deepest_mm, must be 8 to 4096"));
    free(text);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_formats_agree),
        cmocka_unit_test(test_fixtures_are_what_the_script_writes),
        cmocka_unit_test(test_places),
        cmocka_unit_test(test_canted_file),
        cmocka_unit_test(test_sides_of_their_own),
        cmocka_unit_test(test_height_of_the_tape_circle),
        cmocka_unit_test(test_flange_tells_the_axes),
        cmocka_unit_test(test_rails_need_axes),
        cmocka_unit_test(test_bad_columns),
        cmocka_unit_test(test_bad_simpack),
        cmocka_unit_test(test_bad_miniprof),
        cmocka_unit_test(test_wrong_requests),
        cmocka_unit_test(test_damaged_files),
        cmocka_unit_test(test_huge_files),
    };
    printf("seed of the damage: %u\n", SEED);
    return cmocka_run_group_tests(tests, load_formats, unload_formats);
}
