/* Chart A by hand: the interface, with the names of a generated header. */
#ifndef CHART_A_H
#define CHART_A_H

#include <stdint.h>

enum {
    CHART_A_STATE_S0 = 0,
    CHART_A_STATE_S1 = 1,
    CHART_A_STATE_S2 = 2,
    CHART_A_STATE_S3 = 3,
    CHART_A_STATE_S4 = 4,
    CHART_A_STATE_S5 = 5,
    CHART_A_STATE_S6 = 6,
    CHART_A_STATE_S7 = 7,
    CHART_A_STATES = 8
};

enum {
    CHART_A_EVENT_E0 = 0,
    CHART_A_EVENT_E1 = 1,
    CHART_A_EVENT_E2 = 2,
    CHART_A_EVENT_E3 = 3,
    CHART_A_EVENT_E4 = 4,
    CHART_A_EVENT_E5 = 5,
    CHART_A_EVENT_E6 = 6,
    CHART_A_EVENT_E7 = 7,
    CHART_A_EVENTS = 8
};
typedef unsigned chart_a_event;

typedef struct {
    struct {
        int32_t n;
    } data;
    uint8_t state; /* CHART_A_STATE_... */
} chart_a;

void chart_a_init(chart_a *m);
void chart_a_dispatch(chart_a *m, chart_a_event event);

#endif
