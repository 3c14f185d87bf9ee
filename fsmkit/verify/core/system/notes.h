/* notes.h: what the hooks of generated code (hooks.h) note of the machine whose step is recorded. The code includes this
 * before the types of its table are known. */
#ifndef FSM_NOTES_H
#define FSM_NOTES_H

#include <stdint.h>

void fsm_note_taken(uint32_t transition);
void fsm_note_entered(uint32_t state);
void fsm_note_unhandled(uint32_t event);
void fsm_note_occurs(uint32_t number, const void *event);
void fsm_note_read(uint32_t input); /* an input is about to be read; it is chosen now at the latest */

#endif
