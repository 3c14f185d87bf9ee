/* board.h: what is the same on all boards of the cell: the loop, the protocol, and when all is off.
 *
 * A board is a node of the deployment: its generated machines, the drives of its axes, and a table of
 * the signals that it reads and writes. board_a.c and board_b.c fill a `board_program` with these. */
#ifndef BOARD_H
#define BOARD_H

#include "drive.h"
#include "fsm_link.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct {
    const char *name;
    int32_t *value;
} board_signal;

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

    const board_signal *inputs, *outputs;
    const board_machine *machines;
    const board_drive *drives;
    size_t input_count, output_count, machine_count, drive_count;
    const int32_t *power, *estop, *reset; /* three of the inputs */

    void (*make)(fsm_link *link);
    void (*start)(uint32_t now);
    void (*sense)(bool is_off);          /* inputs to drives and machines */
    void (*cycle)(uint32_t now);         /* all machines run */
    void (*act)(bool is_off);            /* drives and machines to outputs; off: only what is safe */
    void (*stop_all)(void);              /* emergency stop to each machine */
    void (*fail_all)(void);              /* the fault `link` to each machine */
    void (*power_up)(void);              /* machines that know of no power are told */
    unsigned (*lost)(void);              /* events between machines of this board that were refused */
} board_program;

/* A module without an axis: what others are told of it, from its generated functions. `member` is that of
 * the struct of the node. */
#define BOARD_TELLS(X, UPPER, member)                                                              \
    static const char *X##_told_name(uint16_t state)                                               \
    {                                                                                              \
        return X##_state_name((X##_state)state);                                                   \
    }                                                                                              \
    static uint16_t X##_told_leaf(void)                                                            \
    {                                                                                              \
        X##_state leaf = (X##_state)0;                                                             \
        return X##_active(&(member), &leaf, 1) > 0 ? (uint16_t)leaf : 0u;                          \
    }                                                                                              \
    static unsigned X##_told_refused(void)                                                         \
    {                                                                                              \
        return (member).rejected;                                                                  \
    }

/* That a module is homed interests nobody. */
#define BOARD_HOMES(X)                                                                             \
    void X##_send_is_homed(X *m)                                                                   \
    {                                                                                              \
        (void)m;                                                                                   \
    }

#define BOARD_TELLS_FAULT(X, member)                                                               \
    static uint8_t X##_told_fault(void)                                                            \
    {                                                                                              \
        return (member).fault_code;                                                                \
    }

#define BOARD_MACHINE(X, UPPER, fault)                                                             \
    {#X, UPPER##_STATES, X##_told_name, X##_told_leaf, fault, X##_told_refused}

/* The operations of a module that moves an axis. */
#define BOARD_MOVES(X, its_drive)                                                                  \
    void X##_motor_enable(X *m)                                                                    \
    {                                                                                              \
        (void)m;                                                                                   \
        drive_enable(&(its_drive));                                                                \
    }                                                                                              \
    void X##_motor_disable(X *m)                                                                   \
    {                                                                                              \
        (void)m;                                                                                   \
        drive_disable(&(its_drive));                                                               \
    }                                                                                              \
    void X##_hold(X *m)                                                                            \
    {                                                                                              \
        (void)m;                                                                                   \
        drive_hold(&(its_drive));                                                                  \
    }                                                                                              \
    void X##_seek(X *m, uint8_t speed)                                                             \
    {                                                                                              \
        (void)m;                                                                                   \
        drive_seek(&(its_drive), speed);                                                           \
    }                                                                                              \
    void X##_goto(X *m, uint16_t position, uint8_t speed)                                          \
    {                                                                                              \
        (void)m;                                                                                   \
        drive_goto(&(its_drive), position, speed);                                                 \
    }

/* What the drive noticed, as events, and where it is, as an input. Without power it notices nothing. */
#define BOARD_SENSE(X, UPPER, member, its_drive, encoder, limit, far_position)                     \
    do {                                                                                           \
        const unsigned noticed_ = drive_sense(&(its_drive), (encoder), (limit) != 0);              \
        if ((noticed_ & DRIVE_STALL) != 0u)                                                        \
            (void)X##_post_stall(&(member));                                                       \
        if ((noticed_ & DRIVE_LIMIT) != 0u)                                                        \
            (void)X##_post_limit(&(member));                                                       \
        if ((noticed_ & DRIVE_ARRIVED) != 0u)                                                      \
            (void)X##_post_arrived(&(member));                                                     \
        (member).at = drive_is_at(&(its_drive), UPPER##_AT_HOME)         ? UPPER##_PLACE_HOME      \
                      : drive_is_at(&(its_drive), UPPER##_AT_OFFSET)     ? UPPER##_PLACE_OFFSET    \
                      : drive_is_at(&(its_drive), UPPER##_##far_position) ? UPPER##_PLACE_FAR      \
                                                                         : UPPER##_PLACE_BETWEEN;  \
    } while (0)

/* What a machine is told when the emergency chain opens, and when a link fails. */
#define BOARD_STOP(X, member) (void)X##_post_estop(&(member))
#define BOARD_FAIL(X, UPPER, member) (void)X##_post_fault(&(member), UPPER##_FAULT_LINK)
#define BOARD_POWER_UP(X, UPPER, member)                                                           \
    do {                                                                                           \
        if (X##_in(&(member), UPPER##_STATE_UNPOWERED))                                            \
            (void)X##_post_power_ok(&(member));                                                    \
    } while (0)

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
