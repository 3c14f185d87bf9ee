/* fsm_rclc_state.c: see fsm_rclc_state.h. */
#include "fsm_rclc_state.h"

#include <string.h>

rcl_ret_t fsm_rclc_state_open(fsm_rclc_state *shown, const rcl_node_t *ros, const char *topic)
{
    rmw_qos_profile_t qos = rmw_qos_profile_default;
    rcl_ret_t code;
    memset(shown, 0, sizeof *shown);
    qos.depth = 1u;
    qos.reliability = RMW_QOS_POLICY_RELIABILITY_RELIABLE;
    qos.durability = RMW_QOS_POLICY_DURABILITY_TRANSIENT_LOCAL;
    shown->publisher = rcl_get_zero_initialized_publisher();
    code = rclc_publisher_init(&shown->publisher, ros,
                               ROSIDL_GET_MSG_TYPE_SUPPORT(std_msgs, msg, String), topic, &qos);
    shown->is_open = code == RCL_RET_OK;
    return code;
}

void fsm_rclc_state_begin(fsm_rclc_state *shown)
{
    shown->length = 0u;
    shown->is_cut = false;
    shown->text[0] = '\0';
}

void fsm_rclc_state_add(fsm_rclc_state *shown, const char *name)
{
    const size_t blank = shown->length > 0u ? 1u : 0u;
    const size_t length = strlen(name);
    if (shown->is_cut || length >= sizeof shown->text - shown->length - blank) {
        shown->is_cut = true;
        return;
    }
    if (blank > 0u) {
        shown->text[shown->length++] = ' ';
    }
    memcpy(shown->text + shown->length, name, length + 1u);
    shown->length += length;
}

void fsm_rclc_state_end(fsm_rclc_state *shown)
{
    std_msgs__msg__String message;
    if (!shown->is_open || (shown->is_published && strcmp(shown->text, shown->last) == 0)) {
        return;
    }
    message.data.data = shown->text;
    message.data.size = shown->length;
    message.data.capacity = sizeof shown->text;
    if (rcl_publish(&shown->publisher, &message, NULL) != RCL_RET_OK) {
        shown->unsent++;
        return;
    }
    memcpy(shown->last, shown->text, sizeof shown->last);
    shown->is_published = true;
}

void fsm_rclc_state_close(fsm_rclc_state *shown, rcl_node_t *ros)
{
    if (shown->is_open) {
        (void)rcl_publisher_fini(&shown->publisher, ros);
    }
    shown->is_open = false;
}
