#include "mpi/dictionary.h"
#include "store/room.h"

/* The kind of the next item on the wire; other numbers are nodes, counted from here. */
enum { STATE, FIRST_NODE };

bool fsm_dictionary_init(fsm_dictionary *self, fsm_composition *composition, uint32_t ranks, size_t memory)
{
    enum { LEAST = 1 << 10, MOST = 1 << 22 };
    fsm_tree *tree = composition->tree;
    size_t tables = (size_t)2 * ranks * (tree->node_count + 1u);
    *self = (fsm_dictionary){.composition = composition, .tree = tree, .ranks = ranks, .most = LEAST};
    while (self->most < MOST && tables * 2 * self->most * sizeof(uint32_t) <= memory / 4)
        self->most *= 2;
    self->peers = calloc(ranks, sizeof *self->peers);
    self->hashes = calloc(tree->node_count, sizeof *self->hashes);
    self->hashed = calloc(tree->node_count, sizeof *self->hashed);
    bool fine = self->peers != NULL && self->hashes != NULL && self->hashed != NULL;
    for (uint32_t i = 0; fine && i < ranks; i++) {
        self->peers[i].sent = calloc(tree->node_count + 1u, sizeof(fsm_places));
        self->peers[i].known = calloc(tree->node_count + 1u, sizeof(fsm_places));
        fine = self->peers[i].sent != NULL && self->peers[i].known != NULL;
    }
    return fine;
}

static void free_tables(fsm_places *tables, uint32_t count)
{
    for (uint32_t i = 0; tables != NULL && i < count; i++)
        free(tables[i].items);
    free(tables);
}

void fsm_dictionary_free(fsm_dictionary *self)
{
    uint32_t nodes = self->tree == NULL ? 0 : self->tree->node_count;
    for (uint32_t i = 0; self->peers != NULL && i < self->ranks; i++) {
        free_tables(self->peers[i].sent, nodes + 1u);
        free_tables(self->peers[i].known, nodes + 1u);
    }
    free(self->peers);
    free_tables(self->hashes, nodes);
    free(self->hashed);
    *self = (fsm_dictionary){0};
}

/* Grows a table to contain an index; new entries are 0. */
static bool make_place(fsm_dictionary *self, fsm_places *table, uint32_t place)
{
    uint32_t before = table->room;
    if (!FSM_HAS_PLACE(table->items, table->room, place, 64))
        return fsm_fail(self->composition, "out of memory");
    self->bytes += (table->room - before) * sizeof *table->items;
    return true;
}

/* --- whose a state is ------------------------------------------------------------------------------- */

static uint64_t stir(uint64_t h)
{
    h = (h ^ h >> 32) * 0xd6e8feb86659fd93u;
    h = (h ^ h >> 32) * 0xd6e8feb86659fd93u;
    return h ^ h >> 32;
}

static uint32_t hash_struct(const unsigned char *bytes, size_t size, uint32_t machine)
{
    uint64_t h = stir(machine + UINT64_C(1)), word;
    for (; size > 0; bytes += sizeof word) {
        size_t part = size < sizeof word ? size : sizeof word;
        word = 0;
        memcpy(&word, bytes, part);
        h = stir(h ^ word);
        size -= part;
    }
    return (uint32_t)h;
}

/* Hashes all states of a node. */
static bool hash_states(fsm_dictionary *self, const fsm_node *node)
{
    size_t index = (size_t)(node - self->tree->nodes);
    const fsm_places *hashes = &self->hashes[index];
    if (node->left != NULL && (!hash_states(self, node->left) || !hash_states(self, node->right)))
        return false;
    if (node->count == 0 || !make_place(self, &self->hashes[index], node->count - 1))
        return node->count == 0;
    for (uint32_t i = self->hashed[index]; i < node->count; i++) {
        const fsm_node_state *at = fsm_node_at(node, i);
        hashes->items[i] = node->left == NULL
            ? hash_struct(fsm_local(self->composition, node->first, at->left),
                          self->composition->system->machines[node->first]->info->size, node->first)
            : (uint32_t)stir(fsm_join(self->hashes[node->left - self->tree->nodes].items[at->left],
                                      self->hashes[node->right - self->tree->nodes].items[at->right]));
    }
    self->hashed[index] = node->count;
    return true;
}

