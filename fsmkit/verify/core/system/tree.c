#include "system/tree.h"

#include <stdlib.h>
#include <string.h>

static bool out_of_memory(fsm_tree *self)
{
    return fsm_fail(self->composition, "out of memory");
}

/* --- making one --------------------------------------------------------------------------------- */

static fsm_node *make_node(fsm_tree *self, uint32_t first, uint32_t last)
{
    fsm_node *node = &self->nodes[self->node_count++];
    *node = (fsm_node){.first = first, .last = last};
    if (last - first > 1) {
        uint32_t middle = first + (last - first) / 2;
        node->left = make_node(self, first, middle);
        node->right = make_node(self, middle, last);
    }
    return node;
}

fsm_tree *fsm_tree_make(fsm_composition *composition)
{
    const fsm_system *system = composition->system;
    fsm_tree *self = calloc(1, sizeof *self);
    if (self == NULL)
        return NULL;
    self->composition = composition;
    self->most_kept = composition->memory_limit / 3;
    self->nodes = calloc(2 * (size_t)system->machine_count, sizeof *self->nodes);
    bool fine = self->nodes != NULL && fsm_lists_init(&self->messages) && fsm_lists_init(&self->marks)
        && fsm_sleep_sets_init(&self->sleep);
    if (fine) {
        uint32_t count = system->machine_count, middle = count / 2;
        self->root_left = make_node(self, 0, count > 1 ? middle : count);
        self->root_right = count > 1 ? make_node(self, middle, count) : NULL;
        for (uint32_t i = 0; i < self->node_count; i++) {
            const fsm_node *node = &self->nodes[i];
            if (node->left == NULL)
                fine = fine && fsm_store_init(&self->nodes[i].seen, system->seen_sizes[node->first] + 1);
        }
    }
    size_t largest = 0;
    for (uint32_t i = 0; i < system->machine_count; i++)
        largest = system->seen_sizes[i] > largest ? system->seen_sizes[i] : largest;
    self->seen = malloc(largest + 1);
    if (fine && self->seen != NULL)
        return self;
    fsm_tree_free(self);
    return NULL;
}

static void free_pairs(fsm_pairs *pairs)
{
    while (pairs != NULL) {
        fsm_pairs *older = pairs->older;
        free(pairs);
        pairs = older;
    }
}

static void free_node(fsm_node *node)
{
    fsm_segmented_array_free(&node->states);
    free_pairs(node->pairs);
    fsm_hash_map_free(&node->delivered);
    fsm_hash_map_free(&node->aspects);
    fsm_store_free(&node->seen);
}

void fsm_tree_free(fsm_tree *self)
{
    if (self == NULL)
        return;
    for (uint32_t thread = 0; thread < FSM_MOST_WORKERS; thread++) {
        for (uint32_t i = 0; self->scratch[thread] != NULL && i < self->node_count * FSM_PARTS; i++)
            free(self->scratch[thread][i]);
        free(self->scratch[thread]);
    }
    for (uint32_t i = 0; i < self->node_count; i++)
        free_node(&self->nodes[i]);
    free(self->nodes);
    fsm_arena_free(&self->moves);
    fsm_lists_free(&self->messages);
    fsm_lists_free(&self->marks);
    fsm_sleep_sets_free(&self->sleep);
    fsm_hash_map_free(&self->evaluated);
    free(self->buffer);
    free(self->seen);
    free(self);
}

static size_t pairs_bytes(uint32_t capacity)
{
    return sizeof(fsm_pairs) + capacity * sizeof(uint32_t);
}

void fsm_tree_tidy(fsm_tree *self)
{
    fsm_hash_map_tidy(&self->evaluated);
    for (uint32_t i = 0; i < self->node_count; i++) {
        fsm_node *node = &self->nodes[i];
        self->kept -= fsm_hash_map_bytes(&node->delivered);
        fsm_hash_map_tidy(&node->delivered);
        self->kept += fsm_hash_map_bytes(&node->delivered);
        fsm_hash_map_tidy(&node->aspects);
        for (const fsm_pairs *older = node->pairs == NULL ? NULL : node->pairs->older; older != NULL; older = older->older)
            self->node_bytes -= pairs_bytes(older->capacity);
        if (node->pairs != NULL) {
            free_pairs(node->pairs->older);
            node->pairs->older = NULL;
        }
    }
}

