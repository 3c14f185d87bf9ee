/* timed.h: breadth-first exploration in dense time: pairs of a discrete part, which is a local state of
 * each machine, and a zone over the clocks of all armed timers.
 *
 * A clock is the time since its timer was armed; the timers of a machine lie in its local state in the
 * order in which they were armed, with their durations (or the least and the greatest). A timer fires
 * when its duration has passed, after those of the same machine that were armed earlier and are due as
 * well; or, if it has a choice, any time between the two, at the latest at the greatest. Time passes only where no machine has something to do; the
 * zones kept are those after it has passed. A pair is passed over where a zone kept for the same
 * discrete part covers it; it is evaluated and counted once for each discrete part.
 *
 * Paths are shortest in the number of steps; the passing of time is no step. */
#ifndef FSM_TIMED_H
#define FSM_TIMED_H

#include "system/flat.h"
#include "system/system_model.h"
#include "search/search.h"
#include "zones/zones.h"

/* The first step to a pair. An initial pair has no `from`. */
typedef struct {
    uint32_t from; /* FSM_NONE: initial */
    uint32_t step; /* ordinal among the steps of `from`, or among the initial ones */
} fsm_origin;

/* The first, and so a nearest, place where a mark was seen. */
typedef struct {
    uint32_t state; /* the pair; FSM_NONE with step FSM_NONE: never; else FSM_NONE is "before the start" */
    uint32_t step;  /* ordinal of the marked step of the pair; FSM_NONE: the pair itself is marked */
    uint64_t count;
} fsm_timed_witness;

/* A pair that was reached. */
typedef struct {
    uint32_t tuple;      /* number of the discrete part */
    uint32_t zone;       /* of those of its size */
    fsm_origin origin;
    bool covered;        /* by one found later, before it was its turn */
} fsm_pair;

/* The pairs of one discrete part that no other covers. */
typedef struct {
    fsm_zone_summary summary;
    uint32_t zone, pair;
} fsm_entry;

typedef struct {
    fsm_entry *entries;
    uint32_t count, room;
} fsm_family;

/* Adds an entry; adds to `all_room` the entries for which memory was allocated. False: out of memory. */
bool fsm_family_add(fsm_family *family, fsm_entry entry, size_t *all_room);

/* A step of a pair, while it is being taken. */
typedef struct {
    const uint32_t *tuple;    /* where it leads: local states, then, if there is a watch, whether it runs */
    const fsm_bound *zone;    /* the same, with time passed as far as it may */
    uint32_t size;            /* clocks and one */
    const fsm_limits *limits; /* of the clocks; NULL: none has a choice of when to fire */
    const uint32_t *marks;
    uint32_t mark_count;
    fsm_kind kind;
    bool waits;               /* time could pass before the step */
    bool fires;               /* a timer: not all points of the zone can take it */
    bool instant;             /* and its duration is 0 */
    uint32_t number;          /* of the local step */
    fsm_description what;
    fsm_bound arrival_least, arrival_most; /* of the watch when it was stopped by the step */
    bool stops;
} fsm_timed_step;

/* Receives a step; false ends the enumeration. */
typedef bool fsm_timed_visit(void *context, const fsm_timed_step *step);

/* An extra clock: it may start when the property `begin` starts to hold, and stops when `end`
 * holds next. Beyond `most` it only counts as more. */
typedef struct {
    bool present;
    uint32_t begin, end; /* numbers of properties */
    int32_t most;        /* in units */
    bool stopped;        /* it did, at least once */
    fsm_bound least;     /* the tightest bound on minus the time when it stopped */
    fsm_bound greatest;  /* the widest bound on the time when it stopped */
    fsm_bound pending;   /* the widest bound on the time while it runs */
} fsm_watch;

typedef struct fsm_timed fsm_timed;

struct fsm_timed {
    fsm_composition *composition;
    size_t memory_limit;
    bool (*keep_on)(fsm_timed *); /* called now and then; sets `outcome` to stop; may be NULL */
    void *context;                /* for `keep_on` */
    int32_t unit;                 /* ticks: the bounds of zones count units */
    fsm_watch watch;

