// What an event would do, and which guards stand against it: as fsmkit/verify/questions.py.

import { ContentError, RangeFault } from "./fsmkit_runtime.mjs";
import { fromJson, toJson } from "./live.mjs";

/** A guard needs a value that is unknown before the step: a payload, or a result of the host. */
class UnknownError extends Error {}

function unknown() {
  throw new UnknownError();
}

/** A payload of which nothing is known. */
const UNKNOWN = new Proxy([], { get: unknown });

/**
 * Return the effect of an event: each tried transition with the value of its guard. `would`:
 * `yes`, `no`, `deferred`, `fault`, or `?` if it depends on an unknown value.
 */
export function why(player, chart, snapshot, event, payload) {
  if (!snapshot.running) return { would: "no", looked: [], because: "the machine does not run" };
  const machine = player.load(snapshot);
  const { host } = machine;
  try {
    machine.watch = null;
    machine.host = new Proxy({}, { get: () => unknown });
    machine._internal = [];
    machine._at = { event, payload: payload === null ? UNKNOWN : payload };
    let would = "?";
    try {
      const [enabled, isDeferred] = machine._select(event);
      would = isDeferred ? "deferred" : enabled.length ? "yes" : "no";
    } catch (error) {
      if (!(error instanceof UnknownError)) throw error;
    }
    const looked = rowsLooked(machine, chart, event);
    if (machine.fault !== null) return { would: "fault", looked, because: `a guard ends in \`${machine.fault}\`` };
    const isIdle = !looked.length && would === "no";
    return isIdle ? { would, looked, because: "no active state has a transition for it" } : { would, looked };
  } finally {
    machine.host = host;
    machine.watch = player.watcher;
    player.held = null;
  }
}

/** The transitions for an event from the leaves outwards, up to the first that is taken. */
function rowsLooked(machine, chart, event) {
  const { states } = machine.definition;
  const rows = [], seen = new Set();
  for (const leaf of machine._leaves()) {
    look: for (let state = leaf; state >= 0; state = states[state].parent) {
      for (const index of states[state].on.get(event) ?? []) {
        const row = rowLooked(machine, chart, index);
        if (!seen.has(index)) rows.push(row);
        seen.add(index);
        if (row.holds === true) break look;
      }
      if (states[state].defers.has(event)) break;
    }
  }
  return rows;
}

function rowLooked(machine, chart, index) {
  const { states, transitions } = machine.definition;
  const { source, guard } = transitions[index];
  const row = { t: index, state: states[source].id, holds: true };
  if (guard === null) return row;
  const { text, reads } = chart.guards[index];
  row.guard = text;
  row.values = Object.fromEntries(reads.map(([place, name, type]) => [name, toJson(machine[place][name], type)]));
  try {
    row.holds = guard(machine);
  } catch (error) {
    if (error instanceof UnknownError) {
      row.holds = "?";
    } else if (error instanceof ContentError || error instanceof RangeFault) {
      row.holds = false;
      row.error = error.message;
    } else {
      throw error;
    }
  }
  return row;
}

/** The events that a machine receives, and whether each would do something now. */
export function events(player, chart, snapshot) {
  return chart.events.flatMap(({ name, received, fields }, event) =>
    received ? [{ event: name, would: why(player, chart, snapshot, event, fields.length ? null : []).would }] : []);
}

/** The payload of an event from JSON, by name; `TypeError` for what does not fit. */
export function payloadOf({ name, fields }, given) {
  const names = fields.map((field) => field.name);
  if (Object.keys(given).sort().join("\n") !== [...names].sort().join("\n")) {
    const takes = names.map((each) => `\`${each}\``).join(", ") || "no values";
    throw Object.assign(new TypeError(`the event \`${name}\` takes ${takes}`), { help: "give each once" });
  }
  return fields.map((field) => {
    try {
      return fromJson(given[field.name], field.type);
    } catch (error) {
      throw new TypeError(`\`${field.name}\` of \`${name}\` ${error.message}`);
    }
  });
}
