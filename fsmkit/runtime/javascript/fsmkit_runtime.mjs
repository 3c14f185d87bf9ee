// The common part of all machines: Appendix D of SCXML 1.0 by name.
//
// A machine is given its definition, tables and functions that `fsmkit compile --target javascript`
// wrote. States, transitions and events are numbers of the chart; times are ticks modulo 2^32, and
// deadlines compare by their distance, which is below 2^31. Values are never changed in place: an
// array that is assigned to is copied, so payloads, logs and data share them safely.

const FAR = 0x80000000;
const NOTHING = -1;
export const SELF = 0;
export const INTERNAL = 1;
export const PORT = 2;
export const INVOKER = 3;
export const INVOKED = 4;

/** Content that cannot be evaluated: the rest of its block is skipped. */
export class ContentError extends Error {}
/** Skips the rest of a block whose error event was already raised. */
export class EndOfBlock extends Error {}
/** A value left the bounds of a type that forbids it: the machine stops. */
export class RangeFault extends Error {}

// --- arithmetic ---------------------------------------------------------------------------------
// Integers are numbers if all values of a type and all intermediate results are safe
// integers, else BigInt: the printer of expressions decides. `+ 0` converts -0 to 0.

/** Divide integers, truncating toward zero (C99 6.5.5). */
export function divide(a, b) {
  if (b == 0) throw new ContentError("division by zero");
  return typeof a === "bigint" ? a / b : (a - (a % b)) / b + 0;
}

/** Return the remainder of `divide`; it has the sign of the dividend. */
export function remainder(a, b) {
  if (b == 0) throw new ContentError("division by zero");
  return typeof a === "bigint" ? a % b : (a % b) + 0;
}

/** Wrap a value into a range. */
export function around(value, lo, hi) {
  if (typeof value === "bigint") {
    const size = hi - lo + 1n, rest = (value - lo) % size;
    return (rest < 0n ? rest + size : rest) + lo;
  }
  const size = hi - lo + 1, rest = (value - lo) % size;
  return (rest < 0 ? rest + size : rest) + lo;
}

/** Return the nearest value of a range. */
export function nearest(value, lo, hi) {
  return value < lo ? lo : value > hi ? hi : value;
}

/** Return a value that lies in its range; otherwise stop the machine. */
export function bounded(value, lo, hi) {
  if (value < lo || value > hi) throw new RangeFault("a value left its range");
  return value;
}

/** Truncate a number; infinities become values just outside the range, NaN becomes 0. */
export function truncate(value, lo, hi) {
  if (Number.isNaN(value)) return 0;
  return value === Infinity ? hi + 1 : value === -Infinity ? lo - 1 : Math.trunc(value) + 0;
}

/** The same with BigInt bounds and result. */
export function truncateBig(value, lo, hi) {
  if (Number.isNaN(value)) return 0n;
  return value === Infinity ? hi + 1n : value === -Infinity ? lo - 1n : BigInt(Math.trunc(value));
}

/** Return the minimum, with C's `b < a ? b : a` for NaN and -0. */
export function least(a, ...others) {
  for (const b of others) if (b < a) a = b;
  return a;
}

/** Return the maximum, likewise. */
export function greatest(a, ...others) {
  for (const b of others) if (b > a) a = b;
  return a;
}

/** Return the magnitude of a BigInt. */
export function magnitude(value) {
  return value < 0n ? -value : value;
}

/** Return a checked index of an array. */
export function position(index, length) {
  if (index < 0 || index >= length) throw new ContentError("index out of range");
  return Number(index);
}

/** Truncate a number to 64 bits; fails outside them. */
export function integer(value) {
  const whole = Number.isFinite(value) ? BigInt(Math.trunc(value)) : 1n << 63n;
  if (BigInt.asIntN(64, whole) !== whole) throw new ContentError("no whole part within 64 bits");
  return whole;
}

/** Return a known number; otherwise `otherwise`, or fail without one. */
export function member(number, known, otherwise) {
  const found = known.find((each) => each == number); // loosely: a number or a BigInt
  if (found !== undefined) return found;
  if (otherwise === undefined) throw new ContentError("the number of no member");
  return otherwise;
}

/** Fail with an error of content. */
export function cannot(reason) {
  throw new ContentError(reason);
}

/** End a block whose error has been raised as an event. */
export function endOfBlock(reason) {
  throw new EndOfBlock(reason);
}

/** Return a copy of an array or record with another part. */
export function changed(values, at, value) {
  const copy = values.slice();
  copy[at] = value;
  return copy;
}

