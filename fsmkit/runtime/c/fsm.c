/* fsm.c: the timers and the one conversion that are no one-liners. See fsm.h. */
#include "fsm.h"

uint8_t fsm_timers_insert(fsm_timer *timers, uint8_t *count, fsm_timer timer)
{
    uint8_t place = *count;
    while (place > 0u && !fsm_reached(timer.deadline, timers[place - 1u].deadline)) {
        timers[place] = timers[place - 1u];
        place--;
    }
    timers[place] = timer;
    (*count)++;
    return place;
}

void fsm_timers_remove(fsm_timer *timers, uint8_t *count, uint8_t place)
{
    static const fsm_timer none = {0u, 0u, 0u};
    (*count)--;
    for (; place < *count; place++) {
        timers[place] = timers[place + 1u];
    }
    timers[place] = none;
}

void fsm_timers_disarm(fsm_timer *timers, uint8_t *count, uint16_t what)
{
    for (uint8_t place = 0u; place < *count; place++) {
        if (timers[place].what == what) {
            fsm_timers_remove(timers, count, place);
            return;
        }
    }
}

int64_t fsm_truncate(double value, int64_t lo, int64_t hi, bool *outside)
{
    *outside = false;
    if (value != value) {
        value = 0.0; /* not a number */
    }
    if (value >= 9223372036854775808.0) {
        *outside = true;
        return hi;
    }
    if (value < -9223372036854775808.0) {
        *outside = true;
        return lo;
    }
    int64_t whole = (int64_t)value;
    *outside = whole < lo || whole > hi;
    return whole < lo ? lo : whole > hi ? hi : whole;
}
