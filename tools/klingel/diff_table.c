/* diff_table.c - where two sequences of numbers part, signal by signal. */
#include "diff_table.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

static bool differ(const struct diff_table *t, double a, double b) {
    if (t->absolute <= 0.0 && t->relative <= 0.0) {
        return memcmp(&a, &b, sizeof a) != 0; /* -0 is not 0 */
    }
    if (a == b || (isnan(a) && isnan(b))) {
        return false;
    }
    const double off = fabs(a - b);
    return !(off <= t->absolute + t->relative * fmax(fabs(a), fabs(b)));
}

void diff_row(struct diff_table *t, uint64_t row, const double *a, const double *b) {
    for (size_t i = 0; i < t->n; i++) {
        struct diff_signal *s = &t->signals[i];
        if (!differ(t, a[i], b[i])) {
            continue;
        }
        if (!s->differs) {
            s->differs = true;
            s->first = s->worst = row;
            s->first_a = s->worst_a = a[i];
            s->first_b = s->worst_b = b[i];
        } else if (!(fabs(a[i] - b[i]) <= fabs(s->worst_a - s->worst_b))) {
            s->worst = row;
            s->worst_a = a[i];
            s->worst_b = b[i];
        }
    }
    t->rows++;
}

bool diff_any(const struct diff_table *t) {
    for (size_t i = 0; i < t->n; i++) {
        if (t->signals[i].differs) {
            return true;
        }
    }
    return false;
}

/* Of those that begin to differ in the same row the one that does so most, in units of itself. */
static const struct diff_signal *first_of(const struct diff_table *t) {
    const struct diff_signal *found = NULL;
    double most = -1.0;
    for (size_t i = 0; i < t->n; i++) {
        const struct diff_signal *s = &t->signals[i];
        const double size = fmax(fabs(s->first_a), fabs(s->first_b));
        const double off = size > 0.0 ? fabs(s->first_a - s->first_b) / size : 0.0;
        if (s->differs && (found == NULL || s->first < found->first ||
                           (s->first == found->first && off > most))) {
            found = s;
            most = off;
        }
    }
    return found;
}

void diff_print(const struct diff_table *t, double step_s, FILE *file) {
    const struct diff_signal *first = first_of(t);
    if (first == NULL) {
        return;
    }
    fprintf(file, "first difference in %s %" PRIu64, t->row, first->first);
    if (step_s > 0.0) {
        fprintf(file, " (%.9g s)", (double)first->first * step_s);
    }
    fprintf(file, ": %s %.17g against %.17g %s, by %.3g\n", first->name,
            first->scale * first->first_a, first->scale * first->first_b, first->unit,
            first->scale * (first->first_b - first->first_a));
    fprintf(file, "%-28s %-8s %10s %10s %14s %14s %10s\n", "signal", "unit", "first", "largest",
            "A", "B", "B - A");
    for (size_t i = 0; i < t->n; i++) {
        const struct diff_signal *s = &t->signals[i];
        if (s->differs) {
            fprintf(file, "%-28s %-8s %10" PRIu64 " %10" PRIu64 " %14.8g %14.8g %10.3g\n", s->name,
                    s->unit, s->first, s->worst, s->scale * s->worst_a, s->scale * s->worst_b,
                    s->scale * (s->worst_b - s->worst_a));
        }
    }
}
