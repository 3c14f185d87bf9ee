/* model.h: the interface between a model and the search.
 *
 * A state is a pair of numbers, its left half in the upper 32 bits and its right half in the lower
 * ones; their meaning is private to the model. Marks are facts of interest, numbered from 0: some
 * are evaluated at states (a property is violated), some at steps (an event was not answered). They come
 * in sets, numbered too; set 0 is empty.
 *
 * Several threads may request successors, marks and sets of marks at once, and results stay valid. The other functions
 * are called by one thread only. */
#ifndef FSM_MODEL_H
#define FSM_MODEL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define FSM_MODEL_ABI 7u

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

/* The footprint of a step by number, of which the model knows details. 0: it may touch anything. */
typedef uint16_t fsm_footprint_number;

typedef struct {
    fsm_state to;
    uint32_t marks;   /* set of marks */
    uint32_t ordinal; /* among all steps of the state, skipped ones included */
    uint32_t sent;    /* for `finish`: the message to the other half; 0: nothing */
    fsm_footprint_number footprint;
    unsigned char kind; /* an fsm_kind */
    bool of_left;       /* for `finish`: it is a step of the left half */
} fsm_step;

/* The steps of a state. The order is fixed, so that the ordinal of a step names it for ever. */
typedef struct {
    fsm_step *items;
    size_t count, room;
    bool deadlock; /* nothing can happen in a state that is not at rest: mark 0 of the state */
    uint32_t thread; /* number of the calling thread; each has steps of its own */
    /* The footprint of the step by which a breadth-first search found this state: steps that
     * then lead nowhere new, and have no new marks, are skipped. 0: none is skipped. */
    fsm_footprint_number found_by;
    uint32_t left_out;
    bool left_out_internal; /* some of them are internal */
} fsm_steps;

bool fsm_steps_grow(fsm_steps *self);

static inline void fsm_steps_clear(fsm_steps *self, fsm_footprint_number found_by)
{
    self->count = 0;
    self->deadlock = false;
    self->found_by = found_by;
    self->left_out = 0;
    self->left_out_internal = false;
}

static inline void fsm_steps_leave_out(fsm_steps *self, unsigned char kind)
{
    self->left_out++;
    self->left_out_internal = self->left_out_internal || kind == FSM_STEP_INTERNAL;
}

/* Appends a step with the next ordinal. False if memory ran out. */
static inline bool fsm_steps_append(fsm_steps *self, fsm_state to, uint32_t marks, fsm_footprint_number footprint,
                                    unsigned char kind)
{
    if (self->count == self->room && !fsm_steps_grow(self))
        return false;
    self->items[self->count] = (fsm_step){.to = to, .marks = marks, .ordinal = (uint32_t)self->count + self->left_out,
                                          .footprint = footprint, .kind = kind};
    self->count++;
    return true;
}

/* The same for a step that touches anything. */
static inline bool fsm_steps_add(fsm_steps *self, fsm_state to, uint32_t marks, fsm_kind kind)
{
    return fsm_steps_append(self, to, marks, 0, (unsigned char)kind);
}

typedef struct {
    uint32_t abi; /* FSM_MODEL_ABI of the header the model was compiled against */
    uint32_t mark_count, action_count;
    void *self; /* handed to each function */

    /* Both add to `steps`, which the caller has emptied. They return false if the model gave up
     * (then `failure` says why). */
    bool (*initial)(void *self, fsm_steps *steps);
    bool (*successors)(void *self, fsm_state state, fsm_steps *steps);

    /* Completes `successors` after memory was fetched for it; until then only the number of the
     * steps is valid. Other states may be requested meanwhile. NULL: nothing is left. */
    bool (*finish)(void *self, fsm_state state, fsm_steps *steps);

    /* Fetches what the steps of a state will need of memory, a state a few places on in a layer: first what
     * the state refers to, then, nearer to it, what that refers to. NULL: nothing is fetched. */
    void (*fetch_first)(const void *self, fsm_state state);
    void (*fetch_next)(const void *self, fsm_state state);

    /* The set of marks that hold at a state (FSM_NONE if memory ran out), and the marks of a set. */
    uint32_t (*marks)(void *self, fsm_state state);
    const uint32_t *(*mark_set)(void *self, uint32_t set, uint32_t *count);

    /* For traps: a number for the visible configuration, and whether the machine may rest there. */
    uint32_t (*configuration)(void *self, fsm_state state);
    bool (*at_rest)(void *self, fsm_state state);

    /* For fairness: which action each of the steps of a state belongs to, if it is fair: it happens some
     * time if it stays possible. Else FSM_NONE. False if memory ran out. */
    bool (*fair)(void *self, fsm_state state, const fsm_steps *steps, uint32_t *actions);

    /* Sets (to 1) actions that count as possible at a state without a step there: untimed, of machines that move in
     * turns, each armed timer, which would fire if it were its turn. NULL: no such actions. */
    void (*armed)(void *self, fsm_state state, unsigned char *actions);

    size_t (*memory)(void *self); /* bytes the model itself holds, once it has put away what only threads needed */
    const char *(*failure)(void *self);

    /* For fairness where time is dense: of which machines some armed timer must end, that is fire or be stopped, before
     * time can pass for ever (a bit each), and for each step of which of these the first one ends. NULL: time passes by
     * steps, which are fair as others are. */
    uint64_t (*running)(void *self, fsm_state state, const fsm_steps *steps, uint64_t *ended);
} fsm_model;

static inline bool fsm_finish(const fsm_model *model, fsm_state state, fsm_steps *steps)
{
    return model->finish == NULL || model->finish(model->self, state, steps);
}

static inline bool fsm_successors(const fsm_model *model, fsm_state state, fsm_steps *steps)
{
    return model->successors(model->self, state, steps) && fsm_finish(model, state, steps);
}

#endif
