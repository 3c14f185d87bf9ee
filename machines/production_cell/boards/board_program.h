/* board_program.h: the program of a board around its wires. The file of a board includes it once, after
 * it has included the header of its wires and defined
 *
 *   BOARD_NAME, BOARD_NODE   its name, and its number in the deployment
 *   BOARD_RING(rest)         names of the node that is generated: ring_a##rest
 *   BOARD_IO(rest)           names of its wires: board_a_io##rest
 *   BOARD_WIRES, BOARD_REGISTERS, BOARD_WINDOW   how many wires and registers, and their bytes
 *   BOARD_MACHINES(X)        X(machine, MACHINE) for each machine
 *   BOARD_MODULES(X)         the same for those that an emergency stop, a fault and power reach
 *   BOARD_DRIVES(X)          X(module, is_belt) for each axis
 *
 * and defines after it `X_told_fault` of each machine X that is no module. */
#ifndef BOARD_PROGRAM_H
#define BOARD_PROGRAM_H

#include "board.h"

static BOARD_IO() io;
static BOARD_IO(_raw) raw;

/* ---- drives ------------------------------------------------------------------------------------ */

#define BOARD_DRIVE_ROW(X, is_belt) {#X, &io.X##_drive},

static const board_drive drives[] = {BOARD_DRIVES(BOARD_DRIVE_ROW)};

/* ---- machines ---------------------------------------------------------------------------------- */

/* What others are told of a machine, from its generated functions. */
#define BOARD_TELLS(X, UPPER)                                                                      \
    static const char *X##_told_name(uint16_t state)                                               \
    {                                                                                              \
        return X##_state_name((X##_state)state);                                                   \
    }                                                                                              \
    static uint16_t X##_told_leaf(void)                                                            \
    {                                                                                              \
        X##_state leaf = (X##_state)0;                                                             \
        return X##_active(&io.node.X, &leaf, 1) > 0 ? (uint16_t)leaf : 0u;                         \
    }                                                                                              \
    static uint8_t X##_told_fault(void);                                                           \
    static unsigned X##_told_refused(void)                                                         \
    {                                                                                              \
        return io.node.X.fsm.rejected;                                                             \
    }
#define BOARD_FAULT(X, UPPER)                                                                      \
    static uint8_t X##_told_fault(void)                                                            \
    {                                                                                              \
        return io.node.X.data.fault_code;                                                          \
    }
#define BOARD_MACHINE_ROW(X, UPPER)                                                                \
    {#X, UPPER##_STATES, X##_told_name, X##_told_leaf, X##_told_fault, X##_told_refused},

BOARD_MACHINES(BOARD_TELLS)
BOARD_MODULES(BOARD_FAULT)

static const board_machine machines[] = {BOARD_MACHINES(BOARD_MACHINE_ROW)};

/* ---- the program ------------------------------------------------------------------------------- */

#define BOARD_INIT(X, is_belt) drive_init(&io.X##_drive, (is_belt) ? &belt : &other);
#define BOARD_STOP(X, UPPER) (void)X##_post_estop(&io.node.X);
#define BOARD_FAIL(X, UPPER) (void)X##_post_fault(&io.node.X, UPPER##_FAULT_LINK);
#define BOARD_POWER_UP(X, UPPER)                                                                   \
    if (X##_in(&io.node.X, UPPER##_STATE_UNPOWERED))                                               \
        (void)X##_post_power_ok(&io.node.X);

static void make(fsm_link *link)
{
    const drive_parameters belt = drive_defaults(true), other = drive_defaults(false);
    BOARD_IO(_init)(&io);
    BOARD_DRIVES(BOARD_INIT)
    io.node.link = link;
}

static void start(uint32_t now)
{
    (void)BOARD_RING(_start)(&io.node, now);
}

static void sense(void)
{
    BOARD_IO(_read)(&io, &raw);
}

static void cycle(uint32_t now, bool is_off)
{
    io.flag.is_off = is_off;
    BOARD_IO(_to_machines)(&io);
    (void)BOARD_RING(_cycle)(&io.node, now);
}

static void act(bool is_off)
{
    io.flag.is_off = is_off;
    BOARD_IO(_from_machines)(&io, &raw);
}

static void stop_all(void)
{
    BOARD_MODULES(BOARD_STOP)
}

static void fail_all(void)
{
    BOARD_MODULES(BOARD_FAIL)
}

static void power_up(void)
{
    BOARD_MODULES(BOARD_POWER_UP)
}

static unsigned lost(void)
{
    return io.node.lost;
}

#define BOARD_COUNT(table) (sizeof(table) / sizeof(table)[0])

const board_program board_this = {
    .name = BOARD_NAME,
    .node = BOARD_NODE,
    .map = &BOARD_RING(_map),
    .endpoints = BOARD_RING(_endpoints),
    .wires = BOARD_IO(_wires),
    .registers = BOARD_IO(_registers),
    .raw = &raw,
    .machines = machines,
    .drives = drives,
    .wire_count = BOARD_WIRES,
    .register_count = BOARD_REGISTERS,
    .window = BOARD_WINDOW,
    .machine_count = BOARD_COUNT(machines),
    .drive_count = BOARD_COUNT(drives),
    .power = &io.in.power,
    .estop = &io.in.estop,
    .reset = &io.in.button_reset,
    .make = make,
    .start = start,
    .sense = sense,
    .cycle = cycle,
    .act = act,
    .stop_all = stop_all,
    .fail_all = fail_all,
    .power_up = power_up,
    .lost = lost,
};

#endif
