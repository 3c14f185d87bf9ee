#include "system/machine.h"

#include "model.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

/* ---- parts of a machine ------------------------------------------------------------------------ */

static uint8_t *count_in(const fsm_list_info *list, void *m)
{
    return fsm_place_at(m, list->count);
}

static uint32_t count_of(const fsm_list_info *list, const void *m)
{
    return list->count == FSM_ABSENT ? 0u : *(const uint8_t *)fsm_at(m, list->count);
}

static fsm_timer *timers_in(const fsm_machine *of, void *m)
{
    return fsm_place_at(m, of->info->timers.offset);
}

static const fsm_timer *timers_of(const fsm_machine *of, const void *m)
{
    return fsm_at(m, of->info->timers.offset);
}

static const void *entry(const fsm_list_info *list, uint32_t size, const void *m, uint32_t i)
{
    return fsm_at(m, list->offset + size * i);
}

static uint32_t region_at(const fsm_machine *of, const void *m, uint32_t region)
{
    return fsm_number_at(&of->info->numbers[region], m);
}

/* A machine in a slot, one after another; `i` is its place in the table of all slots. */
#define FOR_EACH_INNER(of, i, k)                                                                   \
    for (uint32_t i = 0u, k = 0u; i < (of)->info->slot_count; i += 1u + (of)->info->slots[i].within, k++)

static void *inner_in(const fsm_machine *of, void *m, uint32_t i)
{
    return fsm_place_at(m, of->info->slots[i].offset);
}

static const void *inner_of(const fsm_machine *of, const void *m, uint32_t i)
{
    return fsm_at(m, of->info->slots[i].offset);
}

static bool runs_at(const fsm_machine *of, const void *m, uint32_t i)
{
    return fsm_is_running(of->info->slots[i].info, inner_of(of, m, i));
}

static bool is_silent(const fsm_machine *of, uint32_t what)
{
    return of->silent != NULL && what < of->info->transition_count && of->silent[what] != 0u;
}

static uint32_t slack_of(const fsm_machine *of, uint32_t what)
{
    return of->slack != NULL && what < of->info->transition_count ? of->slack[what] : 0u;
}

static bool has_bit(const unsigned char *set, uint32_t number)
{
    return set[number / 8u] >> number % 8u & 1u;
}

/* Deferred events that no active state defers any more. */
static inline uint32_t recalled(const fsm_machine *of, const void *m)
{
    const fsm_machine_info *info = of->info;
    const uint32_t deferred = count_of(&info->deferred, m);
    uint32_t count = 0u;
    for (uint32_t i = 0u; i < deferred; i++) {
        const void *e = entry(&info->deferred, info->event_size, m, i);
        const fsm_number_list *by = &of->deferring[fsm_event_of(info, e) - 1u];
        bool defers = false;
        for (uint32_t s = 0u; s < by->count && !defers; s++)
            defers = fsm_is_active(info, m, by->numbers[s]);
        count += !defers;
    }
    return count;
}

static void reset(const fsm_machine *of, void *m, uint32_t variable)
{
    const fsm_field *field = &of->info->variables[variable];
    memcpy(fsm_place_at(m, field->offset), fsm_at(of->initial, field->offset), field->type->size);
}

/* ---- values ------------------------------------------------------------------------------------ */

/* A scalar for the explorer; of an array or a record nothing is known. */
static fsm_value value_at(const fsm_type *type, const void *place)
{
    fsm_double_bits wide;
    if (type->kind >= FSM_ARRAY)
        return 0;
    if (type->kind != FSM_FLOAT)
        return (fsm_value)fsm_bits_at(type, place);
    wide.value = fsm_float_at(type, place);
    return (fsm_value)wide.bits;
}

/* Set a value scalar by scalar; returns the scalars that follow. */
static const fsm_value *set_value(const fsm_type *type, void *place, const fsm_value *values)
{
    for (uint32_t k = 0u; k < type->scalars; k++) {
        uint32_t offset = 0u;
        const fsm_type *scalar = fsm_scalar(type, k, &offset);
        fsm_double_bits wide;
        wide.bits = (uint64_t)*values++;
        if (scalar->kind == FSM_FLOAT)
            fsm_set_float(scalar, fsm_place_at(place, offset), wide.value);
        else
            fsm_set_bits(scalar, fsm_place_at(place, offset), wide.bits);
    }
    return values;
}

