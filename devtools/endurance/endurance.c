/* endurance.c: a generated machine under random events and injected faults, with an account.
 *
 * Included after x.h and the tables of the chart (see program.py); `x` is the machine. Whoever
 * drives it counts what it offers and what it is answered; the hooks count what the machine does;
 * the machine counts what it refuses and what enables nothing. After each call all three agree, and
 * no event and no timer is in none of the accounts, or the program ends with the law that failed.
 *
 *   endurance SEED SECONDS SAMPLES FOLDER
 *
 * simulates that many seconds in sessions, each from a start to the next, and writes the script and
 * the figures of the first short sessions, at most SAMPLES, into the folder: the interpreter must
 * find the same. */

#include "fsm_mailbox.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- what the program counts ------------------------------------------------------------------ */

#define COUNTS(X)                                                                                  \
    X(sessions)                                                                                    \
    X(restarts)        /* `start` while it runs, or after a fault or the end */                    \
    X(calls)           /* of run */                                                                \
    X(jumps)           /* of the clock, over 5 s to 60 s */                                        \
    X(jumped_over)     /* timers that fired in one call of run, beyond the first */                \
    X(wraps)           /* of the 32 bits of the clock */                                           \
    X(offered)         /* events, by whatever way: the sum of the next six */                      \
    X(posted)          /* by the context of the machine */                                         \
    X(posted_within)   /* from within a step */                                                    \
    X(put)             /* by a second context, into a mailbox */                                   \
    X(dispatched)                                                                                  \
    X(dispatched_within) /* from within a step, which is refused */                                \
    X(sent)            /* by the machine to itself */                                              \
    X(taken)           /* enabled a transition */                                                  \
    X(unhandled)       /* enabled none */                                                          \
    X(full)            /* refused: the queue was full */                                           \
    X(stopped)         /* refused: in a fault, or at its end */                                    \
    X(busy)            /* refused: from within a step */                                           \
    X(lost)            /* refused: the mailbox was full */                                         \
    X(faulted)         /* was at hand when the machine stopped with a fault */                     \
    X(left)            /* waited, or were deferred, at a start or an end */                        \
    X(left_deferred)   /* of these: were deferred */                                               \
    X(held)            /* came from the mailbox to a full queue, and went back */                  \
    X(rejected)        /* what the machine counts as refused */                                    \
    X(deferrals)                                                                                   \
    X(recalls)                                                                                     \
    X(raised)          /* internal events, errors among them */                                    \
    X(unhandled_raised)                                                                            \
    X(transitions)                                                                                 \
    X(operations)                                                                                  \
    X(faults)                                                                                      \
    X(armed)                                                                                       \
    X(fired)                                                                                       \
    X(cancelled)                                                                                   \
    X(timers_left)     /* armed at a start, or in a fault */                                       \
    X(checks)          /* of the laws */

typedef struct {
#define MEMBER(name) uint64_t name;
    COUNTS(MEMBER)
#undef MEMBER
} counts;

static counts all;
static uint64_t stopped_dispatches;
static uint64_t elapsed; /* ticks */
static const uint32_t second = 1000000u / X_TICK_US;

enum { SAMPLED = 1 << 22 };

/* ---- chance ------------------------------------------------------------------------------------ */

static uint64_t chance_state;
static uint32_t host_state; /* of what operations return: that of `fsmkit.runtime.script` */

static uint32_t random_below(uint32_t limit) /* xorshift64*, after Vigna */
{
    chance_state ^= chance_state >> 12;
    chance_state ^= chance_state << 25;
    chance_state ^= chance_state >> 27;
    return (uint32_t)((chance_state * UINT64_C(2685821657736338717)) >> 32) % limit;
}

static bool one_in(uint32_t many)
{
    return random_below(many) == 0;
}

static inline uint32_t next_random(void)
{
    host_state = (1103515245u * host_state + 12345u) & 0x7fffffffu;
    return host_state;
}

