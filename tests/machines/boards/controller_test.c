/* Tests of profile, position controller and drive; prints what it measured, ends with 0 if all holds.
 *
 * Usage: controller_test TRIALS */
#include "drive.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define ONE ((double)PROFILE_ONE)

static unsigned failures;
static uint64_t seed = 1;

static void fail(const char *what, long trial)
{
    if (failures++ < 10)
        printf("FAILED: %s, trial %ld\n", what, trial);
}

/* xorshift64* of Vigna; least..most. */
static int64_t any(int64_t least, int64_t most)
{
    seed ^= seed >> 12;
    seed ^= seed << 25;
    seed ^= seed >> 27;
    return least + (int64_t)((seed * UINT64_C(2685821657736338717)) % (uint64_t)(most - least + 1));
}

/* ---- profile ----------------------------------------------------------------------------------- */

/* A step, and whether it kept to the limits. `fastest` is the top speed, or what it brakes from. */
static int64_t checked_step(profile *p, int64_t fastest, long trial)
{
    const profile was = *p;
    const int64_t was_speed = llabs(was.velocity);
    int64_t speed;
    profile_step(p);
    speed = llabs(p->velocity);
    if (p->velocity - was.velocity != p->acceleration)
        fail("acceleration is the change of velocity", trial);
    if (p->position - was.position != p->velocity)
        fail("velocity is the change of position", trial);
    if (llabs(p->acceleration) > p->top_acceleration)
        fail("acceleration is bounded", trial);
    if (speed > fastest && speed > p->top_speed)
        fail("velocity is bounded", trial);
    if (was_speed <= p->top_speed && speed > p->top_speed)
        fail("velocity stays bounded", trial);
    return speed;
}

static void run_to_the_end(profile *p, int64_t fastest, long trial, long most)
{
    long steps = 0;
    while (!profile_is_done(p) && steps++ < most)
        fastest = checked_step(p, fastest, trial);
    if (!profile_is_done(p) || p->position != p->target)
        fail("it arrives exactly", trial);
    profile_step(p);
    if (!profile_is_done(p) || p->acceleration != 0)
        fail("it stays", trial);
}

/* From rest to rest, against the time of a trapezoid in continuous time. */
static double profile_from_rest(long trial)
{
    profile p = {0};
    const int64_t a = any(1, 4000), v = any(1, 600000);
    const int64_t d = any(-3000 * PROFILE_ONE, 3000 * PROFILE_ONE);
    const double distance = (double)llabs(d), top = (double)v, rate = (double)a;
    const double ideal = distance * rate >= top * top ? distance / top + top / rate
                                                      : 2.0 * sqrt(distance / rate);
    long steps = 0;
    p.top_acceleration = a;
    profile_place(&p, any(-1000000 * PROFILE_ONE, 1000000 * PROFILE_ONE));
    profile_goto(&p, p.position + d, v);
    if (ideal > 200000.0)
        return 0.0;
    while (!profile_is_done(&p) && steps < 400000) {
        const int64_t was = p.position;
        (void)checked_step(&p, 0, trial);
        if ((d > 0 ? p.position < was : p.position > was) ||
            (d > 0 ? p.position > p.target : p.position < p.target))
            fail("it goes straight there", trial);
        steps++;
    }
    if (p.position != p.target)
        fail("it arrives exactly", trial);
    if ((double)steps < ideal - 2.0)
        fail("it is no faster than can be", trial);
    return (double)steps - ideal;
}

/* New targets, top speeds and holds while it moves. */
static void profile_changed_on_the_way(long trial)
{
    profile p = {0};
    int64_t fastest = 0;
    p.top_acceleration = any(50, 4000);
    p.top_speed = 1;
    profile_place(&p, 0);
    for (int change = 0; change < 12; change++) {
        int64_t steps = any(1, 400);
        if (any(0, 3) == 0) {
            const int64_t sign = p.velocity < 0 ? -1 : 1;
            profile_hold(&p);
            while (!profile_is_done(&p)) {
                fastest = checked_step(&p, fastest, trial);
                if (p.velocity * sign < 0)
                    fail("it holds without turning round", trial);
            }
        } else {
            profile_goto(&p, any(-2000 * PROFILE_ONE, 2000 * PROFILE_ONE), any(1000, 600000));
        }
        while (steps-- > 0)
            fastest = checked_step(&p, fastest, trial);
    }
    run_to_the_end(&p, fastest, trial, 5000000);
}

