/* cmd_modes.c - klingel modes: eigenvalues about a steady state, and critical speeds. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli_plot.h"
#include "cli_progress.h"
#include "modes_critical.h"
#include "modes_plot.h"

#define TWO_PI 6.283185307179586
#define MOST_SPEEDS 100000.0
#define DRAWN_SHAPES 4   /* if --plot alone asks for them */
#define SENSITIVE 1e-4   /* relative change of an eigenvalue that is worth a warning */
#define LOWEST_SPEED 0.1 /* m/s; below, creepages no longer divide by V */

struct range {
    double low;
    double high;
    double step;
};

struct arguments {
    double speed_m_s;
    const char *speeds;
    const char *critical;
    double at_m;
    uint64_t shapes;
    const char *csv;
    const char *plot;
    struct cli_target target;
};

struct job {
    const struct kl_model *model;
    struct modes_names names;
    double at_m;
    uint32_t shapes; /* to be printed */
    FILE *csv;
    bool text;
    bool warned;
    bool jump_warned;
    struct modes modes; /* large */
    struct modes_tracks tracks;
    uint32_t track[KL_MAX_STATES]; /* of each of the modes */
};

/* ---- ranges ---- */

/* "A:B" or "A:B:STEP", each a speed. */
static int parse_range(const char *option, const char *text, struct range *range) {
    char part[64];
    char why[160];
    double *const value[] = {&range->low, &range->high, &range->step};
    const char *at = text;
    size_t n = 0;
    size_t wanted = isnan(range->step) ? 3 : 2;
    for (; n < wanted && at != NULL; n++) {
        snprintf(part, sizeof part, "%.*s", (int)strcspn(at, ":"), at);
        if (!cli_quantity(part, "m/s", value[n], why, sizeof why)) {
            return cli_misuse("%s %s: '%s' %s", option, text, part, why);
        }
        at = strchr(at, ':');
        at = at != NULL ? at + 1 : NULL;
    }
    if (n != wanted || at != NULL) {
        return cli_misuse("%s %s: must be %s, speeds in m/s", option, text,
                          wanted == 3 ? "A:B:STEP" : "LOW:HIGH");
    }
    if (!(range->low >= LOWEST_SPEED && range->low <= range->high &&
          range->high <= KL_MAX_SPEED_M_S)) {
        return cli_misuse("%s %s: speeds must rise within %g..%g m/s", option, text, LOWEST_SPEED,
                          KL_MAX_SPEED_M_S);
    }
    if (!(range->step > 0.0 && (range->high - range->low) / range->step <= MOST_SPEEDS)) {
        return cli_misuse("%s %s: the step must be positive, and the speeds at most %.0f", option,
                          text, MOST_SPEEDS);
    }
    return CLI_OK;
}

/* ---- one speed ---- */

static int find(struct job *job, double speed_m_s, bool parts) {
    const struct modes_request request = {.model = job->model,
                                          .names = &job->names,
                                          .speed_m_s = speed_m_s,
                                          .at_m = job->at_m,
                                          .parts = parts,
                                          .check = parts};
    int status = modes_find(&request, &job->modes);
    if (status == CLI_OK && parts && job->modes.insensitivity > SENSITIVE && !job->warned) {
        job->warned = true;
        cli_warn("at %g m/s eigenvalues change by %.1e if the differences are taken wider: the "
                 "model is not smooth there",
                 speed_m_s, job->modes.insensitivity);
    }
    return status;
}

/* The table bridges a jump within one of its steps, steeply: modes there are those of the bridge.
 */
