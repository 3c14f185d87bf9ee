/* A small simulated axis: a trapezoidal velocity profile towards a target, one step a millisecond.
 *
 * All integer, so that the C loop and the Python loop move alike: positions in 1/256 encoder count,
 * velocities in 1/256 count a millisecond, accelerations in 1/256 count a millisecond squared. */
#ifndef AXIS_H
#define AXIS_H

#include <stdbool.h>
#include <stdint.h>

#define AXIS_SCALE 256
#define AXIS_TOP_SPEED 2048   /* 8 counts a millisecond, at 100 percent */
#define AXIS_ACCELERATION 20
#define AXIS_FAR_AWAY (-1000000)

typedef enum { AXIS_NOTHING, AXIS_ARRIVED, AXIS_LIMIT } axis_event;

typedef struct {
    int32_t position, velocity, target, top_speed;
    bool enabled, moving, seeking;
} axis;

/* Start towards a position, in counts, at a speed in percent. */
void axis_goto(axis *self, int32_t counts, int32_t percent);

/* Start towards the limit switch, which is at position zero. */
void axis_seek(axis *self, int32_t percent);

void axis_stop(axis *self);

/* Advance by a millisecond; say whether the motion ended in this step. */
axis_event axis_step(axis *self);

/* Whether the axis stands within two counts of a position. */
bool axis_at(const axis *self, int32_t counts);

#endif