/* A value of a scalar type: of a number often a bound, else one of the least 2^22. */
static void draw_value(const fsm_type *type, void *place)
{
    const uint64_t span = type->hi - type->lo;
    switch (type->kind) {
    case FSM_BOOL:
        fsm_set_bits(type, place, one_in(2));
        break;
    case FSM_ENUMERATION:
        fsm_set_bits(type, place, random_below(type->count));
        break;
    case FSM_DURATION:
        fsm_set_bits(type, place, random_below(1001u));
        break;
    case FSM_FLOAT:
        fsm_set_float(type, place, ((double)random_below(2001u) - 1000.0) / 8.0);
        break;
    default:
        if (one_in(8))
            fsm_set_bits(type, place, one_in(2) ? type->lo : type->hi);
        else
            fsm_set_bits(type, place,
                         type->lo + random_below(span < SAMPLED ? (uint32_t)span + 1u : SAMPLED));
        break;
    }
}

/* What an operation returns: the next value as `SeededHost` makes it. */
static void make(const fsm_type *type, void *result)
{
    for (uint32_t k = 0; k < type->scalars; k++) {
        uint32_t offset = 0;
        const fsm_type *scalar = fsm_scalar(type, k, &offset);
        void *place = fsm_place_at(result, offset);
        const uint32_t drawn = next_random();
        const uint64_t span = scalar->hi - scalar->lo;
        if (scalar->kind == FSM_BOOL)
            fsm_set_bits(scalar, place, drawn >> 16 & 1u);
        else if (scalar->kind == FSM_FLOAT)
            fsm_set_float(scalar, place, ((double)((drawn >> 8) % 2001u) - 1000.0) / 8.0);
        else if (scalar->kind == FSM_DURATION)
            fsm_set_bits(scalar, place, (drawn >> 8) % 1001u);
        else if (scalar->kind == FSM_SYMBOL)
            fsm_set_bits(scalar, place, 0);
        else
            fsm_set_bits(scalar, place,
                         scalar->lo + (drawn >> 8) % (span < SAMPLED ? span + 1u : SAMPLED));
    }
}

/* ---- the machine and what is known of it from outside ------------------------------------------ */

typedef x watched;
typedef x_event watched_event;
static bool watched_post(x *m, const x_event *e);
static void watched_run(x *m, uint32_t at);
FSM_MAILBOX(watched, X_QUEUE, 16)

static x machine;
static watched_mailbox mailbox;

/* Which events come, and how often, differs from session to session; so does how many per cent of
 * them are such that an atomic state which is active answers. */
static uint32_t weights[EVENTS];
static uint32_t guided;

static void draw_weights(void)
{
    const uint32_t absent = 20 + 15 * random_below(4);
    for (unsigned kind = 0; kind < EVENTS; kind++)
        weights[kind] = random_below(100) < absent ? 0 : 1 + random_below(8);
    weights[random_below(EVENTS)] = 8;
    guided = 33u * random_below(4);
}

/* Give each event a chance that such a state answers; the sum of them. */
static uint32_t look_for_answers(uint32_t *chances)
{
    x_state leaves[STATES];
    uint32_t sum = 0;
    const uint16_t count = x_active(&machine, leaves, STATES);
    for (unsigned kind = 0; kind < EVENTS; kind++) {
        chances[kind] = 0;
        for (uint16_t i = 0; i < count; i++)
            for (const unsigned *state = answering[kind]; *state != 0; state++)
                chances[kind] += *state == (unsigned)leaves[i];
        sum += chances[kind];
    }
    return sum;
}