static void warn_of_jumps(struct job *job, double speed_m_s) {
    static const char *const side_name[KL_SIDES] = {"right", "left"};
    for (uint32_t w = 0; w < job->model->n_wheelsets && !job->jump_warned; w++) {
        const struct kl_pair *pair = &job->model->pairs[job->model->wheelsets[w].pair];
        for (int s = 0; s < KL_SIDES; s++) {
            const struct kl_side_table *table = &pair->side[s];
            double y = (double)job->modes.output.wheelset[w].y_m;
            double outboard = s == KL_RIGHT ? y : -y;
            for (uint32_t i = 0; i < table->n_jumps && i < KL_MAX_JUMPS; i++) {
                if (fabs(outboard - table->jumps[i].w_m) < (double)pair->step_m) {
                    job->jump_warned = true;
                    cli_warn("at %g m/s %s stands at y = %.3f mm, where the contact of its %s "
                             "wheel jumps: these modes hold for motions of less than %g mm",
                             speed_m_s, job->model->wheelsets[w].name, 1e3 * y, side_name[s],
                             1e3 * (double)pair->step_m);
                }
            }
        }
    }
}

static double damping_ratio(const struct mode *mode) {
    double size = hypot(mode->real, mode->imag);
    return size > 0.0 ? -mode->real / size : 0.0;
}

static void parts_text(const struct job *job, const struct mode *mode, char *text, size_t size) {
    text[0] = '\0';
    for (uint32_t i = 0; i < mode->n_parts; i++) {
        size_t at = strlen(text);
        double degrees = remainder(mode->part[i].phase_rad, TWO_PI) * 360.0 / TWO_PI;
        snprintf(text + at, size - at, "%s%s %.0f%%", i == 0 ? "" : "  ",
                 job->names.freedom[mode->part[i].freedom].name, 100.0 * mode->part[i].share);
        at = strlen(text);
        if (i > 0 && mode->imag > 0.0) {
            snprintf(text + at, size - at, " (%+.0f deg)", degrees);
        }
    }
}

static void csv_header(FILE *csv) {
    fprintf(csv, "speed_m_s,mode,real_1_s,imag_rad_s,frequency_Hz,damping_ratio,dominant,share,"
                 "second,second_share,third,third_share,track,name\n");
}

static void csv_modes(const struct job *job, double speed_m_s) {
    for (uint32_t i = 0; i < job->modes.n_modes; i++) {
        const struct mode *mode = &job->modes.mode[i];
        fprintf(job->csv, "%.12g,%u,%.12g,%.12g,%.12g,%.12g", speed_m_s, i + 1, mode->real,
                mode->imag, mode->imag / TWO_PI, damping_ratio(mode));
        for (uint32_t k = 0; k < 3; k++) {
            if (k < mode->n_parts) {
                fprintf(job->csv, ",%s,%.4g", job->names.freedom[mode->part[k].freedom].name,
                        mode->part[k].share);
            } else {
                fprintf(job->csv, ",,");
            }
        }
        const uint32_t t = job->track[i];
        fprintf(job->csv, ",%u,\"%s\"\n", t + 1,
                t < job->tracks.n ? job->tracks.track[t].name : "");
    }
}

static void print_state(const struct job *job) {
    const struct kl_output *o = &job->modes.output;
    if (o->track.curvature_1_m == (kl_real)0 && o->track.cant_rad == (kl_real)0) {
        return;
    }
    printf("  steady state in curvature %g 1/m, cant %g mrad:", (double)o->track.curvature_1_m,
           1e3 * (double)o->track.cant_rad);
    for (uint32_t w = 0; w < job->model->n_wheelsets; w++) {
        printf(" %s y %.4f mm, yaw %.4f mrad;", job->model->wheelsets[w].name,
               1e3 * (double)o->wheelset[w].y_m, 1e3 * (double)o->wheelset[w].yaw_rad);
    }
    printf("\n");
}