size_t fsm_tree_bytes(const fsm_tree *self)
{
    size_t bytes = __atomic_load_n(&self->kept, __ATOMIC_RELAXED) + self->node_bytes
        + fsm_lists_bytes(&self->messages) + fsm_lists_bytes(&self->marks) + fsm_hash_map_bytes(&self->evaluated)
        + fsm_sleep_sets_bytes(&self->sleep);
    for (uint32_t i = 0; i < self->node_count; i++)
        bytes += fsm_hash_map_bytes(&self->nodes[i].aspects);
    return bytes;
}

static bool is_room_for(const fsm_tree *self, size_t bytes)
{
    return __atomic_load_n(&self->kept, __ATOMIC_RELAXED) + bytes <= self->most_kept;
}

/* --- lists ------------------------------------------------------------------------------------- */

static bool make_buffer(fsm_tree *self, size_t count)
{
    if (count <= self->buffer_room)
        return true;
    uint32_t *buffer = realloc(self->buffer, 2 * count * sizeof *buffer);
    if (buffer == NULL)
        return out_of_memory(self);
    self->buffer = buffer;
    self->buffer_room = 2 * count;
    return true;
}

static uint32_t join_new_marks(fsm_tree *self, uint32_t a, uint32_t b)
{
    uint32_t count, more;
    const uint32_t *first = fsm_lists_at(&self->marks, a, &count), *second = fsm_lists_at(&self->marks, b, &more);
    uint32_t known = count;
    if (!make_buffer(self, (size_t)count + more))
        return FSM_NONE;
    memcpy(self->buffer, first, count * sizeof *first);
    for (uint32_t i = 0; i < more; i++) {
        uint32_t at = 0;
        while (at < known && first[at] != second[i])
            at++;
        if (at == known)
            self->buffer[count++] = second[i];
    }
    return fsm_lists_number(&self->marks, self->buffer, count);
}

uint32_t fsm_tree_join_some_marks(fsm_tree *self, uint32_t a, uint32_t b)
{
    fsm_lock_take(self->composition->lock);
    uint32_t joined = join_new_marks(self, a, b);
    fsm_lock_leave(self->composition->lock);
    return joined;
}

uint32_t fsm_tree_add_mark(fsm_tree *self, uint32_t marks, uint32_t mark)
{
    fsm_lock_take(self->composition->lock);
    uint32_t one = fsm_lists_number(&self->marks, &mark, 1);
    uint32_t joined = one == FSM_NONE || marks == FSM_NONE ? FSM_NONE : fsm_tree_join_marks(self, marks, one);
    fsm_lock_leave(self->composition->lock);
    return joined;
}

static bool is_inside(const fsm_tree *self, const fsm_node *node, uint32_t message)
{
    uint32_t target = ((const fsm_message *)fsm_store_at(&self->composition->messages, message))->target;
    return target >= node->first && target < node->last;
}

static uint32_t pick_some_messages(fsm_tree *self, const fsm_node *node, uint32_t list, bool inside)
{
    uint32_t count, picked = 0;
    const uint32_t *items = fsm_lists_at(&self->messages, list, &count);
    if (!make_buffer(self, count))
        return FSM_NONE;
    for (uint32_t i = 0; i < count; i++)
        if (is_inside(self, node, items[i]) == inside)
            self->buffer[picked++] = items[i];
    return fsm_lists_number(&self->messages, self->buffer, picked);
}

/* The part of a list of messages that goes to machines in a node, or the one that does not. */
static uint32_t pick_messages(fsm_tree *self, const fsm_node *node, uint32_t list, bool inside)
{
    uint32_t count, picked = 0;
    const uint32_t *items = fsm_lists_at(&self->messages, list, &count);
    for (uint32_t i = 0; i < count; i++)
        picked += is_inside(self, node, items[i]) == inside;
    if (picked == 0 || picked == count)
        return picked == 0 ? 0 : list;
    fsm_lock_take(self->composition->lock);
    uint32_t found = pick_some_messages(self, node, list, inside);
    fsm_lock_leave(self->composition->lock);
    return found;
}

/* --- states of nodes ------------------------------------------------------------------------------ */

