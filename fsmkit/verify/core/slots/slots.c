#include "slots/slots.h"
#include "store/room.h"

#include <stdlib.h>
#include <string.h>

/* --- which machines ----------------------------------------------------------------------------------- */

bool fsm_slots_can(const fsm_system *system, const fsm_split *split, uint32_t machine)
{
    const fsm_machine *m = system->machines[machine];
    return m->info->queue.count != FSM_ABSENT && m->info->queue.room > 1 && m->info->slot_count == 0 && !m->monitor
        && !m->environment && !m->is_channel && m->look == FSM_NONE && m->driver->post != NULL
        && (split == NULL || split->machines == NULL || split->machines[machine].count == 0);
}

static bool start_machine(fsm_slots *self, uint32_t machine)
{
    const fsm_machine_info *info = self->composition->system->machines[machine]->info;
    fsm_slot_machine *m = &self->machines[machine];
    const fsm_system *system = self->composition->system;
    m->room = info->queue.room;
    m->has_clock = system->unit > 0 && info->timers.room == 1 && info->timers.offset != FSM_ABSENT
        && system->machines[machine]->slack == NULL;
    m->lists[0] = malloc(((size_t)m->room + 1) * sizeof **m->lists);
    m->lists[1] = malloc(((size_t)m->room + 1) * sizeof **m->lists);
    return fsm_store_init(&m->events, info->event_size) && m->lists[0] != NULL && m->lists[1] != NULL;
}

bool fsm_slots_init(fsm_slots *self, fsm_composition *composition, const fsm_split *split, const bool *requested)
{
    const fsm_system *system = composition->system;
    size_t largest = 1;
    *self = (fsm_slots){.composition = composition};
    self->machines = calloc(system->machine_count, sizeof *self->machines);
    bool fine = self->machines != NULL;
    fine = fsm_lists_init(&self->sets) && fine;
    fine = fsm_lists_init(&self->changes) && fine;
    for (uint32_t i = 0; fine && i < system->machine_count; i++) {
        largest = system->machines[i]->info->size > largest ? system->machines[i]->info->size : largest;
        fine = requested == NULL || !requested[i] || !fsm_slots_can(system, split, i) || start_machine(self, i);
    }
    self->scratch = malloc(largest);
    return fine && self->scratch != NULL;
}

void fsm_slots_free(fsm_slots *self)
{
    for (uint32_t i = 0; self->machines != NULL && i < self->composition->system->machine_count; i++) {
        fsm_slot_machine *m = &self->machines[i];
        if (m->room > 0)
            fsm_store_free(&m->events);
        free(m->bases);
        free(m->sets);
        free(m->values);
        free(m->known);
        free(m->places);
        free(m->lists[0]);
        free(m->lists[1]);
        fsm_hash_map_free(&m->agreeing);
        fsm_hash_map_free(&m->clocks_set);
    }
    fsm_lists_free(&self->sets);
    fsm_lists_free(&self->changes);
    free(self->machines);
    free(self->scratch);
    *self = (fsm_slots){0};
}

bool fsm_slots_are_many(const fsm_system *system)
{
    enum { MANY = 100000 };
    for (uint32_t i = 0; i < system->machine_count; i++) {
        const fsm_machine *m = system->machines[i];
        uint64_t values = 0, lists = 1;
        if (!fsm_slots_can(system, NULL, i) || m->deferring == NULL)
            continue;
        for (uint32_t p = 0; p < system->possible_count; p++)
            values += system->possible[p].machine == i && m->deferring[system->possible[p].event].count > 0;
        for (uint32_t length = 0; values > 0 && length < m->info->queue.room && lists <= MANY; length++)
            lists = lists * values + 1;
        if (lists > MANY)
            return true;
    }
    return false;
}

/* --- parts of a local state ------------------------------------------------------------------------------ */

