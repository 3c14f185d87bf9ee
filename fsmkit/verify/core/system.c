#include "composition.h"

#include <stdlib.h>
#include <string.h>

uint32_t fsm_first_mark(const fsm_system *system, uint32_t machine)
{
    uint32_t mark = 1 + system->property_count;
    for (uint32_t i = 0; i < machine; i++)
        mark += FSM_NOTE_UNHANDLED + system->machines[i]->event_count;
    return mark;
}

size_t fsm_composition_bytes(const fsm_composition *self)
{
    size_t bytes = sizeof *self + self->step_room * sizeof *self->steps
        + self->numbers.room * sizeof *self->numbers.items + fsm_store_bytes(&self->messages)
        + fsm_memo_bytes(&self->deliveries);
    for (uint32_t i = 0; i < self->system->machine_count; i++)
        bytes += fsm_store_bytes(&self->locals[i]) + fsm_store_bytes(&self->configurations[i])
            + self->info_room[i] * sizeof *self->infos[i];
    return bytes;
}

/* --- a global step under construction --------------------------------------------------------- */

typedef struct {
    fsm_composition *composition;
    fsm_emit *emit;
    void *context;
    uint32_t next[FSM_MOST_MACHINES];
    uint32_t mark_count;
} global;

static void add_mark(global *self, uint32_t mark)
{
    fsm_composition *c = self->composition;
    for (uint32_t i = 0; i < self->mark_count; i++)
        if (c->marks[i] == mark)
            return;
    if (self->mark_count < sizeof c->marks / sizeof *c->marks)
        c->marks[self->mark_count++] = mark;
}

static bool deliver(global *self, uint32_t message)
{
    fsm_composition *c = self->composition;
    uint32_t target = ((const fsm_message *)fsm_store_at(&c->messages, message))->target;
    bool full;
    self->next[target] = fsm_deliver(c, self->next[target], message, &full);
    if (self->next[target] == FSM_NONE)
        return false;
    if (full)
        add_mark(self, fsm_first_mark(c->system, target) + FSM_NOTE_FULL);
    return true;
}

static void add_notes(global *self, uint32_t machine, const fsm_local_step *step)
{
    const fsm_composition *c = self->composition;
    uint32_t first = fsm_first_mark(c->system, machine);
    for (uint32_t i = 0; i < step->note_count; i++)
        add_mark(self, first + c->numbers.items[step->notes + i]);
}

static void describe(fsm_composition *c, uint32_t machine, uint32_t before, const fsm_local_step *step,
                     uint32_t slot)
{
    c->last[slot] = (fsm_description){step->action, machine, step->argument, before,
                                      c->numbers.items + step->choices, step->choice_count};
}

static bool emit(global *self, fsm_kind kind)
{
    fsm_step step = {self->next, self->composition->marks, self->mark_count, kind};
    return self->emit(self->context, &step);
}

static bool take_step(global *self, const uint32_t *state, uint32_t machine, uint32_t number)
{
    fsm_composition *c = self->composition;
    fsm_local_step step = c->steps[number];
    memcpy(self->next, state, c->model.state_size);
    self->next[machine] = step.next;
    self->mark_count = 0;
    add_notes(self, machine, &step);
    for (uint32_t i = 0; i < step.message_count; i++)
        if (!deliver(self, c->numbers.items[step.messages + i]))
            return false;
    describe(c, machine, state[machine], &step, 0);
    return emit(self, step.kind);
}

static bool take_steps(global *self, const uint32_t *state, uint32_t machine, uint32_t first, uint32_t count)
{
    for (uint32_t number = first; number < first + count; number++)
        if (!take_step(self, state, machine, number))
            return false;
    return true;
}

static bool pass_time(global *self, const uint32_t *state)
{
    fsm_composition *c = self->composition;
    self->mark_count = 0;
    for (uint32_t i = 0; i < c->system->machine_count; i++) {
        self->next[i] = fsm_elapse(c, i, state[i]);
        if (self->next[i] == FSM_NONE)
            return false;
    }
    c->last[0] = (fsm_description){.action = FSM_DO_ELAPSE};
    return emit(self, FSM_STEP_TIME);
}

/* --- the functions of the model ----------------------------------------------------------------- */

/* What all machines together show of a global state. */
typedef struct {
    bool answering; /* a machine of the environment has an event waiting */
    uint32_t waiting, awaited;
} overview;

static overview look(const fsm_composition *c, const uint32_t *state)
{
    overview seen = {false, 0, 0};
    for (uint32_t i = 0; i < c->system->machine_count; i++) {
        const fsm_view *view = &fsm_info(c, i, state[i])->view;
        seen.waiting += view->waiting;
        seen.awaited += view->awaited;
        seen.answering = seen.answering || (c->system->machines[i]->environment && view->waiting > 0);
    }
    return seen;
}

