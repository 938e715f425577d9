/* run_input.c - "front.axle_torque_Nm=2000" into the inputs of a run. */
#include <string.h>

#include "record.h"
#include "run_record.h"

int run_set_input(const struct kl_model *model, struct kl_input *input, const char *assignment) {
    static char name[RECORD_MAX_INPUTS][RECORD_INPUT_NAME];
    const char *names[RECORD_MAX_INPUTS];
    struct record_inputs inputs;
    char why[160];
    const char *equals = strchr(assignment, '=');
    if (equals == NULL) {
        return cli_misuse("--input %s: must be NAME=VALUE, such as %s.axle_torque_Nm=2000",
                          assignment, model->wheelsets[0].name);
    }
    const size_t length = (size_t)(equals - assignment);
    record_inputs_of(model, &inputs);
    for (uint32_t i = 0; i < inputs.n; i++) {
        record_input_name(model, i, name[i]);
        names[i] = name[i];
        if (strlen(name[i]) == length && strncmp(name[i], assignment, length) == 0) {
            double value = 0.0;
            if (!cli_quantity(equals + 1, "", &value, why, sizeof why)) {
                return cli_misuse("--input %s: %s", assignment, why);
            }
            record_input_set(&inputs, input, i, (kl_real)value);
            return CLI_OK;
        }
    }
    char wanted[RECORD_INPUT_NAME];
    snprintf(wanted, sizeof wanted, "%.*s", (int)length, assignment);
    const char *near = cli_nearest(wanted, names, inputs.n);
    return cli_misuse("--input %s: the model has no input '%s'; %s %s", assignment, wanted,
                      near != NULL ? "did you mean" : "its first of a wheelset is",
                      near != NULL ? near : name[1]);
}
