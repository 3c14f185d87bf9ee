/* relation.h: what steps do between states that are known: one step forwards or backwards, or any number of them, within a
 * set.
 *
 * The set that bounds the result determines how many events wait in its states, so this need not be followed here. */
#ifndef FSM_RELATION_H
#define FSM_RELATION_H

#include "symbolic/symbolic.h"

typedef struct {
    uint32_t from, to;
} fsm_relation_pair;

/* At one level: pairs of values, sorted; `first` of them for each value. At a machine whose queue is levels, and at each of these:
 * the touch, whose change goes through them; where `is_slot`, there are no pairs. For the passing of time it is NULL. */
typedef struct {
    uint32_t level, count, room;
    const fsm_touch *touch;
    bool is_slot;
    fsm_relation_pair *pairs;
    uint32_t *first, values;
} fsm_relation_part;

typedef struct {
    fsm_class class;
    uint32_t action; /* as of fsm_event; of the passing of time its own */
    bool is_still;
    uint32_t part_count;
    fsm_relation_part *parts; /* from the highest level down */
} fsm_relation_event;

typedef struct {
    fsm_symbolic *symbolic;
    fsm_relation_event *events; /* by number of the event; those without pairs do nothing */
    uint32_t event_count;
    fsm_lists keys;             /* event and phase, for the cache */
    bool backwards, closing;
    fsm_event_list *of_level;   /* those with this highest level */
} fsm_relation;

/* Whether a step counts, by its number in the composition; FSM_SLOT_STEP and more: that of a slot step. */
#define FSM_SLOT_STEP (UINT32_C(1) << 31)
typedef bool fsm_counts_step(void *context, uint32_t number);

/* The relation of the counted steps (NULL: all, and the passing of time). The relation keeps to states that were found. False if memory
 * ran out. */
bool fsm_relation_make(fsm_relation *self, fsm_symbolic *symbolic, bool backwards, fsm_counts_step *counts, void *context);
void fsm_relation_free(fsm_relation *self);

/* What one step leads to from the states of `set`, as far as it is within `bound`. 0 if memory ran out: then the diagram
 * has failed. No root is needed for `set`, `bound` and the result until the next call that may collect garbage. */
uint32_t fsm_relation_step(fsm_relation *self, uint32_t set, uint32_t bound);

/* The same by steps of some actions only, from one number to another, where actions are kept (fsm_model.fair). */
uint32_t fsm_relation_step_by(fsm_relation *self, uint32_t first, uint32_t last, uint32_t set, uint32_t bound);

/* Returns the states reachable by any number of steps within `bound`, including those of `set`. */
uint32_t fsm_relation_close(fsm_relation *self, uint32_t set, uint32_t bound);

#endif
