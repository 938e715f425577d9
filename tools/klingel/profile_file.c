/* profile_file.c - points of a file into Klingel's coordinates, cut, ordered and checked. */
#include "profile_file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "profile_file_text.h"

#define DOUBLED_M 1e-6       /* points nearer than this to the one before are dropped */
#define STEEPEST_SLOPE 100.0 /* as kl_profile_build has it */
#define SCATTER 20.0         /* a smoothed point may lie this many tolerances back */
#define FLANGE_M 8e-3        /* anything further from the tape circle's height is a flange */
#define SCRATCH_BYTES (2u << 20)

struct format {
    const char *suffix;
    int wheel; /* 1 wheel, 0 rail, -1 either */
    bool own_units;
    bool own_axes;
    int (*read)(struct profile_text *);
};

static const struct format formats[] = {{".prw", 1, true, true, profile_read_simpack},
                                        {".prr", 0, true, true, profile_read_simpack},
                                        {".whl", 1, true, false, profile_read_miniprof},
                                        {".ban", 0, true, false, profile_read_miniprof},
                                        {"", -1, false, false, profile_read_columns}};

static const struct format *format_of(const char *name) {
    const char *dot = strrchr(name, '.');
    const struct format *f = formats;
    while (f->suffix[0] != '\0' && (dot == NULL || strcasecmp(dot, f->suffix) != 0)) {
        f++;
    }
    return f;
}

static bool fits(struct model_parts *parts, const char *key, const struct format *f,
                 const struct profile_request *r) {
    const unsigned before = parts->n_errors;
    if (f->wheel >= 0 && (f->wheel == 1) != r->wheel) {
        model_error(parts, key, "%s is a %s profile, must be of a %s", r->name,
                    f->wheel == 1 ? "wheel" : "rail", r->wheel ? "wheel" : "rail");
    }
    if (f->own_units != (r->unit_m == 0.0)) {
        model_error(parts, key,
                    f->own_units ? "%s has its own units: goes without units"
                                 : "%s needs units: m or mm",
                    r->name);
    }
    return parts->n_errors == before;
}

/* ---- the file ---- */

static int open_text(struct profile_text *t, const char *key) {
    char why[128];
    size_t size = 0;
    size_t lines = 1;
    t->path = model_beside(t->parts, t->request->name);
    if (t->path == NULL) {
        return -1;
    }
    t->text = model_read_whole(t->path, PROFILE_MAX_BYTES, &size, why, sizeof why);
    if (t->text == NULL) {
        model_error(t->parts, key, "%s: %s", t->path, why);
        return -1;
    }
    t->rest = t->text;
    for (const char *p = t->text; (p = strchr(p, '\n')) != NULL; p++) {
        lines++;
    }
    t->first = model_take(t->parts, lines, sizeof *t->first);
    t->second = model_take(t->parts, lines, sizeof *t->second);
    t->line_of = model_take(t->parts, lines, sizeof *t->line_of);
    return t->first != NULL && t->second != NULL && t->line_of != NULL ? 0 : -1;
}

/* ---- points ---- */

static void move_point(struct profile_text *t, uint32_t to, uint32_t from) {
    t->first[to] = t->first[from];
    t->second[to] = t->second[from];
    t->line_of[to] = t->line_of[from];
}

static void swap_points(struct profile_text *t, uint32_t a, uint32_t b) {
    const double first = t->first[a];
    const double second = t->second[a];
    const uint32_t line = t->line_of[a];
    move_point(t, a, b);
    t->first[b] = first;
    t->second[b] = second;
    t->line_of[b] = line;
}

static bool is_outboard(enum profile_axes axes) {
    return axes == PROFILE_OUTBOARD_DOWN || axes == PROFILE_OUTBOARD_UP;
}

static bool is_up(enum profile_axes axes) {
    return axes == PROFILE_INBOARD_UP || axes == PROFILE_OUTBOARD_UP;
}

/* Whether a wheel with these axes has its flange inboard and down, and a tape circle. */
static bool flange_fits(const struct profile_text *t, enum profile_axes axes) {
    const double across = is_outboard(axes) ? -1.0 : 1.0;
    const double down = is_up(axes) ? -1.0 : 1.0;
    const double shift = t->request->flange_m;
    bool before = false;
    bool behind = false;
    uint32_t tape = 0;
    uint32_t far = 0;
    for (uint32_t i = 0; i < t->n; i++) {
        const double eta = across * t->first[i] + shift;
        before = before || eta <= 0.0;
        behind = behind || eta >= 0.0;
        tape = fabs(eta) < fabs(across * t->first[tape] + shift) ? i : tape;
    }
    for (uint32_t i = 0; i < t->n; i++) {
        const double off = fabs(t->second[i] - t->second[tape]);
        far = off > fabs(t->second[far] - t->second[tape]) ? i : far;
    }
    return before && behind && down * (t->second[far] - t->second[tape]) > FLANGE_M &&
           across * t->first[far] + shift > 0.0;
}

