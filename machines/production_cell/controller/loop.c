/* loop.c: feeder and molder in a 1 kHz loop, against simulated axes.
 *
 * Usage: loop SECONDS. Prints what the machines do, one line each: time in milliseconds, machine,
 * operation or event or the states it came to rest in. `make demo` builds it; by hand:
 *
 *   fsmkit compile cell.yaml --out generated
 *   cc -Igenerated controller/loop.c controller/axis.c generated/[fm]*.c -o loop
 *
 * On a board, a periodic task takes the place of main's loop, and drivers that of the axes and of
 * the blocks. loop.py is the same program, section by section. */
#include "axis.h"
#include "feeder.h"
#include "molder.h"

#include <stdio.h>
#include <stdlib.h>

/* Encoder counts, as in feeder.yaml and molder.yaml. */
enum { HOME = 0, OFFSET = 100, PUSHED = 2800, OPEN = 1500 };

/* Milliseconds. */
enum { POWER_ON = 100, BELT_TIME = 1000, EXTRACT_TIME = 1500, RELAY_TIME = 1000 };
enum { PAUSE_AT = 20000, RESUME_AT = 22000, STOP_AT = 30000, ESTOP_AT = 40000 };

static struct {
    uint32_t now;
    feeder feeder;
    molder molder;
    axis pusher, door;
    bool pocket, cavity;               /* a block lies there */
    uint32_t belt_due, extract_due;    /* 0: nothing on its way */
    uint32_t release_due;              /* of the safety relay */
    bool feeder_ready, molder_ready;
    unsigned blocks;                   /* moulded and taken out */
} cell;

static void trip(void);
static void start_when_ready(void);

static void say(const char *machine, const char *what)
{
    printf("%u %s %s\n", (unsigned)cell.now, machine, what);
}

/* A full queue would show here; `fsmkit check cell.yaml` proves that it never is. */
static void must(bool posted)
{
    if (!posted)
        say("cell", "QUEUE FULL");
}

/* --- the feeder: what it calls, and what it sends --------------------------------------------- */

void feeder_motor_enable(feeder *m)
{
    (void)m;
    say("feeder", "motor_enable");
    cell.pusher.enabled = true;
}

void feeder_motor_disable(feeder *m)
{
    (void)m;
    say("feeder", "motor_disable");
    axis_stop(&cell.pusher);
    cell.pusher.enabled = false;
}

void feeder_hold(feeder *m)
{
    (void)m;
    say("feeder", "hold");
    axis_stop(&cell.pusher);
}

void feeder_seek(feeder *m, uint8_t speed)
{
    (void)m;
    say("feeder", "seek");
    axis_seek(&cell.pusher, speed);
}

void feeder_goto(feeder *m, uint16_t position, uint8_t speed)
{
    (void)m;
    printf("%u feeder goto %u %u\n", (unsigned)cell.now, position, speed);
    axis_goto(&cell.pusher, position, speed);
}

void feeder_send_pushed(feeder *m)
{
    (void)m;
    say("feeder", "!pushed");
    must(molder_post_pushed(&cell.molder));
}

void feeder_send_feeder_clear(feeder *m)
{
    (void)m;
    say("feeder", "!feeder_clear");
    must(molder_post_feeder_clear(&cell.molder));
}

void feeder_send_pocket_free(feeder *m)
{
    (void)m;
    say("feeder", "!pocket_free");
    if (cell.belt_due == 0)
        cell.belt_due = cell.now + BELT_TIME;
}

void feeder_send_is_homed(feeder *m)
{
    (void)m;
    say("feeder", "!is_homed");
    must(molder_post_home_permit(&cell.molder));
}

void feeder_send_is_ready(feeder *m)
{
    (void)m;
    say("feeder", "!is_ready");
    cell.feeder_ready = true;
    start_when_ready();
}

void feeder_send_has_fault(feeder *m, feeder_fault_kind code)
{
    (void)m;
    printf("%u feeder !has_fault %u\n", (unsigned)cell.now, (unsigned)code);
    trip();
}

