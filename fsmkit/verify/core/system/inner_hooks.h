/* inner_hooks.h: what the explorer listens to in a machine in a slot, included before its source with FSM_PATH, the
 * slots in which it lies. Its states and transitions are not those of the machine that is explored. */
#undef FSM_HOOK_BEGIN
#undef FSM_HOOK_EXIT
#undef FSM_HOOK_TAKE
#undef FSM_HOOK_ENTER
#undef FSM_HOOK_EVENT
#undef FSM_HOOK_TEXT
#define FSM_HOOK_BEGIN(m, cause, index) ((void)(m))
#define FSM_HOOK_EXIT(m, state) ((void)(m), fsm_note_line(FSM_PATH "-", (uint32_t)(state)))
#define FSM_HOOK_TAKE(m, transition) ((void)(m), fsm_note_line(FSM_PATH "t", (uint32_t)(transition)))
#define FSM_HOOK_ENTER(m, state) ((void)(m), fsm_note_line(FSM_PATH "+", (uint32_t)(state)))
#define FSM_HOOK_EVENT(m, what, e) FSM_UNUSED_2(m, e)
#define FSM_HOOK_TEXT(m, what, text, number)                                                       \
    ((void)(m), (void)(text), (void)(number), (what) == FSM_FULL ? fsm_note_text(FSM_NOTE_FULL, FSM_PATH "full", text)                      \
     : (what) == FSM_FAULT ? fsm_note_text(FSM_NOTE_FAULT, FSM_PATH "fault", text)                 \
                           : (void)0)
