"use strict";
// The state of a session, from its messages. Nothing here touches the page.

const KEPT_ENTRIES = 20000;
const KEPT_NUMBERS = 60; // of a variable, for its spark line

class Session {
  constructor() {
    this.hello = null;
    this.mode = { n: 0, head: 0, at: 0, first: 0, mode: "paused", why: [] };
    this.machines = new Map(); // name: see `machineOf`
    this.charts = new Map(); // hash: the chart
    this.entries = new Map(); // n: {n, at, m, text, on: its active leaves where they changed, moves: ["-" or "+", state]}
    this.passed = new Map(); // n: the events and calls between machines and host in that entry
    this.points = new Map(); // number: the requested breakpoint
    this.isAgain = false; // entries of the history come, which are in the states already
    this.unnamed = []; // steps that came before their chart
    this.signals = [];
    this.lost = 0;
  }

  /** Take a message of the protocol. */
  take(message) {
    switch (message.k) {
      case "again":
        this.isAgain = true;
        break;
      case "hello":
        this.hello = message;
        this.isAgain = false;
        this.unnamed = [];
        this.machines = new Map(message.machines.map((each) => [each.m, machineOf(each)]));
        break;
      case "chart":
        this.charts.set(message.chart, message);
        this.name(message);
        break;
      case "state":
        this.state(message);
        break;
      case "step":
        this.step(message);
        break;
      case "set":
        this.set(message);
        break;
      case "post":
        this.note(message, `post ${message.event.map(shown).join(" ")}${message.how === "refused" ? ": no room" : ""}${this.whose(message)}`);
        this.carry(message.n, { from: "", to: message.m, event: message.event, how: message.how, at: message.at });
        this.enqueue(message.m, message, message.event);
        break;
      case "pass":
        this.carry(message.n, { from: message.from[0], to: message.to[0], event: [message.to[1], ...message.values], how: message.how, at: message.at, sentAt: message.sent_at });
        this.enqueue(message.to[0], message, [message.to[1], ...message.values]);
        break;
      case "mode":
        if (message.branch !== this.mode.branch) {
          this.entries.clear();
          this.passed.clear();
        }
        this.mode = { first: 0, ...message };
        break;
      case "points":
        this.points = new Map(message.points.map(({ number, ...point }) => [number, point.on === "taken" ? { what: 0, ...point } : point])); // zeros are omitted
        break;
      case "log": {
        const entry = this.entries.get(message.n);
        if (entry) this.entries.set(message.n, { ...entry, text: `${entry.text}; log: ${message.text}` });
        break;
      }
      case "signals":
        this.signals = message.v;
        message.v.forEach((value, i) => remember(this.numbers, this.hello.signals[i], value));
        break;
      case "lost":
        this.lost += message.count;
        for (const machine of this.machines.values()) if (message.where !== "client" && (!message.m || message.m === machine.name)) machine.isKnown = machine.hasData = false;
        break;
      default: // unknown values are omitted
    }
  }

  numbers = new Map(); // of signals

  state(message) {
    const machine = this.machines.get(message.m);
    if (!machine || this.isAgain) return;
    const isGap = !machine.state || message.n !== this.mode.n; // whole states come in between as well
    // active states may be known without data: after a loss, messages may contain only states
    const isKnown = message.known !== false || message.on.length > 0;
    Object.assign(machine, { state: message, changed: new Set(), isKnown, hasData: message.known !== false });
    if (!isGap) return;
    Object.assign(machine, { left: [], taken: [] });
    machine.numbers.clear();
    for (const values of [message.data, message.inputs, message.outputs]) for (const [name, value] of Object.entries(values)) remember(machine.numbers, name, value);
  }

  step(message) {
    const machine = this.machines.get(message.m);
    if (!machine || !machine.state) return;
    const { state } = machine;
    const chart = this.charts.get(machine.hash);
    this.passed.delete(message.n);
    for (const row of message.do) if (row[0] === "out") this.carry(message.n, { from: message.m, to: "", event: row.slice(1), how: "sent", at: message.at });
    this.note(message, stepText(message, chart));
    if (!chart) this.unnamed.push(message);
    if (this.isOld(machine, message)) return;
    machine.taken = message.do.filter((row) => row[0] === "t").map((row) => row[1]);
    machine.left = message.do.filter((row) => row[0] === "-").map((row) => row[1]);
    const on = new Set(state.on);
    for (const row of message.do) {
      if (row[0] === "-") on.delete(row[1]);
      if (row[0] === "+") on.add(row[1]);
    }
    if (message.status !== "finished") state.on = chart ? chart.states.map((each) => each.id).filter((id) => on.has(id)) : [...on];
    machine.changed = new Set();
    for (const [name, value] of Object.entries(message.set || {})) {
      (name in state.data ? state.data : state.outputs)[name] = value;
      machine.changed.add(name);
      remember(machine.numbers, name, value);
    }
    for (const key of ["timers", "queue", "deferred", "status", "fault"]) if (key in message) state[key] = message[key];
    if (!("queue" in message) && message.cause[0] === "event" && state.queue.length && state.queue[0][0] === message.cause[1]) state.queue = state.queue.slice(1);
    state.at = message.at;
    state.n = message.n;
    machine.last = causeText(message.cause, chart);
    this.mode = { ...this.mode, n: message.n, head: Math.max(this.mode.head, message.n), at: Math.max(this.mode.at, message.at) };
  }

