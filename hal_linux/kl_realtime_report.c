#include "kl_realtime.h"

#include <errno.h>
#include <inttypes.h>
#include <string.h>

#define BUCKET_NS 1000
#define US(ns) ((double)(ns) / 1000.0)

void kl_histogram_init(struct kl_histogram *histogram) {
    memset(histogram, 0, sizeof *histogram);
}

void kl_histogram_add(struct kl_histogram *histogram, int64_t sample_ns) {
    if (histogram->count == 0 || sample_ns < histogram->min_ns)
        histogram->min_ns = sample_ns;
    if (histogram->count == 0 || sample_ns > histogram->max_ns)
        histogram->max_ns = sample_ns;
    histogram->count++;
    histogram->sum_ns += sample_ns;
    if (sample_ns < 0)
        sample_ns = 0;
    if (sample_ns / BUCKET_NS >= (int64_t)KL_HISTOGRAM_BUCKETS)
        histogram->overflow++;
    else
        histogram->bucket[sample_ns / BUCKET_NS]++;
}

double kl_histogram_average_us(const struct kl_histogram *histogram) {
    return histogram->count == 0 ? 0.0 : US(histogram->sum_ns) / (double)histogram->count;
}

double kl_histogram_quantile_us(const struct kl_histogram *histogram, double share) {
    double wanted = share * (double)histogram->count;
    uint64_t below = 0;
    if (histogram->count == 0)
        return 0.0;
    for (uint32_t i = 0; i < KL_HISTOGRAM_BUCKETS; i++) {
        below += histogram->bucket[i];
        if (below > 0 && (double)below >= wanted)
            return (double)(i + 1);
    }
    return US(histogram->max_ns);
}

const char *kl_realtime_policy_text(enum kl_realtime_policy policy) {
    switch (policy) {
    case KL_REALTIME_SKIP:
        return "skip";
    case KL_REALTIME_CATCH_UP:
        return "catch-up";
    case KL_REALTIME_HALT:
        return "halt";
    }
    return "unknown";
}

bool kl_realtime_policy_parse(const char *text, enum kl_realtime_policy *policy) {
    static const enum kl_realtime_policy all[] = {KL_REALTIME_SKIP, KL_REALTIME_CATCH_UP,
                                                  KL_REALTIME_HALT};
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++) {
        if (strcmp(text, kl_realtime_policy_text(all[i])) == 0) {
            *policy = all[i];
            return true;
        }
    }
    return false;
}

const char *kl_realtime_end_text(enum kl_realtime_end end) {
    switch (end) {
    case KL_REALTIME_DONE:
        return "done";
    case KL_REALTIME_STOPPED:
        return "stopped";
    case KL_REALTIME_CALLBACK:
        return "ended by the callback";
    case KL_REALTIME_HALTED:
        return "halted at an overrun";
    case KL_REALTIME_FAILED:
        return "the clock failed";
    case KL_REALTIME_ARGUMENT:
        return "a bad argument";
    }
    return "unknown";
}

/* ---- text ---- */

static void print_line(FILE *file, const char *name, const struct kl_histogram *histogram) {
    (void)fprintf(file,
                  "%-16s min %9.1f  avg %9.1f  p99 %8.0f  max %9.1f  over %u us: %" PRIu64 "\n",
                  name, US(histogram->min_ns), kl_histogram_average_us(histogram),
                  kl_histogram_quantile_us(histogram, 0.99), US(histogram->max_ns),
                  KL_HISTOGRAM_BUCKETS - 1, histogram->overflow);
}

int kl_realtime_report_text(const struct kl_realtime *loop, FILE *file, bool buckets) {
    (void)fprintf(file,
                  "real-time loop   %s; policy %s; period %.1f us; %" PRIu64 " ticks, %" PRIu64
                  " run, in %.3f s\n",
                  kl_realtime_end_text(loop->end), kl_realtime_policy_text(loop->options.policy),
                  US(loop->options.period_ns), loop->ticks, loop->runs,
                  (double)loop->elapsed_ns / 1e9);
    (void)fprintf(file,
                  "overruns         %" PRIu64 " (%" PRIu64 " of the loop's own making, %" PRIu64
                  " woken late); longest run %" PRIu64 "\n",
                  loop->overruns, loop->overruns - loop->system_overruns, loop->system_overruns,
                  loop->longest_run);
    (void)fprintf(file, "granted          %s, %s\n",
                  loop->grants.fifo ? "SCHED_FIFO" : "no real-time scheduling",
                  loop->grants.memory_locked ? "memory locked" : "memory not locked");
    print_line(file, "wake-up us", &loop->latency);
    print_line(file, "execution us", &loop->execution);
    if (buckets) {
        (void)fprintf(file, "# us    wake-up  execution\n");
        for (uint32_t i = 0; i < KL_HISTOGRAM_BUCKETS; i++) {
            if ((loop->latency.bucket[i] | loop->execution.bucket[i]) != 0)
                (void)fprintf(file, "%06" PRIu32 " %08" PRIu32 "   %08" PRIu32 "\n", i,
                              loop->latency.bucket[i], loop->execution.bucket[i]);
        }
    }
    return fflush(file) != 0 || ferror(file) ? EIO : 0;
}

/* ---- JSON ---- */

static void print_json(FILE *file, const char *name, const struct kl_histogram *histogram) {
    const char *comma = "";
    (void)fprintf(
        file,
        ",\n  \"%s_us\": {\"count\": %" PRIu64 ", \"min\": %.3f, \"avg\": %.3f, \"p50\": "
        "%.0f, \"p99\": %.0f, \"max\": %.3f, \"overflow\": %" PRIu64 ",\n    \"histogram\": {",
        name, histogram->count, US(histogram->min_ns), kl_histogram_average_us(histogram),
        kl_histogram_quantile_us(histogram, 0.5), kl_histogram_quantile_us(histogram, 0.99),
        US(histogram->max_ns), histogram->overflow);
    for (uint32_t i = 0; i < KL_HISTOGRAM_BUCKETS; i++) {
        if (histogram->bucket[i] != 0) {
            (void)fprintf(file, "%s\"%" PRIu32 "\": %" PRIu32, comma, i, histogram->bucket[i]);
            comma = ", ";
        }
    }
    (void)fprintf(file, "}}");
}

static const char *truth(bool value) {
    return value ? "true" : "false";
}

int kl_realtime_report_json(const struct kl_realtime *loop, FILE *file) {
    (void)fprintf(file,
                  "{\n  \"end\": \"%s\", \"policy\": \"%s\", \"period_ns\": %" PRId64
                  ", \"elapsed_ns\": %" PRId64 ",\n  \"ticks\": %" PRIu64 ", \"runs\": %" PRIu64
                  ", \"overruns\": %" PRIu64 ", \"system_overruns\": %" PRIu64
                  ", \"longest_overrun_run\": %" PRIu64
                  ",\n  \"fifo\": %s, \"priority\": %d, \"memory_locked\": %s",
                  kl_realtime_end_text(loop->end), kl_realtime_policy_text(loop->options.policy),
                  loop->options.period_ns, loop->elapsed_ns, loop->ticks, loop->runs,
                  loop->overruns, loop->system_overruns, loop->longest_run,
                  truth(loop->grants.fifo), loop->options.priority,
                  truth(loop->grants.memory_locked));
    print_json(file, "wake_up", &loop->latency);
    print_json(file, "execution", &loop->execution);
    (void)fprintf(file, "\n}\n");
    return fflush(file) != 0 || ferror(file) ? EIO : 0;
}
