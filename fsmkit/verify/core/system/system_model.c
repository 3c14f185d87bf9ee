#include "system/system_model.h"

#include "system/cyclic.h"
#include "system/flat.h"
#include "system/tree.h"

#include <stdlib.h>
#include <string.h>

static uint32_t marks_of(const fsm_machine *m)
{
    return FSM_NOTE_UNHANDLED + 2u * m->info->event_count + (m->covered > 0 ? m->covered + m->info->state_count : 0);
}

uint32_t fsm_first_mark(const fsm_system *system, uint32_t machine)
{
    uint32_t mark = 1 + system->property_count;
    for (uint32_t i = 0; i < machine; i++)
        mark += marks_of(system->machines[i]);
    return mark;
}

size_t fsm_composition_bytes(const fsm_composition *self)
{
    size_t bytes = sizeof *self + self->step_room * sizeof *self->steps
        + self->numbers.room * sizeof *self->numbers.items + fsm_store_bytes(&self->messages)
        + fsm_hash_map_bytes(&self->deliveries);
    for (uint32_t i = 0; i < self->system->machine_count; i++)
        bytes += fsm_store_bytes(&self->locals[i]) + fsm_store_bytes(&self->configurations[i])
            + self->info_room[i] * sizeof *self->infos[i];
    return bytes + (self->tree == NULL ? 0 : fsm_tree_bytes(self->tree));
}

/* --- properties that are evaluated at steps --------------------------------------------------- */

static bool has_mark(const fsm_tree *tree, uint32_t set, uint32_t mark)
{
    uint32_t count;
    const uint32_t *marks = fsm_lists_at(&tree->marks, set, &count);
    for (uint32_t i = 0; i < count; i++)
        if (marks[i] == mark)
            return true;
    return false;
}

/* Marks a step for the properties that are evaluated by what occurs in it and the state after it. */
static bool evaluate_step(fsm_composition *self, fsm_step *step)
{
    const fsm_system *system = self->system;
    const void *structs[FSM_MOST_MACHINES];
    uint32_t locals[FSM_MOST_MACHINES];
    bool *occurs = malloc(system->observed_count * sizeof *occurs);
    if (occurs == NULL)
        return fsm_fail(self, "out of memory");
    fsm_tree_unfold(self->tree, step->to, locals);
    for (uint32_t i = 0; i < system->machine_count; i++)
        structs[i] = fsm_local(self, i, locals[i]);
    for (uint32_t i = 0; i < system->observed_count; i++) {
        fsm_observed_event observed = system->observed[i];
        uint32_t first = self->first_marks[observed.machine] + FSM_NOTE_UNHANDLED;
        occurs[i] = has_mark(self->tree, step->marks, first + system->machines[observed.machine]->info->event_count + observed.event);
    }
    for (uint32_t p = 0; p < system->property_count && step->marks != FSM_NONE; p++) {
        if (system->evaluate_step(structs, occurs, p))
            step->marks = fsm_tree_add_mark(self->tree, step->marks, 1 + p);
    }
    free(occurs);
    return step->marks != FSM_NONE || fsm_fail(self, "out of memory");
}

static bool evaluate_steps(fsm_composition *self, fsm_steps *steps, size_t first)
{
    for (size_t i = first; i < steps->count; i++)
        if (!evaluate_step(self, &steps->items[i]))
            return false;
    return true;
}

/* --- initial states ------------------------------------------------------------------------------ */

/* The receiver of initial states; `wanted` is the ordinal of one to describe, or FSM_NONE. */
typedef struct {
    fsm_composition *composition;
    fsm_steps *steps;
    uint32_t wanted;
    fsm_described_start *described;
} starts;