static const fsm_machine *machine_of(const fsm_slots *self, uint32_t machine)
{
    return self->composition->system->machines[machine];
}

static uint32_t count_of(const fsm_list_info *list, const void *m)
{
    return list->count == FSM_ABSENT ? 0u : *(const uint8_t *)fsm_at(m, list->count);
}

static void set_count(const fsm_list_info *list, void *m, uint32_t count)
{
    if (list->count != FSM_ABSENT)
        *(uint8_t *)fsm_place_at(m, list->count) = (uint8_t)count;
}

/* An event by its number from 0, of a value. */
static uint32_t event_of(const fsm_slots *self, uint32_t machine, uint32_t value)
{
    const void *e = fsm_store_at(&self->machines[machine].events, (value - 1) / 2);
    return fsm_event_of(machine_of(self, machine)->info, e) - 1u;
}

static uint32_t value_of(fsm_slots *self, uint32_t machine, const void *e, bool deferred)
{
    uint32_t number = fsm_store_insert(&self->machines[machine].events, e, SIZE_MAX, NULL);
    return number == FSM_NONE ? FSM_NONE : 2 * number + 1 + deferred;
}

/* An event without its values: nobody looks at these. */
static uint32_t some_value(fsm_slots *self, uint32_t machine, uint32_t event, bool deferred)
{
    static const fsm_value none[FSM_MOST_VALUES];
    const fsm_machine *of = machine_of(self, machine);
    uint64_t e[of->info->event_size / sizeof(uint64_t) + 1u];
    fsm_make_event(of, event, none, e);
    return value_of(self, machine, e, deferred);
}

uint32_t fsm_slots_value_of(fsm_slots *self, uint32_t machine, uint32_t message)
{
    const fsm_machine *of = machine_of(self, machine);
    const fsm_message *what = fsm_store_at(&self->composition->messages, message);
    uint64_t e[of->info->event_size / sizeof(uint64_t) + 1u];
    fsm_make_event(of, what->number, what->values, e);
    return value_of(self, machine, e, false);
}

static bool make_room(uint32_t **items, uint32_t *room, uint32_t number)
{
    return FSM_HAS_PLACE(*items, *room, number, 64);
}

/* Puts events into a list of a machine that has none there. */
static void put_events(const fsm_slots *self, uint32_t machine, const fsm_list_info *list, const uint32_t *values,
                       uint32_t count, void *m)
{
    const uint32_t size = machine_of(self, machine)->info->event_size;
    for (uint32_t i = 0; i < count; i++)
        memcpy(fsm_place_at(m, list->offset + size * i),
               fsm_store_at(&self->machines[machine].events, (values[i] - 1) / 2), size);
    set_count(list, m, count);
}

/* A deadline that no timer has: far away, but not yet past. */
static const uint32_t FAR = UINT32_C(1) << 30;

static void set_clock(const fsm_slots *self, uint32_t machine, void *m, uint32_t clock)
{
    const fsm_list_info *timers = &machine_of(self, machine)->info->timers;
    if (!self->machines[machine].has_clock || count_of(timers, m) == 0)
        return;
    fsm_timer *timer = fsm_place_at(m, timers->offset);
    timer->deadline = clock == FSM_CLOCK_FAR ? FAR : (clock - FSM_CLOCK_DUE) * self->composition->system->unit;
}

uint32_t fsm_slots_clock(const fsm_slots *self, uint32_t machine, uint32_t local)
{
    const fsm_list_info *timers = &machine_of(self, machine)->info->timers;
    const void *m = fsm_store_at(&self->composition->locals[machine], local);
    if (!self->machines[machine].has_clock || count_of(timers, m) == 0)
        return FSM_CLOCK_NONE;
    const fsm_timer *timer = fsm_at(m, timers->offset);
    return timer->deadline == FAR ? FSM_CLOCK_FAR : timer->deadline / self->composition->system->unit + FSM_CLOCK_DUE;
}

