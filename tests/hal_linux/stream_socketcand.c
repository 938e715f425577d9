/*
 * stream_socketcand - a socketcand server under load, for measurements with clients of other make.
 * usage: stream_socketcand SECONDS FRAMES_PER_TICK [PRIORITY]
 * Every millisecond it sends FRAMES frames, identifiers 0x100 + i, data the tick as 8 bytes
 * little-endian. It prints "port N" when it listens, and at the end one JSON object: the counts,
 * and the report of the loop. SIGINT and SIGTERM end it early.
 */
#include "kl_realtime.h"
#include "kl_socketcand.h"

#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static struct kl_socketcand server;
static struct kl_realtime loop;
static struct kl_can can;
static long frames_per_tick;

static void on_signal(int number) {
    (void)number;
    kl_realtime_stop(&loop);
}

static bool on_tick(void *context, const struct kl_realtime_tick *tick) {
    (void)context;
    struct kl_can_frame frame = {.length = 8};
    while (kl_can_receive(&can, &frame) == KL_CAN_OK) {
    }
    frame = (struct kl_can_frame){.length = 8};
    for (int i = 0; i < 8; i++)
        frame.data[i] = (uint8_t)(tick->number >> 8 * i);
    for (long i = 0; i < frames_per_tick; i++) {
        frame.id = 0x100 + (uint32_t)i;
        (void)kl_can_send(&can, &frame);
    }
    kl_can_service(&can);
    return true;
}

static void report(void) {
    struct kl_can_counts counts;
    struct kl_socketcand_stats stats;
    kl_can_get_counts(&can, &counts);
    kl_socketcand_get_stats(&server, &stats);
    (void)printf("{\"sent\": %" PRIu64 ", \"send_dropped\": %" PRIu64 ", \"received\": %" PRIu64
                 ", \"receive_dropped\": %" PRIu64 ", \"refused\": %" PRIu64
                 ", \"client_lost\": %" PRIu64 ", \"accepted\": %" PRIu64 ", \"loop\": ",
                 counts.sent, counts.send_dropped, counts.received, counts.receive_dropped,
                 counts.refused, stats.client_lost, stats.accepted);
    (void)kl_realtime_report_json(&loop, stdout);
    (void)printf("}\n");
}

int main(int argc, char **argv) {
    if (argc < 3 || argc > 4) {
        (void)fprintf(stderr, "usage: stream_socketcand SECONDS FRAMES_PER_TICK [PRIORITY]\n");
        return 2;
    }
    frames_per_tick = strtol(argv[2], NULL, 10);
    const struct kl_socketcand_options where = {.port = 0};
    const struct kl_realtime_options options = {
        .period_ns = 1000000,
        .ticks = strtoull(argv[1], NULL, 10) * 1000,
        .policy = KL_REALTIME_CATCH_UP,
        .priority = argc > 3 ? (int)strtol(argv[3], NULL, 10) : KL_REALTIME_PRIORITY,
        .cpu = -1,
        .callback = on_tick,
        .warnings = stderr};
    if (kl_realtime_init(&loop, &options) != KL_REALTIME_DONE ||
        kl_socketcand_open(&server, &where) != KL_CAN_OK) {
        (void)fprintf(stderr, "stream_socketcand: %s\n", kl_socketcand_text(&server));
        return 1;
    }
    can = kl_socketcand_can(&server);
    (void)signal(SIGINT, on_signal);
    (void)signal(SIGTERM, on_signal);
    (void)printf("port %u\n", (unsigned)kl_socketcand_port(&server));
    (void)fflush(stdout);
    (void)kl_realtime_run(&loop);
    report();
    kl_can_close(&can);
    return 0;
}