void fsm_prepare(const fsm_machine *of)
{
    const fsm_machine_info *info = of->info;
    const uint32_t first = (uint32_t)info->data_count + info->output_count + info->input_count - of->constant_count;
    info->init(of->initial);
    for (uint32_t i = 0u; i < of->constant_count; i++) {
        const fsm_field *constant = &info->variables[first + i];
        (void)set_value(constant->type, fsm_place_at(of->initial, constant->offset), &of->constants[i]);
    }
    FOR_EACH_INNER(of, i, k)
        fsm_prepare(of->inner[k]);
}

static void set_choice(const fsm_choices *from, uint32_t choice, const fsm_type *type, void *place)
{
    (void)set_value(type, place, from->values + (size_t)choice * type->scalars);
}

static const fsm_type *slot_at(const fsm_machine *of, fsm_slot_of slot, uint32_t *offset)
{
    const fsm_field *variable = &of->info->variables[slot.variable];
    *offset = variable->offset;
    if (slot.element == UINT32_MAX)
        return variable->type;
    *offset += slot.element * variable->type->element->size;
    return variable->type->element;
}

void fsm_make_event(const fsm_machine *of, uint32_t number, const fsm_value *values, void *e)
{
    const fsm_machine_info *info = of->info;
    const fsm_event_info *event = &info->events[number];
    memset(e, 0, info->event_size);
    fsm_store_bits(fsm_place_at(e, info->event_number), info->event_width, (uint64_t)number + 1u);
    for (uint32_t i = 0u; i < event->field_count; i++)
        values = set_value(event->fields[i].type, fsm_place_at(e, event->fields[i].offset), values);
}

static void show_value(const fsm_machine_info *info, const fsm_type *type, const void *place)
{
    if (type->kind == FSM_ARRAY || type->kind == FSM_RECORD) {
        printf(" [");
        for (uint32_t i = 0u; i < type->count; i++)
            if (type->kind == FSM_ARRAY)
                show_value(info, type->element, fsm_at(place, i * type->element->size));
            else
                show_value(info, type->fields[i].type, fsm_at(place, type->fields[i].offset));
        printf(" ]");
    } else if (type->kind == FSM_FLOAT) {
        printf(" %.17g", fsm_float_at(type, place));
    } else if (type->kind == FSM_SYMBOL) {
        printf(" \"%s\"", info->symbol((uint32_t)fsm_bits_at(type, place)));
    } else if (fsm_is_signed(type)) {
        printf(" %" PRId64, (int64_t)fsm_bits_at(type, place));
    } else {
        printf(" %" PRIu64, fsm_bits_at(type, place));
    }
}

/* ---- operations and outgoing events ------------------------------------------------------------ */

/* Values for a port, where they lie one by one. */
static void note_values(uint32_t port, const fsm_field *fields, uint32_t count, const void *const *given)
{
    fsm_value values[FSM_MOST_VALUES];
    for (uint32_t i = 0u; i < count && i < FSM_MOST_VALUES; i++)
        values[i] = value_at(fields[i].type, given[i]);
    fsm_note_sent(port, count, values);
}

static void trace_call(const fsm_machine *of, const char *what, const char *name, const fsm_field *fields,
                       uint32_t count, const void *const *given)
{
    printf("%s%s %s", of->path, what, name);
    for (uint32_t i = 0u; i < count; i++)
        show_value(of->info, fields[i].type, given[i]);
}

void fsm_do_call(const fsm_machine *of, uint32_t number, const void *const *given, void *result)
{
    const fsm_operation_info *operation = &of->info->operations[number];
    const uint32_t port = of->first_port + number;
    if (operation->result != NULL)
        set_choice(&of->answers[number], fsm_choose(of->answers[number].count), operation->result, result);
    if (of->linked[port])
        note_values(port, operation->parameters, operation->parameter_count, given);
    if (!fsm_recording.tracing)
        return;
    trace_call(of, "op", operation->name, operation->parameters, operation->parameter_count, given);
    if (operation->result != NULL) {
        printf(" =");
        show_value(of->info, operation->result, result);
    }
    printf("\n");
}

