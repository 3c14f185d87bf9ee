/* split.h: shared variables as levels of their own. Every machine that shares a variable has a copy; as part of its local state each
 * copy would multiply the local states, and the diagram would hold the same datum many times.
 *
 * A *base* is the local state of a machine with those variables at their least values; with other values it is a *whole* local
 * state, as machines run it. Both are numbered alike (composition.h). */
#ifndef FSM_SPLIT_H
#define FSM_SPLIT_H

#include "system/composition.h"

/* A variable, and where its values are in machines. */
typedef struct {
    uint32_t holder, slot; /* a machine that has it, and its number among those that this one shares */
    uint32_t count;        /* values */
} fsm_shared;

/* The part that is split off a machine. */
typedef struct {
    uint32_t count;
    uint32_t *variables, *slots; /* numbers of variables, and among those that the machine shares */
    uint32_t combinations;       /* of values */
    uint32_t *bases, base_room;  /* by local state: its base, plus one; 0: not requested yet */
} fsm_split_machine;

typedef struct {
    fsm_composition *composition;
    fsm_shared *variables;
    uint32_t variable_count;
    fsm_split_machine *machines;
    uint32_t **variable_of; /* by machine and slot: its variable, plus one; 0: it is not split off */
    unsigned char *scratch; /* room for the largest machine */
    fsm_hash_map wholes;    /* local state, by machine, base and combination */
} fsm_split;

/* Selects the variables to split off: `enabled` ones with few values, unless a machine has too many combinations. False if
 * memory ran out. */
bool fsm_split_init(fsm_split *self, fsm_composition *composition, bool enabled);
void fsm_split_free(fsm_split *self);

/* Levels of a diagram of a system, at most. */
uint32_t fsm_most_levels(const fsm_system *system);

/* FSM_NONE if it failed. Combinations are numbered from the first variable's values on. */
uint32_t fsm_split_whole(fsm_split *self, uint32_t machine, uint32_t base, uint32_t combination);
uint32_t fsm_split_base(fsm_split *self, uint32_t machine, uint32_t whole);
uint32_t fsm_split_combination(const fsm_split *self, uint32_t machine, uint32_t whole);

/* The value of a variable of a machine, by place there, in a combination; and in a local state of its holder. */
uint32_t fsm_split_value(const fsm_split *self, uint32_t machine, uint32_t place, uint32_t combination);
uint32_t fsm_split_value_of(const fsm_split *self, uint32_t variable, uint32_t holder_local);

/* Whether a message only brings a variable that is split off to another copy. */
bool fsm_split_is_copy(const fsm_split *self, uint32_t message);

#endif
