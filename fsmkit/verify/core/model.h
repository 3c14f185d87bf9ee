/* model.h: all that the search knows about a model.
 *
 * A state is plain data of a fixed size: no pointers, no uninitialised padding. It can therefore be
 * hashed, compared and copied as bytes. Marks are facts of interest, numbered from 0: some are
 * judged at states (a property is violated), some at steps (an event was not answered). */
#ifndef FSM_MODEL_H
#define FSM_MODEL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define FSM_MODEL_ABI 1u

/* Who moves in a step. A cycle of internal steps is a livelock. */
typedef enum { FSM_STEP_INTERNAL, FSM_STEP_TIME, FSM_STEP_ENVIRONMENT } fsm_kind;

typedef struct {
    const void *state; /* where the step leads */
    const uint32_t *marks;
    uint32_t mark_count;
    fsm_kind kind;
} fsm_step;

/* Receives one step; returns false to stop the enumeration. */
typedef bool fsm_emit(void *context, const fsm_step *step);

typedef struct {
    uint32_t abi;      /* FSM_MODEL_ABI of the header the model was compiled against */
    size_t state_size; /* bytes */
    uint32_t mark_count;
    void *self; /* handed to each function */

    /* Both enumerate in a fixed order, so that the ordinal of a step names it for ever. They return
     * false if `emit` did, or if the model itself gave up (then `failure` says why). */
    bool (*initial)(void *self, fsm_emit *emit, void *context);
    bool (*successors)(void *self, const void *state, fsm_emit *emit, void *context);

    /* Writes the marks that hold at a state, at most `mark_count`, and returns how many. */
    uint32_t (*marks)(void *self, const void *state, uint32_t *marks);

    /* For traps: a number for what is visible of the state, and whether to stay there is meant. */
    uint32_t (*configuration)(void *self, const void *state);
    bool (*at_rest)(void *self, const void *state);

    size_t (*memory)(void *self); /* bytes the model itself holds */
    const char *(*failure)(void *self);
} fsm_model;

#endif
