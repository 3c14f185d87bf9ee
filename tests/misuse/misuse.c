/* misuse.c: a host that abuses a machine: for each misuse an account of all events that it posted.
 * An event is handled, ignored (and counted), refused (and counted), waits in a queue, or was given
 * up in a queue of a machine that stopped; nothing else.
 *
 * Usage: misuse EVENTS SEED. Prints a line for each misuse; stops at the first law that is broken. */
#include "abused.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

static uint32_t state; /* xorshift32 */
static uint32_t draw(uint32_t below)
{
    state ^= state << 13;
    state ^= state >> 17;
    state ^= state << 5;
    return state % below;
}

#define LAW(holds)                                                                                 \
    do {                                                                                           \
        if (!(holds)) {                                                                            \
            printf("line %d: broken: %s\n", __LINE__, #holds);                                     \
            exit(1);                                                                               \
        }                                                                                          \
    } while (0)

typedef struct {
    uint32_t posted, handled, ignored, refused, given_up;
} account;

static abused m;
static account sum;       /* of the misuse at hand */

static uint32_t number;   /* of the last tap */
static uint32_t order;    /* of the last tap that was handled */
static uint32_t nested;   /* calls from within a step */
static bool is_nesting;

static uint32_t waiting(void)
{
    return (uint32_t)m.fsm.queue_count + m.fsm.deferred_count;
}

static uint32_t stops(uint32_t count) /* where a counter stops */
{
    return count < 65535u ? count : 65535u;
}

/* Post a tap; the return value, the counter and the queue must agree. */
static bool tap(void)
{
    const uint32_t before = waiting(), rejected = m.fsm.rejected;
    const bool has_room = m.fsm.running && before < ABUSED_QUEUE;
    const bool fits = abused_post_tap(&m, ++number);
    LAW(fits == has_room);
    LAW(waiting() == before + (fits ? 1u : 0u));
    LAW(m.fsm.rejected == (fits ? rejected : stops(rejected + 1u)));
    sum.posted++;
    sum.refused += fits ? 0u : 1u;
    return fits;
}

static fsm_result now_event(uint32_t event, uint32_t now)
{
    abused_event e = ABUSED_NO_EVENT;
    e.event = event;
    return abused_dispatch(&m, &e, now);
}

void abused_touched(abused *which, uint32_t tapped)
{
    LAW(which == &m);
    LAW(tapped > order); /* each once, in order, those that were deferred included */
    order = tapped;
    if (!is_nesting)
        return;
    const abused before = m;
    uint32_t deadline;
    LAW(now_event(ABUSED_EVENT_TAP, m.fsm.now + draw(99)) == FSM_BUSY);
    abused_run(&m, m.fsm.now + draw(1000));
    abused_start(&m, draw(1000));
    LAW(!abused_step_event(&m) && !abused_step_timer(&m) && !abused_step_eventless(&m));
    LAW(abused_next_deadline(&m, &deadline) == (before.fsm.timer_count > 0u));
    LAW(before.fsm.queue_count == m.fsm.queue_count && before.fsm.timer_count == m.fsm.timer_count &&
        before.fsm.now == m.fsm.now && before.data.handled == m.data.handled && before.fsm.active == m.fsm.active &&
        before.data.beats == m.data.beats && before.fsm.running == m.fsm.running && before.fsm.busy == m.fsm.busy);
    nested += 6u;
    for (uint32_t i = draw(3); i > 0u; i--)
        (void)tap();
}

/* Close the account of a machine that is about to begin anew. */
static void close_account(void)
{
    sum.handled += m.data.handled;
    sum.ignored += m.fsm.unhandled;
    sum.given_up += waiting();
}

static void anew(uint32_t now)
{
    close_account();
    abused_start(&m, now);
    LAW(m.fsm.running && !m.fsm.finished && m.fsm.fault == FSM_NO_FAULT && abused_in(&m, ABUSED_STATE_IDLE));
    LAW(waiting() == 0u && m.fsm.rejected == 0u && m.fsm.unhandled == 0u && m.fsm.timer_count == 0u);
}

static void is_stopped(fsm_fault fault)
{
    uint32_t deadline;
    const uint32_t handled = m.data.handled, queued = waiting();
    for (uint32_t i = draw(4); i > 0u; i--)
        LAW(!tap());
    abused_run(&m, m.fsm.now + draw(1000));
    LAW(now_event(ABUSED_EVENT_TAP, 0u) == FSM_STOPPED);
    LAW(!abused_step_event(&m) && !abused_step_timer(&m) && !abused_step_eventless(&m));
    (void)abused_next_deadline(&m, &deadline);
    LAW(!m.fsm.running && m.data.handled == handled && waiting() == queued && abused_fault(&m) == fault);
}

static void before_start(void)
{
    close_account();
    abused_init(&m);
    LAW(!abused_in(&m, ABUSED_STATE_ROOT) && !abused_finished(&m));
    for (uint32_t i = draw(9); i > 0u; i--)
        is_stopped(FSM_NO_FAULT);
    anew(draw(1000));
    LAW(m.data.handled == 0u);
    (void)tap();
    abused_run(&m, 0u);
    LAW(m.data.handled == 1u);
}

static void within_a_step(void)
{
    is_nesting = true;
    if (!abused_in(&m, ABUSED_STATE_BEATING))
        LAW(now_event(ABUSED_EVENT_BEAT_ON, m.fsm.now) == FSM_HANDLED);
    for (uint32_t i = draw(12); i > 0u; i--)
        (void)tap();
    abused_run(&m, m.fsm.now + draw(30));
    is_nesting = false;
    LAW(abused_in(&m, ABUSED_STATE_BEATING) && m.fsm.fault == FSM_NO_FAULT);
}

/* The timer fires at its deadlines, once each, however the clock jumps and wherever it stands. */
static void beats(uint32_t now, uint32_t *due)
{
    const uint32_t before = m.data.beats;
    uint32_t fired = 0u, deadline = 0u;
    for (; (uint32_t)(now - *due) < UINT32_C(0x80000000); *due += 10u)
        fired++;
    (void)tap();
    abused_run(&m, now);
    LAW(m.data.beats == before + fired && m.fsm.now == now && m.fsm.queue_count == 0u);
    LAW(abused_next_deadline(&m, &deadline) && deadline == *due);
}

static void backwards(void)
{
    uint32_t now = draw(UINT32_MAX), due = now + 10u;
    anew(now);
    LAW(now_event(ABUSED_EVENT_BEAT_ON, now) == FSM_HANDLED);
    for (uint32_t i = 0u; i < 50u; i++) {
        uint32_t back = draw(4) == 0u ? draw(UINT32_C(0x7FFFFF00)) : draw(200);
        beats(now - back, &due);
        now += draw(200);
        beats(now, &due);
    }
}

static void wrap(void)
{
    uint32_t now = UINT32_MAX - draw(300), due = now + 10u;
    anew(now);
    LAW(now_event(ABUSED_EVENT_BEAT_ON, now) == FSM_HANDLED);
    for (uint32_t i = 0u; i < 50u; i++) {
        now += draw(30);
        beats(now, &due);
    }
}

static void full(void)
{
    for (uint32_t i = 0u; i < 3u * ABUSED_QUEUE; i++)
        LAW(tap() == (i < ABUSED_QUEUE));
    const uint32_t handled = m.data.handled;
    abused_run(&m, m.fsm.now + draw(30));
    LAW(m.data.handled == handled + ABUSED_QUEUE && waiting() == 0u);
}

static void deferred(void)
{
    LAW(now_event(ABUSED_EVENT_HOLD, m.fsm.now) == FSM_HANDLED);
    const uint32_t handled = m.data.handled;
    for (uint32_t i = 0u; i < 2u * ABUSED_QUEUE; i++) {
        LAW(tap() == (i < ABUSED_QUEUE)); /* deferred events take room of the queue */
        abused_run(&m, m.fsm.now + draw(3));
        LAW(m.data.handled == handled);
    }
    LAW(m.fsm.deferred_count == ABUSED_QUEUE);
    LAW(now_event(ABUSED_EVENT_RELEASE, m.fsm.now) == FSM_HANDLED);
    abused_run(&m, m.fsm.now);
    LAW(m.data.handled == handled + ABUSED_QUEUE && waiting() == 0u);
}

static void endless(void) /* eventless transitions, internal events: a fault, and at once */
{
    const bool is_internal = draw(2) == 0u;
    for (uint32_t i = draw(12); i > 0u; i--)
        (void)tap();
    const fsm_result result =
        now_event(is_internal ? ABUSED_EVENT_CIRCLE : ABUSED_EVENT_WHIRL, m.fsm.now);
    LAW(result == FSM_HANDLED && m.data.loops <= ABUSED_MICROSTEPS);
    is_stopped(FSM_FAULT_MICROSTEPS);
    anew(m.fsm.now);
}

static void without_delay(void) /* timers of no delay: one step at a time, in which no time passes */
{
    const uint32_t now = m.fsm.now, loops = m.data.loops, steps = draw(40);
    LAW(now_event(ABUSED_EVENT_CHASE, now) == FSM_HANDLED);
    for (uint32_t i = 0u; i < steps; i++) {
        (void)tap();
        LAW(abused_step_timer(&m));
        (void)abused_step_event(&m);
        LAW(m.fsm.now == now && m.fsm.timer_count == 1u && abused_in(&m, ABUSED_STATE_CHASING));
    }
    LAW(m.data.loops == loops + 1u + steps);
    LAW(now_event(ABUSED_EVENT_RELEASE, now) == FSM_HANDLED && m.fsm.timer_count == 0u);
}

static void to_itself(void) /* an event that sends itself: run ends, and goes on the next time */
{
    abused_event e = ABUSED_NO_EVENT;
    e.event = ABUSED_EVENT_ECHO;
    anew(m.fsm.now);
    LAW(abused_post(&m, &e));
    sum.posted++; /* and given up in the end */
    for (uint32_t i = draw(9); i > 0u; i--) {
        const uint32_t loops = m.data.loops;
        (void)tap();
        abused_run(&m, m.fsm.now + 1u);
        LAW(m.data.loops > loops && m.data.loops <= loops + ABUSED_MICROSTEPS + ABUSED_QUEUE);
        LAW(m.fsm.queue_count == 1u && m.fsm.running);
    }
    anew(m.fsm.now);
}

static void after_the_end(void)
{
    for (uint32_t i = draw(12); i > 0u; i--)
        (void)tap();
    sum.given_up += waiting(); /* with the machine */
    LAW(now_event(ABUSED_EVENT_FINISH, m.fsm.now) == FSM_HANDLED);
    LAW(abused_finished(&m) && waiting() == 0u);
    is_stopped(FSM_NO_FAULT);
    anew(m.fsm.now);
}

static void no_event(void) /* numbers that are none, and events that nobody wants */
{
    abused_event e = ABUSED_NO_EVENT;
    const uint32_t before = m.fsm.unhandled, handled = m.data.handled;
    e.event = draw(2) == 0u ? 0u : ABUSED_EVENTS + draw(UINT32_MAX / 2u);
    if (draw(3) == 0u)
        e.event = UINT32_C(0x10000) * (1u + draw(99)) + draw(ABUSED_EVENTS); /* cut short, an event */
    if (draw(3) == 0u)
        e.event = ABUSED_EVENT_OTHER;
    sum.posted++;
#ifdef FSM_CHECKED
    if (e.event != ABUSED_EVENT_OTHER) {
        const uint32_t rejected = m.fsm.rejected;
        LAW(abused_dispatch(&m, &e, m.fsm.now) == FSM_REFUSED && !abused_post(&m, &e));
        LAW(m.fsm.rejected == stops(rejected + 1u) && waiting() == 0u && m.fsm.unhandled == before);
        sum.refused++;
        return;
    }
#endif
    LAW(abused_post(&m, &e));
    abused_run(&m, m.fsm.now);
    LAW(m.fsm.unhandled == before + 1u && m.data.handled == handled && abused_in(&m, ABUSED_STATE_IDLE));
    if (m.fsm.unhandled == 60000u)
        anew(m.fsm.now);
}

static void abuse(const char *name, void (*how)(void), uint32_t events)
{
    const account none = {0u, 0u, 0u, 0u, 0u};
    abused_init(&m);
    abused_start(&m, 0u);
    sum = none;
    nested = 0u;
    while (sum.posted < events)
        how();
    anew(0u);
    printf("%s: posted %" PRIu32 ", handled %" PRIu32 ", ignored %" PRIu32 ", refused %" PRIu32
           ", given up %" PRIu32 ", calls from within %" PRIu32 "\n",
           name, sum.posted, sum.handled, sum.ignored, sum.refused, sum.given_up, nested);
    LAW(sum.posted == sum.handled + sum.ignored + sum.refused + sum.given_up);
}

int main(int count, char **words)
{
    static const struct {
        const char *name;
        void (*how)(void);
    } all[] = {{"before start", before_start}, {"within a step", within_a_step},
               {"time backwards", backwards},  {"clock wraps", wrap},
               {"queue full", full},           {"deferred", deferred},
               {"endless macrostep", endless}, {"timers of no delay", without_delay},
               {"sends to itself", to_itself}, {"after the end", after_the_end},
               {"no event", no_event}};
    const uint32_t kinds = (uint32_t)(sizeof all / sizeof all[0]);
    LAW(count == 3);
    state = (uint32_t)strtoul(words[2], NULL, 10) | 1u;
    for (uint32_t i = 0u; i < kinds; i++)
        abuse(all[i].name, all[i].how, (uint32_t)strtoul(words[1], NULL, 10) / kinds + 1u);
    return 0;
}
