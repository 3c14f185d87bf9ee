#include "system/composition.h"
#include "system/system_model.h"
#include "store/room.h"

#include <stdlib.h>
#include <string.h>

bool fsm_fail(fsm_composition *self, const char *why)
{
    const char *none = NULL;
    (void)__atomic_compare_exchange_n(&self->failure, &none, why, false, __ATOMIC_RELEASE, __ATOMIC_RELAXED);
    return false;
}

bool fsm_push_number(fsm_composition *self, fsm_numbers *numbers, uint32_t number)
{
    if (numbers->count >= FSM_NONE || !FSM_HAS_ROOM(numbers->items, numbers->count, numbers->room, 256))
        return fsm_fail(self, "out of memory");
    numbers->items[numbers->count++] = number;
    return true;
}

static uint32_t larger(uint32_t a, uint32_t b)
{
    return a > b ? a : b;
}

/* Measuring memory takes time proportional to the number of machines, so with many machines it is measured rarely. Otherwise
 * the total would grow with the square of their number. */
static bool is_within_memory(fsm_composition *self)
{
    enum { FEW = 64, TIMES = 4 };
    uint32_t machines = self->system->machine_count;
    if (machines > FEW && ++self->unchecked < machines / TIMES)
        return true;
    self->unchecked = 0;
    return fsm_composition_bytes(self) <= self->memory_limit || fsm_fail(self, "out of memory");
}

static bool make_info_room(fsm_composition *self, uint32_t machine)
{
    uint32_t room = self->info_room[machine];
    if (self->locals[machine].count < room)
        return true;
    room = room == 0 ? 64 : 2 * room;
    fsm_local_info *infos = realloc(self->infos[machine], room * sizeof *infos);
    if (infos == NULL)
        return fsm_fail(self, "out of memory");
    self->infos[machine] = infos;
    if (!is_within_memory(self))
        return false;
    self->info_room[machine] = room;
    return true;
}

uint32_t fsm_intern(fsm_composition *self, uint32_t machine, const void *state)
{
    if (!make_info_room(self, machine))
        return FSM_NONE;
    const fsm_machine *m = self->system->machines[machine];
    bool added;
    uint32_t number = fsm_store_insert(&self->locals[machine], state, SIZE_MAX, &added);
    if (number == FSM_NONE) {
        (void)fsm_fail(self, "out of memory");
        return FSM_NONE;
    }
    if (!added)
        return number;
    fsm_view view = fsm_look(m, state);
    memset(self->shown, 0, fsm_configuration_size(m));
    fsm_configuration(m, state, self->shown);
    uint32_t configuration = fsm_store_insert(&self->configurations[machine], self->shown, SIZE_MAX, NULL);
    *fsm_info(self, machine, number) =
        (fsm_local_info){.view = view, .configuration = configuration, .elapsed = FSM_NONE};
    fsm_bounds *bounds = &self->bounds[machine];
    bounds->queue = larger(bounds->queue, view.queued);
    bounds->timers = larger(bounds->timers, view.armed);
    return number;
}

uint32_t fsm_intern_message(fsm_composition *self, const fsm_message *message)
{
    uint32_t number = fsm_store_insert(&self->messages, message, SIZE_MAX, NULL);
    if (number == FSM_NONE)
        (void)fsm_fail(self, "out of memory");
    return number;
}

uint32_t fsm_elapse(fsm_composition *self, uint32_t machine, uint32_t local)
{
    uint32_t elapsed = fsm_info(self, machine, local)->elapsed;
    if (elapsed != FSM_NONE)
        return elapsed;
    const fsm_machine *m = self->system->machines[machine];
    memcpy(self->after, fsm_store_at(&self->locals[machine], local), m->info->size);
    fsm_pass_time(m, self->after, self->system->unit);
    fsm_settle(m, self->after);
    elapsed = fsm_intern(self, machine, self->after);
    if (elapsed != FSM_NONE)
        fsm_info(self, machine, local)->elapsed = elapsed;
    return elapsed;
}

