# The part that all machines share: Appendix D of SCXML, by name.
#
# NUMBER[region] is the deepest active state of a region, 0 for none. An occurrence of an event is a
# string of words: the number of the event, then its fields. Times do not wrap around, except in
# traces. A line of the input is a line of a script, with numbers in place of the names of events.

function active(state) {
    return NUMBER[REGION[state]] >= state && NUMBER[REGION[state]] <= LAST[state]
}

# --- arithmetic -----------------------------------------------------------------------------------

function wrapped(value, lo, hi,   size) {
    size = hi - lo + 1
    value = (value - lo) % size
    return (value < 0 ? value + size : value) + lo
}
function nearest(value, lo, hi) { return value < lo ? lo : value > hi ? hi : value }
function saturated(value, lo, hi) {
    if (!FAILED && (value < lo || value > hi)) error("error.range")
    return nearest(value, lo, hi)
}
function min(a, b) { return b < a ? b : a }
function max(a, b) { return b > a ? b : a }
function abs(a) { return a < 0 ? -a : a }
function floor(a) { return int(a) - (a < int(a)) }
function shift_left(a, count) { return a * 2 ^ count }
function shift_right(a, count) { return floor(a / 2 ^ count) }
# Bits are those of two's complement, with a sign at 2^53: `first` is the bit where `a` alone has one.
function bits(a, b, first, second, both,   found, unit, at, which) {
    found = 0
    unit = 1
    for (at = 0; at <= 53; at++) {
        which = a % 2 != 0 ? (b % 2 != 0 ? both : first) : (b % 2 != 0 ? second : 0)
        found += which * (at < 53 ? unit : -unit)
        a = floor(a / 2); b = floor(b / 2); unit *= 2
    }
    return found
}
function bit_and(a, b) { return bits(a, b, 0, 0, 1) }
function bit_or(a, b) { return bits(a, b, 1, 1, 1) }
function bit_xor(a, b) { return bits(a, b, 1, 1, 0) }
# A failure has no effect until the statement has evaluated all that it needs.
function divisor(b) {
    if (b == 0) FAILED = 1
    return b == 0 ? 1 : b
}
function quotient(a, b) { return int(a / divisor(b)) }
function remainder(a, b) { return a % divisor(b) }
function fail() {
    FAILED = 0
    error("error.execution")
}
function attempt(value, otherwise) {
    if (!FAILED) return value
    fail()
    return otherwise
}

# --- states ---------------------------------------------------------------------------------------

function enter(state) {
    NUMBER[REGION[state]] = state
    print "+ " ID[state]
    entry_actions(state)
}
function leave(state) {
    print "- " ID[state]
    exit_actions(state)
    if (!FINISHED) NUMBER[REGION[state]] = OUTER[state]
}
function leave_between(first, last,   state) {
    for (state = last; state >= first; state--)
        if (state in ID && active(state)) leave(state)
}
function take(transition) {
    print "t " transition
    content(transition)
}
function finish() { RUNNING = 0; FINISHED = 1 }

# --- queues ---------------------------------------------------------------------------------------

function shown(occurrence,   at) {
    at = index(occurrence " ", " ")
    return NAME[substr(occurrence, 1, at - 1) + 0] substr(occurrence, at)
}
function stop(reason) {
    if (FAULT != "") return
    FAULT = reason
    print "fault " reason
}
function enqueue(occurrence) {
    if (INNER_LAST - INNER_FIRST < INTERNAL) {
        INNER[INNER_LAST++] = occurrence
    } else {
        print "full internal"
        stop("internal")
    }
}
function post(occurrence) {
    if (LAST_EVENT - FIRST_EVENT >= QUEUE) return 0
    EVENTS[LAST_EVENT++] = occurrence
    return 1
}
function post_own(occurrence) { if (!post(occurrence)) print "full queue" }
function raise(occurrence) {
    print "raise " shown(occurrence)
    enqueue(occurrence)
}
function error(name) {
    print "error " name
    if (name in ERROR) enqueue(ERROR[name])
}
function send(kind, occurrence, peer) {
    if (kind == "internal") {
        raise(occurrence)
    } else if (kind == "self") {
        print "send " shown(occurrence)
        post_own(occurrence)
    } else {
        print "out " shown(occurrence) (peer == "" ? "" : " to " peer)
    }
}

