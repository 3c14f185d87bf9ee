/* fsm_link_ros.h: frames between nodes of fsmkit by topics of ROS 2, as the transport of a link.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 *   fsm_link_ros_open(&ros, &link, &ring_a_ros, 0);                 the table of ring_a_dds.h
 *   ...                                                             the loop (fsm_link.h)
 *   fsm_link_ros_close(&ros);
 *
 * A node publishes std_msgs/msg/UInt8MultiArray with its frames, reliable and volatile; if a peer
 * does not read in time, its oldest frames are overwritten, and the peer counts it as lost. A peer listens once
 * each of the two has discovered the other. Two threads send and receive; DDS allocates in these and in
 * its own. The loop makes no call of DDS. Nothing proves who publishes: fsm_dds_domain.h says who can
 * reach the domain. Compile fsm_frames.idl by `idlc -t`. POSIX, Cyclone DDS 0.10: -pthread -lddsc. */
#ifndef FSM_LINK_ROS_H
#define FSM_LINK_ROS_H

#include "fsm_dds_domain.h"
#include "fsm_link.h"

#include <pthread.h>
#include <semaphore.h>

#ifdef __cplusplus
extern "C" {
#endif

#ifndef FSM_LINK_ROS_WAITING /* frames that wait for a peer, there and here; then the oldest is lost */
#define FSM_LINK_ROS_WAITING (4 * FSM_LINK_SLOTS)
#endif

/* The topics of a deployment; generated. */
typedef struct {
    uint32_t domain;
    const char *const *topic; /* [node], in DDS, with `rt` before it; NULL: a foreign node */
} fsm_link_ros_net;

typedef enum {
    FSM_LINK_ROS_RECEIVED, /* messages that came */
    FSM_LINK_ROS_SENT,     /* messages that DDS took */
    FSM_LINK_ROS_UNSENT,   /* messages that it did not take: the peers count them as lost */
    FSM_LINK_ROS_COUNTS
} fsm_link_ros_counter;

typedef struct {
    fsm_link *link;
    dds_entity_t participant, writer, waitset, wake;
    dds_entity_t readers[FSM_LINK_NODES]; /* 0: of none */
    pthread_t sender, receiver;
    sem_t work;
    bool has_work, has_sender, has_receiver;
    fsm_shared stop;
    fsm_shared counts[FSM_LINK_ROS_COUNTS];
} fsm_link_ros;

/* Join the domain and attach it to the link; threads of DDS and of the link have this SCHED_FIFO priority
 * if it is not 0. 0, an errno, or a code of DDS, which is negative (fsm_dds_join). Calls DDS. */
int fsm_link_ros_open(fsm_link_ros *ros, fsm_link *link, const fsm_link_ros_net *net, int priority);

uint32_t fsm_link_ros_count(const fsm_link_ros *ros, fsm_link_ros_counter what);

/* Leave the domain; after a fan beside it is closed. Calls DDS. */
void fsm_link_ros_close(fsm_link_ros *ros);

#ifdef __cplusplus
}
#endif

#endif
