// The hub of a page that simulates offline: executes commands and sends messages, as
// fsmkit/inspector/hub.py. It has no clock: `advance` passes real time.

import * as rt from "./fsmkit_runtime.mjs";
import { FOR_EVER, Simulation, SimulationError, leaves } from "./fsmkit_system.mjs";
import { ExpressionError, holds, isUnchanged, read, shownText, shownValue } from "./expressions.mjs";
import { History, LIMIT } from "./history.mjs";
import { fromJson, linesOf, microstepsOf, rowOfEvent, stateOf, stepOf, toJson } from "./live.mjs";
import { events, payloadOf, why } from "./queries.mjs";
import { acted, performed, pytestOf, recalled, scriptOf } from "./scripts.mjs";

const PROTOCOL = 1;
const MOST_STEPS = 1000;
const SLOWEST = 0.001, FASTEST = 1000;
const MOST_RESENT = 10000;
const STATE_EVERY = 1000;
const CLOCK_EVERY = 100000;
const MOST_POINTS = 100;
const MOST_LOOKED = 512;
const BRACES = /\{([^{}]*)\}/; // the placeholder of a value in the text of a log
const KINDS = ["entered", "left", "taken", "event", "sent", "fault", "error", "lost", "condition", "changed", "property"];
const WORDS = { entered: ["+"], left: ["-"], taken: ["t"], sent: ["out", "raise", "send"], fault: ["fault"], error: ["error"], lost: ["full"] };
const CAN = ["post", "set", "returns", "run", "pause", "step", "back", "forward", "seek", "break", "unbreak",
  "watch", "why", "events", "micro", "find", "chart", "history", "branches", "fork", "save", "scenarios", "play"];

/** A command that cannot be obeyed: a rule of fsmkit, why, and a way out. */
export class Refusal extends Error {
  constructor(rule, message, help = "") {
    super(message);
    this.rule = rule;
    this.help = help;
  }
}

function wrong(message, help) {
  return new Refusal("wrong-command", message, help);
}

function placeOf(name, known, kind) {
  if (!known.includes(name)) throw new Refusal("unknown-name", `there is no ${kind} \`${name}\``, known.length ? `use one of ${known.slice(0, 8).join(", ")}` : "");
  return known.indexOf(name);
}

/** A session of a simulated system; `description` is written by `fsmkit.inspector.bundle`. */
export class Hub {
  constructor(description, { seed = 1, limit = LIMIT } = {}) {
    this.description = description;
    this.simulation = new Simulation(description, seed);
    this.names = description.machines.map(({ name }) => name);
    this.charts = description.machines.map(({ chart }) => chart);
    this.clients = [];
    this.points = new Map();
    this.hit = new Map();
    this.nextPoint = 1;
    this.until = null;
    this.isRunning = false;
    this.speed = 1;
    this.due = 0;
    this.sinceClock = 0;
    this.why = [];
    this.moment = this.simulation.begin();
    this.n = 0;
    this.history = new History(this.moment, limit);
    this.settle();
    for (const point of description.points) this.addBreakpoint(point);
  }

  // --- clients ----------------------------------------------------------------------------------------

  /** Add a client that receives messages as objects. */
  join(send) {
    this.clients.push(send);
    send([this.hello(), ...this.states(), this.mode(), ...(this.points.size ? [this.told()] : [])]);
  }

  /** Execute or reject a command; return the response. */
  receive(command) {
    try {
      const result = this.obey(command) ?? null;
      return result === null ? { k: "done", re: command.id } : { k: "done", re: command.id, result };
    } catch (error) {
      const { rule = "wrong-value", message, help } = error;
      if (!(error instanceof Refusal || error instanceof SimulationError || error instanceof ExpressionError || error instanceof ValueError)) throw error;
      return help ? { k: "refused", re: command.id, rule, message, help } : { k: "refused", re: command.id, rule, message };
    }
  }

