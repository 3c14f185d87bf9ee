#include "symbolic/symbolic.h"
#include "store/room.h"

#include <stdlib.h>
#include <string.h>

bool fsm_knowledge_init(fsm_knowledge *self, fsm_composition *composition)
{
    const fsm_system *system = composition->system;
    size_t states = 1, transitions = 1;
    *self = (fsm_knowledge){.composition = composition};
    for (uint32_t i = 0; i < system->machine_count; i++) {
        const fsm_machine_info *info = system->machines[i]->info;
        states = info->state_count > states ? info->state_count : states;
        transitions = info->transition_count > transitions ? info->transition_count : transitions;
    }
    self->locals = calloc(system->machine_count, sizeof *self->locals);
    self->room = calloc(system->machine_count, sizeof *self->room);
    self->states = calloc(states, 1);
    self->transitions = calloc(transitions, 1);
    bool fine = fsm_lists_init(&self->lists);
    if (fine && self->locals != NULL && self->room != NULL && self->states != NULL && self->transitions != NULL)
        return true;
    fsm_knowledge_free(self);
    return false;
}

void fsm_knowledge_free(fsm_knowledge *self)
{
    for (uint32_t i = 0; self->locals != NULL && i < self->composition->system->machine_count; i++)
        free(self->locals[i]);
    if (self->composition != NULL && self->composition->knowledge == self) {
        self->composition->knowledge = NULL;
        self->composition->know = NULL;
    }
    fsm_lists_free(&self->lists);
    free(self->locals);
    free(self->room);
    free(self->states);
    free(self->transitions);
    free(self->buffer);
    *self = (fsm_knowledge){0};
}

static bool make_room(fsm_knowledge *self, uint32_t machine, uint32_t local)
{
    return FSM_HAS_PLACE(self->locals[machine], self->room[machine], local, 16)
        || fsm_fail(self->composition, "out of memory");
}

static bool add(fsm_knowledge *self, uint32_t *count, uint32_t number)
{
    if (!FSM_HAS_ROOM(self->buffer, *count, self->buffer_room, 256))
        return fsm_fail(self->composition, "out of memory");
    self->buffer[(*count)++] = number;
    return true;
}

static bool add_seen(fsm_knowledge *self, const unsigned char *seen, uint32_t size, uint32_t odd, uint32_t *count)
{
    for (uint32_t i = 0; i < size; i++)
        if (seen[i] && !add(self, count, 2 * i + odd))
            return false;
    return true;
}

/* The notes of some steps, each once; what a machine sends to itself may find its queue full. */
static bool add_notes(fsm_knowledge *self, uint32_t machine, uint32_t first, uint32_t step_count, uint32_t *count)
{
    fsm_composition *c = self->composition;
    for (uint32_t s = first; s < first + step_count; s++) {
        const fsm_local_step step = c->steps[s];
        uint32_t local = step.next;
        bool lost = false;
        for (uint32_t i = 0; i < step.message_count; i++) {
            uint32_t message = c->numbers.items[step.messages + i];
            bool full = false;
            if (((const fsm_message *)fsm_store_at(&c->messages, message))->target == machine)
                local = fsm_deliver(c, local, message, &full);
            if (local == FSM_NONE)
                return false;
            lost = lost || full;
        }
        for (uint32_t i = 0; i < step.note_count + lost; i++) {
            uint32_t note = i < step.note_count ? c->numbers.items[step.notes + i] : FSM_NOTE_FULL, at = 0;
            while (at < *count && self->buffer[at] != note)
                at++;
            if (at == *count && !add(self, count, note))
                return false;
        }
    }
    return true;
}

/* Finds out steps, and keeps apart what runs: it counts as covered only where they can be taken. */
static bool find_part(fsm_knowledge *self, uint32_t machine, uint32_t local, bool open, fsm_executed *ran)
{
    fsm_composition *c = self->composition;
    const fsm_machine_info *info = c->system->machines[machine]->info;
    unsigned char *states = c->states_seen[machine], *transitions = c->transitions_seen[machine];
    uint32_t microsteps = c->bounds[machine].microsteps, count = 0;
    memset(self->states, 0, info->state_count);
    memset(self->transitions, 0, info->transition_count);
    c->states_seen[machine] = self->states;
    c->transitions_seen[machine] = self->transitions;
    c->bounds[machine].microsteps = 0;
    bool fine = open ? fsm_know_open(c, machine, local) : fsm_know(c, machine, local);
    ran->microsteps = c->bounds[machine].microsteps;
    c->states_seen[machine] = states;
    c->transitions_seen[machine] = transitions;
    c->bounds[machine].microsteps = microsteps;
    if (!fine || !add_seen(self, self->states, info->state_count, 0, &count)
        || !add_seen(self, self->transitions, info->transition_count, 1, &count))
        return false;
    ran->seen = fsm_lists_number(&self->lists, self->buffer, count);
    const fsm_local_info *known = fsm_info(c, machine, local);
    count = 0;
    fine = add_notes(self, machine, open ? known->open : known->own, open ? known->open_count : known->own_count, &count);
    ran->marks = fsm_lists_number(&self->lists, self->buffer, count);
    return fine && ((ran->seen != FSM_NONE && ran->marks != FSM_NONE) || fsm_fail(c, "out of memory"));
}

bool fsm_knowledge_find(fsm_knowledge *self, uint32_t machine, uint32_t local, bool open)
{
    fsm_executed ran = {0, 0, 0};
    if (!make_room(self, machine, local))
        return false;
    const fsm_executed_steps *known = &self->locals[machine][local];
    if (open ? known->open_known : known->own_known)
        return true;
    if (!find_part(self, machine, local, open, &ran))
        return false;
    fsm_executed_steps *found = &self->locals[machine][local];
    *(open ? &found->open : &found->own) = ran;
    *(open ? &found->open_known : &found->own_known) = true;
    return true;
}

/* For callers that have found the steps possible. */
static bool know(fsm_composition *c, uint32_t machine, uint32_t local, bool open)
{
    fsm_knowledge *self = c->knowledge;
    uint32_t count;
    if (!fsm_knowledge_find(self, machine, local, open))
        return false;
    const fsm_executed *ran = open ? &self->locals[machine][local].open : &self->locals[machine][local].own;
    const uint32_t *seen = fsm_lists_at(&self->lists, ran->seen, &count);
    for (uint32_t i = 0; i < count; i++)
        (seen[i] % 2 == 0 ? c->states_seen : c->transitions_seen)[machine][seen[i] / 2] = 1;
    if (ran->microsteps > c->bounds[machine].microsteps)
        c->bounds[machine].microsteps = ran->microsteps;
    return true;
}

void fsm_knowledge_serve(fsm_knowledge *self)
{
    self->composition->knowledge = self;
    self->composition->know = know;
}