static bool successors(void *context, const void *bytes, fsm_emit *emit_step, void *emit_context)
{
    fsm_composition *c = context;
    const fsm_system *system = c->system;
    const uint32_t *state = bytes;
    global self = {.composition = c, .emit = emit_step, .context = emit_context};
    overview seen = look(c, state);
    bool busy = false, is_open = !seen.answering && seen.waiting <= system->patience;
    for (uint32_t i = 0; i < system->machine_count; i++) {
        const fsm_view *view = &fsm_info(c, i, state[i])->view;
        if (seen.answering && !(system->machines[i]->environment && view->waiting > 0))
            continue;
        if (!fsm_know(c, i, state[i]) || (is_open && !fsm_know_open(c, i, state[i])))
            return false;
        fsm_local_info info = *fsm_info(c, i, state[i]);
        busy = busy || info.busy;
        if (!take_steps(&self, state, i, info.own, info.own_count))
            return false;
        if (is_open && !take_steps(&self, state, i, info.open, info.open_count))
            return false;
    }
    return busy || seen.awaited == 0 || system->unit == 0 || pass_time(&self, state);
}

/* Starts machine after machine, those of the environment first. Outputs reach inputs at once, events
 * the queues when all have started. */
static bool start(global *self, const uint32_t *order, uint32_t at, fsm_numbers *sent)
{
    fsm_composition *c = self->composition;
    uint32_t before[FSM_MOST_MACHINES];
    memcpy(before, self->next, c->model.state_size);
    if (at == c->system->machine_count) {
        bool fine = true;
        for (size_t i = 0; fine && i < sent->count; i++)
            fine = deliver(self, sent->items[i]);
        fine = fine && emit(self, FSM_STEP_ENVIRONMENT);
        memcpy(self->next, before, c->model.state_size);
        return fine;
    }
    uint32_t machine = order[at], marks = self->mark_count;
    size_t first = c->step_count, pending = sent->count;
    if (!fsm_explore(c, machine, self->next[machine], FSM_DO_START, 0, FSM_STEP_INTERNAL))
        return false;
    size_t last = c->step_count;
    for (size_t number = first; number < last; number++) {
        fsm_local_step step = c->steps[number];
        self->next[machine] = step.next;
        add_notes(self, machine, &step);
        for (uint32_t i = 0; i < step.message_count; i++) {
            uint32_t message = c->numbers.items[step.messages + i];
            bool is_input = ((const fsm_message *)fsm_store_at(&c->messages, message))->is_input;
            if (is_input ? !deliver(self, message) : !fsm_push_number(c, sent, message))
                return false;
        }
        describe(c, machine, before[machine], &step, at);
        if (!start(self, order, at + 1, sent))
            return false;
        memcpy(self->next, before, c->model.state_size);
        self->mark_count = marks;
        sent->count = pending;
    }
    return true;
}

static bool copy_initial_outputs(global *self)
{
    fsm_composition *c = self->composition;
    for (uint32_t i = 0; i < c->system->input_link_count; i++) {
        const fsm_input_link *link = &c->system->input_links[i];
        const void *source = fsm_store_at(&c->locals[link->source], self->next[link->source]);
        fsm_message message = {link->target, link->input, true, 1,
                               {c->system->machines[link->source]->output(source, link->output)}};
        uint32_t number = fsm_intern_message(c, &message);
        if (number == FSM_NONE || !deliver(self, number))
            return false;
    }
    return true;
}

static bool initial(void *context, fsm_emit *emit_step, void *emit_context)
{
    fsm_composition *c = context;
    uint32_t count = c->system->machine_count, order[FSM_MOST_MACHINES], placed = 0;
    global self = {.composition = c, .emit = emit_step, .context = emit_context};
    for (uint32_t i = 0; i < count; i++) {
        memset(c->after, 0, c->system->machines[i]->size);
        c->system->machines[i]->init(c->after);
        c->system->machines[i]->settle(c->after);
        self.next[i] = fsm_intern(c, i, c->after);
        if (self.next[i] == FSM_NONE)
            return false;
    }
    for (uint32_t pass = 0; pass < 2; pass++)
        for (uint32_t i = 0; i < count; i++)
            if (c->system->machines[i]->environment == (pass == 0))
                order[placed++] = i;
    fsm_numbers sent = {0};
    bool fine = copy_initial_outputs(&self) && start(&self, order, 0, &sent);
    free(sent.items);
    return fine;
}

static bool is_deadlock(fsm_composition *c, const uint32_t *state)
{
    overview seen = look(c, state);
    bool all_rest = true;
    if (seen.waiting > 0 || seen.awaited > 0)
        return false;
    for (uint32_t i = 0; i < c->system->machine_count; i++) {
        if (!fsm_know(c, i, state[i]) || !fsm_know_open(c, i, state[i]))
            return false;
        const fsm_local_info *info = fsm_info(c, i, state[i]);
        if (info->view.faulted || info->busy || info->owed)
            return false;
        all_rest = all_rest && info->view.at_rest;
    }
    return !all_rest;
}

