/* Chart B by hand, for size: functions walk the hierarchy. */
#include "chart_b.h"

#include <string.h>

#define NO_STATE CHART_B_STATES

/* Exit the active states inside one; all of them inside NO_STATE. */
static void leave(chart_b *m, unsigned domain)
{
    unsigned state = m->state;
    while (state != domain) {
        switch (state) {
        case CHART_B_STATE_OFF:
            EXIT(OFF);
            state = NO_STATE;
            break;
        case CHART_B_STATE_OPERATIONAL:
            EXIT(OPERATIONAL);
            state = NO_STATE;
            break;
        case CHART_B_STATE_HOMING:
            EXIT(HOMING);
            state = CHART_B_STATE_OPERATIONAL;
            break;
        case CHART_B_STATE_IDLE:
            EXIT(IDLE);
            state = CHART_B_STATE_OPERATIONAL;
            break;
        case CHART_B_STATE_RUNNING:
            EXIT(RUNNING);
            state = CHART_B_STATE_OPERATIONAL;
            break;
        case CHART_B_STATE_MOVING:
            EXIT(MOVING);
            state = CHART_B_STATE_RUNNING;
            break;
        case CHART_B_STATE_WAITING:
            EXIT(WAITING);
            state = CHART_B_STATE_RUNNING;
            break;
        case CHART_B_STATE_HANDSHAKE:
            EXIT(HANDSHAKE);
            state = CHART_B_STATE_RUNNING;
            break;
        case CHART_B_STATE_STOPPING:
            EXIT(STOPPING);
            state = CHART_B_STATE_OPERATIONAL;
            break;
        case CHART_B_STATE_ERROR:
            EXIT(ERROR);
            state = NO_STATE;
            break;
        default:
            return;
        }
    }
}

/* Enter a state and its default descendants. */
static void enter(chart_b *m, unsigned state)
{
    switch (state) {
    case CHART_B_STATE_OFF:
        ENTER(OFF);
        break;
    case CHART_B_STATE_OPERATIONAL:
        ENTER(OPERATIONAL);
        enter(m, CHART_B_STATE_HOMING);
        return;
    case CHART_B_STATE_HOMING:
        ENTER(HOMING);
        break;
    case CHART_B_STATE_IDLE:
        ENTER(IDLE);
        break;
    case CHART_B_STATE_RUNNING:
        ENTER(RUNNING);
        enter(m, CHART_B_STATE_MOVING);
        return;
    case CHART_B_STATE_MOVING:
        ENTER(MOVING);
        break;
    case CHART_B_STATE_WAITING:
        ENTER(WAITING);
        break;
    case CHART_B_STATE_HANDSHAKE:
        ENTER(HANDSHAKE);
        break;
    case CHART_B_STATE_STOPPING:
        ENTER(STOPPING);
        break;
    case CHART_B_STATE_ERROR:
        ENTER(ERROR);
        break;
    default:
        break;
    }
    m->state = (uint8_t)state;
}

void chart_b_init(chart_b *m)
{
    memset(m, 0, sizeof *m);
    ENTER(OFF);
    m->state = CHART_B_STATE_OFF;
}

