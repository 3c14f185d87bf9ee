/* A position controller: proportional, integral and derivative action, and what the motion is known
 * to need beforehand (feed-forward), from a setpoint and an encoder, once a millisecond.
 *
 * Integer like the profile. Gains are in 1/65536 of the units named; the output is in steps of the
 * pulse width, at most `limit` either way. */
#ifndef PID_H
#define PID_H

#include <stdint.h>

typedef struct {
    int32_t kp; /* a count of error */
    int32_t ki; /* a count of error, each second */
    int32_t kd; /* a count a second of difference in velocity */
    int32_t kv; /* a count a second of velocity of the setpoint */
    int32_t ka; /* a count a second squared of acceleration of the setpoint */
    int32_t kf; /* moving at all: against dry friction */
    int32_t limit; /* of the output, in steps */
    int32_t lag; /* of the filter of the measured velocity, in milliseconds; at least 1 */
} pid_gains;

typedef struct {
    int64_t sum;      /* integral of the error: 1/65536 count, times milliseconds */
    int64_t velocity; /* measured and filtered: 1/65536 count a millisecond */
    int64_t before;   /* measured position a millisecond ago */
} pid;

/* Begin at a measured position, at rest. */
void pid_reset(pid *self, int64_t measured);

/* The output for this millisecond. Positions in 1/65536 count, velocity and acceleration in that a
 * millisecond (squared). The integral does not grow while the output is at its limit and would only go
 * further beyond it. */
int32_t pid_step(pid *self, const pid_gains *gains, int64_t position, int64_t velocity,
                 int64_t acceleration, int64_t measured);

/* Move the origin of positions. */
void pid_shift(pid *self, int64_t by);

#endif
