/* rclc.h: a stand-in for rclc of micro-ROS. */
#ifndef RCLC_H
#define RCLC_H

#include <rcl/rcl.h>

typedef struct {
    rcl_context_t context;
} rclc_support_t;

rcl_ret_t rclc_support_init_with_options(rclc_support_t *support, int argc, char const *const *argv,
                                         rcl_init_options_t *options, rcl_allocator_t *allocator);
rcl_ret_t rclc_support_fini(rclc_support_t *support);
rcl_ret_t rclc_node_init_default(rcl_node_t *node, const char *name, const char *space,
                                 rclc_support_t *support);
rcl_ret_t rclc_publisher_init(rcl_publisher_t *publisher, const rcl_node_t *node,
                              const rosidl_message_type_support_t *type, const char *topic,
                              const rmw_qos_profile_t *qos);
rcl_ret_t rclc_subscription_init(rcl_subscription_t *subscription, rcl_node_t *node,
                                 const rosidl_message_type_support_t *type, const char *topic,
                                 const rmw_qos_profile_t *qos);

#endif
