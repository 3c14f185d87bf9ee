#include "mpi/exchange.h"

enum { BATCH = 1 << 15, TAG = 1, MORE = 0, LAST = 1 }; /* bytes; the first byte of a batch says whether it is the last */

bool fsm_exchange_init(fsm_exchange *self)
{
    int rank, ranks;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    *self = (fsm_exchange){.rank = (uint32_t)rank, .ranks = (uint32_t)ranks, .mail = calloc((size_t)ranks, sizeof *self->mail)};
    for (int i = 0; self->mail != NULL && i < ranks; i++)
        self->mail[i].request = MPI_REQUEST_NULL;
    return self->mail != NULL;
}

void fsm_exchange_free(fsm_exchange *self)
{
    for (uint32_t i = 0; self->mail != NULL && i < self->ranks; i++) {
        fsm_wire_free(&self->mail[i].writing);
        fsm_wire_free(&self->mail[i].sending);
    }
    free(self->mail);
    fsm_wire_free(&self->incoming);
    *self = (fsm_exchange){0};
}

size_t fsm_exchange_bytes(const fsm_exchange *self)
{
    size_t bytes = self->incoming.room;
    for (uint32_t i = 0; i < self->ranks; i++)
        bytes += self->mail[i].writing.room + self->mail[i].sending.room;
    return bytes;
}

void fsm_exchange_start(fsm_exchange *self, fsm_take_item *take, void *context)
{
    self->take = take;
    self->context = context;
    self->ended = 1; /* ourselves */
    self->failed = false;
}

static void take_batch(fsm_exchange *self, const MPI_Status *status)
{
    int count;
    MPI_Get_count(status, MPI_BYTE, &count);
    self->incoming.count = 0;
    if (!fsm_wire_make_room(&self->incoming, (size_t)count))
        MPI_Abort(MPI_COMM_WORLD, 1); /* not even to throw it away */
    MPI_Recv(self->incoming.bytes, count, MPI_BYTE, status->MPI_SOURCE, TAG, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    fsm_unread from = {self->incoming.bytes + 1, self->incoming.bytes + count, false};
    self->ended += self->incoming.bytes[0] == LAST;
    while (!self->failed && from.at < from.end)
        self->failed = !self->take(self->context, (uint32_t)status->MPI_SOURCE, &from);
}

void fsm_exchange_look(fsm_exchange *self)
{
    for (int there = self->ranks > 1; there;) {
        MPI_Status status;
        MPI_Iprobe(MPI_ANY_SOURCE, TAG, MPI_COMM_WORLD, &there, &status);
        if (there)
            take_batch(self, &status);
    }
}

/* Sends the written batch after the previous one is complete. Meanwhile it receives batches, so that no two ranks wait
 * for each other. */
static void post(fsm_exchange *self, uint32_t peer, unsigned char kind)
{
    fsm_mail *mail = &self->mail[peer];
    for (int gone = 0; !gone;) {
        MPI_Test(&mail->request, &gone, MPI_STATUS_IGNORE);
        if (!gone)
            fsm_exchange_look(self);
    }
    fsm_wire sending = mail->writing;
    mail->writing = mail->sending;
    mail->sending = sending;
    mail->writing.count = 0;
    if (mail->sending.count == 0)
        fsm_wire_number(&mail->sending, kind);
    mail->sending.bytes[0] = kind;
    self->sent += mail->sending.count;
    self->batches++;
    MPI_Isend(mail->sending.bytes, (int)mail->sending.count, MPI_BYTE, (int)peer, TAG, MPI_COMM_WORLD, &mail->request);
}

void fsm_exchange_wrote(fsm_exchange *self, uint32_t peer)
{
    if (self->mail[peer].writing.count >= BATCH)
        post(self, peer, MORE);
}

bool fsm_exchange_end(fsm_exchange *self)
{
    for (uint32_t i = 1; i < self->ranks; i++) /* not all to the same one at once */
        post(self, (self->rank + i) % self->ranks, LAST);
    while (self->ended < self->ranks) {
        MPI_Status status;
        MPI_Probe(MPI_ANY_SOURCE, TAG, MPI_COMM_WORLD, &status);
        take_batch(self, &status);
    }
    for (uint32_t i = 0; i < self->ranks; i++)
        MPI_Wait(&self->mail[i].request, MPI_STATUS_IGNORE);
    return !self->failed;
}
