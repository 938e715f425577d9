/* hil_bus.c - opening a bus by its name. */
#include "hil_bus.h"

#include <inttypes.h>
#include <net/if.h>
#include <stdlib.h>
#include <string.h>

#define SERVER "socketcand"
#define TERMINAL "slcan"
#define AUTO_INTERFACE "vcan0"

static int open_server(struct hil_bus *bus, const char *port_text) {
    struct kl_socketcand_options options = {.port = KL_SOCKETCAND_PORT};
    if (port_text != NULL) {
        size_t length = strlen(port_text);
        unsigned long port = strtoul(port_text, NULL, 10);
        if (length == 0 || length > 5 || strspn(port_text, "0123456789") != length ||
            port > UINT16_MAX) {
            return cli_misuse("--bus socketcand:%s: the port must be within 0..65535", port_text);
        }
        options.port = (uint16_t)port;
    }
    if (kl_socketcand_open(&bus->socketcand, &options) != KL_CAN_OK) {
        return cli_fail("cannot open socketcand on 127.0.0.1:%u: %s; --bus socketcand:0 takes any "
                        "free port",
                        (unsigned)options.port, kl_socketcand_text(&bus->socketcand));
    }
    bus->kind = HIL_BUS_SOCKETCAND;
    bus->can = kl_socketcand_can(&bus->socketcand);
    return CLI_OK;
}

static int open_interface(struct hil_bus *bus, const char *name) {
    const struct kl_socketcan_options options = {.interface = name};
    if (!kl_socketcan_available()) {
        return cli_fail("--bus %s: this kernel has no CAN; use --bus socketcand", name);
    }
    if (strlen(name) >= KL_SOCKETCAN_NAME_BYTES || if_nametoindex(name) == 0) {
        return cli_fail(
            "--bus %s: there is no such CAN interface; use auto, socketcand, slcan, or one of "
            "those that `ip link` shows",
            name);
    }
    enum kl_can_status status = kl_socketcan_open(&bus->socketcan, &options);
    if (status == KL_CAN_DOWN) {
        cli_warn("%s is down: waiting for it (ip link set %s up)", name, name);
    } else if (status != KL_CAN_OK) {
        return cli_fail("cannot open %s: %s", name, kl_socketcan_text(&bus->socketcan));
    }
    bus->kind = HIL_BUS_SOCKETCAN;
    bus->can = kl_socketcan_can(&bus->socketcan);
    return CLI_OK;
}

static int open_terminal(struct hil_bus *bus, const char *path) {
    enum kl_can_status status = kl_slcan_pty_open(&bus->slcan, path);
    if (status == KL_CAN_ARGUMENT || (path != NULL && path[0] == '\0')) {
        return cli_misuse("--bus slcan:%s: the path must have 1..%u characters", path,
                          KL_SLCAN_PTY_PATH_BYTES - 1);
    }
    if (status != KL_CAN_OK) {
        return cli_fail("--bus slcan: %s", kl_slcan_pty_text(&bus->slcan));
    }
    bus->kind = HIL_BUS_SLCAN;
    bus->can = kl_slcan_pty_can(&bus->slcan);
    return CLI_OK;
}

/* Whether `name` is `kind` or `kind:REST`; `rest` is then REST, or NULL. */
static bool is_kind(const char *name, const char *kind, const char **rest) {
    size_t length = strlen(kind);
    bool is = strncmp(name, kind, length) == 0 && (name[length] == '\0' || name[length] == ':');
    *rest = is && name[length] == ':' ? name + length + 1 : NULL;
    return is;
}

int hil_bus_open(struct hil_bus *bus, const char *name) {
    const char *rest = NULL;
    if (strcmp(name, "auto") == 0) {
        bool kernel = kl_socketcan_available() && if_nametoindex(AUTO_INTERFACE) != 0;
        return kernel ? open_interface(bus, AUTO_INTERFACE) : open_server(bus, NULL);
    }
    if (is_kind(name, SERVER, &rest)) {
        return open_server(bus, rest);
    }
    if (is_kind(name, TERMINAL, &rest)) {
        return open_terminal(bus, rest);
    }
    return open_interface(bus, name);
}

void hil_bus_print(const struct hil_bus *bus, FILE *file) {
    if (bus->kind == HIL_BUS_SOCKETCAND) {
        unsigned port = kl_socketcand_port(&bus->socketcand);
        fprintf(file,
                "bus: socketcand on 127.0.0.1:%u\n"
                "     python-can: interface='socketcand', host='127.0.0.1', port=%u, "
                "channel='klingel'\n",
                port, port);
    } else if (bus->kind == HIL_BUS_SLCAN) {
        const char *terminal = kl_slcan_pty_name(&bus->slcan);
        bool linked = bus->slcan.path[0] != '\0';
        fprintf(file,
                "bus: slcan on %s%s%s\n"
                "     python-can: interface='slcan', channel='%s', sleep_after_open=0\n",
                terminal, linked ? ", linked from " : "", bus->slcan.path,
                linked ? bus->slcan.path : terminal);
    } else {
        fprintf(file, "bus: %s\n     python-can: interface='socketcan', channel='%s'\n",
                bus->socketcan.interface, bus->socketcan.interface);
    }
}

void hil_bus_json(const struct hil_bus *bus, FILE *file) {
    static const char *const kinds[] = {"socketcan", "socketcand", "slcan"};
    struct kl_can_counts counts;
    kl_can_get_counts(&bus->can, &counts);
    fprintf(file,
            "{\"kind\": \"%s\", \"sent\": %" PRIu64 ", \"received\": %" PRIu64
            ", \"send_dropped\": %" PRIu64 ", \"receive_dropped\": %" PRIu64
            ", \"refused\": %" PRIu64 ", \"recoveries\": %" PRIu64,
            kinds[bus->kind], counts.sent, counts.received, counts.send_dropped,
            counts.receive_dropped, counts.refused, counts.recoveries);
    if (bus->kind == HIL_BUS_SOCKETCAND) {
        struct kl_socketcand_stats stats;
        kl_socketcand_get_stats(&bus->socketcand, &stats);
        fprintf(file,
                ", \"port\": %u, \"clients\": %u, \"accepted\": %" PRIu64
                ", \"turned_away\": %" PRIu64 ", \"client_lost\": %" PRIu64,
                (unsigned)kl_socketcand_port(&bus->socketcand), (unsigned)stats.clients,
                stats.accepted, stats.turned_away, stats.client_lost);
    }
    if (bus->kind == HIL_BUS_SLCAN) {
        struct kl_slcan_stats stats;
        kl_slcan_link_get_stats(&bus->slcan.link, &stats);
        fprintf(file,
                ", \"opened\": %" PRIu64 ", \"lines\": %" PRIu64 ", \"spoilt\": %" PRIu64
                ", \"belled\": %" PRIu64 ", \"lost_answers\": %" PRIu64,
                stats.opened, stats.lines, stats.spoilt, stats.belled, stats.lost_answers);
    }
    fputc('}', file);
}
