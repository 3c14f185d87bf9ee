/* fair_sets.h: `leads_to` (liveness.h) over sets of states. What is fair is the same as in fairness.h, which see; of time that is
 * dense, and of turns, nothing is known here.
 *
 * Looked at are the states to which a way leads from one that asks, without an answer. A fair run that stays among
 * them either ends there, or it is in the greatest set Z such that from each state in Z
 *   - some step leads into Z;
 *   - a way in Z leads to a stable state;
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
    FSM_SET_UNANSWERED, /* reached from asking states without an answer, these among them */
    FSM_SET_ASKING,
    FSM_SET_STABLE,
    FSM_SET_UNSTABLE, /* empty unless the system is timeless */
    FSM_SET_ENDS,     /* a fair run may end here */
    FSM_SET_FAIR,     /* from here a fair run may stay */
    FSM_SET_ENDLESS,  /* the same without coming to a stable state */
    FSM_SET_HOPELESS, /* asking states that need not be answered; only some of them unless `has_all` */
    FSM_SETS
} fsm_set_name;

typedef struct {
    bool known, violated, has_all;
    bool unevaluated; /* not known since a condition could not be evaluated */
    size_t first_root;
} fsm_unanswered;

/* `asked`, `answer`: properties that mark states. `timeless`: see fsm_find_unanswered. Actions must be kept. Roots stay; if
 * it is not known, there are none. */
fsm_unanswered fsm_find_unanswered_sets(fsm_symbolic *symbolic, uint32_t asked, uint32_t answer, bool timeless);

static inline uint32_t fsm_set_of(const fsm_symbolic *symbolic, const fsm_unanswered *self, fsm_set_name name)
{
    return symbolic->mdd.roots[self->first_root + name];
}

static inline uint32_t fsm_set_where_possible(const fsm_symbolic *symbolic, const fsm_unanswered *self, uint32_t action)
{
    return symbolic->mdd.roots[self->first_root + FSM_SETS + action];
}

#endif