void fsm_do_send(const fsm_machine *of, uint32_t number, const void *const *given)
{
    const fsm_event_info *event = &of->info->events[number];
    if (of->linked[number])
        note_values(number, event->fields, event->field_count, given);
    if (!fsm_recording.tracing)
        return;
    trace_call(of, "out", event->name, event->fields, event->field_count, given);
    printf("\n");
}

void fsm_note_observed(const fsm_machine *of, uint32_t number, const void *e)
{
    const fsm_event_info *event = &of->info->events[number];
    const void *given[FSM_MOST_VALUES];
    for (uint32_t i = 0u; i < event->field_count && i < FSM_MOST_VALUES; i++)
        given[i] = fsm_at(e, event->fields[i].offset);
    note_values(FSM_OBSERVED + number, event->fields, event->field_count, given);
}

/* ---- what others do to it ---------------------------------------------------------------------- */

bool fsm_post_to(const fsm_machine *of, void *m, uint32_t event, const fsm_value *values)
{
    uint64_t e[of->info->event_size / sizeof(uint64_t) + 1u];
    fsm_make_event(of, event, values, e);
    return of->driver->post(m, e);
}

static bool is_queued(const fsm_machine *of, const void *m, uint32_t event)
{
    const fsm_machine_info *info = of->info;
    for (uint32_t i = 0u; i < count_of(&info->queue, m); i++)
        if (fsm_event_of(info, entry(&info->queue, info->event_size, m, i)) == event + 1u)
            return true;
    return false;
}

void fsm_set_input(const fsm_machine *of, void *m, uint32_t input, fsm_value value)
{
    const size_t size = of->look == FSM_NONE ? 0u : of->info->size;
    unsigned char before[size + 1u];
    uint32_t offset;
    const fsm_type *type = slot_at(of, of->inputs[input], &offset);
    memcpy(before, m, size);
    (void)set_value(type, fsm_place_at(m, offset), &value);
    if (of->look != FSM_NONE && memcmp(before, m, size) != 0 && fsm_is_running(of->info, m)
        && !is_queued(of, m, of->look))
        (void)fsm_post_to(of, m, of->look, NULL);
}

void fsm_put_input(const fsm_machine *of, void *m, uint32_t input, fsm_value value)
{
    uint32_t offset;
    const fsm_type *type = slot_at(of, of->inputs[input], &offset);
    (void)set_value(type, fsm_place_at(m, offset), &value);
}

fsm_value fsm_output(const fsm_machine *of, const void *m, uint32_t output)
{
    uint32_t offset;
    const fsm_type *type = slot_at(of, of->outputs[output], &offset);
    return value_at(type, fsm_at(m, offset));
}

void fsm_set_free_input(const fsm_machine *of, void *m, uint32_t free, uint32_t choice)
{
    const fsm_field *input = &of->info->variables[of->free_inputs[free].variable];
    set_choice(&of->free_inputs[free], choice, input->type, fsm_place_at(m, input->offset));
}

void fsm_choose_inputs(const fsm_machine *of, void *m)
{
    const uint32_t first = (uint32_t)of->info->data_count + of->info->output_count;
    if (of->free_count > FSM_MOST_CHOICES) {
        fsm_recording.too_much = "too many choices in one step";
        return;
    }
    fsm_recording.state = m;
    for (uint32_t i = 0u; i < of->free_count; i++) {
        const bool waits = !fsm_recording.again && of->read_inputs != NULL
                           && of->read_inputs[of->free_inputs[i].variable - first] != 0u;
        fsm_recording.read[i] = !waits;
        fsm_set_free_input(of, m, i, waits ? 0u : fsm_choose_for(of->free_inputs[i].count, i));
    }
}

/* ---- steps ------------------------------------------------------------------------------------- */

/* The machine that starts, as it was before: shared data are not set to their start values. */
static const fsm_machine *starting;
static const void *kept;

