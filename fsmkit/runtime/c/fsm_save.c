/* fsm_save.c: a machine as bytes, and back: what its description says, in the order of the format
 * of saved machines. See fsm_save.h. */
#include "fsm_save.h"

#include "fsm_bytes.h"

/* ---- writing ----------------------------------------------------------------------------------- */

/* The place of an entry in a list. */
static uint32_t entry(const fsm_list_info *list, uint32_t size, uint32_t i)
{
    return list->offset + size * i;
}

static uint8_t count_of(const fsm_list_info *list, const void *m)
{
    return *(const uint8_t *)fsm_at(m, list->count);
}

/* Whether an event is one of the chart. */
static bool is_event(const fsm_machine_info *info, const void *e)
{
    return fsm_event_of(info, e) - 1u < info->event_count;
}

/* The events of a queue. A number that is no event, which a host may post, would be ignored and is
 * not saved. */
static void put_queue(fsm_writer *w, const fsm_machine_info *info, const void *m, const fsm_list_info *list)
{
    const uint32_t each = 2u + info->payload;
    uint32_t known = 0u;
    if (list->room == 0u) {
        return;
    }
    if (list->offset == FSM_ABSENT) {
        fsm_fill(w, w->at + 1u + each * list->room);
        return;
    }
    for (uint32_t i = 0u; i < count_of(list, m); i++) {
        known += is_event(info, fsm_at(m, entry(list, info->event_size, i))) ? 1u : 0u;
    }
    const uint8_t *last = w->at + 1u + each * list->room;
    fsm_put(w, known, 1u);
    for (uint32_t i = 0u; i < count_of(list, m); i++) {
        const void *e = fsm_at(m, entry(list, info->event_size, i));
        if (is_event(info, e)) {
            const uint8_t *end = w->at + each;
            fsm_put_event(w, info, e);
            fsm_fill(w, end);
        }
    }
    fsm_fill(w, last);
}

static const fsm_timer *timers_of(const fsm_machine_info *info, const void *m)
{
    return (const fsm_timer *)fsm_at(m, info->timers.offset);
}

static void put_timers(fsm_writer *w, const fsm_machine_info *info, const void *m, uint32_t now)
{
    const fsm_list_info *list = &info->timers;
    if (list->room == 0u) {
        return;
    }
    const uint8_t *end = w->at + 1u + 6u * list->room;
    if (list->offset != FSM_ABSENT) {
        const fsm_timer *timers = timers_of(info, m);
        const uint8_t count = count_of(list, m);
        fsm_put(w, count, 1u);
        for (uint8_t i = 0u; i < count; i++) {
            fsm_put(w, timers[i].deadline - now, 4u);
            fsm_put(w, timers[i].what, 2u);
        }
    }
    fsm_fill(w, end);
}

static void put_place(fsm_writer *w, const fsm_number_list *list, uint32_t number)
{
    fsm_put(w, fsm_find(list->numbers, list->count, number), 2u);
}

static void put_delayed(fsm_writer *w, const fsm_machine_info *info, const void *m)
{
    const fsm_list_info *list = &info->delayed;
    const uint32_t each = 8u + info->payload;
    const uint8_t *end = w->at + each * list->room;
    uint32_t rank = 0u;
    if (list->offset != FSM_ABSENT) {
        const fsm_timer *timers = timers_of(info, m);
        const uint8_t count = count_of(&info->timers, m);
        for (uint8_t i = 0u; i < count; i++) {
            if (timers[i].what != FSM_TIMER_SEND) {
                continue;
            }
            const void *delayed = fsm_at(m, entry(list, info->delayed_size, rank));
            const uint8_t *next = w->at + each;
            put_place(w, &info->routes, *(const uint16_t *)fsm_at(delayed, info->delayed_route));
            put_place(w, &info->marks, timers[i].mark);
            put_place(w, &info->peers, *(const uint16_t *)fsm_at(delayed, info->delayed_peer));
            fsm_put_event(w, info, delayed);
            fsm_fill(w, next);
            rank++;
        }
    }
    fsm_fill(w, end);
}

