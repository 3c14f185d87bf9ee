/* Chart A by hand: a table of states and events leads to the code of a transition. */
#include "chart_a.h"

#include <string.h>

/* The number of a transition; 0 for none. */
static const uint8_t transitions[CHART_A_STATES][CHART_A_EVENTS] = {
    {1, 2, 3, 4, 0, 0, 0, 0},
    {0, 5, 6, 7, 4, 0, 0, 0},
    {0, 0, 8, 9, 10, 4, 0, 0},
    {0, 0, 0, 11, 12, 13, 4, 0},
    {0, 0, 0, 0, 14, 15, 16, 4},
    {4, 0, 0, 0, 0, 17, 18, 19},
    {22, 4, 0, 0, 0, 0, 20, 21},
    {24, 25, 4, 0, 0, 0, 0, 23},
};

void chart_a_init(chart_a *m)
{
    memset(m, 0, sizeof *m);
    m->state = CHART_A_STATE_S0;
}

void chart_a_dispatch(chart_a *m, chart_a_event event)
{
    switch (transitions[m->state][event]) {
    case 1:
        m->data.n += 1;
        m->state = CHART_A_STATE_S1;
        break;
    case 2:
        if ((m->data.n & 1) == 0) {
            m->data.n += 3;
            m->state = CHART_A_STATE_S2;
        }
        break;
    case 3:
        if (m->data.n > 40) {
            m->data.n -= 17;
            m->state = CHART_A_STATE_S7;
        }
        break;
    case 4:
        m->data.n += 2;
        break;
    case 5:
        m->data.n += 1;
        m->state = CHART_A_STATE_S2;
        break;
    case 6:
        if ((m->data.n & 1) == 1) {
            m->data.n += 3;
            m->state = CHART_A_STATE_S3;
        }
        break;
    case 7:
        if (m->data.n > 48) {
            m->data.n -= 18;
            m->state = CHART_A_STATE_S0;
        }
        break;
    case 8:
        m->data.n += 1;
        m->state = CHART_A_STATE_S3;
        break;
    case 9:
        if ((m->data.n & 1) == 0) {
            m->data.n += 3;
            m->state = CHART_A_STATE_S4;
        }
        break;
    case 10:
        if (m->data.n > 56) {
            m->data.n -= 19;
            m->state = CHART_A_STATE_S1;
        }
        break;
    case 11:
        m->data.n += 1;
        m->state = CHART_A_STATE_S4;
        break;
    case 12:
        if ((m->data.n & 1) == 1) {
            m->data.n += 3;
            m->state = CHART_A_STATE_S5;
        }
        break;
    case 13:
        if (m->data.n > 64) {
            m->data.n -= 20;
            m->state = CHART_A_STATE_S2;
        }
        break;
    case 14:
        m->data.n += 1;
        m->state = CHART_A_STATE_S5;
        break;
    case 15:
        if ((m->data.n & 1) == 0) {
            m->data.n += 3;
            m->state = CHART_A_STATE_S6;
        }
        break;
    case 16:
        if (m->data.n > 72) {
            m->data.n -= 21;
            m->state = CHART_A_STATE_S3;
        }
        break;
    case 17:
        m->data.n += 1;
        m->state = CHART_A_STATE_S6;
        break;
    case 18:
        if ((m->data.n & 1) == 1) {
            m->data.n += 3;
            m->state = CHART_A_STATE_S7;
        }
        break;
    case 19:
        if (m->data.n > 80) {
            m->data.n -= 22;
            m->state = CHART_A_STATE_S4;
        }
        break;
    case 20:
        m->data.n += 1;
        m->state = CHART_A_STATE_S7;
        break;
    case 21:
        if ((m->data.n & 1) == 0) {
            m->data.n += 3;
            m->state = CHART_A_STATE_S0;
        }
        break;
    case 22:
        if (m->data.n > 88) {
            m->data.n -= 23;
            m->state = CHART_A_STATE_S5;
        }
        break;
    case 23:
        m->data.n += 1;
        m->state = CHART_A_STATE_S0;
        break;
    case 24:
        if ((m->data.n & 1) == 1) {
            m->data.n += 3;
            m->state = CHART_A_STATE_S1;
        }
        break;
    case 25:
        if (m->data.n > 96) {
            m->data.n -= 24;
            m->state = CHART_A_STATE_S6;
        }
        break;
    default:
        break;
    }
}
