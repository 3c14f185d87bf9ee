/* fsm_bytes.h: values as bytes, least significant first, on every processor.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 * For the sources that save, restore and log machines: nothing else includes it. */
#ifndef FSM_BYTES_H
#define FSM_BYTES_H

#include "fsm_info.h"

#ifndef FSM_HOOK_FOREIGN /* a symbol is written that the chart does not contain */
#define FSM_HOOK_FOREIGN(symbol) ((void)0)
#endif

enum { FSM_SAVED_HEAD = 12, FSM_SAVED_CRC = 4 };

/* ---- writing ----------------------------------------------------------------------------------- */

typedef struct {
    uint8_t *at;
    bool compares; /* compares with the existing bytes instead of writing */
    bool differs;
} fsm_writer;

static inline fsm_writer fsm_write_to(uint8_t *bytes)
{
    const fsm_writer w = {bytes, false, false};
    return w;
}

static inline void fsm_put_byte(fsm_writer *w, uint8_t value)
{
    if (!w->compares) {
        *w->at = value;
    } else if (*w->at != value) {
        w->differs = true;
    }
    w->at++;
}

static inline void fsm_put(fsm_writer *w, uint32_t value, unsigned size)
{
    for (unsigned i = 0u; i < size; i++) {
        fsm_put_byte(w, (uint8_t)(value & 0xFFu));
        value >>= 8;
    }
}

static inline void fsm_put_wide(fsm_writer *w, uint64_t value)
{
    fsm_put(w, (uint32_t)(value & 0xFFFFFFFFu), 4u);
    fsm_put(w, (uint32_t)(value >> 32), 4u);
}

/* Zeros up to a place. */
static inline void fsm_fill(fsm_writer *w, const uint8_t *end)
{
    while (w->at < end) {
        fsm_put_byte(w, 0u);
    }
}

/* The place of a number in a table; its length if it is not there. */
static inline uint32_t fsm_find(const uint16_t *table, uint32_t length, uint32_t number)
{
    uint32_t place = 0u;
    while (place < length && table[place] != number) {
        place++;
    }
    return place;
}

/* The saved bits of a scalar: one pattern for NaN, of which processors have several. */
static inline uint64_t fsm_saved_bits(const fsm_type *type, const void *value)
{
    const uint64_t bits = fsm_bits_at(type, value);
    if (type->kind == FSM_FLOAT && fsm_float_at(type, value) != fsm_float_at(type, value)) {
        return type->size == 4u ? UINT64_C(0x7FC00000) : UINT64_C(0x7FF8000000000000);
    }
    return bits;
}

/* Save a value: its scalars in order. A symbol is its position in the list of the chart; a symbol of
 * the host keeps its number, from 0x10000. */
static inline void fsm_put_value(fsm_writer *w, const fsm_machine_info *info, const fsm_type *type,
                                 const void *value)
{
    for (uint32_t k = 0u; k < type->scalars; k++) {
        uint32_t offset = 0u;
        const fsm_type *scalar = fsm_scalar(type, k, &offset);
        const uint64_t bits = fsm_saved_bits(scalar, fsm_at(value, offset));
        if (scalar->kind == FSM_SYMBOL) {
            const uint32_t symbol = (uint32_t)(bits & 0xFFFFu);
            const uint32_t place = fsm_find(info->texts.numbers, info->texts.count, symbol);
            if (place == info->texts.count) {
                FSM_HOOK_FOREIGN(symbol);
            }
            fsm_put(w, place < info->texts.count ? place : 0x10000u + symbol, 4u);
        } else if (scalar->size == 8u) {
            fsm_put_wide(w, bits);
        } else {
            fsm_put(w, (uint32_t)(bits & 0xFFFFFFFFu), scalar->size);
        }
    }
}

/* An event: its number, and its fields; of a number that is no event 0. */
static inline void fsm_put_event(fsm_writer *w, const fsm_machine_info *info, const void *e)
{
    const uint32_t number = fsm_event_of(info, e);
    const bool is_known = number - 1u < info->event_count;
    fsm_put(w, is_known ? number : 0u, 2u);
    if (!is_known) {
        return;
    }
    const fsm_event_info *event = &info->events[number - 1u];
    for (uint32_t i = 0u; i < event->field_count; i++) {
        fsm_put_value(w, info, event->fields[i].type, fsm_at(e, event->fields[i].offset));
    }
}

