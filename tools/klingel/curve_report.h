/*
 * curve_report.h - steady running in curves as table, CSV and picture. Private to cmd_curve.c.
 */
#ifndef CURVE_REPORT_H
#define CURVE_REPORT_H

#include "curve_steady.h"

/* Y of a wheel, outwards positive: as its flange would push. */
double curve_outward_N(const struct kl_wheelset_output *o, int side);

/* Angle of attack of a wheelset, positive when it runs against the outer rail. */
double curve_attack_rad(const struct curve_result *result, uint32_t wheelset);

/* EN 14363: the track shifting force of a wheelset that a track of the usual kind bears, 10 kN plus
 * a third of the axle load. */
double curve_limit_N(const struct kl_model *model, uint32_t wheelset);

void curve_print(const struct kl_model *model, const struct curve_result *result);
void curve_csv_header(FILE *file);
void curve_csv(FILE *file, const struct kl_model *model, const struct curve_result *result);
int curve_plot(const char *path, const struct kl_model *model, const struct curve_result *results,
               size_t n);

#endif