/* Save all but the machines in its slots; events and timers only while it runs. */
static void put_machine(fsm_writer *w, const fsm_machine_info *info, const void *m, uint32_t now)
{
    const uint8_t *end = w->at + info->saved_size;
    const bool is_running = fsm_is_running(info, m);
    uint32_t status = is_running ? 1u : 0u;
    const uint32_t values = (uint32_t)info->data_count + info->output_count + info->input_count;
    if (info->finished != FSM_ABSENT && *(const bool *)fsm_at(m, info->finished)) {
        status |= 2u;
    }
    fsm_put(w, status, 1u);
    fsm_put(w, info->fault == FSM_ABSENT ? 0u : *(const uint8_t *)fsm_at(m, info->fault), 1u);
    for (uint32_t i = 0u; i < info->number_count; i++) {
        fsm_put(w, fsm_number_at(&info->numbers[i], m), 2u);
    }
    for (uint32_t i = 0u; i < values; i++) {
        fsm_put_value(w, info, info->variables[i].type, fsm_at(m, info->variables[i].offset));
    }
    if (is_running) {
        put_queue(w, info, m, &info->queue);
        put_queue(w, info, m, &info->deferred);
        put_timers(w, info, m, now);
        put_delayed(w, info, m);
    }
    fsm_fill(w, end);
}

/* A machine and those in its slots, those that do not run as zeros. */
static void save_all(fsm_writer *w, const fsm_machine_info *info, const void *m, uint32_t now)
{
    put_machine(w, info, m, now);
    uint32_t skipped = fsm_is_running(info, m) ? 0u : info->slot_count;
    for (uint32_t i = 0u; i < info->slot_count; i++) {
        const fsm_slot *slot = &info->slots[i];
        const void *inner = fsm_at(m, slot->offset);
        if (skipped == 0u && !fsm_is_running(slot->info, inner)) {
            skipped = 1u + slot->within;
        }
        if (skipped == 0u) {
            put_machine(w, slot->info, inner, now);
        } else {
            fsm_fill(w, w->at + slot->info->saved_size);
            skipped--;
        }
    }
}

bool fsm_save(const fsm_machine_info *info, const void *m, uint32_t now, uint8_t *bytes)
{
    fsm_writer w = fsm_write_to(bytes);
    if (info->busy != FSM_ABSENT && *(const bool *)fsm_at(m, info->busy)) {
        return false;
    }
    for (unsigned k = 0u; k < FSM_SAVED_HEAD; k++) {
        fsm_put_byte(&w, info->head[k]);
    }
    save_all(&w, info, m, now);
    fsm_put(&w, fsm_crc(bytes, (size_t)(w.at - bytes)), 4u);
    return true;
}

/* ---- reading ----------------------------------------------------------------------------------- */

static void set_count(void *m, const fsm_list_info *list, uint32_t count)
{
    *(uint8_t *)fsm_place_at(m, list->count) = (uint8_t)count;
}

static void get_event(fsm_reader *r, const fsm_machine_info *info, void *e, bool is_there)
{
    const uint8_t *end = r->at + 2u + info->payload;
    const uint32_t last = is_there ? info->event_count : 0u;
    const uint32_t number = fsm_take(r, 2u, is_there ? 1u : 0u, last);
    for (uint32_t i = 0u; i < info->event_size; i++) {
        *(uint8_t *)fsm_place_at(e, i) = 0u;
    }
    fsm_store_bits(fsm_place_at(e, info->event_number), info->event_width, number);
    if (number > 0u) {
        const fsm_event_info *event = &info->events[number - 1u];
        for (uint32_t i = 0u; i < event->field_count; i++) {
            void *value = fsm_place_at(e, event->fields[i].offset);
            fsm_take_value(r, info, event->fields[i].type, value);
        }
    }
    r->at = end;
}

/* Parts that the machine does not have must be zero. */
static void get_none(fsm_reader *r, uint32_t size)
{
    if (r->at[0] != 0u) {
        r->sound = false;
    }
    r->at += size;
}

/* ---- what no machine can be: see fsmkit.plan.image ------------------------------------------------ */

/* The number of a region in a saved machine, behind its status and fault. */
static uint32_t saved_number(const uint8_t *numbers, uint32_t region)
{
    return numbers[2u * region] | (uint32_t)numbers[2u * region + 1u] << 8;
}

/* Whether a state is active where the regions have these numbers. */
static bool is_saved_active(const fsm_machine_info *info, const uint8_t *numbers, uint32_t state)
{
    const fsm_state_info *of = &info->states[state];
    const uint32_t number = state == 0u ? 1u : saved_number(numbers, of->region);
    return state == 0u || (number >= state && number <= of->last);
}

