/* context.h: a walk through a diagram from the top that knows, at the lowest level of a machine and the variables it shares, in which
 * local state the machine is as a whole. On the way the values are carried down that are needed below, as the number of a list;
 * there are no such values without shared data. For a machine whose queue is levels, windows (slots.h) are known, which have the same
 * steps; carried is its base, with the first event so far that waits and how many there are. */
#ifndef FSM_CONTEXT_H
#define FSM_CONTEXT_H

#include "symbolic/symbolic.h"

typedef struct {
    uint32_t *levels, count, room; /* above, whose values are carried to this one, in falling order */
    uint32_t *machines, machine_count, machine_room; /* of which this is the lowest level */
} fsm_carried;

typedef struct {
    fsm_symbolic *symbolic;
    fsm_carried *carried; /* by level */
    fsm_lists lists, windows; /* windows: base, first event, how many, the clock */
    uint32_t *values;     /* by level: room for those of a machine */
    uint32_t *buffer;
} fsm_contexts;

bool fsm_contexts_init(fsm_contexts *self, fsm_symbolic *symbolic);
void fsm_contexts_free(fsm_contexts *self);

/* The context below, of a value at a level with its context (0 at the top). FSM_NONE if memory ran out. */
uint32_t fsm_context_below(fsm_contexts *self, uint32_t level, uint32_t context, uint32_t value);

/* A local state with the machine's own steps; one with its external events; events that it
 * keeps. */
typedef struct {
    uint32_t own, open, queued;
} fsm_known_local;

/* The local state of a machine whose lowest level this is. False if memory ran out. */
bool fsm_context_local(fsm_contexts *self, uint32_t level, uint32_t context, uint32_t value, uint32_t machine,
                       fsm_known_local *found);

#endif
