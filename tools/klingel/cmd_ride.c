/* cmd_ride.c - klingel ride: the response to irregularities, as it is assessed. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli_plot.h"
#include "ride_report.h"

#define SETTLE_S 3.0 /* left out of the assessment, if nobody says otherwise */

struct arguments {
    double speed_m_s;
    double from_m;
    double to_m;
    double assess_from_m;
    double section_m;
    double floor_m;
    double step_s;
    const char *csv;
    const char *series;
    const char *plot;
    struct cli_target target;
};

/* The end of the track: of its layout, or of its irregularities. */
static double track_end(const struct model_file *file) {
    const struct kl_irregularity_def *rough = &file->track.irregularity;
    const double end = rough->n_samples > 0
                           ? rough->start_m + rough->step_m * (double)(rough->n_samples - 1)
                           : 0.0;
    return fmax(file->track_length_m, end);
}

/* The leading wheelset shall not leave what the file describes. */
static int choose_run(const struct cli_model *m, const struct arguments *a, struct ride_run *run) {
    double lead = 0.0;
    for (uint32_t w = 0; w < m->model.n_wheelsets; w++) {
        lead = fmax(lead, (double)m->model.wheelsets[w].x_m);
    }
    run->from_m = a->from_m;
    run->to_m = isnan(a->to_m) ? track_end(&m->file) - lead : a->to_m;
    run->assess_from_m =
        isnan(a->assess_from_m) ? a->from_m + SETTLE_S * a->speed_m_s : a->assess_from_m;
    if (!(run->to_m > run->assess_from_m && run->assess_from_m >= run->from_m)) {
        return cli_misuse("nothing to assess: the run goes from %g to %g m and is assessed from %g "
                          "m on; see --from, --to and --assess-from",
                          run->from_m, run->to_m, run->assess_from_m);
    }
    return CLI_OK;
}

static int write_file(const char *path, const struct ride_result *result, bool series) {
    struct cli_output out = {0};
    int status = cli_output_open(&out, path);
    if (status == CLI_OK && series) {
        ride_series(out.file, result->record);
    } else if (status == CLI_OK) {
        ride_csv(out.file, result);
    }
    return cli_output_close(&out, status);
}

static int show(const struct cli_model *m, const struct arguments *a,
                const struct ride_result *result) {
    int status = CLI_OK;
    if (!cli_is_stdout(a->csv)) {
        ride_print(result);
    }
    if (a->csv != NULL) {
        status = write_file(a->csv, result, false);
    }
    if (status == CLI_OK && a->plot != NULL) {
        status = ride_plot(a->plot, result, m->file.track_name);
    }
    return cli_flush(status);
}

static int perform(const struct cli_model *m, const struct arguments *a) {
    struct ride_run run = {0};
    struct cli_progress progress;
    static struct ride_record record; /* large */
    int status = choose_run(m, a, &run);
    struct ride_result *result = calloc(1, sizeof *result);
    if (status == CLI_OK && result == NULL) {
        status = cli_fail("out of memory");
    }
    if (status == CLI_OK) {
        cli_progress_begin(&progress);
        run.progress = &progress;
        record.model = &m->model;
        record.speed_m_s = a->speed_m_s;
        ride_points(&record, a->floor_m);
        result->record = &record;
        result->section_m = a->section_m;
        status = ride_simulate(&record, &run);
        cli_progress_end(&progress);
    }
    if (status == CLI_OK && a->series != NULL) {
        status = write_file(a->series, result, true); /* before filters change the forces */
    }
    status = status == CLI_OK ? ride_assess(result) : status;
    status = status == CLI_OK ? show(m, a, result) : status;
    ride_free(&record);
    free(result);
    return status;
}