/* Return whether a state can be the deepest of its region after a macrostep: the machine runs on in
 * all but the final states of the root. */
static bool can_rest(const fsm_machine_info *info, uint32_t state, bool is_running)
{
    const fsm_state_info *of = &info->states[state];
    return of->kind == FSM_ATOMIC || of->kind == FSM_PARALLEL
           || (of->kind == FSM_FINAL && (of->parent != 0u || !is_running));
}

/* Return whether exactly the active regions of a started machine have states, in which they can rest.
 * A fault does not interrupt a microstep. The first state of a region, by number, is its uppermost. */
static bool is_legal(const fsm_machine_info *info, const uint8_t *numbers, bool is_running)
{
    uint32_t left = info->region_count;
    for (uint32_t state = 1u; state < info->state_count && left > 0u; state++) {
        const fsm_state_info *of = &info->states[state];
        const uint32_t parent = of->parent;
        if (of->kind == FSM_HISTORY
            || (parent == 0u ? of->region != 0u || left < info->region_count
                             : info->states[parent].region == of->region)) {
            continue;
        }
        const uint32_t number = saved_number(numbers, of->region);
        const bool is_active = is_saved_active(info, numbers, parent);
        if (number == 0u ? is_active : !is_active || !can_rest(info, number, is_running)) {
            return false;
        }
        left--;
    }
    return true;
}

/* Return whether a history recorded a region exactly if it should: for a region of a parallel state
 * below its parent, if it recorded that state; else if it recorded anything. */
static bool is_whole(const fsm_machine_info *info, const uint8_t *numbers, uint32_t place)
{
    const fsm_number *own = &info->numbers[place];
    const uint32_t parent = info->states[own->history].parent;
    uint32_t owner = 1u;
    bool is_held = false;
    while (info->states[owner].kind == FSM_HISTORY || info->states[owner].region != own->region) {
        owner++; /* to the uppermost state of the region */
    }
    owner = info->states[owner].parent;
    uint32_t above = owner;
    while (above > parent) {
        above = info->states[above].parent;
    }
    const bool is_below = owner > parent && above == parent;
    for (uint32_t i = info->region_count; i < info->number_count; i++) {
        const uint32_t number = saved_number(numbers, i);
        if (info->numbers[i].history != own->history) {
            continue;
        }
        if (!is_below) {
            is_held = is_held || number != 0u;
        } else if (info->numbers[i].region == info->states[owner].region) {
            is_held = number >= owner && number <= info->states[owner].last;
        }
    }
    return is_held == (saved_number(numbers, place) != 0u);
}

/* Return whether a machine has that status in these states. One that was not started recorded none. */
static bool has_status(const fsm_machine_info *info, const uint8_t *numbers, uint32_t status,
                       uint32_t fault)
{
    const uint32_t first = saved_number(numbers, 0u);
    bool is_somewhere = false;
    for (uint32_t i = 0u; i < info->number_count; i++) {
        is_somewhere = is_somewhere || saved_number(numbers, i) != 0u;
    }
    if (status == 2u && (info->states[first].kind != FSM_FINAL || info->states[first].parent != 0u)) {
        return false;
    }
    return is_somewhere == (status != 0u || fault != 0u)
           && (fault == 0u || (status == 0u && info->fault != FSM_ABSENT));
}

static bool is_recordable(const fsm_machine_info *info, const fsm_number *number, uint32_t state)
{
    const uint32_t parent = info->states[number->history].parent;
    uint32_t above = info->states[state].parent;
    if (!number->is_deep) {
        return above == parent;
    }
    while (above > parent) {
        above = info->states[above].parent;
    }
    return above == parent
           && can_rest(info, state, false);
}

/* ---- what waits ---------------------------------------------------------------------------------- */

static void get_queue(fsm_reader *r, const fsm_machine_info *info, void *m, const fsm_list_info *list)
{
    if (list->room == 0u) {
        return;
    }
    if (list->offset == FSM_ABSENT) {
        get_none(r, 1u + list->room * (2u + info->payload));
        return;
    }
    const uint32_t count = fsm_take(r, 1u, 0u, list->room);
    set_count(m, list, count);
    for (uint32_t i = 0u; i < list->room; i++) {
        get_event(r, info, fsm_place_at(m, entry(list, info->event_size, i)), i < count);
    }
}

