/* Chart C by hand: the interface, with the names of a generated header. */
#ifndef CHART_C_H
#define CHART_C_H

#include <stdint.h>

#include "actions.h"

enum {
    CHART_C_STATE_OFF = 0,
    CHART_C_STATE_OPERATIONAL = 1,
    CHART_C_STATE_R0 = 2,
    CHART_C_STATE_R0S0 = 3,
    CHART_C_STATE_R0S1 = 4,
    CHART_C_STATE_R0S2 = 5,
    CHART_C_STATE_R0S3 = 6,
    CHART_C_STATE_R1 = 7,
    CHART_C_STATE_R1S0 = 8,
    CHART_C_STATE_R1S1 = 9,
    CHART_C_STATE_R1S2 = 10,
    CHART_C_STATE_R1S3 = 11,
    CHART_C_STATE_R2 = 12,
    CHART_C_STATE_R2S0 = 13,
    CHART_C_STATE_R2S1 = 14,
    CHART_C_STATE_R2S2 = 15,
    CHART_C_STATE_R2S3 = 16,
    CHART_C_STATE_R3 = 17,
    CHART_C_STATE_R3S0 = 18,
    CHART_C_STATE_R3S1 = 19,
    CHART_C_STATE_R3S2 = 20,
    CHART_C_STATE_R3S3 = 21,
    CHART_C_STATES = 22
};

enum {
    CHART_C_EVENT_ON = 0,
    CHART_C_EVENT_RESUME = 1,
    CHART_C_EVENT_OFF = 2,
    CHART_C_EVENT_TICK = 3,
    CHART_C_EVENT_A0 = 4,
    CHART_C_EVENT_A1 = 5,
    CHART_C_EVENT_A2 = 6,
    CHART_C_EVENT_A3 = 7,
    CHART_C_EVENT_B0 = 8,
    CHART_C_EVENT_B1 = 9,
    CHART_C_EVENT_B2 = 10,
    CHART_C_EVENT_B3 = 11,
    CHART_C_EVENTS = 12
};
typedef unsigned chart_c_event;

typedef struct {
    struct {
        int32_t n;
        uint32_t c[2 * CHART_C_STATES]; /* entries of each state, and its exits */
    } data;
    uint8_t is_on;
    uint8_t region[4]; /* 0 to 3: the active state of each, or the last one */
    uint8_t spare;
} chart_c;

#define ENTER(name) COUNT_ENTRY(CHART_C_STATE_##name)
#define EXIT(name) COUNT_EXIT(CHART_C_STATE_##name)

void chart_c_init(chart_c *m);
void chart_c_dispatch(chart_c *m, chart_c_event event);

#endif
