/* executor.h: a stand-in for rclc of micro-ROS. */
#ifndef RCLC_EXECUTOR_H
#define RCLC_EXECUTOR_H

#include <rclc/rclc.h>

typedef enum { ON_NEW_DATA, ALWAYS } rclc_executor_handle_invocation_t;
typedef void (*rclc_subscription_callback_with_context_t)(const void *message, void *context);
typedef struct {
    rcl_context_t *context;
    size_t count;
} rclc_executor_t;

rclc_executor_t rclc_executor_get_zero_initialized_executor(void);
rcl_ret_t rclc_executor_init(rclc_executor_t *executor, rcl_context_t *context, size_t handles,
                             const rcl_allocator_t *allocator);
rcl_ret_t rclc_executor_add_subscription_with_context(
    rclc_executor_t *executor, rcl_subscription_t *subscription, void *message,
    rclc_subscription_callback_with_context_t callback, void *context,
    rclc_executor_handle_invocation_t invocation);
rcl_ret_t rclc_executor_prepare(rclc_executor_t *executor);
rcl_ret_t rclc_executor_spin_some(rclc_executor_t *executor, const uint64_t timeout_ns);
rcl_ret_t rclc_executor_fini(rclc_executor_t *executor);

#endif
