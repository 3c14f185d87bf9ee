/* fsm_io_map.c: see fsm_io_map.h. */
#include "fsm_io_map.h"

static volatile unsigned char *at(const fsm_io_map *self, const fsm_io_register *it)
{
    return (volatile unsigned char *)self->base + it->offset;
}

static uint32_t load(const fsm_io_map *self, const fsm_io_register *it)
{
    volatile void *const place = at(self, it);
    switch (it->access) {
    case 8:
        return *(volatile uint8_t *)place;
    case 16:
        return *(volatile uint16_t *)place;
    default:
        return *(volatile uint32_t *)place;
    }
}

static void store(const fsm_io_map *self, const fsm_io_register *it, uint32_t word)
{
    volatile void *const place = at(self, it);
    switch (it->access) {
    case 8:
        *(volatile uint8_t *)place = (uint8_t)word;
        break;
    case 16:
        *(volatile uint16_t *)place = (uint16_t)word;
        break;
    default:
        *(volatile uint32_t *)place = word;
        break;
    }
}

static uint32_t mask(const fsm_io_register *it)
{
    return UINT32_MAX >> (32u - it->bits);
}

static int32_t value_of(const fsm_io_register *it, uint32_t word)
{
    uint32_t bits = (word >> it->shift) & mask(it);
    if (it->is_signed && bits > mask(it) >> 1u) {
        bits |= ~mask(it);
    }
    return bits <= (uint32_t)INT32_MAX ? (int32_t)bits : -1 - (int32_t)(UINT32_MAX - bits);
}

bool fsm_io_map_fits(const fsm_io_map *self)
{
    for (size_t i = 0u; i < self->count; i++) {
        const fsm_io_register *const it = &self->registers[i];
        if (it->offset > self->size || self->size - it->offset < it->access / 8u) {
            return false;
        }
    }
    return true;
}

/* Whether a row starts another register than the one before it. */
static bool is_first(const fsm_io_map *self, size_t i)
{
    return i == 0u || self->registers[i - 1u].offset != self->registers[i].offset;
}

void fsm_io_map_read(const fsm_io_map *self, void *raw)
{
    uint32_t word = 0u;
    for (size_t i = 0u; i < self->count; i++) {
        const fsm_io_register *const it = &self->registers[i];
        const fsm_io_wire *const wire = &self->wires[it->wire];
        if (fsm_io_is_output(wire)) {
            continue;
        }
        if (is_first(self, i)) {
            word = load(self, it);
        }
        *fsm_io_at(raw, wire) = value_of(it, word);
    }
}

void fsm_io_map_write(const fsm_io_map *self, const void *raw)
{
    uint32_t word = 0u;
    for (size_t i = 0u; i < self->count; i++) {
        const fsm_io_register *const it = &self->registers[i];
        const fsm_io_wire *const wire = &self->wires[it->wire];
        if (!fsm_io_is_output(wire)) {
            continue;
        }
        if (is_first(self, i)) {
            word = 0u;
        }
        word |= ((uint32_t)*fsm_io_in(raw, wire) & mask(it)) << it->shift;
        if (i + 1u == self->count || is_first(self, i + 1u)) {
            store(self, it, word);
        }
    }
}
