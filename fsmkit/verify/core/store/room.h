/* room.h: arrays that double when they are full. */
#ifndef FSM_ROOM_H
#define FSM_ROOM_H

#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Reallocates the array whose address `items` is. False: out of memory; the array is then as before. */
static inline bool fsm_resize(void *items, size_t bytes)
{
    void *old, *grown;
    memcpy(&old, items, sizeof old);
    grown = realloc(old, bytes);
    if (grown == NULL)
        return false;
    memcpy(items, &grown, sizeof grown);
    return true;
}

#define FSM_LARGER(room, least) ((room) == 0 ? (least) : 2 * (room))

/* Whether an array has room for one item more, after it has grown if it was full; `least` is its first size. */
#define FSM_HAS_ROOM(items, count, room, least)                                                                                  \
    ((count) < (room)                                                                                                            \
     || (fsm_resize(&(items), (size_t)FSM_LARGER(room, least) * sizeof *(items)) && ((room) = FSM_LARGER(room, least)) > 0))

/* Grows an array to contain an index; new elements are 0. */
static inline bool fsm_make_place(void *items, uint32_t *room, uint32_t place, uint32_t least, size_t size)
{
    uint32_t more = *room == 0 ? least : *room;
    void *grown;
    while (more <= place)
        more = more > UINT32_MAX / 2 ? UINT32_MAX : 2 * more;
    if (!fsm_resize(items, more * size))
        return false;
    memcpy(&grown, items, sizeof grown);
    memset((unsigned char *)grown + *room * size, 0, (more - *room) * size);
    *room = more;
    return true;
}

#define FSM_HAS_PLACE(items, room, place, least)                                                                                 \
    ((place) < (room) || fsm_make_place(&(items), &(room), place, least, sizeof *(items)))

#endif