/* Whether there is such a timer, in these states. */
static bool is_known(const fsm_machine_info *info, const uint8_t *numbers, uint32_t what)
{
    if (what == FSM_TIMER_SEND) {
        return info->delayed.offset != FSM_ABSENT;
    }
    for (uint32_t i = 0u; i < info->timeout_count; i++) {
        if (info->timeouts[i].transition == what) {
            return is_saved_active(info, numbers, info->timeouts[i].source);
        }
    }
    return false;
}

/* Return whether a timer does not expire before the one ahead of it, nor so much later that their
 * order depends on the clock, and is the only one of its transition. */
static bool is_in_order(const fsm_timer *timers, uint32_t i, uint32_t now)
{
    const uint32_t half = UINT32_MAX / 2u + 1u; /* turns two's complement into ascending numbers */
    if (i > 0u
        && (timers[i].deadline - timers[i - 1u].deadline >= half
            || timers[i].deadline - now + half < timers[i - 1u].deadline - now + half)) {
        return false;
    }
    for (uint32_t k = 0u; k < i && timers[i].what != FSM_TIMER_SEND; k++) {
        if (timers[k].what == timers[i].what) {
            return false;
        }
    }
    return true;
}

static void get_timers(fsm_reader *r, const fsm_machine_info *info, void *m, uint32_t now,
                       const uint8_t *numbers)
{
    const fsm_list_info *list = &info->timers;
    if (list->room == 0u) {
        return;
    }
    if (list->offset == FSM_ABSENT) {
        get_none(r, 1u + 6u * list->room);
        return;
    }
    fsm_timer *timers = (fsm_timer *)fsm_place_at(m, list->offset);
    const uint32_t count = fsm_take(r, 1u, 0u, list->room);
    set_count(m, list, count);
    for (uint32_t i = 0u; i < list->room; i++) {
        const uint32_t left = fsm_get(r, 4u);
        const uint16_t what = (uint16_t)fsm_get(r, 2u);
        if (i >= count) {
            continue;
        }
        timers[i].deadline = now + left;
        timers[i].what = what;
        if (!is_known(info, numbers, what) || !is_in_order(timers, i, now)) {
            r->sound = false;
        }
    }
}

static void get_delayed(fsm_reader *r, const fsm_machine_info *info, void *m)
{
    const fsm_list_info *list = &info->delayed;
    uint32_t rank = 0u;
    uint32_t found = 0u;
    if (list->room == 0u) {
        return;
    }
    if (list->offset == FSM_ABSENT) {
        get_none(r, (8u + info->payload) * list->room);
        return;
    }
    fsm_timer *timers = (fsm_timer *)fsm_place_at(m, info->timers.offset);
    const uint32_t armed = count_of(&info->timers, m);
    for (uint32_t i = 0u; i < list->room; i++) {
        void *delayed = fsm_place_at(m, entry(list, info->delayed_size, i));
        while (rank < armed && timers[rank].what != FSM_TIMER_SEND) {
            rank++;
        }
        const uint16_t route = fsm_take_place(r, info->routes.numbers, info->routes.count);
        const uint16_t mark = fsm_take_place(r, info->marks.numbers, info->marks.count);
        const uint16_t peer = fsm_take_place(r, info->peers.numbers, info->peers.count);
        get_event(r, info, delayed, rank < armed);
        if (rank < armed) {
            *(uint16_t *)fsm_place_at(delayed, info->delayed_route) = route;
            *(uint16_t *)fsm_place_at(delayed, info->delayed_peer) = peer;
            timers[rank].mark = mark;
            found++;
            rank++;
        }
    }
    set_count(m, list, found);
    for (; rank < armed; rank++) {
        if (timers[rank].what == FSM_TIMER_SEND) {
            r->sound = false;
        }
    }
}