static bool half_hash(fsm_dictionary *self, const fsm_node *node, uint32_t state, uint32_t *hash)
{
    size_t index = (size_t)(node - self->tree->nodes);
    if (state >= self->hashed[index] && !hash_states(self, node))
        return false;
    *hash = self->hashes[index].items[state];
    return true;
}

uint32_t fsm_dictionary_owner(fsm_dictionary *self, fsm_state state)
{
    uint32_t left, right = 0;
    if (!half_hash(self, self->tree->root_left, fsm_left(state), &left)
        || (self->tree->root_right != NULL && !half_hash(self, self->tree->root_right, fsm_right(state), &right)))
        return FSM_NONE;
    return (uint32_t)((stir(fsm_join(left, right)) >> 32) * self->ranks >> 32);
}

/* --- sending
 * --------------------------------------------------------------------------------------- */

/* Returns the slot for a number in a table, which may be empty. */
static uint32_t place_for(fsm_dictionary *self, fsm_places *table, uint32_t number)
{
    uint32_t place = number & (self->most - 1);
    return make_place(self, table, place) ? place : FSM_NONE;
}

static uint32_t send_half(fsm_dictionary *self, uint32_t peer, const fsm_node *node, uint32_t state, fsm_wire *wire)
{
    size_t index = (size_t)(node - self->tree->nodes);
    uint32_t place = place_for(self, &self->peers[peer].sent[index], state);
    uint32_t *held = place == FSM_NONE ? NULL : &self->peers[peer].sent[index].items[place];
    if (held == NULL || *held == state + 1)
        return place;
    const fsm_node_state *at = fsm_node_at(node, state);
    uint32_t left = 0, right = 0;
    if (node->left != NULL) {
        left = send_half(self, peer, node->left, at->left, wire);
        right = send_half(self, peer, node->right, at->right, wire);
        if (left == FSM_NONE || right == FSM_NONE)
            return FSM_NONE;
    }
    fsm_wire_number(wire, FIRST_NODE + index);
    fsm_wire_number(wire, place);
    if (node->left != NULL) {
        fsm_wire_number(wire, left);
        fsm_wire_number(wire, right);
    } else {
        fsm_wire_bytes(wire, fsm_local(self->composition, node->first, at->left),
                       self->composition->system->machines[node->first]->info->size);
    }
    *held = state + 1;
    return place;
}

bool fsm_dictionary_send(fsm_dictionary *self, uint32_t peer, fsm_state state, fsm_wire *wire)
{
    const fsm_tree *tree = self->tree;
    uint32_t left = send_half(self, peer, tree->root_left, fsm_left(state), wire);
    uint32_t right = tree->root_right == NULL ? 0 : send_half(self, peer, tree->root_right, fsm_right(state), wire);
    if (left == FSM_NONE || right == FSM_NONE)
        return false;
    fsm_wire_number(wire, STATE);
    fsm_wire_number(wire, left);
    fsm_wire_number(wire, right);
    return !wire->failed;
}

bool fsm_dictionary_send_footprint(fsm_dictionary *self, uint32_t peer, fsm_footprint_number number, fsm_wire *wire)
{
    fsm_places *sent = &self->peers[peer].sent[self->tree->node_count];
    if (!make_place(self, sent, number))
        return false;
    fsm_wire_number(wire, (uint64_t)number << 1 | (sent->items[number] == 0));
    if (sent->items[number] == 0)
        fsm_wire_bytes(wire, fsm_store_at(&self->tree->sleep.footprints, number), sizeof(fsm_footprint));
    sent->items[number] = 1;
    return !wire->failed;
}

/* --- receiving
 * ---------------------------------------------------------------------------------------- */

