#include "symbolic/context.h"
#include "store/room.h"

#include <stdlib.h>
#include <string.h>

static bool add(uint32_t **items, uint32_t *count, uint32_t *room, uint32_t item)
{
    if (!FSM_HAS_ROOM(*items, *count, *room, 2))
        return false;
    (*items)[(*count)++] = item;
    return true;
}

static bool carries(const fsm_carried *at, uint32_t level)
{
    for (uint32_t i = 0; i < at->count; i++)
        if (at->levels[i] == level)
            return true;
    return false;
}

/* The values of a machine's levels are carried down to the lowest of them. */
static bool add_machine(fsm_contexts *self, uint32_t machine)
{
    const fsm_symbolic *s = self->symbolic;
    const fsm_split_machine *split = &s->split.machines[machine];
    uint32_t lowest = s->level_of[machine];
    for (uint32_t i = 0; i < split->count; i++) {
        uint32_t level = s->level_of_variable[split->variables[i]];
        lowest = level < lowest ? level : lowest;
    }
    lowest -= fsm_slots_levels(&s->slots, machine); /* if it has some, it shares nothing */
    for (uint32_t i = 0; i <= split->count; i++) {
        uint32_t level = i == split->count ? s->level_of[machine] : s->level_of_variable[split->variables[i]];
        for (uint32_t below = lowest; below < level; below++) {
            fsm_carried *at = &self->carried[below];
            if (!carries(at, level) && !add(&at->levels, &at->count, &at->room, level))
                return false;
        }
    }
    fsm_carried *last = &self->carried[lowest];
    return add(&last->machines, &last->machine_count, &last->machine_room, machine);
}

bool fsm_contexts_init(fsm_contexts *self, fsm_symbolic *symbolic)
{
    size_t levels = (size_t)symbolic->level_count + 1;
    *self = (fsm_contexts){.symbolic = symbolic};
    self->carried = calloc(levels, sizeof *self->carried);
    self->values = calloc(levels, sizeof *self->values);
    self->buffer = malloc(levels * sizeof *self->buffer);
    bool fine = fsm_lists_init(&self->lists);
    fine = fsm_lists_init(&self->windows) && fine && self->carried != NULL && self->values != NULL && self->buffer != NULL;
    for (uint32_t i = 0; fine && i < symbolic->system->machine_count; i++)
        fine = add_machine(self, i);
    if (!fine)
        fsm_contexts_free(self);
    return fine;
}

void fsm_contexts_free(fsm_contexts *self)
{
    for (uint32_t level = 0; self->carried != NULL && level <= self->symbolic->level_count; level++) {
        free(self->carried[level].levels);
        free(self->carried[level].machines);
    }
    free(self->carried);
    free(self->values);
    free(self->buffer);
    fsm_lists_free(&self->lists);
    fsm_lists_free(&self->windows);
    *self = (fsm_contexts){0};
}

/* What is known of a machine with its clock, or one more of its slots, the next one from above; FSM_NONE if memory ran out. */
static uint32_t window_with(fsm_contexts *self, const fsm_level *at, uint32_t window, uint32_t value)
{
    fsm_slots *slots = &self->symbolic->slots;
    uint32_t count, machine = at->machine;
    const uint32_t *known = fsm_lists_at(&self->windows, window, &count);
    if (value == 0)
        return window;
    if (at->is_clock) {
        uint32_t matters = fsm_slots_clock_that_matters(slots, machine, known[0], value);
        const uint32_t timed[] = {known[0], known[1], known[2], value == FSM_CLOCK_DUE ? value : matters};
        return fsm_lists_number(&self->windows, timed, 4);
    }
    uint32_t set = fsm_slots_set(slots, machine, known[0]);
    if (set == FSM_NONE)
        return FSM_NONE;
    const uint32_t next[] = {known[0], fsm_slot_waits(slots, machine, value, set) ? value : known[1], known[2] + 1,
                             known[3]};
    return fsm_lists_number(&self->windows, next, 4);
}

