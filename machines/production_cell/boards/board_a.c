/* board_a.c: feeder belt, feeder, molder, extractor; and the supervisor, with buttons, lamp, beacon. */
#include "positions.h"
#include "ring_a.h"

#define BOARD_NAME "a"
#define BOARD_NODE RING_A_NODE_A
#define BOARD_RING(rest) ring_a##rest
#define BOARD_MODULES(X)                                                                           \
    X(feeder_belt, FEEDER_BELT)                                                                    \
    X(feeder, FEEDER)                                                                              \
    X(molder, MOLDER)                                                                              \
    X(extractor, EXTRACTOR)
#define BOARD_MACHINES(X)                                                                          \
    X(supervisor, SUPERVISOR)                                                                      \
    BOARD_MODULES(X)
#define BOARD_DRIVES(X)                                                                            \
    X(feeder_belt, FEEDER_BELT, true, AT_PITCH)                                                    \
    X(feeder, FEEDER, false, AT_PUSHED)                                                            \
    X(molder, MOLDER, false, AT_OPEN)                                                              \
    X(extractor, EXTRACTOR, false, AT_PICK)
#define BOARD_INPUTS(X)                                                                            \
    X(f0, "B_F0")                                                                                  \
    X(p, "B_P")                                                                                    \
    X(m, "B_M")                                                                                    \
    X(start, "button.start")                                                                       \
    X(stop, "button.stop")                                                                         \
    X(pause, "button.pause")                                                                       \
    X(resume, "button.resume")
#define BOARD_OUTPUTS(X)                                                                           \
    X(magnet, "extractor.magnet")                                                                  \
    X(lamp, "lamp")                                                                                \
    X(beacon, "beacon")                                                                            \
    X(heat, "molder.heat")

#include "board_program.h"

void feeder_belt_zero(feeder_belt *m)
{
    (void)m;
    drive_zero(&feeder_belt_drive);
}

void molder_heat(molder *m, bool on)
{
    (void)m;
    out.heat = on;
}

void extractor_magnet(extractor *m, bool on)
{
    (void)m;
    out.magnet = on;
}

static uint8_t supervisor_told_fault(void)
{
    return node.supervisor.out.fault_code;
}

static bool is_pressed(int32_t level, int32_t *before)
{
    const bool pressed = level != 0 && *before == 0;
    *before = level;
    return pressed;
}

/* Reset does nothing while the chain is open. Whatever else turned all off, the supervisor trips. */
static void read_buttons(bool is_off)
{
    static int32_t start_before, stop_before, pause_before, resume_before, reset_before;
    supervisor *const m = &node.supervisor;
    if (is_pressed(in.start, &start_before))
        (void)supervisor_post_press_start(m);
    if (is_pressed(in.stop, &stop_before))
        (void)supervisor_post_press_stop(m);
    if (is_pressed(in.pause, &pause_before))
        (void)supervisor_post_press_pause(m);
    if (is_pressed(in.resume, &resume_before) && supervisor_in(m, SUPERVISOR_STATE_INTERRUPTED))
        (void)supervisor_post_press_start(m);
    if (is_pressed(in.reset, &reset_before) && in.estop == 0)
        (void)supervisor_post_press_reset(m);
    if (is_off && !supervisor_in(m, SUPERVISOR_STATE_TRIPPED) &&
        !supervisor_in(m, SUPERVISOR_STATE_SWITCHED_OFF))
        (void)supervisor_post_press_estop(m);
}

static void board_sense(bool is_off)
{
    node.feeder_belt.in.entry_occupied = in.f0 != 0;
    node.feeder_belt.in.pocket_occupied = in.p != 0;
    node.feeder.in.pocket_occupied = in.p != 0;
    node.feeder.in.cavity_occupied = in.m != 0;
    node.molder.in.cavity_occupied = in.m != 0;
    read_buttons(is_off);
}

static int32_t beacon(void)
{
    const supervisor *const m = &node.supervisor;
    if (supervisor_in(m, SUPERVISOR_STATE_FAULTED) || supervisor_in(m, SUPERVISOR_STATE_TRIPPED))
        return 2;
    return supervisor_in(m, SUPERVISOR_STATE_PRODUCING);
}

static void board_act(bool is_off)
{
    out.lamp = node.feeder_belt.out.lamp && !is_off;
    out.beacon = is_off ? 2 : beacon();
}
