/* board_a.c: feeder belt, feeder, molder, extractor; and the supervisor, with buttons, lamp, beacon. */
#include "board.h"
#include "positions.h"
#include "ring_a.h"

static ring_a node;
static drive feeder_belt_drive, feeder_drive, molder_drive, extractor_drive;

/* ---- signals ----------------------------------------------------------------------------------- */

static struct {
    int32_t feeder_belt_encoder, feeder_belt_limit, feeder_encoder, feeder_limit, molder_encoder,
        molder_limit, extractor_encoder, extractor_limit;
    int32_t f0, p, m;
    int32_t power, estop, start, stop, pause, resume, reset;
} in;

static struct {
    int32_t feeder_belt_pwm, feeder_belt_enable, feeder_pwm, feeder_enable, molder_pwm,
        molder_enable, extractor_pwm, extractor_enable;
    int32_t extractor_magnet, lamp, beacon;
    int32_t supervisor_state, feeder_belt_state, feeder_state, molder_state, extractor_state;
    int32_t supervisor_fault, feeder_belt_fault, feeder_fault, molder_fault, extractor_fault, heat;
} out;

static const board_signal inputs[] = {
    {"feeder_belt.encoder", &in.feeder_belt_encoder},
    {"feeder_belt.limit", &in.feeder_belt_limit},
    {"feeder.encoder", &in.feeder_encoder},
    {"feeder.limit", &in.feeder_limit},
    {"molder.encoder", &in.molder_encoder},
    {"molder.limit", &in.molder_limit},
    {"extractor.encoder", &in.extractor_encoder},
    {"extractor.limit", &in.extractor_limit},
    {"B_F0", &in.f0},
    {"B_P", &in.p},
    {"B_M", &in.m},
    {"power", &in.power},
    {"estop", &in.estop},
    {"button.start", &in.start},
    {"button.stop", &in.stop},
    {"button.pause", &in.pause},
    {"button.resume", &in.resume},
    {"button.reset", &in.reset},
};

static const board_signal outputs[] = {
    {"feeder_belt.pwm", &out.feeder_belt_pwm},
    {"feeder_belt.enable", &out.feeder_belt_enable},
    {"feeder.pwm", &out.feeder_pwm},
    {"feeder.enable", &out.feeder_enable},
    {"molder.pwm", &out.molder_pwm},
    {"molder.enable", &out.molder_enable},
    {"extractor.pwm", &out.extractor_pwm},
    {"extractor.enable", &out.extractor_enable},
    {"extractor.magnet", &out.extractor_magnet},
    {"lamp", &out.lamp},
    {"beacon", &out.beacon},
    {"supervisor.state", &out.supervisor_state},
    {"feeder_belt.state", &out.feeder_belt_state},
    {"feeder.state", &out.feeder_state},
    {"molder.state", &out.molder_state},
    {"extractor.state", &out.extractor_state},
    {"supervisor.fault", &out.supervisor_fault},
    {"feeder_belt.fault", &out.feeder_belt_fault},
    {"feeder.fault", &out.feeder_fault},
    {"molder.fault", &out.molder_fault},
    {"extractor.fault", &out.extractor_fault},
    {"molder.heat", &out.heat},
};

static const board_drive drives[] = {
    {"feeder_belt", &feeder_belt_drive},
    {"feeder", &feeder_drive},
    {"molder", &molder_drive},
    {"extractor", &extractor_drive},
};

/* ---- operations -------------------------------------------------------------------------------- */

BOARD_MOVES(feeder_belt, feeder_belt_drive)
BOARD_MOVES(feeder, feeder_drive)
BOARD_MOVES(molder, molder_drive)
BOARD_MOVES(extractor, extractor_drive)

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
    out.extractor_magnet = on;
}

BOARD_HOMES(feeder_belt)
BOARD_HOMES(feeder)
BOARD_HOMES(molder)
BOARD_HOMES(extractor)

/* ---- machines ---------------------------------------------------------------------------------- */

BOARD_TELLS(supervisor, SUPERVISOR, node.supervisor)
BOARD_TELLS(feeder_belt, FEEDER_BELT, node.feeder_belt)
BOARD_TELLS(feeder, FEEDER, node.feeder)
BOARD_TELLS(molder, MOLDER, node.molder)
BOARD_TELLS(extractor, EXTRACTOR, node.extractor)
BOARD_TELLS_FAULT(supervisor, node.supervisor)
BOARD_TELLS_FAULT(feeder_belt, node.feeder_belt)
BOARD_TELLS_FAULT(feeder, node.feeder)
BOARD_TELLS_FAULT(molder, node.molder)
BOARD_TELLS_FAULT(extractor, node.extractor)

static const board_machine machines[] = {
    BOARD_MACHINE(supervisor, SUPERVISOR, supervisor_told_fault),
    BOARD_MACHINE(feeder_belt, FEEDER_BELT, feeder_belt_told_fault),
    BOARD_MACHINE(feeder, FEEDER, feeder_told_fault),
    BOARD_MACHINE(molder, MOLDER, molder_told_fault),
    BOARD_MACHINE(extractor, EXTRACTOR, extractor_told_fault),
};