  // --- time -------------------------------------------------------------------------------------------

  /** Go on by so much real time; nothing if the session stands still. */
  advance(microseconds) {
    if (!this.isRunning) return;
    this.due += (microseconds * this.speed) / this.description.tick;
    this.go(this.speed === 0 ? FOR_EVER : Math.floor(this.due), MOST_STEPS);
    this.sinceClock += microseconds;
    if (this.isRunning && this.sinceClock >= CLOCK_EVERY) {
      this.sinceClock = 0;
      this.broadcast(this.mode());
    }
  }

  /** Whether there is more to do than `advance` did: it should be called again at once. */
  get wantsMore() {
    return this.isRunning && (this.speed === 0 || this.moment.now < Math.floor(this.due));
  }

  /** Step until a time, a breakpoint, a fault, or so many steps. */
  go(until, most) {
    for (let count = 0; count < most; count += 1) {
      if (!this.step(until)) {
        if (until === FOR_EVER) this.stop(["idle"]);
        return;
      }
      if (!this.isRunning) return;
    }
  }

  /** Start, and process all steps at the same time. */
  settle() {
    const wasRunning = this.isRunning;
    this.isRunning = true;
    this.go(this.moment.now, MOST_STEPS);
    if (this.isRunning) this.isRunning = wasRunning;
  }

  /** Take a step; return false if no step is possible until that time. */
  step(until) {
    const before = this.moment;
    let done;
    try {
      ({ moment: this.moment, done } = this.simulation.step(before, until));
    } catch (error) {
      if (!(error instanceof SimulationError)) throw error;
      this.stop(["fault", error.rule, error.message]);
      return true;
    }
    if (done === null) return false;
    this.n = this.history.head + 1;
    const messages = this.messages(done);
    this.history.add(this.moment, messages.map((message) => JSON.stringify(message)).join(","));
    this.broadcast(...messages);
    if (this.n % STATE_EVERY === 0) this.broadcast(...this.states());
    this.lookAt(before, done);
    return true;
  }

  /** A step, then the events and inputs that it passed on. */
  messages({ machine, macrostep, passed, driven }) {
    const { at } = macrostep;
    const found = [stepOf(this.charts[machine], this.simulation.definition(machine), this.names[machine], this.n, macrostep)];
    for (const { link, payload, hasRoom } of passed) {
      const [event, ...values] = rowOfEvent(this.charts[link.target], { event: link.event, payload });
      found.push({
        k: "pass", n: this.n, at, from: [this.names[link.source], this.portName(link)], to: [this.names[link.target], event],
        values, how: hasRoom ? "queued" : "refused",
      });
    }
    const inputs = new Map();
    for (const { machine: target, number, value } of driven) {
      const { inputs: declared } = this.charts[target];
      if (number < declared.length) {
        if (!inputs.has(target)) inputs.set(target, Object.create(null));
        inputs.get(target)[declared[number].name] = toJson(value, declared[number].type);
      } else { // shared data are no inputs: the machine is sent as a whole
        found.push(this.state(target, at));
      }
    }
    for (const [target, told] of inputs) found.push({ k: "set", m: this.names[target], n: this.n, at, inputs: told });
    return found;
  }

  portName({ source, port }) {
    const { events: own, operations } = this.charts[source];
    return port < own.length ? own[port].name : operations[port - own.length].name;
  }

  /** Stop where a breakpoint is hit or a machine has a fault. */
  lookAt(before, done) {
    let because = null;
    for (const [number, point] of this.points) {
      if (!hits(point, before, this.moment, done)) continue;
      this.hit.set(number, (this.hit.get(number) ?? 0) + 1);
      const over = this.hit.get(number) - point.after - 1;
      const isCounted = over >= 0 && over % point.every === 0 && (point.times === 0 || over / point.every < point.times);
      if (isCounted && point.log.length) this.broadcast({ k: "log", n: this.n, at: this.moment.now, number, text: this.logged(point) });
      else if (isCounted) because ??= ["breakpoint", number];
    }
    if (because !== null) this.stop(because);
    if (this.until !== null && hits(this.until, before, this.moment, done)) this.stop(["until", this.until.text]);
    const { fault } = done.macrostep.after;
    if (fault !== null) this.stop(["fault", fault, this.names[done.machine]]);
  }

