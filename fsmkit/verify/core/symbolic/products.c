#include "symbolic/symbolic.h"
#include "store/room.h"

#include <stdlib.h>
#include <string.h>

/* The steps of a machine for all values of its shared data, put together to few events. Steps that lead to the same local state and
 * send the same form a set of changes of the variables, from some values to others. This is divided into products: of each
 * variable a set of pairs, before and after. What a step neither reads nor changes goes from each value to itself, so
 * the event does not touch it. */

typedef struct {
    uint32_t class, next, sent; /* local state, and list of messages */
    uint32_t label;             /* fsm_symbolic_label */
    uint32_t before, after; /* combinations of values */
} effect;

typedef struct {
    fsm_symbolic *symbolic;
    uint32_t machine, base;
    const fsm_split_machine *split;
    effect *effects;
    uint32_t count, room;
    uint32_t *products; /* of each variable a list of pairs */
    uint32_t product_count;
    uint32_t *joined;   /* room for a list */
} dividing;

static bool no_memory(dividing *self)
{
    fsm_symbolic_stop(self->symbolic, FSM_OUT_OF_MEMORY);
    return false;
}

static bool add_effect(dividing *self, effect what)
{
    if (!FSM_HAS_ROOM(self->effects, self->count, self->room, 64))
        return no_memory(self);
    self->effects[self->count++] = what;
    return true;
}

static bool add_steps(dividing *self, uint32_t whole, uint32_t combination, fsm_class class, uint32_t first, uint32_t count)
{
    fsm_symbolic *s = self->symbolic;
    for (uint32_t n = first; n < first + count; n++) {
        const fsm_local_step step = s->composition->steps[n];
        uint32_t length = 0, next;
        if (!fsm_symbolic_make_room(s, (size_t)step.message_count + 1)
            || !fsm_symbolic_sort_messages(s, self->machine, &step, &length, &next)) {
            fsm_symbolic_stop(s, FSM_MODEL_FAILED);
            return false;
        }
        bool is_still = next == whole && length == 0 && step.kind != FSM_STEP_INTERNAL;
        if (is_still && !s->keeps_actions)
            continue;
        effect what = {(uint32_t)class, fsm_split_base(&s->split, self->machine, next),
                       fsm_lists_number(&s->sent, s->buffer, length),
                       fsm_symbolic_label(s, self->machine, whole, &step, is_still), combination,
                       fsm_split_combination(&s->split, self->machine, next)};
        if (what.next == FSM_NONE || what.sent == FSM_NONE)
            return no_memory(self);
        if (!add_effect(self, what))
            return false;
    }
    return true;
}

static bool find_effects(dividing *self)
{
    fsm_symbolic *s = self->symbolic;
    for (uint32_t combination = 0; combination < self->split->combinations; combination++) {
        uint32_t whole = fsm_split_whole(&s->split, self->machine, self->base, combination);
        if (whole == FSM_NONE || !fsm_knowledge_find(s->knowledge, self->machine, whole, false)
            || !fsm_knowledge_find(s->knowledge, self->machine, whole, true)) {
            fsm_symbolic_stop(s, FSM_MODEL_FAILED);
            return false;
        }
        const fsm_local_info info = *fsm_info(s->composition, self->machine, whole);
        if (!add_steps(self, whole, combination, fsm_symbolic_class(s, self->machine, whole), info.own, info.own_count)
            || !add_steps(self, whole, combination, FSM_CLASS_OPEN, info.open, info.open_count))
            return false;
    }
    return true;
}

static int by_effect(const void *a, const void *b)
{
    const effect *x = a, *y = b;
    if (x->class != y->class)
        return (x->class > y->class) - (x->class < y->class);
    if (x->next != y->next)
        return (x->next > y->next) - (x->next < y->next);
    if (x->sent != y->sent)
        return (x->sent > y->sent) - (x->sent < y->sent);
    if (x->label != y->label)
        return (x->label > y->label) - (x->label < y->label);
    if (x->before != y->before)
        return (x->before > y->before) - (x->before < y->before);
    return (x->after > y->after) - (x->after < y->after);
}

static uint32_t *pairs_of(const dividing *self, uint32_t product)
{
    return self->products + (size_t)product * self->split->count;
}