/* ---- reading -----------------------------------------------------------------------------------
 * A value outside its bounds makes the reader unsound and is replaced by the lower bound. */

typedef struct {
    const uint8_t *at;
    bool sound;
} fsm_reader;

static inline uint32_t fsm_get(fsm_reader *r, unsigned size)
{
    uint32_t value = 0u;
    for (unsigned i = 0u; i < size; i++) {
        value |= (uint32_t)*r->at++ << (8u * i);
    }
    return value;
}

static inline uint32_t fsm_take(fsm_reader *r, unsigned size, uint32_t lo, uint32_t hi)
{
    uint32_t value = fsm_get(r, size);
    if (value >= lo && value <= hi) {
        return value;
    }
    r->sound = false;
    return lo;
}

static inline uint16_t fsm_take_place(fsm_reader *r, const uint16_t *table, uint32_t length)
{
    return table[fsm_take(r, 2u, 0u, length - 1u)];
}

static inline uint16_t fsm_take_symbol(fsm_reader *r, const fsm_number_list *texts)
{
    const uint32_t place = fsm_take(r, 4u, 0u, 0x1FFFFu);
    if (place >= 0x10000u) {
        return (uint16_t)(place - 0x10000u);
    }
    if (place < texts->count) {
        return texts->numbers[place];
    }
    r->sound = false;
    return 0u;
}

static inline void fsm_take_value(fsm_reader *r, const fsm_machine_info *info, const fsm_type *type,
                                  void *value)
{
    for (uint32_t k = 0u; k < type->scalars; k++) {
        uint32_t offset = 0u;
        uint64_t bits;
        const fsm_type *scalar = fsm_scalar(type, k, &offset);
        if (scalar->kind == FSM_SYMBOL) {
            bits = fsm_take_symbol(r, &info->texts);
        } else {
            bits = fsm_get(r, scalar->size < 4u ? scalar->size : 4u);
            if (scalar->size == 8u) {
                bits |= (uint64_t)fsm_get(r, 4u) << 32;
            }
            bits = fsm_extended(scalar, bits);
            if (!fsm_is_of(scalar, bits)) {
                r->sound = false;
                bits = scalar->lo;
            }
        }
        fsm_set_bits(scalar, fsm_place_at(value, offset), bits);
    }
}

/* ---- whole images ------------------------------------------------------------------------------ */

/* CRC-32 of IEEE 802.3, bit by bit: no table. */
static inline uint32_t fsm_crc(const uint8_t *bytes, size_t size)
{
    uint32_t crc = 0xFFFFFFFFu;
    for (size_t i = 0u; i < size; i++) {
        crc ^= bytes[i];
        for (unsigned bit = 0u; bit < 8u; bit++) {
            crc = (crc & 1u) != 0u ? crc >> 1 ^ 0xEDB88320u : crc >> 1;
        }
    }
    return ~crc;
}

/* Check that bytes are complete, and of the chart whose images start with `head`. */
static inline fsm_restored fsm_check(const uint8_t *bytes, size_t size, const uint8_t *head,
                                     size_t expected)
{
    fsm_reader r = {bytes, true};
    if (size < FSM_SAVED_HEAD + FSM_SAVED_CRC) {
        return FSM_DAMAGED;
    }
    r.at = bytes + size - FSM_SAVED_CRC;
    if (fsm_get(&r, 4u) != fsm_crc(bytes, size - FSM_SAVED_CRC)) {
        return FSM_DAMAGED;
    }
    for (unsigned i = 0u; i < FSM_SAVED_HEAD; i++) {
        if (bytes[i] != head[i]) {
            return i < 4u ? FSM_DAMAGED : FSM_FOREIGN;
        }
    }
    return size == expected ? FSM_RESTORED : FSM_DAMAGED;
}

#endif