  /** The text of a breakpoint that logs, with its values. */
  logged({ log }) {
    return log.map((part) => (typeof part === "string" ? part : shownText(part, this.moment.snapshots, this.description.tick))).join("");
  }

  stop(because) {
    if (!this.isRunning) return;
    [this.isRunning, this.until, this.why] = [false, null, because];
    this.broadcast(this.mode());
  }

  // --- commands -----------------------------------------------------------------------------------------

  obey(command) {
    switch (command.do) {
      case "post":
        return this.post(command);
      case "set":
        return this.set(command);
      case "returns":
        return this.returns(command);
      case "run":
        return this.run(command);
      case "pause":
        return this.stop(["asked"]);
      case "step":
        return this.stepOn(command.how ?? "macro", command.at ?? 0);
      case "back":
        return this.seek(this.n - (command.count ?? 1));
      case "forward":
        return this.seek(this.n + (command.count ?? 1));
      case "seek":
        return this.seek(command.n ?? this.stepAt(command.at ?? 0));
      case "break":
        return this.addBreakpoint(command);
      case "unbreak":
        return this.unbreak(command.number);
      case "watch":
        return shownValue(this.expression(command.expression, this.ownNames(command.m ?? ""), false), this.moment.snapshots);
      case "why":
        return this.explain(command);
      case "events": {
        const place = this.machineOf(command.m);
        return events(this.simulation.players[place], this.charts[place], this.moment.snapshots[place]);
      }
      case "micro":
        return this.micro(command.n);
      case "find":
        return this.find(command);
      case "chart":
        return this.sendChart(command.chart);
      case "history":
        return this.resend(command.from ?? 1, command.last ?? null);
      case "branches":
        return [...this.history.others].sort(([a], [b]) => a - b).map(([branch, { first, head }]) => ({ branch, first, head }));
      case "fork":
        if (!this.history.others.has(command.branch)) throw wrong(`there is no branch ${command.branch}`);
        this.history.switch(command.branch);
        return this.seek(this.history.head);
      case "save":
        return this.save(command.as);
      case "scenarios":
        return this.description.scenarios.map(({ name }) => name);
      case "play":
        return this.play(command.scenario);
      default:
        throw wrong(`a page has no command \`${command.do}\``, "use `fsmkit serve`");
    }
  }

  machineOf(name) {
    if (!name && this.names.length === 1) return 0;
    return placeOf(name, this.names, "machine");
  }

  /** The machine whose names an expression has; null: names are `machine.name`. */
  ownNames(name) {
    if (name) return this.machineOf(name);
    return this.names.length === 1 ? 0 : null;
  }

  /** Return an expression: compiled with the page, else parsed here. */
  expression(text, machine, isCondition) {
    const compiled = this.description.conditions.find((each) => each.text === text && each.machine === machine);
    return (isCondition ? compiled : undefined) ?? read(this.simulation, text, machine, isCondition);
  }

  received(machine, name) {
    const { events: own } = this.charts[machine];
    placeOf(name, own.filter(({ received }) => received).map((each) => each.name), "event");
    return own.findIndex((each) => each.name === name);
  }

