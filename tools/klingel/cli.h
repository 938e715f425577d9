/*
 * cli.h - what the sub-commands of klingel share: arguments, errors, output files, models.
 *
 * A sub-command is a function cmd_NAME(argc, argv), argv[0] being its name, that returns the exit
 * status of the program. It describes its options in a table (struct cli_option), from which
 * parsing, checking, --help and error messages all come. Values carry their unit on the command
 * line if wanted (72km/h, 3mm, 200ms) and are SI inside.
 */
#ifndef CLI_H
#define CLI_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "model_file.h"

enum cli_status { CLI_OK = 0, CLI_FAILED = 1, CLI_USAGE = 2 };

/* ---- the sub-commands ---- */

int cmd_bench(int argc, char **argv);
int cmd_build(int argc, char **argv);
int cmd_conicity(int argc, char **argv);
int cmd_creep(int argc, char **argv);
int cmd_critical(int argc, char **argv);
int cmd_curve(int argc, char **argv);
int cmd_dbc(int argc, char **argv);
int cmd_diff(int argc, char **argv);
int cmd_geometry(int argc, char **argv);
int cmd_hil(int argc, char **argv);
int cmd_modes(int argc, char **argv);
int cmd_replay(int argc, char **argv);
int cmd_ride(int argc, char **argv);
int cmd_run(int argc, char **argv);
int cmd_signals(int argc, char **argv);
int cmd_sketch(int argc, char **argv);

/* ---- errors ---- */

/* Names the program in messages: "klingel" or "klingel run"; copied. */
void cli_set_name(const char *name);
const char *cli_name(void);

/* Prints "klingel run: ..." to stderr. cli_fail and cli_misuse return the exit status; the latter
 * adds where help is. */