static void put_shared_back(void *m)
{
    const uint32_t inputs = starting->info->input_count;
    for (uint32_t i = inputs; i < inputs + starting->shared_count; i++) {
        const fsm_field *shared = &starting->info->variables[starting->inputs[i].variable];
        memcpy(fsm_place_at(m, shared->offset), fsm_at(kept, shared->offset), shared->type->size);
    }
}

void fsm_start_machine(const fsm_machine *of, void *m)
{
    const size_t size = of->shared_count == 0u ? 0u : of->info->size;
    unsigned char before[size + 1u];
    memcpy(before, m, size);
    starting = of;
    kept = before;
    fsm_recording.begin = of->shared_count == 0u ? NULL : put_shared_back;
    of->driver->start(m, 0u);
    fsm_recording.begin = NULL;
}

/* Not deferred where it could not be put ahead of the queue. */
void fsm_occur(const fsm_machine *of, void *m, uint32_t event, const fsm_value *values)
{
    const fsm_list_info *queue = &of->info->queue;
    const uint32_t size = of->info->event_size, waiting = count_of(queue, m);
    const uint32_t deferred = count_of(&of->info->deferred, m);
    uint64_t e[size / sizeof(uint64_t) + 1u];
    fsm_make_event(of, event, values, e);
    if (waiting + deferred >= queue->room || (deferred > 0u && recalled(of, m) > 0u)) {
        (void)of->driver->dispatch(m, e, 0u);
        return;
    }
    unsigned char *first = fsm_place_at(m, queue->offset);
    if (waiting > 0u)
        memmove(first + size, first, (size_t)size * waiting);
    memcpy(first, e, size);
    *count_in(queue, m) = (uint8_t)(waiting + 1u);
    (void)of->take(m);
}

static void rotate(void *items, size_t size, uint32_t last)
{
    unsigned char *first = items, moved[size];
    memcpy(moved, first + size * last, size);
    memmove(first + size, first, size * last);
    memcpy(first, moved, size);
}

/* Put an armed timer first, with a deadline; a silent one is not. */
static bool put_first(const fsm_machine *of, void *m, uint32_t timer, uint32_t deadline)
{
    fsm_timer *timers = timers_in(of, m);
    if (of->untimed && of->is_channel) { /* only the oldest message may be the next */
        timers[0].deadline = timer > 0u ? timers[0].deadline : deadline;
        return timer == 0u;
    }
    const uint32_t what = timers[timer].what;
    uint32_t rank = 0u;
    if (is_silent(of, what))
        return false;
    for (uint32_t i = 0u; i < timer; i++)
        rank += timers[i].what == FSM_TIMER_SEND;
    if (what == FSM_TIMER_SEND && of->info->delayed.offset != FSM_ABSENT)
        rotate(fsm_place_at(m, of->info->delayed.offset), of->info->delayed_size, rank);
    rotate(timers, sizeof *timers, timer);
    timers[0].deadline = deadline;
    return true;
}

/* Let a timer, of this machine or of one in a slot, be the next to fire. */
static bool choose(const fsm_machine *of, void *m, uint32_t timer, uint32_t deadline)
{
    const uint32_t own = count_of(&of->info->timers, m);
    if (timer < own)
        return put_first(of, m, timer, deadline);
    timer -= own;
    FOR_EACH_INNER(of, i, k) {
        if (!runs_at(of, m, i))
            continue;
        const uint32_t armed = fsm_look(of->inner[k], inner_of(of, m, i)).armed;
        if (timer < armed)
            return choose(of->inner[k], inner_in(of, m, i), timer, UINT32_MAX);
        timer -= armed;
    }
    return false;
}

bool fsm_fire(const fsm_machine *of, void *m, uint32_t timer)
{
    if (!of->untimed && !of->zones && of->slack == NULL)
        return of->fire_first(m);
    const bool is_own = timer < count_of(&of->info->timers, m);
    const uint32_t slack = is_own ? slack_of(of, timers_of(of, m)[timer].what) : 0u;
    if (!choose(of, m, timer, 0u))
        return false;
    const bool fired = of->fire_first(m);
    return slack == FSM_OPEN_ENDED ? fsm_recording.took : fired;
}

