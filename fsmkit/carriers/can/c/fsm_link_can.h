/* fsm_link_can.h: a foreign node on a CAN bus: its messages as events and levels of a link.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 *   fsm_link_fan_open(&fan, &link);
 *   fsm_link_can_open(&can, &fan, &ring_a_can_heater, "can0");      the tables of ring_a_can.h
 *   fsm_link_fan_start(&fan, 0);                                    and the loop (fsm_link_fan.h)
 *   ...
 *   fsm_link_fan_close(&fan);
 *   fsm_link_can_close(&can);
 *
 * Events are sent as they leave; levels in the cycle of their message, once the machines have run. A
 * message that has not come for 2.5 cycles is silent: its event is posted once; when messages come
 * again after all were silent, a session starts. A frame whose values are out of range counts as
 * malformed. A thread receives and sends cyclic messages; the loop calls nothing of it. It stops
 * sending when the loop completes no cycle within the bound of the deployment (fsm_watch.h), and
 * resumes with the next cycle. POSIX. */
#ifndef FSM_LINK_CAN_H
#define FSM_LINK_CAN_H

#include "fsm_can_bus.h"
#include "fsm_link_fan.h"

#ifdef __cplusplus
extern "C" {
#endif

#ifndef FSM_LINK_CAN_MESSAGES /* of a foreign node in each direction */
#define FSM_LINK_CAN_MESSAGES 64
#endif

typedef enum {
    FSM_LINK_CAN_RECEIVED,   /* frames with an identifier of the tables */
    FSM_LINK_CAN_SENT,       /* frames that the bus took */
    FSM_LINK_CAN_UNSENT,     /* frames that it did not take: they are lost */
    FSM_LINK_CAN_REFUSED,    /* values out of range, or cut off */
    FSM_LINK_CAN_BUS_ERRORS, /* error frames */
    FSM_LINK_CAN_BUS_OFF,    /* those that say that the controller has left the bus */
    FSM_LINK_CAN_COUNTS
} fsm_link_can_counter;

typedef struct {
    const fsm_can_node *node;
    fsm_link_fan *fan;
    fsm_can_bus bus;
    pthread_t thread;
    pthread_mutex_t turn; /* of the thread and of the one that sends events */
    int stop[2];
    bool has_thread;
    bool has_levels;                  /* of this node; guarded, as those that follow */
    uint8_t own[FSM_LINK_BYTES];      /* them */
    uint32_t counts[FSM_LINK_CAN_COUNTS];
    uint8_t levels[FSM_LINK_BYTES]; /* of the foreign node; the thread's own, as those that follow */
    fsm_watch watch; /* of the loop */
    uint64_t due_ms[FSM_LINK_CAN_MESSAGES];
    uint64_t heard_ms[FSM_LINK_CAN_MESSAGES];
    bool is_silent[FSM_LINK_CAN_MESSAGES];
} fsm_link_can;

/* Join a foreign node to a fan that is not started yet, by a bus (fsm_can_bus.h). 0, or an errno. */
int fsm_link_can_open(fsm_link_can *can, fsm_link_fan *fan, const fsm_can_node *node,
                      const char *bus);

uint32_t fsm_link_can_count(fsm_link_can *can, fsm_link_can_counter what);

/* Leave the bus; after the fan is closed. */
void fsm_link_can_close(fsm_link_can *can);

#ifdef __cplusplus
}
#endif

#endif
