/* fsm_rclc_state.h: the active states of a machine on a topic of ROS 2, by rclc, for micro-ROS.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 *   fsm_rclc_state_open(&shown, &node, "/cell/camera/state");
 *   after each cycle, with the names of the active states:
 *     fsm_rclc_state_begin(&shown);
 *     fsm_rclc_state_add(&shown, camera_state_name(state));
 *     fsm_rclc_state_end(&shown);                       publishes them if they have changed
 *   fsm_rclc_state_close(&shown, &node);
 *
 * The message is a std_msgs/msg/String, reliable and transient local: a late subscriber has it at once.
 * Nothing is allocated after fsm_rclc_state_open. What is longer than FSM_RCLC_TEXT is cut off between
 * two names. */
#ifndef FSM_RCLC_STATE_H
#define FSM_RCLC_STATE_H

#include <rcl/rcl.h>
#include <rclc/rclc.h>
#include <std_msgs/msg/string.h>

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#ifndef FSM_RCLC_TEXT /* bytes of the names of active states, with what ends them */
#define FSM_RCLC_TEXT 128
#endif

typedef struct {
    rcl_publisher_t publisher;
    bool is_open, is_published, is_cut;
    size_t length;
    uint32_t unsent; /* texts that rcl did not take; they are tried again */
    char text[FSM_RCLC_TEXT], last[FSM_RCLC_TEXT];
} fsm_rclc_state;

/* Returns RCL_RET_OK or a code of rcl. */
rcl_ret_t fsm_rclc_state_open(fsm_rclc_state *shown, const rcl_node_t *ros, const char *topic);

void fsm_rclc_state_begin(fsm_rclc_state *shown);
void fsm_rclc_state_add(fsm_rclc_state *shown, const char *name);
void fsm_rclc_state_end(fsm_rclc_state *shown);

/* Leave the topic. */
void fsm_rclc_state_close(fsm_rclc_state *shown, rcl_node_t *ros);

#ifdef __cplusplus
}
#endif

#endif
