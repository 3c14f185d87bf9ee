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
 * Deterministic: no thread; see fsm_link.h. Compile with -lzmq -pthread. */
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
    bool is_deterministic;
    /* CURVE: all public keys by node, and this node's secret one; NULL: no authentication. Only
     * nodes with these keys are heard and can listen. */
    const char *const *public_keys;
    const char *secret_key;
    int send_priority;    /* SCHED_FIFO of the threads; 0: leave it */
    int receive_priority;
} fsm_link_zmq_options;

typedef struct {
    fsm_link *link;
    const char *failed; /* what could not be done */
    void *context;
    void *publisher;
    void *subscribers[FSM_LINK_NODES];
    bool is_deterministic;
    bool is_open;
    bool listens[FSM_LINK_NODES]; /* the peer is subscribed */
    sem_t work;
    fsm_shared stop;
    fsm_shared listeners; /* a bit for each peer */
    pthread_t sender, receiver, doorman;
    bool has_sender, has_receiver, has_doorman;
    char keys[FSM_LINK_NODES][FSM_LINK_KEY];
    void *door;
} fsm_link_zmq;

/* Open; 0, or an errno of ZeroMQ or the system, with `failed` saying of what. Allocates (libzmq). */
int fsm_link_zmq_open(fsm_link_zmq *zmq, fsm_link *link, const fsm_link_zmq_options *options);

/* Whether a peer is subscribed to this node. */
bool fsm_link_zmq_listens(const fsm_link_zmq *zmq, uint8_t peer);

/* Read a key out of a file as ZeroMQ's tools write them (name.key, name.key_secret): `kind` is
 * "public-key" or "secret-key". False if there is none. */
bool fsm_link_zmq_key(const char *path, const char *kind, char key[FSM_LINK_KEY]);

/* End the threads and close. The link may be opened again. */
void fsm_link_zmq_close(fsm_link_zmq *zmq);

#ifdef __cplusplus
}
#endif

#endif
