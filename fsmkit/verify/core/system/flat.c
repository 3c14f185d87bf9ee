#include "system/flat.h"

#include <stdlib.h>
#include <string.h>

/* --- starting ---------------------------------------------------------------------------------- */

enum { MOST_MARKS = FSM_MOST_NOTES + FSM_MOST_MACHINES };

typedef struct {
    fsm_composition *composition;
    fsm_visit_start *visit;
    void *context;
    uint32_t order[FSM_MOST_MACHINES];
    fsm_description what[FSM_MOST_MACHINES];
    fsm_numbers sent; /* messages that wait until all have started */
} starting;

/* A state on the way: where the machines are, and the marks so far. */
typedef struct {
    uint32_t locals[FSM_MOST_MACHINES];
    uint32_t marks[MOST_MARKS];
    uint32_t mark_count;
} started;

static void add_mark(started *at, uint32_t mark)
{
    for (uint32_t i = 0; i < at->mark_count; i++)
        if (at->marks[i] == mark)
            return;
    if (at->mark_count < MOST_MARKS)
        at->marks[at->mark_count++] = mark;
}

static bool deliver(const starting *self, started *at, uint32_t message)
{
    fsm_composition *c = self->composition;
    uint32_t target = ((const fsm_message *)fsm_store_at(&c->messages, message))->target;
    bool full;
    at->locals[target] = fsm_deliver(c, at->locals[target], message, &full);
    if (at->locals[target] == FSM_NONE)
        return false;
    if (full)
        add_mark(at, c->first_marks[target] + FSM_NOTE_FULL);
    return true;
}

/* All machines have started: sent events reach the queues. */
static bool finish(const starting *self, started *at)
{
    for (size_t i = 0; i < self->sent.count; i++)
        if (!deliver(self, at, self->sent.items[i]))
            return false;
    fsm_start found = {at->locals, at->marks, at->mark_count, self->what};
    return self->visit(self->context, &found);
}

/* The effects of a machine's start. Outputs reach inputs immediately. */
static bool take_over(starting *self, started *at, uint32_t machine, const fsm_local_step *step)
{
    fsm_composition *c = self->composition;
    uint32_t first = c->first_marks[machine];
    at->locals[machine] = step->next;
    for (uint32_t i = 0; i < step->note_count; i++)
        add_mark(at, first + c->numbers.items[step->notes + i]);
    for (uint32_t i = 0; i < step->message_count; i++) {
        uint32_t message = c->numbers.items[step->messages + i];
        bool is_input = ((const fsm_message *)fsm_store_at(&c->messages, message))->is_input;
        if (is_input ? !deliver(self, at, message) : !fsm_push_number(c, &self->sent, message))
            return false;
    }
    return true;
}

static bool start(starting *self, started *from, uint32_t at);

/* Goes on from one outcome; all but the last one need a copy of the state before. */
static bool go_on(starting *self, started *from, uint32_t at, const fsm_local_step *step, bool is_last)
{
    fsm_composition *c = self->composition;
    uint32_t machine = self->order[at], before = from->locals[machine];
    started *next = is_last ? from : malloc(sizeof *next);
    if (next == NULL)
        return fsm_fail(c, "out of memory");
    if (!is_last)
        *next = *from;
    bool fine = take_over(self, next, machine, step);
    self->what[at] = (fsm_description){step->action, machine, step->argument, before, c->numbers.items + step->choices,
                                       step->choice_count};
    fine = fine && start(self, next, at + 1);
    if (!is_last)
        free(next);
    return fine;
}

/* `from` is used up. */
static bool start(starting *self, started *from, uint32_t at)
{
    fsm_composition *c = self->composition;
    if (at == c->system->machine_count)
        return finish(self, from);
    uint32_t machine = self->order[at];
    size_t first = c->step_count, pending = self->sent.count;
    if (!fsm_explore(c, machine, from->locals[machine], FSM_DO_START, 0, FSM_STEP_INTERNAL))
        return false;
    size_t last = c->step_count;
    for (size_t number = first; number < last; number++) {
        const fsm_local_step step = c->steps[number];
        if (!go_on(self, from, at, &step, number + 1 == last))
            return false;
        self->sent.count = pending;
    }
    return true;
}

