/* Takes the events of a stream one by one, for the driver of certificates (driver.h): a request is
 * one event, and the machine stays as it is between two of them. */
#include "driver.h"

#define machine fsm_machine
#define events fsm_event
#include "bench_chart.h"

BENCH_MACHINE fsm_machine CERTIFY_ALIGNED;
BENCH_MACHINE fsm_state CERTIFY_ALIGNED;
BENCH_EVENT fsm_event[1];

const uint32_t certify_machine_size = (uint32_t)sizeof(BENCH_MACHINE);

void *certify_state(void)
{
    return &fsm_state;
}

void *certify_machine(void)
{
    return &fsm_machine;
}

void certify_prepare(void)
{
}

bool certify_restore_inputs(void)
{
    return true;
}

uint32_t certify_perform(uint8_t action, uint32_t now)
{
    static const uint32_t numbers[] = {BENCH_NUMBERS};
    (void)now;
    if (action == CERTIFY_START) {
        BENCH_INIT;
        CERTIFY(BENCH_START);
    } else {
        BENCH_SET(fsm_event[0], (uint16_t)numbers[certify_take8()]);
        CERTIFY(BENCH_DISPATCH(0));
    }
    return 0u;
}

void certify_after(uint32_t now)
{
    (void)now;
}