void chart_b_dispatch(chart_b *m, chart_b_event event)
{
    unsigned state = m->state;
    for (;;) {
        switch (state) {
        case CHART_B_STATE_OFF:
            switch (event) {
            case CHART_B_EVENT_POWER_ON:
                leave(m, NO_STATE);
                enter(m, CHART_B_STATE_OPERATIONAL);
                return;
            default:
                break;
            }
            return;
        case CHART_B_STATE_OPERATIONAL:
            switch (event) {
            case CHART_B_EVENT_POWER_OFF:
                leave(m, NO_STATE);
                enter(m, CHART_B_STATE_OFF);
                return;
            case CHART_B_EVENT_FAULT:
                leave(m, NO_STATE);
                m->data.faults++;
                enter(m, CHART_B_STATE_ERROR);
                return;
            case CHART_B_EVENT_RESET:
                leave(m, NO_STATE);
                enter(m, CHART_B_STATE_OPERATIONAL);
                return;
            case CHART_B_EVENT_TICK:
                m->data.ticks++;
                return;
            default:
                break;
            }
            return;
        case CHART_B_STATE_HOMING:
            switch (event) {
            case CHART_B_EVENT_HOMED:
                leave(m, CHART_B_STATE_OPERATIONAL);
                enter(m, CHART_B_STATE_IDLE);
                return;
            default:
                break;
            }
            state = CHART_B_STATE_OPERATIONAL;
            break;
        case CHART_B_STATE_IDLE:
            switch (event) {
            case CHART_B_EVENT_START:
                if (m->data.n < 200) {
                    leave(m, CHART_B_STATE_OPERATIONAL);
                    m->data.n++;
                    enter(m, CHART_B_STATE_RUNNING);
                    return;
                }
                m->data.n = 0;
                return;
            default:
                break;
            }
            state = CHART_B_STATE_OPERATIONAL;
            break;
        case CHART_B_STATE_RUNNING:
            switch (event) {
            case CHART_B_EVENT_STOP:
                leave(m, CHART_B_STATE_OPERATIONAL);
                enter(m, CHART_B_STATE_STOPPING);
                return;
            case CHART_B_EVENT_TICK:
                if (m->data.n > 0) {
                    m->data.n--;
                    return;
                }
                break;
            default:
                break;
            }
            state = CHART_B_STATE_OPERATIONAL;
            break;
        case CHART_B_STATE_MOVING:
            switch (event) {
            case CHART_B_EVENT_ARRIVED:
                leave(m, CHART_B_STATE_RUNNING);
                enter(m, CHART_B_STATE_WAITING);
                return;
            default:
                break;
            }
            state = CHART_B_STATE_RUNNING;
            break;
        case CHART_B_STATE_WAITING:
            switch (event) {
            case CHART_B_EVENT_READY:
                if ((m->data.n & 1) == 0) {
                    leave(m, CHART_B_STATE_RUNNING);
                    enter(m, CHART_B_STATE_HANDSHAKE);
                    return;
                }
                m->data.n++;
                return;
            default:
                break;
            }
            state = CHART_B_STATE_RUNNING;
            break;
        case CHART_B_STATE_HANDSHAKE:
            switch (event) {
            case CHART_B_EVENT_DONE:
                if ((m->data.parts & 7) == 7) {
                    leave(m, CHART_B_STATE_OPERATIONAL);
                    m->data.parts++;
                    enter(m, CHART_B_STATE_IDLE);
                    return;
                }
                leave(m, CHART_B_STATE_RUNNING);
                m->data.parts++;
                m->data.n += 2;
                enter(m, CHART_B_STATE_MOVING);
                return;
            default:
                break;
            }
            state = CHART_B_STATE_RUNNING;
            break;
        case CHART_B_STATE_STOPPING:
            switch (event) {
            case CHART_B_EVENT_TICK:
                leave(m, CHART_B_STATE_OPERATIONAL);
                enter(m, CHART_B_STATE_IDLE);
                return;
            default:
                break;
            }
            state = CHART_B_STATE_OPERATIONAL;
            break;
        case CHART_B_STATE_ERROR:
            switch (event) {
            case CHART_B_EVENT_POWER_OFF:
                leave(m, NO_STATE);
                enter(m, CHART_B_STATE_OFF);
                return;
            case CHART_B_EVENT_RESET:
                if ((m->data.faults & 1) == 1) {
                    leave(m, NO_STATE);
                    enter(m, CHART_B_STATE_OPERATIONAL);
                    return;
                }
                leave(m, NO_STATE);
                enter(m, CHART_B_STATE_OFF);
                return;
            default:
                break;
            }
            return;
        default:
            return;
        }
    }
}
