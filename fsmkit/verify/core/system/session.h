/* session.h: what the adapter of a machine asks of those in its slots (SCXML 6.4).
 *
 * An invoked machine lies in the struct of its invoker and is part of its state; only running ones
 * are asked. */
#ifndef FSM_SESSION_H
#define FSM_SESSION_H

#include "system/system.h"

typedef struct {
    void (*settle)(void *m);
    fsm_view (*view)(const void *m);
    bool (*choose)(void *m, uint32_t timer); /* untimed: that armed one is the next to fire; false: silent */
    uint32_t (*timer_name)(const void *m, uint32_t timer); /* untimed, as that of a machine */
    void (*configuration)(const void *m, unsigned char *shown);
    void (*dump)(const void *m);
} fsm_session;

#endif
