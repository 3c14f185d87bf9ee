/* system_model.h: machines, their wires and their environment (system.h), put together as one fsm_model.
 *
 * A local state is the struct of a machine, as shipped. Local states are numbered, and a local step is
 * run once for each local state and action, by the machine's own code (local.c); machines are composed
 * to groups (tree.c). So the machines run seldom, and the search is look-ups.
 *
 * The steps of a global state, in this order:
 *   while a monitor has an event waiting, only monitors move;
 *   else, while a machine of the environment has, only such machines move;
 *   else each machine in turn: an eventless transition that its inputs enable; else the next event of
 *   its queue; else an expired timer (untimed: any armed one), and spontaneous transitions;
 *   then what may happen to each machine, while at most `max_pending_before_input` events wait in all queues;
 *   and time passes if no machine has anything to do and some timer is armed.
 *
 * With turns (cyclic.c), of the machines that are ordered only that whose turn it is may move; the last
 * machine may move on to the next turn when it has nothing left to do.
 *
 * A machine whose node is frozen (cyclic.c, too) has no steps and no external events, and its waiting events do
 * not count for `max_pending_before_input`. A machine whose node is stopped for good does not change any more. */
#ifndef FSM_SYSTEM_MODEL_H
#define FSM_SYSTEM_MODEL_H

#include "system/composition.h"

/* Marks: 0 deadlock, then the properties, then those of each machine (recorder.h). */
uint32_t fsm_first_mark(const fsm_system *system, uint32_t machine);

fsm_composition *fsm_compose(const fsm_system *system, size_t memory_limit);
void fsm_composition_free(fsm_composition *self);
const fsm_model *fsm_composition_model(const fsm_composition *self);
fsm_bounds fsm_composition_bounds(const fsm_composition *self, uint32_t machine);
const unsigned char *fsm_states_seen(const fsm_composition *self, uint32_t machine);
const unsigned char *fsm_transitions_seen(const fsm_composition *self, uint32_t machine);
uint32_t fsm_local_count(const fsm_composition *self, uint32_t machine);

/* The starts of all machines, in that order. */
typedef struct {
    fsm_description what[FSM_MOST_MACHINES];
    uint32_t choices[FSM_MOST_MACHINES][FSM_MOST_CHOICES];
} fsm_described_start;

/* Describes the initial step with an ordinal, or a step of a state. False if the step does not exist. */
bool fsm_describe_start(fsm_composition *self, uint32_t ordinal, fsm_described_start *described, fsm_state *to);
bool fsm_describe_step(fsm_composition *self, fsm_state state, uint32_t ordinal, fsm_description *what,
                       fsm_state *to);

/* Returns the fairness condition that a step meets (fsm_model.fair), or FSM_NONE. */
uint32_t fsm_owed_action(const fsm_composition *self, fsm_kind kind, fsm_description what);

size_t fsm_composition_bytes(const fsm_composition *self);

#endif
