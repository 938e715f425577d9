/* run_record.c - CSV, extremes and faults of a run. */
#include "run_record.h"

#include <math.h>
#include <string.h>

#define N_FAULTS 4
static const struct {
    uint32_t bit;
    const char *text;
} fault_names[N_FAULTS] = {
    {KL_FAULT_NONFINITE, "the state became infinite or not a number"},
    {KL_FAULT_DERAILED, "derailed: a contact left its table"},
    {KL_FAULT_WHEEL_LIFT, "a wheel carried no load (first time)"},
    {KL_FAULT_INPUT, "an input was out of range and was limited (first time)"},
};

static const char *const freedom_name[KL_FREEDOMS] = {"y", "z", "roll", "pitch", "yaw"};
static const char *const freedom_unit[KL_FREEDOMS] = {"m", "m", "rad", "rad", "rad"};
static const char *const side_name[KL_SIDES] = {"right", "left"};

/* ---- extremes ---- */

static void larger(struct extreme *e, double value, double time_s) {
    if (value > e->value) {
        *e = (struct extreme){value, time_s};
    }
}

static void farther(struct extreme *e, double value, double time_s) {
    if (fabs(value) > fabs(e->value)) {
        *e = (struct extreme){value, time_s};
    }
}

void run_record_init(struct run_record *record, const struct kl_model *model) {
    memset(record, 0, sizeof *record);
    record->model = model;
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        for (int s = 0; s < KL_SIDES; s++) {
            struct wheel_extremes *wheel = &record->wheelset[w].wheel[s];
            wheel->q_least_N.value = HUGE_VAL;
            wheel->y_over_q.value = -HUGE_VAL;
        }
    }
}

static void add_wheel(struct wheel_extremes *e, const struct kl_wheelset_output *o, int side,
                      double t) {
    double q = (double)o->q_N[side];
    double y = (double)o->y_N[side];
    /* Y on the rail, counted outwards: the flange of this wheel pushes that way */
    double outwards = side == KL_RIGHT ? y : -y;
    if (q < e->q_least_N.value) {
        e->q_least_N = (struct extreme){q, t};
    }
    larger(&e->q_most_N, q, t);
    farther(&e->y_most_N, y, t);
    if (q > 0.0) {
        larger(&e->y_over_q, outwards / q, t);
    }
}

void run_record_add(struct run_record *record, const struct kl_output *output) {
    double t = 1e-9 * (double)output->time_ns;
    for (int i = 0; i < N_FAULTS; i++) {
        if ((output->faults & ~record->faults & fault_names[i].bit) != 0) {
            record->fault_s[i] = t;
        }
    }
    record->faults |= output->faults;
    for (uint32_t w = 0; w < record->model->n_wheelsets; w++) {
        const struct kl_wheelset_output *o = &output->wheelset[w];
        struct wheelset_extremes *e = &record->wheelset[w];
        farther(&e->y_m, (double)o->y_m, t);
        farther(&e->yaw_rad, (double)o->yaw_rad, t);
        farther(&e->force_y_N, (double)o->force_y_N, t);
        for (int s = 0; s < KL_SIDES; s++) {
            add_wheel(&e->wheel[s], o, s, t);
        }
    }
}

/* ---- text ---- */

static void print_extreme(FILE *file, struct extreme e, double scale, const char *format) {
    if (isfinite(e.value)) {
        fprintf(file, format, e.value * scale);
        fprintf(file, " @%8.3f s", e.time_s);
    } else {
        fprintf(file, "%9s %12s", "-", "");
    }
}

static void print_wheelset(FILE *file, const char *name, const struct wheelset_extremes *e) {
    fprintf(file, "  %s\n    y       ", name);
    print_extreme(file, e->y_m, 1e3, "%9.4f mm  ");
    fprintf(file, "     yaw     ");
    print_extreme(file, e->yaw_rad, 1e3, "%9.4f mrad");
    fprintf(file, "     sum of Y ");
    print_extreme(file, e->force_y_N, 1e-3, "%8.2f kN");
    fputc('\n', file);
    for (int s = 0; s < KL_SIDES; s++) {
        const struct wheel_extremes *wheel = &e->wheel[s];
        fprintf(file, "    %-5s  Q ", side_name[s]);
        print_extreme(file, wheel->q_least_N, 1e-3, "%8.2f");
        print_extreme(file, wheel->q_most_N, 1e-3, " ..%8.2f kN");
        fprintf(file, "  Y ");
        print_extreme(file, wheel->y_most_N, 1e-3, "%8.2f kN");
        fprintf(file, "  Y/Q ");
        print_extreme(file, wheel->y_over_q, 1.0, "%7.3f");
        fputc('\n', file);
    }
}

