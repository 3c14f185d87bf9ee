/* timed_model.h: dense time as an fsm_model, for what cannot be told of zones that cover each other.
 *
 * A state is a discrete part and a zone, and no zone is passed over for a larger one: only equal ones are one state. So a
 * path in the graph, an endless one too, is one of points, and the other way round (Tripakis 2009): each point of a zone
 * comes from some point of the zone before, or from one that no comparison tells apart from it. No two clocks are ever
 * compared with each other: what goes first of the timers of a machine is told by whether those armed earlier are below
 * their own durations. So how far a clock is beyond all that it is compared with may be forgotten (Extra_M of Behrmann,
 * Bouyer, Larsen, Pelanek 2006); that concerns timers whose interval has no end, all others never pass their deadlines.
 *
 * A state is stable, or is not, with all its points: a stable one holds points in which no machine has anything left to
 * do and no timer is due, time passed or not; its zone is open towards the deadlines. Where a timer is due, there is a
 * state for each machine with the one of its due timers that goes first. A step of time leads there. Else no time
 * passes in steps. A step may end in several states, for some points in this one and for others in that one.
 *
 * Zeno runs. Time can pass without end on a run that comes to stable states again and again if and only if each timer
 * that has a deadline ends some time, by firing or being stopped. For one that never ends bounds the time. If all end,
 * and some that take time fire, or run until they are due, again and again, time passes. If none does, all stay below
 * their deadlines from some time on; then the same steps can be taken with a little more time between them, as long as
 * each timer ends early enough, and as each lives for a number of steps only, that little need not tend to 0. Timers of
 * a machine lie in the order of arming, so one that never ends is the first of its machine some time, for ever:
 * `running` of the model tells that. */
#ifndef FSM_TIMED_MODEL_H
#define FSM_TIMED_MODEL_H

#include "store/lists.h"
#include "zones/timed.h"

/* A step of a state. Those of a group are one and the same that ends in several states. */
typedef struct {
    uint32_t number;  /* of the local step, of an initial one among those; FSM_NONE: time passes */
    uint32_t group;
    bool sure;        /* all points of the state can take the group */
    uint32_t action;  /* that is fair; FSM_NONE: none is */
    uint64_t ended;   /* see fsm_model.running */
} fsm_timed_move;

typedef struct {
    fsm_timed timed;  /* keeps discrete parts and zones; it does not run */
    fsm_model model;
    fsm_state at;     /* that `moves` belong to */
    fsm_timed_move *moves;
    size_t move_count, move_room;
    fsm_lists marks;
    uint32_t *marks_of; /* by discrete part; FSM_NONE: not asked yet */
    uint32_t part_room;
    const char *failure;

    /* the state whose steps are enumerated, and where these go */
    uint32_t tuple[FSM_MOST_MACHINES + 1];
    uint32_t size;
    bool waits, stable; /* no machine has anything to do but to wait for its timers; and none is due */
    fsm_bound *zone, *part, *upper;
    fsm_limits *limits;
    fsm_steps *steps, again;
    uint32_t group;
} fsm_timed_model;

bool fsm_timed_model_init(fsm_timed_model *self, fsm_composition *composition, size_t memory_limit);
void fsm_timed_model_free(fsm_timed_model *self);

/* The steps of a state, in `moves`. False if the model gave up. */
bool fsm_timed_model_look(fsm_timed_model *self, fsm_state state);

#endif
