/* fsm_link_local.h: links between nodes of one program, for tests and simulation.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 *   static fsm_link_local wire;                       initially zero
 *   fsm_link_local_join(&wire, &link_a);              each link of the deployment
 *   fsm_link_local_join(&wire, &link_b);
 *
 * What a node sends is with the others when its cycle ends. One thread runs all nodes. */
#ifndef FSM_LINK_LOCAL_H
#define FSM_LINK_LOCAL_H

#include "fsm_link.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    fsm_link *links[FSM_LINK_NODES]; /* [node]; NULL: not there, or gone */
} fsm_link_local;

/* Join with the others; or take the place of a link of the same node, which was restarted. */
void fsm_link_local_join(fsm_link_local *wire, fsm_link *link);

#ifdef __cplusplus
}
#endif

#endif
