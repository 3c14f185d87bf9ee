/* wire.h: bytes on their way to another rank, or to a file. Numbers have 7 bits in each byte, the lowest first, and the
 * last byte is below 128 (LEB128). */
#ifndef FSM_WIRE_H
#define FSM_WIRE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    unsigned char *bytes;
    size_t count, room;
    bool failed; /* memory ran out: it is not whole */
} fsm_wire;

static inline bool fsm_wire_make_room(fsm_wire *self, size_t more)
{
    if (self->count + more <= self->room)
        return true;
    size_t room = 2 * (self->count + more);
    unsigned char *bytes = realloc(self->bytes, room);
    self->failed = self->failed || bytes == NULL;
    if (bytes == NULL)
        return false;
    self->bytes = bytes;
    self->room = room;
    return true;
}

static inline void fsm_wire_bytes(fsm_wire *self, const void *bytes, size_t count)
{
    if (count == 0 || !fsm_wire_make_room(self, count))
        return;
    memcpy(self->bytes + self->count, bytes, count);
    self->count += count;
}

static inline void fsm_wire_number(fsm_wire *self, uint64_t number)
{
    enum { MOST = 10 };
    if (!fsm_wire_make_room(self, MOST))
        return;
    for (; number >= 128; number >>= 7)
        self->bytes[self->count++] = (unsigned char)(number | 128);
    self->bytes[self->count++] = (unsigned char)number;
}

static inline void fsm_wire_free(fsm_wire *self)
{
    free(self->bytes);
    *self = (fsm_wire){0};
}

/* A reader; at its end all numbers are 0 and there are no bytes. */
typedef struct {
    const unsigned char *at, *end;
    bool failed;
} fsm_unread;

static inline uint64_t fsm_read_number(fsm_unread *self)
{
    uint64_t number = 0;
    for (unsigned shift = 0; self->at < self->end && shift < 64; shift += 7) {
        unsigned char byte = *self->at++;
        number |= (uint64_t)(byte & 127) << shift;
        if (byte < 128)
            return number;
    }
    self->failed = true;
    return 0;
}

static inline uint32_t fsm_read_small(fsm_unread *self)
{
    return (uint32_t)fsm_read_number(self);
}

/* NULL if there are not so many. */
static inline const void *fsm_read_bytes(fsm_unread *self, size_t count)
{
    const unsigned char *at = self->at;
    if ((size_t)(self->end - at) < count) {
        self->failed = true;
        return NULL;
    }
    self->at += count;
    return at;
}

#endif
