/* fsm_link_zmq.h: links between nodes over ZeroMQ (libzmq), publish and subscribe.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 *   fsm_link_zmq_options options = {0};
 *   options.endpoints = ring_a_endpoints;          generated from the deployment; or your own
 *   error = fsm_link_zmq_open(&zmq, &link, &options);
 *   if (error != 0) fprintf(stderr, "%s: %s\n", zmq.failed, zmq_strerror(error));
 *   ...
 *   fsm_link_zmq_close(&zmq);
 *
 * Every node publishes at its own endpoint and subscribes to all others, in whatever order they are
 * started, and again when one comes back. A thread sends what the loop put into its ring and was
 * woken for by a semaphore; another receives. The loop never waits for them.
 *
 * Deterministic: frames go and come within calls only; see fsm_link.h. A thread does nothing but let
 * ZeroMQ subscribe again when a peer comes back. Compile with -lzmq -pthread. */
#ifndef FSM_LINK_ZMQ_H
#define FSM_LINK_ZMQ_H

#include "fsm_link.h"

#include <pthread.h>
#include <semaphore.h>

#ifdef __cplusplus
extern "C" {
#endif

#define FSM_LINK_KEY 41 /* characters of a CURVE key as text (Z85), with the zero */

typedef struct {
    const char *const *endpoints; /* [node], e.g. "tcp://127.0.0.1:5571" */
    const char *bind;             /* where to publish, e.g. "tcp://eth0:5571"; NULL: as above */
    bool is_deterministic;
    /* CURVE: all public keys by node, and this node's secret one; NULL: no authentication. Only
     * nodes with these keys are heard and can listen. */
    const char *const *public_keys;
    const char *secret_key;
    int send_priority; /* SCHED_FIFO of the threads; 0: leave it */
    int receive_priority;
} fsm_link_zmq_options;

typedef struct {
    fsm_link *link;
    const char *failed; /* what could not be done */
    int priority_error; /* why a priority was not granted, an errno; 0 if it was, or not asked for */
    void *context;
    void *publisher;
    void *subscribers[FSM_LINK_NODES];
    void *door; /* where connections are let in or refused, by key */
    bool is_deterministic;
    sem_t work;
    fsm_shared stop;
    fsm_shared listeners[FSM_LINK_NODES]; /* the session in which the peer listens, 0 for none */
    pthread_mutex_t turn; /* whose turn it is with the sockets, when deterministic */
    pthread_t sender, receiver, doorman, keeper;
    bool has_work, has_turn, has_sender, has_receiver, has_doorman, has_keeper;
    uint8_t keys[FSM_LINK_NODES][32];
} fsm_link_zmq;

/* Open; 0, or an errno of ZeroMQ or the system, with `failed` saying of what. Allocates (libzmq). */
int fsm_link_zmq_open(fsm_link_zmq *zmq, fsm_link *link, const fsm_link_zmq_options *options);

/* The session of a peer that is subscribed to this node; 0: it is not. */
uint32_t fsm_link_zmq_listener(const fsm_link_zmq *zmq, uint8_t peer);

/* Read a key out of a file as ZeroMQ's tools write them (name.key, name.key_secret): `kind` is
 * "public-key" or "secret-key". False if there is none. */
bool fsm_link_zmq_key(const char *path, const char *kind, char key[FSM_LINK_KEY]);

/* End the threads and close. The link may be opened again. */
void fsm_link_zmq_close(fsm_link_zmq *zmq);

#ifdef __cplusplus
}
#endif

#endif
