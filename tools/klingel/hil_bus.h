/* hil_bus.h - the bus that --bus names. Private to cmd_hil.c. */
#ifndef HIL_BUS_H
#define HIL_BUS_H

#include "cli.h"
#include "kl_slcan_pty.h"
#include "kl_socketcan.h"
#include "kl_socketcand.h"

enum hil_bus_kind { HIL_BUS_SOCKETCAN = 0, HIL_BUS_SOCKETCAND, HIL_BUS_SLCAN };

/* Large: make it static. */
struct hil_bus {
    enum hil_bus_kind kind;
    struct kl_can can;
    struct kl_socketcan socketcan;
    struct kl_socketcand socketcand;
    struct kl_slcan_pty slcan;
};

/* Opens "socketcand", "socketcand:PORT" (0: any free port), "slcan", "slcan:PATH" (a pty, and a
 * symbolic link to it), "auto" or a CAN interface. CLI_OK, or
 * printed: CLI_USAGE for a bad name, CLI_FAILED if it cannot be opened. An interface that is down
 * is no failure: it is waited for. */
int hil_bus_open(struct hil_bus *bus, const char *name);

/* Prints where and how to connect. */
void hil_bus_print(const struct hil_bus *bus, FILE *file);

/* Its counts as one JSON object. */
void hil_bus_json(const struct hil_bus *bus, FILE *file);

#endif
