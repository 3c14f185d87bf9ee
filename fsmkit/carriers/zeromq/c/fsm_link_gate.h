/* fsm_link_gate.h: connections to a node: how many there are, for how long, how much they say.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 * ZeroMQ limits neither connections nor the parts of one message, which it keeps until the last has
 * come. So the gate keeps a second handle of each connection and ends those that go too far:
 * strangers beyond the seats, strangers that have not said a valid hello in time, and whoever sends
 * more than hellos take (as far as the system counts that: Linux does for TCP, since 4.1). Part of
 * fsm_link_zmq.h, not for hosts. One thread. */
#ifndef FSM_LINK_GATE_H
#define FSM_LINK_GATE_H

#include "fsm_link.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    FSM_LINK_SEATS = 32,         /* connections at a time; one more, and the oldest stranger goes */
    FSM_LINK_STRANGER_MS = 2000, /* until a connection must have said a valid hello */
    FSM_LINK_SAID_BYTES = 16384  /* burst, and per second; hellos take at most half of it */
};

typedef struct { /* a struct sockaddr_storage */
    uint8_t bytes[128];
    uint32_t length;
} fsm_link_place;

typedef struct {
    int number; /* the descriptor that ZeroMQ has */
    int handle; /* our own */
    int node;   /* whose it is; -1: a stranger's */
    uint64_t since_ms;
} fsm_link_seat;

typedef struct {
    void *door; /* the socket that is watched; NULL: none */
    void *monitor;
    fsm_link_place place; /* where it listens */
    uint64_t looked_ms;
    int taken;
    fsm_link_seat seats[FSM_LINK_SEATS + 1]; /* in the order in which they came */
    fsm_shared dropped;
} fsm_link_gate;

/* Watch a socket that is not bound yet; false, with errno, if it cannot be. */
bool fsm_link_gate_open(fsm_link_gate *gate, void *context, void *door);

/* See who came and who went, and put out those who went too far. */
void fsm_link_gate_look(fsm_link_gate *gate, uint64_t now_ms);

/* Take a connection, by its descriptor, for a node's, and the node's former for nobody's. */
void fsm_link_gate_know(fsm_link_gate *gate, int number, int node);

void fsm_link_gate_close(fsm_link_gate *gate);

#ifdef __cplusplus
}
#endif

#endif