static bool add_start(void *context, const fsm_start *start)
{
    starts *self = context;
    fsm_composition *c = self->composition;
    uint32_t marks = fsm_lists_number(&c->tree->marks, start->marks, start->mark_count);
    fsm_state state = fsm_tree_fold(c->tree, start->locals);
    bool is_requested = self->steps->count == self->wanted;
    if (state == FSM_NO_STATE || marks == FSM_NONE
        || !fsm_steps_add(self->steps, state, marks, FSM_STEP_ENVIRONMENT))
        return fsm_fail(c, "out of memory");
    if (c->system->observed_count > 0 && !evaluate_steps(c, self->steps, self->steps->count - 1))
        return false;
    for (uint32_t i = 0; is_requested && i < c->system->machine_count; i++) {
        fsm_description *what = &self->described->what[i];
        *what = start->what[i];
        memcpy(self->described->choices[i], what->choices, what->choice_count * sizeof *what->choices);
        what->choices = self->described->choices[i];
    }
    return true;
}

static bool initial(void *context, fsm_steps *steps)
{
    starts self = {context, steps, FSM_NONE, NULL};
    return fsm_start_all(context, add_start, &self);
}

bool fsm_describe_start(fsm_composition *self, uint32_t ordinal, fsm_described_start *described, fsm_state *to)
{
    fsm_steps steps = {0};
    starts all = {self, &steps, ordinal, described};
    bool found = fsm_start_all(self, add_start, &all) && ordinal < steps.count;
    if (found)
        *to = steps.items[ordinal].to;
    free(steps.items);
    return found;
}

/* --- steps ------------------------------------------------------------------------------------- */

/* The parts a state's steps are made of, in the order of their ordinals. */
typedef struct {
    const fsm_moves *left, *right;
    fsm_part part;
} moves_of_both;

/* Whether states of nodes are more than soon are all in the caches. */
static bool is_worth_fetching(const fsm_tree *tree)
{
    enum { CACHED = 2 << 20 };
    return tree->root_right != NULL && __atomic_load_n(&tree->node_bytes, __ATOMIC_RELAXED) > CACHED;
}

static void fetch_first(const void *context, fsm_state state)
{
    const fsm_tree *tree = ((const fsm_composition *)context)->tree;
    if (!is_worth_fetching(tree))
        return;
    __builtin_prefetch(fsm_node_at(tree->root_left, fsm_left(state)));
    __builtin_prefetch(fsm_node_at(tree->root_right, fsm_right(state)));
}

static void fetch_moves(const fsm_node *node, uint32_t state)
{
    const fsm_node_state *at = fsm_node_at(node, state);
    for (fsm_part part = FSM_OWN; part <= FSM_OPEN; part++) {
        const char *moves = (const char *)__atomic_load_n(&at->moves[part], __ATOMIC_ACQUIRE);
        if (moves == NULL)
            continue;
        __builtin_prefetch(moves);
        __builtin_prefetch(moves + FSM_CACHE_LINE);
    }
}

static void fetch_next(const void *context, fsm_state state)
{
    const fsm_tree *tree = ((const fsm_composition *)context)->tree;
    if (!is_worth_fetching(tree))
        return;
    fetch_moves(tree->root_left, fsm_left(state));
    fetch_moves(tree->root_right, fsm_right(state));
}

static bool part_moves(fsm_tree *tree, uint32_t thread, fsm_state state, fsm_part part, moves_of_both *found)
{
    static const fsm_moves none = {0};
    found->part = part;
    found->left = fsm_node_moves(tree, thread, tree->root_left, fsm_left(state), part);
    found->right = tree->root_right == NULL ? &none
                                            : fsm_node_moves(tree, thread, tree->root_right, fsm_right(state), part);
    return found->left != NULL && found->right != NULL;
}

/* The observations of both halves, and the enabled steps. */
static fsm_summary look(const fsm_tree *tree, fsm_state state)
{
    fsm_summary left = fsm_node_at(tree->root_left, fsm_left(state))->summary;
    if (tree->root_right == NULL)
        return left;
    const fsm_summary *right = &fsm_node_at(tree->root_right, fsm_right(state))->summary;
    left.waiting += right->waiting;
    left.awaited += right->awaited;
    left.ticking = left.ticking || right->ticking;
    left.first = left.first < right->first ? left.first : right->first;
    left.faulted = left.faulted || right->faulted;
    left.at_rest = left.at_rest && right->at_rest;
    return left;
}

/* The steps of one half that are taken, as if the other one, in the state `other_state`, got nothing of them; what it gets
 * is left for later. */