# --- timers, sorted by deadline -------------------------------------------------------------------

function arm(kind, what, peer, ticks, mark,   at) {
    for (at = TIMERS++; at > 0 && DUE[at - 1] > NOW + ticks; at--) move(at - 1, at)
    DUE[at] = NOW + ticks; KIND[at] = kind; WHAT[at] = what; PEER[at] = peer; MARK[at] = mark
}
function move(from, to) {
    DUE[to] = DUE[from]; KIND[to] = KIND[from]; WHAT[to] = WHAT[from]; PEER[to] = PEER[from]
    MARK[to] = MARK[from]
}
function remove(at) {
    for (TIMERS--; at < TIMERS; at++) move(at + 1, at)
}
function disarm(kind, what,   at) {
    for (at = TIMERS - 1; at >= 0; at--)
        if (KIND[at] == kind && WHAT[at] == what) remove(at)
}
function cancel(mark,   at) {
    print "cancel " mark
    for (at = TIMERS - 1; at >= 0; at--)
        if (KIND[at] != "timeout" && MARK[at] == mark) remove(at)
}
function delay(kind, occurrence, peer, ticks, mark,   at, count) {
    print "delay " shown(occurrence) " in " ticks
    for (at = 0; at < TIMERS; at++) count += KIND[at] != "timeout"
    if (count >= DELAYED) print "full delayed"
    else arm(kind, occurrence, peer, ticks, mark)
}
function fire(   kind, what, peer) {
    NOW = DUE[0]; kind = KIND[0]; what = WHAT[0]; peer = PEER[0]
    remove(0)
    if (kind == "timeout") {
        time_out(what)
    } else if (kind == "internal") {
        open_event(what)
        react()
        settle()
    } else if (kind == "self") {
        post_own(what)
    } else {
        send(kind, what, peer)
    }
}
function time_out(timer,   waiting, count, place) {
    BUDGET = MICROSTEPS - 1
    EVENT[1] = ""
    print "@" NOW % CLOCK " > timeout " timer
    if (timer in PERIOD) arm("timeout", timer, "", PERIOD[timer], "")
    split("", HELD_GUARDS)
    count = split(WAITING[timer], waiting)
    for (place = 1; place <= count; place++)
        if (FAULT == "" && holds(waiting[place]) && FAULT == "") {
            ENABLED = 1
            TAKEN[0] = waiting[place]
            VARIANT[0] = TAKEN[0] " " variant(TAKEN[0])
            microstep()
            break
        }
    settle()
}

# --- selection ------------------------------------------------------------------------------------

function select(event,   leaf, transition) {
    ENABLED = 0
    split("", HELD_GUARDS)
    for (leaf = 1; leaf < STATES; leaf++)
        if (LEAF[leaf] && active(leaf)) {
            transition = candidate(leaf, event)
            if (transition >= 0) offer(transition)
        }
    return ENABLED
}
# Evaluate a guard once for each event, as evaluating it may raise an error.
function holds(transition) {
    if (!(transition in HELD_GUARDS)) HELD_GUARDS[transition] = guard(transition)
    return HELD_GUARDS[transition]
}
# Add a transition unless it is there or another one preempts it (removeConflictingTransitions).
function offer(transition,   reaction, at, clashes, kept) {
    kept = 0
    reaction = transition " " variant(transition)
    for (at = 0; at < ENABLED; at++) {
        if (TAKEN[at] == transition) return
        if (meet(reaction, VARIANT[at])) {
            if (!is_below(SOURCE[transition], SOURCE[TAKEN[at]])) return
            clashes++
        }
    }
    if (clashes) {
        for (at = 0; at < ENABLED; at++)
            if (!meet(reaction, VARIANT[at])) {
                TAKEN[kept] = TAKEN[at]
                VARIANT[kept++] = VARIANT[at]
            }
        ENABLED = kept
    }
    TAKEN[ENABLED] = transition
    VARIANT[ENABLED++] = reaction
}
function is_below(state, ancestor) { return ancestor < state && state <= BELOW[ancestor] }
function meet(one, other,   a, b) {
    if (!(one in DOMAIN) || !(other in DOMAIN)) return 0
    a = DOMAIN[one]; b = DOMAIN[other]
    return a == b || is_below(a, b) || is_below(b, a)
}

