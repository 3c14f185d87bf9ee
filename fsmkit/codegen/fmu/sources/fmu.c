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
    fmu_model_init(&i->state.machine);
    for (uint32_t r = 0u; r < FMU_COUNT; r++) {
        uint32_t offset = 0u;
        const fsm_type *type = fmu_type(&fmu_rows[r], &offset);
        const uint64_t sign = (uint64_t)1u << 63;
        if (type == NULL || type->kind == FSM_FLOAT || fmu_rows[r].source == FMU_VARIABLE) {
            continue;
        }
        if (type->kind == FSM_ENUMERATION && type->numbers != NULL) { /* the first member */
            i->state.held[r] = (uint64_t)(int64_t)type->numbers[0];
        } else if (!fsm_is_of(type, 0u)) { /* the bound that is nearest to 0, as in modelDescription.xml */
            i->state.held[r] = fsm_is_signed(type) && (type->hi & sign) != 0u ? type->hi
                                                                                  : type->lo;
        }
    }
}

/* ---- machines ---------------------------------------------------------------------------------- */

static const fsm_machine_info *info_of(const fmu_row *row)
{
    return fmu_parts[row->part].driver->info;
}

static void *machine_of(fmu_state *s, uint32_t part)
{
    return (unsigned char *)&s->machine + fmu_parts[part].offset;
}

static const void *machine_in(const fmu_state *s, uint32_t part)
{
    return (const unsigned char *)&s->machine + fmu_parts[part].offset;
}

/* ---- variables --------------------------------------------------------------------------------- */

const fsm_type *fmu_type(const fmu_row *row, uint32_t *offset)
{
    const fsm_machine_info *info = info_of(row);
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
        *bits = fsm_bits_at(type, fsm_at(machine_in(&i->state, row->part), offset));
    } else if (row->source == FMU_REGION) {
        *bits = fsm_number_at(&info_of(row)->numbers[row->number], machine_in(&i->state, row->part));
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
        fsm_set_bits(type, fsm_place_at(machine_of(&i->state, row->part), offset), bits);
    } else {
        i->state.held[reference] = bits;
    }
    return true;
}

/* ---- messages of the machine --------------------------------------------------------------------- */

static bool is_row(uint32_t reference, uint32_t source, uint32_t part, uint32_t number)
{
    const fmu_row *row = &fmu_rows[reference];
    return row->source == source && row->part == part && row->number == number;
}

static void append(fmu_state *s, uint32_t source, uint32_t part, uint32_t number,
                   const fsm_field *fields, const void *const *arguments)
{
    fmu_message *message;
    uint32_t reference = 0u, count = 0u;
    if (s->pending_count == FMU_PENDING) {
        s->is_overrun = true;
        return;
    }
    while (!is_row(reference, source, part, number)) {
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

/* The state that a machine is in, and its part: it lies in one of the instances. */
static fmu_state *state_of(void *m, uint32_t *part)
{
    const size_t at = (size_t)((unsigned char *)m - (unsigned char *)instances);
    fmu_state *s = &instances[at / sizeof instances[0]].state;
    const size_t offset = (size_t)((unsigned char *)m - (unsigned char *)&s->machine);
    *part = 0u;
    while (*part + 1u < FMU_PARTS && fmu_parts[*part].offset != offset) {
        (*part)++;
    }
    return s;
}

void fmu_sent(void *m, uint32_t event, const void *const *arguments)
{
    uint32_t part;
    fmu_state *s = state_of(m, &part);
    append(s, FMU_OUT, part, event, fmu_parts[part].driver->info->events[event].fields, arguments);
}

void fmu_called(void *m, uint32_t operation, const void *const *arguments, void *result)
{
    uint32_t part;
    fmu_state *s = state_of(m, &part);
    const fsm_operation_info *info = &fmu_parts[part].driver->info->operations[operation];
    append(s, FMU_CALL, part, operation, info->parameters, arguments);
    for (uint32_t r = 0u; result != NULL && r < FMU_COUNT; r++) {
        if (is_row(r, FMU_RESULT, part, operation)) {
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
    const fmu_row *of = &fmu_rows[reference];
    const fsm_machine_info *info = info_of(of);
    const fsm_driver *driver = fmu_parts[of->part].driver;
    struct {
        fmu_event event;
        uint64_t room; /* an access of any width lies within */
    } e;
    memset(&e, 0, sizeof e);
    fsm_store_bits(fsm_place_at(&e, info->event_number), info->event_width, of->number + 1u);
    for (uint32_t r = reference + 1u; r < FMU_COUNT && fmu_rows[r].source == FMU_FIELD; r++) {
        uint32_t offset = 0u;
        const fsm_type *type = fmu_type(&fmu_rows[r], &offset);
        fsm_set_bits(type, fsm_place_at(&e, offset), i->state.held[r]);
    }
    return driver->post != NULL && driver->post(machine_of(&i->state, of->part), &e.event);
}

void fmu_start(fmu_instance *i)
{
    fmu_model_start(&i->state.machine, (uint32_t)ticks(i, i->state.time));
}

static bool is_running(const fmu_instance *i, uint32_t reference)
{
    const fmu_row *row = &fmu_rows[reference];
    return fsm_is_running(info_of(row), machine_in(&i->state, row->part));
}

/* Run the machines until the current time. */
static void run(fmu_instance *i)
{
    fmu_state *s = &i->state;
    if (!fmu_model_run(&s->machine, (uint32_t)ticks(i, s->time))) {
        s->is_restless = true;
    }
}

/* Post an event. Process a full queue first, so that no event is lost. */
static void deliver(fmu_instance *i, uint32_t reference)
{
    if (post(i, reference) || !is_running(i, reference)) {
        return;
    }
    run(i);
    if (!post(i, reference) && is_running(i, reference)) {
        i->state.is_overrun = true;
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
    run(i);
}

bool fmu_deadline(const fmu_instance *i, double *at)
{
    const uint64_t now = ticks(i, i->state.time);
    uint32_t due = 0u;
    int32_t left;
    if (!fmu_model_next_deadline(&i->state.machine, &due)) {
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
    if (i->state.is_overrun) {
        return "more events in a step than there is room for (FMU_PENDING, FMU_POSTED)";
    }
    if (i->state.is_restless) {
        return "the machines do not come to rest";
    }
    for (uint32_t part = 0u; part < FMU_PARTS; part++) {
        const uint32_t fault = fmu_parts[part].driver->info->fault;
        if (fault != FSM_ABSENT
            && *(const uint8_t *)fsm_at(machine_in(&i->state, part), fault) != 0u) {
            return "a machine stopped with a fault";
        }
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

/* FNV-1a, 64 bits, to reject damaged states. */
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
