/* timed_arrivals.h: where the steps of a state lead. Many steps with different inputs do the same; each is followed once. */
#ifndef FSM_TIMED_ARRIVALS_H
#define FSM_TIMED_ARRIVALS_H

#include "zones/timed_model.h"

void fsm_timed_arrivals_clear(fsm_timed_arrivals *self);
void fsm_timed_arrivals_free(fsm_timed_arrivals *self);

/* Adds where a step leads, with what is known of the step; `*is_new`: no step of the state did the same before. `tuple_bytes`: the
 * size of its discrete part. False if memory ran out. */
bool fsm_timed_arrivals_add(fsm_timed_arrivals *self, size_t tuple_bytes, const fsm_timed_step *step, fsm_kind kind,
                            const fsm_timed_move *move, bool *is_new);

#endif
