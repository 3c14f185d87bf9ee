/* zephyr.c: the stand-in for Zephyr. */
#include <zephyr/kernel.h>

enum { NO_MESSAGE = -35, TIMED_OUT = -11 }; /* -ENOMSG, -EAGAIN of Zephyr */

int k_msgq_put(struct k_msgq *queue, const void *item, k_timeout_t wait)
{
    (void)wait;
    return standin_put(&queue->queue, item) ? 0 : NO_MESSAGE;
}

int k_msgq_get(struct k_msgq *queue, void *item, k_timeout_t wait)
{
    uint64_t ticks = wait.ticks < 0 ? UINT64_MAX : (uint64_t)wait.ticks;
    return standin_get(&queue->queue, item, ticks) ? 0 : TIMED_OUT;
}

uint32_t k_uptime_get_32(void)
{
    return standin_now();
}

atomic_val_t atomic_inc(atomic_t *value)
{
    return (*value)++;
}