static fsm_node_state *new_state(fsm_tree *self, fsm_node *node)
{
    if (!fsm_segmented_array_make_room(&node->states, node->count, sizeof(fsm_node_state)))
        return NULL;
    (void)__atomic_fetch_add(&self->node_bytes, sizeof(fsm_node_state), __ATOMIC_RELAXED);
    return fsm_node_at(node, node->count++);
}

/* Takes over local states that the machine has got since. */
static bool adopt(fsm_tree *self, fsm_node *node, uint32_t local)
{
    fsm_composition *c = self->composition;
    const fsm_machine *m = c->system->machines[node->first];
    fsm_part first = m->monitor ? FSM_WATCHES : m->environment ? FSM_ANSWERS : FSM_OWN;
    while (node->count <= local) {
        uint32_t number = node->count;
        fsm_node_state *state = new_state(self, node);
        if (state == NULL)
            return out_of_memory(self);
        memset(self->seen, 0, c->system->seen_sizes[node->first] + 1);
        c->system->see(node->first, fsm_store_at(&c->locals[node->first], number), self->seen);
        fsm_view view = fsm_info(c, node->first, number)->view;
        *state = (fsm_node_state){.left = number, .elapsed = FSM_NONE};
        state->aspect = fsm_store_insert(&node->seen, self->seen, SIZE_MAX, NULL);
        state->summary = (fsm_summary){view.waiting, m->monitor ? 0 : view.awaited,
                                       (unsigned char)(view.waiting > 0 ? first : FSM_OWN), view.awaited > 0, view.faulted,
                                       view.at_rest};
        if (state->aspect == FSM_NONE)
            return out_of_memory(self);
    }
    return true;
}

/* The slot of a pair, or the empty one where it belongs; and what it holds. */
static uint32_t *pair_slot(const fsm_node *node, fsm_pairs *pairs, uint32_t left, uint32_t right, uint32_t *held)
{
    uint64_t h = (fsm_join(left, right) ^ (uint64_t)left << 7) * 0x9e3779b97f4a7c15u;
    uint32_t slot = (uint32_t)(h >> 32) & (pairs->capacity - 1);
    for (;; slot = (slot + 1) & (pairs->capacity - 1)) {
        *held = __atomic_load_n(&pairs->slots[slot], __ATOMIC_ACQUIRE);
        if (*held == 0)
            break;
        const fsm_node_state *at = fsm_node_at(node, *held - 1);
        if (at->left == left && at->right == right)
            break;
    }
    return &pairs->slots[slot];
}

static bool grow_pairs(fsm_tree *self, fsm_node *node)
{
    uint32_t capacity = node->pairs == NULL ? 256 : 2 * node->pairs->capacity, held;
    fsm_pairs *pairs = capacity == 0 ? NULL : calloc(1, pairs_bytes(capacity));
    if (pairs == NULL)
        return out_of_memory(self);
    fsm_region_advise(pairs, pairs_bytes(capacity));
    pairs->capacity = capacity;
    pairs->older = node->pairs;
    (void)__atomic_fetch_add(&self->node_bytes, pairs_bytes(capacity), __ATOMIC_RELAXED);
    for (uint32_t i = 0; i < node->count; i++)
        *pair_slot(node, pairs, fsm_node_at(node, i)->left, fsm_node_at(node, i)->right, &held) = i + 1;
    __atomic_store_n(&node->pairs, pairs, __ATOMIC_RELEASE);
    return true;
}

static uint32_t aspect_of(fsm_tree *self, fsm_node *node, uint32_t left, uint32_t right)
{
    uint64_t key = fsm_join(fsm_node_at(node->left, left)->aspect, fsm_node_at(node->right, right)->aspect);
    const uint64_t *known = fsm_hash_map_find(&node->aspects, key);
    if (known != NULL)
        return (uint32_t)*known;
    if (!fsm_hash_map_add(&node->aspects, key, node->aspect_count)) {
        (void)out_of_memory(self);
        return FSM_NONE;
    }
    return node->aspect_count++;
}

static fsm_summary both(fsm_summary a, fsm_summary b)
{
    return (fsm_summary){a.waiting + b.waiting, a.awaited + b.awaited, a.first < b.first ? a.first : b.first,
                         a.ticking || b.ticking, a.faulted || b.faulted, a.at_rest && b.at_rest};
}