static void print_modes(const struct job *job, double speed_m_s) {
    printf("V = %g m/s (%.1f km/h): %s\n", speed_m_s, 3.6 * speed_m_s,
           job->modes.largest_real < 0.0 ? "stable" : "UNSTABLE");
    print_state(job);
    printf("  %12s %12s %10s %9s  %s\n", "real 1/s", "imag rad/s", "freq. Hz", "damping",
           "freedoms by kinetic energy");
    for (uint32_t i = 0; i < job->modes.n_modes; i++) {
        const struct mode *mode = &job->modes.mode[i];
        char text[200];
        parts_text(job, mode, text, sizeof text);
        printf("  %12.6g %12.6g %10.5g %9.4f  %s\n", mode->real, mode->imag, mode->imag / TWO_PI,
               damping_ratio(mode), text);
    }
    if (job->modes.n_neutral > 0) {
        printf("  neutral (below %g rad/s) and left out of the verdict: %u\n", MODES_NEUTRAL,
               job->modes.n_neutral);
    }
    uint32_t chosen[MODES_MAX_SHAPES];
    uint32_t n = modes_choose(&job->modes, job->shapes, chosen);
    modes_print_shapes(&job->names, &job->modes, chosen, n);
}

/* A speed without a steady state is said, and the others are shown all the same. */
static int show_speeds(struct job *job, const struct range *range) {
    double count = floor((range->high - range->low) / range->step * (1.0 + 1e-12) + 1e-9);
    int status = CLI_OK;
    struct cli_progress progress;
    cli_progress_begin(&progress);
    for (double i = 0.0; i <= count; i += 1.0) {
        double speed = fmin(range->low + i * range->step, range->high);
        if (find(job, speed, true) != CLI_OK) {
            status = CLI_FAILED;
            continue;
        }
        warn_of_jumps(job, speed);
        int tracked = modes_tracks_add(&job->tracks, &job->modes, speed, job->track);
        status = status == CLI_OK ? tracked : status;
        if (job->text) {
            print_modes(job, speed);
        } else {
            cli_progress_show(&progress, (i + 1.0) / (count + 1.0), "modes");
        }
        if (job->csv != NULL) {
            csv_modes(job, speed);
        }
    }
    cli_progress_end(&progress);
    return status;
}

/* ---- critical speeds ---- */

static int show_crossing(struct job *job, const struct modes_crossing *crossing) {
    int status = find(job, crossing->speed_m_s, true);
    if (status != CLI_OK) {
        return status;
    }
    const struct mode *mode = modes_least_stable(&job->modes);
    if (job->text) {
        char text[200];
        parts_text(job, mode, text, sizeof text);
        printf("%12.6f m/s (%.3f km/h): %s at %.5g Hz, %s\n", crossing->speed_m_s,
               3.6 * crossing->speed_m_s,
               crossing->stable_below ? "becomes unstable" : "becomes stable", mode->imag / TWO_PI,
               text);
    }
    if (job->csv != NULL) {
        fprintf(job->csv, "%.12g,%s,%.12g,%s\n", crossing->speed_m_s,
                crossing->stable_below ? "unstable" : "stable", mode->imag / TWO_PI,
                job->names.freedom[mode->part[0].freedom].name);
    }
    return CLI_OK;
}

static int show_critical(struct job *job, const struct range *range) {
    struct modes_scan scan = {.model = job->model,
                              .names = &job->names,
                              .at_m = job->at_m,
                              .low_m_s = range->low,
                              .high_m_s = range->high,
                              .work = &job->modes};
    int status = modes_scan(&scan);
    if (status != CLI_OK) {
        return status;
    }
    if (job->text) {
        printf("critical speeds from %g to %g m/s (%s at %g m/s)\n", range->low, range->high,
               scan.stable_at_low ? "stable" : "unstable", range->low);
    }
    for (size_t i = 0; i < scan.n && status == CLI_OK; i++) {
        status = show_crossing(job, &scan.crossing[i]);
    }
    if (status == CLI_OK && scan.n == 0 && job->text) {
        printf("  none\n");
    }
    return status;
}

/* ---- the command ---- */