static void profiles(long trials)
{
    double worst = 0.0;
    for (long trial = 0; trial < trials; trial++) {
        const double late = profile_from_rest(trial);
        worst = late > worst ? late : worst;
        profile_changed_on_the_way(trial);
    }
    if (worst > 8.0)
        fail("it is hardly slower than can be", 0);
    printf("profile: %ld trials, at most %.1f ms later than a trapezoid in continuous time\n",
           trials, worst);
}

/* ---- controller against an axis with an exact solution ------------------------------------------ */

/* An axis of second order: v' = (gain u - v) / lag, x' = v. For a constant u over a time h exactly:
 * v(h) = gain u + (v - gain u) e, x(h) = x + gain u h + (v - gain u) lag (1 - e), with e = exp(-h / lag). */
typedef struct {
    double x, v, gain, lag, friction, stiction;
} plant;

static void plant_step(plant *p, int32_t pwm)
{
    const double h = 0.001, e = exp(-h / p->lag);
    const double against = p->v != 0.0 ? copysign(p->friction, p->v) : copysign(p->friction, pwm);
    const double end = p->gain * (pwm - against), was = p->v;
    if (was == 0.0 && abs(pwm) <= p->stiction)
        return;
    p->x += end * h + (was - end) * p->lag * (1.0 - e);
    p->v = end + (was - end) * e;
    if (p->friction > 0.0 && p->v * was < 0.0)
        p->v = 0.0; /* friction brings to rest, and never beyond */
}

/* Let the controller hold an axis that is `away` counts off; return the output so far away from that
 * of the linear closed loop in exact discrete time, which is solved beside it in floating point. */
static void pid_is_linear(void)
{
    const pid_gains gains = {14 * 65536, 60 * 65536, 6553, 0, 0, 0, 4096, 4};
    pid self;
    double x = 0.0, sum = 0.0, filtered = 0.0, before = 0.0, worst = 0.0;
    plant p = {0.0, 0.0, 3000.0 / 4096.0, 0.04, 0.0, 0.0};
    pid_reset(&self, 0);
    for (int i = 0; i < 2000; i++) {
        const int64_t measured = (int64_t)floor(p.x * ONE + 0.5); /* a fine encoder */
        const int32_t out = pid_step(&self, &gains, 100 * PROFILE_ONE, 0, 0, measured);
        double expected;
        x = (double)measured / ONE;
        filtered += (x - before - filtered) / 4.0;
        before = x;
        expected = 14.0 * (100.0 - x) - 6553.0 / 65536.0 * filtered * 1000.0;
        sum += (100.0 - x) / 1000.0;
        expected += 60.0 * sum;
        worst = fmax(worst, fabs(expected - out));
        plant_step(&p, out);
    }
    if (worst > 1.5)
        fail("the output is that of the difference equation", 0);
    if (fabs(p.x - 100.0) > 0.5)
        fail("it gets there", 0);
    printf("controller: at most %.2f steps of the pulse width beside the difference equation\n", worst);
}

/* Poles: with kp alone the closed loop is lag s^2 + s + gain kp = 0; compare with its step response. */
static void pid_is_analytic(void)
{
    const double gain = 3000.0 / 4096.0, lag = 0.04, kp = 20.0;
    const pid_gains gains = {20 * 65536, 0, 0, 0, 0, 0, 4096, 1};
    const double w0 = sqrt(gain * kp / lag), zeta = 1.0 / (2.0 * lag * w0), wd = w0 * sqrt(1 - zeta * zeta);
    plant p = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    pid self;
    double worst = 0.0;
    p.gain = gain;
    p.lag = lag;
    pid_reset(&self, 0);
    for (int i = 1; i <= 1500; i++) {
        const double t = i / 1000.0 - 0.0005; /* an output that is held lags by half a period */
        const double response =
            100.0 * (1.0 - exp(-zeta * w0 * t) * (cos(wd * t) + zeta * w0 / wd * sin(wd * t)));
        const int64_t measured = (int64_t)floor(p.x * ONE + 0.5);
        plant_step(&p, pid_step(&self, &gains, 100 * PROFILE_ONE, 0, 0, measured));
        worst = fmax(worst, fabs(p.x - response));
    }
    if (worst > 1.0)
        fail("the step response is that of the differential equation", 0);
    printf("controller: at most %.2f %% beside the step response of the differential equation\n", worst);
}

