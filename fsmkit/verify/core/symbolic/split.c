#include "symbolic/split.h"
#include "store/room.h"

#include <stdlib.h>
#include <string.h>

enum {
    MOST_COMBINATIONS = 512, /* of values, for one machine: in each of them each of its local states is run */
    BASE_BITS = 32
};

/* --- which variables -------------------------------------------------------------------------------- */

/* Slots of all machines, numbered one after the other; those that a wire connects are one variable. */
typedef struct {
    const fsm_system *system;
    uint32_t *first, *leader; /* by machine; by slot: another one of the same variable, or itself */
    uint32_t *owner, *next;   /* by slot: its machine; the next one of the same variable, FSM_NONE after the last */
} slots;

static uint32_t leader_of(slots *self, uint32_t slot)
{
    while (self->leader[slot] != slot)
        slot = self->leader[slot] = self->leader[self->leader[slot]];
    return slot;
}

static bool is_shared(const fsm_system *system, const fsm_input_link *link)
{
    const fsm_machine *from = system->machines[link->source], *to = system->machines[link->target];
    return link->output >= from->info->output_count && link->output < from->info->output_count + from->shared_count
        && link->input >= to->info->input_count;
}

static bool join_slots(slots *self)
{
    const fsm_system *system = self->system;
    uint32_t count = 0;
    self->first = malloc((system->machine_count + 1u) * sizeof *self->first);
    for (uint32_t i = 0; self->first != NULL && i < system->machine_count; i++) {
        self->first[i] = count;
        count += system->machines[i]->shared_count;
    }
    self->leader = malloc((count + 1u) * sizeof *self->leader);
    if (self->first == NULL || self->leader == NULL)
        return false;
    self->first[system->machine_count] = count;
    for (uint32_t i = 0; i < count; i++)
        self->leader[i] = i;
    for (uint32_t i = 0; i < system->input_link_count; i++) {
        const fsm_input_link *link = &system->input_links[i];
        if (!is_shared(system, link))
            continue;
        uint32_t from = self->first[link->source] + link->output - system->machines[link->source]->info->output_count;
        uint32_t to = self->first[link->target] + link->input - system->machines[link->target]->info->input_count;
        self->leader[leader_of(self, to)] = leader_of(self, from);
    }
    return true;
}

/* Chains the slots of each variable, from its leader on. */
static bool chain_slots(slots *self)
{
    const fsm_system *system = self->system;
    uint32_t count = self->first[system->machine_count];
    self->owner = malloc((count + 1u) * sizeof *self->owner);
    self->next = malloc((count + 1u) * sizeof *self->next);
    if (self->owner == NULL || self->next == NULL)
        return false;
    for (uint32_t i = 0; i < system->machine_count; i++)
        for (uint32_t slot = self->first[i]; slot < self->first[i + 1]; slot++)
            self->owner[slot] = i;
    for (uint32_t slot = 0; slot < count; slot++)
        self->next[slot] = FSM_NONE;
    for (uint32_t slot = count; slot-- > 0;) {
        uint32_t leader = leader_of(self, slot);
        if (leader == slot)
            continue;
        self->next[slot] = self->next[leader];
        self->next[leader] = slot;
    }
    return true;
}

/* Whether all copies of a variable are held by machines that have room for its values. */
static bool has_room(const fsm_split *self, const slots *all, uint32_t leader, uint32_t count)
{
    uint32_t holders = 0;
    for (uint32_t slot = leader; slot != FSM_NONE; slot = all->next[slot], holders++) {
        const fsm_machine *m = all->system->machines[all->owner[slot]];
        if (m->monitor || self->machines[all->owner[slot]].combinations > MOST_COMBINATIONS / count)
            return false;
    }
    return holders > 1;
}

