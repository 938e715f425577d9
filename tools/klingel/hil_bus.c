/* hil_bus.c - opening a bus by its name. */
#include "hil_bus.h"

#include <inttypes.h>
#include <net/if.h>
#include <stdlib.h>
#include <string.h>

#define SERVER "socketcand"
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
    bus->is_socketcand = true;
    bus->can = kl_socketcand_can(&bus->socketcand);
    return CLI_OK;
}

static int open_interface(struct hil_bus *bus, const char *name) {
    const struct kl_socketcan_options options = {.interface = name};
    if (!kl_socketcan_available()) {
        return cli_fail("--bus %s: this kernel has no CAN; use --bus socketcand", name);
    }
    if (strlen(name) >= KL_SOCKETCAN_NAME_BYTES || if_nametoindex(name) == 0) {
        return cli_fail("--bus %s: there is no such CAN interface; use auto, socketcand, or one of "
                        "those that `ip link` shows",
                        name);
    }
    enum kl_can_status status = kl_socketcan_open(&bus->socketcan, &options);
    if (status == KL_CAN_DOWN) {
        cli_warn("%s is down: waiting for it (ip link set %s up)", name, name);
    } else if (status != KL_CAN_OK) {
        return cli_fail("cannot open %s: %s", name, kl_socketcan_text(&bus->socketcan));
    }
    bus->is_socketcand = false;
    bus->can = kl_socketcan_can(&bus->socketcan);
    return CLI_OK;
}

int hil_bus_open(struct hil_bus *bus, const char *name) {
    size_t length = strlen(SERVER);
    if (strcmp(name, "auto") == 0) {
        bool kernel = kl_socketcan_available() && if_nametoindex(AUTO_INTERFACE) != 0;
        return kernel ? open_interface(bus, AUTO_INTERFACE) : open_server(bus, NULL);
    }
    if (strncmp(name, SERVER, length) == 0 && (name[length] == '\0' || name[length] == ':')) {
        return open_server(bus, name[length] == ':' ? name + length + 1 : NULL);
    }
    return open_interface(bus, name);
}

void hil_bus_print(const struct hil_bus *bus, FILE *file) {
    if (bus->is_socketcand) {
        unsigned port = kl_socketcand_port(&bus->socketcand);
        fprintf(file,
                "bus: socketcand on 127.0.0.1:%u\n"
                "     python-can: interface='socketcand', host='127.0.0.1', port=%u, "
                "channel='klingel'\n",
                port, port);
    } else {
        fprintf(file, "bus: %s\n     python-can: interface='socketcan', channel='%s'\n",
                bus->socketcan.interface, bus->socketcan.interface);
    }
}

void hil_bus_json(const struct hil_bus *bus, FILE *file) {
    struct kl_can_counts counts;
    kl_can_get_counts(&bus->can, &counts);
    fprintf(file,
            "{\"kind\": \"%s\", \"sent\": %" PRIu64 ", \"received\": %" PRIu64
            ", \"send_dropped\": %" PRIu64 ", \"receive_dropped\": %" PRIu64
            ", \"refused\": %" PRIu64 ", \"recoveries\": %" PRIu64,
            bus->is_socketcand ? "socketcand" : "socketcan", counts.sent, counts.received,
            counts.send_dropped, counts.receive_dropped, counts.refused, counts.recoveries);
    if (bus->is_socketcand) {
        struct kl_socketcand_stats stats;
        kl_socketcand_get_stats(&bus->socketcand, &stats);
        fprintf(file,
                ", \"port\": %u, \"clients\": %u, \"accepted\": %" PRIu64
                ", \"turned_away\": %" PRIu64 ", \"client_lost\": %" PRIu64,
                (unsigned)kl_socketcand_port(&bus->socketcand), (unsigned)stats.clients,
                stats.accepted, stats.turned_away, stats.client_lost);
    }
    fputc('}', file);
}
