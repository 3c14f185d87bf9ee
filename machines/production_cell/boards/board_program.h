/* board_program.h: the program of a board, made of its tables. The file of a board includes it once, after
 * it has included the header of its node and defined
 *
 *   BOARD_NAME, BOARD_NODE   its name, and its number in the deployment
 *   BOARD_RING(rest)         names of the node that is generated: ring_a##rest
 *   BOARD_MACHINES(X)        X(machine, MACHINE) for each machine
 *   BOARD_MODULES(X)         the same for those that an emergency stop, a fault and power reach
 *   BOARD_DRIVES(X)          X(module, MODULE, is_belt, CONSTANT of its far position) for each axis
 *   BOARD_INPUTS(X), BOARD_OUTPUTS(X)   X(member, "signal") for what is no signal of a drive or a machine
 *
 * and defines after it what is its own: operations that move no axis, `board_sense`, `board_act`, and
 * `X_told_fault` of each machine X that is no module. */
#ifndef BOARD_PROGRAM_H
#define BOARD_PROGRAM_H

#include "board.h"

static BOARD_RING() node;

/* Inputs beside those of the drives to the machines; outputs beside those of drives and machines. */
static void board_sense(bool is_off);
static void board_act(bool is_off);

/* ---- signals ----------------------------------------------------------------------------------- */

#define BOARD_MEMBER(member, signal) int32_t member;
#define BOARD_DRIVE_INPUTS(X, UPPER, is_belt, FAR) int32_t X##_encoder, X##_limit;
#define BOARD_DRIVE_OUTPUTS(X, UPPER, is_belt, FAR) int32_t X##_pwm, X##_enable;
#define BOARD_MACHINE_OUTPUTS(X, UPPER) int32_t X##_state, X##_fault;

static struct {
    BOARD_DRIVES(BOARD_DRIVE_INPUTS)
    BOARD_INPUTS(BOARD_MEMBER)
    int32_t power, estop, reset;
} in;

static struct {
    BOARD_DRIVES(BOARD_DRIVE_OUTPUTS)
    BOARD_OUTPUTS(BOARD_MEMBER)
    BOARD_MACHINES(BOARD_MACHINE_OUTPUTS)
} out;

