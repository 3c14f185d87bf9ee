/* fsm_link_net.h: a CAN bus that nodes of fsmkit share, as the transport of their links.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 *   fsm_link_net_open(&net, &link, &ring_a_can, "can0");            the tables of ring_a_can.h
 *   ...                                                             the loop (fsm_link.h)
 *   fsm_link_net_close(&net);
 *
 * An event is one frame of the bus, levels are one. Two threads send and receive; the loop calls
 * nothing of the bus. A node is known once its `hello` has arrived, which it sends first and then every
 * 100 ms; a loop that hangs (fsm_watch.h) says no hello. What is lost is counted by the counters in the frames, and by the number of events that
 * `hello` has. Nothing proves who sends: a bus has no keys. POSIX. */
#ifndef FSM_LINK_NET_H
#define FSM_LINK_NET_H

#include "fsm_can_bus.h"
#include "fsm_link.h"

#include <pthread.h>
#include <semaphore.h>

#ifdef __cplusplus
extern "C" {
#endif

#ifndef FSM_LINK_NET_MESSAGES /* events of the map, and two of each node */
#define FSM_LINK_NET_MESSAGES 256
#endif

typedef enum {
    FSM_LINK_NET_RECEIVED, /* frames of other nodes */
    FSM_LINK_NET_SENT,     /* frames that the bus took */
    FSM_LINK_NET_UNSENT,   /* frames that it did not take: the peers count them as lost */
    FSM_LINK_NET_COUNTS
} fsm_link_net_counter;

typedef struct {
    fsm_shared listens; /* 1 + the session in its hello; 0: there was none of this map */
    bool is_known, is_foreign;
    uint32_t hash;
    uint32_t session, sequence, events; /* of the next frame that is made of its messages */
    uint32_t ahead; /* events that a hello has shown to be lost, and no counter yet */
} fsm_link_net_peer;

typedef struct {
    const fsm_can_net *net;
    fsm_link *link;
    fsm_can_bus bus;
    pthread_t sender, receiver;
    sem_t work;
    int stop[2];
    bool has_work, has_sender, has_receiver;
    fsm_shared is_over, is_due; /* for the sender: to end, to say hello */
    fsm_shared counts[FSM_LINK_NET_COUNTS];
    uint8_t sent[FSM_LINK_NET_MESSAGES]; /* the counter of each message; the sender's own, as those */
    uint32_t events, left_out;           /* until now; of them those for foreign nodes */
    uint8_t next[FSM_LINK_NET_MESSAGES]; /* the counter to come; the receiver's own, as those below */
    bool is_counted[FSM_LINK_NET_MESSAGES]; /* there is one */
    uint32_t last[FSM_LINK_NET_MESSAGES];   /* the sequence of the last frame */
    fsm_link_net_peer peers[FSM_LINK_NODES];
    fsm_watch watch; /* of the loop */
} fsm_link_net;

/* Open the bus (fsm_can_bus.h) and attach it to the link. 0, or an errno. */
int fsm_link_net_open(fsm_link_net *net, fsm_link *link, const fsm_can_net *tables,
                      const char *bus);

uint32_t fsm_link_net_count(const fsm_link_net *net, fsm_link_net_counter what);

/* Leave the bus; after a fan beside it is closed. */
void fsm_link_net_close(fsm_link_net *net);

#ifdef __cplusplus
}
#endif

#endif