/* Number of a group's state, by who has the lock. */
static uint32_t intern_new(fsm_tree *self, fsm_node *node, uint32_t left, uint32_t right)
{
    if ((node->pairs == NULL || 2 * (uint64_t)node->count >= node->pairs->capacity) && !grow_pairs(self, node))
        return FSM_NONE;
    uint32_t held, *slot = pair_slot(node, node->pairs, left, right, &held);
    if (held != 0)
        return held - 1;
    uint32_t aspect = aspect_of(self, node, left, right);
    fsm_node_state *state = aspect == FSM_NONE ? NULL : new_state(self, node);
    if (state == NULL) {
        (void)out_of_memory(self);
        return FSM_NONE;
    }
    *state = (fsm_node_state){.left = left, .right = right, .elapsed = FSM_NONE, .aspect = aspect};
    state->summary = both(fsm_node_at(node->left, left)->summary, fsm_node_at(node->right, right)->summary);
    __atomic_store_n(slot, node->count, __ATOMIC_RELEASE);
    return node->count - 1;
}

/* Number of a group's state; FSM_NONE if memory ran out. */
static uint32_t intern(fsm_tree *self, fsm_node *node, uint32_t left, uint32_t right)
{
    fsm_pairs *pairs = __atomic_load_n(&node->pairs, __ATOMIC_ACQUIRE);
    uint32_t held = 0;
    if (pairs != NULL)
        (void)pair_slot(node, pairs, left, right, &held);
    if (held != 0)
        return held - 1;
    fsm_lock_take(self->composition->lock);
    uint32_t number = intern_new(self, node, left, right);
    fsm_lock_leave(self->composition->lock);
    return number;
}

uint32_t fsm_node_number(fsm_tree *self, fsm_node *node, uint32_t left, uint32_t right)
{
    if (node->left == NULL)
        return adopt(self, node, left) ? left : FSM_NONE; /* where there are no threads */
    return intern(self, node, left, right);
}

static uint32_t fold(fsm_tree *self, fsm_node *node, const uint32_t *locals)
{
    if (node->left == NULL)
        return fsm_node_number(self, node, locals[node->first], 0);
    uint32_t left = fold(self, node->left, locals), right = fold(self, node->right, locals);
    return left == FSM_NONE || right == FSM_NONE ? FSM_NONE : intern(self, node, left, right);
}

fsm_state fsm_tree_fold(fsm_tree *self, const uint32_t *locals)
{
    uint32_t left = fold(self, self->root_left, locals);
    uint32_t right = self->root_right == NULL ? 0 : fold(self, self->root_right, locals);
    return left == FSM_NONE || right == FSM_NONE ? FSM_NO_STATE : fsm_join(left, right);
}

static void unfold(const fsm_node *node, uint32_t state, uint32_t *locals)
{
    const fsm_node_state *at = fsm_node_at(node, state);
    if (node->left == NULL) {
        locals[node->first] = at->left;
        return;
    }
    unfold(node->left, at->left, locals);
    unfold(node->right, at->right, locals);
}

void fsm_tree_unfold(const fsm_tree *self, fsm_state state, uint32_t *locals)
{
    unfold(self->root_left, fsm_left(state), locals);
    if (self->root_right != NULL)
        unfold(self->root_right, fsm_right(state), locals);
}

/* --- messages ------------------------------------------------------------------------------------ */

static uint64_t deliver_to_machine(fsm_tree *self, fsm_node *node, uint32_t state, uint32_t messages)
{
    fsm_composition *c = self->composition;
    uint32_t count;
    bool any_full = false;
    const uint32_t *items = fsm_lists_at(&self->messages, messages, &count);
    for (uint32_t i = 0; i < count; i++) {
        if (!is_inside(self, node, items[i]))
            continue;
        bool full;
        state = fsm_deliver(c, state, items[i], &full);
        if (state == FSM_NONE)
            return UINT64_MAX;
        any_full = any_full || full;
    }
    uint32_t mark = c->first_marks[node->first] + FSM_NOTE_FULL;
    uint32_t marks = any_full ? fsm_tree_add_mark(self, 0, mark) : 0;
    return marks == FSM_NONE || !adopt(self, node, state) ? UINT64_MAX : fsm_join(state, marks);
}