#define BOARD_INPUT(member, signal) {signal, &in.member},
#define BOARD_OUTPUT(member, signal) {signal, &out.member},
#define BOARD_DRIVE_INPUT(X, UPPER, is_belt, FAR)                                                  \
    {#X ".encoder", &in.X##_encoder}, {#X ".limit", &in.X##_limit},
#define BOARD_DRIVE_OUTPUT(X, UPPER, is_belt, FAR)                                                 \
    {#X ".pwm", &out.X##_pwm}, {#X ".enable", &out.X##_enable},
#define BOARD_MACHINE_OUTPUT(X, UPPER)                                                             \
    {#X ".state", &out.X##_state}, {#X ".fault", &out.X##_fault},

static const board_signal inputs[] = {
    BOARD_DRIVES(BOARD_DRIVE_INPUT) BOARD_INPUTS(BOARD_INPUT){"power", &in.power},
    {"estop", &in.estop},
    {"button.reset", &in.reset},
};

static const board_signal outputs[] = {BOARD_DRIVES(BOARD_DRIVE_OUTPUT) BOARD_OUTPUTS(BOARD_OUTPUT)
                                           BOARD_MACHINES(BOARD_MACHINE_OUTPUT)};

/* ---- drives ------------------------------------------------------------------------------------ */

#define BOARD_DRIVE(X, UPPER, is_belt, FAR) static drive X##_drive;
#define BOARD_DRIVE_ROW(X, UPPER, is_belt, FAR) {#X, &X##_drive},

BOARD_DRIVES(BOARD_DRIVE)

static const board_drive drives[] = {BOARD_DRIVES(BOARD_DRIVE_ROW)};

/* The operations of a module that moves an axis. */
#define BOARD_MOVES(X, UPPER, is_belt, FAR)                                                        \
    void X##_motor_enable(X *m)                                                                    \
    {                                                                                              \
        (void)m;                                                                                   \
        drive_enable(&X##_drive);                                                                  \
    }                                                                                              \
    void X##_motor_disable(X *m)                                                                   \
    {                                                                                              \
        (void)m;                                                                                   \
        drive_disable(&X##_drive);                                                                 \
    }                                                                                              \
    void X##_hold(X *m)                                                                            \
    {                                                                                              \
        (void)m;                                                                                   \
        drive_hold(&X##_drive);                                                                    \
    }                                                                                              \
    void X##_seek(X *m, uint8_t speed)                                                             \
    {                                                                                              \
        (void)m;                                                                                   \
        drive_seek(&X##_drive, speed);                                                             \
    }                                                                                              \
    void X##_goto(X *m, uint16_t position, uint8_t speed)                                          \
    {                                                                                              \
        (void)m;                                                                                   \
        drive_goto(&X##_drive, position, speed);                                                   \
    }

BOARD_DRIVES(BOARD_MOVES)

/* What the drive noticed, as events, and where it is, as an input. Without power it notices nothing. */
#define BOARD_SENSE(X, UPPER, is_belt, FAR)                                                        \
    static void X##_sense(void)                                                                    \
    {                                                                                              \
        const unsigned noticed = drive_sense(&X##_drive, in.X##_encoder, in.X##_limit != 0);       \
        if ((noticed & DRIVE_STALL) != 0u)                                                         \
            (void)X##_post_stall(&node.X);                                                         \
        if ((noticed & DRIVE_LIMIT) != 0u)                                                         \
            (void)X##_post_limit(&node.X);                                                         \
        if ((noticed & DRIVE_ARRIVED) != 0u)                                                       \
            (void)X##_post_arrived(&node.X);                                                       \
        node.X.in.at = drive_is_at(&X##_drive, UPPER##_AT_HOME)     ? UPPER##_PLACE_HOME           \
                    : drive_is_at(&X##_drive, UPPER##_AT_OFFSET) ? UPPER##_PLACE_OFFSET            \
                    : drive_is_at(&X##_drive, UPPER##_##FAR)     ? UPPER##_PLACE_FAR               \
                                                                 : UPPER##_PLACE_BETWEEN;          \
    }

BOARD_DRIVES(BOARD_SENSE)

/* ---- machines ---------------------------------------------------------------------------------- */

/* That a module is homed interests nobody. */
#define BOARD_HOMES(X, UPPER)                                                                      \
    void X##_send_is_homed(X *m)                                                                   \
    {                                                                                              \
        (void)m;                                                                                   \
    }

BOARD_MODULES(BOARD_HOMES)

/* What others are told of a machine, from its generated functions. */
#define BOARD_TELLS(X, UPPER)                                                                      \
    static const char *X##_told_name(uint16_t state)                                               \
    {                                                                                              \
        return X##_state_name((X##_state)state);                                                   \
    }                                                                                              \
    static uint16_t X##_told_leaf(void)                                                            \
    {                                                                                              \
        X##_state leaf = (X##_state)0;                                                             \
        return X##_active(&node.X, &leaf, 1) > 0 ? (uint16_t)leaf : 0u;                            \
    }                                                                                              \
    static uint8_t X##_told_fault(void);                                                           \
    static unsigned X##_told_refused(void)                                                         \
    {                                                                                              \
        return node.X.fsm.rejected;                                                                \
    }
#define BOARD_FAULT(X, UPPER)                                                                      \
    static uint8_t X##_told_fault(void)                                                            \
    {                                                                                              \
        return node.X.data.fault_code;                                                             \
    }
#define BOARD_MACHINE_ROW(X, UPPER)                                                                \
    {#X, UPPER##_STATES, X##_told_name, X##_told_leaf, X##_told_fault, X##_told_refused},

BOARD_MACHINES(BOARD_TELLS)
BOARD_MODULES(BOARD_FAULT)

static const board_machine machines[] = {BOARD_MACHINES(BOARD_MACHINE_ROW)};

/* ---- the program ------------------------------------------------------------------------------- */

#define BOARD_INIT(X, UPPER, is_belt, FAR) drive_init(&X##_drive, (is_belt) ? &belt : &other);
#define BOARD_SENSES(X, UPPER, is_belt, FAR) X##_sense();
#define BOARD_ACT(X, UPPER, is_belt, FAR)                                                          \
    out.X##_pwm = drive_control(&X##_drive) * on;                                                  \
    out.X##_enable = (X##_drive.mode != DRIVE_OFF) * on;
#define BOARD_TOLD(X, UPPER)                                                                       \
    out.X##_state = X##_told_leaf();                                                               \
    out.X##_fault = X##_told_fault();
#define BOARD_STOP(X, UPPER) (void)X##_post_estop(&node.X);
#define BOARD_FAIL(X, UPPER) (void)X##_post_fault(&node.X, UPPER##_FAULT_LINK);
#define BOARD_POWER_UP(X, UPPER)                                                                   \
    if (X##_in(&node.X, UPPER##_STATE_UNPOWERED))                                                  \
        (void)X##_post_power_ok(&node.X);

static void make(fsm_link *link)
{
    const drive_parameters belt = drive_defaults(true), other = drive_defaults(false);
    BOARD_DRIVES(BOARD_INIT)
    BOARD_RING(_init)(&node);
    node.link = link;
}

static void start(uint32_t now)
{
    (void)BOARD_RING(_start)(&node, now);
}

static void sense(bool is_off)
{
    BOARD_DRIVES(BOARD_SENSES)
    board_sense(is_off);
}

static void cycle(uint32_t now)
{
    (void)BOARD_RING(_cycle)(&node, now);
}

static void act(bool is_off)
{
    const int32_t on = !is_off;
    BOARD_DRIVES(BOARD_ACT)
    board_act(is_off);
    BOARD_MACHINES(BOARD_TOLD)
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
    return node.lost;
}

#define BOARD_COUNT(table) (sizeof(table) / sizeof(table)[0])

const board_program board_this = {
    .name = BOARD_NAME,
    .node = BOARD_NODE,
    .map = &BOARD_RING(_map),
    .endpoints = BOARD_RING(_endpoints),
    .inputs = inputs,
    .outputs = outputs,
    .machines = machines,
    .drives = drives,
    .input_count = BOARD_COUNT(inputs),
    .output_count = BOARD_COUNT(outputs),
    .machine_count = BOARD_COUNT(machines),
    .drive_count = BOARD_COUNT(drives),
    .power = &in.power,
    .estop = &in.estop,
    .reset = &in.reset,
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