uint32_t fsm_deliver(fsm_composition *self, uint32_t local, uint32_t message, bool *full)
{
    uint64_t key = (uint64_t)local << 32 | message;
    const uint64_t *known = fsm_hash_map_find(&self->deliveries, key);
    uint64_t result;
    if (known != NULL) {
        result = *known;
    } else {
        const fsm_message *what = fsm_store_at(&self->messages, message);
        const fsm_machine *m = self->system->machines[what->target];
        bool fits = true;
        memcpy(self->after, fsm_store_at(&self->locals[what->target], local), m->info->size);
        if (what->is_input)
            fsm_set_input(m, self->after, what->number, what->values[0]);
        else if (fsm_info(self, what->target, local)->view.running)
            fits = fsm_post_to(m, self->after, what->number, what->values);
        fsm_settle(m, self->after);
        uint32_t next = fsm_intern(self, what->target, self->after);
        if (next == FSM_NONE)
            return FSM_NONE;
        result = (uint64_t)next << 1 | !fits;
        if (!fsm_hash_map_add(&self->deliveries, key, result)) {
            (void)fsm_fail(self, "out of memory");
            return FSM_NONE;
        }
    }
    *full = result & 1;
    return (uint32_t)(result >> 1);
}

/* --- one local step ------------------------------------------------------------------------- */

static bool perform(const fsm_composition *self, uint32_t machine, void *state, fsm_action action,
                    uint32_t argument)
{
    const fsm_machine *m = self->system->machines[machine];
    const fsm_possible *possible = &self->system->possible[argument];
    if (m->zones)
        fsm_mark(m, state);
    fsm_choose_inputs(m, state);
    switch (action) {
    case FSM_DO_START:
        fsm_start_machine(m, state);
        return true;
    case FSM_DO_TAKE:
        (void)m->take(state);
        return true;
    case FSM_DO_FIRE:
        return fsm_fire(m, state, argument);
    case FSM_DO_EVENTLESS:
        (void)m->eventless(state);
        return true;
    case FSM_DO_OCCUR:
        fsm_occur(m, state, possible->event, possible->values);
        return !possible->spontaneous || fsm_recording.took;
    case FSM_DO_ELAPSE:
        break;
    }
    fsm_pass_time(m, state, self->system->unit);
    return true;
}

static bool push_message(fsm_composition *self, fsm_message *message)
{
    uint32_t number = fsm_intern_message(self, message);
    return number != FSM_NONE && fsm_push_number(self, &self->numbers, number);
}

/* Outputs that changed go to the inputs they are wired to; then what was sent, in order. */
static bool push_messages(fsm_composition *self, uint32_t machine)
{
    const fsm_system *system = self->system;
    const fsm_machine *m = system->machines[machine];
    for (uint32_t i = self->first_input_link[machine]; i < self->first_input_link[machine + 1]; i++) {
        const fsm_input_link *link = &system->input_links[self->of_machine[i]];
        fsm_value value = fsm_output(m, self->after, link->output);
        if (value == fsm_output(m, self->before, link->output))
            continue;
        fsm_message message = {link->target, link->input, true, 1, {value}};
        if (!push_message(self, &message))
            return false;
    }
    for (uint32_t s = 0; s < fsm_recording.sent_count; s++) {
        const fsm_sent_message *sent = &fsm_recording.sent[s];
        for (uint32_t i = self->first_event_link[machine]; i < self->first_event_link[machine + 1]; i++) {
            const fsm_event_link *link = &system->event_links[self->of_machine[i]];
            if (link->port != sent->port)
                continue;
            fsm_message message = {link->target, link->event, false, link->count, {0}};
            for (uint32_t v = 0; v < link->count; v++)
                message.values[v] = sent->values[link->from[v]];
            if (!push_message(self, &message))
                return false;
        }
    }
    return true;
}

static bool same_numbers(const fsm_composition *self, uint32_t a, uint32_t b, uint32_t count)
{
    return count == 0
        || memcmp(self->numbers.items + a, self->numbers.items + b, count * sizeof(uint32_t)) == 0;
}

