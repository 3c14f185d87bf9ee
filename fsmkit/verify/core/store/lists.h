/* lists.h: lists of numbers, each kept once and numbered. List 0 is empty. One thread at a time may
 * number lists while others read them. */
#ifndef FSM_LISTS_H
#define FSM_LISTS_H

#include "store/segmented_array.h"

typedef struct {
    uint32_t count;
    uint32_t items[];
} fsm_list;

typedef struct {
    fsm_segmented_array all;    /* pointers to them */
    uint32_t count;
    uint32_t *slots;   /* number of a list; 0 is empty */
    uint32_t capacity;
    size_t bytes;
} fsm_lists;

bool fsm_lists_init(fsm_lists *self);
void fsm_lists_free(fsm_lists *self);

/* The number of a list, which is added if it is new; UINT32_MAX if memory ran out. */
uint32_t fsm_lists_number(fsm_lists *self, const uint32_t *items, uint32_t count);

static inline const uint32_t *fsm_lists_at(const fsm_lists *self, uint32_t number, uint32_t *count)
{
    const fsm_list *list = *(fsm_list *const *)fsm_segmented_array_at(&self->all, number, sizeof list);
    *count = list->count;
    return list->items;
}

size_t fsm_lists_bytes(const fsm_lists *self);

#endif