/** Format a value as traces do: enumerations as numbers, durations in ticks. */
export function shown(value) {
  if (Array.isArray(value)) return `[${value.map(shown).join(" ")}]`;
  if (typeof value === "boolean") return value ? "1" : "0";
  if (typeof value === "string") return `"${value}"`;
  return typeof value === "number" ? general(value) : String(value);
}

/** Format a number like C's "%.17g": ties are rounded to even, unlike toExponential. */
function general(value) {
  if (Number.isNaN(value)) return "nan";
  if (!Number.isFinite(value)) return value < 0 ? "-inf" : "inf";
  if (Object.is(value, -0)) return "-0";
  if (Number.isSafeInteger(value)) return String(value);
  const [mantissa, power] = Math.abs(value).toExponential(100).split("e");
  const digits = mantissa.replace(".", ""), rest = digits.slice(17), half = "5".padEnd(rest.length, "0");
  let kept = BigInt(digits.slice(0, 17)), exponent = Number(power);
  if (rest > half || (rest === half && kept % 2n === 1n)) kept += 1n;
  let text = String(kept);
  if (text.length > 17) exponent += 1;
  text = text.slice(0, 17).replace(/0+$/, "");
  const sign = value < 0 ? "-" : "";
  if (exponent < -4 || exponent >= 17) {
    const head = text.length > 1 ? `${text[0]}.${text.slice(1)}` : text;
    const size = String(Math.abs(exponent)).padStart(2, "0");
    return `${sign}${head}e${exponent < 0 ? "-" : "+"}${size}`;
  }
  if (exponent < 0) return `${sign}0.${"0".repeat(-exponent - 1)}${text}`;
  if (text.length <= exponent + 1) return sign + text.padEnd(exponent + 1, "0");
  return `${sign}${text.slice(0, exponent + 1)}.${text.slice(exponent + 1)}`;
}

// --- traces ---------------------------------------------------------------------------------------
// Effects are reported as rows: a word, then numbers of the chart and internal values. A row becomes
// a line of a trace, except for `deferred` and `spent`.

/** Return the line of an effect, or null for effects that a trace omits. */
export function effectLine({ states, events }, [word, ...rest]) {
  const spell = (event, payload) => [events[event].name, ...payload.map(shown)].join(" ");
  switch (word) {
    case "-":
    case "+":
      return `${word} ${states[rest[0]].id}`;
    case "op": {
      const [name, passed, hasResult, result] = rest;
      return ["op", name, ...passed.map(shown), ...(hasResult ? ["=", shown(result)] : [])].join(" ");
    }
    case "out":
    case "raise":
    case "send": {
      const [event, payload, peer] = rest;
      return `${word} ${spell(event, payload)}${peer === undefined || peer === null ? "" : ` to ${peer}`}`;
    }
    case "delay":
      return `delay ${spell(rest[0], rest[1])} in ${rest[2]}`;
    case "log":
      return ["log", rest[0], ...rest[1].map(shown)].join(" ");
    case "reply":
      return `reply ${shown(rest[0])}`;
    case "unhandled":
      return `unhandled ${events[rest[0]].name}`;
    case "deferred":
    case "spent":
      return null;
    default:
      return `${word} ${rest.join(" ")}`;
  }
}

/** Return the part after the time in the first line of a macrostep. */
export function causeText({ events }, [word, ...rest]) {
  if (word !== "event") return [word, ...rest].join(" ");
  return ["event", events[rest[0].event].name, ...rest[0].payload.map(shown)].join(" ");
}

// --- machines -----------------------------------------------------------------------------------

/** A running chart. */
export class Machine {
  /** `host` has a method for each operation of the chart, with the name of the operation. */
  constructor(definition, host = {}) {
    const lacking = definition.operations.filter(
      (name) => typeof host[name] !== "function" || host[name] === Object.prototype[name],
    );
    if (lacking.length) throw new TypeError(`the host lacks what ${definition.name} calls: ${lacking.join(", ")}`);
    this.definition = definition;
    this._sharing = definition.states.flatMap(({ shared }, state) => (shared.size > 0 ? [state] : []));
    this.host = host;
    /** Called with each line of the trace, unless null. */
    this.trace = null;
    /** Called with label and values of each `log`, unless null. */
    this.log = null;
    /** Receives the start and end of macrosteps, and each effect: see `_tell`. */
    this.watch = null;
    /** Called with the bounds of an interval delay of an environment; null: the maximum. */
    this.chance = null;
    /** Called with event, payload and addressee of each event that is sent out, unless null. */
    this.send = null;
    /** The value of the last `reply` of a dispatched event; null without one. */
    this.reply = null;
    this._busy = false;
    this._invoker = null;
    this._slot = 0;
    this._slots = definition.invocations.map((invocation, slot) => {
      const child = new Machine(invocation.definition, host);
      child._invoker = this;
      child._slot = slot;
      return child;
    });
    this.inputs = Object.create(null);
    definition.inputs(this);
    this._clear(0);
    this._running = false;
    this._resetData();
  }

