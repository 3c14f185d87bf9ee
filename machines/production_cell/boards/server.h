/* server.h: the protocol of the co-simulation, and of hardware in the loop: requests and replies.
 *
 * The first byte of a request is its kind, that of a reply the same, or `E` before a text. Signals
 * are i32, step numbers and counts of frames u32, least significant byte first.
 *
 *   C  connect          JSON              -> JSON: names of signals, states, other boards
 *   I  initial values   inputs            -> outputs
 *   K  check            -                 -> JSON: whether it is ready, or why not
 *   S  step             number, frames sent by each other board so far, inputs
 *                                         -> number, frames sent by this one, outputs
 *   P  parameter        JSON: name, value -> JSON
 *   R  report           -                 -> JSON: what was counted
 *   Q  quit             -                 -> - */
#ifndef SERVER_H
#define SERVER_H

#include "board.h"
#include "fsm_io_map.h"
#include "fsm_link_zmq.h"
#include "posix/fsm_posix.h"

enum { SERVER_ROOM = 32768 };

typedef struct {
    board board;
    fsm_link link;
    fsm_link_zmq zmq;
    fsm_link_faults faults;
    fsm_io_map *map;     /* registers that the wires are; NULL: requests bring and take them */
    fsm_posix *host;     /* of the real-time loop; NULL in co-simulation, where a step is a request */
    bool is_linked;      /* there are other boards */
    bool is_over;
    uint32_t told[FSM_LINK_NODES];    /* frames that each other board had sent */
    uint32_t unheard[FSM_LINK_NODES]; /* of these, before this one began */
    uint32_t heard;      /* when inputs came last, in ms */
    size_t length;       /* of the reply */
    uint8_t reply[SERVER_ROOM];
} server;

/* Answer a request: afterwards the reply is there. */
void server_answer(server *self, const uint8_t *request, size_t length);

/* Take inputs from the registers, and give outputs to them, if there are any. */
void server_read_map(const server *self);
void server_write_map(const server *self);

/* Write a line for people on how the board is; returns whether it does its work: it is on, has heard
 * the other boards, and no machine has a fault. */
bool server_status(const server *self, char *line, size_t room);

/* Frames of all other boards that were lost. */
unsigned server_losses(const server *self);

#endif