static bool copy_initial_outputs(const starting *self, started *at)
{
    fsm_composition *c = self->composition;
    for (uint32_t i = 0; i < c->system->input_link_count; i++) {
        const fsm_input_link *link = &c->system->input_links[i];
        const void *source = fsm_store_at(&c->locals[link->source], at->locals[link->source]);
        fsm_message message = {link->target, link->input, true, 1,
                               {fsm_output(c->system->machines[link->source], source, link->output)}};
        uint32_t number = fsm_intern_message(c, &message);
        if (number == FSM_NONE || !deliver(self, at, number))
            return false;
    }
    return true;
}

bool fsm_start_all(fsm_composition *self, fsm_visit_start *visit, void *context)
{
    uint32_t count = self->system->machine_count, placed = 0;
    starting all = {.composition = self, .visit = visit, .context = context};
    started at = {.mark_count = 0};
    for (uint32_t i = 0; i < count; i++) {
        const fsm_machine *m = self->system->machines[i];
        memcpy(self->after, m->initial, m->info->size);
        fsm_settle(m, self->after);
        at.locals[i] = fsm_intern(self, i, self->after);
        if (at.locals[i] == FSM_NONE)
            return false;
    }
    for (uint32_t pass = 0; pass < 2; pass++)
        for (uint32_t i = 0; i < count; i++)
            if (self->system->machines[i]->environment == (pass == 0))
                all.order[placed++] = i;
    bool fine = copy_initial_outputs(&all, &at) && start(&all, &at, 0);
    free(all.sent.items);
    return fine;
}

/* --- what is seen --------------------------------------------------------------------------------- */

static bool is_deadlock(fsm_composition *c, const uint32_t *locals)
{
    bool all_rest = true;
    for (uint32_t i = 0; i < c->system->machine_count; i++) {
        const fsm_view *view = &fsm_info(c, i, locals[i])->view;
        if (view->waiting > 0 || (view->awaited > 0 && !c->system->machines[i]->monitor))
            return false;
    }
    for (uint32_t i = 0; i < c->system->machine_count; i++) {
        if (!fsm_know(c, i, locals[i]) || !fsm_know_open(c, i, locals[i]))
            return false;
        const fsm_local_info *info = fsm_info(c, i, locals[i]);
        if (info->view.faulted || info->busy || info->fair)
            return false;
        all_rest = all_rest && info->view.at_rest;
    }
    return !all_rest;
}

bool fsm_flat_evaluate(const fsm_composition *self, const uint32_t *locals, uint32_t property)
{
    const void *structs[FSM_MOST_MACHINES];
    for (uint32_t i = 0; i < self->system->machine_count; i++)
        structs[i] = fsm_store_at(&self->locals[i], locals[i]);
    return self->system->evaluate(structs, property);
}

uint32_t fsm_flat_marks(fsm_composition *self, const uint32_t *locals, uint32_t *found)
{
    uint32_t count = 0;
    if (!self->system->open && is_deadlock(self, locals))
        found[count++] = 0;
    for (uint32_t p = 0; p < self->system->property_count; p++)
        if (fsm_flat_evaluate(self, locals, p))
            found[count++] = 1 + p;
    return count;
}

uint32_t fsm_flat_configuration(const fsm_composition *self, const uint32_t *locals)
{
    uint32_t shown = 0; /* traps are decided for one machine; for several this is only a hash */
    for (uint32_t i = 0; i < self->system->machine_count; i++)
        shown = shown * 0x01000193u + fsm_info(self, i, locals[i])->configuration;
    return shown;
}

bool fsm_flat_at_rest(const fsm_composition *self, const uint32_t *locals)
{
    for (uint32_t i = 0; i < self->system->machine_count; i++) {
        const fsm_view *view = &fsm_info(self, i, locals[i])->view;
        if (!view->at_rest && !view->faulted)
            return false;
    }
    return true;
}