/* Whether the choices of a step come before those of another, where each input is chosen before all else. */
static bool comes_before(const fsm_composition *self, const fsm_local_step *a, const fsm_local_step *b)
{
    const uint32_t *x = self->numbers.items + a->choices, *y = self->numbers.items + b->choices;
    for (uint32_t i = 0; i < a->choice_count && i < b->choice_count; i++)
        if (x[i] != y[i])
            return x[i] < y[i];
    return a->choice_count < b->choice_count;
}

/* The order in which inputs are read is the compiler's; that of the steps is not to depend on it. */
static void sort_steps(fsm_composition *self, size_t first)
{
    for (size_t i = first; i < self->step_count; i++) {
        fsm_local_step moved = self->steps[i];
        size_t at = i;
        for (; at > first && comes_before(self, &moved, &self->steps[at - 1]); at--)
            self->steps[at] = self->steps[at - 1];
        self->steps[at] = moved;
    }
}

/* The outcome of the same action, from `first` on, that had the same effect; NULL: none. */
static fsm_local_step *repeated(const fsm_composition *self, uint32_t machine, size_t first, const fsm_local_step *step)
{
    uint32_t armed = self->system->zones ? fsm_info(self, machine, step->next)->view.armed : 0;
    for (size_t i = first; i < self->step_count; i++) {
        fsm_local_step *other = &self->steps[i];
        if (other->next == step->next && other->message_count == step->message_count
            && other->note_count == step->note_count
            && same_numbers(self, other->clocks, step->clocks, armed)
            && same_numbers(self, other->messages, step->messages, step->message_count)
            && same_numbers(self, other->notes, step->notes, step->note_count))
            return other;
    }
    return NULL;
}

static bool push_step(fsm_composition *self, const fsm_local_step *step)
{
    if (self->step_count >= FSM_NONE || !FSM_HAS_ROOM(self->steps, self->step_count, self->step_room, 256))
        return fsm_fail(self, "out of memory");
    self->steps[self->step_count++] = *step;
    return true;
}

static bool push_recorded(fsm_composition *self, uint32_t machine, fsm_local_step *step)
{
    const fsm_recorder *r = &fsm_recording;
    bool fine = true;
    step->messages = (uint32_t)self->numbers.count;
    fine = push_messages(self, machine);
    step->message_count = (uint32_t)self->numbers.count - step->messages;
    step->notes = (uint32_t)self->numbers.count;
    for (uint32_t i = 0; fine && i < r->note_count; i++)
        if (step->action != FSM_DO_OCCUR
            || r->notes[i] != FSM_NOTE_UNHANDLED + self->system->possible[step->argument].event)
            fine = fsm_push_number(self, &self->numbers, r->notes[i]);
    step->note_count = (uint32_t)self->numbers.count - step->notes;
    step->choices = (uint32_t)self->numbers.count;
    uint32_t choices[FSM_MOST_CHOICES];
    uint32_t choice_count = fsm_recorder_choices(self->system->machines[machine]->free_count, choices);
    if (choice_count > FSM_MOST_CHOICES)
        return fsm_fail(self, "too many choices in one step");
    for (uint32_t i = 0; fine && i < choice_count; i++)
        fine = fsm_push_number(self, &self->numbers, choices[i]);
    step->choice_count = (uint32_t)self->numbers.count - step->choices;
    step->clocks = (uint32_t)self->numbers.count;
    uint32_t armed = self->system->zones ? fsm_info(self, machine, step->next)->view.armed : 0;
    for (uint32_t i = 0; fine && i < armed; i++)
        fine = fsm_push_number(self, &self->numbers, self->clocks[i]);
    return fine;
}

/* Clears what is no state, and notes which timers were armed before. */
static void settle(fsm_composition *self, const fsm_machine *m, void *after, const void *before)
{
    fsm_settle(m, after);
    if (m->zones)
        fsm_unmark(m, after, before, self->clocks);
}

/* Whether a step that led to the same local state armed none of its timers again. */
static bool keeps_clocks(const fsm_composition *self, uint32_t machine, uint32_t local)
{
    uint32_t armed = self->system->zones ? fsm_info(self, machine, local)->view.armed : 0;
    for (uint32_t i = 0; i < armed; i++)
        if (self->clocks[i] != i + 1)
            return false;
    return true;
}

