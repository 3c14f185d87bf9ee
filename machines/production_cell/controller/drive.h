/* A controlled axis: profile, position controller, homing, and what it tells the machine.
 *
 * Once a millisecond: drive_sense with what was measured, whose answer is posted as events; then the
 * machine runs and calls the commands; then drive_control gives the pulse width. */
#ifndef DRIVE_H
#define DRIVE_H

#include "pid.h"
#include "profile.h"

#include <stdbool.h>
#include <stdint.h>

#define DRIVE_FULL 4096 /* steps of the pulse width at full torque */

/* Lengths in 1/65536 count, velocities in that a millisecond, and so on, as in profile.h. Any may be
 * changed between two steps; see drive_set. */
typedef struct {
    pid_gains gains;
    int64_t full_speed;       /* what 100 percent ask for */
    int64_t top_speed;        /* what is never exceeded, whatever is asked for */
    int64_t top_acceleration;
    int64_t tolerance;        /* about a target, within which it has arrived */
    int64_t place_tolerance;  /* about a place, within which it still is there */
    int64_t stall_error;      /* between setpoint and measurement */
    int64_t mark;             /* half the width of a mark */
    int32_t settle_ms;        /* this long within the tolerance: arrived */
    int32_t stall_ms;         /* this long beyond stall_error: stalled */
    bool has_marks;           /* all along its way, of which any is as good, not one switch at its end */
} drive_parameters;

typedef enum {
    DRIVE_OFF,
    DRIVE_HOLDING,
    DRIVE_MOVING,
    DRIVE_LEAVING_SWITCH, /* it stood on the switch when it was to seek it */
    DRIVE_SEEKING,
    DRIVE_LOOKING,        /* whether it stands on a mark */
    DRIVE_SEEKING_MARK,
    DRIVE_SETTLING        /* on the mark it found */
} drive_mode;

enum { DRIVE_ARRIVED = 1, DRIVE_LIMIT = 2, DRIVE_STALL = 4 };

typedef struct {
    drive_parameters parameters;
    profile profile;
    pid pid;
    drive_mode mode;
    int64_t measured; /* 1/65536 count from the origin */
    int64_t speed;    /* asked for by the last command */
    uint32_t encoder; /* as read last */
    int32_t settled_ms, stalled_ms;
    bool has_encoder; /* it was read */
    bool has_origin;  /* it was homed since power-up */
    bool has_arrived; /* and said so */
    bool has_stalled; /* and said so */
} drive;

/* An axis without power, with these parameters. */
void drive_init(drive *self, const drive_parameters *parameters);

/* Reasonable parameters for an axis of about 3000 counts a second at full torque. */
drive_parameters drive_defaults(bool has_marks);

/* Change a parameter by its name, in counts, seconds and steps of the pulse width; false, and
 * nothing changed, if there is none of this name or the value is out of its range. Names: kp ki kd kv ka
 * kf limit lag_ms full_speed top_speed top_acceleration tolerance place_tolerance stall_error mark
 * settle_ms stall_ms. */
bool drive_set(drive *self, const char *name, double value);

/* ---- commands ---------------------------------------------------------------------------------- */

void drive_enable(drive *self);
void drive_disable(drive *self);
void drive_hold(drive *self);

/* Find the origin, until DRIVE_LIMIT: towards the limit switch, which is at position 0; from on it, off
 * it first. With marks: to the middle of the next one ahead, or of that on which it stands. */
void drive_seek(drive *self, int32_t percent);

/* To a position in counts, until DRIVE_ARRIVED. */
void drive_goto(drive *self, int32_t counts, int32_t percent);

/* Where it stands, or is bound for, is the origin. */
void drive_zero(drive *self);

/* ---- once a millisecond -------------------------------------------------------------------------- */

/* Take in the encoder (counts modulo 2^32) and the switch; returns what happened, as a sum of
 * DRIVE_ARRIVED, DRIVE_LIMIT, DRIVE_STALL. */
unsigned drive_sense(drive *self, int32_t encoder, bool limit);

/* Advance the motion; returns the pulse width, 0 without power. */
int32_t drive_control(drive *self);

/* The same for a motor: its pulse width, and whether it has power. */
void drive_act(drive *self, int32_t *pwm, bool *enable);

/* Whether it was homed and stands at a position, in counts. */
bool drive_is_at(const drive *self, int32_t counts);

#endif
