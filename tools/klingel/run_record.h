/* run_record.h - what a run leaves behind: CSV rows, extremes, faults, snapshots. Private to
 * cmd_run.c and cmd_replay.c. */
#ifndef RUN_RECORD_H
#define RUN_RECORD_H

#include "cli.h"

/* A value and when it was. */
struct extreme {
    double value;
    double time_s;
};

struct wheel_extremes {
    struct extreme q_least_N;
    struct extreme q_most_N;
    struct extreme y_most_N; /* by absolute value, kept with its sign */
    struct extreme y_over_q; /* positive: towards climbing, Y outwards over Q */
};

struct wheelset_extremes {
    struct extreme y_m; /* by absolute value, kept with its sign */
    struct extreme yaw_rad;
    struct extreme force_y_N;
    struct wheel_extremes wheel[KL_SIDES];
};

struct run_record {
    const struct kl_model *model;
    uint32_t faults;
    double fault_s[4]; /* of each kl_fault bit, the first time */
    struct wheelset_extremes wheelset[KL_MAX_WHEELSETS];
};

void run_record_init(struct run_record *record, const struct kl_model *model);

/* Takes the outputs of a state in. */
void run_record_add(struct run_record *record, const struct kl_output *output);

/* Extremes and faults as text. */
void run_record_print(const struct run_record *record, FILE *file);

/* What the holding faults were: "derailed at 1.234 s"; "" for none. */
void run_record_hold_text(const struct run_record *record, char *text, size_t size);

/* Header and rows of the CSV, to be ended by whoever has more columns or none. */
void run_csv_header(FILE *file, const struct kl_model *model);
void run_csv_row(FILE *file, const struct kl_model *model, const struct kl_output *output);

/* A state to a file and back, as kl_snapshot has it. CLI_OK, or CLI_FAILED (printed). */
int run_snapshot_write(const char *path, const struct kl_model *model,
                       const struct kl_state *state);
int run_snapshot_read(const char *path, const struct kl_model *model, struct kl_state *state);

/* Applies "wheelset.y=3mm" to a state. CLI_OK or CLI_USAGE (printed). */
int run_set_initial(const struct kl_model *model, struct kl_state *state, const char *assignment);

/* Applies "front.axle_torque_Nm=2000" to the inputs: names as in recordings, SI units. CLI_OK or
 * CLI_USAGE (printed). */
int run_set_input(const struct kl_model *model, struct kl_input *input, const char *assignment);

#endif
