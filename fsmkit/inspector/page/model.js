"use strict";
// The session as the messages tell it. Nothing here touches the page.

class Session {
  constructor() {
    this.hello = null;
    this.mode = { n: 0, head: 0, at: 0, first: 0, mode: "paused", why: [] };
    this.machines = new Map(); // name: {hash, state, changed, left, taken, last}
    this.charts = new Map(); // hash: the chart
    this.entries = new Map(); // n: {m, text}
    this.points = new Map(); // number: what was asked for
    this.lost = 0;
  }

  /** Take a message; return what it changed: "all", "machine", "mode", "entry" or "". */
  take(message) {
    switch (message.k) {
      case "hello":
        this.hello = message;
        this.machines = new Map(message.machines.map((each) => [each.m, { name: each.m, hash: each.chart, state: null, changed: new Set(), left: [], taken: [], last: "" }]));
        return "all";
      case "chart":
        this.charts.set(message.chart, message);
        return "all";
      case "state": {
        const machine = this.machines.get(message.m);
        if (!machine) return "";
        Object.assign(machine, { state: message, changed: new Set(), left: [], taken: [] });
        return "machine";
      }
      case "step":
        return this.step(message);
      case "set": {
        const machine = this.machines.get(message.m);
        if (!machine || !machine.state || this.isOld(machine, message)) return "";
        Object.assign(machine.state.inputs, message.inputs);
        machine.changed = new Set(Object.keys(message.inputs));
        if (!this.entries.has(message.n)) this.note(message, `set ${Object.entries(message.inputs).map(([k, v]) => `${k} = ${shown(v)}`).join(", ")}`);
        return "machine";
      }
      case "post": {
        this.note(message, `post ${message.event.map(shown).join(" ")}${message.how === "refused" ? ": no room" : ""}`);
        const machine = this.machines.get(message.m);
        if (machine && machine.state && message.how === "queued" && !this.isOld(machine, message)) machine.state.queue = [...machine.state.queue, message.event];
        return "machine";
      }
      case "pass": {
        const machine = this.machines.get(message.to[0]);
        if (machine && machine.state && message.how === "queued" && !this.isOld(machine, message)) machine.state.queue = [...machine.state.queue, [message.to[1], ...message.values]];
        return "machine";
      }
      case "mode":
        if (message.branch !== this.mode.branch) this.entries.clear();
        this.mode = message;
        return "mode";
      case "lost":
        this.lost += message.count;
        return "mode";
      default:
        return "";
    }
  }

  step(message) {
    const machine = this.machines.get(message.m);
    if (!machine || !machine.state) return "";
    const { state } = machine;
    const chart = this.charts.get(machine.hash);
    if (this.isOld(machine, message)) {
      this.note(message, stepText(message, chart));
      return "entry";
    }
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
    }
    for (const key of ["timers", "queue", "deferred", "status", "fault"]) if (key in message) state[key] = message[key];
    if (!("queue" in message) && message.cause[0] === "event" && state.queue.length && state.queue[0][0] === message.cause[1]) state.queue = state.queue.slice(1);
    state.at = message.at;
    machine.last = causeText(message.cause, chart);
    state.n = message.n;
    this.note(message, stepText(message, chart));
    this.mode = { ...this.mode, n: message.n, head: Math.max(this.mode.head, message.n), at: Math.max(this.mode.at, message.at) };
    return "machine";
  }

  /** Whether a message is of the past, told again: what it did is in the state already. */
  isOld(machine, message) {
    return message.n <= machine.state.n;
  }

  note(message, text) {
    this.entries.set(message.n, { n: message.n, at: message.at, m: message.m, text });
    if (message.n > this.mode.head) this.mode = { ...this.mode, n: message.n, head: message.n };
    if (this.entries.size > 20000) for (const n of this.entries.keys()) { this.entries.delete(n); if (this.entries.size <= 10000) break; }
  }

}

function stepText(message, chart) {
  return `${causeText(message.cause, chart)}${message.on ? ` → ${message.on.join(" ")}` : ""}`;
}

/** Return the cause of a step in words. */
function causeText(cause, chart) {
  const [kind, ...rest] = cause;
  if (kind === "timeout") {
    const transition = chart && chart.transitions[rest[0]];
    return transition ? `${transition.source}: ${transition.label}` : `timeout ${rest[0]}`;
  }
  return kind === "event" ? rest.map(shown).join(" ") : [kind, ...rest.map(shown)].join(" ");
}
