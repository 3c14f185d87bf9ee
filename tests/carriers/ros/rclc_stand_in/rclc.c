/* rclc.c: a stand-in for rclc: three messages come, and what is published is printed. */
#include <rclc/executor.h>
#include <rcutils/time.h>

#include <fsmkit_cell/msg/lens_judged.h>
#include <fsmkit_cell/msg/lens_look.h>
#include <std_msgs/msg/string.h>
#include <std_msgs/msg/u_int16.h>

#include <stdio.h>
#include <string.h>

enum { MOST = 8, CALLS = 30 };

static struct {
    rcl_subscription_t *subscription;
    void *message;
    rclc_subscription_callback_with_context_t callback;
    void *context;
} handles[MOST];
static size_t count;
static int64_t clock_ns;

rcl_allocator_t rcl_get_default_allocator(void)
{
    rcl_allocator_t found = {NULL};
    return found;
}

rcl_init_options_t rcl_get_zero_initialized_init_options(void)
{
    rcl_init_options_t found = {0u};
    return found;
}

rcl_ret_t rcl_init_options_init(rcl_init_options_t *options, rcl_allocator_t allocator)
{
    (void)options, (void)allocator;
    return RCL_RET_OK;
}

rcl_ret_t rcl_init_options_set_domain_id(rcl_init_options_t *options, size_t domain)
{
    options->domain = domain;
    printf("domain %u\n", (unsigned)domain);
    return RCL_RET_OK;
}

rcl_ret_t rcl_init_options_fini(rcl_init_options_t *options)
{
    (void)options;
    return RCL_RET_OK;
}

rcl_node_t rcl_get_zero_initialized_node(void)
{
    rcl_node_t found = {NULL};
    return found;
}

rcl_publisher_t rcl_get_zero_initialized_publisher(void)
{
    rcl_publisher_t found = {NULL, NULL};
    return found;
}

rcl_subscription_t rcl_get_zero_initialized_subscription(void)
{
    rcl_subscription_t found = {NULL};
    return found;
}

rcl_ret_t rcl_publish(const rcl_publisher_t *publisher, const void *message,
                      rmw_publisher_allocation_t *allocation)
{
    (void)allocation;
    printf("%s", publisher->topic);
    if (strcmp(publisher->type, "fsmkit_cell/LensLook") == 0) {
        const fsmkit_cell__msg__LensLook *look = message;
        printf(" %u %u %d", look->sequence, look->events, look->near);
    } else if (strcmp(publisher->type, "std_msgs/String") == 0) {
        const std_msgs__msg__String *text = message;
        printf(" %.*s", (int)text->data.size, text->data.data);
    }
    printf("\n");
    return RCL_RET_OK;
}

rcl_ret_t rcl_publisher_fini(rcl_publisher_t *publisher, rcl_node_t *node)
{
    (void)node;
    publisher->topic = NULL;
    return RCL_RET_OK;
}

rcl_ret_t rcl_subscription_fini(rcl_subscription_t *subscription, rcl_node_t *node)
{
    (void)node;
    subscription->topic = NULL;
    return RCL_RET_OK;
}

rcl_ret_t rcl_node_fini(rcl_node_t *node)
{
    (void)node;
    return RCL_RET_OK;
}

bool rcl_context_is_valid(const rcl_context_t *context)
{
    return context->calls < CALLS;
}

rcl_ret_t rclc_support_init_with_options(rclc_support_t *support, int argc, char const *const *argv,
                                         rcl_init_options_t *options, rcl_allocator_t *allocator)
{
    (void)argc, (void)argv, (void)options, (void)allocator;
    support->context.calls = 0;
    return RCL_RET_OK;
}

rcl_ret_t rclc_support_fini(rclc_support_t *support)
{
    (void)support;
    return RCL_RET_OK;
}

rcl_ret_t rclc_node_init_default(rcl_node_t *node, const char *name, const char *space,
                                 rclc_support_t *support)
{
    (void)space, (void)support;
    node->name = name;
    return RCL_RET_OK;
}

rcl_ret_t rclc_publisher_init(rcl_publisher_t *publisher, const rcl_node_t *node,
                              const rosidl_message_type_support_t *type, const char *topic,
                              const rmw_qos_profile_t *qos)
{
    (void)node, (void)qos;
    publisher->topic = topic;
    publisher->type = type->name;
    return RCL_RET_OK;
}

rcl_ret_t rclc_subscription_init(rcl_subscription_t *subscription, rcl_node_t *node,
                                 const rosidl_message_type_support_t *type, const char *topic,
                                 const rmw_qos_profile_t *qos)
{
    (void)node, (void)type, (void)qos;
    subscription->topic = topic;
    return RCL_RET_OK;
}

rclc_executor_t rclc_executor_get_zero_initialized_executor(void)
{
    rclc_executor_t found = {NULL, 0u};
    return found;
}

rcl_ret_t rclc_executor_init(rclc_executor_t *executor, rcl_context_t *context, size_t number,
                             const rcl_allocator_t *allocator)
{
    (void)allocator;
    executor->context = context;
    executor->count = number;
    return number <= MOST ? RCL_RET_OK : RCL_RET_ERROR;
}

rcl_ret_t rclc_executor_add_subscription_with_context(
    rclc_executor_t *executor, rcl_subscription_t *subscription, void *message,
    rclc_subscription_callback_with_context_t callback, void *context,
    rclc_executor_handle_invocation_t invocation)
{
    (void)invocation;
    if (count == executor->count) {
        return RCL_RET_ERROR;
    }
    handles[count].subscription = subscription;
    handles[count].message = message;
    handles[count].callback = callback;
    handles[count++].context = context;
    return RCL_RET_OK;
}

rcl_ret_t rclc_executor_prepare(rclc_executor_t *executor)
{
    return executor->count == count ? RCL_RET_OK : RCL_RET_ERROR;
}

static void deliver(const char *topic, const void *message, size_t size)
{
    for (size_t place = 0u; place < count; place++) {
        if (strcmp(handles[place].subscription->topic, topic) == 0) {
            memcpy(handles[place].message, message, size);
            handles[place].callback(handles[place].message, handles[place].context);
        }
    }
}

static void judge(uint32_t sequence, uint8_t verdict)
{
    fsmkit_cell__msg__LensJudged message;
    memset(&message, 0, sizeof message);
    message.session = 5u;
    message.sequence = sequence;
    message.quality = (uint8_t)(10u + sequence);
    message.verdict = verdict;
    deliver("/cell/lens/judged", &message, sizeof message);
}

rcl_ret_t rclc_executor_spin_some(rclc_executor_t *executor, const uint64_t timeout_ns)
{
    std_msgs__msg__UInt16 light = {417u};
    clock_ns += (int64_t)timeout_ns;
    switch (executor->context->calls++) {
    case 3:
        deliver("/cell/lens/light", &light, sizeof light);
        break;
    case 5:
        judge(0u, 1u);
        break;
    case 7:
        judge(1u, 200u); /* of no verdict */
        break;
    case 9:
        judge(4u, 0u); /* two are lost */
        break;
    default:
        break;
    }
    return RCL_RET_OK;
}

rcl_ret_t rclc_executor_fini(rclc_executor_t *executor)
{
    (void)executor;
    return RCL_RET_OK;
}

rcl_ret_t rcutils_steady_time_now(rcutils_time_point_value_t *now)
{
    *now = clock_ns;
    return RCL_RET_OK;
}