/* The context that a value carries. */
static uint32_t carried_of(fsm_contexts *self, uint32_t level, uint32_t value)
{
    const fsm_level *at = &self->symbolic->levels[level];
    const uint32_t base[] = {value, 0, 0, FSM_CLOCK_FAR};
    if (at->is_variable || !fsm_symbolic_has_slots(self->symbolic, at->machine))
        return value;
    return fsm_lists_number(&self->windows, base, 4);
}

/* The value at a level above, or at this one. */
static uint32_t value_at(const fsm_contexts *self, uint32_t level, uint32_t context, uint32_t value, uint32_t requested)
{
    const fsm_carried *at = &self->carried[level];
    uint32_t count;
    const uint32_t *values = fsm_lists_at(&self->lists, context, &count);
    for (uint32_t i = 0; i < count; i++)
        if (at->levels[i] == requested)
            return values[i];
    return value;
}

uint32_t fsm_context_below(fsm_contexts *self, uint32_t level, uint32_t context, uint32_t value)
{
    const fsm_carried *below = &self->carried[level - 1];
    const fsm_level *at = &self->symbolic->levels[level];
    if (below->count == 0)
        return 0;
    for (uint32_t i = 0; i < below->count; i++) {
        uint32_t requested = below->levels[i];
        if (requested == level)
            self->buffer[i] = carried_of(self, level, value);
        else
            self->buffer[i] = value_at(self, level, context, value, requested);
        if ((at->is_slot || at->is_clock) && requested == self->symbolic->level_of[at->machine])
            self->buffer[i] = window_with(self, at, self->buffer[i], value);
        if (self->buffer[i] == FSM_NONE)
            return FSM_NONE;
    }
    return fsm_lists_number(&self->lists, self->buffer, below->count);
}

static bool find_windows(fsm_contexts *self, uint32_t machine, uint32_t window, fsm_known_local *found)
{
    fsm_symbolic *s = self->symbolic;
    uint32_t count;
    const uint32_t *known = fsm_lists_at(&self->windows, window, &count);
    uint32_t open = fsm_slot_is_deferred(known[1]) ? FSM_WINDOW_RECALLED : FSM_WINDOW_QUEUED;
    found->queued = known[2];
    bool is_due = known[1] == FSM_WINDOW_IDLE && known[3] == FSM_CLOCK_DUE;
    uint32_t own = is_due ? FSM_WINDOW_DUE : known[1], clock = fsm_slots_clock_that_matters(&s->slots, machine, known[0], known[3]);
    found->own = fsm_slots_short_window(&s->slots, machine, known[0], own, known[2], is_due ? known[3] : clock);
    found->open = fsm_slots_short_window(&s->slots, machine, known[0], open, known[2], clock);
    return found->own != FSM_NONE && found->open != FSM_NONE
        && fsm_knowledge_find(s->knowledge, machine, found->own, false)
        && fsm_knowledge_find(s->knowledge, machine, found->open, true);
}

bool fsm_context_local(fsm_contexts *self, uint32_t level, uint32_t context, uint32_t value, uint32_t machine,
                       fsm_known_local *found)
{
    fsm_symbolic *s = self->symbolic;
    const fsm_split_machine *split = &s->split.machines[machine];
    if (fsm_symbolic_has_slots(s, machine)) {
        uint32_t window = window_with(self, &s->levels[level], value_at(self, level, context, value, s->level_of[machine]), value);
        return window != FSM_NONE && find_windows(self, machine, window, found);
    }
    uint32_t local = value;
    if (split->count > 0) {
        for (uint32_t i = 0; i < split->count; i++) {
            uint32_t at = s->level_of_variable[split->variables[i]];
            self->values[at] = value_at(self, level, context, value, at);
        }
        self->values[s->level_of[machine]] = value_at(self, level, context, value, s->level_of[machine]);
        local = fsm_symbolic_local(s, machine, self->values);
    }
    *found = (fsm_known_local){local, local, local == FSM_NONE ? 0 : fsm_info(s->composition, machine, local)->view.queued};
    return local != FSM_NONE;
}
