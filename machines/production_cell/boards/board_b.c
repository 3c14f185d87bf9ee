/* board_b.c: extraction belt, sorter, camera, rotator. */
#include "positions.h"
#include "ring_b.h"

#define BOARD_NAME "b"
#define BOARD_NODE RING_B_NODE_B
#define BOARD_RING(rest) ring_b##rest
#define BOARD_MODULES(X)                                                                           \
    X(extraction_belt, EXTRACTION_BELT)                                                            \
    X(sorter, SORTER)                                                                              \
    X(camera, CAMERA)                                                                              \
    X(rotator, ROTATOR)
#define BOARD_MACHINES(X) BOARD_MODULES(X)
#define BOARD_DRIVES(X)                                                                            \
    X(extraction_belt, EXTRACTION_BELT, true, AT_PITCH)                                            \
    X(rotator, ROTATOR, false, AT_PICK)
#define BOARD_INPUTS(X)                                                                            \
    X(e0, "B_E0")                                                                                  \
    X(e1, "B_E1")                                                                                  \
    X(e2, "B_E2")                                                                                  \
    X(retracted, "sorter.retracted")                                                               \
    X(frame, "camera.frame")                                                                       \
    X(id, "camera.id")                                                                             \
    X(verdict, "camera.verdict")
#define BOARD_OUTPUTS(X)                                                                           \
    X(magnet, "rotator.magnet")                                                                    \
    X(sorter_out, "sorter.out")

#include "board_program.h"

static bool sorter_powered, sorter_pushes, camera_sees;

void extraction_belt_zero(extraction_belt *m)
{
    (void)m;
    drive_zero(&extraction_belt_drive);
}

void rotator_magnet(rotator *m, bool on)
{
    (void)m;
    out.magnet = on;
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

static void board_sense(bool is_off)
{
    (void)is_off;
    node.extraction_belt.in.entry_occupied = in.e0 != 0;
    node.extraction_belt.in.middle_occupied = in.e1 != 0;
    node.extraction_belt.in.exit_occupied = in.e2 != 0;
    node.sorter.in.slot_occupied = in.e1 != 0;
    node.sorter.in.retracted = in.retracted != 0;
    node.camera.in.in_view = in.e0 != 0;
    look();
}

static void board_act(bool is_off)
{
    out.sorter_out = sorter_powered && sorter_pushes && !is_off;
}