/* Held against a stop with the output at its limit, the integral does not grow. */
static void pid_does_not_wind_up(void)
{
    const pid_gains gains = {14 * 65536, 600 * 65536, 0, 0, 0, 0, 1000, 1};
    pid self;
    int32_t out = 0;
    pid_reset(&self, 0);
    for (int i = 0; i < 100000; i++) {
        out = pid_step(&self, &gains, 200 * PROFILE_ONE, 0, 0, 0);
        if (out > 1000)
            fail("the output is limited", i);
    }
    out = pid_step(&self, &gains, -10 * PROFILE_ONE, 0, 0, 0);
    if (out > 0)
        fail("the other way it pushes at once", 0);
}

/* ---- drive ---------------------------------------------------------------------------------------- */

typedef struct {
    drive drive;
    plant plant;
    double least; /* the limit switch is pressed at 0 or less; an end stop stands here */
    int32_t base; /* what the encoder says at 0 */
    double worst; /* tracking error, in counts */
    bool jammed, has_marks;
} rig;

/* Belts have a mark at each 1000 counts, 5 to each side. */
static bool is_closed(const rig *r)
{
    if (r->has_marks)
        return fabs(r->plant.x - 1000.0 * floor(r->plant.x / 1000.0 + 0.5)) <= 5.0;
    return r->plant.x <= 0.0;
}

static unsigned rig_step(rig *r)
{
    unsigned events;
    const int32_t encoder = (int32_t)floor(r->plant.x + r->base);
    events = drive_sense(&r->drive, encoder, is_closed(r));
    if (!r->jammed)
        plant_step(&r->plant, drive_control(&r->drive));
    else
        (void)drive_control(&r->drive);
    if (r->plant.x < r->least) {
        r->plant.x = r->least;
        r->plant.v = 0.0;
    }
    r->worst = fmax(r->worst, fabs((double)(r->drive.profile.position - r->drive.measured) / ONE));
    return events;
}

/* Step until an event; returns the milliseconds, or -1 after `most`. */
static long until(rig *r, unsigned event, long most)
{
    for (long ms = 1; ms <= most; ms++)
        if ((rig_step(r) & event) != 0u)
            return ms;
    return -1;
}

static rig any_rig(double x, bool has_marks)
{
    const drive_parameters parameters = drive_defaults(has_marks);
    rig r;
    memset(&r, 0, sizeof r);
    drive_init(&r.drive, &parameters);
    r.plant.x = x;
    r.plant.gain = 3000.0 / 4096.0 * (double)any(95, 115) / 100.0;
    r.plant.lag = 0.04 * (double)any(85, 115) / 100.0;
    r.plant.friction = (double)any(200, 400);
    r.plant.stiction = 1.25 * r.plant.friction;
    r.least = has_marks ? -1e9 : -60.0;
    r.has_marks = has_marks;
    r.base = (int32_t)any(-100000, 100000);
    return r;
}

static void home(rig *r, long trial)
{
    (void)rig_step(r);
    drive_enable(&r->drive);
    drive_seek(&r->drive, 20);
    if (until(r, DRIVE_LIMIT, 8000) < 0)
        fail("it finds its switch", trial);
    if (fabs(r->plant.x - (double)r->drive.measured / ONE) > 2.0)
        fail("it knows where it is", trial);
}

