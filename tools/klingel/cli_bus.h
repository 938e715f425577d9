/* cli_bus.h - the bus of a model, for the sub-commands that show or use it. */
#ifndef CLI_BUS_H
#define CLI_BUS_H

#include "cli.h"
#include "kl_signals.h"

struct cli_bus {
    uint64_t divider;  /* state messages come so many times more slowly */
    uint64_t bit_rate; /* bit/s; 0: without limit */
};

struct cli_option cli_divider_option(struct cli_bus *bus);
struct cli_option cli_bit_rate_option(struct cli_bus *bus);

struct kl_layout cli_bus_layout(const struct cli_model *m, const struct cli_bus *bus);

/* One of kl_dbc_write, kl_signals_csv, kl_signals_markdown. */
typedef enum kl_status (*cli_bus_writer)(const struct kl_layout *layout,
                                         const struct kl_text_sink *sink);

/* Writes the bus of a loaded model to a file. CLI_OK, or printed. */
int cli_bus_write(const struct cli_model *m, const struct cli_bus *bus, const char *path,
                  cli_bus_writer writer);

/* "12345 frames/s, 1.70 Mbit/s, 170 % of 1000 kbit/s" */
void cli_bus_load_text(const struct kl_bus_load *load, uint64_t bit_rate, char *text, size_t size);

#endif
