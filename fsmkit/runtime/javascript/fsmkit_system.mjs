// Simulate a system one macrostep at a time, as a pure function that permits undo.
//
// The schedule is that of `fsmkit.runtime.system_session`: the machines of the environment run first,
// then each machine in the order of the file until it is quiet. When all are quiet, time advances to
// the next deadline. A single chart is a system of one machine. A moment is immutable, so moments
// share common parts. Times are ticks, not wrapped.

import { changed } from "./fsmkit_runtime.mjs";

export const FOR_EVER = 2 ** 52;
const MOST_AT_ONCE = 10000;
const LAST = 64;
const LARGEST_RANGE = 2 ** 22;

/** An error of the simulation: a rule of fsmkit, and the reason. */
export class SimulationError extends Error {
  constructor(rule, message, help = "") {
    super(message);
    this.rule = rule;
    this.help = help;
  }
}

/** Whether values of a type, as descriptions of charts give it, are BigInt. */
export function isBig({ kind, lo, hi }) {
  return kind === "int" && (typeof lo === "object" || typeof hi === "object" ||
    lo < Number.MIN_SAFE_INTEGER || hi > Number.MAX_SAFE_INTEGER);
}

/** The types of the parts of an array or record; null of a scalar. */
export function partTypes(type) {
  if (type.kind === "array") return Array.from({ length: type.length }, () => type.of);
  return type.kind === "record" ? type.fields.map((field) => field.type) : null;
}

/** A value of another type of the same kind, as values of a type are held. */
export function held(value, type) {
  if (Array.isArray(value)) {
    const types = partTypes(type);
    return value.map((part, at) => held(part, types[at]));
  }
  if (typeof value === "bigint") return isBig(type) ? value : Number(value);
  return typeof value === "number" && isBig(type) ? BigInt(value) : value;
}

/** Whether two values are the same number, truth value, text, or hold the same. */
export function isEqual(one, other) {
  return one === other || (Array.isArray(one) && one.every((part, at) => isEqual(part, other[at])));
}

function bound(end) {
  return BigInt(typeof end === "object" ? end.int : end);
}

/** A value of the `from` list of an operation, as machines hold it. */
function fromList(value, type) {
  const types = Array.isArray(value) ? partTypes(type) : null;
  if (types !== null) return value.map((part, at) => fromList(part, types[at]));
  if (typeof value !== "object") return value;
  if ("float" in value) return Number(value.float);
  return isBig(type) ? BigInt(value.int) : Number(value.int);
}

/** Pseudo-random operations and delays: a linear congruential generator mod 2^31, as in all harnesses. */
class Answers {
  constructor(operations) {
    this.state = 1;
    this.given = new Map(); // the results of operations, one per call; the last one is repeated
    this.host = Object.create(null);
    for (const { name, result, tried } of operations) {
      const listed = (tried ?? []).map((value) => fromList(value, result));
      Object.defineProperty(this.host, name, { value: () => this.result(name, result, listed) });
    }
  }

  /** The next result of an operation: a given one, one of its `from` list, or any of its type. */
  result(name, type, listed) {
    if (type === null) return undefined;
    const [first, ...others] = this.given.get(name) ?? [];
    if (others.length) this.given = new Map(this.given).set(name, others);
    if (first !== undefined) return first;
    return listed.length ? listed[(this.next() >> 8) % listed.length] : this.value(type);
  }

  next() {
    this.state = (Math.imul(1103515245, this.state) + 12345) & 0x7fffffff;
    return this.state;
  }

  delay(least, greatest) {
    return least + (this.next() >> 8) % (greatest - least + 1);
  }

  value(type) {
    const parts = partTypes(type);
    if (parts !== null) return parts.map((part) => this.value(part));
    const x = this.next();
    switch (type.kind) {
      case "bool":
        return ((x >> 16) & 1) === 1;
      case "int": {
        const lo = bound(type.lo), size = bound(type.hi) - lo + 1n;
        const value = lo + BigInt(x >> 8) % (size < LARGEST_RANGE ? size : BigInt(LARGEST_RANGE));
        return isBig(type) ? value : Number(value);
      }
      case "enum":
        return (type.numbers ?? type.members.map((_, at) => at))[(x >> 8) % type.members.length];
      case "duration":
        return (x >> 8) % 1001;
      case "float":
        return ((x >> 8) % 2001 - 1000) / 8;
      default:
        return "";
    }
  }
}

