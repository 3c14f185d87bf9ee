/* binding.h: what the binding of a machine does by the table that describes the machine: values,
 * events, operations, what leaves the machine, and the trace. */
#ifndef FSM_BINDING_H
#define FSM_BINDING_H

#include "fsm_info.h"
#include "system/recorder.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

/* What an operation may return. */
typedef struct {
    const void *values;
    uint32_t count;
} fsm_answers;

typedef struct {
    const fsm_machine_info *info;
    const char *path;            /* the slots in which it lies: what the lines of its trace begin with */
    const unsigned char *linked; /* by port, whether a wire begins there: those of events, then of operations */
    const fsm_answers *answers;  /* by operation */
    uint32_t first_port;         /* of operations */
} fsm_binding;

/* ---- values ------------------------------------------------------------------------------------ */

/* A scalar for the explorer; of an array or a record nothing is known. */
static inline fsm_value fsm_value_at(const fsm_type *type, const void *place)
{
    fsm_double_bits wide;
    if (type->kind >= FSM_ARRAY)
        return 0;
    if (type->kind != FSM_FLOAT)
        return (fsm_value)fsm_bits_at(type, place);
    wide.value = fsm_float_at(type, place);
    return (fsm_value)wide.bits;
}

static inline void fsm_set_value(const fsm_type *type, void *place, fsm_value value)
{
    fsm_double_bits wide;
    wide.bits = (uint64_t)value;
    if (type->kind == FSM_FLOAT)
        fsm_set_float(type, place, wide.value);
    else
        fsm_set_bits(type, place, (uint64_t)value);
}

static inline void fsm_show_value(const fsm_machine_info *info, const fsm_type *type, const void *place)
{
    if (type->kind == FSM_ARRAY || type->kind == FSM_RECORD) {
        printf(" [");
        for (uint32_t i = 0u; i < type->count; i++)
            if (type->kind == FSM_ARRAY)
                fsm_show_value(info, type->element, fsm_at(place, i * type->element->size));
            else
                fsm_show_value(info, type->fields[i].type, fsm_at(place, type->fields[i].offset));
        printf(" ]");
    } else if (type->kind == FSM_FLOAT) {
        printf(" %.17g", fsm_float_at(type, place));
    } else if (type->kind == FSM_SYMBOL) {
        printf(" \"%s\"", info->symbol((uint32_t)fsm_bits_at(type, place)));
    } else {
        printf(" %" PRId64, (int64_t)fsm_bits_at(type, place));
    }
}

/* ---- events ------------------------------------------------------------------------------------ */

/* The event of a number from 0, with its scalars in order. */
static inline void fsm_make_event(const fsm_machine_info *info, uint32_t number, const fsm_value *values, void *e)
{
    const fsm_event_info *event = &info->events[number];
    memset(e, 0, info->event_size);
    fsm_store_bits(fsm_place_at(e, info->event_number), info->event_width, (uint64_t)number + 1u);
    for (uint32_t i = 0u; i < event->field_count; i++) {
        const fsm_field *field = &event->fields[i];
        for (uint32_t k = 0u; k < field->type->scalars; k++) {
            uint32_t offset = field->offset;
            const fsm_type *scalar = fsm_scalar(field->type, k, &offset);
            fsm_set_value(scalar, fsm_place_at(e, offset), *values++);
        }
    }
}

/* Values for a port, where they lie one by one. */
static inline void fsm_note_values(uint32_t port, const fsm_field *fields, uint32_t count, const void *const *given)
{
    fsm_value values[FSM_MOST_VALUES];
    for (uint32_t i = 0u; i < count && i < FSM_MOST_VALUES; i++)
        values[i] = fsm_value_at(fields[i].type, given[i]);
    fsm_note_sent(port, count, values);
}

/* An event that the machine is handed, for monitors. */
static inline void fsm_note_heard(const fsm_machine_info *info, uint32_t first_port, const void *e)
{
    const uint32_t number = fsm_event_of(info, e) - 1u;
    const fsm_event_info *event = &info->events[number];
    const void *given[FSM_MOST_VALUES];
    for (uint32_t i = 0u; i < event->field_count && i < FSM_MOST_VALUES; i++)
        given[i] = fsm_at(e, event->fields[i].offset);
    fsm_note_values(first_port + number, event->fields, event->field_count, given);
}

/* ---- what the machine calls -------------------------------------------------------------------- */

static inline void fsm_tell_call(const fsm_binding *of, const char *what, const char *name, const fsm_field *fields,
                                 uint32_t count, const void *const *given)
{
    printf("%s%s %s", of->path, what, name);
    for (uint32_t i = 0u; i < count; i++)
        fsm_show_value(of->info, fields[i].type, given[i]);
}

static inline void fsm_binding_call(const fsm_binding *of, uint32_t number, const void *const *given, void *result)
{
    const fsm_operation_info *operation = &of->info->operations[number];
    const fsm_answers *answers = &of->answers[number];
    const uint32_t port = of->first_port + number;
    if (operation->result != NULL) {
        const uint32_t chosen = fsm_choose(answers->count);
        memcpy(result, fsm_at(answers->values, chosen * operation->result->size), operation->result->size);
    }
    if (of->linked[port])
        fsm_note_values(port, operation->parameters, operation->parameter_count, given);
    if (!fsm_recording.tracing)
        return;
    fsm_tell_call(of, "op", operation->name, operation->parameters, operation->parameter_count, given);
    if (operation->result != NULL) {
        printf(" =");
        fsm_show_value(of->info, operation->result, result);
    }
    printf("\n");
}

static inline void fsm_binding_send(const fsm_binding *of, uint32_t number, const void *const *given)
{
    const fsm_event_info *event = &of->info->events[number];
    if (of->linked[number])
        fsm_note_values(number, event->fields, event->field_count, given);
    if (!fsm_recording.tracing)
        return;
    fsm_tell_call(of, "out", event->name, event->fields, event->field_count, given);
    printf("\n");
}

#define FSM_HOST_CALL(m, operation, given, result) ((void)(m), fsm_binding_call(&binding, operation, given, result))
#define FSM_HOST_SEND(m, event, given) ((void)(m), fsm_binding_send(&binding, event, given))

/* ---- data -------------------------------------------------------------------------------------- */

/* A variable of the table, or an element of one that is an array, which is shared. */
typedef struct {
    uint32_t variable, element; /* UINT32_MAX: none, the whole */
} fsm_slot_of;

static inline const fsm_type *fsm_slot_at(const fsm_machine_info *info, fsm_slot_of slot, uint32_t *offset)
{
    const fsm_field *variable = &info->variables[slot.variable];
    *offset = variable->offset;
    if (slot.element == UINT32_MAX)
        return variable->type;
    *offset += slot.element * variable->type->element->size;
    return variable->type->element;
}

/* Data and outputs, as lines of the trace. */
static inline void fsm_dump_data(const fsm_binding *of, const void *m)
{
    for (uint32_t i = 0u; i < (uint32_t)of->info->data_count + of->info->output_count; i++) {
        const fsm_field *variable = &of->info->variables[i];
        printf("%sd %s", of->path, variable->name);
        fsm_show_value(of->info, variable->type, fsm_at(m, variable->offset));
        printf("\n");
    }
}

#endif
