/* fairness.h: the core of `leads_to` (liveness.h): components that contain a fair run, and that
 * run. */
#ifndef FSM_FAIRNESS_H
#define FSM_FAIRNESS_H

#include "liveness/counterexample.h"
#include "search/scc.h"

/* Flags of places. */
enum {
    FSM_ANSWERED = 1,
    FSM_REQUESTED = 2,    /* without a response so far */
    FSM_STABLE = 4,   /* known only of timeless systems */
    FSM_HOPELESS = 8, /* a request that may stay without a response */
    FSM_ENDS = 16,    /* a run may end here */
    FSM_FAIR = 32,    /* in a component in which a fair run may stay */
    FSM_ENDLESS = 64  /* the same without ever coming to a stable state */
};

typedef struct {
    fsm_search *search;
    unsigned char *flags, outside;
    bool unstable; /* the current components are of unstable states */
    bool violated, failed;
    fsm_steps steps;
    uint32_t *actions; /* of `steps` */
    uint64_t *ended;   /* and which machines' first timers they end */
    size_t action_room;
    uint64_t looks;    /* visited states, to check the limits now and then */
    uint64_t running;  /* machines with timers that must end, at the state looked at */
    /* sets of actions: a byte for each */
    unsigned char *here, *always, *taken;
} fsm_fairness;

bool fsm_fairness_init(fsm_fairness *self, fsm_search *search);
void fsm_fairness_free(fsm_fairness *self);

bool fsm_fairness_flag_stable(fsm_fairness *self);

/* Whether a fair run may stay in a component that is about to be completed; flags its states if so. */
bool fsm_fairness_evaluate(fsm_fairness *self, const fsm_components *all, const uint64_t *places, size_t count);

/* Builds a run: to the nearest hopeless state, on without a response, and around a cycle. */
bool fsm_fairness_lasso(fsm_fairness *self, const fsm_components *stable, const fsm_components *unstable,
                        fsm_lasso *found);

#endif
