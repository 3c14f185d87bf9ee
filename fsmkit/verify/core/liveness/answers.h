/* answers.h: temporal properties, decided over sets of states; what is asked and answered, by option of main.c. */
#ifndef FSM_ANSWERS_H
#define FSM_ANSWERS_H

#include "liveness/fair_sets.h"
#include "ways/ways.h"

typedef struct {
    const char *option, *argument;
    bool known, violated;
    const char *why;     /* it is not known; else NULL */
    bool longer;         /* `path` need not be a shortest one */
    fsm_path path, cycle;
    size_t lost;         /* `recoverable`: the root that is the states from which none can be reached */
    fsm_unanswered sets; /* `leads_to` */
} fsm_answer;

typedef struct {
    fsm_answer *items;
    uint32_t count;
    bool timeless; /* see fsm_find_unanswered */
} fsm_answers;

/* `options`: options and what follows them, in pairs. False if memory ran out. */
bool fsm_answers_init(fsm_answers *self, const char *const *options, uint32_t count, bool timeless);
void fsm_answers_free(fsm_answers *self);

/* Whether actions must be kept for it (symbolic.h). */
bool fsm_answers_need_actions(const fsm_answers *self);

/* Decides all, of all states of a system; sets that show violations stay roots. Nothing is known of `within`. */
void fsm_answers_decide(fsm_answers *self, fsm_symbolic *symbolic);
bool fsm_answers_are_known(const fsm_answers *self);

/* Ways to where they are violated; those that are not found stay empty. */
void fsm_answers_find_ways(fsm_answers *self, const fsm_ways *ways);

/* In the order of the options. */
void fsm_answers_print(const fsm_answers *self);

#endif
