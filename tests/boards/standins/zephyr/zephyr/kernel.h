/* kernel.h: stand-in for what the documentation uses of Zephyr, over a simulated clock. */
#ifndef ZEPHYR_INCLUDE_KERNEL_H_
#define ZEPHYR_INCLUDE_KERNEL_H_

#include "standin.h"

typedef struct {
    int64_t ticks;
} k_timeout_t;
struct k_msgq {
    standin_queue queue;
};
typedef long atomic_t;
typedef long atomic_val_t;

#define K_FOREVER ((k_timeout_t){-1})
#define K_NO_WAIT ((k_timeout_t){0})
#define K_MSEC(ms) ((k_timeout_t){(int64_t)(ms)})
#define BUILD_ASSERT(expression, text) typedef char standin_assertion[(expression) ? 1 : -1]
#define K_MSGQ_DEFINE(name, size, max, align)                                                      \
    static char name##_slots[(size) * (max)];                                                      \
    struct k_msgq name = {{name##_slots, (max), (size), 0, 0}}
#define K_THREAD_DEFINE(name, stack, entry, p1, p2, p3, priority, options, delay)                  \
    int main(void)                                                                                 \
    {                                                                                              \
        entry(p1, p2, p3);                                                                         \
        return 0;                                                                                  \
    }                                                                                              \
    typedef char name##_has_a_stack[(stack) >= 512 && (priority) < 15 && (options) + (delay) == 0  \
                                        ? 1                                                        \
                                        : -1]

int k_msgq_put(struct k_msgq *queue, const void *item, k_timeout_t wait);
int k_msgq_get(struct k_msgq *queue, void *item, k_timeout_t wait);
uint32_t k_uptime_get_32(void);
atomic_val_t atomic_inc(atomic_t *value);

#endif