// --- machines as values ---------------------------------------------------------------------------

/** A tick as a number that grows, of one that is near and known. */
function absolute(tick, near) {
  return near + ((tick - near) | 0);
}

function copied(values) {
  return Object.assign(Object.create(null), values);
}

/** A machine as a value, at a time. */
function frozen(machine, now) {
  return {
    active: machine._active.slice(),
    data: copied(machine.data),
    outputs: copied(machine.outputs),
    inputs: copied(machine.inputs),
    history: new Map(machine._history),
    queue: machine._queue.slice(),
    deferred: machine._deferred.slice(),
    timers: machine._timers.map((timer) => ({ ...timer, due: absolute(timer.due, now) })),
    now,
    running: machine._running,
    finished: machine._finished,
    fault: machine._fault,
    invoked: machine._slots.map((child) => (child._running ? frozen(child, now) : null)),
  };
}

/** Let a machine be as a value says. */
function thaw(machine, snapshot) {
  machine._clear(snapshot.now);
  machine._active = snapshot.active.slice();
  machine.data = copied(snapshot.data);
  machine.outputs = copied(snapshot.outputs);
  machine.inputs = copied(snapshot.inputs);
  machine._history = new Map(snapshot.history);
  machine._queue = snapshot.queue.slice();
  machine._deferred = snapshot.deferred.slice();
  machine._timers = snapshot.timers.map((timer) => ({ ...timer, due: timer.due >>> 0 }));
  machine._running = snapshot.running;
  machine._finished = snapshot.finished;
  machine._fault = snapshot.fault;
  machine._slots.forEach((child, slot) => {
    if (snapshot.invoked[slot] === null) child._running = false;
    else thaw(child, snapshot.invoked[slot]);
  });
}

/** Return the first deadline of a machine and the machines it invokes, or null. */
function nextDeadline({ timers, invoked }) {
  let first = timers.length ? timers[0].due : null;
  for (const child of invoked) {
    const due = child === null ? null : nextDeadline(child);
    if (due !== null && (first === null || due < first)) first = due;
  }
  return first;
}

/** The names of the active atomic states, in document order. */
export function leaves({ states }, { active }) {
  return states.filter((state, index) => active[index] && state.isLeaf).map((state) => state.id);
}

/** Keeps the macrosteps of a machine, with what it invoked inside of them. */
class Watcher {
  constructor() {
    this.frames = [];
    this.done = null;
  }

  open(machine, cause) {
    const isRoot = machine._invoker === null;
    const before = isRoot ? frozen(machine, absolute(machine._now, this.near)) : null;
    if (isRoot && cause[0] === "start") before.running = false;
    this.frames.push({ at: absolute(machine._now, this.near), cause, rows: [], marks: [], before });
  }

  /** End a microstep; one without effect is ignored. */
  mark(transitions) {
    const { rows, marks } = this.frames[this.frames.length - 1];
    const from = marks.length ? marks[marks.length - 1].to : 0;
    if (rows.length > from || transitions.length) marks.push({ transitions, from, to: rows.length });
  }

  tell(machine, row) {
    this.frames[this.frames.length - 1].rows.push(row);
  }

  close(machine, isKept) {
    const frame = this.frames.pop();
    if (!isKept) return;
    if (machine._invoker === null) {
      this.done = frame;
      return;
    }
    const on = [...machine.active(), ...(machine._finished ? ["finished"] : [])];
    const { at, cause, rows } = frame;
    this.frames[this.frames.length - 1].rows.push(["in", machine._slot, { at, cause, rows, on }]);
  }
}

/** A machine of the simulation: it is set to a snapshot, does a step, and is taken as a value again. */
class Player {
  constructor(Machine, operations) {
    this.answers = new Answers(operations);
    this.watcher = new Watcher();
    this.machine = new Machine(this.answers.host);
    this.machine.watch = this.watcher;
    this.machine.chance = (least, greatest) => this.answers.delay(least, greatest);
    this.definition = this.machine.definition;
    this.held = null;
  }