static void draw_event(x_event *e)
{
    uint32_t chances[EVENTS];
    unsigned kind = 0;
    uint32_t sum = random_below(100) < guided ? look_for_answers(chances) : 0;
    if (sum == 0)
        for (unsigned i = 0; i < EVENTS; i++) {
            chances[i] = weights[i];
            sum += weights[i];
        }
    for (uint32_t at = random_below(sum); at >= chances[kind]; kind++)
        at -= chances[kind];
    memset(e, 0, sizeof *e);
    for (uint32_t number = 1; number <= x_info.event_count; number++)
        if ((x_info.events[number - 1].flags & FSM_EVENT_IN) != 0 && kind-- == 0) {
            const fsm_event_info *event = &x_info.events[number - 1];
            fsm_store_bits(fsm_place_at(e, x_info.event_number), x_info.event_width, number);
            for (unsigned i = 0; i < event->field_count; i++)
                draw_value(event->fields[i].type, fsm_place_at(e, event->fields[i].offset));
            break;
        }
}

static uint32_t now;

static uint64_t waiting;       /* accepted, not yet begun */
static uint64_t deferred;      /* begun, and kept for later */
static uint64_t in_mailbox;
static uint64_t refused_since; /* since the last start, as the machine counts it */
static uint64_t unhandled_since;
static bool armed[TRANSITIONS + 1];
static uint32_t due[TRANSITIONS + 1];
static uint32_t armed_now;
static bool is_dispatching, posts_within;
static unsigned open_event; /* begun, outcome unknown */
static bool eventless_open; /* a macrostep that may turn out to be none */
static unsigned fired_in_call;
static bool transition_seen[TRANSITIONS + 1], state_seen[STATES + 1];

static unsigned long session_number;
static FILE *script;
static uint64_t digest;

static uint32_t machine_now(const x *m)
{
    return x_info.now == FSM_ABSENT ? now : *(const uint32_t *)fsm_at(m, x_info.now);
}

/* How much of a list is in use. */
static uint64_t held(const x *m, const fsm_list_info *list)
{
    return list->count == FSM_ABSENT ? 0u : *(const uint8_t *)fsm_at(m, list->count);
}

static void tell_value(const fsm_type *type, const void *place)
{
    const uint64_t bits = fsm_bits_at(type, place);
    if (type->kind == FSM_FLOAT)
        fprintf(script, " %.17g", fsm_float_at(type, place));
    else if (type->kind == FSM_SIGNED)
        fprintf(script, " %" PRId64, (int64_t)bits);
    else
        fprintf(script, " %" PRIu64, bits);
}

static void wrong(const char *law, uint64_t one, uint64_t other)
{
    fprintf(stderr, "session %lu at %lu: %s: %" PRIu64 " and %" PRIu64 "\n", session_number,
            (unsigned long)now, law, one, other);
    exit(1);
}

static void equal(const char *law, uint64_t one, uint64_t other)
{
    if (one != other)
        wrong(law, one, other);
}

static void note(unsigned kind, uint32_t value)
{
    const uint64_t prime = UINT64_C(1099511628211); /* FNV-1a */
    digest = (digest ^ kind) * prime;
    for (unsigned shift = 0; shift < 32; shift += 8)
        digest = (digest ^ (value >> shift & 255u)) * prime;
}

enum { BEGAN_EVENT = 1, BEGAN_TIMEOUT, BEGAN_START, BEGAN_EVENTLESS, EXITED, TAKEN, ENTERED,
       UNHANDLED, RAISED, SENT, LEFT, FULL, FAULTED, CALLED };

/* ---- a second context, like an interrupt: it may come anywhere, and only fills the mailbox ------ */

static void interrupt(unsigned most)
{
    x_event e = X_NO_EVENT;
    for (unsigned count = 1 + random_below(most); count > 0; count--) {
        draw_event(&e);
        all.put++;
        all.offered++;
        if (watched_mailbox_put(&mailbox, &e))
            in_mailbox++;
        else
            all.lost++;
    }
}

/* ---- hooks ------------------------------------------------------------------------------------- */

/* The first hook after an event began tells what became of it. What a state keeps no hook tells, but
 * the count of what is kept. */
