#include "axis.h"

void axis_goto(axis *self, int32_t counts, int32_t percent)
{
    self->target = counts * AXIS_SCALE;
    self->top_speed = AXIS_TOP_SPEED * percent / 100;
    self->moving = true;
    self->seeking = false;
}

void axis_seek(axis *self, int32_t percent)
{
    axis_goto(self, AXIS_FAR_AWAY, percent);
    self->seeking = true;
}

void axis_stop(axis *self)
{
    self->moving = false;
    self->seeking = false;
    self->velocity = 0;
}

axis_event axis_step(axis *self)
{
    if (!self->moving || !self->enabled)
        return AXIS_NOTHING;
    if (self->seeking && self->position <= 0) {
        axis_stop(self);
        self->position = 0;
        return AXIS_LIMIT;
    }
    int32_t sign = self->target < self->position ? -1 : 1;
    int32_t distance = sign * (self->target - self->position);
    int32_t speed = sign * self->velocity; /* negative while it still moves the other way */
    bool must_brake = speed > 0 && (int64_t)speed * speed >= 2 * (int64_t)AXIS_ACCELERATION * distance;
    speed += must_brake ? -AXIS_ACCELERATION : AXIS_ACCELERATION;
    if (speed > self->top_speed)
        speed = self->top_speed;
    if (must_brake && speed < AXIS_ACCELERATION)
        speed = AXIS_ACCELERATION;
    if (speed >= distance) {
        self->position = self->target;
        axis_stop(self);
        return AXIS_ARRIVED;
    }
    self->velocity = sign * speed;
    self->position += self->velocity;
    return AXIS_NOTHING;
}

bool axis_at(const axis *self, int32_t counts)
{
    int32_t error = self->position - counts * AXIS_SCALE;
    return error <= 2 * AXIS_SCALE && error >= -2 * AXIS_SCALE;
}