uint32_t fsm_slots_base(fsm_slots *self, uint32_t machine, uint32_t local)
{
    const fsm_machine *of = machine_of(self, machine);
    fsm_slot_machine *m = &self->machines[machine];
    const fsm_list_info *lists[] = {&of->info->queue, &of->info->deferred};
    if (m->room == 0)
        return local;
    if (!make_room(&m->bases, &m->base_room, local))
        return FSM_NONE;
    if (m->bases[local] == 0) {
        memcpy(self->scratch, fsm_store_at(&self->composition->locals[machine], local), of->info->size);
        for (int i = 0; i < 2; i++) {
            if (lists[i]->count == FSM_ABSENT)
                continue;
            memcpy(self->scratch + lists[i]->offset, fsm_at(of->initial, lists[i]->offset),
                   (size_t)of->info->event_size * lists[i]->room);
            set_count(lists[i], self->scratch, 0);
        }
        set_clock(self, machine, self->scratch, FSM_CLOCK_FAR);
        uint32_t base = fsm_intern(self->composition, machine, self->scratch);
        if (base == FSM_NONE)
            return FSM_NONE;
        m->bases[local] = base + 1;
    }
    return m->bases[local] - 1;
}

uint32_t fsm_slots_read(fsm_slots *self, uint32_t machine, uint32_t local, uint32_t *values)
{
    const fsm_machine_info *info = machine_of(self, machine)->info;
    const void *m = fsm_store_at(&self->composition->locals[machine], local);
    uint32_t deferred = count_of(&info->deferred, m), count = deferred + count_of(&info->queue, m);
    for (uint32_t i = 0; i < count; i++) {
        const fsm_list_info *list = i < deferred ? &info->deferred : &info->queue;
        uint32_t at = i < deferred ? i : i - deferred;
        values[i] = value_of(self, machine, fsm_at(m, list->offset + info->event_size * at), i < deferred);
        if (values[i] == FSM_NONE)
            return FSM_NONE;
    }
    return count;
}

uint32_t fsm_slots_local(fsm_slots *self, uint32_t machine, uint32_t base, const uint32_t *values, uint32_t count,
                         uint32_t clock)
{
    const fsm_machine_info *info = machine_of(self, machine)->info;
    uint32_t deferred = 0;
    if (count == 0 && clock == FSM_CLOCK_FAR)
        return base;
    while (deferred < count && fsm_slot_is_deferred(values[deferred]))
        deferred++;
    memcpy(self->scratch, fsm_store_at(&self->composition->locals[machine], base), info->size);
    put_events(self, machine, &info->deferred, values, deferred, self->scratch);
    put_events(self, machine, &info->queue, values + deferred, count - deferred, self->scratch);
    set_clock(self, machine, self->scratch, clock);
    return fsm_intern(self->composition, machine, self->scratch);
}

/* --- what is deferred where ---------------------------------------------------------------------------------- */

uint32_t fsm_slots_set(fsm_slots *self, uint32_t machine, uint32_t base)
{
    const fsm_machine *of = machine_of(self, machine);
    fsm_slot_machine *m = &self->machines[machine];
    uint32_t events[of->info->event_count + 1u], count = 0;
    if (of->deferring == NULL)
        return 0;
    if (!make_room(&m->sets, &m->set_room, base))
        return FSM_NONE;
    if (m->sets[base] == 0) {
        const void *state = fsm_store_at(&self->composition->locals[machine], base);
        for (uint32_t event = 0; event < of->info->event_count; event++)
            for (uint32_t s = 0; s < of->deferring[event].count; s++)
                if (fsm_is_active(of->info, state, of->deferring[event].numbers[s])) {
                    events[count++] = event;
                    break;
                }
        uint32_t set = fsm_lists_number(&self->sets, events, count);
        if (set == FSM_NONE)
            return FSM_NONE;
        m->sets[base] = set + 1;
    }
    return m->sets[base] - 1;
}

