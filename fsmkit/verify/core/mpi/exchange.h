/* exchange.h: batches of messages between ranks, in phases. Messages for a peer are sent once they fill a batch, or at the
 * end of the phase; what comes is handed on meanwhile. A phase ends in all ranks at once, when all has come. */
#ifndef FSM_EXCHANGE_H
#define FSM_EXCHANGE_H

#include "mpi/wire.h"

#include <mpi.h>

/* Reads one item of a peer. False: the search is over, for a reason that it notes itself. */
typedef bool fsm_take_item(void *context, uint32_t peer, fsm_unread *from);

typedef struct {
    fsm_wire writing, sending;
    MPI_Request request; /* of the messages being sent */
} fsm_mail;

typedef struct {
    uint32_t rank, ranks, ended; /* peers of which all has come in this phase */
    fsm_mail *mail;   /* by peer */
    fsm_wire incoming;
    uint64_t sent;    /* bytes in all, and batches */
    uint64_t batches;
    fsm_take_item *take;
    void *context;
    bool failed;      /* memory ran out, or an item was not taken; what still comes is let go */
} fsm_exchange;

bool fsm_exchange_init(fsm_exchange *self);
void fsm_exchange_free(fsm_exchange *self);

void fsm_exchange_start(fsm_exchange *self, fsm_take_item *take, void *context);

/* Returns the buffer for an item to a peer; call `fsm_exchange_wrote` after each item. */
static inline fsm_wire *fsm_exchange_to(fsm_exchange *self, uint32_t peer)
{
    fsm_wire *wire = &self->mail[peer].writing;
    if (wire->count == 0)
        fsm_wire_number(wire, 0); /* room for the kind of the batch */
    return wire;
}
void fsm_exchange_wrote(fsm_exchange *self, uint32_t peer);

/* Hands on what has come; to be called now and then. */
void fsm_exchange_look(fsm_exchange *self);

/* Waits for all. False if it failed, here. */
bool fsm_exchange_end(fsm_exchange *self);

size_t fsm_exchange_bytes(const fsm_exchange *self);

#endif
