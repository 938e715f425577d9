/*
 * sketch_list.h - the parts of a vehicle: which of them are alike, and what a line says of them.
 */
#ifndef SKETCH_LIST_H
#define SKETCH_LIST_H

#include "cli.h"
#include "sketch_pen.h"

/* What of an element acts in one direction: 0..2 along, 3..5 about x, y, z; 6 on its line. */
struct sketch_part {
    enum sketch_symbol symbol;
    int axis;
};
#define SKETCH_MAX_PARTS 20
size_t sketch_parts(const struct kl_element_def *e, struct sketch_part part[SKETCH_MAX_PARTS]);

/* Numbers of elements and linkages that are alike but for where along the vehicle they are, from 0 in
 * the order of the file; linkages behind the elements. */
struct sketch_groups {
    uint32_t n_element_groups;
    uint32_t n_groups;
    uint32_t of_element[KL_MAX_ELEMENTS];
    uint32_t of_linkage[KL_MAX_LINKAGES];
};
void sketch_group(const struct kl_vehicle_def *def, struct sketch_groups *groups);

/* The element's place: halfway between its points. */
void sketch_place(const struct kl_element_def *e, double at_m[3]);

#define SKETCH_LINE_SIZE 400
/* What is to be said of a group; of bodies or wheelsets that are alike, beginning with number i: how
 * many there are, or 0 if an earlier one is the same. */
void sketch_group_line(const struct kl_vehicle_def *def, const struct sketch_groups *groups,
                       uint32_t group, char line[SKETCH_LINE_SIZE]);
uint32_t sketch_body_line(const struct kl_vehicle_def *def, uint32_t i,
                          char line[SKETCH_LINE_SIZE]);
uint32_t sketch_wheelset_line(const struct cli_model *m, uint32_t i, char line[SKETCH_LINE_SIZE]);

#endif