  // --- interface for hosts --------------------------------------------------------------------------

  /** Start or restart at a time in ticks: enter the initial states. `kept`: data to keep. */
  start(now = 0, kept = {}) {
    this._call(() => {
      this._resetData();
      Object.assign(this.data, kept);
      this._clear(now);
      this._opened(["start"]);
      this._begin();
      this._settle();
    });
  }

  /** Put an event into the queue; false if that is full or the machine does not run. */
  post(event, ...payload) {
    const index = this._named(event, payload);
    if (!this._running || !this._hasRoom()) return false;
    this._queue.push({ event: index, payload });
    return true;
  }

  /** Process one event immediately, ahead of the queue; return whether it enabled a transition. */
  dispatch(event, ...payload) {
    const index = this._named(event, payload);
    return this._call(() => {
      this.reply = null;
      if (!this._running) return false;
      this._open({ event: index, payload });
      this._prepare();
      const isHandled = this._react(false);
      this._settle();
      return isHandled;
    });
  }

  /** Process all events and timers up to a time in ticks; return whether the machine still runs. */
  run(now) {
    return this._call(() => {
      now >>>= 0;
      if (!this._running) return false;
      this._now = now;
      if (this.definition.samplesInputs) {
        this._tryEventless();
      }
      let allowance = this._queue.length + this._deferred.length + this.definition.microsteps;
      while (this._running) {
        if (allowance > 0 && this._takeQueued()) {
          allowance -= 1;
        } else if (this._isDue(now)) {
          this._fire();
          allowance = this.definition.microsteps;
        } else {
          break;
        }
      }
      this._now = now;
      return this._running;
    });
  }

  /** Return the first deadline in ticks, or null if no timer is armed. */
  nextDeadline() {
    let first = this._timers.length ? this._timers[0].due : null;
    for (const child of this._slots) {
      const due = child._running ? child.nextDeadline() : null;
      if (due !== null && (first === null || (due - first) >>> 0 >= FAR)) first = due;
    }
    return first;
  }

  /** Return whether the state of that name is active. */
  isIn(state) {
    const found = this.definition.states.findIndex((one) => one.id === state);
    if (found < 1) throw new RangeError(`${this.definition.name} has no state ${state}`);
    return this._active[found];
  }

  /** The names of the active atomic states, in document order. */
  active() {
    return this._leaves().map((state) => this.definition.states[state].id);
  }

  /** Whether the machine was started and neither finished nor stopped by a fault. */
  get running() {
    return this._running;
  }

  /** Whether the machine ended in a top-level final state. */
  get finished() {
    return this._finished;
  }

  /** Why the machine stopped; null if it did not. */
  get fault() {
    return this._fault;
  }

  // --- calls ----------------------------------------------------------------------------------------

  _call(step) {
    if (this._busy) throw new Error(`${this.definition.name} was called from within one of its own steps`);
    this._busy = true;
    try {
      return step();
    } catch (error) {
      this._fault = this._fault ?? "exception";
      this._running = this._finished = false;
      throw error;
    } finally {
      this._busy = false;
    }
  }

  _named(event, payload) {
    const index = this.definition.postable.get(event);
    if (index === undefined) throw new RangeError(`${this.definition.name} receives no event ${event}`);
    const { size } = this.definition.events[index];
    if (payload.length !== size) throw new TypeError(`${event} carries ${size} values, not ${payload.length}`);
    return index;
  }

  _clear(now) {
    this._active = this.definition.states.map((_, state) => state === 0);
    this._fault = null;
    this._finished = false;
    this._running = true;
    this._now = now >>> 0;
    this._at = null;
    this._budget = 0;
    this._cause = null;
    this._waiting = new Set();
    this._isCancelled = false;
    this._guards = new Map();
    this._emptyQueues();
    for (const child of this._slots) child._running = false;
  }

  _resetData() {
    this.data = Object.create(null);
    this.outputs = Object.create(null);
    this._history = new Map();
    this.definition.reset(this);
  }