# --- steps ----------------------------------------------------------------------------------------

# Leave, run the content, enter. The transitions are in the order of the document, and their domains
# are disjoint: so the last one leaves its states first.
function microstep(   at) {
    for (at = 0; at < ENABLED; at++) record_histories(VARIANT[at])
    for (at = ENABLED - 1; at >= 0; at--) leave_states(VARIANT[at])
    for (at = 0; at < ENABLED; at++) take(TAKEN[at])
    for (at = 0; at < ENABLED; at++) enter_states(VARIANT[at])
}
function open_event(occurrence) {
    BUDGET = MICROSTEPS
    split(occurrence, EVENT, " ")
    print "@" NOW % CLOCK " > event " shown(occurrence)
}
function react() {
    BUDGET--
    if (!select(EVENT[1] + 0)) {
        print "unhandled " NAME[EVENT[1] + 0]
        if (STOPS[EVENT[1] + 0]) stop(NAME[EVENT[1] + 0])
        return 0
    }
    if (FAULT != "") return 0
    microstep()
    return 1
}
function complete(   found) {
    while (RUNNING && FAULT == "") {
        found = select(-1)
        if (FAULT != "" || (!found && INNER_FIRST == INNER_LAST)) return
        if (BUDGET <= 0) {
            stop("microsteps")
        } else if (found) {
            BUDGET--
            microstep()
        } else {
            split(INNER[INNER_FIRST++], EVENT, " ")
            react()
        }
    }
}
function settle(   state, line) {
    complete()
    if (FAULT != "") RUNNING = FINISHED = 0
    else if (!RUNNING) {
        leave_between(1, STATES - 1)
        clear_queues()
    }
    line = "="
    for (state = 1; state < STATES; state++)
        if (LEAF[state] && active(state)) line = line " " ID[state]
    print line (FINISHED ? " finished" : "")
}
function clear_queues() {
    FIRST_EVENT = LAST_EVENT = INNER_FIRST = INNER_LAST = TIMERS = 0
}
function start(now) {
    NOW = now
    split("", NUMBER); split("", HISTORY)
    clear_queues()
    RUNNING = 1; FINISHED = 0; FAULT = ""; EVENT[1] = ""
    BUDGET = MICROSTEPS - 1
    reset_data()
    print "@" NOW % CLOCK " > start"
    enter_states("start")
    settle()
}
function dispatch(occurrence,   handled) {
    open_event(occurrence)
    handled = react()
    settle()
    return handled
}
function run(now,   allowance) {
    if (RUNNING) NOW = now
    allowance = LAST_EVENT - FIRST_EVENT + MICROSTEPS
    while (RUNNING) {
        if (allowance > 0 && FIRST_EVENT < LAST_EVENT) {
            dispatch(EVENTS[FIRST_EVENT++])
            allowance--
        } else if (TIMERS && DUE[0] <= now) {
            fire()
            allowance = MICROSTEPS
        } else {
            break
        }
    }
    NOW = now
}

# --- scripts --------------------------------------------------------------------------------------

function later(reading,   passed) {
    passed = (reading - NOW % CLOCK + CLOCK) % CLOCK
    return NOW + (passed < CLOCK / 2 ? passed : passed - CLOCK)
}
BEGIN { CLOCK = 4294967296 }
{ words = $0; sub(/^[^ ]* /, "", words) }
$1 == "start" { start($2) }
$1 == "run" { now = later($2); run(now) }
$1 == "at" { NOW = later($2) }
$1 == "post" && !(RUNNING && post(words)) { print "full queue" }
$1 == "dispatch" && RUNNING { dispatch(words) }
$1 == "ask" { print "answer " (!RUNNING ? "stopped" : dispatch(words) ? "handled" : "ignored") }
$1 == "dump" { dump() }
