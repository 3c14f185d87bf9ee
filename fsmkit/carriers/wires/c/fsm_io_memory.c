/* fsm_io_memory.c: see fsm_io_memory.h. */
#include "fsm_io_memory.h"

#include <string.h>

const fsm_io_wire *fsm_io_memory_find(const fsm_io_memory *self, const char *name)
{
    for (size_t i = 0u; i < self->count; i++) {
        if (strcmp(self->wires[i].name, name) == 0) {
            return &self->wires[i];
        }
    }
    return NULL;
}

bool fsm_io_memory_set(const fsm_io_memory *self, const char *name, int32_t value)
{
    const fsm_io_wire *const wire = fsm_io_memory_find(self, name);
    if (wire == NULL || fsm_io_is_output(wire)) {
        return false;
    }
    *fsm_io_at(self->raw, wire) = value;
    return true;
}

bool fsm_io_memory_get(const fsm_io_memory *self, const char *name, int32_t *value)
{
    const fsm_io_wire *const wire = fsm_io_memory_find(self, name);
    if (wire == NULL) {
        return false;
    }
    *value = *fsm_io_at(self->raw, wire);
    return true;
}

void fsm_io_memory_make_safe(const fsm_io_memory *self)
{
    for (size_t i = 0u; i < self->count; i++) {
        if (fsm_io_is_output(&self->wires[i])) {
            *fsm_io_at(self->raw, &self->wires[i]) = self->wires[i].safe;
        }
    }
}