static bool add_slot(fsm_split *self, uint32_t machine, uint32_t slot)
{
    fsm_split_machine *m = &self->machines[machine];
    uint32_t shared = self->composition->system->machines[machine]->shared_count;
    if (m->variables == NULL) {
        m->variables = malloc(shared * sizeof *m->variables);
        m->slots = malloc(shared * sizeof *m->slots);
        self->variable_of[machine] = calloc(shared, sizeof **self->variable_of);
    }
    if (m->variables == NULL || m->slots == NULL || self->variable_of[machine] == NULL)
        return false;
    m->variables[m->count] = self->variable_count;
    m->slots[m->count++] = slot;
    m->combinations *= self->variables[self->variable_count].count;
    self->variable_of[machine][slot] = self->variable_count + 1;
    return true;
}

static bool split_off(fsm_split *self, slots *all, uint32_t machine, uint32_t slot)
{
    const fsm_system *system = all->system;
    uint32_t leader = leader_of(all, all->first[machine] + slot);
    uint32_t count = system->machines[machine]->shared_ranges[slot].count;
    if (count == 0 || !has_room(self, all, leader, count))
        return true;
    self->variables[self->variable_count] = (fsm_shared){machine, slot, count};
    for (uint32_t at = leader; at != FSM_NONE; at = all->next[at])
        if (!add_slot(self, all->owner[at], at - all->first[all->owner[at]]))
            return false;
    self->variable_count++;
    return true;
}

static bool find_variables(fsm_split *self, slots *all)
{
    const fsm_system *system = all->system;
    if (!join_slots(all) || !chain_slots(all))
        return false;
    self->variables = calloc(all->first[system->machine_count] + 1u, sizeof *self->variables);
    for (uint32_t i = 0; self->variables != NULL && i < system->machine_count; i++)
        for (uint32_t slot = 0; slot < system->machines[i]->shared_count; slot++)
            if (leader_of(all, all->first[i] + slot) == all->first[i] + slot && !split_off(self, all, i, slot))
                return false;
    return self->variables != NULL;
}

bool fsm_split_init(fsm_split *self, fsm_composition *composition, bool enabled)
{
    const fsm_system *system = composition->system;
    size_t largest = 1;
    slots all = {.system = system};
    *self = (fsm_split){.composition = composition};
    self->machines = calloc(system->machine_count, sizeof *self->machines);
    self->variable_of = calloc(system->machine_count, sizeof *self->variable_of);
    bool fine = self->machines != NULL && self->variable_of != NULL;
    for (uint32_t i = 0; fine && i < system->machine_count; i++) {
        self->machines[i].combinations = 1;
        largest = system->machines[i]->info->size > largest ? system->machines[i]->info->size : largest;
    }
    self->scratch = malloc(largest);
    fine = fine && self->scratch != NULL && (!enabled || find_variables(self, &all));
    free(all.first);
    free(all.leader);
    free(all.owner);
    free(all.next);
    if (!fine)
        fsm_split_free(self);
    return fine;
}

void fsm_split_free(fsm_split *self)
{
    for (uint32_t i = 0; self->machines != NULL && i < self->composition->system->machine_count; i++) {
        free(self->machines[i].variables);
        free(self->machines[i].slots);
        free(self->machines[i].bases);
        if (self->variable_of != NULL)
            free(self->variable_of[i]);
    }
    free(self->variables);
    free(self->machines);
    free(self->variable_of);
    free(self->scratch);
    fsm_hash_map_free(&self->wholes);
    *self = (fsm_split){0};
}

uint32_t fsm_most_levels(const fsm_system *system)
{
    uint32_t levels = system->machine_count;
    for (uint32_t i = 0; i < system->machine_count; i++)
        levels += system->machines[i]->shared_count + system->machines[i]->info->queue.room + 1u;
    return levels;
}

/* --- local states ----------------------------------------------------------------------------------------- */

