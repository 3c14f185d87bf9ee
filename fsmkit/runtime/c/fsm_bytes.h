/* fsm_bytes.h: values as bytes, the least significant first, whatever the processor does.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 * For the sources that save, restore and log machines: nothing else includes it. */
#ifndef FSM_BYTES_H
#define FSM_BYTES_H

#include "fsm.h"

enum { FSM_SAVED_HEAD = 12, FSM_SAVED_CRC = 4 };

/* ---- writing ----------------------------------------------------------------------------------- */

typedef struct {
    uint8_t *at;
} fsm_writer;

static inline void fsm_put(fsm_writer *w, uint32_t value, unsigned size)
{
    for (unsigned i = 0u; i < size; i++) {
        *w->at++ = (uint8_t)(value & 0xFFu);
        value >>= 8;
    }
}

static inline void fsm_put_wide(fsm_writer *w, uint64_t value)
{
    fsm_put(w, (uint32_t)(value & 0xFFFFFFFFu), 4u);
    fsm_put(w, (uint32_t)(value >> 32), 4u);
}

static inline void fsm_put_float(fsm_writer *w, float value)
{
    union {
        float value;
        uint32_t bits;
    } of;
    of.value = value;
    fsm_put(w, of.bits, 4u);
}

static inline void fsm_put_double(fsm_writer *w, double value)
{
    union {
        double value;
        uint64_t bits;
    } of;
    of.value = value;
    fsm_put_wide(w, of.bits);
}

/* Zeros up to a place. */
static inline void fsm_fill(fsm_writer *w, const uint8_t *end)
{
    while (w->at < end)
        *w->at++ = 0u;
}

/* The place of a number in a table; its length if it is not there. */
static inline uint32_t fsm_find(const uint16_t *table, uint32_t length, uint32_t number)
{
    uint32_t place = 0u;
    while (place < length && table[place] != number)
        place++;
    return place;
}

/* A symbol as its place in a table; one that the host made as what it is, from 0x10000. */
static inline void fsm_put_symbol(fsm_writer *w, const uint16_t *table, uint32_t length,
                                  uint32_t symbol)
{
    uint32_t place = fsm_find(table, length, symbol);
    fsm_put(w, place < length ? place : 0x10000u + symbol, 4u);
}

/* ---- reading -----------------------------------------------------------------------------------
 * What lies outside its bounds makes the reader unsound; the lower bound is returned then. */

typedef struct {
    const uint8_t *at;
    bool sound;
} fsm_reader;

static inline uint32_t fsm_get(fsm_reader *r, unsigned size)
{
    uint32_t value = 0u;
    for (unsigned i = 0u; i < size; i++)
        value |= (uint32_t)*r->at++ << (8u * i);
    return value;
}

static inline uint32_t fsm_take(fsm_reader *r, unsigned size, uint32_t lo, uint32_t hi)
{
    uint32_t value = fsm_get(r, size);
    if (value >= lo && value <= hi)
        return value;
    r->sound = false;
    return lo;
}

static inline uint64_t fsm_take_wide(fsm_reader *r, uint64_t lo, uint64_t hi)
{
    uint64_t low = fsm_get(r, 4u);
    uint64_t value = low | (uint64_t)fsm_get(r, 4u) << 32;
    if (value >= lo && value <= hi)
        return value;
    r->sound = false;
    return lo;
}

static inline int32_t fsm_take_signed(fsm_reader *r, unsigned size, int32_t lo, int32_t hi)
{
    uint32_t sign = (uint32_t)1u << (8u * size - 1u);
    uint32_t bits = fsm_get(r, size);
    /* below zero: all bits inverted give one less than the distance from zero */
    int32_t value = (bits & sign) != 0u ? -(int32_t)(~bits & (sign - 1u)) - 1 : (int32_t)bits;
    if (value >= lo && value <= hi)
        return value;
    r->sound = false;
    return lo;
}

static inline int64_t fsm_take_wide_signed(fsm_reader *r, int64_t lo, int64_t hi)
{
    uint64_t bits = fsm_take_wide(r, 0u, UINT64_MAX);
    int64_t value = (bits >> 63) != 0u ? -(int64_t)(~bits) - 1 : (int64_t)bits;
    if (value >= lo && value <= hi)
        return value;
    r->sound = false;
    return lo;
}

static inline float fsm_take_float(fsm_reader *r)
{
    union {
        float value;
        uint32_t bits;
    } of;
    of.bits = fsm_get(r, 4u);
    return of.value;
}

static inline double fsm_take_double(fsm_reader *r)
{
    union {
        double value;
        uint64_t bits;
    } of;
    of.bits = fsm_take_wide(r, 0u, UINT64_MAX);
    return of.value;
}

static inline uint16_t fsm_take_place(fsm_reader *r, const uint16_t *table, uint32_t length)
{
    return table[fsm_take(r, 2u, 0u, length - 1u)];
}

static inline uint16_t fsm_take_symbol(fsm_reader *r, const uint16_t *table, uint32_t length)
{
    uint32_t place = fsm_take(r, 4u, 0u, 0x1FFFFu);
    if (place >= 0x10000u)
        return (uint16_t)(place - 0x10000u);
    if (place < length)
        return table[place];
    r->sound = false;
    return 0u;
}

/* ---- whole images ------------------------------------------------------------------------------ */

/* CRC-32 of IEEE 802.3, bit by bit: no table. */
static inline uint32_t fsm_crc(const uint8_t *bytes, size_t size)
{
    uint32_t crc = 0xFFFFFFFFu;
    for (size_t i = 0u; i < size; i++) {
        crc ^= bytes[i];
        for (unsigned bit = 0u; bit < 8u; bit++)
            crc = (crc & 1u) != 0u ? crc >> 1 ^ 0xEDB88320u : crc >> 1;
    }
    return ~crc;
}

/* Whether bytes are whole, and of the chart whose images begin with `head`. */
static inline fsm_restored fsm_check(const uint8_t *bytes, size_t size, const uint8_t *head,
                                     size_t expected)
{
    fsm_reader r = {bytes, true};
    if (size < FSM_SAVED_HEAD + FSM_SAVED_CRC)
        return FSM_DAMAGED;
    r.at = bytes + size - FSM_SAVED_CRC;
    if (fsm_get(&r, 4u) != fsm_crc(bytes, size - FSM_SAVED_CRC))
        return FSM_DAMAGED;
    for (unsigned i = 0u; i < FSM_SAVED_HEAD; i++)
        if (bytes[i] != head[i])
            return i < 4u ? FSM_DAMAGED : FSM_FOREIGN;
    return size == expected ? FSM_RESTORED : FSM_DAMAGED;
}

#endif
