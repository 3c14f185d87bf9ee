/* fsm_trace.c: the ring of transitions, and the records of the log. See fsm_trace.h. */
#include "fsm_trace.h"

static uint32_t now_;
static uint16_t cause_;

void fsm_trace_at(uint32_t now)
{
    now_ = now;
}

uint32_t fsm_trace_time(void)
{
    return now_;
}

void fsm_trace_cause(uint16_t event)
{
    cause_ = event;
}

#if FSM_TRACE_RECORDS > 0
static struct {
    uint32_t count; /* of all there ever were, modulo 2^32 */
    fsm_trace_record records[FSM_TRACE_RECORDS];
} ring_;

typedef char fsm_trace_holds_a_power_of_two
    [((FSM_TRACE_RECORDS) & ((FSM_TRACE_RECORDS) - 1)) == 0 ? 1 : -1];

void fsm_trace_clear(void)
{
    ring_.count = 0u;
}

size_t fsm_trace_dump(uint8_t *bytes)
{
    static const uint8_t magic[4] = {0x46u, 0x53u, 0x54u, 0x01u};
    const uint32_t held = ring_.count < FSM_TRACE_RECORDS ? ring_.count : FSM_TRACE_RECORDS;
    fsm_writer w = {bytes};
    for (unsigned i = 0u; i < 4u; i++)
        *w.at++ = magic[i];
    fsm_put(&w, ring_.count, 4u);
    for (uint32_t i = 0u; i < held; i++) {
        const fsm_trace_record *r = &ring_.records[(ring_.count - held + i) % FSM_TRACE_RECORDS];
        fsm_put(&w, r->time, 4u);
        fsm_put(&w, r->instance, 2u);
        fsm_put(&w, r->machine, 2u);
        fsm_put(&w, r->event, 2u);
        fsm_put(&w, r->transition, 2u);
    }
    return (size_t)(w.at - bytes);
}
#endif

void fsm_trace_take(uint16_t instance, uint16_t machine, uint32_t time, uint16_t transition)
{
    uint8_t bytes[4];
    fsm_writer w = {bytes};
#if FSM_TRACE_RECORDS > 0
    const fsm_trace_record record = {time, instance, machine, cause_, transition};
    ring_.records[ring_.count % FSM_TRACE_RECORDS] = record;
    ring_.count++;
#else
    (void)instance;
    (void)time;
    (void)cause_;
#endif
    fsm_put(&w, machine, 2u);
    fsm_put(&w, transition, 2u);
    fsm_log_record(FSM_LOG_TAKEN, bytes, 4u);
}

void fsm_log_record(fsm_log_kind kind, const uint8_t *bytes, size_t size)
{
#ifdef FSM_LOGGED
    uint8_t head[3];
    fsm_writer w = {head};
    fsm_put(&w, (uint32_t)kind, 1u);
    fsm_put(&w, (uint32_t)size, 2u);
    fsm_log_write(head, sizeof head);
    if (size > 0u)
        fsm_log_write(bytes, size);
#else
    (void)kind;
    (void)bytes;
    (void)size;
#endif
}

void fsm_log_restored(uint16_t instance, uint32_t now, const uint8_t *bytes, size_t size)
{
#ifdef FSM_LOGGED
    uint8_t head[9];
    fsm_writer w = {head};
    fsm_put(&w, (uint32_t)FSM_LOG_RESTORE, 1u);
    fsm_put(&w, (uint32_t)size + 6u, 2u);
    fsm_put(&w, instance, 2u);
    fsm_put(&w, now, 4u);
    fsm_log_write(head, sizeof head);
    fsm_log_write(bytes, size);
#else
    (void)instance;
    (void)now;
    (void)bytes;
    (void)size;
#endif
}