static void get_number(fsm_reader *r, const fsm_machine_info *info, const fsm_number *number,
                       void *m)
{
    const uint32_t value = fsm_take(r, 2u, 0u, info->state_count - 1u);
    const fsm_state_info *state = &info->states[value];
    if (value != 0u && (state->kind == FSM_HISTORY || state->region != number->region)) {
        r->sound = false;
        return;
    }
    if (value != 0u && number->history != FSM_NO_NUMBER && !is_recordable(info, number, value)) {
        r->sound = false;
    }
    if (number->offset == FSM_ABSENT) {
        return;
    }
    void *place = fsm_place_at(m, number->offset);
    if (number->kind != FSM_RECORDED_OF_BOTH) {
        fsm_store_bits(place, number->size, value);
    } else if (value != 0u && fsm_load_bits(place, number->size) == 0u) {
        fsm_store_bits(place, number->size, FSM_RECORDED + value);
    }
}

/* All but the machines in its slots. */
static void get_machine(fsm_reader *r, const fsm_machine_info *info, void *m, uint32_t now)
{
    const uint32_t status = fsm_take(r, 1u, 0u, 2u);
    const uint32_t fault = fsm_take(r, 1u, 0u, FSM_FAULT_INVOKED);
    const uint8_t *numbers = r->at;
    const uint32_t values = (uint32_t)info->data_count + info->output_count + info->input_count;
    if (info->running != FSM_ABSENT) {
        *(bool *)fsm_place_at(m, info->running) = (status & 1u) != 0u;
    }
    if (info->finished != FSM_ABSENT) {
        *(bool *)fsm_place_at(m, info->finished) = (status & 2u) != 0u;
    }
    if (info->fault != FSM_ABSENT) {
        *(uint8_t *)fsm_place_at(m, info->fault) = (uint8_t)fault;
    }
    for (uint32_t i = 0u; i < info->number_count; i++) {
        get_number(r, info, &info->numbers[i], m);
    }
    for (uint32_t i = info->region_count; i < info->number_count; i++) {
        const fsm_number *number = &info->numbers[i];
        if (number->state != FSM_NO_NUMBER && fsm_is_active(info, m, number->state)) {
            fsm_store_bits(fsm_place_at(m, number->offset), number->size, 0u);
        }
    }
    for (uint32_t i = 0u; i < values; i++) {
        void *value = fsm_place_at(m, info->variables[i].offset);
        fsm_take_value(r, info, info->variables[i].type, value);
    }
    r->sound = r->sound && has_status(info, numbers, status, fault)
               && ((status == 0u && fault == 0u) || is_legal(info, numbers, status == 1u));
    for (uint32_t i = info->region_count; r->sound && i < info->number_count; i++) {
        r->sound = is_whole(info, numbers, i);
    }
    get_queue(r, info, m, &info->queue);
    get_queue(r, info, m, &info->deferred);
    get_timers(r, info, m, now, numbers);
    get_delayed(r, info, m);
    if (info->now != FSM_ABSENT) {
        *(uint32_t *)fsm_place_at(m, info->now) = now;
    }
}

fsm_restored fsm_restore(const fsm_machine_info *info, void *m, uint32_t now, const uint8_t *bytes,
                         size_t size)
{
    fsm_reader r = {bytes + FSM_SAVED_HEAD, true};
    fsm_writer again = {(uint8_t *)bytes + FSM_SAVED_HEAD, true, false};
    uint32_t skipped = 0u;
    size_t expected = FSM_SAVED_HEAD + (size_t)info->saved_size + FSM_SAVED_CRC;
    fsm_restored found;
    if (info->busy != FSM_ABSENT && *(const bool *)fsm_at(m, info->busy)) {
        return FSM_IN_STEP;
    }
    for (uint32_t i = 0u; i < info->slot_count; i++) {
        expected += info->slots[i].info->saved_size;
    }
    found = fsm_check(bytes, size, info->head, expected);
    if (found != FSM_RESTORED) {
        return found;
    }
    info->init(m);
    get_machine(&r, info, m, now);
    for (uint32_t i = 0u; i < info->slot_count; i++) {
        const fsm_slot *slot = &info->slots[i];
        if (skipped == 0u && r.at[0] == 0u && r.at[1] == 0u) {
            skipped = 1u + slot->within;
        }
        if (skipped == 0u) {
            get_machine(&r, slot->info, fsm_place_at(m, slot->offset), now);
        } else {
            r.at += slot->info->saved_size;
            skipped--;
        }
    }
    if (r.sound) { /* saving again would produce the same bytes */
        save_all(&again, info, m, now);
    }
    if (!r.sound || again.differs) {
        info->init(m);
        return FSM_DAMAGED;
    }
    return FSM_RESTORED;
}