static uint32_t marks(void *context, const void *bytes, uint32_t *found)
{
    fsm_composition *c = context;
    const uint32_t *state = bytes;
    const void *locals[FSM_MOST_MACHINES];
    uint32_t count = 0;
    if (!c->system->open && is_deadlock(c, state))
        found[count++] = 0;
    for (uint32_t i = 0; i < c->system->machine_count; i++)
        locals[i] = fsm_store_at(&c->locals[i], state[i]);
    for (uint32_t p = 0; p < c->system->property_count; p++)
        if (c->system->judge(locals, p))
            found[count++] = 1 + p;
    return count;
}

static uint32_t configuration(void *context, const void *bytes)
{
    const fsm_composition *c = context;
    const uint32_t *state = bytes;
    uint32_t shown = 0; /* traps are asked for of one machine; of several this is only a hash */
    for (uint32_t i = 0; i < c->system->machine_count; i++)
        shown = shown * 0x01000193u + fsm_info(c, i, state[i])->configuration;
    return shown;
}

static bool at_rest(void *context, const void *bytes)
{
    const fsm_composition *c = context;
    const uint32_t *state = bytes;
    for (uint32_t i = 0; i < c->system->machine_count; i++) {
        const fsm_view *view = &fsm_info(c, i, state[i])->view;
        if (!view->at_rest && !view->faulted)
            return false;
    }
    return true;
}

static size_t memory(void *context)
{
    return fsm_composition_bytes(context);
}

static const char *failure(void *context)
{
    const fsm_composition *c = context;
    return c->failure;
}

/* --- making one ------------------------------------------------------------------------------- */

static bool init_machine(fsm_composition *self, uint32_t machine)
{
    const fsm_machine *m = self->system->machines[machine];
    self->states_seen[machine] = calloc(m->state_count + 1, 1);
    self->transitions_seen[machine] = calloc(m->transition_count + 1, 1);
    return fsm_store_init(&self->locals[machine], m->size)
        && fsm_store_init(&self->configurations[machine], m->configuration_size)
        && self->states_seen[machine] != NULL && self->transitions_seen[machine] != NULL;
}

fsm_composition *fsm_compose(const fsm_system *system, size_t memory_limit)
{
    fsm_composition *self = calloc(1, sizeof *self);
    if (self == NULL)
        return NULL;
    self->system = system;
    self->memory_limit = memory_limit;
    size_t largest = 1;
    uint32_t count = system->machine_count;
    bool fine = fsm_store_init(&self->messages, sizeof(fsm_message));
    for (uint32_t i = 0; i < count; i++) {
        fine = init_machine(self, i) && fine;
        largest = system->machines[i]->size > largest ? system->machines[i]->size : largest;
    }
    self->before = malloc(largest);
    self->after = malloc(largest);
    self->model = (fsm_model){
        .abi = FSM_MODEL_ABI, .state_size = count * sizeof(uint32_t),
        .mark_count = fsm_first_mark(system, count), .self = self, .initial = initial,
        .successors = successors, .marks = marks, .configuration = configuration, .at_rest = at_rest,
        .memory = memory, .failure = failure};
    if (fine && self->before != NULL && self->after != NULL)
        return self;
    fsm_composition_free(self);
    return NULL;
}

void fsm_composition_free(fsm_composition *self)
{
    if (self == NULL)
        return;
    for (uint32_t i = 0; i < self->system->machine_count; i++) {
        fsm_store_free(&self->locals[i]);
        fsm_store_free(&self->configurations[i]);
        free(self->infos[i]);
        free(self->states_seen[i]);
        free(self->transitions_seen[i]);
    }
    free(self->steps);
    free(self->numbers.items);
    fsm_store_free(&self->messages);
    fsm_memo_free(&self->deliveries);
    free(self->before);
    free(self->after);
    free(self);
}

const fsm_model *fsm_composition_model(const fsm_composition *self)
{
    return &self->model;
}

fsm_bounds fsm_composition_bounds(const fsm_composition *self, uint32_t machine)
{
    return self->bounds[machine];
}

const unsigned char *fsm_states_seen(const fsm_composition *self, uint32_t machine)
{
    return self->states_seen[machine];
}

const unsigned char *fsm_transitions_seen(const fsm_composition *self, uint32_t machine)
{
    return self->transitions_seen[machine];
}

uint32_t fsm_local_count(const fsm_composition *self, uint32_t machine)
{
    return self->locals[machine].count;
}

const void *fsm_local(const fsm_composition *self, uint32_t machine, uint32_t number)
{
    return fsm_store_at(&self->locals[machine], number);
}

fsm_description fsm_describe(const fsm_composition *self, uint32_t machine)
{
    return self->last[machine];
}