/* Whether a rail with its second number growing `up`, or down, is highest somewhere inside. */
static bool head_fits(const struct profile_text *t, bool up) {
    uint32_t top = 0;
    for (uint32_t i = 1; i < t->n; i++) {
        top = (up ? t->second[i] > t->second[top] : t->second[i] < t->second[top]) ? i : top;
    }
    return top > 0 && top + 1 < t->n;
}

/*
 * Where nobody says: a wheel's flange tells both axes. A rail's head tells up and down; on which
 * side the gauge corner is, a new head does not tell at all and a worn one not reliably.
 */
static int find_axes(struct profile_text *t) {
    int found = 0;
    for (int axes = 0; t->request->wheel && axes < PROFILE_AXES_OF_FILE; axes++) {
        if (flange_fits(t, (enum profile_axes)axes)) {
            t->axes = (enum profile_axes)axes;
            found++;
        }
    }
    if (found == 1) {
        return 0;
    }
    if (t->request->wheel) {
        return profile_say(t, 0,
                           "needs axes: inboard_down, inboard_up, outboard_down or outboard_up; "
                           "no flange more than %g mm below the tape circle tells which",
                           1e3 * FLANGE_M);
    }
    const bool up = head_fits(t, true);
    const bool down = head_fits(t, false);
    return profile_say(t, 0, "needs axes: %s; the points do not tell the gauge corner's side",
                       up == down ? "inboard_down, inboard_up, outboard_down or outboard_up"
                       : up       ? "inboard_up or outboard_up"
                                  : "inboard_down or outboard_down");
}

/* eta and zeta, in order of eta from end to end, doubled points dropped. */
static int orient(struct profile_text *t) {
    const struct profile_request *r = t->request;
    const bool outboard = is_outboard(t->axes);
    const bool up = is_up(t->axes);
    uint32_t n = 0;
    for (uint32_t i = 0; i < t->n; i++) {
        t->first[i] = (outboard ? -t->first[i] : t->first[i]) + r->flange_m;
        t->second[i] = up ? -t->second[i] : t->second[i];
        if (!(fabs(t->first[i]) < 1.0 && fabs(t->second[i]) < 1.0)) {
            return profile_say(t, t->line_of[i], "the point is %g mm, %g mm off, must be below 1 m",
                               1e3 * t->first[i], 1e3 * t->second[i]);
        }
        if (n == 0 ||
            hypot(t->first[i] - t->first[n - 1], t->second[i] - t->second[n - 1]) >= DOUBLED_M) {
            move_point(t, n, i);
            n++;
        }
    }
    t->n = n;
    const bool backwards = n > 1 && t->first[n - 1] < t->first[0];
    for (uint32_t i = 0; backwards && i < n / 2; i++) {
        swap_points(t, i, n - 1 - i);
    }
    return 0;
}

/* The point about which a section is kept: next to the tape circle, or the top of the head. */
static uint32_t anchor(const struct profile_text *t) {
    uint32_t best = 0;
    for (uint32_t i = 1; i < t->n; i++) {
        const bool better = t->request->wheel ? fabs(t->first[i]) < fabs(t->first[best])
                                              : t->second[i] < t->second[best];
        best = better ? i : best;
    }
    return best;
}

static bool kept(const struct profile_text *t, uint32_t i, double level) {
    const struct profile_request *r = t->request;
    return t->first[i] >= r->from_m && t->first[i] <= r->to_m &&
           t->second[i] - level <= r->deepest_m;
}

static int cut(struct profile_text *t) {
    uint32_t first = anchor(t);
    uint32_t last = first;
    const double level = t->second[first];
    if (!kept(t, first, level)) {
        return profile_say(
            t, t->line_of[first], "from_mm, to_mm and deepest_mm cut off %s (eta %.3f mm)",
            t->request->wheel ? "the tape circle" : "the top of the head", 1e3 * t->first[first]);
    }
    while (first > 0 && kept(t, first - 1, level)) {
        first--;
    }
    while (last + 1 < t->n && kept(t, last + 1, level)) {
        last++;
    }
    for (uint32_t i = first; i <= last; i++) {
        move_point(t, i - first, i);
    }
    t->n = last - first + 1;
    if (t->n < KL_PROFILE_MIN_POINTS || t->n > KL_PROFILE_MAX_POINTS) {
        return profile_say(t, 0, "%u points within from_mm, to_mm and deepest_mm, must be %d to %d",
                           t->n, KL_PROFILE_MIN_POINTS, KL_PROFILE_MAX_POINTS);
    }
    return 0;
}