static void drives(long trials)
{
    double worst = 0.0;
    long slowest = 0;
    for (long trial = 0; trial < trials; trial++) {
        rig r = any_rig((double)any(-50, 3000), false);
        home(&r, trial);
        r.worst = 0.0;
        for (int i = 0; i < 6; i++) {
            const int32_t target = (int32_t)any(0, 3100);
            long took;
            drive_goto(&r.drive, target, i % 2 == 0 ? 100 : 20);
            if (i == 3)
                (void)until(&r, DRIVE_ARRIVED, any(1, 300));
            if (i == 3)
                drive_goto(&r.drive, target, 100);
            took = until(&r, DRIVE_ARRIVED, 6000);
            if (took < 0)
                fail("it arrives", trial);
            if (i % 2 == 0 && took > slowest)
                slowest = took;
            if (!drive_is_at(&r.drive, target) || fabs(r.plant.x - target) > 8.0)
                fail("it is there", trial);
            if (until(&r, DRIVE_ARRIVED | DRIVE_STALL | DRIVE_LIMIT, 300) != -1)
                fail("it says so once", trial);
        }
        worst = fmax(worst, r.worst);
        drive_goto(&r.drive, r.drive.profile.position > 1500 * PROFILE_ONE ? 0 : 3000, 100);
        (void)until(&r, DRIVE_ARRIVED, 100);
        r.jammed = true;
        if (until(&r, DRIVE_STALL, 400) < 0)
            fail("it notices a jam", trial);
        drive_disable(&r.drive);
        if (drive_control(&r.drive) != 0)
            fail("without power it does not push", trial);
    }
    if (worst > 60.0)
        fail("it follows its profile", 0);
    printf("drive: %ld axes, at most %.1f counts beside the profile, 3100 counts in %ld ms at most\n",
           trials, worst, slowest);
}

/* How far a belt is from the mark it should be at. */
static double off(const rig *r, long pitches)
{
    return fabs(r->plant.x - 1000.0 * (double)pitches);
}

/* A belt that is stopped anywhere ends the pitch. */
static void belts(long trials)
{
    double worst = 0.0;
    for (long trial = 0; trial < trials; trial++) {
        rig r = any_rig((double)any(-900, 0), true);
        long pitches = 0;
        (void)rig_step(&r);
        drive_enable(&r.drive);
        drive_seek(&r.drive, 20);
        if (until(&r, DRIVE_LIMIT, 3000) < 0)
            fail("it finds a mark", trial);
        for (int i = 0; i < 20; i++) {
            drive_goto(&r.drive, 1000, 100);
            pitches++;
            if (i % 5 == 4) { /* the power fails on the way */
                const drive_parameters its = r.drive.parameters;
                (void)until(&r, DRIVE_ARRIVED, any(100, 300));
                drive_disable(&r.drive);
                (void)until(&r, DRIVE_ARRIVED, 500);
                if (i % 10 == 9) /* and the board */
                    drive_init(&r.drive, &its);
                (void)rig_step(&r);
                drive_enable(&r.drive);
                drive_seek(&r.drive, 20);
                if (until(&r, DRIVE_LIMIT, 3000) < 0)
                    fail("it ends the pitch", trial);
            } else {
                if (until(&r, DRIVE_ARRIVED, 2000) < 0)
                    fail("it turns by a pitch", trial);
                drive_zero(&r.drive);
            }
            worst = fmax(worst, off(&r, pitches));
            if (off(&r, pitches) > 10.0 || !drive_is_at(&r.drive, 0))
                fail("it stands on a mark", trial);
        }
    }
    printf("belts: at most %.1f counts beside a mark\n", worst);
}

static void parameters(void)
{
    const drive_parameters defaults = drive_defaults(false);
    drive d;
    drive_init(&d, &defaults);
    if (!drive_set(&d, "kp", 1.5) || d.parameters.gains.kp != 98304)
        fail("a gain is set", 0);
    if (!drive_set(&d, "top_speed", 1000.0) || d.parameters.top_speed != PROFILE_ONE)
        fail("a speed is set", 0);
    if (drive_set(&d, "kp", -1.0) || drive_set(&d, "kp", NAN) || drive_set(&d, "kp", 1e9) ||
        drive_set(&d, "k", 1.0) || drive_set(&d, "limit", 5000.0))
        fail("nonsense is refused", 0);
}

int main(int argc, char **argv)
{
    const long trials = argc > 1 ? strtol(argv[1], NULL, 10) : 1000;
    profiles(trials);
    pid_is_linear();
    pid_is_analytic();
    pid_does_not_wind_up();
    drives(trials / 10 + 1);
    belts(trials / 20 + 1);
    parameters();
    printf("%u failures\n", failures);
    return failures == 0u ? 0 : 1;
}