static void settle_outcome(x *m, uint64_t *outcome)
{
    if (open_event == 0)
        return;
    if (held(m, &x_info.deferred) > deferred) {
        deferred++;
        all.deferrals++;
    } else {
        (*outcome)++;
    }
    open_event = 0;
    (void)m;
}

static void really(void) /* an eventless macrostep does something */
{
    if (eventless_open) {
        eventless_open = false;
        note(BEGAN_EVENTLESS, now);
    }
}

static void arm(unsigned transition, uint32_t deadline)
{
    if (armed[transition])
        wrong("a timeout is armed twice", transition, deadline);
    armed[transition] = true;
    due[transition] = deadline;
    armed_now++;
    all.armed++;
}

static void disarm(unsigned transition, uint64_t *why)
{
    if (armed[transition]) {
        armed[transition] = false;
        armed_now--;
        (*why)++;
    }
}

static void fire(x *m, unsigned transition)
{
    if (transition >= TRANSITIONS || !armed[transition])
        wrong("a timeout fired that was not armed", transition, 0);
    equal("a timeout fires at its deadline", machine_now(m), due[transition]);
    for (unsigned t = 0; t < TRANSITIONS; t++)
        if (armed[t] && !fsm_reached(due[t], due[transition]))
            wrong("timeouts fire in the order of their deadlines", due[t], due[transition]);
    disarm(transition, &all.fired);
    fired_in_call++;
    for (unsigned i = 0; i < x_info.timeout_count; i++)
        if (x_info.timeouts[i].transition == transition && x_info.timeouts[i].is_periodic)
            arm(transition, due[transition] + x_info.timeouts[i].delay);
    (void)m;
}

static void noted_begin(x *m, int cause, unsigned index)
{
    open_event = 0;
    eventless_open = cause == FSM_EVENTLESS;
    if (cause == FSM_START)
        note(BEGAN_START, now);
    if (cause == FSM_TIMEOUT) {
        note(BEGAN_TIMEOUT, index);
        fire(m, index);
    }
    if (one_in(64))
        interrupt(2);
}

static void leave_waiting(void)
{
    all.left += waiting + deferred;
    all.left_deferred += deferred;
    waiting = deferred = 0;
}

static void noted_end(x *m)
{
    uint64_t silent = 0;
    settle_outcome(m, &silent);
    equal("nothing was told of an event", silent, 0);
    eventless_open = false;
    if (x_finished(m))
        leave_waiting();
}

static void noted_exit(x *m, unsigned state)
{
    really();
    settle_outcome(m, &all.taken);
    note(EXITED, state);
    for (unsigned i = 0; i < x_info.timeout_count; i++)
        if (x_info.timeouts[i].source == state)
            disarm(x_info.timeouts[i].transition, &all.cancelled);
    if (one_in(64))
        interrupt(1);
}

static void noted_take(x *m, unsigned transition)
{
    really();
    settle_outcome(m, &all.taken);
    note(TAKEN, transition);
    all.transitions++;
    transition_seen[transition] = true;
}

static void noted_enter(x *m, unsigned state)
{
    really();
    note(ENTERED, state);
    state_seen[state] = true;
    for (unsigned i = 0; i < x_info.timeout_count; i++)
        if (x_info.timeouts[i].source == state)
            arm(x_info.timeouts[i].transition, machine_now(m) + x_info.timeouts[i].delay);
    (void)m;
}

static void begun(x *m, unsigned event)
{
    note(BEGAN_EVENT, event);
    if (is_dispatching) {
        is_dispatching = false;
    } else if (deferred > held(m, &x_info.deferred)) {
        deferred--;
        all.recalls++;
    } else {
        if (waiting == 0)
            wrong("an event began that nobody offered", event, 0);
        waiting--;
    }
    open_event = event;
    (void)m;
}

