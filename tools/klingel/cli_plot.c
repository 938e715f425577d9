/* cli_plot.c - a picture's description as JSON, and the Python program that draws it. */
#include "cli_plot.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#define INTERPRETER "/usr/bin/python3"
#define FOLDERS_UP 5 /* from build/klingel or build/NAME/klingel to the project */

/* ---- JSON ---- */

static void put_text(FILE *file, const char *text) {
    fputc('"', file);
    for (const unsigned char *at = (const unsigned char *)text; *at != '\0'; at++) {
        if (*at < 0x20 || *at == '"' || *at == '\\') {
            fprintf(file, "\\u%04x", *at);
        } else {
            fputc(*at, file);
        }
    }
    fputc('"', file);
}

static void put_key(FILE *file, const char *key, const char *text) {
    fprintf(file, ", \"%s\": ", key);
    if (text != NULL) {
        put_text(file, text);
    } else {
        fputs("null", file);
    }
}

static void put_number(FILE *file, double value) {
    if (isfinite(value)) {
        fprintf(file, "%.12g", value);
    } else {
        fputs("null", file);
    }
}

static void put_array(FILE *file, const char *key, const double *values, size_t n, size_t stride) {
    fprintf(file, ", \"%s\": [", key);
    for (size_t i = 0; i < n; i++) {
        fputs(i > 0 ? ", " : "", file);
        put_number(file, values[i * stride]);
    }
    fputc(']', file);
}

static void put_style(struct cli_plot *plot, const char *kind, const struct cli_plot_style *style) {
    static const char *const colour[] = {"first", "second", "third", "fourth",
                                         "fifth", "sixth",  "ink",   "quiet"};
    static const char *const pen[] = {"solid", "dashed", "dotted", "points"};
    fprintf(plot->json,
            "%s\n  {\"kind\": \"%s\", \"colour\": \"%s\", \"pen\": \"%s\", \"thin\": %s",
            plot->content ? "," : "", kind, colour[style->colour], pen[style->pen],
            style->thin ? "true" : "false");
    put_key(plot->json, "label", style->label);
    plot->content = true;
}

/* ---- what is in a picture ---- */

/* The format that a file's name asks for; NULL: none that is known. */
static const char *format_of(const char *path) {
    static const char *const known[] = {"png", "pdf", "svg"};
    const char *dot = strrchr(path, '.');
    if (cli_is_stdout(path)) {
        return known[0];
    }
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        if (dot != NULL && strcmp(dot + 1, known[i]) == 0) {
            return known[i];
        }
    }
    return NULL;
}

int cli_plot_open(struct cli_plot *plot, const char *path, const char *title, const char *notes) {
    memset(plot, 0, sizeof *plot);
    const char *format = format_of(path);
    if (format == NULL) {
        return cli_misuse("--plot %s: must end in .png, .pdf or .svg", path);
    }
    int status = cli_output_open(&plot->picture, path);
    if (status != CLI_OK) {
        return status;
    }
    plot->json = tmpfile();
    if (plot->json == NULL) {
        return cli_output_close(&plot->picture,
                                cli_fail("cannot draw %s: %s", path, strerror(errno)));
    }
    fprintf(plot->json, "{\"klingel_plot\": 1, \"format\": \"%s\"", format);
    put_key(plot->json, "title", title);
    put_key(plot->json, "notes", notes);
    fputs(", \"panels\": [", plot->json);
    return CLI_OK;
}

static void end_panel(struct cli_plot *plot) {
    fputs(plot->panel ? "]}" : "", plot->json);
}

static void put_range(FILE *file, const char *key, double low, double high) {
    if (low < high) {
        fprintf(file, ", \"%s\": [%.12g, %.12g]", key, low, high);
    } else {
        fprintf(file, ", \"%s\": null", key);
    }
}

void cli_plot_panel(struct cli_plot *plot, const struct cli_plot_panel *panel) {
    end_panel(plot);
    fprintf(plot->json,
            "%s\n {\"row\": %d, \"column\": %d, \"rows\": %d, \"columns\": %d, \"equal\": %s, "
            "\"y_down\": %s, \"x_log\": %s, \"y_log\": %s",
            plot->panel ? "," : "", panel->row, panel->column, panel->rows > 0 ? panel->rows : 1,
            panel->columns > 0 ? panel->columns : 1, panel->equal ? "true" : "false",
            panel->y_down ? "true" : "false", panel->x_log ? "true" : "false",
            panel->y_log ? "true" : "false");
    put_key(plot->json, "title", panel->title);
    put_key(plot->json, "x_label", panel->x_label);
    put_key(plot->json, "y_label", panel->y_label);
    put_range(plot->json, "x_range", panel->x_low, panel->x_high);
    put_range(plot->json, "y_range", panel->y_low, panel->y_high);
    if (panel->sheet_mm > 0.0) {
        fprintf(plot->json, ", \"sheet_mm\": [%.12g, %.12g]", CLI_PLOT_WIDTH_MM, panel->sheet_mm);
    }
    fputs(", \"items\": [", plot->json);
    plot->panel = true;
    plot->content = false;
}

/* Content that is places along a way, and nothing else. */
static void put_way(struct cli_plot *plot, const char *kind, const struct cli_plot_style *style,
                    const double *x, const double *y, size_t n) {
    put_style(plot, kind, style);
    put_array(plot->json, "x", x, n, 1);
    put_array(plot->json, "y", y, n, 1);
    fputc('}', plot->json);
}

void cli_plot_line(struct cli_plot *plot, const struct cli_plot_style *style, const double *x,
                   const double *y, size_t n) {
    put_way(plot, "line", style, x, y, n);
}