void run_record_print(const struct run_record *record, FILE *file) {
    fprintf(file, "extremes (forces on the rail, Y/Q outwards)\n");
    for (uint32_t w = 0; w < record->model->n_wheelsets; w++) {
        print_wheelset(file, record->model->wheelsets[w].name, &record->wheelset[w]);
    }
    fprintf(file, "faults\n");
    for (int i = 0; i < N_FAULTS; i++) {
        if ((record->faults & fault_names[i].bit) != 0) {
            fprintf(file, "  at %.3f s: %s\n", record->fault_s[i], fault_names[i].text);
        }
    }
    if (record->faults == 0) {
        fprintf(file, "  none\n");
    }
}

void run_record_hold_text(const struct run_record *record, char *text, size_t size) {
    text[0] = '\0';
    for (int i = 0; i < N_FAULTS; i++) {
        if ((record->faults & fault_names[i].bit & KL_FAULTS_HOLD) != 0) {
            snprintf(text, size, "at %.3f s: %s", record->fault_s[i], fault_names[i].text);
        }
    }
}

/* ---- CSV ---- */

void run_csv_header(FILE *file, const struct kl_model *model) {
    static const char *const wheelset_column[] = {
        "y_m", "yaw_rad", "z_m", "roll_rad", "spin_rad_s", "y_acc_m_s2", "sum_of_Y_N", "track_y_m"};
    static const char *const wheel_column[] = {"Q_N",       "Y_N",      "T1_N",   "T2_N",
                                               "delta_rad", "flange_N", "rail_m", "rise_m"};
    fprintf(file, "time_s,s_m,speed_m_s,curvature_1_m,cant_rad,faults");
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        const struct kl_body *body = &model->bodies[b];
        for (uint32_t f = 0; f < KL_FREEDOMS; f++) {
            if ((body->freedoms & KL_HAS(f)) != 0) {
                fprintf(file, ",%s_%s_%s,%s_%s_acc_%s_s2", body->name, freedom_name[f],
                        freedom_unit[f], body->name, freedom_name[f], freedom_unit[f]);
            }
        }
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const char *name = model->wheelsets[w].name;
        for (size_t i = 0; i < sizeof wheelset_column / sizeof wheelset_column[0]; i++) {
            fprintf(file, ",%s_%s", name, wheelset_column[i]);
        }
        if (model->wheelsets[w].independent != 0) {
            fprintf(file, ",%s_twist_rad_s", name);
        }
        for (int s = 0; s < KL_SIDES; s++) {
            for (size_t i = 0; i < sizeof wheel_column / sizeof wheel_column[0]; i++) {
                fprintf(file, ",%s_%s_%s", name, side_name[s], wheel_column[i]);
            }
        }
    }
}

static void put(FILE *file, kl_real value) {
    fprintf(file, ",%.12g", (double)value);
}

void run_csv_row(FILE *file, const struct kl_model *model, const struct kl_output *output) {
    fprintf(file, "%.9g", 1e-9 * (double)output->time_ns);
    put(file, output->s_m);
    put(file, output->speed_m_s);
    put(file, output->track.curvature_1_m);
    put(file, output->track.cant_rad);
    fprintf(file, ",%u", (unsigned)output->faults);
    for (uint32_t b = 0; b < model->n_bodies; b++) {
        for (uint32_t f = 0; f < KL_FREEDOMS; f++) {
            if ((model->bodies[b].freedoms & KL_HAS(f)) != 0) {
                put(file, output->body[b].position[f]);
                put(file, output->body[b].acceleration[f]);
            }
        }
    }
    for (uint32_t w = 0; w < model->n_wheelsets; w++) {
        const struct kl_wheelset_output *o = &output->wheelset[w];
        const kl_real values[] = {
            o->y_m,        o->yaw_rad,    o->z_m,       o->roll_rad,
            o->spin_rad_s, o->y_acc_m_s2, o->force_y_N, o->irregularity.lateral_m};
        for (size_t i = 0; i < sizeof values / sizeof values[0]; i++) {
            put(file, values[i]);
        }
        if (model->wheelsets[w].independent != 0) {
            put(file, o->twist_rad_s);
        }
        for (int s = 0; s < KL_SIDES; s++) {
            put(file, o->q_N[s]);
            put(file, o->y_N[s]);
            put(file, o->tread.t1_N[s]);
            put(file, o->tread.t2_N[s]);
            put(file, o->tread.delta_rad[s]);
            put(file, o->flange.normal_N[s]);
            put(file, o->rail_m[s]);
            put(file, o->rise_m[s]);
        }
    }
}