  post({ m, event: name, with: given = {} }) {
    const machine = this.machineOf(m), chart = this.charts[machine];
    const event = this.received(machine, name);
    const payload = valued(() => payloadOf(chart.events[event], given));
    this.beginBranch();
    const after = this.simulation.post(this.moment, machine, event, payload);
    const how = after === null ? "refused" : "queued";
    this.moment = after ?? this.moment;
    const words = [`${this.prefix(machine)}${name}`, ...payload.map(rt.shown)];
    const message = { k: "post", m: this.names[machine], n: this.history.head + 1, at: this.moment.now, event: rowOfEvent(chart, { event, payload }), how };
    this.note(message, acted(`post ${words.join(" ")}`, this.moment.now, after === null, machine, (moment) => this.simulation.post(moment, machine, event, payload)));
    if (!this.isRunning) this.settle();
    return how;
  }

  set({ m, input, value: given }) {
    const machine = this.machineOf(m), chart = this.charts[machine];
    const place = placeOf(input, chart.inputs.map(({ name }) => name), "input");
    const { name, type } = chart.inputs[place];
    const value = valued(() => fromJson(given, type), `the input \`${input}\` `);
    this.beginBranch();
    this.moment = this.simulation.setInput(this.moment, machine, place, value);
    const message = { k: "set", m: this.names[machine], n: this.history.head + 1, at: this.moment.now, inputs: { [name]: toJson(value, type) } };
    this.note(message, acted(`input ${this.prefix(machine)}${name} ${rt.shown(value)}`, this.moment.now, false, machine, (moment) => this.simulation.setInput(moment, machine, place, value)));
    if (!this.isRunning) this.settle();
  }

  returns({ m, operation: wanted, results: given }) {
    const machine = this.machineOf(m), returning = this.charts[machine].operations.filter(({ result }) => result !== null);
    const { name, result: type } = returning[placeOf(wanted, returning.map((each) => each.name), "operation with a result")];
    if (!given.length) throw new Refusal("wrong-value", `no result is given for \`${name}\``);
    const results = given.map((value) => valued(() => fromJson(value, type), `the result of \`${name}\` `));
    this.beginBranch();
    this.moment = this.simulation.setResults(this.moment, machine, name, results);
    const message = { k: "set", m: this.names[machine], n: this.history.head + 1, at: this.moment.now, inputs: {}, results: { [name]: results.map((value) => toJson(value, type)) } };
    const line = `returns ${this.prefix(machine)}${name} ${results.map(rt.shown).join(" ")}`;
    this.note(message, acted(line, this.moment.now, false, machine, (moment) => this.simulation.setResults(moment, machine, name, results)));
    if (!this.isRunning) this.settle();
  }

  run({ speed = this.speed, until = "" }) {
    if (speed !== 0 && !(SLOWEST <= speed && speed <= FASTEST)) throw wrong(`there is no speed ${speed}`, `use 0 or ${SLOWEST} to ${FASTEST}`);
    const point = until ? this.pointOf({ on: "condition", what: until }) : null;
    this.beginBranch();
    [this.until, this.speed, this.isRunning, this.due, this.why] = [point, speed, true, this.moment.now, []];
    this.broadcast(this.mode());
  }

  /** Advance by one unit; in the past, replay entries. Return the number of steps. */
  stepOn(how, at) {
    if (!["macro", "timer", "tick", "time"].includes(how)) throw wrong(`there is no step \`${how}\``, "use macro, timer, tick or time");
    this.stop(["asked"]);
    if (how === "macro" && this.n < this.history.head) {
      this.seek(this.n + 1);
      return 1;
    }
    this.beginBranch();
    const first = this.n;
    [this.isRunning, this.why] = [true, ["stepped"]];
    const due = this.simulation.nextDeadline(this.moment);
    if (how === "macro") this.go(FOR_EVER, 1);
    else if (how === "tick") this.go(this.moment.now + 1, MOST_STEPS);
    else if (how === "time") while (this.isRunning && this.moment.now < at) this.go(at, MOST_STEPS);
    else this.go(due ?? this.moment.now, MOST_STEPS);
    this.isRunning = false;
    this.broadcast(this.mode());
    return this.n - first;
  }

