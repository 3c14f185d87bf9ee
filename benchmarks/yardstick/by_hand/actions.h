/* The actions of states: each entry and each exit counts. The driver's hooks see their order. */
#ifndef ACTIONS_H
#define ACTIONS_H

#ifndef FSM_HOOK_ENTER
#define FSM_HOOK_ENTER(m, state) ((void)0)
#define FSM_HOOK_EXIT(m, state) ((void)0)
#endif

#define COUNT_ENTRY(state) (m->data.c[2 * (state)]++, FSM_HOOK_ENTER(m, state))
#define COUNT_EXIT(state) (m->data.c[2 * (state) + 1]++, FSM_HOOK_EXIT(m, state))

#endif
