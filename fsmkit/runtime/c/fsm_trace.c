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
    fsm_writer w = fsm_write_to(bytes);
    for (unsigned i = 0u; i < 4u; i++) {
        *w.at++ = magic[i];
    }
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
    fsm_writer w = fsm_write_to(bytes);
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
    fsm_writer w = fsm_write_to(head);
    fsm_put(&w, (uint32_t)kind, 1u);
    fsm_put(&w, (uint32_t)size, 2u);
    fsm_log_write(head, sizeof head);
    if (size > 0u) {
        fsm_log_write(bytes, size);
    }
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
    fsm_writer w = fsm_write_to(head);
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

static void log_from(fsm_log_kind kind, const uint8_t *bytes, const fsm_writer *w)
{
    fsm_log_record(kind, bytes, (size_t)(w->at - bytes));
}

void fsm_log_call(fsm_log_kind kind, const fsm_machine_info *info, uint16_t instance, const void *m,
                  const void *e, uint32_t now, uint8_t *bytes)
{
    fsm_writer w = fsm_write_to(bytes);
    const fsm_field *inputs = &info->variables[info->data_count + info->output_count];
    fsm_put(&w, instance, 2u);
    fsm_put(&w, now, 4u);
    for (uint16_t i = 0u; i < info->input_count; i++) {
        fsm_put_value(&w, info, inputs[i].type, fsm_at(m, inputs[i].offset));
    }
    if (kind == FSM_LOG_START) {
        for (unsigned i = 4u; i < FSM_SAVED_HEAD; i++) {
            *w.at++ = info->head[i];
        }
    }
    if (e != NULL) {
        fsm_put_event(&w, info, e);
    }
    log_from(kind, bytes, &w);
}

void fsm_log_post(const fsm_machine_info *info, uint16_t instance, const void *e, bool fits,
                  uint8_t *bytes)
{
    fsm_writer w = fsm_write_to(bytes);
    fsm_put(&w, instance, 2u);
    fsm_put(&w, fits ? 1u : 0u, 1u);
    fsm_put_event(&w, info, e);
    log_from(FSM_LOG_POST, bytes, &w);
}

void fsm_log_called(const fsm_machine_info *info, uint16_t machine, uint16_t operation,
                    const void *result, uint8_t *bytes)
{
    fsm_writer w = fsm_write_to(bytes);
    fsm_put(&w, machine, 2u);
    fsm_put(&w, operation, 2u);
    if (result != NULL) {
        fsm_put_value(&w, info, info->operations[operation].result, result);
    }
    log_from(FSM_LOG_CALLED, bytes, &w);
}

static bool is_empty(const fsm_list_info *list, const void *m)
{
    return list->offset == FSM_ABSENT || *(const uint8_t *)fsm_at(m, list->count) == 0u;
}

bool fsm_is_idle(const fsm_machine_info *info, const void *m, uint32_t now)
{
    if (info->slot_count > 0u || info->input_count > 0u) {
        return false;
    }
    if (!is_empty(&info->queue, m) || !is_empty(&info->deferred, m)) {
        return false;
    }
    if (is_empty(&info->timers, m)) {
        return true;
    }
    return !fsm_reached(now, ((const fsm_timer *)fsm_at(m, info->timers.offset))->deadline);
}
