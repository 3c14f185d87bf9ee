/* fsm_link_hello.h: who listens to a node: each shows every other that it is the one at its endpoint.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 * A node sends each peer a hello over the connection that it made to the endpoint of this peer, and
 * in it a token, a random number that it sends nowhere else. Only whoever is at that endpoint can
 * send the token back, in a hello of its own; then the connection that brought it is the peer's. So
 * nobody can listen in the name of a node without being at its endpoint, or on the way to it. With
 * keys a hello counts only for the node whose key was shown. Part of fsm_link_zmq.h, not for hosts. */
#ifndef FSM_LINK_HELLO_H
#define FSM_LINK_HELLO_H

#include "fsm_link.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    FSM_LINK_HELLO = 22, /* bytes: mark, sender, session (4), its token (8), the other's (8) */
    FSM_LINK_TOKEN = 8,
    FSM_LINK_ROUTE = 5,       /* bytes of the route that ZeroMQ gives to a connection */
    FSM_LINK_GONE_MS = 2000,  /* without a hello, a peer listens no more */
    FSM_LINK_NO_KEYS = -1,    /* in place of the node whose key was shown */
    FSM_LINK_STRANGE_KEY = -2
};

/* The state of a peer. The context that processes hellos writes it, another reads it. */
typedef struct {
    uint8_t token[FSM_LINK_TOKEN]; /* sent to this peer's endpoint only; constant */
    fsm_shared peer_token[2];      /* the received token of the peer; 0: not yet */
    fsm_shared session;            /* in which it listens; 0: it does not */
    uint8_t route[FSM_LINK_ROUTE]; /* to where it listens; of the receiving context */
    uint64_t at_ms;                /* the last hello; its own as well */
} fsm_link_acquaintance;

typedef struct {
    uint8_t node, nodes;
    uint32_t session;
    fsm_link_acquaintance of[FSM_LINK_NODES];
} fsm_link_hellos;

/* Start; false if the system has no random numbers. */
bool fsm_link_hello_init(fsm_link_hellos *all, uint8_t node, uint8_t nodes, uint32_t session);

/* Write what to say to a peer. */
void fsm_link_hello_write(const fsm_link_hellos *all, uint8_t peer, uint8_t *hello);

/* Process a message of a route, which may be a hello. Return the peer of the route, or -1. */
int fsm_link_hello_receive(fsm_link_hellos *all, const uint8_t *bytes, size_t length,
                        const uint8_t *route, size_t route_length, int key_of, uint64_t now_ms);

/* Treat a peer as gone; all peers that have been silent for long. */
void fsm_link_hello_forget(fsm_link_hellos *all, uint8_t peer);
void fsm_link_hello_pass_time(fsm_link_hellos *all, uint64_t now_ms);

#ifdef __cplusplus
}
#endif

#endif
