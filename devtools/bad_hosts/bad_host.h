/* bad_host.h: what bad_host.c needs of each machine. The source of a machine X is included with
 * CALLED defined as X. */
#ifndef BAD_HOST_H
#define BAD_HOST_H

#include "fsm_info.h"

/* A machine that the host drives, with the calls that fsm_driver does not have. */
typedef struct {
    const char *name;
    const fsm_driver *driver;
    void *machine, *other;    /* two structs of the machine */
    void *event, *inner;      /* room for an event, and for one that an operation posts */
    uint8_t *saved, *again;   /* room for two snapshots */
    size_t saved_size;
    bool (*step)(void *m, uint32_t which); /* step_timer, step_event, step_eventless */
    void (*read)(const void *m, uint32_t number); /* everything that only reads */
} subject;

void host_call(const fsm_machine_info *info, uint32_t operation, const void *const *given,
               void *result);
void host_send(const fsm_machine_info *info, uint32_t event, const void *const *given);

#define CALLED_JOIN(X, name) X##name
#define CALLED_NAME(X, name) CALLED_JOIN(X, name)
#define CALLED_INFO (&CALLED_NAME(CALLED, _info))
#define FSM_HOST_CALL(m, operation, given, result)                                                 \
    ((void)(m), host_call(CALLED_INFO, operation, given, result))
#define FSM_HOST_SEND(m, event, given) ((void)(m), host_send(CALLED_INFO, event, given))

#endif