static void make(fsm_link *link)
{
    const drive_parameters belt = drive_defaults(true), other = drive_defaults(false);
    drive_init(&feeder_belt_drive, &belt);
    drive_init(&feeder_drive, &other);
    drive_init(&molder_drive, &other);
    drive_init(&extractor_drive, &other);
    ring_a_init(&node);
    node.link = link;
}

static void start(uint32_t now)
{
    (void)ring_a_start(&node, now);
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

static void sense(bool is_off)
{
    BOARD_SENSE(feeder_belt, FEEDER_BELT, node.feeder_belt, feeder_belt_drive,
                in.feeder_belt_encoder, in.feeder_belt_limit, AT_PITCH);
    BOARD_SENSE(feeder, FEEDER, node.feeder, feeder_drive, in.feeder_encoder, in.feeder_limit,
                AT_PUSHED);
    BOARD_SENSE(molder, MOLDER, node.molder, molder_drive, in.molder_encoder, in.molder_limit,
                AT_OPEN);
    BOARD_SENSE(extractor, EXTRACTOR, node.extractor, extractor_drive, in.extractor_encoder,
                in.extractor_limit, AT_PICK);
    node.feeder_belt.entry_occupied = in.f0 != 0;
    node.feeder_belt.pocket_occupied = in.p != 0;
    node.feeder.pocket_occupied = in.p != 0;
    node.feeder.cavity_occupied = in.m != 0;
    node.molder.cavity_occupied = in.m != 0;
    read_buttons(is_off);
}

static void cycle(uint32_t now)
{
    (void)ring_a_cycle(&node, now);
}

static int32_t beacon(void)
{
    const supervisor *const m = &node.supervisor;
    if (supervisor_in(m, SUPERVISOR_STATE_FAULTED) || supervisor_in(m, SUPERVISOR_STATE_TRIPPED))
        return 2;
    return supervisor_in(m, SUPERVISOR_STATE_PRODUCING);
}

static void act(bool is_off)
{
    const int32_t on = !is_off;
    out.feeder_belt_pwm = drive_control(&feeder_belt_drive) * on;
    out.feeder_pwm = drive_control(&feeder_drive) * on;
    out.molder_pwm = drive_control(&molder_drive) * on;
    out.extractor_pwm = drive_control(&extractor_drive) * on;
    out.feeder_belt_enable = (feeder_belt_drive.mode != DRIVE_OFF) * on;
    out.feeder_enable = (feeder_drive.mode != DRIVE_OFF) * on;
    out.molder_enable = (molder_drive.mode != DRIVE_OFF) * on;
    out.extractor_enable = (extractor_drive.mode != DRIVE_OFF) * on;
    out.lamp = node.feeder_belt.lamp * on;
    out.beacon = is_off ? 2 : beacon();
    out.supervisor_state = supervisor_told_leaf();
    out.feeder_belt_state = feeder_belt_told_leaf();
    out.feeder_state = feeder_told_leaf();
    out.molder_state = molder_told_leaf();
    out.extractor_state = extractor_told_leaf();
    out.supervisor_fault = supervisor_told_fault();
    out.feeder_belt_fault = feeder_belt_told_fault();
    out.feeder_fault = feeder_told_fault();
    out.molder_fault = molder_told_fault();
    out.extractor_fault = extractor_told_fault();
}

static void stop_all(void)
{
    BOARD_STOP(feeder_belt, node.feeder_belt);
    BOARD_STOP(feeder, node.feeder);
    BOARD_STOP(molder, node.molder);
    BOARD_STOP(extractor, node.extractor);
}

static void fail_all(void)
{
    BOARD_FAIL(feeder_belt, FEEDER_BELT, node.feeder_belt);
    BOARD_FAIL(feeder, FEEDER, node.feeder);
    BOARD_FAIL(molder, MOLDER, node.molder);
    BOARD_FAIL(extractor, EXTRACTOR, node.extractor);
}

static void power_up(void)
{
    BOARD_POWER_UP(feeder_belt, FEEDER_BELT, node.feeder_belt);
    BOARD_POWER_UP(feeder, FEEDER, node.feeder);
    BOARD_POWER_UP(molder, MOLDER, node.molder);
    BOARD_POWER_UP(extractor, EXTRACTOR, node.extractor);
}

static unsigned lost(void)
{
    return node.lost;
}

#define COUNT(table) (sizeof(table) / sizeof(table)[0])

const board_program board_this = {
    .name = "a",
    .node = RING_A_NODE_A,
    .map = &ring_a_map,
    .endpoints = ring_a_endpoints,
    .inputs = inputs,
    .outputs = outputs,
    .machines = machines,
    .drives = drives,
    .input_count = COUNT(inputs),
    .output_count = COUNT(outputs),
    .machine_count = COUNT(machines),
    .drive_count = COUNT(drives),
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
