#include "system/notes.h"

#include "system/machine.h"

static void note_covered(uint32_t number)
{
    const fsm_machine *of = fsm_recording.machine;
    if (of->covered > 0)
        fsm_note_mark(FSM_NOTE_UNHANDLED + 2u * of->info->event_count + number);
}

void fsm_note_taken(uint32_t transition)
{
    fsm_recording.took = true;
    fsm_recording.transitions_seen[transition] = 1;
    note_covered(transition);
    fsm_note_line("t", transition);
}

void fsm_note_entered(uint32_t state)
{
    fsm_recording.states_seen[state] = 1;
    note_covered(fsm_recording.machine->covered + state);
    fsm_note_line("+", state);
}

void fsm_note_unhandled(uint32_t event)
{
    if (fsm_recording.machine->noted[event] != 0)
        fsm_note_mark(FSM_NOTE_UNHANDLED + event);
}

void fsm_note_occurs(uint32_t number, const void *event)
{
    const fsm_machine *of = fsm_recording.machine;
    if (of->by_property != NULL && of->by_property[number] != 0)
        fsm_note_mark(FSM_NOTE_UNHANDLED + of->info->event_count + number);
    if (of->by_monitor != NULL && of->by_monitor[number] != 0)
        fsm_note_observed(of, number, event);
}

void fsm_note_read(uint32_t input)
{
    const fsm_machine *of = fsm_recording.machine;
    const uint32_t place = of->read_inputs == NULL ? 0u : of->read_inputs[input];
    if (place == 0u || fsm_recording.read[place - 1u])
        return;
    fsm_recording.read[place - 1u] = true;
    fsm_set_free_input(of, fsm_recording.state, place - 1u, fsm_choose_for(of->free_inputs[place - 1u].count, place - 1u));
}
