/* rcl.h: a stand-in for rcl of ROS 2: the names and signatures that a package of fsmkit uses. */
#ifndef RCL_H
#define RCL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef int32_t rcl_ret_t;
#define RCL_RET_OK 0
#define RCL_RET_ERROR 1
#define RCL_MS_TO_NS(milliseconds) ((uint64_t)(milliseconds) * 1000000u)

typedef struct {
    const char *name;
} rosidl_message_type_support_t;

#define ROSIDL_GET_MSG_TYPE_SUPPORT(package, folder, name) support_##package##__##folder##__##name()

typedef struct {
    void *state;
} rcl_allocator_t;
typedef struct {
    size_t domain;
} rcl_init_options_t;
typedef struct {
    int calls;
} rcl_context_t;
typedef struct {
    const char *name;
} rcl_node_t;
typedef struct {
    const char *topic, *type;
} rcl_publisher_t;
typedef struct {
    const char *topic;
} rcl_subscription_t;
typedef struct {
    void *unused;
} rmw_publisher_allocation_t;

typedef enum { RMW_QOS_POLICY_RELIABILITY_RELIABLE = 1, RMW_QOS_POLICY_RELIABILITY_BEST_EFFORT } reliability;
typedef enum { RMW_QOS_POLICY_DURABILITY_TRANSIENT_LOCAL = 1, RMW_QOS_POLICY_DURABILITY_VOLATILE } durability;
typedef struct {
    size_t depth;
    reliability reliability;
    durability durability;
} rmw_qos_profile_t;
static const rmw_qos_profile_t rmw_qos_profile_default = {
    10u, RMW_QOS_POLICY_RELIABILITY_RELIABLE, RMW_QOS_POLICY_DURABILITY_VOLATILE};

rcl_allocator_t rcl_get_default_allocator(void);
rcl_init_options_t rcl_get_zero_initialized_init_options(void);
rcl_ret_t rcl_init_options_init(rcl_init_options_t *options, rcl_allocator_t allocator);
rcl_ret_t rcl_init_options_set_domain_id(rcl_init_options_t *options, size_t domain);
rcl_ret_t rcl_init_options_fini(rcl_init_options_t *options);
rcl_node_t rcl_get_zero_initialized_node(void);
rcl_publisher_t rcl_get_zero_initialized_publisher(void);
rcl_subscription_t rcl_get_zero_initialized_subscription(void);
rcl_ret_t rcl_publish(const rcl_publisher_t *publisher, const void *message,
                      rmw_publisher_allocation_t *allocation);
rcl_ret_t rcl_publisher_fini(rcl_publisher_t *publisher, rcl_node_t *node);
rcl_ret_t rcl_subscription_fini(rcl_subscription_t *subscription, rcl_node_t *node);
rcl_ret_t rcl_node_fini(rcl_node_t *node);
bool rcl_context_is_valid(const rcl_context_t *context);

#endif