/* The deadline of an interval without an end stays away. */
void fsm_pass_time(const fsm_machine *of, void *m, uint32_t ticks)
{
    of->rebase(m, ticks);
    if (of->slack == NULL)
        return;
    fsm_timer *timers = timers_in(of, m);
    for (uint32_t i = 0u; i < count_of(&of->info->timers, m); i++)
        if (timers[i].deadline < FSM_OPEN_ENDED && slack_of(of, timers[i].what) == FSM_OPEN_ENDED)
            timers[i].deadline = FSM_OPEN_ENDED;
}

/* ---- timers ------------------------------------------------------------------------------------ */

bool fsm_is_early(const fsm_machine *of, const void *m, uint32_t timer)
{
    const fsm_timer *one = &timers_of(of, m)[timer];
    const uint32_t most = slack_of(of, one->what);
    return most > 0u && one->deadline <= most;
}

uint32_t fsm_timer_names(const fsm_machine *of)
{
    uint32_t names = (uint32_t)of->info->transition_count + of->info->event_count;
    FOR_EACH_INNER(of, i, k)
        names += fsm_timer_names(of->inner[k]);
    return names;
}

static uint32_t own_timer_name(const fsm_machine *of, const void *m, uint32_t timer)
{
    const fsm_machine_info *info = of->info;
    const fsm_timer *timers = timers_of(of, m);
    uint32_t rank = 0u;
    if (is_silent(of, timers[timer].what))
        return FSM_NONE;
    if (timers[timer].what != FSM_TIMER_SEND)
        return timers[timer].what;
    for (uint32_t i = 0u; i < timer; i++)
        rank += timers[i].what == FSM_TIMER_SEND;
    return info->transition_count + fsm_event_of(info, entry(&info->delayed, info->delayed_size, m, rank)) - 1u;
}

uint32_t fsm_timer_name(const fsm_machine *of, const void *m, uint32_t timer)
{
    const uint32_t own = count_of(&of->info->timers, m);
    uint32_t first = (uint32_t)of->info->transition_count + of->info->event_count;
    if (timer < own)
        return own_timer_name(of, m, timer);
    timer -= own;
    FOR_EACH_INNER(of, i, k) {
        if (runs_at(of, m, i)) {
            const uint32_t armed = fsm_look(of->inner[k], inner_of(of, m, i)).armed;
            if (timer < armed) {
                const uint32_t name = fsm_timer_name(of->inner[k], inner_of(of, m, i), timer);
                return name == FSM_NONE ? name : first + name;
            }
            timer -= armed;
        }
        first += fsm_timer_names(of->inner[k]);
    }
    return 0u;
}

void fsm_mark(const fsm_machine *of, void *m)
{
    fsm_timer *timers = timers_in(of, m);
    const uint32_t count = count_of(&of->info->timers, m);
    for (uint32_t i = 0u; i < count; i++)
        timers[i].deadline = i - count;
}

void fsm_unmark(const fsm_machine *of, void *m, const void *before, uint32_t *source)
{
    fsm_timer *timers = timers_in(of, m);
    const uint32_t count = count_of(&of->info->timers, m), old = count_of(&of->info->timers, before);
    for (uint32_t i = 0u; i < count; i++) {
        const uint32_t place = timers[i].deadline + old;
        const bool is_old = timers[i].deadline >= 0x80000000u;
        source[i] = is_old ? place + 1u : 0u;
        if (is_old)
            timers[i].deadline = timers_of(of, before)[place].deadline;
    }
}

void fsm_limits_of(const fsm_machine *of, const void *m, fsm_limits *limits)
{
    const fsm_timer *timers = timers_of(of, m);
    for (uint32_t i = 0u; i < count_of(&of->info->timers, m); i++) {
        limits[i].upper = (int32_t)timers[i].deadline;
        limits[i].lower = limits[i].upper - (int32_t)slack_of(of, timers[i].what);
    }
}

/* ---- what does not count as state -------------------------------------------------------------- */

static void swap(void *a, void *b, size_t size)
{
    unsigned char held[size];
    memcpy(held, a, size);
    memcpy(a, b, size);
    memcpy(b, held, size);
}