  _emptyQueues() {
    this._queue = [];
    this._deferred = [];
    this._internal = [];
    this._timers = [];
  }

  // --- trace ----------------------------------------------------------------------------------------

  /** Report the start of a macrostep; a tentative one is reported with its first effect. */
  _opened(cause, isTried = false) {
    const { watch, trace } = this._root();
    if (watch === null && trace === null) return;
    this._cause = cause;
    if (watch !== null) watch.open(this, cause);
    if (!isTried) this._announce();
  }

  /** Report the end of a macrostep; a tentative one without effect is not reported. */
  _closed() {
    const { watch, trace } = this._root();
    const isKept = this._cause === null;
    if (trace !== null && isKept) this._pass(["=", ...this.active(), ...(this._finished ? ["finished"] : [])].join(" "));
    if (watch !== null) watch.close(this, isKept);
    this._cause = null;
  }

  /** Execute a step without first and last line; not reported if the function returns false. */
  _aside(cause, step) {
    const { watch } = this._root();
    if (watch === null) return step();
    watch.open(this, cause);
    const done = step();
    watch.close(this, done !== false);
    return done;
  }

  _announce() {
    if (this._invoker !== null) this._invoker._announce();
    if (this._cause === null) return;
    const cause = this._cause;
    this._cause = null;
    if (this._root().trace !== null) this._pass(`@${this._now} > ${causeText(this.definition, cause)}`);
  }

  /** Report an effect: a word and its arguments in internal form. */
  _tell(row) {
    const { watch, trace } = this._root();
    if (watch === null && trace === null) return;
    this._announce();
    if (watch !== null) watch.tell(this, row);
    const line = trace === null ? null : effectLine(this.definition, row);
    if (line !== null) this._pass(line);
  }

  _pass(line) {
    if (this._invoker === null) {
      this.trace(line);
    } else {
      this._invoker._pass(`${this._invoker.definition.invocations[this._slot].id}: ${line}`);
    }
  }

  _root() {
    return this._invoker === null ? this : this._invoker._root();
  }

  // --- macrosteps (mainEventLoop) -------------------------------------------------------------------

  /** Start the macrostep of an event. */
  _open(occurrence) {
    this._budget = this.definition.microsteps;
    this._at = occurrence;
    this._opened(["event", occurrence]);
  }

  /** Try eventless transitions, as after a change of inputs. */
  _tryEventless() {
    this._budget = this.definition.microsteps;
    this._at = null;
    this._opened(["eventless"], true);
    this._settle();
  }

  /** Finalize and forward an event that has just left the external queue (SCXML 6.4.1, 6.5). */
  _prepare() {
    const { finalize, source } = this.definition.events[this._at.event];
    if (finalize && this._active[source]) this._block(finalize);
    this.definition.invocations.forEach((invocation, slot) => {
      if (invocation.forwards) this._forward(slot, this._at);
    });
  }

  /** Take the oldest recalled event, else the oldest queued one; else let invoked machines continue. */
  _takeQueued() {
    const recalled = this._deferred.findIndex(({ event }) => !this._defers(event));
    if (recalled < 0 && !this._queue.length) {
      return this._slots.length > 0 && this._aside(["within"], () => {
        const isDone = this._settleInvoked();
        this._close();
        return isDone;
      });
    }
    if (recalled >= 0) {
      this._open(this._deferred.splice(recalled, 1)[0]);
    } else {
      this._open(this._queue.shift());
      this._prepare();
    }
    this._react(true);
    this._settle();
    return true;
  }

  /** Take the transitions that the current event enables; else defer it or report it as unhandled. */
  _react(mayDefer) {
    const { event } = this._at;
    this._budget -= 1;
    const [enabled, isDeferred] = this._select(event);
    if (isDeferred && mayDefer && this._hasRoom()) {
      this._deferred.push(this._at);
      this._tell(["deferred", event]);
      this._mark();
      return false;
    }
    if (!enabled.length) {
      const { name, isError } = this.definition.events[event];
      this._tell(["unhandled", event]);
      if (isError) this._stop(name);
      this._mark();
      return false;
    }
    if (this._fault !== null) return false;
    this._microstep(enabled);
    return true;
  }

