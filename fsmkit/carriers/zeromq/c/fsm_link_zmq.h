/* fsm_link_zmq.h: links between nodes over ZeroMQ (libzmq).
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
 * Every node publishes at its own endpoint and connects to those of all others, in whatever order
 * they are started, and again when one comes back. A thread sends what the loop put into its ring
 * and was woken for by a semaphore; another receives. The loop never waits for them.
 *
 * A node publishes by a socket of the kind ROUTER, to the listeners that it knows
 * (fsm_link_hello.h), and not by PUB or XPUB: these keep all subscriptions, without
 * bound. Everything that others can make a link keep is bounded: by the size of messages
 * (ZMQ_MAXMSGSIZE) and by fsm_link_gate.h.
 *
 * Deterministic: frames go and come within calls only; see fsm_link.h. A thread only exchanges
 * hellos. Compile all files of this folder with -lzmq -pthread. */
#ifndef FSM_LINK_ZMQ_H
#define FSM_LINK_ZMQ_H

#include "fsm_link.h"
#include "fsm_link_gate.h"
#include "fsm_link_hello.h"
#include "fsm_link_keys.h"

#include <pthread.h>
#include <semaphore.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    const char *const *endpoints; /* [node], e.g. "tcp://127.0.0.1:5571"; NULL: a foreign node */
    const char *bind;             /* where to publish, e.g. "tcp://eth0:5571"; NULL: as above */
    bool is_deterministic;
    /* CURVE: all public keys by node, and this node's secret one. Only nodes with these keys are
     * accepted and can listen. NULL: no authentication, and no endpoint beyond this computer, unless
     * the deployment says `insecure: true`. */
    const char *const *public_keys;
    const char *secret_key;
    /* SCHED_FIFO of the threads; 0: leave it. They move what the loop posts and run shortly: give them
     * more than the loop has, since a frame otherwise waits until no loop wants the processor. */
    int send_priority;
    int receive_priority;
    int io_priority; /* of ZeroMQ's own threads */
    uint64_t cpus;   /* Linux: a bit for each processor that may run these threads; 0: any */
} fsm_link_zmq_options;

typedef struct {
    fsm_link *link;
    const char *failed; /* what could not be done */
    /* Why a priority or the processors were not granted, an errno; 0 if they were, or not requested. */
    int priority_error;
    int cpus_error;
    void *context;
    void *publisher;
    void *subscribers[FSM_LINK_NODES];
    bool is_deterministic;
    sem_t work;
    fsm_shared stop;
    pthread_mutex_t turn; /* whose turn it is with the sockets, when deterministic */
    pthread_t sender, receiver, keeper;
    bool has_work, has_turn, has_sender, has_receiver, has_keeper;
    fsm_link_transport transport;
    fsm_link_hellos hellos;
    fsm_link_gate gate;
    fsm_link_keys keys;
    bool has_keys;
    struct { /* received by the publisher: a route, a hello; no further parts */
        uint8_t route[FSM_LINK_ROUTE];
        size_t length;
        unsigned parts;
    } received;
    struct { /* of the hellos of this node, by peer */
        uint64_t at_ms;
        uint8_t bytes[FSM_LINK_HELLO];
    } said[FSM_LINK_NODES];
    bool is_flooded; /* more came to the publisher than was looked at */
    bool within[FSM_LINK_NODES]; /* a message of several parts, which is no frame */
} fsm_link_zmq;

/* Open; 0, or an errno of ZeroMQ or the system, with the failed call in `failed`. Allocates (libzmq). */
int fsm_link_zmq_open(fsm_link_zmq *zmq, fsm_link *link, const fsm_link_zmq_options *options);

/* Whether an endpoint is of this computer only, by its text: ipc, inproc, and of tcp an address of
 * 127.0.0.0/8 in four numbers, localhost and [::1]; no wildcard, interface, other name or source. */
bool fsm_link_zmq_is_loopback(const char *endpoint);

/* The connections to this node that its gate has ended: strangers, and whoever says too much. */
uint32_t fsm_link_zmq_dropped(const fsm_link_zmq *zmq);

/* The session of a peer that listens to this node, and has shown that it is it; 0: none does. */
uint32_t fsm_link_zmq_listener(const fsm_link_zmq *zmq, uint8_t peer);

/* End the threads and close; what waits is sent, for half a second at most. The link may be opened
 * again. */
void fsm_link_zmq_close(fsm_link_zmq *zmq);

#ifdef __cplusplus
}
#endif

#endif
