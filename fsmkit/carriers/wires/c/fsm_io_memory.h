/* fsm_io_memory.h: a raw image by the names of its wires, for tests and co-simulation. */
#ifndef FSM_IO_MEMORY_H
#define FSM_IO_MEMORY_H

#include "fsm_io.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    const fsm_io_wire *wires;
    size_t count;
    void *raw; /* the image */
} fsm_io_memory;

/* A wire by its name; NULL for an unknown name. */
const fsm_io_wire *fsm_io_memory_find(const fsm_io_memory *self, const char *name);

/* Set an input; false, and nothing is set, if there is no input of this name. */
bool fsm_io_memory_set(const fsm_io_memory *self, const char *name, int32_t value);

/* Take the value of any wire; false for an unknown name. */
bool fsm_io_memory_get(const fsm_io_memory *self, const char *name, int32_t *value);

/* Set all outputs to off, as before the first cycle. */
void fsm_io_memory_make_safe(const fsm_io_memory *self);

#ifdef __cplusplus
}
#endif

#endif
