/* fsm_link_keys.h: who is let in, by key: CURVE, and ZAP (rfc.zeromq.org/spec/26 and 27).
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 * Part of fsm_link_zmq.h, which includes it; only fsm_link_zmq_key is for hosts. */
#ifndef FSM_LINK_KEYS_H
#define FSM_LINK_KEYS_H

#include "fsm_link.h"

#include <pthread.h>

#ifdef __cplusplus
extern "C" {
#endif

#define FSM_LINK_KEY 41 /* characters of a CURVE key as text (Z85), with the zero */

typedef struct {
    void *door; /* where ZeroMQ requests admission */
    uint8_t nodes;
    uint8_t keys[FSM_LINK_NODES][32];
    pthread_t doorman;
    bool has_doorman;
    fsm_shared stop;
} fsm_link_keys;

/* Accept clients with one of these keys, and assign their nodes; return false, with errno, on failure.
 * Call it before binding a socket. */
bool fsm_link_keys_open(fsm_link_keys *keys, void *context, uint8_t nodes,
                        const char *const *public_keys);

/* The node whose key the sender of a message has shown (a zmq_msg_t); -2: of none. */
int fsm_link_keys_of(void *message);

void fsm_link_keys_close(fsm_link_keys *keys);

/* Read a key out of a file as ZeroMQ's tools write them (name.key, name.key_secret): `kind` is
 * "public-key" or "secret-key". False if it is missing. */
bool fsm_link_zmq_key(const char *path, const char *kind, char key[FSM_LINK_KEY]);

#ifdef __cplusplus
}
#endif

#endif