static bool add_steps(fsm_tree *tree, const fsm_moves *moves, const fsm_node *other, uint32_t other_state, bool of_left,
                      fsm_steps *steps)
{
    const uint64_t *sleeping = fsm_sleep_sets_row(&tree->sleep, steps->found_by);
    bool fetches = is_worth_fetching(tree);
    for (uint32_t i = 0; i < moves->count; i++) {
        const fsm_move *move = &moves->items[i];
        if (fsm_sleeps(sleeping, move->footprint)) {
            fsm_steps_leave_out(steps, move->kind);
            continue;
        }
        fsm_state to = of_left ? fsm_join(move->to, other_state) : fsm_join(other_state, move->to);
        if (!fsm_steps_append(steps, to, move->marks, move->footprint, move->kind))
            return fsm_fail(tree->composition, "out of memory");
        steps->items[steps->count - 1].sent = move->sent;
        steps->items[steps->count - 1].of_left = of_left;
        if (fetches && move->sent != 0)
            fsm_hash_map_fetch(&other->delivered, fsm_join(other_state, move->sent));
    }
    return true;
}

static bool add_both(fsm_tree *tree, fsm_state state, const moves_of_both *moves, fsm_steps *steps)
{
    return add_steps(tree, moves->left, tree->root_right, fsm_right(state), true, steps)
        && add_steps(tree, moves->right, tree->root_left, fsm_left(state), false, steps);
}

/* Delivers to the other half what it gets of a step. */
static bool deliver_step(fsm_tree *tree, fsm_state state, fsm_step *step)
{
    uint32_t other = step->of_left ? fsm_right(state) : fsm_left(state);
    uint64_t reached = fsm_node_deliver(tree, step->of_left ? tree->root_right : tree->root_left, other, step->sent);
    if (reached == UINT64_MAX)
        return false;
    step->to = step->of_left ? fsm_join(fsm_left(step->to), fsm_left(reached)) : fsm_join(fsm_left(reached), fsm_right(step->to));
    step->marks = fsm_tree_join_marks(tree, step->marks, fsm_right(reached));
    return step->marks != FSM_NONE || fsm_fail(tree->composition, "out of memory");
}

static bool pass_time(fsm_tree *tree, fsm_state state, fsm_steps *steps)
{
    uint32_t left = fsm_node_elapse(tree, tree->root_left, fsm_left(state));
    uint32_t right = tree->root_right == NULL ? 0 : fsm_node_elapse(tree, tree->root_right, fsm_right(state));
    if (left == FSM_NONE || right == FSM_NONE)
        return false;
    return fsm_steps_add(steps, fsm_join(left, right), 0, FSM_STEP_TIME)
        || fsm_fail(tree->composition, "out of memory");
}

static bool successors_in_turn(fsm_composition *self, fsm_state state, fsm_steps *steps)
{
    fsm_turn turn;
    return fsm_turn_find(self, steps->thread, state, &turn) && fsm_turn_steps(self, &turn, steps);
}

static bool successors(void *context, fsm_state state, fsm_steps *steps)
{
    fsm_composition *c = context;
    fsm_tree *tree = c->tree;
    if (fsm_is_ordered(c->system))
        return successors_in_turn(c, state, steps);
    if (c->system->observed_count > 0)
        steps->found_by = 0; /* each step is evaluated, with the state that it leads to */
    fsm_summary seen = look(tree, state);
    bool is_open = seen.first == FSM_OWN && seen.waiting <= c->system->max_pending_before_input;
    moves_of_both own, open = {0};
    if (!part_moves(tree, steps->thread, state, seen.first, &own)
        || (is_open && !part_moves(tree, steps->thread, state, FSM_OPEN, &open)))
        return false;
    bool busy = own.left->busy || own.right->busy;
    if (!add_both(tree, state, &own, steps) || (is_open && !add_both(tree, state, &open, steps)))
        return false;
    bool fair = own.left->fair || own.right->fair || (is_open && (open.left->fair || open.right->fair));
    steps->deadlock = !c->system->open && seen.waiting == 0 && seen.awaited == 0 && !seen.faulted
        && !busy && !fair && !seen.at_rest;
    return busy || !seen.ticking || c->system->unit == 0 || pass_time(tree, state, steps);
}