static bool settle_step(fsm_composition *self, uint32_t machine, uint32_t local, size_t first,
                        fsm_local_step *step)
{
    const fsm_machine *m = self->system->machines[machine];
    fsm_bounds *bounds = &self->bounds[machine];
    if (fsm_recording.budget <= m->microsteps)
        bounds->microsteps = larger(bounds->microsteps, m->microsteps - fsm_recording.budget);
    settle(self, m, self->after, self->before);
    step->next = fsm_intern(self, machine, self->after);
    if (step->next == FSM_NONE)
        return false;
    size_t numbers = self->numbers.count;
    if (!push_recorded(self, machine, step))
        return false;
    bool idle = step->kind == FSM_STEP_ENVIRONMENT && step->next == local && step->message_count == 0
        && step->note_count == 0 && keeps_clocks(self, machine, local);
    bool still = step->action == FSM_DO_EVENTLESS && step->next == local && !fsm_recording.took;
    fsm_local_step *same = idle || still ? NULL : repeated(self, machine, first, step);
    if (!idle && !still && same == NULL)
        return push_step(self, step);
    if (same != NULL && comes_before(self, step, same)) {
        same->choices = step->choices;
        same->choice_count = step->choice_count;
        return true;
    }
    self->numbers.count = numbers;
    return true;
}

static void listen_to(const fsm_composition *self, uint32_t machine)
{
    fsm_recording.states_seen = self->states_seen[machine];
    fsm_recording.transitions_seen = self->transitions_seen[machine];
    fsm_recording.machine = self->system->machines[machine];
}

bool fsm_explore(fsm_composition *self, uint32_t machine, uint32_t local, fsm_action action,
                 uint32_t argument, fsm_kind kind)
{
    const fsm_machine *m = self->system->machines[machine];
    size_t first = self->step_count;
    uint32_t runs = 0;
    memcpy(self->before, fsm_store_at(&self->locals[machine], local), m->info->size);
    listen_to(self, machine);
    fsm_recorder_forget();
    do {
        enum { MOST_RUNS = 1 << 16 };
        if (++runs > MOST_RUNS)
            return fsm_fail(self, "too many combinations of choices in one step");
        memcpy(self->after, self->before, m->info->size);
        fsm_recorder_start();
        bool done = perform(self, machine, self->after, action, argument);
        if (fsm_recording.too_much != NULL)
            return fsm_fail(self, fsm_recording.too_much);
        fsm_local_step step = {.action = action, .argument = argument, .kind = kind};
        if (done && !settle_step(self, machine, local, first, &step))
            return false;
    } while (fsm_recorder_advance());
    if (m->read_inputs != NULL)
        sort_steps(self, first);
    return true;
}

void fsm_run_again(fsm_composition *self, fsm_description what, void *after)
{
    const fsm_machine *m = self->system->machines[what.machine];
    const void *before = fsm_store_at(&self->locals[what.machine], what.before);
    memcpy(after, before, m->info->size);
    fsm_recorder_forget();
    for (uint32_t i = 0; i < what.choice_count; i++)
        fsm_recording.chosen[i] = what.choices[i];
    fsm_recording.choice_count = what.choice_count;
    listen_to(self, what.machine);
    fsm_recorder_start();
    fsm_recording.tracing = fsm_recording.again = true;
    (void)perform(self, what.machine, after, what.action, what.argument);
    fsm_recording.tracing = fsm_recording.again = false;
    settle(self, m, after, before);
}

/* --- all local steps ------------------------------------------------------------------------ */

static bool explore_spontaneous(fsm_composition *self, uint32_t machine, uint32_t local)
{
    const fsm_system *system = self->system;
    for (uint32_t i = self->first_possible[machine]; i < self->first_possible[machine + 1]; i++) {
        uint32_t p = self->of_machine[i];
        if (system->possible[p].spontaneous && !fsm_explore(self, machine, local, FSM_DO_OCCUR, p, FSM_STEP_ENVIRONMENT))
            return false;
    }
    return true;
}