static uint64_t deliver_to_group(fsm_tree *self, fsm_node *node, uint32_t state, uint32_t messages)
{
    const fsm_node_state *at = fsm_node_at(node, state);
    uint64_t left = fsm_node_deliver(self, node->left, at->left, messages);
    uint64_t right = fsm_node_deliver(self, node->right, at->right, messages);
    if (left == UINT64_MAX || right == UINT64_MAX)
        return UINT64_MAX;
    uint32_t to = intern(self, node, fsm_left(left), fsm_left(right));
    uint32_t marks = fsm_tree_join_marks(self, fsm_right(left), fsm_right(right));
    return to == FSM_NONE || marks == FSM_NONE ? UINT64_MAX : fsm_join(to, marks);
}

uint64_t fsm_node_find_delivered(fsm_tree *self, fsm_node *node, uint32_t state, uint32_t messages)
{
    uint64_t key = fsm_join(state, messages);
    uint32_t own = pick_messages(self, node, messages, true);
    if (own == FSM_NONE)
        return UINT64_MAX;
    uint64_t result = own == 0            ? fsm_join(state, 0)
        : own != messages                 ? fsm_node_deliver(self, node, state, own)
        : node->left != NULL              ? deliver_to_group(self, node, state, messages)
                                          : UINT64_MAX;
    bool to_machine = own == messages && node->left == NULL;
    if (!to_machine && (result == UINT64_MAX || !is_room_for(self, 0)))
        return result;
    fsm_lock_take(self->composition->lock);
    if (to_machine)
        result = deliver_to_machine(self, node, state, messages);
    size_t before = fsm_hash_map_bytes(&node->delivered);
    if (result != UINT64_MAX && !fsm_hash_map_add(&node->delivered, key, result)) {
        (void)out_of_memory(self);
        result = UINT64_MAX;
    }
    (void)__atomic_fetch_add(&self->kept, fsm_hash_map_bytes(&node->delivered) - before, __ATOMIC_RELAXED);
    fsm_lock_leave(self->composition->lock);
    return result;
}

static uint32_t elapse_machine(fsm_tree *self, fsm_node *node, uint32_t local)
{
    fsm_lock_take(self->composition->lock);
    uint32_t to = fsm_elapse(self->composition, node->first, local);
    bool fine = to != FSM_NONE && adopt(self, node, to);
    fsm_lock_leave(self->composition->lock);
    return fine ? to : FSM_NONE;
}

uint32_t fsm_node_elapse(fsm_tree *self, fsm_node *node, uint32_t state)
{
    fsm_node_state *at = fsm_node_at(node, state);
    uint32_t to = __atomic_load_n(&at->elapsed, __ATOMIC_ACQUIRE);
    if (to != FSM_NONE)
        return to;
    if (node->left == NULL) {
        to = elapse_machine(self, node, at->left);
    } else {
        uint32_t left = fsm_node_elapse(self, node->left, at->left);
        uint32_t right = fsm_node_elapse(self, node->right, at->right);
        to = left == FSM_NONE || right == FSM_NONE ? FSM_NONE : intern(self, node, left, right);
    }
    __atomic_store_n(&at->elapsed, to, __ATOMIC_RELEASE);
    return to;
}

/* --- steps ------------------------------------------------------------------------------------- */

static bool add_move(fsm_tree *self, fsm_moves **moves, fsm_move move)
{
    fsm_moves *list = *moves;
    if (list->count == list->room) {
        uint32_t room = 2 * list->room;
        list = realloc(list, sizeof *list + room * sizeof list->items[0]);
        if (list == NULL)
            return out_of_memory(self);
        list->room = room;
        *moves = list;
    }
    list->items[list->count++] = move;
    list->busy = list->busy || move.kind == FSM_STEP_INTERNAL;
    return true;
}

/* The bit of an input of a machine. */
static uint64_t bit_of_input(const fsm_system *system, const fsm_message *message)
{
    uint32_t link = 0;
    while (system->input_links[link].target != message->target || system->input_links[link].input != message->number)
        link++;
    return UINT64_C(1) << link % 64;
}

