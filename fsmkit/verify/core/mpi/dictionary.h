/* dictionary.h: the encoding of states of the system for another rank.
 *
 * Each rank numbers local states, and the states of groups (tree.h), in the order of their
 * discovery. The identity of a state, independent of these numbers, is the structs of its
 * machines: their hash determines the rank that owns it. A rank sends each half of it as an
 * index of a table that it keeps for each peer and each node of the tree. A half without an
 * index is sent before: for a group the indices of its children, for a machine the struct
 * itself. So a state is two small numbers, and each struct is sent to each peer about once. The
 * tables are of limited size, and an index may be reused later: messages are decoded in the
 * order in which they were sent, so both sides agree at each moment. Footprints (sleep_sets.h)
 * are sent in the same manner. */
#ifndef FSM_DICTIONARY_H
#define FSM_DICTIONARY_H

#include "mpi/wire.h"
#include "system/tree.h"

/* The entry at each index; the number of entries is a power of two, or 0. */
typedef struct {
    uint32_t *items;
    uint32_t room;
} fsm_places;

/* By node of the tree, footprints last: our numbers plus one in the order sent; and our numbers
 * for theirs. */
typedef struct {
    fsm_places *sent, *known;
} fsm_peer;

typedef struct {
    fsm_composition *composition;
    fsm_tree *tree;
    uint32_t ranks, most; /* places of a table */
    fsm_peer *peers;
    fsm_places *hashes; /* by node, of its states */
    uint32_t *hashed;   /* by node, how many have theirs */
    size_t bytes;
} fsm_dictionary;

/* False if memory ran out. At most a quarter of `memory` bytes are used for tables. */
bool fsm_dictionary_init(fsm_dictionary *self, fsm_composition *composition, uint32_t ranks, size_t memory);
void fsm_dictionary_free(fsm_dictionary *self);

/* Returns the rank that owns a state, equal in every rank. FSM_NONE if memory ran out. */
uint32_t fsm_dictionary_owner(fsm_dictionary *self, fsm_state state);

/* Writes a state for a peer, or a footprint. False if memory ran out. */
bool fsm_dictionary_send(fsm_dictionary *self, uint32_t peer, fsm_state state, fsm_wire *wire);
bool fsm_dictionary_send_footprint(fsm_dictionary *self, uint32_t peer, fsm_footprint_number number, fsm_wire *wire);

/* Reads what a peer wrote, up to and with the next state or footprint. False if memory ran out, or it cannot be read. */
bool fsm_dictionary_receive(fsm_dictionary *self, uint32_t peer, fsm_unread *from, fsm_state *state);
bool fsm_dictionary_receive_footprint(fsm_dictionary *self, uint32_t peer, fsm_unread *from, fsm_footprint_number *number);

/* Writes and reads a state whole, without a table. FSM_NO_STATE if memory ran out, or it cannot be read. */
void fsm_write_state(const fsm_composition *composition, fsm_state state, fsm_wire *wire);
fsm_state fsm_read_state(fsm_composition *composition, fsm_unread *from);

/* Reads the struct of a machine and returns its number; FSM_NONE if memory ran out, or without a
 * struct. */
uint32_t fsm_read_local(fsm_composition *composition, uint32_t machine, fsm_unread *from);

#endif
