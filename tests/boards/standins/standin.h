/* standin.h: a kernel of one task on a simulated clock, under the stand-ins of two real ones. */
#ifndef STANDIN_H
#define STANDIN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct {
    char *slots;
    size_t room, size, first, count;
} standin_queue;

/* Store the next time of the test's plan; return false at its end. */
bool standin_next(uint32_t *at);
void standin_happen(void);

uint32_t standin_now(void);
bool standin_put(standin_queue *queue, const void *item);

/* Wait for an item: UINT64_MAX is for ever. Ends the program when nothing can happen any more. */
bool standin_get(standin_queue *queue, void *item, uint64_t ticks);

#endif