void cli_plot_rays(struct cli_plot *plot, const struct cli_plot_style *style,
                   const struct cli_plot_ray *rays, size_t n) {
    const size_t stride = sizeof rays[0] / sizeof(double);
    put_style(plot, "rays", style);
    put_array(plot->json, "x0", &rays->x0, n, stride);
    put_array(plot->json, "y0", &rays->y0, n, stride);
    put_array(plot->json, "x1", &rays->x1, n, stride);
    put_array(plot->json, "y1", &rays->y1, n, stride);
    fputc('}', plot->json);
}

void cli_plot_mark(struct cli_plot *plot, const struct cli_plot_style *style, char axis, double at,
                   const char *text) {
    put_style(plot, "mark", style);
    fprintf(plot->json, ", \"axis\": \"%c\", \"at\": ", axis);
    put_number(plot->json, at);
    put_key(plot->json, "text", text);
    fputc('}', plot->json);
}

void cli_plot_text(struct cli_plot *plot, enum cli_plot_colour colour, double x, double y,
                   const char *text) {
    const struct cli_plot_style style = {.colour = colour};
    put_style(plot, "text", &style);
    put_array(plot->json, "at", (const double[]){x, y}, 2, 1);
    put_key(plot->json, "text", text);
    fputc('}', plot->json);
}

void cli_plot_fill(struct cli_plot *plot, const struct cli_plot_style *style, const double *x,
                   const double *y, size_t n) {
    put_way(plot, "fill", style, x, y, n);
}

void cli_plot_word(struct cli_plot *plot, enum cli_plot_colour colour,
                   const struct cli_plot_word *word) {
    const struct cli_plot_style style = {.colour = colour};
    put_style(plot, "word", &style);
    put_array(plot->json, "at", (const double[]){word->x, word->y}, 2, 1);
    put_key(plot->json, "text", word->text);
    fprintf(plot->json, ", \"points\": %.12g, \"align\": \"%c\", \"boxed\": %s}", word->points,
            word->align, word->boxed ? "true" : "false");
}

/* ---- drawing ---- */

/* tools/plot.py of the project that the program was built in. False: said. */
static bool find_program(char *path, size_t size) {
    const char *named = getenv("KLINGEL_PLOT");
    if (named != NULL && named[0] != '\0') {
        snprintf(path, size, "%s", named);
        return true;
    }
    char folder[3072];
    ssize_t length = readlink("/proc/self/exe", folder, sizeof folder - 1);
    folder[length > 0 ? length : 0] = '\0';
    for (int i = 0; i < FOLDERS_UP; i++) {
        char *slash = strrchr(folder, '/');
        if (slash == NULL) {
            break;
        }
        *slash = '\0';
        snprintf(path, size, "%s/tools/plot.py", folder);
        if (access(path, R_OK) == 0) {
            return true;
        }
    }
    (void)cli_fail(
        "no picture: tools/plot.py is not above the program; KLINGEL_PLOT=FILE names it");
    return false;
}

static void become(const char *program, int in, int out, int errors) {
    if (dup2(in, STDIN_FILENO) >= 0 && dup2(out, STDOUT_FILENO) >= 0 &&
        dup2(errors, STDERR_FILENO) >= 0) {
        execl(INTERPRETER, INTERPRETER, "-B", program, (char *)NULL);
        dprintf(STDERR_FILENO, "cannot start %s: %s\n", INTERPRETER, strerror(errno));
    }
    _exit(127);
}

/* The last line that the program wrote: Python ends with what matters. */
static void last_line(FILE *errors, char *line, size_t size) {
    char next[512];
    snprintf(line, size, "the program that draws failed and did not say why");
    rewind(errors);
    while (fgets(next, sizeof next, errors) != NULL) {
        next[strcspn(next, "\n")] = '\0';
        if (next[0] != '\0') {
            snprintf(line, size, "%s", next);
        }
    }
}

static int draw(struct cli_plot *plot, FILE *errors) {
    char program[4096];
    char why[512];
    int ended = -1;
    if (!find_program(program, sizeof program)) {
        return CLI_FAILED;
    }
    if (fflush(plot->json) != 0 || fflush(plot->picture.file) != 0) {
        return cli_fail("no picture: %s", strerror(errno));
    }
    rewind(plot->json);
    pid_t child = fork();
    if (child == 0) {
        become(program, fileno(plot->json), fileno(plot->picture.file), fileno(errors));
    }
    while (child > 0 && waitpid(child, &ended, 0) < 0 && errno == EINTR) {
    }
    if (child > 0 && WIFEXITED(ended) && WEXITSTATUS(ended) == 0) {
        return CLI_OK;
    }
    last_line(errors, why, sizeof why);
    return cli_fail("no picture: %s", child < 0 ? strerror(errno) : why);
}

int cli_plot_close(struct cli_plot *plot, int status) {
    if (plot->json == NULL) {
        return status;
    }
    end_panel(plot);
    fputs("]}\n", plot->json);
    if (status == CLI_OK && ferror(plot->json) != 0) {
        status = cli_fail("no picture: its description could not be written");
    }
    FILE *errors = status == CLI_OK ? tmpfile() : NULL;
    if (status == CLI_OK) {
        status = errors != NULL ? draw(plot, errors) : cli_fail("no picture: %s", strerror(errno));
    }
    if (errors != NULL) {
        fclose(errors);
    }
    fclose(plot->json);
    plot->json = NULL;
    return cli_output_close(&plot->picture, status);
}

struct cli_option cli_plot_option(const char **value, const char *help) {
    struct cli_option option = cli_file_option("--plot", value, help);
    option.argument = "PICTURE";
    return option;
}
