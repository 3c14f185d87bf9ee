/* composition.h: the explored system: its local steps (local.c), and the data for global steps
 * (system_model.c). */
#ifndef FSM_COMPOSITION_H
#define FSM_COMPOSITION_H

#include "store/hash_map.h"
#include "store/store.h"
#include "system/system.h"
#include "search/workers.h"

typedef struct {
    uint32_t *items;
    size_t count, room;
} fsm_numbers;

/* A local step and what it led to. Ranges are of `numbers`. */
typedef struct {
    uint32_t next;
    uint32_t argument;
    uint32_t messages, message_count;
    uint32_t notes, note_count;
    uint32_t choices, choice_count;
    uint32_t clocks; /* zones: for each timer of the next state, which one it was; see `unmark` */
    fsm_action action;
    fsm_kind kind;
} fsm_local_step;

typedef struct {
    fsm_view view;
    uint32_t configuration;
    uint32_t elapsed;             /* local state after a unit of time; FSM_NONE: not requested yet */
    uint32_t own, own_count;      /* its own steps, and what may happen to it; ranges of `steps` */
    uint32_t open, open_count;
    bool known, open_known;       /* the steps are there */
    bool busy;                    /* an own step is internal */
    bool fair;                    /* something that is fair can happen */
} fsm_local_info;

/* A value for an input or an event for a queue, on its way. */
typedef struct {
    uint32_t target, number;
    uint32_t is_input;
    uint32_t count;
    fsm_value values[FSM_MOST_VALUES];
} fsm_message;

struct fsm_composition {
    const fsm_system *system;
    fsm_lock *lock; /* for all new machines, and for running ones */
    fsm_model model;
    size_t memory_limit;
    const char *failure;
    fsm_store locals[FSM_MOST_MACHINES];
    fsm_local_info *infos[FSM_MOST_MACHINES];
    uint32_t info_room[FSM_MOST_MACHINES];
    fsm_store configurations[FSM_MOST_MACHINES];
    fsm_bounds bounds[FSM_MOST_MACHINES];
    uint32_t first_marks[FSM_MOST_MACHINES];
    /* By machine: where its wires, and what may happen to it, are in `of_machine`; their numbers in the system, in order. */
    uint32_t first_event_link[FSM_MOST_MACHINES + 1], first_input_link[FSM_MOST_MACHINES + 1];
    uint32_t first_possible[FSM_MOST_MACHINES + 1];
    uint32_t *of_machine;
    uint32_t unchecked; /* local states since memory was looked at */
    unsigned char *states_seen[FSM_MOST_MACHINES], *transitions_seen[FSM_MOST_MACHINES];
    fsm_local_step *steps;
    size_t step_count, step_room;
    fsm_numbers numbers;          /* messages, notes, choices and clocks of steps */
    uint32_t clocks[UINT8_MAX + 1]; /* zones: those of the step run last */
    fsm_store messages;
    fsm_hash_map deliveries;          /* (local state, message) -> (local state, full) */
    unsigned char *before, *after; /* room for the largest struct */
    unsigned char *shown;          /* room for the largest configuration */
    size_t store_bytes;
    struct fsm_tree *tree;
    /* Enumerates steps and separates their coverage (symbolic/knowledge.c); may be NULL. */
    void *knowledge;
    bool (*know)(fsm_composition *self, uint32_t machine, uint32_t local, bool open);
};

bool fsm_fail(fsm_composition *self, const char *why);
bool fsm_push_number(fsm_composition *self, fsm_numbers *numbers, uint32_t number);

/* Number of a local state; FSM_NONE if memory ran out. */
uint32_t fsm_intern(fsm_composition *self, uint32_t machine, const void *state);

static inline fsm_local_info *fsm_info(const fsm_composition *self, uint32_t machine, uint32_t local)
{
    return &self->infos[machine][local];
}

static inline const void *fsm_local(const fsm_composition *self, uint32_t machine, uint32_t number)
{
    return fsm_store_at(&self->locals[machine], number);
}

/* Fills in the steps of a local state, own and external ones. Only called where these steps can be
 * taken, since the code that they run counts as covered. */
bool fsm_know(fsm_composition *self, uint32_t machine, uint32_t local);
bool fsm_know_open(fsm_composition *self, uint32_t machine, uint32_t local);

/* Runs one action with every sequence of choices and appends the outcomes to `steps`. */
bool fsm_explore(fsm_composition *self, uint32_t machine, uint32_t local, fsm_action action,
                 uint32_t argument, fsm_kind kind);

/* The local state after a unit of time. */
uint32_t fsm_elapse(fsm_composition *self, uint32_t machine, uint32_t local);

/* The local state of the target after a message has come; `*full` if there was no room for it. */
uint32_t fsm_deliver(fsm_composition *self, uint32_t local, uint32_t message, bool *full);

/* Runs a described step again, into `after` (of the machine's size), tracing. */
void fsm_run_again(fsm_composition *self, fsm_description what, void *after);

/* Number of a message; FSM_NONE if memory ran out. */
uint32_t fsm_intern_message(fsm_composition *self, const fsm_message *message);

#endif