static uint32_t received(const fsm_places *table, fsm_unread *from)
{
    uint32_t place = fsm_read_small(from);
    if (place < table->room)
        return table->items[place];
    from->failed = true;
    return 0;
}

uint32_t fsm_read_local(fsm_composition *composition, uint32_t machine, fsm_unread *from)
{
    size_t size = composition->system->machines[machine]->info->size;
    const void *local = fsm_read_bytes(from, size);
    if (local == NULL)
        return FSM_NONE;
    memcpy(composition->after, local, size); /* where it is aligned */
    return fsm_intern(composition, machine, composition->after);
}

/* A half of a state, in a place of its table. */
static bool receive_half(fsm_dictionary *self, const fsm_peer *peer, size_t index, fsm_unread *from)
{
    if (index >= self->tree->node_count)
        return false;
    fsm_node *node = &self->tree->nodes[index];
    uint32_t place = fsm_read_small(from), number;
    if (node->left != NULL) {
        uint32_t left = received(&peer->known[node->left - self->tree->nodes], from);
        uint32_t right = received(&peer->known[node->right - self->tree->nodes], from);
        number = from->failed ? FSM_NONE : fsm_node_number(self->tree, node, left, right);
    } else {
        number = fsm_read_local(self->composition, node->first, from);
        number = number == FSM_NONE ? number : fsm_node_number(self->tree, node, number, 0);
    }
    if (number == FSM_NONE || place >= self->most || !make_place(self, &peer->known[index], place))
        return false;
    peer->known[index].items[place] = number;
    return true;
}

bool fsm_dictionary_receive(fsm_dictionary *self, uint32_t peer, fsm_unread *from, fsm_state *state)
{
    const fsm_tree *tree = self->tree;
    const fsm_peer *own = &self->peers[peer];
    uint64_t kind;
    while ((kind = fsm_read_number(from)) >= FIRST_NODE)
        if (!receive_half(self, own, (size_t)kind - FIRST_NODE, from))
            return false;
    if (kind != STATE)
        return false;
    uint32_t left = received(&own->known[tree->root_left - tree->nodes], from);
    uint32_t right = tree->root_right == NULL ? fsm_read_small(from) : received(&own->known[tree->root_right - tree->nodes], from);
    *state = fsm_join(left, right);
    return !from->failed;
}

bool fsm_dictionary_receive_footprint(fsm_dictionary *self, uint32_t peer, fsm_unread *from, fsm_footprint_number *number)
{
    fsm_places *known = &self->peers[peer].known[self->tree->node_count];
    uint32_t sent = fsm_read_small(from), place = sent >> 1;
    if (place >= FSM_MOST_FOOTPRINTS || !make_place(self, known, place))
        return false;
    if ((sent & 1) != 0) {
        fsm_footprint footprint;
        const void *bytes = fsm_read_bytes(from, sizeof footprint);
        if (bytes == NULL)
            return false;
        memcpy(&footprint, bytes, sizeof footprint);
        known->items[place] = fsm_sleep_sets_number(&self->tree->sleep, &footprint);
    }
    *number = (fsm_footprint_number)known->items[place];
    return known->items[place] != FSM_NONE && !from->failed;
}

/* --- without a table -------------------------------------------------------------------------------------- */

void fsm_write_state(const fsm_composition *composition, fsm_state state, fsm_wire *wire)
{
    uint32_t locals[FSM_MOST_MACHINES];
    fsm_tree_unfold(composition->tree, state, locals);
    for (uint32_t i = 0; i < composition->system->machine_count; i++)
        fsm_wire_bytes(wire, fsm_local(composition, i, locals[i]), composition->system->machines[i]->info->size);
}

fsm_state fsm_read_state(fsm_composition *composition, fsm_unread *from)
{
    uint32_t locals[FSM_MOST_MACHINES];
    for (uint32_t i = 0; i < composition->system->machine_count; i++) {
        locals[i] = fsm_read_local(composition, i, from);
        if (locals[i] == FSM_NONE)
            return FSM_NO_STATE;
    }
    return fsm_tree_fold(composition->tree, locals);
}
