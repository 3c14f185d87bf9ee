/* timed_model.h: dense time as an fsm_model, for properties that zones which cover each other do not decide.
 *
 * A state is a discrete part and a zone, and no zone is passed over for a larger one: only equal ones are one state. So a
 * path in the graph, an endless one too, is one of points, and the other way round (Tripakis 2009): each point of a zone
 * comes from some point of the zone before, or from one that no comparison distinguishes from it. No two clocks are ever
 * compared with each other: the first of the timers of a machine follows from whether those armed earlier are below
 * their own durations. So how far a clock is beyond all compared constants may be forgotten (Extra_M of Behrmann,
 * Bouyer, Larsen, Pelanek 2006); that concerns timers whose interval has no end, all others never pass their deadlines.
 *
 * A state is stable, or is not, with all its points: a stable one holds points in which no machine has anything left to
 * do and no timer has expired, time passed or not; its zone is open towards the deadlines. If a timer has expired, there is a
 * state for each machine with the first of its expired timers. A step of time leads there. Else no time
 * passes in steps. A step may end in several states, for some points in this one and for others in that one.
 *
 * Zeno runs. Time can pass without end on a run that comes to stable states again and again if and only if each timer
 * that has a deadline ends some time, by firing or being stopped. For one that never ends bounds the time. If all end,
 * and some that take time fire, or run until they are due, again and again, time passes. If none does, all stay below
 * their deadlines from some time on; then the same steps can be taken with a little more time between them, as long as
 * each timer ends early enough, and as each lives for a number of steps only, that little need not tend to 0. Timers of
 * a machine lie in the order of arming, so one that never ends is the first of its machine some time, for ever:
 * `running` of the model expresses that. */
#ifndef FSM_TIMED_MODEL_H
#define FSM_TIMED_MODEL_H

#include "store/lists.h"
#include "store/set.h"
#include "zones/timed.h"
#include "zones/timed_arrivals.h"

/* Which state represents a new one of the same part: of the same discrete part, stable or not alike. The representative
 * has a larger zone, so each run of points is one of the graph, and a step of the graph may be one of no point. A state
 * that is covered before its steps were enumerated has one step, which no machine does: to the state that covers it.
 *
 * FSM_COVER_SIMULATED: each point of the new zone is simulated by a point of the other one, by the abstraction aLU (zones.h).
 * Stable points are simulated by stable ones. A point in which a timer has expired may be simulated by one in which it has not,
 * which does the same steps. Which events and timers are possible in a stable state depends on its discrete part
 * only, so the run that simulates a fair one is fair.
 *
 * FSM_COVER_HULL: there is one zone for all points of a part with the same timers due: the least that holds all. It may hold points
 * that are not reached.
 *
 * FSM_COVER_POINTS: zones are points, and time passes until some timer comes to its least or greatest duration. So each path
 * of the graph is one of points, but few runs are in it: those whose steps all come at such instants, as corner points of zones
 * (Bouyer, Brinksma, Larsen 2008). */
typedef enum { FSM_COVER_EQUAL, FSM_COVER_SUBSET, FSM_COVER_SIMULATED, FSM_COVER_HULL, FSM_COVER_POINTS } fsm_timed_cover;

/* A state of the graph. All states that were found are in it, those covered later, too. */
typedef struct {
    fsm_state state, from;  /* by whose step it was found first; FSM_NO_STATE: an initial one */
    uint32_t step;          /* the ordinal of that step */
    uint32_t arc_count;     /* FSM_NONE: its steps are not kept */
    size_t arcs;            /* the first of its steps */
    uint64_t running;       /* see fsm_model.running */
} fsm_timed_node;

/* The number of the step from a state to one that covers it. */
#define FSM_TIMED_COVERED (FSM_NONE - 1)

/* A step that is kept. */
typedef struct {
    fsm_timed_move move;
    fsm_state to;
    fsm_kind kind;
} fsm_timed_arc;

