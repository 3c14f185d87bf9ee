/* Chart B by hand, for speed: a switch over the active leaf, with inherited transitions written out. */
#include "chart_b.h"

#include <string.h>

void chart_b_init(chart_b *m)
{
    memset(m, 0, sizeof *m);
    ENTER(OFF);
    m->state = CHART_B_STATE_OFF;
}

void chart_b_dispatch(chart_b *m, chart_b_event event)
{
    switch (m->state) {
    case CHART_B_STATE_OFF:
        switch (event) {
        case CHART_B_EVENT_POWER_ON:
            EXIT(OFF);
            ENTER(OPERATIONAL);
            ENTER(HOMING);
            m->state = CHART_B_STATE_HOMING;
            break;
        default:
            break;
        }
        break;
    case CHART_B_STATE_HOMING:
        switch (event) {
        case CHART_B_EVENT_POWER_OFF:
            EXIT(HOMING);
            EXIT(OPERATIONAL);
            ENTER(OFF);
            m->state = CHART_B_STATE_OFF;
            break;
        case CHART_B_EVENT_HOMED:
            EXIT(HOMING);
            ENTER(IDLE);
            m->state = CHART_B_STATE_IDLE;
            break;
        case CHART_B_EVENT_FAULT:
            EXIT(HOMING);
            EXIT(OPERATIONAL);
            m->data.faults++;
            ENTER(ERROR);
            m->state = CHART_B_STATE_ERROR;
            break;
        case CHART_B_EVENT_RESET:
            EXIT(HOMING);
            EXIT(OPERATIONAL);
            ENTER(OPERATIONAL);
            ENTER(HOMING);
            m->state = CHART_B_STATE_HOMING;
            break;
        case CHART_B_EVENT_TICK:
            m->data.ticks++;
            break;
        default:
            break;
        }
        break;
    case CHART_B_STATE_IDLE:
        switch (event) {
        case CHART_B_EVENT_POWER_OFF:
            EXIT(IDLE);
            EXIT(OPERATIONAL);
            ENTER(OFF);
            m->state = CHART_B_STATE_OFF;
            break;
        case CHART_B_EVENT_START:
            if (m->data.n < 200) {
                EXIT(IDLE);
                m->data.n++;
                ENTER(RUNNING);
                ENTER(MOVING);
                m->state = CHART_B_STATE_MOVING;
                break;
            }
            m->data.n = 0;
            break;
        case CHART_B_EVENT_FAULT:
            EXIT(IDLE);
            EXIT(OPERATIONAL);
            m->data.faults++;
            ENTER(ERROR);
            m->state = CHART_B_STATE_ERROR;
            break;
        case CHART_B_EVENT_RESET:
            EXIT(IDLE);
            EXIT(OPERATIONAL);
            ENTER(OPERATIONAL);
            ENTER(HOMING);
            m->state = CHART_B_STATE_HOMING;
            break;
        case CHART_B_EVENT_TICK:
            m->data.ticks++;
            break;
        default:
            break;
        }
        break;
    case CHART_B_STATE_MOVING:
        switch (event) {
        case CHART_B_EVENT_POWER_OFF:
            EXIT(MOVING);
            EXIT(RUNNING);
            EXIT(OPERATIONAL);
            ENTER(OFF);
            m->state = CHART_B_STATE_OFF;
            break;
        case CHART_B_EVENT_ARRIVED:
            EXIT(MOVING);
            ENTER(WAITING);
            m->state = CHART_B_STATE_WAITING;
            break;
        case CHART_B_EVENT_STOP:
            EXIT(MOVING);
            EXIT(RUNNING);
            ENTER(STOPPING);
            m->state = CHART_B_STATE_STOPPING;
            break;
        case CHART_B_EVENT_FAULT:
            EXIT(MOVING);
            EXIT(RUNNING);
            EXIT(OPERATIONAL);
            m->data.faults++;
            ENTER(ERROR);
            m->state = CHART_B_STATE_ERROR;
            break;
        case CHART_B_EVENT_RESET:
            EXIT(MOVING);
            EXIT(RUNNING);
            EXIT(OPERATIONAL);
            ENTER(OPERATIONAL);
            ENTER(HOMING);
            m->state = CHART_B_STATE_HOMING;
            break;
        case CHART_B_EVENT_TICK:
            if (m->data.n > 0) {
                m->data.n--;
                break;
            }
            m->data.ticks++;
            break;
        default:
            break;
        }
        break;
    case CHART_B_STATE_WAITING:
        switch (event) {
        case CHART_B_EVENT_POWER_OFF:
            EXIT(WAITING);
            EXIT(RUNNING);
            EXIT(OPERATIONAL);
            ENTER(OFF);
            m->state = CHART_B_STATE_OFF;
            break;
        case CHART_B_EVENT_READY:
            if ((m->data.n & 1) == 0) {
                EXIT(WAITING);
                ENTER(HANDSHAKE);
                m->state = CHART_B_STATE_HANDSHAKE;
                break;
            }
            m->data.n++;
            break;
        case CHART_B_EVENT_STOP:
            EXIT(WAITING);
            EXIT(RUNNING);
            ENTER(STOPPING);
            m->state = CHART_B_STATE_STOPPING;
            break;
        case CHART_B_EVENT_FAULT:
            EXIT(WAITING);
            EXIT(RUNNING);
            EXIT(OPERATIONAL);
            m->data.faults++;
            ENTER(ERROR);
            m->state = CHART_B_STATE_ERROR;
            break;
        case CHART_B_EVENT_RESET:
            EXIT(WAITING);
            EXIT(RUNNING);
            EXIT(OPERATIONAL);
            ENTER(OPERATIONAL);
            ENTER(HOMING);
            m->state = CHART_B_STATE_HOMING;
            break;
        case CHART_B_EVENT_TICK:
            if (m->data.n > 0) {
                m->data.n--;
                break;
            }
            m->data.ticks++;
            break;
        default:
            break;
        }
        break;
    case CHART_B_STATE_HANDSHAKE:
        switch (event) {
        case CHART_B_EVENT_POWER_OFF:
            EXIT(HANDSHAKE);
            EXIT(RUNNING);
            EXIT(OPERATIONAL);
            ENTER(OFF);
            m->state = CHART_B_STATE_OFF;
            break;
        case CHART_B_EVENT_DONE:
            if ((m->data.parts & 7) == 7) {
                EXIT(HANDSHAKE);
                EXIT(RUNNING);
                m->data.parts++;
                ENTER(IDLE);
                m->state = CHART_B_STATE_IDLE;
                break;
            }
            EXIT(HANDSHAKE);
            m->data.parts++;
            m->data.n += 2;
            ENTER(MOVING);
            m->state = CHART_B_STATE_MOVING;
            break;
        case CHART_B_EVENT_STOP:
            EXIT(HANDSHAKE);
            EXIT(RUNNING);
            ENTER(STOPPING);
            m->state = CHART_B_STATE_STOPPING;
            break;
        case CHART_B_EVENT_FAULT:
            EXIT(HANDSHAKE);
            EXIT(RUNNING);
            EXIT(OPERATIONAL);
            m->data.faults++;
            ENTER(ERROR);
            m->state = CHART_B_STATE_ERROR;
            break;
        case CHART_B_EVENT_RESET:
            EXIT(HANDSHAKE);
            EXIT(RUNNING);
            EXIT(OPERATIONAL);
            ENTER(OPERATIONAL);
            ENTER(HOMING);
            m->state = CHART_B_STATE_HOMING;
            break;
        case CHART_B_EVENT_TICK:
            if (m->data.n > 0) {
                m->data.n--;
                break;
            }
            m->data.ticks++;
            break;
        default:
            break;
        }
        break;
    case CHART_B_STATE_STOPPING:
        switch (event) {
        case CHART_B_EVENT_POWER_OFF:
            EXIT(STOPPING);
            EXIT(OPERATIONAL);
            ENTER(OFF);
            m->state = CHART_B_STATE_OFF;
            break;
        case CHART_B_EVENT_FAULT:
            EXIT(STOPPING);
            EXIT(OPERATIONAL);
            m->data.faults++;
            ENTER(ERROR);
            m->state = CHART_B_STATE_ERROR;
            break;
        case CHART_B_EVENT_RESET:
            EXIT(STOPPING);
            EXIT(OPERATIONAL);
            ENTER(OPERATIONAL);
            ENTER(HOMING);
            m->state = CHART_B_STATE_HOMING;
            break;
        case CHART_B_EVENT_TICK:
            EXIT(STOPPING);
            ENTER(IDLE);
            m->state = CHART_B_STATE_IDLE;
            break;
        default:
            break;
        }
        break;
    case CHART_B_STATE_ERROR:
        switch (event) {
        case CHART_B_EVENT_POWER_OFF:
            EXIT(ERROR);
            ENTER(OFF);
            m->state = CHART_B_STATE_OFF;
            break;
        case CHART_B_EVENT_RESET:
            if ((m->data.faults & 1) == 1) {
                EXIT(ERROR);
                ENTER(OPERATIONAL);
                ENTER(HOMING);
                m->state = CHART_B_STATE_HOMING;
                break;
            }
            EXIT(ERROR);
            ENTER(OFF);
            m->state = CHART_B_STATE_OFF;
            break;
        default:
            break;
        }
        break;
    default:
        break;
    }
}
