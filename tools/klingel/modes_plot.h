/*
 * modes_plot.h - modes as pictures and tables: root locus over a range of speeds, and the shapes of
 * single modes. Private to cmd_modes.c.
 */
#ifndef MODES_PLOT_H
#define MODES_PLOT_H

#include "modes_track.h"

/* Root locus, frequency and damping over the speed, every track by its name. CLI_OK or a failure
 * (printed). */
int modes_plot_locus(const char *path, const struct kl_model *model,
                     const struct modes_tracks *tracks);

/* The modes whose shapes are shown: the least damped ones that swing, at most `most`, in order of
 * rising frequency. Returns how many. */
#define MODES_MAX_SHAPES 12
uint32_t modes_choose(const struct modes *modes, uint32_t most, uint32_t chosen[MODES_MAX_SHAPES]);

/* Amplitude and phase of every freedom, the largest amplitude (m or rad) being one. */
void modes_print_shapes(const struct modes_names *names, const struct modes *modes,
                        const uint32_t *chosen, uint32_t n);

struct modes_shapes {
    const struct kl_model *model;
    const struct kl_vehicle_def *vehicle; /* how long bodies are: as far as elements reach */
    const struct modes_names *names;
    const struct modes *modes;
    const uint32_t *chosen;
    uint32_t n;
    double speed_m_s;
};

/* From above or from the side, and from behind, at two phases a quarter of a period apart. */
int modes_plot_shapes(const char *path, const struct modes_shapes *shapes);

#endif