typedef struct {
    fsm_timed timed;  /* keeps discrete parts and zones; it does not run */
    fsm_model model;
    fsm_timed_cover cover;
    bool has_choices; /* some timer has a choice of when to fire: else aLU is the subset relation */
    bool partial;     /* only states whose steps are kept are explored; the others have no steps and the marks `hoped` */
    uint32_t hoped;   /* a set of marks */
    bool exact;       /* for now, states are distinguished as by FSM_COVER_EQUAL and are no nodes */
    fsm_family *covers; /* by part: the states that no other one covers; `pair` is the node */
    uint32_t cover_room;
    size_t entry_room;  /* of all `covers` */
    fsm_timed_node *nodes; /* in the order in which they were found */
    uint32_t node_count, node_room;
    fsm_hash_map numbers;  /* of nodes, by state */
    fsm_timed_arc *arcs;
    size_t arc_count, arc_room;
    bool forgetful;     /* there is no room for more of them: what is enumerated again must be as before */
    fsm_timed_arrivals arrivals;
    fsm_state from;     /* the state whose steps are enumerated */
    fsm_state at;     /* that `moves` belong to */
    fsm_timed_move *moves;
    size_t move_count, move_room;
    fsm_lists marks;
    uint32_t *marks_of; /* by discrete part; FSM_NONE: not requested yet */
    uint32_t part_room;
    const char *failure;

    /* the state whose steps are enumerated, and where these go */
    uint32_t tuple[FSM_MOST_MACHINES + 1];
    uint32_t size;
    bool waits, stable; /* no machine has anything to do but to wait for its timers; and no timer has expired */
    fsm_bound *zone, *part, *other, *upper;
    fsm_limits *limits;
    fsm_steps *steps, again;
    uint32_t group;
    uint64_t running; /* see fsm_model.running; of the state that `moves` belong to */
} fsm_timed_model;

bool fsm_timed_model_init(fsm_timed_model *self, fsm_composition *composition, size_t memory_limit);
void fsm_timed_model_free(fsm_timed_model *self);

/* The node of a state, or NULL. */
const fsm_timed_node *fsm_timed_node_of(const fsm_timed_model *self, fsm_state state);

/* Whether its points are stable. */
bool fsm_timed_is_stable(fsm_state state);

/* Whether no other state covers a node. */
bool fsm_timed_is_maximal(const fsm_timed_model *self, fsm_state state);

/* Whether a zone covers that of another state of its part, in the sense of the model. */
bool fsm_timed_covers(fsm_timed_model *self, fsm_state big, fsm_state small);

/* Ends the exploration before all states were explored: only those have steps all of whose steps lead to `passed` states. The
 * others are said to have all of some marks, so what is violated then is violated. False if memory ran out. */
bool fsm_timed_be_partial(fsm_timed_model *self, const fsm_set *passed, const uint32_t *marks, uint32_t count);

/* A discrete part and points of it, before they are separated. */
typedef struct {
    const uint32_t *locals;
    uint32_t tuple, size;
    const fsm_limits *limits;
    const fsm_bound *zone;
} fsm_timed_points;

/* Restricts to the points in which no timer has expired; false if that is empty. */
bool fsm_timed_cut_stable(fsm_timed_model *self, const fsm_timed_points *at, fsm_bound *part);

/* The timer that was looked at last, and its machine, with the clocks of the machines before; at first all are 0. */
typedef struct {
    uint32_t machine, first, clock;
} fsm_timed_due;

/* Restricts to the points in which the next timer has expired, but none of its machine that was
 * armed earlier; false after the last. */
bool fsm_timed_cut_due(fsm_timed_model *self, const fsm_timed_points *at, fsm_timed_due *next, fsm_bound *part);

/* From now on states are distinguished by their zones; or not any more. */
void fsm_timed_be_exact(fsm_timed_model *self, bool exact);

/* The steps of a state, in `moves`. False if the model gave up. */
bool fsm_timed_model_look(fsm_timed_model *self, fsm_state state);

#endif
