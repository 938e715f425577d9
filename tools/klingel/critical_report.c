/* critical_report.c - amplitude over speed. */
#include "critical_report.h"

#include <math.h>

bool critical_hunts(const struct cycle *c) {
    return c->end == CYCLE_STAYS || c->end == CYCLE_IRREGULAR || c->end == CYCLE_UNSETTLED;
}

const struct critical_end *critical_lowest_end(const struct critical_result *r) {
    const struct critical_end *lowest = NULL;
    for (unsigned b = 0; b < r->n_branches; b++) {
        const struct critical_end *end = &r->end[b];
        if (end->found && (lowest == NULL || end->hunts_m_s < lowest->hunts_m_s)) {
            lowest = end;
        }
    }
    return lowest;
}

/* ---- text ---- */

static void print_linear(const struct critical_result *r) {
    const struct modes_scan *linear = &r->linear;
    printf("linear: %s at %g m/s\n", linear->stable_at_low ? "stable" : "unstable",
           linear->low_m_s);
    for (size_t i = 0; i < linear->n; i++) {
        const struct modes_crossing *c = &linear->crossing[i];
        printf("  %10.4f m/s (%.2f km/h): becomes %s, %.4f Hz\n", c->speed_m_s, 3.6 * c->speed_m_s,
               c->stable_below ? "unstable" : "stable", r->linear_Hz[i]);
    }
    if (linear->n == 0) {
        printf("  no critical speed up to %g m/s\n", linear->high_m_s);
    }
}

static void print_ends(const struct critical_result *r) {
    for (unsigned b = 0; b < r->n_branches; b++) {
        const struct critical_end *end = &r->end[b];
        if (!end->found) {
            continue;
        }
        printf("nonlinear: hunting ends between %.4f and %.4f m/s (%.2f km/h); there %.4f mm at "
               "%.4f Hz%s\n",
               end->rest_m_s, end->hunts_m_s, 3.6 * end->hunts_m_s, 1e3 * end->cycle.amplitude,
               end->cycle.frequency_Hz,
               end->cycle.end == CYCLE_UNSETTLED ? ", decaying too slowly to be sure" : "");
    }
    if (r->n_branches == 0) {
        printf("nonlinear: no hunting was found from %g to %g m/s\n", r->low_m_s, r->high_m_s);
    } else if (critical_lowest_end(r) == NULL) {
        printf("nonlinear: hunting does not end down to %g m/s\n", r->low_m_s);
    }
}

/* What a cycle is called. */
static const char *name_of(const struct critical_point *p) {
    static const char *const name[] = {[CYCLE_REST] = "rest",
                                       [CYCLE_STAYS] = "stable",
                                       [CYCLE_IRREGULAR] = "irregular",
                                       [CYCLE_UNSETTLED] = "unsettled",
                                       [CYCLE_LOST] = "derailed"};
    return p->unstable ? "unstable" : name[p->cycle.end];
}

static void print_point(const struct critical_result *r, const struct critical_point *p) {
    const struct cycle *c = &p->cycle;
    printf("  %10.4f  %-9s %12.4f %12.4f %12.4f %10.1f", p->speed_m_s, name_of(p),
           1e3 * c->amplitude, c->frequency_Hz, 1e3 * c->mean, c->time_s);
    if (!p->unstable && c->end == CYCLE_IRREGULAR) {
        printf("  periods of %.3f to %.3f mm", 1e3 * c->least, 1e3 * c->most);
    } else if (!p->unstable && c->end == CYCLE_UNSETTLED) {
        printf("  not settled in %g s: last fifth, %.3f to %.3f mm", r->longest_s, 1e3 * c->least,
               1e3 * c->most);
    }
    printf("\n");
}

/* Speeds in a row at which nothing hunts, in one line. Returns the point after them. */
static size_t print_quiet(const struct critical_result *r, size_t first) {
    const enum cycle_end end = r->point[first].cycle.end;
    size_t last = first;
    while (last + 1 < r->n && r->point[last + 1].cycle.end == end && !r->point[last + 1].unstable) {
        last++;
    }
    if (last > first) {
        printf("  %10.4f to %.4f  %s\n", r->point[first].speed_m_s, r->point[last].speed_m_s,
               name_of(&r->point[first]));
    } else {
        printf("  %10.4f  %s\n", r->point[first].speed_m_s, name_of(&r->point[first]));
    }
    return last + 1;
}

