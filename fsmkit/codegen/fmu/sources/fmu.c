/* fmu.c: see fmu.h.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms. */
#include "fmu.h"

#include <string.h>

static fmu_instance instances[FMU_INSTANCES];
static fmu_copy copies[FMU_STATES];

fmu_instance *fmu_take(void)
{
    for (size_t k = 0u; k < FMU_INSTANCES; k++) {
        if (!instances[k].is_taken) {
            memset(&instances[k], 0, sizeof instances[k]);
            instances[k].is_taken = true;
            fmu_reset(&instances[k]);
            return &instances[k];
        }
    }
    return NULL;
}

void fmu_reset(fmu_instance *i)
{
    memset(&i->state, 0, sizeof i->state);
    FMU_DRIVER.info->init(&i->state.machine);
    for (uint32_t r = 0u; r < FMU_COUNT; r++) {
        uint32_t offset = 0u;
        const fsm_type *type = fmu_type(&fmu_rows[r], &offset);
        const uint64_t sign = (uint64_t)1u << 63;
        if (type == NULL || type->kind == FSM_FLOAT || fmu_rows[r].source == FMU_VARIABLE) {
            continue;
        }
        if (!fsm_is_of(type, 0u)) { /* the bound that is nearest to 0, as in modelDescription.xml */
            i->state.held[r] = type->kind == FSM_SIGNED && (type->hi & sign) != 0u ? type->hi
                                                                                  : type->lo;
        }
    }
}

/* ---- variables --------------------------------------------------------------------------------- */

const fsm_type *fmu_type(const fmu_row *row, uint32_t *offset)
{
    const fsm_machine_info *info = FMU_DRIVER.info;
    const fsm_field *field;
    *offset = 0u;
    switch (row->source) {
    case FMU_VARIABLE:
        field = &info->variables[row->number];
        break;
    case FMU_FIELD:
        field = &info->events[row->number].fields[row->field];
        break;
    case FMU_PARAMETER:
        field = &info->operations[row->number].parameters[row->field];
        break;
    case FMU_RESULT:
        return fsm_scalar(info->operations[row->number].result, row->scalar, offset);
    default:
        return NULL;
    }
    *offset = field->offset;
    return fsm_scalar(field->type, row->scalar, offset);
}

bool fmu_get(const fmu_instance *i, uint32_t reference, uint64_t *bits)
{
    const fmu_row *row = &fmu_rows[reference];
    uint32_t offset = 0u;
    const fsm_type *type = fmu_type(row, &offset);
    if (row->source == FMU_VARIABLE) {
        *bits = fsm_bits_at(type, fsm_at(&i->state.machine, offset));
    } else if (row->source == FMU_REGION) {
        *bits = fsm_number_at(&FMU_DRIVER.info->numbers[row->number], &i->state.machine);
    } else if (row->source == FMU_TIME) {
        memcpy(bits, &i->state.time, sizeof i->state.time);
    } else {
        *bits = i->state.held[reference];
    }
    return true;
}

bool fmu_set(fmu_instance *i, uint32_t reference, uint64_t bits)
{
    const fmu_row *row = &fmu_rows[reference];
    uint32_t offset = 0u;
    const fsm_type *type = fmu_type(row, &offset);
    if (!row->is_input || (type != NULL && !fsm_is_of(type, bits))) {
        return false;
    }
    if (row->source == FMU_VARIABLE) {
        fsm_set_bits(type, fsm_place_at(&i->state.machine, offset), bits);
    } else {
        i->state.held[reference] = bits;
    }
    return true;
}

/* ---- messages of the machine --------------------------------------------------------------------- */

static void append(fmu_state *s, uint32_t source, uint32_t number, const fsm_field *fields,
                   const void *const *arguments)
{
    fmu_message *message;
    uint32_t reference = 0u, count = 0u;
    if (s->pending_count == FMU_PENDING) {
        s->is_overrun = true;
        return;
    }
    while (fmu_rows[reference].source != source || fmu_rows[reference].number != number) {
        reference++;
    }
    message = &s->pending[(s->pending_first + s->pending_count++) % FMU_PENDING];
    memset(message, 0, sizeof *message);
    message->reference = reference;
    for (uint32_t r = reference + 1u; r < FMU_COUNT; r++) {
        const fmu_row *row = &fmu_rows[r];
        uint32_t offset = 0u;
        const fsm_type *type;
        if ((row->source != FMU_FIELD && row->source != FMU_PARAMETER) || row->number != number) {
            break;
        }
        type = fsm_scalar(fields[row->field].type, row->scalar, &offset);
        message->bits[count++] = fsm_bits_at(type, fsm_at(arguments[row->field], offset));
    }
}