static int draw(struct job *job, const struct kl_vehicle_def *vehicle, const struct arguments *a) {
    uint32_t chosen[MODES_MAX_SHAPES];
    if (a->speeds != NULL) {
        return modes_plot_locus(a->plot, job->model, &job->tracks);
    }
    const uint32_t most = job->shapes > 0 ? job->shapes : DRAWN_SHAPES;
    const struct modes_shapes shapes = {.model = job->model,
                                        .vehicle = vehicle,
                                        .names = &job->names,
                                        .modes = &job->modes,
                                        .chosen = chosen,
                                        .n = modes_choose(&job->modes, most, chosen),
                                        .speed_m_s = a->speed_m_s};
    return modes_plot_shapes(a->plot, &shapes);
}

static int perform(struct job *job, const struct kl_vehicle_def *vehicle,
                   const struct arguments *a) {
    struct range speeds = {a->speed_m_s, a->speed_m_s, 1.0};
    struct range critical = {1.0, KL_MAX_SPEED_M_S, MODES_SCAN_STEP};
    struct cli_output csv = {0};
    int status = CLI_OK;
    if (a->speeds != NULL) {
        speeds.step = CLI_NOT_GIVEN;
        status = parse_range("--speeds", a->speeds, &speeds);
    }
    if (status == CLI_OK && a->critical != NULL && !cli_is_stdout(a->critical)) {
        status = parse_range("--critical", a->critical, &critical);
    }
    if (status == CLI_OK && a->csv != NULL) {
        status = cli_output_open(&csv, a->csv);
    }
    if (status != CLI_OK) {
        return status;
    }
    job->csv = csv.file;
    job->text = !cli_is_stdout(a->csv);
    job->shapes = (uint32_t)a->shapes;
    modes_name(job->model, &job->names);
    status = modes_tracks_begin(&job->tracks, &job->names);
    const bool modes = a->critical == NULL || a->speeds != NULL || !isnan(a->speed_m_s);
    if (modes && status == CLI_OK) {
        if (job->csv != NULL) {
            csv_header(job->csv);
        }
        status = show_speeds(job, &speeds);
        job->csv = NULL; /* holds one kind of table */
        if (a->plot != NULL && job->tracks.any) {
            int drawn = draw(job, vehicle, a);
            status = status == CLI_OK ? drawn : status;
        }
    }
    if (a->critical != NULL && job->tracks.last != NULL) {
        if (job->csv != NULL) {
            fprintf(job->csv, "critical_speed_m_s,becomes,frequency_Hz,dominant\n");
        }
        int shown = show_critical(job, &critical);
        status = status == CLI_OK ? shown : status;
    }
    modes_tracks_free(&job->tracks);
    /* modes that were found are kept; a list of critical speeds is whole or useless */
    int written = cli_output_close(&csv, modes ? CLI_OK : status);
    status = status == CLI_OK ? written : status;
    return cli_flush(status);
}

/* The model on smooth track: a mode knows no irregularities. */
static int open_smooth(struct cli_model *m, const struct arguments *a) {
    int status = cli_model_load(m, &a->target);
    if (status == CLI_OK) {
        m->file.track.irregularity.n_samples = 0;
        status = cli_model_build(m);
    }
    return status;
}

static int check(const struct arguments *a) {
    const bool modes = a->speeds != NULL || !isnan(a->speed_m_s);
    if (!modes && a->critical == NULL) {
        return cli_misuse("one of --speed, --speeds and --critical is needed");
    }
    if (a->speeds != NULL && !isnan(a->speed_m_s)) {
        return cli_misuse("--speed and --speeds exclude each other");
    }
    if (a->shapes > 0 && isnan(a->speed_m_s)) {
        return cli_misuse("--shapes needs --speed: shapes are those of one speed");
    }
    if (a->plot != NULL && !modes) {
        return cli_misuse("--plot needs --speeds (root locus) or --speed (shapes)");
    }
    if (a->plot != NULL && cli_is_stdout(a->plot) && cli_is_stdout(a->csv)) {
        return cli_misuse("--csv and --plot cannot both go to standard output");
    }
    if (modes && a->critical != NULL && cli_is_stdout(a->csv)) {
        return cli_misuse("--csv to standard output holds modes or critical speeds, not both");
    }
    return CLI_OK;
}

