/* fsm_io.c: see fsm_io.h. */
#include "fsm_io.h"

#define ONE 65536 /* of the filter */

void fsm_io_debounce(bool *value, uint16_t *count, bool reading, uint16_t readings)
{
    if (reading == *value) {
        *count = 0u;
        return;
    }
    (*count)++;
    if (*count >= readings) {
        *value = reading;
        *count = 0u;
    }
}

/* The value of the bits of an unsigned as two's complement. */
static int32_t signed_of(uint32_t bits)
{
    return bits <= (uint32_t)INT32_MAX ? (int32_t)bits : -1 - (int32_t)(UINT32_MAX - bits);
}

void fsm_io_count(int32_t *value, fsm_io_counter *counter, int32_t raw, uint8_t bits)
{
    const uint32_t mask = UINT32_MAX >> (32u - bits);
    const uint32_t now = (uint32_t)raw & mask;
    uint32_t moved;
    if (counter->has_last) {
        moved = (now - counter->last) & mask;
        if (moved > mask >> 1u) {
            moved |= ~mask; /* backwards */
        }
        *value = signed_of((uint32_t)*value + moved);
    } else {
        *value = signed_of(now);
    }
    counter->last = now;
    counter->has_last = true;
}

static int32_t scaled(const fsm_io_scale *scale, int32_t raw)
{
    const fsm_io_point *right = scale->points, *left;
    uint16_t place = 0u;
    int64_t width, height, step;
    if (raw <= right->raw) {
        return right->value;
    }
    while (place + 1u < scale->count && raw > right->raw) {
        place++;
        right = &scale->points[place];
    }
    if (raw > right->raw) {
        return right->value;
    }
    left = right - 1;
    width = (int64_t)right->raw - left->raw;
    height = (int64_t)right->value - left->value;
    step = ((height < 0 ? -height : height) * ((int64_t)raw - left->raw) + width / 2) / width;
    return (int32_t)(left->value + (height < 0 ? -step : step));
}

/* A filter never leaves the range of its readings; here an analysis sees it, too. */
static int64_t bounded(int64_t filtered)
{
    const int64_t least = (int64_t)INT32_MIN * ONE, greatest = (int64_t)INT32_MAX * ONE;
    return filtered < least ? least : filtered > greatest ? greatest : filtered;
}

static void count_up(uint16_t *count)
{
    if (*count < UINT16_MAX) {
        (*count)++;
    }
}

void fsm_io_convert(int32_t *value, fsm_io_converter *converter, const fsm_io_scale *scale,
                    int32_t raw)
{
    int64_t reading, before, now;
    if (raw < scale->least || raw > scale->greatest) {
        count_up(&converter->invalid);
        return;
    }
    converter->invalid = 0u;
    reading = (int64_t)scaled(scale, raw) * ONE;
    before = converter->has_value ? bounded(converter->filtered) : reading;
    now = bounded(before + (reading - before) / (scale->lowpass + 1));
    converter->filtered = now;
    converter->has_value = true;
    /* rounded: halves upwards, as the dividend is made positive */
    *value = (int32_t)((now + ONE / 2 + (INT64_C(1) << 48)) / ONE - (INT64_C(1) << 32));
}

void fsm_io_number(int32_t *value, uint16_t *invalid, int32_t raw, int32_t least, int32_t greatest)
{
    if (raw < least || raw > greatest) {
        count_up(invalid);
        return;
    }
    *invalid = 0u;
    *value = raw;
}

void fsm_io_hysteresis(bool *value, int32_t signal, int32_t above, int32_t below)
{
    if (signal > above) {
        *value = true;
    } else if (signal < below) {
        *value = false;
    }
}

void fsm_io_switch_off(const fsm_io_wire *wires, size_t count, void *raw)
{
    for (size_t i = 0u; i < count; i++) {
        if (fsm_io_is_output(&wires[i]) && !wires[i].is_kept) {
            *fsm_io_at(raw, &wires[i]) = wires[i].safe;
        }
    }
}

int32_t fsm_io_clamp(int32_t value, int32_t least, int32_t greatest)
{
    return value < least ? least : value > greatest ? greatest : value;
}
