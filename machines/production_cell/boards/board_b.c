/* board_b.c: extraction belt, sorter, camera, rotator. */
#include "board.h"
#include "positions.h"
#include "ring_b.h"

static ring_b node;
static drive extraction_belt_drive, rotator_drive;
static bool sorter_powered, sorter_pushes, camera_sees;

/* ---- signals ----------------------------------------------------------------------------------- */

static struct {
    int32_t extraction_belt_encoder, extraction_belt_limit, rotator_encoder, rotator_limit;
    int32_t e0, e1, e2, retracted, frame, id, verdict, power, estop, reset;
} in;

static struct {
    int32_t extraction_belt_pwm, extraction_belt_enable, rotator_pwm, rotator_enable;
    int32_t rotator_magnet, sorter_out;
    int32_t extraction_belt_state, sorter_state, camera_state, rotator_state;
    int32_t extraction_belt_fault, sorter_fault, camera_fault, rotator_fault;
} out;

static const board_signal inputs[] = {
    {"extraction_belt.encoder", &in.extraction_belt_encoder},
    {"extraction_belt.limit", &in.extraction_belt_limit},
    {"rotator.encoder", &in.rotator_encoder},
    {"rotator.limit", &in.rotator_limit},
    {"B_E0", &in.e0},
    {"B_E1", &in.e1},
    {"B_E2", &in.e2},
    {"sorter.retracted", &in.retracted},
    {"camera.frame", &in.frame},
    {"camera.id", &in.id},
    {"camera.verdict", &in.verdict},
    {"power", &in.power},
    {"estop", &in.estop},
    {"button.reset", &in.reset},
};

static const board_signal outputs[] = {
    {"extraction_belt.pwm", &out.extraction_belt_pwm},
    {"extraction_belt.enable", &out.extraction_belt_enable},
    {"rotator.pwm", &out.rotator_pwm},
    {"rotator.enable", &out.rotator_enable},
    {"rotator.magnet", &out.rotator_magnet},
    {"sorter.out", &out.sorter_out},
    {"extraction_belt.state", &out.extraction_belt_state},
    {"sorter.state", &out.sorter_state},
    {"camera.state", &out.camera_state},
    {"rotator.state", &out.rotator_state},
    {"extraction_belt.fault", &out.extraction_belt_fault},
    {"sorter.fault", &out.sorter_fault},
    {"camera.fault", &out.camera_fault},
    {"rotator.fault", &out.rotator_fault},
};

static const board_drive drives[] = {
    {"extraction_belt", &extraction_belt_drive},
    {"rotator", &rotator_drive},
};

/* ---- operations -------------------------------------------------------------------------------- */

BOARD_MOVES(extraction_belt, extraction_belt_drive)
BOARD_MOVES(rotator, rotator_drive)

void extraction_belt_zero(extraction_belt *m)
{
    (void)m;
    drive_zero(&extraction_belt_drive);
}

void rotator_magnet(rotator *m, bool on)
{
    (void)m;
    out.rotator_magnet = on;
}

/* The sorter is out or in; it neither seeks nor goes anywhere. */
void sorter_motor_enable(sorter *m)
{
    (void)m;
    sorter_powered = true;
}

void sorter_motor_disable(sorter *m)
{
    (void)m;
    sorter_powered = false;
}

void sorter_push(sorter *m, bool pushes)
{
    (void)m;
    sorter_pushes = pushes;
}

void camera_motor_enable(camera *m)
{
    (void)m;
    camera_sees = true;
}

void camera_motor_disable(camera *m)
{
    (void)m;
    camera_sees = false;
}

#define MOVES_NOTHING(X)                                                                           \
    void X##_hold(X *m)                                                                            \
    {                                                                                              \
        (void)m;                                                                                   \
    }                                                                                              \
    void X##_seek(X *m, uint8_t speed)                                                             \
    {                                                                                              \
        (void)m;                                                                                   \
        (void)speed;                                                                               \
    }                                                                                              \
    void X##_goto(X *m, uint16_t position, uint8_t speed)                                          \
    {                                                                                              \
        (void)m;                                                                                   \
        (void)position;                                                                            \
        (void)speed;                                                                               \
    }

MOVES_NOTHING(sorter)
MOVES_NOTHING(camera)

/* That it is degraded changes nothing but its report. */
void camera_send_degraded(camera *m)
{
    (void)m;
}

BOARD_HOMES(extraction_belt)
BOARD_HOMES(sorter)
BOARD_HOMES(camera)
BOARD_HOMES(rotator)

/* ---- machines ---------------------------------------------------------------------------------- */

BOARD_TELLS(extraction_belt, EXTRACTION_BELT, node.extraction_belt)
BOARD_TELLS(sorter, SORTER, node.sorter)
BOARD_TELLS(camera, CAMERA, node.camera)
BOARD_TELLS(rotator, ROTATOR, node.rotator)
BOARD_TELLS_FAULT(extraction_belt, node.extraction_belt)
BOARD_TELLS_FAULT(sorter, node.sorter)
BOARD_TELLS_FAULT(camera, node.camera)
BOARD_TELLS_FAULT(rotator, node.rotator)

