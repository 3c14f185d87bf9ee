/* Chart B by hand: the interface, with the names of a generated header. */
#ifndef CHART_B_H
#define CHART_B_H

#include <stdint.h>

#include "actions.h"

enum {
    CHART_B_STATE_OFF = 0,
    CHART_B_STATE_OPERATIONAL = 1,
    CHART_B_STATE_HOMING = 2,
    CHART_B_STATE_IDLE = 3,
    CHART_B_STATE_RUNNING = 4,
    CHART_B_STATE_MOVING = 5,
    CHART_B_STATE_WAITING = 6,
    CHART_B_STATE_HANDSHAKE = 7,
    CHART_B_STATE_STOPPING = 8,
    CHART_B_STATE_ERROR = 9,
    CHART_B_STATES = 10
};

enum {
    CHART_B_EVENT_POWER_ON = 0,
    CHART_B_EVENT_POWER_OFF = 1,
    CHART_B_EVENT_HOMED = 2,
    CHART_B_EVENT_START = 3,
    CHART_B_EVENT_ARRIVED = 4,
    CHART_B_EVENT_READY = 5,
    CHART_B_EVENT_DONE = 6,
    CHART_B_EVENT_STOP = 7,
    CHART_B_EVENT_FAULT = 8,
    CHART_B_EVENT_RESET = 9,
    CHART_B_EVENT_TICK = 10,
    CHART_B_EVENTS = 11
};
typedef unsigned chart_b_event;

typedef struct {
    struct {
        int32_t n;
        uint32_t faults;
        uint32_t parts;
        uint32_t ticks;
        uint32_t c[2 * CHART_B_STATES]; /* entries of each state, and its exits */
    } data;
    uint8_t state; /* CHART_B_STATE_... of the active leaf */
} chart_b;

#define ENTER(name) COUNT_ENTRY(CHART_B_STATE_##name)
#define EXIT(name) COUNT_EXIT(CHART_B_STATE_##name)

void chart_b_init(chart_b *m);
void chart_b_dispatch(chart_b *m, chart_b_event event);

#endif