/* Number of the footprint of a step of a machine; FSM_NONE if memory ran out. */
static uint32_t footprint_of(fsm_tree *self, const fsm_node *node, uint32_t state, fsm_part part,
                             const fsm_local_step *step)
{
    const fsm_composition *c = self->composition;
    const fsm_machine *const *machines = c->system->machines;
    uint32_t before = fsm_info(c, node->first, state)->view.waiting;
    uint32_t after = fsm_info(c, node->first, step->next)->view.waiting;
    fsm_footprint found = {.moved = UINT64_C(1) << node->first % 64, .mover = node->first,
                           .part = (unsigned char)part, .takes = after < before, .sends = after > before};
    found.calls = machines[node->first]->environment && part >= FSM_OWN && after > 0;
    for (uint32_t i = 0; i < step->message_count; i++) {
        const fsm_message *message = fsm_store_at(&c->messages, c->numbers.items[step->messages + i]);
        uint64_t target = UINT64_C(1) << message->target % 64;
        if (message->is_input && !machines[message->target]->monitor) { /* monitors may have an event of it */
            found.receivers |= target;
            found.inputs |= bit_of_input(c->system, message);
        } else {
            found.moved |= target;
            found.sends = true;
            found.calls = found.calls || machines[message->target]->environment;
        }
    }
    return fsm_sleep_sets_number(&self->sleep, &found);
}

/* A step of a machine, which receives its own events immediately. */
static bool machine_move(fsm_tree *self, fsm_node *node, uint32_t state, fsm_part part, const fsm_local_step *step,
                         fsm_move *move)
{
    fsm_composition *c = self->composition;
    const uint32_t *numbers = c->numbers.items;
    uint32_t first = c->first_marks[node->first];
    if (!make_buffer(self, step->note_count) || !adopt(self, node, step->next))
        return false;
    for (uint32_t i = 0; i < step->note_count; i++)
        self->buffer[i] = first + numbers[step->notes + i];
    uint32_t marks = fsm_lists_number(&self->marks, self->buffer, step->note_count);
    uint32_t sent = fsm_lists_number(&self->messages, numbers + step->messages, step->message_count);
    uint32_t footprint = footprint_of(self, node, state, part, step);
    if (marks == FSM_NONE || sent == FSM_NONE || footprint == FSM_NONE)
        return out_of_memory(self);
    uint64_t to = fsm_node_deliver(self, node, step->next, sent);
    if (to == UINT64_MAX)
        return false;
    *move = (fsm_move){fsm_left(to), pick_messages(self, node, sent, false),
                       fsm_tree_join_marks(self, marks, fsm_right(to)), (fsm_footprint_number)footprint,
                       (unsigned char)step->kind};
    return (move->sent != FSM_NONE && move->marks != FSM_NONE) || out_of_memory(self);
}

static bool run_machine(fsm_tree *self, fsm_node *node, uint32_t state, fsm_part part, fsm_moves **moves)
{
    fsm_composition *c = self->composition;
    bool known = c->know != NULL ? c->know(c, node->first, state, part == FSM_OPEN)
        : part == FSM_OPEN       ? fsm_know_open(c, node->first, state)
                                 : fsm_know(c, node->first, state);
    if (!known)
        return false;
    fsm_local_info info = *fsm_info(c, node->first, state);
    uint32_t first = part == FSM_OPEN ? info.open : info.own;
    uint32_t count = part == FSM_OPEN ? info.open_count : info.own_count;
    (*moves)->fair = info.fair;
    for (uint32_t i = first; i < first + count; i++) {
        fsm_local_step step = c->steps[i];
        fsm_move move;
        if (!machine_move(self, node, state, part, &step, &move) || !add_move(self, moves, move))
            return false;
    }
    return true;
}

static bool machine_moves(fsm_tree *self, fsm_node *node, uint32_t state, fsm_part part, fsm_moves **moves)
{
    if (part < FSM_OWN && fsm_node_at(node, state)->summary.first != part)
        return true;
    fsm_lock_take(self->composition->lock);
    bool fine = run_machine(self, node, state, part, moves);
    fsm_lock_leave(self->composition->lock);
    return fine;
}

