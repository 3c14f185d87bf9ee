/* fsm_link_rclc.h: a foreign node of ROS 2 by rclc, for micro-ROS: its topics as events and levels.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 *   fsm_link_rclc_open(&topics, &link, &cell_b_rclc_vision, &node, &executor);
 *   for each cycle:
 *     rclc_executor_spin_some(&executor, timeout);    what has come goes into the link
 *     cell_b_cycle(&node, now);                       what leaves is published within the call
 *   fsm_link_rclc_close(&topics);
 *
 * There is no thread, and nothing is allocated after fsm_link_rclc_open: messages are of a fixed size and
 * lie in the tables. An event that finds the link full is lost, and counted as FSM_LINK_OVERFLOW. rclc does
 * not say who publishes: a restart is seen only by the `session` that messages of fsmkit carry. */
#ifndef FSM_LINK_RCLC_H
#define FSM_LINK_RCLC_H

#include "fsm_link.h"
#include "fsm_ros_values.h"

#include <rcl/rcl.h>
#include <rclc/executor.h>
#include <rclc/rclc.h>

#ifdef __cplusplus
extern "C" {
#endif

#ifndef FSM_LINK_RCLC_TOPICS /* of a foreign node, in both directions */
#define FSM_LINK_RCLC_TOPICS 16
#endif

/* ---- tables; generated ------------------------------------------------------------------------ */

typedef struct {
    const char *name;
    const rosidl_message_type_support_t *(*type)(void);
    void *message; /* where one that comes is stored */
    fsm_ros_qos qos;
    bool is_event;
    bool is_sent;    /* by this node */
    bool is_counted; /* its messages have fsm_ros_numbers */
} fsm_link_rclc_topic;

/* A connection. A topic may have several; members as of fsm_link_dds_wire. */
typedef struct {
    uint16_t topic, message, at, size;
    bool (*unpack)(const void *sample, uint8_t *p, fsm_ros_numbers *numbers);
    rcl_ret_t (*publish)(const rcl_publisher_t *writer, const uint8_t *p,
                         const fsm_ros_numbers *numbers);
} fsm_link_rclc_wire;

typedef struct {
    uint8_t peer;         /* the foreign node, by its place in the deployment */
    uint16_t levels;      /* bytes of its levels */
    const uint8_t *start; /* its levels, until messages with them come */
    uint16_t topic_count, wire_count;
    const fsm_link_rclc_topic *topic;
    const fsm_link_rclc_wire *wire;
} fsm_link_rclc_node;

/* ---- a translator ----------------------------------------------------------------------------- */

typedef enum {
    FSM_LINK_RCLC_RECEIVED, /* messages that came */
    FSM_LINK_RCLC_SENT,     /* messages that rcl took */
    FSM_LINK_RCLC_UNSENT,   /* messages that it did not take: lost */
    FSM_LINK_RCLC_REFUSED,  /* messages with a value out of its range */
    FSM_LINK_RCLC_LATE,     /* messages whose own number had come already: dropped */
    FSM_LINK_RCLC_COUNTS
} fsm_link_rclc_counter;

typedef struct fsm_link_rclc fsm_link_rclc;

typedef struct {
    fsm_link_rclc *of;
    rcl_publisher_t publisher;
    rcl_subscription_t subscription;
    bool is_open, is_known, is_published;
    uint32_t session, next; /* incoming */
    uint32_t sequence;      /* outgoing */
} fsm_link_rclc_end;

struct fsm_link_rclc {
    const fsm_link_rclc_node *node;
    fsm_link *link;
    fsm_link_rclc *others; /* translators of the same link */
    rcl_node_t *ros;
    uint32_t session, sequence, events; /* of the frames that are made */
    uint32_t counts[FSM_LINK_RCLC_COUNTS];
    uint8_t levels[FSM_LINK_BYTES]; /* of the foreign node */
    uint8_t own[FSM_LINK_BYTES];    /* of this one, as they were published */
    fsm_link_rclc_end ends[FSM_LINK_RCLC_TOPICS];
};

/* Join a foreign node to a link that nothing carries but others of these; the executor needs a handle for
 * each topic that comes. RCL_RET_OK, or a code of rcl; RCL_RET_ERROR as well if the tables are too long. */
rcl_ret_t fsm_link_rclc_open(fsm_link_rclc *rclc, fsm_link *link, const fsm_link_rclc_node *node,
                             rcl_node_t *ros, rclc_executor_t *executor);

uint32_t fsm_link_rclc_count(const fsm_link_rclc *rclc, fsm_link_rclc_counter what);

/* Leave the topics. */
void fsm_link_rclc_close(fsm_link_rclc *rclc);

#ifdef __cplusplus
}
#endif

#endif
