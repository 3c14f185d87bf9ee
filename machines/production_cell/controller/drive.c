#include "drive.h"

#include <stddef.h>
#include <string.h>

enum {
    FAR_COUNTS = 8000,  /* further than any axis with a switch can go */
    OFF_COUNTS = 400    /* further than any switch reaches */
};

drive_parameters drive_defaults(bool has_marks)
{
    drive blank;
    memset(&blank, 0, sizeof blank);
    (void)drive_set(&blank, "kp", 60.0);
    (void)drive_set(&blank, "ki", 200.0);
    (void)drive_set(&blank, "kd", 1.0);
    (void)drive_set(&blank, "kv", 4096.0 / 3000.0);
    (void)drive_set(&blank, "ka", 0.04 * 4096.0 / 3000.0);
    (void)drive_set(&blank, "kf", 250.0);
    (void)drive_set(&blank, "limit", DRIVE_FULL);
    (void)drive_set(&blank, "lag_ms", 6.0);
    (void)drive_set(&blank, "full_speed", 3500.0);
    (void)drive_set(&blank, "top_speed", 2400.0);
    (void)drive_set(&blank, "top_acceleration", 14000.0);
    (void)drive_set(&blank, "tolerance", 4.0);
    (void)drive_set(&blank, "place_tolerance", 12.0);
    (void)drive_set(&blank, "stall_error", 150.0);
    (void)drive_set(&blank, "settle_ms", 10.0);
    (void)drive_set(&blank, "stall_ms", 60.0);
    (void)drive_set(&blank, "mark", 5.0);
    blank.parameters.has_marks = has_marks;
    return blank.parameters;
}

void drive_init(drive *self, const drive_parameters *parameters)
{
    memset(self, 0, sizeof *self);
    self->parameters = *parameters;
    self->profile.top_acceleration = parameters->top_acceleration;
    self->profile.top_speed = parameters->top_speed;
}

/* ---- parameters ---------------------------------------------------------------------------------- */

typedef struct {
    const char *name;
    size_t offset;
    double scale, least, most; /* value times scale is what is stored */
    bool is_wide;              /* 64 bits */
} setting;

#define ONE 65536.0
#define NARROW(name, member, scale, least, most)                                                   \
    {name, offsetof(drive_parameters, member), scale, least, most, false}
#define WIDE(name, member, scale, least, most)                                                     \
    {name, offsetof(drive_parameters, member), scale, least, most, true}

static const setting settings[] = {
    NARROW("kp", gains.kp, ONE, 0, 4096),
    NARROW("ki", gains.ki, ONE, 0, 16384),
    NARROW("kd", gains.kd, ONE, 0, 256),
    NARROW("kv", gains.kv, ONE, 0, 256),
    NARROW("ka", gains.ka, ONE, 0, 16),
    NARROW("kf", gains.kf, ONE, 0, DRIVE_FULL),
    NARROW("limit", gains.limit, 1, 0, DRIVE_FULL),
    NARROW("lag_ms", gains.lag, 1, 1, 1000),
    WIDE("full_speed", full_speed, ONE / 1000, 1, 60000),
    WIDE("top_speed", top_speed, ONE / 1000, 1, 60000),
    WIDE("top_acceleration", top_acceleration, ONE / 1e6, 100, 60000),
    WIDE("tolerance", tolerance, ONE, 0, 1000),
    WIDE("place_tolerance", place_tolerance, ONE, 0, 1000),
    WIDE("stall_error", stall_error, ONE, 1, 10000),
    WIDE("mark", mark, ONE, 0, 100),
    NARROW("settle_ms", settle_ms, 1, 1, 10000),
    NARROW("stall_ms", stall_ms, 1, 1, 10000),
};

bool drive_set(drive *self, const char *name, double value)
{
    unsigned char *const bytes = (unsigned char *)&self->parameters;
    for (size_t i = 0; i < sizeof settings / sizeof settings[0]; i++) {
        const setting *s = &settings[i];
        int64_t wide;
        int32_t narrow;
        if (strcmp(s->name, name) != 0)
            continue;
        if (!(value >= s->least && value <= s->most)) /* no number, too */
            return false;
        wide = (int64_t)(value * s->scale + 0.5);
        narrow = (int32_t)wide;
        if (s->is_wide)
            memcpy(bytes + s->offset, &wide, sizeof wide);
        else
            memcpy(bytes + s->offset, &narrow, sizeof narrow);
        return true;
    }
    return false;
}

/* ---- commands ------------------------------------------------------------------------------------ */

static void begin(drive *self, drive_mode mode)
{
    self->mode = mode;
    self->settled_ms = 0;
    self->stalled_ms = 0;
    self->has_arrived = false;
    self->has_stalled = false;
}

void drive_enable(drive *self)
{
    if (self->mode != DRIVE_OFF)
        return;
    profile_place(&self->profile, self->measured);
    pid_reset(&self->pid, self->measured);
    begin(self, DRIVE_HOLDING);
}

void drive_disable(drive *self)
{
    begin(self, DRIVE_OFF);
}

void drive_hold(drive *self)
{
    if (self->mode == DRIVE_OFF)
        return;
    profile_hold(&self->profile);
    begin(self, DRIVE_HOLDING);
}

static void head_for(drive *self, int64_t target, int32_t percent, drive_mode mode)
{
    self->speed = self->parameters.full_speed * percent / 100;
    self->profile.target = target;
    begin(self, mode);
}