static bool finish(void *context, fsm_state state, fsm_steps *steps)
{
    fsm_composition *c = context;
    for (size_t i = 0; i < steps->count; i++)
        if (steps->items[i].sent != 0 && !deliver_step(c->tree, state, &steps->items[i]))
            return false;
    return c->system->observed_count == 0 || evaluate_steps(c, steps, 0);
}

/* Describes a step of a state with very many steps. */
static bool describe(fsm_composition *self, fsm_state state, uint32_t ordinal, fsm_description *what)
{
    fsm_tree *tree = self->tree;
    if (fsm_is_ordered(self->system)) {
        fsm_turn turn;
        return fsm_turn_find(self, 0, state, &turn) && fsm_turn_describe(self, &turn, ordinal, what);
    }
    fsm_summary seen = look(tree, state);
    fsm_part parts[2] = {seen.first, FSM_OPEN};
    for (int i = 0; i < 2; i++) {
        moves_of_both moves;
        if (i == 1 && (seen.first != FSM_OWN || seen.waiting > self->system->max_pending_before_input))
            break;
        if (!part_moves(tree, 0, state, parts[i], &moves))
            return false;
        uint32_t left = moves.left->count, right = moves.right->count;
        if (ordinal < left + right) {
            *what = ordinal < left
                ? fsm_node_describe(tree, tree->root_left, fsm_left(state), parts[i], ordinal)
                : fsm_node_describe(tree, tree->root_right, fsm_right(state), parts[i], ordinal - left);
            return true;
        }
        ordinal -= left + right;
    }
    *what = (fsm_description){.action = FSM_DO_ELAPSE};
    return true;
}

bool fsm_describe_step(fsm_composition *self, fsm_state state, uint32_t ordinal, fsm_description *what,
                       fsm_state *to)
{
    fsm_steps steps = {0};
    bool fine = fsm_successors(&self->model, state, &steps) && ordinal < steps.count;
    if (fine)
        *to = steps.items[ordinal].to;
    free(steps.items);
    return fine && describe(self, state, ordinal, what);
}

/* --- what is fair ------------------------------------------------------------------------------- */

/* Actions: the own steps of each machine; the passing of time; external events; untimed: each timer. */
static uint32_t first_timer(const fsm_system *system, uint32_t machine)
{
    uint32_t first = system->machine_count + 1 + system->possible_count;
    for (uint32_t i = 0; i < machine; i++)
        first += fsm_timer_names(system->machines[i]);
    return first;
}

/* An event that may carry several payloads is one action. */
static uint32_t action_of_possible(const fsm_system *system, uint32_t number)
{
    const fsm_possible *what = &system->possible[number];
    uint32_t first = 0;
    if (!what->fair || (what->spontaneous && !system->machines[what->machine]->environment))
        return FSM_NONE;
    while (system->possible[first].machine != what->machine || system->possible[first].event != what->event
           || system->possible[first].fair != what->fair)
        first++;
    return system->machine_count + 1 + first;
}

uint32_t fsm_owed_action(const fsm_composition *self, fsm_kind kind, fsm_description what)
{
    const fsm_system *system = self->system;
    const fsm_machine *m = system->machines[what.machine];
    if (what.action == FSM_DO_ELAPSE)
        return system->machine_count;
    if (what.action == FSM_DO_OCCUR)
        return action_of_possible(system, what.argument);
    if (kind == FSM_STEP_INTERNAL)
        return what.machine;
    if (what.action != FSM_DO_FIRE || kind != FSM_STEP_TIME || !m->untimed)
        return FSM_NONE;
    const void *before = fsm_store_at(&self->locals[what.machine], what.before);
    return first_timer(system, what.machine) + fsm_timer_name(m, before, what.argument);
}

static bool fair(void *context, fsm_state state, const fsm_steps *steps, uint32_t *actions)
{
    fsm_composition *self = context;
    for (size_t i = 0; i < steps->count; i++) {
        fsm_description what;
        if (!describe(self, state, (uint32_t)i, &what))
            return false;
        actions[i] = fsm_owed_action(self, steps->items[i].kind, what);
    }
    return true;
}