void fmu_sent(void *m, uint32_t event, const void *const *arguments)
{
    append((fmu_state *)m, FMU_OUT, event, FMU_DRIVER.info->events[event].fields, arguments);
}

void fmu_called(void *m, uint32_t operation, const void *const *arguments, void *result)
{
    const fsm_operation_info *info = &FMU_DRIVER.info->operations[operation];
    fmu_state *s = (fmu_state *)m;
    append(s, FMU_CALL, operation, info->parameters, arguments);
    for (uint32_t r = 0u; result != NULL && r < FMU_COUNT; r++) {
        if (fmu_rows[r].source == FMU_RESULT && fmu_rows[r].number == operation) {
            uint32_t offset = 0u;
            const fsm_type *type = fmu_type(&fmu_rows[r], &offset);
            fsm_set_bits(type, fsm_place_at(result, offset), s->held[r]);
        }
    }
}

bool fmu_next(fmu_instance *i)
{
    fmu_state *s = &i->state;
    const fmu_message *message = &s->pending[s->pending_first];
    uint32_t count = 0u;
    if (!i->is_counting) {
        for (uint32_t r = 0u; r < FMU_COUNT; r++) {
            if (fmu_rows[r].source == FMU_OUT || fmu_rows[r].source == FMU_CALL) {
                s->held[r] = 0u;
            }
        }
    }
    if (s->pending_count == 0u) {
        return false;
    }
    for (uint32_t r = message->reference + 1u; r < FMU_COUNT
         && (fmu_rows[r].source == FMU_FIELD || fmu_rows[r].source == FMU_PARAMETER); r++)
        s->held[r] = message->bits[count++];
    if (i->is_counting) {
        s->held[message->reference] = (s->held[message->reference] + 1u) & INT32_MAX;
    } else {
        s->held[message->reference] = 1u;
    }
    s->pending_first = (s->pending_first + 1u) % FMU_PENDING;
    s->pending_count--;
    return true;
}

/* ---- running ------------------------------------------------------------------------------------- */

/* Whole ticks since the start; an importer's sums of steps are off by less than a thousandth. */
static uint64_t ticks(const fmu_instance *i, double time)
{
    return (uint64_t)((time - i->state.start) * (1e6 / FMU_TICK_US) + 1e-3);
}

static bool post(fmu_instance *i, uint32_t reference)
{
    const fsm_machine_info *info = FMU_DRIVER.info;
    const uint32_t number = fmu_rows[reference].number;
    struct {
        fmu_event event;
        uint64_t room; /* an access of any width lies within */
    } e;
    memset(&e, 0, sizeof e);
    fsm_store_bits(fsm_place_at(&e, info->event_number), info->event_width, number + 1u);
    for (uint32_t r = reference + 1u; r < FMU_COUNT && fmu_rows[r].source == FMU_FIELD; r++) {
        uint32_t offset = 0u;
        const fsm_type *type = fmu_type(&fmu_rows[r], &offset);
        fsm_set_bits(type, fsm_place_at(&e, offset), i->state.held[r]);
    }
    return FMU_DRIVER.post != NULL && FMU_DRIVER.post(&i->state.machine, &e.event);
}

void fmu_start(fmu_instance *i)
{
    FMU_DRIVER.start(&i->state.machine, (uint32_t)ticks(i, i->state.time));
}

/* Post an event; a full queue is worked off first, so that none is lost. */
static void deliver(fmu_instance *i, uint32_t reference)
{
    fmu_state *s = &i->state;
    if (post(i, reference) || !fsm_is_running(FMU_DRIVER.info, &s->machine)) {
        return;
    }
    FMU_DRIVER.run(&s->machine, (uint32_t)ticks(i, s->time));
    if (!post(i, reference) && fsm_is_running(FMU_DRIVER.info, &s->machine)) {
        s->is_overrun = true;
    }
}

