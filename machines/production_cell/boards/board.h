/* board.h: what is the same on all boards of the cell: the loop, the protocol, and when all is off.
 *
 * A board is a node of the deployment behind its wires, both of which are generated, with the drives of
 * its axes. board_program.h makes a `board_program` of it. */
#ifndef BOARD_H
#define BOARD_H

#include "drive.h"
#include "fsm_io.h"
#include "fsm_link.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* A machine as it is told to others. `leaf` is the first active atomic state. */
typedef struct {
    const char *name;
    uint16_t states;
    const char *(*state_name)(uint16_t state);
    uint16_t (*leaf)(void);
    uint8_t (*fault)(void);
    unsigned (*refused)(void); /* events that found its queue full */
} board_machine;

typedef struct {
    const char *name;
    drive *drive;
} board_drive;

typedef struct {
    const char *name;
    uint8_t node; /* in the deployment */
    const fsm_link_map *map;
    const char *const *endpoints; /* of the links, by node; generated */

    const fsm_io_wire *wires; /* inputs first */
    const fsm_io_register *registers;
    void *raw; /* the values of the wires */
    const board_machine *machines;
    const board_drive *drives;
    size_t wire_count, register_count, machine_count, drive_count;
    size_t window; /* bytes of the registers */
    const bool *power, *estop, *reset; /* three of the inputs, as they were read */

    void (*make)(fsm_link *link);
    void (*start)(uint32_t now);
    void (*sense)(void);                 /* wires are read */
    void (*cycle)(uint32_t now, bool is_off); /* drives and machines are told, all machines run */
    void (*act)(bool is_off);            /* drives and machines to wires; off: only what is safe */
    void (*stop_all)(void);              /* emergency stop to each machine */
    void (*fail_all)(void);              /* the fault `link` to each machine */
    void (*power_up)(void);              /* machines that know of no power are told */
    unsigned (*lost)(void);              /* events between machines of this board that were refused */
} board_program;

extern const board_program board_this;

/* ---- the board as the server sees it ------------------------------------------------------------- */

enum { BOARD_NOTES = 16, BOARD_NOTE_LENGTH = 120 };

typedef struct {
    uint32_t at; /* ms */
    char text[BOARD_NOTE_LENGTH];
} board_note;

typedef struct {
    fsm_link *link;
    bool is_linked;
    uint32_t now;
    bool has_started;
    bool is_off;           /* nothing may move */
    bool chain_was_open;   /* and reset was not pressed since */
    bool reset_was_down;
    bool is_deaf;          /* nobody gives it inputs, or those who do make no sense */
    uint32_t powered_ms;
    uint32_t lost_events[FSM_LINK_NODES], restarts[FSM_LINK_NODES];
    bool is_silent[FSM_LINK_NODES];
    uint32_t note_count;
    board_note notes[BOARD_NOTES]; /* why it went off or failed, the last ones */
} board;

void board_make(board *self, fsm_link *link, bool is_linked);

/* A millisecond: inputs were written, outputs will be. The first starts the machines, whatever the
 * time is: a board may come late. */
void board_step(board *self, uint32_t now);

/* Outputs that are safe, with the machines as they are. */
void board_off(board *self, const char *why);

/* From now on it hears again. */
void board_hears(board *self);

void board_write_note(board *self, const char *format, ...);

#endif