/* Height as a function of eta. A smoothed profile may have points that scatter has thrown back. */
static int check_order(const struct profile_text *t) {
    const double back = SCATTER * t->request->smoothing_m;
    double furthest = t->first[0];
    for (uint32_t i = 1; i < t->n; i++) {
        const double step = t->first[i] - furthest;
        if (back > 0.0 ? step < -back : !(step > 1e-7)) {
            return profile_say(t, t->line_of[i],
                               "eta = %.6f mm behind %.6f mm: must grow from point to point; cut "
                               "off what lies behind with from_mm, to_mm or deepest_mm",
                               1e3 * t->first[i], 1e3 * furthest);
        }
        if (back == 0.0 && !(fabs(t->second[i] - t->second[i - 1]) < STEEPEST_SLOPE * step)) {
            return profile_say(
                t, t->line_of[i],
                "steeper than 89.4 degrees at eta = %.6f mm: cut it off with from_mm, "
                "to_mm or deepest_mm",
                1e3 * t->first[i]);
        }
        furthest = step > 0.0 ? t->first[i] : furthest;
    }
    return 0;
}

/* The flange is inboard and down, or, if there is none, the wheel is lower inboard; a head is
 * highest somewhere inside. */
static int check_shape(const struct profile_text *t) {
    const uint32_t at = anchor(t);
    uint32_t far = 0;
    if (!t->request->wheel) {
        return at > 0 && at + 1 < t->n
                   ? 0
                   : profile_say(t, t->line_of[at],
                                 "the rail is highest at an end (eta %.3f mm): are the axes right?",
                                 1e3 * t->first[at]);
    }
    for (uint32_t i = 1; i < t->n; i++) {
        far = fabs(t->second[i] - t->second[at]) > fabs(t->second[far] - t->second[at]) ? i : far;
    }
    const double off = t->second[far] - t->second[at];
    const bool flange = fabs(off) > FLANGE_M;
    const bool right =
        flange ? off > 0.0 && t->first[far] > 0.0 : t->second[t->n - 1] > t->second[0];
    return right ? 0
                 : profile_say(t, t->line_of[far],
                               "the wheel's flange must be inboard and down, but eta = %.3f mm is "
                               "%.3f mm below the tape circle: are the axes right?",
                               1e3 * t->first[far], 1e3 * off);
}

/* ---- the definition ---- */

/* Builds the section once, to find what only the core can, and for a wheel's height at eta = 0. */
static int settle(struct profile_text *t, struct kl_profile_def *def) {
    struct kl_arena arena;
    struct kl_profile profile;
    struct kl_diag diag = {KL_OK, NULL, -1, 0.0};
    void *scratch = malloc(SCRATCH_BYTES);
    if (scratch == NULL) {
        return profile_say(t, 0, "out of memory");
    }
    kl_arena_init(&arena, scratch, SCRATCH_BYTES);
    int status = 0;
    if (kl_profile_build(def, 0.0, &arena, &profile, &diag) != KL_OK) {
        status = profile_say(t, 0, "%s (%g)", diag.what, diag.value);
    } else if (t->request->wheel && !(profile.eta_min_m < 0.0 && profile.eta_max_m > 0.0)) {
        status = profile_say(t, 0, "eta = %.3f to %.3f mm: must reach over the tape circle, 0",
                             1e3 * profile.eta_min_m, 1e3 * profile.eta_max_m);
    } else if (t->request->wheel) {
        const double level = kl_profile_at(&profile, 0.0).zeta_m;
        for (uint32_t i = 0; i < t->n; i++) {
            t->second[i] -= level;
        }
    }
    free(scratch);
    return status;
}

int profile_file_read(struct model_parts *parts, const char *key,
                      const struct profile_request *request, struct kl_profile_def *def) {
    struct profile_text t = {.parts = parts, .request = request, .axes = request->axes};
    const struct format *format = format_of(request->name);
    int status = fits(parts, key, format, request) ? open_text(&t, key) : -1;
    if (status == 0) {
        status = format->read(&t);
    }
    free(t.text);
    if (status == 0 && t.n == 0) {
        status = profile_say(&t, 0, "the file holds no points");
    }
    if (status == 0 && t.axes == PROFILE_AXES_OF_FILE) {
        t.axes = PROFILE_OUTBOARD_DOWN;
        status = format->own_axes ? 0 : find_axes(&t);
    }
    if (status != 0 || orient(&t) != 0 || cut(&t) != 0 || check_shape(&t) != 0 ||
        check_order(&t) != 0) {
        return -1;
    }
    def->kind = KL_PROFILE_POINTS;
    def->n_points = t.n;
    def->eta_m = t.first;
    def->zeta_m = t.second;
    def->smoothing_m = request->smoothing_m;
    return settle(&t, def);
}