static const board_machine machines[] = {
    BOARD_MACHINE(extraction_belt, EXTRACTION_BELT, extraction_belt_told_fault),
    BOARD_MACHINE(sorter, SORTER, sorter_told_fault),
    BOARD_MACHINE(camera, CAMERA, camera_told_fault),
    BOARD_MACHINE(rotator, ROTATOR, rotator_told_fault),
};

static void make(fsm_link *link)
{
    const drive_parameters belt = drive_defaults(true), other = drive_defaults(false);
    drive_init(&extraction_belt_drive, &belt);
    drive_init(&rotator_drive, &other);
    ring_b_init(&node);
    node.link = link;
}

static void start(uint32_t now)
{
    (void)ring_b_start(&node, now);
}

/* A verdict as the protocol has it: good, bad, unknown. */
static uint8_t quality(int32_t verdict)
{
    return verdict == 1   ? CAMERA_QUALITY_GOOD
           : verdict == 2 ? CAMERA_QUALITY_BAD
                          : CAMERA_QUALITY_UNKNOWN;
}

static void look(void)
{
    static int32_t frame_before, e0_before;
    camera *const m = &node.camera;
    if (camera_sees && in.frame != frame_before)
        (void)camera_post_frame(m);
    if (in.e0 != 0 && e0_before == 0)
        (void)camera_post_entered_view(m);
    if (in.e0 == 0 && e0_before != 0)
        (void)camera_post_left_view(m);
    if (in.e0 != 0 && in.verdict != 0 && camera_in(m, CAMERA_STATE_TRACKING))
        (void)camera_post_judged(m, quality(in.verdict));
    frame_before = in.frame;
    e0_before = in.e0;
}

static void sense(bool is_off)
{
    (void)is_off;
    BOARD_SENSE(extraction_belt, EXTRACTION_BELT, node.extraction_belt, extraction_belt_drive,
                in.extraction_belt_encoder, in.extraction_belt_limit, AT_PITCH);
    BOARD_SENSE(rotator, ROTATOR, node.rotator, rotator_drive, in.rotator_encoder, in.rotator_limit,
                AT_PICK);
    node.extraction_belt.entry_occupied = in.e0 != 0;
    node.extraction_belt.middle_occupied = in.e1 != 0;
    node.extraction_belt.exit_occupied = in.e2 != 0;
    node.sorter.slot_occupied = in.e1 != 0;
    node.sorter.retracted = in.retracted != 0;
    node.camera.in_view = in.e0 != 0;
    look();
}

static void cycle(uint32_t now)
{
    (void)ring_b_cycle(&node, now);
}

static void act(bool is_off)
{
    const int32_t on = !is_off;
    out.extraction_belt_pwm = drive_control(&extraction_belt_drive) * on;
    out.rotator_pwm = drive_control(&rotator_drive) * on;
    out.extraction_belt_enable = (extraction_belt_drive.mode != DRIVE_OFF) * on;
    out.rotator_enable = (rotator_drive.mode != DRIVE_OFF) * on;
    out.sorter_out = (sorter_powered && sorter_pushes) * on;
    out.extraction_belt_state = extraction_belt_told_leaf();
    out.sorter_state = sorter_told_leaf();
    out.camera_state = camera_told_leaf();
    out.rotator_state = rotator_told_leaf();
    out.extraction_belt_fault = extraction_belt_told_fault();
    out.sorter_fault = sorter_told_fault();
    out.camera_fault = camera_told_fault();
    out.rotator_fault = rotator_told_fault();
}

static void stop_all(void)
{
    BOARD_STOP(extraction_belt, node.extraction_belt);
    BOARD_STOP(sorter, node.sorter);
    BOARD_STOP(camera, node.camera);
    BOARD_STOP(rotator, node.rotator);
}

static void fail_all(void)
{
    BOARD_FAIL(extraction_belt, EXTRACTION_BELT, node.extraction_belt);
    BOARD_FAIL(sorter, SORTER, node.sorter);
    BOARD_FAIL(camera, CAMERA, node.camera);
    BOARD_FAIL(rotator, ROTATOR, node.rotator);
}

static void power_up(void)
{
    BOARD_POWER_UP(extraction_belt, EXTRACTION_BELT, node.extraction_belt);
    BOARD_POWER_UP(sorter, SORTER, node.sorter);
    BOARD_POWER_UP(camera, CAMERA, node.camera);
    BOARD_POWER_UP(rotator, ROTATOR, node.rotator);
}

static unsigned lost(void)
{
    return node.lost;
}

#define COUNT(table) (sizeof(table) / sizeof(table)[0])

const board_program board_this = {
    .name = "b",
    .node = RING_B_NODE_B,
    .map = &ring_b_map,
    .endpoints = ring_b_endpoints,
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