static void noted_event(x *m, int what, unsigned event)
{
    if (what == FSM_TAKEN) {
        begun(m, event);
        return;
    }
    really();
    if (what == FSM_UNHANDLED) {
        uint64_t *who = open_event == event ? &all.unhandled : &all.unhandled_raised;
        note(UNHANDLED, event);
        unhandled_since++;
        if (open_event == event)
            open_event = 0;
        (*who)++;
    } else if (what == FSM_RAISED) {
        note(RAISED, event);
        all.raised++;
    } else if (what == FSM_SENT) {
        note(SENT, event);
        all.sent++;
        all.offered++;
        waiting++; /* unless the queue is full, which is told next */
    } else if (what == FSM_LEFT) {
        note(LEFT, event);
    }
}

static void noted_text(x *m, int what, const char *text)
{
    really();
    if (what == FSM_FULL) {
        note(FULL, 0);
        if (strcmp(text, "queue") == 0) {
            waiting--;
            all.full++;
            all.rejected++;
            refused_since++;
        }
    } else if (what == FSM_FAULT) {
        note(FAULTED, 0);
        all.faults++;
        settle_outcome(m, &all.faulted);
    } else if (what == FSM_ERROR) {
        all.raised++;
    }
}

/* ---- what the host does ------------------------------------------------------------------------ */

static void tell_event(const char *verb, const x_event *e)
{
    if (script != NULL) {
        const fsm_event_info *event = &x_info.events[e->event - 1];
        fprintf(script, "%s %s", verb, event->name);
        for (unsigned i = 0; i < event->field_count; i++)
            tell_value(event->fields[i].type, fsm_at(e, event->fields[i].offset));
        fprintf(script, "\n");
    }
}

static void tell_time(const char *verb)
{
    if (script != NULL)
        fprintf(script, "%s %lu\n", verb, (unsigned long)now);
}

static void check_laws(void)
{
    const x *m = &machine;
    all.checks++;
    equal("waiting in the queue", waiting, m->fsm.queue_count);
    equal("deferred", deferred, held(m, &x_info.deferred));
    equal("refused since the start", refused_since < 65535 ? refused_since : 65535, m->fsm.rejected);
    equal("unhandled since the start", unhandled_since < 65535 ? unhandled_since : 65535,
          m->fsm.unhandled);
    equal("in the mailbox", in_mailbox, fsm_ring_count(&mailbox.ring));
    equal("lost at the mailbox", all.lost, watched_mailbox_lost(&mailbox));
    equal("armed timers", armed_now, held(m, &x_info.timers));
    equal("internal events between steps", 0, held(m, &x_info.internal));
    equal("an event is offered in one way", all.offered,
          all.posted + all.posted_within + all.put + all.dispatched + all.dispatched_within +
              all.sent);
    equal("offered = taken + unhandled + refused + left + deferred + waiting", all.offered,
          all.taken + all.unhandled + all.faulted + all.full + all.stopped + all.busy + all.lost +
              all.left + deferred + waiting + in_mailbox);
    equal("deferrals = recalls + left + deferred still", all.deferrals,
          all.recalls + all.left_deferred + deferred);
    equal("rejected = full + stopped + held", all.rejected,
          all.full + all.stopped - stopped_dispatches + all.held);
    equal("armed = fired + cancelled + left + pending", all.armed,
          all.fired + all.cancelled + all.timers_left + armed_now);
}

/* Count what an offer to the queue came to. */
static bool answered(bool is_accepted, uint64_t *otherwise)
{
    if (is_accepted) {
        waiting++;
    } else {
        (*otherwise)++;
        all.rejected++;
        refused_since++;
    }
    return is_accepted;
}

static uint64_t *reason(void)
{
    return fsm_is_running(&x_info, &machine) ? &all.full : &all.stopped;
}

/* The mailbox posts and runs: what it cannot post stays in it. */
static bool watched_post(x *m, const x_event *e)
{
    tell_event("post", e);
    if (!answered(x_post(m, e), &all.held))
        return false;
    in_mailbox--;
    return true;
}

