/* fsm_link_fan.h: one link with a transport for fsmkit peers and translators for third-party ones.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 *   fsm_link_fan_open(&fan, &link);
 *   fsm_link_fan_add(&fan, RING_A_NODE_HEATER, send_can, &can);
 *   fsm_link_zmq_open(&zmq, &link, &options);       only if another node runs machines of fsmkit
 *   fsm_link_fan_start(&fan, 0);                    before the loop
 *   ...
 *   fsm_link_zmq_close(&zmq);
 *   fsm_link_fan_close(&fan);                       before translators are closed
 *
 * All frames of a node share one sequence of numbers, so every fsmkit peer receives all of them and
 * counts no gap. A translator receives each outgoing frame in the sending thread, and picks the parts
 * for its node. It converts what that node sends to frames and calls fsm_link_fan_arrive in its own
 * thread. The loop waits for none of them. POSIX: -pthread. */
#ifndef FSM_LINK_FAN_H
#define FSM_LINK_FAN_H

#include "fsm_link.h"

#include <pthread.h>
#include <semaphore.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Receive an outgoing frame: levels, or an event for any node. Must not wait. */
typedef void fsm_link_fan_send(void *translator, const fsm_link_frame *frame);

typedef struct {
    fsm_link *link;
    const fsm_link_transport *inner; /* of the fsmkit nodes; NULL: none */
    void *inner_carrier;
    struct {
        fsm_link_fan_send *send; /* NULL: not a third-party node */
        void *translator;
        uint32_t session, sequence, events; /* of the frames from it; events: number passed on */
    } peers[FSM_LINK_NODES];
    fsm_link_transport transport;
    pthread_mutex_t turn; /* held by threads that call fsm_link_arrive */
    sem_t work;
    fsm_shared stop;
    pthread_t sender;
    bool has_work, has_sender;
    uint32_t every_us; /* set before the start: the sender's period; the loop then wakes no thread */
} fsm_link_fan;

/* Initialize a fan for a link without transport; return 0, or an errno. */
int fsm_link_fan_open(fsm_link_fan *fan, fsm_link *link);

/* Add a translator for a third-party node, before a transport is opened. */
void fsm_link_fan_add(fsm_link_fan *fan, uint8_t peer, fsm_link_fan_send *send, void *translator);

/* Start the fan around the link's transport. Without a transport, a thread of the fan sends, with this
 * SCHED_FIFO priority if it is not 0: at the end of each cycle, which costs the loop a system call
 * (futex), or with `every_us` in its own period, which costs none. Return 0, or an errno. */
int fsm_link_fan_start(fsm_link_fan *fan, int priority);

/* Pass on a message of a third-party node: an event by its number, or FSM_LINK_LEVELS with all levels
 * of the node; docs/reference/links.md describes the payload. One thread for each peer. Return false
 * for a malformed message, which is counted. */
bool fsm_link_fan_arrive(fsm_link_fan *fan, uint8_t peer, uint16_t message, const uint8_t *payload,
                         uint16_t size);

/* Report lost events of the third-party node; the link counts them. */
void fsm_link_fan_missed(fsm_link_fan *fan, uint8_t peer, uint32_t events);

/* Report that the third-party node restarted: its next frames start a new session. */
void fsm_link_fan_restarted(fsm_link_fan *fan, uint8_t peer);

/* Detach from the link. */
void fsm_link_fan_close(fsm_link_fan *fan);

#ifdef __cplusplus
}
#endif

#endif