uint32_t fsm_split_value(const fsm_split *self, uint32_t machine, uint32_t place, uint32_t combination)
{
    const fsm_split_machine *m = &self->machines[machine];
    for (uint32_t i = 0; i < place; i++)
        combination /= self->variables[m->variables[i]].count;
    return combination % self->variables[m->variables[place]].count;
}

static uint32_t value_at(const fsm_split *self, uint32_t machine, uint32_t slot, uint32_t count, uint32_t local)
{
    const fsm_composition *c = self->composition;
    const fsm_machine *m = c->system->machines[machine];
    fsm_value value = fsm_output(m, fsm_store_at(&c->locals[machine], local), m->info->output_count + slot);
    value -= m->shared_ranges[slot].least;
    return value < 0 || value >= count ? 0 : (uint32_t)value;
}

uint32_t fsm_split_value_of(const fsm_split *self, uint32_t variable, uint32_t holder_local)
{
    const fsm_shared *shared = &self->variables[variable];
    return value_at(self, shared->holder, shared->slot, shared->count, holder_local);
}

uint32_t fsm_split_combination(const fsm_split *self, uint32_t machine, uint32_t whole)
{
    const fsm_split_machine *m = &self->machines[machine];
    uint32_t combination = 0;
    for (uint32_t i = m->count; i-- > 0;) {
        uint32_t count = self->variables[m->variables[i]].count;
        combination = combination * count + value_at(self, machine, m->slots[i], count, whole);
    }
    return combination;
}

uint32_t fsm_split_whole(fsm_split *self, uint32_t machine, uint32_t base, uint32_t combination)
{
    fsm_composition *c = self->composition;
    const fsm_split_machine *m = &self->machines[machine];
    const fsm_machine *of = c->system->machines[machine];
    if (combination == 0)
        return base;
    uint64_t key = ((uint64_t)machine << BASE_BITS | base) * MOST_COMBINATIONS + combination;
    const uint64_t *known = fsm_hash_map_find(&self->wholes, key);
    if (known != NULL)
        return (uint32_t)*known;
    memcpy(self->scratch, fsm_store_at(&c->locals[machine], base), of->info->size);
    for (uint32_t i = 0; i < m->count; i++)
        fsm_put_input(of, self->scratch, of->info->input_count + m->slots[i],
                      of->shared_ranges[m->slots[i]].least + fsm_split_value(self, machine, i, combination));
    uint32_t whole = fsm_intern(c, machine, self->scratch);
    return whole == FSM_NONE || !fsm_hash_map_add(&self->wholes, key, whole) ? FSM_NONE : whole;
}

uint32_t fsm_split_base(fsm_split *self, uint32_t machine, uint32_t whole)
{
    fsm_split_machine *m = &self->machines[machine];
    fsm_composition *c = self->composition;
    const fsm_machine *of = c->system->machines[machine];
    if (m->count == 0)
        return whole;
    if (!FSM_HAS_PLACE(m->bases, m->base_room, whole, 64))
        return FSM_NONE;
    if (m->bases[whole] == 0) {
        memcpy(self->scratch, fsm_store_at(&c->locals[machine], whole), of->info->size);
        for (uint32_t i = 0; i < m->count; i++)
            fsm_put_input(of, self->scratch, of->info->input_count + m->slots[i], of->shared_ranges[m->slots[i]].least);
        uint32_t base = fsm_intern(c, machine, self->scratch);
        if (base == FSM_NONE)
            return FSM_NONE;
        m->bases[whole] = base + 1;
    }
    return m->bases[whole] - 1;
}

bool fsm_split_is_copy(const fsm_split *self, uint32_t message)
{
    const fsm_composition *c = self->composition;
    const fsm_message *what = fsm_store_at(&c->messages, message);
    const uint32_t *variable_of = self->variable_of[what->target];
    uint32_t inputs = c->system->machines[what->target]->info->input_count;
    return what->is_input && what->number >= inputs && variable_of != NULL && variable_of[what->number - inputs] != 0;
}
