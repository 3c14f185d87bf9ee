/* hooks.h: what the explorer listens to in generated code (-DFSM_HOOKS='"hooks.h"'). */
#ifndef FSM_EXPLORER_HOOKS_H
#define FSM_EXPLORER_HOOKS_H

#include "system/notes.h"
#include "system/recorder.h"

#define FSM_HOOK_BEGIN(m, cause, index)                                                            \
    ((cause) == FSM_START && fsm_recording.begin != NULL ? fsm_recording.begin(m) : (void)0)
#define FSM_HOOK_EXIT(m, state) ((void)(m), fsm_note_line("-", (uint32_t)(state)))
#define FSM_HOOK_TAKE(m, transition)                                                               \
    ((void)(m), fsm_note_budget(FSM_MICROSTEPS_LEFT(m)), fsm_note_taken((uint32_t)(transition)))
#define FSM_HOOK_ENTER(m, state)                                                                   \
    ((void)(m), fsm_note_budget(FSM_MICROSTEPS_LEFT(m)), fsm_note_entered((uint32_t)(state)))
#define FSM_HOOK_EVENT(m, what, e)                                                                 \
    ((void)(m), (void)(e), (what) == FSM_UNHANDLED ? fsm_note_unhandled((uint32_t)(e)->event - 1u)                       \
     : (what) == FSM_TAKEN   ? fsm_note_occurs((uint32_t)(e)->event - 1u, e)                          \
                             : (void)0)
#define FSM_HOOK_INPUT(m, number) (fsm_note_read(number), (m))
#define FSM_HOOK_LEFT(m, type, number, peer) ((void)(m))
#define FSM_HOOK_TEXT(m, what, text, number)                                                       \
    ((void)(m), (void)(text), (void)(number), (what) == FSM_FULL ? fsm_note_text(FSM_NOTE_FULL, "full", text)                               \
     : (what) == FSM_FAULT ? fsm_note_text(FSM_NOTE_FAULT, "fault", text)                          \
                           : (void)0)

#endif
