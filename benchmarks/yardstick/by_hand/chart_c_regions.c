/* Chart C by hand: a number for each region. As in SCXML, all guards come before all exits, and
 * these before all entries. Each state's actions are code of their own, not one indexed counter. */
#include "chart_c.h"

#include <string.h>

#define STAYS 0xffu

#define ENTER_STATE(r) \
    switch (m->region[r]) { \
    case 0: ENTER(R##r##S0); break; \
    case 1: ENTER(R##r##S1); break; \
    case 2: ENTER(R##r##S2); break; \
    case 3: ENTER(R##r##S3); break; \
    }

#define EXIT_STATE(r) \
    switch (m->region[r]) { \
    case 0: EXIT(R##r##S0); break; \
    case 1: EXIT(R##r##S1); break; \
    case 2: EXIT(R##r##S2); break; \
    case 3: EXIT(R##r##S3); break; \
    }

#define SELECT_TICK(r) \
    next[r] = STAYS; \
    switch (m->region[r]) { \
    case 0: next[r] = 1; break; \
    case 1: if ((m->data.n & (1 << r)) == 0) next[r] = 2; break; \
    case 2: next[r] = 3; break; \
    case 3: next[r] = 0; break; \
    }

#define EXIT_ON_TICK(r) \
    if (next[r] != STAYS) \
        EXIT_STATE(r)

#define ENTER_ON_TICK(r) \
    if (next[r] != STAYS) { \
        m->region[r] = next[r]; \
        ENTER_STATE(r) \
    }

#define ON_A(r) \
    switch (m->region[r]) { \
    case 0: \
        EXIT(R##r##S0); \
        ENTER(R##r##S2); \
        m->region[r] = 2; \
        break; \
    case 1: \
        if ((m->data.n & 1) == (r & 1)) { \
            EXIT(R##r##S1); \
            ENTER(R##r##S3); \
            m->region[r] = 3; \
        } \
        break; \
    case 2: \
        EXIT(R##r##S2); \
        m->data.n += r + 1; \
        ENTER(R##r##S0); \
        m->region[r] = 0; \
        break; \
    case 3: \
        m->data.n += 1; \
        break; \
    }

#define ON_B(r) \
    switch (m->region[r]) { \
    case 1: \
        EXIT(R##r##S1); \
        m->data.n += 2; \
        ENTER(R##r##S0); \
        m->region[r] = 0; \
        break; \
    case 3: \
        if (m->data.n > 8 * r) { \
            EXIT(R##r##S3); \
            m->data.n -= 9 + 5 * r; \
            ENTER(R##r##S1); \
            m->region[r] = 1; \
        } \
        break; \
    }

void chart_c_init(chart_c *m)
{
    memset(m, 0, sizeof *m);
    ENTER(OFF);
}

static void switch_on(chart_c *m)
{
    EXIT(OFF);
    ENTER(OPERATIONAL);
    m->is_on = 1;
    ENTER(R0);
    ENTER_STATE(0)
    ENTER(R1);
    ENTER_STATE(1)
    ENTER(R2);
    ENTER_STATE(2)
    ENTER(R3);
    ENTER_STATE(3)
}

void chart_c_dispatch(chart_c *m, chart_c_event event)
{
    uint8_t next[4];
    if (!m->is_on) {
        if (event == CHART_C_EVENT_ON) {
            memset(m->region, 0, sizeof m->region);
            switch_on(m);
        } else if (event == CHART_C_EVENT_RESUME) {
            switch_on(m);
        }
        return;
    }
    switch (event) {
    case CHART_C_EVENT_OFF:
        EXIT_STATE(3)
        EXIT(R3);
        EXIT_STATE(2)
        EXIT(R2);
        EXIT_STATE(1)
        EXIT(R1);
        EXIT_STATE(0)
        EXIT(R0);
        EXIT(OPERATIONAL);
        m->is_on = 0;
        ENTER(OFF);
        break;
    case CHART_C_EVENT_TICK:
        SELECT_TICK(0)
        SELECT_TICK(1)
        SELECT_TICK(2)
        SELECT_TICK(3)
        EXIT_ON_TICK(3)
        EXIT_ON_TICK(2)
        EXIT_ON_TICK(1)
        EXIT_ON_TICK(0)
        ENTER_ON_TICK(0)
        ENTER_ON_TICK(1)
        ENTER_ON_TICK(2)
        ENTER_ON_TICK(3)
        break;
    case CHART_C_EVENT_A0: ON_A(0) break;
    case CHART_C_EVENT_A1: ON_A(1) break;
    case CHART_C_EVENT_A2: ON_A(2) break;
    case CHART_C_EVENT_A3: ON_A(3) break;
    case CHART_C_EVENT_B0: ON_B(0) break;
    case CHART_C_EVENT_B1: ON_B(1) break;
    case CHART_C_EVENT_B2: ON_B(2) break;
    case CHART_C_EVENT_B3: ON_B(3) break;
    default:
        break;
    }
}
