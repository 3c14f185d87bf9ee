/* fsm_save.h: save any machine to bytes, and restore it.
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

/* Save a machine, with the remaining time of its timers; return false within a step. */
bool fsm_save(const fsm_machine_info *info, const void *m, uint32_t now, uint8_t *bytes);

/* Restore a machine; rejected bytes leave it unchanged, or as initialized. */
fsm_restored fsm_restore(const fsm_machine_info *info, void *m, uint32_t now, const uint8_t *bytes,
                         size_t size);

#ifdef __cplusplus
}
#endif

#endif
