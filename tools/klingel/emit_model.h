/* emit_model.h - a model as C source. Private to cmd_build.c. */
#ifndef EMIT_MODEL_H
#define EMIT_MODEL_H

#include "cli.h"

/* Writes C source that defines `const struct kl_model NAME` and needs only klingel.h: constant
 * arrays with exact hexadecimal numbers, refused by the compiler where the real type or the
 * capacities do not fit. */
void emit_model(FILE *file, const struct kl_model *model, const char *name);

/* Bytes of constant data that it takes, about. */
size_t emit_model_bytes(const struct kl_model *model);

#endif