  /** Run to a stable configuration and start its invocations. */
  _settle() {
    this._complete();
    while (this._waiting.size && this._running && this._fault === null) {
      const waiting = [...this._waiting].sort((a, b) => a - b);
      this._waiting.clear();
      for (const state of waiting) this._blocks(this.definition.states[state].invokes);
      if (this._internal.length) this._complete();
    }
    if (this._running && this._fault === null) this._settleInvoked();
    if (this._fault === null && !this._running) {
      this._end();
    } else {
      this._close();
    }
    this._mark();
    this._closed();
  }

  _complete() {
    while (this._running && this._fault === null) {
      const [enabled] = this._select(NOTHING);
      if (this._fault !== null || !(enabled.length || this._internal.length)) break;
      if (this._budget <= 0) {
        this._stop("microsteps");
      } else if (enabled.length) {
        this._budget -= 1;
        this._microstep(enabled);
      } else {
        this._at = this._internal.shift();
        this._react(false);
      }
    }
  }

  _close() {
    if (this._fault !== null) this._running = this._finished = false;
  }

  /** Run the script and enter the initial states. */
  _begin() {
    this._budget = this.definition.microsteps - 1;
    this._block(this.definition.script);
    this._block(this.definition.initial);
    this.definition.enter(this);
    this._mark();
  }

  /** Leave all states, innermost first (exitInterpreter). */
  _end() {
    for (let state = this._active.length - 1; state > 0; state -= 1) {
      if (this._active[state]) this._left(state);
    }
    this._emptyQueues();
    if (this._finished && this.definition.conclude) this.definition.conclude(this);
  }

  // --- selection --------------------------------------------------------------------------------------

  _leaves() {
    const { states } = this.definition;
    const found = [];
    this._active.forEach((isActive, state) => isActive && states[state].isLeaf && found.push(state));
    return found;
  }

  _defers(event) {
    return this.definition.states.some((state, index) => this._active[index] && state.defers.has(event));
  }

  /** Return the optimal set that an event or no event enables, and whether the event is deferred. */
  _select(event) {
    const { states } = this.definition;
    const enabled = [];
    let isDeferred = false;
    this._guards.clear();
    for (const leaf of this._leaves()) {
      for (let state = leaf; state !== NOTHING; state = states[state].parent) {
        const { on, eventless, defers, shared } = states[state];
        const found = this._first(event === NOTHING ? eventless : on.get(event) ?? []);
        if (found !== NOTHING) {
          if (!enabled.includes(found)) enabled.push(found);
          break;
        }
        if (event !== NOTHING && defers.has(event) && !shared.has(event)) {
          isDeferred = true;
          break;
        }
      }
    }
    if (event !== NOTHING) {
      const keeps = (state) =>
        this._active[state] && states[state].shared.has(event) && !this._isAnswered(state, enabled);
      if (isDeferred || this._sharing.some(keeps)) return [[], true];
    }
    return [this._withoutConflicts(enabled), false];
  }

  _isAnswered(state, enabled) {
    const { last } = this.definition.states[state];
    return enabled.some((index) => {
      const { source } = this.definition.transitions[index];
      return state <= source && source <= last;
    });
  }

  _first(transitions) {
    for (const index of transitions) if (this._test(index)) return index;
    return NOTHING;
  }

  /** Evaluate a guard once per selection; a failing guard is false. */
  _test(index) {
    const { guard } = this.definition.transitions[index];
    if (guard === null) return true;
    let isHeld = this._guards.get(index);
    if (isHeld === undefined) {
      isHeld = this._attempt(() => guard(this), false);
      this._guards.set(index, isHeld);
    }
    return isHeld;
  }

  /** Remove preempted transitions (removeConflictingTransitions). */
  _withoutConflicts(enabled) {
    if (enabled.length < 2) return enabled;
    const { states, transitions } = this.definition;
    const isBelow = (state, ancestor) => ancestor < state && state <= states[ancestor].last;
    const kept = [];
    for (const index of enabled) {
      const domain = this._domain(index);
      const clashes = kept.filter((other) => other.domain !== null && domain !== null &&
        (domain === other.domain || isBelow(domain, other.domain) || isBelow(other.domain, domain)));
      const { source } = transitions[index];
      if (clashes.every((other) => isBelow(source, transitions[other.index].source))) {
        for (const other of clashes) kept.splice(kept.indexOf(other), 1);
        kept.push({ index, domain });
      }
    }
    return kept.map(({ index }) => index);
  }

  /** Return the reaction of a transition: the first variant whose conditions hold. */
  _variant(index) {
    const holds = ({ history, first, last }) => {
      const held = this._history.get(history);
      if (first === 0) return held === undefined;
      return held !== undefined && held.some((state) => first <= state && state <= last);
    };
    return this.definition.transitions[index].variants.find(({ conditions }) => conditions.every(holds));
  }