  /** Set the machine to a snapshot. */
  load(snapshot) {
    if (this.held !== snapshot) thaw(this.machine, snapshot);
    this.held = null;
    this.machine._now = snapshot.now >>> 0;
    this.watcher.near = snapshot.now;
    this.watcher.done = null;
    this.watcher.frames = [];
    return this.machine;
  }

  /** Do a step from a snapshot with the results of operations; return the macrostep or null. */
  step(snapshot, answers, given, act) {
    const machine = this.load(snapshot);
    [this.answers.state, this.answers.given] = [answers, given];
    act(machine);
    const { done } = this.watcher;
    if (done === null) return null;
    const after = frozen(machine, absolute(machine._now, snapshot.now));
    this.held = after;
    return { ...done, after, answers: this.answers.state, given: this.answers.given };
  }
}

// --- the schedule -----------------------------------------------------------------------------------

/** The steps of a system; a pure function of a moment. */
export class Simulation {
  /** `system`: what `fsmkit.inspector.bundle` writes of one, each machine with its class. */
  constructor(system, seed = 1) {
    this.system = system;
    this.seed = seed;
    this.machines = system.machines;
    this.players = this.machines.map(({ Machine, chart }) => new Player(Machine, chart.operations));
    const places = this.machines.map((_, place) => place);
    this.order = [...places.filter((m) => this.machines[m].environment), ...places.filter((m) => !this.machines[m].environment)];
    this.initial = this.players.map(({ machine }) => frozen(machine, 0));
    this.most = this.players.reduce((sum, { definition }) => sum + mostAtOnce(definition), 0);
  }

  definition(machine) {
    return this.players[machine].definition;
  }

  /** The system before its start. */
  begin() {
    let moment = {
      now: 0, snapshots: this.initial, answers: this.machines.map(() => this.seed), given: this.machines.map(() => new Map()),
      toStart: this.order, started: [], turn: null, atOnce: 0,
    };
    for (const machine of this.order) moment = this.drive(moment, machine, null).moment;
    return moment;
  }

  /** Put an event in the queue of a machine; null if it has no room or does not run. */
  post(moment, machine, event, payload) {
    const snapshot = moment.snapshots[machine];
    const { queue, deferred, running } = snapshot;
    if (!running || queue.length + deferred.length >= this.definition(machine).queue) return null;
    return withMachine(moment, machine, { ...snapshot, queue: [...queue, { event, payload }] });
  }

  /** Set the next results of an operation, one per call; the last one repeats. */
  setResults(moment, machine, operation, results) {
    return { ...moment, given: placed(moment.given, machine, new Map(moment.given[machine]).set(operation, results)) };
  }

  /** Give an input another value; after the inputs shared data are counted. */
  setInput(moment, machine, number, value) {
    const { chart, shared } = this.machines[machine];
    const snapshot = moment.snapshots[machine];
    if (number < chart.inputs.length) {
      const { name, type } = chart.inputs[number];
      const inputs = { ...copied(snapshot.inputs), [name]: held(value, type) };
      return withMachine(moment, machine, { ...snapshot, inputs });
    }
    const { data: place, element } = shared[number - chart.inputs.length];
    const { name, type } = chart.data[place];
    const whole = element === null ? held(value, type) : changed(snapshot.data[name], element, held(value, type.of));
    return withMachine(moment, machine, { ...snapshot, data: { ...copied(snapshot.data), [name]: whole } });
  }

  /**
   * Take the next macrostep up to a time. Without one `done` is null, and the time is `until`, or that
   * of the last step if no timer is armed.
   */
  step(moment, until = FOR_EVER) {
    if (moment.toStart.length) return this.start(moment);
    for (;;) {
      if (moment.turn !== null) return this.close(...this.within({ ...moment, turn: null }, moment.turn));
      for (const machine of this.order) {
        moment = atTime(moment, machine);
        const found = this.beginTurn(moment, machine);
        if (found !== null) return this.close(...found);
      }
      const deadline = this.nextDeadline(moment);
      if (deadline === null || deadline > until) {
        return { moment: { ...moment, now: until === FOR_EVER ? moment.now : until }, done: null };
      }
      moment = { ...moment, now: deadline, atOnce: 0 };
    }
  }