/* Make equal sets of timers equal bytes, without their deadlines: by what they are, delayed events by event. */
static void sort_timers(const fsm_machine *of, void *m)
{
    const fsm_machine_info *info = of->info;
    const uint32_t count = count_of(&info->timers, m), size = info->delayed_size;
    fsm_timer *timers = timers_in(of, m);
    uint32_t first = count;
    for (uint32_t i = 0u; i < count; i++)
        timers[i].deadline = 0u;
    if (of->is_channel)
        return; /* what was sent first comes first, at whatever time */
    for (uint32_t i = 1u; i < count; i++)
        for (uint32_t j = i; j > 0u && timers[j - 1u].what > timers[j].what; j--)
            swap(&timers[j - 1u], &timers[j], sizeof *timers);
    while (first > 0u && timers[first - 1u].what == FSM_TIMER_SEND)
        first--;
    for (uint32_t i = first + 1u; i < count; i++)
        for (uint32_t j = i; j > first; j--) {
            unsigned char *a = fsm_place_at(m, info->delayed.offset + size * (j - first - 1u)), *b = a + size;
            const uint32_t x = fsm_event_of(info, a), y = fsm_event_of(info, b);
            int order = x != y ? (x > y ? 1 : -1) : memcmp(&timers[j - 1u], &timers[j], sizeof *timers);
            if ((order != 0 ? order : memcmp(a, b, size)) <= 0)
                break;
            swap(&timers[j - 1u], &timers[j], sizeof *timers);
            swap(a, b, size);
        }
}

static inline void clear(const fsm_span *spans, uint32_t count, void *m)
{
    for (uint32_t i = 0u; i < count; i++) {
        void *place = fsm_place_at(m, (uint32_t)spans[i].offset);
        switch (spans[i].size) { /* one store for a size that is known, wherever it is: a span need not be aligned */
        case 1u:
            memset(place, 0, 1u);
            break;
        case 2u:
            memset(place, 0, 2u);
            break;
        case 4u:
            memset(place, 0, 4u);
            break;
        default:
            memset(place, 0, spans[i].size);
            break;
        }
    }
}

/* Waiting events and the records of histories are cleared. */
static void clear_stopped(const fsm_machine *of, void *m)
{
    const fsm_machine_info *info = of->info;
    clear(of->stopped, of->stopped_count, m);
    for (uint32_t i = 0u; i < info->number_count; i++) {
        const fsm_number *number = &info->numbers[i];
        if (i < info->region_count && number->kind == FSM_PLAIN)
            continue;
        if (number->offset != FSM_ABSENT && number->kind != FSM_RECORDED_OF_BOTH)
            fsm_store_bits(fsm_place_at(m, number->offset), number->size,
                           i < info->region_count ? fsm_number_at(number, m) : 0u);
    }
    FOR_EACH_INNER(of, i, k)
        of->inner[k]->info->init(inner_in(of, m, i));
}

static bool is_dead(const fsm_machine *of, const void *m, const fsm_resettable *one)
{
    for (uint32_t region = 0u; region < of->info->region_count; region++)
        if (has_bit(one->live, region_at(of, m, region)))
            return false;
    return true;
}

/* Rare features: inputs outside the state, machines in slots, timers without deadlines, dead data. */
static void settle_more(const fsm_machine *of, void *m, bool is_running)
{
    const fsm_machine_info *info = of->info;
    const uint32_t inputs = (uint32_t)info->data_count + info->output_count;
    for (uint32_t i = 0u; of->resets_inputs && i < info->input_count; i++)
        if (of->kept_inputs == NULL || of->kept_inputs[i] == 0u)
            reset(of, m, inputs + i);
    if (!is_running)
        clear_stopped(of, m);
    FOR_EACH_INNER(of, i, k)
        if (runs_at(of, m, i))
            fsm_settle(of->inner[k], inner_in(of, m, i));
    if (of->untimed && info->timers.offset != FSM_ABSENT)
        sort_timers(of, m);
    for (uint32_t i = 0u; i < of->resettable_count; i++)
        if (!is_running || is_dead(of, m, &of->resettable[i]))
            reset(of, m, of->resettable[i].variable);
}