static int by_number(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

/* All pairs of two lists. */
static uint32_t join(dividing *self, uint32_t a, uint32_t b)
{
    uint32_t count, more, kept = 0;
    const uint32_t *first = fsm_lists_at(&self->symbolic->pairs, a, &count);
    const uint32_t *second = fsm_lists_at(&self->symbolic->pairs, b, &more);
    memcpy(self->joined, first, count * sizeof *first);
    memcpy(self->joined + count, second, more * sizeof *second);
    qsort(self->joined, (size_t)count + more, sizeof *self->joined, by_number);
    for (uint32_t i = 0; i < count + more; i++)
        if (i == 0 || self->joined[i] != self->joined[kept - 1])
            self->joined[kept++] = self->joined[i];
    return fsm_lists_number(&self->symbolic->pairs, self->joined, kept);
}

static bool differ_only_at(const dividing *self, uint32_t a, uint32_t b, uint32_t place)
{
    for (uint32_t i = 0; i < self->split->count; i++)
        if (i != place && pairs_of(self, a)[i] != pairs_of(self, b)[i])
            return false;
    return true;
}

/* Joins products that differ at one variable only; whether some did. */
static bool join_at(dividing *self, uint32_t place, bool *changed)
{
    size_t bytes = self->split->count * sizeof *self->products;
    for (uint32_t a = 0; a < self->product_count; a++)
        for (uint32_t b = a + 1; b < self->product_count;) {
            if (!differ_only_at(self, a, b, place)) {
                b++;
                continue;
            }
            uint32_t joined = join(self, pairs_of(self, a)[place], pairs_of(self, b)[place]);
            if (joined == FSM_NONE)
                return no_memory(self);
            pairs_of(self, a)[place] = joined;
            memmove(pairs_of(self, b), pairs_of(self, --self->product_count), bytes);
            *changed = true;
        }
    return true;
}

/* Whether a variable goes from each value to itself. */
static bool is_untouched(const dividing *self, uint32_t place, uint32_t list)
{
    uint32_t count, values = self->symbolic->split.variables[self->split->variables[place]].count;
    const uint32_t *pairs = fsm_lists_at(&self->symbolic->pairs, list, &count);
    bool same = count == values;
    for (uint32_t i = 0; same && i < count; i++)
        same = pairs[i] == i * values + i;
    return same;
}

static bool make_event(dividing *self, const effect *what, const uint32_t *pairs)
{
    fsm_symbolic *s = self->symbolic;
    uint32_t count, length = FSM_KEY_HEAD;
    const uint32_t *messages = fsm_lists_at(&s->sent, what->sent, &count);
    if (!fsm_symbolic_make_room(s, FSM_KEY_HEAD + 2u * (size_t)self->split->count + count))
        return false;
    fsm_symbolic_start_key(s, self->machine, (fsm_class)what->class, 0, 0, what->label);
    for (uint32_t place = 0; place < self->split->count; place++) {
        if (is_untouched(self, place, pairs[place]))
            continue;
        s->buffer[2]++;
        s->buffer[length++] = self->split->variables[place];
        s->buffer[length++] = pairs[place];
    }
    memcpy(s->buffer + length, messages, count * sizeof *messages);
    fsm_event *event = fsm_symbolic_event(s, s->buffer, length + count);
    return event != NULL && fsm_symbolic_add_to_row(s, event, self->base, what->next);
}

/* Divides what leads to one local state and sends the same. */
static bool divide(dividing *self, const effect *effects, uint32_t count)
{
    fsm_symbolic *s = self->symbolic;
    bool changed = true;
    self->product_count = 0;
    for (uint32_t i = 0; i < count; i++) {
        if (i > 0 && by_effect(&effects[i], &effects[i - 1]) == 0)
            continue;
        for (uint32_t place = 0; place < self->split->count; place++) {
            uint32_t values = s->split.variables[self->split->variables[place]].count;
            uint32_t pair = fsm_split_value(&s->split, self->machine, place, effects[i].before) * values
                + fsm_split_value(&s->split, self->machine, place, effects[i].after);
            pairs_of(self, self->product_count)[place] = fsm_lists_number(&s->pairs, &pair, 1);
            if (pairs_of(self, self->product_count)[place] == FSM_NONE)
                return no_memory(self);
        }
        self->product_count++;
    }
    while (changed) {
        changed = false;
        for (uint32_t place = 0; place < self->split->count; place++)
            if (!join_at(self, place, &changed))
                return false;
    }
    for (uint32_t i = 0; i < self->product_count; i++)
        if (!make_event(self, effects, pairs_of(self, i)))
            return false;
    return true;
}

bool fsm_symbolic_add_split(fsm_symbolic *symbolic, uint32_t machine, uint32_t base)
{
    dividing self = {.symbolic = symbolic, .machine = machine, .base = base, .split = &symbolic->split.machines[machine]};
    uint32_t pairs = 1;
    for (uint32_t i = 0; i < self.split->count; i++) {
        uint32_t values = symbolic->split.variables[self.split->variables[i]].count;
        pairs = values * values > pairs ? values * values : pairs;
    }
    bool fine = find_effects(&self);
    self.products = malloc(((size_t)self.count + 1) * self.split->count * sizeof *self.products);
    self.joined = malloc(2u * (size_t)pairs * sizeof *self.joined);
    fine = fine && ((self.products != NULL && self.joined != NULL) || no_memory(&self));
    if (fine && self.count > 0)
        qsort(self.effects, self.count, sizeof *self.effects, by_effect);
    for (uint32_t first = 0, end; fine && first < self.count; first = end) {
        const effect *at = &self.effects[first];
        for (end = first; end < self.count && self.effects[end].class == at->class && self.effects[end].next == at->next
             && self.effects[end].sent == at->sent && self.effects[end].label == at->label; end++)
            ;
        fine = divide(&self, at, end - first);
    }
    free(self.effects);
    free(self.products);
    free(self.joined);
    return fine;
}