  /** Return the first deadline of any machine, or null. */
  nextDeadline({ snapshots }) {
    const found = snapshots.filter(({ running }) => running).map(nextDeadline).filter((due) => due !== null);
    return found.length ? Math.min(...found) : null;
  }

  // --- turns ----------------------------------------------------------------------------------------

  start(moment) {
    const [machine, ...rest] = moment.toStart;
    const { chart, shared } = this.machines[machine];
    const before = moment.snapshots[machine];
    const kept = Object.fromEntries(shared.map(({ data }) => [chart.data[data].name, before.data[chart.data[data].name]]));
    const first = this.act(moment, machine, { ...before, now: moment.now }, (m) => m.start(moment.now, kept));
    let following = after(moment, machine, first), changes;
    ({ moment: following, driven: changes } = this.drive(following, machine, before));
    const started = [...moment.started, [machine, first]];
    following = { ...following, toStart: rest, started: rest.length ? started : [] };
    const passed = [];
    if (!rest.length) {
      for (const [each, macrostep] of started) {
        const on = this.passOn(following, each, [macrostep]);
        following = on.moment;
        passed.push(...on.passed);
      }
    }
    return { moment: following, done: { machine, macrostep: first, passed, driven: changes } };
  }

  act(moment, machine, snapshot, act) {
    return this.players[machine].step(snapshot, moment.answers[machine], moment.given[machine], act);
  }

  beginTurn(moment, machine) {
    const before = moment.snapshots[machine];
    if (!before.running) return null;
    const { triesEventless, shared } = this.machines[machine];
    if (triesEventless) {
      const tried = this.act(moment, machine, before, (m) => m._tryEventless());
      if (tried !== null) {
        const turn = { machine, before, allowance: this.allowance(machine, tried.after), done: [tried], isSingle: shared.length > 0 };
        return [after(moment, machine, tried), turn];
      }
    }
    return this.within(moment, { machine, before, allowance: this.allowance(machine, before), done: [], isSingle: false });
  }

  allowance(machine, { queue, deferred }) {
    return queue.length + deferred.length + this.definition(machine).microsteps;
  }

  /** Process the next event or timer of the current turn; null without one. */
  within(moment, turn) {
    const { machine, isSingle } = turn;
    const snapshot = moment.snapshots[machine];
    if (!snapshot.running || isSingle) return null;
    let allowance = turn.allowance - 1;
    let done = turn.allowance > 0 ? this.act(moment, machine, snapshot, (m) => m._takeQueued()) : null;
    if (done === null) {
      const due = nextDeadline(snapshot);
      if (due === null || due > moment.now) return null;
      done = this.act(moment, machine, snapshot, (m) => m._fire());
      allowance = this.definition(machine).microsteps;
    }
    return [after(moment, machine, done), { ...turn, allowance, done: [...turn.done, done] }];
  }

  /** Count the step; deliver the events of the turn if the machine is quiet. */
  close(moment, turn) {
    const { machine } = turn;
    const last = turn.done[turn.done.length - 1];
    moment = { ...moment, atOnce: moment.atOnce + 1 };
    if (moment.atOnce > this.most) throw this.standsStill(machine, turn.done);
    if (this.hasMore(moment, turn)) return { moment: { ...moment, turn }, done: { machine, macrostep: last, passed: [], driven: [] } };
    const on = this.passOn(atTime(moment, machine), machine, turn.done);
    const driven = this.drive(on.moment, machine, turn.before);
    return { moment: driven.moment, done: { machine, macrostep: last, passed: on.passed, driven: driven.driven } };
  }

  hasMore(moment, turn) {
    const snapshot = moment.snapshots[turn.machine];
    if (!snapshot.running || turn.isSingle) return false;
    const due = nextDeadline(snapshot);
    if (due !== null && due <= moment.now) return true;
    if (turn.allowance <= 0) return false;
    const { states } = this.definition(turn.machine);
    const isDeferred = ({ event }) => states.some((state, index) => snapshot.active[index] && state.defers.has(event));
    if (snapshot.queue.length || snapshot.deferred.some((each) => !isDeferred(each))) return true;
    return snapshot.invoked.some((child) => child !== null) && this.within(moment, turn) !== null;
  }

