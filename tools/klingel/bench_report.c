/* bench_report.c - what a step costs, as text, table and JSON. */
#include <inttypes.h>
#include <math.h>

#include "bench_case.h"

static double real_time(const struct bench_case *c) {
    return 1e9 * (double)c->m.model.step_s / c->times.median;
}

static void print_stages(const struct bench_case *c, FILE *file) {
    fprintf(file, "  %-16s %12s %8s %10s\n", "stage", "instructions", "share", "about ns");
    for (int i = 0; i < BENCH_STAGES; i++) {
        const double share = c->instructions > 0.0 ? c->stage[i] / c->instructions : 0.0;
        fprintf(file, "  %-16s %12.0f %6.1f %% %10.0f\n", bench_stage_name((enum bench_stage)i),
                c->stage[i], 1e2 * share, share * c->times.median);
    }
}

static void print_case(const struct bench_case *c, int which, double calibration_ns, FILE *file) {
    const struct bench_times *t = &c->times;
    fprintf(file, "%s\n",
            which == BENCH_STRAIGHT ? "straight, smooth track" : "track with irregularities");
    fprintf(file, "  ns per step, batches of %u:   min %.0f   median %.0f   p90 %.0f\n",
            BENCH_BATCH, t->min, t->median, t->p90);
    fprintf(file,
            "  ns per step, singly:           median %.0f   p99 %.0f   p99.9 %.0f   max %.0f\n",
            t->single_median, t->p99, t->p999, t->max);
    fprintf(file, "  %.0f x real time; %.3f of the calibration kernel\n", real_time(c),
            t->median / calibration_ns);
    if (c->instructions > 0.0) {
        fprintf(file, "  %.0f instructions per step\n", c->instructions);
    }
    if (c->has_stages) {
        print_stages(c, file);
    }
}

void bench_print(const struct bench_of_model *b, FILE *file) {
    const struct bench_case *straight = &b->of[BENCH_STRAIGHT];
    const struct bench_case *track = &b->of[BENCH_TRACK_CASE];
    const struct kl_model *model = &straight->m.model;
    fprintf(file, "%s: %u states, step %g ms, %g m/s, %" PRIu64 " steps measured twice\n",
            model->name, model->n_states, 1e3 * (double)model->step_s, b->speed_m_s, b->steps);
    fprintf(file,
            "model built in %.2f ms; state %zu bytes; calibration kernel (1000 dependent "
            "multiply-adds) %.0f ns\n",
            straight->m.build_ms, sizeof(struct kl_state), b->calibration_ns);
    for (int i = 0; i < BENCH_CASES; i++) {
        print_case(&b->of[i], i, b->calibration_ns, file);
    }
    if (straight->instructions > 0.0) {
        fprintf(file, "instructions, worst case over best: %.3f\n",
                fmax(track->instructions, straight->instructions) /
                    fmin(track->instructions, straight->instructions));
    }
}

/* ---- a table of many ---- */

void bench_table_head(bool instructions, FILE *file) {
    fprintf(file, "%-24s %-8s %6s %8s %8s %8s %8s %8s %9s %7s%s\n", "model", "case", "states",
            "min ns", "median", "p99", "p99.9", "max", "real time", "kernel",
            instructions ? "  instr." : "");
}

void bench_table_row(const struct bench_of_model *b, FILE *file) {
    for (int i = 0; i < BENCH_CASES; i++) {
        const struct bench_case *c = &b->of[i];
        const struct bench_times *t = &c->times;
        fprintf(file, "%-24.24s %-8s %6u %8.0f %8.0f %8.0f %8.0f %8.0f %8.0fx %7.3f",
                i == 0 ? c->m.model.name : "", bench_case_name[i], c->m.model.n_states, t->min,
                t->median, t->p99, t->p999, t->max, real_time(c), t->median / b->calibration_ns);
        if (c->instructions > 0.0) {
            fprintf(file, " %8.0f", c->instructions);
        }
        fputc('\n', file);
    }
}

/* ---- JSON ---- */

static void json_case(FILE *file, const struct bench_case *c, int which, double calibration_ns) {
    const struct bench_times *t = &c->times;
    fprintf(file,
            ",\n  \"%s\": {\"min_ns\": %.1f, \"median_ns\": %.1f, \"p90_ns\": %.1f, "
            "\"single_median_ns\": %.1f, \"p99_ns\": %.1f, \"p99_9_ns\": %.1f, \"max_ns\": %.1f, "
            "\"median_of_kernel\": %.5f",
            bench_case_name[which], t->min, t->median, t->p90, t->single_median, t->p99, t->p999,
            t->max, t->median / calibration_ns);
    if (c->instructions > 0.0) {
        fprintf(file, ", \"instructions\": %.1f", c->instructions);
    }
    if (c->has_stages) {
        fprintf(file, ",\n    \"stages\": {");
        for (int i = 0; i < BENCH_STAGES; i++) {
            fprintf(file, "%s\"%s\": %.1f", i == 0 ? "" : ", ",
                    bench_stage_name((enum bench_stage)i), c->stage[i]);
        }
        fprintf(file, "}");
    }
    fprintf(file, "}");
}

void bench_json(const struct bench_of_model *b, FILE *file) {
    const struct bench_case *straight = &b->of[BENCH_STRAIGHT];
    const struct kl_model *model = &straight->m.model;
    fprintf(file,
            "{\n  \"model\": \"%s\", \"model_hash\": \"%016" PRIx64 "\", \"step_ns\": %" PRId64
            ", \"speed_m_s\": %.9g,\n  \"bodies\": %" PRIu32 ", \"wheelsets\": %" PRIu32
            ", \"steps\": %" PRIu64 ", \"build_ms\": %.3f, \"states\": %u, \"state_bytes\": %zu,\n"
            "  \"clock_ns\": %.1f, \"calibration_ns\": %.1f",
            model->name, model->hash, model->step_ns, b->speed_m_s, model->n_bodies,
            model->n_wheelsets, b->steps, straight->m.build_ms, model->n_states,
            sizeof(struct kl_state), straight->times.clock_ns, b->calibration_ns);
    for (int i = 0; i < BENCH_CASES; i++) {
        json_case(file, &b->of[i], i, b->calibration_ns);
    }
    fprintf(file, "\n}");
}
