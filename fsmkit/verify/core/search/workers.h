/* workers.h: threads that do one thing together, and wait for each other; and a lock. */
#ifndef FSM_WORKERS_H
#define FSM_WORKERS_H

#include <stdbool.h>
#include <stdint.h>

enum { FSM_MOST_WORKERS = 64 };

/* The task of each worker; worker 0 is the caller. */
typedef void fsm_work(void *context, uint32_t worker);

typedef struct fsm_workers fsm_workers;

/* With so many, the caller included; NULL if none could be started. */
fsm_workers *fsm_workers_start(uint32_t count);
void fsm_workers_stop(fsm_workers *self);
uint32_t fsm_workers_count(const fsm_workers *self);

/* Lets them work until the caller finds no more to do, and returns when all are done. The work is to be
 * divided by turns: not every worker need have come in time. */
void fsm_workers_run(fsm_workers *self, fsm_work *work, void *context);

/* The next of the numbers below `count`, each for one worker only; `count` when all are taken. */
static inline uint32_t fsm_take_turn(uint32_t *turns, uint32_t count)
{
    uint32_t turn = __atomic_fetch_add(turns, 1, __ATOMIC_RELAXED);
    return turn < count ? turn : count;
}

/* Who has the lock may take it again. */
typedef struct fsm_lock fsm_lock;

fsm_lock *fsm_lock_make(void); /* NULL if memory ran out */
void fsm_lock_free(fsm_lock *self);
void fsm_lock_take(fsm_lock *self);
void fsm_lock_leave(fsm_lock *self);

#endif