int cmd_modes(int argc, char **argv) {
    struct arguments a = {.speed_m_s = CLI_NOT_GIVEN};
    int status = CLI_OK;
    const struct cli_option options[] = {
        cli_speed_option("--speed", &a.speed_m_s, LOWEST_SPEED,
                         "modes at one speed, m/s or with a unit (72km/h); 0.1..150 m/s"),
        {.name = "--speeds",
         .argument = "A:B:STEP",
         .kind = CLI_TEXT,
         .value = &a.speeds,
         .help = "modes at speeds from A to B, m/s or with units"},
        {.name = "--critical",
         .argument = "LOW:HIGH",
         .kind = CLI_MAYBE,
         .value = &a.critical,
         .help = "every speed at which stability changes, to 1e-6 m/s: looked for in\n"
                 "steps of 0.5 m/s, then bisected; default 1:150 m/s"},
        {.name = "--shapes",
         .argument = "N",
         .kind = CLI_COUNT,
         .value = &a.shapes,
         .low = 1,
         .high = MODES_MAX_SHAPES,
         .help = "with --speed: the shapes of the N least damped modes that swing, every\n"
                 "freedom with amplitude and phase; 1..12"},
        cli_plot_option(&a.plot,
                        "with --speeds: root locus, frequency and damping over the speed; with\n"
                        "--speed: shapes (4, or as many as --shapes says). .png, .pdf or .svg"),
        cli_place_option("--at", &a.at_m,
                         "where on the track, m; default 0. The whole vehicle should stand on\n"
                         "one curvature there"),
        cli_maybe_file_option("--csv", &a.csv,
                              "the modes as CSV (with --critical alone: the critical speeds);\n"
                              "without FILE, or with -, to standard output in place of the text"),
    };
    const struct cli_command command = {
        .takes_track = true,
        .purpose =
            "Eigenvalues of a vehicle about its steady state: straight track (default) or where\n"
            "--at says on TRACK; irregularities are left out. Prints frequency, damping ratio\n"
            "(negative: unstable) and the freedoms that hold most of the kinetic energy, with\n"
            "their phases. The model is linearised by central differences of its equations; a\n"
            "warning tells where the result depends on how wide these are. Stability is that of\n"
            "the largest real part; eigenvalues below 0.001 rad/s count as neutral (a freedom\n"
            "that nothing holds) and do not enter. Over a range of speeds each mode is followed "
            "and\n"
            "keeps its number and name (CSV columns track and name).",
        .example = "klingel modes models/restrained_wheelset.yaml --critical\n"
                   "klingel modes models/two_axle_wagon.yaml --speeds 10:60:10 --csv modes.csv\n"
                   "klingel modes models/two_axle_wagon.yaml --speeds 5:60:1 --plot locus.png\n"
                   "klingel modes models/two_axle_wagon.yaml --speed 30 --shapes 3 --plot s.png\n",
        .options = options,
        .n_options = sizeof options / sizeof options[0]};
    if (!cli_parse(&command, argc, argv, &a.target, &status) || (status = check(&a)) != CLI_OK) {
        return status;
    }
    struct cli_model m;
    status = open_smooth(&m, &a);
    if (status != CLI_OK) {
        return status;
    }
    struct job *job = calloc(1, sizeof *job);
    if (job == NULL) {
        status = cli_fail("out of memory");
    } else {
        job->model = &m.model;
        job->at_m = a.at_m;
        status = perform(job, &m.file.vehicle, &a);
    }
    free(job);
    cli_model_close(&m);
    return status;
}