/* The steps of one child of a group, with what they send to the other. */
static bool child_moves(fsm_tree *self, uint32_t thread, fsm_node *node, uint32_t state, fsm_part part,
                        bool is_left, fsm_moves **moves)
{
    const fsm_node_state *at = fsm_node_at(node, state);
    fsm_node *child = is_left ? node->left : node->right, *other = is_left ? node->right : node->left;
    uint32_t other_state = is_left ? at->right : at->left;
    const fsm_moves *steps = fsm_node_moves(self, thread, child, is_left ? at->left : at->right, part);
    if (steps == NULL)
        return false;
    (*moves)->fair = (*moves)->fair || steps->fair;
    for (uint32_t i = 0; i < steps->count; i++) {
        fsm_move move = steps->items[i];
        uint64_t reached = fsm_node_deliver(self, other, other_state, move.sent);
        if (reached == UINT64_MAX)
            return false;
        uint32_t left = is_left ? move.to : fsm_left(reached), right = is_left ? fsm_left(reached) : move.to;
        move.to = intern(self, node, left, right);
        move.sent = move.sent == 0 ? 0 : pick_messages(self, other, move.sent, false);
        move.marks = fsm_tree_join_marks(self, move.marks, fsm_right(reached));
        if (move.to == FSM_NONE || move.sent == FSM_NONE || move.marks == FSM_NONE)
            return out_of_memory(self);
        if (!add_move(self, moves, move))
            return false;
    }
    return true;
}

/* Empty room for the steps of a node, of a thread. */
static fsm_moves **clear_scratch(fsm_tree *self, uint32_t thread, const fsm_node *node, fsm_part part)
{
    enum { FIRST_ROOM = 16 };
    if (self->scratch[thread] == NULL)
        self->scratch[thread] = calloc((size_t)self->node_count * FSM_PARTS, sizeof *self->scratch[thread]);
    if (self->scratch[thread] == NULL)
        return NULL;
    fsm_moves **moves = &self->scratch[thread][(size_t)(node - self->nodes) * FSM_PARTS + part];
    if (*moves == NULL) {
        *moves = malloc(sizeof **moves + FIRST_ROOM * sizeof(*moves)->items[0]);
        if (*moves == NULL)
            return NULL;
        (*moves)->room = FIRST_ROOM;
    }
    (*moves)->count = 0;
    (*moves)->busy = (*moves)->fair = false;
    return moves;
}

/* Keeps a copy of steps while memory for that lasts; of machines, which are few, always. */
static const fsm_moves *keep(fsm_tree *self, const fsm_node *node, uint32_t state, fsm_part part,
                             const fsm_moves *moves)
{
    size_t bytes = sizeof *moves + moves->count * sizeof moves->items[0], used = 0;
    fsm_moves **place = &fsm_node_at(node, state)->moves[part];
    if (node->left != NULL && !is_room_for(self, bytes))
        return moves;
    fsm_lock_take(self->composition->lock);
    fsm_moves *kept = *place; /* another thread may have found them out meanwhile */
    if (kept == NULL && (kept = fsm_arena_take(&self->moves, bytes, &used)) != NULL) {
        memcpy(kept, moves, bytes);
        kept->room = kept->count;
        (void)__atomic_fetch_add(&self->kept, used, __ATOMIC_RELAXED);
        __atomic_store_n(place, kept, __ATOMIC_RELEASE);
    }
    fsm_lock_leave(self->composition->lock);
    return kept != NULL ? kept : moves;
}

const fsm_moves *fsm_node_find_moves(fsm_tree *self, uint32_t thread, fsm_node *node, uint32_t state, fsm_part part)
{
    fsm_moves **moves = clear_scratch(self, thread, node, part);
    if (moves == NULL) {
        (void)out_of_memory(self);
        return NULL;
    }
    if (node->left == NULL ? !machine_moves(self, node, state, part, moves)
                           : !child_moves(self, thread, node, state, part, true, moves)
                || !child_moves(self, thread, node, state, part, false, moves))
        return NULL;
    return keep(self, node, state, part, *moves);
}

fsm_description fsm_node_describe(fsm_tree *self, fsm_node *node, uint32_t state, fsm_part part, uint32_t number)
{
    const fsm_composition *c = self->composition;
    while (node->left != NULL) {
        const fsm_node_state *at = fsm_node_at(node, state);
        const fsm_moves *left = fsm_node_moves(self, 0, node->left, at->left, part);
        bool is_left = left != NULL && number < left->count;
        number -= is_left || left == NULL ? 0 : left->count;
        node = is_left ? node->left : node->right;
        state = is_left ? at->left : at->right;
    }
    const fsm_local_info *info = fsm_info(c, node->first, state);
    const fsm_local_step *step = &c->steps[(part == FSM_OPEN ? info->open : info->own) + number];
    return (fsm_description){step->action, node->first, step->argument, state,
                             c->numbers.items + step->choices, step->choice_count};
}