/* --- the molder: what it calls, and what it sends --------------------------------------------- */

void molder_motor_enable(molder *m)
{
    (void)m;
    say("molder", "motor_enable");
    cell.door.enabled = true;
}

void molder_motor_disable(molder *m)
{
    (void)m;
    say("molder", "motor_disable");
    axis_stop(&cell.door);
    cell.door.enabled = false;
}

void molder_hold(molder *m)
{
    (void)m;
    say("molder", "hold");
    axis_stop(&cell.door);
}

void molder_seek(molder *m, uint8_t speed)
{
    (void)m;
    say("molder", "seek");
    axis_seek(&cell.door, speed);
}

void molder_goto(molder *m, uint16_t position, uint8_t speed)
{
    (void)m;
    printf("%u molder goto %u %u\n", (unsigned)cell.now, position, speed);
    axis_goto(&cell.door, position, speed);
}

void molder_heat(molder *m, bool on)
{
    (void)m;
    say("molder", on ? "heat on" : "heat off");
}

void molder_send_mold_ready(molder *m)
{
    (void)m;
    say("molder", "!mold_ready");
    must(feeder_post_mold_ready(&cell.feeder));
}

void molder_send_mold_done(molder *m)
{
    (void)m;
    say("molder", "!mold_done");
    must(feeder_post_mold_done(&cell.feeder));
}

void molder_send_extract_ready(molder *m)
{
    (void)m;
    say("molder", "!extract_ready");
    if (cell.extract_due == 0)
        cell.extract_due = cell.now + EXTRACT_TIME;
}

void molder_send_is_homed(molder *m)
{
    (void)m;
    say("molder", "!is_homed");
}

void molder_send_is_ready(molder *m)
{
    (void)m;
    say("molder", "!is_ready");
    cell.molder_ready = true;
    start_when_ready();
}

void molder_send_has_fault(molder *m, molder_fault_kind code)
{
    (void)m;
    printf("%u molder !has_fault %u\n", (unsigned)cell.now, (unsigned)code);
    trip();
}

/* --- the panel -------------------------------------------------------------------------------- */

static void trip(void)
{
    say("panel", "emergency stop");
    must(feeder_post_estop(&cell.feeder));
    must(molder_post_estop(&cell.molder));
    cell.belt_due = cell.extract_due = 0;
    cell.release_due = cell.now + RELAY_TIME;
}

static void home(void)
{
    cell.feeder_ready = cell.molder_ready = false;
    must(feeder_post_home_permit(&cell.feeder));
}

static void stop(void)
{
    say("panel", "stop");
    cell.feeder_ready = cell.molder_ready = false;
    must(feeder_post_stop(&cell.feeder));
    must(molder_post_stop(&cell.molder));
}

static void start_when_ready(void)
{
    if (!cell.feeder_ready || !cell.molder_ready)
        return;
    say("panel", "start");
    must(feeder_post_start(&cell.feeder));
    must(molder_post_start(&cell.molder));
    if (cell.pocket)
        must(feeder_post_block_ready(&cell.feeder));
}

static void panel(void)
{
    switch (cell.now) {
    case POWER_ON:
        must(feeder_post_power_ok(&cell.feeder));
        must(molder_post_power_ok(&cell.molder));
        home();
        break;
    case PAUSE_AT:
        must(feeder_post_pause(&cell.feeder));
        must(molder_post_pause(&cell.molder));
        break;
    case RESUME_AT:
        must(feeder_post_resume(&cell.feeder));
        must(molder_post_resume(&cell.molder));
        break;
    case STOP_AT:
        stop();
        break;
    case ESTOP_AT:
        trip();
        break;
    default:
        break;
    }
    if (cell.release_due != 0 && cell.now == cell.release_due) {
        cell.release_due = 0;
        must(feeder_post_estop_clear(&cell.feeder));
        must(molder_post_estop_clear(&cell.molder));
        must(feeder_post_reset(&cell.feeder));
        must(molder_post_reset(&cell.molder));
        home();
    }
}