  standsStill(machine, done) {
    const definition = this.definition(machine);
    const small = done.slice(-LAST).flatMap(({ rows }) => rows);
    const entered = small.filter(([word]) => word === "+").map(([, state]) => definition.states[state].id);
    const last = done[done.length - 1];
    const names = [...new Set(entered.length ? entered : leaves(definition, last.after))];
    const at = durationText(last.at * this.system.tick);
    const most = mostAtOnce(definition).toLocaleString("en-US");
    return new SimulationError(
      "livelock",
      `time stands still at ${at}: \`${definition.name}\` takes more than ${most} steps at one time, in ${names.map((name) => `\`${name}\``).join(", ")}`,
      "give one of the delays a length, or let one of the steps wait for an event",
    );
  }

  // --- between machines -------------------------------------------------------------------------------

  passOn(moment, source, done) {
    const { events, operations } = this.machines[source].chart;
    const passed = [];
    for (const [word, ...rest] of done.flatMap(({ rows }) => rows)) {
      let port, values;
      if (word === "out") [port, values] = rest;
      else if (word === "op") [port, values] = [events.length + operations.findIndex(({ name }) => name === rest[0]), rest[1]];
      else continue;
      for (const link of this.system.eventLinks) {
        if (link.source !== source || link.port !== port) continue;
        const { fields } = this.machines[link.target].chart.events[link.event];
        const payload = link.arguments.map((place, at) => held(values[place], fields[at].type));
        const following = this.post(moment, link.target, link.event, payload);
        passed.push({ link, payload, hasRoom: following !== null });
        moment = following ?? moment;
      }
    }
    return { moment, passed };
  }

  /** Copy changed outputs and shared variables of a machine to the machines that read them. */
  drive(moment, source, before) {
    const driven = [];
    for (const { source: from, output, target, input } of this.system.inputLinks) {
      if (from !== source) continue;
      const value = this.written(source, moment.snapshots[source], output);
      if (before !== null && isEqual(value, this.written(source, before, output))) continue;
      moment = this.setInput(moment, target, input, value);
      driven.push({ machine: target, number: input, value });
    }
    return { moment, driven };
  }

  /** Return the source of a wire: an output, else a shared variable, else any data. */
  written(machine, snapshot, number) {
    const { chart, shared } = this.machines[machine];
    if (number < chart.outputs.length) return snapshot.outputs[chart.outputs[number].name];
    const place = number - chart.outputs.length;
    if (place < shared.length) {
      const { data, element } = shared[place];
      const value = snapshot.data[chart.data[data].name];
      return element === null ? value : value[element];
    }
    const rest = place - shared.length;
    if (rest < chart.data.length) return snapshot.data[chart.data[rest].name];
    return snapshot.outputs[chart.outputs[rest - chart.data.length].name];
  }
}

function mostAtOnce({ transitions }) {
  return Math.max(MOST_AT_ONCE, 2 * transitions.length);
}

/** Return a copy of an array with another element for one machine. */
function placed(ofEach, machine, one) {
  return [...ofEach.slice(0, machine), one, ...ofEach.slice(machine + 1)];
}

function withMachine(moment, machine, snapshot) {
  return { ...moment, snapshots: placed(moment.snapshots, machine, snapshot) };
}

/** The system after a macrostep of a machine; its host has answered meanwhile. */
function after(moment, machine, done) {
  const answers = placed(moment.answers, machine, done.answers);
  const given = placed(moment.given, machine, done.given);
  return withMachine({ ...moment, answers, given }, machine, done.after);
}

/** The system in which a machine has seen the time. */
function atTime(moment, machine) {
  const snapshot = moment.snapshots[machine];
  return snapshot.now === moment.now ? moment : withMachine(moment, machine, { ...snapshot, now: moment.now });
}

/** Microseconds in the largest of us, ms and s that is exact, or seconds with a point. */
export function durationText(us) {
  if (us >= 1e6 && us % 1000 === 0) return `${us / 1e6}s`;
  return us % 1000 === 0 ? `${us / 1000}ms` : `${us}us`;
}