  /** Move the view to a step; later actions start a branch. Return the step. */
  seek(n) {
    this.isRunning = false;
    n = Math.max(this.history.first, Math.min(n, this.history.head));
    [this.n, this.moment, this.why] = [n, this.momentAt(n), ["sought"]];
    this.broadcast(...this.states(), this.mode());
    return n;
  }

  /** The moment after an entry, made again from one that is kept. */
  momentAt(n) {
    let [kept, moment] = this.history.before(n);
    for (; kept < n; kept += 1) ({ moment } = this.simulation.step(moment));
    return moment;
  }

  /** An entry done again after a moment: the moment that it led to, and the step, if it was one. */
  again(n, before) {
    const { actions, moments } = this.history.branch;
    return actions.has(n) ? { moment: moments.get(n), done: null } : this.simulation.step(before);
  }

  /** The microsteps of an entry. */
  micro(n) {
    if (!(this.history.first < n && n <= this.history.head)) throw wrong(`there is no step ${n}`);
    const { done } = this.again(n, this.momentAt(n - 1));
    if (done === null) throw wrong(`entry ${n} is no step whose microsteps are known`);
    return microstepsOf(this.charts[done.machine], this.simulation.definition(done.machine), done.macrostep);
  }

  /** Return the next hit of a breakpoint, or the last one before, or where to continue the search. */
  find({ on, m, what, if: guard, from, back = false }) {
    const point = this.pointOf({ on, m, what, if: guard });
    const { first: begin, head } = this.history;
    const first = back ? Math.max(begin + 1, Math.min(from - 1, head) - MOST_LOOKED + 1) : Math.max(from, begin) + 1;
    const last = back ? Math.min(from - 1, head) : Math.min(head, first + MOST_LOOKED - 1);
    let found = null, before = first <= last ? this.momentAt(first - 1) : null;
    for (let n = first; n <= last && (back || found === null); n += 1) {
      const { moment, done } = this.again(n, before);
      if (hits(point, before, moment, done)) found = n;
      before = moment;
    }
    if (found !== null) return { n: found };
    if (back) return first > begin + 1 ? { from: first } : {};
    return last < head ? { from: last } : {};
  }