void cli_warn(const char *format, ...) __attribute__((format(printf, 1, 2)));
int cli_fail(const char *format, ...) __attribute__((format(printf, 1, 2)));
int cli_misuse(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* The word of `words` (n of them) that looks most like `text`; NULL if none is near. */
const char *cli_nearest(const char *text, const char *const *words, size_t n);

/* ---- quantities ---- */

/*
 * Reads a decimal number with an optional unit of the same kind as `unit`, which is meant where
 * none is given; the result is SI. `unit` "" takes no unit. Not a number, NaN, infinity, unknown
 * unit: false, with the reason in `why`. Units: m mm km; s ms min; m/s mm/s km/h; rad mrad deg;
 * rad/s mrad/s deg/s; N kN.
 */
bool cli_quantity(const char *text, const char *unit, double *si, char *why, size_t why_size);

/* What one of a unit is in SI; 1 for unknown ones. */
double cli_unit(const char *unit);

/* ---- arguments ---- */

/* Default of a CLI_NUMBER that tells whether it was given; see isnan(). */
#define CLI_NOT_GIVEN ((double)NAN)

#define CLI_MAX_LIST 64
struct cli_list {
    size_t n;
    const char *item[CLI_MAX_LIST];
};

enum cli_kind {
    CLI_FLAG = 0,  /* bool: set true */
    CLI_NUMBER,    /* double, SI; `unit`, `low` and `high` say what is allowed */
    CLI_COUNT,     /* uint64_t, low..high */
    CLI_TEXT,      /* const char *: never empty */
    CLI_MAYBE,     /* const char *: "-" if the option is last or followed by another option */
    CLI_LIST,      /* struct cli_list: given any number of times */
    CLI_CHOICE,    /* int: number of the word in `argument`, which lists them: "skip|halt" */
    CLI_EXTRA_TEXT /* as CLI_TEXT, but not shown by --help */
};

struct cli_option {
    const char *name;     /* "--csv" */
    const char *alias;    /* "-o", or NULL */
    const char *argument; /* shown in help: "FILE"; NULL for a flag */
    enum cli_kind kind;
    void *value;      /* holds the default before parsing */
    const char *unit; /* NUMBER */
    double low;       /* NUMBER: SI; COUNT */
    double high;
    const char *help; /* with the default; "\n" begins another line */
};

/* The options that several sub-commands have, each with its own help; `value` is the default. */
struct cli_option cli_speed_option(const char *name, double *value, double low, const char *help);
struct cli_option cli_place_option(const char *name, double *value, const char *help);
struct cli_option cli_time_option(const char *name, double *value, double high, const char *help);
struct cli_option cli_file_option(const char *name, const char **value, const char *help);
/* A file, or standard output where none is named. */
struct cli_option cli_maybe_file_option(const char *name, const char **value, const char *help);
/* -o, --output */
struct cli_option cli_output_option(const char **value, const char *help);

/* What every sub-command works on: its operands and the values of --set. */
struct cli_target {
    const char *vehicle;
    const char *track; /* NULL: none was given */
    const char *file;  /* of a command that takes one before MODEL */
    struct cli_list set;
};

#define CLI_MAX_OPTIONS 31 /* of a sub-command, besides --set */
struct cli_command {
    bool takes_track; /* MODEL [TRACK], else MODEL */
    bool takes_file;  /* a FILE before these, always to be given; MODEL may be left out */
    const char
        *operands; /* what stands for them in help where MODEL may be left out, which the command
                             then checks; NULL: MODEL must be given */
    const char *purpose;
    const char *example; /* lines to be typed, each ended by "\n" */
    const struct cli_option *options;
    size_t n_options;
};

/*
 * Parses into the values of the options and into `target`. --set is an option of all sub-commands
 * and stands in none of their tables. Returns true if the command shall go on; otherwise `*status`
 * is what it returns: --help was printed, or what is wrong was.
 */
bool cli_parse(const struct cli_command *command, int argc, char **argv, struct cli_target *target,
               int *status);

/* ---- output files ---- */

/*
 * A file that appears complete or not at all: written beside its place under another name, and
 * renamed by cli_output_close. "-" is standard output. What is no regular file (a pipe, /dev/null)
 * is written directly. A file that a signal interrupts is removed.
 */
struct cli_output {
    FILE *file;
    char *path;
    char *temporary; /* NULL where `path` is written directly */
};

/* 0, or CLI_FAILED or CLI_USAGE with the reason printed. Names of model files (.yaml) are refused:
 * a forgotten argument shall not cost a model. */
int cli_output_open(struct cli_output *output, const char *path);

/* Ends writing; `status` is what the command has come to. Keeps the file only where that is 0 and
 * all was written. Returns the status, or CLI_FAILED with the reason printed. */
int cli_output_close(struct cli_output *output, int status);

/* For the end of a command that printed: `status`, or CLI_FAILED (said) if standard output took not
 * all of it. */
int cli_flush(int status);

/* True for "-". */
bool cli_is_stdout(const char *path);

/* One line of CSV, 12 digits. */
void cli_csv_row(FILE *file, const double *values, size_t n);

/* A text sink of the port room that writes to the FILE in `context`. */
int cli_sink_write(void *context, const char *text, size_t size);

/* ---- models ---- */

struct cli_model {
    struct model_file file; /* must not be moved */
    struct kl_model model;
    double build_ms;
};

/* Loads the files and applies --set. CLI_OK or CLI_FAILED (printed). */
int cli_model_load(struct cli_model *m, const struct cli_target *target);
/* Builds m->model. Frees `m` if that fails. */
int cli_model_build(struct cli_model *m);

/* Between the two: a free speed becomes a prescribed one. What asks about the motion at a speed wants
 * to stay there. */
void cli_model_hold_speed(struct cli_model *m);
/* Both. */
int cli_model_open(struct cli_model *m, const struct cli_target *target);
/* Builds m->model on an endless smooth track of one curvature and cant; as often as wanted. Frees `m`
 * if that fails. */
int cli_model_endless(struct cli_model *m, double curvature_1_m, double cant_rad);
/* What curvature and cant are at `s_m` of the track that was loaded; builds m->model. Frees `m` if
 * that fails. */
int cli_model_layout(struct cli_model *m, double s_m, double *curvature_1_m, double *cant_rad);
/* Scratch for all vehicles that the command's one stepping thread steps. */
struct kl_work *cli_work(void);
/* Another time step than the file's, before a build; NAN leaves it. CLI_OK or CLI_USAGE (printed). */
int cli_model_step(struct cli_model *m, double step_s);
void cli_model_close(struct cli_model *m);

/* Monotonic time in seconds. */
double cli_seconds(void);

#endif
