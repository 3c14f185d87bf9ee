/* hooks.h: all hooks of a generated machine lead to endurance.c. */
#ifndef ENDURANCE_HOOKS_H
#define ENDURANCE_HOOKS_H

#define FSM_HOOK_BEGIN(m, cause, index) noted_begin(m, cause, (unsigned)(index))
#define FSM_HOOK_END(m) noted_end(m)
#define FSM_HOOK_EXIT(m, state) noted_exit(m, (unsigned)(state))
#define FSM_HOOK_TAKE(m, transition) noted_take(m, (unsigned)(transition))
#define FSM_HOOK_ENTER(m, state) noted_enter(m, (unsigned)(state))
#define FSM_HOOK_EVENT(m, what, e) noted_event(m, what, (unsigned)(e)->event)
#define FSM_HOOK_TEXT(m, what, text, number) noted_text(m, what, text)
#define FSM_HOST_CALL(m, operation, given, result) \
    ((void)(given), call_back(m, operation, result))
#define FSM_HOST_SEND(m, event, given) ((void)(m), (void)(given))

#endif