/* --- the rest of the cell --------------------------------------------------------------------- */

static void neighbours(void)
{
    if (cell.belt_due != 0 && cell.now == cell.belt_due) {
        cell.belt_due = 0;
        cell.pocket = true;
        must(feeder_post_block_ready(&cell.feeder));
    }
    if (cell.extract_due != 0 && cell.now == cell.extract_due) {
        cell.extract_due = 0;
        cell.cavity = false;
        cell.blocks++;
        must(molder_post_extract_clear(&cell.molder));
    }
}

static void axes(void)
{
    switch (axis_step(&cell.pusher)) {
    case AXIS_ARRIVED:
        if (axis_at(&cell.pusher, PUSHED) && cell.pocket) {
            cell.cavity = true;
            cell.pocket = false;
        }
        must(feeder_post_arrived(&cell.feeder));
        break;
    case AXIS_LIMIT:
        must(feeder_post_limit(&cell.feeder));
        break;
    case AXIS_NOTHING:
        break;
    }
    switch (axis_step(&cell.door)) {
    case AXIS_ARRIVED:
        must(molder_post_arrived(&cell.molder));
        break;
    case AXIS_LIMIT:
        must(molder_post_limit(&cell.molder));
        break;
    case AXIS_NOTHING:
        break;
    }
}

static uint8_t place(const axis *self, int32_t far_end)
{
    if (self->moving)
        return FEEDER_PLACE_BETWEEN;
    if (axis_at(self, HOME))
        return FEEDER_PLACE_HOME;
    if (axis_at(self, OFFSET))
        return FEEDER_PLACE_OFFSET;
    return axis_at(self, far_end) ? FEEDER_PLACE_FAR : FEEDER_PLACE_BETWEEN;
}

static void inputs(void)
{
    cell.feeder.in.at = place(&cell.pusher, PUSHED);
    cell.feeder.in.pocket_occupied = cell.pocket;
    cell.feeder.in.cavity_occupied = cell.cavity;
    cell.molder.in.at = place(&cell.door, OPEN);
    cell.molder.in.cavity_occupied = cell.cavity;
}

/* Prints the states that became active since the last tick. */
static void print_feeder(bool *was)
{
    for (uint16_t s = 1; s < FEEDER_STATES; s++) {
        bool is = feeder_in(&cell.feeder, (feeder_state)s);
        if (is && !was[s])
            printf("%u feeder %s\n", (unsigned)cell.now, feeder_state_name((feeder_state)s));
        was[s] = is;
    }
}

static void print_molder(bool *was)
{
    for (uint16_t s = 1; s < MOLDER_STATES; s++) {
        bool is = molder_in(&cell.molder, (molder_state)s);
        if (is && !was[s])
            printf("%u molder %s\n", (unsigned)cell.now, molder_state_name((molder_state)s));
        was[s] = is;
    }
}

int main(int argc, char **argv)
{
    static bool feeder_was[FEEDER_STATES], molder_was[MOLDER_STATES];
    uint32_t end = argc > 1 ? (uint32_t)strtoul(argv[1], NULL, 10) * 1000u : 60000u;
    cell.pusher.position = 300 * AXIS_SCALE;
    cell.door.position = 700 * AXIS_SCALE;
    feeder_init(&cell.feeder);
    molder_init(&cell.molder);
    feeder_start(&cell.feeder, 0);
    molder_start(&cell.molder, 0);
    for (cell.now = 1; cell.now <= end; cell.now++) {
        panel();
        axes();
        neighbours();
        inputs();
        feeder_run(&cell.feeder, cell.now);
        molder_run(&cell.molder, cell.now);
        print_feeder(feeder_was);
        print_molder(molder_was);
    }
    printf("%u cell %u blocks moulded\n", (unsigned)end, cell.blocks);
    return fflush(stdout) == 0 ? 0 : 1;
}