static bool has_event(const fsm_slots *self, uint32_t set, uint32_t event)
{
    uint32_t count;
    const uint32_t *events = fsm_lists_at(&self->sets, set, &count);
    for (uint32_t i = 0; i < count; i++)
        if (events[i] == event)
            return true;
    return false;
}

bool fsm_slot_waits(const fsm_slots *self, uint32_t machine, uint32_t value, uint32_t set)
{
    return value != 0 && (!fsm_slot_is_deferred(value) || !has_event(self, set, event_of(self, machine, value)));
}

/* An event that some state defers, and this one does, or does not; FSM_NONE. */
static uint32_t event_with(const fsm_slots *self, uint32_t machine, uint32_t set, bool deferred)
{
    const fsm_machine *of = machine_of(self, machine);
    for (uint32_t event = 0; of->deferring != NULL && event < of->info->event_count; event++)
        if (of->deferring[event].count > 0 && has_event(self, set, event) == deferred)
            return event;
    return FSM_NONE;
}

bool fsm_slots_has_event(const fsm_slots *self, uint32_t machine, uint32_t set, bool deferred)
{
    return event_with(self, machine, set, deferred) != FSM_NONE;
}

/* --- windows ------------------------------------------------------------------------------------------------------ */

/* A list of so many events with the given one ahead, unless it is 0, and the others all alike. */
static uint32_t window(fsm_slots *self, uint32_t machine, uint32_t base, uint32_t first, uint32_t other, uint32_t count,
                       uint32_t clock)
{
    uint32_t *values = self->machines[machine].lists[0];
    if (first == FSM_NONE || other == FSM_NONE)
        return FSM_NONE;
    for (uint32_t i = 0; i < count; i++)
        values[i] = i == 0 && first != 0 ? first : other;
    return fsm_slots_local(self, machine, base, values, count, clock);
}

uint32_t fsm_slots_window(fsm_slots *self, uint32_t machine, uint32_t base, uint32_t what, uint32_t count, uint32_t clock)
{
    bool idle = what == FSM_WINDOW_IDLE || what == FSM_WINDOW_DUE;
    if (count == 0)
        return fsm_slots_local(self, machine, base, NULL, 0, clock);
    if (what == FSM_WINDOW_QUEUED || what == FSM_WINDOW_EVENTLESS)
        return window(self, machine, base, 0, some_value(self, machine, 0, false), count, clock);
    if (!idle && what != FSM_WINDOW_RECALLED)
        return window(self, machine, base, what, some_value(self, machine, 0, false), count, clock);
    uint32_t set = fsm_slots_set(self, machine, base);
    uint32_t event = set == FSM_NONE ? FSM_NONE : event_with(self, machine, set, idle);
    uint32_t value = event == FSM_NONE ? FSM_NONE : some_value(self, machine, event, true);
    return window(self, machine, base, value, idle ? value : some_value(self, machine, 0, false), count, clock);
}

bool fsm_slots_agree(const fsm_slots *self, uint32_t machine, uint32_t base, uint32_t what)
{
    return fsm_hash_map_find(&self->machines[machine].agreeing, fsm_join(base, what)) != NULL;
}

bool fsm_slots_set_agree(fsm_slots *self, uint32_t machine, uint32_t base, uint32_t what)
{
    return fsm_hash_map_add(&self->machines[machine].agreeing, fsm_join(base, what), 1);
}

bool fsm_slots_set_clock(fsm_slots *self, uint32_t machine, uint32_t base, uint32_t clock)
{
    return fsm_hash_map_add(&self->machines[machine].clocks_set, fsm_join(base, clock), 1);
}

uint32_t fsm_slots_clock_that_matters(const fsm_slots *self, uint32_t machine, uint32_t base, uint32_t clock)
{
    bool matters = fsm_hash_map_find(&self->machines[machine].clocks_set, fsm_join(base, clock)) != NULL;
    return matters ? clock : FSM_CLOCK_FAR;
}