/* Between its turns a machine has timers that are fair, too: an order of turns puts nothing off for ever. */
static void armed(void *context, fsm_state state, unsigned char *actions)
{
    fsm_composition *self = context;
    uint32_t locals[FSM_MOST_MACHINES];
    fsm_hold holds[FSM_MOST_MACHINES];
    fsm_tree_unfold(self->tree, state, locals);
    fsm_turn_holds(self, locals, holds);
    for (uint32_t i = 0; i < self->system->machine_count; i++) {
        const fsm_machine *m = self->system->machines[i];
        if (!self->system->ordered[i] || holds[i] != FSM_HOLD_NONE)
            continue;
        for (uint32_t timer = 0; timer < fsm_info(self, i, locals[i])->view.armed; timer++) {
            uint32_t name = fsm_timer_name(m, fsm_store_at(&self->locals[i], locals[i]), timer);
            if (name != FSM_NONE)
                actions[first_timer(self->system, i) + name] = 1;
        }
    }
}

/* --- what is seen of a state --------------------------------------------------------------------- */

static uint32_t evaluate(fsm_composition *c, uint64_t key, fsm_state state)
{
    fsm_tree *tree = c->tree;
    uint32_t locals[FSM_MOST_MACHINES], set = 0;
    fsm_lock_take(c->lock);
    fsm_tree_unfold(tree, state, locals);
    for (uint32_t p = 0; set != FSM_NONE && p < c->system->property_count; p++)
        if (fsm_flat_evaluate(c, locals, p))
            set = fsm_tree_add_mark(tree, set, 1 + p);
    if (set == FSM_NONE || !fsm_hash_map_add(&tree->evaluated, key, set)) {
        (void)fsm_fail(c, "out of memory");
        set = FSM_NONE;
    }
    fsm_lock_leave(c->lock);
    return set;
}

/* Properties see of a state only its aspects: they are evaluated once for each pair of these. */
static uint32_t marks(void *context, fsm_state state)
{
    fsm_composition *c = context;
    fsm_tree *tree = c->tree;
    if (c->system->property_count == 0)
        return 0;
    uint32_t right = tree->root_right == NULL ? 0 : fsm_node_at(tree->root_right, fsm_right(state))->aspect;
    uint64_t key = fsm_join(fsm_node_at(tree->root_left, fsm_left(state))->aspect, right);
    const uint64_t *known = fsm_hash_map_find(&tree->evaluated, key);
    if (known != NULL)
        return (uint32_t)*known;
    return evaluate(c, key, state);
}

static const uint32_t *mark_set(void *context, uint32_t set, uint32_t *count)
{
    const fsm_composition *c = context;
    return fsm_lists_at(&c->tree->marks, set, count);
}

static uint32_t configuration(void *context, fsm_state state)
{
    const fsm_composition *c = context;
    uint32_t locals[FSM_MOST_MACHINES];
    fsm_tree_unfold(c->tree, state, locals);
    return fsm_flat_configuration(c, locals);
}

static bool at_rest(void *context, fsm_state state)
{
    const fsm_composition *c = context;
    uint32_t locals[FSM_MOST_MACHINES];
    fsm_tree_unfold(c->tree, state, locals);
    return fsm_flat_at_rest(c, locals);
}

static size_t memory(void *context)
{
    const fsm_composition *c = context;
    fsm_tree_tidy(c->tree);
    return fsm_composition_bytes(c);
}

static const char *failure(void *context)
{
    const fsm_composition *c = context;
    return __atomic_load_n(&c->failure, __ATOMIC_ACQUIRE);
}

/* --- making one ------------------------------------------------------------------------------- */