  _domain(index) {
    return this._variant(index).domain;
  }

  // --- microsteps ---------------------------------------------------------------------------------------

  /** Exit, run the content of the transitions, enter (Appendix D, microstep). */
  _microstep(enabled) {
    const { transitions } = this.definition;
    this._exit(enabled.map((index) => this._domain(index)).filter((domain) => domain !== null));
    for (const index of enabled) {
      this._tell(["t", index]);
      this._block(transitions[index].content);
    }
    for (const index of [...enabled].sort((a, b) => a - b)) {
      const { enter } = this._variant(index);
      if (enter) enter(this);
    }
    this._mark(enabled);
  }

  /** Report the end of a microstep with its transitions; it includes the effects since the last one. */
  _mark(transitions = []) {
    const { watch } = this._root();
    if (watch !== null && this._invoker === null) watch.mark([...transitions].sort((a, b) => a - b));
  }

  /** Record histories, run exit handlers and leave, innermost first (exitStates). */
  _exit(domains) {
    const { states } = this.definition;
    const exits = [];
    const last = Math.max(0, ...domains.map((domain) => states[domain].last));
    const first = Math.min(...domains);
    for (let state = last; state > first; state -= 1) {
      const isLeft = (domain) => domain < state && state <= states[domain].last;
      if (this._active[state] && domains.some(isLeft)) exits.push(state);
    }
    for (const state of exits) {
      for (const history of states[state].histories) {
        const kept = states[history].isDeep
          ? (other) => states[other].isLeaf && state < other && other <= states[state].last
          : (other) => states[other].parent === state;
        this._history.set(history, exits.filter(kept).reverse());
      }
    }
    for (const state of exits) {
      this._left(state);
      this._active[state] = false;
    }
  }

  /** Cancel timers, run exit handlers, cancel invocations. */
  _left(state) {
    const { timed, exit, slots } = this.definition.states[state];
    this._tell(["-", state]);
    if (timed.length) this._timers = this._timers.filter(({ transition }) => !timed.includes(transition));
    this._blocks(exit);
    this._waiting.delete(state);
    for (const slot of slots) this._dismiss(slot);
  }

  /** Enter a state, unless it is active: timers, handlers, the content of defaults (enterStates). */
  _enter(state, defaults = []) {
    if (this._active[state]) return;
    const { forgotten, timed, entry, invokes, final } = this.definition.states[state];
    this._active[state] = true;
    for (const history of forgotten) this._history.delete(history);
    this._tell(["+", state]);
    for (const index of timed) this._arm({ transition: index }, this._length(this.definition.transitions[index]));
    if (invokes.length) this._waiting.add(state);
    this._blocks(entry);
    for (const index of defaults) {
      this._tell(["t", index]);
      this._block(this.definition.transitions[index].content);
    }
    if (final) final(this);
  }

  /** Enter the recorded states of a deep history strictly below a state. */
  _restore(held, below) {
    const { states } = this.definition;
    const coming = new Set();
    for (const leaf of held) {
      if (leaf <= below || leaf > states[below].last) continue;
      for (let state = leaf; state !== below; state = states[state].parent) coming.add(state);
    }
    for (const state of [...coming].sort((a, b) => a - b)) this._enter(state);
  }

  /** Whether a compound state is at a final child, a parallel one in all regions (isInFinalState). */
  _isInFinalState(state) {
    const { kind, children } = this.definition.states[state];
    const { states } = this.definition;
    if (kind === "parallel") return children.every((child) => this._isInFinalState(child));
    return kind === "compound" && children.some((child) => states[child].kind === "final" && this._active[child]);
  }

  _finish() {
    this._running = false;
    this._finished = true;
  }

  // --- content ------------------------------------------------------------------------------------------

  _blocks(blocks) {
    for (const block of blocks) this._block(block);
  }

  /** Run one block; an error skips the rest of it (SCXML 4.1). */
  _block(block) {
    if (block) this._attempt(() => block(this), null);
  }

  /** Return the value of an expression, or a default if it fails. */
  _attempt(evaluate, otherwise) {
    try {
      return evaluate();
    } catch (error) {
      if (error instanceof RangeFault) {
        this._stop("range");
      } else if (error instanceof ContentError) {
        this._error("error.execution");
      } else if (!(error instanceof EndOfBlock)) {
        throw error;
      }
      return otherwise;
    }
  }