  stepAt(at) {
    let low = this.history.first, high = this.history.head;
    while (low < high) {
      const middle = Math.floor((low + high + 1) / 2);
      if (this.momentAt(middle).now <= at) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  explain({ m, event: name, with: given = null }) {
    const machine = this.machineOf(m), chart = this.charts[machine];
    const event = this.received(machine, name), { fields } = chart.events[event];
    const payload = given === null && fields.length ? null : valued(() => payloadOf(chart.events[event], given ?? {}));
    return why(this.simulation.players[machine], chart, this.moment.snapshots[machine], event, payload);
  }

  sendChart(hash) {
    const chart = this.charts.find((each) => each.message.chart === hash);
    if (chart === undefined) throw wrong("this session has no chart of that hash", "use those of `hello`");
    this.broadcast(chart.message);
  }

  resend(first, last) {
    const from = Math.max(first, this.history.first);
    const to = Math.min(last ?? this.history.head, from + MOST_RESENT - 1, this.history.head);
    const texts = this.history.texts(from, to);
    if (texts.length) this.broadcast({ k: "again", first: from, last: to }, ...JSON.parse(`[${texts.join(",")}]`));
    return { first: from, last: to };
  }

  // --- breakpoints ----------------------------------------------------------------------------------------

  /** Add a breakpoint; its number. */
  addBreakpoint(command) {
    if (this.points.size >= MOST_POINTS) throw wrong(`there are ${MOST_POINTS} breakpoints`, "remove one");
    const point = this.pointOf(command);
    const number = this.nextPoint;
    this.nextPoint += 1;
    this.points.set(number, point);
    this.broadcast(this.told());
    return number;
  }

  unbreak(number) {
    if (!this.points.delete(number)) throw wrong(`there is no breakpoint ${number}`);
    this.hit.delete(number);
    this.broadcast(this.told());
  }

  /** Return the breakpoints for clients. */
  told() {
    const points = [...this.points].map(([number, { command }]) => {
      const { on, m = "", what = "", if: guard = "", after = 0, every = 1, times = 0, log = "" } = command;
      const given = Object.entries({ on, m, what, if: guard, after, every, times, log }).filter(([, value]) => value !== "" && value !== 0);
      return { number, ...Object.fromEntries(given) };
    });
    return { k: "points", points };
  }

  pointOf(command) {
    const { on, m = "", what = "", if: guard = "", after = 0, every = 1, times = 0, log = "" } = command;
    if (every < 1 || after < 0 || times < 0) throw wrong("a breakpoint counts from 1", "`every` is 1 or more, `after` and `times` 0");
    if (!KINDS.includes(on)) throw wrong(`there is no breakpoint on \`${on}\``, `use one of ${KINDS.join(", ")}`);
    const machine = m || this.names.length === 1 ? this.machineOf(m) : null;
    const point = { on, text: String(what), machine, places: null, condition: null, guard: null, isNegated: false, after, every, times, command, log: [] };
    point.log = log.split(BRACES).map((part, place) => (place % 2 ? this.expression(part, this.ownNames(m), false) : part)).filter((part) => part !== "");
    if (guard) point.guard = this.expression(guard, this.ownNames(m), true);
    if (on === "condition") {
      point.condition = this.expression(String(what), this.ownNames(m), true);
    } else if (on === "changed") {
      point.condition = this.expression(String(what), this.ownNames(m), false);
    } else if (on === "property") {
      const found = this.description.properties.find(({ name }) => name === what);
      if (!found) throw new Refusal("unknown-name", `there is no property \`${what}\` of states`, "use the name of an invariant or of what must be reachable");
      [point.condition, point.isNegated] = [found, found.isNegated];
    } else if (!["fault", "error", "lost"].includes(on)) {
      if (machine === null) throw wrong("the command names no machine", "give `m`");
      point.places = this.placesOfPoint(on, machine, what);
    }
    return point;
  }

  /** Return the indices of a breakpoint's name; events of one name may have several payloads. */
  placesOfPoint(on, machine, what) {
    const { states, transitions } = this.simulation.definition(machine);
    if (on === "taken") {
      if (!Number.isInteger(what) || what < 0 || what >= transitions.length) throw wrong(`there is no transition ${what}`, `give a number from 0 to ${transitions.length - 1}`);
      return [what];
    }
    const isState = on === "entered" || on === "left";
    const known = isState ? states.map(({ id }) => id) : this.charts[machine].events.map(({ name }) => name);
    if (!known.includes(what)) throw new Refusal("unknown-name", `\`${this.charts[machine].name}\` has no ${isState ? "state" : "event"} \`${what}\``, `use one of ${known.slice(0, 8).join(", ")}`);
    return known.flatMap((name, place) => (name === what ? [place] : []));
  }

  // --- scenarios and saving ------------------------------------------------------------------------

  /** Perform a scenario from the start, as a branch; its last entry, which is in view. */
  play(name) {
    const scenario = this.description.scenarios.find((each) => each.name === name);
    if (scenario === undefined) throw wrong(`there is no scenario \`${name}\``);
    if (scenario.entries === undefined) performed(this, scenario.actions);
    else recalled(this, scenario.entries);
    this.seek(this.history.head);
    if (scenario.why !== undefined) {
      this.why = scenario.why;
      this.broadcast(this.mode());
    }
    return this.n;
  }

  save(kind) {
    const { branch } = this.history;
    if (kind === "live") {
      const charts = [...new Set(this.charts.map(({ message }) => message))];
      return [this.hello(), ...charts].map((message) => `${JSON.stringify(message)}\n`).join("") +
        branch.texts.filter((text) => text).map((text) => `[${text}]\n`).join("");
    }
    if (kind !== "script" && kind !== "pytest") throw wrong(`nothing is saved as \`${kind}\``, "use script, pytest or live");
    if (branch.first) throw wrong("the first steps are forgotten", "save as `live`");
    const found = scriptOf(this);
    if (found === null) throw wrong("no script does what was done here", "a script posts when all is quiet, and sets inputs of a chart alone: save as `live`");
    if (kind === "script") return found.script.map((line) => `${line}\n`).join("");
    return pytestOf(this.description.file, found, this.simulation.seed);
  }

  // --- inside -------------------------------------------------------------------------------------------

  get isAlone() {
    return this.description.isOpen && this.names.length === 1;
  }

  prefix(machine) {
    return this.isAlone ? "" : `${this.names[machine]}.`;
  }

  /** The lines of a macrostep in a trace. */
  lines(machine, macrostep) {
    const definition = this.simulation.definition(machine);
    const on = [...leaves(definition, macrostep.after), ...(macrostep.after.finished ? ["finished"] : [])];
    const lines = linesOf(rt, definition, { ...macrostep, on });
    return this.isAlone ? lines : lines.map((line) => `${this.names[machine]}: ${line}`);
  }

  /** Continue after the step in view; later steps remain as another branch. */
  beginBranch() {
    const { number } = this.history;
    this.history.cut(this.n, this.moment);
    if (this.history.number !== number) this.broadcast(this.mode());
  }

  /** Keep that a client did something, and send it to all. */
  note(message, action) {
    this.n = this.history.add(this.moment, JSON.stringify(message), action);
    this.broadcast(message);
  }

  hello() {
    const { seed } = this.simulation;
    return {
      k: "hello", protocol: PROTOCOL, session: "", name: this.description.name, time: "simulated", tick_us: this.description.tick,
      at: this.moment.now, n: this.n, can: CAN, machines: this.names.map((m, place) => ({ m, chart: this.charts[place].message.chart })),
      ...(seed === 1 ? {} : { seed }),
    };
  }

  state(machine, at) {
    return stateOf(this.charts[machine], this.simulation.definition(machine), this.names[machine], this.n, this.moment.snapshots[machine], at);
  }

  states() {
    return this.names.map((_, machine) => this.state(machine, this.moment.now));
  }

  mode() {
    const { number, first, head } = this.history;
    const message = { k: "mode", mode: this.isRunning ? "running" : "paused", n: this.n, head, at: this.moment.now, speed: this.speed };
    if (number) message.branch = number;
    if (first) message.first = first;
    if (this.why.length) message.why = this.why;
    return message;
  }

  broadcast(...messages) {
    for (const send of this.clients) send(messages);
  }
}

/** A value that does not fit its type. */
class ValueError extends TypeError {}

function valued(readValue, before = "") {
  try {
    return readValue();
  } catch (error) {
    if (!(error instanceof TypeError)) throw error;
    throw Object.assign(new ValueError(`${before}${error.message}`), { help: error.help });
  }
}

/** Whether a step hits a breakpoint. */
function hits(point, before, after, done) {
  if (point.guard !== null && !holds(point.guard, after.snapshots)) return false;
  if (point.on === "changed") return !isUnchanged(point.condition, before.snapshots, after.snapshots);
  if (point.condition !== null) {
    const isMarked = ({ snapshots }) => holds(point.condition, snapshots) !== point.isNegated;
    return !isMarked(before) && isMarked(after);
  }
  if (done === null) return false; // somebody outside did something
  const { machine, macrostep, passed } = done;
  const { on, places } = point;
  if (on === "lost" && passed.some(({ hasRoom }) => !hasRoom)) return true;
  if (point.machine !== null && point.machine !== machine) return false;
  const [cause, about] = macrostep.cause;
  if (on === "event") return (cause === "event" || cause === "delayed") && places.includes(about.event);
  return macrostep.rows.some(([word, which]) => WORDS[on].includes(word) && (places === null || places.includes(which)));
}
