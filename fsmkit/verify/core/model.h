/* model.h: all that the search knows about a model.
 *
 * A state is a pair of numbers, its left half in the upper 32 bits and its right half in the lower
 * ones; what they stand for is the model's own. Marks are facts of interest, numbered from 0: some
 * are judged at states (a property is violated), some at steps (an event was not answered). They come
 * in sets, numbered too; set 0 is empty.
 *
 * Several threads may ask for successors, marks and sets of marks at once, and what was told stays true. All else
 * is asked by one thread alone. */
#ifndef FSM_MODEL_H
#define FSM_MODEL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define FSM_MODEL_ABI 6u

#define FSM_NONE UINT32_MAX

typedef uint64_t fsm_state;

#define FSM_NO_STATE UINT64_MAX

static inline fsm_state fsm_join(uint32_t left, uint32_t right)
{
    return (fsm_state)left << 32 | right;
}

static inline uint32_t fsm_left(fsm_state state)
{
    return (uint32_t)(state >> 32);
}

static inline uint32_t fsm_right(fsm_state state)
{
    return (uint32_t)state;
}

/* Who moves in a step. A cycle of internal steps is a livelock. */
typedef enum { FSM_STEP_INTERNAL, FSM_STEP_TIME, FSM_STEP_ENVIRONMENT } fsm_kind;

typedef struct {
    fsm_state to;
    uint32_t marks; /* set of marks */
    fsm_kind kind;
} fsm_step;

/* The steps of a state. The order is fixed, so that the ordinal of a step names it for ever. */
typedef struct {
    fsm_step *items;
    size_t count, room;
    bool deadlock; /* nothing can happen, and that is not meant: mark 0 of the state */
    uint32_t thread; /* number of the one that asks; each asks with steps of its own */
} fsm_steps;

bool fsm_steps_grow(fsm_steps *self);

/* False if memory ran out. */
static inline bool fsm_steps_add(fsm_steps *self, fsm_state to, uint32_t marks, fsm_kind kind)
{
    if (self->count == self->room && !fsm_steps_grow(self))
        return false;
    self->items[self->count++] = (fsm_step){to, marks, kind};
    return true;
}

typedef struct {
    uint32_t abi; /* FSM_MODEL_ABI of the header the model was compiled against */
    uint32_t mark_count, action_count;
    void *self; /* handed to each function */

    /* Both add to `steps`, which the caller has emptied. They return false if the model gave up
     * (then `failure` says why). */
    bool (*initial)(void *self, fsm_steps *steps);
    bool (*successors)(void *self, fsm_state state, fsm_steps *steps);

    /* Fetches what the steps of a state will need of memory, a state a few places on in a layer: first what
     * the state refers to, then, nearer to it, what that refers to. NULL: nothing is fetched. */
    void (*fetch_first)(const void *self, fsm_state state);
    void (*fetch_next)(const void *self, fsm_state state);

    /* The set of marks that hold at a state (FSM_NONE if memory ran out), and the marks of a set. */
    uint32_t (*marks)(void *self, fsm_state state);
    const uint32_t *(*mark_set)(void *self, uint32_t set, uint32_t *count);

    /* For traps: a number for what is visible of the state, and whether to stay there is meant. */
    uint32_t (*configuration)(void *self, fsm_state state);
    bool (*at_rest)(void *self, fsm_state state);

    /* For fairness: which action each of the steps of a state belongs to, if it is owed: it happens some
     * time if it stays possible. Else FSM_NONE. False if memory ran out. */
    bool (*owed)(void *self, fsm_state state, const fsm_steps *steps, uint32_t *actions);

    size_t (*memory)(void *self); /* bytes the model itself holds, once it has put away what only threads needed */
    const char *(*failure)(void *self);

    /* For fairness where time is dense: of which machines some armed timer must end, that is fire or be stopped, before
     * time can pass for ever (a bit each), and for each step of which of these the first one ends. NULL: time passes by
     * steps, which are owed as others are. */
    uint64_t (*running)(void *self, fsm_state state, const fsm_steps *steps, uint64_t *ended);
} fsm_model;

#endif