  /** Name the causes of steps that came before their chart. */
  name(chart) {
    const isOf = ({ m }) => this.machines.get(m)?.hash === chart.chart;
    for (const message of this.unnamed.filter(isOf)) {
      const entry = this.entries.get(message.n);
      if (entry) this.entries.set(message.n, { ...entry, text: stepText(message, chart) });
      const machine = this.machines.get(message.m);
      if (machine.state.n === message.n) machine.last = causeText(message.cause, chart);
    }
    this.unnamed = this.unnamed.filter((message) => !isOf(message));
  }

  set(message) {
    const machine = this.machines.get(message.m);
    if (!machine || !machine.state || this.isOld(machine, message)) return;
    Object.assign(machine.state.inputs, message.inputs);
    machine.changed = new Set(Object.keys(message.inputs));
    for (const [name, value] of Object.entries(message.inputs)) remember(machine.numbers, name, value);
    if (!this.entries.has(message.n)) this.note(message, `${changesOf(message)}${this.whose(message)}`);
  }

  /** Return who commanded, in brackets, where there were several clients. */
  whose(message) {
    if (!message.by) return "";
    return message.by === this.hello.client ? " (you)" : ` (client ${message.by})`;
  }

  enqueue(name, message, event) {
    const machine = this.machines.get(name);
    if (machine && machine.state && message.how === "queued" && !this.isOld(machine, message)) machine.state.queue = [...machine.state.queue, event];
  }

  /** Return whether a message is a repetition, so that the state includes its effects already. */
  isOld(machine, message) {
    return this.isAgain || message.n <= machine.state.n;
  }

  note(message, text) {
    const moves = message.on ? message.do.filter(([word]) => word === "-" || word === "+") : [];
    this.entries.set(message.n, { n: message.n, at: message.at, m: message.m, text, on: message.on, moves });
    if (message.k === "post") this.passed.delete(message.n);
    if (message.n > this.mode.head) this.mode = { ...this.mode, n: message.n, head: message.n };
    if (this.entries.size <= KEPT_ENTRIES) return;
    for (const n of this.entries.keys()) {
      this.entries.delete(n);
      this.passed.delete(n);
      if (this.entries.size <= KEPT_ENTRIES / 2) return;
    }
  }

  /** Keep that an event went from a machine to another; "" is the host. One that a machine takes has not left. */
  carry(n, passed) {
    const all = this.passed.get(n) || [];
    const out = passed.from && passed.to ? all.findIndex((each) => each.from === passed.from && !each.to) : -1;
    if (out >= 0) all.splice(out, 1);
    this.passed.set(n, [...all, passed]);
  }
}

/** Return for the states of a chart their `parents` and `regions` by id (null: in no region). */
const structures = new WeakMap();

function structureOf(chart) {
  let found = structures.get(chart);
  if (!found) {
    const kinds = new Map(chart.states.map(({ id, kind }) => [id, kind]));
    const [parents, regions] = [new Map(), new Map()];
    for (const { id, parent } of chart.states) { // parents come first
      parents.set(id, parent);
      regions.set(id, kinds.get(parent) === "parallel" ? id : regions.get(parent) ?? null);
    }
    structures.set(chart, (found = { parents, regions }));
  }
  return found;
}

/** Return the innermost region that contains or is a state, or null. */
const regionOf = (chart, id) => (chart ? structureOf(chart).regions.get(id) ?? null : null);

/** Return null, for states outside all regions, then all regions in document order. */
const regionsOf = (chart) => [null, ...new Set([...structureOf(chart).regions.values()].filter((id) => id !== null))];

/** Return a state and those around it, the outermost first, without the root; nothing for no state. */
function pathTo(chart, id) {
  const { parents } = structureOf(chart);
  const path = [];
  for (let at = id; (parents.get(at) ?? null) !== null; at = parents.get(at)) path.unshift(at);
  return path;
}

/** Return the innermost active state of a region (null: outside all regions), or undefined. */
const innermost = (chart, on, region) => pathsOf(chart, on).get(region)?.at(-1);

/** Return the active states of each region that is active, from the outermost to the innermost. */
function pathsOf(chart, on) {
  const { parents, regions } = structureOf(chart);
  const found = new Map();
  for (const id of parents.keys()) {
    if (!on.has(id)) continue;
    const region = regions.get(id);
    if (found.has(region)) found.get(region).push(id);
    else found.set(region, [id]);
  }
  return found;
}

/** Return the innermost active states of a machine. */
function leavesOf(chart, on) {
  if (!chart) return on.slice(-1);
  const around = new Set(on.map((id) => structureOf(chart).parents.get(id)));
  return on.filter((id) => !around.has(id));
}

function machineOf(named) {
  return { name: named.m, hash: named.chart, state: null, changed: new Set(), left: [], taken: [], last: "", isKnown: true, hasData: true, numbers: new Map() };
}

/** Keep the last numbers of a variable. */
function remember(numbers, name, value) {
  if (typeof value !== "number") return;
  const all = numbers.get(name);
  if (!all) numbers.set(name, [value]);
  else if (all.push(value) > KEPT_NUMBERS) all.shift();
}