/* Those that may fire before their deadlines, and those that are due but not the next: between
 * timers whose delays are intervals there is no order. */
static bool explore_early(fsm_composition *self, uint32_t machine, uint32_t local, fsm_view view)
{
    const fsm_machine *m = self->system->machines[machine];
    for (uint32_t timer = view.due ? 1 : 0; m->slack != NULL && timer < view.armed; timer++)
        if (fsm_is_early(m, fsm_store_at(&self->locals[machine], local), timer)
            && !fsm_explore(self, machine, local, FSM_DO_FIRE, timer, FSM_STEP_ENVIRONMENT))
            return false;
    return true;
}

static bool explore_timers(fsm_composition *self, uint32_t machine, uint32_t local, fsm_view view)
{
    if (self->system->zones)
        return true; /* it depends on the clocks, which are no part of this state: timed.c */
    if (!self->system->untimed)
        return (!view.due || fsm_explore(self, machine, local, FSM_DO_FIRE, 0, FSM_STEP_INTERNAL))
            && explore_early(self, machine, local, view);
    for (uint32_t timer = 0; timer < view.armed; timer++)
        if (!fsm_explore(self, machine, local, FSM_DO_FIRE, timer, FSM_STEP_TIME))
            return false;
    return true;
}

static bool explore_own(fsm_composition *self, uint32_t machine, uint32_t local, fsm_view view)
{
    const fsm_machine *m = self->system->machines[machine];
    bool arbitrary = self->system->open;
    size_t first = self->step_count;
    if (m->eventless != NULL
        && !fsm_explore(self, machine, local, FSM_DO_EVENTLESS, 0, arbitrary ? FSM_STEP_ENVIRONMENT : FSM_STEP_INTERNAL))
        return false;
    if (!arbitrary && self->step_count > first)
        return true;
    if (view.waiting > 0)
        return fsm_explore(self, machine, local, FSM_DO_TAKE, 0, FSM_STEP_INTERNAL);
    return explore_timers(self, machine, local, view) && explore_spontaneous(self, machine, local);
}

static bool explore_open(fsm_composition *self, uint32_t machine, uint32_t local, bool *fair)
{
    const fsm_system *system = self->system;
    for (uint32_t i = self->first_possible[machine]; i < self->first_possible[machine + 1]; i++) {
        uint32_t p = self->of_machine[i];
        const fsm_possible *possible = &system->possible[p];
        if (possible->spontaneous)
            continue;
        size_t first = self->step_count;
        if (!fsm_explore(self, machine, local, FSM_DO_OCCUR, p, FSM_STEP_ENVIRONMENT))
            return false;
        *fair = *fair || (possible->fair && self->step_count > first);
    }
    return true;
}

bool fsm_know(fsm_composition *self, uint32_t machine, uint32_t local)
{
    fsm_local_info info = *fsm_info(self, machine, local);
    if (info.known)
        return true;
    info.own = (uint32_t)self->step_count;
    if (info.view.running && !explore_own(self, machine, local, info.view))
        return false;
    info.own_count = (uint32_t)self->step_count - info.own;
    for (uint32_t i = info.own; i < info.own + info.own_count; i++) {
        info.busy = info.busy || self->steps[i].kind == FSM_STEP_INTERNAL;
        info.fair = info.fair || (self->steps[i].action == FSM_DO_OCCUR && self->system->possible[self->steps[i].argument].fair);
    }
    info.known = true;
    *fsm_info(self, machine, local) = info;
    return is_within_memory(self);
}

bool fsm_know_open(fsm_composition *self, uint32_t machine, uint32_t local)
{
    fsm_local_info info = *fsm_info(self, machine, local);
    if (info.open_known)
        return true;
    info.open = (uint32_t)self->step_count;
    if (info.view.running && !explore_open(self, machine, local, &info.fair))
        return false;
    info.open_count = (uint32_t)self->step_count - info.open;
    info.open_known = true;
    *fsm_info(self, machine, local) = info;
    return is_within_memory(self);
}