static void watched_run(x *m, uint32_t at)
{
    uint64_t sent = all.sent;
    uint64_t within = all.posted_within;
    tell_time("run");
    fired_in_call = 0;
    all.calls++;
    x_run(m, at);
    if (fired_in_call > 1)
        all.jumped_over += fired_in_call - 1;
    if (fsm_is_running(&x_info, m) && sent == all.sent && within == all.posted_within)
        equal("what was posted before `run` was taken", waiting, 0);
    for (unsigned t = 0; t < TRANSITIONS; t++)
        if (armed[t] && fsm_is_running(&x_info, m) && fsm_reached(at, due[t]))
            wrong("a timeout is overdue", due[t], at);
}

static void post(void)
{
    x_event e = X_NO_EVENT;
    draw_event(&e);
    tell_event("post", &e);
    all.posted++;
    all.offered++;
    (void)answered(x_post(&machine, &e), reason());
}

static void dispatch(void)
{
    uint64_t taken = all.taken;
    uint64_t ignored = all.unhandled + all.faulted;
    x_event e = X_NO_EVENT;
    draw_event(&e);
    tell_event("dispatch", &e);
    all.dispatched++;
    all.offered++;
    is_dispatching = true;
    switch (x_dispatch(&machine, &e, now)) {
    case FSM_HANDLED: equal("handled", all.taken, taken + 1); break;
    case FSM_IGNORED: equal("ignored", all.unhandled + all.faulted, ignored + 1); break;
    case FSM_STOPPED:
        all.stopped++;
        stopped_dispatches++; /* which the machine does not count */
        break;
    case FSM_BUSY: wrong("busy between steps", 1, 0); break;
    default: wrong("an answer that there is not", 1, 0); break;
    }
    is_dispatching = false;
}

/* An operation of the host calls the machine that called it. */
static void call_back(x *m, unsigned operation, void *result)
{
    const fsm_type *type = x_info.operations[operation].result;
    really();
    note(CALLED, operation);
    all.operations++;
    if (one_in(16)) {
        x_event e = X_NO_EVENT;
        draw_event(&e);
        all.dispatched_within++;
        all.offered++;
        all.busy++;
        equal("dispatch within a step", (uint64_t)x_dispatch(m, &e, now), FSM_BUSY);
    }
    if (posts_within && one_in(8)) {
        x_event e = X_NO_EVENT;
        draw_event(&e);
        all.posted_within++;
        all.offered++;
        (void)answered(x_post(m, &e), reason());
    }
    if (one_in(16))
        interrupt(2);
    if (type != NULL)
        make(type, result);
}

/* ---- a session --------------------------------------------------------------------------------- */

static void change_inputs(bool is_all)
{
    const fsm_field *inputs = &x_info.variables[x_info.data_count + x_info.output_count];
    for (unsigned i = 0; i < x_info.input_count; i++)
        if (is_all || one_in(x_info.input_count)) {
            void *place = fsm_place_at(&machine, inputs[i].offset);
            draw_value(inputs[i].type, place);
            if (script != NULL) {
                fprintf(script, "input %s", inputs[i].name);
                tell_value(inputs[i].type, place);
                fprintf(script, "\n");
            }
        }
}

static void start(void)
{
    tell_time("start");
    leave_waiting();
    for (unsigned t = 0; t < TRANSITIONS; t++)
        disarm(t, &all.timers_left);
    refused_since = unhandled_since = 0;
    x_start(&machine, now);
    check_laws();
}

static void pass_time(uint32_t most)
{
    uint32_t step = 1 + random_below(most);
    if (one_in(8000)) {
        step += 5000 + random_below(55000);
        all.jumps++;
    }
    elapsed += step;
    if (now + step < now)
        all.wraps++;
    now += step;
    watched_mailbox_run(&mailbox, &machine, now);
}

static uint32_t first_time(void)
{
    switch (random_below(4)) {
    case 0: return 0u - 1u - random_below(10000); /* soon the clock wraps around */
    case 1: return 0x80000000u - random_below(10000);
    case 2: return random_below(0xffffffffu);
    default: return 0;
    }
}

