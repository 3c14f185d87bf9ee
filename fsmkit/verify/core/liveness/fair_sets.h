/* fair_sets.h: `leads_to` (liveness.h) over sets of states. Fairness is defined in fairness.h. Dense time and turns are not
 * supported here.
 *
 * The search covers the states on paths from a request without a response. A fair run that stays among
 * them either ends there, or it is in the greatest set Z such that from each state in Z
 *   - some step leads into Z;
 *   - a path in Z leads to a stable state;
 *   - for each action a way in Z leads to a stable state where it is not possible, or through a step of it
 * (Emerson, Lei 1986, "Efficient model checking in fragments of the propositional mu-calculus"). A run that stays in Z can
 * go to each of these again and again; and the states of a fair run have the three properties, so they are all in Z. In a system
 * without time the same counts among states that are not stable, without the second line and with all states in the
 * third. Each way is found by a closure backwards; the three are applied in turn until none takes anything away. */
#ifndef FSM_FAIR_SETS_H
#define FSM_FAIR_SETS_H

#include "symbolic/symbolic.h"

/* Sets, which are roots. Then those in which each action is possible, by number. */
typedef enum {
    FSM_SET_OPEN, /* reached from requests without a response, these included */
    FSM_SET_REQUESTS,
    FSM_SET_STABLE,
    FSM_SET_UNSTABLE, /* empty unless the system is timeless */
    FSM_SET_ENDS,     /* a fair run may end here */
    FSM_SET_FAIR,     /* from here a fair run may stay */
    FSM_SET_ENDLESS,  /* the same without coming to a stable state */
    FSM_SET_HOPELESS, /* requests that may stay without a response; only some of them unless
                       * `has_all` */
    FSM_SETS
} fsm_set_name;

typedef struct {
    bool known, violated, has_all;
    bool unevaluated; /* not known since a condition could not be evaluated */
    size_t first_root;
} fsm_fair_sets;

/* `request`, `response`: properties that mark states. `timeless`: see fsm_find_violations.
 * Actions must be kept. Roots stay; if the result is unknown, there are no roots. */
fsm_fair_sets fsm_find_fair_sets(fsm_symbolic *symbolic, uint32_t request, uint32_t answer, bool timeless);

static inline uint32_t fsm_set_of(const fsm_symbolic *symbolic, const fsm_fair_sets *self, fsm_set_name name)
{
    return symbolic->mdd.roots[self->first_root + name];
}

static inline uint32_t fsm_set_where_possible(const fsm_symbolic *symbolic, const fsm_fair_sets *self, uint32_t action)
{
    return symbolic->mdd.roots[self->first_root + FSM_SETS + action];
}

#endif
