/* profile_file_text.h - a profile file as lines and points; what its formats share. Private to
 * profile_file*.c. */
#ifndef PROFILE_FILE_TEXT_H
#define PROFILE_FILE_TEXT_H

#include "profile_file.h"

#define PROFILE_MAX_BYTES (8u * 1024u * 1024u)
#define PROFILE_MAX_VALUES 8 /* in one row */

struct profile_text {
    struct model_parts *parts;
    const char *path;
    const struct profile_request *request;
    enum profile_axes axes; /* as requested, or as found out */
    char *text;             /* the file, cut up as it is read */
    char *rest;
    unsigned line; /* of the last line read, from 1 */
    uint32_t n;    /* points */
    double *first; /* in file order; in the file's units until the reader turns them into m */
    double *second;
    uint32_t *line_of;
};

/* Prints "file:line: ..." and counts; `line` 0: the whole file. Gives -1. */
int profile_say(const struct profile_text *text, unsigned line, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* The next line without blanks around it; NULL at the end. */
char *profile_next_line(struct profile_text *text);

/* A plain finite number and nothing behind it. */
bool profile_number(const char *word, double *value);

/*
 * The numbers of a row, separated by blanks, commas or semicolons; -1 (printed) where there are
 * fewer than `least` or more than `most`, or one is no finite number. Cuts the line up.
 */
int profile_row(const struct profile_text *text, char *line, int least, int most,
                double values[PROFILE_MAX_VALUES]);

void profile_add_point(struct profile_text *text, double first, double second);

/* The formats: fill the points, in m, all header steps done. -1: printed. */
int profile_read_simpack(struct profile_text *text);
int profile_read_miniprof(struct profile_text *text);
int profile_read_columns(struct profile_text *text);

#endif