/* The time a session takes, in ticks: most are short, so that they can be done again. */
static uint64_t draw_length(void)
{
    switch (random_below(8)) {
    case 0: return second * 60u * (1u + random_below(20));
    case 1: case 2: return second * (60u + random_below(300));
    default: return second * (5u + random_below(30));
    }
}

static void session(uint64_t length)
{
    static const uint32_t paces[] = {1, 2, 5, 50};
    static const uint32_t rates[] = {1, 3, 10, 40};
    const uint32_t pace = 1u + second * paces[random_below(4)] / 1000u;
    const uint32_t rate = rates[random_below(4)];
    const uint64_t until = elapsed + length;
    now = first_time();
    host_state = random_below(10000);
    draw_weights();
    if (script != NULL)
        fprintf(script, "seed %lu\n", (unsigned long)host_state);
    change_inputs(true);
    start();
    while (elapsed < until) {
        const uint32_t kind = random_below(100);
        if (kind >= rate) {
            pass_time(pace);
        } else {
            switch (random_below(16)) {
            case 0: dispatch(); break;
            case 1: interrupt(20); break;
            case 2:
                for (unsigned n = random_below(2u * X_QUEUE); n > 0; n--)
                    post();
                break;
            case 3: case 4: case 5: case 6: change_inputs(false); break;
            default: post(); break;
            }
        }
        if (one_in(fsm_is_running(&x_info, &machine) ? 50000 : 50)) {
            all.restarts++;
            start();
        }
        check_laws();
    }
    all.sessions++;
}

/* A session that the interpreter can do again: its script, and what came of it. */
static void sampled_session(uint64_t length, const char *folder)
{
    char name[4096];
    counts before = all;
    snprintf(name, sizeof name, "%s/session_%lu.txt", folder, session_number);
    script = fopen(name, "w");
    if (script == NULL)
        wrong("cannot write a script", 0, 0);
    digest = UINT64_C(14695981039346656037);
    session(length);
    fclose(script);
    script = NULL;
    printf("session %lu digest %" PRIu64, session_number, digest);
#define SINCE(name) printf(" " #name " %" PRIu64, all.name - before.name)
    SINCE(rejected);
    SINCE(taken);
    SINCE(unhandled);
    SINCE(unhandled_raised);
    SINCE(transitions);
    SINCE(operations);
    SINCE(fired);
    SINCE(deferrals);
    SINCE(faults);
    printf("\n");
}

static unsigned seen(const bool *which, unsigned count)
{
    unsigned found = 0;
    for (unsigned i = 0; i < count; i++)
        found += which[i];
    return found;
}

int main(int argc, char **argv)
{
    if (argc != 5)
        return 2;
    chance_state = strtoull(argv[1], NULL, 10) * 2u + 1u;
    const uint64_t end = strtoull(argv[2], NULL, 10) * second;
    long samples = strtol(argv[3], NULL, 10);
    for (unsigned n = 0; n < 20; n++)
        (void)random_below(2); /* a small seed takes a while to spread */
    x_init(&machine);
    for (; elapsed < end; session_number++) {
        uint64_t length = draw_length();
        if (length > end - elapsed)
            length = end - elapsed;
        posts_within = one_in(3);
        if (samples > 0 && !posts_within && length < second * 60u) {
            samples--;
            sampled_session(length, argv[4]);
        } else {
            session(length);
        }
    }
    printf("total ticks %" PRIu64, elapsed);
#define PRINT(name) printf(" " #name " %" PRIu64, all.name);
    COUNTS(PRINT)
    printf(" waiting %" PRIu64 " deferred %" PRIu64 " in_mailbox %" PRIu64 " pending %lu", waiting,
           deferred, in_mailbox, (unsigned long)armed_now);
    printf(" states_seen %u transitions_seen %u\n", seen(state_seen, STATES),
           seen(transition_seen, TRANSITIONS));
    return 0;
}