    fsm_store tuples;
    fsm_family *families;         /* by tuple */
    uint32_t family_room;
    size_t entry_room;            /* of all families */
    fsm_zones zones;
    fsm_pair *pairs;
    uint32_t pair_count, pair_room, kept; /* found; those that none covers */
    uint32_t next, step, depth, layer_end;
    uint64_t transitions;
    bool internal_back_edge;      /* some step that takes no time led to a discrete part no newer */
    size_t bytes;                 /* at the last check */
    fsm_timed_witness *witnesses;
    bool *awaited;                /* by mark; NULL: explore everything */
    uint32_t awaited_count;
    fsm_outcome outcome;
    const char *failure;

    fsm_hash_map fires;               /* (machine, local state, timer) -> (first step, count) */
    uint32_t *marks, *evaluated;     /* of the current step, of the discrete part it leads to */
    const fsm_description *starts; /* how the machines started, while an initial pair is visited */
    /* room for the zone a step starts from, after its guard, and where it leads; for bounds and limits */
    fsm_bound *before, *guarded, *after, *upper;
    fsm_limits *limits, *next_limits;
    uint32_t *source;
    uint32_t current[FSM_MOST_MACHINES + 1], following[FSM_MOST_MACHINES + 1];
};

bool fsm_timed_init(fsm_timed *self, fsm_composition *composition, size_t memory_limit);
void fsm_timed_free(fsm_timed *self);

/* Explores until everything is known or a limit is met; says so in `outcome`. */
void fsm_timed_run(fsm_timed *self);

/* Enumerate the initial pairs, and the steps of a pair, in a fixed order. `at_once`: no time passes,
 * neither before nor after a step. False if `visit` was, or the model gave up. */
bool fsm_timed_initial(fsm_timed *self, fsm_timed_visit *visit, void *context);
bool fsm_timed_successors(fsm_timed *self, const uint32_t *tuple, const fsm_bound *zone, bool at_once,
                          fsm_timed_visit *visit, void *context);

/* Whether time may pass in a discrete part: no machine has anything to do but to wait for its timers. False if the
 * model gave up. */
bool fsm_timed_may_wait(fsm_timed *self, const uint32_t *tuple, bool *waits);

/* Writes the limits of all clocks of a discrete part, and says in `*choice` whether some timer has a choice of when
 * to fire. The watch is compared up to its limit. */
bool fsm_timed_limits(fsm_timed *self, const uint32_t *tuple, fsm_limits *limits, bool *choice);

/* Returns the number of a machine's armed timers in a discrete part. */
uint32_t fsm_timed_armed(const fsm_timed *self, const uint32_t *tuple, uint32_t machine);

/* A step that is looked for by its number, and where it leads. */
typedef struct {
    uint32_t wanted, at, ordinal, size; /* `ordinal` stays as it was if there is no such step */
    bool initial;                       /* by its place among the initial ones instead */
    uint32_t machines, tuple[FSM_MOST_MACHINES + 1];
    fsm_bound *zone;
} fsm_timed_sought;

bool fsm_timed_pick(void *sought, const fsm_timed_step *step);

/* The clocks of a discrete part, and one. */
uint32_t fsm_timed_size(const fsm_timed *self, const uint32_t *tuple);

/* A stored pair that covers the target of a step; FSM_NONE: no pair does. */
uint32_t fsm_timed_find(fsm_timed *self, const fsm_timed_step *step);

size_t fsm_timed_bytes(const fsm_timed *self);
uint32_t fsm_timed_path(const fsm_timed *self, uint32_t pair, uint32_t *path);

static inline uint32_t fsm_timed_machines(const fsm_timed *self)
{
    return self->composition->system->machine_count;
}

/* Whether the watch runs in a discrete part. */
static inline bool fsm_timed_watches(const fsm_timed *self, const uint32_t *tuple)
{
    return tuple[fsm_timed_machines(self)] != 0;
}

static inline const uint32_t *fsm_timed_tuple(const fsm_timed *self, uint32_t pair)
{
    return fsm_store_at(&self->tuples, self->pairs[pair].tuple);
}

#endif
