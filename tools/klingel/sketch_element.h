/* sketch_element.h - force elements and linkages of a view; see sketch_vehicle.h. */
#ifndef SKETCH_ELEMENT_H
#define SKETCH_ELEMENT_H

#include "sketch_vehicle.h"

/* Symbols, with their numbers where they have none elsewhere. Linkages are drawn in the plan, between the
 * centres that they tie. */
void sketch_draw_elements(struct sketch_view *view, const struct sketch_what *what);
void sketch_draw_linkages(struct sketch_view *view, const struct sketch_what *what);

#endif
