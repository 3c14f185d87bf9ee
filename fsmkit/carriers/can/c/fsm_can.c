/* fsm_can.c: see fsm_can.h. */
#include "fsm_can.h"

#include <string.h>

static unsigned least_of(unsigned a, unsigned b)
{
    return a < b ? a : b;
}

/* The next byte with bits of higher value. */
static size_t next_byte(const fsm_can_signal *signal, size_t byte)
{
    return (signal->flags & FSM_CAN_BIG) != 0u ? byte - 1u : byte + 1u;
}

static uint64_t get_raw(const fsm_can_signal *signal, const uint8_t *data)
{
    size_t byte = signal->lowest / 8u;
    unsigned offset = signal->lowest % 8u;
    uint64_t raw = 0u;
    for (unsigned done = 0u, some; done < signal->bits; done += some) {
        some = least_of(8u - offset, signal->bits - done);
        raw |= (uint64_t)((unsigned)(data[byte] >> offset) & ((1u << some) - 1u)) << done;
        byte = next_byte(signal, byte);
        offset = 0u;
    }
    if ((signal->flags & FSM_CAN_SIGNED) != 0u && (raw >> (signal->bits - 1u)) != 0u) {
        raw |= ~(uint64_t)0u << (signal->bits - 1u);
    }
    return raw;
}

static void put_raw(const fsm_can_signal *signal, uint64_t raw, uint8_t *data)
{
    size_t byte = signal->lowest / 8u;
    unsigned offset = signal->lowest % 8u;
    for (unsigned done = 0u, some; done < signal->bits; done += some) {
        unsigned part;
        some = least_of(8u - offset, signal->bits - done);
        part = (unsigned)(raw >> done) & ((1u << some) - 1u);
        data[byte] = (uint8_t)(data[byte] | (part << offset));
        byte = next_byte(signal, byte);
        offset = 0u;
    }
}

static int member_of(const fsm_can_signal *signal, uint64_t raw)
{
    for (unsigned place = 0u; place < signal->members; place++) {
        if ((uint64_t)signal->raw[place] == raw) {
            return (int)place;
        }
    }
    return -1;
}

/* With the sign bit turned, signed numbers are in the order of unsigned ones. */
static bool is_within(const fsm_can_signal *signal, uint64_t raw)
{
    uint64_t turned = (signal->flags & FSM_CAN_SIGNED) != 0u ? (uint64_t)1u << 63u : 0u;
    return (raw ^ turned) >= (signal->least ^ turned) && (raw ^ turned) <= (signal->most ^ turned) &&
           (signal->members == 0u || member_of(signal, raw) >= 0);
}

static uint64_t value_of(const fsm_can_signal *signal, uint64_t raw)
{
    if (signal->members != 0u) {
        return (uint64_t)member_of(signal, raw);
    }
    return ((signal->flags & FSM_CAN_NEGATED) != 0u ? 0u - raw : raw) + signal->shift;
}

fsm_can_result fsm_can_decode(const fsm_can_message *message, const uint8_t *data, size_t length,
                              uint8_t *payload)
{
    const fsm_can_signal *end = message->signal + message->signals;
    fsm_can_result result = FSM_CAN_TAKEN;
    if (length < message->length) {
        return FSM_CAN_REFUSED;
    }
    for (const fsm_can_signal *signal = message->signal; signal < end; signal++) {
        if (is_within(signal, get_raw(signal, data))) {
            continue;
        }
        if ((signal->flags & FSM_CAN_SELECTS) != 0u) {
            return FSM_CAN_OTHER;
        }
        result = FSM_CAN_REFUSED;
    }
    if (result != FSM_CAN_TAKEN) {
        return result;
    }
    for (const fsm_can_signal *signal = message->signal; signal < end; signal++) {
        if (signal->size != 0u) {
            uint64_t value = value_of(signal, get_raw(signal, data));
            fsm_link_put_bytes(payload + signal->at, value, signal->size);
        }
    }
    return FSM_CAN_TAKEN;
}

/* Set the raw value for the value in a payload; false if it has none. */
static bool find_raw(const fsm_can_signal *signal, const uint8_t *payload, uint64_t *raw)
{
    const uint8_t *from = payload + signal->at;
    uint64_t value;
    *raw = signal->shift;
    if (signal->size == 0u) {
        return true;
    }
    if ((signal->flags & FSM_CAN_SIGNED_VALUE) != 0u) {
        value = (uint64_t)fsm_link_get_signed(from, signal->size);
    } else {
        value = fsm_link_get_bytes(from, signal->size);
    }
    if (signal->members != 0u) {
        if (value >= signal->members) {
            return false;
        }
        *raw = (uint64_t)signal->raw[value];
        return true;
    }
    if ((signal->flags & FSM_CAN_FLOAT) != 0u && signal->size == 4u && signal->bits == 64u) {
        uint8_t wide[8];
        fsm_link_put_double(wide, (double)fsm_link_get_float(from));
        value = fsm_link_get_bytes(wide, 8u);
    }
    *raw = value - signal->shift;
    if ((signal->flags & FSM_CAN_NEGATED) != 0u) {
        *raw = 0u - *raw;
    }
    return is_within(signal, *raw);
}

bool fsm_can_encode(const fsm_can_message *message, const uint8_t *payload, uint8_t *data)
{
    memset(data, 0, message->length);
    for (unsigned place = 0u; place < message->signals; place++) {
        uint64_t raw;
        if (!find_raw(&message->signal[place], payload, &raw)) {
            return false;
        }
        put_raw(&message->signal[place], raw, data);
    }
    return true;
}
