/* lists.h: lists of numbers, each kept once and numbered. List 0 is empty. */
#ifndef FSM_LISTS_H
#define FSM_LISTS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct {
    uint32_t *items;   /* of all lists, one after another */
    size_t item_count, item_room;
    size_t *starts;    /* `count` + 1 of them */
    uint32_t count, room;
    uint32_t *slots;   /* number of a list; 0 is empty */
    uint32_t capacity;
} fsm_lists;

bool fsm_lists_init(fsm_lists *self);
void fsm_lists_free(fsm_lists *self);

/* The number of a list, which is added if it is new; UINT32_MAX if memory ran out. */
uint32_t fsm_lists_number(fsm_lists *self, const uint32_t *items, uint32_t count);

static inline const uint32_t *fsm_lists_at(const fsm_lists *self, uint32_t number, uint32_t *count)
{
    *count = (uint32_t)(self->starts[number + 1] - self->starts[number]);
    return self->items + self->starts[number];
}

size_t fsm_lists_bytes(const fsm_lists *self);

#endif
