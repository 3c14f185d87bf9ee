/* standin.c: see standin.h. */
#include "standin.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uint32_t now;

uint32_t standin_now(void)
{
    return now;
}

bool standin_put(standin_queue *queue, const void *item)
{
    if (queue->count == queue->room)
        return false;
    memcpy(queue->slots + (queue->first + queue->count) % queue->room * queue->size, item,
           queue->size);
    queue->count++;
    return true;
}

bool standin_get(standin_queue *queue, void *item, uint64_t ticks)
{
    uint64_t until = ticks == UINT64_MAX ? UINT64_MAX : now + ticks;
    while (queue->count == 0) {
        uint32_t at;
        if (standin_next(&at) && at <= until) {
            now = at > now ? at : now;
            standin_happen();
        } else if (until == UINT64_MAX) {
            printf("%lu asleep for ever\n", (unsigned long)now);
            exit(0);
        } else {
            now = (uint32_t)until;
            return false;
        }
    }
    memcpy(item, queue->slots + queue->first * queue->size, queue->size);
    queue->first = (queue->first + 1) % queue->room;
    queue->count--;
    return true;
}
