/* fsm_save.h: a machine as bytes, and back, whatever machine it is.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 * A host calls X_save and X_restore of its machine X. */
#ifndef FSM_SAVE_H
#define FSM_SAVE_H

#include "fsm_info.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Write a machine, timers with the time they have left; false from within a step. */
bool fsm_save(const fsm_machine_info *info, const void *m, uint32_t now, uint8_t *bytes);

/* The reverse; bytes that are refused leave the machine as it is, or as it was made. */
fsm_restored fsm_restore(const fsm_machine_info *info, void *m, uint32_t now, const uint8_t *bytes,
                         size_t size);

#ifdef __cplusplus
}
#endif

#endif