void fsm_settle(const fsm_machine *of, void *m)
{
    const fsm_machine_info *info = of->info;
    const bool is_running = fsm_is_running(info, m);
    clear(of->cleared, of->cleared_count, m);
    if (!is_running || of->untimed || (of->resets_inputs && info->input_count > 0u) || info->slot_count > 0u
        || of->resettable_count > 0u)
        settle_more(of, m, is_running);
}

/* ---- looking ----------------------------------------------------------------------------------- */

fsm_view fsm_look(const fsm_machine *of, const void *m)
{
    const fsm_machine_info *info = of->info;
    fsm_view v = {.running = fsm_is_running(info, m)};
    v.faulted = info->fault != FSM_ABSENT && *(const uint8_t *)fsm_at(m, info->fault) != FSM_NO_FAULT;
    if (!v.running) {
        v.at_rest = info->finished != FSM_ABSENT && *(const bool *)fsm_at(m, info->finished);
        return v;
    }
    v.queued = count_of(&info->queue, m);
    v.waiting = v.queued;
    if (count_of(&info->deferred, m) > 0u) {
        v.waiting += recalled(of, m);
        v.queued += count_of(&info->deferred, m);
    }
    v.armed = count_of(&info->timers, m);
    for (uint32_t i = 0u; i < v.armed; i++)
        v.awaited += !is_silent(of, timers_of(of, m)[i].what);
    v.due = v.armed > 0u && fsm_reached(0u, timers_of(of, m)[0].deadline);
    FOR_EACH_INNER(of, i, k) {
        if (!runs_at(of, m, i))
            continue;
        const fsm_view within = fsm_look(of->inner[k], inner_of(of, m, i));
        v.waiting += within.waiting;
        v.armed += within.armed;
        v.awaited += within.awaited;
        v.due = v.due || within.due;
    }
    v.at_rest = true;
    for (uint32_t region = 0u; region < info->region_count; region++)
        v.at_rest = v.at_rest && of->restless[region_at(of, m, region)] == 0u;
    return v;
}

static size_t own_configuration_size(const fsm_machine_info *info)
{
    return 1u + 2u * (size_t)info->region_count;
}

size_t fsm_configuration_size(const fsm_machine *of)
{
    size_t size = own_configuration_size(of->info);
    for (uint32_t i = 0u; i < of->info->slot_count; i++)
        size += own_configuration_size(of->info->slots[i].info);
    return size;
}

void fsm_configuration(const fsm_machine *of, const void *m, unsigned char *shown)
{
    const fsm_machine_info *info = of->info;
    *shown++ = fsm_is_running(info, m);
    for (uint32_t region = 0u; region < info->region_count; region++) {
        const uint32_t deepest = region_at(of, m, region);
        *shown++ = (unsigned char)(deepest & 255u);
        *shown++ = (unsigned char)(deepest >> 8u);
    }
    FOR_EACH_INNER(of, i, k) {
        if (runs_at(of, m, i))
            fsm_configuration(of->inner[k], inner_of(of, m, i), shown);
        shown += fsm_configuration_size(of->inner[k]);
    }
}

void fsm_dump(const fsm_machine *of, const void *m)
{
    const fsm_machine_info *info = of->info;
    for (uint32_t i = 0u; i < (uint32_t)info->data_count + info->output_count; i++) {
        const fsm_field *variable = &info->variables[i];
        printf("%sd %s", of->path, variable->name);
        show_value(info, variable->type, fsm_at(m, variable->offset));
        printf("\n");
    }
    printf("%s=", of->path);
    for (uint32_t region = 0u; region < info->region_count; region++) {
        const uint32_t deepest = region_at(of, m, region);
        if (deepest > 0u && info->states[deepest].kind >= FSM_ATOMIC)
            printf(" %" PRIu32, deepest);
    }
    printf("%s\n", info->finished != FSM_ABSENT && *(const bool *)fsm_at(m, info->finished) ? " finished" : "");
    FOR_EACH_INNER(of, i, k)
        if (runs_at(of, m, i))
            fsm_dump(of->inner[k], inner_of(of, m, i));
}
