/* answers.h: temporal properties, decided over sets of states; properties and answers by option
 * of main.c. */
#ifndef FSM_ANSWERS_H
#define FSM_ANSWERS_H

#include "liveness/fair_sets.h"
#include "paths/symbolic_paths.h"

typedef struct {
    const char *option, *argument;
    bool known, violated;
    const char *why;     /* why it is unknown; else NULL */
    bool longer;         /* `path` need not be a shortest one */
    fsm_path path, cycle;
    size_t lost;         /* `recoverable`: the root that is the states from which none can be reached */
    fsm_fair_sets sets; /* `leads_to` */
} fsm_answer;

typedef struct {
    fsm_answer *items;
    uint32_t count;
    bool timeless; /* see fsm_find_violations */
} fsm_answers;

/* `options`: options and what follows them, in pairs. False if memory ran out. */
bool fsm_answers_init(fsm_answers *self, const char *const *options, uint32_t count, bool timeless);
void fsm_answers_free(fsm_answers *self);

/* Whether actions must be kept for it (symbolic.h). */
bool fsm_answers_need_actions(const fsm_answers *self);

/* Decides all properties over all states of a system; sets that show violations stay roots.
 * `within` is not decided. */
void fsm_answers_decide(fsm_answers *self, fsm_symbolic *symbolic);
bool fsm_answers_are_known(const fsm_answers *self);

/* Paths to the violations; those that are not found stay empty. */
void fsm_answers_find_paths(fsm_answers *self, const fsm_path_context *ways);

/* In the order of the options. */
void fsm_answers_print(const fsm_answers *self);

#endif