  /** Evaluate a condition in content; a failing one is false and raises `error.execution`. */
  _holds(condition) {
    try {
      return condition();
    } catch (error) {
      if (!(error instanceof ContentError)) throw error;
      this._error("error.execution");
      return false;
    }
  }

  /** Return the nearest value of a range; a change raises an error event. */
  _clamp(value, lo, hi) {
    if (lo <= value && value <= hi) return value;
    this._error("error.range");
    return nearest(value, lo, hi);
  }

  _field(name) {
    const at = this._at === null ? undefined : this.definition.events[this._at.event].fields.get(name);
    if (at === undefined) throw new ContentError(`the current event has no field ${name}`);
    return this._at.payload[at];
  }

  _eventName() {
    return this._at === null ? "" : this.definition.events[this._at.event].name;
  }

  _eventType() {
    return this._at === null ? "" : this.definition.events[this._at.event].type;
  }

  _raise(event, payload) {
    this._tell(["raise", event, payload]);
    this._enqueueInternal(event, payload);
  }

  _sendOwn(event, payload) {
    this._tell(["send", event, payload]);
    this._enqueueOwn(event, payload);
  }

  _emit(event, payload, peer) {
    this._tell(["out", event, payload, peer]);
    const root = this._root();
    if (root.send !== null) root.send(this.definition.events[event].name, payload, peer);
  }

  _delay(event, payload, delay, mark, route, slots, peer) {
    if (delay < 0) throw new ContentError("a delay cannot be negative");
    this._tell(["delay", event, payload, delay]);
    if (this._timers.filter(({ transition }) => transition === NOTHING).length >= this.definition.delayed) {
      this._tell(["full", "delayed"]);
      return;
    }
    this._arm({ transition: NOTHING, event, payload, mark, route, slots, peer }, delay);
  }

  _cancel(mark) {
    this._tell(["cancel", mark]);
    this._timers = this._timers.filter((timer) => timer.transition !== NOTHING || timer.mark !== mark);
  }

  _log(label, values) {
    this._tell(["log", label, values]);
    const root = this._root();
    if (root.log !== null) root.log(label, ...values);
  }

  _reply(value) {
    this.reply = value;
    this._tell(["reply", value]);
  }

  _operation(name, passed, hasResult) {
    const result = this.host[name](...passed);
    // the host performs the outer machine's operation of that name, which may return nothing
    this._tell(["op", name, passed, hasResult && result !== undefined, result]);
    return result;
  }

  // --- queues and errors ----------------------------------------------------------------------------------

  _hasRoom() {
    return this._queue.length + this._deferred.length < this.definition.queue;
  }

  _enqueueOwn(event, payload) {
    if (this._hasRoom()) {
      this._queue.push({ event, payload });
    } else {
      this._tell(["full", "queue"]);
    }
  }

  _enqueueInternal(event, payload) {
    if (this._internal.length < this.definition.internal) {
      this._internal.push({ event, payload });
    } else {
      this._tell(["full", "internal"]);
      this._stop("internal");
    }
  }

  _error(name) {
    this._tell(["error", name]);
    const event = this.definition.errors.get(name);
    if (event !== undefined) this._enqueueInternal(event, this.definition.events[event].blank);
  }

  /** Stop the machine with a fault; only the first one counts. */
  _stop(reason) {
    if (this._fault !== null) return;
    this._fault = reason;
    this._tell(["fault", reason]);
  }

  // --- timers -----------------------------------------------------------------------------------------------

  /** Return a delay; for an interval, `chance` picks it. */
  _length({ least, delay }) {
    const { chance } = this._root();
    return least === undefined || chance === null ? delay : chance(least, delay);
  }

  /** Insert a timer after those with an earlier or equal deadline. */
  _arm(timer, delay) {
    const due = (this._now + delay) >>> 0;
    let at = this._timers.length;
    while (at > 0 && (due - this._timers[at - 1].due) >>> 0 >= FAR) at -= 1;
    this._timers.splice(at, 0, { ...timer, due });
  }

  _isDue(now) {
    const due = this.nextDeadline();
    return due !== null && (now - due) >>> 0 < FAR;
  }

  /** Fire the first timer at its deadline; of equal ones, the machine's own comes first. */
  _fire() {
    const due = this.nextDeadline();
    this._now = due;
    if (!this._timers.length || this._timers[0].due !== due) {
      this._aside(["within"], () => {
        const child = this._slots.find((one) => one._running && one.nextDeadline() === due);
        if (child) {
          child._fire();
          this._absorb(child);
        }
        if (this._fault === null) this._settleInvoked();
        this._close();
      });
      return;
    }
    const timer = this._timers.shift();
    if (timer.transition === NOTHING) {
      this._deliver(timer);
    } else {
      this._timeOut(timer.transition);
    }
  }