void drive_seek(drive *self, int32_t percent)
{
    if (self->mode == DRIVE_OFF)
        return;
    if (self->parameters.has_marks)
        head_for(self, self->profile.position + FAR_COUNTS * PROFILE_ONE, percent,
                 DRIVE_LOOKING);
    else
        head_for(self, self->profile.position + OFF_COUNTS * PROFILE_ONE, percent,
                 DRIVE_LEAVING_SWITCH);
}

void drive_goto(drive *self, int32_t counts, int32_t percent)
{
    if (self->mode != DRIVE_OFF)
        head_for(self, counts * PROFILE_ONE, percent, DRIVE_MOVING);
}

static void shift(drive *self, int64_t by)
{
    self->measured -= by;
    profile_shift(&self->profile, by);
    pid_shift(&self->pid, by);
    self->has_origin = true;
}

void drive_zero(drive *self)
{
    shift(self, self->profile.target);
}

/* ---- once a millisecond -------------------------------------------------------------------------- */

static void measure(drive *self, int32_t encoder)
{
    const uint32_t read = (uint32_t)encoder;
    const uint32_t moved = self->has_encoder ? read - self->encoder : 0u;
    const int64_t counts = moved < UINT32_C(0x80000000) ? (int64_t)moved
                                                        : (int64_t)moved - INT64_C(0x100000000);
    self->encoder = read;
    self->has_encoder = true;
    self->measured += counts * PROFILE_ONE;
}

static bool is_near(int64_t a, int64_t b, int64_t tolerance)
{
    return a - b <= tolerance && b - a <= tolerance;
}

static bool has_stalled(drive *self)
{
    const drive_parameters *p = &self->parameters;
    if (is_near(self->measured, self->profile.position, p->stall_error)) {
        self->stalled_ms = 0;
        return false;
    }
    self->stalled_ms++;
    if (self->has_stalled || self->stalled_ms < p->stall_ms)
        return false;
    self->has_stalled = true;
    return true;
}

static bool has_settled(drive *self)
{
    const drive_parameters *p = &self->parameters;
    if (!profile_is_done(&self->profile) ||
        !is_near(self->measured, self->profile.target, p->tolerance)) {
        self->settled_ms = 0;
        return false;
    }
    self->settled_ms++;
    if (self->has_arrived || self->settled_ms < p->settle_ms)
        return false;
    self->has_arrived = true;
    return true;
}

static void settle_on_mark(drive *self, int64_t middle)
{
    shift(self, middle);
    self->profile.target = 0;
    self->mode = DRIVE_SETTLING;
}

/* Whoever stands on a mark stays, no further off than the mark is wide. The others come from before
 * it: there it begins. */
static void seek_mark(drive *self, bool limit)
{
    const int64_t mark = self->parameters.mark;
    if (self->mode == DRIVE_LOOKING && limit)
        settle_on_mark(self, self->has_origin && is_near(self->measured, 0, mark) ? 0 : self->measured);
    else if (limit)
        settle_on_mark(self, self->measured + mark);
    else
        self->mode = DRIVE_SEEKING_MARK;
}

static unsigned seek_switch(drive *self, bool limit)
{
    if (self->mode == DRIVE_LEAVING_SWITCH && !limit) {
        self->mode = DRIVE_SEEKING;
        self->profile.target = self->profile.position - FAR_COUNTS * PROFILE_ONE;
    } else if (self->mode == DRIVE_SEEKING && limit) {
        shift(self, self->measured);
        drive_hold(self);
        return DRIVE_LIMIT;
    }
    return 0u;
}

unsigned drive_sense(drive *self, int32_t encoder, bool limit)
{
    unsigned events;
    measure(self, encoder);
    if (self->mode == DRIVE_OFF)
        return 0u;
    events = has_stalled(self) ? DRIVE_STALL : 0u;
    switch (self->mode) {
    case DRIVE_MOVING:
        if (has_settled(self))
            events |= DRIVE_ARRIVED;
        break;
    case DRIVE_LEAVING_SWITCH:
    case DRIVE_SEEKING:
        events |= seek_switch(self, limit);
        break;
    case DRIVE_LOOKING:
    case DRIVE_SEEKING_MARK:
        seek_mark(self, limit);
        break;
    case DRIVE_SETTLING:
        if (has_settled(self)) {
            drive_hold(self);
            events |= DRIVE_LIMIT;
        }
        break;
    case DRIVE_OFF:
    case DRIVE_HOLDING:
        break;
    }
    return events;
}

int32_t drive_control(drive *self)
{
    const drive_parameters *p = &self->parameters;
    profile *const motion = &self->profile;
    if (self->mode == DRIVE_OFF) {
        profile_place(motion, self->measured);
        return 0;
    }
    motion->top_acceleration = p->top_acceleration;
    motion->top_speed = self->speed < p->top_speed ? self->speed : p->top_speed;
    profile_step(motion);
    return pid_step(&self->pid, &p->gains, motion->position, motion->velocity, motion->acceleration,
                    self->measured);
}

bool drive_is_at(const drive *self, int32_t counts)
{
    const bool rests = self->mode == DRIVE_OFF || self->mode == DRIVE_HOLDING || self->has_arrived;
    return self->has_origin && rests && self->profile.velocity == 0 &&
           is_near(self->measured, counts * PROFILE_ONE, self->parameters.place_tolerance);
}

void drive_act(drive *self, int32_t *pwm, bool *enable)
{
    *pwm = drive_control(self);
    *enable = self->mode != DRIVE_OFF;
}