/* Points of the same branch stand together, in the order in which they were found. */
static void print_points(const struct critical_result *r) {
    bool derailed = false;
    if (r->n > 0) {
        printf("  %10s  %-9s %12s %12s %12s %10s\n", "speed m/s", "cycle", "amplitude mm",
               "frequency Hz", "mean mm", "settled s");
    }
    for (size_t i = 0; i < r->n;) {
        const struct critical_point *p = &r->point[i];
        const struct critical_point *before = i > 0 ? p - 1 : p;
        derailed = derailed || p->cycle.end == CYCLE_LOST;
        if (p->branch != before->branch || p->unstable != before->unstable) {
            printf("\n");
        }
        if (p->unstable || critical_hunts(&p->cycle)) {
            print_point(r, p);
            i++;
        } else {
            i = print_quiet(r, i);
        }
    }
    printf("amplitude and mean are those of the lateral displacement of %s: half and middle of its "
           "extremes;\nbelow %g mm it counts as rest%s\n",
           r->wheelset, 1e3 * r->rest_m,
           derailed ? "; derailed: a wheelset has left its contact table" : "");
}

/* The lowest speed at which a disturbance ended so; HUGE_VAL: none did. */
static double lowest_lost(const struct critical_result *r) {
    double lowest = HUGE_VAL;
    for (size_t i = 0; i < r->n; i++) {
        const struct critical_point *p = &r->point[i];
        lowest = p->cycle.end == CYCLE_LOST ? fmin(lowest, p->speed_m_s) : lowest;
    }
    return lowest;
}

static void print_kind(const struct critical_result *r) {
    const struct critical_end *lowest = critical_lowest_end(r);
    if (r->linear.n == 0 || !r->linear.stable_at_low) {
        return;
    }
    const double critical = r->linear.crossing[0].speed_m_s;
    if (r->grows_m_s > 0.0 && r->grows.end == CYCLE_LOST) {
        printf(
            "hardly disturbed at %.2f m/s, just above the linear critical speed, it grows until it "
            "derails\n",
            r->grows_m_s);
    } else if (r->grows_m_s > 0.0) {
        printf("hardly disturbed at %.2f m/s, just above the linear critical speed, it comes to "
               "%.3f mm\n",
               r->grows_m_s, 1e3 * r->grows.amplitude);
    }
    if (r->kind == CRITICAL_HARD) {
        printf("subcritical: a hard loss of stability. ");
    } else if (r->kind == CRITICAL_SOFT) {
        printf("supercritical: a soft loss of stability, that hunting begins there and grows with "
               "the speed. ");
        if (lowest != NULL && lowest->hunts_m_s < critical - 0.1) {
            printf("Beside it there is another:\n");
        }
    } else if (r->kind == CRITICAL_UNBOUNDED) {
        printf("No cycle holds it there. ");
    } else {
        printf("whether the loss of stability is hard or soft could not be settled. ");
    }
    const double lost = lowest_lost(r);
    if (lowest != NULL && lowest->hunts_m_s < critical - 0.1) {
        printf("Between %.2f and %.2f m/s the vehicle runs steadily or hunts, by the disturbance\n",
               lowest->hunts_m_s, critical);
    } else if (lost < critical) {
        printf("Between %.2f and %.2f m/s it runs steadily or derails, by the disturbance\n", lost,
               critical);
    } else {
        printf("\n");
    }
}

void critical_print(const struct critical_result *r) {
    printf("%s: stability, steps of %g ms\n", r->name, 1e3 * r->step_s);
    print_linear(r);
    if (!r->followed) {
        return;
    }
    print_ends(r);
    print_points(r);
    print_kind(r);
}

void critical_csv(FILE *file, const struct critical_result *r) {
    static const char *const kind[] = {"not settled", "subcritical", "supercritical", "unbounded"};
    fprintf(file, "# linear critical speeds m/s:");
    for (size_t i = 0; i < r->linear.n; i++) {
        fprintf(file, " %.9g (%s, %.6g Hz)", r->linear.crossing[i].speed_m_s,
                r->linear.crossing[i].stable_below ? "unstable" : "stable", r->linear_Hz[i]);
    }
    fprintf(file, "\n");
    for (unsigned b = 0; b < r->n_branches; b++) {
        if (r->end[b].found) {
            fprintf(file, "# hunting ends between m/s: %.9g %.9g\n", r->end[b].rest_m_s,
                    r->end[b].hunts_m_s);
        }
    }
    if (r->followed && r->linear.n > 0 && r->linear.stable_at_low) {
        fprintf(file, "# loss of stability: %s\n", kind[r->kind]);
    }
    fprintf(file,
            "speed_m_s,branch,cycle,amplitude_m,least_m,most_m,frequency_Hz,mean_m,settled_s\n");
    for (size_t i = 0; i < r->n; i++) {
        const struct critical_point *p = &r->point[i];
        fprintf(file, "%.12g,%u,%s,%.12g,%.12g,%.12g,%.12g,%.12g,%.6g\n", p->speed_m_s,
                p->branch + 1, name_of(p), p->cycle.amplitude, p->cycle.least, p->cycle.most,
                p->cycle.frequency_Hz, p->cycle.mean, p->cycle.time_s);
    }
}