  _deliver({ event, payload, route, slots, peer }) {
    if (route === INVOKED && !slots.some((slot) => this._slots[slot]._running)) {
      const error = this.definition.errors.get("error.communication");
      this._takeInternal({ event: error, payload: this.definition.events[error].blank });
    } else if (route === INTERNAL) {
      this._takeInternal({ event, payload });
    } else if (route === PORT) {
      this._aside(["delayed", { event, payload }], () => this._emit(event, payload, peer));
    } else if (route === SELF) {
      this._aside(["delayed", { event, payload }], () => this._enqueueOwn(event, payload));
    } else {
      this._aside(["within"], () => {
        if (route === INVOKER) this._answer(event, payload);
        else this._hand(slots, event, payload, peer);
        this._settleInvoked();
        this._close();
      });
    }
  }

  _takeInternal(occurrence) {
    this._open(occurrence);
    this._react(false);
    this._settle();
  }

  /** Take the first enabled transition that waits for a timer, if any. */
  _timeOut(index) {
    this._budget = this.definition.microsteps - 1;
    this._at = null;
    this._opened(["timeout", index]);
    const { isPeriodic, delay, slack, others = [] } = this.definition.transitions[index];
    if (isPeriodic) this._arm({ transition: index }, delay);
    this._guards.clear();
    const waiting = [index, ...others];
    const taken = waiting.find((each) => this._fault === null && this._test(each));
    if (taken === undefined) {
      const { chance } = this._root();
      if (slack === undefined) this._tell(["spent", index]);
      else this._arm({ transition: index }, 1 + (chance === null ? 0 : chance(0, slack)));
      this._mark();
    } else if (this._fault === null) {
      this._microstep([taken]);
    }
    this._settle();
  }

  // --- invoked machines (SCXML 6.4) -------------------------------------------------------------------------

  _invoke(slot, give) {
    const child = this._slots[slot];
    child._resetData();
    give(child);
    child._clear(this._now);
    child._opened(["start"]);
    child._begin();
    child._settle();
    this._absorb(child);
  }

  /** Let each invoked machine take one event in turn, in document order, until all are quiet. */
  _settleInvoked() {
    let isDone = false;
    if (!this._slots.length) return isDone;
    for (let round = 0; round < this.definition.microsteps; round += 1) {
      let isQuiet = true;
      for (const child of this._slots) {
        if (!child._running || this._fault !== null) continue;
        child._now = this._now;
        if (child._takeQueued()) {
          isQuiet = false;
          this._absorb(child);
        }
      }
      if (isQuiet) break;
      isDone = true;
    }
    return isDone;
  }

  _absorb(child) {
    if (child._fault !== null) this._stop("invoked");
  }

  /** Cancel an invoked machine: it exits its states, and its events are dropped. */
  _dismiss(slot) {
    const child = this._slots[slot];
    if (!child._running) return;
    child._now = this._now;
    child._isCancelled = true;
    child._running = false;
    child._aside(["cancelled"], () => child._end());
    this._absorb(child);
  }

  /** Put an event into the queue of the invoker, which may be cancelling this machine. */
  _answer(event, payload) {
    this._tell(["out", event, payload, "#_parent"]);
    if (this._isCancelled) return;
    const invoker = this._invoker;
    if (invoker === null || !invoker._hasRoom()) {
      this._tell(["full", "queue"]);
      return;
    }
    const passage = invoker.definition.invocations[this._slot].returns[event];
    if (passage !== null && invoker._running) invoker._queue.push({ event: passage.event, payload: passage.payload(payload) });
  }

  /** Put an event into the queue of the first invoked machine that is running. */
  _hand(slots, event, payload, peer) {
    this._tell(["out", event, payload, peer]);
    const slot = slots.find((one) => this._slots[one]._running);
    if (slot === undefined) {
      this._error("error.communication");
    } else {
      this._forward(slot, { event, payload });
    }
  }

  _forward(slot, { event, payload }) {
    const child = this._slots[slot];
    const passage = this.definition.invocations[slot].passages[event];
    if (passage === null || !child._running) return;
    if (child._hasRoom()) {
      child._queue.push({ event: passage.event, payload: passage.payload(payload) });
    } else {
      this._tell(["full", "queue"]);
    }
  }
}