static int check(const struct arguments *a) {
    if (isnan(a->speed_m_s)) {
        return cli_misuse("--speed V is missing");
    }
    if (a->target.track == NULL) {
        return cli_misuse(
            "TRACK is missing: without irregularities there is nothing to respond to");
    }
    const int to_stdout = cli_is_stdout(a->csv) + cli_is_stdout(a->series) + cli_is_stdout(a->plot);
    if (to_stdout > 1) {
        return cli_misuse("only one of --csv, --series and --plot can go to standard output");
    }
    return CLI_OK;
}

static const char purpose[] =
    "Runs a vehicle over a track with irregularities at constant speed and assesses forces and\n"
    "accelerations. EN 14363: sum of Y and Y/Q (20 Hz, sliding mean of 2 m), Q (20 Hz),\n"
    "accelerations of floor and frames in their bands, 0.15 and 99.85 % percentiles. Comfort:\n"
    "Sperling's Wz; weighted accelerations after EN 12299 and, of their 95 % percentiles over 5\n"
    "s, N_MV without its longitudinal part. Filters are Butterworth of order 4. Accelerations\n"
    "are those an instrument on the floor of the heaviest body would show, over the leading and\n"
    "trailing wheelsets and between, gravity by the body's lean included.";

int cmd_ride(int argc, char **argv) {
    struct arguments a = {.speed_m_s = CLI_NOT_GIVEN,
                          .to_m = CLI_NOT_GIVEN,
                          .assess_from_m = CLI_NOT_GIVEN,
                          .floor_m = 1.2,
                          .step_s = CLI_NOT_GIVEN};
    int status = CLI_OK;
    struct cli_option step = cli_time_option("--step", &a.step_s, 0.01,
                                             "time step instead of the model's, 0.01ms..10ms");
    step.low = 1e-5;
    struct cli_option section =
        cli_place_option("--section", &a.section_m,
                         "length of the sections whose percentiles are compared, the worst being\n"
                         "shown; default: the whole run is one");
    section.low = 0.0;
    struct cli_option floor_height = cli_place_option(
        "--floor", &a.floor_m, "height of the floor above the rail; default 1.2 m");
    floor_height.low = 0.0;
    floor_height.high = 10.0;
    const struct cli_option options[] = {
        cli_speed_option("--speed", &a.speed_m_s, 0.5, "m/s or with a unit (72km/h); needed"),
        cli_place_option("--from", &a.from_m, "where the run begins; default 0"),
        cli_place_option("--to", &a.to_m, "where it ends; default: the end of the track"),
        cli_place_option("--assess-from", &a.assess_from_m,
                         "where the assessment begins; default 3 s after the run"),
        section,
        floor_height,
        step,
        cli_maybe_file_option(
            "--csv", &a.csv,
            "the figures as CSV in SI units; without FILE, or with -, to standard\n"
            "output in place of the text"),
        cli_file_option("--series", &a.series,
                        "every sample of accelerations and forces as CSV, not filtered"),
        cli_plot_option(&a.plot,
                        "accelerations, their spectra, track shifting forces and wheel loads.\n"
                        ".png, .pdf or .svg"),
    };
    const struct cli_command command = {
        .takes_track = true,
        .purpose = purpose,
        .example = "klingel ride models/two_axle_wagon.yaml models/demo_track.yaml --speed 27 \\\n"
                   "    --section 100 --plot ride.png\n",
        .options = options,
        .n_options = sizeof options / sizeof options[0]};
    if (!cli_parse(&command, argc, argv, &a.target, &status) || (status = check(&a)) != CLI_OK) {
        return status;
    }
    struct cli_model m;
    status = cli_model_load(&m, &a.target);
    if (status == CLI_OK) {
        status = cli_model_step(&m, a.step_s);
        if (status != CLI_OK) {
            cli_model_close(&m);
        }
    }
    if (status == CLI_OK) {
        cli_model_hold_speed(&m);
        status = cli_model_build(&m);
    }
    if (status == CLI_OK) {
        status = perform(&m, &a);
        cli_model_close(&m);
    }
    return status;
}