/* Sorts what belongs to machines by them. */
static bool find_wires(fsm_composition *self)
{
    const fsm_system *system = self->system;
    uint32_t count = 0;
    self->of_machine =
        malloc(((size_t)system->event_link_count + system->input_link_count + system->possible_count + 1) * sizeof *self->of_machine);
    if (self->of_machine == NULL)
        return false;
    uint32_t *firsts[] = {self->first_event_link, self->first_input_link, self->first_possible};
    const uint32_t counts[] = {system->event_link_count, system->input_link_count, system->possible_count};
    for (int kind = 0; kind < 3; kind++) {
        uint32_t *first = firsts[kind], start = count;
        for (uint32_t i = 0; i < counts[kind]; i++) {
            uint32_t owner = kind == 0 ? system->event_links[i].source : kind == 1 ? system->input_links[i].source : system->possible[i].machine;
            first[owner + 1]++;
        }
        for (uint32_t i = 0; i < system->machine_count; i++)
            first[i + 1] += first[i];
        for (uint32_t i = counts[kind]; i-- > 0;) { /* backwards, so that each position is reached by counting down */
            uint32_t owner = kind == 0 ? system->event_links[i].source : kind == 1 ? system->input_links[i].source : system->possible[i].machine;
            self->of_machine[start + --first[owner + 1]] = i;
        }
        count += counts[kind];
        for (uint32_t i = 0; i < system->machine_count; i++) /* now each is where its own ones start */
            first[i] = start + first[i + 1];
        first[system->machine_count] = count;
    }
    return true;
}

static bool init_machine(fsm_composition *self, uint32_t machine)
{
    const fsm_machine *m = self->system->machines[machine];
    fsm_prepare(m);
    self->states_seen[machine] = calloc(m->info->state_count + 1, 1);
    self->transitions_seen[machine] = calloc(m->info->transition_count + 1, 1);
    return fsm_store_init(&self->locals[machine], m->info->size)
        && fsm_store_init(&self->configurations[machine], fsm_configuration_size(m))
        && self->states_seen[machine] != NULL && self->transitions_seen[machine] != NULL;
}

fsm_composition *fsm_compose(const fsm_system *system, size_t memory_limit)
{
    fsm_composition *self = calloc(1, sizeof *self);
    if (self == NULL)
        return NULL;
    self->system = system;
    self->memory_limit = memory_limit;
    size_t largest = 1, widest = 1;
    uint32_t count = system->machine_count;
    bool fine = fsm_store_init(&self->messages, sizeof(fsm_message));
    for (uint32_t i = 0; i < count; i++) {
        fine = init_machine(self, i) && fine;
        const fsm_machine *m = system->machines[i];
        size_t width = fsm_configuration_size(m);
        largest = m->info->size > largest ? m->info->size : largest;
        widest = width > widest ? width : widest;
    }
    for (uint32_t i = 0, mark = fsm_first_mark(system, 0); i < count; i++) {
        self->first_marks[i] = mark;
        mark += marks_of(system->machines[i]);
    }
    fine = find_wires(self) && fine;
    self->lock = fsm_lock_make();
    self->before = malloc(largest);
    self->after = malloc(largest);
    self->shown = malloc(widest);
    self->model = (fsm_model){
        .abi = FSM_MODEL_ABI, .mark_count = fsm_first_mark(system, count), .self = self,
        .action_count = first_timer(system, count),
        .initial = initial, .successors = successors, .finish = finish,
        .fetch_first = fetch_first, .fetch_next = fetch_next, .marks = marks, .mark_set = mark_set,
        .configuration = configuration, .at_rest = at_rest, .fair = fair,
        .armed = system->untimed && system->turn != NULL ? armed : NULL, .memory = memory, .failure = failure};
    self->tree = fine && self->lock != NULL ? fsm_tree_make(self) : NULL;
    if (self->tree != NULL && self->before != NULL && self->after != NULL && self->shown != NULL)
        return self;
    fsm_composition_free(self);
    return NULL;
}

void fsm_composition_free(fsm_composition *self)
{
    if (self == NULL)
        return;
    fsm_tree_free(self->tree);
    for (uint32_t i = 0; i < self->system->machine_count; i++) {
        fsm_store_free(&self->locals[i]);
        fsm_store_free(&self->configurations[i]);
        free(self->infos[i]);
        free(self->states_seen[i]);
        free(self->transitions_seen[i]);
    }
    free(self->steps);
    free(self->of_machine);
    free(self->numbers.items);
    fsm_store_free(&self->messages);
    fsm_hash_map_free(&self->deliveries);
    free(self->before);
    free(self->shown);
    free(self->after);
    fsm_lock_free(self->lock);
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
