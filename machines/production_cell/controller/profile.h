/* A motion profile of second order: velocity and acceleration are bounded, the target is reached
 * exactly and at rest, and target and top speed may change at any time, while it moves as well.
 *
 * Integer, one step a millisecond. A length is in 1/65536 count, a velocity in that a millisecond, an
 * acceleration in that a millisecond squared: so every compiler and processor gives the same motion,
 * which floating point gives only as long as nobody contracts a multiplication and an addition, and
 * positions do not lose places while a belt runs for days, as they are 64 bits wide. */
#ifndef PROFILE_H
#define PROFILE_H

#include <stdbool.h>
#include <stdint.h>

#define PROFILE_ONE INT64_C(65536) /* a count */

/* Bounds for what the caller gives; within them nothing overflows. */
#define PROFILE_MOST_LENGTH (INT64_C(1) << 56)   /* of a position, either way */
#define PROFILE_MOST_DISTANCE (INT64_C(1) << 48) /* from target to target */
#define PROFILE_MOST_SPEED (INT64_C(1) << 24)    /* 256 counts a millisecond */

typedef struct {
    int64_t position, velocity, acceleration; /* the setpoint of this millisecond */
    int64_t target;
    int64_t top_speed;        /* positive; at most PROFILE_MOST_SPEED */
    int64_t top_acceleration; /* positive; at most PROFILE_MOST_SPEED */
} profile;

/* Be at rest at a position. */
void profile_place(profile *self, int64_t position);

/* Go to a position. From a velocity that cannot be stopped before it, overshoot and come back. */
void profile_goto(profile *self, int64_t target, int64_t top_speed);

/* Come to rest as soon as the acceleration allows. */
void profile_hold(profile *self);

/* Advance by a millisecond. */
void profile_step(profile *self);

/* Move the origin of positions: what was `by` is 0 from now on. */
void profile_shift(profile *self, int64_t by);

/* Whether it is at rest at its target. */
bool profile_is_done(const profile *self);

/* How far it still goes when a velocity, not negative, is reduced from the next millisecond on. */
int64_t profile_braking(int64_t velocity, int64_t top_acceleration);

/* The largest velocity of the next millisecond from which it can still stop within a distance, not
 * negative. */
int64_t profile_allowed(int64_t distance, int64_t top_acceleration);

#endif
