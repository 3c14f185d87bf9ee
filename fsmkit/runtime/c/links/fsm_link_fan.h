/* fsm_link_fan.h: one link with a carrier for each peer: frames to nodes of fsmkit, translators to
 * foreign ones.
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
 * All frames of a node are numbered in one sequence, so every peer of fsmkit receives all of them
 * and counts no gap. A translator sees each frame that goes out, in the thread that sends, and takes
 * of it what concerns its node; for what comes from there it makes frames and calls
 * fsm_link_fan_arrive, in a thread of its own. The loop waits for none of them. POSIX: -pthread. */
#ifndef FSM_LINK_FAN_H
#define FSM_LINK_FAN_H

#include "fsm_link.h"

#include <pthread.h>
#include <semaphore.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Take a frame that goes out: levels, or an event for whichever node. Must not wait. */
typedef void fsm_link_fan_send(void *translator, const fsm_link_frame *frame);

typedef struct {
    fsm_link *link;
    const fsm_link_transport *inner; /* of the nodes of fsmkit; NULL: there is none */
    void *inner_carrier;
    struct {
        fsm_link_fan_send *send; /* NULL: no foreign node */
        void *translator;
        uint32_t session, sequence, events; /* of the frames made for it; events: handed on so far */
    } peers[FSM_LINK_NODES];
    fsm_link_transport transport;
    pthread_mutex_t turn; /* of the threads that call fsm_link_arrive */
    sem_t work;
    fsm_shared stop;
    pthread_t sender;
    bool has_work, has_sender;
    uint32_t every_us; /* set it before the start: the thread sends so often, and the loop wakes nobody */
} fsm_link_fan;

/* Make a fan of a link that nothing carries yet; 0, or an errno. */
int fsm_link_fan_open(fsm_link_fan *fan, fsm_link *link);

/* Let a translator serve a foreign node. Before a transport is opened. */
void fsm_link_fan_add(fsm_link_fan *fan, uint8_t peer, fsm_link_fan_send *send, void *translator);

/* Begin, around the transport that the link has; without one a thread of the fan sends, with this SCHED_FIFO
 * priority if it is not 0: when a cycle ends, which costs the loop a call of the system (futex), or with
 * `every_us` in periods of its own, which costs none. 0, or an errno. */
int fsm_link_fan_start(fsm_link_fan *fan, int priority);

/* Something came from a foreign node: an event by its number, or FSM_LINK_LEVELS with all levels of
 * the node; the payload as docs/reference/links.md has it. One thread for each peer. Whether it was
 * taken for what it says; else it counts as malformed. */
bool fsm_link_fan_arrive(fsm_link_fan *fan, uint8_t peer, uint16_t message, const uint8_t *payload,
                         uint16_t size);

/* The foreign node sent so many events that never came: the link counts them as lost. */
void fsm_link_fan_missed(fsm_link_fan *fan, uint8_t peer, uint32_t events);

/* What the foreign node sends next is of another run of it: its frames begin a new session. */
void fsm_link_fan_restarted(fsm_link_fan *fan, uint8_t peer);

/* Leave the link. */
void fsm_link_fan_close(fsm_link_fan *fan);

#ifdef __cplusplus
}
#endif

#endif
