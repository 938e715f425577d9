/*
 * modes_linear.h - the steady state of a model, and its eigenvalues linearised about it. Private to
 * cmd_modes.c, cmd_critical.c and cmd_curve.c.
 */
#ifndef MODES_LINEAR_H
#define MODES_LINEAR_H

#include "cli.h"

/* Below this magnitude (rad/s) an eigenvalue counts as neutral: a freedom that nothing holds. */
#define MODES_NEUTRAL 1e-3

struct mode {
    double real; /* 1/s */
    double imag; /* rad/s, >= 0: one of a pair */
    /* the rates (positions if neutral) of the eigenvector, by kinetic energy */
    struct {
        uint32_t freedom; /* index into struct modes_names */
        double share;     /* of the energy, 0..1 */
        double phase_rad; /* against the largest */
    } part[3];
    uint32_t n_parts;
    uint32_t column; /* of its eigenvector in struct modes */
};

struct modes {
    uint32_t n;       /* states */
    uint32_t n_modes; /* pairs counted once */
    struct mode mode[KL_MAX_STATES];
    double largest_real;     /* of those that are not neutral; -HUGE_VAL if all are */
    uint32_t n_neutral;      /* eigenvalues */
    double residual;         /* largest rate in the steady state */
    double insensitivity;    /* largest change of an eigenvalue, relative to its magnitude, when
                                the differences are taken four times as wide; 0 if not asked for */
    struct kl_state state;   /* the steady state */
    struct kl_output output; /* in it */
    /* eigenvectors if asked for: state i of the mode in column k is at [i * n + k] */
    double vector_re[KL_MAX_STATES * KL_MAX_STATES];
    double vector_im[KL_MAX_STATES * KL_MAX_STATES];
};

/* The freedoms of a model: bodies' and wheelsets', each with the states of position and rate. */
#define MODES_FREEDOMS (KL_FREEDOMS * KL_MAX_BODIES + 4 * KL_MAX_WHEELSETS)
struct modes_names {
    uint32_t n;
    struct {
        char name[KL_NAME_SIZE + 8];
        int32_t position; /* state; -1 for spin and twist */
        int32_t rate;
        double inertia;
    } freedom[MODES_FREEDOMS];
};
void modes_name(const struct kl_model *model, struct modes_names *names);

struct modes_request {
    const struct kl_model *model;
    const struct modes_names *names;
    double speed_m_s;
    double at_m; /* distance */
    bool parts;  /* eigenvectors and parts too */
    bool check;  /* insensitivity too */
    bool quick;  /* Newton's method alone for the steady state */
};

/*
 * The steady state at a speed (Newton-Raphson from the centred state at rest, rates of all states
 * zero; the centred state itself where it is one), the Jacobian of kl_rates about it by central
 * differences, and its eigenvalues. Modes come in order of rising frequency, then damping. CLI_OK,
 * or CLI_FAILED (printed).
 */
int modes_find(const struct modes_request *request, struct modes *modes);

/* The same about a state that was found already. */
struct modes_steady;
int modes_about(const struct modes_request *request, const struct modes_steady *steady,
                struct modes *modes);

#endif
