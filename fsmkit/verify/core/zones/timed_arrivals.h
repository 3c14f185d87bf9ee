/* timed_arrivals.h: where the steps of a state lead. Many steps with different inputs do the same; each is followed once. */
#ifndef FSM_TIMED_ARRIVALS_H
#define FSM_TIMED_ARRIVALS_H

#include "zones/timed.h"

/* A step of a state. Those of a group are one and the same that ends in several states. */
typedef struct {
    uint32_t number;  /* of the local step, of an initial one among those; FSM_NONE: time passes */
    uint32_t group;
    bool sure;        /* all points of the state can take the group */
    uint32_t action;  /* that is fair; FSM_NONE: none is */
    uint64_t ended;   /* see fsm_model.running */
} fsm_timed_move;

/* Points to which the steps of the current state lead, each once. */
typedef struct {
    unsigned char *bytes;
    size_t size, room;
    uint64_t *slots; /* hash and offset; UINT64_MAX: empty */
    uint32_t count, capacity;
} fsm_timed_arrivals;

void fsm_timed_arrivals_clear(fsm_timed_arrivals *self);
void fsm_timed_arrivals_free(fsm_timed_arrivals *self);

/* Adds where a step leads, with what is known of the step; `*is_new`: no step of the state did the same before. `tuple_bytes`: the
 * size of its discrete part. False if memory ran out. */
bool fsm_timed_arrivals_add(fsm_timed_arrivals *self, size_t tuple_bytes, const fsm_timed_step *step, fsm_kind kind,
                            const fsm_timed_move *move, bool *is_new);

#endif
