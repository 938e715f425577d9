/* hil_report.c - what a session has come to, as text and as JSON. */
#include <inttypes.h>

#include "hil_session.h"

static double simulated_s(const struct hil_session *s) {
    return (double)s->node.counts.steps * (double)s->node.config.model->step_s;
}

static void lockstep_text(const struct hil_session *s, FILE *file) {
    const struct kl_histogram *h = &s->loop.execution;
    double elapsed = 1e-9 * (double)s->loop.elapsed_ns;
    fprintf(file, "lockstep         %s; %" PRIu64 " cycles in %.3f s, %.2f x real time\n",
            kl_realtime_end_text(s->loop.end), s->node.counts.cycles, elapsed,
            elapsed > 0.0 ? simulated_s(s) / elapsed : 0.0);
    fprintf(file, "execution us     min %9.1f  avg %9.1f  p99 %8.0f  max %9.1f\n",
            1e-3 * (double)h->min_ns, kl_histogram_average_us(h), kl_histogram_quantile_us(h, 0.99),
            1e-3 * (double)h->max_ns);
}

/* Of the recorder's memory at the worst, per cent. */
static double fullness(const struct hil_record *r) {
    return 100.0 * (double)r->fullest / (double)r->size;
}

void hil_report_text(const struct hil_session *s, FILE *file) {
    const struct kl_node_counts *n = &s->node.counts;
    if (s->clock == HIL_LOCKSTEP) {
        lockstep_text(s, file);
    } else {
        (void)kl_realtime_report_text(&s->loop, file, false);
    }
    fprintf(file,
            "model            %" PRIu64 " steps, state hash %016" PRIx64 ", faults 0x%" PRIx32 "\n",
            n->steps, kl_state_hash(&s->state), s->state.faults);
    fprintf(file,
            "frames           sent %" PRIu64 ", dropped %" PRIu64 ", received %" PRIu64
            ", unknown %" PRIu64 ", malformed %" PRIu64 ", badly protected %" PRIu64 "\n",
            n->sent, n->dropped, n->received, n->unknown, n->malformed, n->protection);
    fprintf(file,
            "commands         done %" PRIu64 ", refused %" PRIu64 ", set-points %" PRIu64
            ", late %" PRIu64 "\n",
            n->run_commands, n->run_refused, n->setpoints, n->late);
    fprintf(file, "bus              down in %" PRIu64 " cycles, recovered %" PRIu64 " times\n",
            n->down_cycles, n->recoveries);
    if (s->recorded) {
        const struct record_writer *w = &s->record.writer;
        fprintf(file,
                "recording        %s: %" PRIu64 " steps, lost %" PRIu64
                " (no room); memory full to %.0f %%\n",
                w->path, w->steps, w->lost, fullness(&s->record));
    }
}

static void lockstep_json(const struct hil_session *s, FILE *file) {
    const struct kl_histogram *h = &s->loop.execution;
    fprintf(file,
            "{\"end\": \"%s\", \"elapsed_ns\": %" PRId64 ", \"execution_us\": {\"count\": %" PRIu64
            ", \"min\": %.3f, \"avg\": %.3f, \"p99\": %.0f, \"max\": %.3f}}\n",
            kl_realtime_end_text(s->loop.end), s->loop.elapsed_ns, h->count,
            1e-3 * (double)h->min_ns, kl_histogram_average_us(h), kl_histogram_quantile_us(h, 0.99),
            1e-3 * (double)h->max_ns);
}

static void node_json(const struct hil_session *s, FILE *file) {
    const struct kl_node_counts *n = &s->node.counts;
    const struct {
        const char *name;
        uint64_t value;
    } counts[] = {{"cycles", n->cycles},
                  {"steps", n->steps},
                  {"syncs", n->syncs},
                  {"sent", n->sent},
                  {"dropped", n->dropped},
                  {"busy", n->busy},
                  {"send_errors", n->send_errors},
                  {"received", n->received},
                  {"receive_errors", n->receive_errors},
                  {"unknown", n->unknown},
                  {"malformed", n->malformed},
                  {"protection", n->protection},
                  {"run_commands", n->run_commands},
                  {"run_refused", n->run_refused},
                  {"setpoints", n->setpoints},
                  {"late", n->late},
                  {"faults", n->faults},
                  {"down_cycles", n->down_cycles},
                  {"recover_calls", n->recover_calls},
                  {"recoveries", n->recoveries},
                  {"saturated", s->node.codec.saturated},
                  {"not_finite", s->node.codec.not_finite}};
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++) {
        fprintf(file, "%s\"%s\": %" PRIu64,
                i == 0       ? "{"
                : i % 6 == 0 ? ",\n    "
                             : ", ",
                counts[i].name, counts[i].value);
    }
    fputc('}', file);
}

void hil_report_json(const struct hil_session *s, FILE *file) {
    const struct kl_model *model = s->node.config.model;
    fprintf(file,
            "{\"model\": \"%s\", \"model_hash\": \"%016" PRIx64 "\", \"clock\": \"%s\", "
            "\"simulated_s\": %.9g, \"state_hash\": \"%016" PRIx64 "\", \"model_faults\": %" PRIu32
            ",\n\"node\": ",
            model->name, model->hash, s->clock == HIL_LOCKSTEP ? "lockstep" : "realtime",
            simulated_s(s), kl_state_hash(&s->state), s->state.faults);
    node_json(s, file);
    fprintf(file, ",\n\"bus\": ");
    hil_bus_json(&s->bus, file);
    if (s->recorded) {
        const struct record_writer *w = &s->record.writer;
        fprintf(file,
                ",\n\"recording\": {\"steps\": %" PRIu64 ", \"lost\": %" PRIu64
                ", \"bytes\": %" PRIu64 ", \"memory_full_percent\": %.1f}",
                w->steps, w->lost, w->bytes, fullness(&s->record));
    }
    fprintf(file, ",\n\"loop\": ");
    if (s->clock == HIL_LOCKSTEP) {
        lockstep_json(s, file);
    } else {
        (void)kl_realtime_report_json(&s->loop, file);
    }
    fprintf(file, "}\n");
}
