// What was done as a script, and scripts performed: as fsmkit/inspector/saving.py and runtime/script.py.

import { snapshotFrom } from "./live.mjs";

const MOST_STEPS = 100000;

/** Something that a client did: a line of a script, when (ticks), and how it is done again. */
export function acted(line, at, isRefused, machine, act) {
  return { line, at, isRefused, machine, act };
}

/**
 * The branch in view as a script that does the same, and its trace; null if no script does. Time
 * passes in the script before what a client does, and for the first step after it.
 */
export function scriptOf(hub) {
  const { history, simulation } = hub;
  const { branch } = history;
  const script = hub.isAlone && simulation.seed !== 1 ? [`seed ${simulation.seed}`] : [];
  const trace = [];
  let moment = branch.moments.get(0), isStarted = false, waits = false, last = 0;
  for (let n = 1; n <= branch.head; n += 1) {
    if (branch.actions.has(n)) {
      const { line, at, isRefused, machine } = branch.actions.get(n);
      if (line === null) return null; // the calls of a path that was performed elsewhere
      moment = branch.moments.get(n);
      if (isStarted && (!waits || at > last)) script.push(`run ${at >>> 0}`);
      script.push(line);
      [waits, last] = [true, at];
      if (isRefused) trace.push(`${hub.isAlone ? "" : `${hub.names[machine]}: `}full queue`);
      continue;
    }
    let done;
    ({ moment, done } = simulation.step(moment));
    const { at } = done.macrostep;
    if (!isStarted) script.push(hub.isAlone ? `start ${at >>> 0}` : "start");
    if (waits || !isStarted) script.push(`run ${at >>> 0}`);
    [isStarted, waits, last] = [true, false, at];
    trace.push(...hub.lines(done.machine, done.macrostep));
  }
  script.push(`run ${(hub.n === history.head ? hub.moment : hub.momentAt(history.head)).now >>> 0}`);
  const once = script.filter((line, at) => line !== script[at - 1] || !line.startsWith("run "));
  return isSame(played(hub, once), trace) ? { script: once, trace } : null;
}

function isSame(one, other) {
  return one !== null && one.length === other.length && one.every((line, at) => line === other[at]);
}

/** The trace of the actions of a branch, performed as a script performs them; null where none can. */
function played(hub, script) {
  const { simulation, history } = hub;
  const actions = [...history.branch.actions.values()];
  let moment = simulation.begin(), isPosted = false;
  const trace = [];
  const go = (until) => {
    for (;;) {
      const found = simulation.step(moment, until);
      ({ moment } = found);
      if (found.done === null) return;
      trace.push(...hub.lines(found.done.machine, found.done.macrostep));
    }
  };
  for (const line of script) {
    const [verb, ...words] = line.split(" ");
    switch (verb) {
      case "seed":
        break;
      case "start":
        while (moment.toStart.length) {
          const found = simulation.step(moment, 0);
          ({ moment } = found);
          trace.push(...hub.lines(found.done.machine, found.done.macrostep));
        }
        break;
      case "run":
        if (hub.isAlone && isPosted) moment = { ...moment, now: Number(words[0]) };
        isPosted = false;
        go(Number(words[0]));
        break;
      default: {
        const { act, isRefused, machine } = actions.shift();
        if (verb === "input" && !hub.isAlone) return null;
        const following = act(moment);
        isPosted = true;
        if ((following === null) !== isRefused) return null;
        if (isRefused) trace.push(`${hub.isAlone ? "" : `${hub.names[machine]}: `}full queue`);
        moment = following ?? moment;
      }
    }
  }
  return trace;
}

/** A text of Python. */
function quoted(text) {
  return JSON.stringify(text).replace(/[\u007f-\uffff]/g, (unit) => `\\u${unit.charCodeAt(0).toString(16).padStart(4, "0")}`);
}

function listed(lines) {
  return `[\n${lines.map((line) => `    ${quoted(line)},\n`).join("")}]`;
}

/** A pytest that performs a script of a file again. */
export function pytestOf(file, { script, trace }, seed) {
  return [
    '"""Saved from a session: performs it again, and compares the trace."""',
    "",
    "from fsmkit.inspector.saving import trace_of",
    "",
    `FILE = ${quoted(file)}`,
    `SEED = ${seed}`,
    `SCRIPT = ${listed(script)}`,
    `TRACE = ${listed(trace)}`,
    "",
    "",
    "def test_it_does_so_again() -> None:",
    "    assert trace_of(FILE, SCRIPT, SEED) == TRACE",
    "",
  ].join("\n");
}

/**
 * Perform a scenario from the start, as a branch; clients see the end. A chart alone takes what was posted when its script lets time pass, at the
 * time that it is then, as every harness does.
 */
export function performed(hub, actions) {
  const { clients } = hub;
  hub.clients = [];
  hub.seek(0);
  hub.beginBranch();
  const waiting = [];
  const act = () => waiting.splice(0).forEach((action) => { hub.isRunning = true; hub.obey(action); });
  const goOn = (until, isOver) => {
    for (let count = 0; count < MOST_STEPS && !isOver(); count += 1) {
      hub.isRunning = true;
      if (!hub.step(until)) break;
    }
  };
  for (const action of actions) {
    if (action.do === "start") {
      act();
      goOn(0, () => !hub.moment.toStart.length);
    } else if (action.do === "run") {
      if (waiting.length) hub.moment = { ...hub.moment, now: action.at };
      act();
      goOn(action.at, () => false);
    } else {
      waiting.push(action);
      if (!hub.isAlone) act();
    }
  }
  act();
  hub.isRunning = false;
  hub.clients = clients;
}

/**
 * Add a recorded path as a branch: its messages, and the machines after
 * each entry. From any of them the simulation can go on.
 */
export function recalled(hub, entries) {
  const { clients, simulation } = hub;
  hub.clients = [];
  hub.seek(0);
  hub.beginBranch();
  for (const { now, machines, toStart, messages } of entries) {
    const snapshots = hub.moment.snapshots.slice();
    for (const [machine, found] of machines) {
      snapshots[machine] = snapshotFrom(hub.charts[machine], simulation.definition(machine), found);
    }
    hub.moment = { ...hub.moment, now, snapshots, toStart, turn: null };
    const n = hub.history.head + 1;
    const text = messages.map((message) => JSON.stringify({ ...message, n })).join(",");
    hub.n = hub.history.add(hub.moment, text, acted(null, now, false, 0, null));
  }
  hub.clients = clients;
}
