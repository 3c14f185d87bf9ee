#include "pid.h"

enum { PER_SECOND = 1000 };

#define ONE INT64_C(65536)
#define MOST_ERROR (INT64_C(1) << 32) /* 65536 counts; 2^31 of a gain times this is within 64 bits */
#define MOST_SUM (INT64_C(1) << 42)   /* 2^20 counts, times a second over a thousand */

static int64_t within(int64_t value, int64_t most)
{
    return value > most ? most : value < -most ? -most : value;
}

/* A gain in 1/65536 times a quantity in 1/65536, in 1/65536. */
static int64_t scaled(int32_t gain, int64_t quantity)
{
    return within(quantity, MOST_ERROR - 1) * gain / ONE;
}

void pid_reset(pid *self, int64_t measured)
{
    self->sum = 0;
    self->velocity = 0;
    self->before = measured;
}

int32_t pid_step(pid *self, const pid_gains *gains, int64_t position, int64_t velocity,
                 int64_t acceleration, int64_t measured)
{
    const int64_t error = within(position - measured, MOST_ERROR - 1);
    const int64_t moved = within(measured - self->before, MOST_ERROR - 1);
    const int64_t most = gains->limit * ONE;
    int64_t out, sum, whole;
    self->before = measured;
    self->velocity += (moved - self->velocity) / gains->lag;
    out = scaled(gains->kp, error);
    out += scaled(gains->kd, (velocity - self->velocity) * PER_SECOND);
    out += scaled(gains->kv, velocity * PER_SECOND);
    out += scaled(gains->ka, acceleration * PER_SECOND * PER_SECOND);
    if (velocity != 0)
        out += velocity > 0 ? gains->kf : -(int64_t)gains->kf;
    sum = within(self->sum + error, MOST_SUM);
    whole = out + scaled(gains->ki, sum / PER_SECOND);
    if ((whole > most && error > 0) || (whole < -most && error < 0))
        whole = out + scaled(gains->ki, self->sum / PER_SECOND);
    else
        self->sum = sum;
    return (int32_t)(within(whole, most) / ONE);
}

void pid_shift(pid *self, int64_t by)
{
    self->before -= by;
}