uint32_t fsm_slots_short_window(fsm_slots *self, uint32_t machine, uint32_t base, uint32_t what, uint32_t count, uint32_t clock)
{
    bool is_full = what == FSM_WINDOW_QUEUED && count == self->machines[machine].room; /* what comes is not deferred there */
    bool by_itself = what != FSM_WINDOW_QUEUED && what != FSM_WINDOW_RECALLED;
    if (!is_full && fsm_slots_agree(self, machine, base, what)
        && (!by_itself || fsm_slots_agree(self, machine, base, FSM_WINDOW_EVENTLESS))
        && (what != FSM_WINDOW_DUE || fsm_slots_agree(self, machine, base, FSM_WINDOW_IDLE)))
        count = what != FSM_WINDOW_IDLE && what != FSM_WINDOW_DUE && what != FSM_WINDOW_QUEUED;
    return fsm_slots_window(self, machine, base, what, count, clock);
}

/* --- what was found ------------------------------------------------------------------------------------------------ */

bool fsm_slots_add_value(fsm_slots *self, uint32_t machine, uint32_t value, bool *added)
{
    fsm_slot_machine *m = &self->machines[machine];
    *added = false;
    if (value == 0)
        return true;
    if (!FSM_HAS_PLACE(m->known, m->known_room, value, 64))
        return false;
    if (m->known[value])
        return true;
    if (!make_room(&m->values, &m->value_room, m->value_count))
        return false;
    m->known[value] = 1;
    m->values[m->value_count++] = value;
    *added = true;
    return true;
}

bool fsm_slots_add_place(fsm_slots *self, uint32_t machine, uint32_t base)
{
    fsm_slot_machine *m = &self->machines[machine];
    if (!make_room(&m->places, &m->place_room, m->place_count))
        return false;
    m->places[m->place_count++] = base;
    return true;
}

/* --- changes -------------------------------------------------------------------------------------------------------- */

enum { MACHINE, KIND, CONDITION, TAKEN, PUT, LENGTH, BEFORE, AFTER, LOSES, PUSHED };

uint32_t fsm_slots_number(fsm_slots *self, const fsm_change *change)
{
    uint32_t items[PUSHED + change->pushed_count + 1u];
    items[MACHINE] = change->machine;
    items[KIND] = change->kind;
    items[CONDITION] = change->condition;
    items[TAKEN] = change->taken;
    items[PUT] = change->put;
    items[LENGTH] = change->length;
    items[BEFORE] = change->before;
    items[AFTER] = change->after;
    items[LOSES] = change->loses;
    if (change->pushed_count > 0)
        memcpy(items + PUSHED, change->pushed, change->pushed_count * sizeof *items);
    uint32_t number = fsm_lists_number(&self->changes, items, PUSHED + change->pushed_count);
    return number == FSM_NONE ? 0 : number; /* list 0 is empty, so these lists have other numbers */
}

fsm_change fsm_slots_change(const fsm_slots *self, uint32_t number)
{
    uint32_t count;
    const uint32_t *items = fsm_lists_at(&self->changes, number, &count);
    return (fsm_change){.machine = items[MACHINE], .kind = (fsm_change_kind)items[KIND],
                        .condition = (fsm_change_condition)items[CONDITION], .taken = items[TAKEN], .put = items[PUT],
                        .length = items[LENGTH], .before = items[BEFORE], .after = items[AFTER],
                        .loses = items[LOSES] != 0, .pushed = items + PUSHED, .pushed_count = count - PUSHED};
}

bool fsm_change_is_none(const fsm_change *change)
{
    return change->kind == FSM_CHANGE_NONE && change->condition == FSM_IF_ANY && change->pushed_count == 0
        && change->length == FSM_NONE && change->before == change->after;
}
