/* ranks.h: breadth-first exploration by several processes (MPI), each with a part of the states.
 *
 * A state belongs to the rank that its hash names (dictionary.h), which alone keeps it in its set. Layers are expanded in step:
 * each rank expands its own states of the layer; a state of another rank goes there, unless it was sent lately. So all distances
 * are those of one process, and so are all counts. Layers are kept as stops, as in search.h, a part in each rank; each state of a
 * layer knows by which state of the stop before it came, in whichever rank. */
#ifndef FSM_RANKS_H
#define FSM_RANKS_H

#include "mpi/dictionary.h"
#include "mpi/exchange.h"
#include "report.h"

enum { FSM_LATELY_BITS = 16, FSM_LATELY = 1 << FSM_LATELY_BITS };

/* A state of a layer, its ancestor's place in the stop before, and the footprint of the step by which it was found. */
typedef struct {
    fsm_state state;
    uint32_t place;
    uint16_t rank;
    fsm_footprint_number footprint;
} fsm_member;

typedef struct {
    fsm_region region; /* of members */
    size_t count, seen;
} fsm_members;

typedef struct {
    uint32_t depth, count;
    fsm_member *members;
} fsm_stop;

/* A state to be added to the set, while its bucket is prefetched from memory. */
typedef struct {
    fsm_member member;
    fsm_shard *shard;
    uint64_t home;
    uint32_t edition;
    bool internal;
} fsm_pending;

enum { FSM_PENDING = 64 };

/* The first place in this rank where a mark was seen. */
typedef struct {
    fsm_member at;           /* at.state is FSM_NO_STATE: the mark is of an initial step, place is its ordinal */
    uint32_t depth, stop, step; /* step: FSM_NONE if the state itself is marked */
    uint64_t count;
} fsm_sight;

typedef struct {
    fsm_composition *composition;
    const fsm_model *model;
    fsm_pace *pace;
    size_t memory;
    bool sleepless, livelock;
    const bool *awaited; /* by mark; NULL: none */
    uint32_t awaited_count;
    const char *folder; /* of the saved data; NULL: nothing is saved */
    const char *identity; /* of the program, to be saved with it */
    uint32_t save_every; /* layers */
} fsm_ranks_options;

typedef struct {
    fsm_ranks_options options;
    fsm_composition *composition;
    const fsm_model *model;
    fsm_dictionary words;
    fsm_exchange exchange;
    uint32_t rank, ranks;

    fsm_set passed;
    fsm_members layers[2];
    uint32_t depth;
    fsm_stop *stops;
    uint32_t stop_count, interval;
    uint64_t stop_members;
    fsm_sight *sights; /* by mark */
    fsm_state *lately; /* FSM_LATELY states of others that were sent, each where its hash says */
    uint64_t expanded, transitions, sent_states, filtered; /* sent_states: states sent to other ranks */
    uint64_t all_states, all_transitions;           /* of all ranks, when the layer started */
    bool maybe_cyclic;
    fsm_outcome outcome;
    fsm_state target;  /* a state of this rank to be found; FSM_NO_STATE: none */
    fsm_sight found;
    fsm_steps steps;
    fsm_pending pending[FSM_PENDING];
    uint32_t first_pending, pending_count;
    struct fsm_saved *saved;
} fsm_ranks;

/* Prints the result, in rank 0, and returns the exit code. MPI is initialised and finalised
 * here. */
int fsm_ranks_explore(const fsm_ranks_options *options);

static inline fsm_member *fsm_members_of(const fsm_members *self)
{
    return self->region.base;
}

bool fsm_ranks_stop(fsm_ranks *self, fsm_outcome outcome); /* false */
size_t fsm_ranks_bytes(const fsm_ranks *self);
bool fsm_ranks_keep_on(fsm_ranks *self);                   /* whether time and memory last */
bool fsm_ranks_add(fsm_ranks *self, fsm_members *layer, fsm_member member);
fsm_outcome fsm_ranks_agree(fsm_ranks *self); /* the worst outcome of all, which from now on is everybody's */
uint64_t fsm_ranks_sum(uint64_t own);

/* Explores from the initial states on, or from where it is. */
void fsm_ranks_run(fsm_ranks *self, bool begins);
void fsm_ranks_forget(fsm_ranks *self); /* all states */

/* stops.c: keeps the layer that is about to be expanded as a stop; and drops some where they become many. */
bool fsm_stops_keep(fsm_ranks *self, fsm_members *layer);
bool fsm_stops_thin_out(fsm_ranks *self, fsm_members *layer);

/* trimming.c: a state on a cycle of internal steps, in one rank, which then has it as target; `*cyclic` in all. False if
 * memory ran out. */
bool fsm_ranks_find_livelock(fsm_ranks *self, bool *cyclic);

/* saved.c: what was found so far, in a folder, by layers. */
bool fsm_saved_open(fsm_ranks *self, uint32_t *depth); /* depth: FSM_NONE if nothing is saved yet */
bool fsm_saved_layer(fsm_ranks *self, const fsm_members *layer);
bool fsm_saved_commit(fsm_ranks *self, fsm_members *layer);
void fsm_saved_close(fsm_ranks *self, bool is_over); /* over: nothing is to go on, and all is removed */

#endif