void fmu_run(fmu_instance *i)
{
    fmu_state *s = &i->state;
    for (uint32_t r = 0u; r < FMU_COUNT; r++) {
        if (fmu_rows[r].source != FMU_IN) {
            continue;
        }
        if (i->is_counting) {
            if (s->held[r] > s->posted[r] && s->held[r] - s->posted[r] > FMU_POSTED) {
                s->is_overrun = true;
            }
            for (; s->posted[r] < s->held[r] && !s->is_overrun; s->posted[r]++) {
                deliver(i, r);
            }
            s->posted[r] = s->held[r];
        } else if (s->held[r] != 0u) {
            deliver(i, r);
            s->held[r] = 0u;
        }
    }
    FMU_DRIVER.run(&s->machine, (uint32_t)ticks(i, s->time));
}

bool fmu_deadline(const fmu_instance *i, double *at)
{
    const uint64_t now = ticks(i, i->state.time);
    uint32_t due = 0u;
    int32_t left;
    if (!FMU_DRIVER.next_deadline(&i->state.machine, &due)) {
        return false;
    }
    left = (int32_t)(due - (uint32_t)now);
    *at = i->state.time;
    if (left > 0) {
        *at = i->state.start + (double)(now + (uint64_t)left) * (FMU_TICK_US / 1e6);
    }
    return true;
}

bool fmu_is_due_within(const fmu_instance *i, double end, double *at)
{
    if (!fmu_deadline(i, at) || ticks(i, *at) <= ticks(i, i->state.time)
        || ticks(i, *at) > ticks(i, end)) {
        return false;
    }
    if (*at > end) {
        *at = end;
    }
    return true;
}

const char *fmu_trouble(const fmu_instance *i)
{
    const fsm_machine_info *info = FMU_DRIVER.info;
    if (i->state.is_overrun) {
        return "more events in a step than there is room for (FMU_PENDING, FMU_POSTED)";
    }
    if (info->fault != FSM_ABSENT && *(const uint8_t *)fsm_at(&i->state.machine, info->fault) != 0u) {
        return "the machine stopped with a fault";
    }
    return NULL;
}

/* ---- states -------------------------------------------------------------------------------------- */

fmu_copy *fmu_save(const fmu_instance *i, fmu_copy *over)
{
    for (size_t k = 0u; over == NULL && k < FMU_STATES; k++) {
        if (!copies[k].is_taken) {
            over = &copies[k];
        }
    }
    if (over != NULL) {
        over->is_taken = true;
        if (i != NULL) {
            over->state = i->state;
        }
    }
    return over;
}

/* FNV-1a, 64 bits: what was damaged on its way is refused. */
static uint64_t checksum(const unsigned char *bytes, size_t size)
{
    uint64_t sum = UINT64_C(0xcbf29ce484222325);
    for (size_t k = 0u; k < size; k++) {
        sum = (sum ^ bytes[k]) * UINT64_C(0x100000001b3);
    }
    return sum;
}

void fmu_export(const fmu_state *state, unsigned char *bytes)
{
    unsigned char *copy = bytes + FMU_SAVED_BYTES - sizeof *state;
    uint64_t sum;
    memcpy(copy, state, sizeof *state);
    sum = checksum(copy, sizeof *state);
    memcpy(bytes, FMU_TOKEN, sizeof FMU_TOKEN);
    memcpy(bytes + sizeof FMU_TOKEN, &sum, sizeof sum);
}

bool fmu_import(fmu_state *state, const unsigned char *bytes, size_t size)
{
    const unsigned char *copy = bytes + FMU_SAVED_BYTES - sizeof *state;
    uint64_t sum;
    if (size != FMU_SAVED_BYTES || memcmp(bytes, FMU_TOKEN, sizeof FMU_TOKEN) != 0) {
        return false;
    }
    memcpy(&sum, bytes + sizeof FMU_TOKEN, sizeof sum);
    if (sum != checksum(copy, sizeof *state)) {
        return false;
    }
    memcpy(state, copy, sizeof *state);
    return true;
}
