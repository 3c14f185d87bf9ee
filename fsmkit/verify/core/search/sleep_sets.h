/* sleep_sets.h: steps that need not be taken, since the same steps in another order lead to the same state.
 *
 * Sleep sets (Godefroid 1990, "Using partial orders to improve automatic verification methods") of one step, for
 * breadth-first searches: a state remembers the step by which it was found first, and the steps that sleep then are those
 * which could as well have come before it. No state is lost, nor is any found later:
 *
 *   Two steps commute in a state if each can be taken before the other one and both orders lead to the same state.
 *   Let a state be at a distance d + 1 from the initial ones, reached from u, which is at the distance d, by x; and let x
 *   sleep in u, which was found first from q by z. Then x and z commute in q, and x comes before z in the order of movers.
 *   The state that x leads to from q is at the distance d, as otherwise ours were nearer; and z leads from it to ours. If z
 *   sleeps there, go on in the same way. Each time the step into our state is a later one in the order, so this ends, with
 *   a step that does not sleep.
 *
 * What is lost: a value for an input may come to fewer of the local states of the machine that gets it, if another one
 * is put beside it in the same state of the system. All local states that this leads to are found.
 *
 * Nor is the first sight of a mark lost: what x did in u it would have done in q, which is nearer. Properties that are
 * evaluated at steps look at the state after it, too; where there are any, no step sleeps (system_model.c).
 *
 * When two steps commute. A step is a function of the local state of the machine that moves; what it sends changes the local
 * states of others as a function of these; a value for an input is put in its place and does nothing else. So steps that
 * touch different machines, or different inputs of a machine that does not move, do each the same before and after the
 * other one. Whether they may be taken depends on more: on whether machines of the environment have to answer first, and
 * how many events wait in all queues. Let z be taken in q, and x in the state after it.
 *   x can be taken in q: both are reactions of the same kind, or neither is one; and if x is external, not more
 *   events waited in q than after z.
 *   z can be taken after x: x causes no reaction of a machine that had none to make; and if z is external, not more
 *   events wait after x than did in q. */
#ifndef FSM_SLEEP_SETS_H
#define FSM_SLEEP_SETS_H

#include "store/store.h"

/* The kinds of steps: own steps of monitors, those of environment machines with a waiting event, all own
 * steps, and external events. */
typedef enum { FSM_WATCHES, FSM_ANSWERS, FSM_OWN, FSM_OPEN, FSM_PARTS } fsm_part;

/* The footprint of a machine's step in any state. Unused bytes are 0. */
typedef struct {
    uint64_t moved;       /* machines: a bit for the one that moves, and each that it sends an event; of many, some share one */
    uint64_t receivers;        /* those that it gives a value for an input */
    uint64_t inputs;      /* a bit for each such input; where there are many, two may have the same */
    uint32_t mover;
    unsigned char part;   /* an fsm_part */
    unsigned char takes;  /* fewer events may wait after it than before */
    unsigned char sends;  /* more may */
    unsigned char calls;  /* a machine of the environment may have an event waiting then that had none */
} fsm_footprint;

enum { FSM_MOST_FOOTPRINTS = 4096 };

typedef struct {
    fsm_store footprints; /* numbered; the first one touches everything */
    uint64_t *rows;       /* for each, bit by bit: which sleep in a state that was found by it */
} fsm_sleep_sets;

bool fsm_sleep_sets_init(fsm_sleep_sets *self);
void fsm_sleep_sets_free(fsm_sleep_sets *self);
size_t fsm_sleep_sets_bytes(const fsm_sleep_sets *self);

/* Number of a footprint; FSM_NONE if memory ran out. If there are too many, it is 0. One thread at a time may call this; others
 * may meanwhile use the numbers that they know. */
uint32_t fsm_sleep_sets_number(fsm_sleep_sets *self, const fsm_footprint *footprint);

/* Returns the sleeping steps of a state that was first reached by a step with this footprint. */
static inline const uint64_t *fsm_sleep_sets_row(const fsm_sleep_sets *self, fsm_footprint_number found_by)
{
    return self->rows + (size_t)found_by * (FSM_MOST_FOOTPRINTS / 64);
}

static inline bool fsm_sleeps(const uint64_t *row, fsm_footprint_number step)
{
    return (__atomic_load_n(&row[step / 64], __ATOMIC_RELAXED) >> step % 64 & 1) != 0;
}

#endif
