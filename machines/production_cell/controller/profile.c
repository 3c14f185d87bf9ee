#include "profile.h"

/* The whole part of a square root. */
static int64_t root(int64_t of)
{
    uint64_t left = (uint64_t)of, found = 0u, bit = UINT64_C(1) << 62;
    while (bit > left)
        bit >>= 2;
    for (; bit != 0u; bit >>= 2) {
        if (left >= found + bit) {
            left -= found + bit;
            found = (found >> 1) + bit;
        } else {
            found >>= 1;
        }
    }
    return (int64_t)found;
}

/* With v = n a + r and 0 <= r < a the velocities to come are v - a, v - 2 a ... r, and then 0. */
int64_t profile_braking(int64_t velocity, int64_t top_acceleration)
{
    const int64_t n = velocity / top_acceleration;
    return n * velocity - top_acceleration * (n * (n + 1) / 2);
}

/* v and what follows it is (n + 1) v - a n (n + 1) / 2, which grows with v, and is a n (n + 1) / 2
 * where v = n a: so n is found first, as the largest that fits, and then v. It reaches the target
 * exactly as below a, where n = 0, the velocity is the distance itself. */
int64_t profile_allowed(int64_t distance, int64_t top_acceleration)
{
    const int64_t pairs = 2 * (distance / top_acceleration); /* n (n + 1) is at most this */
    int64_t n = (root(4 * pairs + 1) - 1) / 2;
    return (distance + top_acceleration * (n * (n + 1) / 2)) / (n + 1);
}

void profile_place(profile *self, int64_t position)
{
    self->position = position;
    self->target = position;
    self->velocity = 0;
    self->acceleration = 0;
}

void profile_goto(profile *self, int64_t target, int64_t top_speed)
{
    self->target = target;
    self->top_speed = top_speed;
}

void profile_hold(profile *self)
{
    const int64_t speed = self->velocity < 0 ? -self->velocity : self->velocity;
    const int64_t way = profile_braking(speed, self->top_acceleration);
    self->target = self->position + (self->velocity < 0 ? -way : way);
}

void profile_step(profile *self)
{
    const int64_t sign = self->target < self->position ? -1 : 1;
    const int64_t a = self->top_acceleration;
    const int64_t was = sign * self->velocity; /* negative while it still moves the other way */
    int64_t speed = profile_allowed(sign * (self->target - self->position), a);
    if (speed > self->top_speed)
        speed = self->top_speed;
    if (speed > was + a)
        speed = was + a;
    if (speed < was - a)
        speed = was - a;
    self->acceleration = sign * (speed - was);
    self->velocity = sign * speed;
    self->position += self->velocity;
}

void profile_shift(profile *self, int64_t by)
{
    self->position -= by;
    self->target -= by;
}

bool profile_is_done(const profile *self)
{
    return self->position == self->target && self->velocity == 0;
}
